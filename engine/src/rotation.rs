//! Small rotations and the angles that people read off a rotation matrix.
//!
//! A rotation matrix is spelt destination first: `c_nb` turns a vector of the body frame into the
//! navigation frame, `v_n = c_nb * v_b`. Angles come from `libm`, whose code is the same on every processor;
//! the system's chooses its own at run time, and the last bit with it.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// The matrix `[v×]` of the cross product: `skew(v) * u = v × u`.
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The rotation by the vector `theta` (rad) in Cayley's form, (2I + [θ×])(2I − [θ×])⁻¹, written
/// out: I + 2/(1+|a|²)·([a×] + [a×]²) with a = θ/2.
///
/// Paper 1, §2.1 (the attitude recursion). The plain form turns by 2·atan(|θ|/2) instead of |θ|,
/// which at 8 rad/s and 100 Hz is 4·10⁻⁵ rad too little at every sample; so a carries the first
/// term of the series of tan(|θ|/2), which leaves |θ|⁵/120. The result is orthogonal to rounding
/// for every θ.
pub fn cayley(theta: &Vector3<f64>) -> Matrix3<f64> {
    let a = theta * (0.5 * (1.0 + theta.norm_squared() / 12.0));
    let scale = 2.0 / (1.0 + a.norm_squared());
    let (xx, yy, zz) = (a.x * a.x, a.y * a.y, a.z * a.z);
    let (xy, xz, yz) = (a.x * a.y, a.x * a.z, a.y * a.z);
    Matrix3::new(
        1.0 - scale * (yy + zz),
        scale * (xy - a.z),
        scale * (xz + a.y),
        scale * (xy + a.z),
        1.0 - scale * (xx + zz),
        scale * (yz - a.x),
        scale * (xz - a.y),
        scale * (yz + a.x),
        1.0 - scale * (xx + yy),
    )
}

/// Azimuth of a horizontal vector given by its east and north parts, clockwise from north, rad in
/// (−π, π].
pub fn azimuth(east: f64, north: f64) -> f64 {
    libm::atan2(east, north)
}

/// Azimuth of the body's x axis, clockwise from north, rad in (−π, π].
pub fn heading(c_nb: &Matrix3<f64>) -> f64 {
    azimuth(c_nb[(0, 0)], c_nb[(1, 0)])
}

/// Which axis of the body points ahead; its z axis points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Forward {
    /// x ahead, y to the left.
    X,
    /// y ahead, x to the right: the feed cabin of paper 3.
    Y,
}

/// An attitude as the three angles that people read.
///
/// Turned one after another from level and facing north, each about the body's own axis: the heading
/// about up, clockwise; the pitch about the right-hand side; the roll about the forward axis. With
/// [`Forward::Y`] that is c_nb = R_z(−heading) R_x(pitch) R_y(roll).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles {
    /// Azimuth of the forward axis, clockwise from north, rad in (−π, π].
    pub heading_rad: f64,
    /// Elevation of the forward axis, rad in [−π/2, π/2].
    pub pitch_rad: f64,
    /// Roll about the forward axis, right side down positive, rad in (−π, π].
    pub roll_rad: f64,
}

/// Sigma of an angle of which nothing is known: evenly anywhere in a turn, rad.
const UNKNOWN_ANGLE_RAD: f64 = 1.813_799_364_234_217_8;

impl Angles {
    /// The angles of the attitude `c_nb`. Where the forward axis stands upright, heading and roll are not
    /// defined apart from each other; what is given then belongs to that attitude all the same.
    pub fn of(c_nb: &Matrix3<f64>, forward: Forward) -> Angles {
        let (ahead, right_up) = match forward {
            Forward::X => (c_nb.column(0), -c_nb[(2, 1)]),
            Forward::Y => (c_nb.column(1), c_nb[(2, 0)]),
        };
        Angles {
            heading_rad: azimuth(ahead.x, ahead.y),
            pitch_rad: libm::atan2(ahead.z, libm::hypot(ahead.x, ahead.y)),
            roll_rad: libm::atan2(-right_up, c_nb[(2, 2)]),
        }
    }

    /// The attitude with these angles, c_nb.
    pub fn to_rotation(self, forward: Forward) -> Matrix3<f64> {
        let (sin_heading, cos_heading) = libm::sincos(self.heading_rad);
        let (sin_pitch, cos_pitch) = libm::sincos(self.pitch_rad);
        let (sin_roll, cos_roll) = libm::sincos(self.roll_rad);
        let ahead = Vector3::new(sin_heading * cos_pitch, cos_heading * cos_pitch, sin_pitch);
        let level_right = Vector3::new(cos_heading, -sin_heading, 0.0);
        let upright = level_right.cross(&ahead);
        let right = level_right * cos_roll - upright * sin_roll;
        let up = upright * cos_roll + level_right * sin_roll;
        match forward {
            Forward::X => Matrix3::from_columns(&[ahead, -right, up]),
            Forward::Y => Matrix3::from_columns(&[right, ahead, up]),
        }
    }

    /// How heading, pitch and roll (rows) change with a small rotation φ in n of the attitude: with true
    /// rotation = (I + \[φ×\]) · estimated, true angles = estimated angles + this · φ.
    ///
    /// The first row is that of a heading in [`crate::measure::magnetic_heading`] with the other sign: tilt
    /// counts in a heading as soon as the forward axis is not level. Not finite where that axis is upright.
    pub fn jacobian(&self) -> Matrix3<f64> {
        let (sin_heading, cos_heading) = libm::sincos(self.heading_rad);
        let (sin_pitch, cos_pitch) = libm::sincos(self.pitch_rad);
        let tan_pitch = sin_pitch / cos_pitch;
        Matrix3::new(
            sin_heading * tan_pitch,
            cos_heading * tan_pitch,
            -1.0,
            cos_heading,
            -sin_heading,
            0.0,
            sin_heading / cos_pitch,
            cos_heading / cos_pitch,
            0.0,
        )
    }

    /// Sigmas of heading, pitch and roll for a covariance of the attitude error φ in n, rad². An angle that is
    /// not known at all has that of one anywhere in a turn.
    pub fn sigmas_rad(&self, attitude: &Matrix3<f64>) -> [f64; 3] {
        let jacobian = self.jacobian();
        std::array::from_fn(|k| {
            let row = jacobian.row(k);
            let variance = (row * attitude * row.transpose())[0];
            // Written so that a NaN counts as unknown.
            if variance < UNKNOWN_ANGLE_RAD * UNKNOWN_ANGLE_RAD {
                variance.max(0.0).sqrt()
            } else {
                UNKNOWN_ANGLE_RAD
            }
        })
    }
}

/// An angle brought into (−π, π].
pub fn wrap(angle_rad: f64) -> f64 {
    let turns = (angle_rad / std::f64::consts::TAU).round();
    let wrapped = angle_rad - turns * std::f64::consts::TAU;
    if wrapped <= -std::f64::consts::PI { wrapped + std::f64::consts::TAU } else { wrapped }
}

/// The attitude that levels a specific force `f_b` measured at rest (so that it points up in n) and
/// gives the x axis of the body the azimuth `heading_rad`.
///
/// Works for every mounting; where x itself stands upright, the azimuth is that of −z or +z,
/// whichever the mounting leaves horizontal. A dead accelerometer's zero is taken to stand along z.
pub fn level(f_b: &Vector3<f64>, heading_rad: f64) -> Matrix3<f64> {
    let up_b = f_b.try_normalize(0.0).unwrap_or_else(Vector3::z);
    let x_b = Vector3::x();
    let mut forward_b = x_b - up_b * up_b.dot(&x_b);
    if forward_b.norm() < 1e-3 {
        let z_b = Vector3::z() * -up_b.x.signum();
        forward_b = z_b - up_b * up_b.dot(&z_b);
    }
    let forward_b = forward_b.normalize();
    let left_b = up_b.cross(&forward_b);
    let (sin, cos) = libm::sincos(heading_rad);
    let forward_n = Vector3::new(sin, cos, 0.0);
    let left_n = Vector3::new(-cos, sin, 0.0);
    forward_n * forward_b.transpose() + left_n * left_b.transpose() + Vector3::z() * up_b.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cayley_turns_by_the_whole_angle() {
        let theta = Vector3::new(0.05, -0.03, 0.08);
        let exact = nalgebra::Rotation3::new(theta);
        assert!((cayley(&theta) - exact.matrix()).norm() < 2.0 * theta.norm().powi(5) / 120.0 + 1e-15);
        let large = cayley(&(theta * 20.0));
        assert!((large * large.transpose() - Matrix3::identity()).norm() < 1e-14);
    }

    #[test]
    fn skew_is_the_cross_product() {
        let (a, b) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(-4.0, 0.5, 2.0));
        assert_eq!(skew(&a) * b, a.cross(&b));
    }

    #[test]
    fn level_puts_gravity_up_and_x_on_its_azimuth_for_any_mounting() {
        for f_b in [
            Vector3::new(0.0, 0.0, 9.8),
            Vector3::new(0.0, 0.0, -9.8),
            Vector3::new(5.0, -2.0, 8.0),
            Vector3::new(9.8, 0.0, 0.0),
            Vector3::new(-9.8, 0.0, 0.0),
            Vector3::zeros(),
        ] {
            let c_nb = level(&f_b, 0.7);
            assert!((c_nb * f_b - Vector3::z() * f_b.norm()).norm() < 1e-12);
            assert!((c_nb.determinant() - 1.0).abs() < 1e-12);
            if f_b.x.abs() < 9.0 {
                assert!((heading(&c_nb) - 0.7).abs() < 1e-12);
            }
        }
    }

    const TILTED: [Angles; 4] = [
        Angles { heading_rad: 0.7, pitch_rad: 0.2, roll_rad: -0.4 },
        Angles { heading_rad: -2.6, pitch_rad: -1.1, roll_rad: 2.9 },
        Angles { heading_rad: 3.0, pitch_rad: 0.9, roll_rad: 0.1 },
        Angles { heading_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 },
    ];

    fn apart(a: &Angles, b: &Angles) -> Vector3<f64> {
        Vector3::new(
            wrap(a.heading_rad - b.heading_rad),
            a.pitch_rad - b.pitch_rad,
            wrap(a.roll_rad - b.roll_rad),
        )
    }

    #[test]
    fn angles_are_turned_clockwise_then_up_then_right_side_down() {
        for angles in TILTED {
            let right_front_up = angles.to_rotation(Forward::Y);
            let about = |axis: Vector3<f64>, by: f64| nalgebra::Rotation3::new(axis * by).into_inner();
            let turned = about(Vector3::z(), -angles.heading_rad)
                * about(Vector3::x(), angles.pitch_rad)
                * about(Vector3::y(), angles.roll_rad);
            assert!((right_front_up - turned).norm() < 1e-14);
            // The other axes of the same body.
            let front_left_up = angles.to_rotation(Forward::X);
            assert!((front_left_up.column(0) - right_front_up.column(1)).norm() < 1e-15);
            assert!((front_left_up.column(1) + right_front_up.column(0)).norm() < 1e-15);
            for (c_nb, forward) in [(right_front_up, Forward::Y), (front_left_up, Forward::X)] {
                assert!((c_nb.determinant() - 1.0).abs() < 1e-14);
                assert!(apart(&Angles::of(&c_nb, forward), &angles).norm() < 1e-14);
            }
            assert!(wrap(heading(&front_left_up) - angles.heading_rad).abs() < 1e-14);
        }
    }

    #[test]
    fn the_jacobian_of_the_angles_is_their_derivative_by_a_rotation_in_n() {
        for forward in [Forward::X, Forward::Y] {
            for angles in TILTED {
                let (c_nb, jacobian) = (angles.to_rotation(forward), angles.jacobian());
                for axis in 0..3 {
                    let mut phi = Vector3::zeros();
                    phi[axis] = 1e-5;
                    let turned = |phi: Vector3<f64>| Angles::of(&(cayley(&phi) * c_nb), forward);
                    let derivative = apart(&turned(phi), &turned(-phi)) / 2e-5;
                    assert!((derivative - jacobian.column(axis)).norm() < 1e-9, "{angles:?}, axis {axis}");
                }
            }
        }
    }

    #[test]
    fn the_sigmas_of_the_angles_are_those_of_many_attitudes_and_end_at_a_turn() {
        let angles = Angles { heading_rad: 0.7, pitch_rad: 0.9, roll_rad: -0.4 };
        let factor = Matrix3::new(2e-3, 0.0, 0.0, 1e-3, 3e-3, 0.0, -1e-3, 5e-4, 4e-3);
        // The eight corners ±1 have the covariance of the identity.
        let mut squares = Vector3::zeros();
        for corner in 0..8 {
            let phi = factor * Vector3::from_fn(|axis, _| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
            let turned = Angles::of(&(cayley(&phi) * angles.to_rotation(Forward::X)), Forward::X);
            squares += apart(&turned, &angles).map(|x| x * x) / 8.0;
        }
        let sigmas = Vector3::from(angles.sigmas_rad(&(factor * factor.transpose())));
        for (found, expected) in sigmas.iter().zip(&squares.map(f64::sqrt)) {
            assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        }
        let upright = Angles { pitch_rad: std::f64::consts::FRAC_PI_2, ..angles };
        let [heading, pitch, roll] = upright.sigmas_rad(&(Matrix3::identity() * 1e-6));
        assert!((pitch - 1e-3).abs() < 1e-9 && heading == roll);
        assert!((heading - std::f64::consts::PI / 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn wrap_keeps_the_half_turn_positive() {
        use std::f64::consts::PI;
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
    }
}
