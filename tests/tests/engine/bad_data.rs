//! Sensors that break: the trouble is named with its time and foot, and no number goes astray.
//!
//! Every run goes through [`Told::check`](crate::told::Told::check): whatever comes in, what goes
//! out is finite and orderly.

use lodestep_engine::event::AnomalyKind;
use lodestep_engine::sample::{Foot, ImuSample};
use lodestep_engine::session::{Session, SessionConfig, Visit};
use lodestep_engine::sim::faults::{Channel, Fault};
use proptest::prelude::*;

use crate::scenario::{PERIOD_NS, SECOND_NS, Scenario, short_walk};
use crate::told::Told;

const NEVER: i64 = i64::MAX;
/// The longest times that files and messages can hold.
const LONGEST_NS: i64 = 9_000_000_000 * SECOND_NS;

/// In the middle of the walk, s.
const AT_NS: i64 = 25 * SECOND_NS;

/// Lets a fault happen to the right foot; checks that it is told as `kind`, on that foot, at its time
/// give or take a second, and no other trouble of the sensor; gives the run for more.
#[track_caller]
fn assert_named(fault: Fault, kind: AnomalyKind, from_ns: i64) -> (Scenario, Told) {
    let scenario = short_walk().with_true_heading().with_fault(Foot::Right, &fault);
    let told = scenario.run();
    let found = told.anomalies(kind, Foot::Right);
    assert!(!found.is_empty(), "{fault:?} was not told: {:?}", told.track.anomalies);
    let near = (from_ns - SECOND_NS)..=(from_ns + SECOND_NS);
    assert!(near.contains(&found[0].t_start_ns), "{:?}", found[0]);
    let left: Vec<_> =
        told.track.anomalies.iter().filter(|anomaly| anomaly.foot == Some(Foot::Left)).collect();
    assert!(left.is_empty(), "the left foot is well: {left:?}");
    (scenario, told)
}

#[track_caller]
fn assert_end_within(scenario: &Scenario, told: &Told, metres: f64) {
    let errors = told.errors(scenario);
    assert!(errors.end_error_m <= metres, "{errors:?}");
}

#[test]
fn single_readings_that_are_no_numbers_are_left_out() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for channel in [Channel::Gyro, Channel::Accel] {
            let fault =
                Fault::Value { channel, axis: 1, value, from_ns: AT_NS, to_ns: AT_NS + 3 * PERIOD_NS };
            let (scenario, told) = assert_named(fault, AnomalyKind::NotFinite, AT_NS);
            assert_eq!(told.anomalies(AnomalyKind::NotFinite, Foot::Right)[0].samples, 3);
            assert_end_within(&scenario, &told, 2.0);
        }
    }
}

#[test]
fn magnetic_values_that_are_no_numbers_count_as_missing() {
    let fault = Fault::Value {
        channel: Channel::Mag,
        axis: 0,
        value: f64::NAN,
        from_ns: AT_NS,
        to_ns: AT_NS + SECOND_NS,
    };
    let (scenario, told) = assert_named(fault, AnomalyKind::NotFinite, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
}

#[test]
fn a_reading_beyond_all_reason_is_left_out() {
    for (channel, value) in [(Channel::Gyro, 1e6), (Channel::Accel, -1e30)] {
        let fault = Fault::Value { channel, axis: 0, value, from_ns: AT_NS, to_ns: AT_NS + 2 * PERIOD_NS };
        let (scenario, told) = assert_named(fault, AnomalyKind::Saturation, AT_NS);
        assert_end_within(&scenario, &told, 2.0);
    }
}

#[test]
fn an_axis_that_sticks_is_named() {
    for (channel, axis) in [(Channel::Gyro, 0), (Channel::Gyro, 1), (Channel::Accel, 2)] {
        let fault = Fault::StuckAxis { channel, axis, from_ns: AT_NS, to_ns: AT_NS + 4 * SECOND_NS };
        let (_, told) = assert_named(fault, AnomalyKind::StuckAxis, AT_NS + SECOND_NS);
        let axis_name = ["x", "y", "z"][axis];
        let name = if channel == Channel::Gyro {
            format!("gyr_{axis_name}_rad_s")
        } else {
            format!("acc_{axis_name}_m_s2")
        };
        let detail = &told.anomalies(AnomalyKind::StuckAxis, Foot::Right)[0].detail;
        assert!(detail.contains(&name), "{detail}");
    }
}

#[test]
fn heel_strikes_beyond_the_range_are_named() {
    let fault = Fault::Saturation { channel: Channel::Accel, limit: 2.0 * 9.80665 };
    let scenario = short_walk().with_true_heading().with_fault(Foot::Right, &fault);
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::Saturation, Foot::Right);
    assert!(!found.is_empty(), "{:?}", told.track.anomalies);
    assert!(found.iter().all(|anomaly| anomaly.t_start_ns > 11 * SECOND_NS), "not while standing: {found:?}");
}

#[test]
fn gaps_are_named_and_the_track_goes_on_after_them() {
    for (gap_ns, end_m) in [(3 * SECOND_NS / 10, 2.0), (5 * SECOND_NS, 3.0)] {
        let fault = Fault::Dropout { from_ns: AT_NS, to_ns: AT_NS + gap_ns };
        let (scenario, told) = assert_named(fault, AnomalyKind::Gap, AT_NS);
        let gap = told.anomalies(AnomalyKind::Gap, Foot::Right)[0];
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
    for foot in Foot::BOTH {
        assert_eq!(told.anomalies(AnomalyKind::Gap, foot).len(), 1, "{:?}", told.track.anomalies);
    }
    let sigma = told.last().sigma_n_m;
    assert!(sigma[0] > 20.0 && sigma[1] > 20.0, "{sigma:?}: it may have gone anywhere");
    assert!(told.last().position_n_m[1] > 15.0, "{:?}", told.last());
}

#[test]
fn time_stamps_that_repeat_or_go_back_are_named_and_left_out() {
    let (scenario, told) =
        assert_named(Fault::RepeatedTime { from_ns: AT_NS, every: 7 }, AnomalyKind::RepeatedTime, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
    let back = Fault::BackwardTime { at_ns: AT_NS, by_ns: 3 * SECOND_NS };
    let (scenario, told) = assert_named(back, AnomalyKind::BackwardTime, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
}

#[test]
fn one_stamp_of_another_day_costs_one_sample() {
    for ahead_s in [60, 86_400, 9_000_000_000] {
        let scenario = short_walk().with_true_heading().with_samples(Foot::Right, |k, sample| {
            if k == 2500 {
                sample.t_ns += ahead_s * SECOND_NS;
            }
        });
        let told = scenario.run();
        let found = told.anomalies(AnomalyKind::BackwardTime, Foot::Right);
        assert!(found.len() == 1 && found[0].samples == 1, "{:?}", told.track.anomalies);
        assert!((found[0].t_start_ns - AT_NS).abs() < SECOND_NS, "{found:?}");
        assert_end_within(&scenario, &told, 2.0);
    }
}

#[test]
fn a_clock_that_is_set_back_for_good_is_named() {
    // The device set its clock back by a minute: its samples cannot be placed any more.
    let scenario = short_walk().with_true_heading().with_samples(Foot::Right, |_, sample| {
        if sample.t_ns >= AT_NS {
            sample.t_ns -= 60 * SECOND_NS;
        }
    });
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::BackwardTime, Foot::Right);
    assert!(!found.is_empty() && found[0].samples > 100, "{found:?}");
    assert!(found[0].t_start_ns <= found[0].t_end_ns, "{found:?}");
}

#[test]
fn swapped_axes_of_the_gyro_are_named() {
    let scenario = short_walk().with_true_heading().with_samples(Foot::Right, |_, sample| {
        sample.w_ib_b_rad_s.swap(0, 1);
    });
    let told = scenario.run();
    assert!(
        !told.anomalies(AnomalyKind::WrongMounting, Foot::Right).is_empty(),
        "{:?}",
        told.track.anomalies
    );
    assert!(told.anomalies(AnomalyKind::WrongMounting, Foot::Left).is_empty(), "{:?}", told.track.anomalies);
}

#[test]
fn an_acceleration_in_g_is_named_at_the_start() {
    let scenario = short_walk().with_true_heading().with_samples(Foot::Left, |_, sample| {
        sample.f_b_m_s2 = sample.f_b_m_s2.map(|f| f / 9.80665);
    });
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::ImpossibleRestGravity, Foot::Left);
    assert_eq!(found.len(), 1, "{:?}", told.track.anomalies);
    assert!(
        found[0].t_end_ns < 13 * SECOND_NS && found[0].detail.contains("scale and units"),
        "{:?}",
        found[0]
    );
}

#[test]
fn ten_times_the_rate_is_named_or_harmless() {
    // Samples a tenth of the interval apart: everything happens ten times as fast as it can.
    let mut scenario = short_walk().with_true_heading();
    for log in &mut scenario.logs {
        log.iter_mut().for_each(|sample| sample.t_ns /= 10);
    }
    scenario.run();
}

#[test]
fn a_sensor_that_only_says_zero_is_named() {
    let dead = |_: usize, sample: &mut ImuSample| {
        (sample.w_ib_b_rad_s, sample.f_b_m_s2, sample.mag_b_ut) = ([0.0; 3], [0.0; 3], Some([0.0; 3]));
    };
    let told = short_walk().with_samples(Foot::Right, dead).run();
    assert!(!told.anomalies(AnomalyKind::StuckAxis, Foot::Right).is_empty(), "{:?}", told.track.anomalies);
    assert_eq!(told.anomalies(AnomalyKind::ImpossibleRestGravity, Foot::Right).len(), 1);
    // Both of them.
    let told = short_walk().with_samples(Foot::Left, dead).with_samples(Foot::Right, dead).run();
    assert!(!told.anomalies(AnomalyKind::StuckAxis, Foot::Left).is_empty());
}

#[test]
fn a_foot_that_is_missing_from_the_start_is_named_and_the_other_goes_on() {
    let mut scenario = short_walk().with_true_heading();
    scenario.logs[1].clear();
    let told = scenario.run();
    let missing = told.anomalies(AnomalyKind::FootMissing, Foot::Right);
    assert_eq!(missing.len(), 1, "{:?}", told.track.anomalies);
    assert!(told.last().right.is_none());
    assert_end_within(&scenario, &told, 2.5);
}

#[test]
fn a_foot_that_ends_early_is_named() {
    let mut scenario = short_walk().with_true_heading();
    scenario.logs[1].truncate(2500);
    let told = scenario.run();
    assert_eq!(told.track.points.len(), scenario.truth.len(), "the left foot goes on");
    let missing = told.anomalies(AnomalyKind::FootMissing, Foot::Right);
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
    for foot in Foot::BOTH {
        assert_eq!(told.anomalies(AnomalyKind::NoStillStart, foot).len(), 1, "{:?}", told.track.anomalies);
    }
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

#[test]
fn lost_samples_cost_little() {
    let scenario = short_walk()
        .with_true_heading()
        .with_fault(Foot::Left, &Fault::LostSamples { share: 0.05 })
        .with_fault(Foot::Right, &Fault::LostSamples { share: 0.05 });
    assert_end_within(&scenario, &scenario.run(), 2.0);
}

#[test]
fn a_gyro_bias_that_jumps_is_found_again_in_the_stances() {
    let fault =
        Fault::Offset { channel: Channel::Gyro, by: [0.01, -0.01, 0.01], from_ns: AT_NS, to_ns: NEVER };
    let scenario = short_walk().with_true_heading().with_fault(Foot::Left, &fault);
    assert_end_within(&scenario, &scenario.run(), 3.0);
}

#[test]
fn iron_beside_the_way_does_not_turn_the_track() {
    let iron = |from_s: i64| Fault::Offset {
        channel: Channel::Mag,
        by: [60.0, -20.0, 10.0],
        from_ns: from_s * SECOND_NS,
        to_ns: (from_s + 6) * SECOND_NS,
    };
    let scenario =
        short_walk().with_true_heading().with_fault(Foot::Left, &iron(20)).with_fault(Foot::Right, &iron(20));
    assert_end_within(&scenario, &scenario.run(), 2.0);
}

/// A number as a broken device may send it.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -20.0..20.0,
        2 => -2e3..2e3,
        1 => prop::sample::select(vec![0.0, -0.0, 1e-300, 1e300, f64::MAX, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
    ]
}

fn triad() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        // Most of the time a foot at rest, so that the filter is reached and not only the doorman.
        3 => (-0.05..0.05, -0.05..0.05, 9.7..9.9).prop_map(|(x, y, z)| [x, y, z]),
        1 => [number(), number(), number()],
    ]
}

fn rate() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![3 => [-0.02..0.02, -0.02..0.02, -0.02..0.02], 1 => [-9.0..9.0, -9.0..9.0, -9.0..9.0], 1 => triad()]
}

/// From one sample to the next, ns.
fn interval_ns() -> impl Strategy<Value = i64> {
    prop_oneof![
        20 => Just(PERIOD_NS),
        2 => 0..3 * PERIOD_NS,
        1 => -SECOND_NS..10 * SECOND_NS,
        1 => prop::sample::select(vec![0, 1, -1, 200 * PERIOD_NS, 86_400 * SECOND_NS, -86_400 * SECOND_NS, LONGEST_NS, -LONGEST_NS]),
    ]
}

/// What a device may do next.
#[derive(Clone, Debug)]
enum Deed {
    /// So many samples in a row, alike but for their time.
    Samples(Foot, usize, i64, ImuSample),
    /// Someone says that the inspector stands somewhere.
    Visit(i64, f64, Option<f64>),
    /// A foot ends.
    End(Foot),
}

fn deed() -> impl Strategy<Value = Deed> {
    let foot = || prop::sample::select(Foot::BOTH.to_vec());
    let sample = (rate(), triad(), prop::option::of(triad()), prop::option::of(number())).prop_map(
        |(w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa)| ImuSample {
            t_ns: 0,
            w_ib_b_rad_s,
            f_b_m_s2,
            mag_b_ut,
            pressure_hpa,
        },
    );
    prop_oneof![
        60 => (foot(), 1..40usize, interval_ns(), sample).prop_map(|(f, count, step, s)| Deed::Samples(f, count, step, s)),
        4 => (-20 * SECOND_NS..20 * SECOND_NS, -200.0..200.0, prop::option::of(-50.0..50.0))
            .prop_map(|(t, e, u)| Deed::Visit(t, e, u)),
        1 => foot().prop_map(Deed::End),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, rng_seed: prop::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn whatever_comes_in_what_goes_out_is_finite_and_orderly(
        deeds in prop::collection::vec(deed(), 1..80),
        lead_s in prop::option::of(0i64..20),
        feet in prop::sample::select(vec![vec![Foot::Left], vec![Foot::Right], Foot::BOTH.to_vec()]),
    ) {
        let config = SessionConfig { feet, max_lead_ns: lead_s.map(|s| s * SECOND_NS), ..SessionConfig::default() };
        let (mut session, mut events) = (Session::new(config), Vec::new());
        let mut now_ns = [0_i64; 2];
        for deed in deeds {
            match deed {
                Deed::Samples(foot, count, step_ns, sample) => {
                    for k in 0..count {
                        let t_ns = &mut now_ns[foot.index()];
                        let step_ns = if k == 0 { step_ns } else { PERIOD_NS };
                        *t_ns = t_ns.saturating_add(step_ns).clamp(-LONGEST_NS, LONGEST_NS);
                        // Not to the bit alike, or every run would be one of stuck axes.
                        let mut sample = ImuSample { t_ns: *t_ns, ..sample };
                        sample.f_b_m_s2[0] += 1e-3 * (k as f64 * 0.7).sin();
                        session.push(foot, &sample, &mut events);
                    }
                }
                Deed::Visit(from_now_ns, e_m, u_m) => {
                    let t_start_ns = now_ns[0].max(now_ns[1]).saturating_add(from_now_ns);
                    let visit = Visit {
                        marker: "M".to_owned(),
                        t_start_ns,
                        t_end_ns: t_start_ns.saturating_add(4 * SECOND_NS),
                        position_n_m: (e_m, -e_m, u_m),
                    };
                    session.visit(visit, &mut events);
                }
                Deed::End(foot) => session.end_foot(foot, &mut events),
            }
        }
        session.finish(&mut events);
        Told::check(events, session.summary());
    }
}
