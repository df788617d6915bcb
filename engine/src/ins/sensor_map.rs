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
/// v₁ = v + C b_a + f × φ,  p₁ = p + (v + v₁)·dt/2 + k × φ,  φ₁ = φ − C b_g,  and each bias fades.
///
/// k is what the mean of the velocities leaves of the way: with it, what an error of the attitude has turned is the very
/// way that the strapdown has gone, and none of it tells of the heading.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorMap {
    /// Integral of the attitude, s, row by row.
    pub(super) c: [[f64; 3]; 3],
    /// Integral of the specific force, m/s.
    pub(super) f: [f64; 3],
    /// Double integral of the specific force less half the time times `f`, m.
    pub(super) k: [f64; 3],
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
        let v_1 = sum(sum(v, times(&self.c, accelerometer)), cross(self.f, phi));
        [
            difference(phi, times(&self.c, gyro)),
            scaled(gyro, self.gyro_bias_kept),
            sum(sum(p, scaled(sum(v, v_1), self.half_s)), cross(self.k, phi)),
            v_1,
            scaled(accelerometer, self.accelerometer_bias_kept),
        ]
    }

    /// The transposed map.
    #[inline(always)]
    pub(super) fn transposed(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let later = scaled(p, self.half_s);
        let by_velocity = sum(v, later);
        [
            difference(difference(phi, cross(self.f, by_velocity)), cross(self.k, p)),
            difference(scaled(gyro, self.gyro_bias_kept), times_transposed(&self.c, phi)),
            p,
            sum(by_velocity, later),
            sum(scaled(accelerometer, self.accelerometer_bias_kept), times_transposed(&self.c, by_velocity)),
        ]
    }

    /// The errors before.
    #[inline]
    pub(super) fn inverse(&self, [phi, gyro, p, v, accelerometer]: Five) -> Five {
        let gyro = scaled(gyro, 1.0 / self.gyro_bias_kept);
        let accelerometer = scaled(accelerometer, 1.0 / self.accelerometer_bias_kept);
        let phi = sum(phi, times(&self.c, gyro));
        let v_0 = difference(difference(v, times(&self.c, accelerometer)), cross(self.f, phi));
        let p = difference(difference(p, scaled(sum(v, v_0), self.half_s)), cross(self.k, phi));
        [phi, gyro, p, v_0, accelerometer]
    }
}

// Spelt out: closures over arrays are not always taken apart, and this is most of a propagation.

#[inline(always)]
pub(super) fn sum([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a + x, b + y, c + z]
}

#[inline(always)]
pub(super) fn difference([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a - x, b - y, c - z]
}

#[inline(always)]
pub(super) fn scaled([x, y, z]: [f64; 3], by: f64) -> [f64; 3] {
    [x * by, y * by, z * by]
}

#[inline(always)]
pub(super) fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

#[inline(always)]
pub(super) fn times_transposed(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [
        dot([m[0][0], m[1][0], m[2][0]], v),
        dot([m[0][1], m[1][1], m[2][1]], v),
        dot([m[0][2], m[1][2], m[2][2]], v),
    ]
}

#[inline(always)]
fn dot([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}

#[inline(always)]
pub(super) fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> SensorMap {
        SensorMap {
            c: [[0.1, 0.2, -0.3], [0.4, -0.5, 0.6], [0.7, 0.8, 0.9]],
            f: [1.0, -2.0, 3.0],
            k: [0.3, 0.1, -0.4],
            half_s: 0.25,
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
