//! The rover's files: unpacked where they are packed, and read. A file that was cut off within its packing is read as far as it goes.

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

use anyhow::Result;
use flate2::bufread::MultiGzDecoder;
use lodestep_engine::gnss::ephemeris::Navigation;
use lodestep_engine::gnss::observations::Observations;
use lodestep_engine::gnss::{navigation_reader, observation_reader};
use lodestep_engine::parse::{anchors_csv, ranges_csv};
use lodestep_engine::sample::{SurveyedAnchor, TagRanges};
use lodestep_engine::systems::rover::instrument::Instrument;

use crate::cli::failure::Failure;

/// The bytes of a file, and a sentence where its packing ends too early.
fn unpacked(path: &Path) -> Result<(Vec<u8>, Option<String>)> {
    let packed =
        fs::read(path).map_err(|error| Failure::bad_input(path, format!("cannot be read: {error}")))?;
    if !packed.starts_with(&[0x1f, 0x8b]) {
        return Ok((packed, None));
    }
    let mut bytes = Vec::with_capacity(8 * packed.len());
    match MultiGzDecoder::new(packed.as_slice()).read_to_end(&mut bytes) {
        Ok(_) => Ok((bytes, None)),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof && !bytes.is_empty() => {
            let sentence = format!("{}: the packed file is cut off; what is there is used", path.display());
            Ok((bytes, Some(sentence)))
        }
        Err(error) => Err(Failure::bad_input(path, format!("cannot be unpacked: {error}; copy it again"))),
    }
}

/// A name in front of each sentence.
fn named(path: &Path, notes: &[String]) -> Vec<String> {
    notes.iter().map(|note| format!("{}: {note}", path.display())).collect()
}

/// A file of observations.
pub(super) fn observations(path: &Path, anomalies: &mut Vec<String>) -> Result<Observations> {
    let (bytes, cut) = unpacked(path)?;
    let file = observation_reader::read(&bytes).map_err(|error| Failure::bad_input(path, error))?;
    anomalies.extend(cut);
    anomalies.extend(named(path, &file.notes));
    Ok(file)
}

/// All navigation files as one.
pub(super) fn navigation(paths: &[impl AsRef<Path>], anomalies: &mut Vec<String>) -> Result<Navigation> {
    let mut all = Navigation::default();
    for path in paths {
        let path = path.as_ref();
        let (bytes, cut) = unpacked(path)?;
        let file = navigation_reader::read(&bytes).map_err(|error| Failure::bad_input(path, error))?;
        anomalies.extend(cut);
        anomalies.extend(named(path, &file.notes));
        all.append(file);
    }
    // As a session takes them.
    all.in_order_of_time();
    Ok(all)
}

/// A file of ranges.
pub(super) fn ranges(path: &Path, anomalies: &mut Vec<String>) -> Result<TagRanges> {
    let (bytes, cut) = unpacked(path)?;
    let file = ranges_csv::read(&bytes).map_err(|error| Failure::bad_input(path, error))?;
    anomalies.extend(cut);
    anomalies.extend(named(path, &file.notes));
    Ok(file)
}

/// The anchors.
pub(super) fn anchors(path: &Path) -> Result<Vec<SurveyedAnchor>> {
    let (bytes, _) = unpacked(path)?;
    anchors_csv::read(&bytes).map_err(|error| Failure::bad_input(path, error))
}

/// What is known of the instruments.
pub(super) fn instrument(path: Option<&Path>) -> Result<Instrument> {
    let Some(path) = path else { return Ok(Instrument::default()) };
    let (bytes, _) = unpacked(path)?;
    let text = String::from_utf8(bytes).map_err(|_| Failure::bad_input(path, "expected text in UTF-8"))?;
    Instrument::from_toml(&text).map_err(|error| Failure::bad_input(path, error))
}
