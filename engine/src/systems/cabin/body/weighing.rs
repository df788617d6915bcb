//! What the devices say at an epoch, each row weighed at its own moment, and which of them are late or silent.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::Body;
use crate::systems::cabin::aids::Aids;
use crate::systems::cabin::causes::{CabinCause, RayTrouble};
use crate::systems::cabin::encoder_watch::channel_name;
use crate::systems::cabin::filter::{Filter, Measured};
use crate::systems::cabin::legs::Seated;
use crate::systems::cabin::rig::Target;
use crate::systems::cabin::rows::{AidRow, AntennaRow, EncoderRow, RayRow};
use crate::systems::cabin::session::CabinError;
use crate::systems::cabin::watch::Watch;

/// An antenna has a fix while the last is not older, ns.
const THERE_NS: i64 = 1_000_000_000;
/// An inertial sensor is silent after so long, ns.
const SENSOR_SILENT_NS: i64 = 250_000_000;
/// A group of devices is silent after so many times the usual time between two rows of its quickest, and after this long at least, ns.
const USUAL_TIMES: i64 = 4;
/// How often a device writes is known after so many of its rows.
const KNOWN_AFTER: u32 = 3;
/// Beyond this, a time between two rows is an outage and nothing usual, ns.
const LONGEST_BETWEEN_NS: i64 = 5_000_000_000;
const STATIONS_SILENT_NS: i64 = 500_000_000;
const ANTENNAS_SILENT_NS: i64 = 300_000_000;
/// The encoders, after so many times the usual time between two readings and after this long at least, ns.
const USUAL_READINGS: i64 = 5;
const ENCODERS_SILENT_NS: i64 = 300_000_000;

/// The rays find a leg that is off by so many of the maker's sigmas, or more.
const LEAST_SIGMAS: f64 = 4.0;

/// What became of a row, by the last epoch.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(in crate::systems::cabin) struct Weighed {
    pub(in crate::systems::cabin) aid: usize,
    pub(in crate::systems::cabin) t_ns: i64,
    pub(in crate::systems::cabin) nis: f64,
    pub(in crate::systems::cabin) taken: bool,
}

/// How often a device writes.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(in crate::systems::cabin) struct Between {
    /// Times between two rows that were seen.
    rows: u32,
    /// Their running mean, ns.
    usual_ns: i64,
}

impl Body {
    /// Whether a row waits for a reading of the encoders (`Filter::waits_for_reading`).
    pub(in crate::systems::cabin) fn waits_for_reading(
        &self,
        row: &AidRow,
        t_ns: i64,
        reading_ns: Option<i64>,
    ) -> bool {
        let AidRow::Ray(ray) = row else { return false };
        self.filter.as_ref().is_some_and(|filter| filter.waits_for_reading(ray, t_ns, reading_ns))
    }

    /// Readings of the encoders; whether a leg has leapt.
    pub(super) fn encoders(
        &mut self,
        row: &EncoderRow,
        aids: &mut Aids,
        watch: &mut Watch,
    ) -> Result<bool, CabinError> {
        let Some(filter) = &mut self.filter else { return Ok(false) };
        if filter.rig.joints.is_none() {
            return Ok(false);
        }
        self.last_seen.insert(aids.encoders(), row.t_ns);
        let seated = filter.encoders(row);
        if let Seated::Leapt { leg, by_m } = seated {
            watch.wrong(&leg_name(leg), CabinCause::LegOff { off_m: by_m }, row.t_ns, 2);
        } else if let Seated::Turned { axis, by_rad } = seated {
            watch.wrong(&channel_name(axis), CabinCause::AngleOff { off_rad: by_rad }, row.t_ns, 1);
        } else if let Seated::Stuck { channels } = &seated {
            let all = channels.len() == 8;
            let name = channels.first().filter(|_| !all).map_or("encoders".to_owned(), |k| channel_name(*k));
            watch.wrong(&name, CabinCause::Stuck, row.t_ns, 1);
        } else if seated == Seated::Taken {
            aids.took(aids.encoders(), row.t_ns);
            self.seats += 1;
        } else {
            self.unseated += 1;
            if self.seats == 0 && self.unseated >= 20 {
                return Err(CabinError(format!(
                    "expected legs that a pose of the platform fits, found none in the encoders' first rows (a {} rad, b {} rad, legs {:?} m at {:.3} s): check the unit of each leg, and joint_r, joint_p and rest_r",
                    row.a_rad,
                    row.b_rad,
                    row.legs_m,
                    row.t_ns as f64 * 1e-9
                )));
            }
            let cause = CabinCause::NoPose { angles_rad: [row.a_rad, row.b_rad], legs_m: row.legs_m };
            watch.wrong("encoders", cause, row.t_ns, 2);
        }
        Ok(matches!(seated, Seated::Leapt { .. } | Seated::Turned { .. }))
    }

    pub(super) fn antenna(&mut self, row: &AntennaRow, aids: &mut Aids, watch: &mut Watch) -> Option<bool> {
        let aid = aids.antenna(row.antenna);
        self.note_row(row.t_ns, aid);
        self.last_seen.insert(aid, row.t_ns);
        let filter = self.filter.as_mut()?;
        if !believable(row) {
            return None;
        }
        // The paper has three antennas; those of the other make are its spare.
        if !filter.tuning.calibration && self.rig.antennas[row.antenna].make != self.rig.antennas[0].make {
            return None;
        }
        let measured = filter.measure_antenna(row)?;
        self.fixed_ns.insert(row.antenna, row.t_ns);
        let taken = filter.weigh(&measured, filter.tuning.gate);
        self.weighed.push(Weighed { aid, t_ns: row.t_ns, nis: filter.nis, taken });
        self.doubt.note(aid, taken, measured.innovation.norm());
        self.note_innovation(aid, &measured, taken);
        if taken {
            aids.took(aid, row.t_ns);
        } else {
            let cause = CabinCause::WrongFix { off_n_m: measured.innovation.into() };
            watch.wrong(aids.name(aid), cause, row.t_ns, 3);
            self.whole_make(row, aids, watch);
        }
        Some(taken)
    }

    pub(super) fn whole_make(&self, row: &AntennaRow, aids: &Aids, watch: &mut Watch) {
        let make = self.rig.antennas[row.antenna].make;
        // One whose fix is float, or that is silent, says nothing of the others.
        let is_there = |k: usize| self.fixed_ns.get(&k).is_some_and(|last_ns| row.t_ns - last_ns < THERE_NS);
        let of_make: Vec<usize> = (0..self.rig.antennas.len())
            .filter(|k| self.rig.antennas[*k].make == make && is_there(*k))
            .collect();
        if of_make.len() > 1
            && of_make.iter().all(|k| watch.is_open(aids.name(aids.antenna(*k)), "wrong_fix"))
        {
            watch.wrong(&self.rig.make_names[make], CabinCause::WrongMake, row.t_ns, 1);
        }
    }

    pub(super) fn ray(&mut self, row: &RayRow, aids: &mut Aids, watch: &mut Watch) -> Option<bool> {
        if matches!(self.rig.targets.get(row.target), None | Some(Target::Elsewhere)) {
            return None;
        }
        let aid = aids.station(row.station);
        self.note_row(row.t_ns, aid);
        let filter = self.filter.as_mut()?;
        self.last_seen.insert(aid, row.t_ns);
        let measured = filter.measure_ray(row)?;
        let taken = filter.weigh(&measured, filter.tuning.gate);
        self.weighed.push(Weighed { aid, t_ns: row.t_ns, nis: filter.nis, taken });
        self.doubt.note(aid, taken, off_m(&measured, row.slant_m));
        self.note_innovation(aid, &measured, taken);
        let filter = self.filter.as_mut()?;
        if let Some(columns) = leg_columns(&measured, filter.states.legs) {
            let (innovation, information) = &filter.weighed;
            self.leg_doubt.note(row.station, taken, &columns, innovation, information);
        }
        if taken {
            self.rays = self.rays.saturating_add(1);
            aids.took(aid, row.t_ns);
            return Some(true);
        }
        let off = measured.innovation;
        let cause = CabinCause::WrongRay {
            looks_like: wrong_ray(&measured, row.slant_m),
            distance_m: off.z,
            angles_arcsec: [off.x, off.y].map(|off_rad| off_rad.to_degrees() * 3600.0),
        };
        watch.wrong(aids.name(aid), cause, row.t_ns, 2);
        Some(false)
    }

    /// Devices that contradict the pose together: nobody knows who is right.
    pub(super) fn contradictions(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        let makes: Vec<usize> = self.rig.antennas.iter().map(|antenna| antenna.make).collect();
        // The paper's filter knows no doubt.
        if self.filter.as_ref().is_none_or(|filter| !filter.tuning.calibration) {
            return;
        }
        if let Some(found) = self.doubt.pass(t_ns, aids, &makes) {
            let group = if found.stations { "stations" } else { "antennas" };
            let cause = CabinCause::Contradiction { devices: found.devices as u64, off_m: found.off_m };
            watch.wrong(group, cause, t_ns, 4);
        }
    }

    /// Legs that read wrongly, by their own leaps or by the rays to the platform.
    pub(super) fn wrong_legs(&mut self, t_ns: i64, watch: &mut Watch) {
        let Some(filter) = &mut self.filter else { return };
        if let Some((leg, off_m)) = self.leg_doubt.pass(t_ns, LEAST_SIGMAS * filter.rig.leg_sigma_m) {
            filter.legs.found(leg, off_m, 0.003 + 0.15 * off_m.abs());
            watch.wrong(&leg_name(leg), CabinCause::LegOff { off_m }, t_ns, 1);
        }
        for (leg, off_m) in self.filter.iter().flat_map(Filter::wrong_legs) {
            watch.wrong(&leg_name(leg), CabinCause::LegOff { off_m }, t_ns, 1);
        }
        for (axis, off_rad) in self.filter.iter().flat_map(Filter::wrong_angles) {
            watch.wrong(&channel_name(axis), CabinCause::AngleOff { off_rad }, t_ns, 1);
        }
    }

    /// Makes, or stations, whose rows are later or earlier than stated by more than the stated sigma allows.
    pub(super) fn late(&self, t_ns: i64, watch: &mut Watch) {
        let Some(filter) = self.filter.as_ref().filter(|filter| filter.tuning.calibration) else { return };
        let makes = self.rig.make_names.iter().enumerate().map(|(make, name)| {
            (name.as_str(), filter.states.make_delays + make, self.rig.make_delay_sigma_s)
        });
        let stations = ("stations", filter.states.station_delay, self.rig.station.delay_sigma_s);
        let encoders = ("encoders", filter.states.encoder_delay, self.rig.encoder_delay_sigma_s);
        for (name, state, stated_s) in makes.chain([stations, encoders]) {
            let (late_s, sigma_s) = (filter.x[state], filter.covariance.row(state)[state].max(0.0).sqrt());
            if late_s.abs() > 4.0 * stated_s && late_s.abs() > 5.0 * sigma_s {
                watch.wrong(name, CabinCause::Late { late_s, sigma_s }, t_ns, 1);
            }
        }
    }

    /// Keeps the usual time between two rows of a device: each has its own rate, and several may write at the same moments.
    fn note_row(&mut self, t_ns: i64, aid: usize) {
        let Some(last_ns) = self.last_seen.get(&aid) else { return };
        let between_ns = t_ns - last_ns;
        if !(1..=LONGEST_BETWEEN_NS).contains(&between_ns) {
            return;
        }
        let usual = self.between.entry(aid).or_insert(Between { rows: 0, usual_ns: between_ns });
        usual.rows = usual.rows.saturating_add(1);
        // The first few count alike, later ones as long as thirty-two.
        usual.usual_ns += (between_ns - usual.usual_ns) / i64::from(usual.rows.min(32));
    }

    /// Devices that have gone silent.
    pub(super) fn silences(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        if let Some(last_ns) = self.last_imu_ns.filter(|last_ns| t_ns - last_ns > SENSOR_SILENT_NS) {
            let cause = CabinCause::SensorSilent { silent_s: (t_ns - last_ns) as f64 * 1e-9 };
            watch.wrong_since(if self.is_cabin { "imu" } else { "platform_imu" }, cause, last_ns, t_ns, 1);
        }
        let silent_ns = |all: std::ops::Range<usize>, least_ns: i64| {
            let known =
                all.filter_map(|aid| self.between.get(&aid)).filter(|usual| usual.rows >= KNOWN_AFTER);
            // Until a rate is known, any pause may be usual.
            let usual_ns = known.map(|usual| usual.usual_ns).min().unwrap_or(LONGEST_BETWEEN_NS);
            (USUAL_TIMES * usual_ns).clamp(least_ns, 2_000_000_000.max(3 * usual_ns))
        };
        let antennas_silent_ns = silent_ns(aids.antenna(0)..aids.station(0), ANTENNAS_SILENT_NS);
        let stations_silent_ns = silent_ns(aids.station(0)..aids.encoders(), STATIONS_SILENT_NS);
        let readings_ns = self.filter.as_ref().map_or(0, Filter::between_readings_ns);
        let encoders_silent_ns = ENCODERS_SILENT_NS.max(USUAL_READINGS * readings_ns);
        let antennas: Vec<usize> = (0..self.rig.antennas.len()).map(|k| aids.antenna(k)).collect();
        let stations: Vec<usize> = (0..self.rig.stations_n.len()).map(|k| aids.station(k)).collect();
        for (kind, (group, all, limit_ns, single_ns)) in [
            ("antennas", antennas, antennas_silent_ns, 1_000_000_000.max(2 * antennas_silent_ns)),
            ("stations", stations, stations_silent_ns, 15_000_000_000),
            ("encoders", vec![aids.encoders()], i64::MAX, encoders_silent_ns),
        ]
        .into_iter()
        .enumerate()
        {
            let seen: Vec<(usize, i64)> =
                all.iter().filter_map(|aid| self.last_seen.get(aid).map(|last| (*aid, *last))).collect();
            let Some(latest) = seen.iter().map(|(_, last)| *last).max() else { continue };
            if limit_ns < i64::MAX && t_ns - latest > limit_ns {
                watch.wrong_since(group, CabinCause::AllSilent, latest, t_ns, 1);
                self.back_ns[kind] = Some(t_ns);
                continue;
            }
            // After fog each has to find its prism again.
            let back_ns = self.back_ns[kind].unwrap_or(i64::MIN / 2);
            for (aid, last) in seen {
                if t_ns - last.max(back_ns) > single_ns {
                    watch.wrong_since(aids.name(aid), CabinCause::Silent, last, t_ns, 1);
                }
            }
        }
    }
}

/// A fix with numbers that a fix may have; float ones are centimetres to decimetres off for minutes.
pub(super) fn believable(row: &AntennaRow) -> bool {
    row.quality == 4
        && row.position_n.iter().all(|x| x.is_finite())
        && row.sigma_n.iter().all(|sigma| *sigma > 0.0 && *sigma < 1.0)
}

/// How far a ray passes its prism across, m.
fn across_m(measured: &Measured, slant_m: f64) -> f64 {
    libm::hypot(measured.innovation.x * 0.5, measured.innovation.y) * slant_m
}

/// A leg as the encoders' column has it.
pub(super) fn leg_name(leg: usize) -> String {
    format!("leg_{}", leg + 1)
}

/// How a ray changes with each leg; `None` for one that looks at the cabin.
fn leg_columns(measured: &Measured, legs: usize) -> Option<[Vector3<f64>; 6]> {
    let mut columns = [Vector3::zeros(); 6];
    let mut found = false;
    for (state, column) in measured.jacobian.iter().filter(|(state, _)| (legs..legs + 6).contains(state)) {
        columns[state - legs] = Vector3::from(*column);
        found = true;
    }
    found.then_some(columns)
}

/// How far off a ray is, m.
fn off_m(measured: &Measured, slant_m: f64) -> f64 {
    libm::hypot(across_m(measured, slant_m), measured.innovation.z)
}

/// Which kind of trouble a refused ray shows.
fn wrong_ray(measured: &Measured, slant_m: f64) -> RayTrouble {
    let off = measured.innovation;
    let across_m = across_m(measured, slant_m);
    if across_m > 0.3 || off.z.abs() > 0.5 {
        RayTrouble::Prism
    } else if off.z.abs() > across_m {
        RayTrouble::Distance
    } else {
        RayTrouble::Direction
    }
}

/// The direction of a ray in n.
pub(super) fn along(row: &RayRow) -> Vector3<f64> {
    let (sin_azimuth, cos_azimuth) = libm::sincos(row.azimuth_rad);
    let (sin_zenith, cos_zenith) = libm::sincos(row.zenith_rad);
    Vector3::new(sin_azimuth * sin_zenith, cos_azimuth * sin_zenith, cos_zenith)
}

#[cfg(test)]
#[path = "weighing_tests.rs"]
mod tests;
