//! Where each error stands in the filter's error vector, its first variance and how it lasts.
//!
//! Errors are true − estimated. The first eighteen belong to the strapdown: attitude φ, velocity and position in n, biases
//! of gyros and accelerometers and scale factors of the accelerometers in b.

use serde::{Deserialize, Serialize};

use super::rig::Rig;
use super::tuning::{Lasting, Tuning};

pub(super) const ATTITUDE: usize = 0;
pub(super) const VELOCITY: usize = 3;
pub(super) const POSITION: usize = 6;
/// States that others move.
pub(super) const MOVING: usize = 9;
pub(super) const GYRO_BIAS: usize = 9;
pub(super) const ACCELEROMETER_BIAS: usize = 12;
pub(super) const ACCELEROMETER_SCALE: usize = 15;
/// States that move others.
pub(super) const DRIVING: usize = 18;
/// Rotation of the sensor's case in b.
pub(super) const MOUNTING: usize = 18;
/// Shift and turn of the surveyed antennas against b.
pub(super) const SURVEY: usize = 21;
const FIRST: usize = 27;

/// A station's states: pointing in azimuth and zenith angle (as angles), distance, then refraction in both, and the part of
/// the distance that stays.
pub(super) const OF_STATION: usize = 6;

/// Places of the states that depend on the instrument.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct States {
    pub(super) n: usize,
    pub(super) legs: usize,
    pub(super) make_delays: usize,
    pub(super) station_delay: usize,
    pub(super) encoder_delay: usize,
    /// What each angle of the rotator reads too much.
    pub(super) rotator: usize,
    makes: usize,
    antennas: usize,
    stations: usize,
    /// By state: first variance, and its error as a process that stays as it is, or wanders.
    pub(super) process: Vec<Process>,
}

/// A state's own error.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Process {
    pub(super) variance: f64,
    /// Correlation time, s; infinite for a constant.
    pub(super) time_s: f64,
    /// What comes anew each second to one that never fades.
    pub(super) walk: f64,
}

impl Process {
    fn constant(sigma: f64) -> Process {
        Process { variance: sigma * sigma, time_s: f64::INFINITY, walk: 0.0 }
    }

    fn lasting(sigma: f64, time_s: f64) -> Process {
        Process { variance: sigma * sigma, time_s, walk: 0.0 }
    }
}

impl States {
    pub(super) fn new(rig: &Rig, tuning: &Tuning, stated_sigma_m: [f64; 2]) -> States {
        let legs = FIRST;
        let make_delays = legs + 6;
        let station_delay = make_delays + rig.make_delay_s.len();
        let encoder_delay = station_delay + 1;
        let rotator = encoder_delay + 1;
        let makes = rotator + 2;
        let antennas = makes + 3 * rig.make_delay_s.len();
        let stations = antennas + 3 * rig.antennas.len();
        let n = stations + OF_STATION * rig.stations_n.len();
        let mut process = vec![Process::constant(0.0); n];
        let mut set = |from: usize, all: &[Process]| process[from..from + all.len()].copy_from_slice(all);

        let noise = &rig.noise;
        let walk = |sigma: f64| {
            let Lasting { share, time_s } = tuning.bias_walk;
            Process { walk: (share * sigma).powi(2) / time_s, ..Process::constant(sigma) }
        };
        set(GYRO_BIAS, &[walk(noise.gyro_bias_rad_s); 3]);
        set(ACCELEROMETER_BIAS, &[walk(noise.accelerometer_bias_m_s2); 3]);
        if tuning.calibration {
            set(ACCELEROMETER_SCALE, &[Process::constant(noise.accelerometer_scale); 3]);
            set(MOUNTING, &[Process::constant(rig.mounting_sigma_rad); 3]);
            let (count, reach_m) = (rig.antennas.len().max(1) as f64, rig.antenna_reach_m());
            let shift = rig.antenna_sigma_m / count.sqrt();
            let (level, yaw) = (shift * std::f64::consts::SQRT_2 / reach_m, shift / reach_m);
            set(SURVEY, &[shift, shift, shift, level, level, yaw].map(Process::constant));
            set(
                make_delays,
                &vec![Process::constant(tuning.delay * rig.make_delay_sigma_s); rig.make_delay_s.len()],
            );
            set(station_delay, &[Process::constant(tuning.delay * rig.station.delay_sigma_s)]);
            set(encoder_delay, &[Process::constant(tuning.delay * rig.encoder_delay_sigma_s)]);
            set(rotator, &[Process::constant(rig.rotator_sigma_rad); 2]);
            // The wave of a screw wanders with the legs.
            let leg = rig.leg_sigma_m;
            set(legs, &[Process { walk: (0.1 * leg).powi(2) / 100.0, ..Process::constant(leg) }; 6]);
        }
        let axes = |of: &[Lasting; 2]| {
            [0, 0, 1]
                .map(|axis: usize| Process::lasting(of[axis].share * stated_sigma_m[axis], of[axis].time_s))
        };
        for make in 0..rig.make_delay_s.len() {
            set(makes + 3 * make, &axes(&tuning.make));
        }
        for antenna in 0..rig.antennas.len() {
            set(antennas + 3 * antenna, &axes(&tuning.antenna));
        }
        let station = &rig.station;
        for k in 0..rig.stations_n.len() {
            let pointing =
                Process::lasting(tuning.pointing.share * station.angle_rad, tuning.pointing.time_s);
            let slant = Process::lasting(tuning.slant.share * station.slant_m, tuning.slant.time_s);
            let surveyed = station.position_m / rig.usual_range_m(k);
            let refraction = tuning.refraction.map(|Lasting { share, time_s }| {
                let bent = share * station.angle_rad;
                Process::lasting(if share > 0.0 { libm::hypot(bent, surveyed) } else { 0.0 }, time_s)
            });
            let stays =
                if tuning.calibration { libm::hypot(station.position_m, 0.5 * station.slant_m) } else { 0.0 };
            set(
                stations + OF_STATION * k,
                &[pointing, pointing, slant, refraction[0], refraction[1], Process::constant(stays)],
            );
        }
        States {
            n,
            legs,
            make_delays,
            station_delay,
            encoder_delay,
            rotator,
            makes,
            antennas,
            stations,
            process,
        }
    }

    pub(super) fn make(&self, make: usize) -> usize {
        self.makes + 3 * make
    }

    pub(super) fn antenna(&self, antenna: usize) -> usize {
        self.antennas + 3 * antenna
    }

    pub(super) fn station(&self, station: usize) -> usize {
        self.stations + OF_STATION * station
    }
}

impl Rig {
    /// Root mean square distance of the antennas from their middle, m.
    fn antenna_reach_m(&self) -> f64 {
        let centre = self.antenna_centre_b();
        let squares: f64 =
            self.antennas.iter().map(|antenna| (antenna.position_b - centre).norm_squared()).sum();
        (squares / self.antennas.len().max(1) as f64).sqrt().max(0.1)
    }

    /// How far a station looks, m: to 150 m above the origin.
    fn usual_range_m(&self, station: usize) -> f64 {
        (nalgebra::Vector3::new(0.0, 0.0, 150.0) - self.stations_n[station]).norm().max(10.0)
    }
}
