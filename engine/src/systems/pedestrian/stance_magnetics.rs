//! The magnetic field over one stance: its mean, and its mean near both ends.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::rotation::cayley;

/// How many readings are averaged at either end of a stance, at most.
const END_READINGS: usize = 10;

/// What the magnetometer and the gyro have seen since a stance began.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StanceMagnetics {
    /// Turns the present body frame into that of the stance's start, by the gyro less its bias.
    turn: Matrix3<f64>,
    elapsed_s: f64,
    readings: u32,
    sum_start_frame_ut: Vector3<f64>,
    /// The first readings, and a ring of the last ones.
    first: [Reading; END_READINGS],
    last: [Reading; END_READINGS],
}

/// A reading turned back into the body frame of the stance's start.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Reading {
    at_s: f64,
    start_frame_ut: Vector3<f64>,
}

const NO_READING: Reading = Reading { at_s: 0.0, start_frame_ut: Vector3::new(0.0, 0.0, 0.0) };

/// The two ends of a stance, as [`crate::measure::magnetic_rate`] wants them.
#[derive(Clone, Copy, Debug)]
pub struct StanceEnds {
    /// Mean field near the start, in the body frame of the stance's start, µT.
    pub start_b_ut: Vector3<f64>,
    /// Mean field near the end, in the body frame of the stance's end, µT.
    pub end_b_ut: Vector3<f64>,
    /// Turns the end's body frame into the start's.
    pub turn: Matrix3<f64>,
    /// Time between the middles of both ends, s.
    pub duration_s: f64,
    /// How many readings each mean is over.
    pub readings: usize,
}

impl Default for StanceMagnetics {
    fn default() -> Self {
        StanceMagnetics {
            turn: Matrix3::identity(),
            elapsed_s: 0.0,
            readings: 0,
            sum_start_frame_ut: Vector3::zeros(),
            first: [NO_READING; END_READINGS],
            last: [NO_READING; END_READINGS],
        }
    }
}

impl StanceMagnetics {
    /// A new stance begins.
    pub fn begin(&mut self) {
        self.turn = Matrix3::identity();
        self.elapsed_s = 0.0;
        self.readings = 0;
        self.sum_start_frame_ut = Vector3::zeros();
    }

    /// Goes on by one sample: `w_nb_b` is the rate less the estimated bias, rad/s.
    #[inline]
    pub fn extend(&mut self, w_nb_b: &Vector3<f64>, dt_s: f64, mag_b_ut: Option<&Vector3<f64>>) {
        self.turn *= cayley(&(w_nb_b * dt_s));
        self.elapsed_s += dt_s;
        let Some(mag_b_ut) = mag_b_ut else { return };
        let index = self.readings as usize;
        let reading = Reading { at_s: self.elapsed_s, start_frame_ut: self.turn * mag_b_ut };
        if index < END_READINGS {
            self.first[index] = reading;
        }
        self.last[index % END_READINGS] = reading;
        self.readings += 1;
        self.sum_start_frame_ut += reading.start_frame_ut;
    }

    /// How many readings the stance has.
    pub fn readings(&self) -> u32 {
        self.readings
    }

    /// Mean field over the stance so far, in the present body frame, µT.
    pub fn mean_b_ut(&self) -> Option<Vector3<f64>> {
        (self.readings > 0)
            .then(|| self.turn.transpose() * self.sum_start_frame_ut / f64::from(self.readings))
    }

    /// The ends of the stance so far, when they do not overlap by more than half.
    pub fn ends(&self) -> Option<StanceEnds> {
        let readings = END_READINGS.min(self.readings as usize / 3);
        if readings < 2 {
            return None;
        }
        let newest = self.readings as usize;
        let (start_s, start_b_ut) = mean(self.first[..readings].iter());
        let (end_s, end_start_frame_ut) =
            mean((newest - readings..newest).map(|k| &self.last[k % END_READINGS]));
        let end_b_ut = self.turn.transpose() * end_start_frame_ut;
        let duration_s = end_s - start_s;
        Some(StanceEnds { start_b_ut, end_b_ut, turn: self.turn, duration_s, readings })
    }
}

/// Mean time and mean field.
fn mean<'a>(readings: impl Iterator<Item = &'a Reading>) -> (f64, Vector3<f64>) {
    let (mut count, mut at_s, mut field_ut) = (0.0, 0.0, Vector3::zeros());
    for reading in readings {
        count += 1.0;
        at_s += reading.at_s;
        field_ut += reading.start_frame_ut;
    }
    (at_s / count, field_ut / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bias_shows_as_the_turn_of_the_field_between_both_ends() {
        let field_n = Vector3::new(-1.5, 36.7, -31.0);
        let rate = Vector3::new(0.02, 0.01, -0.05);
        let bias = Vector3::new(0.0, 0.0, 0.01);
        let mut stance = StanceMagnetics::default();
        stance.begin();
        let mut c_nb = Matrix3::identity();
        for _ in 0..60 {
            c_nb *= cayley(&(rate * 0.01));
            stance.extend(&(rate + bias), 0.01, Some(&(c_nb.transpose() * field_n)));
        }
        let ends = stance.ends().unwrap();
        assert!((ends.duration_s - 0.5).abs() < 1e-9);
        let observation = crate::measure::magnetic_rate::magnetic_rate(
            0,
            &ends.start_b_ut,
            &ends.end_b_ut,
            &ends.turn,
            ends.duration_s,
            0.1,
        );
        // The reading holds the bias that the estimate lacks: true − estimated = +bias.
        let (_, jacobian) = observation.jacobians()[0];
        let explained = jacobian * bias;
        assert!((explained - observation.innovation).norm() < 2e-3, "{explained} {}", observation.innovation);
    }
}
