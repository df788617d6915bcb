//! Small tables: markers, visits, truth, and those of unknown columns.

use lodestep_engine::parse::markers_csv::{self, MarkerPlace};
use lodestep_engine::parse::{any_table, truth_csv, visits_csv};

use crate::sentence;

/// The first byte says what the rest is taken for.
pub(crate) fn run(bytes: &[u8]) {
    let Some((kind, file)) = bytes.split_first() else { return };
    // A carriage return ends a row as a line feed does.
    let lines = file.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    let rows = match kind % 4 {
        0 => markers(file),
        1 => visits(file),
        2 => truth_csv::read(file).map(|places| {
            assert!(places.iter().flat_map(|place| place.position_m).all(f64::is_finite));
            places.len()
        }),
        _ => any_table::read(file).map(|table| {
            assert!(table.rows.iter().all(|row| row.cells.len() == table.columns.len()));
            // Lines are counted by line feeds; a carriage return ends a row, too.
            assert!(table.rows.windows(2).all(|rows| rows[0].line <= rows[1].line));
            table.rows.len()
        }),
    };
    match rows {
        Ok(rows) => assert!(rows <= lines, "{rows} rows below a header in {lines} lines"),
        Err(error) => sentence::check(&error, file),
    }
}

fn markers(file: &[u8]) -> Result<usize, lodestep_engine::parse::ParseError> {
    let markers = markers_csv::read(file)?;
    let local = markers.iter().filter_map(|marker| match marker.place {
        MarkerPlace::Local { e_m, n_m, u_m } => Some((marker.name.as_str(), e_m, n_m, u_m)),
        MarkerPlace::Geodetic { .. } => None,
    });
    let local: Vec<_> = local.collect();
    let text = markers_csv::write(local.iter().copied());
    let again = markers_csv::read(text.as_bytes()).expect("markers that were written are read");
    assert_eq!(again.len(), local.len(), "{text}");
    for (again, (name, e_m, n_m, u_m)) in again.iter().zip(local) {
        assert_eq!(
            (again.name.as_str(), again.place),
            (name, MarkerPlace::Local { e_m, n_m, u_m }),
            "{text}"
        );
    }
    Ok(markers.len())
}

fn visits(file: &[u8]) -> Result<usize, lodestep_engine::parse::ParseError> {
    let visits = visits_csv::read(file)?;
    assert!(visits.iter().all(|visit| visit.t_start_ns <= visit.t_end_ns));
    let text = visits_csv::write(&visits);
    let again = visits_csv::read(text.as_bytes()).expect("visits that were written are read");
    assert_eq!(again, visits, "{text}");
    Ok(visits.len())
}
