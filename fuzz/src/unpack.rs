//! Packed logs: never more out than the limits allow, and every end is the true one or an error.

use lodestep_server::sessions::unpack::{Unpack, UnpackError, UnpackLimits};

/// What a log may unpack to here.
const MOST_BYTES: u64 = 48 << 10;

/// The first byte says in which pieces the rest is read.
pub(crate) fn run(bytes: &[u8]) {
    let Some((piece, packed)) = bytes.split_first() else { return };
    let limits = UnpackLimits { max_unpacked_bytes: MOST_BYTES, max_ratio: 200 };
    match all(packed, limits, 64 + 64 * usize::from(*piece)) {
        Ok(plain) => {
            let again = all(packed, limits, 8 << 10).expect("what was unpacked once is unpacked again");
            assert!(plain == again, "the pieces changed the log");
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.len() < 500 && !text.chars().any(char::is_control), "{text}");
        }
    }
}

fn all(packed: &[u8], limits: UnpackLimits, piece: usize) -> Result<Vec<u8>, UnpackError> {
    let mut unpack = Unpack::new(packed, limits)?;
    let (mut plain, mut buffer) = (Vec::new(), vec![0; piece]);
    loop {
        match unpack.read(&mut buffer)? {
            0 => return Ok(plain),
            n => plain.extend_from_slice(&buffer[..n]),
        }
        assert!(plain.len() as u64 <= MOST_BYTES, "{} bytes came through", plain.len());
    }
}
