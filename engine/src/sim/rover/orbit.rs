//! Satellites of a made sky: their broadcast elements are the truth, by the interface documents of GPS (IS-GPS-200, table
//! 20-IV) and BDS (B1I, 5.2.4.12). Kept apart from the estimator's, so that an error of one shows in the other.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use super::clock::Instant;
use crate::sim::random::Random;

/// Gravitational constant of Earth for GPS and for BDS, m³/s².
const MU: [f64; 2] = [3.986_005e14, 3.986_004_418e14];
/// Rate of Earth for GPS and for BDS, rad/s.
const EARTH_RATE: [f64; 2] = [7.292_115_146_7e-5, 7.292_115e-5];
/// −2 √μ / c², the relativistic clock, s/√m.
const RELATIVITY: f64 = -4.442_807_633e-10;
/// BDS time is behind GPS time, s, and its weeks begin so many later.
const BDT_BEHIND_S: f64 = 14.0;
const BDT_WEEKS: i32 = 1356;

/// The system of a satellite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum System {
    Gps,
    Bds,
}

impl System {
    pub(super) fn letter(self) -> char {
        match self {
            System::Gps => 'G',
            System::Bds => 'C',
        }
    }

    /// Frequencies of the two bands, Hz: L1 and L2, B1I and B3I.
    pub(super) fn frequencies(self) -> [f64; 2] {
        match self {
            System::Gps => [1_575.42e6, 1_227.60e6],
            System::Bds => [1_561.098e6, 1_268.52e6],
        }
    }
}

/// Broadcast elements; angles in rad, times in s.
#[derive(Clone, Debug)]
pub(super) struct Satellite {
    pub(super) system: System,
    pub(super) number: u32,
    geostationary: bool,
    root_a: f64,
    eccentricity: f64,
    inclination: f64,
    inclination_rate: f64,
    node: f64,
    node_rate: f64,
    perigee: f64,
    anomaly: f64,
    motion_change: f64,
    harmonics: [f64; 6],
    clock: [f64; 2],
    /// Reference time: week and second of the week of the system's own time.
    week: i32,
    toe_s: f64,
}

/// A sky of satellites whose elements refer to the two hours about an instant.
pub(super) fn draw(random: &mut Random, now: Instant) -> Vec<Satellite> {
    let mut all = Vec::new();
    let toe = |system: System| {
        let (week, tow_s) = match system {
            System::Gps => (now.week, now.tow_s),
            System::Bds => (now.week - BDT_WEEKS, now.tow_s - BDT_BEHIND_S),
        };
        (week, (tow_s / 3600.0).floor() * 3600.0)
    };
    let mut add =
        |system: System, number: u32, root_a: f64, plane: Option<f64>, slot: f64, inclination: f64| {
            let (week, toe_s) = toe(system);
            let geostationary = plane.is_none();
            let harmonic =
                |random: &mut Random, sigma: f64| if geostationary { 0.0 } else { sigma * random.normal() };
            // The frame of geostationary elements leans by −5°: an orbit above the equator goes down through its
            // plane where that rises, so the node lies on the other side.
            let node_at_toe = plane.unwrap_or(PI);
            all.push(Satellite {
                system,
                number,
                geostationary,
                root_a,
                eccentricity: if geostationary { 2e-4 } else { random.uniform(0.001, 0.012) },
                inclination,
                inclination_rate: harmonic(random, 2e-10),
                // Elements refer the node to the week's beginning.
                node: wrapped(node_at_toe + EARTH_RATE[system as usize] * toe_s),
                node_rate: if geostationary { 0.0 } else { -8e-9 + 4e-10 * random.normal() },
                perigee: if geostationary { 0.0 } else { random.uniform(-PI, PI) },
                anomaly: slot,
                motion_change: if geostationary { 0.0 } else { 4.5e-9 + 3e-10 * random.normal() },
                harmonics: [
                    harmonic(random, 2e-6),
                    harmonic(random, 5e-6),
                    harmonic(random, 50.0),
                    harmonic(random, 200.0),
                    harmonic(random, 6e-8),
                    harmonic(random, 6e-8),
                ],
                clock: [2e-4 * random.normal(), 4e-12 * random.normal()],
                week,
                toe_s,
            });
        };
    let turn = random_pair(now);
    for plane in 0..6 {
        for slot in 0..5 {
            let node = f64::from(plane) * TAU / 6.0 + turn[0];
            let along = f64::from(slot) * TAU / 5.0 + f64::from(plane) * 0.7 + turn[1];
            add(System::Gps, plane * 5 + slot + 1, 5_153.65, Some(node), wrapped(along), 0.96);
        }
    }
    for (k, longitude_deg) in [140.0_f64, 80.0, 110.5, 160.0, 58.75].into_iter().enumerate() {
        add(
            System::Bds,
            k as u32 + 1,
            6_493.4,
            None,
            wrapped(longitude_deg.to_radians() - PI),
            5.0_f64.to_radians(),
        );
    }
    for k in 0..5_u32 {
        let node = f64::from(k) * TAU / 5.0 + turn[1];
        add(System::Bds, k + 6, 6_493.4, Some(node), wrapped(2.0 - f64::from(k) * TAU / 5.0), 0.96);
    }
    for k in 0..18_u32 {
        let node = f64::from(k % 3) * TAU / 3.0 + turn[0] + 0.4;
        let along = f64::from(k / 3) * TAU / 6.0 + f64::from(k % 3) * 0.5 + turn[1];
        add(System::Bds, k + 19, 5_282.6, Some(node), wrapped(along), 0.96);
    }
    all
}

/// How the planes are turned: by the time of the day, as the real ones.
fn random_pair(now: Instant) -> [f64; 2] {
    let day = now.tow_s / 86_164.0 * TAU;
    [wrapped(1.3 * day), wrapped(2.0 * day + 0.3)]
}

fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl Satellite {
    /// Seconds of the system's own time since the reference time.
    fn since_toe(&self, at: Instant) -> f64 {
        let (weeks, behind) = match self.system {
            System::Gps => (0, 0.0),
            System::Bds => (BDT_WEEKS, BDT_BEHIND_S),
        };
        f64::from(at.week - weeks - self.week) * 604_800.0 + (at.tow_s - behind - self.toe_s)
    }

    fn eccentric_anomaly(&self, t: f64) -> f64 {
        let a = self.root_a * self.root_a;
        let motion = (MU[self.system as usize] / (a * a * a)).sqrt() + self.motion_change;
        let mean = self.anomaly + motion * t;
        let mut e = mean;
        for _ in 0..12 {
            e = mean + self.eccentricity * e.sin();
        }
        e
    }

    /// Position in the frame that turns with Earth at the instant itself, m.
    pub(super) fn position_e(&self, at: Instant) -> [f64; 3] {
        let t = self.since_toe(at);
        let rate = EARTH_RATE[self.system as usize];
        let e = self.eccentric_anomaly(t);
        let true_anomaly = ((1.0 - self.eccentricity * self.eccentricity).sqrt() * e.sin())
            .atan2(e.cos() - self.eccentricity);
        let phi = true_anomaly + self.perigee;
        let [cuc, cus, crc, crs, cic, cis] = self.harmonics;
        let (s2, c2) = (2.0 * phi).sin_cos();
        let u = phi + cus * s2 + cuc * c2;
        let r = self.root_a * self.root_a * (1.0 - self.eccentricity * e.cos()) + crs * s2 + crc * c2;
        let i = self.inclination + self.inclination_rate * t + cis * s2 + cic * c2;
        let (x, y) = (r * u.cos(), r * u.sin());
        let turned = |node: f64| {
            [
                x * node.cos() - y * i.cos() * node.sin(),
                x * node.sin() + y * i.cos() * node.cos(),
                y * i.sin(),
            ]
        };
        if !self.geostationary {
            return turned(self.node + (self.node_rate - rate) * t - rate * self.toe_s);
        }
        // A frame that does not turn, leaning by five degrees, so that the inclination is never zero.
        let [x, y, z] = turned(self.node + self.node_rate * t - rate * self.toe_s);
        let (s5, c5) = (-5.0_f64).to_radians().sin_cos();
        let (y, z) = (y * c5 + z * s5, -y * s5 + z * c5);
        let (s, c) = (rate * t).sin_cos();
        [x * c + y * s, -x * s + y * c, z]
    }

    /// What the satellite's clock is ahead, s.
    pub(super) fn clock_s(&self, at: Instant) -> f64 {
        let t = self.since_toe(at);
        self.clock[0]
            + self.clock[1] * t
            + RELATIVITY * self.eccentricity * self.root_a * self.eccentric_anomaly(t).sin()
    }

    /// Appends the navigation message as RINEX 3 writes it.
    pub(super) fn write(&self, out: &mut String) {
        let behind_weeks = if self.system == System::Bds { BDT_WEEKS } else { 0 };
        let civil = Instant { week: self.week + behind_weeks, tow_s: self.toe_s }.civil();
        let _ = write!(
            out,
            "{}{:02} {:04} {:02} {:02} {:02} {:02} {:02}",
            self.system.letter(),
            self.number,
            civil.0,
            civil.1,
            civil.2,
            civil.3,
            civil.4,
            civil.5 as u32
        );
        let [cuc, cus, crc, crs, cic, cis] = self.harmonics;
        let lines: [[f64; 4]; 7] = [
            [1.0, crs, self.motion_change, self.anomaly],
            [cuc, self.eccentricity, cus, self.root_a],
            [self.toe_s, cic, self.node, cis],
            [self.inclination, crc, self.perigee, self.node_rate],
            [self.inclination_rate, 0.0, f64::from(self.week), 0.0],
            [2.0, 0.0, 0.0, 0.0],
            [self.toe_s, 0.0, 0.0, 0.0],
        ];
        push_numbers(&[self.clock[0], self.clock[1], 0.0], out);
        for line in lines {
            out.push_str("    ");
            push_numbers(&line, out);
        }
    }
}

/// Numbers as RINEX has them, 19 characters each, and the end of the line.
fn push_numbers(numbers: &[f64], out: &mut String) {
    for number in numbers {
        out.push_str(&rinex_number(*number));
    }
    out.push('\n');
}

fn rinex_number(number: f64) -> String {
    let text = format!("{number:.12e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{:>19}", format!("{mantissa}E{sign}{:02}", exponent.abs()))
}

impl Satellite {
    /// This very satellite, as somebody reads it out of the navigation file: its elements rounded as they are written.
    pub(super) fn rounded(mut self) -> Satellite {
        let round = |x: &mut f64| *x = format!("{x:.12e}").parse().unwrap_or(*x);
        for x in [
            &mut self.root_a,
            &mut self.eccentricity,
            &mut self.inclination,
            &mut self.inclination_rate,
            &mut self.node,
            &mut self.node_rate,
            &mut self.perigee,
            &mut self.anomaly,
            &mut self.motion_change,
        ] {
            round(x);
        }
        self.harmonics.iter_mut().chain(&mut self.clock).for_each(round);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geostationary_satellites_stay_above_their_longitude_and_the_equator() {
        let now = Instant { week: 2340, tow_s: 200_000.0 };
        let sky = draw(&mut Random::new(1, 0, crate::sim::random::Purpose::RoverSky), now);
        let first = sky.iter().find(|s| s.system == System::Bds && s.number == 1).unwrap();
        for later_s in [0.0, 900.0, 3600.0] {
            let [x, y, z] = first.position_e(now.after(later_s));
            assert!((y.atan2(x).to_degrees() - 140.0).abs() < 0.3, "{}", y.atan2(x).to_degrees());
            assert!(z.abs() < 1e5, "{z}");
            assert!((x.hypot(y) / 42_164e3 - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn medium_orbits_have_the_speed_of_their_radius() {
        let now = Instant { week: 2340, tow_s: 200_000.0 };
        for satellite in draw(&mut Random::new(2, 0, crate::sim::random::Purpose::RoverSky), now) {
            if satellite.geostationary {
                continue;
            }
            let inertial = |later: f64| {
                let [x, y, z] = satellite.position_e(now.after(later));
                let (s, c) = (EARTH_RATE[0] * later).sin_cos();
                [x * c - y * s, x * s + y * c, z]
            };
            let (a, b) = (inertial(-0.5), inertial(0.5));
            let speed = (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt();
            let expected = (MU[0] / (satellite.root_a * satellite.root_a)).sqrt();
            assert!((speed / expected - 1.0).abs() < 0.02, "{speed} {expected}");
        }
    }
}
