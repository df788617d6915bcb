//! The first attitude, without a magnetometer: what the antenna is accelerated by according to its positions is what the
//! sensor feels, so the one turned onto the other is the attitude.
//!
//! Positions p at t − h, t and t + h give the mean acceleration (p₊ − 2p + p₋)/h² under a triangle of time, and so does the
//! specific force, turned by the gyro into the frame of the first sample, with the antenna's lever arm: Σ|v − R u|² is
//! least for the attitude R of that frame (Wahba's problem; v the acceleration less gravity in n, u the same as felt).
//! The bias of the gyro is found along with it.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::causes::SurveyCause;
use super::pass::LONG_GAP_NS;
use super::recording::Fix;
use crate::ins::earth::Earth;
use crate::rotation::cayley;
use crate::sample::ImuSample;

/// A first attitude with its covariance.
#[derive(Clone, Debug)]
pub(super) struct Aligned {
    /// The sample that the attitude is of.
    pub(super) sample: usize,
    /// The stretch that was used, ns.
    pub(super) window_ns: [i64; 2],
    /// Attitude at that sample.
    pub(super) c_nb: Matrix3<f64>,
    /// Bias of the gyro, rad/s.
    pub(super) gyro_bias_b: Vector3<f64>,
    /// Covariance of attitude (n) and bias.
    pub(super) covariance: SMatrix<f64, 6, 6>,
    /// Position of the antenna there, m.
    pub(super) antenna_n_m: Vector3<f64>,
    /// Its velocity, m/s.
    pub(super) antenna_n_m_s: Vector3<f64>,
    /// Residual, root mean square by axis, m/s².
    pub(super) residual_m_s2: f64,
}

/// Why there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NotAligned {
    /// No position falls on the samples.
    NoFixes,
    /// Positions and forces were never accelerated enough, or never agreed: the best sigma of the heading, rad, and the
    /// residual there, m/s².
    NoManoeuvre { sigma_rad: f64, residual_m_s2: f64 },
}

/// Half of a triangle, s: where positions come less often, the time between two of them.
const HALF_S: f64 = 0.6;
/// … but no more than this: the turn of the pole in a longer one is not known well enough, s.
const LONGEST_HALF_S: f64 = 1.5;
/// Windows grow by this, s, from the shortest to the longest.
const GROWTH_S: f64 = 1.0;
const SHORTEST_S: f64 = 5.0;
const LONGEST_S: f64 = 20.0;
/// A heading that is as sure as this will do, rad.
const SURE_RAD: f64 = 0.15;
/// Where none is, one that is as sure as this is tried: what comes after it has to make it surer before the sky is lost.
const HALF_SURE_RAD: f64 = 0.25;
/// Positions and forces that agree no better than this are not of one pole, m/s².
const MOST_RESIDUAL_M_S2: f64 = 0.5;
/// An attitude is taken back so far at most, and over no longer interval between samples, ns.
const FARTHEST_BACK_NS: i64 = 60_000_000_000;
const MOST_INTERVAL_NS: i64 = 50_000_000;
/// Sigma of the bias of a gyro that has just been switched on, rad/s.
const BIAS_RAD_S: f64 = 0.02;

/// A mean under a triangle.
struct Pair {
    measured_n: Vector3<f64>,
    felt: Vector3<f64>,
    /// How the felt one changes with the bias.
    by_bias: Matrix3<f64>,
}

impl NotAligned {
    /// As a cause.
    pub(super) fn cause(self) -> SurveyCause {
        match self {
            NotAligned::NoFixes => SurveyCause::NoFixes,
            NotAligned::NoManoeuvre { sigma_rad, residual_m_s2 } if residual_m_s2 > MOST_RESIDUAL_M_S2 => {
                SurveyCause::OtherMotion { apart_m_s2: residual_m_s2, heading_deg: sigma_rad.to_degrees() }
            }
            NotAligned::NoManoeuvre { sigma_rad, .. } => {
                SurveyCause::NoManoeuvre { heading_deg: sigma_rad.to_degrees() }
            }
        }
    }
}

/// Finds the first window in which the heading becomes sure.
pub(super) fn align(
    imu: &[ImuSample],
    fixes: &[Fix],
    antenna_b_m: &Vector3<f64>,
    earth: &Earth,
) -> Result<Aligned, NotAligned> {
    let inside = |fix: &&Fix| {
        imu.first().is_some_and(|first| fix.t_ns >= first.t_ns)
            && imu.last().is_some_and(|l| fix.t_ns <= l.t_ns)
    };
    let fixes: Vec<Fix> = fixes.iter().filter(inside).copied().collect();
    if fixes.len() < 3 {
        return Err(NotAligned::NoFixes);
    }
    let mut search = Search::default();
    if let Some(aligned) = search.go_on(imu, &fixes, antenna_b_m, earth) {
        return Ok(aligned);
    }
    let mut again = Search { sure_rad: HALF_SURE_RAD, ..Search::default() };
    again.go_on(imu, &fixes, antenna_b_m, earth).ok_or(search.best)
}

/// The search for that window, which goes on as fixes come in.
#[derive(Clone, Debug)]
pub(super) struct Search {
    from: usize,
    to: usize,
    looked_ns: i64,
    sure_rad: f64,
    best: NotAligned,
}

impl Default for Search {
    fn default() -> Search {
        let best = NotAligned::NoManoeuvre { sigma_rad: std::f64::consts::PI, residual_m_s2: f64::NAN };
        Search { from: 0, to: 0, looked_ns: i64::MIN / 2, sure_rad: SURE_RAD, best }
    }
}

impl Search {
    /// Looks at the fixes that came since; all of them lie within the samples.
    pub(super) fn go_on(
        &mut self,
        imu: &[ImuSample],
        fixes: &[Fix],
        antenna_b_m: &Vector3<f64>,
        earth: &Earth,
    ) -> Option<Aligned> {
        while self.to < fixes.len() {
            self.to += 1;
            let seconds = |from: usize, to: usize| (fixes[to].t_ns - fixes[from].t_ns) as f64 * 1e-9;
            while seconds(self.from, self.to - 1) > LONGEST_S {
                self.from += 1;
            }
            let end_ns = fixes[self.to - 1].t_ns;
            let grown_ns = (end_ns - self.looked_ns) as f64;
            if seconds(self.from, self.to - 1) < SHORTEST_S || grown_ns < GROWTH_S * 1e9 {
                continue;
            }
            self.looked_ns = end_ns;
            let Some(aligned) = solve(imu, &fixes[self.from..self.to], antenna_b_m, earth) else { continue };
            let sigma_rad = aligned.covariance[(2, 2)].sqrt();
            if sigma_rad < self.sure_rad && aligned.residual_m_s2 < MOST_RESIDUAL_M_S2 {
                return Some(taken_back(aligned, imu, fixes));
            }
            if let NotAligned::NoManoeuvre { sigma_rad: least, .. } = self.best
                && sigma_rad < least
            {
                self.best = NotAligned::NoManoeuvre { sigma_rad, residual_m_s2: aligned.residual_m_s2 };
            }
        }
        None
    }
}

/// The same attitude at the first fix of the stretch that the window lies in: a pole that was held before it was leaned has
/// shown its biases meanwhile.
fn taken_back(aligned: Aligned, imu: &[ImuSample], fixes: &[Fix]) -> Aligned {
    let at_ns = imu[aligned.sample].t_ns;
    let mut first = fixes.partition_point(|fix| fix.t_ns < at_ns).min(fixes.len() - 1);
    while first > 0
        && fixes[first].t_ns - fixes[first - 1].t_ns < LONG_GAP_NS
        && at_ns - fixes[first - 1].t_ns < FARTHEST_BACK_NS
    {
        first -= 1;
    }
    let mut sample = imu.partition_point(|sample| sample.t_ns < fixes[first].t_ns);
    // Over a gap in the samples nobody knows how it was turned.
    let gap = |k: usize| imu[k].t_ns - imu[k - 1].t_ns > MOST_INTERVAL_NS;
    if let Some(after) = (sample + 1..=aligned.sample).rev().find(|k| gap(*k)) {
        first = fixes.partition_point(|fix| fix.t_ns < imu[after].t_ns).min(fixes.len() - 1);
        sample = imu.partition_point(|sample| sample.t_ns < fixes[first].t_ns);
    }
    if sample >= aligned.sample {
        return aligned;
    }
    let mut turned = Matrix3::identity();
    for k in sample + 1..=aligned.sample {
        let dt_s = (imu[k].t_ns - imu[k - 1].t_ns) as f64 * 1e-9;
        turned *= cayley(&((Vector3::from(imu[k].w_ib_b_rad_s) - aligned.gyro_bias_b) * dt_s));
    }
    let (antenna_n_m, antenna_n_m_s) = line(&fixes[first..]);
    let mut covariance = aligned.covariance;
    let back_s = (at_ns - imu[sample].t_ns) as f64 * 1e-9;
    for axis in 0..3 {
        covariance[(axis, axis)] += covariance[(axis + 3, axis + 3)] * back_s * back_s;
    }
    Aligned {
        sample,
        c_nb: aligned.c_nb * turned.transpose(),
        covariance,
        antenna_n_m,
        antenna_n_m_s,
        ..aligned
    }
}

fn solve(imu: &[ImuSample], fixes: &[Fix], antenna_b_m: &Vector3<f64>, earth: &Earth) -> Option<Aligned> {
    let start = imu.partition_point(|sample| sample.t_ns < fixes[0].t_ns);
    let end = imu.partition_point(|sample| sample.t_ns <= fixes[fixes.len() - 1].t_ns);
    if end < start + 10 {
        return None;
    }
    let samples = &imu[start..end];
    let mut bias = Vector3::zeros();
    let mut r: Option<Matrix3<f64>> = None;
    let mut result = None;
    for _ in 0..4 {
        let pairs = pairs(samples, fixes, antenna_b_m, earth, &bias);
        if pairs.len() < 6 {
            return None;
        }
        let r_now = match r {
            Some(r) => r,
            None => wahba(&pairs)?,
        };
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let mut right = SVector::<f64, 6>::zeros();
        let mut squares = 0.0;
        for pair in &pairs {
            let turned = r_now * pair.felt;
            let residual = pair.measured_n - turned;
            squares += residual.norm_squared();
            let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
            jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-crate::rotation::skew(&turned));
            jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(r_now * pair.by_bias));
            normal += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * residual;
        }
        let freedom = (3 * pairs.len() - 6).max(1) as f64;
        let residual_m_s2 = (squares / freedom).sqrt();
        // Neighbouring triangles share most of their time.
        let shared = (2e-9 * half_ns(fixes) as f64 * pairs.len() as f64
            / ((fixes[fixes.len() - 1].t_ns - fixes[0].t_ns) as f64 * 1e-9))
            .max(1.0);
        let variance = residual_m_s2.max(0.03).powi(2) * shared;
        normal /= variance;
        right /= variance;
        for axis in 3..6 {
            normal[(axis, axis)] += 1.0 / (BIAS_RAD_S * BIAS_RAD_S);
            right[axis] -= bias[axis - 3] / (BIAS_RAD_S * BIAS_RAD_S);
        }
        let covariance = normal.try_inverse()?;
        let step = covariance * right;
        let turn = Vector3::new(step[0], step[1], step[2]);
        let r_next = cayley(&turn) * r_now;
        bias += Vector3::new(step[3], step[4], step[5]);
        r = Some(r_next);
        let (antenna_n_m, antenna_n_m_s) = line(fixes);
        result = Some(Aligned {
            sample: start,
            window_ns: [fixes[0].t_ns, fixes[fixes.len() - 1].t_ns],
            c_nb: r_next,
            gyro_bias_b: bias,
            covariance,
            antenna_n_m,
            antenna_n_m_s,
            residual_m_s2,
        });
    }
    result
}

/// Position and velocity at the first of the positions, by a line through those of the first half second, or to the next one.
fn line(fixes: &[Fix]) -> (Vector3<f64>, Vector3<f64>) {
    let first = &fixes[0];
    let near_ns = half_ns(&fixes[..fixes.len().min(10)]);
    let near = fixes.iter().take_while(|fix| fix.t_ns <= first.t_ns + near_ns);
    let velocity = near.last().filter(|last| last.t_ns > first.t_ns).map_or_else(Vector3::zeros, |last| {
        (last.p_n_m - first.p_n_m) / ((last.t_ns - first.t_ns) as f64 * 1e-9)
    });
    (first.p_n_m, velocity)
}

fn pairs(
    samples: &[ImuSample],
    fixes: &[Fix],
    antenna_b_m: &Vector3<f64>,
    earth: &Earth,
    bias: &Vector3<f64>,
) -> Vec<Pair> {
    // Integrals from the first sample on: of force, of force times time, of what the bias does to both; and attitudes.
    struct At {
        c: Matrix3<f64>,
        force: Vector3<f64>,
        force_t: Vector3<f64>,
        by_bias: Matrix3<f64>,
        by_bias_t: Matrix3<f64>,
        turn_by_bias: Matrix3<f64>,
    }
    let zero_ns = samples[0].t_ns;
    let seconds = |t_ns: i64| (t_ns - zero_ns) as f64 * 1e-9;
    let mut at: Vec<At> = Vec::with_capacity(samples.len());
    at.push(At {
        c: Matrix3::identity(),
        force: Vector3::zeros(),
        force_t: Vector3::zeros(),
        by_bias: Matrix3::zeros(),
        by_bias_t: Matrix3::zeros(),
        turn_by_bias: Matrix3::zeros(),
    });
    for k in 1..samples.len() {
        let last = &at[k - 1];
        let dt_s = seconds(samples[k].t_ns) - seconds(samples[k - 1].t_ns);
        let w = Vector3::from(samples[k].w_ib_b_rad_s) - bias;
        let c = last.c * cayley(&(w * dt_s));
        let mean = (last.c + c) * 0.5;
        let f = mean * Vector3::from(samples[k].f_b_m_s2);
        let middle_s = seconds(samples[k].t_ns) - 0.5 * dt_s;
        let turn_by_bias = last.turn_by_bias - mean * dt_s;
        // A turn δθ moves f by δθ × f = −[f×] δθ.
        let moved = -crate::rotation::skew(&f) * turn_by_bias;
        at.push(At {
            c,
            force: last.force + f * dt_s,
            force_t: last.force_t + f * (dt_s * middle_s),
            by_bias: last.by_bias + moved * dt_s,
            by_bias_t: last.by_bias_t + moved * (dt_s * middle_s),
            turn_by_bias,
        });
    }
    let index = |t_ns: i64| samples.partition_point(|sample| sample.t_ns < t_ns).min(samples.len() - 1);
    let mut pairs = Vec::new();
    let mut low = 0;
    let mut high = 0;
    let half_ns = half_ns(fixes);
    for middle in fixes {
        while low + 1 < fixes.len() && fixes[low].t_ns < middle.t_ns - half_ns - 30_000_000 {
            low += 1;
        }
        while high + 1 < fixes.len() && fixes[high + 1].t_ns <= middle.t_ns + half_ns + 30_000_000 {
            high += 1;
        }
        // Where positions come at another beat the farthest on both sides that are as far apart will do.
        let (before, after) = (&fixes[low], &fixes[high]);
        let (h0, h1) = (middle.t_ns - before.t_ns, after.t_ns - middle.t_ns);
        let regular = (h0 - h1).abs() < 5_000_000 && h0 > half_ns / 2 && h0 < half_ns * 3 / 2;
        if !regular {
            continue;
        }
        let h_s = h0 as f64 * 1e-9;
        let measured = (after.p_n_m - middle.p_n_m * 2.0 + before.p_n_m) / (h_s * h_s);
        let gravity_n = earth.gravity_n(&middle.p_n_m);
        let [a, b, c] = [before.t_ns, middle.t_ns, after.t_ns].map(|t_ns| &at[index(t_ns)]);
        let [ta, _, tc] =
            [before.t_ns, middle.t_ns, after.t_ns].map(|t_ns| seconds(samples[index(t_ns)].t_ns));
        // ∫(t − ta) f over the first half and ∫(tc − t) f over the second.
        let rising = (b.force_t - a.force_t) - (b.force - a.force) * ta;
        let falling = (c.force - b.force) * tc - (c.force_t - b.force_t);
        let rising_by = (b.by_bias_t - a.by_bias_t) - (b.by_bias - a.by_bias) * ta;
        let falling_by = (c.by_bias - b.by_bias) * tc - (c.by_bias_t - b.by_bias_t);
        let arm = (c.c - b.c * 2.0 + a.c) * antenna_b_m / (h_s * h_s);
        pairs.push(Pair {
            measured_n: measured - gravity_n,
            felt: (rising + falling) / (h_s * h_s) + arm,
            by_bias: (rising_by + falling_by) / (h_s * h_s),
        });
    }
    pairs
}

/// Half of a triangle for positions that come as often as these, ns.
fn half_ns(fixes: &[Fix]) -> i64 {
    let mut between_ns: Vec<i64> = fixes.windows(2).map(|pair| pair[1].t_ns - pair[0].t_ns).collect();
    between_ns.sort_unstable();
    let usual_ns = between_ns.get(between_ns.len() / 2).copied().unwrap_or(0);
    usual_ns.clamp((HALF_S * 1e9) as i64, (LONGEST_HALF_S * 1e9) as i64)
}

/// The rotation that brings the felt ones nearest to the measured ones.
fn wahba(pairs: &[Pair]) -> Option<Matrix3<f64>> {
    let mut b = Matrix3::zeros();
    for pair in pairs {
        b += pair.measured_n * pair.felt.transpose();
    }
    let svd = b.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u * v_t).determinant();
    Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign.signum())) * v_t)
}
