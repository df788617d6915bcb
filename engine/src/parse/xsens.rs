//! The exports of Xsens (Movella): MT Manager's text files, and the CSV of Xsens DOT.
//!
//! Both name their columns `PacketCounter`, `SampleTimeFine`, `Acc_X`, `Gyr_X`, `Mag_X`. Sources of the
//! layout: the DOT logger of Xsens' Android SDK (a first line `sep=,`, lines such as `DeviceTag:,…`,
//! `OutputRate:,60Hz`; SampleTimeFine in microseconds, 32 bits; Gyr in deg/s by the DOT user manual), and MT
//! Manager exports as public readers have them (4 to 12 lines that begin with `//`, among them
//! `// Update Rate: 100.0Hz`; parted by tabs, semicolons or commas; SampleTimeFine often empty, else in
//! steps of 0.1 ms; PacketCounter of 16 bits; Gyr in rad/s by the MT low-level protocol). A table with
//! neither beginning does not say whether it has degrees or radians, and is not guessed at.
//!
//! Mag is in shares of the field at the place of calibration.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::log_format::{LogFormat, Recognised};
use crate::parse::mapping::{
    Axes, FieldUnit, ForceUnit, Mapping, PressureUnit, RateUnit, TimeSource, TimeUnit,
};
use crate::parse::table_head::{Candidate, TextHead};

/// SampleTimeFine has 32 bits.
const FINE_WRAPS_AT: u64 = 1 << 32;
/// MT Manager's PacketCounter has 16.
const PACKETS_WRAP_AT: u64 = 1 << 16;

pub(super) fn recognise(
    head: &TextHead,
    header: &Candidate<'_>,
    rate_hz: Option<f64>,
) -> Option<Result<Recognised, ParseError>> {
    let names = &header.names;
    let counted = names.find("packetcounter").or(names.find("sampletimefine"));
    counted?;
    let (Some(acc), Some(gyr)) =
        (names.axes(&[("acc_{}", ForceUnit::MS2)]), names.axes(&[("gyr_{}", RateUnit::RadS)]))
    else {
        return Some(Err(without_rates(header)));
    };
    let above = head.before(header);
    let manager = above.iter().any(|line| line.starts_with("//"));
    let dot = above.iter().any(|line| line.starts_with("DeviceTag") || line.starts_with("sep="));
    let time = match (manager, dot) {
        (true, false) => manager_time(head, header, rate_hz.or_else(|| update_rate(above))),
        (false, true) => fine(header, TimeUnit::Us),
        _ => return Some(Err(of_unknown_origin(header))),
    };
    let Some(time) = time else { return Some(Err(without_time(header))) };
    let unit = if dot { RateUnit::DegS } else { RateUnit::RadS };
    let mapping = Mapping {
        delimiter: header.delimiter,
        time,
        gyr: Axes::of(gyr.columns, unit),
        acc,
        mag: names.axes(&[("mag_{}", FieldUnit::Counts)]),
        pressure: names.one(&[("pressure", PressureUnit::Pa), ("baro", PressureUnit::Pa)]),
        skip_rows_without_inertial: false,
    };
    Some(Ok(Recognised::table(LogFormat::Xsens, mapping, head.shown(header))))
}

/// The counter of packets, which also says what is missing, where the rate is known; else the clock.
fn manager_time(head: &TextHead, header: &Candidate<'_>, rate_hz: Option<f64>) -> Option<TimeSource> {
    if let (Some(index), Some(_)) = (header.names.find("packetcounter"), rate_hz) {
        let column = Some(header.names.all[index].to_owned());
        return Some(TimeSource {
            column,
            unit: TimeUnit::Samples,
            rate_hz,
            wraps_at: Some(PACKETS_WRAP_AT),
        });
    }
    let index = header.names.find("sampletimefine")?;
    let filled =
        head.row_below(header).get(index).is_some_and(|field| field.parse::<f64>().is_ok_and(f64::is_finite));
    if filled { fine(header, TimeUnit::Ticks10Khz) } else { None }
}

fn fine(header: &Candidate<'_>, unit: TimeUnit) -> Option<TimeSource> {
    let index = header.names.find("sampletimefine")?;
    let column = Some(header.names.all[index].to_owned());
    Some(TimeSource { column, unit, rate_hz: None, wraps_at: Some(FINE_WRAPS_AT) })
}

/// The number in a line such as `// Update Rate: 100.0Hz`.
fn update_rate(above: &[String]) -> Option<f64> {
    let line = above.iter().find(|line| line.to_ascii_lowercase().contains("update rate"))?;
    let number = line.rsplit(':').next()?.trim().trim_end_matches(|c: char| !c.is_ascii_digit());
    number.parse().ok().filter(|rate| (1.0..=10_000.0).contains(rate))
}

fn needed(header: &Candidate<'_>, expected: &str, advice: &str) -> ParseError {
    let found = format!("the columns {}", header.names.all.join(", "));
    ParseError::new(ParseErrorKind::MappingNeeded, expected, found, advice).at_line(header.line as u64 + 1)
}

fn without_rates(header: &Candidate<'_>) -> ParseError {
    needed(
        header,
        "an Xsens export with Acc_X, Acc_Y, Acc_Z and Gyr_X, Gyr_Y, Gyr_Z",
        "export again with acceleration and rate of turn (of the DOT: rate quantities, or custom mode 5): free acceleration lacks gravity, and from orientation alone no walk can be computed",
    )
}

fn of_unknown_origin(header: &Candidate<'_>) -> ParseError {
    needed(
        header,
        "the lines before the header that say which Xsens program wrote this",
        "give the file as it was exported, or choose the columns by hand and say whether Gyr is in deg/s or rad/s",
    )
}

fn without_time(header: &Candidate<'_>) -> ParseError {
    needed(
        header,
        "a line // Update Rate, or SampleTimeFine with values",
        "give the rate that the sensor was set to, in Hz, or export again with SampleTimeFine",
    )
}

#[cfg(test)]
mod tests {
    use crate::parse::log_format::{LogFormat, Note};
    use crate::parse::log_reader::{LogReader, ReadOptions, samples_of};

    fn manager(above: &str, rows: &[(u32, &str)]) -> String {
        let mut text = format!(
            "{above}PacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMag_X\tMag_Y\tMag_Z\n"
        );
        for (packet, fine) in rows {
            text += &format!("{packet:05}\t{fine}\t0.1\t-0.2\t9.8\t0.01\t0.02\t0.03\t-0.6\t-0.2\t0.5\n");
        }
        text
    }

    #[test]
    fn mt_manager_counts_packets_over_their_wrap() {
        let text = manager(
            "// Start Time: Unknown\n//  Update Rate: 100.0Hz\n// Coordinate system: ENU\n",
            &[(65_534, ""), (65_535, ""), (1, "")],
        );
        let (recognised, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!(
            (recognised.format, &recognised.notes[..]),
            (LogFormat::Xsens, &[Note::FieldWithoutUnit][..])
        );
        let times: Vec<i64> = samples.iter().map(|sample| sample.t_ns).collect();
        // Packet 0 is missing, and so is its time.
        assert_eq!(times, [0, 10_000_000, 30_000_000]);
        assert_eq!(samples[0].w_ib_b_rad_s, [0.01, 0.02, 0.03]);
        assert_eq!(samples[0].mag_b_ut, None);
    }

    #[test]
    fn mt_manager_without_a_rate_uses_the_fine_clock_or_asks() {
        let text = manager("// Start Time: Unknown\n", &[(7, "4294967290"), (8, "94")]);
        let (_, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!(samples[1].t_ns, 10_000_000);
        let silent = manager("// Start Time: Unknown\n", &[(7, ""), (8, "")]);
        assert_eq!(samples_of(silent.as_bytes()).unwrap_err().code(), "mapping_needed");
        let mut reader = LogReader::new(ReadOptions { rate_hz: Some(40.0), ..ReadOptions::default() });
        let mut samples = Vec::new();
        reader.push(silent.as_bytes(), &mut samples).unwrap();
        reader.finish(&mut samples).unwrap();
        assert_eq!(samples[1].t_ns, 25_000_000);
    }

    #[test]
    fn a_dot_counts_microseconds_and_degrees() {
        let text = "sep=,\nDeviceTag:,LF,,,,,\nFirmwareVersion:,3.0.0,,,,\nOutputRate:,60Hz,,,\n\n\
            PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n\
            1,4294960000,1,0,0,0,0,0,9.8,180,0,0\n2,9371,1,0,0,0,0,0,9.8,0,0,0\n";
        let (_, samples) = samples_of(text.as_bytes()).unwrap();
        assert_eq!(samples[1].t_ns, 16_667_000);
        assert!((samples[0].w_ib_b_rad_s[0] - std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn what_it_does_not_say_is_not_guessed() {
        let bare = manager("", &[(1, "100"), (2, "200")]);
        let error = samples_of(bare.as_bytes()).unwrap_err();
        assert!(error.advice.contains("deg/s or rad/s"), "{error}");
        let free = "sep=,\nDeviceTag:,1\nPacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Status\n1,2,3,4,5,6,7,8,0\n";
        let error = samples_of(free.as_bytes()).unwrap_err();
        assert!(error.advice.contains("free acceleration lacks gravity"), "{error}");
    }
}
