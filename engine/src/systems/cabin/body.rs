//! A body on its way: its filter, and what is done at each epoch. How it starts, what its devices say and what comes out are files of
//! the folder.

mod agreement;
mod growth;
mod starting;
mod telling;
mod weighing;

pub(super) use weighing::{Between, Weighed};

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use self::agreement::SensorLeap;
use self::growth::Growth;
use super::aids::Aids;
use super::causes::CabinCause;
use super::doubt::Doubt;
use super::filter::Filter;
use super::gravity_alignment::GravityAlignment;
use super::leg_doubt::LegDoubt;
use super::rig::Rig;
use super::rows::{AidRow, ImuRow};
use super::scores::Scores;
use super::sensor_watch::{Sampled, SensorWatch};
use super::session::{CabinConfig, CabinError};
use super::start::Sighting;
use super::tape::Leaf;
use super::tuning::Tuning;
use super::watch::Watch;

/// Most that a correction moves a pose at once, m.
const STEP_M: f64 = 0.001;
/// A filter whose every row is refused for so long is lost, ns.
const LOST_AFTER_NS: i64 = 3_000_000_000;
/// Without a start after so long it is said why, ns.
const STARTS_WITHIN_NS: i64 = 5_000_000_000;
/// A sensor is stuck after so many samples that are the same.
const STUCK_AFTER: u32 = 20;
/// After so many periods without a sample the next has nothing to be compared with.
const HOLE_PERIODS: i64 = 4;
/// A pose that was lost so often before it had held for so long rests on a sensor that is not what the instrument says, ns.
const LOST_TIMES: u32 = 3;
const HELD_NS: i64 = 10_000_000_000;
/// The specific force of something that hangs or flies, m/s²; gyros of a cabin, rad/s.
const FORCES_M_S2: std::ops::Range<f64> = 4.0..20.0;
const FASTEST_RAD_S: f64 = 3.0;

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Body {
    rig: Rig,
    tuning: Tuning,
    config: CabinConfig,
    is_cabin: bool,
    filter: Option<Filter>,
    started_ns: i64,
    /// Where it was when the filter began, m.
    begun_n: Vector3<f64>,
    first_ns: Option<i64>,
    sightings: BTreeMap<usize, Sighting>,
    velocities: Vec<Vector3<f64>>,
    stated: Vec<[f64; 2]>,
    gravity: Option<GravityAlignment>,
    last_imu_ns: Option<i64>,
    /// The last readings, and how often they have come again.
    last_read: Option<([f64; 3], [f64; 3])>,
    same: u32,
    /// How often the pose was lost, and whether it has ever held for a while.
    lost: u32,
    has_held: bool,
    /// Rays that were taken since the start.
    rays: u32,
    periods: Vec<i64>,
    taken_ns: i64,
    refused: usize,
    /// How fast the sigmas of both poses grow.
    growths: [Growth; 2],
    last_seen: BTreeMap<usize, i64>,
    /// When each antenna last had a fix that could be weighed, ns.
    fixed_ns: BTreeMap<usize, i64>,
    /// How often each antenna and each station writes.
    between: BTreeMap<usize, Between>,
    /// Rows of the encoders that a pose has fitted, and others.
    seats: u32,
    unseated: u32,
    /// When antennas, stations and encoders came back, ns.
    back_ns: [Option<i64>; 3],
    /// By how much the poses told are still behind those of the filter, in n, m: the cabin's and the platform's.
    behind_n: [Vector3<f64>; 2],
    aligned: bool,
    /// Only of a session that smooths; such a one is never saved.
    #[serde(skip)]
    leaves: VecDeque<Leaf>,
    /// The last time at which its poses were wanted, ns: a spare that nobody asks for need not be smoothed.
    wanted_ns: i64,
    holds_platform: bool,
    misfit: Option<String>,
    doubt: Doubt,
    leg_doubt: LegDoubt,
    /// What the samples say of the sensor, and the innovations of everything.
    sensor_watch: SensorWatch,
    scores: Scores,
    sensor_leap: Option<SensorLeap>,
    noise_judged_ns: i64,
    /// The rows of the last epoch that were weighed.
    weighed: Vec<Weighed>,
}

impl Body {
    pub(super) fn new(rig: Rig, tuning: Tuning, config: &CabinConfig, is_cabin: bool) -> Body {
        Body {
            rig,
            tuning,
            config: config.clone(),
            is_cabin,
            filter: None,
            started_ns: 0,
            begun_n: Vector3::zeros(),
            first_ns: None,
            sightings: BTreeMap::new(),
            velocities: Vec::new(),
            stated: Vec::new(),
            gravity: Some(GravityAlignment::default()),
            last_imu_ns: None,
            last_read: None,
            same: 0,
            lost: 0,
            has_held: false,
            rays: 0,
            periods: Vec::new(),
            taken_ns: 0,
            refused: 0,
            growths: [Growth::default(); 2],
            last_seen: BTreeMap::new(),
            fixed_ns: BTreeMap::new(),
            between: BTreeMap::new(),
            seats: 0,
            unseated: 0,
            back_ns: [None; 3],
            behind_n: [Vector3::zeros(); 2],
            aligned: false,
            leaves: VecDeque::new(),
            wanted_ns: if is_cabin { i64::MAX } else { i64::MIN },
            holds_platform: true,
            misfit: None,
            doubt: Doubt::default(),
            leg_doubt: LegDoubt::default(),
            sensor_watch: SensorWatch::default(),
            scores: Scores::default(),
            sensor_leap: None,
            noise_judged_ns: i64::MIN,
            weighed: Vec::new(),
        }
    }

    /// Takes away what became of the rows of the last epoch.
    pub(super) fn weighed(&mut self) -> Vec<Weighed> {
        std::mem::take(&mut self.weighed)
    }

    pub(super) fn has_started(&self) -> bool {
        self.filter.is_some() || self.started_ns > 0
    }

    pub(super) fn why_not_started(&self) -> String {
        self.misfit.clone().unwrap_or_else(|| {
            "expected fixes of three antennas at once (quality 4, sigmas below 1 m) and samples of the inertial sensor, or rays to three prisms, found none: without them there is no position to start from; check the files' times, qualities and units".to_owned()
        })
    }

    /// Readings of the body's inertial sensor.
    pub(super) fn imu(&mut self, row: &ImuRow, aids: &mut Aids, watch: &mut Watch, source: &str) {
        let (w_s, f_s) = (Vector3::from(row.w_s), Vector3::from(row.f_s));
        let force = f_s.norm();
        // Written so that a NaN is refused.
        if !(FORCES_M_S2.contains(&force) && w_s.norm() < FASTEST_RAD_S) {
            let cause = CabinCause::OutOfRange { force_m_s2: force, rate_rad_s: w_s.norm() };
            watch.wrong(source, cause, row.t_ns, 1);
            return;
        }
        // No two samples of a sensor that works are the same in all of six numbers.
        let read = (row.w_s, row.f_s);
        self.same = if self.last_read == Some(read) { self.same + 1 } else { 0 };
        self.last_read = Some(read);
        if self.same >= STUCK_AFTER {
            watch.wrong(source, CabinCause::Stuck, row.t_ns, 1);
            return;
        }
        let before_ns = self.last_imu_ns.replace(row.t_ns);
        let dt_ns = before_ns.map_or(0, |before_ns| row.t_ns - before_ns);
        if before_ns.is_some() && dt_ns <= 0 {
            watch.wrong(source, CabinCause::TimeRepeats, row.t_ns, 1);
            return;
        }
        if self.periods.len() < 25 && dt_ns > 0 {
            self.periods.push(dt_ns);
        }
        let period_ns = self.period_ns();
        if dt_ns > HOLE_PERIODS * period_ns {
            self.sensor_watch.begin_anew();
        }
        match self.sensor_watch.take(&f_s, &w_s) {
            Sampled::Good => {}
            Sampled::Leap(leap) => self.sensor_leapt(row.t_ns, leap),
            Sampled::Spike => {
                let cause = CabinCause::OutOfRange { force_m_s2: force, rate_rad_s: w_s.norm() };
                watch.wrong(source, cause, row.t_ns, 1);
                return;
            }
            Sampled::StuckAxis => {
                watch.wrong(source, CabinCause::Stuck, row.t_ns, 1);
                return;
            }
        }
        self.noise_of_sensor(row.t_ns, source, watch);
        let sensor = if self.is_cabin { Some(Aids::IMU) } else { aids.platform_imu() };
        if let Some(sensor) = sensor {
            aids.took(sensor, row.t_ns);
        }
        if let Some(gravity) = &mut self.gravity
            && dt_ns > 0
        {
            gravity.push(dt_ns as f64 * 1e-9, &(self.rig.c_bs * w_s), &(self.rig.c_bs * f_s));
        }
        if let Some(filter) = &mut self.filter {
            filter.set_period(period_ns);
            if let Some(silent_s) = filter.advance(row)
                && silent_s > 0.1
            {
                let since_ns = row.t_ns - (silent_s * 1e9) as i64;
                watch.wrong_since(source, CabinCause::SensorSilent { silent_s }, since_ns, row.t_ns, 1);
            }
        }
    }

    fn period_ns(&self) -> i64 {
        let mut periods = self.periods.clone();
        periods.sort_unstable();
        periods.get(periods.len() / 2).copied().unwrap_or(5_000_000).clamp(500_000, 50_000_000)
    }

    /// What has been written since the last epoch.
    pub(super) fn epoch(
        &mut self,
        t_ns: i64,
        rows: &[AidRow],
        aids: &mut Aids,
        watch: &mut Watch,
    ) -> Result<(), CabinError> {
        self.weighed.clear();
        self.first_ns.get_or_insert(t_ns);
        if self.filter.is_none() {
            self.gather(t_ns, rows, aids, watch);
            let waited_ns = t_ns - self.first_ns.unwrap_or(t_ns);
            if self.is_cabin && self.filter.is_none() && waited_ns > STARTS_WITHIN_NS {
                watch.wrong("antennas", CabinCause::NoStart { why: self.why_not_started() }, t_ns, 1);
            }
            return Ok(());
        }
        let period_ns = self.period_ns();
        let Some(filter) = &mut self.filter else { return Ok(()) };
        if t_ns - filter.t_ns > 3 * period_ns {
            filter.coast(t_ns);
        }
        filter.propagate();
        let joined = self.config.platform && filter.rig.joints.is_some();
        let before = self.places(t_ns, joined);
        if self.filter.as_mut().is_some_and(Filter::put_legs_right) {
            // What contradicted the pose did so because of the leg.
            self.doubt = Doubt::default();
            self.leg_doubt = LegDoubt::default();
            self.refused = 0;
            self.spread(before, self.places(t_ns, joined));
        }
        let before = self.places(t_ns, joined);
        let mut leapt = false;
        let has_readings = rows.iter().any(|row| matches!(row, AidRow::Encoders(_)));
        for row in rows.iter().filter(|row| matches!(row, AidRow::Encoders(_))) {
            let AidRow::Encoders(row) = row else { continue };
            leapt |= self.encoders(row, aids, watch)?;
        }
        // Encoders that write seldom say where the platform has gone meanwhile.
        if leapt || has_readings {
            self.spread(before, self.places(t_ns, joined));
        }
        let before = self.places(t_ns, joined);
        let (mut taken, mut refused) = (0, 0);
        for row in rows {
            match row {
                AidRow::Encoders(_) => {}
                AidRow::Antenna(row) => count(self.antenna(row, aids, watch), &mut taken, &mut refused),
                AidRow::Ray(row) => count(self.ray(row, aids, watch), &mut taken, &mut refused),
            }
        }
        let Some(filter) = &mut self.filter else { return Ok(()) };
        if self.aligned
            && let Some((leg, off_m)) = filter.free_improbable_leg()
        {
            watch.wrong(&weighing::leg_name(leg), CabinCause::LegOff { off_m }, t_ns, 1);
        }
        filter.correct();
        self.spread(before, self.places(t_ns, joined));
        let Some(filter) = &mut self.filter else { return Ok(()) };
        if taken > 0 {
            self.taken_ns = t_ns;
            self.refused = 0;
        }
        self.refused += refused;
        let lost = self.refused > 30 && t_ns - self.taken_ns > LOST_AFTER_NS;
        if lost || !filter.is_finite() {
            let source = if self.is_cabin { "imu" } else { "platform_imu" };
            watch.wrong(source, CabinCause::Lost, t_ns, 1);
            self.has_held |= t_ns - self.started_ns > HELD_NS;
            self.lost += 1;
            if self.lost >= LOST_TIMES && !self.has_held {
                return Err(CabinError(format!(
                    "expected an inertial sensor ({source}) that agrees with antennas and prisms, found one that they contradicted {LOST_TIMES} times, each time within {} s: check its axes (c_b_s), its units (rad/s, m/s²) and its clock",
                    HELD_NS / 1_000_000_000
                )));
            }
            self.begin_anew();
            return Ok(());
        }
        self.contradictions(t_ns, aids, watch);
        self.agreement(t_ns, aids, watch);
        self.wrong_legs(t_ns, watch);
        self.silences(t_ns, aids, watch);
        if self.rig.has_imu {
            self.late(t_ns, watch);
        }
        self.check_mounting(watch)?;
        Ok(())
    }

    /// Where the filter has the body and the platform.
    fn places(&self, t_ns: i64, joined: bool) -> [Option<Vector3<f64>>; 2] {
        let Some(filter) = &self.filter else { return [None; 2] };
        [
            filter.body(t_ns).map(|pose| pose.place()),
            if joined { filter.platform(t_ns).map(|pose| pose.place()) } else { None },
        ]
    }

    /// A control loop must not be shaken: what a correction moves beyond `STEP_M` comes bit by bit, a step an epoch.
    fn spread(&mut self, before: [Option<Vector3<f64>>; 2], after: [Option<Vector3<f64>>; 2]) {
        for (behind, (before, after)) in self.behind_n.iter_mut().zip(before.iter().zip(after)) {
            let Some((before, after)) = before.zip(after) else { continue };
            let due = *behind + before - after;
            let length = due.norm();
            // One that is lost anyway is told where it is.
            *behind = if length <= STEP_M || length > 0.2 || !self.aligned {
                Vector3::zeros()
            } else {
                due * (1.0 - STEP_M / length)
            };
        }
    }

    fn begin_anew(&mut self) {
        self.behind_n = [Vector3::zeros(); 2];
        self.scores.forget();
        self.doubt = Doubt::default();
        self.leg_doubt = LegDoubt::default();
        self.filter = None;
        self.rays = 0;
        self.sightings.clear();
        self.velocities.clear();
        self.refused = 0;
        self.aligned = false;
        self.growths = [Growth::default(); 2];
    }
}

fn count(taken: Option<bool>, yes: &mut usize, no: &mut usize) {
    match taken {
        Some(true) => *yes += 1,
        Some(false) => *no += 1,
        None => {}
    }
}
