//! The inspector stands at a surveyed marker. Paper 1, §3.4.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// The middle of the feet is at `marker_n_m`, give or take `sigma_m` on each axis.
///
/// `positions_n` are the positions of the sensors that take part, each with its number; what stands
/// on two feet is measured on both, half each.
pub fn marker_position(
    positions_n: &[(usize, Vector3<f64>)],
    marker_n_m: &Vector3<f64>,
    sigma_m: &Vector3<f64>,
) -> Observation<3> {
    let share = 1.0 / positions_n.len() as f64;
    let middle = positions_n.iter().map(|(_, p)| p).sum::<Vector3<f64>>() * share;
    let noise = Matrix3::from_diagonal(&sigma_m.component_mul(sigma_m));
    let mut observation = Observation::new(middle - marker_n_m, noise);
    for (sensor, _) in positions_n {
        observation = observation.with(ErrorState::Position.of(*sensor), SMatrix::identity() * share);
    }
    observation
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};
    use crate::ins::eskf::Eskf;
    use crate::ins::nav_state::NavState;

    const SIGMA_M: Vector3<f64> = Vector3::new(1.0, 1.0, 2.0);

    fn positions(feet: &[NavState; 2], sensors: &[usize]) -> Vec<(usize, Vector3<f64>)> {
        sensors.iter().map(|sensor| (*sensor, feet[*sensor].p_n)).collect()
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_middle_of_the_feet_that_take_part() {
        for truth in [generic_truth(), zero_truth()] {
            for sensors in [&[0, 1][..], &[0], &[1]] {
                let marker = sensors.iter().map(|sensor| truth[*sensor].p_n).sum::<Vector3<f64>>()
                    / sensors.len() as f64;
                assert_linearised(&truth, 1e-8, |feet| {
                    marker_position(&positions(feet, sensors), &marker, &SIGMA_M)
                });
            }
        }
    }

    #[test]
    fn a_sure_marker_brings_the_middle_there_and_leaves_the_feet_apart() {
        let mut feet = generic_truth();
        let apart = feet[0].p_n - feet[1].p_n;
        let marker = Vector3::new(15.0, -28.0, 6.0);
        // Both feet have gone astray together.
        let mut filter = Eskf::<10>::new();
        filter.add_noise(&[0, 1].map(|sensor| ErrorState::Position.of(sensor)), &Vector3::repeat(100.0));
        let observation = marker_position(&positions(&feet, &[0, 1]), &marker, &Vector3::repeat(1e-3));
        let correction = filter.update(&observation, f64::INFINITY).correction.unwrap();
        for (sensor, foot) in feet.iter_mut().enumerate() {
            foot.correct(sensor, &correction);
        }
        assert!(((feet[0].p_n + feet[1].p_n) * 0.5 - marker).norm() < 1e-6);
        assert!((feet[0].p_n - feet[1].p_n - apart).norm() < 1e-9);
    }
}
