//! Rotator and Stewart platform as geometry: where the platform is in the cabin's frame for the encoders' readings, and how
//! that changes with the length of each leg.
//!
//! leg_i = |t_r + c_r_p joint_p_i − joint_r_i| is solved for (t_r, c_r_p) by Newton's method; c_b_r = R_x(a) R_y(b).

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::instrument::{Instrument, vectors};
use crate::rotation::{cayley, skew};

/// The joints.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Joints {
    pivot_b: Vector3<f64>,
    joint_r: Vec<Vector3<f64>>,
    joint_p: Vec<Vector3<f64>>,
    rest_r: Vector3<f64>,
}

/// Where the platform is on the rotator.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Seat {
    pub(super) t_r: Vector3<f64>,
    pub(super) c_rp: Matrix3<f64>,
    /// How t_r (rows 0–2) and a small rotation of the platform in r (rows 3–5) change with the legs.
    pub(super) by_legs: Matrix6<f64>,
}

/// Where the platform is in the cabin.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct PlatformInCabin {
    /// Its origin, in b, m.
    pub(super) position_b: Vector3<f64>,
    /// Turns p into b.
    pub(super) c_bp: Matrix3<f64>,
    /// How its origin (rows 0–2) and a small rotation of it (rows 3–5), both in b, change with the legs.
    pub(super) by_legs: Matrix6<f64>,
    /// The rotator's axes as they stand, and the point about which it turns, in b.
    pub(super) axes_b: [Vector3<f64>; 2],
    pub(super) pivot_b: Vector3<f64>,
}

impl Joints {
    pub(super) fn new(instrument: &Instrument) -> Joints {
        Joints {
            pivot_b: Vector3::from(instrument.rotator.pivot_b),
            joint_r: vectors(&instrument.stewart.joint_r),
            joint_p: vectors(&instrument.stewart.joint_p),
            rest_r: Vector3::from(instrument.stewart.rest_r),
        }
    }

    /// Lengths of the legs in a pose, and their Jacobian by t_r and a small rotation in r.
    fn legs(&self, t_r: &Vector3<f64>, c_rp: &Matrix3<f64>) -> (Vector6<f64>, Matrix6<f64>) {
        let (mut lengths, mut by_pose) = (Vector6::zeros(), Matrix6::zeros());
        for (k, (joint_r, joint_p)) in self.joint_r.iter().zip(&self.joint_p).enumerate() {
            let arm_r = c_rp * joint_p;
            let leg_r = t_r + arm_r - joint_r;
            let length = leg_r.norm();
            let along = leg_r / length;
            lengths[k] = length;
            let turn = arm_r.cross(&along);
            by_pose.row_mut(k).copy_from_slice(&[along.x, along.y, along.z, turn.x, turn.y, turn.z]);
        }
        (lengths, by_pose)
    }

    /// The seat at rest; `None` where six legs would not hold it.
    pub(super) fn at_rest(&self) -> Option<Seat> {
        let (_, by_pose) = self.legs(&self.rest_r, &Matrix3::identity());
        let by_legs = by_pose.try_inverse()?;
        (by_legs.iter().all(|x| x.is_finite()) && by_legs.norm() < 1e3).then_some(Seat {
            t_r: self.rest_r,
            c_rp: Matrix3::identity(),
            by_legs,
        })
    }

    /// The seat for these lengths, m, from one nearby; `None` where no pose fits.
    pub(super) fn seat(&self, legs_m: &Vector6<f64>, near: &Seat) -> Option<Seat> {
        let (mut t_r, mut c_rp) = (near.t_r, near.c_rp);
        for _ in 0..12 {
            let (lengths, by_pose) = self.legs(&t_r, &c_rp);
            let off = legs_m - lengths;
            let by_legs = by_pose.try_inverse()?;
            let step = by_legs * off;
            t_r += step.fixed_rows::<3>(0);
            c_rp = cayley(&step.fixed_rows::<3>(3).into_owned()) * c_rp;
            if !step.iter().all(|x| x.is_finite()) || step.norm() > 5.0 {
                return None;
            }
            if step.norm() < 1e-7 {
                // Half a turn away, or through the rotator, a pose may fit that no platform takes.
                let sane = (t_r - self.rest_r).norm() < 1.5 && c_rp.trace() > 1.0;
                return sane.then_some(Seat { t_r, c_rp, by_legs });
            }
        }
        None
    }

    /// The platform in the cabin, with the rotator at these angles.
    pub(super) fn in_cabin(&self, a_rad: f64, b_rad: f64, seat: &Seat) -> PlatformInCabin {
        let ((sin_a, cos_a), (sin_b, cos_b)) = (libm::sincos(a_rad), libm::sincos(b_rad));
        let about_x = Matrix3::new(1.0, 0.0, 0.0, 0.0, cos_a, -sin_a, 0.0, sin_a, cos_a);
        let about_y = Matrix3::new(cos_b, 0.0, sin_b, 0.0, 1.0, 0.0, -sin_b, 0.0, cos_b);
        let c_br = about_x * about_y;
        let mut by_legs = Matrix6::zeros();
        for rows in [0, 3] {
            let turned = c_br * seat.by_legs.fixed_rows::<3>(rows);
            by_legs.fixed_rows_mut::<3>(rows).copy_from(&turned);
        }
        PlatformInCabin {
            position_b: self.pivot_b + c_br * seat.t_r,
            c_bp: c_br * seat.c_rp,
            by_legs,
            axes_b: [Vector3::x(), about_x * Vector3::y()],
            pivot_b: self.pivot_b,
        }
    }
}

impl PlatformInCabin {
    /// A point of the platform in b, m, and how it changes with the legs.
    pub(super) fn point(&self, point_p: &Vector3<f64>) -> (Vector3<f64>, nalgebra::Matrix3x6<f64>) {
        let arm_b = self.c_bp * point_p;
        let by_legs = self.by_legs.fixed_rows::<3>(0) - skew(&arm_b) * self.by_legs.fixed_rows::<3>(3);
        (self.position_b + arm_b, by_legs)
    }
}

#[cfg(test)]
#[path = "joints_tests.rs"]
mod tests;
