//! One session: readings in, events out. The door behind the upload, the stream and the command line, for every system.

use crate::event::Event;
use crate::identify::stands::Stands;
use crate::replay::InputStore;
use crate::stream::{Reading, StreamId};
use crate::system::System;

#[cfg(test)]
mod long_walk_tests;
mod saved_state;
#[cfg(test)]
mod tests;

pub use crate::system::{ConfigError, NotRestored, SensorState, SessionConfig, Solution, Summary};
pub use crate::visit::Visit;
pub use saved_state::{SOURCES, SavedState};

/// One session in progress.
///
/// What is known depends on the readings alone, not on how they were cut into batches: a log that is
/// uploaded, streamed or read by the command line gives the same events to the last bit.
#[derive(Debug)]
pub struct Session {
    config: SessionConfig,
    system: Box<dyn System>,
    summary: Summary,
    first_point_ns: Option<i64>,
    stands: Option<Box<Stands>>,
}

impl Session {
    /// A session that waits for its first readings.
    ///
    /// # Errors
    ///
    /// Where the system does not take such streams.
    pub fn new(config: SessionConfig) -> Result<Session, ConfigError> {
        Session::with_store(config, None)
    }

    /// The same, with the readings of its past, which it needs when a visit makes it look back, in `store` rather than in
    /// memory. A session that will be smoothed whole keeps them in memory all the same.
    ///
    /// # Errors
    ///
    /// Where the system does not take such streams.
    pub fn with_store(
        config: SessionConfig,
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Session, ConfigError> {
        let mut system = config.system.start(&config, store)?;
        for visit in config.identification.iter().flat_map(|told| &told.automatic_visits) {
            system.visit(visit.clone(), &mut Vec::new());
        }
        Ok(Session {
            stands: config.identification.as_ref().map(|told| Box::new(Stands::new(told))),
            config,
            system,
            summary: Summary::default(),
            first_point_ns: None,
        })
    }

    /// How it was configured.
    pub fn config(&self) -> &SessionConfig {
        &self.config
    }

    /// Takes one reading of one stream; the readings of a stream come in the order of its log. Appends
    /// what became known to `events`. Readings of a stream that the session does not have, or that has
    /// ended, are left out.
    pub fn push<'a>(
        &mut self,
        stream: impl Into<StreamId>,
        reading: impl Into<Reading<'a>>,
        events: &mut Vec<Event>,
    ) {
        let known = events.len();
        self.summary.samples += 1;
        self.system.push(stream.into(), reading.into(), events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    /// Takes a visit, before or after its time; one that is older than the history is turned
    /// down with a reason, and a run over the stored log will use it.
    pub fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let known = events.len();
        if let Some(stands) = &mut self.stands {
            stands.note_visit(&visit);
        }
        self.system.visit(visit, events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    /// Looks for stands in what became known since `known`, and makes the visits that are nearly certain.
    fn identify(&mut self, known: usize, events: &mut Vec<Event>) {
        let Some(stands) = &mut self.stands else { return };
        let (mut from, mut found, mut visits) = (known, Vec::new(), Vec::new());
        loop {
            stands.take(&events[from..], &mut found, &mut visits);
            events.append(&mut found);
            from = events.len();
            if visits.is_empty() {
                break;
            }
            for visit in visits.drain(..) {
                self.system.visit(visit, events);
            }
        }
    }

    /// No more readings of this stream will come: others need not wait for it.
    pub fn end(&mut self, stream: impl Into<StreamId>, events: &mut Vec<Event>) {
        let known = events.len();
        self.system.end(stream.into(), events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    /// No more readings will come: what waits is processed and reported, and the session is smoothed if that was
    /// asked for.
    pub fn finish(&mut self, events: &mut Vec<Event>) {
        self.finish_filter(events);
        while self.smooth_next(events) {}
    }

    /// Smooths the next piece of the session, after [`Self::finish_filter`]; says whether there was one. A
    /// piece is a minute, reported as one revision, the last first: a caller that takes it away at once
    /// never holds the session twice.
    pub fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        self.system.smooth_next(events)
    }

    /// The first part of [`Self::finish`]: all but the smoothing.
    pub fn finish_filter(&mut self, events: &mut Vec<Event>) {
        let known = events.len();
        self.system.finish(events);
        self.identify(known, events);
        if let Some(stands) = &mut self.stands {
            stands.finish(events);
        }
        self.sum_up(&events[known..]);
    }

    /// What it amounts to so far.
    pub fn summary(&self) -> Summary {
        Summary { late_samples: self.system.progress().late_samples, ..self.summary }
    }

    /// The state of the inertial sensors that keep up, by stream; none before the session is aligned.
    pub fn sensors(&self) -> Vec<SensorState> {
        self.system.sensors()
    }

    /// Where it is at its newest reading, where the system serves a control loop.
    pub fn pose(&self) -> Option<crate::system::Pose> {
        self.system.pose()
    }

    /// What corrects that pose, by name, in the order of its bits.
    pub fn aid_names(&self) -> Vec<String> {
        self.system.aid_names()
    }

    /// Values of the system's own charts that became known since the last time.
    pub fn chart_values(&mut self) -> Vec<crate::system::ChartValue> {
        self.system.chart_values()
    }

    /// Whether a visit reached back to before what a restored session knows: it has to be made again from an older state, or
    /// from all of its readings.
    pub fn lacks_past(&self) -> bool {
        self.system.lacks_past()
    }

    fn sum_up(&mut self, reported: &[Event]) {
        let mut last_ns = None;
        for event in reported {
            if let Event::Point(point) = event {
                self.first_point_ns.get_or_insert(point.t_ns);
                self.summary.epochs += 1;
                last_ns = Some(point.t_ns);
            }
        }
        let Some(last_ns) = last_ns else { return };
        let progress = self.system.progress();
        self.summary.distance_m = progress.distance_m;
        self.summary.duration_s = seconds(last_ns - self.first_point_ns.unwrap_or(last_ns));
        self.summary.since_marker_s = seconds(last_ns - progress.last_visit_ns);
        self.summary.since_marker_m = progress.distance_m - progress.last_visit_m;
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
