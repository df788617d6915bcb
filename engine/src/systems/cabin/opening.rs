//! What was known is made uncertain again, where something has turned out to be otherwise.

use nalgebra::Vector3;

use super::filter::Filter;
use super::states::{ACCELEROMETER_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};

impl Filter {
    /// The sensor has leapt by so much, m/s² and rad/s in b, and stays there: its biases may have.
    pub(super) fn sensor_leapt(&mut self, [force_b, rate_b]: [&Vector3<f64>; 2], since_s: f64) {
        for axis in 0..3 {
            self.covariance.add(GYRO_BIAS + axis, GYRO_BIAS + axis, rate_b.norm_squared());
            self.covariance.add(ACCELEROMETER_BIAS + axis, ACCELEROMETER_BIAS + axis, force_b.norm_squared());
            let (speed, turned) = (force_b.norm() * since_s, rate_b.norm() * since_s);
            self.covariance.add(VELOCITY + axis, VELOCITY + axis, speed * speed);
            self.covariance.add(ATTITUDE + axis, ATTITUDE + axis, turned * turned);
        }
    }

    /// The place may be off by so much, m, as what said it was wrong.
    pub(super) fn unsettle(&mut self, off_m: f64) {
        for axis in 0..3 {
            self.covariance.add(POSITION + axis, POSITION + axis, off_m * off_m);
        }
    }

    /// Makes a state uncertain by so much again, in its unit.
    pub(super) fn open(&mut self, state: usize, sigma: f64) {
        self.covariance.add(state, state, sigma * sigma);
    }
}
