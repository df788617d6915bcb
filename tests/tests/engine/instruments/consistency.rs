//! A filter of an inertial sensor with scale factors and a GNSS antenna at a lever arm that is estimated: over
//! many seeds it is as wrong as it says.

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::ins::earth::Earth;
use lodestep_engine::ins::eskf::{Eskf, Update};
use lodestep_engine::ins::imu_noise::{GaussMarkov, ImuNoise};
use lodestep_engine::ins::layout::{ErrorState, Layout, SensorStates, StateVariable};
use lodestep_engine::ins::lever_arm::LeverArm;
use lodestep_engine::ins::strapdown::{ImuInterval, Strapdown};
use lodestep_engine::measure::antenna_position::antenna_position;
use lodestep_engine::measure::antenna_velocity::antenna_velocity;
use lodestep_engine::sim::white_noise;
use nalgebra::{DVector, Matrix3, Rotation3, Vector3};

use super::motion::{Motion, SITE};

const SEEDS: u64 = 40;
const DT_S: f64 = 0.01;
const SAMPLES: usize = 6_000;
/// Samples from one solution of the receiver to the next.
const EVERY: usize = 20;
const SIGMA_POSITION_M: f64 = 0.02;
const SIGMA_VELOCITY_M_S: f64 = 0.05;
/// From the sensor to the antenna, in b, m.
const ARM_B_M: Vector3<f64> = Vector3::new(0.1, -0.2, 1.5);

/// A consumer chip: 0.2 °/√h, 0.05 m/s/√h, 20 °/h and 2 mm/s² over 200 s.
const NOISE: ImuNoise = ImuNoise {
    angle_random_walk_rad_sqrt_s: 5.8e-5,
    velocity_random_walk_m_s_sqrt_s: 8e-4,
    gyro_bias_rad_s: GaussMarkov { sigma: 1e-4, correlation_time_s: 200.0 },
    accelerometer_bias_m_s2: GaussMarkov { sigma: 2e-3, correlation_time_s: 200.0 },
    gyro_scale_factor: GaussMarkov::CONSTANT,
    accelerometer_scale_factor: GaussMarkov { sigma: 2e-3, correlation_time_s: 500.0 },
};

/// First sigmas by block: attitude, gyro bias, position, velocity, accelerometer bias, scale factors, lever arm.
const FIRST: [f64; BLOCKS] = [0.02, 2e-4, 0.05, 0.05, 5e-3, 3e-3, 2e-3, 0.03];

struct States {
    imu: SensorStates,
    arm: StateVariable,
    blocks: usize,
}

const STATES: States = {
    let mut layout = Layout::of_strapdowns(1);
    let imu = layout.with_scale_factors(0);
    let arm = layout.add(3);
    States { imu, arm, blocks: layout.blocks() }
};
const BLOCKS: usize = STATES.blocks;

/// The errors that a sensor has beside white noise.
struct Imperfect {
    gyro_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
    gyro_scale: Vector3<f64>,
    accelerometer_scale: Vector3<f64>,
}

fn three(normal: &mut impl FnMut() -> f64, sigma: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| sigma * normal())
}

impl Imperfect {
    fn new(normal: &mut impl FnMut() -> f64) -> Imperfect {
        Imperfect {
            gyro_bias: three(normal, FIRST[1]),
            accelerometer_bias: three(normal, FIRST[4]),
            gyro_scale: three(normal, FIRST[5]),
            accelerometer_scale: three(normal, FIRST[6]),
        }
    }

    fn reads(&mut self, perfect: &ImuInterval, normal: &mut impl FnMut() -> f64) -> ImuInterval {
        let dt_s = perfect.dt_s;
        let mut wander = |error: &mut Vector3<f64>, process: GaussMarkov| {
            *error = *error * process.kept(dt_s) + three(normal, process.growth(dt_s).sqrt());
        };
        wander(&mut self.gyro_bias, NOISE.gyro_bias_rad_s);
        wander(&mut self.accelerometer_bias, NOISE.accelerometer_bias_m_s2);
        wander(&mut self.gyro_scale, NOISE.gyro_scale_factor);
        wander(&mut self.accelerometer_scale, NOISE.accelerometer_scale_factor);
        let scaled = |truth: &Vector3<f64>, scale: &Vector3<f64>| truth + truth.component_mul(scale);
        ImuInterval {
            dt_s,
            w_ib_b: scaled(&perfect.w_ib_b, &self.gyro_scale)
                + self.gyro_bias
                + three(normal, NOISE.angle_random_walk_rad_sqrt_s / dt_s.sqrt()),
            f_b: scaled(&perfect.f_b, &self.accelerometer_scale)
                + self.accelerometer_bias
                + three(normal, NOISE.velocity_random_walk_m_s_sqrt_s / dt_s.sqrt()),
        }
    }
}

/// The filter's own estimate.
struct Estimate {
    strapdown: Strapdown,
    arm: LeverArm,
    eskf: Eskf<BLOCKS>,
}

impl Estimate {
    fn correct(&mut self, update: &Update<BLOCKS>) {
        let correction = update.correction.as_ref().expect("without a gate every measurement is used");
        self.strapdown.correct(correction);
        self.arm.correct(correction);
    }

    /// Normalised squared error of the states from block `from` to block `to`.
    fn nees(&self, errors: &[Vector3<f64>; BLOCKS], blocks: &[usize]) -> f64 {
        let dense = self.eskf.covariance.dense();
        let places: Vec<usize> = blocks.iter().flat_map(|block| 3 * block..3 * block + 3).collect();
        let e = DVector::from_iterator(places.len(), places.iter().map(|k| errors[k / 3][k % 3]));
        let p = dense.select_rows(&places).select_columns(&places);
        e.dot(&p.cholesky().expect("the covariance is positive definite").solve(&e))
    }
}

/// Squared errors at the end of a run, normalised by the filter's covariance: of all states, and of attitude,
/// position and velocity.
fn run(seed: u64, motion: &Motion, perfect: &[ImuInterval]) -> [f64; 2] {
    let mut normal = white_noise(seed);
    let normal = &mut normal;
    let frame = LocalFrame::new(SITE);
    let earth = Earth::turning(&frame);
    let mut sensor = Imperfect::new(normal);

    let mut estimate = Estimate {
        strapdown: motion.start(STATES.imu),
        arm: LeverArm::estimated(ARM_B_M, STATES.arm),
        eskf: Eskf::new(),
    };
    // What the filter begins with is off by its first sigmas; the sensor's errors it takes for zero.
    let mut first = FIRST.map(|sigma| three(normal, sigma));
    for block in [1, 4, 5, 6] {
        first[block] = Vector3::zeros();
    }
    estimate.strapdown.correct(&first);
    estimate.arm.correct(&first);
    for (block, sigma) in FIRST.into_iter().enumerate() {
        estimate.eskf.covariance.set_diagonal(block, Matrix3::from_diagonal_element(sigma * sigma));
    }

    let readings: Vec<ImuInterval> = perfect.iter().map(|perfect| sensor.reads(perfect, normal)).collect();
    for (k, reading) in readings.iter().enumerate().take(SAMPLES) {
        estimate.strapdown.advance(&earth, reading);
        if (k + 1) % EVERY != 0 {
            continue;
        }
        estimate.strapdown.propagate(&mut estimate.eskf, &earth, &NOISE);
        let truth = motion.pose(DT_S * (k + 1) as f64);
        let antenna_n = truth.p_n + truth.c_nb * ARM_B_M + three(normal, SIGMA_POSITION_M);
        let noise = Matrix3::from_diagonal_element(SIGMA_POSITION_M.powi(2));
        let observation = antenna_position(&estimate.strapdown, &estimate.arm, &antenna_n, &noise);
        let update = estimate.eskf.update(&observation, f64::INFINITY);
        estimate.correct(&update);
        if (k + 1) % (5 * EVERY) == 0 {
            let swept_n = truth.c_nb * motion.rate_against_n(DT_S * (k + 1) as f64).cross(&ARM_B_M);
            let velocity_n = truth.v_n + swept_n + three(normal, SIGMA_VELOCITY_M_S);
            // The rate at the epoch, by the interval before and the one after.
            let w_ib_b = (reading.w_ib_b + readings[k + 1].w_ib_b) * 0.5;
            let gyro = NOISE.angle_random_walk_rad_sqrt_s.powi(2) / (2.0 * DT_S) * ARM_B_M.norm_squared();
            let noise = Matrix3::from_diagonal_element(SIGMA_VELOCITY_M_S.powi(2) + gyro);
            let (strapdown, arm) = (&estimate.strapdown, &estimate.arm);
            let observation = antenna_velocity(strapdown, arm, &w_ib_b, &earth, &velocity_n, &noise);
            let update = estimate.eskf.update(&observation, f64::INFINITY);
            estimate.correct(&update);
        }
    }

    let truth = motion.pose(DT_S * SAMPLES as f64);
    let nav = &estimate.strapdown.nav;
    let errors = [
        Rotation3::from_matrix_unchecked(truth.c_nb * nav.c_nb.transpose()).scaled_axis(),
        sensor.gyro_bias - nav.gyro_bias_b,
        nav.p_n - truth.p_n,
        nav.v_n - truth.v_n,
        sensor.accelerometer_bias - nav.accelerometer_bias_b,
        sensor.gyro_scale - estimate.strapdown.gyro_scale,
        sensor.accelerometer_scale - estimate.strapdown.accelerometer_scale,
        ARM_B_M - estimate.arm.arm_b_m,
    ];
    let moving = [ErrorState::Attitude, ErrorState::Position, ErrorState::Velocity].map(|state| state.of(0));
    let all: Vec<usize> = (0..BLOCKS).collect();
    [estimate.nees(&errors, &all), estimate.nees(&errors, &moving)]
}

#[test]
fn over_forty_seeds_the_errors_of_all_states_are_as_large_as_the_filter_says() {
    let motion = Motion::pole();
    let perfect = motion.readings(&LocalFrame::new(SITE), DT_S, SAMPLES + 1);
    let mut sums = [0.0; 2];
    for seed in 1..=SEEDS {
        for (sum, nees) in sums.iter_mut().zip(run(seed, &motion, &perfect)) {
            *sum += nees;
        }
    }
    for (sum, states) in sums.into_iter().zip([3 * BLOCKS, 9]) {
        // The sum has χ² of seeds × states degrees of freedom: 99 % of it lies within 2.58 of its sigmas.
        let degrees = SEEDS as f64 * states as f64;
        assert!((sum - degrees).abs() < 2.58 * (2.0 * degrees).sqrt(), "{sum} of {degrees}");
    }
}
