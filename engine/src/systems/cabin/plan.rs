//! Where cabin and platform should be: rows of the control system's plan, between which a straight line is taken.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::rotation::wrap;
use crate::system::Column;

/// A plan is taken across a hole of so long at most, ns.
const LONGEST_NS: i64 = 2_000_000_000;
/// A plan goes on beyond its last row for so long, ns.
const BEYOND_NS: i64 = 500_000_000;
/// Rows that lie so long behind are let go, ns.
const KEPT_NS: i64 = 5_000_000_000;

const fn column(name: &'static str, required: bool, about: &'static str) -> Column {
    Column { name, required, about }
}

/// Its columns.
pub(super) const COLUMNS: &[Column] = &[
    column("e_m", true, "The cabin's planned position, east, m."),
    column("n_m", true, "North, m."),
    column("u_m", true, "Up, m."),
    column("yaw_rad", false, "Planned yaw, rad."),
    column("pitch_rad", false, "Planned pitch, rad."),
    column("roll_rad", false, "Planned roll, rad."),
    column("platform_e_m", false, "The platform's planned position, east, m."),
    column("platform_n_m", false, "North, m."),
    column("platform_u_m", false, "Up, m."),
    column("platform_yaw_rad", false, "The platform's planned yaw, rad."),
    column("platform_pitch_rad", false, "Its planned pitch, rad."),
    column("platform_roll_rad", false, "Its planned roll, rad."),
];

/// Where a body should be; NaN where nothing is planned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlannedBody {
    pub(super) place_n_m: [f64; 3],
    /// Yaw, pitch and roll.
    pub(super) angles_rad: [f64; 3],
}

/// Cabin and platform.
pub(super) type Planned = [PlannedBody; 2];

impl PlannedBody {
    fn of(values: &[f64], from: usize) -> PlannedBody {
        let three = |from: usize| [0, 1, 2].map(|k| values.get(from + k).copied().unwrap_or(f64::NAN));
        PlannedBody { place_n_m: three(from), angles_rad: three(from + 3) }
    }

    /// A share of the way to another; angles go the short way round.
    fn toward(&self, to: &PlannedBody, share: f64) -> PlannedBody {
        let place = |axis: usize| self.place_n_m[axis] + share * (to.place_n_m[axis] - self.place_n_m[axis]);
        let angle =
            |axis: usize| self.angles_rad[axis] + share * wrap(to.angles_rad[axis] - self.angles_rad[axis]);
        PlannedBody { place_n_m: [0, 1, 2].map(place), angles_rad: [0, 1, 2].map(angle) }
    }

    /// Measured angles less the planned, rad.
    pub(super) fn off_rad(&self, measured_rad: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| wrap(measured_rad[axis] - self.angles_rad[axis]))
    }
}

/// The rows that are still of use.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Plan(VecDeque<(i64, Planned)>);

impl Plan {
    /// A row; one that goes back in time is of no plan.
    pub(super) fn push(&mut self, t_ns: i64, values: &[f64]) {
        if self.0.back().is_some_and(|(last_ns, _)| t_ns <= *last_ns) {
            return;
        }
        self.0.push_back((t_ns, [0, 6].map(|from| PlannedBody::of(values, from))));
    }

    /// What is planned for a time, ns.
    pub(super) fn at(&self, t_ns: i64) -> Option<Planned> {
        let mut after = self.0.partition_point(|(row_ns, _)| *row_ns < t_ns);
        // The next row may be on its way: a little beyond the last the line goes on.
        if after == self.0.len() && self.0.back().is_some_and(|(last_ns, _)| t_ns - last_ns <= BEYOND_NS) {
            after -= 1;
        }
        let (to_ns, to) = self.0.get(after)?;
        if *to_ns == t_ns {
            return Some(*to);
        }
        let (from_ns, from) = self.0.get(after.checked_sub(1)?)?;
        if to_ns - from_ns > LONGEST_NS {
            return None;
        }
        let share = (t_ns - from_ns) as f64 / (to_ns - from_ns) as f64;
        Some([0, 1].map(|body| from[body].toward(&to[body], share)))
    }

    /// Lets go of what nobody will ask for.
    pub(super) fn forget_before(&mut self, t_ns: i64) {
        while self.0.get(1).is_some_and(|(row_ns, _)| *row_ns < t_ns - KEPT_NS) {
            self.0.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_a_line_from_row_to_row_and_nothing_across_a_hole_or_beyond_its_end() {
        let mut plan = Plan::default();
        plan.push(0, &[1.0, 2.0, 3.0, 3.1, 0.0, 0.0, 1.0, 2.0, 0.0, -3.1, 0.2, 0.1]);
        plan.push(200_000_000, &[1.2, 2.0, 3.0, -3.1, 0.0, 0.0, 1.0, 2.4, 0.0, 3.1, 0.4, 0.1]);
        plan.push(5_000_000_000, &[9.0, 9.0, 9.0]);
        let [cabin, platform] = plan.at(50_000_000).unwrap();
        assert!((cabin.place_n_m[0] - 1.05).abs() < 1e-12 && (platform.place_n_m[1] - 2.1).abs() < 1e-12);
        // The short way round.
        assert!((cabin.angles_rad[0] - 3.1208).abs() < 1e-4, "{}", cabin.angles_rad[0]);
        assert!((platform.angles_rad[1] - 0.25).abs() < 1e-12);
        let off_rad = platform.off_rad([3.1, 0.25, 0.1]);
        assert!((off_rad[0] + 0.0624).abs() < 1e-4 && off_rad[1].abs() < 1e-12, "{off_rad:?}");
        assert_eq!(plan.at(1_000_000_000), None);
        assert_eq!(plan.at(6_000_000_000), None);
        // While the next row is on its way the line goes on, for a while.
        let mut so_far = Plan::default();
        so_far.push(0, &[1.0, 2.0, 3.0]);
        so_far.push(200_000_000, &[1.2, 2.0, 3.0]);
        assert!((so_far.at(300_000_000).unwrap()[0].place_n_m[0] - 1.3).abs() < 1e-12);
        assert_eq!(so_far.at(800_000_000), None);
        assert!(plan.at(5_000_000_000).unwrap()[1].place_n_m[0].is_nan());
    }
}
