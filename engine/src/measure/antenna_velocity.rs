//! A GNSS antenna's velocity by Doppler, at its lever arm. Paper 3, (20), with the lever arm that it leaves out.

use nalgebra::{Matrix3, Vector3};

use crate::ins::earth::Earth;
use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The antenna at `arm` moves with `measured_n_m_s` while the gyro reads `w_ib_b` (rad/s, as read), with the
/// covariance `noise` of the solution (m²/s²). The gyro's own noise at the lever arm is to be a part of it.
pub fn antenna_velocity(
    strapdown: &Strapdown,
    arm: &LeverArm,
    w_ib_b: &Vector3<f64>,
    earth: &Earth,
    measured_n_m_s: &Vector3<f64>,
    noise: &Matrix3<f64>,
) -> Observation<3> {
    arm.velocity(strapdown, w_ib_b, earth).observed(strapdown, arm, measured_n_m_s, noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{Rig, assert_linearised};
    use crate::rotation::cayley;

    /// How fast a point moves by differences of its path: the body turns on at the true rate against n.
    fn velocity_of(
        rig: &Rig,
        sensor: usize,
        arm: usize,
        w_ib_b_read: &Vector3<f64>,
        earth: &Earth,
    ) -> Vector3<f64> {
        let strapdown = &rig.strapdowns[sensor];
        let w_ib_b = (w_ib_b_read - strapdown.nav.gyro_bias_b)
            .component_div(&strapdown.gyro_scale.map(|scale| 1.0 + scale));
        let w_nb_b = w_ib_b - strapdown.nav.c_nb.transpose() * earth.w_ie_n();
        let at = |t_s: f64| {
            let turned = strapdown.nav.c_nb * cayley(&(w_nb_b * t_s));
            strapdown.nav.v_n * t_s + turned * rig.arms[arm].arm_b_m
        };
        (at(1e-5) - at(-1e-5)) / 2e-5
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_how_fast_the_antenna_of_any_sensor_moves() {
        for seed in 0..20 {
            let truth = Rig::random(seed, &[false, true]);
            let w_ib_b = Vector3::new(0.8, -1.3, 0.5);
            // Earth's rate as it is, none, and one that shows.
            for faster in [0.0, 1.0, 1e4] {
                let earth = Earth::spinning(Vector3::new(0.0, 6.6e-5, 3.2e-5) * faster);
                for (sensor, arm) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let measured = truth.arms[arm].velocity(&truth.strapdowns[sensor], &w_ib_b, &earth).v_n;
                    let by_path = velocity_of(&truth, sensor, arm, &w_ib_b, &earth);
                    assert!((measured - by_path).norm() < 1e-8, "{measured} {by_path}");
                    assert_linearised(&truth, 1e-8, |rig| {
                        let (strapdown, arm) = (&rig.strapdowns[sensor], &rig.arms[arm]);
                        antenna_velocity(strapdown, arm, &w_ib_b, &earth, &measured, &Matrix3::identity())
                    });
                }
            }
        }
    }
}
