//! Visits at markers: told early or late, right or wrong.

use lodestep_engine::systems::pedestrian::Config;
use std::collections::BTreeMap;

use lodestep_engine::event::{Event, VisitOutcome};
use lodestep_engine::replay::InputStore;
use lodestep_engine::session::{Session, Solution, Visit};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};

use crate::scenario::{SECOND_NS, Scenario, short_walk};
use crate::told::Told;

/// The first two stops on the spiral road.
fn two_stops() -> Scenario {
    let scenario = Scenario::beginning(WalkKind::Spiral, 1, &SensorModel::cmp10a(), 290.0);
    assert_eq!(scenario.visits.len(), 2, "{:?}", scenario.visits);
    scenario
}

/// The scenario with every visit told `after_ns` after its end; before its start where negative.
fn told_at(scenario: &Scenario, after_ns: i64) -> Told {
    let early = Scenario { visits: Vec::new(), ..scenario.clone() };
    let (session, events) = early.session();
    told_to(session, events, scenario, after_ns)
}

fn told_to(mut session: Session, mut events: Vec<Event>, scenario: &Scenario, after_ns: i64) -> Told {
    let mut untold = scenario.visits.iter().peekable();
    for (foot, sample) in scenario.merge_by_time() {
        while let Some(visit) = untold.next_if(|visit| {
            let from_ns = if after_ns < 0 { visit.t_start_ns } else { visit.t_end_ns };
            sample.t_ns >= from_ns + after_ns
        }) {
            session.visit(visit.clone(), &mut events);
        }
        session.push(foot, &sample, &mut events);
    }
    session.finish(&mut events);
    Told::check(events, session.summary())
}

#[track_caller]
fn assert_same_track(found: &Told, expected: &Told) {
    let differs = found.track.points.iter().zip(&expected.track.points).position(|(a, b)| a != b);
    assert_eq!(differs, None, "the first point that differs");
    assert_eq!(found.track.visits, expected.track.visits);
    assert_eq!(found.track.sha256(), expected.track.sha256());
}

#[test]
fn a_visit_told_late_gives_the_track_of_one_told_early() {
    let scenario = two_stops();
    let expected = scenario.run();
    let accepted: Vec<bool> = expected.track.visits.iter().map(|visit| visit.accepted).collect();
    assert_eq!(accepted, [true, true], "{:?}", expected.track.visits);
    for after_ns in [-3 * SECOND_NS, 0, 4 * SECOND_NS, 17 * SECOND_NS] {
        assert_same_track(&told_at(&scenario, after_ns), &expected);
    }
}

/// Room for the past of a walk outside of its session.
#[derive(Default)]
struct Aside(BTreeMap<u64, Vec<u8>>);

impl InputStore for Aside {
    fn put(&mut self, number: u64, bytes: &[u8]) -> bool {
        self.0.insert(number, bytes.to_vec()).is_none()
    }

    fn get(&mut self, number: u64) -> Option<Vec<u8>> {
        self.0.get(&number).cloned()
    }

    fn forget_before(&mut self, number: u64) {
        self.0.retain(|kept, _| *kept >= number);
    }
}

#[test]
fn a_live_walk_whose_past_lies_elsewhere_is_the_same_to_the_last_bit() {
    let mut live = two_stops();
    live.config.solution = Solution::Trail;
    let early = Scenario { visits: Vec::new(), ..live.clone() };
    for after_ns in [0, 17 * SECOND_NS] {
        let (session, events) = early.session_with(Some(Box::new(Aside::default())));
        let aside = told_to(session, events, &live, after_ns);
        assert!(aside.track.revised_points > 25_000, "the trail was bent: {}", aside.track.revised_points);
        assert_same_track(&aside, &told_at(&live, after_ns));
    }
}

#[test]
fn a_visit_pulls_the_track_to_the_marker_and_makes_it_surer() {
    let scenario = two_stops();
    let (with, without) = (scenario.run(), Scenario { visits: Vec::new(), ..scenario.clone() }.run());
    for visit in &with.track.visits {
        let plan_m = |[e, n, _]: [f64; 3]| e.hypot(n);
        assert!(plan_m(visit.after_minus_marker_n_m) <= plan_m(visit.before_minus_marker_n_m), "{visit:?}");
    }
    let sigma_m = |told: &Told| told.last().sigma_n_m[0].hypot(told.last().sigma_n_m[1]);
    assert!(sigma_m(&with) < sigma_m(&without), "{} {}", sigma_m(&with), sigma_m(&without));
    assert!(with.summary.since_marker_s < 40.0 && without.summary.since_marker_s > 280.0);
}

#[test]
fn a_late_visit_while_running_gives_the_track_of_an_early_one() {
    // In running there is no moment at which both feet stand.
    let mut scenario = Scenario::beginning(WalkKind::Running, 2, &SensorModel::cmp10a(), 262.0);
    let truth = scenario.true_places();
    let t_ns = 247 * SECOND_NS;
    let [e_m, n_m, u_m] = truth[(t_ns / 10_000_000) as usize].position_m;
    scenario.visits = vec![visit("P1", t_ns, [e_m, n_m, u_m])];
    assert_same_track(&told_at(&scenario, 8 * SECOND_NS), &scenario.run());
}

#[test]
fn a_visit_older_than_the_history_is_turned_down_with_its_reason() {
    let scenario = two_stops();
    let told = told_at(&scenario, 60 * SECOND_NS);
    let without = Scenario { visits: Vec::new(), ..scenario.clone() }.run();
    assert_eq!(told.track.points, without.track.points, "the track is as if it had not been told");
    let outcome = &told.track.visits[0];
    assert!(!outcome.accepted && outcome.nis.is_nan() && outcome.degrees_of_freedom == 0, "{outcome:?}");
    assert!(outcome.reason.contains("in the past"), "{}", outcome.reason);
}

#[test]
fn a_visit_after_the_end_of_the_log_is_turned_down_with_its_reason() {
    let mut scenario = short_walk();
    scenario.visits = vec![visit("P1", 500 * SECOND_NS, [0.0, 30.0, 0.0])];
    let outcome = &scenario.run().track.visits[0];
    assert!(!outcome.accepted && outcome.reason.contains("after the end"), "{outcome:?}");
}

fn visit(marker: &str, t_ns: i64, [e_m, n_m, u_m]: [f64; 3]) -> Visit {
    Visit {
        marker: marker.to_owned(),
        t_start_ns: t_ns - SECOND_NS / 2,
        t_end_ns: t_ns + SECOND_NS / 2,
        position_n_m: (e_m, n_m, Some(u_m)),
    }
}

/// The short walk with visits at these times, s, off the truth by these offsets, m.
fn with_visits(offsets: &[(i64, [f64; 3])]) -> (Scenario, Vec<VisitOutcome>, Told) {
    let mut scenario = short_walk();
    let truth = scenario.true_places();
    for (t_s, offset) in offsets {
        let there = truth[*t_s as usize * 100].position_m;
        let position = [0, 1, 2].map(|axis| there[axis] + offset[axis]);
        scenario.visits.push(visit(&format!("at {t_s} s"), t_s * SECOND_NS, position));
    }
    let told = scenario.run();
    (scenario, told.track.visits.clone(), told)
}

#[test]
fn a_marker_a_hundred_metres_off_is_turned_down_and_changes_nothing() {
    let (_, visits, told) = with_visits(&[(30, [100.0, 0.0, 0.0])]);
    assert!(!visits[0].accepted && visits[0].nis > 35.0, "{:?}", visits[0]);
    assert_eq!(visits[0].after_minus_marker_n_m, visits[0].before_minus_marker_n_m);
    assert!((visits[0].before_minus_marker_n_m[0] + 100.0).abs() < 3.0, "{:?}", visits[0]);
    assert!(visits[0].reason.contains("wrong marker"), "{}", visits[0].reason);
    let end = told.last().position_n_m;
    let untouched = short_walk().run().last().position_n_m;
    // To be weighed it brings the covariance up to its moment, so what comes next is cut into other pieces.
    assert!((0..3).all(|axis| (end[axis] - untouched[axis]).abs() < 1e-2), "{end:?} {untouched:?}");
}

#[test]
fn a_second_marker_that_says_the_same_is_believed() {
    let (_, visits, told) = with_visits(&[(25, [60.0, 80.0, 0.0]), (32, [61.0, 79.0, 0.0])]);
    assert_eq!(visits.iter().map(|visit| visit.accepted).collect::<Vec<_>>(), [false, true], "{visits:?}");
    assert!(visits[1].nis > 35.0, "{:?}", visits[1]);
    let [e, n, _] = visits[1].after_minus_marker_n_m;
    assert!(e.hypot(n) < 3.0, "{:?}", visits[1]);
    let [e, n, _] = told.last().position_n_m;
    assert!((e - 61.0).abs() < 4.0 && (n - 109.0).abs() < 4.0, "{e} {n}");
}

#[test]
fn a_right_marker_after_a_wrong_one_is_believed_and_a_wrong_one_after_it_is_not() {
    let (scenario, visits, told) =
        with_visits(&[(24, [100.0, 0.0, 0.0]), (28, [0.4, -0.3, 0.0]), (33, [100.0, 0.0, 0.0])]);
    let accepted: Vec<bool> = visits.iter().map(|visit| visit.accepted).collect();
    assert_eq!(accepted, [false, true, false], "{visits:?}");
    assert!(told.errors(&scenario).end_error_m < 2.0);
}

#[test]
fn a_marker_without_a_height_leaves_the_height_alone() {
    let mut scenario = short_walk();
    let without = scenario.run();
    let truth = scenario.true_places()[3_000].position_m;
    scenario.visits =
        vec![Visit { position_n_m: (truth[0], truth[1], None), ..visit("P1", 30 * SECOND_NS, truth) }];
    let told = scenario.run();
    let outcome = &told.track.visits[0];
    assert_eq!((outcome.accepted, outcome.degrees_of_freedom), (true, 2), "{outcome:?}");
    assert_eq!(outcome.before_minus_marker_n_m[2], 0.0);
    let (with_up, without_up) = (told.last().position_n_m[2], without.last().position_n_m[2]);
    assert!((with_up - without_up).abs() < 0.02, "{with_up} {without_up}");
}

#[test]
fn without_the_markers_aid_a_visit_only_shows_how_far_off_the_track_is() {
    let mut scenario = two_stops();
    Config::of_mut(&mut scenario.config).aids.markers = false;
    let told = scenario.run();
    let without = Scenario { visits: Vec::new(), ..scenario.clone() }.run();
    assert_eq!(told.track.points, without.track.points);
    assert_eq!(told.track.visits.len(), 2);
    for visit in &told.track.visits {
        assert!(!visit.accepted && visit.reason.contains("not among the aids"), "{visit:?}");
        assert!(visit.before_minus_marker_n_m[0].hypot(visit.before_minus_marker_n_m[1]) < 20.0, "{visit:?}");
    }
}
