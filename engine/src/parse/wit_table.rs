//! The text logs of WitMotion's programs (WT901, HWT901B, CMP10A, …).
//!
//! Three generations are known, parted by tabs or commas, in English or Chinese, in UTF-8 or GBK. Sources of
//! the layout: WitMotion's own Python examples (`Chiptime ax(g) … wx(deg/s) … magx`), the readers of these
//! files in Gyroflow's telemetry parser (`ChipTime`, `hx`; `Chip Time()`, `Acceleration X(g)`,
//! `Angular velocity X(°/s)`, `Magnetic field X(uT)`), and logs of its phone application in public
//! notebooks (`time`, `DeviceName`, `AccX(g)`, `AsX(°/s)`, `HX(uT)`; 片上时间, 加速度X(g), 角速度X(°/s),
//! 磁场X(uT)). A field without a unit is in
//! counts that differ from model to model.

use crate::parse::clock_text;
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
    let acc = names.axes(&[
        ("a{}(g)", ForceUnit::G),
        ("acc{}(g)", ForceUnit::G),
        ("acceleration{}(g)", ForceUnit::G),
        ("加速度{}(g)", ForceUnit::G),
        ("acc{}(m/s2)", ForceUnit::MS2),
        ("a{}(m/s2)", ForceUnit::MS2),
    ])?;
    let gyr = names.axes(&[
        ("w{}(deg/s)", RateUnit::DegS),
        ("as{}(deg/s)", RateUnit::DegS),
        ("angularvelocity{}(deg/s)", RateUnit::DegS),
        ("角速度{}(deg/s)", RateUnit::DegS),
    ])?;
    let mag = names.axes(&[
        ("h{}(ut)", FieldUnit::Ut),
        ("magneticfield{}(ut)", FieldUnit::Ut),
        ("磁场{}(ut)", FieldUnit::Ut),
        ("h{}(mg)", FieldUnit::Mgauss),
        ("h{}", FieldUnit::Counts),
        ("h{}()", FieldUnit::Counts),
        ("mag{}", FieldUnit::Counts),
        ("磁场{}", FieldUnit::Counts),
        ("磁场{}()", FieldUnit::Counts),
    ]);
    let pressure = names.one(&[
        ("pressure(pa)", PressureUnit::Pa),
        ("pressure(hpa)", PressureUnit::Hpa),
        ("p(pa)", PressureUnit::Pa),
        ("气压(pa)", PressureUnit::Pa),
    ]);
    let Some(time) = time_of(head, header, rate_hz) else {
        return Some(Err(ParseError::new(
            ParseErrorKind::MappingNeeded,
            "a column ChipTime or Time, or the rate of the samples",
            format!("the columns {}", names.all.join(", ")),
            "switch the time on in the sensor's output, or give the rate that it was set to, in Hz",
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
        skip_rows_without_inertial: false,
    };
    Some(Ok(Recognised::table(LogFormat::WitTable, mapping, head.shown(header))))
}

/// The sensor's own clock before that of the computer, and a rate that is given before both: these
/// clocks are told as rarely as packets come in, many rows at a time.
fn time_of(head: &TextHead, header: &Candidate<'_>, rate_hz: Option<f64>) -> Option<TimeSource> {
    if rate_hz.is_some() {
        return Some(TimeSource { column: None, unit: TimeUnit::S, rate_hz, wraps_at: None });
    }
    let first = head.row_below(header);
    for pattern in ["chiptime", "chiptime()", "片上时间()", "片上时间", "time(s)", "时间(s)", "time", "时间"]
    {
        let Some(index) = header.names.find(pattern) else { continue };
        let Some(field) = first.get(index) else { continue };
        let unit = if clock_text::is_time(field.as_bytes()) {
            TimeUnit::DateTime
        } else if field.replace(',', ".").parse::<f64>().is_ok() {
            TimeUnit::S
        } else {
            continue;
        };
        let column = Some(header.names.all[index].to_owned());
        return Some(TimeSource { column, unit, rate_hz: None, wraps_at: None });
    }
    None
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::{LogFormat, Note};
    use crate::parse::log_reader::{LogReader, ReadOptions, samples_of};

    #[test]
    fn the_older_program() {
        let text = "StartTime: 2026-11-25 09:30:00.000\n\
            ChipTime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tT(°)\thx\thy\thz\tPressure(Pa)\t\n\
            2026-11-25 09:30:00.500\t0,1\t0\t1\t90\t0\t0\t0\t25\t120\t3\t-400\t90150\t\n\
            2026-11-25 09:30:00.510\t0\t0\t1\t0\t0\t0\t0\t25\t120\t3\t-400\t90150\t\n";
        let (recognised, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!(
            (recognised.format, &recognised.notes[..]),
            (LogFormat::WitTable, &[Note::FieldWithoutUnit][..])
        );
        assert_eq!((samples[0].t_ns, samples[1].t_ns), (0, 10_000_000));
        assert!((samples[0].w_ib_b_rad_s[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((samples[0].f_b_m_s2[0] - 0.980_665).abs() < 1e-12, "a decimal comma");
        assert_eq!((samples[0].mag_b_ut, samples[0].pressure_hpa), (None, Some(901.5)));
    }

    #[test]
    fn the_newer_program_in_english_and_the_phone_over_midnight() {
        let newer = "Time\tDevice name\tChip Time()\tAcceleration X(g)\tAcceleration Y(g)\tAcceleration Z(g)\tAngular velocity X(°/s)\tAngular velocity Y(°/s)\tAngular velocity Z(°/s)\tMagnetic field X(uT)\tMagnetic field Y(uT)\tMagnetic field Z(uT)\n\
            09:30:00.0\tWT(COM3)\t2026-11-25 9:30:00:000\t0\t0\t1\t0\t0\t0\t20\t-5\t40\n\
            09:30:00.0\tWT(COM3)\t2026-11-25 9:30:00:005\t0\t0\t1\t0\t0\t0\tnull\tnull\tnull\n";
        let (_, samples) = samples_of(newer.as_bytes()).unwrap();
        assert_eq!(
            (samples[1].t_ns, samples[0].mag_b_ut, samples[1].mag_b_ut),
            (5_000_000, Some([20.0, -5.0, 40.0]), None)
        );
        let phone = "time,DeviceName,AccX(g),AccY(g),AccZ(g),AsX(Â°/s),AsY(Â°/s),AsZ(Â°/s)\n23:59:59.990,LF,0,0,1,0,0,0\n00:00:00.000,LF,0,0,1,0,0,0\n";
        let (_, samples) = samples_of(phone.as_bytes()).unwrap();
        assert_eq!(samples[1].t_ns, 10_000_000);
    }

    #[test]
    fn the_chinese_program_in_gbk() {
        let text = "时间\t设备名称\t片上时间()\t加速度X(g)\t加速度Y(g)\t加速度Z(g)\t角速度X(°/s)\t角速度Y(°/s)\t角速度Z(°/s)\t磁场X(uT)\t磁场Y(uT)\t磁场Z(uT)\n\
            2026-11-25T09:30:00.000\tLF\t\t0\t0\t1\t0\t0\t180\t20\t-5\t40\n2026-11-25T09:30:00.020\tLF\t\t0\t0\t1\t0\t0\t0\t20\t-5\t40\n";
        let (gbk, _, _) = encoding_rs::GBK.encode(text);
        for bytes in [text.as_bytes(), &gbk] {
            let (recognised, samples) = samples_of(bytes).unwrap();
            assert_eq!(recognised.format, LogFormat::WitTable);
            assert_eq!(samples[1].t_ns, 20_000_000);
            assert!((samples[0].w_ib_b_rad_s[2] - std::f64::consts::PI).abs() < 1e-12);
        }
    }

    #[test]
    fn without_a_clock_the_rate_is_asked_for_and_used() {
        let text =
            "ax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\n0\t0\t1\t0\t0\t0\n0\t0\t1\t0\t0\t0\n";
        assert_eq!(samples_of(text.as_bytes()).unwrap_err().code(), "mapping_needed");
        let mut reader = LogReader::new(ReadOptions { rate_hz: Some(200.0), ..ReadOptions::default() });
        let mut samples = Vec::new();
        reader.push(text.as_bytes(), &mut samples).unwrap();
        reader.finish(&mut samples).unwrap();
        assert_eq!(samples[1].t_ns, 5_000_000);
    }
}
