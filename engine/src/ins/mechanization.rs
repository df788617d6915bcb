//! The strapdown: attitude, velocity and position from one sample to the next.

use nalgebra::Vector3;

use super::nav_state::NavState;
use crate::rotation::cayley;

/// What the strapdown leaves for the error model: the step it has just made.
#[derive(Clone, Copy, Debug)]
pub struct Increment {
    /// Length of the step, s.
    pub dt_s: f64,
    /// Specific force over the step, in n, m/s².
    pub f_n: Vector3<f64>,
    /// Angular rate over the step less the estimated bias, in n, rad/s.
    pub w_nb_n: Vector3<f64>,
    /// Acceleration over the step, specific force and gravity together, in n, m/s².
    pub acceleration_n: Vector3<f64>,
}

/// Moves `state` on by `dt_s`.
///
/// `w_ib_b` (rad/s) and `f_b` (m/s²) are the readings at the end of the step, `w_ib_b_before` those
/// at its start. Paper 1, §2.1: attitude first (Cayley's form), then velocity with the new attitude
/// and the new specific force, then position with the mean of both velocities. The rate is the mean
/// of both ends, which is of second order where the paper's is of first.
#[inline]
pub fn advance(
    state: &mut NavState,
    w_ib_b_before: &Vector3<f64>,
    w_ib_b: &Vector3<f64>,
    f_b: &Vector3<f64>,
    dt_s: f64,
    gravity_m_s2: f64,
) -> Increment {
    let w_nb_b = (w_ib_b_before + w_ib_b) * 0.5 - state.gyro_bias_b;
    state.c_nb *= cayley(&(w_nb_b * dt_s));
    let f_n = state.c_nb * (f_b - state.accelerometer_bias_b);
    let v_n_before = state.v_n;
    let acceleration_n = f_n - Vector3::z() * gravity_m_s2;
    state.v_n += acceleration_n * dt_s;
    state.p_n += (v_n_before + state.v_n) * (0.5 * dt_s);
    Increment { dt_s, f_n, w_nb_n: state.c_nb * w_nb_b, acceleration_n }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn at_rest_nothing_moves_and_a_bias_is_taken_off() {
        let bias = Vector3::new(0.01, -0.02, 0.03);
        let mut state = NavState {
            c_nb: Matrix3::identity(),
            v_n: Vector3::zeros(),
            p_n: Vector3::zeros(),
            gyro_bias_b: bias,
            accelerometer_bias_b: Vector3::new(0.0, 0.0, 0.05),
        };
        for _ in 0..100 {
            advance(&mut state, &bias, &bias, &Vector3::new(0.0, 0.0, 9.85), 0.01, 9.8);
        }
        assert!(state.p_n.norm() < 1e-12 && (state.c_nb - Matrix3::identity()).norm() < 1e-14);
    }

    #[test]
    fn a_turn_on_a_circle_comes_back_to_where_it_began() {
        // Radius 2 m, one turn in 4 s, the x axis along the velocity: the specific force is the
        // centripetal acceleration to the left and gravity.
        let (radius, period, steps) = (2.0, 4.0, 4000);
        let rate = std::f64::consts::TAU / period;
        let w = Vector3::new(0.0, 0.0, rate);
        let f = Vector3::new(0.0, radius * rate * rate, 9.8);
        let mut state = NavState {
            c_nb: Matrix3::identity(),
            v_n: Vector3::new(radius * rate, 0.0, 0.0),
            p_n: Vector3::zeros(),
            gyro_bias_b: Vector3::zeros(),
            accelerometer_bias_b: Vector3::zeros(),
        };
        for _ in 0..steps {
            advance(&mut state, &w, &w, &f, period / f64::from(steps), 9.8);
        }
        assert!(state.p_n.norm() < 2e-2, "{}", state.p_n.norm());
    }
}
