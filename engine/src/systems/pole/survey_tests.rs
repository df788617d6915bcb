use super::*;
use crate::anomaly::Cause as _;
use crate::geo::Geodetic;
use crate::sample::ImuSample;

fn frame() -> LocalFrame {
    LocalFrame::new(Geodetic { latitude_deg: 25.65, longitude_deg: 106.85, height_m: 1110.0 })
}

fn options() -> Options {
    Options { tuning: Tuning::default(), smoothed: true, rate_hz: 20.0, lands: true }
}

fn pole() -> Instrument {
    Instrument { antenna_b_m: Vector3::new(0.01, -0.01, 1.0), tip_b_m: Some(Vector3::new(0.01, -0.02, -1.0)) }
}

/// A pole that is held upright and still for half a minute, with fixes.
fn upright() -> Recording {
    let sample = |k: i64| ImuSample {
        t_ns: k * 5_000_000,
        w_ib_b_rad_s: [0.001, -0.002, 0.0005],
        f_b_m_s2: [0.02, -0.01, 9.787],
        mag_b_ut: None,
        pressure_hpa: None,
    };
    let fix = |k: i64| Fix {
        t_ns: k * 200_000_000,
        p_n_m: Vector3::new(0.003 * libm::sin(k as f64), 0.003 * libm::cos(1.3 * k as f64), 1.5),
        sigma_n_m: Vector3::new(0.012, 0.012, 0.023),
        quality: crate::systems::pole::recording::Quality::Fixed,
    };
    Recording {
        imu: (1..6000).map(sample).collect(),
        fixes: (1..150).map(fix).collect(),
        switch: None,
        stops: Vec::new(),
        left_out: Vec::new(),
    }
}

fn sentence(recording: &Recording, instrument: &Instrument) -> String {
    compute(recording, instrument, &frame(), &options()).unwrap_err().sentence()
}

#[test]
fn without_a_manoeuvre_nobody_knows_where_north_is() {
    let said = sentence(&upright(), &pole());
    assert!(said.contains("manoeuvre"), "{said}");
}

#[test]
fn antenna_and_tip_that_are_swapped_are_said() {
    let right = pole();
    let swapped = Instrument { antenna_b_m: right.tip_b_m.unwrap(), tip_b_m: Some(right.antenna_b_m) };
    let said = sentence(&upright(), &swapped);
    assert!(said.contains("swapped"), "{said}");
}

#[test]
fn feet_are_not_taken_for_metres() {
    let right = pole();
    let feet = Instrument {
        antenna_b_m: right.antenna_b_m / 0.3048,
        tip_b_m: right.tip_b_m.map(|tip_b_m| tip_b_m / 0.3048),
    };
    let said = sentence(&upright(), &feet);
    assert!(said.contains("feet"), "{said}");
    let mut recording = upright();
    recording.fixes.iter_mut().for_each(|fix| fix.p_n_m.z += 1110.0 * (1.0 / 0.3048 - 1.0));
    let said = sentence(&recording, &pole());
    assert!(said.contains("feet"), "{said}");
}

#[test]
fn positions_of_another_day_are_said() {
    let mut recording = upright();
    recording.fixes.iter_mut().for_each(|fix| fix.t_ns += 86_400_000_000_000);
    let said = sentence(&recording, &pole());
    assert!(said.contains("another day"), "{said}");
}

#[test]
fn only_stretches_of_fixes_between_two_gaps_are_doubted() {
    let mut fixes = upright().fixes;
    fixes.retain(|fix| {
        let t_s = fix.t_ns / 1_000_000_000;
        !(5..10).contains(&t_s) && !(15..20).contains(&t_s)
    });
    let found = islands(&fixes);
    let [island] = found[..] else { panic!("{found:?}") };
    let ends = [fixes[island.fixes[0]].t_ns, fixes[island.fixes[1] - 1].t_ns];
    assert_eq!(ends, [10_000_000_000, 14_800_000_000]);
    assert!(islands(&upright().fixes).is_empty());
}

#[test]
fn an_island_that_is_off_by_more_than_everything_else_allows_is_not_trusted() {
    let sure = Matrix3::identity() * 0.03 * 0.03;
    assert!(agrees(&Vector3::new(0.02, -0.05, 0.04), &sure));
    assert!(!agrees(&Vector3::new(0.3, 0.0, 0.0), &sure));
    // What cannot be held against anything is not trusted either.
    assert!(!agrees(&Vector3::zeros(), &(sure * 25.0)));
}
