//! The pose at the newest reading, for a control loop that cannot wait for a point of the track.

use crate::anomaly::AnomalyKind;
use crate::event::MOST_PARTS;

/// How far a system is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseState {
    /// The attitude is still being found.
    Aligning,
    /// Every kind of aid corrects it.
    Full,
    /// Some kind of aid is missing.
    Reduced,
    /// No position aid corrects it any more.
    Coasting,
}

/// Where every part of a system is at its newest reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// When, ns of the session's clock.
    pub t_ns: i64,
    /// How far the system is.
    pub state: PoseState,
    /// What has corrected it within the last half second: bits in the order of [`super::System::aid_names`].
    pub aids: u64,
    /// How each of them is, in the same order.
    pub aid_states: Vec<AidState>,
    /// The parts, in the order of the declaration; `None` for one of which nothing is known.
    pub bodies: [Option<BodyPose>; MOST_PARTS],
}

/// Something that may correct a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AidState {
    /// Since it last corrected a pose, s; infinite where it never did.
    pub since_s: f64,
    /// What is wrong with it now, or has been within the last two seconds.
    pub trouble: Option<AnomalyKind>,
}

/// Where one part is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose {
    /// Position of its origin, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Velocity, m/s.
    pub velocity_n_m_s: [f64; 3],
    /// Heading of the forward axis, clockwise from north, its elevation, and the roll about it, rad.
    pub angles_rad: [f64; 3],
    /// Rate of turn against n, in n, rad/s.
    pub rate_n_rad_s: [f64; 3],
    /// Sigmas of the position, m.
    pub sigma_n_m: [f64; 3],
    /// Sigmas of the angles, rad.
    pub sigma_angles_rad: [f64; 3],
    /// Measured less planned, m; NaN where no plan is known.
    pub off_plan_n_m: [f64; 3],
    /// The same of its angles, rad.
    pub off_plan_rad: [f64; 3],
    /// The position is this close to the truth, but for one epoch in ten thousand, m.
    pub protection_level_m: f64,
    /// Three sigmas of the least certain direction, m.
    pub three_sigma_m: f64,
    /// More than this three sigmas must not be, m.
    pub budget_m: f64,
    /// Until the budget is used up at the present growth, s; `None` while it does not grow.
    pub time_left_s: Option<f64>,
    /// Whether a device says where it is now; else it is where it was last.
    pub is_measured: bool,
}

/// A value of a chart of a system's own.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartValue {
    /// When, ns.
    pub t_ns: i64,
    /// The chart that the system declares.
    pub chart: &'static str,
    /// The line in it.
    pub series: String,
    /// In the chart's unit.
    pub value: f64,
}
