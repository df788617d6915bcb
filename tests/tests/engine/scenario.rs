//! Given: a simulated walk with its truth, and a session that suits it.

use std::sync::LazyLock;

use lodestep_engine::geo::Site;
use lodestep_engine::parse::truth_csv::KnownPlace;
use lodestep_engine::replay::InputStore;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig, Visit};
use lodestep_engine::sim::faults::{Fault, inject};
use lodestep_engine::sim::pedestrian::{FootTruth, SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::{self, Side};

use crate::told::Told;

/// A walk, ready to be told to a session.
#[derive(Clone)]
pub(crate) struct Scenario {
    pub(crate) config: SessionConfig,
    /// The logs of the feet, left first; empty where a foot has none.
    pub(crate) logs: [Vec<ImuSample>; 2],
    /// Told before the first sample.
    pub(crate) visits: Vec<Visit>,
    /// How the feet truly were at each epoch.
    pub(crate) truth: Vec<[FootTruth; 2]>,
}

/// 30 m straight on with the CMP10A: 41 s, 8,000 samples; what most tests walk.
static SHORT_WALK: LazyLock<Scenario> =
    LazyLock::new(|| Scenario::simulated(WalkKind::Line { metres: 30.0 }, 1, &SensorModel::cmp10a()));

/// The interval of every simulated log, ns.
pub(crate) const PERIOD_NS: i64 = 10_000_000;
pub(crate) const SECOND_NS: i64 = 1_000_000_000;

pub(crate) fn short_walk() -> Scenario {
    SHORT_WALK.clone()
}

impl Scenario {
    /// The whole walk; its start is known, its heading is the magnetometer's.
    pub(crate) fn simulated(kind: WalkKind, seed: u64, model: &SensorModel) -> Scenario {
        Scenario::beginning(kind, seed, model, f64::INFINITY)
    }

    /// As much of the walk as begins in its first `seconds`.
    pub(crate) fn beginning(kind: WalkKind, seed: u64, model: &SensorModel, seconds: f64) -> Scenario {
        let site = Site::fast();
        let mut simulator = Simulator::new(&kind, seed, &site, model);
        let initial_position_n_m = simulator.start_n_m();
        let visits = simulator.visits().to_vec();
        let (mut logs, mut truth) = ([Vec::new(), Vec::new()], Vec::new());
        while let Some(epoch) = simulator.next_epoch().filter(|epoch| epoch.t_ns as f64 * 1e-9 < seconds) {
            let [left, right] = epoch.samples;
            logs[0].push(left);
            logs[1].push(right);
            truth.push(epoch.truth);
        }
        let end_ns = logs[0].last().map_or(0, |sample| sample.t_ns);
        let visits = visits
            .into_iter()
            .filter(|visit| visit.t_end_ns < end_ns)
            .map(|visit| {
                let [e_m, n_m, u_m] = visit.position_n_m;
                let (t_start_ns, t_end_ns) = (visit.t_start_ns, visit.t_end_ns);
                Visit { marker: visit.marker, t_start_ns, t_end_ns, position_n_m: (e_m, n_m, Some(u_m)) }
            })
            .collect();
        let config = SessionConfig {
            initial_position_n_m,
            declination_rad: site.declination_deg.to_radians(),
            site_field: Some(site.field()),
            gravity_m_s2: site.gravity_m_s2,
            ..pedestrian::two_feet()
        };
        Scenario { config, logs, visits, truth }
    }

    /// Tells the session the true heading of the left sensor instead of leaving it to the magnetometer.
    pub(crate) fn with_true_heading(mut self) -> Scenario {
        self.config.initial_heading_rad = Some(self.truth[0][0].heading_rad);
        self
    }

    /// Only this foot has a sensor, and the session starts at it.
    pub(crate) fn with_one_foot(mut self, foot: Side) -> Scenario {
        self.config.streams = vec![pedestrian::stream(foot)];
        self.config.initial_position_n_m = self.truth[0][foot.index()].position_n_m;
        if self.config.initial_heading_rad.is_some() {
            self.config.initial_heading_rad = Some(self.truth[0][foot.index()].heading_rad);
        }
        self.logs[foot.other().index()].clear();
        self
    }

    /// Something goes wrong with the log of a foot.
    pub(crate) fn with_fault(mut self, foot: Side, fault: &Fault) -> Scenario {
        inject(&mut self.logs[foot.index()], fault, 1);
        self
    }

    /// Every sample of a foot is changed.
    pub(crate) fn with_samples(mut self, foot: Side, change: impl Fn(usize, &mut ImuSample)) -> Scenario {
        for (k, sample) in self.logs[foot.index()].iter_mut().enumerate() {
            change(k, sample);
        }
        self
    }

    /// Where the point of the track truly was: the middle of the session's feet.
    pub(crate) fn true_places(&self) -> Vec<KnownPlace> {
        let feet: Vec<Side> = self.config.streams.iter().filter_map(|stream| Side::of(stream.id)).collect();
        (0..)
            .zip(&self.truth)
            .map(|(epoch, truth)| KnownPlace {
                t_ns: epoch * PERIOD_NS,
                position_m: std::array::from_fn(|axis| {
                    let of = |foot: &Side| truth[foot.index()].position_n_m[axis];
                    feet.iter().map(of).sum::<f64>() / feet.len() as f64
                }),
            })
            .collect()
    }

    /// The samples of the session's feet in the order of their times, left first where they are equal.
    pub(crate) fn merge_by_time(&self) -> Vec<(Side, ImuSample)> {
        let mut merged = Vec::with_capacity(self.logs[0].len() + self.logs[1].len());
        let (mut left, mut right) = (self.logs[0].iter().peekable(), self.logs[1].iter().peekable());
        loop {
            let right_is_older = match (left.peek(), right.peek()) {
                (None, None) => return merged,
                (Some(left), Some(right)) => right.t_ns < left.t_ns,
                (left, _) => left.is_none(),
            };
            let (foot, queue) =
                if right_is_older { (Side::Right, &mut right) } else { (Side::Left, &mut left) };
            merged.extend(queue.next().map(|sample| (foot, *sample)));
        }
    }

    /// A session that knows the visits and has no sample yet, and what it has told so far.
    pub(crate) fn session(&self) -> (Session, Vec<lodestep_engine::event::Event>) {
        self.session_with(None)
    }

    /// The same, its past in a store.
    pub(crate) fn session_with(
        &self,
        store: Option<Box<dyn InputStore>>,
    ) -> (Session, Vec<lodestep_engine::event::Event>) {
        let mut events = Vec::new();
        let mut session = Session::with_store(self.config.clone(), store).unwrap();
        for visit in &self.visits {
            session.visit(visit.clone(), &mut events);
        }
        (session, events)
    }

    /// Tells a session everything in the order of time.
    pub(crate) fn run(&self) -> Told {
        let (mut session, mut events) = self.session();
        for (foot, sample) in self.merge_by_time() {
            session.push(foot, &sample, &mut events);
        }
        session.finish(&mut events);
        Told::check(events, session.summary())
    }
}
