//! The swinging foot passes the standing one at a known distance to its side. Paper 1, §3.3.
//!
//! The paper takes the smallest distance to be zero and measures its length. Motion capture of both
//! feet gives 0.08 to 0.25 m depending on where the sensor sits, and the length of a short vector
//! says nothing about the side: two feet that an error has made change sides would be pushed further
//! apart. At the moment of the smallest distance the line between the feet stands across the swing,
//! and left is left of right; so what is measured here is the signed distance across the swing,
//! which is linear in the positions.

use nalgebra::{RowVector3, SMatrix, SVector, Vector3};

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
    let length = along_n.x.hypot(along_n.y);
    let to_left_n = Vector3::new(-along_n.y / length, along_n.x / length, 0.0);
    let row: RowVector3<f64> = to_left_n.transpose();
    let innovation = to_left_n.dot(&(left_p_n - right_p_n)) - separation_m;
    Observation::new(SVector::<f64, 1>::new(innovation), SMatrix::<f64, 1, 1>::new(sigma_m * sigma_m))
        .with(ErrorState::Position.of(0), row)
        .with(ErrorState::Position.of(1), -row)
}
