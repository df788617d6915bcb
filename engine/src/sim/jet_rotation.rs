//! A rotation that changes in time, by jets of its nine elements: its rate follows without a formula for any one
//! sequence of angles.

use std::ops::Mul;

use nalgebra::{Matrix3, Vector3};

use super::jet::Jet;

/// A rotation matrix and its first and second derivatives in time. As `c_nb` it turns b into n, and its rate is that of b
/// against n, in b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JetRotation {
    /// By row and column.
    elements: [[Jet; 3]; 3],
}

const ZERO: Jet = Jet::constant(0.0);
const ONE: Jet = Jet::constant(1.0);

impl JetRotation {
    /// By an angle about x, right-handed, rad.
    pub fn about_x(angle: Jet) -> JetRotation {
        let (sin, cos) = angle.sin_cos();
        JetRotation { elements: [[ONE, ZERO, ZERO], [ZERO, cos, sin * -1.0], [ZERO, sin, cos]] }
    }

    /// By an angle about y, right-handed, rad.
    pub fn about_y(angle: Jet) -> JetRotation {
        let (sin, cos) = angle.sin_cos();
        JetRotation { elements: [[cos, ZERO, sin], [ZERO, ONE, ZERO], [sin * -1.0, ZERO, cos]] }
    }

    /// By an angle about z, right-handed, rad.
    pub fn about_z(angle: Jet) -> JetRotation {
        let (sin, cos) = angle.sin_cos();
        JetRotation { elements: [[cos, sin * -1.0, ZERO], [sin, cos, ZERO], [ZERO, ZERO, ONE]] }
    }

    /// A rotation that does not change.
    pub fn constant(matrix: &Matrix3<f64>) -> JetRotation {
        let element = |row: usize| std::array::from_fn(|column| Jet::constant(matrix[(row, column)]));
        JetRotation { elements: std::array::from_fn(element) }
    }

    /// A vector that is turned.
    pub fn turn(&self, v: [Jet; 3]) -> [Jet; 3] {
        self.elements.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// The rotation itself.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.elements[row][column].value)
    }

    /// Its rate, in the frame that is turned, rad/s: \[ω×\] = Cᵀ Ċ.
    pub fn rate_rad_s(&self) -> Vector3<f64> {
        off_diagonal(&self.matrix().tr_mul(&self.first()))
    }

    /// The derivative of that rate, in the same frame, rad/s²: \[ω̇×\] = Cᵀ C̈ + Ċᵀ Ċ, of which the second term is symmetric.
    pub fn rate_derivative_rad_s2(&self) -> Vector3<f64> {
        let second = Matrix3::from_fn(|row, column| self.elements[row][column].acceleration);
        off_diagonal(&self.matrix().tr_mul(&second))
    }

    fn first(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.elements[row][column].rate)
    }
}

/// The vector of the skew-symmetric part.
fn off_diagonal(m: &Matrix3<f64>) -> Vector3<f64> {
    0.5 * Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)])
}

impl Mul for JetRotation {
    type Output = JetRotation;

    fn mul(self, other: JetRotation) -> JetRotation {
        let column = |k: usize| self.turn(other.elements.map(|row| row[k]));
        let columns = [column(0), column(1), column(2)];
        JetRotation { elements: std::array::from_fn(|row| columns.map(|column| column[row])) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    #[test]
    fn each_axis_turns_right_handed_at_the_rate_of_its_angle() {
        let angle = Jet { value: 0.7, rate: 0.3, acceleration: -0.2 };
        type About = fn(Jet) -> JetRotation;
        let turns: [(About, Vector3<f64>); 3] = [
            (JetRotation::about_x, Vector3::x()),
            (JetRotation::about_y, Vector3::y()),
            (JetRotation::about_z, Vector3::z()),
        ];
        for (about, axis) in turns {
            let turned = about(angle);
            assert!(
                (turned.matrix() - Rotation3::from_scaled_axis(axis * angle.value).into_inner()).norm()
                    < 1e-15
            );
            assert!((turned.rate_rad_s() - axis * angle.rate).norm() < 1e-15);
            assert!((turned.rate_derivative_rad_s2() - axis * angle.acceleration).norm() < 1e-15);
        }
    }

    #[test]
    fn a_product_has_the_sum_of_the_rates_each_in_its_own_frame() {
        let (a, b) = (
            JetRotation::about_z(Jet { value: 0.4, rate: 0.9, acceleration: 0.0 }),
            JetRotation::about_x(Jet { value: -1.1, rate: 0.5, acceleration: 0.0 }),
        );
        let both = a * b;
        assert!((both.matrix() - a.matrix() * b.matrix()).norm() < 1e-15);
        let expected = b.matrix().tr_mul(&a.rate_rad_s()) + b.rate_rad_s();
        assert!((both.rate_rad_s() - expected).norm() < 1e-15);
        // A fixed mounting turns the rate and adds none.
        let mounting =
            JetRotation::constant(Rotation3::from_scaled_axis(Vector3::new(0.3, 0.2, -0.5)).matrix());
        let mounted = both * mounting;
        assert!((mounted.rate_rad_s() - mounting.matrix().tr_mul(&expected)).norm() < 1e-15);
    }
}
