//! A walk in progress: its feet's lines, merged by time, and the filter of as many feet as there are.

use super::causes::WalkCause;
use super::config::Config;
use super::filter::Filter;
use super::kept_step::KeptStep;
use super::preprocess::FootLine;
use super::side::Side;
use super::slow_errors::blocks;
use super::start::{self, Starts};
use crate::anomaly::Cause;
use crate::event::Event;
use crate::merge::{self, Epochs, Queued};
use crate::replay::InputStore;
use crate::replay::history::History;
use crate::stream::{Reading, StreamId};
use crate::system::{Progress, SensorState, SessionConfig, Solution, System};
use crate::visit::Visit;

mod saved;

/// A foot whose log begins or ends so much apart from the other's is reported, ns.
const MISSING_NS: i64 = 1_000_000_000;

/// A walk in progress.
#[derive(Debug)]
pub(crate) struct Pedestrian {
    session: SessionConfig,
    config: Config,
    store: Option<Box<dyn InputStore>>,
    lines: Vec<FootLine>,
    filters: Filters,
    /// Visits that wait for the alignment.
    early_visits: Vec<Visit>,
    late_samples: u64,
    merged_ns: i64,
    epochs: Epochs<2>,
}

/// The filter, for as many feet as there are.
#[derive(Debug)]
pub(crate) enum Filters {
    Waiting,
    OneFoot(Box<History<Filter<{ blocks(1) }, 1>, { blocks(1) }>>),
    TwoFeet(Box<History<Filter<{ blocks(2) }, 2>, { blocks(2) }>>),
}

/// Does the same with the history of either filter; nothing before there is one.
macro_rules! with_history {
    ($filters:expr, $history:ident => $do:expr, otherwise $nothing:expr) => {
        match $filters {
            Filters::Waiting => $nothing,
            Filters::OneFoot($history) => $do,
            Filters::TwoFeet($history) => $do,
        }
    };
}

impl Pedestrian {
    pub(crate) fn new(
        session: &SessionConfig,
        config: &Config,
        store: Option<Box<dyn InputStore>>,
    ) -> Pedestrian {
        let sides = session.streams.iter().filter_map(|stream| Side::of(stream.id));
        Pedestrian {
            session: SessionConfig { identification: None, ..session.clone() },
            config: config.clone(),
            store,
            lines: sides.map(|side| FootLine::new(side, config.tuning.longest_alignment_s)).collect(),
            filters: Filters::Waiting,
            early_visits: Vec::new(),
            late_samples: 0,
            merged_ns: i64::MIN,
            epochs: Epochs::default(),
        }
    }

    #[cfg(test)]
    pub(crate) fn filters(&mut self) -> &mut Filters {
        &mut self.filters
    }

    fn go_on(&mut self, events: &mut Vec<Event>) {
        if matches!(self.filters, Filters::Waiting) {
            if !self.ready_to_align() {
                return;
            }
            self.align(events);
        }
        while let Some(sensor) = merge::earliest(&self.lines, self.session.max_lead_ns) {
            let Some(mut step) = self.lines[sensor].take() else { return };
            if step.t_ns < self.merged_ns {
                self.late_samples += 1;
                continue;
            }
            self.merged_ns = step.t_ns;
            self.notice_silence(step.t_ns, events);
            step.sensor = sensor;
            step.opens_epoch = self.epochs.opens(sensor, step.t_ns);
            with_history!(
                &mut self.filters,
                history => history.push(KeptStep::new(&step, history.next_epoch(step.opens_epoch)), events),
                otherwise {}
            );
        }
    }

    /// Every foot has shown its standing start, or will not, or keeps the other waiting too long.
    fn ready_to_align(&self) -> bool {
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max();
        let Some(newest_ns) = newest_ns else { return false };
        let any = self.lines.iter().any(|line| line.is_aligned() && line.newest_ns().is_some());
        any && self.lines.iter().all(|line| {
            line.is_aligned()
                || self.session.max_lead_ns.is_some_and(|lead_ns| match line.newest_ns() {
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
        let absent: Vec<Side> =
            self.lines.iter().filter(|line| line.start().is_none()).map(FootLine::side).collect();
        self.lines.retain(|line| line.start().is_some());
        for side in absent {
            events.push(foot_missing(side, self.lines[0].first_ns(), &WalkCause::FootAbsent { side }));
        }
        let solution = self.session.solution;
        let starts = start::resolve(&self.session, &self.config, &mut self.lines, events);
        let store = self.store.take().filter(|_| solution != Solution::Smoothed);
        self.filters = match starts {
            Starts::One(filter, setting) => {
                Filters::OneFoot(Box::new(History::new(setting, filter, solution, store)))
            }
            Starts::Two(filter, setting) => {
                Filters::TwoFeet(Box::new(History::new(setting, filter, solution, store)))
            }
        };
        for visit in std::mem::take(&mut self.early_visits) {
            with_history!(&mut self.filters, history => history.visit(visit, events), otherwise {});
        }
    }

    /// The session goes on at `t_ns` although a foot has been silent for longer than the other may lead.
    fn notice_silence(&mut self, t_ns: i64, events: &mut Vec<Event>) {
        let Some(lead_ns) = self.session.max_lead_ns else { return };
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max().unwrap_or(t_ns);
        for line in &mut self.lines {
            let since_ns = line.newest_ns().unwrap_or(t_ns);
            let silent = newest_ns - since_ns > lead_ns;
            if line.turns_silent(!line.has_ended() && line.next_ns().is_none() && silent) {
                let side = line.side();
                let cause = WalkCause::FootSilent { side, longest_silence_s: seconds(lead_ns) };
                events.push(foot_missing(side, since_ns, &cause));
            }
        }
    }

    /// A foot whose log begins or ends well before the other's.
    fn notice_early_end(&self, events: &mut Vec<Event>) {
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max().unwrap_or(0);
        let oldest_ns = self.lines.iter().map(FootLine::first_ns).min().unwrap_or(0);
        for line in &self.lines {
            let side = line.side();
            let (first_ns, last_ns) = (line.first_ns(), line.newest_ns().unwrap_or(0));
            if first_ns - oldest_ns > MISSING_NS {
                let late_s = seconds(first_ns - oldest_ns);
                events.push(foot_missing(side, first_ns, &WalkCause::FootLate { side, late_s }));
            }
            if newest_ns - last_ns > MISSING_NS {
                let early_s = seconds(newest_ns - last_ns);
                events.push(foot_missing(side, last_ns, &WalkCause::FootEarly { side, early_s }));
            }
        }
    }
}

impl System for Pedestrian {
    fn push(&mut self, stream: StreamId, reading: Reading<'_>, events: &mut Vec<Event>) {
        let Reading::Imu(sample) = reading else { return };
        let Some(line) = self.lines.iter_mut().find(|line| line.side().stream() == stream) else { return };
        if line.has_ended() {
            self.late_samples += 1;
            return;
        }
        line.push(&sample.in_single_precision(), events);
        self.go_on(events);
    }

    fn visit(&mut self, visit: Visit, events: &mut Vec<Event>) {
        match &mut self.filters {
            Filters::Waiting => self.early_visits.push(visit),
            Filters::OneFoot(history) => history.visit(visit, events),
            Filters::TwoFeet(history) => history.visit(visit, events),
        }
    }

    fn end(&mut self, stream: StreamId, events: &mut Vec<Event>) {
        if let Some(line) = self.lines.iter_mut().find(|line| line.side().stream() == stream) {
            line.end(events);
        }
        self.go_on(events);
    }

    fn finish(&mut self, events: &mut Vec<Event>) {
        for line in &mut self.lines {
            line.end(events);
        }
        self.go_on(events);
        self.notice_early_end(events);
        with_history!(&mut self.filters, history => history.finish(events), otherwise {});
    }

    fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        with_history!(&mut self.filters, history => history.smooth_next(events), otherwise false)
    }

    fn progress(&self) -> Progress {
        let late_samples = self.late_samples;
        let (distance_m, (last_visit_ns, last_visit_m)) = with_history!(
            &self.filters,
            history => (history.filter().distance_m(), history.filter().last_marker),
            otherwise (0.0, (0, 0.0))
        );
        Progress { distance_m, last_visit_ns, last_visit_m, late_samples }
    }

    fn sensors(&self) -> Vec<SensorState> {
        with_history!(
            &self.filters,
            history => history.filter().sensors(history.setting()),
            otherwise Vec::new()
        )
    }

    fn save(&mut self) -> Option<(i64, Vec<u8>)> {
        self.saved()
    }

    fn lacks_past(&self) -> bool {
        with_history!(&self.filters, history => history.lacks_past(), otherwise false)
    }

    #[cfg(test)]
    fn as_any(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(self)
    }
}

fn foot_missing(side: Side, t_ns: i64, cause: &WalkCause) -> Event {
    Event::Anomaly(cause.anomaly(Some(side.stream()), [t_ns; 2], 0))
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
