//! Runs of the engine over a stored session: samples in, tracks and what was found out.

use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::evaluate::SessionReport;
use lodestep_engine::event::{Event, Stand, TrackPoint, VisitOutcome};
use lodestep_engine::session::{ConfigError, Session, SessionConfig, Summary, Visit};
use lodestep_engine::stream::Reading;
use lodestep_engine::track::Track;

use super::merge_by_time::{Merged, MergedByTime, StreamReadings};
use super::run_metrics::figures_of;
use super::thinning::Thinning;
use crate::charts::{Recorder, of_points};
use crate::store;
use crate::store::lab_runs::Figures;

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
    pub(crate) report: SessionReport,
    /// The figures by which it is compared with others.
    pub(crate) figures: Figures,
    /// What its charts are drawn from.
    pub(crate) charts: Vec<store::charts::Series>,
    /// Over every epoch, lower-case hex.
    pub(crate) sha256: String,
}

/// A run under way: a session of the engine and the track that it has told so far.
pub(crate) struct Computation {
    session: Session,
    events: Vec<Event>,
    pub(crate) track: Track,
    /// Of its points, only the first in each cell of this thinning are kept.
    thinning: Option<Thinning>,
    /// What was done to read the streams; no part of the track, which is the same for the same samples.
    pub(crate) read_with: Vec<Anomaly>,
    /// Looks on for the charts, where they are wanted.
    recorder: Option<Box<Recorder>>,
}

impl Computation {
    /// Before its first sample. Room for the points of `most_epochs` (0 where nobody knows) is taken at once: a track
    /// that grows is moved as a whole again and again, and for that moment held twice.
    pub(crate) fn new(
        config: SessionConfig,
        visits: &[Visit],
        most_epochs: u64,
    ) -> Result<Computation, ConfigError> {
        let mut run = Computation {
            session: Session::new(config)?,
            events: Vec::new(),
            track: Track { points: Vec::with_capacity(most_epochs as usize), ..Track::default() },
            thinning: None,
            read_with: Vec::new(),
            recorder: None,
        };
        for visit in visits {
            run.session.visit(visit.clone(), &mut run.events);
        }
        Ok(run)
    }

    /// Keeps points at the stored rate alone, where not every epoch is wanted.
    pub(crate) fn thin(&mut self, cell_ns: i64) {
        self.thinning = Some(Thinning::new(cell_ns));
        self.track.points = Vec::new();
    }

    /// Keeps what charts need, from now on.
    pub(crate) fn record(&mut self) {
        self.recorder = Some(Box::new(Recorder::new(self.session.config())));
    }

    fn take(&mut self, merged: Merged<'_>) {
        match merged {
            Merged::Reading(stream, reading) => {
                self.session.push(stream, reading, &mut self.events);
                if let Some(recorder) = &mut self.recorder {
                    if let Reading::Imu(sample) = reading {
                        recorder.sample(stream, sample);
                    }
                    recorder.look(&self.session, reading.t_ns());
                }
            }
            Merged::End(stream) => self.session.end(stream, &mut self.events),
        }
        self.take_events();
    }

    fn take_events(&mut self) {
        let Computation { session, events, track, recorder, thinning, .. } = self;
        for value in session.chart_values() {
            if let Some(recorder) = recorder {
                recorder.value(value);
            }
        }
        for event in events.drain(..) {
            if let Some(recorder) = recorder {
                recorder.event(&event);
            }
            let skipped = match (&event, &mut *thinning) {
                (Event::Point(point), Some(thinning)) => !thinning.takes(point.t_ns),
                _ => false,
            };
            if !skipped {
                track.take(event);
            }
        }
    }

    /// There are no more samples. The track is what the filter told; [`Self::smooth`] makes it better.
    fn finish_filter(&mut self) {
        self.session.finish_filter(&mut self.events);
        self.take_events();
    }

    /// Smooths the walk, if that was asked for, piece by piece from its end, so that it is never held
    /// twice. `go_on` hears what share is done and says whether to continue; the answer is no when it
    /// said so.
    pub(crate) fn smooth(&mut self, mut go_on: impl FnMut(f64) -> bool) -> bool {
        let end = |point: Option<&TrackPoint>| point.map_or(0, |point| point.t_ns);
        let (first_ns, last_ns) = (end(self.track.points.first()), end(self.track.points.last()));
        while self.session.smooth_next(&mut self.events) {
            let reached_ns = self.events.iter().find_map(|event| match event {
                Event::Revision { points } => points.first().map(|point| point.t_ns),
                _ => None,
            });
            self.take_events();
            let left = reached_ns.unwrap_or(last_ns).saturating_sub(first_ns) as f64;
            if !go_on(1.0 - left / (last_ns - first_ns).max(1) as f64) {
                return false;
            }
        }
        true
    }

    pub(crate) fn summary(&self) -> Summary {
        self.session.summary()
    }

    /// What is stored of it: of the points the first in each cell of the thinning.
    /// `process_s` is how long all of it took.
    pub(crate) fn into_computed(mut self, cell_ns: i64, process_s: f64) -> Computed {
        let recorded = self.recorder.take().map(|recorder| recorder.into_series());
        let mut charts = recorded.unwrap_or_default();
        charts.extend(of_points(
            self.session.config().system.declaration(),
            store::track::TrackKind::Main,
            &self.track.points,
        ));
        let summary = self.summary();
        let report = SessionReport::of(&self.track, summary.distance_m);
        Computed {
            charts,
            sha256: self.track.sha256(),
            stored: thinned(&self.track.points, cell_ns),
            figures: figures_of(&self.track, &summary, &report, process_s),
            summary,
            report,
            visits: self.track.visits,
            stands: self.track.stands,
            anomalies: self.track.anomalies,
        }
    }
}

/// Feeds all samples to a run. `go_on` hears how many are done and says whether to continue; the answer
/// is no when it said so.
pub(crate) fn feed<S: StreamReadings>(
    run: &mut Computation,
    mut samples: MergedByTime<S>,
    mut go_on: impl FnMut(u64) -> bool,
) -> anyhow::Result<bool> {
    let mut done = 0;
    while let Some(step) = samples.next()? {
        run.take(step);
        done += 1;
        if done % SAMPLES_A_STRIDE == 0 && !go_on(done) {
            return Ok(false);
        }
    }
    run.finish_filter();
    run.read_with = samples.anomalies();
    Ok(true)
}

/// The first point in each cell of the thinning.
pub(crate) fn thinned(points: &[TrackPoint], cell_ns: i64) -> Vec<TrackPoint> {
    let mut thinning = Thinning::new(cell_ns);
    points.iter().filter(|point| thinning.takes(point.t_ns)).copied().collect()
}
