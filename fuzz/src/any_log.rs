//! A log of any maker, recognised by its first bytes: no more samples than bytes, whatever it is cut into.

use lodestep_engine::parse::log_survey::LogSurvey;
use lodestep_engine::parse::{LogReader, ParseError, ReadOptions};
use lodestep_engine::sample::ImuSample;

use crate::{samples, sentence};

/// The first byte says where the file is cut, the second what is said of it; the rest is the file.
pub(crate) fn run(bytes: &[u8]) {
    let [cut, said, file @ ..] = bytes else { return };
    let reading = ReadOptions {
        mapping: None,
        rate_hz: [None, Some(100.0), Some(0.0), Some(12_345.6)][usize::from(said & 3)],
        field_ut_per_count: [None, Some(0.15), Some(-1.0), Some(1e9)][usize::from(said >> 2 & 3)],
        clock_zero_ns: [None, Some(0), Some(i64::MIN), Some(1_700_000_000_000_000_000)]
            [usize::from(said >> 4 & 3)],
    };
    check(&reading, file, 1 + usize::from(*cut));
}

/// Reads a log whole and in pieces, and holds what came out against what went in.
pub(crate) fn check(reading: &ReadOptions, file: &[u8], piece: usize) {
    let (whole, whole_end) = read(reading, file, file.len().max(1));
    let (pieces, pieces_end) = read(reading, file, piece);
    samples::assert_same(&whole, &pieces);
    assert_eq!(whole_end, pieces_end);
    // Twelve fields and delimiters, or two packets of eleven bytes.
    assert!(whole.len() * 12 <= file.len(), "{} samples of {} bytes", whole.len(), file.len());
    if let Err(error) = whole_end {
        sentence::check(&error, file);
    }
    let mut survey = LogSurvey::default();
    whole.iter().for_each(|sample| survey.take(sample.into()));
    let survey = survey.finish();
    assert_eq!(survey.samples, whole.len() as u64);
    assert!(survey.still_s >= 0.0 && survey.duration_s >= 0.0, "{survey:?}");
    assert!((0.0..=1.0).contains(&survey.field_share) && (0.0..=1.0).contains(&survey.pressure_share));
}

fn read(reading: &ReadOptions, file: &[u8], piece: usize) -> (Vec<ImuSample>, Result<(), ParseError>) {
    let (mut reader, mut samples) = (LogReader::new(reading.clone()), Vec::new());
    let pushed = file.chunks(piece).try_for_each(|bytes| reader.push(bytes, &mut samples));
    let end = pushed.and_then(|()| reader.finish(&mut samples));
    assert_eq!(reader.samples(), samples.len() as u64);
    assert_eq!(reader.clock_ns().is_some(), !samples.is_empty());
    if let Some(table) = reader.table() {
        assert!(table.rows.len() <= 8 && table.columns.len() <= 256, "{table:?}");
    }
    (samples, end)
}
