//! The samples alone decide what becomes known: not how they are cut, nor which foot's come first.

use lodestep_engine::event::Event;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::faults::Fault;
use lodestep_engine::systems::pedestrian::{Side, causes};

use crate::scenario::{PERIOD_NS, SECOND_NS, Scenario, short_walk};
use crate::told::Told;

/// A walk on which both sensors have had their trouble.
fn walk() -> Scenario {
    short_walk()
        .with_fault(
            Side::Right,
            &Fault::Dropout { from_ns: 17 * SECOND_NS, to_ns: 17 * SECOND_NS + 15 * PERIOD_NS },
        )
        .with_fault(
            Side::Left,
            &Fault::Dropout { from_ns: 25 * SECOND_NS, to_ns: 25 * SECOND_NS + 12 * PERIOD_NS },
        )
        .with_fault(Side::Left, &Fault::RepeatedTime { from_ns: 28 * SECOND_NS, every: 400 })
}

fn push_all(scenario: &Scenario, samples: impl IntoIterator<Item = (Side, ImuSample)>) -> Told {
    let (mut session, mut events) = scenario.session();
    for (foot, sample) in samples {
        session.push(foot, &sample, &mut events);
    }
    session.finish(&mut events);
    Told::check(events, session.summary())
}

/// The samples in turns of `pieces` at a time, whatever their times.
fn in_pieces(scenario: &Scenario, pieces: [usize; 2]) -> Vec<(Side, ImuSample)> {
    let mut queues = Side::BOTH.map(|foot| scenario.logs[foot.index()].iter());
    let mut samples = Vec::new();
    while queues.iter().any(|queue| queue.len() > 0) {
        for foot in Side::BOTH {
            let piece = queues[foot.index()].by_ref().take(pieces[foot.index()]);
            samples.extend(piece.map(|sample| (foot, *sample)));
        }
    }
    samples
}

/// Everything but the sensor trouble, which is told as soon as it is seen.
fn without_anomalies(events: &[Event]) -> Vec<&Event> {
    events.iter().filter(|event| !matches!(event, Event::Anomaly(_))).collect()
}

#[track_caller]
fn assert_same(found: &Told, expected: &Told) {
    let (found_events, expected_events) =
        (without_anomalies(&found.events), without_anomalies(&expected.events));
    let differs = found_events.iter().zip(&expected_events).position(|(a, b)| a != b);
    assert_eq!((differs, found_events.len()), (None, expected_events.len()));
    assert_eq!(found.track.sha256(), expected.track.sha256(), "anomalies or the sign of a zero");
    assert_eq!(found.summary, expected.summary);
}

#[test]
fn whichever_foot_comes_first_and_however_it_is_cut_the_same_becomes_known() {
    let scenario = walk();
    let expected = scenario.run();
    assert!(!expected.track.anomalies.is_empty());
    let whole = usize::MAX;
    for pieces in [[1, 1], [37, 101], [500, 1], [whole, whole], [200, whole]] {
        assert_same(&push_all(&scenario, in_pieces(&scenario, pieces)), &expected);
    }
    let mut right_first = in_pieces(&scenario, [whole, whole]);
    right_first.sort_by_key(|(foot, _)| std::cmp::Reverse(*foot));
    assert_same(&push_all(&scenario, right_first), &expected);
}

#[test]
fn ending_a_foot_before_the_session_is_the_same_as_finishing() {
    let mut scenario = walk();
    scenario.logs[1].truncate(3000);
    let expected = scenario.run();
    let (mut session, mut events) = scenario.session();
    for foot in [Side::Right, Side::Left] {
        for sample in &scenario.logs[foot.index()] {
            session.push(foot, sample, &mut events);
        }
        session.end(foot, &mut events);
    }
    session.finish(&mut events);
    assert_same(&Told::check(events, session.summary()), &expected);
}

/// Live, with the right foot's samples coming `delay` samples after the left one's.
fn delayed(scenario: &Scenario, delay: usize) -> Told {
    let [left, right] = [0, 1].map(|foot| &scenario.logs[foot]);
    let mut samples = Vec::new();
    for k in 0..left.len() + delay {
        samples.extend(left.get(k).map(|sample| (Side::Left, *sample)));
        let late = k.checked_sub(delay).and_then(|k| right.get(k));
        samples.extend(late.map(|sample| (Side::Right, *sample)));
    }
    push_all(scenario, samples)
}

#[test]
fn a_foot_that_lags_by_less_than_the_longest_lead_changes_nothing() {
    let mut scenario = short_walk();
    let expected = scenario.run();
    scenario.config.max_lead_ns = Some(2 * SECOND_NS);
    let told = delayed(&scenario, 150);
    assert_same(&told, &expected);
    assert_eq!(told.summary.late_samples, 0);
}

#[test]
fn a_foot_that_lags_by_more_is_not_waited_for_and_its_samples_are_counted() {
    let mut scenario = short_walk().with_true_heading();
    scenario.config.max_lead_ns = Some(SECOND_NS);
    // Both feet have been aligned when the right one falls behind by 3 s for good.
    let (mut session, mut events) = scenario.session();
    let [left, right] = [0, 1].map(|foot| &scenario.logs[foot]);
    for (k, sample) in left.iter().enumerate() {
        session.push(Side::Left, sample, &mut events);
        let late = if k < 2000 { Some(k) } else { k.checked_sub(300).filter(|late| *late >= 2000) };
        if let Some(sample) = late.and_then(|late| right.get(late)) {
            session.push(Side::Right, sample, &mut events);
        }
    }
    session.finish(&mut events);
    let told = Told::check(events, session.summary());
    assert!(told.summary.late_samples > 1000, "{:?}", told.summary);
    assert!(told.track.points.len() >= left.len() - 5, "the track goes on with the left foot");
    let missing = told.anomalies(causes::FOOT_MISSING, Side::Right);
    assert!(missing.first().is_some_and(|first| first.t_start_ns < 21 * SECOND_NS), "{missing:?}");
    let errors = told.errors(&scenario);
    assert!(errors.end_error_m < 3.0, "{errors:?}");
}

#[test]
fn points_come_while_the_walk_goes_on() {
    let scenario = short_walk();
    let (mut session, mut events) = scenario.session();
    for (foot, sample) in scenario.merge_by_time() {
        session.push(foot, &sample, &mut events);
        if sample.t_ns < 13 * SECOND_NS {
            continue;
        }
        let newest_ns = events.iter().rev().find_map(|event| match event {
            Event::Point(point) => Some(point.t_ns),
            _ => None,
        });
        // The stance detector looks ahead, and an epoch is told when the next one begins.
        assert!(newest_ns.is_some_and(|t_ns| sample.t_ns - t_ns <= 6 * PERIOD_NS), "{newest_ns:?}");
    }
}
