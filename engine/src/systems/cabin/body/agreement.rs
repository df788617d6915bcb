//! Whether the world is as the filter believes: the sensor's own noise, the scatter of rows, and errors that creep in.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::Body;
use crate::systems::cabin::aids::Aids;
use crate::systems::cabin::causes::CabinCause;
use crate::systems::cabin::encoder_watch::channel_name;
use crate::systems::cabin::filter::Measured;
use crate::systems::cabin::scores::Innovation;
use crate::systems::cabin::watch::Watch;

/// Noise by the samples counts where it is so many times the stated, and less than this many are not told.
const MORE_NOISE: f64 = 1.2;
/// Rows scatter more than stated where the mean of their normalised squares is above this, and not any more below that.
const SCATTERS: [f64; 2] = [1.2, 1.6];
/// More than this is no noise: rows that are wrong, or a pose that is.
const CONTRADICTS: f64 = 5.0;
/// The factor of their variance goes up and down by so much every half second.
const FACTOR_UP: f64 = 1.25;
const FACTOR_DOWN: f64 = 1.04;
const JUDGED_EVERY_NS: i64 = 500_000_000;
/// It is told from this factor on, and is this at most.
const TOLD_FACTOR: f64 = 3.0;
const MOST_FACTOR: f64 = 16.0;
/// A state creeps where its score is so many sigmas, and none of another device is nearly as much.
const CREEPS_SIGMAS: f64 = 4.0;
const CLEARER: f64 = 1.2;
/// A state that creeps is then so many sigmas uncertain: most of what has crept in stands in other states by now.
const OPENED_SIGMAS: f64 = 3.0;
/// What was wrong of the first pose has gone by then, ns.
const SETTLED_NS: i64 = 20_000_000_000;
/// Its device is named where its error is so many of the sigmas that it may have.
const NAMED_SIGMAS: f64 = 5.0;
/// The sigma of an angle of an encoder is as small as its last digit; what is less than this is no matter, in the state's unit.
const LEAST_SIGMA: f64 = 1e-5;

/// A leap of the sensor is its own where its biases have followed it by so much of it, within so long, ns; it was known after this, s.
const FOLLOWED: f64 = 0.5;
const FOLLOWS_WITHIN_NS: i64 = 2_000_000_000;
const LEAP_KNOWN_S: f64 = 0.02;
/// Less is none, m/s² and rad/s.
const LEAST_LEAP: [f64; 2] = [0.02, 2e-4];

/// By how much the sensor has leapt, and what its biases were, in b, m/s² and rad/s.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct SensorLeap {
    t_ns: i64,
    by_b: [Vector3<f64>; 2],
    biases_b: [Vector3<f64>; 2],
}

/// What an error that crept in has moved the place by: a station's is one of several, its angle is at the end of its range, and a
/// rotator's at the length of the platform's arm, m; antennas say little beside stations.
const OF_STATION: f64 = 0.5;
const OF_RANGE_M: f64 = 75.0;
const ROTATOR_M: f64 = 2.5;
const OF_LEG: f64 = 1.0;
const OF_ANTENNA: f64 = 0.1;

/// A state that may creep, of which device, and what is then said.
struct Hypothesis {
    state: usize,
    device: String,
    cause: fn(f64, f64) -> CabinCause,
    /// By how much it may have moved the place, m for each of its unit.
    reach_m: f64,
}

impl Body {
    /// The sensor's noise by its own samples.
    pub(super) fn noise_of_sensor(&mut self, t_ns: i64, source: &str, watch: &mut Watch) {
        let dt_s = self.period_ns() as f64 * 1e-9;
        let noise = &self.rig.noise;
        let stated = [noise.velocity_random_walk, noise.angle_random_walk];
        let Some(filter) = self.filter.as_mut().filter(|filter| filter.tuning.calibration) else { return };
        let Some([force, rate]) = self.sensor_watch.densities(dt_s) else { return };
        let counts = |found: f64, stated: f64| if found > MORE_NOISE * stated { found } else { 0.0 };
        filter.sampled_noise = [counts(rate, stated[1]), counts(force, stated[0])];
        if let Some(times) = self.sensor_watch.noisy(dt_s, stated) {
            watch.wrong(source, CabinCause::Noisy { times }, t_ns, 20);
        }
    }

    /// The sensor reads otherwise from a sample on: it may be its bias, or the cabin.
    pub(super) fn sensor_leapt(&mut self, t_ns: i64, leap_s: [Vector3<f64>; 2]) {
        let by_b = leap_s.map(|leap_s| self.rig.c_bs * leap_s);
        let Some(filter) = self.filter.as_mut().filter(|filter| filter.tuning.calibration) else { return };
        filter.propagate();
        let nav = filter.nav();
        let biases_b = [nav.accelerometer_bias_b, nav.gyro_bias_b];
        filter.sensor_leapt([&by_b[0], &by_b[1]], LEAP_KNOWN_S);
        self.sensor_leap = Some(SensorLeap { t_ns, by_b, biases_b });
    }

    /// Where the biases have followed a leap of the sensor, it was its own.
    fn leap_is_followed(&mut self, t_ns: i64, watch: &mut Watch) {
        let Some((filter, leap)) = self.filter.as_ref().zip(self.sensor_leap) else { return };
        let nav = filter.nav();
        let now = [nav.accelerometer_bias_b, nav.gyro_bias_b];
        let follows = (0..2).any(|k| {
            let is_part = leap.by_b[k].norm() > LEAST_LEAP[k];
            is_part && (now[k] - leap.biases_b[k]).dot(&leap.by_b[k]) > FOLLOWED * leap.by_b[k].norm_squared()
        });
        if follows {
            let source = if self.is_cabin { "imu" } else { "platform_imu" };
            let [force_m_s2, rate_rad_s] = leap.by_b.map(|by_b| by_b.norm());
            watch.wrong(source, CabinCause::BiasLeap { force_m_s2, rate_rad_s }, t_ns, 1);
        }
        if follows || t_ns - leap.t_ns > FOLLOWS_WITHIN_NS {
            self.sensor_leap = None;
        }
    }

    /// A row that was weighed just now.
    pub(super) fn note_innovation(&mut self, aid: usize, measured: &Measured, taken: bool) {
        let Some(filter) = &self.filter else { return };
        let (innovation, information) = &filter.weighed;
        let row = Innovation { jacobian: &measured.jacobian, innovation, information, taken };
        self.scores.note(aid, &row);
    }

    /// The end of an epoch: what the innovations say.
    pub(super) fn agreement(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        self.scores.pass(t_ns);
        if !self.aligned || self.filter.as_ref().is_none_or(|filter| !filter.tuning.calibration) {
            return;
        }
        self.leap_is_followed(t_ns, watch);
        // Where devices contradict each other nobody knows who is right: nobody's noise, and nobody's error, explains it.
        if self.doubt.is_there() {
            return;
        }
        self.scattering(t_ns, aids, watch);
        if t_ns - self.started_ns > SETTLED_NS {
            self.creeping(t_ns, aids, watch);
        }
    }

    /// Rows that scatter more than stated are believed less.
    fn scattering(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        let Some(filter) = &mut self.filter else { return };
        let is_due = t_ns >= self.noise_judged_ns.saturating_add(JUDGED_EVERY_NS);
        for (group, name, all) in [
            (0, "antennas", aids.antenna(0)..aids.station(0)),
            (1, "stations", aids.station(0)..aids.encoders()),
        ] {
            let factor = &mut filter.scatter[group];
            if is_due && let Some(mean) = self.scores.mean_square(all) {
                if mean > SCATTERS[1] && mean < CONTRADICTS {
                    *factor = (*factor * FACTOR_UP).min(MOST_FACTOR);
                } else if mean < SCATTERS[0] {
                    *factor = (*factor / FACTOR_DOWN).max(1.0);
                }
            }
            if *factor > TOLD_FACTOR {
                watch.wrong(name, CabinCause::Noisy { times: factor.sqrt() }, t_ns, 1);
            }
        }
        if is_due {
            self.noise_judged_ns = t_ns;
        }
    }

    /// Errors that creep where their own process does not bring them: what may be is then more.
    fn creeping(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        let all = self.hypotheses(aids);
        let Some(filter) = &mut self.filter else { return };
        let scored = |hypothesis: &Hypothesis| self.scores.of(hypothesis.state).0.abs();
        if let Some(best) = all.iter().max_by(|a, b| scored(a).total_cmp(&scored(b))) {
            let others = all.iter().filter(|other| other.device != best.device).map(scored);
            if scored(best) > CREEPS_SIGMAS && scored(best) > CLEARER * others.fold(0.0, f64::max) {
                let (_, off) = self.scores.of(best.state);
                let sigma = filter.states.process[best.state].variance.sqrt().max(LEAST_SIGMA);
                let opened = (2.0 * off.abs()).max(OPENED_SIGMAS * sigma);
                filter.open(best.state, opened);
                // What crept in has bent the place meanwhile.
                filter.unsettle(opened * best.reach_m);
                if let Some(leg) = best.state.checked_sub(filter.states.legs).filter(|leg| *leg < 6) {
                    filter.legs.free(leg);
                }
                self.scores.forget_state(best.state);
            }
        }
        for Hypothesis { state, device, cause, .. } in all {
            let sigma = filter.states.process[state].variance.sqrt().max(LEAST_SIGMA);
            let sigmas = filter.x[state].abs() / sigma.max(1e-12);
            if sigmas > NAMED_SIGMAS {
                watch.wrong(&device, cause(filter.x[state], sigmas), t_ns, 1);
            }
        }
    }

    fn hypotheses(&self, aids: &Aids) -> Vec<Hypothesis> {
        let Some(filter) = &self.filter else { return Vec::new() };
        let states = &filter.states;
        let mut all = Vec::new();
        let mut add = |state: usize, device: &str, cause: fn(f64, f64) -> CabinCause, reach_m: f64| {
            all.push(Hypothesis { state, device: device.to_owned(), cause, reach_m });
        };
        let late: fn(f64, f64) -> CabinCause =
            |late_s, sigmas| CabinCause::Late { late_s, sigma_s: late_s.abs() / sigmas.max(1.0) };
        let creeps: fn(f64, f64) -> CabinCause = |_, sigmas| CabinCause::Creeps { sigmas };
        for antenna in 0..self.rig.antennas.len() {
            for axis in 0..3 {
                add(states.antenna(antenna) + axis, aids.name(aids.antenna(antenna)), creeps, OF_ANTENNA);
            }
        }
        for (make, name) in self.rig.make_names.iter().enumerate() {
            for axis in 0..3 {
                add(states.make(make) + axis, name, |_, _| CabinCause::WrongMake, OF_ANTENNA);
            }
        }
        for station in 0..self.rig.stations_n.len() {
            let reach_m = [OF_RANGE_M, OF_RANGE_M, OF_STATION];
            for (part, reach_m) in reach_m.into_iter().enumerate() {
                add(states.station(station) + part, aids.name(aids.station(station)), creeps, reach_m);
            }
        }
        if self.rig.joints.is_some() {
            add(states.encoder_delay, "encoders", late, 0.0);
            for axis in 0..2 {
                let name = channel_name(axis);
                add(states.rotator + axis, &name, |off_rad, _| CabinCause::AngleOff { off_rad }, ROTATOR_M);
            }
            for leg in 0..6 {
                add(
                    states.legs + leg,
                    &super::weighing::leg_name(leg),
                    |off_m, _| CabinCause::LegOff { off_m },
                    OF_LEG,
                );
            }
        }
        all
    }
}
