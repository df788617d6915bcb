//! The files of a survey: what the sensor, the receiver and the switch make of the motion.

use nalgebra::Vector3;

use super::super::earth::Earth;
use super::super::imu::Imu;
use super::super::motion::{Motion as _, Mounting};
use super::super::random::{Purpose, Random};
use super::course::{Course, Route};
use super::gnss::{self, GnssEpoch};
use super::motion::{BLOW_S, PoleMotion};
use super::trouble::Trouble;
use super::world::{World, Worlds};
use crate::geo::{Geodetic, Site};
use crate::sample::ImuSample;

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

/// Walks in the usual world. Everything of it is of the seed: the pole, the sensor, the sky, the way.
pub fn simulate(route: Route, seed: u64, trouble: Trouble) -> SimulatedSurvey {
    simulate_in(Worlds::Usual, route, seed, trouble)
}

/// Draws a world and walks in it.
pub fn simulate_in(worlds: Worlds, route: Route, seed: u64, trouble: Trouble) -> SimulatedSurvey {
    let world = World::of(worlds, seed);
    let [latitude_deg, longitude_deg, height_m] = world.origin;
    let site = Site::at("survey", Geodetic { latitude_deg, longitude_deg, height_m }, 2026.5);
    let mut normal = Random::new(seed, Random::COMMON, Purpose::Weather);
    let [antenna_told, mut tip_told] = world.told(&mut normal);
    if trouble == Trouble::TipOff {
        tip_told.x += 0.02;
    }
    let phase = world.phase(&mut normal);
    let course = Course::draw(route, &world, seed, trouble);
    let motion = PoleMotion::new(course.clone(), &world, seed, trouble != Trouble::NoManoeuvre);
    let model = &world.imu;
    let earth = Earth::curved(&site, true);
    let mounting = Mounting { lever_arm_b_m: Vector3::zeros(), c_bs: world.pole.c_bs };
    let mut sensor = Imu::new(model, mounting, earth, seed, 0).following(BLOW_S / 3.0);
    let truth_every = libm::round(0.1 * model.rate_hz) as i64;
    let end_ns = (motion.end_s() * 1e9) as i64;
    let period_ns = model.period_ns();
    let mut imu = Vec::new();
    let mut truth = Vec::new();
    for k in 0..end_ns / period_ns {
        let t_ns = (k + 1) * period_ns;
        let t_s = t_ns as f64 * 1e-9;
        let (place, reading) = sensor.sample(&motion, t_ns);
        let f = Vector3::from(reading.f_s_m_s2);
        let (w_more, f_more) = world.more.at(t_s, walked(&motion, t_s), course.gap_s[0], &f);
        let w = Vector3::from(reading.w_is_s_rad_s) + w_more;
        imu.push(
            ImuSample {
                t_ns,
                w_ib_b_rad_s: w.into(),
                f_b_m_s2: (f + f_more).into(),
                mag_b_ut: None,
                pressure_hpa: None,
            }
            .as_logged(),
        );
        if k % truth_every == 0 {
            truth.push(TruthRow {
                t_ns,
                tip_n_m: motion.tip_m(t_s).into(),
                imu_n_m: place.position_n_m.into(),
                axis_x_azimuth_rad: place.heading_rad(),
                lean: motion.lean(t_s),
            });
        }
    }
    let gnss_open = gnss::positions(&motion, &world, &phase, seed, trouble, &course);
    let outside = |epoch: &GnssEpoch| {
        let t_s = epoch.t_ns as f64 * 1e-9;
        let [from_s, to_s] = course.gap_s;
        !(from_s..to_s).contains(&t_s) || gnss::in_island(trouble, &course, t_s)
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
