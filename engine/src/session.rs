//! One walk: samples in, events out. The one type behind the upload, the stream and the command line.

use serde::{Deserialize, Serialize};

use crate::event::Event;
use crate::identify::Identification;
use crate::identify::stands::Stands;
use crate::replay::InputStore;
use crate::replay::history::History;
use crate::sample::{Foot, ImuSample};
use crate::systems::pedestrian::filter::Filter;
use crate::systems::pedestrian::kept_step::KeptStep;
use crate::systems::pedestrian::line::FootLine;
use crate::systems::pedestrian::slow_errors::blocks;
use crate::systems::pedestrian::start::{self, Starts};
use crate::systems::pedestrian::tuning::Tuning;
use crate::trouble::Trouble;

mod aids;
mod ending;
#[cfg(test)]
mod long_walk_tests;
mod saved_state;
mod sensor_state;

pub use crate::system::{SensorState, Solution, Summary};
pub use crate::visit::Visit;
pub use aids::Aids;
pub use saved_state::{NotRestored, SOURCES, SavedState};

/// What a session is told before its first sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SessionConfig {
    /// The feet that will send samples, left first.
    pub feet: Vec<Foot>,
    /// Where the middle of the feet stands at the start, east-north-up, m.
    pub initial_position_n_m: [f64; 3],
    /// Heading of the first sensor's x axis at the start, clockwise from true north, rad; `None`
    /// takes it from the magnetometer, or else lets that axis point east.
    pub initial_heading_rad: Option<f64>,
    /// Magnetic declination, east of north positive, rad.
    pub declination_rad: f64,
    /// Local gravity, m/s².
    pub gravity_m_s2: f64,
    /// The aids to use, as far as the data allow them.
    pub aids: Aids,
    /// How far one foot's samples may run ahead of the other's before the session goes on without
    /// it, ns; `None` waits for ever, as is right for logs that are complete.
    pub max_lead_ns: Option<i64>,
    /// Whether what is told is smoothed.
    pub solution: Solution,
    /// The parameters of the filter and its detectors.
    pub tuning: Tuning,
    /// The markers to choose from where the inspector stands; without them stands are not told.
    pub identification: Option<Identification>,
}

impl Default for SessionConfig {
    fn default() -> Self {
        SessionConfig {
            feet: vec![Foot::Left, Foot::Right],
            initial_position_n_m: [0.0; 3],
            initial_heading_rad: None,
            declination_rad: 0.0,
            gravity_m_s2: 9.80665,
            aids: Aids::default(),
            max_lead_ns: None,
            solution: Solution::default(),
            tuning: Tuning::default(),
            identification: None,
        }
    }
}

/// One walk in progress.
///
/// What is known depends on the samples alone, not on how they were cut into batches: a log that is
/// uploaded, streamed or read by the command line gives the same events to the last bit.
#[derive(Debug)]
pub struct Session {
    config: SessionConfig,
    store: Option<Box<dyn InputStore>>,
    lines: Vec<FootLine>,
    walk: Walk,
    /// Visits that wait for the alignment.
    early_visits: Vec<Visit>,
    summary: Summary,
    merged_ns: i64,
    epoch: EpochGrouping,
    first_point_ns: Option<i64>,
    stands: Option<Box<Stands>>,
}

/// The filter, for as many feet as there are.
#[derive(Debug)]
enum Walk {
    Waiting,
    OneFoot(Box<History<Filter<{ blocks(1) }, 1>, { blocks(1) }>>),
    TwoFeet(Box<History<Filter<{ blocks(2) }, 2>, { blocks(2) }>>),
}

/// An epoch is a run of samples in which no foot appears twice; but a new one begins only when time
/// has passed, so that no two have the same time, and feet that fell out of step by a lost sample
/// are in step again with the next pair of equal times.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct EpochGrouping {
    members: [bool; 2],
    last_ns: i64,
}

impl EpochGrouping {
    fn opens(&mut self, sensor: usize, t_ns: i64) -> bool {
        let opens = self.members == [false; 2] || (self.members[sensor] && t_ns > self.last_ns);
        if opens {
            self.members = [false; 2];
        }
        self.members[sensor] = true;
        self.last_ns = t_ns;
        opens
    }
}

impl Session {
    /// A session that waits for its first samples.
    pub fn new(config: SessionConfig) -> Session {
        let lines =
            config.feet.iter().map(|foot| FootLine::new(*foot, config.tuning.longest_alignment_s)).collect();
        Session {
            stands: config.identification.as_ref().map(|told| Box::new(Stands::new(told))),
            early_visits: config
                .identification
                .iter()
                .flat_map(|told| told.automatic_visits.clone())
                .collect(),
            config,
            store: None,
            lines,
            walk: Walk::Waiting,
            summary: Summary::default(),
            merged_ns: i64::MIN,
            epoch: EpochGrouping::default(),
            first_point_ns: None,
        }
    }

    /// Puts the samples of its past, which it needs when a visit makes it look back, there rather than in memory. To be
    /// said before the first sample; a walk that will be smoothed whole keeps them in memory all the same.
    pub fn put_past_in(&mut self, store: Box<dyn InputStore>) {
        self.store = Some(store);
    }

    /// What it was told at the start.
    pub fn config(&self) -> &SessionConfig {
        &self.config
    }

    /// Takes one sample of one foot; the samples of a foot come in the order of its log. Appends
    /// what became known to `events`. Samples of a foot that the session does not have, or that has
    /// ended, are left out.
    pub fn push(&mut self, foot: Foot, sample: &ImuSample, events: &mut Vec<Event>) {
        let known = events.len();
        self.summary.samples += 1;
        let Some(line) = self.lines.iter_mut().find(|line| line.foot() == foot) else { return };
        if line.has_ended() {
            self.summary.late_samples += 1;
            return;
        }
        line.push(&sample.in_single_precision(), events);
        self.go_on(events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    /// Tells of a visit, before or after its time; one that is older than the history is turned
    /// down with a reason, and a run over the stored log will use it.
    pub fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        let known = events.len();
        if let Some(stands) = &mut self.stands {
            stands.note_visit(&visit);
        }
        self.apply_visit(visit, events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    fn apply_visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        match &mut self.walk {
            Walk::Waiting => self.early_visits.push(visit),
            Walk::OneFoot(history) => history.visit(visit, events),
            Walk::TwoFeet(history) => history.visit(visit, events),
        }
    }

    /// Looks for stands in what became known since `known`, and makes the visits that are nearly certain.
    fn identify(&mut self, known: usize, events: &mut Vec<Event>) {
        let Some(mut stands) = self.stands.take() else { return };
        let (mut from, mut found, mut visits) = (known, Vec::new(), Vec::new());
        loop {
            stands.take(&events[from..], &mut found, &mut visits);
            events.append(&mut found);
            from = events.len();
            if visits.is_empty() {
                break;
            }
            for visit in visits.drain(..) {
                self.apply_visit(visit, events);
            }
        }
        self.stands = Some(stands);
    }

    /// No more samples of this foot will come: the other need not wait for it.
    pub fn end_foot(&mut self, foot: Foot, events: &mut Vec<Event>) {
        let known = events.len();
        if let Some(line) = self.lines.iter_mut().find(|line| line.foot() == foot) {
            line.end(events);
        }
        self.go_on(events);
        self.identify(known, events);
        self.sum_up(&events[known..]);
    }

    /// What it amounts to so far.
    pub fn summary(&self) -> Summary {
        self.summary
    }

    fn go_on(&mut self, events: &mut Vec<Event>) {
        if matches!(self.walk, Walk::Waiting) {
            if !self.ready_to_align() {
                return;
            }
            self.align(events);
        }
        while let Some(sensor) = self.next_line() {
            let Some(mut step) = self.lines[sensor].take() else { return };
            if step.t_ns < self.merged_ns {
                self.summary.late_samples += 1;
                continue;
            }
            self.merged_ns = step.t_ns;
            self.notice_silence(step.t_ns, events);
            step.sensor = sensor;
            step.opens_epoch = self.epoch.opens(sensor, step.t_ns);
            match &mut self.walk {
                Walk::Waiting => {}
                Walk::OneFoot(history) => {
                    history.push(KeptStep::new(&step, history.next_epoch(step.opens_epoch)), events);
                }
                Walk::TwoFeet(history) => {
                    history.push(KeptStep::new(&step, history.next_epoch(step.opens_epoch)), events);
                }
            }
        }
    }

    /// Every foot has shown its standing start, or will not, or keeps the other waiting too long.
    fn ready_to_align(&self) -> bool {
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max();
        let Some(newest_ns) = newest_ns else { return false };
        let any = self.lines.iter().any(|line| line.is_aligned() && line.newest_ns().is_some());
        any && self.lines.iter().all(|line| {
            line.is_aligned()
                || self.config.max_lead_ns.is_some_and(|lead_ns| match line.newest_ns() {
                    Some(own_ns) => newest_ns - own_ns > lead_ns,
                    None => self.lines.iter().any(|other| other.span_ns() > lead_ns && other.is_aligned()),
                })
        })
    }

    /// Fixes the feet that take part, and starts the filter.
    fn align(&mut self, events: &mut Vec<Event>) {
        for line in &mut self.lines {
            line.align();
        }
        let absent: Vec<Foot> =
            self.lines.iter().filter(|line| line.start().is_none()).map(FootLine::foot).collect();
        self.lines.retain(|line| line.start().is_some());
        for foot in absent {
            events.push(foot_missing(foot, self.lines[0].first_ns(), &Trouble::FootAbsent { foot }));
        }
        let solution = self.config.solution;
        let starts = start::resolve(&self.config, &mut self.lines, events);
        let store = self.store.take().filter(|_| solution != Solution::Smoothed);
        self.walk = match starts {
            Starts::One(filter, setting) => {
                Walk::OneFoot(Box::new(History::new(setting, filter, solution, store)))
            }
            Starts::Two(filter, setting) => {
                Walk::TwoFeet(Box::new(History::new(setting, filter, solution, store)))
            }
        };
        for visit in std::mem::take(&mut self.early_visits) {
            match &mut self.walk {
                Walk::Waiting => {}
                Walk::OneFoot(history) => history.visit(visit, events),
                Walk::TwoFeet(history) => history.visit(visit, events),
            }
        }
    }

    /// The line whose next step is the earliest, when it is certain that no earlier one will come.
    fn next_line(&self) -> Option<usize> {
        let mut earliest: Option<(i64, usize)> = None;
        for (sensor, line) in self.lines.iter().enumerate() {
            if let Some(t_ns) = line.next_ns()
                && earliest.is_none_or(|(best_ns, _)| t_ns < best_ns)
            {
                earliest = Some((t_ns, sensor));
            }
        }
        let (t_ns, sensor) = earliest?;
        let lead_ns = self.lines[sensor].newest_ns().map_or(0, |newest_ns| newest_ns - t_ns);
        let waited = self.config.max_lead_ns.is_some_and(|longest_ns| lead_ns > longest_ns);
        let certain = waited || self.lines.iter().all(|line| line.next_ns().is_some() || line.has_ended());
        certain.then_some(sensor)
    }

    /// The session goes on at `t_ns` although a foot has been silent for longer than the other may lead.
    fn notice_silence(&mut self, t_ns: i64, events: &mut Vec<Event>) {
        let Some(lead_ns) = self.config.max_lead_ns else { return };
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max().unwrap_or(t_ns);
        for line in &mut self.lines {
            let since_ns = line.newest_ns().unwrap_or(t_ns);
            let silent = newest_ns - since_ns > lead_ns;
            if line.turns_silent(!line.has_ended() && line.next_ns().is_none() && silent) {
                let foot = line.foot();
                let trouble = Trouble::FootSilent { foot, longest_silence_s: seconds(lead_ns) };
                events.push(foot_missing(foot, since_ns, &trouble));
            }
        }
    }

    fn sum_up(&mut self, told: &[Event]) {
        let mut last_ns = None;
        for event in told {
            if let Event::Point(point) = event {
                self.first_point_ns.get_or_insert(point.t_ns);
                self.summary.epochs += 1;
                last_ns = Some(point.t_ns);
            }
        }
        let Some(last_ns) = last_ns else { return };
        let (distance_m, (marker_ns, marker_m)) = match &self.walk {
            Walk::Waiting => return,
            Walk::OneFoot(history) => (history.filter().distance_m(), history.filter().last_marker),
            Walk::TwoFeet(history) => (history.filter().distance_m(), history.filter().last_marker),
        };
        self.summary.distance_m = distance_m;
        self.summary.duration_s = seconds(last_ns - self.first_point_ns.unwrap_or(last_ns));
        self.summary.since_marker_s = seconds(last_ns - marker_ns);
        self.summary.since_marker_m = distance_m - marker_m;
    }
}

fn foot_missing(foot: Foot, t_ns: i64, trouble: &Trouble) -> Event {
    Event::Anomaly(trouble.anomaly(Some(foot), [t_ns; 2], 0))
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
