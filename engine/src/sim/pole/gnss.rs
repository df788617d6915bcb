//! What the receiver makes of the motion of the antenna.

use nalgebra::{Matrix2, Vector2};

use super::super::gauss_markov::GaussMarkov;
use super::super::motion::Motion as _;
use super::super::random::{Purpose, Random};
use super::course::Course;
use super::motion::PoleMotion;
use super::trouble::Trouble;
use super::world::World;

/// A position of the antenna.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssEpoch {
    /// Time, ns.
    pub t_ns: i64,
    /// Phase centre, east-north-up from the site's origin, m.
    pub p_n_m: [f64; 3],
    /// Sigmas as stated, m.
    pub sigma_n_m: [f64; 3],
    /// `fixed` or `float`.
    pub quality: &'static str,
}

/// A receiver and its sky.
#[derive(Clone, Debug)]
pub(super) struct GnssModel {
    /// Positions a second.
    pub(super) rate_hz: f64,
    /// New at each of them, east, north and up, m.
    pub(super) white_m: [f64; 3],
    /// What stays for some time, m, and from and until how long it may, s.
    pub(super) slow_m: [f64; 3],
    pub(super) slow_time_s: [f64; 2],
    /// What it says of itself, m.
    pub(super) told_m: [f64; 3],
    /// By how much the phase centre moves as the pole leans by one, 1σ on each axis, m.
    pub(super) phase_m: f64,
    /// What its clock shows more than the sensor's, s.
    pub(super) apart_s: f64,
}

impl GnssModel {
    /// The usual one, with so many times the usual error that lasts for a while and that is new each time.
    pub(super) fn usual([slowly, anew]: [f64; 2]) -> GnssModel {
        GnssModel {
            rate_hz: 5.0,
            white_m: [0.005 * anew, 0.005 * anew, 0.010 * anew],
            slow_m: [0.010, 0.010, 0.008].map(|sigma_m| sigma_m * slowly),
            slow_time_s: [10.0, 40.0],
            told_m: [0.012, 0.012, 0.023],
            phase_m: 0.025,
            apart_s: 0.0,
        }
    }
}

/// Half a minute in the gap in which solutions come, in worlds that have one.
pub(super) fn in_island(trouble: Trouble, course: &Course, t_s: f64) -> bool {
    let [from_s, to_s] = course.gap_s;
    let lasts_s = 30.0_f64.min(0.4 * (to_s - from_s));
    let begins_s = from_s + 0.12 * (to_s - from_s);
    matches!(trouble, Trouble::Float | Trouble::FloatTold | Trouble::WrongFix)
        && (begins_s..begins_s + lasts_s).contains(&t_s)
}

/// All positions, with nothing withheld.
pub(super) fn positions(
    motion: &PoleMotion,
    world: &World,
    phase: &Matrix2<f64>,
    seed: u64,
    trouble: Trouble,
    course: &Course,
) -> Vec<GnssEpoch> {
    let model = &world.gnss;
    let mut white = Random::new(seed, 0, Purpose::FixNoise);
    let slow_random = Random::new(seed, 0, Purpose::FixSlowError);
    let [from_s, to_s] = model.slow_time_s;
    let slow_time_s = white.uniform(from_s, to_s);
    let mut slow = GaussMarkov::new(model.slow_m, slow_time_s, slow_random);
    let angle_rad = white.uniform(0.0, std::f64::consts::TAU);
    let period_ns = (1e9 / model.rate_hz) as i64;
    let apart_ns = libm::round(model.apart_s * 1e9) as i64;
    let mut epochs = Vec::new();
    for k in 1..=(motion.end_s() * model.rate_hz) as i64 {
        let true_ns = k * period_ns;
        let t_s = true_ns as f64 * 1e-9;
        let place = motion.at(t_s).at_lever_arm(&world.pole.antenna_m).position_n_m;
        let lean = motion.lean(t_s);
        let centre = phase * Vector2::new(lean[0], lean[1]);
        let slow = slow.advance(period_ns as f64 * 1e-9);
        let noise = white.normal_3();
        let sigma = model.told_m.map(|sigma| sigma * white.uniform(0.85, 1.15));
        let [white_e, white_n, white_u] = model.white_m;
        let mut p_n_m = [
            place.x + centre.x + slow[0] + white_e * noise[0],
            place.y + centre.y + slow[1] + white_n * noise[1],
            place.z + slow[2] + white_u * noise[2],
        ];
        let (mut quality, mut sigma_n_m) = ("fixed", sigma);
        if in_island(trouble, course, t_s) {
            let (sin, cos) = libm::sincos(angle_rad);
            p_n_m = [p_n_m[0] + 0.3 * cos, p_n_m[1] + 0.3 * sin, p_n_m[2] + 0.2];
            match trouble {
                Trouble::Float => (quality, sigma_n_m) = ("float", [0.3, 0.3, 0.4]),
                Trouble::FloatTold => (quality, sigma_n_m) = ("float", [0.025, 0.025, 0.04]),
                _ => {}
            }
        }
        epochs.push(GnssEpoch { t_ns: true_ns + apart_ns, p_n_m, sigma_n_m, quality });
    }
    epochs
}
