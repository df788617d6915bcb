//! The joint block filter of two feet against the same filter as a textbook writes it: one dense
//! state of thirty errors, one dense transition, Joseph's update. Both walk with simulated feet.

use lodestep_engine::geo::Site;
use lodestep_engine::ins::error_model::Transition;
use lodestep_engine::ins::eskf::Eskf;
use lodestep_engine::ins::layout::ErrorState;
use lodestep_engine::ins::mechanization::advance;
use lodestep_engine::ins::nav_state::NavState;
use lodestep_engine::ins::observation::Observation;
use lodestep_engine::measure::magnetic_heading::magnetic_heading;
use lodestep_engine::measure::zero_velocity::zero_velocity;
use lodestep_engine::rotation::skew;
use lodestep_engine::sim::pedestrian::{Epoch, FootTruth, SensorModel, Simulator, WalkKind};
use lodestep_engine::systems::pedestrian::foot_noise::FootNoise;
use lodestep_engine::systems::pedestrian::foot_separation::{Beside, foot_separation};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const GRAVITY_M_S2: f64 = 9.787;
const DT_S: f64 = 0.01;
/// Samples to a propagation.
const EVERY: usize = 2;

/// Both filters with a nominal state of their own each.
struct Pair {
    blocks: Eskf<10>,
    block_feet: [NavState; 2],
    dense: DMatrix<f64>,
    dense_feet: [NavState; 2],
    noise: FootNoise,
}

/// A foot at the first epoch.
fn first_state(truth: &FootTruth) -> NavState {
    NavState {
        c_nb: truth.q_nb.to_rotation_matrix().into_inner(),
        v_n: truth.velocity_n_m_s.into(),
        p_n: truth.position_n_m.into(),
        gyro_bias_b: Vector3::new(0.002, -0.001, 0.001),
        accelerometer_bias_b: Vector3::zeros(),
    }
}

/// Half a minute from the last seconds of the standing start on: 15 s of walking and standing again.
fn walk() -> Vec<Epoch> {
    let kind = WalkKind::Line { metres: 20.0 };
    let mut simulator = Simulator::new(&kind, 5, &Site::fast(), &SensorModel::cmp10a());
    std::iter::from_fn(|| simulator.next_epoch()).skip(1_000).collect()
}

impl Pair {
    fn new(start: &Epoch) -> Pair {
        let mut blocks = Eskf::new();
        for sensor in [0, 1] {
            for (state, sigma) in [
                (ErrorState::Attitude, 0.05),
                (ErrorState::GyroBias, 2e-3),
                (ErrorState::Position, 0.1),
                (ErrorState::Velocity, 0.01),
                (ErrorState::AccelerometerBias, 0.08),
            ] {
                blocks.covariance.set_diagonal(state.of(sensor), Matrix3::identity() * (sigma * sigma));
            }
        }
        let feet = [0, 1].map(|sensor| first_state(&start.truth[sensor]));
        let dense = blocks.covariance.dense();
        Pair { blocks, block_feet: feet.clone(), dense, dense_feet: feet, noise: FootNoise::default() }
    }

    /// A foot goes on by a propagation interval.
    fn propagate(&mut self, sensor: usize, epochs: &[Epoch]) {
        let mut transition = Transition::none();
        let (mut dt_s, mut c_dt, mut f_dt) = (0.0, Matrix3::zeros(), Vector3::zeros());
        let mut f_dt2 = Vector3::zeros();
        let (mut turning, mut pushing) = (Vector3::<f64>::zeros(), Vector3::<f64>::zeros());
        for pair in epochs.windows(2) {
            let [before, sample] = [0, 1].map(|k| pair[k].samples[sensor]);
            let (before, w) = (before.w_ib_b_rad_s.into(), sample.w_ib_b_rad_s.into());
            let f = sample.f_b_m_s2.into();
            let foot = &mut self.block_feet[sensor];
            let made = advance(foot, &before, &w, &f, DT_S, GRAVITY_M_S2);
            transition.extend(&made, &foot.c_nb);
            let foot = &mut self.dense_feet[sensor];
            let made = advance(foot, &before, &w, &f, DT_S, GRAVITY_M_S2);
            dt_s += DT_S;
            c_dt += foot.c_nb * DT_S;
            f_dt2 += f_dt * DT_S + made.f_n * (0.5 * DT_S * DT_S);
            f_dt += made.f_n * DT_S;
            turning += made.w_nb_n.map(|rate| rate * rate * DT_S);
            pushing += made.acceleration_n.map(|acceleration| acceleration * acceleration * DT_S);
        }
        transition.apply(&mut self.blocks.covariance, sensor, &self.noise);

        let noise = &self.noise;
        let mut phi = DMatrix::identity(30, 30);
        let mut set = |row: ErrorState, column: ErrorState, block: Matrix3<f64>| {
            phi.view_mut((3 * row.of(sensor), 3 * column.of(sensor)), (3, 3)).copy_from(&block);
        };
        let kept = |correlation_s: f64| Matrix3::identity() * (1.0 - dt_s / correlation_s);
        set(ErrorState::GyroBias, ErrorState::GyroBias, kept(noise.gyro_bias_correlation_time_s));
        set(
            ErrorState::AccelerometerBias,
            ErrorState::AccelerometerBias,
            kept(noise.accelerometer_bias_correlation_time_s),
        );
        set(ErrorState::Attitude, ErrorState::GyroBias, -c_dt);
        set(ErrorState::Velocity, ErrorState::Attitude, skew(&f_dt));
        set(ErrorState::Velocity, ErrorState::AccelerometerBias, c_dt);
        // The position goes by the mean of the velocity before and after, but for what the attitude turns.
        let half_s = 0.5 * dt_s;
        set(ErrorState::Position, ErrorState::Velocity, Matrix3::identity() * dt_s);
        set(ErrorState::Position, ErrorState::Attitude, skew(&f_dt2));
        set(ErrorState::Position, ErrorState::AccelerometerBias, c_dt * half_s);
        self.dense = &phi * &self.dense * phi.transpose();
        let turning = turning * noise.angle_random_walk_share_sqrt_s.powi(2);
        let pushing = pushing * noise.velocity_random_walk_share_sqrt_s.powi(2);
        let none = Vector3::zeros();
        for (state, density, motion) in [
            (ErrorState::Attitude, noise.angle_random_walk_rad_sqrt_s, turning),
            (ErrorState::GyroBias, noise.gyro_bias_random_walk_rad_s_sqrt_s, none),
            (ErrorState::Velocity, noise.velocity_random_walk_m_s_sqrt_s, pushing),
            (ErrorState::AccelerometerBias, noise.accelerometer_bias_random_walk_m_s2_sqrt_s, none),
        ] {
            for axis in 0..3 {
                let k = 3 * state.of(sensor) + axis;
                let variance = density * density * dt_s + motion[axis];
                self.dense[(k, k)] += variance;
                if state == ErrorState::Velocity {
                    let position = 3 * ErrorState::Position.of(sensor) + axis;
                    self.dense[(position, k)] += half_s * variance;
                    self.dense[(k, position)] += half_s * variance;
                    self.dense[(position, position)] += half_s * half_s * variance;
                }
            }
        }
        let up = 3 * ErrorState::Position.of(sensor) + 2;
        self.dense[(up, up)] += noise.height_random_walk_m_sqrt_s.powi(2) * dt_s;
    }

    /// Both filters weigh a measurement, each of its own nominal state.
    fn update<const M: usize>(&mut self, model: impl Fn(&[NavState; 2]) -> Observation<M>) {
        self.update_blocks(&model(&self.block_feet));
        let observation = model(&self.dense_feet);
        let mut h = DMatrix::zeros(M, 30);
        for (block, jacobian) in observation.jacobians() {
            let mut place = h.view_mut((0, 3 * block), (M, 3));
            place += jacobian;
        }
        let r = DMatrix::from_fn(M, M, |row, column| observation.noise[(row, column)]);
        let z = DVector::from_fn(M, |row, _| observation.innovation[row]);
        let s = &h * &self.dense * h.transpose() + &r;
        let gain = s.cholesky().expect("S is positive definite").solve(&(&h * &self.dense)).transpose();
        let i_kh = DMatrix::identity(30, 30) - &gain * &h;
        self.dense = &i_kh * &self.dense * i_kh.transpose() + &gain * r * gain.transpose();
        let errors = gain * z;
        let correction: [Vector3<f64>; 10] =
            std::array::from_fn(|k| Vector3::new(errors[3 * k], errors[3 * k + 1], errors[3 * k + 2]));
        for (sensor, foot) in self.dense_feet.iter_mut().enumerate() {
            foot.correct(sensor, &correction);
        }
    }

    fn update_blocks<const M: usize>(&mut self, observation: &Observation<M>) {
        let update = self.blocks.update(observation, f64::INFINITY);
        let correction = update.correction.expect("every measurement is used");
        for (sensor, foot) in self.block_feet.iter_mut().enumerate() {
            foot.correct(sensor, &correction);
        }
    }

    /// One propagation interval: standing feet are held, now and then see the field, and pass each
    /// other. `epochs` holds the one before the interval, too.
    fn step(&mut self, number: usize, epochs: &[Epoch]) {
        let end = &epochs[epochs.len() - 1];
        for sensor in [0, 1] {
            self.propagate(sensor, epochs);
            if end.truth[sensor].stance {
                self.update(|feet| zero_velocity(sensor, &feet[sensor].v_n, 0.03));
                if let Some(mag_b_ut) = end.samples[sensor].mag_b_ut.filter(|_| number.is_multiple_of(52)) {
                    let mag_b_ut = mag_b_ut.into();
                    self.update(|feet| magnetic_heading(sensor, &feet[sensor].c_nb, &mag_b_ut, -0.04, 0.3));
                }
            }
        }
        if number.is_multiple_of(26) {
            let along_n = Vector3::new(0.3, 1.2, 0.1);
            self.update(|feet| beside_each_other(feet, &along_n, 0.05));
        }
    }
}

/// The separation of the feet as they are now.
fn beside_each_other(feet: &[NavState; 2], along_n: &Vector3<f64>, sigma_m: f64) -> Observation<1> {
    let beside = Beside::new(&feet[0].p_n, &feet[1].p_n, along_n);
    foot_separation(beside.distance_m, 0.13, sigma_m)
        .with(ErrorState::Position.of(0), beside.to_left_n)
        .with(ErrorState::Position.of(1), -beside.to_left_n)
}

fn largest_relative_difference(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    // An element counts against the variances of its row and column.
    let scale = |i: usize, j: usize| (b[(i, i)] * b[(j, j)]).sqrt();
    let differences = (0..30).flat_map(|i| (0..30).map(move |j| (i, j)));
    differences.map(|(i, j)| (a[(i, j)] - b[(i, j)]).abs() / scale(i, j)).fold(0.0, f64::max)
}

#[test]
fn the_block_filter_is_the_dense_one() {
    let walk = walk();
    let mut pair = Pair::new(&walk[0]);
    for number in 0..(walk.len() - 1) / EVERY {
        pair.step(number, &walk[number * EVERY..=(number + 1) * EVERY]);
    }
    // Both have walked, and arrived.
    assert!((pair.block_feet[0].p_n.y - walk[walk.len() - 1].truth[0].position_n_m[1]).abs() < 1.0);
    let covariance = pair.blocks.covariance.dense();
    let off = largest_relative_difference(&covariance, &pair.dense);
    assert!(off < 1e-9, "covariances differ by {off}");
    // What binds the feet is there to be compared.
    assert!(covariance.view((0, 15), (15, 15)).abs().max() > 1e-4);
    for (block, dense) in pair.block_feet.iter().zip(&pair.dense_feet) {
        let off = (block.p_n - dense.p_n).norm() / dense.p_n.norm().max(1.0);
        assert!(off < 1e-9, "positions differ by {off}");
        assert!((block.v_n - dense.v_n).norm() < 1e-9);
        assert!((block.c_nb - dense.c_nb).norm() < 1e-9);
        assert!((block.gyro_bias_b - dense.gyro_bias_b).norm() < 1e-9);
        assert!((block.accelerometer_bias_b - dense.accelerometer_bias_b).norm() < 1e-9);
    }
}

#[test]
fn the_covariance_stays_symmetric_and_positive_definite_for_half_an_hour() {
    // The blocks alone, which the dense filter has shown to be right; the same walk to and fro.
    let walk = walk();
    let intervals = (walk.len() - 1) / EVERY;
    let mut pair = Pair::new(&walk[0]);
    for number in 0..90_000 {
        let at = number % intervals * EVERY;
        let epochs = &walk[at..=at + EVERY];
        for sensor in [0, 1] {
            let mut transition = Transition::none();
            for k in 1..=EVERY {
                let [before, sample] = [k - 1, k].map(|k| epochs[k].samples[sensor]);
                let foot = &mut pair.block_feet[sensor];
                let made = advance(
                    foot,
                    &before.w_ib_b_rad_s.into(),
                    &sample.w_ib_b_rad_s.into(),
                    &sample.f_b_m_s2.into(),
                    DT_S,
                    GRAVITY_M_S2,
                );
                transition.extend(&made, &foot.c_nb);
            }
            transition.apply(&mut pair.blocks.covariance, sensor, &pair.noise);
            if epochs[EVERY].truth[sensor].stance {
                let observation = zero_velocity(sensor, &pair.block_feet[sensor].v_n, 0.01);
                pair.update_blocks(&observation);
            }
        }
        if number.is_multiple_of(26) {
            let observation = beside_each_other(&pair.block_feet, &Vector3::new(0.3, 1.2, 0.1), 0.01);
            pair.update_blocks(&observation);
        }
        if number.is_multiple_of(9_000) || number + 1 == 90_000 {
            let covariance = pair.blocks.covariance.dense();
            assert_eq!(covariance, covariance.transpose(), "symmetric to the bit, after {number} intervals");
            // Scaled to correlations, so that metres do not hide what becomes of the biases.
            let scaled = DMatrix::from_fn(30, 30, |i, j| {
                covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
            });
            let smallest = scaled.symmetric_eigenvalues().min();
            assert!(smallest > 0.0, "smallest eigenvalue {smallest} after {number} intervals");
        }
    }
}
