//! A file of markers by one request, for programs: taken whole or not at all, and undone like any other.

use std::collections::HashMap;

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::any_table::AnyTable;
use lodestep_engine::parse::{ParseError, any_table, markers_csv};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::difference::difference;
use super::finding::{Findings, Level};
use super::imports::{apply_at_once, new_row};
use super::mapping::Mapping;
use super::plan::Plan;
use super::rows::{Row, rows};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::markers;

/// How often it is compared anew with a table that others change meanwhile.
const MOST_TRIES: u32 = 5;

/// What a file changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "ImportedMarkers")]
pub(crate) struct Imported {
    /// Markers that were not there.
    pub(crate) added: u64,
    /// Markers that moved.
    pub(crate) changed: u64,
    /// Markers that stood there already.
    pub(crate) unchanged: u64,
}

/// The markers of a file of our own columns, or of any that says as clearly what it means.
fn rows_of(file: &[u8], table: &AnyTable, frame: &LocalFrame) -> std::result::Result<Vec<Row>, ParseError> {
    let strict = match markers_csv::read(file) {
        Ok(read) => {
            let lines = table.rows.iter().map(|row| row.line);
            let rows = read.into_iter().zip(lines).map(|(row, line)| {
                let (e_m, n_m, u_m) = row.place.to_local_m(frame);
                Row { line, name: row.name, place: markers::Place { e_m, n_m, u_m }, sigma_m: None }
            });
            return Ok(rows.collect());
        }
        Err(error) => error,
    };
    places(table, frame).ok_or(strict)
}

/// The markers of a table whose columns are known by their names; `None` where anything about it is odd, for nobody is
/// asked here.
fn places(table: &AnyTable, frame: &LocalFrame) -> Option<Vec<Row>> {
    let mapping = Mapping::guess(&table.columns)?;
    let mut findings = Findings::default();
    let read = rows(table, mapping, frame, &mut findings);
    (!findings.has(Level::Error) && !findings.has(Level::Warning)).then_some(read)
}

/// East, north and up of the site, m; up is `None` where the file does not tell.
type Place = (f64, f64, Option<f64>);

/// The places of a file's markers by their names, as the command line takes them: east, north and up of the site, m.
/// Without a site only files in its own frame can be read.
pub(crate) fn places_of_file(
    file: &[u8],
    frame: Option<&LocalFrame>,
) -> std::result::Result<HashMap<String, Place>, ParseError> {
    let table = any_table::read(file)?;
    let Some(frame) = frame else {
        let local = markers_csv::read(file)?;
        let place = |row: markers_csv::MarkerRow| match row.place {
            markers_csv::MarkerPlace::Local { e_m, n_m, u_m } => Some((row.name, (e_m, n_m, u_m))),
            markers_csv::MarkerPlace::Geodetic { .. } => None,
        };
        return Ok(local.into_iter().filter_map(place).collect());
    };
    let rows = rows_of(file, &table, frame)?;
    Ok(rows.into_iter().map(|row| (row.name, (row.place.e_m, row.place.n_m, row.place.u_m))).collect())
}

/// Reads a file and puts its markers into the table, at once for every reader. Markers that the
/// file does not name stay. One that changes nothing leaves no trace.
pub(crate) async fn import(app: &App, caller: Caller, file: Vec<u8>) -> Result<Imported> {
    let frame = app.site.local_frame();
    let table = any_table::read(&file)?;
    let rows = rows_of(&file, &table, &frame)?;
    let _turn = app.import_turns.lock().await;
    let mut tries = 0;
    loop {
        // The revision first: a change in between is seen at the end, and then it is compared anew.
        let compared = markers::revision(app.store.read()).await?;
        let standing: HashMap<_, _> = markers::list(app.store.read())
            .await?
            .into_iter()
            .map(|marker| (marker.name.clone(), marker.place()))
            .collect();
        let (differences, counts) = difference(&rows, &standing, false);
        let imported = Imported { added: counts.added, changed: counts.changed, unchanged: counts.unchanged };
        if differences.is_empty() {
            return Ok(imported);
        }
        let plan = Plan {
            encoding: table.encoding.to_owned(),
            columns: table.columns.clone(),
            sample: Vec::new(),
            rows: rows.len() as u64,
            mapping: None,
            findings: Findings::default(),
            differences,
        };
        let row = new_row(false, counts, compared);
        match apply_at_once(app, caller.clone(), file.clone(), plan, row).await {
            Ok(_) => return Ok(imported),
            Err(Error::Conflict { code: "table_moved_on", .. }) if tries < MOST_TRIES => tries += 1,
            Err(error) => return Err(error),
        }
    }
}
