//! The CSV files of MicroStrain's SensorConnect, and of MIP Monitor before it.
//!
//! Both begin with a block on the file and the device, then a line `DATA_START`, then the header. Sources of
//! the layout: SensorConnect exports of 3DM-CV5, CV7 and GX5 sensors that people read in public code
//! (`Time`, `inertial-6253.76535:scaledAccelX`, …, times as text, in seconds or in nanoseconds since 1970,
//! a `referenceTime` of the sensor in ns), and the reader of the NaveGo toolbox for MIP Monitor
//! (`GPS TOW`, `X Accel [x8004]`, `X Gyro [x8005]`, `X Mag [x8006]`). The units are those of the MIP
//! protocol's scaled vectors: g, rad/s, gauss, millibar; a name that carries another unit wins.

use crate::parse::clock_text;
use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit};
use crate::parse::table_head::{Candidate, Names, TextHead};

pub(super) fn recognise(head: &TextHead, header: &Candidate<'_>) -> Option<Result<Recognised, ParseError>> {
    let names = header.names.without_devices();
    let acc = names.axes(&[
        ("scaledaccel{}", ForceUnit::G),
        ("scaledaccel{}(g)", ForceUnit::G),
        ("scaledaccel{}[g]", ForceUnit::G),
        ("scaledaccel{}(m/s2)", ForceUnit::MS2),
        ("scaledaccel{}[m/s2]", ForceUnit::MS2),
        ("{}accel[x8004]", ForceUnit::G),
    ])?;
    let gyr = names.axes(&[
        ("scaledgyro{}", RateUnit::RadS),
        ("scaledgyro{}(rad/s)", RateUnit::RadS),
        ("scaledgyro{}[rad/s]", RateUnit::RadS),
        ("scaledgyro{}(rad/sec)", RateUnit::RadS),
        ("scaledgyro{}[rad/sec]", RateUnit::RadS),
        ("scaledgyro{}(deg/s)", RateUnit::DegS),
        ("scaledgyro{}[deg/s]", RateUnit::DegS),
        ("{}gyro[x8005]", RateUnit::RadS),
    ])?;
    let mag = names.axes(&[
        ("scaledmag{}", FieldUnit::Gauss),
        ("scaledmag{}(gauss)", FieldUnit::Gauss),
        ("scaledmag{}[gauss]", FieldUnit::Gauss),
        ("scaledmag{}(ut)", FieldUnit::Ut),
        ("scaledmag{}[ut]", FieldUnit::Ut),
        ("{}mag[x8006]", FieldUnit::Gauss),
    ]);
    let pressure = names.one(&[
        ("scaledambientpressure", PressureUnit::Hpa),
        ("scaledambientpressure(mbar)", PressureUnit::Hpa),
        ("scaledambientpressure[mbar]", PressureUnit::Hpa),
        ("scaledambientpressure(hpa)", PressureUnit::Hpa),
        ("ambientpressure[x8017]", PressureUnit::Hpa),
    ]);
    let Some(time) = time_of(&names, &head.row_below(header)) else {
        return Some(Err(ParseError::new(
            ParseErrorKind::MappingNeeded,
            "a column Time, referenceTime or GPS TOW",
            format!("the columns {}", header.names.all.join(", ")),
            "export the log with its time column, or choose the columns by hand",
        )
        .at_line(header.line as u64 + 1)));
    };
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr,
        acc,
        mag,
        pressure,
        // Channels of other rates stand in rows of their own.
        skip_rows_without_inertial: true,
    };
    Some(Ok(Recognised::table(LogFormat::MicroStrain, mapping, head.shown(header))))
}

/// The sensor's own clock before that of the computer.
fn time_of(names: &Names<'_>, first: &[&str]) -> Option<TimeSource> {
    for (pattern, unit) in [
        ("referencetime", Some(TimeUnit::Ns)),
        ("referencetimestamp", Some(TimeUnit::Ns)),
        ("time", None),
        ("gpstow", Some(TimeUnit::S)),
    ] {
        let Some(index) = names.find(pattern) else { continue };
        let Some(field) = first.get(index) else { continue };
        let unit = match (unit, field.parse::<f64>()) {
            (Some(unit), Ok(_)) => unit,
            (None, Ok(value)) => unit_by_size(value),
            (None, Err(_)) if clock_text::is_time(field.as_bytes()) => TimeUnit::DateTime,
            _ => continue,
        };
        let column = Some(names.all[index].to_owned());
        return Some(TimeSource { column, unit, rate_hz: None, wraps_at: None });
    }
    None
}

/// A time since 1970 is 1.7·10⁹ s; since the device was switched on it is less, in seconds.
fn unit_by_size(value: f64) -> TimeUnit {
    match value.abs() {
        v if v > 1e17 => TimeUnit::Ns,
        v if v > 1e14 => TimeUnit::Us,
        v if v > 1e11 => TimeUnit::Ms,
        _ => TimeUnit::S,
    }
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::LogFormat;
    use crate::parse::log_reader::samples_of;

    fn sensor_connect(times: [&str; 3]) -> String {
        let device = "inertial-6253.76535:";
        let columns: Vec<String> = [
            "scaledAccelX",
            "scaledAccelY",
            "scaledAccelZ",
            "scaledGyroX",
            "scaledGyroY",
            "scaledGyroZ",
            "scaledMagX",
            "scaledMagY",
            "scaledMagZ",
            "scaledAmbientPressure",
        ]
        .iter()
        .map(|name| format!("{device}{name}"))
        .collect();
        format!(
            "FILE_INFO\nListSeparator,comma\n\nDEVICE_INFO\nModelName,3DM-CV5\n\nDATA_START\nTime,{}\n\
             {},0,0,1,0.5,0,0,0.25,0,-0.4,901.5\n{},,,,,,,,,,\n{},0,0,-1,0,0,0,,,,\n",
            columns.join(","),
            times[0],
            times[1],
            times[2]
        )
    }

    #[test]
    fn sensor_connect_with_every_kind_of_time() {
        for times in [
            ["11/25/2026 09:30:00.000000000", "11/25/2026 09:30:00.004", "11/25/2026 09:30:00.005000000"],
            ["1764063000000000000", "1764063000004000000", "1764063000005000000"],
            ["1764063000.000", "1764063000.004", "1764063000.005"],
        ] {
            let (recognised, samples) = samples_of(sensor_connect(times).as_bytes()).unwrap();
            assert_eq!(recognised.format, LogFormat::MicroStrain);
            // The row of another stream is left out.
            assert_eq!(samples.len(), 2, "{times:?}");
            assert_eq!((samples[0].t_ns, samples[1].t_ns), (0, 5_000_000), "{times:?}");
            assert_eq!(samples[0].w_ib_b_rad_s, [0.5, 0.0, 0.0]);
            assert!((samples[0].f_b_m_s2[2] - 9.806_65).abs() < 1e-12);
            assert_eq!(samples[0].mag_b_ut, Some([25.0, 0.0, -40.0]));
            assert_eq!((samples[0].pressure_hpa, samples[1].mag_b_ut), (Some(901.5), None));
        }
    }

    #[test]
    fn mip_monitor() {
        let text = "FILE_INFO\nListSeparator=comma\n\nDEVICE_INFO\nModelName,3DM-GX3-35\n\nDATA_START\n\
            GPS TFlags,GPS Week,GPS TOW,X Accel [x8004],Y Accel [x8004],Z Accel [x8004],X Gyro [x8005],Y Gyro [x8005],Z Gyro [x8005],X Mag [x8006],Y Mag [x8006],Z Mag [x8006]\n\
            7,1936,12345.01,0,0,1,0,0.1,0,0.3,0,0.3\n7,1936,12345.02,0,0,1,0,0,0,0.3,0,0.3\n";
        let (_, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!((samples.len(), samples[1].t_ns), (2, 10_000_000));
        assert_eq!(samples[0].mag_b_ut, Some([30.0, 0.0, 30.0]));
    }

    #[test]
    fn without_a_time_it_asks_for_one() {
        let error = samples_of(sensor_connect(["", "", ""]).as_bytes()).unwrap_err();
        assert_eq!(error.code(), "mapping_needed");
    }
}
