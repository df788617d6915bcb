//! The error-state Kalman filter: it can propagate, update, hand over a correction. It knows no
//! sensor and no nominal state.

use nalgebra::{Matrix3, RowVector3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::aside::Aside;
use super::block_covariance::BlockCovariance;
use super::earth_transition::EarthPropagation;
use super::error_model::Transition;
use super::layout::BLOCKS_A_SENSOR;
use super::observation::Observation;
use super::process_noise::ProcessNoise;
use super::tape::{AsideInUpdate, Tape};

/// The error filter of `B` three-vectors (10 for two feet, 5 for one).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Eskf<const B: usize> {
    /// Covariance of the error state. Read it; what changes it after the start goes through the filter,
    /// which records it for a smoother.
    pub covariance: BlockCovariance<B>,
    /// What has happened since the tape was last taken, where it is recording.
    #[serde(skip)]
    pub(crate) tape: Tape,
    /// An error of the past that is yet to be measured.
    pub(super) aside: Option<Aside<B>>,
}

/// What became of an update. A rejected measurement is an outcome, not an error.
#[derive(Clone, Debug)]
pub struct Update<const B: usize> {
    /// Normalised innovation squared, z'S⁻¹z.
    pub nis: f64,
    /// The estimated errors, to be taken off the nominal state; `None` where the measurement was
    /// rejected and nothing changed.
    pub correction: Option<[Vector3<f64>; B]>,
}

/// Where what is known has this many times a measurement's variance, taking the one off the other
/// would leave more rounding than covariance.
const SHARPEST: f64 = 1e7;
/// Such a measurement is divided at most so often; by then its noise has grown by 32 powers of ten.
const MOST_PARTS: u8 = 8;

impl<const B: usize> Eskf<B> {
    /// A filter with zero covariance.
    pub fn new() -> Self {
        Eskf { covariance: BlockCovariance::zeros(), tape: Tape::default(), aside: None }
    }

    /// The errors of sensor number `sensor` go through `transition`, which covers no time afterwards.
    #[inline]
    pub fn propagate(&mut self, transition: &mut Transition, sensor: usize, noise: &impl ProcessNoise) {
        let propagation = transition.propagation(noise);
        propagation.apply(&mut self.covariance, sensor);
        if let Some(aside) = &mut self.aside {
            aside.transform(sensor * BLOCKS_A_SENSOR, |errors| propagation.map.forward(errors));
        }
        self.tape.propagation(&propagation, sensor);
        *transition = Transition::none();
    }

    /// The same for a transition on a turning Earth.
    pub(super) fn propagate_on_earth(&mut self, propagation: &EarthPropagation, sensor: usize) {
        propagation.apply(&mut self.covariance, sensor);
        if let Some(aside) = &mut self.aside {
            aside.transform(sensor * BLOCKS_A_SENSOR, |errors| propagation.map.forward(errors));
        }
        self.tape.earth_propagation(propagation, sensor);
    }

    /// Adds `factor` times the error of vector `b` to that of vector `a`.
    pub fn add_multiple(&mut self, a: usize, b: usize, factor: &Matrix3<f64>) {
        self.covariance.add_multiple(a, b, factor);
        if let Some(aside) = &mut self.aside {
            aside.row.add_multiple(a, b, factor);
        }
        self.tape.add_multiple(a, b, factor);
    }

    /// Scales the error of vector `i`, axis by axis. No factor is zero: what is forgotten altogether is
    /// [isolated](Self::isolate).
    pub fn scale(&mut self, i: usize, by: &Vector3<f64>) {
        self.covariance.scale(i, by);
        if let Some(aside) = &mut self.aside {
            aside.row.scale(i, by);
        }
        self.tape.scale(i, by);
    }

    /// The errors of these vectors are written in a frame that is turned by `r`. It is not taken down: what was recorded
    /// before belongs to the other frame.
    pub(crate) fn turn(&mut self, vectors: &[usize], r: &Matrix3<f64>) {
        self.covariance.turn(vectors, r);
        if let Some(aside) = &mut self.aside {
            for vector in vectors {
                let block = aside.row.block(*vector) * r.transpose();
                aside.row.0[0][*vector] = [block[0], block[1], block[2]];
            }
        }
    }

    /// Keeps the error Σ jacobian · error of that block as it is now: it will be measured later. What was
    /// kept before is forgotten.
    pub fn set_aside(&mut self, jacobians: &[(usize, RowVector3<f64>)]) {
        self.aside = Some(Aside::of(&self.covariance, jacobians));
        self.tape.set_aside::<B>(jacobians);
    }

    /// What has been taken off the nominal value of the error set aside since then; `None` where there is
    /// none.
    pub fn corrected_aside(&self) -> Option<f64> {
        self.aside.as_ref().map(|aside| aside.corrected)
    }

    /// The covariance of the error set aside with M functions of the errors of now; zero where there is none.
    pub(crate) fn aside_seen_by<const M: usize>(
        &self,
        jacobians: &[(usize, SMatrix<f64, M, 3>)],
    ) -> SVector<f64, M> {
        let Some(aside) = &self.aside else { return SVector::zeros() };
        jacobians.iter().map(|(i, jacobian)| jacobian * aside.row.block(*i).transpose()).sum()
    }

    /// Weighs a measurement of the error set aside, which is forgotten then, and of the blocks that
    /// `observation` names; uses it when its normalised innovation squared is at most `gate`.
    pub fn update_aside(&mut self, observation: &Observation<1>, gate: f64) -> Update<B> {
        let rejected = Update { nis: f64::INFINITY, correction: None };
        let Some(aside) = self.aside.take() else { return rejected };
        let mut cross_covariance = self.covariance.seen_by(observation.jacobians());
        cross_covariance.add(&aside.row);
        let mut variance = aside.variance;
        for (block, jacobian) in observation.jacobians() {
            variance +=
                jacobian.dot(&cross_covariance.block(*block)) + jacobian.dot(&aside.row.block(*block));
        }
        // No sharper than what rounding allows, see SHARPEST.
        variance += observation.noise[0].max(variance / SHARPEST);
        let (innovation, information) = (observation.innovation, SMatrix::<f64, 1, 1>::new(1.0 / variance));
        let weighted = information * innovation;
        let nis = innovation.dot(&weighted);
        if !(nis >= 0.0 && nis <= gate) {
            return Update { nis, ..rejected };
        }
        let gain = cross_covariance.times(&information);
        let correction = cross_covariance.transposed_times(&weighted);
        self.covariance.subtract_product(&gain, &cross_covariance);
        self.tape.update(observation, &gain, &information, &weighted, AsideInUpdate::Measured);
        Update { nis, correction: Some(correction) }
    }

    /// Forgets what vector `i` has to do with all others and gives it the covariance `block`; what was set
    /// aside is forgotten.
    pub fn isolate(&mut self, i: usize, block: Matrix3<f64>) {
        self.aside = None;
        self.tape.isolate(&self.covariance, i);
        self.covariance.isolate(i, block);
    }

    /// The error of vector `to` becomes that of vector `from` and a noise of this variance, by axis; what
    /// was set aside is forgotten.
    pub fn copy(&mut self, from: usize, to: usize, variance: &Vector3<f64>) {
        self.aside = None;
        self.tape.copy(&self.covariance, from, to);
        self.covariance.copy(from, to);
        self.add_noise(&[to], variance);
    }

    /// Gives `blocks` one noise in common, of this variance by axis.
    pub fn add_noise(&mut self, blocks: &[usize], variance: &Vector3<f64>) {
        self.covariance.add_common_noise(blocks, variance);
        self.tape.common_noise(blocks, variance);
    }

    /// Weighs `observation`; uses it when its normalised innovation squared is at most `gate`.
    ///
    /// The plain form P − K·(P·H')' with symmetric diagonal blocks has stayed positive definite
    /// over millions of steps of two feet; Joseph's form is the tests' oracle.
    #[inline]
    pub fn update<const M: usize>(&mut self, observation: &Observation<M>, gate: f64) -> Update<B> {
        self.update_in_parts(observation, gate, MOST_PARTS)
    }

    /// The same for a measurement that may be divided `parts` times more: one without noise, or a covariance that is
    /// not positive definite, would otherwise be divided without end.
    #[inline]
    fn update_in_parts<const M: usize>(
        &mut self,
        observation: &Observation<M>,
        gate: f64,
        parts: u8,
    ) -> Update<B> {
        let cross_covariance = self.covariance.seen_by(observation.jacobians());
        let mut innovation_covariance = observation.noise;
        for (block, jacobian) in observation.jacobians() {
            innovation_covariance += jacobian * cross_covariance.block(*block).transpose();
        }
        let Some(information) = inverse_of_symmetric(&innovation_covariance) else {
            return Update { nis: f64::INFINITY, correction: None };
        };
        let weighted: SVector<f64, M> = information * observation.innovation;
        let nis = observation.innovation.dot(&weighted);
        // Written so that a NaN counts as rejected.
        if !(nis >= 0.0 && nis <= gate) {
            return Update { nis, correction: None };
        }
        let too_sharp = |k| innovation_covariance[(k, k)] > SHARPEST * observation.noise[(k, k)];
        if parts > 0 && (0..M).any(too_sharp) {
            return Update { nis, correction: self.update_in_two_steps(observation, parts - 1) };
        }
        let gain = cross_covariance.times(&information);
        let correction = cross_covariance.transposed_times(&weighted);
        self.covariance.subtract_product(&gain, &cross_covariance);
        let aside_gain = self
            .aside
            .as_mut()
            .map(|aside| aside.update(observation, &information, &weighted, &cross_covariance));
        let aside = aside_gain.as_ref().map_or(AsideInUpdate::None, AsideInUpdate::Gains);
        self.tape.update(observation, &gain, &information, &weighted, aside);
        Update { nis, correction: Some(correction) }
    }

    /// Weighs a measurement with a multiple of its noise first, and then what is left of it.
    #[cold]
    fn update_in_two_steps<const M: usize>(
        &mut self,
        observation: &Observation<M>,
        parts: u8,
    ) -> Option<[Vector3<f64>; B]> {
        let mut blunt = observation.clone();
        blunt.noise *= SHARPEST * 1e-3;
        let mut correction = self.update_in_parts(&blunt, f64::INFINITY, parts).correction?;
        let mut rest = observation.clone();
        for (block, jacobian) in observation.jacobians() {
            rest.innovation -= jacobian * correction[*block];
        }
        // The blunt one has left no more than that is sharp enough for.
        let Some(of_the_rest) = self.update_in_parts(&rest, f64::INFINITY, 0).correction else {
            return Some(correction);
        };
        for (sum, part) in correction.iter_mut().zip(&of_the_rest) {
            *sum += part;
        }
        Some(correction)
    }
}

impl<const B: usize> Default for Eskf<B> {
    fn default() -> Self {
        Self::new()
    }
}

/// The inverse of a small symmetric positive definite matrix by Cholesky's factors; `None` when it
/// is not positive definite.
#[inline]
fn inverse_of_symmetric<const M: usize>(a: &SMatrix<f64, M, M>) -> Option<SMatrix<f64, M, M>> {
    let mut l = SMatrix::<f64, M, M>::zeros();
    for j in 0..M {
        let mut diagonal = a[(j, j)];
        for k in 0..j {
            diagonal -= l[(j, k)] * l[(j, k)];
        }
        if diagonal <= 0.0 || diagonal.is_nan() {
            return None;
        }
        let root = diagonal.sqrt();
        l[(j, j)] = root;
        for i in j + 1..M {
            let mut sum = a[(i, j)];
            for k in 0..j {
                sum -= l[(i, k)] * l[(j, k)];
            }
            l[(i, j)] = sum / root;
        }
    }
    let mut l_inverse = SMatrix::<f64, M, M>::zeros();
    for j in 0..M {
        l_inverse[(j, j)] = 1.0 / l[(j, j)];
        for i in j + 1..M {
            let mut sum = 0.0;
            for k in j..i {
                sum -= l[(i, k)] * l_inverse[(k, j)];
            }
            l_inverse[(i, j)] = sum / l[(i, i)];
        }
    }
    Some(l_inverse.transpose() * l_inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector, Matrix3};

    /// A full covariance with correlations everywhere.
    fn correlated() -> Eskf<10> {
        let factor =
            DMatrix::from_fn(30, 30, |r, c| ((r * 7 + c * 13) as f64).sin() + if r == c { 3.0 } else { 0.0 });
        let p = &factor * factor.transpose();
        let mut filter = Eskf::new();
        for i in 0..10 {
            for j in i..10 {
                filter.covariance.set(i, j, &Matrix3::from_fn(|r, c| p[(3 * i + r, 3 * j + c)]));
            }
        }
        filter
    }

    #[test]
    fn a_block_update_is_joseph_s_dense_update() {
        let mut filter = correlated();
        let p = filter.covariance.dense();
        let (h_a, h_b) =
            (Matrix3::new(1.0, 0.2, -0.4, 0.0, 1.1, 0.3, 0.7, 0.0, 0.9), -Matrix3::identity() * 0.5);
        let observation = Observation::<3>::new(Vector3::new(0.3, -0.2, 0.5), Matrix3::identity() * 0.04)
            .with(3, h_a)
            .with(8, h_b);
        let mut h = DMatrix::zeros(3, 30);
        h.fixed_view_mut::<3, 3>(0, 9).copy_from(&h_a);
        h.fixed_view_mut::<3, 3>(0, 24).copy_from(&h_b);
        let r = DMatrix::from_diagonal_element(3, 3, 0.04);
        let s = &h * &p * h.transpose() + &r;
        let s_inverse = s.clone().try_inverse().unwrap();
        let k = &p * h.transpose() * &s_inverse;
        let i_kh = DMatrix::identity(30, 30) - &k * &h;
        let joseph = &i_kh * &p * i_kh.transpose() + &k * r * k.transpose();
        let z = DVector::from_row_slice(&[0.3, -0.2, 0.5]);

        let update = filter.update(&observation, f64::INFINITY);
        let difference = (filter.covariance.dense() - joseph).abs().max();
        assert!(difference < 1e-9, "{difference}");
        let expected = &k * &z;
        for (i, correction) in update.correction.unwrap().iter().enumerate() {
            for axis in 0..3 {
                assert!((correction[axis] - expected[3 * i + axis]).abs() < 1e-10);
            }
        }
        assert!((update.nis - (z.transpose() * s_inverse * z)[0]).abs() < 1e-10);
    }

    #[test]
    fn beyond_its_gate_a_measurement_changes_nothing_and_says_its_statistic() {
        let mut filter = correlated();
        let before = filter.covariance.dense();
        let observation = Observation::<1>::new(SVector::<f64, 1>::new(1e4), SMatrix::<f64, 1, 1>::new(1.0))
            .with(0, SMatrix::<f64, 1, 3>::new(1.0, 0.0, 0.0));
        let update = filter.update(&observation, 9.0);
        assert!(update.nis > 9.0 && update.correction.is_none());
        assert_eq!(before, filter.covariance.dense());
    }

    #[test]
    fn after_a_measurement_that_is_sharp_beyond_measure_the_covariance_is_positive_definite() {
        let mut filter = correlated();
        let scale = 1e9;
        for i in 0..10 {
            for j in i..10 {
                let block = filter.covariance.block(i, j) * scale;
                filter.covariance.set(i, j, &block);
            }
        }
        let noise = 1e-3;
        let innovation = Vector3::new(3e4, -2e4, 5e4);
        let observation =
            Observation::<3>::new(innovation, Matrix3::identity() * noise).with(3, Matrix3::identity());
        let update = filter.update(&observation, f64::INFINITY);
        // All that is left of the block's error is the measurement's.
        assert!((update.correction.unwrap()[3] - innovation).norm() < 1e-6);
        for axis in 0..3 {
            let left = filter.covariance.block(3, 3)[(axis, axis)];
            assert!((left / noise - 1.0).abs() < 0.01, "{left}");
        }
        assert!(filter.covariance.dense().cholesky().is_some());
    }

    #[test]
    fn a_measurement_without_noise_is_not_divided_without_end() {
        let mut filter = correlated();
        let innovation = Vector3::new(0.3, -0.2, 0.5);
        let observation = Observation::<3>::new(innovation, Matrix3::zeros()).with(3, Matrix3::identity());
        let update = filter.update(&observation, f64::INFINITY);
        assert!((update.correction.unwrap()[3] - innovation).norm() < 1e-9);
    }

    #[test]
    fn where_rounding_is_all_that_is_left_a_measurement_is_not_divided_without_end() {
        // Two errors that are huge and nearly opposite: of their sum nothing is known but rounding, however often it is measured.
        for power in 10..30 {
            let mut filter = correlated();
            let huge = Matrix3::identity() * 10_f64.powi(power);
            for (i, j, block) in [(3, 3, huge), (4, 4, huge), (3, 4, -huge * (1.0 - 1e-9))] {
                filter.covariance.set(i, j, &block);
            }
            let observation = Observation::<3>::new(Vector3::repeat(0.1), Matrix3::identity() * 1e-12)
                .with(3, Matrix3::identity())
                .with(4, Matrix3::identity());
            for _ in 0..3 {
                filter.update(&observation, f64::INFINITY);
            }
        }
    }

    #[test]
    fn a_measurement_that_is_not_a_number_is_rejected() {
        let mut filter = correlated();
        let observation =
            Observation::<1>::new(SVector::<f64, 1>::new(f64::NAN), SMatrix::<f64, 1, 1>::new(1.0))
                .with(0, SMatrix::<f64, 1, 3>::new(1.0, 0.0, 0.0));
        assert!(filter.update(&observation, f64::INFINITY).correction.is_none());
        assert!(filter.covariance.is_sound());
    }
}
