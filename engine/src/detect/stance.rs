//! Does the foot stand? Two detectors behind one signature.
//!
//! Both judge a sample by its neighbours on either side, so a decision comes some samples after the
//! sample it is about: [`StanceDetector::delay`].

use std::collections::VecDeque;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Which detector, with its thresholds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "detector", rename_all = "snake_case", deny_unknown_fields)]
pub enum StanceTuning {
    /// Paper 1, §2.3: ‖ω‖ and ‖f‖ within bounds, then the majority of a centred window.
    Threshold {
        /// The rate must stay below this, rad/s.
        rate_rad_s: f64,
        /// The specific force must stay within this of gravity, m/s².
        specific_force_m_s2: f64,
        /// The window reaches so far to either side, s.
        half_window_s: f64,
    },
    /// The generalised likelihood ratio of Skog, Händel, Nilsson and Rantakokko (2010), eq. 9, over
    /// a centred window: the mean squared rate, and the mean squared difference of the specific
    /// force from a vector of gravity's length along its mean, each over its own sigma.
    LikelihoodRatio {
        /// Sigma of the rate in stance, rad/s.
        sigma_rate_rad_s: f64,
        /// Sigma of the specific force in stance, m/s².
        sigma_specific_force_m_s2: f64,
        /// The foot stands when the statistic is below this, in walking.
        threshold: f64,
        /// The statistic's own mean over the last strides up to which the threshold holds; above,
        /// it grows with the cube of that mean. In walking the mean is 400 to 1,500 and a standing
        /// foot reaches 1 to 5; in running it is 3,000 to 6,500, a foot on the ground comes down to
        /// 30 to 280 and one in mid-swing to 300 to 1,300 (measured on recorded runs and walks).
        walking_activity: f64,
        /// The time over which that mean is taken, s.
        activity_time_s: f64,
        /// A hurried gait never comes to rest so far: there the foot stands below so many times the least that the
        /// statistic has come to in the last stride,
        least_times: f64,
        /// which takes about so long, s,
        stride_s: f64,
        /// but only below this share of that mean: what is quiet is quiet beside the motion.
        activity_share: f64,
        /// Below this the foot may stand, where the strapdown has come to rest, too: a hard or hasty contact.
        /// It grows with that mean as it is.
        doubtful_threshold: f64,
        /// The window reaches so far to either side, s.
        half_window_s: f64,
    },
}

impl StanceTuning {
    /// The paper's own figures.
    pub const PAPER: StanceTuning =
        StanceTuning::Threshold { rate_rad_s: 0.6, specific_force_m_s2: 1.0, half_window_s: 0.05 };

    fn half_window_s(&self) -> f64 {
        match *self {
            StanceTuning::Threshold { half_window_s, .. } => half_window_s,
            StanceTuning::LikelihoodRatio { half_window_s, .. } => half_window_s,
        }
    }
}

impl Default for StanceTuning {
    fn default() -> Self {
        StanceTuning::LikelihoodRatio {
            sigma_rate_rad_s: 0.35,
            sigma_specific_force_m_s2: 0.35,
            threshold: 8.0,
            walking_activity: 1450.0,
            activity_time_s: 1.0,
            least_times: 3.0,
            stride_s: 1.0,
            activity_share: 0.05,
            doubtful_threshold: 140.0,
            half_window_s: 0.03,
        }
    }
}

/// What a detector says about one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StanceDecision {
    /// Whether the foot stands.
    pub stance: bool,
    /// Whether it may stand: its strapdown has to say the same.
    pub doubtful: bool,
    /// Root mean square of the angular rate around the sample, rad/s: how much a standing foot still
    /// rolls.
    pub rate_rms_rad_s: f64,
    /// Root mean square of what the specific force differs from a steady one of gravity's length,
    /// m/s².
    pub unsteadiness_m_s2: f64,
}

/// A detector at work on one foot.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StanceDetector {
    /// Set again when a saved one is taken up.
    #[serde(skip)]
    tuning: StanceTuning,
    gravity_m_s2: f64,
    #[serde(skip)]
    half_window: usize,
    window: VecDeque<Member>,
    #[serde(skip)]
    standing: usize,
    sum_rate_squared: f64,
    sum_force_squared: f64,
    sum_force: Vector3<f64>,
    since_fresh_sums: usize,
    interval_s: f64,
    /// Mean of the statistic over the last strides.
    activity: f64,
    /// The least statistic of each part of the last stride, the newest last.
    least: VecDeque<f64>,
    /// Samples of the newest part so far.
    of_part: usize,
}

/// Into so many parts a stride is cut for its least statistic.
const PARTS_OF_A_STRIDE: usize = 16;

/// More samples than any sensor sends in the longest window.
const LONGEST_HALF_WINDOW: usize = 1_000_000;

/// One heel strike counts at most this much in the mean of the statistic.
const MOST_ACTIVE: f64 = 2e4;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Member {
    within_bounds: bool,
    rate_squared: f64,
    f_b: Vector3<f64>,
}

/// Samples on either side of the one that is decided about.
fn half_window(tuning: &StanceTuning, interval_s: f64) -> usize {
    ((tuning.half_window_s() / interval_s).round() as usize).clamp(1, LONGEST_HALF_WINDOW)
}

impl StanceDetector {
    /// For samples that come every `interval_s` seconds.
    pub fn new(tuning: StanceTuning, interval_s: f64, gravity_m_s2: f64) -> Self {
        let half_window = half_window(&tuning, interval_s);
        StanceDetector {
            tuning,
            gravity_m_s2,
            half_window,
            window: VecDeque::with_capacity(2 * half_window + 2),
            standing: 0,
            sum_rate_squared: 0.0,
            sum_force_squared: 0.0,
            sum_force: Vector3::zeros(),
            since_fresh_sums: 0,
            interval_s,
            activity: 0.0,
            least: VecDeque::with_capacity(PARTS_OF_A_STRIDE + 1),
            of_part: 0,
        }
    }

    /// A detector that was saved is told its thresholds again; what follows from them is not believed but counted.
    pub(crate) fn set_tuning(&mut self, tuning: StanceTuning) {
        self.tuning = tuning;
        self.half_window = half_window(&tuning, self.interval_s);
        self.standing = self.window.iter().filter(|member| member.within_bounds).count();
    }

    /// How many samples a decision is late.
    pub fn delay(&self) -> usize {
        self.half_window
    }

    /// Takes the next sample and decides about the one [`Self::delay`] samples before it; `None`
    /// until there is one.
    #[inline]
    pub fn push(&mut self, w_ib_b: &Vector3<f64>, f_b: &Vector3<f64>) -> Option<StanceDecision> {
        if self.window.len() == 2 * self.half_window + 1 {
            self.drop_oldest();
        }
        let member = Member {
            within_bounds: self.within_bounds(w_ib_b, f_b),
            rate_squared: w_ib_b.norm_squared(),
            f_b: *f_b,
        };
        self.window.push_back(member);
        self.standing += usize::from(member.within_bounds);
        self.sum_rate_squared += member.rate_squared;
        self.sum_force_squared += f_b.norm_squared();
        self.sum_force += f_b;
        (self.window.len() > self.half_window).then(|| self.decide())
    }

    /// No more samples come: the decision about the next sample that waits for one.
    pub fn flush(&mut self) -> Option<StanceDecision> {
        if self.window.len() <= self.half_window {
            return None;
        }
        self.drop_oldest();
        (self.window.len() > self.half_window).then(|| self.decide())
    }

    fn drop_oldest(&mut self) {
        if let Some(oldest) = self.window.pop_front() {
            self.standing -= usize::from(oldest.within_bounds);
            self.sum_rate_squared -= oldest.rate_squared;
            self.sum_force_squared -= oldest.f_b.norm_squared();
            self.sum_force -= oldest.f_b;
        }
        // Running sums gather rounding after a heel strike; fresh ones now and then let it go.
        self.since_fresh_sums += 1;
        if self.since_fresh_sums >= 64 {
            self.since_fresh_sums = 0;
            self.sum_rate_squared = self.window.iter().map(|m| m.rate_squared).sum();
            self.sum_force_squared = self.window.iter().map(|m| m.f_b.norm_squared()).sum();
            self.sum_force = self.window.iter().map(|m| m.f_b).sum();
        }
    }

    fn within_bounds(&self, w_ib_b: &Vector3<f64>, f_b: &Vector3<f64>) -> bool {
        match self.tuning {
            StanceTuning::Threshold { rate_rad_s, specific_force_m_s2, .. } => {
                w_ib_b.norm_squared() < rate_rad_s * rate_rad_s
                    && (f_b.norm() - self.gravity_m_s2).abs() < specific_force_m_s2
            }
            StanceTuning::LikelihoodRatio { .. } => false,
        }
    }

    /// Takes the newest value of the statistic and tells the least of the last stride, itself included.
    fn least_of_a_stride(&mut self, statistic: f64, stride_s: f64) -> f64 {
        let samples_a_part = ((stride_s / self.interval_s) as usize / PARTS_OF_A_STRIDE).max(1);
        if self.of_part == 0 {
            self.least.push_back(statistic);
            if self.least.len() > PARTS_OF_A_STRIDE + 1 {
                self.least.pop_front();
            }
        }
        self.of_part = (self.of_part + 1) % samples_a_part;
        if let Some(newest) = self.least.back_mut() {
            *newest = newest.min(statistic);
        }
        self.least.iter().copied().fold(statistic, f64::min)
    }

    fn decide(&mut self) -> StanceDecision {
        let count = self.window.len() as f64;
        let rate_squared = (self.sum_rate_squared / count).max(0.0);
        let mean_force = self.sum_force.norm() / count;
        // mean‖f − g·f̄/‖f̄‖‖² written out.
        let unsteadiness_squared = (self.sum_force_squared / count - 2.0 * self.gravity_m_s2 * mean_force
            + self.gravity_m_s2 * self.gravity_m_s2)
            .max(0.0);
        let (stance, doubtful) = match self.tuning {
            StanceTuning::Threshold { .. } => (2 * self.standing > self.window.len(), false),
            StanceTuning::LikelihoodRatio {
                sigma_rate_rad_s,
                sigma_specific_force_m_s2,
                threshold,
                walking_activity,
                activity_time_s,
                least_times,
                stride_s,
                activity_share,
                doubtful_threshold,
                ..
            } => {
                let statistic = rate_squared / (sigma_rate_rad_s * sigma_rate_rad_s)
                    + unsteadiness_squared / (sigma_specific_force_m_s2 * sigma_specific_force_m_s2);
                let share = (self.interval_s / activity_time_s).min(1.0);
                self.activity += (statistic.min(MOST_ACTIVE) - self.activity) * share;
                let running = (self.activity / walking_activity).max(1.0);
                let hurried = (least_times * self.least_of_a_stride(statistic, stride_s))
                    .min(activity_share * self.activity);
                let stance = statistic < (threshold * running * running * running).max(hurried);
                (stance, !stance && statistic < doubtful_threshold * running)
            }
        };
        StanceDecision {
            stance,
            doubtful,
            rate_rms_rad_s: rate_squared.sqrt(),
            unsteadiness_m_s2: unsteadiness_squared.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One second still, half a second of swing, one second still, at 100 Hz.
    fn a_step() -> Vec<(Vector3<f64>, Vector3<f64>)> {
        (0..250)
            .map(|k| {
                if (100..150).contains(&k) {
                    let phase = f64::from(k - 100) * 0.1;
                    (Vector3::new(0.3, 5.0 * phase.cos(), 0.2), Vector3::new(8.0 * phase.sin(), 1.0, 12.0))
                } else {
                    (Vector3::new(0.01, 0.0, -0.01), Vector3::new(0.0, 3.3, 9.2))
                }
            })
            .collect()
    }

    fn decisions(tuning: StanceTuning) -> Vec<bool> {
        let mut detector = StanceDetector::new(tuning, 0.01, 9.787);
        let mut told: Vec<bool> =
            a_step().iter().filter_map(|(w, f)| detector.push(w, f)).map(|d| d.stance).collect();
        while let Some(decision) = detector.flush() {
            told.push(decision.stance);
        }
        told
    }

    #[test]
    fn both_detectors_decide_about_every_sample_and_find_the_swing() {
        for tuning in [StanceTuning::PAPER, StanceTuning::default()] {
            let told = decisions(tuning);
            assert_eq!(told.len(), 250);
            assert!(told[..90].iter().all(|s| *s), "stands before the swing");
            assert!(told[105..145].iter().all(|s| !*s), "swings");
            assert!(told[160..].iter().all(|s| *s), "stands after the swing");
        }
    }

    /// Five seconds of strides of 0.7 s at 200 Hz whose contacts, 0.15 s long, shake by so much, and whose swings
    /// turn by so much; the standing start before.
    fn hurried_strides(shaking_m_s2: f64, turning_rad_s: f64) -> Vec<(bool, Vector3<f64>, Vector3<f64>)> {
        let standing = (0..200).map(|_| (false, Vector3::zeros(), Vector3::new(0.0, 0.0, 9.8)));
        let strides = (0..1000).map(|k| {
            let (t_s, sign) = (f64::from(k % 140) * 0.005, if k % 2 == 0 { 1.0 } else { -1.0 });
            if t_s < 0.15 {
                (true, Vector3::new(0.4, 0.0, 0.0), Vector3::new(sign * shaking_m_s2, 0.0, 9.8))
            } else {
                let push = 20.0 * libm::sin((t_s - 0.15) * 11.4);
                (
                    false,
                    Vector3::new(turning_rad_s, 0.0, 0.0),
                    Vector3::new(push, sign * 3.0, 9.8 + push.abs()),
                )
            }
        });
        standing.chain(strides).collect()
    }

    #[test]
    fn contacts_of_a_hurried_gait_are_found_from_the_second_stride_on_and_no_swing_with_them() {
        for shaking_m_s2 in [1.2, 1.6, 2.0] {
            let walk = hurried_strides(shaking_m_s2, 5.0);
            let mut detector = StanceDetector::new(StanceTuning::default(), 0.005, 9.8);
            let mut told: Vec<bool> =
                walk.iter().filter_map(|(_, w, f)| detector.push(w, f)).map(|d| d.stance).collect();
            while let Some(decision) = detector.flush() {
                told.push(decision.stance);
            }
            let contact = |stride: usize| 200 + stride * 140..230 + stride * 140;
            let missed = (2..7).filter(|stride| !told[contact(*stride)].iter().any(|stands| *stands)).count();
            assert_eq!(missed, 0, "shaken by {shaking_m_s2} m/s²");
            let in_swings = (0..7).map(|stride| 240 + stride * 140..332 + stride * 140);
            assert!(in_swings.flat_map(|swing| told[swing].to_vec()).all(|stands| !stands));
        }
    }

    #[test]
    fn the_window_is_a_time_whatever_the_rate() {
        let delay = |interval| StanceDetector::new(StanceTuning::PAPER, interval, 9.8).delay();
        assert_eq!((delay(0.01), delay(0.004), delay(0.1)), (5, 13, 1));
    }
}
