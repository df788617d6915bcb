//! The CSV and tab-parted exports of Shimmer's Consensys and ConsensysPRO.
//!
//! A line `sep=` may stand first, then names such as `Shimmer_9E21_Accel_LN_X_CAL`, then a row of units (`m/(s^2)`, `deg/s`,
//! `local_flux`, `kPa`); times are milliseconds since 1970 (`Timestamp_Unix_CAL`) or since the sensor was switched on. The low-noise
//! accelerometer reaches 2 g, which no step stays within: the wide-range one is taken where both are there. The field is in
//! shares of the place's own, which is no unit. What is `RAW` is in counts.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit};
use crate::parse::table_head::{Candidate, TextHead};

pub(super) fn recognise(head: &TextHead, header: &Candidate<'_>) -> Option<Result<Recognised, ParseError>> {
    if !header.names.all.iter().any(|name| name.trim().to_lowercase().starts_with("shimmer_")) {
        return None;
    }
    // `shimmer_9e21_gyro_x_cal`: the device, then the channel.
    let names = header.names.shortened(|name| {
        name.strip_prefix("shimmer_")
            .and_then(|rest| rest.split_once('_'))
            .map_or(name, |(_, channel)| channel)
    });
    let units = head.row_below(header);
    let unit_of = |column: &str| -> String {
        let at = header.names.all.iter().position(|name| *name == column);
        at.and_then(|at| units.get(at)).map(|unit| unit.to_lowercase()).unwrap_or_default()
    };
    let gyr = names.axes(&[("gyro_{}_cal", RateUnit::DegS)]);
    let acc = names.axes(&[
        ("accel_wr_{}_cal", ForceUnit::MS2),
        ("accel_ln_{}_cal", ForceUnit::MS2),
        ("accel_{}_cal", ForceUnit::MS2),
    ]);
    let time = names.one(&[
        ("timestamp_unix_cal", TimeUnit::Ms),
        ("timestamp_sync_unix_cal", TimeUnit::Ms),
        ("timestamp_sync_cal", TimeUnit::Ms),
        ("timestamp_cal", TimeUnit::Ms),
        ("system_timestamp_cal", TimeUnit::Ms),
        ("timestamp_formattedunix_cal", TimeUnit::DateTime),
    ]);
    let (Some(mut gyr), Some(mut acc), Some(time)) = (gyr, acc, time) else {
        return Some(Err(ParseError::new(
            ParseErrorKind::MappingNeeded,
            "calibrated channels of a Shimmer: Timestamp, Gyro and Accel, each ending in CAL",
            format!("the columns {}", header.names.all.join(", ")),
            "export calibrated data with gyroscope, accelerometer and time stamps from Consensys",
        )
        .at_line(header.line as u64 + 1)));
    };
    if unit_of(&gyr.columns[0]).starts_with("rad") {
        gyr.unit = RateUnit::RadS;
    }
    if unit_of(&acc.columns[0]) == "g" {
        acc.unit = ForceUnit::G;
    }
    let mag = names.axes(&[("mag_{}_cal", FieldUnit::Counts)]).map(|mut mag| {
        if matches!(unit_of(&mag.columns[0]).as_str(), "ut" | "µt") {
            mag.unit = FieldUnit::Ut;
        }
        mag
    });
    let pressure = names.one(&[
        ("pressure_bmp280_cal", PressureUnit::Kpa),
        ("pressure_bmp180_cal", PressureUnit::Kpa),
        ("pressure_bmp390_cal", PressureUnit::Kpa),
    ]);
    let time = TimeSource { column: Some(time.column), unit: time.unit, rate_hz: None, wraps_at: None };
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr,
        acc,
        mag,
        pressure,
        skip_rows_without_inertial: true,
    };
    Some(Ok(Recognised::table(LogFormat::Shimmer, mapping, head.shown(header))))
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::{LogFormat, Note};
    use crate::parse::log_reader::samples_of;

    /// As Consensys writes it: a line for spreadsheets, names, units, rows that end in a tabulator.
    pub(in crate::parse) const CONSENSYS: &str = "\"sep=\t\"\n\
        Shimmer_9E21_Timestamp_Unix_CAL\tShimmer_9E21_Accel_LN_X_CAL\tShimmer_9E21_Accel_LN_Y_CAL\tShimmer_9E21_Accel_LN_Z_CAL\tShimmer_9E21_Gyro_X_CAL\tShimmer_9E21_Gyro_Y_CAL\tShimmer_9E21_Gyro_Z_CAL\tShimmer_9E21_Mag_X_CAL\tShimmer_9E21_Mag_Y_CAL\tShimmer_9E21_Mag_Z_CAL\tShimmer_9E21_Pressure_BMP280_CAL\t\n\
        ms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s\tlocal_flux\tlocal_flux\tlocal_flux\tkPa\t\n\
        1764063000000.0\t0.1\t0.2\t9.8\t180.0\t0.0\t-90.0\t0.6\t0.1\t-0.7\t89.05\t\n\
        1764063000009.765\t0.1\t0.2\t9.8\t0.0\t0.0\t0.0\t0.6\t0.1\t-0.7\t89.05\t\n";

    #[test]
    fn a_consensys_export_is_read_below_its_rows_of_names_and_units() {
        let (recognised, samples) = samples_of(CONSENSYS.as_bytes()).unwrap();
        assert_eq!(
            (recognised.format, &recognised.notes[..]),
            (LogFormat::Shimmer, &[Note::FieldWithoutUnit][..])
        );
        // Milliseconds of Unix time as one number are told to a quarter of a microsecond.
        assert!(samples.len() == 2 && (samples[1].t_ns - 9_765_000).abs() < 300, "{samples:?}");
        assert_eq!(samples[0].f_b_m_s2, [0.1, 0.2, 9.8]);
        assert!((samples[0].w_ib_b_rad_s[0] - std::f64::consts::PI).abs() < 1e-12);
        assert!((samples[0].pressure_hpa.unwrap() - 890.5).abs() < 1e-9);
        assert_eq!(samples[0].mag_b_ut, None);
    }

    #[test]
    fn raw_counts_are_refused_with_what_to_export() {
        let error = samples_of(CONSENSYS.replace("_CAL", "_RAW").as_bytes()).unwrap_err();
        assert!(error.advice.contains("calibrated"), "{error}");
    }
}
