use proptest::prelude::*;

use super::*;
use crate::parse::wit_serial::tests::dump;

const CANONICAL: &str = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n5.0,0,0,0,0,0,9.8\n5.01,0,0,0,0,0,9.8\n";

/// A small log of every format.
fn one_of_each() -> Vec<(LogFormat, Vec<u8>)> {
    let x_io = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)\n0.00,1,2,3,0,0,1,20,0,-40,902.1\n0.01,1,2,3,0,0,1,20,0,-40,902.1\n";
    let micro_strain = "DEVICE_INFO\n\nDATA_START\nTime,i-6:scaledAccelX,i-6:scaledAccelY,i-6:scaledAccelZ,i-6:scaledGyroX,i-6:scaledGyroY,i-6:scaledGyroZ\n11/25/2026 09:30:00.000,0,0,1,0,0,0\n11/25/2026 09:30:00.010,0,0,1,0,0,0\n";
    let xsens = "// Start Time: Unknown\n// Update Rate: 100.0Hz\nPacketCounter;SampleTimeFine;Acc_X;Acc_Y;Acc_Z;Gyr_X;Gyr_Y;Gyr_Z;Mag_X;Mag_Y;Mag_Z\n00001;;0;0;9,8;0;0;0;1;0;0\n00002;;0;0;9,8;0;0;0;1;0;0\n";
    let wit = "StartTime: x\nChipTime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\thx\thy\thz\n2026-11-25 09:30:00.500\t0\t0\t1\t0\t0\t0\t1\t2\t3\n2026-11-25 09:30:00.510\t0\t0\t1\t0\t0\t0\t1\t2\t3\n";
    vec![
        (LogFormat::Canonical, CANONICAL.into()),
        (LogFormat::XIo, x_io.into()),
        (LogFormat::MicroStrain, micro_strain.into()),
        (LogFormat::Xsens, xsens.into()),
        (LogFormat::WitTable, wit.into()),
        (LogFormat::WitSerial, dump(2, true)),
    ]
}

fn read_with(
    reading: ReadOptions,
    bytes: &[u8],
    piece: usize,
) -> Result<(LogReader, Vec<ImuSample>), ParseError> {
    let mut reader = LogReader::new(reading);
    let mut samples = Vec::new();
    for bytes in bytes.chunks(piece) {
        reader.push(bytes, &mut samples)?;
    }
    reader.finish(&mut samples)?;
    Ok((reader, samples))
}

#[test]
fn every_format_is_recognised_by_its_content() {
    for (format, bytes) in one_of_each() {
        for piece in [1, 13, 1 << 20] {
            let (reader, samples) = read_with(ReadOptions::default(), &bytes, piece).unwrap();
            assert_eq!(reader.recognised().unwrap().format, format);
            assert_eq!(samples.len(), 2, "{format:?}");
            let expected =
                if format == LogFormat::Canonical { [5_000_000_000, 5_010_000_000] } else { [0, 10_000_000] };
            assert_eq!([samples[0].t_ns, samples[1].t_ns], expected, "{format:?}");
            assert_eq!(reader.samples(), 2);
        }
    }
}

#[test]
fn a_long_log_is_read_in_pieces_of_any_size() {
    let (header, row) = (
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n",
        ",0.11,-0.7,0.2,-0.49,0.24,0.83\n",
    );
    let text: String = std::iter::once(header.to_owned())
        .chain((0..3000).map(|i| format!("{}{row}", f64::from(i) * 0.0025)))
        .collect();
    let (_, whole) = read_with(ReadOptions::default(), text.as_bytes(), 1 << 20).unwrap();
    assert_eq!(whole.len(), 3000);
    for piece in [777, 32 << 10, (32 << 10) + 1] {
        assert_eq!(read_with(ReadOptions::default(), text.as_bytes(), piece).unwrap().1, whole);
    }
}

#[test]
fn the_clock_s_zero_may_be_given_and_is_shared_by_the_feet() {
    let (_, xsens) = one_of_each().swap_remove(3);
    let (reader, _) = read_with(ReadOptions::default(), &xsens, 100).unwrap();
    assert_eq!(reader.clock_ns(), Some((10_000_000, 20_000_000)));
    let zero = common_zero_ns([10_000_000, 4_000_000]);
    let (_, samples) =
        read_with(ReadOptions { clock_zero_ns: zero, ..ReadOptions::default() }, &xsens, 100).unwrap();
    assert_eq!(samples[0].t_ns, 6_000_000);
    assert_eq!(common_zero_ns([0, 3_600_000_000_001]), None);
    assert_eq!(common_zero_ns([i64::MIN, i64::MAX]), None);
}

#[test]
fn a_table_that_nobody_knows_is_shown_and_can_be_mapped() {
    let text = "secs;wx;wy;wz;fx;fy;fz\n0,00;1;2;3;0;0;9,8\n0,01;1;2;3;0;0;9,8\n";
    let mut reader = LogReader::new(ReadOptions::default());
    let mut samples = Vec::new();
    reader.push(text.as_bytes(), &mut samples).unwrap();
    let error = reader.finish(&mut samples).unwrap_err();
    assert_eq!(error.code(), "unknown_format");
    assert!(error.to_string().contains("secs, wx, wy") && error.to_string().contains("WitMotion"), "{error}");
    let table = reader.table().unwrap();
    assert_eq!((table.columns.len(), table.rows.len()), (7, 2));

    let mapping: Mapping = serde_json::from_str(
        r#"{"delimiter":"semicolon","time":{"column":"secs","unit":"s"},
            "gyr":{"columns":["wx","wy","wz"],"unit":"deg_s"},"acc":{"columns":["fx","fy","fz"],"unit":"m_s2"}}"#,
    )
    .unwrap();
    let (reader, samples) =
        read_with(ReadOptions { mapping: Some(mapping), ..ReadOptions::default() }, text.as_bytes(), 9)
            .unwrap();
    assert_eq!(reader.recognised().unwrap().format, LogFormat::Mapped);
    assert_eq!((samples[1].t_ns, samples[1].f_b_m_s2[2]), (10_000_000, 9.8));
}

#[test]
fn what_is_said_must_be_possible() {
    for reading in [
        ReadOptions { rate_hz: Some(f64::NAN), ..ReadOptions::default() },
        ReadOptions { rate_hz: Some(0.0), ..ReadOptions::default() },
        ReadOptions { field_ut_per_count: Some(-1.0), ..ReadOptions::default() },
    ] {
        assert_eq!(read_with(reading, CANONICAL.as_bytes(), 100).unwrap_err().code(), "bad_mapping");
    }
}

fn any_reading() -> impl Strategy<Value = ReadOptions> {
    let mapping = r#"{"time":{"column":"t_s","unit":"UNIT","rate_hz":50,"wraps_at":65536},"gyr":{"columns":["gyr_x_rad_s","gyr_y_rad_s","gyr_z_rad_s"],"unit":"rad_s"},"acc":{"columns":["acc_x_m_s2","acc_y_m_s2","acc_z_m_s2"],"unit":"g"}}"#;
    let mapped = prop::sample::select(vec!["s", "ms", "us", "ns", "ticks10_khz", "samples", "date_time"])
        .prop_map(move |unit| serde_json::from_str(&mapping.replace("UNIT", unit)).unwrap());
    (prop::option::of(mapped), prop::option::of(1.0..1e3_f64), prop::option::of(any::<i64>())).prop_map(
        |(mapping, rate_hz, clock_zero_ns)| ReadOptions {
            mapping,
            rate_hz,
            field_ut_per_count: rate_hz,
            clock_zero_ns,
        },
    )
}

proptest! {
    /// A log of any format, cut, with bytes changed, doubled and put in: there is an answer, the same one
    /// in whatever pieces it comes, and never a panic.
    #[test]
    fn mutated_logs_never_panic_and_pieces_do_not_matter(
        which in 0_usize..6,
        reading in any_reading(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![any::<u8>(), Just(b','), Just(b'\n'), Just(b'"'), Just(b'9'), Just(b'-'), Just(b'e'), Just(0x55)], 0_usize..4), 0..12),
        cut in any::<prop::sample::Index>(),
        piece in 1_usize..80,
    ) {
        let mut bytes = one_of_each().swap_remove(which).1;
        for (index, byte, how) in changes {
            let at = index.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                2 => { bytes.remove(at); }
                _ => {
                    let end = (at + 40).min(bytes.len());
                    let again = bytes[at..end].to_vec();
                    bytes.splice(at..at, again);
                }
            }
            if bytes.is_empty() { bytes.push(b'\n'); }
        }
        if cut.index(4) == 0 {
            let at = cut.index(bytes.len());
            bytes.truncate(at + 1);
        }
        let whole = read_with(reading.clone(), &bytes, bytes.len()).map(|(_, samples)| samples);
        let pieces = read_with(reading, &bytes, piece).map(|(_, samples)| samples);
        prop_assert_eq!(format!("{whole:?}"), format!("{pieces:?}"));
    }

    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..2000),
        reading in any_reading(),
    ) {
        let _ = read_with(reading, &bytes, 97);
    }
}
