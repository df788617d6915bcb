use super::*;
use crate::parse::mapping::{Delimiter, TimeSource, TimeUnit};

/// A foot that walks for 20 s, with a field of 50 µT and 890 hPa.
fn walk() -> Vec<ImuSample> {
    (0..2000)
        .map(|k| {
            let swing = k % 100 < 40;
            let (w, f) = if swing { (4.0, 16.0) } else { (0.01, 9.8) };
            ImuSample {
                t_ns: k * 10_000_000,
                w_ib_b_rad_s: [w, 0.0, 0.0],
                f_b_m_s2: [0.0, 0.0, f],
                mag_b_ut: Some([30.0, 0.0, 40.0]),
                pressure_hpa: Some(890.0),
            }
        })
        .collect()
}

fn judged(said: Said, change: impl Fn(&mut ImuSample)) -> Result<(), ParseError> {
    let mut check = UnitsCheck::new(said);
    for mut sample in walk() {
        change(&mut sample);
        check.take(&sample)?;
    }
    check.finish()
}

fn times(value: &mut [f64; 3], by: f64) {
    *value = value.map(|x| x * by);
}

#[test]
fn every_unit_that_was_not_said_is_named_with_the_way_to_say_it() {
    judged(Said::CANONICAL, |_| {}).unwrap();
    let degrees = 180.0 / std::f64::consts::PI;
    type Change = Box<dyn Fn(&mut ImuSample)>;
    let rate = |by: f64| -> Change { Box::new(move |s| times(&mut s.w_ib_b_rad_s, by)) };
    let force = |by: f64| -> Change { Box::new(move |s| times(&mut s.f_b_m_s2, by / 9.8)) };
    let field = |by: f64| -> Change { Box::new(move |s| s.mag_b_ut = s.mag_b_ut.map(|m| m.map(|x| x * by))) };
    let pressure = |by: f64| -> Change { Box::new(move |s| s.pressure_hpa = s.pressure_hpa.map(|p| p * by)) };
    for (change, looks_like, way) in [
        (rate(degrees), "degrees per second", "deg/s"),
        (rate(degrees * 1e3), "thousandths of a degree", "mdeg/s"),
        (rate(degrees * 16.4 * 4.0), "counts", "one_is"),
        (force(1.0), "multiples of g", "g as their unit"),
        (force(1000.0), "mg", "mg as their unit"),
        (force(256.0), "256 for g", "one_is"),
        (force(2048.0), "2048 for g", "0.00048828125"),
        (force(16_384.0), "16384 for g", "one_is"),
        (field(0.01), "gauss", "gauss"),
        (field(10.0), "milligauss", "mgauss"),
        (field(1e3), "nanotesla", "nT"),
        (pressure(100.0), "pascals", "Pa"),
        (pressure(0.1), "kilopascals", "kPa"),
        (
            Box::new(|s: &mut ImuSample| s.f_b_m_s2[2] = if s.f_b_m_s2[2] > 10.0 { 9.0 } else { 0.05 }),
            "lacks gravity",
            "include gravity",
        ),
    ] {
        let error = judged(Said::CANONICAL, change).unwrap_err();
        assert!(error.found.contains(looks_like), "{looks_like}: {error}");
        assert!(error.advice.contains(way), "{way}: {error}");
    }
}

#[test]
fn what_a_broken_sensor_says_is_no_other_unit() {
    judged(Said::CANONICAL, |s| s.f_b_m_s2 = [0.0; 3]).unwrap();
    judged(Said::CANONICAL, |s| s.f_b_m_s2 = [f64::NAN; 3]).unwrap();
    judged(Said::CANONICAL, |s| times(&mut s.f_b_m_s2, 2.0)).unwrap();
    judged(Said::CANONICAL, |s| s.mag_b_ut = Some([0.0; 3])).unwrap();
    judged(Said::CANONICAL, |s| s.mag_b_ut = Some([1.0, 0.1, 0.0])).unwrap();
}

#[test]
fn what_was_said_of_a_table_is_taken_back_in_the_sentence() {
    let xyz = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}{axis}"));
    let said = Said::by(
        &Mapping {
            delimiter: Delimiter::Comma,
            time: TimeSource {
                column: Some("t".to_owned()),
                unit: TimeUnit::S,
                rate_hz: None,
                wraps_at: None,
            },
            gyr: Axes::of(xyz("g"), RateUnit::DegS),
            acc: Axes::of(xyz("a"), ForceUnit::Mg),
            mag: None,
            pressure: None,
            skip_rows_without_inertial: false,
        },
        false,
    );
    judged(said, |_| {}).unwrap();
    let error = judged(said, |s| times(&mut s.f_b_m_s2, 1e-3)).unwrap_err();
    assert!(error.found.contains("multiples of g") && error.found.contains("about 1.0"), "{error}");
}
