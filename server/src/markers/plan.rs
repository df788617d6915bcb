//! What a file would do to the table: read by a mapping, checked, compared.

use std::collections::HashMap;

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::any_table::AnyTable;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::checks::check;
use super::defect::Defect;
use super::difference::{Difference, difference};
use super::finding::{Findings, Level};
use super::mapping::Mapping;
use super::rows::rows;
use crate::site;
use crate::store::marker_imports::Counts;
use crate::store::markers::{Marker, Place};

/// Rows that are shown where the columns are chosen.
const SAMPLE_ROWS: usize = 5;

/// What a file would do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "ImportPlan")]
pub(crate) struct Plan {
    /// How its text is written: `UTF-8` or `GBK`.
    #[schemars(example = &"UTF-8")]
    pub(crate) encoding: String,
    /// The names of its columns.
    #[schemars(example = ["name", "e_m", "n_m", "u_m"])]
    pub(crate) columns: Vec<String>,
    /// Its first rows, cell by cell.
    #[schemars(example = [["A17", "1.0", "2.0", "3.0"]])]
    pub(crate) sample: Vec<Vec<String>>,
    /// How many rows it has.
    pub(crate) rows: u64,
    /// Which column is what; `None`: the names do not tell, somebody has to.
    pub(crate) mapping: Option<Mapping>,
    /// What is odd.
    #[serde(flatten)]
    pub(crate) findings: Findings,
    /// What it would change.
    pub(crate) differences: Vec<Difference>,
}

/// Makes the plan of a file against the markers that stand.
pub(super) fn plan(
    table: &AnyTable,
    mapping: Option<Mapping>,
    whole_table: bool,
    standing: &[Marker],
    frame: &LocalFrame,
    site_plan: &site::Plan,
) -> (Plan, Counts) {
    let mut findings = Findings::default();
    let mut compared = (Vec::new(), Counts::default());
    let mapping = mapping.or_else(|| Mapping::guess(&table.columns));
    match mapping {
        None => findings.of_file(Level::Error, &Defect::ColumnsUnknown, None),
        Some(mapping) => {
            let standing: HashMap<String, Place> =
                standing.iter().map(|marker| (marker.name.clone(), marker.place())).collect();
            let read = rows(table, mapping, frame, &mut findings);
            check(&read, mapping, &standing, site_plan, &mut findings);
            compared = difference(&read, &standing, whole_table);
            let removed = compared.1.removed;
            if removed > 0 && !findings.has(Level::Error) {
                findings.of_file(Level::Warning, &Defect::Removes { missing: removed }, None);
            }
        }
    }
    // Of a file that cannot be applied the rows that can be read would show half a difference.
    if findings.has(Level::Error) {
        compared = (Vec::new(), Counts::default());
    }
    let (differences, counts) = compared;
    let sample = table.rows.iter().take(SAMPLE_ROWS).map(|row| row.cells.clone()).collect();
    let plan = Plan {
        encoding: table.encoding.to_owned(),
        columns: table.columns.clone(),
        sample,
        rows: table.rows.len() as u64,
        mapping,
        findings,
        differences,
    };
    (plan, counts)
}
