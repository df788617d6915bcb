//! The swinging foot passes the standing one at a known distance to its side. Paper 1, §3.3.
//!
//! The paper takes the smallest distance to be zero and measures its length. Motion capture of both
//! feet gives 0.08 to 0.25 m depending on where the sensor sits, and the length of a short vector
//! says nothing about the side: two feet that an error has made change sides would be pushed further
//! apart. At the moment of the smallest distance the line between the feet stands across the swing,
//! and left is left of right; so what is measured here is the signed distance across the swing,
//! which is linear in the positions.

use nalgebra::{Matrix2, Matrix2x3, RowVector3, SMatrix, SVector, Vector2, Vector3};

use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// How far the sensor of the left foot is to the left of the right one's.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// The distance, m.
    pub distance_m: f64,
    /// Its derivative by the left foot's position; by the right one's it is the opposite.
    pub to_left_n: RowVector3<f64>,
}

impl Beside {
    /// Across the horizontal direction `along_n` of the swing (any length).
    pub fn new(left_p_n: &Vector3<f64>, right_p_n: &Vector3<f64>, along_n: &Vector3<f64>) -> Self {
        let length = along_n.xy().norm();
        let to_left_n = RowVector3::new(-along_n.y / length, along_n.x / length, 0.0);
        Beside { distance_m: to_left_n.transpose().dot(&(left_p_n - right_p_n)), to_left_n }
    }
}

/// How the part of `difference_n` along a horizontal direction, `row`, changes by an attitude error about the vertical
/// because the direction itself is known by the attitude only.
///
/// Turned about the vertical with everything else, two feet keep their distance across and along a stride. The errors
/// of the two positions alone would see such a turn, and the heading with them: what a stride cannot know.
pub fn by_its_direction(row: &RowVector3<f64>, difference_n: &Vector3<f64>) -> RowVector3<f64> {
    RowVector3::new(0.0, 0.0, row.y * difference_n.x - row.x * difference_n.y)
}

/// A distance across the swing of now or of a past moment is `separation_m`. What it depends on is added
/// by the caller, who knows where that error stands.
pub fn foot_separation(distance_m: f64, separation_m: f64, sigma_m: f64) -> Observation<1> {
    let innovation = distance_m - separation_m;
    Observation::new(SVector::<f64, 1>::new(innovation), SMatrix::<f64, 1, 1>::new(sigma_m * sigma_m))
}

/// The standing foot is half-way along the stride that the other has just made, and half-way up it.
///
/// The separation across the swing leaves open how far one foot is ahead of the other and above it,
/// and nothing else in the joint filter holds these two together. In level walking, on slopes and on
/// stairs alike a stride begins and ends as far from the standing foot, give or take `sigma_along_m`
/// and `sigma_up_m`; what a gait has of its own comes with opposite signs from both feet and cancels.
///
/// `swinging`, `standing`: the sensors' numbers; `from_p_n`, `to_p_n`: the swinging foot at lift-off
/// and now; `standing_p_n`: the other where it stands.
pub fn stride_symmetry(
    swinging: usize,
    standing: usize,
    from_p_n: &Vector3<f64>,
    to_p_n: &Vector3<f64>,
    standing_p_n: &Vector3<f64>,
    sigma_along_m: f64,
    sigma_up_m: f64,
) -> Observation<2> {
    let stride_n = to_p_n - from_p_n;
    let length = stride_n.xy().norm();
    let rows = Matrix2x3::new(stride_n.x / length, stride_n.y / length, 0.0, 0.0, 0.0, 1.0);
    let innovation: Vector2<f64> = rows * ((from_p_n + to_p_n) * 0.5 - standing_p_n);
    let noise = Matrix2::new(sigma_along_m * sigma_along_m, 0.0, 0.0, sigma_up_m * sigma_up_m);
    // An error made before the stride has moved both of its ends; one made in it, the last end by
    // half, which is left out.
    Observation::new(innovation, noise)
        .with(ErrorState::Position.of(swinging), rows)
        .with(ErrorState::Position.of(standing), -rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::{assert_linearised, generic_truth, zero_truth};
    use crate::ins::eskf::Eskf;
    use nalgebra::Matrix3;

    /// The separation at this very moment.
    fn now(beside: &Beside, separation_m: f64, sigma_m: f64) -> Observation<1> {
        foot_separation(beside.distance_m, separation_m, sigma_m)
            .with(ErrorState::Position.of(0), beside.to_left_n)
            .with(ErrorState::Position.of(1), -beside.to_left_n)
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_distance_across_the_swing() {
        for truth in [generic_truth(), zero_truth()] {
            for along_n in
                [Vector3::new(0.9, 1.2, 0.4), Vector3::new(-3.0, 0.1, 0.0), Vector3::new(0.0, -2.0, 1.0)]
            {
                let left_n = Vector3::new(-along_n.y, along_n.x, 0.0).normalize();
                let separation_m = left_n.dot(&(truth[0].p_n - truth[1].p_n));
                assert_linearised(&truth, 1e-8, |feet| {
                    now(&Beside::new(&feet[0].p_n, &feet[1].p_n, &along_n), separation_m, 0.05)
                });
            }
        }
    }

    #[test]
    fn the_symmetry_s_jacobian_is_the_derivative_by_errors_made_before_the_stride() {
        for (swinging, standing) in [(0, 1), (1, 0)] {
            for mut truth in [generic_truth(), zero_truth()] {
                let stride_n = Vector3::new(0.8, -1.0, 0.17);
                // Half-way along and half-way up; to the side it says nothing.
                let aside_n = Vector3::new(1.0, 0.8, 0.0) * 0.1;
                truth[standing].p_n = truth[swinging].p_n - stride_n * 0.5 + aside_n;
                assert_linearised(&truth, 1e-8, |feet| {
                    let to_p_n = feet[swinging].p_n;
                    let from_p_n = to_p_n - stride_n;
                    stride_symmetry(swinging, standing, &from_p_n, &to_p_n, &feet[standing].p_n, 0.2, 0.1)
                });
            }
        }
    }

    #[test]
    fn a_turn_of_both_feet_about_the_vertical_is_not_seen() {
        let vertical = Vector3::z();
        for difference_n in [Vector3::new(0.1, 0.02, 0.3), Vector3::new(-0.7, 0.4, 0.0)] {
            for row in [RowVector3::new(0.6, 0.8, 0.0), RowVector3::new(-1.0, 0.0, 0.0)] {
                // An attitude error φ moves the end of d by d × φ.
                let by_positions = (row * difference_n.cross(&vertical))[0];
                let by_direction = (by_its_direction(&row, &difference_n) * vertical)[0];
                assert!((by_positions + by_direction).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn feet_that_an_error_made_change_sides_are_brought_back() {
        // Walking north with the left foot 0.3 m to the right of the right one.
        let (mut left, mut right) = (Vector3::new(0.15, 5.0, 0.0), Vector3::new(-0.15, 5.1, 0.0));
        let mut filter = Eskf::<10>::new();
        for sensor in [0, 1] {
            filter.covariance.set_diagonal(ErrorState::Position.of(sensor), Matrix3::identity());
        }
        let observation = now(&Beside::new(&left, &right, &Vector3::new(0.0, 1.4, 0.2)), 0.13, 0.01);
        let correction = filter.update(&observation, f64::INFINITY).correction.unwrap();
        left -= correction[ErrorState::Position.of(0)];
        right -= correction[ErrorState::Position.of(1)];
        assert!((right.x - left.x - 0.13).abs() < 1e-3, "left at {}, right at {}", left.x, right.x);
        assert!((left.x + right.x).abs() < 1e-9, "both share the correction");
        assert_eq!((left.y, right.y), (5.0, 5.1), "along the swing nothing is said");
    }
}
