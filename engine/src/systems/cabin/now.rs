//! Cabin and platform at the newest reading, for a control loop.

use nalgebra::Vector3;

use super::output::{Row, Status};
use super::plan::PlannedBody;
use crate::system::{BodyPose, PoseState};

/// Both bodies.
#[derive(Clone, Debug)]
pub struct Now {
    /// The cabin.
    pub cabin: BodyNow,
    /// The platform, where anything says where it is.
    pub platform: Option<BodyNow>,
}

/// One body.
#[derive(Clone, Debug)]
pub struct BodyNow {
    /// Its pose.
    pub row: Row,
    /// Rate of turn against n, in n, rad/s.
    pub rate_n: Vector3<f64>,
    /// More than this three sigmas must not be, m.
    pub budget_m: f64,
}

impl BodyNow {
    /// As a control loop is told it.
    pub(super) fn pose(&self, planned: Option<&PlannedBody>) -> BodyPose {
        let row = &self.row;
        let angles = row.angles();
        let angles_rad = [angles.heading_rad, angles.pitch_rad, angles.roll_rad];
        BodyPose {
            position_n_m: row.p_n.into(),
            velocity_n_m_s: row.v_n.into(),
            angles_rad,
            rate_n_rad_s: self.rate_n.into(),
            sigma_n_m: row.sigma_n_m(),
            sigma_angles_rad: row.sigma_angles_rad(),
            off_plan_n_m: planned
                .map_or([f64::NAN; 3], |planned| (row.p_n - Vector3::from(planned.place_n_m)).into()),
            off_plan_rad: planned.map_or([f64::NAN; 3], |planned| planned.off_rad(angles_rad)),
            protection_level_m: row.protection_level_m(),
            three_sigma_m: 3.0 * row.largest_sigma_m(),
            budget_m: self.budget_m,
            time_left_s: row.time_left_s,
            is_measured: !row.is_held,
        }
    }
}

impl From<Status> for PoseState {
    fn from(status: Status) -> PoseState {
        match status {
            Status::Aligning => PoseState::Aligning,
            Status::Full => PoseState::Full,
            Status::Reduced => PoseState::Reduced,
            Status::Coasting => PoseState::Coasting,
        }
    }
}
