//! The canonical log: however it is cut the same samples come out, and written they are read again.

use lodestep_engine::parse::{ImuCsv, ParseError, imu_csv};
use lodestep_engine::sample::ImuSample;

use crate::{samples, sentence};

/// The first byte says where the file, which is the rest, is cut.
pub(crate) fn run(bytes: &[u8]) {
    let Some((cut, file)) = bytes.split_first() else { return };
    let (whole, whole_end) = read(file, file.len().max(1));
    let (pieces, pieces_end) = read(file, 1 + usize::from(*cut));
    samples::assert_same(&whole, &pieces);
    assert_eq!(whole_end, pieces_end);
    // Each sample takes a line of thirteen bytes at least, below a header.
    assert!(whole.len() * 13 <= file.len(), "{} samples of {} bytes", whole.len(), file.len());
    match whole_end {
        Err(error) => sentence::check(&error, file),
        Ok(()) => {
            let mut text = String::new();
            imu_csv::write(&whole, true, &mut text);
            let (again, end) = read(text.as_bytes(), text.len());
            assert_eq!(end, Ok(()), "what was written is not read: {text}");
            samples::assert_same(&whole, &again);
        }
    }
}

fn read(file: &[u8], piece: usize) -> (Vec<ImuSample>, Result<(), ParseError>) {
    let (mut parser, mut samples) = (ImuCsv::new(), Vec::new());
    let pushed = file.chunks(piece).try_for_each(|bytes| parser.push(bytes, &mut samples));
    let end = pushed.and_then(|()| parser.finish(&mut samples));
    assert_eq!(parser.samples(), samples.len() as u64);
    let _ = parser.ignored_columns();
    (samples, end)
}
