//! The visits of a walk, each with the place of its marker.

use std::path::Path;

use anyhow::Result;
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::{markers_csv, visits_csv};
use lodestep_engine::session::Visit;

use crate::cli::failure::Failure;
use crate::cli::log_file::read_small;
use crate::markers::places_of_file;

/// Reads markers and visits; the visits come in the order of their starts.
pub(super) fn read(markers_path: &Path, visits_path: &Path, frame: Option<LocalFrame>) -> Result<Vec<Visit>> {
    let file = read_small(markers_path)?;
    let places =
        places_of_file(&file, frame.as_ref()).map_err(|error| Failure::bad_input(markers_path, error))?;
    if places.is_empty() && frame.is_none() && markers_csv::read(&file).is_ok_and(|rows| !rows.is_empty()) {
        return Err(Failure::usage(format!(
            "{} gives latitudes and longitudes: add --site SITE.toml, whose origin they are measured from",
            markers_path.display()
        )));
    }
    let rows = visits_csv::read(&read_small(visits_path)?)
        .map_err(|error| Failure::bad_input(visits_path, error))?;
    let mut visits = Vec::with_capacity(rows.len());
    for row in rows {
        let Some(&position_n_m) = places.get(&row.marker) else {
            return Err(Failure::bad_input(
                visits_path,
                format!(
                    "expected the name of a marker in {}, found {:?}; correct the name or add the marker",
                    markers_path.display(),
                    row.marker
                ),
            ));
        };
        let (t_start_ns, t_end_ns) = (row.t_start_ns, row.t_end_ns);
        visits.push(Visit { marker: row.marker, t_start_ns, t_end_ns, position_n_m });
    }
    visits.sort_by_key(|visit| visit.t_start_ns);
    Ok(visits)
}
