//! Broadcast orbits: 1019 (GPS), 1042 (BeiDou), 1046 (Galileo I/NAV). Angles come in semicircles.

use std::f64::consts::PI;

use super::bits::Bits;
use crate::gnss::ephemeris::Ephemeris;
use crate::gnss::satellite::{Constellation, Satellite};
use crate::gnss::time::{GPS_MINUS_BEIDOU_S, GpsTime, WEEK_S};

/// BeiDou's week 0, as GPS counts.
const BEIDOU_WEEK: i32 = 1356;
/// Galileo's week 0, as GPS counts.
const GALILEO_WEEK: i32 = 1024;

/// The week that ends in these digits and is nearest to another.
fn nearest_week(told: u64, cycle: i32, near: i32) -> i32 {
    let told = told as i32;
    near + (told - near + cycle / 2).rem_euclid(cycle) - cycle / 2
}

/// Reads 1019 behind the message's number.
pub(super) fn gps(bits: &mut Bits<'_>, now: GpsTime) -> Option<Ephemeris> {
    let number = bits.unsigned(6)? as u8;
    let week = nearest_week(bits.unsigned(10)?, 1024, now.week());
    bits.skip(4 + 2)?;
    let i_dot = PI * bits.scaled(14, -43)?;
    bits.skip(8)?;
    let toc_s = bits.unsigned(16)? as f64 * 16.0;
    let [af2, af1, af0] = [bits.scaled(8, -55)?, bits.scaled(16, -43)?, bits.scaled(22, -31)?];
    bits.skip(10)?;
    let orbit = orbit(bits, &Sizes { harmonic: 16, harmonic_rad: -29, harmonic_m: -5, toe: 16 })?;
    let toe_s = orbit.toe * 16.0;
    bits.skip(8)?;
    let health = bits.unsigned(6)?;
    let satellite = satellite(Constellation::Gps, number, 32)?;
    let times = times(week, toe_s, toc_s)?;
    Some(orbit.ephemeris(satellite, times, [af0, af1, af2], i_dot, health == 0))
}

/// Reads 1042.
pub(super) fn beidou(bits: &mut Bits<'_>, now: GpsTime) -> Option<Ephemeris> {
    let number = bits.unsigned(6)? as u8;
    let week = nearest_week(bits.unsigned(13)?, 8192, now.week() - BEIDOU_WEEK) + BEIDOU_WEEK;
    bits.skip(4)?;
    let i_dot = PI * bits.scaled(14, -43)?;
    bits.skip(5)?;
    let toc_s = bits.unsigned(17)? as f64 * 8.0;
    let [a2, a1, a0] = [bits.scaled(11, -66)?, bits.scaled(22, -50)?, bits.scaled(24, -33)?];
    bits.skip(5)?;
    let orbit = orbit(bits, &Sizes { harmonic: 18, harmonic_rad: -31, harmonic_m: -6, toe: 17 })?;
    let toe_s = orbit.toe * 8.0;
    bits.skip(20)?;
    let health = bits.unsigned(1)?;
    let satellite = satellite(Constellation::Beidou, number, 63)?;
    let [toe, toc] = times(week, toe_s, toc_s)?.map(|time| time + GPS_MINUS_BEIDOU_S as f64);
    Some(orbit.ephemeris(satellite, [toe, toc], [a0, a1, a2], i_dot, health == 0))
}

/// Reads 1046.
pub(super) fn galileo(bits: &mut Bits<'_>, now: GpsTime) -> Option<Ephemeris> {
    let number = bits.unsigned(6)? as u8;
    let week = nearest_week(bits.unsigned(12)?, 4096, now.week() - GALILEO_WEEK) + GALILEO_WEEK;
    bits.skip(10 + 8)?;
    let i_dot = PI * bits.scaled(14, -43)?;
    let toc_s = bits.unsigned(14)? as f64 * 60.0;
    let [af2, af1, af0] = [bits.scaled(6, -59)?, bits.scaled(21, -46)?, bits.scaled(31, -34)?];
    let orbit = orbit(bits, &Sizes { harmonic: 16, harmonic_rad: -29, harmonic_m: -5, toe: 14 })?;
    let toe_s = orbit.toe * 60.0;
    bits.skip(20)?;
    let health = bits.unsigned(6)?;
    let satellite = satellite(Constellation::Galileo, number, 36)?;
    let times = times(week, toe_s, toc_s)?;
    Some(orbit.ephemeris(satellite, times, [af0, af1, af2], i_dot, health == 0))
}

fn satellite(constellation: Constellation, number: u8, most: u8) -> Option<Satellite> {
    (1..=most).contains(&number).then_some(Satellite { constellation, number })
}

/// Reference times of orbit and clock; the clock's may lie in the week before or after.
fn times(week: i32, toe_s: f64, toc_s: f64) -> Option<[GpsTime; 2]> {
    if toe_s >= WEEK_S || toc_s >= WEEK_S {
        return None;
    }
    let toe = GpsTime::from_week(week, toe_s);
    let off_s = toc_s - toe_s;
    let turned = if off_s > WEEK_S / 2.0 {
        -WEEK_S
    } else if off_s < -WEEK_S / 2.0 {
        WEEK_S
    } else {
        0.0
    };
    Some([toe, GpsTime::from_week(week, toc_s) + turned])
}

/// What differs among the systems.
struct Sizes {
    /// Bits of the harmonic terms.
    harmonic: u32,
    /// Powers of two of their steps.
    harmonic_rad: i32,
    harmonic_m: i32,
    /// Bits of the reference time.
    toe: u32,
}

/// What stands in all three in one order.
struct Orbit {
    crs: f64,
    delta_n: f64,
    m0: f64,
    cuc: f64,
    eccentricity: f64,
    cus: f64,
    sqrt_a: f64,
    /// In the message's own steps.
    toe: f64,
    cic: f64,
    omega0: f64,
    cis: f64,
    i0: f64,
    crc: f64,
    omega: f64,
    omega_dot: f64,
}

fn orbit(bits: &mut Bits<'_>, sizes: &Sizes) -> Option<Orbit> {
    let Sizes { harmonic, harmonic_rad, harmonic_m, toe } = *sizes;
    let crs = bits.scaled(harmonic, harmonic_m)?;
    let delta_n = PI * bits.scaled(16, -43)?;
    let m0 = PI * bits.scaled(32, -31)?;
    let cuc = bits.scaled(harmonic, harmonic_rad)?;
    let eccentricity = bits.scaled_unsigned(32, -33)?;
    let cus = bits.scaled(harmonic, harmonic_rad)?;
    let sqrt_a = bits.scaled_unsigned(32, -19)?;
    let toe = bits.unsigned(toe)? as f64;
    let cic = bits.scaled(harmonic, harmonic_rad)?;
    let omega0 = PI * bits.scaled(32, -31)?;
    let cis = bits.scaled(harmonic, harmonic_rad)?;
    let i0 = PI * bits.scaled(32, -31)?;
    let crc = bits.scaled(harmonic, harmonic_m)?;
    let omega = PI * bits.scaled(32, -31)?;
    let omega_dot = PI * bits.scaled(24, -43)?;
    Some(Orbit {
        crs,
        delta_n,
        m0,
        cuc,
        eccentricity,
        cus,
        sqrt_a,
        toe,
        cic,
        omega0,
        cis,
        i0,
        crc,
        omega,
        omega_dot,
    })
}

impl Orbit {
    fn ephemeris(
        &self,
        satellite: Satellite,
        [toe, toc]: [GpsTime; 2],
        clock: [f64; 3],
        i_dot: f64,
        healthy: bool,
    ) -> Ephemeris {
        Ephemeris {
            satellite,
            toc,
            toe,
            clock,
            sqrt_a: self.sqrt_a,
            eccentricity: self.eccentricity,
            m0: self.m0,
            delta_n: self.delta_n,
            omega0: self.omega0,
            omega_dot: self.omega_dot,
            omega: self.omega,
            i0: self.i0,
            i_dot,
            cu: [self.cuc, self.cus],
            cr: [self.crc, self.crs],
            ci: [self.cic, self.cis],
            healthy,
        }
    }
}
