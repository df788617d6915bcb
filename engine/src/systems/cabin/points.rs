//! Rows of cabin and platform as the points of a track.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::output::Row;
use super::session::Poses;
use crate::event::{Part, Tilt, TrackPoint};

fn point(cabin: &Row, platform: Option<[f64; 3]>) -> TrackPoint {
    let angles = cabin.angles();
    let [yaw, pitch, roll] = cabin.sigma_angles_rad();
    let part = |position_n_m| Part { position_n_m, stance: false };
    let position_n_m: [f64; 3] = cabin.p_n.into();
    TrackPoint {
        t_ns: cabin.t_ns,
        position_n_m,
        heading_rad: angles.heading_rad,
        sigma_heading_rad: yaw,
        sigma_n_m: cabin.sigma_n_m(),
        covariance_en_m2: cabin.covariance[(0, 1)],
        tilt: Some(Tilt {
            roll_rad: angles.roll_rad,
            pitch_rad: angles.pitch_rad,
            sigma_roll_rad: roll as f32,
            sigma_pitch_rad: pitch as f32,
        }),
        parts: [Some(part(position_n_m)), platform.map(part)],
    }
}

/// Puts the rows of both bodies together as they come.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Pairs {
    cabin: VecDeque<Row>,
    platform: VecDeque<Row>,
}

impl Pairs {
    pub(super) fn take(&mut self, poses: &mut Poses) {
        self.cabin.extend(poses.cabin.drain(..));
        self.platform.extend(poses.platform.drain(..));
    }

    /// The next row of the cabin, with the platform's of the same time, where there is one; while the platform's may still come,
    /// none.
    pub(super) fn next(&mut self, all_came: bool) -> Option<(Row, Option<Row>)> {
        let newest_ns = self.platform.back().map_or(i64::MIN, |platform| platform.t_ns);
        if !all_came && self.cabin.front()?.t_ns > newest_ns {
            return None;
        }
        let cabin = self.cabin.pop_front()?;
        while self.platform.front().is_some_and(|platform| platform.t_ns < cabin.t_ns) {
            self.platform.pop_front();
        }
        let platform = self.platform.front().is_some_and(|platform| platform.t_ns == cabin.t_ns);
        let platform = if platform { self.platform.pop_front() } else { None };
        Some((cabin, platform))
    }
}

pub(super) fn of_rows((cabin, platform): &(Row, Option<Row>)) -> TrackPoint {
    point(cabin, platform.as_ref().map(|platform| platform.p_n.into()))
}

/// All rows of a run as points.
pub fn track_points(mut poses: Poses) -> Vec<TrackPoint> {
    let mut pairs = Pairs::default();
    pairs.take(&mut poses);
    std::iter::from_fn(|| pairs.next(true)).map(|rows| of_rows(&rows)).collect()
}
