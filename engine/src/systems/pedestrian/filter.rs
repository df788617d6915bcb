//! The joint filter of one or two feet: both strapdowns and one error covariance, a sample at a time.
//!
//! What it is aided by stands in files of its own: `stance_aids`, `two_feet`, `visits`; whether a foot stands, in
//! `contact`; what it tells, in `position`.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::aids::Aids;
use super::beyond::Beyond;
use super::config::Config;
use super::foot::{FootState, Step};
use super::north::North;
use super::odometer::Walked;
use super::preprocess::FootLine;
use super::side::Side;
use super::slow_errors::{Slow, deviation, stride, surroundings};
use super::swing::Following;
use super::tuning::Tuning;
use super::two_feet::Passing;
use crate::event::Event;
use crate::ins::eskf::Eskf;
use crate::ins::layout::{BLOCKS_A_SENSOR, ErrorState};
use crate::ins::mechanization::advance;
use crate::ins::observation::Observation;
use crate::rotation::{heading, skew};
use crate::system::SessionConfig;

/// A step longer than this is not integrated: what the foot did meanwhile is unknown, s.
const LONGEST_STEP_S: f64 = 0.2;
/// A velocity that is corrected by more was no estimate: what turns it means nothing, m/s.
const LARGEST_TURNED_M_S: f64 = 2.0;
/// And a position, m.
const LARGEST_TURNED_M: f64 = 20.0;
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
    /// When the last accepted visit was, ns, and how far had been walked by then, m.
    pub(crate) last_marker: (i64, f64),
    /// Innovation of the last visit, if it was turned down.
    pub(super) turned_down: Option<Vector3<f64>>,
    pub(super) heading_uncertain: bool,
    /// What the position may be wrong by beyond the covariance.
    pub(super) beyond: Beyond,
    /// How the walk is turned, where nothing says that from the start.
    pub(super) north: Option<Box<North>>,
    /// Where the inspector was when it was last known, m.
    pub(super) last_sure_place_n: Vector3<f64>,
    /// When a contradiction of the heights was last told, ns.
    pub(super) heights_told_ns: Option<i64>,
    /// What the feet know of each other is left out: they do not take turns.
    pub(super) feet_out_of_step: bool,
    /// Mean of the altimeter's normalised innovations squared over the last stances.
    pub(super) altimeter_nis: f64,
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
            last_marker: (start_ns, 0.0),
            turned_down: None,
            heading_uncertain: false,
            beyond: Beyond::default(),
            north: None,
            last_sure_place_n: place_n,
            heights_told_ns: None,
            feet_out_of_step: false,
            altimeter_nis: 1.0,
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
            foot.fastest_m_s = foot.fastest_m_s.max(foot.nav.v_n.norm());
            self.shorten(sensor, &moved_n);
        }
        let foot = &mut self.feet[sensor];
        foot.t_ns = step.t_ns;
        foot.ride.take(step.f_b.norm(), dt_s);
        foot.last_w_ib_b = step.w_ib_b;
        let stands = self.is_in_contact(setting, step);
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
                self.watch_field(step);
                self.swing(setting, sensor, told);
            }
        }
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
        self.judge_swing(setting, sensor, told);
        self.begin_ride(sensor);
        if F == 2 && setting.aids.separation && !self.feet_out_of_step {
            let other_p_n = self.feet[1 - sensor].nav.p_n;
            let foot = &mut self.feet[sensor];
            if foot.swing.end(&foot.nav.p_n, &other_p_n) == Following::Passed {
                self.apply_separation(setting, sensor, told);
            }
            self.apply_symmetry(setting, sensor);
        }
        self.stretch(sensor);
        self.feet[sensor].stance.begin(step.t_ns);
        self.stand(setting, step, 0.0, told);
    }

    fn lift_off(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        self.close_stance(setting, sensor, told);
        self.note_gait(sensor);
        self.note_lift_off(sensor);
        let foot = &mut self.feet[sensor];
        foot.stance.stands = false;
        foot.fastest_m_s = foot.nav.v_n.norm();
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
    ///
    /// Turned about the vertical with everything else, a foot's velocity errs by v × φ and its position by p × φ. The errors
    /// of the covariance are those of the velocity and the position that were; they become those of the corrected
    /// ones, or the difference would tell of the heading at the next hold (`measure::zero_velocity`).
    #[inline]
    pub(super) fn correct(&mut self, correction: &[Vector3<f64>; B]) {
        for sensor in 0..F {
            for (state, largest) in
                [(ErrorState::Velocity, LARGEST_TURNED_M_S), (ErrorState::Position, LARGEST_TURNED_M)]
            {
                let moved_n = -correction[state.of(sensor)];
                if moved_n.norm_squared() < largest * largest {
                    let attitude = ErrorState::Attitude.of(sensor);
                    self.eskf.add_multiple(state.of(sensor), attitude, &skew(&moved_n));
                }
            }
        }
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
