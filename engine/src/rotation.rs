//! Small rotations and the angles that people read off a rotation matrix.
//!
//! A rotation matrix is spelt destination first: `c_nb` turns a vector of the body frame into the
//! navigation frame, `v_n = c_nb * v_b`. Angles come from `libm`, whose code is the same on every processor;
//! the system's chooses its own at run time, and the last bit with it.

use nalgebra::{Matrix3, Vector3};

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

    #[test]
    fn wrap_keeps_the_half_turn_positive() {
        use std::f64::consts::PI;
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
    }
}
