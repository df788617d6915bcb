//! What poses come to: rows of the track, and where the tip stood at each stop.

use nalgebra::{Matrix4, Vector3};

use super::pass::Pose;
use super::points::VisitOfPoint;
use super::recording::{Instrument, Recording};
use super::survey::Row;
use crate::rotation::azimuth;

/// Where the tip touches the ground at each stop: the mean over the stop.
pub(super) fn visits(recording: &Recording, instrument: &Instrument, poses: &[Pose]) -> Vec<VisitOfPoint> {
    let mut visits = Vec::new();
    for (number, stop) in recording.stops.iter().enumerate() {
        let from = poses.partition_point(|pose| pose.t_ns < stop.t_start_ns);
        let to = poses.partition_point(|pose| pose.t_ns <= stop.t_end_ns);
        let of = &poses[from..to];
        let touches: Vec<(Vector3<f64>, f64)> =
            of.iter().filter(|pose| pose.stands).filter_map(touch).collect();
        let stood = 2 * touches.len() > of.len() && !of.is_empty();
        let seen = if touches.is_empty() { of.iter().filter_map(touch).collect() } else { touches };
        if seen.is_empty() || instrument.tip_b_m.is_none() {
            continue;
        }
        let count = seen.len() as f64;
        let sum: Vector3<f64> = seen.iter().map(|(touch, _)| touch).sum();
        let tilt_rad = seen.iter().map(|(_, tilt)| tilt).sum::<f64>() / count;
        visits.push(VisitOfPoint { stop: number, p_n_m: sum / count, stood, tilt_rad });
    }
    visits
}

/// Where the tip touches the ground, or would, and how the pole leans.
fn touch(pose: &Pose) -> Option<(Vector3<f64>, f64)> {
    let tip_b_m = pose.tip_b_m?;
    let up_n = pose.c_nb * (pose.antenna_b_m - tip_b_m).normalize();
    let lean_n = Vector3::new(up_n.x, up_n.y, 0.0);
    let touch_n_m = pose.p_n + pose.c_nb * tip_b_m - lean_n * pose.roundness_m;
    Some((touch_n_m, libm::asin(lean_n.norm().min(1.0))))
}

pub(super) fn row(pose: &Pose, looks: &[i64], covariances: &[Matrix4<f64>]) -> Row {
    let tip = pose.tip_b_m.map(|tip_b_m| pose.p_n + pose.c_nb * tip_b_m);
    // Between two looks variances lie on a line.
    let next = pose.after.min(covariances.len() - 1);
    let last = next.saturating_sub(1);
    let share = (pose.t_ns - looks[last]) as f64 / (looks[next] - looks[last]).max(1) as f64;
    let share = share.clamp(0.0, 1.0);
    let covariance = covariances[last] * (1.0 - share) + covariances[next] * share;
    let sigma = |axis: usize| covariance[(axis, axis)].max(0.0).sqrt();
    Row {
        t_ns: pose.t_ns,
        tip_n_m: tip.map(Into::into),
        antenna_n_m: (pose.p_n + pose.c_nb * pose.antenna_b_m).into(),
        sigma_n_m: [sigma(0), sigma(1), sigma(2)],
        covariance_en_m2: covariance[(0, 1)],
        heading_rad: azimuth(pose.c_nb[(0, 0)], pose.c_nb[(1, 0)]),
        sigma_heading_rad: sigma(3),
        contact: pose.stands,
    }
}
