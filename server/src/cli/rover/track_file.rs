//! The track as the file that its name asks for.

use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use lodestep_engine::gnss::solution::{Solution, nmea, pos};
use lodestep_engine::systems::rover::row::{HEADER, Row};

use crate::cli::failure::Failure;
use crate::cli::output_file;

/// Writes rows as CSV, as RTKLIB's `.pos` or as NMEA.
pub(super) fn write(path: &Path, rows: &[Row]) -> Result<()> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match &ending[..] {
        "pos" => {
            let solutions = solutions(path, rows)?;
            output_file::write(path, |out| pos::write(solutions, out))
        }
        "nmea" => {
            let solutions = solutions(path, rows)?;
            output_file::write(path, |out| nmea::write(solutions, out))
        }
        _ => output_file::write(path, |out| {
            let mut text = String::with_capacity(170 * (rows.len() + 1));
            text.push_str(HEADER);
            rows.iter().for_each(|row| row.write(&mut text));
            out.write_all(text.as_bytes())
        }),
    }
}

fn solutions(path: &Path, rows: &[Row]) -> Result<Vec<Solution>> {
    let solutions: Vec<Solution> = rows.iter().filter_map(Row::solution).collect();
    if solutions.is_empty() {
        return Err(Failure::bad_input(
            path,
            "expected satellites, for .pos and .nmea hold places on the Earth; found ranges alone: name a .csv",
        ));
    }
    Ok(solutions)
}
