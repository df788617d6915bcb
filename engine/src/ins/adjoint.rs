//! The way back over a tape: what the measurements of the future say of the errors of the past.
//!
//! The modified Bryson–Frazier smoother (G. J. Bierman, *Fixed interval smoothing with discrete
//! measurements*, International Journal of Control 18, 1973): beside the errors run their adjoints λ and
//! the information Λ of what comes later. Where the filter has the covariance P, the smoothed errors are
//! P λ and their covariance is P − P Λ P. Nothing is inverted, and every operation of the filter is gone
//! back over by itself. With the signs of the notation page an update with innovation m goes back as
//!
//! λ ← H' S⁻¹ m + (I − K H)' λ,  Λ ← H' S⁻¹ H + (I − K H)' Λ (I − K H),
//!
//! and a transition e ← Φ e + noise as λ ← Φ' λ, Λ ← Φ' Λ Φ. As the filter takes its corrections off the
//! nominal state at once, errors are those against the nominal state of their moment.
//!
//! The errors themselves go back, too, so that P is needed at the ends only: after an update K m is put
//! on again, after a transition the noise's part Q λ is taken off and Φ undone. The disturbance smoother
//! of S. J. Koopman (Biometrika 80, 1993) is the same run forward.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::aside::transform_row;
use super::block_covariance::BlockCovariance;
use super::earth_transition::EarthPropagation;
use super::error_model::Propagation;
use super::eskf::Eskf;
use super::layout::{BLOCKS_A_SENSOR, ErrorState};
use super::linear_maps::Rows;
use super::sensor_map::Five;
use super::tape::{AsideTaken, Entry, Tape};

/// What the future says at one moment of the way back.
#[derive(Clone, Debug)]
pub(crate) struct Adjoint<const B: usize> {
    /// λ, in inverse units of the errors.
    lambda: [Vector3<f64>; B],
    /// Λ.
    information: BlockCovariance<B>,
    /// The smoothed errors of the nominal state, P λ.
    errors: [Vector3<f64>; B],
    /// What the future says of an error that has been set aside.
    aside: Option<OfAside<B>>,
    /// Whether Λ is wanted: λ alone gives the errors, at a fraction of the work.
    with_information: bool,
    /// Smoothed functions of the errors of later moments, as functions of the errors of now.
    carried: Vec<Rows<4, B>>,
}

/// λ and Λ of the error set aside: Λ with itself and with all others.
#[derive(Clone, Debug)]
struct OfAside<const B: usize> {
    lambda: f64,
    information: f64,
    row: Rows<1, B>,
}

impl<const B: usize> Adjoint<B> {
    /// At the end, where the future says nothing.
    pub(crate) fn at_the_end() -> Self {
        Adjoint {
            lambda: [Vector3::zeros(); B],
            information: BlockCovariance::zeros(),
            errors: [Vector3::zeros(); B],
            aside: None,
            with_information: true,
            carried: Vec::new(),
        }
    }

    /// The same for a way back that is asked for errors only, not for how sure they are.
    pub(crate) fn of_errors_at_the_end() -> Self {
        Adjoint { with_information: false, ..Adjoint::at_the_end() }
    }

    /// Keeps four functions of the smoothed errors of now, so that their covariance with those of earlier moments
    /// can be told: `jacobians` are the functions, `seen` their covariance with the errors in the filter.
    ///
    /// The smoothed errors of two moments j < k have the covariance (I − P_k Λ_k) Ψ P_j, where Ψ leads from j to k through
    /// every transition and update (P. de Jong, Biometrika 76, 1989).
    pub(crate) fn carry(&mut self, jacobians: &[(usize, SMatrix<f64, 4, 3>)], seen: &Rows<4, B>) {
        let mut carried = self.information.times_rows(seen).times(&-SMatrix::<f64, 4, 4>::identity());
        for (block, jacobian) in jacobians {
            for m in 0..4 {
                for axis in 0..3 {
                    carried.0[m][*block][axis] += jacobian[(m, axis)];
                }
            }
        }
        self.carried.push(carried);
    }

    /// The covariances of what was kept, in the order of keeping, with four functions of the smoothed errors of now, whose
    /// covariance with the errors in the filter is `seen`.
    pub(crate) fn carried_seen_by(&self, seen: &Rows<4, B>) -> Vec<SMatrix<f64, 4, 4>> {
        self.carried.iter().map(|carried| carried.times_transposed(seen)).collect()
    }

    /// The smoothed errors of the nominal state.
    pub(crate) fn errors(&self) -> &[Vector3<f64>; B] {
        &self.errors
    }

    /// W Λ W': what smoothing takes off the covariance of M numbers whose covariance with the errors is `w`,
    /// and with the error set aside `w_aside`.
    pub(crate) fn taken_off<const M: usize>(
        &self,
        w: &Rows<M, B>,
        w_aside: &SVector<f64, M>,
    ) -> SMatrix<f64, M, M> {
        let off = self.information.times_rows(w).times_transposed(w);
        let Some(aside) = &self.aside else { return off };
        let both = w.times_transposed(&aside.row) * w_aside.transpose();
        off + both + both.transpose() + w_aside * w_aside.transpose() * aside.information
    }

    /// Whether every number in it is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let vectors = self.lambda.iter().chain(&self.errors);
        vectors.flat_map(|v| v.iter()).all(|x| x.is_finite()) && self.information.is_finite()
    }

    /// Works the errors out anew from the covariance that the filter had at this moment: on the way back
    /// rounding grows as the errors of an inertial sensor do, so once in a minute it is taken out.
    pub(crate) fn anchor(&mut self, filter: &Eskf<B>) {
        self.errors = filter.covariance.times(&self.lambda);
        if let (Some(kept), Some(said)) = (&filter.aside, &self.aside) {
            let more = kept.row.transposed_times(&SVector::<f64, 1>::new(said.lambda));
            self.errors.iter_mut().zip(&more).for_each(|(error, more)| *error += more);
        }
    }

    /// Goes back over `tape`, to the last moment marked in it, or to its start. Says whether it is at a
    /// moment.
    pub(crate) fn go_back(&mut self, tape: &mut Tape) -> bool {
        while let Some(entry) = tape.entries.pop() {
            match entry {
                Entry::Moment => return true,
                Entry::Propagation { sensor } => {
                    if let Some(propagation) = tape.propagations.pop() {
                        self.undo_propagation(&propagation, usize::from(sensor));
                    }
                }
                Entry::EarthPropagation { sensor } => {
                    if let Some(propagation) = tape.earth_propagations.pop() {
                        self.undo_earth_propagation(&propagation, usize::from(sensor));
                    }
                }
                Entry::Update { rows, used, blocks, aside } => {
                    let blocks = &blocks[..usize::from(used)];
                    match rows {
                        1 => self.undo_update::<1>(blocks, aside, &mut tape.numbers),
                        2 => self.undo_update::<2>(blocks, aside, &mut tape.numbers),
                        _ => self.undo_update::<3>(blocks, aside, &mut tape.numbers),
                    }
                }
                Entry::SetAside => self.undo_set_aside(&mut tape.numbers),
                Entry::AddMultiple { a, b } => {
                    let factor = Matrix3::from_column_slice(&pop::<9>(&mut tape.numbers));
                    self.undo_add_multiple(usize::from(a), usize::from(b), &factor);
                }
                Entry::Scale { block } => {
                    let (block, by) = (usize::from(block), Vector3::from(pop(&mut tape.numbers)));
                    if self.with_information {
                        self.information.scale(block, &by);
                    }
                    self.carried.iter_mut().for_each(|carried| carried.scale(block, &by));
                    self.lambda[block].component_mul_assign(&by);
                    self.errors[block].component_div_assign(&by);
                    if let Some(aside) = &mut self.aside {
                        aside.row.scale(block, &by);
                    }
                }
                Entry::Isolate { block } => {
                    let block = usize::from(block);
                    self.information.isolate(block, Matrix3::zeros());
                    self.carried.iter_mut().for_each(|carried| carried.clear(block));
                    self.lambda[block] = Vector3::zeros();
                    self.errors[block] = self.by_row(&mut tape.numbers);
                }
                Entry::Copy { from, to } => {
                    let (from, to) = (usize::from(from), usize::from(to));
                    self.information.add_multiple(from, to, &Matrix3::identity());
                    self.information.isolate(to, Matrix3::zeros());
                    for carried in &mut self.carried {
                        carried.add_multiple(from, to, &Matrix3::identity());
                        carried.clear(to);
                    }
                    let lambda = std::mem::take(&mut self.lambda[to]);
                    self.lambda[from] += lambda;
                    self.errors[to] = self.by_row(&mut tape.numbers);
                }
                Entry::CommonNoise { blocks } => {
                    let variance = Vector3::from(pop(&mut tape.numbers));
                    let of = (0..B).filter(|block| blocks >> block & 1 == 1);
                    let sum: Vector3<f64> = of.clone().map(|block| self.lambda[block]).sum();
                    of.for_each(|block| self.errors[block] -= variance.component_mul(&sum));
                }
            }
        }
        false
    }

    fn undo_propagation(&mut self, propagation: &Propagation, sensor: usize) {
        let (map, growth) = (&propagation.map, &propagation.growth);
        self.take_noise_off(
            sensor,
            [
                (ErrorState::Attitude, &growth.attitude),
                (ErrorState::GyroBias, &growth.gyro_bias),
                (ErrorState::AccelerometerBias, &growth.accelerometer_bias),
                (ErrorState::Position, &growth.position),
            ],
        );
        let (position, velocity) = (ErrorState::Position.of(sensor), ErrorState::Velocity.of(sensor));
        let share_s = growth.position_share_s;
        let pushed =
            growth.velocity.component_mul(&(self.lambda[velocity] + self.lambda[position] * share_s));
        self.errors[velocity] -= pushed;
        self.errors[position] -= pushed * share_s;
        self.undo_map(sensor, |errors| map.inverse(errors), |lambda| map.transposed(lambda));
    }

    fn undo_earth_propagation(&mut self, propagation: &EarthPropagation, sensor: usize) {
        let map = &propagation.map;
        let white = [
            (ErrorState::Attitude, &propagation.half_attitude),
            (ErrorState::Velocity, &propagation.half_velocity),
        ];
        self.take_noise_off(sensor, white);
        self.take_noise_off(
            sensor,
            [
                (ErrorState::GyroBias, &propagation.gyro_bias),
                (ErrorState::AccelerometerBias, &propagation.accelerometer_bias),
            ],
        );
        self.undo_map(sensor, |errors| map.inverse(errors), |lambda| map.transposed(lambda));
        self.take_noise_off(sensor, white);
    }

    /// Takes Q λ off the errors.
    #[inline]
    fn take_noise_off<const N: usize>(&mut self, sensor: usize, grown: [(ErrorState, &Vector3<f64>); N]) {
        for (state, variance) in grown {
            self.errors[state.of(sensor)] -= variance.component_mul(&self.lambda[state.of(sensor)]);
        }
    }

    /// Goes back over Φ, of which the inverse and the transposed are given.
    #[inline]
    fn undo_map(&mut self, sensor: usize, inverse: impl Fn(Five) -> Five, transposed: impl Fn(Five) -> Five) {
        let first = sensor * BLOCKS_A_SENSOR;
        change_five(&mut self.errors, first, inverse);
        change_five(&mut self.lambda, first, &transposed);
        if self.with_information {
            self.information.transform(first, &transposed);
        }
        self.carried.iter_mut().for_each(|carried| transform_row(carried, first, &transposed));
        if let Some(aside) = &mut self.aside {
            transform_row(&mut aside.row, first, &transposed);
        }
    }

    fn undo_add_multiple(&mut self, a: usize, b: usize, factor: &Matrix3<f64>) {
        let transposed = factor.transpose();
        if self.with_information {
            self.information.add_multiple(b, a, &transposed);
        }
        self.carried.iter_mut().for_each(|carried| carried.add_multiple(b, a, &transposed));
        let (lambda, error) = (self.lambda[a], self.errors[b]);
        self.lambda[b] += transposed * lambda;
        self.errors[a] -= factor * error;
        if let Some(aside) = &mut self.aside {
            aside.row.add_multiple(b, a, &transposed);
        }
    }

    /// The error set aside was c = g e: λ ← λ + g' λ_c, Λ ← Λ + g' Λ_ce + Λ_ec g + g' Λ_cc g.
    fn undo_set_aside(&mut self, numbers: &mut Vec<f64>) {
        let mut g = Rows::<1, B>::zeros();
        let start = numbers.len().saturating_sub(3 * B);
        g.0.as_flattened_mut().as_flattened_mut().copy_from_slice(&numbers[start..]);
        numbers.truncate(start);
        let Some(aside) = self.aside.take() else { return };
        let mut d = g.times(&SMatrix::<f64, 1, 1>::new(-0.5 * aside.information));
        d.subtract(&aside.row);
        for block in 0..B {
            let own = g.block(block).transpose();
            if own != Vector3::zeros() {
                self.information.subtract_both_products(block, &own, &d);
                self.lambda[block] += own * aside.lambda;
            }
        }
    }

    fn undo_update<const M: usize>(&mut self, blocks: &[u8], taken: AsideTaken, numbers: &mut Vec<f64>) {
        let own_gain = if taken == AsideTaken::Gains { M } else { 0 };
        let start = numbers.len().saturating_sub(3 * M * (blocks.len() + B) + M * M + 2 * M + own_gain);
        let mut rest = &numbers[start..];
        let mut take = |count: usize| {
            let (taken, left) = rest.split_at(count);
            rest = left;
            taken
        };
        let mut h_transposed = [(0, SMatrix::<f64, 3, M>::zeros()); super::observation::MOST_BLOCKS];
        for (place, block) in h_transposed.iter_mut().zip(blocks) {
            let jacobian = SMatrix::<f64, M, 3>::from_column_slice(take(3 * M));
            *place = (usize::from(*block), jacobian.transpose());
        }
        let h_transposed = &h_transposed[..blocks.len()];
        let mut gain = Rows::<M, B>::zeros();
        gain.0.as_flattened_mut().as_flattened_mut().copy_from_slice(take(3 * M * B));
        let s_inverse = SMatrix::<f64, M, M>::from_column_slice(take(M * M));
        let mut say = SVector::<f64, M>::from_column_slice(take(M));
        let innovation = SVector::<f64, M>::from_column_slice(take(M));
        // An error that was set aside and never used is not spoken of.
        let own_gain = (taken == AsideTaken::Gains && self.aside.is_some())
            .then(|| SVector::<f64, M>::from_column_slice(take(M)));

        for carried in &mut self.carried {
            let corrected = carried.times_transposed(&gain);
            for (block, t) in h_transposed {
                let off = corrected * t.transpose();
                for m in 0..4 {
                    for axis in 0..3 {
                        carried.0[m][*block][axis] -= off[(m, axis)];
                    }
                }
            }
        }
        if !self.with_information && taken == AsideTaken::None {
            say -= gain.of(&self.lambda);
            for (block, t) in h_transposed {
                self.lambda[*block] += t * say;
            }
            for (error, put_on) in self.errors.iter_mut().zip(&gain.transposed_times(&innovation)) {
                *error += put_on;
            }
            numbers.truncate(start);
            return;
        }

        // Λ ← Λ − T D − D' T' with T = H' and D = K' Λ − (K' Λ K + S⁻¹) T' / 2.
        let mut d = self.information.times_rows(&gain);
        let mut inner = s_inverse;
        if let (Some(own_gain), Some(aside)) = (&own_gain, &mut self.aside) {
            let column: SMatrix<f64, M, 1> = own_gain.clone_owned();
            d.add(&aside.row.times(&column));
            let with_itself = gain.times_transposed(&aside.row) + own_gain * aside.information;
            inner += with_itself * own_gain.transpose();
            for (block, t) in h_transposed {
                let off = t * with_itself;
                aside.row.0[0][*block].iter_mut().zip(&off).for_each(|(cell, off)| *cell -= off);
            }
            say -= own_gain * aside.lambda;
        }
        inner += d.times_transposed(&gain);
        for (block, t) in h_transposed {
            let half = (t * inner.transpose() * 0.5).transpose();
            for m in 0..M {
                for axis in 0..3 {
                    d.0[m][*block][axis] -= half[(m, axis)];
                }
            }
        }
        for (block, t) in h_transposed {
            self.information.subtract_both_products(*block, t, &d);
        }
        say -= gain.of(&self.lambda);
        for (block, t) in h_transposed {
            self.lambda[*block] += t * say;
        }
        if taken == AsideTaken::Measured {
            // Its Jacobian is 1, and of what comes later nothing depends on it.
            let mut row = d.times(&SMatrix::<f64, 1, M>::repeat(-1.0));
            for (block, t) in h_transposed {
                let half = t * inner.column(0) * 0.5;
                row.0[0][*block].iter_mut().zip(&half).for_each(|(cell, half)| *cell += half);
            }
            self.aside = Some(OfAside { lambda: say[0], information: inner[(0, 0)], row });
        }
        for (error, put_on) in self.errors.iter_mut().zip(&gain.transposed_times(&innovation)) {
            *error += put_on;
        }
        numbers.truncate(start);
    }

    /// The error of a block by its row of the covariance, which is on the tape.
    fn by_row(&self, numbers: &mut Vec<f64>) -> Vector3<f64> {
        let start = numbers.len().saturating_sub(9 * B);
        let error = numbers[start..]
            .chunks_exact(9)
            .zip(&self.lambda)
            .map(|(block, lambda)| Matrix3::from_column_slice(block) * lambda)
            .sum();
        numbers.truncate(start);
        error
    }
}

/// Five of the vectors, from number `first` on, become what `map` says.
fn change_five<const B: usize>(vectors: &mut [Vector3<f64>; B], first: usize, map: impl Fn(Five) -> Five) {
    if let Some(five) = vectors[first..].first_chunk_mut::<5>() {
        *five = map(five.map(Into::into)).map(Into::into);
    }
}

/// Takes the last numbers off the tape.
fn pop<const N: usize>(numbers: &mut Vec<f64>) -> [f64; N] {
    let mut last = [0.0; N];
    let start = numbers.len().saturating_sub(N);
    last.iter_mut().zip(&numbers[start..]).for_each(|(to, number)| *to = *number);
    numbers.truncate(start);
    last
}

#[cfg(test)]
#[path = "adjoint_tests.rs"]
mod tests;
