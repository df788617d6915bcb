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

/// The sensor of the left foot is `separation_m` to the left of the right one's, across the
/// horizontal direction `along_n` of the swing (any length).
///
/// Sensor 0 is the left foot's, sensor 1 the right one's.
pub fn foot_separation(
    left_p_n: &Vector3<f64>,
    right_p_n: &Vector3<f64>,
    along_n: &Vector3<f64>,
    separation_m: f64,
    sigma_m: f64,
) -> Observation<1> {
    let length = along_n.xy().norm();
    let to_left_n = Vector3::new(-along_n.y / length, along_n.x / length, 0.0);
    let row: RowVector3<f64> = to_left_n.transpose();
    let innovation = to_left_n.dot(&(left_p_n - right_p_n)) - separation_m;
    Observation::new(SVector::<f64, 1>::new(innovation), SMatrix::<f64, 1, 1>::new(sigma_m * sigma_m))
        .with(ErrorState::Position.of(0), row)
        .with(ErrorState::Position.of(1), -row)
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
