//! What a transition on a turning Earth does to the five error vectors of one strapdown, with what a smoother
//! needs of it: the transposed map and the inverse.

use nalgebra::Matrix3;

use super::sensor_map::{Five, cross, difference, scaled, sum, times, times_transposed};

/// A matrix, row by row.
pub(super) type Rows3 = [[f64; 3]; 3];

pub(super) fn rows(m: &Matrix3<f64>) -> Rows3 {
    std::array::from_fn(|row| std::array::from_fn(|column| m[(row, column)]))
}

/// The map H S H. S is what the sensor's errors do:
///
/// φ₁ = φ + A b_g,  v₁ = v + f × φ + V b_g + W b_a,  p₁ = p + v·t + s × φ + P b_g + Q b_a;
///
/// H, before and after it, is half of what Earth does: φ turns by −w_ie·t/2 and v by −w_ie·t, and gravity
/// pulls by where the position is wrong. Afterwards each bias has faded.
#[derive(Clone, Copy, Debug)]
pub(super) struct EarthMap {
    pub(super) dt_s: f64,
    /// f and s: first and second integral of the specific force, m/s and m.
    pub(super) velocity_by_attitude: [f64; 3],
    pub(super) position_by_attitude: [f64; 3],
    /// A, V and P, s, m and m·s.
    pub(super) attitude_by_gyro: Rows3,
    pub(super) velocity_by_gyro: Rows3,
    pub(super) position_by_gyro: Rows3,
    /// W and Q, s and s².
    pub(super) velocity_by_accelerometer: Rows3,
    pub(super) position_by_accelerometer: Rows3,
    /// The turn of φ and that of v in H.
    pub(super) half_turn: Rows3,
    pub(super) whole_turn: Rows3,
    /// Gravity's gradient times half of the time, 1/s.
    pub(super) half_gradient_dt: Rows3,
    /// What is left of the biases.
    pub(super) gyro_bias_kept: f64,
    pub(super) accelerometer_bias_kept: f64,
}

impl EarthMap {
    /// The errors afterwards.
    #[inline(always)]
    pub(super) fn forward(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let (phi, v) = self.earth(phi, p, v);
        let v_1 = sum(
            sum(v, cross(self.velocity_by_attitude, phi)),
            sum(times(&self.velocity_by_gyro, gyro), times(&self.velocity_by_accelerometer, accelerometer)),
        );
        let p_1 = sum(
            sum(sum(p, scaled(v, self.dt_s)), cross(self.position_by_attitude, phi)),
            sum(times(&self.position_by_gyro, gyro), times(&self.position_by_accelerometer, accelerometer)),
        );
        let phi_1 = sum(phi, times(&self.attitude_by_gyro, gyro));
        let (phi_1, v_1) = self.earth(phi_1, p_1, v_1);
        [
            phi_1,
            scaled(gyro, self.gyro_bias_kept),
            p_1,
            v_1,
            scaled(accelerometer, self.accelerometer_bias_kept),
        ]
    }

    /// The transposed map.
    #[inline(always)]
    pub(super) fn transposed(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let (phi, p, v) = self.earth_transposed(phi, p, v);
        let gyro = sum(
            sum(scaled(gyro, self.gyro_bias_kept), times_transposed(&self.attitude_by_gyro, phi)),
            sum(times_transposed(&self.velocity_by_gyro, v), times_transposed(&self.position_by_gyro, p)),
        );
        let accelerometer = sum(
            scaled(accelerometer, self.accelerometer_bias_kept),
            sum(
                times_transposed(&self.velocity_by_accelerometer, v),
                times_transposed(&self.position_by_accelerometer, p),
            ),
        );
        let phi_0 = difference(
            difference(phi, cross(self.velocity_by_attitude, v)),
            cross(self.position_by_attitude, p),
        );
        let v_0 = sum(v, scaled(p, self.dt_s));
        let (phi_0, p_0, v_0) = self.earth_transposed(phi_0, p, v_0);
        [phi_0, gyro, p_0, v_0, accelerometer]
    }

    /// The errors before.
    #[inline]
    pub(super) fn inverse(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let gyro = scaled(gyro, 1.0 / self.gyro_bias_kept);
        let accelerometer = scaled(accelerometer, 1.0 / self.accelerometer_bias_kept);
        let (phi, v) = self.earth_inverse(phi, p, v);
        let phi_0 = difference(phi, times(&self.attitude_by_gyro, gyro));
        let v_0 = difference(
            difference(v, cross(self.velocity_by_attitude, phi_0)),
            sum(times(&self.velocity_by_gyro, gyro), times(&self.velocity_by_accelerometer, accelerometer)),
        );
        let p_0 = difference(
            difference(difference(p, scaled(v_0, self.dt_s)), cross(self.position_by_attitude, phi_0)),
            sum(times(&self.position_by_gyro, gyro), times(&self.position_by_accelerometer, accelerometer)),
        );
        let (phi_0, v_0) = self.earth_inverse(phi_0, p_0, v_0);
        [phi_0, gyro, p_0, v_0, accelerometer]
    }

    /// H: attitude and velocity afterwards.
    #[inline(always)]
    fn earth(&self, phi: [f64; 3], p: [f64; 3], v: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let pulled = times(&self.half_gradient_dt, p);
        (times(&self.half_turn, phi), sum(times(&self.whole_turn, v), pulled))
    }

    #[inline(always)]
    fn earth_transposed(&self, phi: [f64; 3], p: [f64; 3], v: [f64; 3]) -> ([f64; 3], [f64; 3], [f64; 3]) {
        (
            times_transposed(&self.half_turn, phi),
            sum(p, times_transposed(&self.half_gradient_dt, v)),
            times_transposed(&self.whole_turn, v),
        )
    }

    /// Attitude and velocity before H: a rotation's inverse is its transpose.
    #[inline]
    fn earth_inverse(&self, phi: [f64; 3], p: [f64; 3], v: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let pulled = times(&self.half_gradient_dt, p);
        (times_transposed(&self.half_turn, phi), times_transposed(&self.whole_turn, difference(v, pulled)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::cayley;
    use nalgebra::Vector3;

    fn map() -> EarthMap {
        let some = |seed: f64| rows(&Matrix3::from_fn(|r, c| libm::sin(seed + (3 * r + c) as f64)));
        EarthMap {
            dt_s: 0.5,
            velocity_by_attitude: [1.0, -2.0, 3.0],
            position_by_attitude: [0.4, 0.3, -0.7],
            attitude_by_gyro: some(0.1),
            velocity_by_gyro: some(0.2),
            position_by_gyro: some(0.3),
            velocity_by_accelerometer: some(0.4),
            position_by_accelerometer: some(0.5),
            half_turn: rows(&cayley(&Vector3::new(0.1, -0.2, 0.15))),
            whole_turn: rows(&cayley(&Vector3::new(0.2, -0.4, 0.3))),
            half_gradient_dt: some(0.6),
            gyro_bias_kept: 0.9,
            accelerometer_bias_kept: 0.8,
        }
    }

    fn some(seed: f64) -> Five {
        std::array::from_fn(|i| std::array::from_fn(|k| libm::sin(seed + (3 * i + k) as f64)))
    }

    fn product(a: &Five, b: &Five) -> f64 {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_transposed_map_is_the_one_of_the_scalar_product() {
        for seed in [0.3, 1.7, 4.0] {
            let (x, y) = (some(seed), some(seed + 0.77));
            let (there, back) = (product(&map().forward(x), &y), product(&x, &map().transposed(y)));
            assert!((there - back).abs() < 1e-12, "{there} {back}");
        }
    }

    #[test]
    fn the_inverse_leads_back() {
        let x = some(2.2);
        let back = map().inverse(map().forward(x));
        for (a, b) in x.as_flattened().iter().zip(back.as_flattened()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
