//! Three gyros or accelerometers at right angles, nearly: bias, scale, misalignment, noise, range and steps.

use nalgebra::{Matrix3, Vector3};

use super::random::Random;

/// How a triad errs, each error given so that zero means none; in its own unit, for one reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriadErrors {
    /// Turn-on bias of each axis, 1σ.
    pub(super) bias: f64,
    /// By how much that bias wanders from reading to reading, 1σ.
    pub(super) bias_step: f64,
    /// Noise of a reading, 1σ.
    pub(super) noise: f64,
    /// Scale factor error of each axis, 1σ.
    pub(super) scale: f64,
    /// Misalignment of the axes towards each other, 1σ, rad.
    pub(super) misalignment_rad: f64,
    /// The largest reading; infinite for none.
    pub(super) range: f64,
    /// What one step of the converter is worth; `None` for readings that are not rounded.
    pub(super) step: Option<f64>,
}

/// A triad whose errors have been drawn.
#[derive(Clone, Debug)]
pub(super) struct Triad {
    sensitivity: Matrix3<f64>,
    bias: Vector3<f64>,
    errors: TriadErrors,
    noise: Random,
    bias_walk: Random,
}

impl Triad {
    /// Draws what is constant from `calibration`: always as many numbers, in one order.
    pub(super) fn new(
        errors: TriadErrors,
        calibration: &mut Random,
        noise: Random,
        bias_walk: Random,
    ) -> Triad {
        Triad {
            bias: errors.bias * Vector3::from(calibration.normal_3()),
            sensitivity: Matrix3::identity()
                + Matrix3::from_diagonal(&(errors.scale * Vector3::from(calibration.normal_3())))
                + off_diagonal(errors.misalignment_rad, calibration),
            errors,
            noise,
            bias_walk,
        }
    }

    /// The next reading of a true value.
    pub(super) fn read(&mut self, truth: &Vector3<f64>) -> [f64; 3] {
        let ideal = self.sensitivity * truth + self.bias;
        let (noise, walk) = (self.noise.normal_3(), self.bias_walk.normal_3());
        std::array::from_fn(|axis| {
            self.bias[axis] += self.errors.bias_step * walk[axis];
            digitise(ideal[axis] + self.errors.noise * noise[axis], self.errors.range, self.errors.step)
        })
    }
}

fn off_diagonal(sigma: f64, draw: &mut Random) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| if row == column { 0.0 } else { sigma * draw.normal() })
}

/// A reading within the range, in whole steps.
pub(super) fn digitise(value: f64, range: f64, step: Option<f64>) -> f64 {
    match step {
        // The highest code of a two's-complement converter is one step below the range.
        Some(step) => (libm::round(value / step) * step).clamp(-range, range - step),
        None => value.clamp(-range, range),
    }
}
