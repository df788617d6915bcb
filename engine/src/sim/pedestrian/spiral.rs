//! FAST's inspection road, with stops beside actuators.

use nalgebra::Vector3;

use super::gait::{Gait, SENSOR_HEIGHT_M};
use super::path::Path;
use super::plan::{Course, Leg, Stop};
use super::walk::{STANDING_START_S, Walker};
use crate::geo::Site;
use crate::geo::terrain::{Anchor, anchors, road};
use crate::sim::jet::Jet;
use crate::sim::random::{Purpose, Random};

/// How far apart the visited actuators are along the road, m, how many they are, and how long an
/// inspector stops at each, s.
const VISIT_EVERY_M: f64 = 150.0;
const VISITS: usize = 22;
const VISIT_S: f64 = 12.0;
/// Of the stretches between visits, the share with a pause in it; how long it is, s; and how far from
/// any actuator, m.
const PAUSES_SHARE: f64 = 0.4;
const PAUSE_S: (f64, f64) = (6.0, 20.0);
const CLEAR_OF_ACTUATORS_M: f64 = 3.0;
/// The spiral lasts so long: 270,000 epochs at 100 Hz.
const SPIRAL_S: f64 = 2700.0;

/// FAST's road. Every 150 m the inspector leaves it to stand beside an anchor: a metre (1σ on each
/// axis) from it, the ground being where the feet then are. With `pauses` there are stops on the road
/// as well, from a stream of their own.
pub(super) fn spiral(seed: u64, site: &Site, walker: &mut Walker, pauses: bool) -> Course {
    const SPACING_M: f64 = 0.5;
    let anchors = anchors(site);
    let mut random = Random::new(seed, Random::COMMON, Purpose::Course);
    let mut points: Vec<Vector3<f64>> = road(site, SPACING_M).into_iter().map(Vector3::from).collect();
    let centre_line = Path::from_points(points.iter().copied());
    let mut stops: Vec<(usize, Anchor)> = Vec::new();
    for number in 1..=VISITS {
        let target_m = number as f64 * VISIT_EVERY_M;
        let near_m = |index: usize| (centre_line.along_m(index) - target_m).abs() < 15.0;
        let nearby: Vec<usize> = (0..points.len()).filter(|&index| near_m(index)).collect();
        let distance_m = |anchor: &Anchor| {
            let position = Vector3::from(anchor.position_n_m);
            nearby
                .iter()
                .map(|&index| (centre_line.points_n_m()[index] - position).norm())
                .fold(f64::MAX, f64::min)
        };
        let nearest = anchors
            .iter()
            .min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))
            .expect("the dome has anchors");
        let beside = Vector3::from(nearest.position_n_m) + Vector3::from(random.normal_3())
            - Vector3::z() * SENSOR_HEIGHT_M;
        // Abreast of it on the road; from there the way bends to it and back within a few metres.
        let plan_m = |index: usize| (points[index] - beside).xy().norm();
        let abreast = nearby
            .iter()
            .copied()
            .min_by(|&a, &b| plan_m(a).total_cmp(&plan_m(b)))
            .expect("the road passes every 150 m");
        let aside = beside - points[abreast];
        // Height needs more room than a side step: the ground stays walkable.
        let (across_m, up_m) = (8.0, 8.0 + 10.0 * aside.z.abs());
        for (index, point) in points.iter_mut().enumerate() {
            let from_m = centre_line.along_m(index) - centre_line.along_m(abreast);
            let share = |half_m: f64| Jet::constant(0.5 + 0.5 * from_m / half_m).bump().value;
            let (across, up) = (share(across_m), share(up_m));
            *point += Vector3::new(aside.x * across, aside.y * across, aside.z * up);
        }
        stops.push((abreast, nearest.clone()));
    }
    points.truncate(stops.last().map_or(points.len(), |&(index, _)| index + 1));

    let path = Path::from_points(points);
    let mut legs: Vec<Leg> = stops
        .into_iter()
        .map(|(index, anchor)| Leg {
            until_m: path.along_m(index),
            gait: Gait::Walk,
            steps: None,
            stop: Some(Stop { seconds: VISIT_S + random.uniform(-1.5, 1.5), marker: Some(anchor) }),
        })
        .collect();
    if pauses {
        legs = with_pauses(legs, seed, &path, &anchors);
    }
    // The pace that fills the time: each stop costs the joining step and the slow first one, and a
    // few seconds are left to stand at the end.
    let stopped_s = STANDING_START_S
        + 10.0
        + legs
            .iter()
            .filter_map(|leg| leg.stop.as_ref())
            .map(|stop| stop.seconds + 0.58 * walker.cycle_s)
            .sum::<f64>();
    walker.step_m = 0.5 * walker.cycle_s * path.length_m() / (SPIRAL_S - stopped_s);
    Course {
        path,
        standing_start_s: STANDING_START_S,
        legs,
        stand_until_s: Some(SPIRAL_S),
        starts_at_origin: false,
    }
}

/// Puts pauses into some of the stretches between the visits.
fn with_pauses(visits: Vec<Leg>, seed: u64, path: &Path, anchors: &[Anchor]) -> Vec<Leg> {
    const TRIES: usize = 20;
    let mut random = Random::new(seed, Random::COMMON, Purpose::Pauses);
    let mut legs = Vec::with_capacity(2 * visits.len());
    let mut from_m = 0.0;
    for visit in visits {
        let until_m = visit.until_m;
        if random.uniform(0.0, 1.0) < PAUSES_SHARE {
            let seconds = random.uniform(PAUSE_S.0, PAUSE_S.1);
            let clear = (0..TRIES).find_map(|_| {
                let along_m = from_m + random.uniform(0.2, 0.8) * (until_m - from_m);
                let at = path.at(along_m).position_n_m;
                let is_clear = anchors.iter().all(|anchor| {
                    let [e_m, n_m, _] = anchor.position_n_m;
                    libm::hypot(e_m - at.x, n_m - at.y) >= CLEAR_OF_ACTUATORS_M
                });
                is_clear.then_some(along_m)
            });
            if let Some(along_m) = clear {
                legs.push(Leg {
                    until_m: along_m,
                    gait: Gait::Walk,
                    steps: None,
                    stop: Some(Stop { seconds, marker: None }),
                });
            }
        }
        legs.push(visit);
        from_m = until_m;
    }
    legs
}
