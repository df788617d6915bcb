//! The smoothed track: nearer to the truth, without a jump, as sure as it may be, and the same however it
//! is come by.

#![allow(clippy::print_stdout, reason = "the figures are what an engineer runs these for")]

use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::session::{Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use nalgebra::{Matrix2, Vector2, Vector3};

use crate::scenario::{SECOND_NS, Scenario, short_walk};
use crate::told::Told;

fn smoothed(scenario: &Scenario) -> Told {
    let mut scenario = scenario.clone();
    scenario.config.solution = Solution::Smoothed;
    scenario.run()
}

/// Largest step from one epoch to the next of the middle of the feet beyond what the truth moved, within
/// five seconds of a visit, m.
fn largest_jump_m(scenario: &Scenario, points: &[TrackPoint]) -> f64 {
    let truth = scenario.true_places();
    let off: Vec<(i64, Vector3<f64>)> = points
        .iter()
        .zip(&truth)
        .map(|(point, truth)| {
            (point.t_ns, Vector3::from(point.position_n_m) - Vector3::from(truth.position_m))
        })
        .collect();
    let near = |t_ns: i64| {
        scenario
            .visits
            .iter()
            .any(|visit| (visit.t_start_ns - 5 * SECOND_NS..visit.t_end_ns + 5 * SECOND_NS).contains(&t_ns))
    };
    off.windows(2).filter(|w| near(w[0].0)).map(|w| (w[1].1 - w[0].1).norm()).fold(0.0, f64::max)
}

/// A walk to and past a marker, that is visited by a made-up inspector at these times, s.
fn with_visits(mut scenario: Scenario, times_s: &[i64]) -> Scenario {
    for t_s in times_s {
        let truth = &scenario.truth[(t_s * 100) as usize];
        let middle = |axis: usize| 0.5 * (truth[0].position_n_m[axis] + truth[1].position_n_m[axis]);
        scenario.visits.push(Visit {
            marker: format!("at {t_s} s"),
            t_start_ns: t_s * SECOND_NS,
            t_end_ns: t_s * SECOND_NS,
            position_n_m: (middle(0) + 1.0, middle(1) - 0.5, Some(middle(2))),
        });
    }
    scenario
}

#[test]
fn a_smoothed_track_bends_to_its_markers_without_a_jump_and_is_never_less_sure() {
    let scenario = Scenario::beginning(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 400.0);
    assert!(scenario.visits.len() >= 2);
    let (filtered, smoothed) = (scenario.run(), smoothed(&scenario));
    assert_eq!(filtered.track.points.len(), smoothed.track.points.len());
    let (before, after) = (filtered.errors(&scenario), smoothed.errors(&scenario));
    let jumps = [&filtered, &smoothed].map(|told| largest_jump_m(&scenario, &told.track.points));
    println!(
        "400 s of the spiral: {:.2} m filtered, {:.2} m smoothed; jumps {jumps:?} m",
        before.horizontal.rms_m, after.horizontal.rms_m
    );
    assert!(after.horizontal.rms_m < before.horizontal.rms_m && after.horizontal.rms_m < 1.5);
    assert!(jumps[1] < 0.05 && jumps[0] > 0.3, "{jumps:?}");
    for (filtered, smoothed) in filtered.track.points.iter().zip(&smoothed.track.points) {
        let sigmas = |point: &TrackPoint| {
            let [e, n, u] = point.sigma_n_m;
            [e, n, u, point.sigma_heading_rad]
        };
        for (filtered, smoothed) in sigmas(filtered).into_iter().zip(sigmas(smoothed)) {
            assert!(smoothed < filtered * 1.001, "{smoothed} and {filtered}");
        }
    }
    assert_eq!(filtered.last(), smoothed.last(), "at the end the smoother knows what the filter knows");
}

#[test]
fn a_visit_that_was_told_late_gives_the_very_track_of_one_that_was_told_in_time() {
    let mut scenario = with_visits(short_walk(), &[20, 30]);
    scenario.config.solution = Solution::Smoothed;
    let in_time = scenario.run();
    let visits = std::mem::take(&mut scenario.visits);
    let (mut session, mut events) = scenario.session();
    let mut late = visits.into_iter().peekable();
    for (foot, sample) in scenario.merge_by_time() {
        session.push(foot, &sample, &mut events);
        while let Some(visit) = late.next_if(|visit| sample.t_ns >= visit.t_end_ns + 7 * SECOND_NS) {
            session.visit(visit, &mut events);
        }
    }
    session.finish(&mut events);
    let told_late = Told::check(events, session.summary());
    assert!(told_late.track.visits.iter().all(|visit| visit.accepted) && told_late.track.visits.len() == 2);
    assert_eq!(told_late.track.points, in_time.track.points);
}

#[test]
fn one_foot_is_smoothed_too() {
    let foot = lodestep_engine::systems::pedestrian::Side::Right;
    let scenario = with_visits(short_walk().with_true_heading().with_one_foot(foot), &[]);
    let (filtered, smoothed) = (scenario.run(), smoothed(&scenario));
    assert_eq!(filtered.last(), smoothed.last());
    assert!(smoothed.errors(&scenario).horizontal.max_m < 2.0);
}

#[test]
fn a_live_trail_bends_at_a_visit_and_goes_on_where_it_was() {
    let mut scenario = with_visits(short_walk(), &[]);
    scenario.config.solution = Solution::Trail;
    let visit = with_visits(short_walk(), &[30]).visits.remove(0);
    let (mut session, mut events) = scenario.session();
    for (foot, sample) in scenario.merge_by_time() {
        if sample.t_ns == 36 * SECOND_NS && foot == lodestep_engine::systems::pedestrian::Side::Left {
            session.visit(visit.clone(), &mut events);
            let Some(Event::Revision { points }) = events.last() else { panic!("the trail bends") };
            assert!(points[0].t_ns < SECOND_NS / 10, "from its start");
            let steps = points
                .windows(2)
                .map(|w| (Vector3::from(w[1].position_n_m) - Vector3::from(w[0].position_n_m)).norm());
            assert!(steps.fold(0.0, f64::max) < 0.06, "and has no jump");
        }
        session.push(foot, &sample, &mut events);
    }
    session.finish(&mut events);
    let told = Told::check(events, session.summary());
    let largest = told
        .track
        .points
        .windows(2)
        .map(|w| (Vector3::from(w[1].position_n_m) - Vector3::from(w[0].position_n_m)).norm());
    assert!(largest.fold(0.0, f64::max) < 0.06, "nor has the trail that the map shows");
    let marked = told.track.points.iter().find(|point| point.t_ns == 30 * SECOND_NS).unwrap();
    let (e_m, n_m, _) = visit.position_n_m;
    let [e, n, _] = marked.position_n_m;
    assert!((e - e_m).hypot(n - n_m) < 1.5);
}

#[test]
fn the_smoothed_track_knows_how_wrong_it_is() {
    let (mut sum, mut height, mut count) = (0.0, 0.0, 0.0);
    for seed in 1..=50 {
        let scenario = Scenario::simulated(WalkKind::Line { metres: 40.0 }, seed, &SensorModel::cmp10a());
        let scenario = with_visits(scenario, &[40]);
        let told = smoothed(&scenario);
        let truth = scenario.true_places();
        for second in [12, 18, 24, 30, 36] {
            let (point, truth) = (&told.track.points[second * 100], truth[second * 100].position_m);
            let off = Vector2::new(point.position_n_m[0] - truth[0], point.position_n_m[1] - truth[1]);
            let [e, n, u] = point.sigma_n_m;
            let covariance = Matrix2::new(e * e, point.covariance_en_m2, point.covariance_en_m2, n * n);
            sum += (off.transpose() * covariance.try_inverse().unwrap() * off)[0] / 2.0;
            height += ((point.position_n_m[2] - truth[2]) / u).powi(2);
            count += 1.0;
        }
    }
    let (plan, height) = (sum / count, height / count);
    println!("smoothed, 50 seeds of 40 m: plan {plan:.2}, height {height:.2}, where 1 is honest");
    assert!((1.0 / 36.0..9.0).contains(&plan) && (1.0 / 36.0..9.0).contains(&height));
}
