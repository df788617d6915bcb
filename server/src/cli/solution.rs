//! `--solution`: the filter's track, or the smoothed one.

use clap::ValueEnum;
use lodestep_engine::session;

/// Which solution to give.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Solution {
    /// Each point by what was known up to then, marker and separation corrections included
    #[default]
    Filtered,
    /// Each point by the whole walk
    Smoothed,
}

impl From<Solution> for session::Solution {
    fn from(solution: Solution) -> Self {
        match solution {
            Solution::Filtered => session::Solution::Filtered,
            Solution::Smoothed => session::Solution::Smoothed,
        }
    }
}
