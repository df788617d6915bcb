//! How noisy a sensor is, by its own samples: what the filter takes for granted is one class, and there are worse ones.
//!
//! Sixth differences of a hand's motion are nothing beside those of white noise, of which σ makes √924 σ; their median knows
//! nothing of strikes and slips. A sensor that filters its output shows less than its noise, so that one that seems better
//! than what is taken for granted is not believed.

use nalgebra::Vector3;

use super::tuning::Tuning;
use crate::sample::ImuSample;

/// Sixth differences, and the sum of their squares.
const DIFFERENCES: [f64; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
const SQUARES: f64 = 924.0;
/// The median of a normal's magnitude, in sigmas.
const MEDIAN: f64 = 0.674_49;
/// So many of them say something.
const FEWEST: usize = 500;
/// No more than this are looked at: the first of a recording.
const MOST: usize = 20_000;
/// What is taken for granted is this much more than a good data sheet's noise.
const MARGIN: f64 = 1.15;
/// No sensor is worse than so many times what is taken for granted.
const WORST: f64 = 6.0;

/// Noise densities of the gyro (rad/√s) and the accelerometer (m/s/√s), root mean square of the axes; `None` where samples are
/// few or come irregularly.
fn noise(imu: &[ImuSample]) -> Option<[f64; 2]> {
    let mut between_ns: Vec<i64> =
        imu.windows(2).take(MOST).map(|pair| pair[1].t_ns - pair[0].t_ns).collect();
    if between_ns.len() < FEWEST {
        return None;
    }
    let middle = between_ns.len() / 2;
    let period_ns = *between_ns.select_nth_unstable(middle).1;
    let spans = period_ns * 6;
    let regular: Vec<&[ImuSample]> = imu
        .windows(7)
        .take(MOST)
        .filter(|seven| (seven[6].t_ns - seven[0].t_ns - spans).abs() < period_ns / 2)
        .collect();
    if regular.len() < FEWEST {
        return None;
    }
    let density = |reading: fn(&ImuSample) -> [f64; 3]| {
        let variance: f64 = (0..3)
            .map(|axis| {
                let mut differences: Vec<f64> = regular
                    .iter()
                    .map(|seven| {
                        let sum: f64 = DIFFERENCES
                            .iter()
                            .zip(*seven)
                            .map(|(by, sample)| by * reading(sample)[axis])
                            .sum();
                        sum.abs()
                    })
                    .collect();
                let middle = differences.len() / 2;
                let median = *differences.select_nth_unstable_by(middle, f64::total_cmp).1;
                median * median / (MEDIAN * MEDIAN * SQUARES)
            })
            .sum();
        (variance / 3.0 * period_ns as f64 * 1e-9).sqrt()
    };
    Some([density(|sample| sample.w_ib_b_rad_s), density(|sample| sample.f_b_m_s2)])
}

/// The tuning for the sensor that took these samples: one that is noisier than what is taken for granted is worse in all
/// that its class is known by.
pub(super) fn tuned(tuning: &Tuning, imu: &[ImuSample]) -> Tuning {
    let mut tuning = tuning.clone();
    let Some([gyro, accelerometer]) = noise(imu) else { return tuning };
    let of = &mut tuning.imu;
    let worse = |measured: f64, granted: f64| (MARGIN * measured / granted).clamp(1.0, WORST);
    let by_gyro = worse(gyro, of.angle_random_walk_rad_sqrt_s);
    let by_force = worse(accelerometer, of.velocity_random_walk_m_s_sqrt_s);
    of.angle_random_walk_rad_sqrt_s *= by_gyro;
    of.velocity_random_walk_m_s_sqrt_s *= by_force;
    let by = Vector3::new(by_gyro, by_force, 1.0).max();
    let start = &mut tuning.start;
    start.scale *= by;
    start.cross_rad *= by;
    start.walking_rad_s *= by;
    start.accelerometer_bias_m_s2 *= by_force;
    tuning
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(gyro: f64, force: f64, trembles: f64) -> Vec<ImuSample> {
        // A plain generator: what is tested is a median.
        let mut word = 1_u64;
        let mut noise = move || {
            (0..12)
                .map(|_| {
                    word =
                        word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (word >> 11) as f64 / (1_u64 << 53) as f64
                })
                .sum::<f64>()
                - 6.0
        };
        (0..6000_i64)
            .map(|k| {
                let swing = trembles * libm::sin(25.0 * k as f64 * 0.01);
                ImuSample {
                    t_ns: k * 10_000_000,
                    w_ib_b_rad_s: [0, 1, 2].map(|_| swing + gyro * 10.0 * noise()),
                    f_b_m_s2: [0, 1, 2].map(|_| swing + force * 10.0 * noise()),
                    mag_b_ut: None,
                    pressure_hpa: None,
                }
            })
            .collect()
    }

    #[test]
    fn noise_is_measured_beside_a_hand_that_trembles() {
        let [gyro, force] = noise(&samples(2e-4, 3e-3, 0.05)).unwrap();
        assert!((gyro / 2e-4 - 1.0).abs() < 0.05, "{gyro}");
        assert!((force / 3e-3 - 1.0).abs() < 0.05, "{force}");
    }

    #[test]
    fn a_worse_sensor_is_taken_for_one_and_a_better_one_is_not() {
        let usual = Tuning::default();
        assert_eq!(tuned(&usual, &samples(1e-6, 1e-5, 0.05)), usual);
        let worse = tuned(&usual, &samples(2e-4, 1e-5, 0.05));
        assert!((worse.imu.angle_random_walk_rad_sqrt_s / 2.3e-4 - 1.0).abs() < 0.05);
        assert!(worse.start.scale > 2.0 * usual.start.scale);
        assert_eq!(worse.imu.velocity_random_walk_m_s_sqrt_s, usual.imu.velocity_random_walk_m_s_sqrt_s);
        assert_eq!(tuned(&usual, &samples(2e-4, 1e-5, 0.05)[..300]), usual);
    }
}
