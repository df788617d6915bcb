//! Readings that cannot be: no numbers, beyond a range, without any change.

use super::*;

pub(super) const TROUBLES: &[Trouble] = &[
    Trouble::of_right("a rate that is no number", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.w_ib_b_rad_s[1] = f64::NAN)
    }),
    Trouble::of_right("a force that is no number", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.f_b_m_s2[0] = f64::NAN)
    }),
    Trouble::of_right("an infinite rate", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.w_ib_b_rad_s[2] = f64::INFINITY)
    }),
    Trouble::of_right("a force of minus infinity", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.f_b_m_s2[2] = f64::NEG_INFINITY)
    }),
    Trouble::of_right("every tenth reading no number", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 15, 35, |k, s| {
            if k % 10 == 0 {
                s.f_b_m_s2 = [f64::NAN; 3];
            }
        })
    }),
    Trouble::of_right("no numbers to the end", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 30, NEVER, |_, s| s.w_ib_b_rad_s = [f64::NAN; 3])
    }),
    Trouble::of_right("a rate beyond all reason", AnomalyKind::SATURATION, |logs| {
        right(logs, 25, 26, |_, s| s.w_ib_b_rad_s[0] = 1e6)
    }),
    Trouble::of_right("a force beyond all reason", AnomalyKind::SATURATION, |logs| {
        right(logs, 25, 26, |_, s| s.f_b_m_s2[1] = -1e30)
    }),
    Trouble::of_right("forces clipped at 2 g", AnomalyKind::SATURATION, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| f.clamp(-19.613_3, 19.613_3)))
    }),
    Trouble::of_right("rates clipped at 500 deg/s", AnomalyKind::SATURATION, |logs| {
        right(logs, 0, NEVER, |_, s| {
            s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| (1.6 * w).clamp(-8.726_646, 8.726_646))
        })
    }),
    Trouble::of_right("a rate at the end of its range", AnomalyKind::SATURATION, |logs| {
        right(logs, 25, 26, |_, s| s.w_ib_b_rad_s[1] = 34.906_585)
    }),
    Trouble::of_right("forces that wrap around", AnomalyKind::SATURATION, |logs| {
        right(logs, 25, 26, |_, s| s.f_b_m_s2[2] -= 4_096.0 * 9.806_65)
    }),
    Trouble::of_right("raw counts for rates", AnomalyKind::SATURATION, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| (w * 939.0).round()))
    }),
    Trouble::of_right("the x axis of the gyro stuck", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 25, 29, |_, s| s.w_ib_b_rad_s[0] = 0.25)
    }),
    Trouble::of_right("the y axis of the gyro stuck", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 25, 29, |_, s| s.w_ib_b_rad_s[1] = -0.25)
    }),
    Trouble::of_right("the z axis of the accelerometer stuck", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 25, 29, |_, s| s.f_b_m_s2[2] = 9.25)
    }),
    Trouble::of_right("an axis that is dead from the start", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2[0] = 0.0)
    }),
    Trouble::of_right("all axes frozen", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 25, 30, |_, s| {
            s.w_ib_b_rad_s = [0.01, 0.02, 0.03];
            s.f_b_m_s2 = [0.1, 0.2, 9.7];
        })
    }),
    Trouble::of_right("a sensor that only says zero", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 0, NEVER, |_, s| {
            s.w_ib_b_rad_s = [0.0; 3];
            s.f_b_m_s2 = [0.0; 3];
        })
    }),
    Trouble::of_right("a triad that repeats its readings for a second", AnomalyKind::STUCK_AXIS, |logs| {
        right(logs, 25, 27, |_, s| s.w_ib_b_rad_s = [1.0, 1.0, 1.0])
    }),
];

#[test]
fn readings_that_cannot_be_are_named() {
    assert_each_is_named(TROUBLES);
}

#[test]
fn single_readings_that_are_no_numbers_are_left_out() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for channel in [Channel::Gyro, Channel::Accel] {
            let fault =
                Fault::Value { channel, axis: 1, value, from_ns: AT_NS, to_ns: AT_NS + 3 * PERIOD_NS };
            let (scenario, told) = assert_named(fault, AnomalyKind::NOT_FINITE, AT_NS);
            assert_eq!(told.anomalies(AnomalyKind::NOT_FINITE, Side::Right)[0].samples, 3);
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
    let (scenario, told) = assert_named(fault, AnomalyKind::NOT_FINITE, AT_NS);
    assert_end_within(&scenario, &told, 2.0);
}

#[test]
fn a_reading_beyond_all_reason_is_left_out() {
    for (channel, value) in [(Channel::Gyro, 1e6), (Channel::Accel, -1e30)] {
        let fault = Fault::Value { channel, axis: 0, value, from_ns: AT_NS, to_ns: AT_NS + 2 * PERIOD_NS };
        let (scenario, told) = assert_named(fault, AnomalyKind::SATURATION, AT_NS);
        assert_end_within(&scenario, &told, 2.0);
    }
}

#[test]
fn an_axis_that_sticks_is_named() {
    for (channel, axis) in [(Channel::Gyro, 0), (Channel::Gyro, 1), (Channel::Accel, 2)] {
        let fault = Fault::StuckAxis { channel, axis, from_ns: AT_NS, to_ns: AT_NS + 4 * SECOND_NS };
        let (_, told) = assert_named(fault, AnomalyKind::STUCK_AXIS, AT_NS + SECOND_NS);
        let axis_name = ["x", "y", "z"][axis];
        let name = if channel == Channel::Gyro {
            format!("gyr_{axis_name}_rad_s")
        } else {
            format!("acc_{axis_name}_m_s2")
        };
        let detail = &told.anomalies(AnomalyKind::STUCK_AXIS, Side::Right)[0].detail;
        assert!(detail.contains(&name), "{detail}");
    }
}

#[test]
fn heel_strikes_beyond_the_range_are_named() {
    let fault = Fault::Saturation { channel: Channel::Accel, limit: 2.0 * 9.80665 };
    let scenario = short_walk().with_true_heading().with_fault(Side::Right, &fault);
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::SATURATION, Side::Right);
    assert!(!found.is_empty(), "{:?}", told.track.anomalies);
    assert!(found.iter().all(|anomaly| anomaly.t_start_ns > 11 * SECOND_NS), "not while standing: {found:?}");
}

#[test]
fn a_sensor_that_only_says_zero_is_named() {
    let dead = |_: usize, sample: &mut ImuSample| {
        (sample.w_ib_b_rad_s, sample.f_b_m_s2, sample.mag_b_ut) = ([0.0; 3], [0.0; 3], Some([0.0; 3]));
    };
    let told = short_walk().with_samples(Side::Right, dead).run();
    assert!(!told.anomalies(AnomalyKind::STUCK_AXIS, Side::Right).is_empty(), "{:?}", told.track.anomalies);
    assert_eq!(told.anomalies(AnomalyKind::IMPOSSIBLE_REST_GRAVITY, Side::Right).len(), 1);
    // Both of them.
    let told = short_walk().with_samples(Side::Left, dead).with_samples(Side::Right, dead).run();
    assert!(!told.anomalies(AnomalyKind::STUCK_AXIS, Side::Left).is_empty());
}
