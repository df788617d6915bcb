//! The rover's own estimator: motion, satellites and ranges in one state, epoch by epoch.

use nalgebra::Vector3;

use super::arcs::{Ambiguity, Key, Known, Losses, group};
use super::coupling::{Bend, CoupledRange, Coupling, RangeOutcome, Sky};
use super::differences::{Base, Difference, Pair, differences, seen};
use super::fixing::{Answer, release, search};
use super::instrument::{AmbiguityMode, Instrument};
use super::lost_tag::LostTag;
use super::noise::Noise;
use super::row::Quality;
use super::satellites::{Arcs, directions, drop_arcs, forget_clocks, weigh};
use super::smoothing::{Tape, Transition};
use super::state::{POSITION, RANGES, State, VELOCITY};
use crate::gnss::ephemeris::Navigation;
use crate::gnss::satellite::Constellation;
use crate::gnss::time::GpsTime;

/// White noise of the acceleration, m²/s³: a trolley or a walker, in plan and upwards.
const Q_PLAN: f64 = 0.1;
const Q_UP: f64 = 0.03;
/// So long after the last satellite a rover is still near the door, s.
const DOOR_S: f64 = 3.0;
/// A plan that few satellites hold better than this is not asked of ranges anew, m.
const LOST_SIGMA_M: f64 = 0.1;
/// Walk of the height where no satellite says how high, m/√s.
const HEIGHT_WALK: f64 = 0.02;
/// Plan sigma under which whole cycles are called fixed, m. A reader of the word counts on 5 cm: that has to be two sigmas.
pub const FIXED_PLAN_SIGMA_M: f64 = 0.025;
/// What no residual shows: antennas, multipath that stays, the base's own place; m.
pub(super) const FLOOR_M: f64 = 0.0015;

/// What an epoch of the filter came to.
#[derive(Clone, Debug)]
pub struct Position {
    /// East, north, up, m.
    pub p_n: [f64; 3],
    /// Standard deviations, m.
    pub sigma_n: [f64; 3],
    /// Covariance of east and north, m².
    pub covariance_en_m2: f64,
    /// What it rests on.
    pub quality: Quality,
    /// The ratio of a search.
    pub ratio: Option<f64>,
    /// Satellites used.
    pub satellites: usize,
}

/// Where and when a filter begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// When.
    pub time: GpsTime,
    /// East, north, up, m.
    pub p_n: [f64; 3],
    /// Standard deviations, m.
    pub sigma_n: [f64; 3],
}

/// What a filter is told of receivers and tag.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    /// What is known beforehand.
    pub instrument: &'a Instrument,
    /// Both receivers have two bands.
    pub two_bands: bool,
    /// Time between epochs, s.
    pub interval_s: f64,
    /// Systems to use.
    pub systems: &'a [Constellation],
}

/// The filter.
#[derive(Clone, Debug)]
pub struct Filter {
    /// The estimate.
    pub state: State,
    /// When it holds.
    pub time: GpsTime,
    /// Arcs of satellites.
    pub arcs: Arcs,
    /// How good observations are.
    pub noise: Noise,
    mode: AmbiguityMode,
    two_bands: bool,
    interval_s: f64,
    mask_rad: f64,
    systems: Vec<Constellation>,
    epoch: u64,
    /// The ranges' part.
    pub coupling: Coupling,
    /// When satellites were taken last.
    last_satellites: Option<GpsTime>,
    /// When the filter began.
    began: GpsTime,
    /// Directions between satellites at the last epoch.
    directions: usize,
    /// The last epoch was fixed.
    fixed: bool,
    last: Option<(Answer, u32)>,
    /// How often held integers were given up.
    pub releases: usize,
    /// What it goes through, where it is to be smoothed.
    pub tape: Option<Tape>,
    /// Whole cycles that are known from an earlier run.
    pub known: Known,
    /// Whether the tag is where ranges say.
    lost: LostTag,
    /// Gauges there have been.
    gauges: u32,
}

impl Filter {
    /// A filter that begins at a time and a place.
    pub fn new(start: Start, setting: &Setting<'_>, coupling: Coupling) -> Filter {
        let Start { time, p_n, sigma_n } = start;
        let Setting { instrument, two_bands, interval_s, systems } = *setting;
        let mut state = State::new(&p_n, &sigma_n);
        for _ in 0..3 {
            state.push(0.0, 4.0);
        }
        state.push_many(coupling.states(), 0.0);
        coupling.start(&mut state);
        let mode = instrument.ambiguities.mode;
        Filter {
            state,
            time,
            arcs: Arcs::default(),
            noise: Noise::new(two_bands, &instrument.gnss, interval_s, mode == AmbiguityMode::Carried),
            mode,
            two_bands,
            interval_s,
            mask_rad: instrument.gnss.elevation_mask_deg.unwrap_or(10.0).to_radians(),
            systems: systems.to_vec(),
            epoch: 0,
            coupling,
            last_satellites: None,
            began: time,
            directions: 0,
            fixed: false,
            last: None,
            releases: 0,
            tape: None,
            known: Known::default(),
            lost: LostTag::default(),
            gauges: 0,
        }
    }

    /// Moves on to a time.
    pub fn move_to(&mut self, time: GpsTime) {
        let dt_s = time.since(self.time);
        if dt_s == 0.0 {
            return;
        }
        if let Some(tape) = &mut self.tape {
            tape.leave(&self.state);
        }
        let outside = self.satellites_in_sight();
        let level = !(outside && self.directions >= 3);
        if !level {
            self.state.propagate(dt_s, [Q_PLAN, Q_PLAN, Q_UP]);
        } else {
            // Nothing says how high the rover is: a floor is even, and the height walks slowly from the last known one.
            self.state.reset(VELOCITY + 2, 0.0, 0.0);
            self.state.propagate(dt_s, [Q_PLAN, Q_PLAN, 0.0]);
            self.state.add_variance(POSITION + 2, HEIGHT_WALK * HEIGHT_WALK * dt_s.abs());
        }
        let sky = if outside && self.directions >= 6 {
            Sky::Open
        } else if self.last_satellites.is_some_and(|last| time.since(last) < DOOR_S) {
            Sky::Door
        } else {
            Sky::Hall
        };
        let factors = self.coupling.grow(&mut self.state, dt_s.abs(), sky, outside);
        if let Some(tape) = &mut self.tape {
            tape.arrive(&self.state, Transition { dt_s, level, factors });
        }
        self.coupling.judge(&mut self.state);
        self.time = time;
    }

    fn satellites_in_sight(&self) -> bool {
        self.last_satellites.is_some_and(|last| self.time.since(last) < 1.5 * self.interval_s.max(0.5))
    }

    /// Takes a range at the filter's time.
    pub fn range(&mut self, range: &CoupledRange) -> RangeOutcome {
        // A range bends over what is not known of the height. Where satellites will say it, a range counts less until then;
        // among anchors alone nothing ever will, and only a start is helped.
        let vague = !self.fixed && self.state.sigma(0).max(self.state.sigma(2)) > 0.15;
        let bend = if !vague {
            Bend::Flat
        } else if self.satellites_in_sight() && self.directions >= 3 {
            Bend::Doubtful
        } else if self.time.since(self.began) < 10.0 {
            Bend::SecondOrder
        } else {
            Bend::Flat
        };
        let fixed = self.fixed && self.satellites_in_sight();
        let outcome = self.coupling.weigh(&mut self.state, range, fixed, bend);
        // With few satellites, too, a start on the wrong side of two anchors is only left when the third is asked.
        let few = self.directions < 6 && !fixed && self.plan_sigma_m() > LOST_SIGMA_M;
        if !self.satellites_in_sight() || few {
            self.lost.take(range, outcome, &mut self.state, &self.coupling);
        }
        outcome
    }

    /// The standard deviation in plan, m.
    pub fn plan_sigma_m(&self) -> f64 {
        plan_sigma(&self.state)
    }

    /// Takes an epoch of satellites at the filter's time. None with too few of them.
    pub fn satellites(
        &mut self,
        pair: Pair<'_>,
        base: &Base,
        navigation: &Navigation,
        losses: [&Losses; 2],
    ) -> Option<Position> {
        self.epoch += 1;
        if self.mode == AmbiguityMode::Epoch {
            self.begin_epoch();
        }
        let seen = seen(pair, base, navigation, &self.systems, self.mask_rad);
        let at = Vector3::new(self.state.x[0], self.state.x[1], self.state.x[2]);
        let differences = differences(&seen, base, &at);
        let enough = {
            let mut of: Vec<_> = differences.iter().map(|one| one.satellite).collect();
            of.dedup();
            let mut by_system = [0_usize; 4];
            of.iter().for_each(|satellite| by_system[satellite.constellation.index()] += 1);
            by_system.iter().any(|count| *count >= 2)
        };
        if !enough {
            return None;
        }
        self.end_lost(&differences, losses);
        self.begin_known(&differences);
        let distance_m = at.norm();
        // The first epoch says at once how good codes are, and is weighed again by what it says.
        if self.epoch == 1 || self.mode == AmbiguityMode::Epoch {
            let (mut state, mut arcs) = (self.state.clone(), self.arcs.clone());
            weigh(&mut state, &mut arcs, &differences, &at, &mut self.noise, self.epoch, distance_m);
        }
        let result = weigh(
            &mut self.state,
            &mut self.arcs,
            &differences,
            &at,
            &mut self.noise,
            self.epoch,
            distance_m,
        );
        self.last_satellites = Some(self.time);
        self.directions = directions(&differences);

        // More than a third of what was held does not fit: it was wrong.
        if result.given_up >= 2 && 3 * result.given_up > result.held + result.given_up {
            self.releases += 1;
            release(&mut self.state, &mut self.arcs);
            self.last = None;
            self.fixed = false;
            let position = self.position(&self.state, Quality::Float, None, result.satellites);
            let end = self.clocks_begin(result.first_clock);
            drop_arcs(&mut self.state, &mut self.arcs, &[], end);
            return Some(position);
        }
        let found = search(&self.state, &self.arcs, &differences, &self.noise, distance_m);
        let mut quality = Quality::Float;
        let mut shown = None;
        let mut first_clock = result.first_clock;
        if let Some(answer) = found.answer {
            let equal = match &self.last {
                Some((before, count)) if answer.agrees(before) == Some(true) => count + 1,
                _ => 1,
            };
            let clear = self.two_bands && answer.directions >= 6;
            let enough = if self.two_bands { 3.max((2.0 / self.interval_s) as u32) } else { 15 };
            let hold = self.mode == AmbiguityMode::Carried
                && equal >= enough
                && (answer.directions >= 4 || result.held > 0);
            if hold {
                let before = self.state.len();
                answer.hold(&mut self.state, &mut self.arcs);
                self.count_gauges();
                first_clock -= before - self.state.len();
                self.last = None;
            } else {
                let mut fixed = self.state.clone();
                answer.apply(&mut fixed);
                if result.held_directions < 2 && clear && plan_sigma(&fixed) < FIXED_PLAN_SIGMA_M {
                    quality = Quality::Fixed;
                    shown = Some(fixed);
                }
                self.last = Some((answer, equal));
            }
        }
        let held_directions = self.held_directions(&differences);
        // Where few satellites carry it, the rest comes from ranges and motion, whose errors are no noise.
        let limit = if held_directions >= 4 { FIXED_PLAN_SIGMA_M } else { 0.6 * FIXED_PLAN_SIGMA_M };
        if held_directions >= 2 && self.plan_sigma_m() < limit {
            quality = Quality::Fixed;
        }
        self.fixed = quality == Quality::Fixed;
        let position =
            self.position(shown.as_ref().unwrap_or(&self.state), quality, found.ratio, result.satellites);
        let mut ended = result;
        ended.first_clock = first_clock;
        forget_clocks(&mut self.state, &mut self.arcs, &ended, self.epoch, 0);
        Some(position)
    }

    fn clocks_begin(&self, first_clock: usize) -> usize {
        // After arcs were taken out, clocks stand right behind what is left of them.
        let last = self.arcs.by_key.values().filter_map(|arc| match arc.ambiguity {
            Ambiguity::Float(index) => Some(index + 1),
            Ambiguity::Held(_) => None,
        });
        last.max().unwrap_or(RANGES + self.coupling.states()).min(first_clock)
    }

    fn held_directions(&self, differences: &[Difference]) -> usize {
        let mut by_system = [0_usize; 4];
        let mut before = None;
        for one in differences.iter().filter(|one| one.phase_m.is_some()) {
            let held = self
                .arcs
                .by_key
                .get(&(one.satellite, one.band))
                .is_some_and(|arc| arc.epochs != u32::MAX && matches!(arc.ambiguity, Ambiguity::Held(_)));
            if held && before != Some(one.satellite) {
                by_system[one.satellite.constellation.index()] += 1;
                before = Some(one.satellite);
            }
        }
        by_system.iter().map(|count| count.saturating_sub(1)).sum()
    }

    fn begin_epoch(&mut self) {
        let keys: Vec<Key> = self.arcs.by_key.keys().copied().collect();
        let end = self.state.len();
        drop_arcs(&mut self.state, &mut self.arcs, &keys, end);
        for axis in 0..3 {
            let (position, velocity) = (self.state.x[POSITION + axis], self.state.x[VELOCITY + axis]);
            self.state.reset(POSITION + axis, position, 30.0 * 30.0);
            self.state.reset(VELOCITY + axis, 0.0 * velocity, 4.0);
        }
        self.last = None;
    }

    /// Gives newly held arcs the gauge of their group, or a new one.
    fn count_gauges(&mut self) {
        let mut of_group: std::collections::BTreeMap<_, u32> = self
            .arcs
            .by_key
            .iter()
            .filter(|(_, arc)| arc.gauge != 0)
            .map(|(key, arc)| (group(key), arc.gauge))
            .collect();
        for (key, arc) in &mut self.arcs.by_key {
            if let Ambiguity::Held(cycles) = arc.ambiguity
                && arc.gauge == 0
            {
                let gauges = &mut self.gauges;
                arc.gauge = *of_group.entry(group(key)).or_insert_with(|| {
                    *gauges += 1;
                    *gauges
                });
                self.arcs.found.insert((*key, arc.began), (arc.gauge, cycles));
            }
        }
    }

    /// Begins arcs whose whole cycles an earlier run came to know.
    fn begin_known(&mut self, differences: &[Difference]) {
        if self.known.is_empty() {
            return;
        }
        // Gauges that this run makes itself are others than those of the earlier one.
        self.gauges = self.gauges.max(1_000_000);
        for difference in differences.iter().filter(|one| one.phase_m.is_some()) {
            let key = (difference.satellite, difference.band);
            if self.arcs.by_key.contains_key(&key) {
                continue;
            }
            let Some(&(gauge, cycles)) = self.known.get(&(key, self.epoch)) else { continue };
            let other = self
                .arcs
                .by_key
                .iter()
                .any(|(held, arc)| group(held) == group(&key) && arc.gauge != 0 && arc.gauge != gauge);
            if !other {
                self.arcs.begin(key, Ambiguity::Held(cycles), difference, self.epoch, gauge);
            }
        }
    }

    /// Ends the arcs of what a receiver lost, of what is tracked in another way, and where the doubt about half a cycle came or went.
    fn end_lost(&mut self, differences: &[Difference], losses: [&Losses; 2]) {
        let mut ended = Vec::new();
        for difference in differences.iter().filter(|one| one.phase_m.is_some()) {
            let key = (difference.satellite, difference.band);
            let Some(arc) = self.arcs.by_key.get(&key) else { continue };
            let lost = losses.iter().any(|receiver| receiver.has(&key));
            let gap = arc.last_seen + 1 < self.epoch;
            if lost
                || gap
                || arc.half_cycle != difference.half_cycle
                || arc.attributes != difference.attributes
            {
                if lost {
                    self.arcs.slips_told += 1;
                }
                ended.push(key);
            }
        }
        let end = self.state.len();
        drop_arcs(&mut self.state, &mut self.arcs, &ended, end);
    }

    /// The position of a state as a row has it.
    pub fn position(
        &self,
        state: &State,
        quality: Quality,
        ratio: Option<f64>,
        satellites: usize,
    ) -> Position {
        let sigma = |axis: usize| (state.covariance(axis, axis).max(0.0) + FLOOR_M * FLOOR_M).sqrt();
        Position {
            p_n: [state.x[0], state.x[1], state.x[2]],
            sigma_n: [sigma(0), sigma(1), sigma(2)],
            covariance_en_m2: state.covariance(0, 1),
            quality,
            ratio,
            satellites,
        }
    }
}

fn plan_sigma(state: &State) -> f64 {
    (state.covariance(0, 0) + state.covariance(1, 1)).max(0.0).sqrt()
}
