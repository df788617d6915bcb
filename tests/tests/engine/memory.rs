//! A live session runs all day: what it holds must not grow with the hours.

use lodestep_engine::session::Session;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Config;

use crate::scenario::{SECOND_NS, Scenario};

/// How much a session holds, by the length of its debug form: every sample, step and checkpoint
/// that it keeps is spelt out there.
fn held(session: &Session) -> usize {
    format!("{session:?}").len()
}

/// What the session holds at each of these times, s.
fn held_at(scenario: &Scenario, times_s: &[i64]) -> Vec<usize> {
    let (mut session, mut events) = scenario.session();
    let mut sizes = Vec::new();
    for (foot, sample) in scenario.merge_by_time() {
        if times_s.get(sizes.len()).is_some_and(|t_s| sample.t_ns >= t_s * SECOND_NS) {
            sizes.push(held(&session));
        }
        session.push(foot, &sample, &mut events);
        events.clear();
    }
    assert_eq!(sizes.len(), times_s.len());
    sizes
}

fn with_a_short_history(kind: WalkKind, seconds: f64) -> Scenario {
    let mut scenario = Scenario::beginning(kind, 1, &SensorModel::cmp10a(), seconds);
    Config::of_mut(&mut scenario.config).tuning.history_s = 10.0;
    scenario.visits.clear();
    scenario
}

#[test]
fn a_standing_session_holds_no_more_after_two_minutes_than_after_one() {
    let scenario = with_a_short_history(WalkKind::Standing { seconds: 130.0 }, 130.0);
    let sizes = held_at(&scenario, &[60, 120]);
    assert!(sizes[1] < sizes[0] * 13 / 10, "{sizes:?}");
}

#[test]
fn a_walking_session_holds_no_more_after_two_minutes_than_after_one() {
    let scenario = with_a_short_history(WalkKind::Rectangle, 130.0);
    let sizes = held_at(&scenario, &[60, 120]);
    assert!(sizes[1] < sizes[0] * 13 / 10, "{sizes:?}");
}

#[test]
fn a_session_whose_second_foot_fell_silent_does_not_hoard_the_other_s_samples() {
    let mut scenario = with_a_short_history(WalkKind::Rectangle, 130.0);
    scenario.config.max_lead_ns = Some(2 * SECOND_NS);
    scenario.logs[1].truncate(2500);
    let sizes = held_at(&scenario, &[60, 120]);
    assert!(sizes[1] < sizes[0] * 13 / 10, "{sizes:?}");
}
