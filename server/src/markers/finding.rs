//! What is odd about a file of markers, told before it is applied.

use std::collections::BTreeMap;

use lodestep_engine::figures::Figures;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defect::Defect;
use super::mapping::Mapping;

/// Findings of one kind that are told one by one; of more, only the number.
const MOST_OF_A_KIND: usize = 50;

/// One thing that is odd.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "MarkerFinding")]
pub(crate) struct Finding {
    /// One word for programs and for the page's own words.
    #[schemars(example = &"far_move")]
    pub(crate) code: String,
    /// Whether the file can be applied all the same.
    pub(crate) level: Level,
    /// The line of the file, where it is about one.
    pub(crate) line: Option<u64>,
    /// The marker, where it is about one.
    #[schemars(example = &"A17")]
    pub(crate) marker: Option<String>,
    /// Expected, found, what to do.
    #[schemars(example = &"A17 moves by 12.4 m: is this the same marker?")]
    pub(crate) detail: String,
    /// The figures and names of that sentence; `None` in a plan that was stored before they were kept.
    #[serde(default)]
    #[schemars(with = "Option<BTreeMap<String, serde_json::Value>>")]
    pub(crate) figures: Option<Figures>,
    /// The mapping that would make it right, where one would.
    pub(crate) suggested: Option<Mapping>,
}

impl Finding {
    fn of(level: Level, odd: &Defect) -> Finding {
        Finding {
            code: odd.code().to_owned(),
            level,
            line: None,
            marker: None,
            detail: odd.sentence(),
            figures: Some(odd.figures()),
            suggested: None,
        }
    }
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "MarkerFindingLevel")]
pub(crate) enum Level {
    /// Nothing of the file can be applied.
    Error,
    /// It can be applied by a surveyor who has seen this and knows better.
    Warning,
}

/// All findings of a file, of each kind the first ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Findings {
    /// One by one.
    pub(crate) findings: Vec<Finding>,
    /// How many of each kind there are, those that are not told one by one included.
    pub(crate) finding_counts: BTreeMap<String, u64>,
}

impl Findings {
    /// Adds one about the whole file.
    pub(super) fn of_file(&mut self, level: Level, odd: &Defect, suggested: Option<Mapping>) {
        self.push(Finding { suggested, ..Finding::of(level, odd) });
    }

    /// Adds one about a line.
    pub(super) fn of_line(&mut self, level: Level, line: u64, marker: &str, odd: &Defect) {
        let marker = (!marker.is_empty()).then(|| marker.to_owned());
        self.push(Finding { line: Some(line), marker, ..Finding::of(level, odd) });
    }

    fn push(&mut self, finding: Finding) {
        let count = self.finding_counts.entry(finding.code.clone()).or_default();
        *count += 1;
        if *count <= MOST_OF_A_KIND as u64 {
            self.findings.push(finding);
        }
    }

    /// Whether anything keeps the file from being applied.
    pub(crate) fn has(&self, level: Level) -> bool {
        self.findings.iter().any(|finding| finding.level == level)
    }
}
