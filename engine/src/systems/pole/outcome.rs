//! What poses come to: rows of the track, and where the tip stood at each stop.

use nalgebra::{Matrix4, Vector3};

use super::pass::Pose;
use super::points::VisitOfPoint;
use super::recording::{Instrument, Recording};
use super::survey::Row;
use crate::rotation::azimuth;

/// A stop is looked at in so many parts.
const MOST_PARTS: usize = 12;
/// A tip that stays moves by no more than this in a stop, m: five times what the filter takes the ground to creep by in ten
/// seconds.
const STAYS_WITHIN_M: f64 = 0.015;

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
        let moved_m = moved(&seen);
        // A tip that slips was put on the point before: where it stood first is the likelier place.
        let meant = if moved_m > 0.0 { &seen[..first_place(&seen)] } else { &seen[..] };
        let p_n_m = mean(meant);
        let tilt_rad = meant.iter().map(|(_, tilt)| tilt).sum::<f64>() / meant.len() as f64;
        visits.push(VisitOfPoint { stop: number, p_n_m, stood, moved_m, tilt_rad });
    }
    visits
}

/// How far apart the means of two parts of a stop are, m; zero where that is no more than a round tip, soft ground and a hand
/// make.
fn moved(seen: &[(Vector3<f64>, f64)]) -> f64 {
    let means: Vec<Vector3<f64>> = seen.chunks(part_of(seen)).map(mean).collect();
    let apart = means.iter().flat_map(|a| means.iter().map(move |b| (a - b).norm()));
    Some(apart.fold(0.0, f64::max)).filter(|moved_m| *moved_m > STAYS_WITHIN_M).unwrap_or(0.0)
}

/// How many looks of a stop come before its tip has moved; all where it never does.
fn first_place(seen: &[(Vector3<f64>, f64)]) -> usize {
    let part = part_of(seen);
    let first = mean(&seen[..part.min(seen.len())]);
    let stays = seen.chunks(part).take_while(|part| (mean(part) - first).norm() <= STAYS_WITHIN_M);
    stays.map(<[_]>::len).sum()
}

fn part_of(seen: &[(Vector3<f64>, f64)]) -> usize {
    seen.len().div_ceil(MOST_PARTS).max(1)
}

fn mean(seen: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
    seen.iter().map(|(touch, _)| touch).sum::<Vector3<f64>>() / seen.len() as f64
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_that_trembles_stays_and_one_that_slips_has_moved() {
        let at = |k: usize, east_m: f64| {
            let tremble = 0.002 * libm::sin(k as f64);
            (Vector3::new(east_m + tremble, tremble, 0.0), 0.1)
        };
        let trembles: Vec<_> = (0..100).map(|k| at(k, 0.0)).collect();
        assert_eq!(moved(&trembles), 0.0);
        let slips: Vec<_> = (0..100).map(|k| at(k, if k < 30 { 0.0 } else { 0.1 })).collect();
        assert!((moved(&slips) - 0.1).abs() < 0.005, "{}", moved(&slips));
        assert!((mean(&slips[..first_place(&slips)]) - Vector3::zeros()).norm() < 0.005);
        assert_eq!(moved(&[]), 0.0);
    }
}
