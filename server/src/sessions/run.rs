//! One run of the engine over a stored session: samples in, a track and what was found out.

use lodestep_engine::event::{Anomaly, Stand, TrackPoint, VisitOutcome};
use lodestep_engine::session::{Session, SessionConfig, Summary, Visit};
use lodestep_engine::track::Track;

use super::in_time_order::{FootSamples, InTimeOrder, Step};
use super::stored_grid::Grid;

/// Samples between two looks at whether to go on.
const SAMPLES_A_STRIDE: u64 = 4_096;

/// What a run came to.
#[derive(Debug)]
pub(crate) struct Computed {
    /// The track at the stored rate.
    pub(crate) stored: Vec<TrackPoint>,
    pub(crate) visits: Vec<VisitOutcome>,
    pub(crate) stands: Vec<Stand>,
    pub(crate) anomalies: Vec<Anomaly>,
    pub(crate) summary: Summary,
    /// Over every epoch, lower-case hex.
    pub(crate) sha256: String,
}

/// Every epoch of a run, with what was found out.
pub(crate) struct FullRun {
    pub(crate) track: Track,
    pub(crate) summary: Summary,
}

/// Runs the engine. `go_on` hears how many samples are done and says whether to continue; `None` when
/// it said no. `on_filtered` sees the track as the filter left it, before any smoothing.
pub(crate) fn run<S: FootSamples>(
    config: SessionConfig,
    visits: &[Visit],
    mut samples: InTimeOrder<S>,
    mut go_on: impl FnMut(u64) -> bool,
    on_filtered: impl FnOnce(&Track),
) -> anyhow::Result<Option<FullRun>> {
    let mut session = Session::new(config);
    let mut track = Track::default();
    let mut events = Vec::new();
    for visit in visits {
        session.visit(visit.clone(), &mut events);
    }
    let mut done = 0;
    while let Some(step) = samples.next()? {
        match step {
            Step::Sample(foot, sample) => {
                session.push(foot, &sample, &mut events);
                done += 1;
                if done % SAMPLES_A_STRIDE == 0 && !go_on(done) {
                    return Ok(None);
                }
            }
            Step::End(foot) => session.end_foot(foot, &mut events),
        }
        events.drain(..).for_each(|event| track.take(event));
    }
    session.finish_filter(&mut events);
    events.drain(..).for_each(|event| track.take(event));
    on_filtered(&track);
    // Piece by piece, so that the walk is never held twice.
    while session.smooth_next(&mut events) {
        events.drain(..).for_each(|event| track.take(event));
        if !go_on(done) {
            return Ok(None);
        }
    }
    Ok(Some(FullRun { track, summary: session.summary() }))
}

impl FullRun {
    /// What is stored of it: of the points the first in each cell of the grid.
    pub(crate) fn into_computed(self, cell_ns: i64) -> Computed {
        let mut grid = Grid::new(cell_ns);
        Computed {
            sha256: self.track.sha256(),
            stored: thinned(&self.track.points, &mut grid),
            visits: self.track.visits,
            stands: self.track.stands,
            anomalies: self.track.anomalies,
            summary: self.summary,
        }
    }
}

/// The first point in each cell of the grid.
pub(crate) fn thinned(points: &[TrackPoint], grid: &mut Grid) -> Vec<TrackPoint> {
    points.iter().filter(|point| grid.takes(point.t_ns)).copied().collect()
}
