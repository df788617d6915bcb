//! The tip of a pole that stands on the ground does not move: zero velocity at a lever arm. Paper 4, (10)–(12).

use nalgebra::{Matrix3, Vector3};

use crate::ins::earth::Earth;
use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The tip at `arm` has the velocity zero while the gyro reads `w_ib_b` (rad/s, as read), with `sigma_m_s` of
/// motion left on each axis.
pub fn tip_velocity(
    strapdown: &Strapdown,
    arm: &LeverArm,
    w_ib_b: &Vector3<f64>,
    earth: &Earth,
    sigma_m_s: f64,
) -> Observation<3> {
    let noise = Matrix3::from_diagonal_element(sigma_m_s * sigma_m_s);
    arm.velocity(strapdown, w_ib_b, earth).observed(strapdown, arm, &Vector3::zeros(), &noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{Rig, assert_linearised};

    #[test]
    fn the_jacobian_is_the_derivative_of_how_fast_the_tip_of_a_pole_that_rocks_on_it_moves() {
        for seed in 0..20 {
            let mut truth = Rig::random(seed, &[true, false]);
            let w_ib_b = Vector3::new(-0.4, 0.9, 0.2);
            for faster in [0.0, 1.0, 1e4] {
                let earth = Earth::spinning(Vector3::new(0.0, 6.6e-5, 3.2e-5) * faster);
                for (sensor, arm) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    // The pole turns about its tip: the sensor moves as the tip stands.
                    let strapdown = &mut truth.strapdowns[sensor];
                    let w_nb_n = strapdown.nav.c_nb * strapdown.corrected_rate(&w_ib_b) - earth.w_ie_n();
                    strapdown.nav.v_n = -w_nb_n.cross(&(strapdown.nav.c_nb * truth.arms[arm].arm_b_m));
                    assert_linearised(&truth, 1e-8, |rig| {
                        tip_velocity(&rig.strapdowns[sensor], &rig.arms[arm], &w_ib_b, &earth, 0.06)
                    });
                }
            }
        }
    }

    #[test]
    fn the_noise_is_the_sigma_squared_on_each_axis() {
        let rig = Rig::random(0, &[false]);
        let earth = Earth::still(9.8);
        let observation = tip_velocity(&rig.strapdowns[0], &rig.arms[0], &Vector3::zeros(), &earth, 0.06);
        assert_eq!(observation.noise, Matrix3::identity() * (0.06 * 0.06));
    }
}
