//! The joint filter of one or two feet: both strapdowns and one error covariance, a sample at a time.
//!
//! What it is aided by stands in files of its own: `stance_aids`, `two_feet`, `visits`; what it tells,
//! in `position`.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::aids::Aids;
use super::config::Config;
use super::foot::{FootState, Step};
use super::line::FootLine;
use super::side::Side;
use super::slow_errors::{Slow, deviation, stride, surroundings};
use super::swing::Following;
use super::tuning::Tuning;
use super::two_feet::Passing;
use super::walked::Walked;
use crate::event::Event;
use crate::ins::eskf::Eskf;
use crate::ins::layout::{BLOCKS_A_SENSOR, ErrorState};
use crate::ins::mechanization::advance;
use crate::ins::observation::Observation;
use crate::rotation::heading;
use crate::system::SessionConfig;

/// A step longer than this is not integrated: what the foot did meanwhile is unknown, s.
const LONGEST_STEP_S: f64 = 0.2;
/// A stance of walking is surer than this, m/s: beyond, the foot rolls by a radian a second or is shaken.
const DOUBTFUL_STAND_M_S: f64 = 0.075;
/// After so long in the air a foot may have come down, whatever its speed: the strapdown of a hard run, whose
/// gyro has met its limit, is wrong by metres a second, s.
const SURE_FLIGHT_S: f64 = 0.35;
/// No foot glides so evenly for so long, s.
const LONGEST_EVEN_S: f64 = 0.3;
/// A swing of a walk or a run is over by then, s, and as long again later nothing is left to believe.
const LONG_SWING_S: f64 = 0.55;
/// 99.9 % quantile of χ² with 3 degrees of freedom.
pub(super) const GATE_3: f64 = 16.27;
/// 99.9 % quantile of χ² with 2 degrees of freedom.
pub(super) const GATE_2: f64 = 13.82;
/// 99.9 % quantile of χ² with 1 degree of freedom.
pub(super) const GATE_1: f64 = 10.83;

/// What the filter needs to know besides the samples.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub(crate) tuning: Tuning,
    pub(crate) aids: Aids,
    pub(crate) gravity_m_s2: f64,
    pub(crate) declination_rad: f64,
    /// The feet in the order of their sensors' numbers.
    pub(crate) feet: Vec<Side>,
    /// The site's horizontal field and its part upwards, µT, where they are known.
    pub(crate) site_field_ut: Option<(f64, f64)>,
    /// Where the walk began, if nothing tells which way it went: the track may be turned any way about it.
    pub(crate) turned_about_n: Option<Vector3<f64>>,
    /// By what share of the way walked since the last marker the place is doubted, because the sensors read too seldom.
    pub(crate) coarse_share: f64,
}

impl Setting {
    /// Of the feet that take part, each by its line.
    pub(crate) fn new(session: &SessionConfig, config: &Config, lines: &[FootLine]) -> Setting {
        Setting {
            tuning: config.tuning.clone(),
            aids: config.aids,
            gravity_m_s2: session.gravity_m_s2,
            declination_rad: session.declination_rad,
            feet: lines.iter().map(FootLine::side).collect(),
            site_field_ut: session.magnetic_field.map(|field| {
                let [east, north, up] = field.b_n_ut;
                (libm::hypot(east, north), up)
            }),
            turned_about_n: None,
            coarse_share: 0.0,
        }
    }
}

/// The state of everything that changes from sample to sample, for `F` feet with `B`
/// three-vectors of error ([`super::slow_errors::blocks`]); a copy of it is a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Filter<const B: usize, const F: usize> {
    pub(crate) eskf: Eskf<B>,
    #[serde(with = "crate::array")]
    pub(crate) feet: [FootState; F],
    pub(crate) walked: Walked,
    pub(crate) slow: Slow,
    /// Where one foot was nearest to the other.
    pub(super) passing: Option<Passing>,
    /// How many of the session's visits have been applied.
    pub(crate) visits_weighed: usize,
    /// Where the last accepted visit was, or the start, n, m.
    pub(super) anchor_n: Vector3<f64>,
    /// When the last accepted visit was, ns, and how far had been walked by then, m.
    pub(crate) last_marker: (i64, f64),
    /// Innovation of the last visit, if it was turned down.
    pub(super) turned_down: Option<Vector3<f64>>,
    pub(super) heading_uncertain: bool,
    /// By what share of the way walked since the last marker the place is doubted, because sensors contradict each
    /// other.
    pub(super) doubted_share: f64,
}

impl<const B: usize, const F: usize> Filter<B, F> {
    pub(crate) fn new(feet: [FootState; F]) -> Self {
        let place_n = feet[0].nav.p_n;
        let start_ns = feet.iter().map(|foot| foot.t_ns).min().unwrap_or(0);
        Filter {
            eskf: Eskf::new(),
            feet,
            walked: Walked::default(),
            slow: Slow::new(place_n, start_ns),
            passing: None,
            visits_weighed: 0,
            anchor_n: place_n,
            last_marker: (start_ns, 0.0),
            turned_down: None,
            heading_uncertain: false,
            doubted_share: 0.0,
        }
    }

    /// Goes on by one sample. Outcomes are appended to `told`.
    #[inline]
    pub(crate) fn take(&mut self, setting: &Setting, step: &Step, told: &mut Vec<Event>) {
        let sensor = step.sensor;
        let dt_s = seconds(step.t_ns - self.feet[sensor].t_ns);
        if dt_s > LONGEST_STEP_S {
            self.lose(setting, sensor, dt_s);
        } else if dt_s > 0.0 {
            let foot = &mut self.feet[sensor];
            let before_p_n = foot.nav.p_n;
            let made = advance(
                &mut foot.nav,
                &foot.last_w_ib_b,
                &step.w_ib_b,
                &step.f_b,
                dt_s,
                setting.gravity_m_s2,
            );
            foot.transition.extend(&made, &foot.nav.c_nb);
            let moved_n = foot.nav.p_n - before_p_n;
            foot.fastest_squared_m2_s2 = foot.fastest_squared_m2_s2.max(foot.nav.v_n.norm_squared());
            self.shorten(sensor, &moved_n);
        }
        let foot = &mut self.feet[sensor];
        foot.t_ns = step.t_ns;
        foot.last_w_ib_b = step.w_ib_b;
        if !step.stance {
            self.feet[sensor].quiet_since_ns = step.t_ns;
        }
        let stands = if self.feet[sensor].stance.stands {
            (step.stance && !self.slips(setting, step))
                || (step.doubtful && self.comes_to_rest(setting, step))
        } else {
            (step.stance && !self.is_in_flight(setting, step))
                || (step.doubtful && self.comes_to_rest(setting, step))
        };
        let foot = &self.feet[sensor];
        // A foot that is held is propagated when that happens.
        let held = stands && foot.stance.stands && setting.aids.zupt;
        if !held && foot.transition.dt_s() >= setting.tuning.swing_interval_s * 0.99 {
            self.propagate(setting, sensor);
        }
        match (self.feet[sensor].stance.stands, stands) {
            (false, true) => self.touch_down(setting, step, told),
            (true, true) => self.stand(setting, step, dt_s, told),
            (true, false) => self.lift_off(setting, sensor, told),
            (false, false) => {
                self.watch_swing(setting, step, dt_s, told);
                self.swing(setting, sensor, told);
            }
        }
    }

    /// Whether a foot that is taken to stand is on its way all the same. A runner's swing has a moment that is
    /// as quiet as the ground of a hard run, and a foot that is set down with care glides as evenly as one that
    /// stands; what tells them apart is the speed that the strapdown has come to. It is asked as long as that
    /// can be believed: of a hard run soon after the foot has left the ground.
    #[inline]
    fn is_in_flight(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        if foot.lost || !foot.swing.has_begun() {
            return false;
        }
        let tuning = &setting.tuning;
        let (slowest_m_s, longest_s, gate) = if step.zupt_sigma_m_s > DOUBTFUL_STAND_M_S {
            (tuning.slowest_flight_m_s, SURE_FLIGHT_S, tuning.flight_gate)
        } else {
            (tuning.slowest_glide_m_s, tuning.longest_glide_s, tuning.glide_gate)
        };
        let flown_s = seconds(step.t_ns - foot.swing.begun_ns());
        flown_s <= longest_s
            && seconds(step.t_ns - foot.quiet_since_ns) < LONGEST_EVEN_S
            && foot.nav.v_n.norm() >= slowest_m_s
            && self.motion(setting, step).is_some_and(|(ratio, _)| ratio > gate)
    }

    /// Whether a foot of which the detector is not sure has come to rest by its own strapdown.
    fn comes_to_rest(&mut self, setting: &Setting, step: &Step) -> bool {
        if self.feet[step.sensor].lost {
            return false;
        }
        let (gate, most_m_s) = (setting.tuning.landing_gate, setting.tuning.landing_sigma_m_s);
        self.motion(setting, step).is_some_and(|(ratio, sigma_m_s)| ratio < gate && sigma_m_s < most_m_s)
    }

    /// Whether a standing foot has gone off between two holds.
    fn slips(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        setting.aids.zupt
            && foot.stance.is_hold_due(step.t_ns, &setting.tuning)
            && foot.stance.held_ns != i64::MIN
            && !foot.lost
            && (self.motion(setting, step).is_some_and(|(ratio, _)| ratio > setting.tuning.slip_gate)
                || self.creeps(setting, step.sensor))
    }

    /// Whether a foot that sets off too gently for any single hold has been held against its will: then it is
    /// given its velocity back.
    fn creeps(&mut self, setting: &Setting, sensor: usize) -> bool {
        let taken_n = self.feet[sensor].stance.taken_n;
        if taken_n.norm() < setting.tuning.slip_m_s {
            return false;
        }
        let foot = &mut self.feet[sensor];
        let missed_n = foot.stance.missed_n + taken_n * (0.5 * setting.tuning.hold_interval_s);
        foot.nav.v_n += taken_n;
        foot.nav.p_n += missed_n;
        foot.stance.taken_n = Vector3::zeros();
        foot.stance.missed_n = Vector3::zeros();
        let (velocity, position) = (ErrorState::Velocity.of(sensor), ErrorState::Position.of(sensor));
        let doubt = taken_n.norm() * 0.5;
        self.eskf.add_noise(&[velocity], &Vector3::repeat(doubt * doubt));
        let way_m = missed_n.norm() * 0.5;
        self.eskf.add_noise(&[position], &Vector3::repeat(way_m * way_m));
        true
    }

    /// How far the velocity is from that of a foot that stands: squared over the variance that it would have; and
    /// the largest sigma of that variance, m/s.
    fn motion(&mut self, setting: &Setting, step: &Step) -> Option<(f64, f64)> {
        if self.feet[step.sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, step.sensor);
        }
        let velocity = ErrorState::Velocity.of(step.sensor);
        let foot = &self.feet[step.sensor];
        // Once a contact is overdue the strapdown is doubted by a share of the motion, as scale, alignment and
        // sampling err by one, all one way: more than white noise says.
        let overdue =
            ((seconds(step.t_ns - foot.swing.begun_ns()) - LONG_SWING_S) / LONG_SWING_S).clamp(0.0, 2.0);
        let share = setting.tuning.swing_doubt * overdue;
        let doubt = share * share * foot.fastest_squared_m2_s2;
        let covariance = self.eskf.covariance.block(velocity, velocity)
            + Matrix3::from_diagonal_element(step.zupt_sigma_m_s * step.zupt_sigma_m_s + doubt);
        let v_n = foot.nav.v_n;
        let ratio = v_n.dot(&covariance.cholesky()?.solve(&v_n));
        Some((ratio, covariance.diagonal().max().sqrt()))
    }

    pub(super) fn propagate(&mut self, setting: &Setting, sensor: usize) {
        self.eskf.propagate(&mut self.feet[sensor].transition, sensor, &setting.tuning.imu_noise);
    }

    /// Brings the covariance of every foot up to its last sample.
    pub(crate) fn propagate_all(&mut self, setting: &Setting) {
        for sensor in 0..F {
            if self.feet[sensor].transition.dt_s() > 0.0 {
                self.propagate(setting, sensor);
            }
            self.stretch(sensor);
        }
    }

    fn touch_down(&mut self, setting: &Setting, step: &Step, told: &mut Vec<Event>) {
        let sensor = step.sensor;
        if F == 2 && setting.aids.separation {
            let other_p_n = self.feet[1 - sensor].nav.p_n;
            let foot = &mut self.feet[sensor];
            if foot.swing.end(&foot.nav.p_n, &other_p_n) == Following::Passed {
                self.apply_separation(setting, sensor, told);
            }
            self.apply_symmetry(setting, sensor);
        }
        self.stretch(sensor);
        self.feet[sensor].stance.begin(step.t_ns);
        self.feet[sensor].endless = false;
        self.stand(setting, step, 0.0, told);
    }

    fn lift_off(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        self.close_stance(setting, sensor, told);
        let foot = &mut self.feet[sensor];
        foot.stance.stands = false;
        foot.fastest_squared_m2_s2 = foot.nav.v_n.norm_squared();
        let p_n = foot.nav.p_n;
        let t_ns = foot.t_ns;
        foot.swing.begin(&p_n, t_ns);
        let azimuth_rad = heading(&foot.nav.c_nb);
        self.walked.stand(sensor, &p_n, azimuth_rad);
    }

    #[inline]
    pub(super) fn update<const M: usize>(&mut self, observation: &Observation<M>, gate: f64) -> (f64, bool) {
        let update = self.eskf.update(observation, gate);
        if let Some(correction) = &update.correction {
            self.correct(correction);
        }
        (update.nis, update.correction.is_some())
    }

    /// Applies a correction to every state.
    #[inline]
    pub(super) fn correct(&mut self, correction: &[Vector3<f64>; B]) {
        for (sensor, foot) in self.feet.iter_mut().enumerate() {
            foot.nav.correct(sensor, correction);
            foot.deviation_rad += correction[deviation(sensor, F)];
            foot.stride_error += correction[stride(sensor, F)];
            self.walked.shift(sensor, &-correction[ErrorState::Position.of(sensor)]);
        }
        self.slow.surroundings += correction[surroundings(F)];
    }

    /// Gives the blocks of one foot their first covariance.
    pub(crate) fn set_first_covariance(&mut self, sensor: usize, variances: [Matrix3<f64>; BLOCKS_A_SENSOR]) {
        for (k, block) in variances.into_iter().enumerate() {
            self.eskf.covariance.set_diagonal(sensor * BLOCKS_A_SENSOR + k, block);
        }
    }

    /// Makes the first positions of both feet known to each other by `sigma_m` on each axis, while
    /// the session's own start is known by `start_sigma_m`.
    pub(crate) fn set_first_positions(&mut self, start_sigma_m: f64, sigma_m: f64) {
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        self.eskf.add_noise(&positions, &Vector3::repeat(start_sigma_m * start_sigma_m));
        for position in positions {
            self.eskf.add_noise(&[position], &Vector3::repeat(sigma_m * sigma_m));
        }
    }
}

pub(super) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
