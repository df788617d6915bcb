//! A strapdown left to itself drifts as the error model says.

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::ins::earth::Earth;
use lodestep_engine::ins::eskf::Eskf;
use lodestep_engine::ins::imu_noise::{GaussMarkov, ImuNoise};
use lodestep_engine::ins::layout::{ErrorState, Layout, SensorStates};
use lodestep_engine::ins::strapdown::Strapdown;
use nalgebra::{Matrix3, Vector3};

use super::motion::{Motion, Pose, SITE};

pub(super) const BLOCKS: usize = 7;
pub(super) const STATES: SensorStates = Layout::of_strapdowns(1).with_scale_factors(0);

/// A sensor without noise, whose biases and scale factors are constant.
const NOISELESS: ImuNoise = ImuNoise {
    angle_random_walk_rad_sqrt_s: 0.0,
    velocity_random_walk_m_s_sqrt_s: 0.0,
    gyro_bias_rad_s: GaussMarkov::CONSTANT,
    accelerometer_bias_m_s2: GaussMarkov::CONSTANT,
    gyro_scale_factor: GaussMarkov::CONSTANT,
    accelerometer_scale_factor: GaussMarkov::CONSTANT,
};

/// The errors of a strapdown whose sensor is perfect, in the order of the filter's blocks.
pub(super) fn errors(strapdown: &Strapdown, truth: &Pose) -> [Vector3<f64>; BLOCKS] {
    let nav = &strapdown.nav;
    let turn = truth.c_nb * nav.c_nb.transpose();
    let turn = (turn - turn.transpose()) * 0.5;
    [
        Vector3::new(turn[(2, 1)], turn[(0, 2)], turn[(1, 0)]),
        -nav.gyro_bias_b,
        nav.p_n - truth.p_n,
        nav.v_n - truth.v_n,
        -nav.accelerometer_bias_b,
        -strapdown.gyro_scale,
        -strapdown.accelerometer_scale,
    ]
}

/// How far the drift of a strapdown that begins with errors is off what the filter makes of these errors, as a
/// share of it: attitude, position, velocity.
fn off(motion: &Motion, first: &[Vector3<f64>; BLOCKS], dt_s: f64, samples: usize, every: usize) -> [f64; 3] {
    let frame = LocalFrame::new(SITE);
    let earth = Earth::turning(&frame);
    let (mut strapdown, mut perfect) = (motion.start(STATES), motion.start(STATES));
    strapdown.correct(&first.map(|error| -error));
    // One more block whose first number is sure to be 1: the covariance with it is the error itself.
    let mut eskf = Eskf::<{ BLOCKS + 1 }>::new();
    eskf.covariance.set_diagonal(BLOCKS, Matrix3::from_diagonal(&Vector3::x()));
    for (block, error) in first.iter().enumerate() {
        eskf.add_multiple(block, BLOCKS, &(error * Vector3::x().transpose()));
    }
    for (k, reading) in motion.readings(&frame, dt_s, samples).iter().enumerate() {
        strapdown.advance(&earth, reading);
        perfect.advance(&earth, reading);
        if (k + 1) % every == 0 {
            strapdown.propagate(&mut eskf, &earth, &NOISELESS);
        }
    }
    // Against one that begins without: what the strapdown itself leaves is in both.
    let truth = motion.pose(dt_s * samples as f64);
    let (drifted, left) = (errors(&strapdown, &truth), errors(&perfect, &truth));
    [ErrorState::Attitude, ErrorState::Position, ErrorState::Velocity].map(|state| {
        let block = state.of(0);
        let predicted = eskf.covariance.block(block, BLOCKS).column(0).into_owned();
        (drifted[block] - left[block] - predicted).norm() / (predicted.norm() + 1e-9)
    })
}

#[test]
fn a_minute_of_swift_motion_makes_of_every_error_what_the_error_model_says() {
    let one = Vector3::new(0.6, -0.7, 0.5);
    let sizes = [1e-3, 1e-4, 0.1, 0.02, 0.01, 1e-3, 1e-3];
    for block in 0..BLOCKS {
        let mut first = [Vector3::zeros(); BLOCKS];
        first[block] = one * sizes[block];
        let off = off(&Motion::pole(), &first, 0.005, 12_000, 40);
        assert!(off.iter().all(|off| *off < 0.01), "block {block}: {off:?}");
    }
}

#[test]
fn in_half_a_schuler_period_gravity_pulls_errors_back_as_the_error_model_says() {
    let one = Vector3::new(0.6, -0.7, 0.0);
    let sizes = [1e-5, 1e-9, 1.0, 0.01, 1e-5, 0.0, 0.0];
    let first = std::array::from_fn(|block| one * sizes[block]);
    let off = off(&Motion::rest(), &first, 0.1, 25_000, 10);
    assert!(off.iter().all(|off| *off < 0.01), "{off:?}");
}
