//! A body on its way: how its filter starts, what its devices say at each epoch, and the poses that come out.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector3;

use super::aids::Aids;
use super::filter::{Filter, Measured, Start};
use super::gravity_alignment::GravityAlignment;
use super::output::{Row, Status};
use super::rig::{Rig, Target};
use super::rows::{AidRow, AntennaRow, EncoderRow, ImuRow, RayRow};
use super::session::{CabinConfig, CabinError};
use super::start::{self, Sighting};
use super::tape::{Future, Leaf, Posed};
use super::tuning::Tuning;
use super::watch::Watch;

/// First sightings are gathered for so long, ns.
const GATHER_NS: i64 = 600_000_000;
/// Sightings of so long count as one moment, ns.
const ONE_MOMENT_NS: i64 = 400_000_000;
/// Epochs of which a smoother gives poses at once, and those that it looks ahead.
const SMOOTHED_EPOCHS: usize = 4800;
const AHEAD_EPOCHS: usize = 3200;
/// Most that a correction moves a pose at once, m.
const STEP_M: f64 = 0.001;
/// A filter whose every row is refused for so long is lost, ns.
const LOST_AFTER_NS: i64 = 3_000_000_000;
/// An attitude this sure is found: yaw and level, rad.
const ALIGNED_RAD: [f64; 2] = [1.2e-3, 4e-4];
/// The specific force of something that hangs or flies, m/s²; gyros of a cabin, rad/s.
const FORCES_M_S2: std::ops::Range<f64> = 4.0..20.0;
const FASTEST_RAD_S: f64 = 3.0;
/// Budgets of position, m: the cabin's and the platform's.
const BUDGETS_M: [f64; 2] = [0.015, 0.003];
/// An inertial sensor's axes are wrong where gravity says the level or the yaw otherwise by more, rad: told, and refused. On a
/// cabin that swings half a minute of gravity leaves ten degrees of yaw.
const MISMOUNTED_RAD: [f64; 2] = [0.02, 0.6];
const REFUSED_RAD: [f64; 2] = [0.06, 0.9];
/// Yaw is compared on a body that has stayed within so much, m.
const STAYED_M: f64 = 0.3;
const CHECKED_AFTER_S: f64 = 30.0;

#[derive(Debug)]
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
    periods: Vec<i64>,
    taken_ns: i64,
    refused: usize,
    sigma_before: Option<[(i64, f64); 2]>,
    last_seen: BTreeMap<usize, i64>,
    /// Rows of the encoders that a pose has fitted, and others.
    seats: u32,
    unseated: u32,
    back_ns: BTreeMap<&'static str, i64>,
    /// By how much the poses told are still behind those of the filter, in n, m: the cabin's and the platform's.
    behind_n: [Vector3<f64>; 2],
    aligned: bool,
    leaves: VecDeque<Leaf>,
    /// The last time at which its poses were wanted, ns: a spare that nobody asks for need not be smoothed.
    wanted_ns: i64,
    holds_platform: bool,
    misfit: Option<String>,
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
            periods: Vec::new(),
            taken_ns: 0,
            refused: 0,
            sigma_before: None,
            last_seen: BTreeMap::new(),
            seats: 0,
            unseated: 0,
            back_ns: BTreeMap::new(),
            behind_n: [Vector3::zeros(); 2],
            aligned: false,
            leaves: VecDeque::new(),
            wanted_ns: if is_cabin { i64::MAX } else { i64::MIN },
            holds_platform: true,
            misfit: None,
        }
    }

    pub(super) fn has_started(&self) -> bool {
        self.filter.is_some() || self.started_ns > 0
    }

    pub(super) fn why_not_started(&self) -> String {
        self.misfit.clone().unwrap_or_else(|| {
            "expected fixes of three antennas at once, or rays to three prisms, found none: without them there is no position to start from; check the files' times".to_owned()
        })
    }

    /// Readings of the body's inertial sensor.
    pub(super) fn imu(&mut self, row: &ImuRow, aids: &mut Aids, watch: &mut Watch, source: &str) {
        let (w_s, f_s) = (Vector3::from(row.w_s), Vector3::from(row.f_s));
        let force = f_s.norm();
        // Written so that a NaN is refused.
        if !(FORCES_M_S2.contains(&force) && w_s.norm() < FASTEST_RAD_S) {
            watch.wrong(source, "out_of_range", row.t_ns, 1, || {
                format!("expected readings of a cabin, found {force:.3} m/s² and {:.3} rad/s; the sample was left out", w_s.norm())
            });
            return;
        }
        let before_ns = self.last_imu_ns.replace(row.t_ns);
        let dt_ns = before_ns.map_or(0, |before_ns| row.t_ns - before_ns);
        if before_ns.is_some() && dt_ns <= 0 {
            watch.wrong(source, "time_repeats", row.t_ns, 1, || {
                "expected later samples, found one at the same time; it was left out".to_owned()
            });
            return;
        }
        if self.periods.len() < 25 && dt_ns > 0 {
            self.periods.push(dt_ns);
        }
        let period_ns = self.period_ns();
        if self.is_cabin {
            aids.took(Aids::IMU, row.t_ns);
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
                watch.wrong_since(source, "silent", since_ns, row.t_ns, 1, || {
                    format!("no samples for {silent_s:.2} s; its biases are taken to be others")
                });
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
        self.first_ns.get_or_insert(t_ns);
        if self.filter.is_none() {
            self.gather(t_ns, rows, aids, watch);
            return Ok(());
        }
        let period_ns = self.period_ns();
        let Some(filter) = &mut self.filter else { return Ok(()) };
        if t_ns - filter.t_ns > 3 * period_ns {
            filter.coast(t_ns);
        }
        filter.propagate();
        let joined = self.config.platform && filter.rig.joints.is_some();
        for row in rows.iter().filter(|row| matches!(row, AidRow::Encoders(_))) {
            let AidRow::Encoders(row) = row else { continue };
            self.encoders(row, aids, watch)?;
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
            watch.wrong(if self.is_cabin { "imu" } else { "platform_imu" }, "lost", t_ns, 1, || {
                "nothing agreed with the pose for three seconds; it was found anew".to_owned()
            });
            self.begin_anew();
            return Ok(());
        }
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
        self.filter = None;
        self.sightings.clear();
        self.velocities.clear();
        self.refused = 0;
        self.aligned = false;
        self.sigma_before = None;
    }

    fn encoders(&mut self, row: &EncoderRow, aids: &mut Aids, watch: &mut Watch) -> Result<(), CabinError> {
        let Some(filter) = &mut self.filter else { return Ok(()) };
        if filter.rig.joints.is_none() {
            return Ok(());
        }
        self.last_seen.insert(aids.encoders(), row.t_ns);
        if filter.encoders(row) {
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
            watch.wrong("encoders", "no_pose", row.t_ns, 2, || {
                format!(
                    "no pose of the platform fits a {} rad, b {} rad and legs {:?} m",
                    row.a_rad, row.b_rad, row.legs_m
                )
            });
        }
        Ok(())
    }

    fn antenna(&mut self, row: &AntennaRow, aids: &mut Aids, watch: &mut Watch) -> Option<bool> {
        let filter = self.filter.as_mut()?;
        let aid = aids.antenna(row.antenna);
        self.last_seen.insert(aid, row.t_ns);
        if !believable(row) {
            return None;
        }
        // The paper has three antennas; those of the other make are its spare.
        if !filter.tuning.calibration && self.rig.antennas[row.antenna].make != self.rig.antennas[0].make {
            return None;
        }
        let measured = filter.measure_antenna(row)?;
        let taken = filter.weigh(&measured, filter.tuning.gate);
        if taken {
            aids.took(aid, row.t_ns);
        } else {
            let off = measured.innovation;
            watch.wrong(aids.name(aid), "wrong_fix", row.t_ns, 3, || {
                format!(
                    "told as fixed, it is {:.0} mm off ({:.0} {:.0} {:.0})",
                    1e3 * off.norm(),
                    1e3 * off.x,
                    1e3 * off.y,
                    1e3 * off.z
                )
            });
            self.whole_make(row, aids, watch);
        }
        Some(taken)
    }

    fn whole_make(&self, row: &AntennaRow, aids: &Aids, watch: &mut Watch) {
        let make = self.rig.antennas[row.antenna].make;
        let of_make: Vec<usize> =
            (0..self.rig.antennas.len()).filter(|k| self.rig.antennas[*k].make == make).collect();
        if of_make.len() > 1
            && of_make.iter().all(|k| watch.is_open(aids.name(aids.antenna(*k)), "wrong_fix"))
        {
            watch.wrong(&self.rig.make_names[make], "wrong_make", row.t_ns, 1, || {
                "all antennas of the make are off at once: its base station".to_owned()
            });
        }
    }

    fn ray(&mut self, row: &RayRow, aids: &mut Aids, watch: &mut Watch) -> Option<bool> {
        let filter = self.filter.as_mut()?;
        if matches!(filter.rig.targets.get(row.target), None | Some(Target::Elsewhere)) {
            return None;
        }
        let aid = aids.station(row.station);
        self.last_seen.insert(aid, row.t_ns);
        let measured = filter.measure_ray(row)?;
        let taken = filter.weigh(&measured, filter.tuning.gate);
        if taken {
            aids.took(aid, row.t_ns);
            return Some(true);
        }
        let kind = wrong_ray(&measured, row.slant_m);
        let off = measured.innovation;
        watch.wrong(aids.name(aid), kind, row.t_ns, 2, || {
            format!(
                "off by {:.1} mm of distance and {:.1}″, {:.1}″ of azimuth and zenith angle",
                1e3 * off.z,
                off.x.to_degrees() * 3600.0,
                off.y.to_degrees() * 3600.0
            )
        });
        Some(false)
    }

    /// Makes, or stations, whose rows are later or earlier than stated by more than the stated sigma allows.
    fn late(&self, t_ns: i64, watch: &mut Watch) {
        let Some(filter) = self.filter.as_ref().filter(|filter| filter.tuning.calibration) else { return };
        let makes = self.rig.make_names.iter().enumerate().map(|(make, name)| {
            (name.as_str(), filter.states.make_delays + make, self.rig.make_delay_sigma_s)
        });
        let stations = ("stations", filter.states.station_delay, self.rig.station.delay_sigma_s);
        for (name, state, stated_s) in makes.chain([stations]) {
            let (late_s, sigma_s) = (filter.x[state], filter.covariance.row(state)[state].max(0.0).sqrt());
            if late_s.abs() > 4.0 * stated_s && late_s.abs() > 5.0 * sigma_s {
                watch.wrong(name, "late", t_ns, 1, || {
                    format!(
                        "its rows are {:.0} ms later than stated, by the pose itself ({:.0} ms)",
                        1e3 * late_s,
                        1e3 * sigma_s
                    )
                });
            }
        }
    }

    /// Devices that have gone silent.
    fn silences(&mut self, t_ns: i64, aids: &Aids, watch: &mut Watch) {
        let antennas: Vec<usize> = (0..self.rig.antennas.len()).map(|k| aids.antenna(k)).collect();
        let stations: Vec<usize> = (0..self.rig.stations_n.len()).map(|k| aids.station(k)).collect();
        for (group, all, limit_ns, single_ns) in [
            ("antennas", antennas, 300_000_000, 1_000_000_000),
            ("stations", stations, 2_000_000_000, 15_000_000_000),
            ("encoders", vec![aids.encoders()], i64::MAX, 300_000_000),
        ] {
            let seen: Vec<(usize, i64)> =
                all.iter().filter_map(|aid| self.last_seen.get(aid).map(|last| (*aid, *last))).collect();
            let Some(latest) = seen.iter().map(|(_, last)| *last).max() else { continue };
            if limit_ns < i64::MAX && t_ns - latest > limit_ns {
                watch.wrong_since(group, "silent", latest, t_ns, 1, || "none of them writes".to_owned());
                self.back_ns.insert(group, t_ns);
                continue;
            }
            // After fog each has to find its prism again.
            let back_ns = self.back_ns.get(group).copied().unwrap_or(i64::MIN / 2);
            for (aid, last) in seen {
                if t_ns - last.max(back_ns) > single_ns {
                    watch.wrong_since(aids.name(aid), "silent", last, t_ns, 1, || {
                        "it writes nothing".to_owned()
                    });
                }
            }
        }
    }

    /// Once, after half a minute: gravity, followed in the inertial frame, says level and yaw by itself.
    fn check_mounting(&mut self, watch: &mut Watch) -> Result<(), CabinError> {
        let (Some(filter), Some(gravity)) = (&self.filter, &self.gravity) else { return Ok(()) };
        if gravity.time_s() < CHECKED_AFTER_S {
            return Ok(());
        }
        let (nav, found) = (filter.nav(), gravity.attitude(&self.rig.earth, &filter.nav().p_n));
        let off = found.map(|found| {
            nalgebra::Rotation3::from_matrix_unchecked(found * nav.c_nb.transpose()).scaled_axis()
        });
        self.gravity = None;
        let Some(off) = off else { return Ok(()) };
        let stayed = self.is_cabin && (nav.p_n - self.begun_n).norm() < STAYED_M;
        let (level, yaw) = (off.xy().norm(), if stayed { off.z.abs() } else { 0.0 });
        if level < MISMOUNTED_RAD[0] && yaw < MISMOUNTED_RAD[1] {
            return Ok(());
        }
        let sentence = format!(
            "the inertial sensor says another attitude than antennas and prisms do: {:.2}° of level and {:.1}° of yaw apart; check the mounting (c_b_s), and which antenna is which",
            off.xy().norm().to_degrees(),
            off.z.to_degrees()
        );
        if level < REFUSED_RAD[0] && yaw < REFUSED_RAD[1] {
            // It may have been moved meanwhile.
            watch.wrong(
                if self.is_cabin { "imu" } else { "platform_imu" },
                "mounting",
                filter.t_ns,
                1,
                || sentence,
            );
            return Ok(());
        }
        Err(CabinError(sentence))
    }

    /// Before the start: sightings, until a rigid body goes through them.
    fn gather(&mut self, t_ns: i64, rows: &[AidRow], aids: &mut Aids, watch: &mut Watch) {
        for row in rows {
            match row {
                AidRow::Antenna(row) if believable(row) && !self.rig.antennas.is_empty() => {
                    let place_b = self.rig.antennas[row.antenna].position_b;
                    let aid = aids.antenna(row.antenna);
                    self.sightings.insert(
                        aid,
                        Sighting { t_ns: row.t_ns, aid, place_b, p_n: Vector3::from(row.position_n) },
                    );
                    self.velocities.extend(row.velocity_n.map(Vector3::from));
                    let [e, n, u] = row.sigma_n;
                    self.stated.push([libm::hypot(e, n) / std::f64::consts::SQRT_2, u]);
                }
                AidRow::Ray(row)
                    if self.rig.antennas.is_empty()
                        || t_ns - self.first_ns.unwrap_or(t_ns) > 5_000_000_000 =>
                {
                    if let Some(Target::Body(place_b)) = self.rig.targets.get(row.target) {
                        let aid = aids.station(row.station);
                        let p_n = self.rig.stations_n[row.station] + along(row) * row.slant_m;
                        self.sightings.insert(aid, Sighting { t_ns: row.t_ns, aid, place_b: *place_b, p_n });
                    }
                }
                _ => {}
            }
        }
        let imu_ns = if self.rig.has_imu { self.last_imu_ns } else { Some(t_ns) };
        let Some(imu_ns) = imu_ns else { return };
        let fresh: Vec<Sighting> =
            self.sightings.values().filter(|s| t_ns - s.t_ns < ONE_MOMENT_NS).copied().collect();
        let since_ns = t_ns - self.first_ns.unwrap_or(t_ns);
        if since_ns < GATHER_NS || fresh.len() < 3 || t_ns - imu_ns > 100_000_000 {
            return;
        }
        let Some(fit) = start::fit(&fresh) else {
            let names: Vec<&str> = fresh.iter().map(|s| aids.name(s.aid)).collect();
            self.misfit = Some(format!(
                "expected {} where the instrument has them, found no rigid body through more than half of them: check which is which, and the unit of the positions",
                names.join(", ")
            ));
            return;
        };
        for (k, out) in fit.left_out.iter().enumerate() {
            let exchanged = fit
                .left_out
                .iter()
                .enumerate()
                .find(|(other, with)| *other != k && fit.are_exchanged(&fresh[*out], &fresh[**with]));
            let name = aids.name(fresh[*out].aid).to_owned();
            match exchanged {
                Some((_, with)) => watch.wrong(&name, "exchanged", t_ns, 1, || {
                    format!("it stands where {} should: the two are exchanged", aids.name(fresh[*with].aid))
                }),
                None => watch.wrong(&name, "wrong_fix", t_ns, 1, || {
                    "it is not where the instrument has it beside the others".to_owned()
                }),
            }
        }
        let v_n = if self.velocities.is_empty() {
            Vector3::zeros()
        } else {
            let recent = &self.velocities[self.velocities.len().saturating_sub(24)..];
            recent.iter().sum::<Vector3<f64>>() / recent.len() as f64
        };
        let begin = Start {
            t_ns: imu_ns,
            p_n: fit.p_n,
            v_n,
            c_nb: fit.c_nb,
            sigma_p_m: 0.05,
            sigma_v_m_s: if self.velocities.is_empty() { 0.3 } else { 0.03 },
            sigma_attitude_rad: 3e-3,
        };
        let recording = self.config.smoothed;
        self.filter =
            Some(Filter::new(self.rig.clone(), self.tuning, self.stated_sigma_m(), &begin, recording));
        self.started_ns = t_ns.max(1);
        self.begun_n = fit.p_n;
        self.taken_ns = t_ns;
    }

    /// What the antennas' rows state, in plan and in height, m: the median.
    fn stated_sigma_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| {
            let mut all: Vec<f64> = self.stated.iter().map(|stated| stated[axis]).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or([0.006, 0.008][axis])
        })
    }

    /// The pose at a time, and the platform's where encoders join it.
    pub(super) fn emit(
        &mut self,
        t_ns: i64,
        aids: &Aids,
        joined: bool,
        out: &mut Vec<Row>,
        platform: &mut Vec<Row>,
    ) {
        let recording = self.config.smoothed;
        let Some(filter) = &self.filter else { return };
        let Some(pose) = filter.body(t_ns) else { return };
        let (row, columns) = filter.row(t_ns, &pose, recording);
        let of_platform = if joined { filter.platform(t_ns) } else { None };
        self.holds_platform = of_platform.as_ref().is_none_or(|pose| pose.is_held());
        let beside = of_platform.map(|pose| filter.row(t_ns, &pose, recording));
        let row = if recording { row } else { row.behind(&self.behind_n[0]) };
        let beside = if recording {
            beside
        } else {
            beside.map(|(row, columns)| (row.behind(&self.behind_n[1]), columns))
        };
        let row = self.told(row, aids, 0);
        let beside = beside.map(|(row, columns)| (self.told(row, aids, 1), columns));
        if !recording {
            out.push(row);
            platform.extend(beside.map(|(row, _)| row));
            return;
        }
        let Some(leaf) = self.filter.as_mut().and_then(|filter| filter.leaf.as_mut()) else { return };
        leaf.poses.push(Posed { row, columns, is_platform: false });
        leaf.poses.extend(beside.map(|(row, columns)| Posed { row, columns, is_platform: true }));
    }

    /// The row with its status and the time that is left.
    fn told(&mut self, mut row: Row, aids: &Aids, which: usize) -> Row {
        let mask = aids.fresh(row.t_ns);
        let [antennas, stations] = aids.has_position(mask);
        let [yaw, pitch, roll] = row.sigma_angles_rad();
        self.aligned |= yaw < ALIGNED_RAD[0] && pitch.max(roll) < ALIGNED_RAD[1];
        let encoders = mask >> aids.encoders() & 1 == 1;
        let all = (antennas || self.rig.antennas.is_empty())
            && (stations || !self.config.has_stations)
            && (encoders || !self.config.has_encoders)
            && mask & 1 == 1;
        row.aids = mask;
        row.status = match (self.aligned, antennas || stations, all) {
            (false, ..) => Status::Aligning,
            (true, false, _) => Status::Coasting,
            (true, true, false) => Status::Reduced,
            (true, true, true) => Status::Full,
        };
        let sigma_m = row.largest_sigma_m();
        let before = self.sigma_before.get_or_insert([(row.t_ns, sigma_m); 2]);
        let (then_ns, then_m) = before[which];
        let dt_s = (row.t_ns - then_ns) as f64 * 1e-9;
        if dt_s > 0.0 {
            let growth = (sigma_m - then_m) / dt_s;
            let budget_m = if self.is_cabin { BUDGETS_M[which] } else { BUDGETS_M[1] };
            row.time_left_s = (row.status == Status::Coasting && growth > 0.0)
                .then(|| ((budget_m / 3.0 - sigma_m) / growth).max(0.0));
        }
        before[which] = (row.t_ns, sigma_m);
        row
    }
}

fn count(taken: Option<bool>, yes: &mut usize, no: &mut usize) {
    match taken {
        Some(true) => *yes += 1,
        Some(false) => *no += 1,
        None => {}
    }
}

/// A fix with numbers that a fix may have; float ones are centimetres to decimetres off for minutes.
fn believable(row: &AntennaRow) -> bool {
    row.quality == 4
        && row.position_n.iter().all(|x| x.is_finite())
        && row.sigma_n.iter().all(|sigma| *sigma > 0.0 && *sigma < 1.0)
}

/// Which kind of trouble a refused ray shows.
fn wrong_ray(measured: &Measured, slant_m: f64) -> &'static str {
    let off = measured.innovation;
    let across_m = libm::hypot(off.x * 0.5, off.y) * slant_m;
    if across_m > 0.3 || off.z.abs() > 0.5 {
        "wrong_prism"
    } else if off.z.abs() > across_m {
        "wrong_distance"
    } else {
        "wrong_direction"
    }
}

/// The direction of a ray in n.
fn along(row: &RayRow) -> Vector3<f64> {
    let (sin_azimuth, cos_azimuth) = libm::sincos(row.azimuth_rad);
    let (sin_zenith, cos_zenith) = libm::sincos(row.zenith_rad);
    Vector3::new(sin_azimuth * sin_zenith, cos_azimuth * sin_zenith, cos_zenith)
}

/// Smoothing of what has been recorded.
impl Body {
    /// Puts what the filter recorded since the last epoch aside.
    pub(super) fn turn_page(&mut self, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
        let Some(filter) = &mut self.filter else { return };
        let Some(leaf) = &mut filter.leaf else { return };
        self.leaves.push_back(std::mem::take(leaf));
        if self.leaves.len() >= SMOOTHED_EPOCHS + AHEAD_EPOCHS {
            self.smooth(SMOOTHED_EPOCHS, out, platform);
        }
    }

    /// Smooths all that is recorded and gives the poses of the first epochs.
    fn smooth(&mut self, first: usize, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
        let Some(n) = self.filter.as_ref().map(|filter| filter.states.n) else { return };
        let begins_ns = self.leaves.iter().find_map(|leaf| leaf.poses.first()).map(|posed| posed.row.t_ns);
        if begins_ns.is_none_or(|begins_ns| begins_ns > self.wanted_ns) {
            self.leaves.drain(..first.min(self.leaves.len()));
            return;
        }
        let mut future = Future::new(n);
        let (mut rows, mut beside) = (Vec::new(), Vec::new());
        for (k, leaf) in self.leaves.iter().enumerate().rev() {
            if k < first {
                for posed in leaf.poses.iter().rev() {
                    let into = if posed.is_platform { &mut beside } else { &mut rows };
                    into.push(future.smooth(posed));
                }
            }
            future.back(leaf);
        }
        out.extend(rows.into_iter().rev());
        platform.extend(beside.into_iter().rev());
        self.leaves.drain(..first.min(self.leaves.len()));
    }

    /// Its poses are asked for at a time, ns.
    pub(super) fn is_wanted_at(&mut self, t_ns: i64) {
        self.wanted_ns = self.wanted_ns.max(t_ns);
    }

    /// Whether no encoder has said where the platform is in the last row.
    pub(super) fn holds_platform(&self) -> bool {
        self.holds_platform
    }

    /// Poses up to this time are smoothed, ns; all, where the filter has not started.
    pub(super) fn known_until_ns(&self) -> i64 {
        let first = self.leaves.front().and_then(|leaf| leaf.poses.first());
        if self.filter.is_none() { i64::MAX } else { first.map_or(i64::MIN, |posed| posed.row.t_ns - 1) }
    }

    /// The end: the poses that wait.
    pub(super) fn finish(&mut self, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
        if let Some(leaf) = self.filter.as_mut().and_then(|filter| filter.leaf.as_mut()) {
            self.leaves.push_back(std::mem::take(leaf));
        }
        let all = self.leaves.len();
        self.smooth(all, out, platform);
    }
}
