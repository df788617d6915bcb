//! What an inertial sensor's samples say of the sensor itself.
//!
//! A cabin of thirty tons moves below some hertz: from sample to sample only noise changes. The second difference of white noise has six
//! times its variance, so it gives the noise that there is, whatever the maker states (motion of 0.05 m/s² at 1 Hz adds 5·10⁻⁵ m/s² to it
//! at 200 Hz). A single sample far off its neighbours is none of a cabin, and one axis that reads the same for long is stuck.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The noise is known after so many samples and is over so many.
const FEWEST: u32 = 40;
const SAMPLES: f64 = 100.0;
/// A sample is a spike where it is off the last one by so many sigmas of the noise, and by so much at least, m/s² and rad/s.
const SPIKE_SIGMAS: f64 = 12.0;
const LEAST_SPIKE: [f64; 2] = [0.05, 4e-4];
/// What stays is no spike: so many in a row are taken for what they are.
const SPIKES_IN_ROW: u32 = 3;
/// It stays where it is off the first by so much of the leap at most.
const STAYS: f64 = 0.3;
/// One axis is stuck after so many samples of the same number, where it never had a tenth of that before.
const STUCK_AFTER: u32 = 100;
/// The sensor is told to be noisy from so many times the stated density on.
const NOISY: f64 = 2.0;

/// Force, then rate.
type Reading = [Vector3<f64>; 2];

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct SensorWatch {
    last: Option<Reading>,
    before: Option<Reading>,
    /// Variance of an axis' white noise, (m/s²)² and (rad/s)².
    variance: [f64; 2],
    samples: u32,
    spikes: u32,
    /// The first of them.
    leapt: Option<Reading>,
    same: [[u32; 3]; 2],
    longest_same: [[u32; 3]; 2],
}

/// What a sample is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sampled {
    Good,
    Spike,
    /// The sensor reads otherwise from now on: by so much, in the axes of the case, m/s² and rad/s.
    Leap([Vector3<f64>; 2]),
    /// One of its axes reads the same again and again.
    StuckAxis,
}

impl SensorWatch {
    /// A sample: specific force, m/s², and rate, rad/s, in the axes of the case.
    pub(super) fn take(&mut self, f_s: &Vector3<f64>, w_s: &Vector3<f64>) -> Sampled {
        let now = [*f_s, *w_s];
        let Some(last) = self.last else {
            self.last = Some(now);
            return Sampled::Good;
        };
        let is_known = self.samples >= FEWEST;
        let leaps = (0..2).any(|k| {
            let most = (SPIKE_SIGMAS * self.variance[k].sqrt()).max(LEAST_SPIKE[k]);
            (now[k] - last[k]).amax() > most
        });
        if is_known && leaps && self.spikes < SPIKES_IN_ROW {
            self.spikes += 1;
            self.leapt.get_or_insert(now);
            return Sampled::Spike;
        }
        // After a leap that stayed differences begin anew; else they are of the noise, which has become more.
        let first = self.leapt.take().filter(|_| leaps && is_known);
        let leap = first.map(|first| [first[0] - last[0], first[1] - last[1]]);
        let stays = first.zip(leap).is_some_and(|(first, leap)| {
            (0..2).all(|k| {
                let noise = (SPIKE_SIGMAS * self.variance[k].sqrt()).max(0.5 * LEAST_SPIKE[k]);
                (now[k] - first[k]).amax() < noise.max(STAYS * leap[k].amax())
            })
        });
        let begins_anew = stays;
        self.spikes = 0;
        let is_stuck = self.is_stuck(&now, &last);
        if let Some(before) = self.before.filter(|_| !begins_anew) {
            self.samples = self.samples.saturating_add(1);
            let share = 1.0 / f64::from(self.samples).min(SAMPLES);
            for k in 0..2 {
                let second = now[k] - last[k] * 2.0 + before[k];
                self.variance[k] += share * (second.norm_squared() / 18.0 - self.variance[k]);
            }
        }
        self.before = if begins_anew { None } else { Some(last) };
        self.last = Some(now);
        match leap {
            _ if is_stuck => Sampled::StuckAxis,
            Some(leap) if stays => Sampled::Leap(leap),
            _ => Sampled::Good,
        }
    }

    /// After a silence the next sample has no neighbour.
    pub(super) fn begin_anew(&mut self) {
        (self.last, self.before, self.leapt) = (None, None, None);
    }

    fn is_stuck(&mut self, now: &Reading, last: &Reading) -> bool {
        let mut stuck = false;
        for k in 0..2 {
            for axis in 0..3 {
                let same = if now[k][axis] == last[k][axis] { self.same[k][axis] + 1 } else { 0 };
                if same == 0 && self.same[k][axis] < STUCK_AFTER {
                    self.longest_same[k][axis] = self.longest_same[k][axis].max(self.same[k][axis]);
                }
                self.same[k][axis] = same;
                stuck |= same >= STUCK_AFTER && 10 * self.longest_same[k][axis] < STUCK_AFTER;
            }
        }
        stuck
    }

    /// Densities of the noise by the samples, m/s/√s and rad/√s, of samples so far apart, s.
    pub(super) fn densities(&self, dt_s: f64) -> Option<[f64; 2]> {
        (self.samples >= FEWEST).then(|| self.variance.map(|variance| (variance * dt_s).sqrt()))
    }

    /// By how much the noise is more than the stated densities, where it is much more.
    pub(super) fn noisy(&self, dt_s: f64, stated: [f64; 2]) -> Option<f64> {
        let found = self.densities(dt_s)?;
        let times = (0..2).map(|k| found[k] / stated[k].max(1e-12)).fold(0.0, f64::max);
        (times > NOISY).then_some(times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look like white noise of sigma 1.
    fn noise(k: u64) -> f64 {
        let mixed = (k.wrapping_add(1)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((mixed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
    }

    fn sample(k: u64, sigma: f64) -> [Vector3<f64>; 2] {
        let t_s = k as f64 * 0.005;
        let swing = 0.05 * libm::sin(6.0 * t_s);
        let of = |at: u64| Vector3::new(noise(6 * k + at), noise(6 * k + at + 1), noise(6 * k + at + 2));
        [Vector3::new(swing, 0.0, 9.8) + of(0) * sigma, of(3) * (sigma * 1e-2)]
    }

    #[test]
    fn the_noise_is_that_of_the_samples_while_the_cabin_swings() {
        let mut watch = SensorWatch::default();
        for k in 0..400 {
            let [f, w] = sample(k, 0.01);
            assert_eq!(watch.take(&f, &w), Sampled::Good);
        }
        let [force, rate] = watch.densities(0.005).unwrap();
        assert!((force / (0.01 * 0.005_f64.sqrt()) - 1.0).abs() < 0.15, "{force}");
        assert!((rate / (1e-4 * 0.005_f64.sqrt()) - 1.0).abs() < 0.15, "{rate}");
        assert!(watch.noisy(0.005, [force, rate]).is_none());
        assert!((watch.noisy(0.005, [force / 5.0, rate]).unwrap() - 5.0).abs() < 1e-9);
    }

    #[test]
    fn a_spike_is_left_out_and_what_stays_is_not() {
        let mut watch = SensorWatch::default();
        let mut told = Vec::new();
        for k in 0..300 {
            let [mut f, w] = sample(k, 0.001);
            if k == 100 || k >= 200 {
                f.y += 5.0;
            }
            told.push(watch.take(&f, &w));
        }
        let spikes: Vec<usize> = (0..300).filter(|k| told[*k] == Sampled::Spike).collect();
        assert_eq!(spikes, [100, 200, 201, 202]);
        let Sampled::Leap([force, _]) = told[203] else { panic!("{:?}", told[203]) };
        assert!((force - Vector3::new(0.0, 5.0, 0.0)).norm() < 0.05, "{force}");
    }

    #[test]
    fn one_axis_that_stays_as_it_is_is_stuck_and_a_coarse_one_is_not() {
        let (mut watch, mut coarse) = (SensorWatch::default(), SensorWatch::default());
        for k in 0..800 {
            let [mut f, mut w] = sample(k, 0.001);
            w.z = libm::round(w.z * 1e4) * 1e-4 + if k % 90 == 0 { 1e-4 } else { 0.0 };
            assert_eq!(coarse.take(&f, &w), Sampled::Good, "{k}");
            if k >= 300 {
                f.x = 0.02;
            }
            w.z = 0.0 + noise(k);
            let found = watch.take(&f, &w);
            assert!(found == Sampled::Good || k >= 400, "{k}: {found:?}");
            assert!(found == Sampled::StuckAxis || k < 401, "{k}: {found:?}");
        }
    }
}
