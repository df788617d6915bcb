//! Field, air pressure and temperature.

use super::*;

pub(super) const TROUBLES: &[Trouble] = &[
    Trouble::of_right("a field that is no number", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 30, |_, s| s.mag_b_ut = Some([f64::NAN; 3]))
    }),
    Trouble::of_right("an infinite field", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 30, |_, s| s.mag_b_ut = Some([f64::INFINITY, 0.0, 0.0]))
    }),
    Trouble::of_right("iron beside the way", AnomalyKind::MAGNETIC_FIELD, |logs| {
        right(logs, 20, 26, |_, s| s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [x + 60.0, y - 20.0, z + 10.0]))
    }),
    Trouble::of_right("a field in gauss", AnomalyKind::MAGNETIC_FIELD, |logs| {
        right(logs, 0, NEVER, |_, s| s.mag_b_ut = s.mag_b_ut.map(|b| b.map(|b| 0.01 * b)))
    }),
    Trouble::of_right("a field in nanotesla", AnomalyKind::MAGNETIC_FIELD, |logs| {
        right(logs, 0, NEVER, |_, s| s.mag_b_ut = s.mag_b_ut.map(|b| b.map(|b| 1e3 * b)))
    }),
    Trouble::of_right("a field of zero", AnomalyKind::MAGNETIC_FIELD, |logs| {
        right(logs, 0, NEVER, |_, s| s.mag_b_ut = Some([0.0; 3]))
    }),
    Trouble::of_right("a magnet on the shoe", AnomalyKind::MAGNETIC_FIELD, |logs| {
        right(logs, 20, NEVER, |_, s| s.mag_b_ut = s.mag_b_ut.map(|[x, y, z]| [x, y, z + 400.0]))
    }),
    Trouble::of_right("a pressure that is no number", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.pressure_hpa = Some(f64::NAN))
    }),
    Trouble::of_right("a pressure of zero", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.pressure_hpa = Some(0.0))
    }),
    Trouble::of_right("a pressure in pascal", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 0, NEVER, |_, s| s.pressure_hpa = s.pressure_hpa.map(|p| 100.0 * p))
    }),
    Trouble::of_right("a pressure in kilopascal", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 0, NEVER, |_, s| s.pressure_hpa = s.pressure_hpa.map(|p| 0.1 * p))
    }),
    Trouble::of_right("a spike of the pressure", AnomalyKind::NOT_FINITE, |logs| {
        right(logs, 25, 26, |_, s| s.pressure_hpa = Some(1e9))
    }),
];

#[test]
fn fields_and_pressures_that_cannot_be_are_named() {
    assert_each_is_named(TROUBLES);
}

#[test]
fn a_gyro_bias_that_jumps_is_found_again_in_the_stances() {
    let fault =
        Fault::Offset { channel: Channel::Gyro, by: [0.01, -0.01, 0.01], from_ns: AT_NS, to_ns: NEVER };
    let scenario = short_walk().with_true_heading().with_fault(Side::Left, &fault);
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
        short_walk().with_true_heading().with_fault(Side::Left, &iron(20)).with_fault(Side::Right, &iron(20));
    assert_end_within(&scenario, &scenario.run(), 2.0);
}
