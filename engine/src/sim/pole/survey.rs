//! The files of a survey: what the sensor, the receiver and the switch make of the motion.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::super::earth::Earth;
use super::super::gauss_markov::GaussMarkov;
use super::super::imu::{Imu, ImuModel};
use super::super::motion::{Motion as _, Mounting};
use super::super::random::{Purpose, Random};
use super::course::{Course, Route};
use super::motion::PoleMotion;
use super::trouble::Trouble;
use crate::geo::{Geodetic, Site};
use crate::sample::ImuSample;

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

/// The truth at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthRow {
    /// Time, ns.
    pub t_ns: i64,
    /// The tip, m.
    pub tip_n_m: [f64; 3],
    /// The sensor, m.
    pub imu_n_m: [f64; 3],
    /// Azimuth of its x axis, clockwise from north, rad.
    pub axis_x_azimuth_rad: f64,
    /// East and north of the unit vector up the pole.
    pub lean: [f64; 2],
}

/// A survey that never was.
#[derive(Clone, Debug)]
pub struct SimulatedSurvey {
    /// The site.
    pub site: Site,
    /// Lever arms as told, m.
    pub antenna_b_m: [f64; 3],
    /// To the tip.
    pub tip_b_m: [f64; 3],
    /// Samples.
    pub imu: Vec<ImuSample>,
    /// Positions, with nothing withheld.
    pub gnss_open: Vec<GnssEpoch>,
    /// Positions as the surveyor has them.
    pub gnss: Vec<GnssEpoch>,
    /// The switch, a row at each change.
    pub contact: Vec<(i64, bool)>,
    /// When the tip was held on the point, ns.
    pub stop_ns: [i64; 2],
    /// Where the point is, m.
    pub point_n_m: [f64; 3],
    /// The truth, ten times a second.
    pub truth: Vec<TruthRow>,
}

const IMU_HZ: f64 = 200.0;
const GNSS_HZ: f64 = 5.0;

/// Draws a world and walks in it. Everything of it is of the seed: the pole, the sensor, the sky, the way.
pub fn simulate(route: Route, seed: u64, trouble: Trouble) -> SimulatedSurvey {
    let mut world = Random::new(seed, Random::COMMON, Purpose::Calibration);
    let mut draw = |from: f64, to: f64| world.uniform(from, to);
    let origin = Geodetic {
        latitude_deg: draw(-60.0, 60.0),
        longitude_deg: draw(-180.0, 180.0),
        height_m: draw(0.0, 1500.0),
    };
    let site = Site::at("survey", origin, 2026.5);
    let half_m = draw(0.9, 1.05);
    let antenna = Vector3::new(draw(-0.03, 0.03), draw(-0.03, 0.03), half_m);
    let tip = Vector3::new(draw(-0.03, 0.03), draw(-0.03, 0.03), draw(0.0, 0.1) - half_m);
    let roundness_m = draw(0.0, 0.01);
    let walking = Vector3::new(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0)) * 6e-4;
    let class = draw(0.7, 1.4);
    let sky = [draw(0.7, 1.3), draw(0.7, 1.3)];
    let mut normal = Random::new(seed, Random::COMMON, Purpose::Weather);
    let told = |arm: Vector3<f64>, normal: &mut Random| arm + Vector3::from(normal.normal_3()) * 0.002;
    let antenna_told = told(antenna, &mut normal);
    let mut tip_told = told(tip, &mut normal);
    if trouble == Trouble::TipOff {
        tip_told.x += 0.02;
    }
    let phase = Matrix2::from_fn(|_, _| 0.025 * normal.normal());

    let course = Course::draw(route, seed, trouble);
    let motion = PoleMotion::new(course.clone(), tip, roundness_m, seed, trouble != Trouble::NoManoeuvre);
    let model = ImuModel {
        rate_hz: IMU_HZ,
        averaging: true,
        gyro_noise_deg_s_rthz: 0.004 * class,
        gyro_bias_deg_s: 0.35,
        gyro_bias_walk_deg_s_rts: 9e-4 * class,
        accel_noise_m_s2_rthz: 0.001 * class,
        accel_bias_m_s2: 0.08,
        accel_bias_walk_m_s2_rts: 2e-4 * class,
        scale: 1e-3 * class,
        misalignment_rad: 1e-3 * class,
        gyro_range_deg_s: 1000.0,
        accel_range_g: 16.0,
        sixteen_bits: true,
    };
    let earth = Earth::curved(&site, true);
    let mut sensor = Imu::new(&model, Mounting::at_origin(), earth, seed, 0);
    let end_ns = (motion.end_s() * 1e9) as i64;
    let period_ns = model.period_ns();
    let mut imu = Vec::new();
    let mut truth = Vec::new();
    for k in 0..end_ns / period_ns {
        let t_ns = (k + 1) * period_ns;
        let t_s = t_ns as f64 * 1e-9;
        let (place, reading) = sensor.sample(&motion, t_ns);
        let w = Vector3::from(reading.w_is_s_rad_s) + walking * walked(&motion, t_s);
        imu.push(
            ImuSample {
                t_ns,
                w_ib_b_rad_s: w.into(),
                f_b_m_s2: reading.f_s_m_s2,
                mag_b_ut: None,
                pressure_hpa: None,
            }
            .as_logged(),
        );
        if k % 20 == 0 {
            truth.push(TruthRow {
                t_ns,
                tip_n_m: motion.tip_m(t_s).into(),
                imu_n_m: place.position_n_m.into(),
                axis_x_azimuth_rad: place.heading_rad(),
                lean: motion.lean(t_s),
            });
        }
    }
    let gnss_open = positions(&motion, &antenna, &phase, sky, seed, trouble, &course);
    let outside = |epoch: &GnssEpoch| {
        let t_s = epoch.t_ns as f64 * 1e-9;
        let [from_s, to_s] = course.gap_s;
        !(from_s..to_s).contains(&t_s) || in_island(trouble, &course, t_s)
    };
    let gnss = gnss_open.iter().copied().filter(outside).collect();
    let stand = &course.stands[course.target];
    SimulatedSurvey {
        antenna_b_m: antenna_told.into(),
        tip_b_m: tip_told.into(),
        imu,
        gnss_open,
        gnss,
        contact: switch(&course, seed, trouble),
        stop_ns: [stand.from_s + 0.8, stand.to_s - 0.8].map(|t_s| (t_s * 1e9) as i64),
        point_n_m: stand.place_m,
        truth,
        site,
    }
}

/// How much of the extra bias of walking there is: it goes when the pole is held for more than a second.
fn walked(motion: &PoleMotion, t_s: f64) -> f64 {
    match motion.stands(t_s) {
        None => 1.0,
        Some(stand) if stand.from_s == 0.0 => 0.0,
        Some(stand) => libm::exp(-(t_s - stand.from_s - 1.0).max(0.0) / 0.4),
    }
}

/// Half a minute in the gap in which solutions come, in worlds that have one.
fn in_island(trouble: Trouble, course: &Course, t_s: f64) -> bool {
    let [from_s, to_s] = course.gap_s;
    let lasts_s = 30.0_f64.min(0.4 * (to_s - from_s));
    let begins_s = from_s + 0.12 * (to_s - from_s);
    matches!(trouble, Trouble::Float | Trouble::FloatTold | Trouble::WrongFix)
        && (begins_s..begins_s + lasts_s).contains(&t_s)
}

/// Of what a receiver says, so many times the usual lasts for a while, and so many times is new at each epoch.
fn positions(
    motion: &PoleMotion,
    antenna: &Vector3<f64>,
    phase: &Matrix2<f64>,
    [slowly, anew]: [f64; 2],
    seed: u64,
    trouble: Trouble,
    course: &Course,
) -> Vec<GnssEpoch> {
    let mut white = Random::new(seed, 0, Purpose::FixNoise);
    let slow_random = Random::new(seed, 0, Purpose::FixSlowError);
    let slow_time_s = white.uniform(10.0, 40.0);
    let slow_m = [0.010, 0.010, 0.008].map(|sigma_m| sigma_m * slowly);
    let mut slow = GaussMarkov::new(slow_m, slow_time_s, slow_random);
    let angle_rad = white.uniform(0.0, std::f64::consts::TAU);
    let period_ns = (1e9 / GNSS_HZ) as i64;
    let mut epochs = Vec::new();
    for k in 1..=(motion.end_s() * GNSS_HZ) as i64 {
        let t_ns = k * period_ns;
        let t_s = t_ns as f64 * 1e-9;
        let place = motion.at(t_s).at_lever_arm(antenna).position_n_m;
        let lean = motion.lean(t_s);
        let centre = phase * Vector2::new(lean[0], lean[1]);
        let slow = slow.advance(period_ns as f64 * 1e-9);
        let noise = white.normal_3();
        let sigma = [0.012, 0.012, 0.023].map(|sigma| sigma * white.uniform(0.85, 1.15));
        let mut p_n_m = [
            place.x + centre.x + slow[0] + 0.005 * anew * noise[0],
            place.y + centre.y + slow[1] + 0.005 * anew * noise[1],
            place.z + slow[2] + 0.010 * anew * noise[2],
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
        epochs.push(GnssEpoch { t_ns, p_n_m, sigma_n_m, quality });
    }
    epochs
}

/// A switch closes late and opens early or late, and sometimes chatters.
fn switch(course: &Course, seed: u64, trouble: Trouble) -> Vec<(i64, bool)> {
    let mut random = Random::new(seed, 0, Purpose::Timing);
    let mut rows = Vec::new();
    let last = course.stands.len() - 1;
    for (k, stand) in course.stands.iter().enumerate() {
        let closes_s = if k == 0 { 0.0 } else { stand.from_s + random.uniform(0.004, 0.020) };
        let opens_s = stand.to_s + random.uniform(-0.010, 0.030);
        let chatters = trouble == Trouble::Chatter || random.uniform(0.0, 1.0) < 0.08;
        let bounces = if !chatters || k == 0 {
            0
        } else if trouble == Trouble::Chatter {
            8
        } else {
            1
        };
        let mut t_s = closes_s;
        rows.push((t_s, true));
        for _ in 0..bounces {
            t_s += random.uniform(0.008, 0.03);
            rows.push((t_s, false));
            t_s += random.uniform(0.008, 0.03);
            rows.push((t_s, true));
        }
        if k < last {
            rows.push((opens_s, false));
        }
    }
    rows.into_iter().map(|(t_s, closed)| ((t_s * 1e9) as i64, closed)).collect()
}
