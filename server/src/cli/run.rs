//! One walk through the engine, by the same steps as an upload, and how long it took.

use std::time::Instant;

use anyhow::Result;
use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::session::{SessionConfig, Summary, Visit};
use lodestep_engine::stream::StreamId;
use lodestep_engine::track::Track;

use crate::sessions::computation::{Computation, feed};
use crate::sessions::merge_by_time::{MergedByTime, StreamReadings};

/// What a walk came to.
pub(super) struct Walked {
    pub(super) track: Track,
    /// What was done to read the logs.
    pub(super) read_with: Vec<Anomaly>,
    pub(super) summary: Summary,
    /// Wall-clock time of reading and filtering together.
    pub(super) process_seconds: f64,
}

/// Runs the engine over the logs of one walk; the visits are told beforehand, by time.
pub(super) fn run<S: StreamReadings>(
    config: SessionConfig,
    visits: &[Visit],
    streams: impl IntoIterator<Item = (impl Into<StreamId>, S)>,
) -> Result<Walked> {
    let begin = Instant::now();
    // How many samples a log holds is known at its end.
    let mut run = Computation::new(config, visits, 0)?;
    feed(&mut run, MergedByTime::new(streams), |_| true)?;
    run.smooth(|_| true);
    let (summary, process_seconds) = (run.summary(), begin.elapsed().as_secs_f64());
    Ok(Walked { track: run.track, read_with: run.read_with, summary, process_seconds })
}
