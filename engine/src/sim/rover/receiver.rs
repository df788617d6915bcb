//! What a receiver measures of a made sky: code and phase on two bands, with clocks, air, multipath, slips and half cycles.

use super::clock::Instant;
use super::orbit::Satellite;
use crate::geo::{Geodetic, LocalFrame};
use crate::sim::random::Random;

const LIGHT_M_S: f64 = 299_792_458.0;
const EARTH_RATE: f64 = 7.292_115_146_7e-5;

/// One satellite in one epoch.
#[derive(Clone, Debug)]
pub(super) struct Observed {
    /// Index into the sky.
    pub(super) satellite: usize,
    pub(super) code_m: [f64; 2],
    pub(super) phase_cycles: [f64; 2],
    /// Loss-of-lock indicators as RINEX has them.
    pub(super) lli: [u8; 2],
    pub(super) snr_db_hz: [f64; 2],
}

/// How good a receiver and its surroundings are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quality {
    pub(super) code_m: f64,
    pub(super) phase_m: f64,
    pub(super) code_multipath_m: f64,
    pub(super) phase_multipath_m: f64,
    /// Slips of one satellite, 1/s.
    pub(super) slips_hz: f64,
}

/// Whether a satellite is tracked on a band, and how.
#[derive(Clone, Copy, Debug, Default)]
struct Lock {
    tracked: bool,
    cycles: f64,
    half_until_s: f64,
    half: bool,
    code_multipath: f64,
    phase_multipath: f64,
}

/// A receiver.
#[derive(Clone, Debug)]
pub(super) struct Receiver {
    quality: Quality,
    clock_s: f64,
    drift: f64,
    locks: Vec<[Lock; 2]>,
    random: Random,
    pub(super) slips: usize,
    pub(super) slips_without_lli: usize,
    moves: bool,
}

impl Receiver {
    pub(super) fn new(quality: Quality, satellites: usize, mut random: Random, moves: bool) -> Receiver {
        let clock_s = 2e-4 * random.normal();
        let drift = 1e-8 * random.normal();
        let locks = vec![[Lock::default(); 2]; satellites];
        Receiver { quality, clock_s, drift, locks, random, slips: 0, slips_without_lli: 0, moves }
    }

    /// An epoch by the receiver's clock at a place; `visible` are the satellites that can be received.
    pub(super) fn observe(
        &mut self,
        sky: &[Satellite],
        tag: Instant,
        t_s: f64,
        place: Geodetic,
        visible: &[usize],
    ) -> Vec<Observed> {
        /// Multipath changes while standing, s, and on the way, s.
        const STILL_S: f64 = 40.0;
        const MOVING_S: f64 = 3.0;
        self.clock_s += self.drift + 2e-10 * self.random.normal();
        let fade = (-1.0 / if self.moves { MOVING_S } else { STILL_S }).exp();
        let grow = (1.0 - fade * fade).sqrt();
        let at = tag.after(-self.clock_s);
        let p_e = place.to_ecef_m();
        let frame = LocalFrame::new(place);
        let mut out = Vec::new();
        for (k, satellite) in sky.iter().enumerate() {
            if !visible.contains(&k) {
                self.locks[k] = [Lock::default(); 2];
                continue;
            }
            let (range_m, sent) = range(satellite, at, &p_e);
            let elevation = elevation(satellite, at, &frame);
            let sin_e = elevation.sin().max(0.05);
            let air_m = 2.3 * (-place.height_m / 8_000.0).exp() / sin_e;
            let frequencies = satellite.system.frequencies();
            let ion_m = 2.5 / (sin_e * sin_e + 0.1).sqrt();
            let clocks_m = LIGHT_M_S * (self.clock_s - satellite.clock_s(sent));
            let mut observed = Observed {
                satellite: k,
                code_m: [0.0; 2],
                phase_cycles: [0.0; 2],
                lli: [0; 2],
                snr_db_hz: [0.0; 2],
            };
            for band in 0..2 {
                let wave_m = LIGHT_M_S / frequencies[band];
                let ion_m = ion_m * (frequencies[0] / frequencies[band]).powi(2);
                let quality = self.quality;
                let (n1, n2, n3, n4) =
                    (self.random.normal(), self.random.normal(), self.random.normal(), self.random.normal());
                let lli = self.keep_lock(k, band, t_s);
                let lock = &mut self.locks[k][band];
                lock.code_multipath = lock.code_multipath * fade + grow * quality.code_multipath_m * n1;
                lock.phase_multipath = lock.phase_multipath * fade + grow * quality.phase_multipath_m * n2;
                let low = 0.6 + 0.4 / sin_e;
                let geometry_m = range_m + clocks_m + air_m;
                observed.code_m[band] =
                    geometry_m + ion_m + low * (quality.code_m * n3 + lock.code_multipath);
                let phase_m = geometry_m - ion_m + low * (quality.phase_m * n4 + lock.phase_multipath);
                let half = if lock.half { 0.5 } else { 0.0 };
                observed.phase_cycles[band] = phase_m / wave_m + lock.cycles + half;
                observed.lli[band] = lli;
                observed.snr_db_hz[band] = 36.0 + 14.0 * sin_e - 5.0 * band as f64 + 0.6 * n3;
            }
            out.push(observed);
        }
        out
    }

    /// Slips, half cycles and new locks; the loss-of-lock indicator of this epoch.
    fn keep_lock(&mut self, satellite: usize, band: usize, t_s: f64) -> u8 {
        let slip = self.random.uniform(0.0, 1.0) < self.quality.slips_hz;
        let (u1, u2, u3) =
            (self.random.uniform(0.0, 1.0), self.random.uniform(0.0, 1.0), self.random.uniform(0.0, 1.0));
        let lock = &mut self.locks[satellite][band];
        let mut lli = 0;
        if !lock.tracked {
            lock.tracked = true;
            lock.cycles = (2e5 * (u1 - 0.5)).round();
            // Until the sign of the data is known a phase may be half a cycle off.
            if u2 < 0.3 {
                lock.half_until_s = t_s + 2.0 + 3.0 * u3;
                lock.half = u1 < 0.5;
            }
            lli |= 1;
        } else if slip {
            lock.cycles += (12.0 * (u1 - 0.5)).round() + if u1 < 0.5 { -1.0 } else { 1.0 };
            self.slips += 1;
            if u2 < 0.75 {
                lli |= 1;
            } else {
                self.slips_without_lli += 1;
            }
        }
        if t_s < lock.half_until_s {
            lli |= 2;
        } else {
            lock.half = false;
        }
        lli
    }
}

/// The geometric range by light's way on a turning Earth, and when the signal was sent.
fn range(satellite: &Satellite, at: Instant, p_e: &[f64; 3]) -> (f64, Instant) {
    let mut range_m = 2.2e7;
    let mut sent = at;
    for _ in 0..6 {
        let way_s = range_m / LIGHT_M_S;
        sent = at.after(-way_s);
        let [x, y, z] = satellite.position_e(sent);
        let (s, c) = (EARTH_RATE * way_s).sin_cos();
        let turned = [x * c + y * s, -x * s + y * c, z];
        range_m = turned.iter().zip(p_e).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    }
    (range_m, sent)
}

/// Elevation and azimuth of a satellite, rad.
pub(super) fn direction(satellite: &Satellite, at: Instant, frame: &LocalFrame) -> (f64, f64) {
    let [e, n, u] = frame.to_local_m(Geodetic::from_ecef_m(satellite.position_e(at)));
    (u.atan2(e.hypot(n)), e.atan2(n))
}

fn elevation(satellite: &Satellite, at: Instant, frame: &LocalFrame) -> f64 {
    direction(satellite, at, frame).0
}
