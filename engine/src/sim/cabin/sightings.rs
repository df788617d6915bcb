//! Antennas and total stations: tables 2 and 3 of the paper, with errors that last.

use nalgebra::Vector3;

use super::super::gauss_markov::GaussMarkov;
use super::super::random::{Purpose, Random};
use super::devices::{Devices, ROW_NS};
use super::fault::FaultKind;
use super::geometry::{ANGLE_RAD, JITTER_S, SLANT_M};
use super::rows::{AntennaReading, Ray};

/// Of a fix: stated sigmas, and its parts that a make shares, that last, and that are white, m.
const STATED_M: [f64; 3] = [0.0070, 0.0057, 0.0079];
const MAKE_M: [f64; 3] = [0.0060, 0.0046, 0.0058];
const OWN_M: [f64; 3] = [0.0030, 0.0030, 0.0045];
const WHITE_M: [f64; 3] = [0.0013, 0.0013, 0.0026];
const DOPPLER_M_S: [f64; 3] = [0.008, 0.008, 0.015];
/// Of a ray: pointing and distance that last, and refraction.
const POINTING_RAD: f64 = 6.2e-6;
const SLANT_LASTS_M: f64 = 0.002;
const REFRACTION_RAD: f64 = 6e-6;

impl Devices<'_> {
    pub(super) fn antennas(&self) -> Vec<AntennaReading> {
        let slow = |sigma: [f64; 3], time_s: f64, stream: usize| {
            let random = Random::new(self.seed, stream, Purpose::FixSlowError);
            GaussMarkov::new(sigma.map(|x| x * self.scale), time_s, random)
        };
        let mut white = Random::new(self.seed, Random::COMMON, Purpose::FixNoise);
        let mut own: Vec<GaussMarkov> = (0..6).map(|k| slow(OWN_M, 30.0, 3 + k)).collect();
        let mut makes: Vec<GaussMarkov> = (0..2).map(|make| slow(MAKE_M, 90.0, 9 + make)).collect();
        let mut float_until_s = [-1.0; 6];
        let offsets: Vec<Vector3<f64>> = (0..8).map(|_| direction(&mut white)).collect();
        let sizes: Vec<f64> = (0..8)
            .map(|k| if k < 6 { white.uniform(0.05, 0.2) } else { white.uniform(0.06, 0.12) })
            .collect();
        let late_s = white.uniform(0.08, 0.15);
        let mut rows = Vec::new();
        for t_ns in self.ticks(ROW_NS) {
            let t_s = t_ns as f64 * 1e-9;
            let shared: Vec<[f64; 3]> = makes.iter_mut().map(|make| make.advance(0.05)).collect();
            for antenna in 0..6 {
                let make = antenna % 2;
                let lasting = own[antenna].advance(0.05);
                let (noise, doppler) = (white.normal_3(), white.normal_3());
                if white.uniform(0.0, 1.0) < 0.00018 {
                    float_until_s[antenna] = t_s + white.uniform(3.0, 20.0);
                }
                let late_s = if self.is(FaultKind::LateMake(make), t_s) { late_s } else { 0.0 };
                let then_s = t_s - self.delay_s[make] - late_s;
                if then_s < 0.0 || self.is(FaultKind::NoAntennas, t_s) {
                    continue;
                }
                let place = self.at(then_s).cabin.at_lever_arm(&self.antennas_b[antenna]);
                let mut off = Vector3::from(shared[make])
                    + Vector3::from(lasting)
                    + Vector3::from(noise).component_mul(&Vector3::from(WHITE_M)) * self.scale;
                if self.is(FaultKind::WrongFix(antenna), t_s) {
                    off += offsets[antenna] * sizes[antenna];
                }
                if self.is(FaultKind::WrongMake(make), t_s) {
                    off += offsets[6 + make] * sizes[6 + make];
                }
                let is_float = t_s < float_until_s[antenna];
                if is_float {
                    off += offsets[antenna] * 0.25;
                }
                let digits = |x: f64| libm::round(x * 1e4) * 1e-4;
                let position = place.position_n_m + off;
                let velocity =
                    place.velocity_n_m_s + Vector3::from(doppler).component_mul(&Vector3::from(DOPPLER_M_S));
                rows.push(AntennaReading {
                    t_ns,
                    antenna,
                    position_n_m: [position.x, position.y, position.z].map(digits),
                    sigma_n_m: if is_float {
                        [0.2; 3]
                    } else {
                        STATED_M.map(|sigma| digits(sigma * self.scale))
                    },
                    quality: if is_float { 5 } else { 4 },
                    velocity_n_m_s: [velocity.x, velocity.y, velocity.z].map(digits),
                });
            }
        }
        rows
    }

    pub(super) fn stations(&self) -> Vec<Ray> {
        let mut rays: Vec<Ray> =
            (0..self.stations_n.len()).flat_map(|station| self.station(station)).collect();
        rays.sort_by_key(|ray| (ray.t_ns, ray.station));
        rays
    }

    fn station(&self, station: usize) -> Vec<Ray> {
        let random = |purpose| Random::new(self.seed, 3 + station, purpose);
        let mut white = random(Purpose::StationNoise);
        let mut slow = random(Purpose::StationSlowError);
        let refraction: [f64; 2] = [slow.normal() * REFRACTION_RAD, slow.normal() * REFRACTION_RAD];
        let mut lasting = GaussMarkov::new([POINTING_RAD, POINTING_RAD, 0.0], 4.0, slow.clone());
        let mut slant_lasting =
            GaussMarkov::new([SLANT_LASTS_M, 0.0, 0.0], 6.0, random(Purpose::EncoderNoise));
        let period_s = white.uniform(0.11, 0.19);
        let wrong_m = white.uniform(0.015, 0.034) * if white.normal() > 0.0 { 1.0 } else { -1.0 };
        let cabin_targets = self.geometry.cabin_targets_b.len();
        let platform_targets = self.geometry.platform_targets_p.len();
        let target = if self.plan.stations_on_platform {
            cabin_targets + station % platform_targets
        } else {
            station % cabin_targets
        };
        let mut t_s = white.uniform(1.0, 4.0);
        let mut lost_until_s = 0.0;
        let mut rays = Vec::new();
        while t_s <= self.course.end_s() {
            let tag_s = t_s;
            let step_s = period_s + white.uniform(-0.002, 0.002);
            t_s += step_s;
            let (pointing, slant_off) = (lasting.advance(step_s), slant_lasting.advance(step_s));
            let noise = white.normal_3();
            let jitter_s = JITTER_S * white.normal();
            if white.uniform(0.0, 1.0) < 0.0008 {
                lost_until_s = tag_s + white.uniform(2.0, 6.0);
            }
            if self.is(FaultKind::Fog, tag_s) {
                lost_until_s = tag_s + 2.4 + white.uniform(0.0, 3.0);
            }
            if tag_s < lost_until_s {
                continue;
            }
            let seen = match (self.is(FaultKind::WrongPrism(station), tag_s), target < cabin_targets) {
                (false, _) => target,
                (true, true) => (target + 1) % cabin_targets,
                (true, false) => cabin_targets + (target - cabin_targets + 1) % platform_targets,
            };
            let state = self.at(tag_s - self.station_delay_s - jitter_s);
            let place_n = match seen.checked_sub(cabin_targets) {
                None => state.cabin.at_lever_arm(&self.geometry.cabin_targets_b[seen]).position_n_m,
                Some(k) => state.platform.at_lever_arm(&self.geometry.platform_targets_p[k]).position_n_m,
            };
            let ray_n = place_n - self.stations_n[station];
            let (plan_m, slant_m) = (libm::hypot(ray_n.x, ray_n.y), ray_n.norm());
            let across = slant_m / plan_m;
            let azimuth_off = (refraction[0] + pointing[0] + ANGLE_RAD * noise[0]) * across;
            let wrong_m = if self.is(FaultKind::WrongDistance(station), tag_s) { wrong_m } else { 0.0 };
            let digits = |x: f64, unit: f64| libm::round(x / unit) * unit;
            rays.push(Ray {
                t_ns: (libm::round(tag_s * 1e4) as i64) * 100_000,
                station,
                target,
                azimuth_rad: digits(
                    libm::atan2(ray_n.x, ray_n.y).rem_euclid(std::f64::consts::TAU) + azimuth_off,
                    1e-9,
                ),
                zenith_rad: digits(
                    libm::atan2(plan_m, ray_n.z) + refraction[1] + pointing[1] + ANGLE_RAD * noise[1],
                    1e-9,
                ),
                slant_m: digits(
                    slant_m + slant_off[0] + wrong_m + (SLANT_M + 1e-6 * slant_m) * noise[2],
                    1e-5,
                ),
            });
        }
        rays
    }
}

/// A direction, evenly drawn.
fn direction(random: &mut Random) -> Vector3<f64> {
    Vector3::from(random.normal_3()).normalize()
}
