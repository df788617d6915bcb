//! Alignment of a parked, swinging cabin: gravity, followed in the inertial frame (D. Gu et al., *Coarse alignment for marine
//! SINS using gravity in the inertial frame as a reference*, PLANS 2008).
//!
//! Gravity turns with Earth in inertial space along a cone, whose axis is north. The gyros tell the body's attitude against
//! where it was at the beginning; in that frame the second integral of the specific force is that of −gravity, beside a
//! straight line for the velocity at the beginning, and swinging does not grow in it. Both series without their straight
//! lines are fitted by a rotation (Wahba's problem).

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::ins::earth::Earth;
use crate::rotation::cayley;

/// Follows gravity from the first readings on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct GravityAlignment {
    /// Turns b into the body's frame at the beginning, which stays where it was in inertial space.
    c_ib: Matrix3<f64>,
    /// Integrals of the specific force in that frame, m/s and m, by time.
    velocity_i: Vector3<f64>,
    distance_i: Vector3<f64>,
    t_s: f64,
    /// The distances at even times.
    passed: Vec<(f64, Vector3<f64>)>,
}

impl Default for GravityAlignment {
    fn default() -> Self {
        GravityAlignment {
            c_ib: Matrix3::identity(),
            velocity_i: Vector3::zeros(),
            distance_i: Vector3::zeros(),
            t_s: 0.0,
            passed: Vec::new(),
        }
    }
}

/// Between two distances that are kept, s.
const KEPT_EVERY_S: f64 = 0.5;

impl GravityAlignment {
    /// Goes on by means over an interval, in b.
    pub(super) fn push(&mut self, dt_s: f64, w_ib_b: &Vector3<f64>, f_b: &Vector3<f64>) {
        let turned = cayley(&(w_ib_b * dt_s));
        let pushed_i = self.c_ib * (f_b + w_ib_b.cross(f_b) * (0.5 * dt_s)) * dt_s;
        self.distance_i += (self.velocity_i + pushed_i * 0.5) * dt_s;
        self.velocity_i += pushed_i;
        self.c_ib *= turned;
        self.t_s += dt_s;
        if self.t_s >= KEPT_EVERY_S * (self.passed.len() + 1) as f64 {
            self.passed.push((self.t_s, self.distance_i));
        }
    }

    /// For how long it has followed, s.
    pub(super) fn time_s(&self) -> f64 {
        self.t_s
    }

    /// The attitude now, c_nb; `None` before twenty seconds.
    pub(super) fn attitude(&self, earth: &Earth, p_n: &Vector3<f64>) -> Option<Matrix3<f64>> {
        if self.t_s < 20.0 {
            return None;
        }
        let g_n = earth.gravity_n(p_n);
        let times: Vec<f64> = self.passed.iter().map(|(t_s, _)| *t_s).collect();
        let found: Vec<Vector3<f64>> = self.passed.iter().map(|(_, distance_i)| *distance_i).collect();
        // In n as it stood at the beginning gravity turns with Earth: the second integral of −g, by its series in time.
        let w_n = earth.w_ie_n();
        let (once, twice) = (w_n.cross(&g_n), w_n.cross(&w_n.cross(&g_n)));
        let felt: Vec<Vector3<f64>> = (times.iter())
            .map(|t| -(g_n * (t * t / 2.0) + once * (t.powi(3) / 6.0) + twice * (t.powi(4) / 24.0)))
            .collect();
        let (found, felt) = (without_line(&times, &found), without_line(&times, &felt));
        let mut product = Matrix3::zeros();
        for (n, i) in felt.iter().zip(&found) {
            product += n * i.transpose();
        }
        let svd = product.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let mut sign = Matrix3::identity();
        let smallest = svd.singular_values.imin();
        sign[(smallest, smallest)] = (u * v_t).determinant().signum();
        // From n at the beginning to n now, and from the body then to the body now.
        Some(cayley(&(w_n * -self.t_s)) * (u * sign * v_t) * self.c_ib)
    }
}

/// A series less its straight line by least squares.
fn without_line(times: &[f64], series: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let count = times.len() as f64;
    let mean_t = times.iter().sum::<f64>() / count;
    let mean = series.iter().sum::<Vector3<f64>>() / count;
    let squares: f64 = times.iter().map(|t| (t - mean_t) * (t - mean_t)).sum();
    let slope: Vector3<f64> =
        times.iter().zip(series).map(|(t, x)| (x - mean) * (t - mean_t)).sum::<Vector3<f64>>() / squares;
    times.iter().zip(series).map(|(t, x)| x - mean - slope * (t - mean_t)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::{Geodetic, LocalFrame};

    #[test]
    fn a_parked_cabin_that_swings_is_levelled_and_finds_north_within_a_minute() {
        let frame = LocalFrame::new(Geodetic { latitude_deg: 25.65, longitude_deg: 106.86, height_m: 840.0 });
        let earth = Earth::turning(&frame);
        let c_nb = cayley(&Vector3::new(0.05, -0.08, 1.1));
        let mut alignment = GravityAlignment::default();
        for k in 0..12_000 {
            let t_s = (k as f64 + 0.5) * 0.005;
            // It swings by 20 mm each way every 6 s, and does not turn.
            let sway = -0.02 * 1.05_f64.powi(2) * libm::sin(1.05 * t_s);
            // It begins at full speed.
            let f_n = Vector3::new(sway, -0.7 * sway, 0.0) - earth.gravity_n(&Vector3::zeros());
            alignment.push(0.005, &c_nb.tr_mul(&earth.w_ie_n()), &c_nb.tr_mul(&f_n));
        }
        let found = alignment.attitude(&earth, &Vector3::zeros()).unwrap();
        let off = nalgebra::Rotation3::from_matrix_unchecked(found * c_nb.transpose()).scaled_axis();
        assert!(off.xy().norm().to_degrees() < 0.01, "level {}°", off.xy().norm().to_degrees());
        assert!(off.z.abs().to_degrees() < 0.6, "yaw {}°", off.z.to_degrees());
        assert!(GravityAlignment::default().attitude(&earth, &Vector3::zeros()).is_none());
    }
}
