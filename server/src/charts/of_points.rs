//! What a track shows: how sure it is, its heading and height, its speed, the stance and distance of its parts.

use std::collections::VecDeque;

use lodestep_engine::event::{MOST_PARTS, TrackPoint};
use lodestep_engine::rotation::wrap;
use lodestep_engine::system::Declaration;

use super::cells::{CELL_NS, Cells};
use crate::store::charts::Series;
use crate::store::track::TrackKind;

/// A speed is the way of so long, ns.
const SPEED_OVER_NS: i64 = 1_000_000_000;

/// The charts that a run has; the others are of the main run alone.
const OF_EACH_RUN: [&str; 5] = ["sigma_plan", "sigma_up", "sigma_heading", "heading", "height"];

/// A run's points, oldest first, cut into cells. A heading goes on beyond a full turn: a line that jumps from
/// 180° to −180° has no smallest and largest value.
pub(crate) fn of_points(system: &Declaration, run: TrackKind, points: &[TrackPoint]) -> Vec<Series> {
    let mut of_run: [Cells; 5] = std::array::from_fn(|_| Cells::new(CELL_NS));
    let mut stance: [Cells; MOST_PARTS] = std::array::from_fn(|_| Cells::new(CELL_NS));
    let [mut speed, mut separation] = std::array::from_fn(|_| Cells::new(CELL_NS));
    let mut heading_rad = points.first().map_or(0.0, |point| point.heading_rad);
    let mut recent: VecDeque<(i64, [f64; 3])> = VecDeque::new();
    for point in points {
        let t_ns = point.t_ns;
        heading_rad += wrap(point.heading_rad - heading_rad);
        let [sigma_e_m, sigma_n_m, sigma_u_m] = point.sigma_n_m;
        let values = [
            sigma_e_m.hypot(sigma_n_m),
            sigma_u_m,
            point.sigma_heading_rad,
            heading_rad,
            point.position_n_m[2],
        ];
        for (cells, value) in of_run.iter_mut().zip(values) {
            cells.take(t_ns, value);
        }
        if run != TrackKind::Main {
            continue;
        }
        for (cells, part) in stance.iter_mut().zip(point.parts) {
            if let Some(part) = part {
                cells.take(t_ns, f64::from(u8::from(part.stance)));
            }
        }
        if let [Some(first), Some(second)] = point.parts {
            separation.take(t_ns, in_plan_m(&first.position_n_m, &second.position_n_m));
        }
        while recent.front().is_some_and(|(then_ns, _)| t_ns - then_ns > SPEED_OVER_NS) {
            recent.pop_front();
        }
        if let Some((then_ns, then_m)) =
            recent.front().filter(|(then_ns, _)| t_ns - then_ns > SPEED_OVER_NS / 2)
        {
            speed.take(t_ns, in_plan_m(then_m, &point.position_n_m) / ((t_ns - then_ns) as f64 * 1e-9));
        }
        recent.push_back((t_ns, point.position_n_m));
    }
    let lines =
        OF_EACH_RUN.into_iter().zip(of_run).map(|(chart, cells)| cells.into_series(chart, run.name()));
    let standing = system.parts.iter().zip(stance).filter(|(part, _)| part.has_stance);
    let standing = standing.map(|(part, cells)| cells.into_series("stance", part.name));
    let main = [speed.into_series("speed", run.name()), separation.into_series("separation", run.name())];
    lines.chain(standing).chain(main).flatten().collect()
}

fn in_plan_m(from_m: &[f64; 3], to_m: &[f64; 3]) -> f64 {
    (to_m[0] - from_m[0]).hypot(to_m[1] - from_m[1])
}

#[cfg(test)]
mod tests {
    use lodestep_engine::event::Part;
    use lodestep_engine::systems::catalogue;

    use super::*;

    fn point(t_ns: i64, e_m: f64, heading_rad: f64) -> TrackPoint {
        let part = |n_m, stance| Some(Part { position_n_m: [e_m, n_m, 0.0], stance });
        TrackPoint {
            t_ns,
            position_n_m: [e_m, 0.0, -3.0],
            heading_rad,
            sigma_heading_rad: 0.1,
            sigma_n_m: [3.0, 4.0, 1.5],
            covariance_en_m2: 0.0,
            tilt: None,
            parts: [part(0.1, t_ns % 200_000_000 == 0), part(-0.1, false)],
        }
    }

    #[test]
    fn a_walk_of_a_metre_a_second_that_turns_about_is_cut_into_cells() {
        let turning = |k: i64| wrap(3.0 + 0.05 * k as f64);
        let points: Vec<_> = (0..30).map(|k| point(k * 100_000_000, k as f64 * 0.1, turning(k))).collect();
        let all = of_points(catalogue::usual(), TrackKind::Main, &points);
        let line = |chart: &str, name: &str| {
            all.iter().find(|series| series.chart == chart && series.name == name).unwrap()
        };
        assert!(line("speed", "main").low.iter().filter(|v| v.is_finite()).all(|v| (v - 1.0).abs() < 1e-5));
        assert!(line("separation", "main").high.iter().all(|v| (v - 0.2).abs() < 1e-6));
        assert!(line("sigma_plan", "main").high.iter().all(|v| (v - 5.0).abs() < 1e-6));
        assert_eq!(line("stance", "left").high[..3], [1.0, 0.0, 1.0]);
        // On beyond half a turn, without a jump.
        let heading = &line("heading", "main").low;
        assert!(heading.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 1e-4), "{heading:?}");
        assert!(
            of_points(catalogue::usual(), TrackKind::Filtered, &points)
                .iter()
                .all(|series| series.name == "filtered")
        );
        assert!(of_points(catalogue::usual(), TrackKind::Main, &[]).is_empty());
    }
}
