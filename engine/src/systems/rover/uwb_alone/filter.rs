//! One Kalman filter over position, velocity and the biases of ranges, for one model of them.
//!
//! States: position (its height against the reference height), velocity, the tag's slow bias, the quick bias that all
//! anchors share, the scale of ranges; then for each anchor a slow and a quick bias. Everything is linear but the range
//! itself, and a range is one number: an update is a product of a row and a matrix.

use super::model::{
    CLIMB_TIME_S, COMMON_LASTS, HEIGHT_TIME_S, KNOWN_HEIGHT_TIME_S, Model, QUICK_TIME_S, QUICK_WAY_M,
    SLOW_TIME_S, VELOCITY_TIME_S,
};
use super::tape::{Entry, Tape};
use crate::systems::rover::anchors::AntennaHeight;
use crate::systems::rover::ranges::{self, Line};

/// The tag's slow bias.
const TAG: usize = 6;
/// The quick bias of all anchors.
const COMMON: usize = 7;
/// The scale of ranges.
const SCALE: usize = 8;
/// States before those of the anchors.
const SHARED: usize = 9;
/// Beyond this many sigmas an innovation is weighed down.
const HUBER: f64 = 2.5;
/// Beyond this many sigmas a range is rejected.
const GATE: f64 = 4.5;
/// Share of gross errors that is reckoned with, and their density, 1/m.
const GROSS_SHARE: f64 = 0.03;
const GROSS_DENSITY: f64 = 1.0 / 60.0;
/// So many rejections of one anchor in a row, alike and not absurd, are a path that has changed.
const CHANGED_PATH: u32 = 4;
const MOST_CHANGE_M: f64 = 4.0;

/// What became of a range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    /// It went into the filter.
    pub(super) used: bool,
    /// Logarithm of how likely it was.
    pub(super) log_likelihood: f64,
}

/// What of an anchor's noise has been learnt.
#[derive(Clone, Copy, Debug)]
struct Learnt {
    /// Variance of the white noise against the model's.
    factor: f64,
    /// Rejections in a row, and the last innovation.
    rejected: u32,
    innovation_m: f64,
}

/// A filter and its model.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    pub(super) model: Model,
    height: AntennaHeight,
    t_s: f64,
    started_s: f64,
    x: Vec<f64>,
    p: Vec<f64>,
    learnt: Vec<Learnt>,
    bias_m: f64,
}

impl Filter {
    /// A filter at a position, its sigmas along and up, m.
    pub(super) fn new(
        model: Model,
        height: AntennaHeight,
        bias_m: f64,
        anchors: usize,
        t_s: f64,
        start: &Start,
    ) -> Filter {
        let n = SHARED + 2 * anchors;
        let mut filter = Filter {
            model,
            height,
            t_s,
            started_s: t_s,
            x: vec![0.0; n],
            p: vec![0.0; n * n],
            learnt: vec![Learnt { factor: 1.0, rejected: 0, innovation_m: 0.0 }; anchors],
            bias_m,
        };
        filter.x[..2].copy_from_slice(&start.p_n[..2]);
        filter.x[2] = start.p_n[2] - height.u_m;
        let mut set = |k: usize, sigma: f64| filter.p[k * n + k] = sigma * sigma;
        for k in 0..3 {
            set(k, start.sigma_m[k]);
        }
        set(3, start.speed_m_s);
        set(4, start.speed_m_s);
        set(5, if model.climb > 0.0 { 0.5 } else { 0.0 });
        set(TAG, model.tag_m);
        set(COMMON, model.common_m);
        set(SCALE, model.scale);
        for anchor in 0..anchors {
            set(SHARED + 2 * anchor, model.slow_m);
            set(SHARED + 2 * anchor + 1, model.quick_m);
        }
        filter
    }

    pub(super) fn states(&self) -> usize {
        self.x.len()
    }

    /// Position, m.
    pub(super) fn p_n(&self) -> [f64; 3] {
        [self.x[0], self.x[1], self.x[2] + self.height.u_m]
    }

    /// Covariance of the position, m².
    pub(super) fn covariance(&self) -> [[f64; 3]; 3] {
        let n = self.states();
        std::array::from_fn(|i| std::array::from_fn(|j| self.p[i * n + j]))
    }

    /// What an anchor's ranges have too much for longer than some seconds, m, and its sigma.
    pub(super) fn bias(&self, anchor: usize) -> (f64, f64) {
        let n = self.states();
        let slow = SHARED + 2 * anchor;
        let variance = self.p[slow * n + slow] + self.p[TAG * n + TAG] + 2.0 * self.p[slow * n + TAG];
        (self.bias_m + self.x[TAG] + self.x[slow], variance.max(0.0).sqrt())
    }

    /// Quick bias of an anchor, m.
    pub(super) fn quick_bias(&self, anchor: usize) -> f64 {
        self.x[SHARED + 2 * anchor + 1]
    }

    /// Sigma of the white noise of an anchor's ranges as it has been learnt, m.
    pub(super) fn range_sigma(&self, anchor: usize) -> f64 {
        self.model.white_m * self.learnt[anchor].factor.sqrt()
    }

    /// Moves the filter on to a time.
    pub(super) fn propagate(&mut self, t_s: f64, tape: Option<&mut Tape>) {
        let dt = t_s - self.t_s;
        if dt <= 0.0 {
            return;
        }
        self.t_s = t_s;
        let n = self.states();
        let step = self.step(dt);
        for k in 0..3 {
            self.x[k] = self.x[k] * step.decay[k] + step.along[k] * self.x[3 + k];
        }
        for k in 3..n {
            self.x[k] *= step.decay[k];
        }
        // Rows, then columns.
        for k in 0..3 {
            for j in 0..n {
                self.p[k * n + j] =
                    self.p[k * n + j] * step.decay[k] + step.along[k] * self.p[(3 + k) * n + j];
            }
        }
        for i in 3..n {
            for j in 0..n {
                self.p[i * n + j] *= step.decay[i];
            }
        }
        for i in 0..n {
            let row = &mut self.p[i * n..(i + 1) * n];
            for k in 0..3 {
                row[k] = row[k] * step.decay[k] + step.along[k] * row[3 + k];
            }
            for (value, decay) in row.iter_mut().zip(&step.decay).skip(3) {
                *value *= decay;
            }
        }
        for k in 0..3 {
            self.p[k * n + k] += step.noise_pp[k];
            self.p[k * n + 3 + k] += step.noise_pv[k];
            self.p[(3 + k) * n + k] += step.noise_pv[k];
        }
        for k in 3..n {
            self.p[k * n + k] += step.noise[k];
        }
        let [pp, pv, vv] = step.noise_en;
        for (i, j, noise) in [(0, 1, pp), (0, 4, pv), (1, 3, pv), (3, 4, vv)] {
            self.p[i * n + j] += noise;
            self.p[j * n + i] += noise;
        }
        if let Some(tape) = tape {
            tape.push(Entry::Step { decay: step.decay, along: step.along });
        }
    }

    /// Spectral densities of the acceleration, m²/s³: east, north, up, and between east and north. A carrier that goes
    /// somewhere brakes more easily than it turns.
    fn acceleration(&self) -> [f64; 4] {
        const GOING_M_S: f64 = 0.3;
        let along = self.model.acceleration * self.model.acceleration;
        let up = self.model.climb * self.model.climb;
        let (v_e, v_n) = (self.x[3], self.x[4]);
        let speed2 = v_e * v_e + v_n * v_n;
        // Gradually: a speed that is hardly one has no direction.
        let going = speed2 / (speed2 + GOING_M_S * GOING_M_S);
        let across = along * (1.0 - going * (1.0 - self.model.turning * self.model.turning));
        let (c, s) = if speed2 > 0.0 { (v_e * v_e / speed2, v_n * v_n / speed2) } else { (0.5, 0.5) };
        let cs = if speed2 > 0.0 { v_e * v_n / speed2 } else { 0.0 };
        [along * c + across * s, along * s + across * c, up, (along - across) * cs]
    }

    fn step(&self, dt: f64) -> Step {
        let n = self.states();
        let mut step = Step {
            decay: vec![1.0; n],
            along: [0.0; 3],
            noise: vec![0.0; n],
            noise_pp: [0.0; 3],
            noise_pv: [0.0; 3],
            noise_en: [0.0; 3],
        };
        let fade = |time_s: f64| libm::exp(-dt / time_s);
        let q = self.acceleration();
        for k in 0..3 {
            let time_s = if k < 2 { VELOCITY_TIME_S } else { CLIMB_TIME_S };
            let decay = fade(time_s);
            // Where the steps are long the velocity has forgotten: no more than its own spread goes in.
            let t = dt.min(time_s);
            let factors = [t * t * dt / 3.0, 0.5 * t * t, 0.5 * time_s * (1.0 - decay * decay)];
            step.decay[3 + k] = decay;
            step.along[k] = time_s * (1.0 - decay);
            step.noise_pp[k] = q[k] * factors[0];
            step.noise_pv[k] = q[k] * factors[1];
            step.noise[3 + k] = q[k] * factors[2];
            if k == 0 {
                step.noise_en = factors.map(|factor| q[3] * factor);
            }
        }
        let known = self.height.known;
        let height_decay = fade(if known { KNOWN_HEIGHT_TIME_S } else { HEIGHT_TIME_S });
        step.decay[2] = height_decay;
        let spread = self.height.sigma_m * self.height.sigma_m * (1.0 - height_decay * height_decay);
        step.noise_pp[2] += spread;
        let mut stationary = |k: usize, time_s: f64, sigma: f64| {
            let decay = fade(time_s);
            step.decay[k] = decay;
            step.noise[k] = sigma * sigma * (1.0 - decay * decay);
        };
        // What surrounds a path changes with the way, and hardly while the tag stands.
        let speed = (self.x[3] * self.x[3] + self.x[4] * self.x[4]).sqrt();
        let quick_s = 1.0 / (speed / QUICK_WAY_M + 1.0 / QUICK_TIME_S);
        let common_s = COMMON_LASTS * quick_s;
        stationary(TAG, SLOW_TIME_S, self.model.tag_m);
        stationary(COMMON, common_s, self.model.common_m);
        for anchor in 0..(n - SHARED) / 2 {
            stationary(SHARED + 2 * anchor, SLOW_TIME_S, self.model.slow_m);
            stationary(SHARED + 2 * anchor + 1, quick_s, self.model.quick_m);
        }
        step
    }

    /// Weighs a range to an anchor.
    pub(super) fn weigh(
        &mut self,
        anchor: usize,
        anchor_n: &[f64; 3],
        range_m: f64,
        tape: Option<&mut Tape>,
    ) -> Weighed {
        /// Seconds after a start in which the bend of the range counts: the position is metres wide.
        const BENT_S: f64 = 10.0;
        let n = self.states();
        let line = ranges::line(&self.p_n(), anchor_n);
        let row = row(&line, anchor);
        let mut ph = vec![0.0; n];
        for (i, value) in ph.iter_mut().enumerate() {
            *value = row.iter().map(|(k, h)| self.p[i * n + k] * h).sum();
        }
        let hph: f64 = row.iter().map(|(k, h)| ph[*k] * h).sum();
        let biases: f64 = row[3..].iter().map(|(k, h)| self.x[*k] * h).sum();
        let mut expected = line.range_m + self.bias_m + biases;
        let mut r = self.model.white_m * self.model.white_m * self.learnt[anchor].factor;
        if self.t_s - self.started_s < BENT_S {
            let bend = ranges::bend(&line, &self.covariance());
            expected += bend.mean_m;
            r += bend.variance_m2;
        }
        let innovation_m = range_m - expected;
        let s = hph + r;
        let nis = innovation_m * innovation_m / s;
        let log_likelihood = libm::log(
            (1.0 - GROSS_SHARE) * libm::exp(-0.5 * nis.min(400.0)) / (2.0 * std::f64::consts::PI * s).sqrt()
                + GROSS_SHARE * GROSS_DENSITY,
        );
        let used = nis <= GATE * GATE;
        self.learn(anchor, innovation_m, nis, used, n);
        if used {
            let sigmas = nis.sqrt();
            // Huber's weight, as a larger noise of this one range.
            let s = if sigmas > HUBER { s * sigmas / HUBER } else { s };
            for i in 0..n {
                let gain = ph[i] / s;
                self.x[i] += gain * innovation_m;
                for (value, ph) in self.p[i * n..(i + 1) * n].iter_mut().zip(&ph) {
                    *value -= gain * ph;
                }
            }
            if let Some(tape) = tape {
                tape.push(Entry::Range { row, gain_times_s: ph, s, innovation_m });
            }
        }
        Weighed { used, log_likelihood }
    }

    fn learn(&mut self, anchor: usize, innovation_m: f64, nis: f64, used: bool, n: usize) {
        const PACE: f64 = 0.01;
        const MOST: f64 = 30.0;
        let learnt = &mut self.learnt[anchor];
        if used {
            learnt.factor = (learnt.factor * (1.0 + PACE * (nis.min(9.0) - 1.0))).clamp(0.02, MOST);
            learnt.rejected = 0;
            return;
        }
        let alike = (innovation_m - learnt.innovation_m).abs() < 0.5 && innovation_m.abs() < MOST_CHANGE_M;
        learnt.rejected = if alike { learnt.rejected + 1 } else { 1 };
        learnt.innovation_m = innovation_m;
        if learnt.rejected >= CHANGED_PATH {
            learnt.rejected = 0;
            let quick = SHARED + 2 * anchor + 1;
            self.p[quick * n + quick] += innovation_m * innovation_m;
        }
    }

    /// Starts again at a position that was found anew; the biases stay.
    pub(super) fn restart(&mut self, start: &Start, tape: Option<&mut Tape>) {
        let n = self.states();
        self.started_s = self.t_s;
        for k in 0..6 {
            for j in 0..n {
                self.p[k * n + j] = 0.0;
                self.p[j * n + k] = 0.0;
            }
            self.x[k] = 0.0;
        }
        self.x[..2].copy_from_slice(&start.p_n[..2]);
        self.x[2] = start.p_n[2] - self.height.u_m;
        for k in 0..3 {
            self.p[k * n + k] = start.sigma_m[k] * start.sigma_m[k];
        }
        for k in 3..5 {
            self.p[k * n + k] = start.speed_m_s * start.speed_m_s;
        }
        self.p[5 * n + 5] = if self.model.climb > 0.0 { 0.25 } else { 0.0 };
        if let Some(tape) = tape {
            tape.push(Entry::Restart);
        }
    }

    /// The rows of the covariance that belong to the position.
    pub(super) fn position_rows(&self) -> [Vec<f64>; 3] {
        let n = self.states();
        std::array::from_fn(|k| self.p[k * n..(k + 1) * n].to_vec())
    }
}

/// Where a filter begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Start {
    /// Position, m.
    pub(super) p_n: [f64; 3],
    /// Its sigmas, m.
    pub(super) sigma_m: [f64; 3],
    /// Sigma of the velocity along each horizontal axis, m/s.
    pub(super) speed_m_s: f64,
}

struct Step {
    decay: Vec<f64>,
    along: [f64; 3],
    noise: Vec<f64>,
    noise_pp: [f64; 3],
    noise_pv: [f64; 3],
    /// The same between east and north: of positions, of position and velocity, of velocities.
    noise_en: [f64; 3],
}

/// The row of a range: what is not zero of it.
fn row(line: &Line, anchor: usize) -> [(usize, f64); 8] {
    [
        (0, line.unit_n[0]),
        (1, line.unit_n[1]),
        (2, line.unit_n[2]),
        (TAG, 1.0),
        (COMMON, 1.0),
        (SCALE, line.range_m),
        (SHARED + 2 * anchor, 1.0),
        (SHARED + 2 * anchor + 1, 1.0),
    ]
}
