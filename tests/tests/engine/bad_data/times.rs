//! Clocks and links: gaps, stamps that repeat, go back, run ahead.

use super::*;
use lodestep_engine::systems::pedestrian::causes;

pub(super) const TROUBLES: &[Trouble] = &[
    Trouble::of_right("a third of a second without samples", AnomalyKind::GAP, |logs| {
        logs[1].retain(|s| !(25_000_000_000..25_300_000_000).contains(&s.t_ns))
    }),
    Trouble::of_right("five seconds without samples", AnomalyKind::GAP, |logs| {
        logs[1].retain(|s| !(25_000_000_000..30_000_000_000).contains(&s.t_ns))
    }),
    Trouble::of_right("a minute without samples", AnomalyKind::GAP, |logs| {
        for log in logs {
            log.iter_mut().filter(|s| s.t_ns >= AT_NS).for_each(|s| s.t_ns += 60 * SECOND_NS);
        }
    }),
    Trouble::of_right("a sample in three is lost", AnomalyKind::GAP, |logs| {
        let mut k = 0_u32;
        logs[1].retain(|_| {
            k = k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            k >> 16 & 3 != 0 && k >> 20 & 3 != 0
        });
    }),
    Trouble::of_right("a tenth of the rate", AnomalyKind::GAP, |logs| {
        let mut k = 0;
        logs[1].retain(|_| {
            k += 1;
            k % 10 == 0
        });
    }),
    Trouble::of_right("ten times the rate", causes::IMPOSSIBLE_CADENCE, |logs| {
        right(logs, 0, NEVER, |_, s| s.t_ns /= 10)
    }),
    Trouble::of_right("milliseconds taken for seconds", AnomalyKind::GAP, |logs| {
        right(logs, 0, NEVER, |_, s| s.t_ns *= 1_000)
    }),
    Trouble::of_right("the same stamp every seventh sample", AnomalyKind::REPEATED_TIME, |logs| {
        lodestep_engine::sim::faults::inject(
            &mut logs[1],
            &Fault::RepeatedTime { from_ns: AT_NS, every: 7 },
            1,
        )
    }),
    Trouble::of_right("every sample twice", AnomalyKind::REPEATED_TIME, |logs| {
        logs[1] = logs[1].iter().flat_map(|s| [*s, *s]).collect()
    }),
    Trouble::of_right("ten samples with one stamp", AnomalyKind::REPEATED_TIME, |logs| {
        right(logs, 15, 35, |_, s| s.t_ns -= s.t_ns % 100_000_000)
    }),
    Trouble::of_right("all stamps zero", AnomalyKind::REPEATED_TIME, |logs| {
        right(logs, 0, NEVER, |_, s| s.t_ns = 0)
    }),
    Trouble::of_right("one stamp that goes back", AnomalyKind::BACKWARD_TIME, |logs| {
        logs[1][2_500].t_ns -= 3 * SECOND_NS
    }),
    Trouble::of_right("a clock set back for good", AnomalyKind::BACKWARD_TIME, |logs| {
        right(logs, 25, NEVER, |_, s| s.t_ns -= 60 * SECOND_NS)
    }),
    Trouble::of_right("a stamp of tomorrow", AnomalyKind::BACKWARD_TIME, |logs| {
        logs[1][2_500].t_ns += 86_400 * SECOND_NS
    }),
    Trouble::of_right("a stamp at the end of all time", AnomalyKind::BACKWARD_TIME, |logs| {
        logs[1][2_500].t_ns = i64::MAX
    }),
    Trouble::of_right("a stamp before all time", AnomalyKind::BACKWARD_TIME, |logs| {
        logs[1][2_500].t_ns = i64::MIN
    }),
    Trouble::of_right("a packet that came twice", AnomalyKind::BACKWARD_TIME, |logs| {
        let packet: Vec<_> = logs[1][2_450..2_500].to_vec();
        logs[1].splice(2_500..2_500, packet);
    }),
    Trouble::of_right("neighbours that changed places", AnomalyKind::BACKWARD_TIME, |logs| {
        (2_500..2_600).step_by(2).for_each(|k| logs[1].swap(k, k + 1))
    }),
    Trouble::of_right("stamps that jitter over each other", AnomalyKind::BACKWARD_TIME, |logs| {
        right(logs, 15, 35, |k, s| s.t_ns += [0, 13_000_000, -9_000_000, 4_000_000][k % 4])
    }),
    Trouble::of_right("a counter of 16 bits that wraps", AnomalyKind::BACKWARD_TIME, |logs| {
        right(logs, 0, NEVER, |_, s| s.t_ns %= 16_384_000_000)
    }),
    Trouble::of_right("a log that was written from its end", AnomalyKind::BACKWARD_TIME, |logs| {
        logs[1].reverse()
    }),
    Trouble::of_right("two logs in one file", AnomalyKind::BACKWARD_TIME, |logs| {
        let again = logs[1].clone();
        logs[1].extend(again);
    }),
];

#[test]
fn clocks_and_links_that_fail_are_named() {
    assert_each_is_named(TROUBLES);
}

#[test]
fn gaps_are_named_and_the_track_goes_on_after_them() {
    for (gap_ns, end_m) in [(3 * SECOND_NS / 10, 2.0), (5 * SECOND_NS, 3.0)] {
        let fault = Fault::Dropout { from_ns: AT_NS, to_ns: AT_NS + gap_ns };
        let (scenario, told) = assert_named(fault, AnomalyKind::GAP, AT_NS);
        let gap = told.anomalies(AnomalyKind::GAP, Side::Right)[0];
        assert!((gap.t_end_ns - gap.t_start_ns - gap_ns).abs() <= 2 * PERIOD_NS, "{gap:?}");
        assert_eq!(gap.samples as i64, gap_ns / PERIOD_NS, "{gap:?}");
        assert_end_within(&scenario, &told, end_m);
    }
}

#[test]
fn after_a_minute_without_either_foot_the_track_says_how_unsure_it_is() {
    // Both recorders stop for a minute on the way, and start again.
    let mut scenario = short_walk().with_true_heading();
    for log in &mut scenario.logs {
        for sample in log.iter_mut().filter(|sample| sample.t_ns >= AT_NS) {
            sample.t_ns += 60 * SECOND_NS;
        }
    }
    let told = scenario.run();
    for foot in Side::BOTH {
        assert_eq!(told.anomalies(AnomalyKind::GAP, foot).len(), 1, "{:?}", told.track.anomalies);
    }
    let sigma = told.last().sigma_n_m;
    assert!(sigma[0] > 20.0 && sigma[1] > 20.0, "{sigma:?}: it may have gone anywhere");
    assert!(told.last().position_n_m[1] > 15.0, "{:?}", told.last());
}

#[test]
fn time_stamps_that_repeat_or_go_back_are_named_and_left_out() {
    let (scenario, told) =
        assert_named(Fault::RepeatedTime { from_ns: AT_NS, every: 7 }, AnomalyKind::REPEATED_TIME, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
    let back = Fault::BackwardTime { at_ns: AT_NS, by_ns: 3 * SECOND_NS };
    let (scenario, told) = assert_named(back, AnomalyKind::BACKWARD_TIME, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
}

#[test]
fn one_stamp_of_another_day_costs_one_sample() {
    for ahead_s in [60, 86_400, 9_000_000_000] {
        let scenario = short_walk().with_true_heading().with_samples(Side::Right, |k, sample| {
            if k == 2500 {
                sample.t_ns += ahead_s * SECOND_NS;
            }
        });
        let told = scenario.run();
        let found = told.anomalies(AnomalyKind::BACKWARD_TIME, Side::Right);
        assert!(found.len() == 1 && found[0].samples == 1, "{:?}", told.track.anomalies);
        assert!((found[0].t_start_ns - AT_NS).abs() < SECOND_NS, "{found:?}");
        assert_end_within(&scenario, &told, 2.0);
    }
}

#[test]
fn a_clock_that_is_set_back_for_good_is_named() {
    // The device set its clock back by a minute: its samples cannot be placed any more.
    let scenario = short_walk().with_true_heading().with_samples(Side::Right, |_, sample| {
        if sample.t_ns >= AT_NS {
            sample.t_ns -= 60 * SECOND_NS;
        }
    });
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::BACKWARD_TIME, Side::Right);
    assert!(!found.is_empty() && found[0].samples > 100, "{found:?}");
    assert!(found[0].t_start_ns <= found[0].t_end_ns, "{found:?}");
}

#[test]
fn ten_times_the_rate_is_named_for_both_feet() {
    // Samples a tenth of the interval apart: everything happens ten times as fast as it can.
    let mut scenario = short_walk().with_true_heading();
    for log in &mut scenario.logs {
        log.iter_mut().for_each(|sample| sample.t_ns /= 10);
    }
    let told = scenario.run();
    for foot in Side::BOTH {
        let found = told.anomalies(causes::IMPOSSIBLE_CADENCE, foot);
        assert_eq!(found.len(), 1, "{found:?}");
    }
}

#[test]
fn lost_samples_cost_little() {
    let scenario = short_walk()
        .with_true_heading()
        .with_fault(Side::Left, &Fault::LostSamples { share: 0.05 })
        .with_fault(Side::Right, &Fault::LostSamples { share: 0.05 });
    assert_end_within(&scenario, &scenario.run(), 2.0);
}
