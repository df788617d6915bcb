//! The oracle of the measurement models: what a model says of states whose errors are known.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::ins::layout::BLOCKS_A_SENSOR;
use crate::ins::nav_state::NavState;
use crate::ins::observation::Observation;
use crate::rotation::cayley;

/// Error states of two feet.
const N: usize = 2 * 3 * BLOCKS_A_SENSOR;

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
        c_nb: nalgebra::Matrix3::identity(),
        v_n: Vector3::zeros(),
        p_n: Vector3::zeros(),
        gyro_bias_b: Vector3::zeros(),
        accelerometer_bias_b: Vector3::zeros(),
    };
    [zero.clone(), zero]
}

/// The estimated states whose errors against `truth` are `e`, by the notation page: true rotation =
/// (I + [φ×])·estimated; estimated − true for position and velocity; true − estimated for biases.
fn estimated(truth: &[NavState; 2], e: &DVector<f64>) -> [NavState; 2] {
    [0, 1].map(|sensor| {
        let part = |block: usize| {
            let at = 3 * (sensor * BLOCKS_A_SENSOR + block);
            Vector3::new(e[at], e[at + 1], e[at + 2])
        };
        let truth = &truth[sensor];
        NavState {
            c_nb: cayley(&-part(0)) * truth.c_nb,
            gyro_bias_b: truth.gyro_bias_b - part(1),
            p_n: truth.p_n + part(2),
            v_n: truth.v_n + part(3),
            accelerometer_bias_b: truth.accelerometer_bias_b - part(4),
        }
    })
}

fn dense_jacobian<const M: usize>(observation: &Observation<M>) -> DMatrix<f64> {
    let mut h = DMatrix::zeros(M, N);
    for (block, jacobian) in observation.jacobians() {
        let mut place = h.view_mut((0, 3 * block), (M, 3));
        place += jacobian;
    }
    h
}

/// Checks `model`, which weighs a measurement made of the truth against the states it is given:
/// at the truth the innovation is zero; its derivative by every one of the 30 errors is the model's
/// Jacobian to within `tolerance`; and errors of every state at once give the innovation H·e, sign
/// included, to the second order.
pub(crate) fn assert_linearised<const M: usize>(
    truth: &[NavState; 2],
    tolerance: f64,
    model: impl Fn(&[NavState; 2]) -> Observation<M>,
) {
    let at_truth = model(truth);
    assert!(at_truth.innovation.norm() < 1e-9, "at the truth: {}", at_truth.innovation);
    let h = dense_jacobian(&at_truth);

    let innovation = |e: &DVector<f64>| model(&estimated(truth, e)).innovation;
    let step = 1e-5;
    for k in 0..N {
        let mut e = DVector::zeros(N);
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

    // Errors as a walk has them, a few degrees of attitude among them.
    let e = DVector::from_fn(N, |k, _| {
        libm::sin((k * 37 + 11) as f64) * [0.03, 0.003, 0.5, 0.2, 0.05][k / 3 % 5]
    });
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
