//! The strapdown's error transition against differences of the strapdown itself.

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::geo::{Geodetic, LocalFrame};
use crate::ins::aside::Aside;
use crate::ins::block_covariance::BlockCovariance;
use crate::ins::differences::{Estimated, Random, Rig, part};
use crate::ins::layout::{ErrorState, Layout};
use crate::ins::linear_maps::Rows;

/// Two strapdowns, one with scale factors, a lever arm and a place.
const B: usize = 2 * 5 + 2 + 2;
const N: usize = 3 * B;
/// Samples to a propagation of the covariance.
const SAMPLES: usize = 20;

/// No noise, and biases and scale factors that fade.
const FADING: ImuNoise = ImuNoise {
    angle_random_walk_rad_sqrt_s: 0.0,
    velocity_random_walk_m_s_sqrt_s: 0.0,
    gyro_bias_rad_s: GaussMarkov { sigma: 0.0, correlation_time_s: 3.0 },
    accelerometer_bias_m_s2: GaussMarkov { sigma: 0.0, correlation_time_s: 2.0 },
    gyro_scale_factor: GaussMarkov { sigma: 0.0, correlation_time_s: 4.0 },
    accelerometer_scale_factor: GaussMarkov { sigma: 0.0, correlation_time_s: 5.0 },
};

fn fast() -> LocalFrame {
    LocalFrame::new(Geodetic { latitude_deg: 25.652_944, longitude_deg: 106.856_667, height_m: 1110.0 })
}

/// Readings of a body that swings and is pushed about, as means over intervals of 5 ms.
fn readings(seed: u64, sensor: u64) -> Vec<ImuInterval> {
    let mut random = Random::new(1000 + 10 * seed + sensor);
    let (w, f) = ([random.vector(1.0), random.vector(1.0)], [random.vector(4.0), random.vector(4.0)]);
    (0..SAMPLES)
        .map(|k| {
            let t_s = k as f64 * 0.005;
            ImuInterval {
                dt_s: 0.005,
                w_ib_b: w[0] * libm::sin(3.0 * t_s) + w[1],
                f_b: f[0] * libm::cos(7.0 * t_s) + f[1] + Vector3::z() * 9.8,
            }
        })
        .collect()
}

fn advance(rig: &mut Rig, earth: &Earth, seed: u64) {
    for (sensor, strapdown) in (0..).zip(&mut rig.strapdowns) {
        for interval in readings(seed, sensor) {
            strapdown.advance(earth, &interval);
        }
    }
}

fn propagate(rig: &mut Rig, eskf: &mut Eskf<B>, earth: &Earth) {
    for strapdown in &mut rig.strapdowns {
        strapdown.propagate(eskf, earth, &FADING);
    }
}

/// Errors of `estimate` against `truth`, by the notation page.
fn errors(estimate: &Rig, truth: &Rig) -> DVector<f64> {
    let mut e = DVector::zeros(N);
    let mut set = |block: usize, error: Vector3<f64>| e.fixed_rows_mut::<3>(3 * block).copy_from(&error);
    for (estimate, truth) in estimate.strapdowns.iter().zip(&truth.strapdowns) {
        let turn = nalgebra::Rotation3::from_matrix_unchecked(truth.nav.c_nb * estimate.nav.c_nb.transpose());
        let first = truth.states().sensor() * 5;
        set(first, turn.scaled_axis());
        set(first + 1, truth.nav.gyro_bias_b - estimate.nav.gyro_bias_b);
        set(first + 2, estimate.nav.p_n - truth.nav.p_n);
        set(first + 3, estimate.nav.v_n - truth.nav.v_n);
        set(first + 4, truth.nav.accelerometer_bias_b - estimate.nav.accelerometer_bias_b);
        if let Some(scale) = truth.states().gyro_scale() {
            set(scale.block(), truth.gyro_scale - estimate.gyro_scale);
        }
        if let Some(scale) = truth.states().accelerometer_scale() {
            set(scale.block(), truth.accelerometer_scale - estimate.accelerometer_scale);
        }
    }
    set(truth.arms[1].state.unwrap().block(), truth.arms[1].arm_b_m - estimate.arms[1].arm_b_m);
    set(truth.places[0].1.block(), estimate.places[0].0 - truth.places[0].0);
    e
}

/// Φ column by column: what the filter makes of an error that was set aside.
fn transition(rig: &Rig, earth: &Earth) -> DMatrix<f64> {
    let mut phi = DMatrix::zeros(N, N);
    for k in 0..N {
        let mut row = Rows::zeros();
        row.row_mut(0)[k] = 1.0;
        let mut eskf = Eskf::<B>::new();
        eskf.aside = Some(Aside { row, variance: 0.0, corrected: 0.0 });
        propagate(&mut rig.clone(), &mut eskf, earth);
        phi.set_column(k, &DVector::from_column_slice(eskf.aside.unwrap().row.row(0)));
    }
    phi
}

/// How far the transition is off differences of the strapdown, block by block: in units of what the errors
/// typically are, the largest difference, and the largest change from what the errors were.
fn off(start: &Rig, earth: &Earth, seed: u64) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut truth = start.clone();
    advance(&mut truth, earth, seed);
    let phi = transition(&truth, earth);
    propagate(&mut truth, &mut Eskf::<B>::new(), earth);
    let typical = start.typical();
    let (mut off, mut change) = (DMatrix::<f64>::zeros(B, B), DMatrix::<f64>::zeros(B, B));
    for k in 0..N {
        let step = typical[k / 3];
        let after = |sign: f64| {
            let mut e = DVector::zeros(N);
            e[k] = sign * step;
            let mut estimate = start.with_errors(&e);
            advance(&mut estimate, earth, seed);
            propagate(&mut estimate, &mut Eskf::<B>::new(), earth);
            errors(&estimate, &truth)
        };
        let (found, predicted) = ((after(1.0) - after(-1.0)) * 0.5, phi.column(k) * step);
        for (block, scale) in typical.iter().enumerate() {
            let at = (block, k / 3);
            let predicted = part(&predicted, block);
            off[at] = off[at].max((part(&found, block) - predicted).norm() / scale);
            let mut before = DVector::zeros(N);
            before[k] = step;
            change[at] = change[at].max((predicted - part(&before, block)).norm() / scale);
        }
    }
    (off, change)
}

#[test]
fn the_transition_of_any_set_of_sensors_is_the_derivative_of_the_strapdown() {
    // Over 0.1 s of swings. What differs is of second order in the share of one sample, 1/20; and with Earth, of
    // second order in how far it turns, which only shows where it turns a hundred times too fast.
    const TOLERANCE: f64 = 2e-3;
    let still = Earth::still(9.787);
    let turning = Earth::turning(&fast());
    let spinning = Earth::spinning(Vector3::new(0.0, 0.0066, 0.0032));
    for seed in 0..10 {
        for earth in [&still, &turning, &spinning] {
            for with_scale in [[true, false], [false, true]] {
                let (off, change) = off(&Rig::random(seed, &with_scale), earth, seed);
                for row in 0..B {
                    for column in 0..B {
                        let (off, change) = (off[(row, column)], change[(row, column)]);
                        assert!(
                            off < TOLERANCE * (change + 1e-6),
                            "seed {seed}, {earth:?}: block {row} by {column} is {off:e} off, of {change:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_covariance_goes_through_the_same_transition_with_all_it_is_correlated_with() {
    let earth = Earth::turning(&fast());
    for seed in 0..4 {
        let mut rig = Rig::random(seed, &[true, false]);
        advance(&mut rig, &earth, seed);
        let phi = transition(&rig, &earth);
        let mut random = Random::new(seed);
        let factor = DMatrix::from_fn(N, N, |_, _| random.normal());
        let p = &factor * factor.transpose();
        let mut eskf = Eskf::<B>::new();
        for i in 0..B {
            for j in i..B {
                eskf.covariance.set(i, j, &Matrix3::from_fn(|r, c| p[(3 * i + r, 3 * j + c)]));
            }
        }
        propagate(&mut rig, &mut eskf, &earth);
        let expected = &phi * &p * phi.transpose();
        let off = (eskf.covariance.dense() - &expected).abs().max() / expected.abs().max();
        assert!(off < 1e-13, "{off}");
    }
}

#[test]
fn the_noise_grows_with_its_densities_and_correlates_attitude_velocity_and_position() {
    // A body at rest: attitude noise tilts gravity, which pulls on velocity and position.
    let noise = ImuNoise {
        angle_random_walk_rad_sqrt_s: 1e-4,
        velocity_random_walk_m_s_sqrt_s: 1e-3,
        gyro_bias_rad_s: GaussMarkov { sigma: 1e-7, correlation_time_s: 100.0 },
        accelerometer_bias_m_s2: GaussMarkov { sigma: 1e-5, correlation_time_s: 50.0 },
        gyro_scale_factor: GaussMarkov { sigma: 1e-6, correlation_time_s: 200.0 },
        accelerometer_scale_factor: GaussMarkov { sigma: 2e-6, correlation_time_s: 300.0 },
    };
    let mut layout = Layout::of_strapdowns(1);
    let states = layout.with_scale_factors(0);
    let earth = Earth::still(9.8);
    let nav = NavState {
        c_nb: Matrix3::identity(),
        v_n: Vector3::zeros(),
        p_n: Vector3::zeros(),
        gyro_bias_b: Vector3::zeros(),
        accelerometer_bias_b: Vector3::zeros(),
    };
    let covariance = |propagations: usize| {
        let mut strapdown = Strapdown::new(states, nav.clone());
        let mut eskf = Eskf::<7>::new();
        for _ in 0..propagations {
            for _ in 0..200 / propagations {
                let f_b = Vector3::z() * 9.8;
                strapdown.advance(&earth, &ImuInterval { dt_s: 0.005, w_ib_b: Vector3::zeros(), f_b });
            }
            strapdown.propagate(&mut eskf, &earth, &noise);
        }
        eskf.covariance
    };
    // In 1 s: the integrals of white noise, and of that which tilts gravity.
    let (tilt, pull) = (1e-8, 1e-6);
    let level = |covariance: &BlockCovariance<7>, a: ErrorState, b: ErrorState| {
        covariance.block(states.block(a), states.block(b))[(0, 0)]
    };
    for (propagations, tolerance) in [(200, 1e-3), (20, 1e-2), (5, 0.05)] {
        let covariance = covariance(propagations);
        for (a, b, expected) in [
            (Attitude, Attitude, tilt),
            (Velocity, Velocity, pull + 9.8 * 9.8 * tilt / 3.0),
            (Position, Velocity, pull / 2.0 + 9.8 * 9.8 * tilt / 8.0),
            (Position, Position, pull / 3.0 + 9.8 * 9.8 * tilt / 20.0),
        ] {
            let found = level(&covariance, a, b);
            assert!((found / expected - 1.0).abs() < tolerance, "{a:?} {b:?}: {found} {expected}");
        }
        for (block, process) in [
            (states.block(ErrorState::GyroBias), noise.gyro_bias_rad_s),
            (states.block(ErrorState::AccelerometerBias), noise.accelerometer_bias_m_s2),
            (states.gyro_scale().unwrap().block(), noise.gyro_scale_factor),
            (states.accelerometer_scale().unwrap().block(), noise.accelerometer_scale_factor),
        ] {
            let found = covariance.block(block, block)[(2, 2)];
            assert!((found / process.growth(1.0) - 1.0).abs() < 1e-9, "block {block}: {found}");
        }
    }
}
