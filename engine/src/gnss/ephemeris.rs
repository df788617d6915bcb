//! Broadcast orbits and clocks: where a satellite was, by the interface documents of GPS (IS-GPS-200), BeiDou (B1I 3.0), Galileo
//! (OS SIS ICD) and QZSS.

use nalgebra::Vector3;

use super::satellite::{Constellation, Satellite};
use super::time::GpsTime;

/// Earth's rate by GPS and Galileo, rad/s.
const RATE_GPS: f64 = 7.292_115_146_7e-5;
/// Earth's rate by BeiDou, rad/s.
const RATE_BEIDOU: f64 = 7.292_115e-5;
/// Gravitational constant by GPS and QZSS, m³/s².
const MU_GPS: f64 = 3.986_005_0e14;
/// Gravitational constant by BeiDou and Galileo, m³/s².
const MU_OTHERS: f64 = 3.986_004_418e14;
/// −2 √µ / c², s/√m, of the relativistic clock.
const RELATIVITY: f64 = -4.442_807_633e-10;

/// What one satellite broadcasts of its orbit and clock; angles in radians, lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ephemeris {
    /// The satellite.
    pub satellite: Satellite,
    /// Reference time of the clock.
    pub toc: GpsTime,
    /// Reference time of the orbit.
    pub toe: GpsTime,
    /// Clock offset s, drift s/s, its change s/s².
    pub clock: [f64; 3],
    /// Square root of the semi-major axis.
    pub sqrt_a: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Mean anomaly at the reference time.
    pub m0: f64,
    /// Correction of the mean motion, rad/s.
    pub delta_n: f64,
    /// Longitude of the ascending node at the beginning of the week.
    pub omega0: f64,
    /// Its rate, rad/s.
    pub omega_dot: f64,
    /// Argument of perigee.
    pub omega: f64,
    /// Inclination at the reference time.
    pub i0: f64,
    /// Its rate, rad/s.
    pub i_dot: f64,
    /// Cosine and sine terms of the argument of latitude.
    pub cu: [f64; 2],
    /// Cosine and sine terms of the radius, m.
    pub cr: [f64; 2],
    /// Cosine and sine terms of the inclination.
    pub ci: [f64; 2],
    /// The satellite says of itself that it is well.
    pub healthy: bool,
}

/// Where a satellite is, and how its clock stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SatelliteState {
    /// Earth-centred Earth-fixed, m, in the frame of the moment itself.
    pub p_e: Vector3<f64>,
    /// Clock minus GPS time, s, relativity included.
    pub clock_s: f64,
}

impl Ephemeris {
    /// How long before and after its reference time it is used, s.
    pub fn reach_s(&self) -> f64 {
        match self.satellite.constellation {
            Constellation::Beidou => 6.0 * 3600.0 + 1.0,
            _ => 4.0 * 3600.0 + 1.0,
        }
    }

    /// Clock offset without relativity at a moment, s.
    pub fn clock_s(&self, time: GpsTime) -> f64 {
        let dt = time.since(self.toc);
        self.clock[0] + dt * (self.clock[1] + dt * self.clock[2])
    }

    /// The satellite's place and clock at a moment.
    pub fn state(&self, time: GpsTime) -> SatelliteState {
        let (mu, rate) = match self.satellite.constellation {
            Constellation::Beidou => (MU_OTHERS, RATE_BEIDOU),
            Constellation::Galileo => (MU_OTHERS, RATE_GPS),
            Constellation::Gps | Constellation::Qzss => (MU_GPS, RATE_GPS),
        };
        let t = time.since(self.toe);
        let a = self.sqrt_a * self.sqrt_a;
        let n = libm::sqrt(mu / (a * a * a)) + self.delta_n;
        let m = self.m0 + n * t;
        let mut e = m;
        // Kepler's equation by Newton; orbits are nearly round, so that few rounds suffice.
        for _ in 0..12 {
            let (sin, cos) = libm::sincos(e);
            let step = (e - self.eccentricity * sin - m) / (1.0 - self.eccentricity * cos);
            e -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        let (sin_e, cos_e) = libm::sincos(e);
        let root = libm::sqrt(1.0 - self.eccentricity * self.eccentricity);
        let argument = libm::atan2(root * sin_e, cos_e - self.eccentricity) + self.omega;
        let (sin_2u, cos_2u) = libm::sincos(2.0 * argument);
        let u = argument + self.cu[0] * cos_2u + self.cu[1] * sin_2u;
        let r = a * (1.0 - self.eccentricity * cos_e) + self.cr[0] * cos_2u + self.cr[1] * sin_2u;
        let i = self.i0 + self.i_dot * t + self.ci[0] * cos_2u + self.ci[1] * sin_2u;
        let (sin_u, cos_u) = libm::sincos(u);
        let (x, y) = (r * cos_u, r * sin_u);
        let (sin_i, cos_i) = libm::sincos(i);
        // The node is told for the beginning of the week by the system's own clock.
        let toe_s = match self.satellite.constellation {
            Constellation::Beidou => (self.toe - super::time::GPS_MINUS_BEIDOU_S as f64).tow_s(),
            _ => self.toe.tow_s(),
        };
        let geostationary = self.satellite.is_beidou_geostationary();
        let turning = if geostationary { self.omega_dot } else { self.omega_dot - rate };
        let (sin_o, cos_o) = libm::sincos(self.omega0 + turning * t - rate * toe_s);
        let in_frame = Vector3::new(x * cos_o - y * cos_i * sin_o, x * sin_o + y * cos_i * cos_o, y * sin_i);
        let p_e = if geostationary { turned(in_frame, rate * t) } else { in_frame };
        let relativity_s = RELATIVITY * self.eccentricity * self.sqrt_a * sin_e;
        SatelliteState { p_e, clock_s: self.clock_s(time) + relativity_s }
    }
}

/// From the frame that is inclined by −5° and does not turn, in which BeiDou tells geostationary orbits, to the Earth's.
fn turned(p: Vector3<f64>, angle: f64) -> Vector3<f64> {
    let (sin_5, cos_5) = libm::sincos((-5.0_f64).to_radians());
    let (sin, cos) = libm::sincos(angle);
    let (x, y, z) = (p.x, p.y * cos_5 + p.z * sin_5, -p.y * sin_5 + p.z * cos_5);
    Vector3::new(x * cos + y * sin, -x * sin + y * cos, z)
}

/// The ephemerides of all satellites.
#[derive(Clone, Debug, Default)]
pub struct Navigation {
    /// In no order.
    pub ephemerides: Vec<Ephemeris>,
    /// Klobuchar's eight coefficients, where a file has them.
    pub klobuchar: Option<[f64; 8]>,
    /// What was passed over, a sentence each.
    pub notes: Vec<String>,
}

impl Navigation {
    /// Adds what another file holds.
    pub fn append(&mut self, mut other: Navigation) {
        self.ephemerides.append(&mut other.ephemerides);
        self.klobuchar = self.klobuchar.or(other.klobuchar);
        self.notes.append(&mut other.notes);
    }

    /// Brings the ephemerides into the order of their reference times; those of one time stay as they came.
    pub fn in_order_of_time(&mut self) {
        self.ephemerides.sort_by_key(|one| one.toe);
    }

    /// The ephemeris of a healthy satellite whose reference time is nearest; none in reach.
    pub fn nearest(&self, satellite: Satellite, time: GpsTime) -> Option<&Ephemeris> {
        self.ephemerides
            .iter()
            .filter(|one| {
                one.satellite == satellite && (one.toe.ns - time.ns).abs() as f64 * 1e-9 <= one.reach_s()
            })
            .min_by_key(|one| (one.toe.ns - time.ns).abs())
            .filter(|one| one.healthy)
    }

    /// The first and last reference time.
    pub fn span(&self) -> Option<(GpsTime, GpsTime)> {
        let first = self.ephemerides.iter().map(|one| one.toe).min()?;
        Some((first, self.ephemerides.iter().map(|one| one.toe).max()?))
    }
}
