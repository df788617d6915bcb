//! Points that are fixed to the body at a lever arm from the sensor: an antenna, a tip, a prism.
//!
//! With the sensor at p_n, a point at the lever arm l_b is at p_n + C l_b and moves with
//! v_n + C (w_nb_b × l_b), where w_nb_b = w_ib_b − Cᵀ w_ie_n as n is fixed to Earth. The Jacobians below follow
//! from the signs of the notation page; a lever arm's own error is, like a bias, true − estimated.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::earth::Earth;
use super::layout::{ErrorState, StateVariable, correction_of};
use super::observation::Observation;
use super::strapdown::Strapdown;
use crate::rotation::skew;

/// A lever arm, which may be estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeverArm {
    /// From the sensor to the point, in b, m.
    pub arm_b_m: Vector3<f64>,
    /// Where its error stands, where it is a state: in b, m, true − estimated.
    pub state: Option<StateVariable>,
}

impl LeverArm {
    /// One that is known.
    pub fn known(arm_b_m: Vector3<f64>) -> LeverArm {
        LeverArm { arm_b_m, state: None }
    }

    /// One that is estimated.
    pub fn estimated(arm_b_m: Vector3<f64>, state: StateVariable) -> LeverArm {
        LeverArm { arm_b_m, state: Some(state) }
    }

    /// Takes its estimated error off: `correction` is the whole error vector of the filter.
    pub fn correct<const B: usize>(&mut self, correction: &[Vector3<f64>; B]) {
        self.arm_b_m += correction_of(correction, self.state);
    }

    /// Where the point is.
    pub fn position(&self, strapdown: &Strapdown) -> PointPosition {
        let c_nb = strapdown.nav.c_nb;
        let arm_n = c_nb * self.arm_b_m;
        PointPosition { p_n: strapdown.nav.p_n + arm_n, by_attitude: skew(&arm_n), by_arm: -c_nb }
    }

    /// How the point moves when the gyro reads `w_ib_b` (rad/s, as read).
    ///
    /// The rate is that of the same moment. Readings that are means over an interval give it as the mean of
    /// the interval before and the one after; the last reading alone is late by half an interval, which at an
    /// angular acceleration α is off by α · dt/2 · ‖l‖.
    pub fn velocity(&self, strapdown: &Strapdown, w_ib_b: &Vector3<f64>, earth: &Earth) -> PointVelocity {
        let (c_nb, w_ie_n) = (strapdown.nav.c_nb, earth.w_ie_n());
        let w_ib_b = strapdown.corrected_rate(w_ib_b);
        let swept_n = c_nb * w_ib_b.cross(&self.arm_b_m);
        let arm_n = c_nb * self.arm_b_m;
        // What the gyro reads too much turns the point about the sensor.
        let mut by_gyro_bias = -c_nb * skew(&self.arm_b_m);
        for (mut column, scale) in by_gyro_bias.column_iter_mut().zip(&strapdown.gyro_scale) {
            column /= 1.0 + scale;
        }
        let mut by_gyro_scale = by_gyro_bias;
        for (mut column, rate) in by_gyro_scale.column_iter_mut().zip(&w_ib_b) {
            column *= *rate;
        }
        PointVelocity {
            v_n: strapdown.nav.v_n + swept_n - w_ie_n.cross(&arm_n),
            by_attitude: skew(&swept_n) - skew(&w_ie_n) * skew(&arm_n),
            by_gyro_bias,
            by_gyro_scale,
            by_arm: skew(&w_ie_n) * c_nb - c_nb * skew(&w_ib_b),
        }
    }
}

/// The position of a point, and how its error (estimated − true) changes with the errors of attitude and lever
/// arm; with that of the sensor's position it changes one to one.
#[derive(Clone, Copy, Debug)]
pub struct PointPosition {
    /// In n, m.
    pub p_n: Vector3<f64>,
    /// By the attitude error φ: \[C l×\].
    pub by_attitude: Matrix3<f64>,
    /// By the lever arm's error: −C.
    pub by_arm: Matrix3<f64>,
}

impl PointPosition {
    /// The measurement that this point is at `measured_n_m`, with the covariance `noise` (m²).
    pub fn observed(
        &self,
        strapdown: &Strapdown,
        arm: &LeverArm,
        measured_n_m: &Vector3<f64>,
        noise: &Matrix3<f64>,
    ) -> Observation<3> {
        let states = strapdown.states();
        Observation::new(self.p_n - measured_n_m, *noise)
            .with(states.block(ErrorState::Position), Matrix3::identity())
            .with(states.block(ErrorState::Attitude), self.by_attitude)
            .with_variable(arm.state, self.by_arm)
    }
}

/// The velocity of a point, and how its error (estimated − true) changes with the errors of attitude, gyro and
/// lever arm; with that of the sensor's velocity it changes one to one.
#[derive(Clone, Copy, Debug)]
pub struct PointVelocity {
    /// In n, m/s.
    pub v_n: Vector3<f64>,
    /// By the attitude error φ: \[C (w_ib × l)×\] − \[w_ie×\] \[C l×\].
    pub by_attitude: Matrix3<f64>,
    /// By the residual gyro bias: −C \[l×\] D, D the diagonal of 1/(1 + s).
    pub by_gyro_bias: Matrix3<f64>,
    /// By the residual scale factors of the gyro: −C \[l×\] D W, W the diagonal of the rate.
    pub by_gyro_scale: Matrix3<f64>,
    /// By the lever arm's error: −C \[w_nb×\].
    pub by_arm: Matrix3<f64>,
}

impl PointVelocity {
    /// The measurement that this point moves with `measured_n_m_s`, with the covariance `noise` (m²/s²).
    pub fn observed(
        &self,
        strapdown: &Strapdown,
        arm: &LeverArm,
        measured_n_m_s: &Vector3<f64>,
        noise: &Matrix3<f64>,
    ) -> Observation<3> {
        let states = strapdown.states();
        Observation::new(self.v_n - measured_n_m_s, *noise)
            .with(states.block(ErrorState::Velocity), Matrix3::identity())
            .with(states.block(ErrorState::Attitude), self.by_attitude)
            .with(states.block(ErrorState::GyroBias), self.by_gyro_bias)
            .with_variable(states.gyro_scale(), self.by_gyro_scale)
            .with_variable(arm.state, self.by_arm)
    }
}
