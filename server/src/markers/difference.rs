//! The exact difference that a file makes to the table.

use std::collections::{HashMap, HashSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::Row;
use super::write::MarkerEdit;
use crate::store::marker_imports::Counts;
use crate::store::markers::Place;

/// One marker that the file changes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MarkerDifference")]
pub(crate) struct Difference {
    /// What becomes of it.
    pub(crate) change: Change,
    /// What it is, and what it becomes.
    #[serde(flatten)]
    pub(crate) step: MarkerEdit,
    /// The line of the file; `None` where the file lacks it.
    pub(crate) line: Option<u64>,
    /// How far it moves in plan, m; `None` where it is added or removed.
    pub(crate) moved_m: Option<f64>,
    /// By how much it rises, m; `None` where one of the two heights is not known.
    pub(crate) raised_m: Option<f64>,
    /// How sure the file says the new place is, east, north and up, m; `None` where it does not say.
    #[serde(default)]
    pub(crate) sigma_m: Option<[f64; 3]>,
}

/// What becomes of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "MarkerDifferenceKind")]
pub(crate) enum Change {
    /// It is not there yet.
    Added,
    /// It stands elsewhere.
    Changed,
    /// The file, which is the whole table, lacks it.
    Removed,
}

/// The difference of rows to the table, the farthest moves first, then what is added and removed, by name.
pub(super) fn difference(
    rows: &[Row],
    standing: &HashMap<String, Place>,
    whole_table: bool,
) -> (Vec<Difference>, Counts) {
    let mut counts = Counts::default();
    let mut differences = Vec::new();
    for row in rows {
        let before = standing.get(&row.name).copied();
        // An empty height leaves the height alone.
        let after = Place { u_m: row.place.u_m.or(before.and_then(|before| before.u_m)), ..row.place };
        let change = match before {
            None => Change::Added,
            Some(before) if before == after => {
                counts.unchanged += 1;
                continue;
            }
            Some(_) => Change::Changed,
        };
        differences.push(Difference {
            change,
            line: Some(row.line),
            moved_m: before.map(|before| before.plan_distance_m(&after)),
            raised_m: before.and_then(|before| Some(after.u_m? - before.u_m?)),
            sigma_m: row.sigma_m,
            step: MarkerEdit { name: row.name.clone(), before, after: Some(after) },
        });
    }
    if whole_table {
        let named: HashSet<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        for (name, place) in standing.iter().filter(|(name, _)| !named.contains(name.as_str())) {
            differences.push(Difference {
                change: Change::Removed,
                line: None,
                moved_m: None,
                raised_m: None,
                sigma_m: None,
                step: MarkerEdit { name: name.clone(), before: Some(*place), after: None },
            });
        }
    }
    for difference in &differences {
        match difference.change {
            Change::Added => counts.added += 1,
            Change::Changed => counts.changed += 1,
            Change::Removed => counts.removed += 1,
        }
    }
    let size = |difference: &Difference| {
        difference.moved_m.map_or(-1.0, |moved| moved.hypot(difference.raised_m.unwrap_or_default()))
    };
    differences.sort_by(|a, b| {
        size(b)
            .total_cmp(&size(a))
            .then_with(|| (a.change as u8).cmp(&(b.change as u8)))
            .then_with(|| a.step.name.cmp(&b.step.name))
    });
    (differences, counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(e_m: f64, u_m: Option<f64>) -> Place {
        Place { e_m, n_m: 0.0, u_m }
    }

    #[test]
    fn what_is_added_changed_removed_and_unchanged_is_told_exactly() {
        let standing: HashMap<_, _> = [
            ("same", place(1.0, Some(5.0))),
            ("moved", place(2.0, Some(5.0))),
            ("raised", place(3.0, Some(5.0))),
            ("gone", place(4.0, None)),
        ]
        .map(|(name, place)| (name.to_owned(), place))
        .into();
        let row = |line, name: &str, place| Row { line, name: name.to_owned(), place, sigma_m: None };
        let rows = [
            row(2, "same", place(1.0, None)),
            row(3, "moved", place(2.25, Some(5.0))),
            row(4, "raised", place(3.0, Some(5.5))),
            row(5, "new", place(9.0, None)),
        ];
        let (told, counts) = difference(&rows, &standing, true);
        assert_eq!(counts, Counts { added: 1, changed: 2, removed: 1, unchanged: 1 });
        let names: Vec<_> = told.iter().map(|difference| difference.step.name.as_str()).collect();
        assert_eq!(names, ["raised", "moved", "new", "gone"]);
        assert_eq!((told[1].moved_m, told[0].raised_m), (Some(0.25), Some(0.5)));
        assert_eq!(difference(&rows, &standing, false).1.removed, 0);
    }
}
