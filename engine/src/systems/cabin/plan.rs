//! Where cabin and platform should be: rows of the control system's plan, between which a straight line is taken.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

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
];

/// Position and yaw of the cabin, position of the platform; NaN where nothing is planned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Planned {
    pub(super) cabin_n_m: [f64; 3],
    pub(super) platform_n_m: [f64; 3],
    pub(super) yaw_rad: f64,
}

/// The rows that are still of use.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Plan(VecDeque<(i64, Planned)>);

impl Plan {
    /// A row; one that goes back in time is of no plan.
    pub(super) fn push(&mut self, t_ns: i64, values: &[f64]) {
        let at = |column: usize| values.get(column).copied().unwrap_or(f64::NAN);
        if self.0.back().is_some_and(|(last_ns, _)| t_ns <= *last_ns) {
            return;
        }
        let planned =
            Planned { cabin_n_m: [at(0), at(1), at(2)], yaw_rad: at(3), platform_n_m: [at(6), at(7), at(8)] };
        self.0.push_back((t_ns, planned));
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
        let between = |a: f64, b: f64| a + share * (b - a);
        let places = |a: &[f64; 3], b: &[f64; 3]| [0, 1, 2].map(|axis| between(a[axis], b[axis]));
        Some(Planned {
            cabin_n_m: places(&from.cabin_n_m, &to.cabin_n_m),
            platform_n_m: places(&from.platform_n_m, &to.platform_n_m),
            yaw_rad: from.yaw_rad + share * crate::rotation::wrap(to.yaw_rad - from.yaw_rad),
        })
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
        plan.push(0, &[1.0, 2.0, 3.0, 3.1, 0.0, 0.0, 1.0, 2.0, 0.0]);
        plan.push(200_000_000, &[1.2, 2.0, 3.0, -3.1, 0.0, 0.0, 1.0, 2.4, 0.0]);
        plan.push(5_000_000_000, &[9.0, 9.0, 9.0]);
        let at = plan.at(50_000_000).unwrap();
        assert!((at.cabin_n_m[0] - 1.05).abs() < 1e-12 && (at.platform_n_m[1] - 2.1).abs() < 1e-12);
        // The short way round.
        assert!((at.yaw_rad - 3.1208).abs() < 1e-4, "{}", at.yaw_rad);
        assert_eq!(plan.at(1_000_000_000), None);
        assert_eq!(plan.at(6_000_000_000), None);
        // While the next row is on its way the line goes on, for a while.
        let mut so_far = Plan::default();
        so_far.push(0, &[1.0, 2.0, 3.0]);
        so_far.push(200_000_000, &[1.2, 2.0, 3.0]);
        assert!((so_far.at(300_000_000).unwrap().cabin_n_m[0] - 1.3).abs() < 1e-12);
        assert_eq!(so_far.at(800_000_000), None);
        assert!(plan.at(5_000_000_000).unwrap().platform_n_m[0].is_nan());
    }
}
