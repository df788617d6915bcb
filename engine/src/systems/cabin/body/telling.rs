//! The poses that come out: with status and the time that is left, and smoothed.

use nalgebra::Vector3;

use super::Body;
use crate::systems::cabin::aids::Aids;
use crate::systems::cabin::now::BodyNow;
use crate::systems::cabin::output::{Pose, Row, Status};
use crate::systems::cabin::tape::{Future, Posed};

/// Epochs of which a smoother gives poses at once, and those that it looks ahead.
const SMOOTHED_EPOCHS: usize = 4800;
const AHEAD_EPOCHS: usize = 3200;
/// An attitude this sure is found: yaw and level, rad.
const ALIGNED_RAD: [f64; 2] = [1.2e-3, 4e-4];
/// So many rays verify a pose; after so long none are waited for, ns.
const VERIFIED_BY: u32 = 8;
const VERIFIED_WITHIN_NS: i64 = 10_000_000_000;
/// Budgets of position, m: the cabin's and the platform's.
const BUDGETS_M: [f64; 2] = [0.015, 0.003];

impl Body {
    /// The pose at a time, and the platform's where encoders join it.
    pub(in crate::systems::cabin) fn emit(
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
        let row = self.doubt.widened(row);
        let of_platform = if joined { filter.platform(t_ns) } else { None };
        self.holds_platform = of_platform.as_ref().is_none_or(|pose| pose.is_held());
        let beside = of_platform.map(|pose| {
            let (row, columns) = filter.row(t_ns, &pose, recording);
            (self.doubt.widened(row), columns)
        });
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
    pub(super) fn told(&mut self, mut row: Row, aids: &Aids, which: usize) -> Row {
        let [yaw, pitch, roll] = row.sigma_angles_rad();
        self.aligned |=
            yaw < ALIGNED_RAD[0] && pitch.max(roll) < ALIGNED_RAD[1] && self.is_verified(row.t_ns);
        row.aids = self.fresh(row.t_ns, aids);
        row.status = self.status(row.aids, aids);
        self.growths[which].note(row.t_ns, row.largest_sigma_m());
        row.time_left_s = self.time_left_s(&row, which);
        row
    }

    /// What corrects it.
    fn fresh(&self, t_ns: i64, aids: &Aids) -> u64 {
        if self.is_cabin { aids.fresh_of_cabin(t_ns) } else { aids.fresh_of_platform(t_ns) }
    }

    /// More than this three sigmas must not be, m.
    fn budget_m(&self, which: usize) -> f64 {
        if self.is_cabin { BUDGETS_M[which] } else { BUDGETS_M[1] }
    }

    /// Until the budget is used up; `None` while all that should correct the pose does, or the sigma does not grow.
    fn time_left_s(&self, row: &Row, which: usize) -> Option<f64> {
        let is_short_of = matches!(row.status, Status::Coasting | Status::Reduced);
        let left_s = self.growths[which].left_s(row.largest_sigma_m(), self.budget_m(which) / 3.0);
        left_s.filter(|_| is_short_of)
    }

    /// Whether rays agree with the pose, which rests on surveyed places and encoders alone; stations may take a while to find their
    /// prisms, or never come.
    fn is_verified(&self, t_ns: i64) -> bool {
        !self.config.has_stations || self.rays >= VERIFIED_BY || t_ns - self.started_ns > VERIFIED_WITHIN_NS
    }

    fn status(&self, mask: u64, aids: &Aids) -> Status {
        let [antennas, stations] = aids.has_position(mask);
        let encoders = mask >> aids.encoders() & 1 == 1;
        let sensor = if self.is_cabin { Some(Aids::IMU) } else { aids.platform_imu() };
        let all = (antennas || self.rig.antennas.is_empty())
            && (stations || !self.config.has_stations)
            && (encoders || !self.config.has_encoders)
            && sensor.is_none_or(|sensor| mask >> sensor & 1 == 1)
            && !self.doubt.is_there()
            && self.filter.as_ref().is_none_or(|filter| {
                filter.wrong_legs().next().is_none() && filter.wrong_angles().next().is_none()
            });
        match (self.aligned, antennas || stations, all) {
            (false, ..) => Status::Aligning,
            (true, false, _) => Status::Coasting,
            (true, true, false) => Status::Reduced,
            (true, true, true) => Status::Full,
        }
    }

    /// The pose at the newest reading, and the platform's where encoders join it. Nothing changes.
    pub(in crate::systems::cabin) fn now(&self, aids: &Aids, joined: bool) -> [Option<BodyNow>; 2] {
        let Some(filter) = &self.filter else { return [None, None] };
        let t_ns = filter.t_ns;
        let of = |pose: Pose, which: usize, rate_n: Vector3<f64>| {
            let (row, _) = filter.row(t_ns, &pose, false);
            let mut row = self.doubt.widened(row).behind(&self.behind_n[which]);
            row.aids = self.fresh(t_ns, aids);
            row.status = self.status(row.aids, aids);
            row.time_left_s = self.time_left_s(&row, which);
            BodyNow { row, rate_n, budget_m: self.budget_m(which) }
        };
        let cabin = filter.body(t_ns).map(|pose| of(pose, 0, filter.rate_n()));
        let platform = if joined { filter.platform(t_ns) } else { None };
        [cabin, platform.map(|pose| of(pose, 1, filter.platform_rate_n(t_ns)))]
    }
}

/// Smoothing of what has been recorded.
impl Body {
    /// Puts what the filter recorded since the last epoch aside.
    pub(in crate::systems::cabin) fn turn_page(&mut self, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
        let Some(filter) = &mut self.filter else { return };
        let Some(leaf) = &mut filter.leaf else { return };
        self.leaves.push_back(std::mem::take(leaf));
        if self.leaves.len() >= SMOOTHED_EPOCHS + AHEAD_EPOCHS {
            self.smooth(SMOOTHED_EPOCHS, out, platform);
        }
    }

    /// Smooths all that is recorded and gives the poses of the first epochs.
    pub(super) fn smooth(&mut self, first: usize, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
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
    pub(in crate::systems::cabin) fn is_wanted_at(&mut self, t_ns: i64) {
        self.wanted_ns = self.wanted_ns.max(t_ns);
    }

    /// Whether no encoder has said where the platform is in the last row.
    pub(in crate::systems::cabin) fn holds_platform(&self) -> bool {
        self.holds_platform
    }

    /// Poses up to this time are smoothed, ns; all, where the filter has not started.
    pub(in crate::systems::cabin) fn known_until_ns(&self) -> i64 {
        let first = self.leaves.front().and_then(|leaf| leaf.poses.first());
        if self.filter.is_none() { i64::MAX } else { first.map_or(i64::MIN, |posed| posed.row.t_ns - 1) }
    }

    /// The end: the poses that wait.
    pub(in crate::systems::cabin) fn finish(&mut self, out: &mut Vec<Row>, platform: &mut Vec<Row>) {
        if let Some(leaf) = self.filter.as_mut().and_then(|filter| filter.leaf.as_mut()) {
            self.leaves.push_back(std::mem::take(leaf));
        }
        let all = self.leaves.len();
        self.smooth(all, out, platform);
    }
}
