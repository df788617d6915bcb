//! Walks and how they are told to a session.

use std::io::Read as _;
use std::ops::Range;

use flate2::read::GzDecoder;
use lodestep_engine::event::Event;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::ImuCsv;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig, Solution, Visit};
use lodestep_engine::sim::ImuModel;
use lodestep_engine::sim::faults::{Fault, inject};
use lodestep_engine::sim::pedestrian::{FootTruth, SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian;
use lodestep_engine::systems::pedestrian::Side;

use crate::fold::Fold;

pub(crate) const SECOND_NS: i64 = 1_000_000_000;

/// The solutions with the names under which their hashes are stored.
pub(crate) const SOLUTIONS: [(&str, Solution); 3] =
    [("filtered", Solution::Filtered), ("trail", Solution::Trail), ("smoothed", Solution::Smoothed)];

/// One foot's recorded log, gzip.
pub(crate) type PackedLog = (Side, &'static [u8]);

/// Makes a walk.
pub(crate) type Make = fn() -> Walk;

/// A visit that is keyed in at a moment of the walk.
#[derive(Clone)]
pub(crate) struct Keyed {
    /// Before the first sample of this time or later, ns.
    pub(crate) at_ns: i64,
    pub(crate) visit: Visit,
}

/// What a session is given.
#[derive(Clone)]
pub(crate) struct Walk {
    pub(crate) config: SessionConfig,
    /// The samples in the order in which they arrive.
    pub(crate) samples: Vec<(Side, ImuSample)>,
    /// Visits by the moment at which they are keyed in.
    pub(crate) visits: Vec<Keyed>,
    /// How the feet truly were, epoch by epoch, left first; empty for a recording.
    pub(crate) truth: Vec<[FootTruth; 2]>,
}

impl Walk {
    /// As much of a simulated walk as lies in its first `seconds`. The visits it makes by itself are keyed in as soon as
    /// they are over.
    pub(crate) fn simulated(kind: WalkKind, seed: u64, model: &SensorModel, seconds: i64) -> Walk {
        let site = Site::fast();
        let mut simulator = Simulator::new(&kind, seed, &site, model);
        let config = SessionConfig {
            initial_position_n_m: simulator.start_n_m(),
            declination_rad: site.declination_deg.to_radians(),
            site_field: Some(site.field()),
            gravity_m_s2: site.gravity_m_s2,
            ..pedestrian::two_feet()
        };
        let visits = simulator.visits().iter().map(|visit| {
            let [e_m, n_m, u_m] = visit.position_n_m;
            let (t_start_ns, t_end_ns) = (visit.t_start_ns, visit.t_end_ns);
            let marker = visit.marker.clone();
            let visit = Visit { marker, t_start_ns, t_end_ns, position_n_m: (e_m, n_m, Some(u_m)) };
            Keyed { at_ns: t_end_ns, visit }
        });
        let visits = visits.filter(|keyed| keyed.at_ns < seconds * SECOND_NS).collect();
        let (mut samples, mut truth) = (Vec::new(), Vec::new());
        while let Some(epoch) = simulator.next_epoch().filter(|epoch| epoch.t_ns < seconds * SECOND_NS) {
            let [left, right] = epoch.samples;
            samples.extend([(Side::Left, left), (Side::Right, right)]);
            truth.push(epoch.truth);
        }
        Walk { config, samples, visits, truth }
    }

    /// A recorded walk: one packed log a foot, merged by time, left first.
    pub(crate) fn recorded(logs: &[PackedLog]) -> Walk {
        let mut samples = Vec::new();
        for (foot, packed) in logs {
            let (mut csv, mut log, mut parser) = (Vec::new(), Vec::new(), ImuCsv::new());
            GzDecoder::new(*packed).read_to_end(&mut csv).expect("gzip");
            parser.push(&csv, &mut log).expect("a canonical log");
            parser.finish(&mut log).expect("a canonical log");
            samples.extend(log.into_iter().map(|sample| (*foot, sample)));
        }
        samples.sort_by_key(|(foot, sample)| (sample.t_ns, *foot));
        let sides: Vec<Side> = logs.iter().map(|(foot, _)| *foot).collect();
        let config = pedestrian::Config::default().session(&sides);
        Walk { config, samples, visits: Vec::new(), truth: Vec::new() }
    }

    pub(crate) fn with(mut self, change: impl FnOnce(&mut SessionConfig)) -> Walk {
        change(&mut self.config);
        self
    }

    pub(crate) fn with_solution(self, solution: Solution) -> Walk {
        self.with(|config| config.solution = solution)
    }

    /// One foot has a sensor, and its log alone is told.
    pub(crate) fn with_one_foot(mut self, foot: Side) -> Walk {
        self.config.streams = vec![pedestrian::stream(foot)];
        if let Some(truth) = self.truth.first() {
            self.config.initial_position_n_m = truth[foot.index()].position_n_m;
        }
        self.samples.retain(|(of, _)| *of == foot);
        self
    }

    /// Something goes wrong with one foot's log before it is told.
    pub(crate) fn with_fault(mut self, foot: Side, fault: &Fault) -> Walk {
        let (mut log, other): (Vec<_>, Vec<_>) = self.samples.into_iter().partition(|(of, _)| *of == foot);
        let mut samples = log.drain(..).map(|(_, sample)| sample).collect();
        inject(&mut samples, fault, 1);
        self.samples = by_time(&other, foot, &samples);
        self
    }

    /// A visit at the true place of the middle of the feet at a time, off by so much, keyed in so much later.
    pub(crate) fn with_visit(mut self, t_s: i64, off_m: [f64; 2], has_height: bool, later_s: i64) -> Walk {
        let [left, right] = &self.truth[self.number_at(t_s * SECOND_NS) / 2];
        let middle = |axis: usize| 0.5 * (left.position_n_m[axis] + right.position_n_m[axis]);
        let visit = Visit {
            marker: format!("at {t_s} s"),
            t_start_ns: (t_s - 1) * SECOND_NS,
            t_end_ns: (t_s + 1) * SECOND_NS,
            position_n_m: (middle(0) + off_m[0], middle(1) + off_m[1], has_height.then(|| middle(2))),
        };
        self.visits.push(Keyed { at_ns: (t_s + later_s) * SECOND_NS, visit });
        self
    }

    /// The samples of one foot arrive so much later than those of the other with the same time, from a time on.
    pub(crate) fn with_delay(mut self, foot: Side, delay_ns: i64, from_ns: i64) -> Walk {
        self.samples.sort_by_key(|(of, sample)| {
            let is_late = *of == foot && sample.t_ns >= from_ns;
            sample.t_ns + if is_late { delay_ns } else { 0 }
        });
        self
    }

    /// Gives a session everything and folds what it says.
    pub(crate) fn run(&self) -> Fold {
        let (mut session, mut fold) =
            (Session::new(self.config.clone()).expect("streams of a walk"), Fold::default());
        self.go_on(&mut session, 0..self.samples.len(), |_, session, events| {
            fold.take(events);
            fold.look_at_times(session);
        });
        self.finish(session, fold)
    }

    /// Gives a session the samples of these numbers with the visits among them; `after` sees it after each, with the
    /// number of the next sample and with what it said.
    pub(crate) fn go_on(
        &self,
        session: &mut Session,
        range: Range<usize>,
        mut after: impl FnMut(usize, &mut Session, &mut Vec<Event>),
    ) {
        let (mut events, first) = (Vec::new(), range.start);
        let mut visits: Vec<(usize, &Visit)> =
            self.visits.iter().map(|keyed| (self.number_at(keyed.at_ns), &keyed.visit)).collect();
        visits.sort_by_key(|(before, _)| *before);
        let mut visits = visits.into_iter().skip_while(|(before, _)| *before < first).peekable();
        for number in range {
            while let Some((_, visit)) = visits.next_if(|(before, _)| *before == number) {
                session.visit(visit.clone(), &mut events);
            }
            let (foot, sample) = &self.samples[number];
            session.push(*foot, sample, &mut events);
            after(number + 1, session, &mut events);
        }
    }

    /// The visits that are keyed in after the last sample, and the end.
    pub(crate) fn finish(&self, mut session: Session, mut fold: Fold) -> Fold {
        let mut events = Vec::new();
        for keyed in self.visits.iter().filter(|keyed| self.number_at(keyed.at_ns) == self.samples.len()) {
            session.visit(keyed.visit.clone(), &mut events);
        }
        session.finish(&mut events);
        fold.take(&mut events);
        fold.look(&session);
        fold
    }

    /// The number of the first sample of this time or later.
    pub(crate) fn number_at(&self, t_ns: i64) -> usize {
        let at = self.samples.iter().position(|(_, sample)| sample.t_ns >= t_ns);
        at.unwrap_or(self.samples.len())
    }
}

/// The CMP10A with other gyros and accelerometers.
pub(crate) fn with_imu(change: impl FnOnce(&mut ImuModel)) -> SensorModel {
    let mut model = SensorModel::cmp10a();
    change(&mut model.imu);
    model
}

/// A spoilt log among the samples of the other foot, which keep their order. Samples go by the latest time before them:
/// a stamp that goes back does not move its sample.
fn by_time(other: &[(Side, ImuSample)], foot: Side, log: &Vec<ImuSample>) -> Vec<(Side, ImuSample)> {
    let mut merged = Vec::with_capacity(other.len() + log.len());
    let mut waiting = other.iter().peekable();
    for sample in log {
        while let Some(earlier) = waiting.next_if(|(of, s)| (s.t_ns, *of) < (sample.t_ns, foot)) {
            merged.push(*earlier);
        }
        merged.push((foot, *sample));
    }
    merged.extend(waiting);
    merged
}
