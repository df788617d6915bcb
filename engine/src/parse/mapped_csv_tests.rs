use super::*;
use crate::parse::mapping::{FieldUnit, ForceUnit, PressureUnit, RateUnit, Scalar, TimeSource};

fn mapping(time: TimeSource) -> Mapping {
    let axes = |name: &str| ["x", "y", "z"].map(|axis| format!("{name}{axis}"));
    Mapping {
        delimiter: Delimiter::Comma,
        time,
        gyr: Axes::of(axes("g"), RateUnit::RadS),
        acc: Axes::of(axes("a"), ForceUnit::MS2),
        mag: None,
        pressure: None,
        skip_rows_without_inertial: false,
    }
}

fn clock(unit: TimeUnit) -> TimeSource {
    TimeSource { column: Some("t".to_owned()), unit, rate_hz: None, wraps_at: None }
}

fn read(mapping: Mapping, text: &str) -> Result<Vec<ImuSample>, ParseError> {
    let mut parser = MappedCsv::new(mapping, None)?;
    let mut samples = Vec::new();
    for piece in text.as_bytes().chunks(7) {
        parser.push(piece, &mut samples)?;
    }
    parser.finish(&mut samples)?;
    Ok(samples)
}

const HEADER: &str = "t,gx,gy,gz,ax,ay,az";

#[test]
fn every_unit_of_time_is_exact() {
    for (unit, first, second) in [
        (TimeUnit::S, "1700000000.000000001", "1700000000.000000003"),
        (TimeUnit::Ms, "1700000000000", "1700000000000.000002"),
        (TimeUnit::Us, "5", "5.002"),
        (TimeUnit::Ns, "1700000000000000001", "1700000000000000003"),
    ] {
        let text = format!("{HEADER}\n{first},0,0,0,0,0,9.8\n{second},0,0,0,0,0,9.8\n");
        let samples = read(mapping(clock(unit)), &text).unwrap();
        let step = samples[1].t_ns - samples[0].t_ns;
        // A fraction of a large number goes through a float.
        assert!(if unit == TimeUnit::Ms { step.abs() < 300 } else { step == 2 }, "{unit:?}: {step}");
    }
}

#[test]
fn rows_may_be_counted_instead() {
    let rate = TimeSource { column: None, unit: TimeUnit::S, rate_hz: Some(100.0), wraps_at: None };
    let text = format!("{HEADER}\n,0,0,0,0,0,9.8\n,0,0,0,0,0,9.8\n");
    assert_eq!(read(mapping(rate), &text).unwrap()[1].t_ns, 10_000_000);
}

#[test]
fn the_header_may_stand_below_other_lines_and_its_columns_in_any_order() {
    let mut wanted = mapping(clock(TimeUnit::S));
    wanted.mag = Some(Axes::of(["my", "mx", "mz"].map(str::to_owned), FieldUnit::Mgauss));
    wanted.pressure = Some(Scalar { column: "p".to_owned(), unit: PressureUnit::Kpa });
    let text = "Site 7\r\n\r\nseven,lines,of,this,and,that,az\r\nnote,p,mx,my,mz,az,ay,ax,gz,gy,gx,t\r\nhi,90.15,100,200,300,3,2,1,6,5,4,0.5\r\nhi,,,,,3,2,1,6,5,4,0.6\r\n";
    let samples = read(wanted, text).unwrap();
    assert_eq!(samples[0].f_b_m_s2, [1.0, 2.0, 3.0]);
    assert_eq!(samples[0].w_ib_b_rad_s, [4.0, 5.0, 6.0]);
    assert_eq!(samples[0].mag_b_ut, Some([20.0, 10.0, 30.0]));
    assert_eq!(samples[0].pressure_hpa, Some(901.5));
    assert_eq!((samples[1].mag_b_ut, samples[1].pressure_hpa), (None, None));
}

#[test]
fn what_is_wrong_is_named() {
    let row = "0,0,0,0,0,0,9.8\n";
    let error = |text: String| read(mapping(clock(TimeUnit::S)), &text).unwrap_err();
    let other = error("a,b,c\n1,2,3\n".to_owned());
    assert_eq!(other.code(), "missing_column");
    assert!(other.to_string().contains("the file begins \"a, b, c\""), "{other}");
    assert_eq!(error(format!("{HEADER}\n")).code(), "empty_file");
    let word = error(format!("x\n{HEADER}\n0.1,0,zero,0,0,0,9.8\n"));
    assert_eq!((word.code(), word.line, word.column.as_deref()), ("not_a_number", Some(3), Some("gy")));
    let short = error(format!("{HEADER}\n0.1,0,0\n"));
    assert_eq!((short.code(), short.line), ("wrong_field_count", Some(2)));
    assert_eq!(error(format!("{HEADER}\n,0,0,0,0,0,9.8\n")).code(), "bad_time");
    assert_eq!(error(format!("{HEADER},gx\n0,0,0,0,0,0,9.8,1\n")).code(), "repeated_column");
    assert_eq!(error("\n".repeat(2000)).code(), "missing_column");
    assert_eq!(error(format!("{HEADER}\n0,0,0,0,0,,9.8\n")).code(), "empty_field");
    let mut merged = mapping(clock(TimeUnit::S));
    merged.skip_rows_without_inertial = true;
    assert_eq!(read(merged.clone(), &format!("{HEADER}\n0,0,0,0,0,,9.8\n{row}")).unwrap().len(), 1);
    assert_eq!(read(merged, &format!("{HEADER}\n0,0,0,0,0,,9.8\n")).unwrap_err().code(), "empty_file");
}

/// A foot that walks, in rad/s and m/s², multiplied by these.
fn walk(rate: f64, force: f64) -> String {
    let mut text = format!("{HEADER}\n");
    for i in 0..2000 {
        let swing = i % 100 < 40;
        let (w, f) = if swing { (4.0, 16.0) } else { (0.01, 9.8) };
        text += &format!("{},{},0,0,0,0,{}\n", f64::from(i) * 0.01, w * rate, f * force);
    }
    text
}

#[test]
fn units_that_were_said_wrong_are_found_out() {
    let said = |rate, force| {
        let mut mapping = mapping(clock(TimeUnit::S));
        mapping.gyr.unit = rate;
        mapping.acc.unit = force;
        mapping
    };
    let degrees = 180.0 / std::f64::consts::PI;
    let (rad, deg, ms2, g) = (RateUnit::RadS, RateUnit::DegS, ForceUnit::MS2, ForceUnit::G);
    assert_eq!(read(said(rad, ms2), &walk(1.0, 1.0)).unwrap().len(), 2000);
    assert_eq!(read(said(deg, g), &walk(degrees, 1.0 / 9.806_65)).unwrap().len(), 2000);
    let code = |mapping, text: String| read(mapping, &text).unwrap_err();
    let error = code(said(rad, ms2), walk(degrees, 1.0));
    assert_eq!(error.code(), "degrees_not_radians");
    assert!(error.advice.contains("choose deg/s"), "{error}");
    assert_eq!(code(said(deg, ms2), walk(1.0, 1.0)).code(), "radians_not_degrees");
    assert_eq!(code(said(rad, ms2), walk(1.0, 1.0 / 9.806_65)).code(), "g_not_metres");
    assert_eq!(code(said(rad, g), walk(1.0, 1.0)).code(), "metres_not_g");
}
