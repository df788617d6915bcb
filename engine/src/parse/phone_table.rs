//! Applications that log all sensors of a phone into one table, by the names of their columns.
//!
//! | who | time | rate | force | field, pressure |
//! |---|---|---|---|---|
//! | AndroSensor | `Time since start in ms` | `GYROSCOPE X (rad/s)` | `ACCELEROMETER X (m/s²)` | `MAGNETIC FIELD X (μT)`, `ATMOSPHERIC PRESSURE (hPa)` |
//! | SensorLog | `loggingTime(txt)`, `accelerometerTimestamp_sinceReboot(s)` | `gyroRotationX(rad/s)` | `accelerometerAccelerationX(G)` | `magnetometerX(µT)`, `altimeterPressure(kPa)` |
//! | Physics Toolbox | `time` | `wx` (rad/s) | `gFx` (g) | `Bx` (µT), `p` (hPa) |
//!
//! SensorLog's forces have Apple's sign: what pulls and not what holds, as a phone at rest with its screen up tells −1 g along z.

use crate::parse::clock_text;
use crate::parse::error::ParseError;
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit};
use crate::parse::table_head::{Candidate, Names, TextHead};

pub(super) fn recognise(head: &TextHead, header: &Candidate<'_>) -> Option<Result<Recognised, ParseError>> {
    let names = &header.names;
    let mut acc = names.axes(&[
        ("accelerometer{}(m/s2)", ForceUnit::MS2),
        ("accelerometeracceleration{}(g)", ForceUnit::G),
        ("gf{}", ForceUnit::G),
    ])?;
    if acc.columns[0].to_lowercase().contains("acceleration") {
        acc.one_is = Some(-1.0);
    }
    let gyr = names.axes(&[
        ("gyroscope{}(rad/s)", RateUnit::RadS),
        ("gyrorotation{}(rad/s)", RateUnit::RadS),
        ("w{}", RateUnit::RadS),
    ])?;
    let time = time_of(head, header, names)?;
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr,
        acc,
        mag: names.axes(&[
            ("magneticfield{}(ut)", FieldUnit::Ut),
            ("magnetometer{}(ut)", FieldUnit::Ut),
            ("b{}", FieldUnit::Ut),
        ]),
        pressure: names.one(&[
            ("atmosphericpressure(hpa)", PressureUnit::Hpa),
            ("altimeterpressure(kpa)", PressureUnit::Kpa),
            ("p", PressureUnit::Hpa),
        ]),
        skip_rows_without_inertial: true,
    };
    Some(Ok(Recognised::table(LogFormat::PhoneTable, mapping, head.shown(header))))
}

fn time_of(head: &TextHead, header: &Candidate<'_>, names: &Names<'_>) -> Option<TimeSource> {
    let of =
        |column: String, unit| Some(TimeSource { column: Some(column), unit, rate_hz: None, wraps_at: None });
    if let Some(clock) = names.one(&[
        ("timesincestartinms", TimeUnit::Ms),
        ("gyrotimestamp_sincereboot(s)", TimeUnit::S),
        ("accelerometertimestamp_sincereboot(s)", TimeUnit::S),
    ]) {
        return of(clock.column, clock.unit);
    }
    let first = head.row_below(header);
    ["loggingtime(txt)", "time"].iter().find_map(|name| {
        let at = names.find(name)?;
        let cell = first.get(at)?;
        let dated = clock_text::is_time(cell.as_bytes());
        let unit = if dated { TimeUnit::DateTime } else { TimeUnit::S };
        (dated || cell.replace(',', ".").parse::<f64>().is_ok())
            .then(|| of(names.all[at].to_owned(), unit))
            .flatten()
    })
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::LogFormat;
    use crate::parse::log_reader::samples_of;

    #[test]
    fn each_application_is_known_by_its_columns() {
        let andro = "ACCELEROMETER X (m/s²);ACCELEROMETER Y (m/s²);ACCELEROMETER Z (m/s²);GRAVITY X (m/s²);LINEAR ACCELERATION X (m/s²);GYROSCOPE X (rad/s);GYROSCOPE Y (rad/s);GYROSCOPE Z (rad/s);MAGNETIC FIELD X (μT);MAGNETIC FIELD Y (μT);MAGNETIC FIELD Z (μT);ATMOSPHERIC PRESSURE (hPa);Time since start in ms ;YYYY-MO-DD HH-MI-SS_SSS\n\
            0.1;0.2;9.8;0;0;0.3;0;0;20;-5;40;901.5;5;2026-11-25 09-30-00_005\n0.1;0.2;9.8;0;0;0.3;0;0;20;-5;40;901.5;15;2026-11-25 09-30-00_015\n";
        let log = "loggingTime(txt),loggingSample(N),accelerometerAccelerationX(G),accelerometerAccelerationY(G),accelerometerAccelerationZ(G),gyroRotationX(rad/s),gyroRotationY(rad/s),gyroRotationZ(rad/s),magnetometerX(µT),magnetometerY(µT),magnetometerZ(µT),altimeterPressure(kPa)\n\
            2026-11-25 09:30:00.005 +0800,1,0,0,-1,0.3,0,0,20,-5,40,90.15\n2026-11-25 09:30:00.015 +0800,2,0,0,-1,0.3,0,0,20,-5,40,90.15\n";
        let toolbox = "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,p,Bx,By,Bz\n\
            0.005,0,0,1,0,0,0,0.3,0,0,901.5,20,-5,40\n0.015,0,0,1,0,0,0,0.3,0,0,901.5,20,-5,40\n";
        for text in [andro, log, toolbox] {
            let (recognised, samples) = samples_of(text.as_bytes()).unwrap();
            assert_eq!((recognised.format, samples[1].t_ns), (LogFormat::PhoneTable, 10_000_000), "{text}");
            let first = samples[0];
            assert!((first.f_b_m_s2[2] - 9.8).abs() < 0.01, "{first:?}");
            assert_eq!((first.w_ib_b_rad_s[0], first.mag_b_ut), (0.3, Some([20.0, -5.0, 40.0])));
            assert!((first.pressure_hpa.unwrap() - 901.5).abs() < 1e-9);
        }
    }
}
