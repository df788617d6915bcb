//! How the errors of one sensor grow: the transition of paper 1, §2.2, applied block by block.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::block_covariance::BlockCovariance;
use super::layout::BLOCKS_A_SENSOR;
use super::layout::ErrorState::{AccelerometerBias, Attitude, GyroBias, Position, Velocity};
use super::mechanization::Increment;
use super::process_noise::{Growth, ProcessNoise};
use super::sensor_map::SensorMap;

/// The transition over one or several steps of the strapdown, gathered sample by sample so that the
/// covariance need not be propagated at every one of them.
///
/// With the signs of the notation page (biases true − estimated, velocity estimated − true):
/// δφ̇ = −C δb_g, δv̇ = [f_n×] φ + C δb_a, δṗ = δv. Paper 1 prints −C in the velocity row, which
/// holds for an accelerometer bias of the other sign. By the attitude the position goes as the strapdown's own does, by
/// the accelerometer bias and the velocity by the mean of the velocity before and after; what else is of second order in the interval (100 ms in a swing, 180 ms at most where a
/// foot stands) is left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Transition {
    dt_s: f64,
    c_nb_dt: Matrix3<f64>,
    f_n_dt: Vector3<f64>,
    /// Double integral of the specific force, as the strapdown's position takes it, m.
    f_n_dt2: Vector3<f64>,
    /// Integrals of the squares of rate and acceleration on each axis of n, rad²/s and m²/s³.
    rate_squared_dt: Vector3<f64>,
    acceleration_squared_dt: Vector3<f64>,
}

impl Transition {
    /// Over no time at all.
    pub fn none() -> Self {
        Transition {
            dt_s: 0.0,
            c_nb_dt: Matrix3::zeros(),
            f_n_dt: Vector3::zeros(),
            f_n_dt2: Vector3::zeros(),
            rate_squared_dt: Vector3::zeros(),
            acceleration_squared_dt: Vector3::zeros(),
        }
    }

    /// How long it has become, s.
    #[inline]
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Goes on by one step of the strapdown that ended in the attitude `c_nb`.
    #[inline]
    pub fn extend(&mut self, step: &Increment, c_nb: &Matrix3<f64>) {
        self.dt_s += step.dt_s;
        self.c_nb_dt += c_nb * step.dt_s;
        self.f_n_dt2 += (self.f_n_dt + step.f_n * (0.5 * step.dt_s)) * step.dt_s;
        self.f_n_dt += step.f_n * step.dt_s;
        self.rate_squared_dt += step.w_nb_n.component_mul(&step.w_nb_n) * step.dt_s;
        self.acceleration_squared_dt += step.acceleration_n.component_mul(&step.acceleration_n) * step.dt_s;
    }

    /// Integral of the squared rate on each axis of n, rad²/s.
    pub fn rate_squared_dt(&self) -> Vector3<f64> {
        self.rate_squared_dt
    }

    /// Integral of the squared acceleration on each axis of n, m²/s³.
    pub fn acceleration_squared_dt(&self) -> Vector3<f64> {
        self.acceleration_squared_dt
    }

    /// P ← Φ P Φ' + Q for the errors of sensor number `sensor`, its cross-covariance with
    /// everything else included; the others' own blocks stay as they are.
    #[inline]
    pub fn apply<const B: usize>(
        &self,
        covariance: &mut BlockCovariance<B>,
        sensor: usize,
        noise: &impl ProcessNoise,
    ) {
        self.propagation(noise).apply(covariance, sensor);
    }

    /// The transition with its noise: all that a filter and a smoother need of it.
    #[inline]
    pub(super) fn propagation(&self, noise: &impl ProcessNoise) -> Propagation {
        let c = &self.c_nb_dt;
        let kept = noise.biases_kept(self.dt_s);
        Propagation {
            map: SensorMap {
                c: std::array::from_fn(|row| std::array::from_fn(|column| c[(row, column)])),
                f: self.f_n_dt.into(),
                k: (self.f_n_dt2 - self.f_n_dt * (0.5 * self.dt_s)).into(),
                half_s: 0.5 * self.dt_s,
                gyro_bias_kept: kept.gyro,
                accelerometer_bias_kept: kept.accelerometer,
            },
            growth: noise.growth(self),
        }
    }
}

/// Φ and Q of one transition.
#[derive(Clone, Copy, Debug)]
pub(super) struct Propagation {
    /// Φ.
    pub(super) map: SensorMap,
    /// Q.
    pub(super) growth: Growth,
}

impl Propagation {
    #[inline]
    pub(super) fn apply<const B: usize>(&self, covariance: &mut BlockCovariance<B>, sensor: usize) {
        let (map, growth) = (&self.map, &self.growth);
        covariance.transform(sensor * BLOCKS_A_SENSOR, |errors| map.forward(errors));
        for (state, variance) in [
            (Attitude, &growth.attitude),
            (GyroBias, &growth.gyro_bias),
            (AccelerometerBias, &growth.accelerometer_bias),
            (Position, &growth.position),
        ] {
            covariance.add_noise(state.of(sensor), variance);
        }
        let (position, velocity) = (Position.of(sensor), Velocity.of(sensor));
        covariance.add_shared_noise(position, velocity, growth.position_share_s, &growth.velocity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::imu_noise::{GaussMarkov, ImuNoise};
    use crate::ins::mechanization::advance;
    use crate::ins::nav_state::NavState;
    use crate::rotation::{cayley, skew};
    use nalgebra::{DMatrix, DVector};

    const GRAVITY: f64 = 9.787;

    fn nominal() -> NavState {
        NavState {
            c_nb: cayley(&Vector3::new(0.4, -0.7, 1.1)),
            v_n: Vector3::new(1.0, -0.4, 0.2),
            p_n: Vector3::new(3.0, 5.0, -1.0),
            gyro_bias_b: Vector3::new(0.01, 0.0, -0.02),
            accelerometer_bias_b: Vector3::new(0.05, -0.03, 0.02),
        }
    }

    /// The estimated state whose error against `truth` is `e`.
    fn estimated(truth: &NavState, e: &DVector<f64>) -> NavState {
        let part = |k: usize| Vector3::new(e[3 * k], e[3 * k + 1], e[3 * k + 2]);
        NavState {
            c_nb: cayley(&-part(0)) * truth.c_nb,
            gyro_bias_b: truth.gyro_bias_b - part(1),
            p_n: truth.p_n + part(2),
            v_n: truth.v_n + part(3),
            accelerometer_bias_b: truth.accelerometer_bias_b - part(4),
        }
    }

    fn error(estimate: &NavState, truth: &NavState) -> DVector<f64> {
        let turn = truth.c_nb * estimate.c_nb.transpose();
        let phi = Vector3::new(
            turn[(2, 1)] - turn[(1, 2)],
            turn[(0, 2)] - turn[(2, 0)],
            turn[(1, 0)] - turn[(0, 1)],
        ) * 0.5;
        let parts = [
            phi,
            truth.gyro_bias_b - estimate.gyro_bias_b,
            estimate.p_n - truth.p_n,
            estimate.v_n - truth.v_n,
            truth.accelerometer_bias_b - estimate.accelerometer_bias_b,
        ];
        DVector::from_iterator(15, parts.iter().flat_map(|v| v.iter().copied()))
    }

    fn walk_on(state: &mut NavState, transition: &mut Transition, samples: usize, dt_s: f64) {
        for k in 0..samples {
            let t = k as f64 * dt_s;
            let w = Vector3::new(2.0 * (3.0 * t).sin(), 4.0 * (2.0 * t).cos(), -1.0);
            let f = Vector3::new(3.0 * (5.0 * t).cos(), 2.0, 9.0 + 4.0 * (4.0 * t).sin());
            let step = advance(state, &w, &w, &f, dt_s, GRAVITY);
            transition.extend(&step, &state.c_nb);
        }
    }

    /// Φ as the notation page writes it.
    fn phi(transition: &Transition) -> DMatrix<f64> {
        let mut dense = DMatrix::identity(15, 15);
        let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
            dense.view_mut((3 * row, 3 * column), (3, 3)).copy_from(&block);
        };
        set(0, 1, -transition.c_nb_dt);
        set(2, 3, Matrix3::identity() * transition.dt_s);
        set(2, 0, skew(&transition.f_n_dt2));
        set(2, 4, transition.c_nb_dt * (0.5 * transition.dt_s));
        set(3, 0, skew(&transition.f_n_dt));
        set(3, 4, transition.c_nb_dt);
        dense
    }

    #[test]
    fn the_transition_is_the_derivative_of_the_mechanization() {
        let (samples, dt_s) = (2, 0.01);
        let mut truth = nominal();
        let mut transition = Transition::none();
        walk_on(&mut truth, &mut transition, samples, dt_s);
        let phi = phi(&transition);
        for k in 0..15 {
            let step = 1e-5;
            let difference = |sign: f64| {
                let mut e = DVector::zeros(15);
                e[k] = sign * step;
                let mut state = estimated(&nominal(), &e);
                walk_on(&mut state, &mut Transition::none(), samples, dt_s);
                error(&state, &truth)
            };
            let derivative = (difference(1.0) - difference(-1.0)) / (2.0 * step);
            // The model leaves out
            for row in 0..15 {
                let off = (derivative[row] - phi[(row, k)]).abs();
                assert!(off < 4e-3, "row {row}, column {k}: {} and {}", derivative[row], phi[(row, k)]);
            }
        }
    }

    #[test]
    fn propagation_by_blocks_is_the_dense_product_with_the_other_foot_s_cross_covariance() {
        let factor = DMatrix::from_fn(30, 30, |r, c| ((r * 5 + c * 11) as f64).cos());
        let p = &factor * factor.transpose();
        for sensor in [0, 1] {
            let mut covariance = BlockCovariance::<10>::zeros();
            for i in 0..10 {
                for j in i..10 {
                    covariance.set(i, j, &Matrix3::from_fn(|r, c| p[(3 * i + r, 3 * j + c)]));
                }
            }
            let mut transition = Transition::none();
            walk_on(&mut nominal(), &mut transition, 2, 0.01);
            let mut dense_phi = DMatrix::identity(30, 30);
            dense_phi.view_mut((15 * sensor, 15 * sensor), (15, 15)).copy_from(&phi(&transition));
            let noise = ImuNoise {
                angle_random_walk_rad_sqrt_s: 2e-4,
                velocity_random_walk_m_s_sqrt_s: 0.02,
                gyro_bias_rad_s: GaussMarkov { sigma: 1e-3, correlation_time_s: 30.0 },
                accelerometer_bias_m_s2: GaussMarkov { sigma: 0.05, correlation_time_s: 20.0 },
                gyro_scale_factor: GaussMarkov::CONSTANT,
                accelerometer_scale_factor: GaussMarkov::CONSTANT,
            };
            let dt_s = transition.dt_s();
            for (block, process) in [(1, noise.gyro_bias_rad_s), (4, noise.accelerometer_bias_m_s2)] {
                for k in (15 * sensor + 3 * block..).take(3) {
                    dense_phi[(k, k)] = process.kept(dt_s);
                }
            }
            let mut q = DMatrix::zeros(30, 30);
            for axis in 0..3 {
                let at = |block: usize| 15 * sensor + 3 * block + axis;
                q[(at(0), at(0))] = noise.angle_random_walk_rad_sqrt_s.powi(2) * dt_s;
                q[(at(1), at(1))] = noise.gyro_bias_rad_s.growth(dt_s);
                q[(at(4), at(4))] = noise.accelerometer_bias_m_s2.growth(dt_s);
                let (position, velocity, half_s) = (at(2), at(3), 0.5 * dt_s);
                let pushed = noise.velocity_random_walk_m_s_sqrt_s.powi(2) * dt_s;
                q[(velocity, velocity)] = pushed;
                q[(position, velocity)] = half_s * pushed;
                q[(velocity, position)] = half_s * pushed;
                q[(position, position)] = half_s * half_s * pushed;
            }
            let expected = &dense_phi * &p * dense_phi.transpose() + q;
            transition.apply(&mut covariance, sensor, &noise);
            let difference = (covariance.dense() - expected).abs().max();
            assert!(difference < 1e-10, "{difference}");
        }
    }
}
