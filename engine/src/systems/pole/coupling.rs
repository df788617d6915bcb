//! What one unit of an error of the gyro does to the strapdown until its errors are brought up to date.

use nalgebra::{Matrix3, Vector3};

use super::states::{BLOCKS, STATES};
use crate::ins::eskf::Eskf;
use crate::ins::layout::ErrorState::{Attitude, Position, Velocity};
use crate::rotation::skew;

/// The part of attitude, velocity and position in an error that the gyro reads with a factor on each axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RateCoupling {
    attitude: Matrix3<f64>,
    velocity: Matrix3<f64>,
    position: Matrix3<f64>,
    used: bool,
}

impl RateCoupling {
    /// Goes on by an interval: the gyro reads the error with the factors `by`; specific force has pushed by `pushed_n`
    /// (m/s).
    pub(super) fn extend(
        &mut self,
        dt_s: f64,
        c_nb: &Matrix3<f64>,
        pushed_n: &Vector3<f64>,
        by: &Vector3<f64>,
    ) {
        if !self.used && *by == Vector3::zeros() {
            return;
        }
        self.used = true;
        let push = skew(pushed_n);
        let mut turn = *c_nb;
        for (mut column, by) in turn.column_iter_mut().zip(by) {
            column *= -dt_s * by;
        }
        self.position += self.velocity * dt_s + push * (self.attitude + turn / 3.0) * (0.5 * dt_s);
        self.velocity += push * (self.attitude + turn * 0.5);
        self.attitude += turn;
    }

    /// The error in `block` has acted on the strapdown, and starts anew.
    pub(super) fn apply(&mut self, eskf: &mut Eskf<BLOCKS>, block: usize) {
        if self.used {
            let states = STATES.imu;
            eskf.add_multiple(states.block(Attitude), block, &self.attitude);
            eskf.add_multiple(states.block(Velocity), block, &self.velocity);
            eskf.add_multiple(states.block(Position), block, &self.position);
            *self = RateCoupling::default();
        }
    }
}
