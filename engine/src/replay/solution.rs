//! Whether what a session reports is smoothed.

use serde::{Deserialize, Serialize};

/// What a session reports in the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solution {
    /// Each point as it was known at its time, but for what applies to a past moment.
    #[default]
    Filtered,
    /// The same while it goes on; and after each accepted visit the trail of the last five minutes is
    /// smoothed and reported as a revision.
    Trail,
    /// The same while it goes on; and at the end the whole session is smoothed and reported as revisions. Every
    /// input is kept until then.
    Smoothed,
}
