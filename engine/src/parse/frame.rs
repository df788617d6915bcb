//! The binary device frame: little-endian, 16 bytes of header, then 88 bytes a sample, as
//! `docs/wire.md` lays it out. Any microcontroller can write it with a `memcpy`.

use crate::parse::batch::{self, Batch};
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::sample::Foot;

const MAGIC: [u8; 2] = *b"LS";
const VERSION: u8 = 1;
const HEADER_BYTES: usize = 16;
const SAMPLE_BYTES: usize = 88;

/// The length of the longest frame, bytes.
pub const MOST_BYTES: usize = HEADER_BYTES + SAMPLE_BYTES * Batch::MOST_SAMPLES;

/// Appends a batch to `out` as one frame.
///
/// # Errors
///
/// When the batch holds no sample or more than [`Batch::MOST_SAMPLES`].
pub fn encode(batch: &Batch, out: &mut Vec<u8>) -> Result<(), ParseError> {
    batch::check_size(batch.samples.len())?;
    let n = u16::try_from(batch.samples.len()).expect("check_size allows at most 1,000");
    out.reserve(HEADER_BYTES + SAMPLE_BYTES * batch.samples.len());
    out.extend_from_slice(&MAGIC);
    out.push(VERSION);
    out.push(u8::from(batch.foot == Foot::Right));
    out.extend_from_slice(&batch.sequence.to_le_bytes());
    out.extend_from_slice(&n.to_le_bytes());
    out.extend_from_slice(&[0, 0]);
    for sample in &batch.samples {
        out.extend_from_slice(&sample.t_ns.to_le_bytes());
        for value in batch::channels(sample) {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
    Ok(())
}

/// How long the frame is that `bytes` begin with, by its header, bytes: where frames stand one after the other.
///
/// # Errors
///
/// When there is no header of a frame of this version.
pub fn length(bytes: &[u8]) -> Result<usize, ParseError> {
    let (header, _) = header(bytes)?;
    let n = usize::from(u16::from_le_bytes([header[12], header[13]]));
    batch::check_size(n)?;
    Ok(HEADER_BYTES + SAMPLE_BYTES * n)
}

/// Reads one frame, which must be exactly as long as its header says.
///
/// # Errors
///
/// When the header is not that of a frame of this version, or the length does not fit it.
pub fn decode(bytes: &[u8]) -> Result<Batch, ParseError> {
    let (header, body) = header(bytes)?;
    let foot = match header[3] {
        0 => Foot::Left,
        1 => Foot::Right,
        other => return Err(wrong_header("0 (left) or 1 (right) in byte 3", format!("{other}"))),
    };
    if header[14..] != [0, 0] {
        return Err(wrong_header(
            "zeros in bytes 14 and 15",
            format!("{:02X} {:02X}", header[14], header[15]),
        ));
    }
    let n = usize::from(u16::from_le_bytes([header[12], header[13]]));
    batch::check_size(n)?;
    if body.len() != SAMPLE_BYTES * n {
        return Err(ParseError::new(
            ParseErrorKind::FrameLength,
            format!("{} bytes, for {n} samples", HEADER_BYTES + SAMPLE_BYTES * n),
            format!("{} bytes", bytes.len()),
            "send 16 + 88·n bytes, with n in bytes 12 and 13",
        ));
    }
    let (samples, _) = body.as_chunks::<SAMPLE_BYTES>();
    let samples = samples
        .iter()
        .map(|bytes| {
            let (words, _) = bytes.as_chunks::<8>();
            let mut channels = [0.0; 10];
            for (channel, word) in channels.iter_mut().zip(&words[1..]) {
                *channel = f64::from_le_bytes(*word);
            }
            batch::sample(i64::from_le_bytes(words[0]), channels)
        })
        .collect();
    let mut sequence = [0; 8];
    sequence.copy_from_slice(&header[4..12]);
    Ok(Batch { foot, sequence: u64::from_le_bytes(sequence), samples })
}

/// The header of a frame of this version, and what follows it.
fn header(bytes: &[u8]) -> Result<(&[u8; HEADER_BYTES], &[u8]), ParseError> {
    let Some((header, body)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(ParseError::new(
            ParseErrorKind::FrameLength,
            format!("a frame of at least {} bytes", HEADER_BYTES + SAMPLE_BYTES),
            format!("{} bytes", bytes.len()),
            "send each frame whole, as one binary message",
        ));
    };
    if header[..2] != MAGIC {
        return Err(wrong_header(
            "the bytes 4C 53 at the start",
            format!("{:02X} {:02X}", header[0], header[1]),
        ));
    }
    if header[2] != VERSION {
        return Err(wrong_header("version 1 in byte 2", format!("{}", header[2])));
    }
    Ok((header, body))
}

fn wrong_header(expected: &str, found: String) -> ParseError {
    ParseError::new(
        ParseErrorKind::FrameHeader,
        expected,
        found,
        "build the frame as the device protocol lays it out: \"LS\", version 1, foot, sequence, count, 0, 0",
    )
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sample::ImuSample;

    fn finite() -> impl Strategy<Value = f64> {
        prop::num::f64::ANY.prop_filter("missing values are told apart by NaN", |x| !x.is_nan())
    }

    prop_compose! {
        fn any_sample()(
            t_ns in any::<i64>(),
            w_ib_b_rad_s in prop::array::uniform3(finite()),
            f_b_m_s2 in prop::array::uniform3(finite()),
            mag_b_ut in prop::option::of(prop::array::uniform3(finite())),
            pressure_hpa in prop::option::of(finite()),
        ) -> ImuSample {
            ImuSample { t_ns, w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa }
        }
    }

    fn one_sample() -> Batch {
        let sample = ImuSample {
            t_ns: 5,
            w_ib_b_rad_s: [0.1, 0.2, 0.3],
            f_b_m_s2: [0.0, 0.0, 9.8],
            mag_b_ut: None,
            pressure_hpa: Some(900.0),
        };
        Batch { foot: Foot::Right, sequence: 7, samples: vec![sample] }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(
            right in any::<bool>(),
            sequence in any::<u64>(),
            samples in prop::collection::vec(any_sample(), 1..20),
        ) {
            let foot = if right { Foot::Right } else { Foot::Left };
            let batch = Batch { foot, sequence, samples };
            let mut bytes = Vec::new();
            encode(&batch, &mut bytes).unwrap();
            prop_assert_eq!(bytes.len(), 16 + 88 * batch.samples.len());
            prop_assert_eq!(decode(&bytes).unwrap(), batch);
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = decode(&bytes);
        }

        #[test]
        fn a_damaged_header_never_panics(at in 0_usize..16, value in any::<u8>()) {
            let mut bytes = Vec::new();
            encode(&one_sample(), &mut bytes).unwrap();
            bytes[at] = value;
            let _ = decode(&bytes);
        }
    }

    #[test]
    fn a_frame_is_exactly_as_long_as_it_says() {
        let mut bytes = Vec::new();
        encode(&one_sample(), &mut bytes).unwrap();
        assert_eq!(decode(&bytes[..bytes.len() - 1]).unwrap_err().code(), "frame_length");
        bytes.push(0);
        let error = decode(&bytes).unwrap_err();
        assert_eq!(
            error.to_string(),
            "expected 104 bytes, for 1 samples, found 105 bytes; send 16 + 88·n bytes, with n in bytes 12 and 13"
        );
        assert_eq!(decode(b"LS").unwrap_err().code(), "frame_length");
    }

    #[test]
    fn a_wrong_header_is_named() {
        let mut good = Vec::new();
        encode(&one_sample(), &mut good).unwrap();
        for (at, code) in
            [(0, "frame_header"), (2, "frame_header"), (3, "frame_header"), (15, "frame_header")]
        {
            let mut bytes = good.clone();
            bytes[at] = 9;
            assert_eq!(decode(&bytes).unwrap_err().code(), code, "byte {at}");
        }
        let mut bytes = good.clone();
        bytes[12] = 0;
        assert_eq!(decode(&bytes).unwrap_err().code(), "batch_size");
        bytes[12..14].copy_from_slice(&1001_u16.to_le_bytes());
        assert_eq!(decode(&bytes).unwrap_err().code(), "batch_size");
    }

    #[test]
    fn a_magnetometer_without_one_axis_says_nothing() {
        let mut bytes = Vec::new();
        let mut batch = one_sample();
        batch.samples[0].mag_b_ut = Some([1.0, 2.0, f64::NAN]);
        batch.samples[0].w_ib_b_rad_s[0] = f64::NAN;
        encode(&batch, &mut bytes).unwrap();
        let read = decode(&bytes).unwrap();
        assert_eq!(read.samples[0].mag_b_ut, None);
        assert!(read.samples[0].w_ib_b_rad_s[0].is_nan());
    }
}
