//! Sensors on feet: one that is missing, that comes loose, that is worn on the other one.

use super::*;
use lodestep_engine::systems::pedestrian::causes;

pub(super) const TROUBLES: &[Trouble] = &[
    Trouble::of_right("a foot that is missing from the start", causes::FOOT_MISSING, |logs| logs[1].clear()),
    Trouble::of_right("a foot that ends early", causes::FOOT_MISSING, |logs| logs[1].truncate(2_500)),
    Trouble::of_right("a foot that begins late", causes::FOOT_MISSING, |logs| drop(logs[1].drain(..2_500))),
    Trouble {
        name: "the other foot that ends early",
        told: causes::FOOT_MISSING,
        foot: Some(Side::Left),
        spoil: |logs| logs[0].truncate(2_500),
    },
    Trouble::of_right("a foot that is silent for long while the other walks", AnomalyKind::GAP, |logs| {
        logs[1].retain(|s| !(20_000_000_000..38_000_000_000).contains(&s.t_ns))
    }),
    Trouble::of_right("a walk without a standing start", AnomalyKind::NO_STILL_START, |logs| {
        for log in logs {
            log.drain(..1_250);
        }
    }),
    Trouble::of_right("a foot that moves while it should stand", AnomalyKind::NO_STILL_START, |logs| {
        right(logs, 0, 12, |k, s| {
            s.w_ib_b_rad_s[1] += 2.0 * (k as f64 * 0.3).sin();
            s.f_b_m_s2[0] += 4.0 * (k as f64 * 0.3).cos();
        })
    }),
    Trouble::of_right("a sensor that turns on the foot", AnomalyKind::WRONG_MOUNTING, |logs| {
        lodestep_engine::sim::faults::inject(&mut logs[1], &Fault::HalfTurn { at_ns: 15 * SECOND_NS }, 1)
    }),
    Trouble::of_right("a sensor that falls off", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 20, NEVER, |k, s| {
            let noise = 0.002 * ((k * 7_919 % 1_009) as f64 / 1_009.0 - 0.5);
            s.w_ib_b_rad_s = [noise, -noise, 0.5 * noise];
            s.f_b_m_s2 = [9.78 + 10.0 * noise, 5.0 * noise, -7.0 * noise];
        })
    }),
];

#[test]
fn feet_that_are_missing_or_wrong_are_named() {
    assert_each_is_named(TROUBLES);
}

#[test]
fn a_foot_that_is_missing_from_the_start_is_named_and_the_other_goes_on() {
    let mut scenario = short_walk().with_true_heading();
    scenario.logs[1].clear();
    let told = scenario.run();
    let missing = told.anomalies(causes::FOOT_MISSING, Side::Right);
    assert_eq!(missing.len(), 1, "{:?}", told.track.anomalies);
    assert!(told.last().parts[1].is_none());
    assert_end_within(&scenario, &told, 2.5);
}

#[test]
fn a_foot_that_ends_early_is_named() {
    let mut scenario = short_walk().with_true_heading();
    scenario.logs[1].truncate(2500);
    let told = scenario.run();
    assert_eq!(told.track.points.len(), scenario.truth.len(), "the left foot goes on");
    let missing = told.anomalies(causes::FOOT_MISSING, Side::Right);
    assert_eq!(missing.len(), 1, "{:?}", told.track.anomalies);
    assert!((missing[0].t_start_ns - AT_NS).abs() < SECOND_NS, "{missing:?}");
    // The middle of a foot that walks on and one that is left behind is nowhere near the inspector.
    assert_end_within(&scenario, &told, 3.0);
}

#[test]
fn a_walk_without_a_standing_start_is_named() {
    let mut scenario = short_walk();
    for log in &mut scenario.logs {
        log.drain(..1250);
    }
    let told = scenario.run();
    for foot in Side::BOTH {
        assert_eq!(told.anomalies(AnomalyKind::NO_STILL_START, foot).len(), 1, "{:?}", told.track.anomalies);
    }
    // Nothing else is wrong with the sensors.
    let others = told.track.anomalies.iter().filter(|anomaly| anomaly.kind != AnomalyKind::NO_STILL_START);
    assert_eq!(others.count(), 0, "{:?}", told.track.anomalies);
    assert_end_within(&scenario, &told, 2.0);
}

#[test]
fn a_session_that_gets_nothing_or_next_to_nothing_tells_next_to_nothing() {
    // The stance detector looks three samples ahead, so that less than four say nothing.
    for (kept, points) in [(0, 0), (1, 0), (3, 0), (30, 30)] {
        let mut scenario = short_walk();
        for log in &mut scenario.logs {
            log.truncate(kept);
        }
        assert_eq!(scenario.run().track.points.len(), points, "{kept} samples");
    }
}
