//! The Jacobian oracle: what a measurement model and an error transition say of states whose errors are known,
//! against differences of the nonlinear models. For any set of sensors and variables.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use super::layout::{BLOCKS_A_SENSOR, Layout, SensorStates, StateVariable};
use super::lever_arm::LeverArm;
use super::nav_state::NavState;
use super::observation::Observation;
use super::strapdown::Strapdown;
use crate::rotation::cayley;

/// States that have errors.
pub(crate) trait Estimated: Sized {
    /// Three-vectors of error.
    fn blocks(&self) -> usize;

    /// The estimated states whose errors against these, the truth, are `e`, by the notation page: true rotation =
    /// (I + [φ×])·estimated; estimated − true for positions and velocities; true − estimated for what a sensor or
    /// a survey has too much.
    fn with_errors(&self, e: &DVector<f64>) -> Self;

    /// Errors that each block may have, about as a good filter has them.
    fn typical(&self) -> Vec<f64>;
}

/// Block `block` of an error vector.
pub(super) fn part(e: &DVector<f64>, block: usize) -> Vector3<f64> {
    Vector3::new(e[3 * block], e[3 * block + 1], e[3 * block + 2])
}

fn nav_with_errors(truth: &NavState, sensor: usize, e: &DVector<f64>) -> NavState {
    let part = |block: usize| part(e, sensor * BLOCKS_A_SENSOR + block);
    NavState {
        c_nb: cayley(&-part(0)) * truth.c_nb,
        gyro_bias_b: truth.gyro_bias_b - part(1),
        p_n: truth.p_n + part(2),
        v_n: truth.v_n + part(3),
        accelerometer_bias_b: truth.accelerometer_bias_b - part(4),
    }
}

impl<const S: usize> Estimated for [NavState; S] {
    fn blocks(&self) -> usize {
        S * BLOCKS_A_SENSOR
    }

    fn with_errors(&self, e: &DVector<f64>) -> Self {
        std::array::from_fn(|sensor| nav_with_errors(&self[sensor], sensor, e))
    }

    /// As a walk has them, a few degrees of attitude among them.
    fn typical(&self) -> Vec<f64> {
        [0.03, 0.003, 0.5, 0.2, 0.05].repeat(S)
    }
}

/// Instruments as a filter has them: strapdowns, points at lever arms, places that are estimated.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    pub(crate) strapdowns: Vec<Strapdown>,
    pub(crate) arms: Vec<LeverArm>,
    /// Places in n, m, whose errors are estimated − true.
    pub(crate) places: Vec<(Vector3<f64>, StateVariable)>,
    blocks: usize,
}

impl Rig {
    /// A truth that nothing distinguishes, of as many strapdowns as `with_scale` has members, each with scale
    /// factors or without: tilted, moving, away from the origin, with biases. One lever arm that is known, one that
    /// is estimated, and a place.
    pub(crate) fn random(seed: u64, with_scale: &[bool]) -> Rig {
        let mut random = Random::new(seed);
        let mut layout = Layout::of_strapdowns(with_scale.len());
        let states: Vec<SensorStates> = (0..with_scale.len())
            .map(|sensor| {
                if with_scale[sensor] {
                    layout.with_scale_factors(sensor)
                } else {
                    layout.without_scale_factors(sensor)
                }
            })
            .collect();
        let strapdowns = states
            .into_iter()
            .map(|states| {
                let nav = NavState {
                    c_nb: cayley(&random.vector(1.0)),
                    v_n: random.vector(1.0),
                    p_n: random.vector(30.0),
                    gyro_bias_b: random.vector(0.01),
                    accelerometer_bias_b: random.vector(0.05),
                };
                let mut strapdown = Strapdown::new(states, nav);
                if states.gyro_scale().is_some() {
                    strapdown.gyro_scale = random.vector(3e-3);
                    strapdown.accelerometer_scale = random.vector(3e-3);
                }
                strapdown
            })
            .collect();
        let arms =
            vec![LeverArm::known(random.vector(1.0)), LeverArm::estimated(random.vector(1.0), layout.add(3))];
        let places = vec![(random.vector(20.0), layout.add(3))];
        Rig { strapdowns, arms, places, blocks: layout.blocks() }
    }
}

impl Estimated for Rig {
    fn blocks(&self) -> usize {
        self.blocks
    }

    fn with_errors(&self, e: &DVector<f64>) -> Self {
        let mut estimated = self.clone();
        let of = |variable: StateVariable| part(e, variable.block());
        for strapdown in &mut estimated.strapdowns {
            let states = strapdown.states();
            strapdown.nav = nav_with_errors(&strapdown.nav, states.sensor(), e);
            strapdown.gyro_scale -= states.gyro_scale().map_or_else(Vector3::zeros, of);
            strapdown.accelerometer_scale -= states.accelerometer_scale().map_or_else(Vector3::zeros, of);
        }
        for arm in &mut estimated.arms {
            arm.arm_b_m -= arm.state.map_or_else(Vector3::zeros, of);
        }
        for (place, variable) in &mut estimated.places {
            *place += of(*variable);
        }
        estimated
    }

    fn typical(&self) -> Vec<f64> {
        let mut typical = [1e-3, 1e-4, 0.1, 0.05, 0.01].repeat(self.strapdowns.len());
        for strapdown in &self.strapdowns {
            if strapdown.states().gyro_scale().is_some() {
                typical.extend([1e-3, 1e-3]);
            }
        }
        typical.extend([0.01, 0.05]);
        typical
    }
}

/// Random numbers, the same for the same seed.
pub(crate) struct Random(Pcg64Mcg);

impl Random {
    pub(crate) fn new(seed: u64) -> Random {
        // An odd multiplier spreads neighbouring seeds over the whole state.
        Random(Pcg64Mcg::new(u128::from(seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15_F39C_C060_5CED_C835)))
    }

    /// Standard normal.
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Three normal numbers with this sigma.
    pub(crate) fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sigma * self.normal())
    }
}

/// The truth of two feet in the middle of a walk: tilted, moving, away from the origin, with biases.
pub(crate) fn generic_truth() -> [NavState; 2] {
    [
        NavState {
            c_nb: cayley(&Vector3::new(0.35, -0.5, 1.9)),
            v_n: Vector3::new(1.1, -0.6, 0.3),
            p_n: Vector3::new(20.0, -31.0, 4.0),
            gyro_bias_b: Vector3::new(0.011, -0.004, 0.007),
            accelerometer_bias_b: Vector3::new(0.05, -0.02, 0.08),
        },
        NavState {
            c_nb: cayley(&Vector3::new(-0.2, 0.4, 1.2)),
            v_n: Vector3::new(-0.2, 0.1, 0.05),
            p_n: Vector3::new(20.4, -30.2, 4.1),
            gyro_bias_b: Vector3::new(-0.006, 0.002, 0.001),
            accelerometer_bias_b: Vector3::new(0.0, 0.04, -0.03),
        },
    ]
}

/// The truth of two feet that nothing distinguishes from the origin: every number zero, axes of n.
pub(crate) fn zero_truth() -> [NavState; 2] {
    let zero = NavState {
        c_nb: Matrix3::identity(),
        v_n: Vector3::zeros(),
        p_n: Vector3::zeros(),
        gyro_bias_b: Vector3::zeros(),
        accelerometer_bias_b: Vector3::zeros(),
    };
    [zero.clone(), zero]
}

fn dense_jacobian<const M: usize>(observation: &Observation<M>, blocks: usize) -> DMatrix<f64> {
    let mut h = DMatrix::zeros(M, 3 * blocks);
    for (block, jacobian) in observation.jacobians() {
        let mut place = h.view_mut((0, 3 * block), (M, 3));
        place += jacobian;
    }
    h
}

/// Checks `model`, which weighs a measurement made of the truth against the states it is given:
/// at the truth the innovation is zero; its derivative by every one of the errors is the model's
/// Jacobian to within `tolerance`; and errors of every state at once give the innovation H·e, sign
/// included, to the second order.
pub(crate) fn assert_linearised<T: Estimated, const M: usize>(
    truth: &T,
    tolerance: f64,
    model: impl Fn(&T) -> Observation<M>,
) {
    let n = 3 * truth.blocks();
    let at_truth = model(truth);
    assert!(at_truth.innovation.norm() < 1e-9, "at the truth: {}", at_truth.innovation);
    let h = dense_jacobian(&at_truth, truth.blocks());

    let innovation = |e: &DVector<f64>| model(&truth.with_errors(e)).innovation;
    let step = 1e-5;
    for k in 0..n {
        let mut e = DVector::zeros(n);
        e[k] = step;
        let derivative = (innovation(&e) - innovation(&-&e)) / (2.0 * step);
        for row in 0..M {
            assert!(
                (derivative[row] - h[(row, k)]).abs() <= tolerance,
                "row {row}, error {k}: the innovation changes by {}, the Jacobian says {}",
                derivative[row],
                h[(row, k)]
            );
        }
    }

    let typical = truth.typical();
    let e = DVector::from_fn(n, |k, _| libm::sin((k * 37 + 11) as f64) * typical[k / 3]);
    let (found, predicted) = (innovation(&e), &h * &e);
    let largest_change = h.abs().max() * e.amax();
    for row in 0..M {
        assert!(
            (found[row] - predicted[row]).abs() <= 0.03 * largest_change + 3.0 * tolerance * e.amax(),
            "row {row}: the innovation is {}, H·e is {}",
            found[row],
            predicted[row]
        );
    }
}
