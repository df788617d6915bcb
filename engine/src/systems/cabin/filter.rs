//! The joint filter of cabin and platform: one strapdown, whose errors stand beside those of every device that corrects it.
//!
//! The strapdown runs at the sensor's rate in the axes of b; the covariance goes on at every epoch, and every row that has
//! come since is weighed at the moment at which the thing was where it says (`past`). Errors are true − estimated.

use std::collections::VecDeque;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::covariance::{Covariance, Sparse, Update};
use super::encoder_watch::EncoderWatch;
use super::joints::{PlatformInCabin, Seat};
use super::legs::Legs;
use super::past::{Moment, Past};
use super::rig::Rig;
use super::rows::ImuRow;
use super::states::{
    ACCELEROMETER_BIAS, ACCELEROMETER_SCALE, ATTITUDE, DRIVING, GYRO_BIAS, MOUNTING, MOVING, POSITION,
    States, VELOCITY,
};
use super::steady::Steadiness;
use super::tape::Leaf;
use super::tuning::Tuning;
use crate::ins::layout::{Layout, SensorStates};
use crate::ins::nav_state::NavState;
use crate::ins::strapdown::{ImuInterval, Strapdown};
use crate::rotation::{cayley, skew};

const SENSOR: SensorStates = {
    let mut layout = Layout::of_strapdowns(1);
    layout.with_scale_factors(0)
};

/// How a cabin on six cables moves where no inertial sensor says it: sigma of its velocity, m/s, and of its attitude, rad, a
/// second after both were known.
const UNSEEN_VELOCITY_M_S: f64 = 0.06;
const UNSEEN_ATTITUDE_RAD: f64 = 0.004;
/// Longest step in which the strapdown goes on without readings, ns.
const COAST_STEP_NS: i64 = 10_000_000;
/// A sensor that was silent for so long may have been started anew, with other biases, s.
const RESTARTED_AFTER_S: f64 = 0.3;

/// Where the body is believed to be when the filter starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) t_ns: i64,
    /// Of the body's origin, m.
    pub(super) p_n: Vector3<f64>,
    pub(super) v_n: Vector3<f64>,
    pub(super) c_nb: Matrix3<f64>,
    pub(super) sigma_p_m: f64,
    pub(super) sigma_v_m_s: f64,
    pub(super) sigma_attitude_rad: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Filter {
    pub(super) rig: Rig,
    pub(super) tuning: Tuning,
    pub(super) states: States,
    strapdown: Strapdown,
    /// Rotation of the sensor's case in b that was not stated.
    pub(super) mounting: Matrix3<f64>,
    /// Nominal values of the states behind the strapdown's.
    pub(super) x: Vec<f64>,
    pub(super) covariance: Covariance,
    /// What the rows of this epoch have said of the errors so far.
    pub(super) dx: Vec<f64>,
    pub(super) past: Past,
    /// The strapdown's time, ns.
    pub(super) t_ns: i64,
    propagated: Propagated,
    coasted_s: f64,
    silent_s: f64,
    w_nb_b: Vector3<f64>,
    period_ns: i64,
    pub(super) seat: Option<Seat>,
    /// Normalised innovation squared of the row that was weighed last.
    pub(super) nis: f64,
    /// Its innovation by what the rows before it have said, and the inverse of that one's covariance.
    pub(super) weighed: (Vector3<f64>, Matrix3<f64>),
    pub(super) legs: Legs,
    pub(super) seats: VecDeque<(i64, PlatformInCabin)>,
    pub(super) encoder_watch: EncoderWatch,
    /// Densities of the sensor's noise by its own samples, rad/√s and m/s/√s: where they are more, they hold.
    pub(super) sampled_noise: [f64; 2],
    /// By how much more the rows of antennas and of stations scatter than stated: factors of variance.
    pub(super) scatter: [f64; 2],
    /// How well the platform goes on along a line in the cabin, and in n.
    pub(super) steady: Steadiness,
    /// What a smoother needs of this epoch; nothing is kept where nobody smooths.
    #[serde(skip)]
    pub(super) leaf: Option<Leaf>,
}

/// The strapdown when the covariance last went on.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Propagated {
    t_ns: i64,
    c_nb: Matrix3<f64>,
    v_n: Vector3<f64>,
    p_n: Vector3<f64>,
}

/// What a device's row says against the prediction.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) jacobian: Sparse,
    pub(super) innovation: Vector3<f64>,
    pub(super) noise: Matrix3<f64>,
}

impl Filter {
    pub(super) fn new(
        rig: Rig,
        tuning: Tuning,
        stated_sigma_m: [f64; 2],
        start: &Start,
        recording: bool,
    ) -> Filter {
        let states = States::new(&rig, &tuning, stated_sigma_m);
        let nav = NavState {
            c_nb: start.c_nb,
            v_n: start.v_n,
            p_n: start.p_n + start.c_nb * rig.lever_b,
            gyro_bias_b: Vector3::zeros(),
            accelerometer_bias_b: Vector3::zeros(),
        };
        let mut covariance = Covariance::new(states.n);
        for (k, process) in states.process.iter().enumerate() {
            covariance.add(k, k, process.variance);
        }
        for axis in 0..3 {
            covariance.add(ATTITUDE + axis, ATTITUDE + axis, start.sigma_attitude_rad.powi(2));
            covariance.add(VELOCITY + axis, VELOCITY + axis, start.sigma_v_m_s.powi(2));
            covariance.add(POSITION + axis, POSITION + axis, start.sigma_p_m.powi(2));
        }
        let propagated = Propagated { t_ns: start.t_ns, c_nb: nav.c_nb, v_n: nav.v_n, p_n: nav.p_n };
        let seat = rig.joints.as_ref().and_then(super::joints::Joints::at_rest);
        let mut past = Past::default();
        past.push(Moment {
            t_ns: start.t_ns,
            c_nb: nav.c_nb,
            v_n: nav.v_n,
            p_n: nav.p_n,
            w_nb_b: Vector3::zeros(),
        });
        Filter {
            strapdown: Strapdown::new(SENSOR, nav),
            mounting: Matrix3::identity(),
            x: vec![0.0; states.n],
            dx: vec![0.0; states.n],
            covariance,
            past,
            t_ns: start.t_ns,
            propagated,
            coasted_s: 0.0,
            silent_s: 0.0,
            nis: f64::NAN,
            weighed: (Vector3::zeros(), Matrix3::zeros()),
            legs: Legs::default(),
            w_nb_b: Vector3::zeros(),
            period_ns: 5_000_000,
            seat,
            seats: VecDeque::new(),
            steady: Steadiness::default(),
            encoder_watch: EncoderWatch::default(),
            sampled_noise: [0.0; 2],
            scatter: [1.0; 2],
            leaf: recording.then(Leaf::default),
            rig,
            tuning,
            states,
        }
    }

    /// The usual time between two readings, ns.
    pub(super) fn set_period(&mut self, period_ns: i64) {
        self.period_ns = period_ns;
    }

    /// Goes on by readings. For how long the sensor had been silent before, s, where that is more than some lost samples.
    pub(super) fn advance(&mut self, row: &ImuRow) -> Option<f64> {
        let from_ns = row.t_ns - self.period_ns;
        let hole_ns = from_ns - self.t_ns;
        let mut silent = None;
        if hole_ns > 3 * self.period_ns {
            self.coast(from_ns);
        }
        if self.silent_s > 0.0 {
            silent = Some(self.silent_s);
            if self.silent_s > RESTARTED_AFTER_S {
                self.restart_sensor();
            }
            self.silent_s = 0.0;
        }
        let dt_s = (row.t_ns - self.t_ns) as f64 * 1e-9;
        if dt_s <= 0.0 {
            return silent;
        }
        let interval = ImuInterval {
            dt_s,
            w_ib_b: self.rig.c_bs * Vector3::from(row.w_s),
            f_b: self.rig.c_bs * Vector3::from(row.f_s),
        };
        self.step(row.t_ns, &interval);
        silent
    }

    /// Goes on without readings: neither acceleration nor a change of rate is known.
    pub(super) fn coast(&mut self, until_ns: i64) {
        while self.t_ns < until_ns {
            let t_ns = (self.t_ns + COAST_STEP_NS).min(until_ns);
            let dt_s = (t_ns - self.t_ns) as f64 * 1e-9;
            self.w_nb_b *= libm::exp(-dt_s / 0.5);
            let nav = &self.strapdown.nav;
            let w_ie_n = self.rig.earth.w_ie_n();
            let f_n = w_ie_n.cross(&nav.v_n) * 2.0 - self.rig.earth.gravity_n(&nav.p_n);
            let f_b = nav.c_nb.tr_mul(&f_n);
            let w_b = self.w_nb_b + nav.c_nb.tr_mul(&w_ie_n);
            let scale = self.strapdown.accelerometer_scale.map(|scale| 1.0 + scale);
            let interval = ImuInterval {
                dt_s,
                w_ib_b: w_b + nav.gyro_bias_b,
                f_b: f_b.component_mul(&scale) + nav.accelerometer_bias_b,
            };
            self.step(t_ns, &interval);
            self.coasted_s += dt_s;
            self.silent_s += dt_s;
        }
    }

    fn step(&mut self, t_ns: i64, interval: &ImuInterval) {
        self.strapdown.advance(&self.rig.earth, interval);
        self.strapdown.forget_transition();
        self.t_ns = t_ns;
        let nav = &self.strapdown.nav;
        self.w_nb_b =
            self.strapdown.corrected_rate(&interval.w_ib_b) - nav.c_nb.tr_mul(&self.rig.earth.w_ie_n());
        self.past.push(Moment { t_ns, c_nb: nav.c_nb, v_n: nav.v_n, p_n: nav.p_n, w_nb_b: self.w_nb_b });
    }

    /// After a silence the biases may be others.
    fn restart_sensor(&mut self) {
        self.propagate();
        for k in GYRO_BIAS..ACCELEROMETER_SCALE {
            self.covariance.reset(k, 2.0 * self.states.process[k].variance);
            if let Some(leaf) = &mut self.leaf {
                leaf.forget_after(k);
            }
        }
    }

    /// Brings the covariance to the strapdown's time.
    pub(super) fn propagate(&mut self) {
        let dt_s = (self.t_ns - self.propagated.t_ns) as f64 * 1e-9;
        if dt_s <= 0.0 {
            return;
        }
        let (nav, before) = (&self.strapdown.nav, &self.propagated);
        let earth = &self.rig.earth;
        let w_ie = skew(&earth.w_ie_n());
        let g_n = earth.gravity_n(&before.p_n);
        let c_nb = (before.c_nb + nav.c_nb) * 0.5;
        let coriolis = w_ie * (before.v_n + nav.v_n);
        // First and second integral of the specific force, in n.
        let pushed_n = nav.v_n - before.v_n + (coriolis - g_n) * dt_s;
        let moved_n = nav.p_n - before.p_n - before.v_n * dt_s + (coriolis - g_n) * (0.5 * dt_s * dt_s);
        let scale = Matrix3::from_diagonal(&(c_nb.tr_mul(&pushed_n) / dt_s));

        let mut moving = [[0.0; DRIVING]; MOVING];
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            for r in 0..3 {
                for c in 0..3 {
                    moving[row + r][column + c] = block[(r, c)];
                }
            }
        };
        let one = Matrix3::identity();
        set(ATTITUDE, ATTITUDE, &(one - w_ie * dt_s));
        set(ATTITUDE, GYRO_BIAS, &(c_nb * -dt_s));
        set(VELOCITY, ATTITUDE, &-skew(&pushed_n));
        set(VELOCITY, VELOCITY, &(one - w_ie * (2.0 * dt_s)));
        set(VELOCITY, POSITION, &(earth.gravity_gradient_n() * dt_s));
        set(VELOCITY, GYRO_BIAS, &(skew(&pushed_n) * c_nb * (0.5 * dt_s)));
        set(VELOCITY, ACCELEROMETER_BIAS, &(c_nb * -dt_s));
        set(VELOCITY, ACCELEROMETER_SCALE, &(c_nb * scale * -dt_s));
        set(POSITION, ATTITUDE, &-skew(&moved_n));
        set(POSITION, VELOCITY, &(one * dt_s));
        set(POSITION, POSITION, &one);
        set(POSITION, ACCELEROMETER_BIAS, &(c_nb * (-0.5 * dt_s * dt_s)));
        set(POSITION, ACCELEROMETER_SCALE, &(c_nb * scale * (-0.5 * dt_s * dt_s)));

        let mut kept = vec![1.0; self.states.n];
        for (kept, process) in kept.iter_mut().zip(&self.states.process).skip(MOVING) {
            if process.time_s.is_finite() {
                *kept = libm::exp(-dt_s / process.time_s);
            }
        }
        self.covariance.propagate(&moving, &kept);
        for (k, process) in self.states.process.iter().enumerate().skip(MOVING) {
            let grown = process.walk * dt_s + process.variance * (1.0 - kept[k] * kept[k]);
            self.covariance.add(k, k, grown);
            self.x[k] *= kept[k];
        }
        let noise = &self.rig.noise;
        let unseen = |sigma: f64, density: f64| density * density * dt_s + sigma * sigma * self.coasted_s;
        let turned = unseen(UNSEEN_ATTITUDE_RAD, noise.angle_random_walk.max(self.sampled_noise[0]));
        let driven = unseen(UNSEEN_VELOCITY_M_S, noise.velocity_random_walk.max(self.sampled_noise[1]));
        for axis in 0..3 {
            self.covariance.add(ATTITUDE + axis, ATTITUDE + axis, turned);
            self.covariance.add(VELOCITY + axis, VELOCITY + axis, driven);
            self.covariance.add(POSITION + axis, POSITION + axis, driven * dt_s * dt_s / 3.0);
            self.covariance.add(POSITION + axis, VELOCITY + axis, driven * dt_s / 2.0);
            self.covariance.add(VELOCITY + axis, POSITION + axis, driven * dt_s / 2.0);
        }
        self.coasted_s = 0.0;
        if let Some(leaf) = &mut self.leaf {
            leaf.propagated(&moving, &kept);
        }
        self.propagated = Propagated { t_ns: self.t_ns, c_nb: nav.c_nb, v_n: nav.v_n, p_n: nav.p_n };
    }

    /// Weighs what a row says, and whether it was taken; the covariance has to be at the strapdown's time.
    pub(super) fn weigh(&mut self, measured: &Measured, gate: f64) -> bool {
        let Measured { jacobian, innovation, noise } = measured;
        let mut innovation = *innovation;
        for (state, h) in jacobian {
            innovation -= Vector3::from(*h) * self.dx[*state];
        }
        let product = self.covariance.times_transposed(jacobian);
        let spread = Covariance::projected(jacobian, &product) + noise;
        let Some(information) = spread.try_inverse() else { return false };
        let nis = innovation.dot(&(information * innovation));
        self.nis = nis;
        self.weighed = (innovation, information);
        // Written so that a NaN is refused.
        if !(nis >= 0.0 && nis <= gate) {
            return false;
        }
        let gain: [Vec<f64>; 3] = std::array::from_fn(|column| {
            let by = information.column(column);
            (0..self.states.n)
                .map(|k| product[0][k] * by[0] + product[1][k] * by[1] + product[2][k] * by[2])
                .collect()
        });
        for (k, dx) in self.dx.iter_mut().enumerate() {
            *dx += gain[0][k] * innovation.x + gain[1][k] * innovation.y + gain[2][k] * innovation.z;
        }
        self.covariance.subtract(&gain, &product);
        if let Some(leaf) = &mut self.leaf {
            leaf.updates.push(Update { jacobian: jacobian.clone(), innovation, information, gain });
        }
        true
    }

    /// Takes what the rows of this epoch have said off the nominal state.
    pub(super) fn correct(&mut self) {
        let at = |k: usize| Vector3::new(self.dx[k], self.dx[k + 1], self.dx[k + 2]);
        let (phi, v, p) = (at(ATTITUDE), at(VELOCITY), at(POSITION));
        let nav = &mut self.strapdown.nav;
        nav.c_nb = cayley(&phi) * nav.c_nb;
        nav.v_n += v;
        nav.p_n += p;
        nav.gyro_bias_b += at(GYRO_BIAS);
        nav.accelerometer_bias_b += at(ACCELEROMETER_BIAS);
        self.strapdown.accelerometer_scale += at(ACCELEROMETER_SCALE);
        self.mounting = cayley(&at(MOUNTING)) * self.mounting;
        for (x, dx) in self.x.iter_mut().zip(&self.dx).skip(MOUNTING + 3) {
            *x += dx;
        }
        self.past.correct(&phi, &v, &p);
        self.propagated.c_nb = nav.c_nb;
        self.propagated.v_n = nav.v_n;
        self.propagated.p_n = nav.p_n;
        self.dx.fill(0.0);
    }

    /// The strapdown's nominal state.
    pub(super) fn nav(&self) -> &NavState {
        &self.strapdown.nav
    }

    /// Rate against n, in axes of b, rad/s.
    pub(super) fn w_nb_b(&self) -> Vector3<f64> {
        self.w_nb_b
    }

    pub(super) fn is_finite(&self) -> bool {
        self.strapdown.is_finite() && self.covariance.row(POSITION)[POSITION].is_finite()
    }
}

#[cfg(test)]
#[path = "filter_tests.rs"]
mod tests;
