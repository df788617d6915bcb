//! The CSV exports of APDM's Opal sensors (Motion Studio, Mobility Lab, and what converters make of their HDF5 files).
//!
//! The file itself is HDF5, which is refused with what to export. A table names its channels in words with units:
//! `Acceleration X (m/s^2)`, `Angular Velocity X (rad/s)`, `Magnetic Field X (uT)`, `Barometer (kPa)`, `Time (us)` or `Time (s)`.
//! Of Phyphox's single tables those with rates and forces together look the same (`Acceleration x (m/s^2)`, `Gyroscope x (rad/s)`).

use crate::parse::error::ParseError;
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit};
use crate::parse::table_head::{Candidate, TextHead};

pub(super) fn recognise(head: &TextHead, header: &Candidate<'_>) -> Option<Result<Recognised, ParseError>> {
    let names = &header.names;
    let acc = names.axes(&[
        ("acceleration{}(m/s2)", ForceUnit::MS2),
        ("accelerometer{}(m/s2)", ForceUnit::MS2),
        ("acceleration{}(g)", ForceUnit::G),
        ("accelerationwithg{}(m/s2)", ForceUnit::MS2),
    ])?;
    let gyr = names.axes(&[
        ("angularvelocity{}(rad/s)", RateUnit::RadS),
        ("angularvelocity{}(deg/s)", RateUnit::DegS),
        ("gyroscope{}(rad/s)", RateUnit::RadS),
        ("gyroscope{}(deg/s)", RateUnit::DegS),
    ])?;
    let clock = names.one(&[
        ("time(us)", TimeUnit::Us),
        ("time(s)", TimeUnit::S),
        ("time(ms)", TimeUnit::Ms),
        ("time(ns)", TimeUnit::Ns),
        ("timestamp(us)", TimeUnit::Us),
        ("timestamp(s)", TimeUnit::S),
    ])?;
    let mag = names.axes(&[
        ("magneticfield{}(ut)", FieldUnit::Ut),
        ("magnetometer{}(ut)", FieldUnit::Ut),
        ("magneticfield{}(gauss)", FieldUnit::Gauss),
    ]);
    let pressure = names.one(&[
        ("barometer(kpa)", PressureUnit::Kpa),
        ("pressure(kpa)", PressureUnit::Kpa),
        ("barometer(hpa)", PressureUnit::Hpa),
        ("pressure(hpa)", PressureUnit::Hpa),
    ]);
    let time = TimeSource { column: Some(clock.column), unit: clock.unit, rate_hz: None, wraps_at: None };
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr,
        acc,
        mag,
        pressure,
        skip_rows_without_inertial: false,
    };
    Some(Ok(Recognised::table(LogFormat::Apdm, mapping, head.shown(header))))
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::LogFormat;
    use crate::parse::log_reader::samples_of;

    #[test]
    fn channels_are_named_in_words_with_their_units() {
        let text = "Time (us),Acceleration X (m/s^2),Acceleration Y (m/s^2),Acceleration Z (m/s^2),Angular Velocity X (rad/s),Angular Velocity Y (rad/s),Angular Velocity Z (rad/s),Magnetic Field X (µT),Magnetic Field Y (µT),Magnetic Field Z (µT),Barometer (kPa)\n\
            1764063000000000,0.1,0.2,9.8,0.3,0,0,30,20,-31,89.05\n1764063000007812,0.1,0.2,9.8,0.3,0,0,30,20,-31,89.05\n";
        let (recognised, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!((recognised.format, samples[1].t_ns), (LogFormat::Apdm, 7_812_000));
        assert_eq!((samples[0].f_b_m_s2, samples[0].w_ib_b_rad_s), ([0.1, 0.2, 9.8], [0.3, 0.0, 0.0]));
        assert_eq!(samples[0].mag_b_ut, Some([30.0, 20.0, -31.0]));
    }
}
