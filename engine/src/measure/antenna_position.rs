//! A GNSS antenna's position, at its lever arm. Paper 4, (14), and paper 3, (20) for each antenna by itself.
//!
//! Paper 4 prints the tip's lever arm in (14); it is the antenna's. Paper 3 has none.

use nalgebra::{Matrix3, Vector3};

use crate::ins::lever_arm::LeverArm;
use crate::ins::observation::Observation;
use crate::ins::strapdown::Strapdown;

/// The antenna at `arm` is at `measured_n_m`, with the covariance `noise` of the solution (m², in n: a receiver
/// gives it by east, north and up, and within 50 km these are the axes of n to half a degree).
pub fn antenna_position(
    strapdown: &Strapdown,
    arm: &LeverArm,
    measured_n_m: &Vector3<f64>,
    noise: &Matrix3<f64>,
) -> Observation<3> {
    arm.position(strapdown).observed(strapdown, arm, measured_n_m, noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{Rig, assert_linearised};

    #[test]
    fn the_jacobian_is_the_derivative_of_where_the_antenna_of_any_sensor_is() {
        for seed in 0..20 {
            let truth = Rig::random(seed, &[false, true, true]);
            for sensor in 0..3 {
                for arm in 0..2 {
                    let antenna = |rig: &Rig| {
                        let strapdown = &rig.strapdowns[sensor];
                        strapdown.nav.p_n + strapdown.nav.c_nb * rig.arms[arm].arm_b_m
                    };
                    let measured = antenna(&truth);
                    assert_linearised(&truth, 1e-8, |rig| {
                        let noise = Matrix3::identity();
                        antenna_position(&rig.strapdowns[sensor], &rig.arms[arm], &measured, &noise)
                    });
                }
            }
        }
    }

    #[test]
    fn the_noise_is_the_solution_s_covariance() {
        let rig = Rig::random(0, &[false]);
        let noise = Matrix3::new(4.0, 1.0, 0.5, 1.0, 3.0, 0.2, 0.5, 0.2, 9.0);
        let observation = antenna_position(&rig.strapdowns[0], &rig.arms[0], &Vector3::zeros(), &noise);
        assert_eq!(observation.noise, noise);
    }
}
