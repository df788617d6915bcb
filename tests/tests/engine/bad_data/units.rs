//! Channels that say something else than what they are called.

use super::*;

pub(super) const TROUBLES: &[Trouble] = &[
    Trouble::of_right("forces in g", AnomalyKind::IMPOSSIBLE_REST_GRAVITY, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| f / 9.806_65))
    }),
    Trouble::of_right("forces in milli-g", AnomalyKind::SATURATION, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| f / 9.806_65e-3))
    }),
    Trouble::of_right("forces in feet", AnomalyKind::IMPOSSIBLE_REST_GRAVITY, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| f / 0.304_8))
    }),
    Trouble::of_right("forces without gravity", AnomalyKind::IMPOSSIBLE_REST_GRAVITY, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2[2] -= 9.78)
    }),
    Trouble::of_right("forces of twice the scale", AnomalyKind::IMPOSSIBLE_REST_GRAVITY, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| 2.0 * f))
    }),
    Trouble::of_right("forces of half the scale", AnomalyKind::IMPOSSIBLE_REST_GRAVITY, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2 = s.f_b_m_s2.map(|f| 0.5 * f))
    }),
    Trouble::of_right(
        "one axis of the accelerometer off by 3 m/s²",
        AnomalyKind::IMPOSSIBLE_REST_GRAVITY,
        |logs| right(logs, 0, NEVER, |_, s| s.f_b_m_s2[2] += 3.0),
    ),
    Trouble::of_right("rates in degrees", AnomalyKind::SATURATION, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(f64::to_degrees))
    }),
    Trouble::of_right("rates in thousandths", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| 1e-3 * w))
    }),
    Trouble::of_right("swapped axes of the gyro", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s.swap(0, 1))
    }),
    Trouble::of_right("swapped axes of the accelerometer", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2.swap(0, 2))
    }),
    Trouble::of_right("a gyro with the wrong sign", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| -w))
    }),
    Trouble::of_right("one axis of the gyro with the wrong sign", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s[1] = -s.w_ib_b_rad_s[1])
    }),
    Trouble::of_right("an accelerometer upside down", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.f_b_m_s2[2] = -s.f_b_m_s2[2])
    }),
    Trouble::of_right(
        "gyro and accelerometer in each other's place",
        AnomalyKind::IMPOSSIBLE_REST_GRAVITY,
        |logs| right(logs, 0, NEVER, |_, s| std::mem::swap(&mut s.w_ib_b_rad_s, &mut s.f_b_m_s2)),
    ),
    Trouble::of_right("rates of half the scale", AnomalyKind::WRONG_MOUNTING, |logs| {
        right(logs, 0, NEVER, |_, s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(|w| 0.5 * w))
    }),
];

#[test]
fn channels_that_are_mislabelled_are_named() {
    assert_each_is_named(TROUBLES);
}

#[test]
fn swapped_axes_of_the_gyro_are_named() {
    let scenario = short_walk().with_true_heading().with_samples(Side::Right, |_, sample| {
        sample.w_ib_b_rad_s.swap(0, 1);
    });
    let told = scenario.run();
    assert!(
        !told.anomalies(AnomalyKind::WRONG_MOUNTING, Side::Right).is_empty(),
        "{:?}",
        told.track.anomalies
    );
    assert!(told.anomalies(AnomalyKind::WRONG_MOUNTING, Side::Left).is_empty(), "{:?}", told.track.anomalies);
}

#[test]
fn an_acceleration_in_g_is_named_at_the_start() {
    let scenario = short_walk().with_true_heading().with_samples(Side::Left, |_, sample| {
        sample.f_b_m_s2 = sample.f_b_m_s2.map(|f| f / 9.80665);
    });
    let told = scenario.run();
    let found = told.anomalies(AnomalyKind::IMPOSSIBLE_REST_GRAVITY, Side::Left);
    assert_eq!(found.len(), 1, "{:?}", told.track.anomalies);
    assert!(
        found[0].t_end_ns < 13 * SECOND_NS && found[0].detail.contains("scale and units"),
        "{:?}",
        found[0]
    );
}
