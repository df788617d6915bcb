//! A file of markers by one request, for programs: taken whole or not at all, and undone like any other.

use std::collections::HashMap;

use lodestep_engine::parse::{any_table, markers_csv};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::difference::difference;
use super::finding::Findings;
use super::imports::{apply_at_once, new_row};
use super::plan::Plan;
use super::rows::Row;
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::markers;

/// How often it is compared anew with a table that others change meanwhile.
const MOST_TRIES: u32 = 5;

/// What a file changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Imported {
    /// Markers that were not there.
    pub(crate) added: u64,
    /// Markers that moved.
    pub(crate) changed: u64,
    /// Markers that stood there already.
    pub(crate) unchanged: u64,
}

/// Reads a file (UTF-8 or GBK) and puts its markers into the table, at once for whoever looks. Markers that the
/// file does not name stay. One that changes nothing leaves no trace.
pub(crate) async fn import(app: &App, caller: Caller, file: Vec<u8>) -> Result<Imported> {
    let frame = app.site.local_frame();
    let read = markers_csv::read(&file)?;
    let table = any_table::read(&file)?;
    let rows: Vec<Row> = read
        .into_iter()
        .zip(&table.rows)
        .map(|(row, as_is)| {
            let (e_m, n_m, u_m) = row.place.to_local_m(&frame);
            Row { line: as_is.line, name: row.name, place: markers::Place { e_m, n_m, u_m } }
        })
        .collect();
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
