//! What a transition does to the five error vectors of one sensor, with what a smoother needs of it: the
//! transposed map and the inverse.
//!
//! All five are worked out in one go, number by number of a column: every number of a covariance is
//! fetched and put back once.

/// The vectors of one sensor in the order of [`super::layout`]: attitude, gyro bias, position, velocity,
/// accelerometer bias.
pub(super) type Five = [[f64; 3]; 5];

/// The map, written out:
///
/// v₁ = v + C b_a + f × φ,  p₁ = p + (v + v₁)·dt/2,  φ₁ = φ − C b_g,  and each bias fades.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorMap {
    /// Integral of the attitude, s, row by row.
    pub(super) c: [[f64; 3]; 3],
    /// Integral of the specific force, m/s.
    pub(super) f: [f64; 3],
    /// Half of the time, s.
    pub(super) half_s: f64,
    /// What is left of the biases.
    pub(super) gyro_bias_kept: f64,
    pub(super) accelerometer_bias_kept: f64,
}

impl SensorMap {
    /// The errors afterwards.
    #[inline(always)]
    pub(super) fn forward(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let (turned, pushed, lifted) =
            (times(&self.c, gyro), times(&self.c, accelerometer), cross(self.f, phi));
        let v_1: [f64; 3] = std::array::from_fn(|k| v[k] + pushed[k] + lifted[k]);
        [
            std::array::from_fn(|k| phi[k] - turned[k]),
            gyro.map(|x| x * self.gyro_bias_kept),
            std::array::from_fn(|k| p[k] + self.half_s * (v[k] + v_1[k])),
            v_1,
            accelerometer.map(|x| x * self.accelerometer_bias_kept),
        ]
    }

    /// The transposed map.
    #[inline(always)]
    pub(super) fn transposed(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let by_velocity: [f64; 3] = std::array::from_fn(|k| v[k] + self.half_s * p[k]);
        let (turned, pushed, lifted) = (
            times_transposed(&self.c, phi),
            times_transposed(&self.c, by_velocity),
            cross(self.f, by_velocity),
        );
        [
            std::array::from_fn(|k| phi[k] - lifted[k]),
            std::array::from_fn(|k| gyro[k] * self.gyro_bias_kept - turned[k]),
            p,
            std::array::from_fn(|k| by_velocity[k] + self.half_s * p[k]),
            std::array::from_fn(|k| accelerometer[k] * self.accelerometer_bias_kept + pushed[k]),
        ]
    }

    /// The errors before.
    #[inline]
    pub(super) fn inverse(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let gyro = gyro.map(|x| x / self.gyro_bias_kept);
        let accelerometer = accelerometer.map(|x| x / self.accelerometer_bias_kept);
        let turned = times(&self.c, gyro);
        let phi: [f64; 3] = std::array::from_fn(|k| phi[k] + turned[k]);
        let (pushed, lifted) = (times(&self.c, accelerometer), cross(self.f, phi));
        let v_0: [f64; 3] = std::array::from_fn(|k| v[k] - pushed[k] - lifted[k]);
        let p = std::array::from_fn(|k| p[k] - self.half_s * (v[k] + v_0[k]));
        [phi, gyro, p, v_0, accelerometer]
    }
}

#[inline(always)]
fn times(m: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| m[k][0] * x + m[k][1] * y + m[k][2] * z)
}

#[inline(always)]
fn times_transposed(m: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| m[0][k] * x + m[1][k] * y + m[2][k] * z)
}

#[inline(always)]
fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> SensorMap {
        SensorMap {
            c: [[0.1, 0.2, -0.3], [0.4, -0.5, 0.6], [0.7, 0.8, 0.9]],
            f: [1.0, -2.0, 3.0],
            half_s: 0.25,
            gyro_bias_kept: 0.9,
            accelerometer_bias_kept: 0.8,
        }
    }

    fn some(seed: f64) -> Five {
        std::array::from_fn(|i| std::array::from_fn(|k| libm::sin(seed + (3 * i + k) as f64)))
    }

    fn dot(a: &Five, b: &Five) -> f64 {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn the_transposed_map_is_the_one_of_the_scalar_product() {
        for seed in [0.3, 1.7, 4.0] {
            let (x, y) = (some(seed), some(seed + 0.77));
            let (there, back) = (dot(&map().forward(x), &y), dot(&x, &map().transposed(y)));
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
