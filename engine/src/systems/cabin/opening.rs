//! What was known is made uncertain again, where something has turned out to be otherwise.

use nalgebra::Vector3;

use super::filter::Filter;
use super::states::{ACCELEROMETER_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};

/// Biases of a sensor that reads what all others contradict, 1σ, rad/s and m/s².
const ANY_RATE_RAD_S: f64 = 5e-4;
const ANY_FORCE_M_S2: f64 = 0.1;

impl Filter {
    /// The sensor reads what antennas and stations contradict: its biases may be any, and so may what has come of them since, m.
    pub(super) fn doubt_sensor(&mut self, off_m: f64, since_s: f64) {
        let (speed, turned) =
            (2.0 * off_m / since_s, off_m / since_s.powi(2) / 9.8 + ANY_RATE_RAD_S * since_s);
        for axis in 0..3 {
            self.covariance.add(POSITION + axis, POSITION + axis, off_m * off_m);
            self.covariance.add(VELOCITY + axis, VELOCITY + axis, speed * speed);
            self.covariance.add(ATTITUDE + axis, ATTITUDE + axis, turned * turned);
            self.covariance.add(GYRO_BIAS + axis, GYRO_BIAS + axis, ANY_RATE_RAD_S.powi(2));
            self.covariance.add(ACCELEROMETER_BIAS + axis, ACCELEROMETER_BIAS + axis, ANY_FORCE_M_S2.powi(2));
        }
    }

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
