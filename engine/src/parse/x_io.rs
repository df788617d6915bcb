//! The CSV files of x-io's NGIMU and x-IMU3: the unit of every column stands in its name.
//!
//! The layout is that of the logged sessions that x-io publishes as examples (`sensors.csv` of
//! NGIMU-MATLAB-Import-Logged-Data-Example: `Time (s)`, `Gyroscope X (deg/s)`, `Accelerometer X (g)`,
//! `Magnetometer X (uT)`, `Barometer (hPa)`; `short_walk.csv` of Gait-Tracking without the last four), and
//! of what the x-IMU3 software writes as `Inertial.csv` (`Timestamp (us)`). The x-IMU3 tells its
//! magnetometer in a file of its own, in a unit that is 1 for the Earth's field wherever it was calibrated.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit};
use crate::parse::table_head::{Candidate, TextHead};

pub(super) fn recognise(
    head: &TextHead,
    header: &Candidate<'_>,
    rate_hz: Option<f64>,
) -> Option<Result<Recognised, ParseError>> {
    let names = &header.names;
    let gyr =
        names.axes(&[("gyroscope{}(deg/s)", RateUnit::DegS), ("gyroscope{}(rad/s)", RateUnit::RadS)])?;
    let acc =
        names.axes(&[("accelerometer{}(g)", ForceUnit::G), ("accelerometer{}(m/s2)", ForceUnit::MS2)])?;
    let clock = names.one(&[
        ("time(s)", TimeUnit::S),
        ("timestamp(us)", TimeUnit::Us),
        ("time(us)", TimeUnit::Us),
        ("timestamp(s)", TimeUnit::S),
    ]);
    let time = match (clock, names.one(&[("packetnumber", TimeUnit::Samples)])) {
        (Some(clock), _) => {
            TimeSource { column: Some(clock.column), unit: clock.unit, rate_hz: None, wraps_at: None }
        }
        (None, Some(packets)) if rate_hz.is_some() => {
            TimeSource { column: Some(packets.column), unit: TimeUnit::Samples, rate_hz, wraps_at: None }
        }
        // Another program's, that tells the time otherwise.
        _ if names.all.iter().any(|name| name.to_lowercase().contains("time")) => return None,
        _ => return Some(Err(without_time(header))),
    };
    let mag = names.axes(&[
        ("magnetometer{}(ut)", FieldUnit::Ut),
        ("magnetometer{}(g)", FieldUnit::Gauss),
        ("magnetometer{}(gauss)", FieldUnit::Gauss),
        ("magnetometer{}(a.u.)", FieldUnit::Counts),
    ]);
    let pressure = names.one(&[
        ("barometer(hpa)", PressureUnit::Hpa),
        ("pressure(hpa)", PressureUnit::Hpa),
        ("pressure(pa)", PressureUnit::Pa),
    ]);
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr,
        acc,
        mag,
        pressure,
        skip_rows_without_inertial: false,
    };
    Some(Ok(Recognised::table(LogFormat::XIo, mapping, head.shown(header))))
}

fn without_time(header: &Candidate<'_>) -> ParseError {
    ParseError::new(
        ParseErrorKind::MappingNeeded,
        "a column Time (s) or Timestamp (us), or the rate of the samples",
        format!("the columns {}", header.names.all.join(", ")),
        "export the log with time stamps, or give the rate that the sensor was set to, in Hz",
    )
    .at_line(header.line as u64 + 1)
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::{LogFormat, Note};
    use crate::parse::log_reader::samples_of;

    const NGIMU: &str = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)\n\
        12.000000000,180,-90,0.5,0.5,0.0,-1.0,-0.46,-19.2,-40.8,902.5\n\
        12.010026,0,0,0,0,0,1,,,,902.5\n";

    #[test]
    fn ngimu_units_become_the_engine_s_and_time_begins_at_the_first_row() {
        let (recognised, samples) = samples_of(NGIMU.as_bytes()).unwrap();
        assert_eq!(recognised.format, LogFormat::XIo);
        let first = samples[0];
        assert_eq!((first.t_ns, samples[1].t_ns), (0, 10_026_000));
        assert!((first.w_ib_b_rad_s[0] - std::f64::consts::PI).abs() < 1e-12);
        assert!((first.f_b_m_s2[2] + 9.806_65).abs() < 1e-12);
        assert_eq!(first.mag_b_ut, Some([-0.46, -19.2, -40.8]));
        assert_eq!(first.pressure_hpa, Some(902.5));
        assert_eq!(samples[1].mag_b_ut, None);
    }

    #[test]
    fn x_imu3_counts_microseconds_and_its_field_has_no_unit() {
        let text = "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n\
            1700000000000000,0,0,0,0,0,1\n1700000000002500,0,0,0,0,0,1\n";
        let (recognised, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!(samples[1].t_ns, 2_500_000);
        assert!(recognised.notes.is_empty());
        let with_field = text
            .replace("Z (g)\n", "Z (g),Magnetometer X (a.u.),Magnetometer Y (a.u.),Magnetometer Z (a.u.)\n")
            .replace("0,0,1\n", "0,0,1,1,0,0\n");
        let (recognised, samples) = samples_of(with_field.as_bytes()).unwrap();
        assert_eq!((samples[0].mag_b_ut, &recognised.notes[..]), (None, &[Note::FieldWithoutUnit][..]));
    }

    #[test]
    fn packets_without_a_clock_ask_for_the_rate() {
        let text = NGIMU.replace("Time (s)", "Packet number");
        let error = samples_of(text.as_bytes()).unwrap_err();
        assert_eq!(error.code(), "mapping_needed");
        assert!(error.advice.contains("in Hz"), "{error}");
    }
}
