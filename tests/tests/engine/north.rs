//! A walk of which nothing says where north is: known places some metres apart tell how it is turned, from its start on.

#![allow(clippy::print_stdout, reason = "the figures are what an engineer runs these for")]

use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::session::{Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::sim::white_noise;
use lodestep_engine::systems::pedestrian::contradictions::MARKERS_DISAGREE;
use lodestep_engine::systems::pedestrian::{Config, Side};
use nalgebra::{Matrix2, Rotation2, Vector2};

use crate::scenario::{SECOND_NS, Scenario};
use crate::told::Told;

/// 60 m around a block without a magnetometer; a visit at each of these times, s.
fn without_a_compass(seed: u64, times_s: &[i64]) -> Scenario {
    let walk = WalkKind::Block { metres: 60.0 };
    let mut scenario = Scenario::simulated(walk, seed, &SensorModel::cmp10a());
    for foot in Side::BOTH {
        scenario = scenario.with_samples(foot, |_, sample| sample.mag_b_ut = None);
    }
    Config::of_mut(&mut scenario.config).tuning.marker_sigma_m = 0.1;
    let truth = scenario.true_places();
    scenario.visits = times_s
        .iter()
        .map(|t_s| {
            let [e_m, n_m, u_m] = truth[(t_s * 100) as usize].position_m;
            let t_ns = t_s * SECOND_NS;
            let marker = format!("at {t_s} s");
            Visit { marker, t_start_ns: t_ns, t_end_ns: t_ns, position_n_m: (e_m, n_m, Some(u_m)) }
        })
        .collect();
    scenario
}

fn smoothed(scenario: &Scenario) -> Told {
    let mut scenario = scenario.clone();
    scenario.config.solution = Solution::Smoothed;
    scenario.run()
}

fn off_m(scenario: &Scenario, points: &[TrackPoint]) -> Vec<f64> {
    let truth = scenario.true_places();
    let plan = |p: &[f64; 3]| Vector2::new(p[0], p[1]);
    points
        .iter()
        .zip(&truth)
        .map(|(point, t)| (plan(&point.position_n_m) - plan(&t.position_m)).norm())
        .collect()
}

/// Error squared over its own covariance, by degree of freedom.
fn normalised(point: &TrackPoint, truth: &[f64; 3]) -> f64 {
    let off = Vector2::new(point.position_n_m[0] - truth[0], point.position_n_m[1] - truth[1]);
    let [e, n, _] = point.sigma_n_m;
    let covariance = Matrix2::new(e * e, point.covariance_en_m2, point.covariance_en_m2, n * n);
    (off.transpose() * covariance.try_inverse().expect("a covariance") * off)[0] / 2.0
}

fn disagreements(told: &Told) -> usize {
    told.track.anomalies.iter().filter(|anomaly| anomaly.kind == MARKERS_DISAGREE).count()
}

/// The markers of a scenario, turned about the start by so much.
fn turned(scenario: &Scenario, rad: f64, which: impl Fn(usize) -> bool) -> Scenario {
    let mut other = scenario.clone();
    let [start_e, start_n, _] = scenario.config.initial_position_n_m;
    let start = Vector2::new(start_e, start_n);
    for (k, visit) in other.visits.iter_mut().enumerate().filter(|(k, _)| which(*k)) {
        let (e_m, n_m, up_m) = visit.position_n_m;
        let place = start + Rotation2::new(rad) * (Vector2::new(e_m, n_m) - start);
        visit.position_n_m = (place.x, place.y, up_m);
        visit.marker = format!("{} {k}", visit.marker);
    }
    other
}

#[test]
fn a_start_and_a_marker_turn_the_walk_and_the_smoothed_one_is_right_from_its_first_step() {
    let scenario = without_a_compass(1, &[30, 50]);
    let (filtered, smoothed) = (scenario.run(), smoothed(&scenario));
    assert!(filtered.track.visits.iter().all(|visit| visit.accepted), "{:?}", filtered.track.visits);
    let (as_known, hindsight) =
        (off_m(&scenario, &filtered.track.points), off_m(&scenario, &smoothed.track.points));
    // Before the first marker the walk may go any way, and its sigma says so; after it both are right.
    let largest = |off: &[f64]| off.iter().copied().fold(0.0, f64::max);
    assert!(largest(&as_known[..2_500]) > 5.0);
    assert!(filtered.track.points[2_500].sigma_n_m[0] > 5.0);
    assert!(largest(&as_known[3_100..]) < 1.0, "{}", largest(&as_known[3_100..]));
    assert!(largest(&hindsight) < 0.6, "{}", largest(&hindsight));
    assert!(smoothed.track.points.iter().all(|point| point.sigma_n_m[0] < 0.6));
    assert_eq!(disagreements(&filtered), 0);
}

#[test]
fn turned_markers_give_the_same_walk_turned() {
    let scenario = without_a_compass(2, &[30, 50]);
    let own = smoothed(&scenario);
    let [start_e, start_n, _] = scenario.config.initial_position_n_m;
    let start = Vector2::new(start_e, start_n);
    for rad in [0.5, 2.0, 3.1, -1.2] {
        let other = smoothed(&turned(&scenario, rad, |_| true));
        for (a, b) in own.track.points.iter().zip(&other.track.points) {
            let place =
                |point: &TrackPoint| Vector2::new(point.position_n_m[0], point.position_n_m[1]) - start;
            let apart = (Rotation2::new(rad) * place(a) - place(b)).norm();
            // Not to the bit: the noise that grows with the motion is taken axis by axis of n.
            assert!(apart < 0.03, "{rad} rad: {apart} m at {} s", a.t_ns as f64 * 1e-9);
            assert!((a.position_n_m[2] - b.position_n_m[2]).abs() < 0.01);
        }
    }
}

#[test]
fn a_marker_that_no_turn_reaches_is_turned_down() {
    let mut scenario = without_a_compass(1, &[30, 40, 50]);
    scenario.visits[0].position_n_m.0 += 40.0;
    let told = scenario.run();
    let accepted: Vec<bool> = told.track.visits.iter().map(|visit| visit.accepted).collect();
    assert_eq!(accepted, [false, true, true]);
    let off = off_m(&scenario, &told.track.points);
    assert!(off[off.len() - 1] < 1.0, "{}", off[off.len() - 1]);
}

#[test]
fn a_first_marker_that_turns_the_walk_wrongly_is_outvoted_and_that_is_said() {
    let scenario = without_a_compass(1, &[26, 33, 42, 50]);
    let wrong = turned(&scenario, 1.0, |k| k == 0);
    let (filtered, smoothed) = (wrong.run(), smoothed(&wrong));
    assert!(disagreements(&filtered) >= 1);
    for told in [&filtered, &smoothed] {
        let off = off_m(&wrong, &told.track.points);
        let end = told.last();
        assert!(off[off.len() - 1] < 0.6 && end.sigma_n_m[0] < 1.0, "{} {end:?}", off[off.len() - 1]);
    }
    let largest = off_m(&wrong, &smoothed.track.points).into_iter().fold(0.0, f64::max);
    assert!(largest < 0.8, "{largest}");
    // One against one: neither is believed, and the sigma says so.
    let mut undecided = wrong.clone();
    undecided.visits.truncate(2);
    for told in [undecided.run(), self::smoothed(&undecided)] {
        assert_eq!(disagreements(&told), 1);
        let (k, truth) = (4_000, undecided.true_places());
        assert!(normalised(&told.track.points[k], &truth[k].position_m) < 9.0, "{:?}", told.track.points[k]);
        assert!(told.track.points[k].sigma_n_m[0] > 3.0);
    }
}

#[test]
fn a_visit_that_is_keyed_in_late_gives_the_same_track() {
    let scenario = without_a_compass(3, &[30, 38, 50]);
    for solution in [Solution::Filtered, Solution::Trail, Solution::Smoothed] {
        let mut scenario = scenario.clone();
        scenario.config.solution = solution;
        let in_time = scenario.run();
        let mut late = scenario.clone();
        late.visits.clear();
        let (mut session, mut events) = late.session();
        for (foot, sample) in scenario.merge_by_time() {
            session.push(foot, &sample, &mut events);
            let newest_ns = sample.t_ns;
            for visit in scenario.visits.iter().filter(|visit| visit.t_end_ns + 9 * SECOND_NS == newest_ns) {
                if foot == Side::Left {
                    session.visit(visit.clone(), &mut events);
                }
            }
        }
        session.finish(&mut events);
        assert!(events.iter().filter(|event| matches!(event, Event::Visit(_))).count() >= 3);
        let late = Told::check(events, session.summary());
        let differs = in_time.track.points.iter().zip(&late.track.points).position(|(a, b)| a != b);
        // The trail is smoothed at the time at which a visit comes.
        match solution {
            Solution::Trail => assert_eq!(in_time.last(), late.last()),
            _ => assert_eq!(differs, None, "{solution:?}"),
        }
    }
}

#[test]
fn a_live_trail_is_turned_back_to_its_start() {
    let mut scenario = without_a_compass(1, &[30, 50]);
    scenario.config.solution = Solution::Trail;
    let off = off_m(&scenario, &scenario.run().track.points);
    let largest = off[..3_000].iter().copied().fold(0.0, f64::max);
    assert!(largest < 0.8, "{largest}");
}

#[test]
fn a_walk_turned_by_markers_is_as_wrong_as_it_says() {
    const SEEDS: u64 = 12;
    let (mut after, mut middle, mut end) = (0.0, 0.0, 0.0);
    for seed in 0..SEEDS {
        let mut scenario = without_a_compass(seed, &[30]);
        let mut normal = white_noise(seed);
        for visit in &mut scenario.visits {
            // As far beside the marker as the filter is told.
            visit.position_n_m.0 += 0.1 * normal();
            visit.position_n_m.1 += 0.1 * normal();
        }
        let truth = scenario.true_places();
        let (filtered, smoothed) = (scenario.run(), smoothed(&scenario));
        let of = |told: &Told, k: usize| normalised(&told.track.points[k], &truth[k].position_m);
        after += of(&filtered, 4_000);
        middle += of(&smoothed, 2_000);
        end += of(&filtered, truth.len() - 1);
    }
    for (what, sum) in [("after the marker", after), ("before it, smoothed", middle), ("end", end)] {
        let nees = sum / SEEDS as f64;
        println!("{what}: {nees:.2}");
        assert!((0.15..2.5).contains(&nees), "{what}: {nees}");
    }
}
