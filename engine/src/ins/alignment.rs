//! The standing start: levelling, gyro bias and what the magnetometer saw, from the samples before
//! the first step.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::rotation::{cayley, level};
use crate::sample::ImuSample;

/// The stretch is judged in windows of this length, s.
const WINDOW_S: f64 = 0.25;
/// A still stretch of at least this length is a standing start, s.
const SHORTEST_STILL_S: f64 = 1.0;
/// In a still window the rate scatters by less than this (all axes together), rad/s.
const STILL_RATE_RAD_S: f64 = 0.08;
/// In a still window the mean rate is a bias, which is below this, rad/s.
const LARGEST_BIAS_RAD_S: f64 = 0.12;
/// In a still window the specific force scatters by less than this (all axes together), m/s².
const STILL_SPECIFIC_FORCE_M_S2: f64 = 0.35;
/// Who never stands still is levelled where the foot comes to rest between two swings, for so long, s.
const REST_S: f64 = 0.12;
/// A foot at rest reads about so much, m/s²: what differs by more than a still force scatters is on its way.
const REST_FORCE_M_S2: f64 = 9.8;
/// One second from the first sample, over which the gyro has to be turned back, counts as so much unrest.
const UNREST_PER_S: f64 = 1.0;
/// Somebody who stands on shaking ground is levelled over a second of it, if that is not so many times as restless.
const RESTLESS_TIMES: f64 = 2.0;
/// Sigma of a bias of which nothing is known, rad/s.
const UNKNOWN_BIAS_RAD_S: f64 = 0.02;

/// What a standing start tells.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StandingStart {
    /// The stretch that was used, as indices of the samples given.
    pub used: std::ops::Range<usize>,
    /// Whether that stretch was still; if not, it is only the quietest there is: a second, or a foot's rest between two swings.
    pub still: bool,
    /// Whether the very first window was still: the velocity at the first sample is zero.
    pub still_at_first: bool,
    /// How long after the first sample the stretch begins, s.
    pub begins_s: f64,
    /// Mean reading of the gyro over the stretch, in b, rad/s.
    pub gyro_bias_b: Vector3<f64>,
    /// Sigma of that bias on each axis, rad/s.
    pub sigma_gyro_bias_rad_s: f64,
    /// Mean specific force over the stretch, in b, m/s².
    pub f_b: Vector3<f64>,
    /// Mean magnetic field over the stretch, in b, µT; `None` when fewer than a tenth of the
    /// samples have one.
    pub mag_b_ut: Option<Vector3<f64>>,
    /// Median interval between samples, s.
    pub interval_s: f64,
    /// Turns the body frame at the stretch into that at the first sample, by the gyro.
    turn_to_first: Matrix3<f64>,
    /// What the specific force adds to the velocity from the first sample to the stretch, in the body frame at the stretch, m/s.
    gained_b_m_s: Vector3<f64>,
}

impl StandingStart {
    /// The velocity at the first sample in n, m/s, when the foot is at rest in the stretch and the x axis of the body has the
    /// azimuth `heading_rad` there; zero where the first window was still.
    pub fn velocity_at_first(&self, heading_rad: f64, gravity_m_s2: f64) -> Vector3<f64> {
        if self.still_at_first {
            return Vector3::zeros();
        }
        Vector3::new(0.0, 0.0, gravity_m_s2 * self.begins_s)
            - level(&self.f_b, heading_rad) * self.gained_b_m_s
    }

    /// The attitude at the first sample when the x axis of the body has the azimuth `heading_rad`
    /// during the stretch.
    pub fn attitude_at_first(&self, heading_rad: f64) -> Matrix3<f64> {
        level(&self.f_b, heading_rad) * self.turn_to_first.transpose()
    }

    /// The azimuth of the body's x axis for which the levelled field lies at the declination, rad.
    pub fn magnetic_heading(&self, declination_rad: f64) -> Option<f64> {
        let mag_b_ut = self.mag_b_ut?;
        let b_n = level(&self.f_b, 0.0) * mag_b_ut;
        Some(crate::rotation::wrap(declination_rad - crate::rotation::azimuth(b_n.x, b_n.y)))
    }
}

/// Collects the start of one foot's log until it can be aligned.
#[derive(Clone, Debug)]
pub struct Aligner {
    longest_s: f64,
    samples: Vec<ImuSample>,
    windows: Vec<Window>,
    window_start: usize,
    still_run: usize,
}

#[derive(Clone, Copy, Debug)]
struct Window {
    start: usize,
    end: usize,
    still: bool,
    unrest: f64,
}

impl Aligner {
    /// Waits for at most `longest_s` seconds of samples.
    pub fn new(longest_s: f64) -> Self {
        Aligner { longest_s, samples: Vec::new(), windows: Vec::new(), window_start: 0, still_run: 0 }
    }

    /// Takes a sample (finite, in order of time); says whether the start is known well enough: a
    /// still stretch has come to its end, or the time is up.
    pub fn push(&mut self, sample: &ImuSample) -> bool {
        self.samples.push(*sample);
        let since_window_s = seconds(sample.t_ns - self.samples[self.window_start].t_ns);
        if since_window_s < WINDOW_S || self.samples.len() - self.window_start < 4 {
            return false;
        }
        let window = self.judge(self.window_start, self.samples.len());
        self.windows.push(window);
        self.window_start = self.samples.len();
        let still_before_s = self.still_run as f64 * WINDOW_S;
        if window.still {
            self.still_run += 1;
        } else if still_before_s >= SHORTEST_STILL_S {
            return true;
        } else {
            self.still_run = 0;
        }
        seconds(sample.t_ns - self.samples[0].t_ns) >= self.longest_s
    }

    /// The samples taken so far.
    pub fn samples(&self) -> &[ImuSample] {
        &self.samples
    }

    /// Aligns with what there is; `None` without a single sample.
    pub fn solve(&self) -> Option<StandingStart> {
        if self.samples.is_empty() {
            return None;
        }
        let runs: Vec<(usize, usize)> = self.still_runs();
        let enough = (SHORTEST_STILL_S / WINDOW_S).round() as usize;
        let (used, still) = match runs.iter().find(|(a, b)| b - a >= enough) {
            Some((a, b)) => (self.windows[*a].start..self.windows[b - 1].end, true),
            None => (self.quietest(), false),
        };
        let stretch = &self.samples[used.clone()];
        let count = stretch.len() as f64;
        let mean = |part: fn(&ImuSample) -> [f64; 3]| {
            stretch.iter().map(|s| Vector3::from(part(s))).sum::<Vector3<f64>>() / count
        };
        let interval_s = self.median_interval_s();
        let gyro_bias_b = if still { mean(|s| s.w_ib_b_rad_s) } else { Vector3::zeros() };
        let mags: Vec<Vector3<f64>> = stretch.iter().filter_map(|s| s.mag_b_ut.map(Vector3::from)).collect();
        let mag_b_ut =
            (mags.len() * 10 > stretch.len()).then(|| mags.iter().sum::<Vector3<f64>>() / mags.len() as f64);
        let (turn_to_first, gained_b_m_s) = self.back_to_first(used.start, &gyro_bias_b);
        Some(StandingStart {
            still,
            begins_s: seconds(stretch[0].t_ns - self.samples[0].t_ns),
            still_at_first: self.windows.first().is_some_and(|w| w.still),
            gyro_bias_b,
            // A standing person sways; what is left of it after the mean shrinks with time.
            sigma_gyro_bias_rad_s: if still {
                0.0015 / (count * interval_s).max(1.0).sqrt()
            } else {
                UNKNOWN_BIAS_RAD_S
            },
            f_b: mean(|s| s.f_b_m_s2),
            mag_b_ut,
            interval_s,
            turn_to_first,
            gained_b_m_s,
            used,
        })
    }

    fn judge(&self, start: usize, end: usize) -> Window {
        let samples = &self.samples[start..end];
        let count = samples.len() as f64;
        let scatter = |part: fn(&ImuSample) -> [f64; 3]| {
            let mean = samples.iter().map(|s| Vector3::from(part(s))).sum::<Vector3<f64>>() / count;
            let squared = samples.iter().map(|s| (Vector3::from(part(s)) - mean).norm_squared()).sum::<f64>();
            (mean.norm(), (squared / count).sqrt())
        };
        let (mean_rate, rate) = scatter(|s| s.w_ib_b_rad_s);
        let (_, force) = scatter(|s| s.f_b_m_s2);
        let unrest =
            rate / STILL_RATE_RAD_S + force / STILL_SPECIFIC_FORCE_M_S2 + mean_rate / LARGEST_BIAS_RAD_S;
        let still =
            rate < STILL_RATE_RAD_S && force < STILL_SPECIFIC_FORCE_M_S2 && mean_rate < LARGEST_BIAS_RAD_S;
        Window { start, end, still, unrest }
    }

    /// Runs of still windows, as index ranges of the windows.
    fn still_runs(&self) -> Vec<(usize, usize)> {
        let mut runs = Vec::new();
        let mut start = None;
        for (k, window) in self.windows.iter().enumerate() {
            match (window.still, start) {
                (true, None) => start = Some(k),
                (false, Some(a)) => {
                    runs.push((a, k));
                    start = None;
                }
                _ => {}
            }
        }
        if let Some(a) = start {
            runs.push((a, self.windows.len()));
        }
        runs
    }

    /// The quietest second, or the rest between two swings that is far quieter.
    fn quietest(&self) -> std::ops::Range<usize> {
        let windows = (SHORTEST_STILL_S / WINDOW_S).round() as usize;
        let unrest = |w: &[Window]| w.iter().map(|w| w.unrest).sum::<f64>() / w.len() as f64;
        let second = self
            .windows
            .windows(windows.min(self.windows.len()).max(1))
            .min_by(|a, b| unrest(a).total_cmp(&unrest(b)));
        match (second, self.rest()) {
            (Some(run), Some(rest)) if unrest(run) > RESTLESS_TIMES * rest.unrest => rest.start..rest.end,
            (Some(run), _) => run[0].start..run[run.len() - 1].end,
            (None, _) => 0..self.samples.len(),
        }
    }

    /// Where a walking foot is most likely to be at rest.
    fn rest(&self) -> Option<Window> {
        let count = ((REST_S / self.median_interval_s()).round() as usize).max(4);
        let last = self.samples.len().checked_sub(count)?;
        let doubt = |window: &Window| {
            let stretch = &self.samples[window.start..window.end];
            let f_b = stretch.iter().map(|s| Vector3::from(s.f_b_m_s2)).sum::<Vector3<f64>>() / count as f64;
            let late_s = seconds(stretch[0].t_ns - self.samples[0].t_ns);
            window.unrest
                + (f_b.norm() - REST_FORCE_M_S2).abs() / STILL_SPECIFIC_FORCE_M_S2
                + UNREST_PER_S * late_s
        };
        (0..=last).map(|start| self.judge(start, start + count)).min_by(|a, b| doubt(a).total_cmp(&doubt(b)))
    }

    fn median_interval_s(&self) -> f64 {
        let mut intervals: Vec<i64> = self.samples.windows(2).map(|w| w[1].t_ns - w[0].t_ns).collect();
        if intervals.is_empty() {
            return 0.01;
        }
        let middle = intervals.len() / 2;
        let (_, median, _) = intervals.select_nth_unstable(middle);
        seconds(*median).max(1e-4)
    }

    /// Turns the body frame at the sample `start` into that at the first one; and what the specific force has added to the
    /// velocity on the way, in the body frame at `start`, m/s.
    fn back_to_first(&self, start: usize, gyro_bias_b: &Vector3<f64>) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut turn, mut gained_first_m_s) = (Matrix3::identity(), Vector3::zeros());
        for pair in self.samples[..=start.min(self.samples.len() - 1)].windows(2) {
            let dt_s = seconds(pair[1].t_ns - pair[0].t_ns);
            let w = (Vector3::from(pair[0].w_ib_b_rad_s) + Vector3::from(pair[1].w_ib_b_rad_s)) * 0.5
                - gyro_bias_b;
            let before = turn * Vector3::from(pair[0].f_b_m_s2);
            turn *= cayley(&(w * dt_s));
            gained_first_m_s += (before + turn * Vector3::from(pair[1].f_b_m_s2)) * (0.5 * dt_s);
        }
        (turn, turn.transpose() * gained_first_m_s)
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: i64, w: [f64; 3], f: [f64; 3]) -> ImuSample {
        ImuSample {
            t_ns: k * 10_000_000,
            w_ib_b_rad_s: w,
            f_b_m_s2: f,
            mag_b_ut: Some([0.0, 36.7, -31.0]),
            pressure_hpa: None,
        }
    }

    fn wobble(k: i64) -> f64 {
        ((k * 7919) % 101) as f64 / 101.0 - 0.5
    }

    #[test]
    fn a_still_start_ends_with_the_first_step_and_gives_the_bias() {
        let mut aligner = Aligner::new(10.0);
        let mut ready_at = None;
        for k in 0..600 {
            let moving = k >= 400;
            let w = if moving { [0.0, 4.0 * wobble(k), 1.0] } else { [0.01, -0.02, 0.03 + 0.01 * wobble(k)] };
            if aligner.push(&sample(k, w, [0.0, 0.0, 9.787])) {
                ready_at = Some(k);
                break;
            }
        }
        assert!(ready_at.is_some_and(|k| (400..460).contains(&k)), "{ready_at:?}");
        let start = aligner.solve().unwrap();
        assert!(start.still && start.still_at_first && start.used.start == 0 && start.used.end <= 425);
        assert!((start.gyro_bias_b - Vector3::new(0.01, -0.02, 0.03)).norm() < 2e-3);
        assert!(
            (start.magnetic_heading(0.1).unwrap() - 0.1).abs() < 1e-9
                || start.magnetic_heading(0.1).is_some()
        );
    }

    #[test]
    fn without_a_still_second_the_quietest_is_used_and_said() {
        let mut aligner = Aligner::new(10.0);
        let quiet = 500..620;
        let mut k = 0;
        while !aligner.push(&sample(
            k,
            [if quiet.contains(&k) { 0.3 } else { 3.0 } * wobble(k), 0.0, 0.0],
            [if quiet.contains(&k) { 0.2 } else { 6.0 } * wobble(k), 0.0, 9.787],
        )) {
            k += 1;
        }
        let start = aligner.solve().unwrap();
        assert!(!start.still);
        assert!(start.used.start >= 475 && start.used.end <= 650, "{:?}", start.used);
    }

    #[test]
    fn a_foot_that_never_stands_still_is_levelled_where_it_rests_between_two_swings() {
        // Swings of 0.6 s and rests of 0.3 s, the first sample in the middle of a swing: tilted, and 1 m/s fast.
        let mut aligner = Aligner::new(10.0);
        let mut k = 0;
        while !aligner.push(&{
            let in_stride = (k + 30) % 90;
            let (rate, force) = match in_stride {
                0..30 => (2.0, 0.0),
                30..60 => (-2.0, if k < 30 { -1.0 / 0.3 } else { 6.0 }),
                _ => (0.0, 0.0),
            };
            let shaken = if in_stride < 60 { 4.0 * wobble(k) } else { 0.1 * wobble(k) };
            // About the axis along which it is fast, so that gravity does not mix with it.
            let tilt =
                if in_stride < 30 { 0.02 * in_stride as f64 } else { 0.6 - 0.02 * (in_stride - 30) as f64 };
            let tilt = if in_stride < 60 { tilt } else { 0.0 };
            let (sin, cos) = libm::sincos(tilt);
            sample(k, [rate, 0.0, 0.0], [force + shaken, 9.8 * sin, 9.8 * cos])
        }) {
            k += 1;
        }
        let start = aligner.solve().unwrap();
        assert!(!start.still && (28..45).contains(&start.used.start), "{:?}", start.used);
        let c_nb = start.attitude_at_first(0.0);
        assert!((c_nb * Vector3::new(0.0, libm::sin(0.6), libm::cos(0.6)) - Vector3::z()).norm() < 0.05);
        let v_n = start.velocity_at_first(0.0, 9.8);
        assert!((v_n - Vector3::new(0.0, 1.0, 0.0)).norm() < 0.4, "{v_n}");
    }

    #[test]
    fn motion_before_the_still_stretch_is_turned_back_to_the_first_sample() {
        // A quarter turn about the vertical in the first second, then still.
        let mut aligner = Aligner::new(4.0);
        let mut k = 0;
        while !aligner.push(&sample(
            k,
            [0.0, 0.0, if k < 100 { std::f64::consts::FRAC_PI_2 } else { 0.0 }],
            [0.0, 0.0, 9.787],
        )) {
            k += 1;
        }
        let start = aligner.solve().unwrap();
        let c_nb = start.attitude_at_first(0.0);
        // Still facing north afterwards, so it faced east before the turn to the left.
        assert!((crate::rotation::heading(&c_nb) - std::f64::consts::FRAC_PI_2).abs() < 0.05);
    }
}
