use proptest::prelude::*;

use super::*;

const HEADER: &str = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2";

fn read(bytes: &[u8]) -> Result<Vec<ImuSample>, ParseError> {
    read_in_pieces(bytes, bytes.len().max(1))
}

fn read_in_pieces(bytes: &[u8], piece: usize) -> Result<Vec<ImuSample>, ParseError> {
    let mut parser = ImuCsv::new();
    let mut samples = Vec::new();
    for bytes in bytes.chunks(piece) {
        parser.push(bytes, &mut samples)?;
    }
    parser.finish(&mut samples)?;
    Ok(samples)
}

fn error(text: &str) -> ParseError {
    read(text.as_bytes()).unwrap_err()
}

#[test]
fn any_column_order_a_byte_order_mark_and_carriage_returns_are_fine() {
    let text = "\u{feff}pressure_hpa,acc_z_m_s2,acc_y_m_s2,acc_x_m_s2,gyr_z_rad_s,gyr_y_rad_s,gyr_x_rad_s,note,t_s\r\n\
                ,9.8,2,1,0.3,0.2,0.1,hello,1.005\r\n901.5, 9.8 ,2,1,nan,-inf,0.1,,1.01\r\n";
    for piece in 1..text.len() {
        let samples = read_in_pieces(text.as_bytes(), piece).unwrap();
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].t_ns, 1_005_000_000);
        assert_eq!(samples[0].w_ib_b_rad_s, [0.1, 0.2, 0.3]);
        assert_eq!(samples[0].f_b_m_s2, [1.0, 2.0, 9.8]);
        assert_eq!(samples[0].mag_b_ut, None);
        assert_eq!(samples[0].pressure_hpa, None);
        assert_eq!(samples[1].pressure_hpa, Some(901.5));
        assert!(samples[1].w_ib_b_rad_s[2].is_nan());
        assert_eq!(samples[1].w_ib_b_rad_s[1], f64::NEG_INFINITY);
    }
    let mut parser = ImuCsv::new();
    parser.push(text.as_bytes(), &mut Vec::new()).unwrap();
    assert_eq!(parser.ignored_columns(), ["note"]);
}

#[test]
fn an_empty_magnetometer_field_is_a_missing_value() {
    let text = format!("{HEADER},mag_x_ut,mag_y_ut,mag_z_ut\n0,0,0,0,0,0,9.8,1,2,3\n1,0,0,0,0,0,9.8,1,,3\n");
    let samples = read(text.as_bytes()).unwrap();
    assert_eq!(samples[0].mag_b_ut, Some([1.0, 2.0, 3.0]));
    assert_eq!(samples[1].mag_b_ut, None);
}

#[test]
fn a_misspelt_column_is_named_with_its_nearest() {
    let text = format!("{}\n0,0,0,0,0,0,9.8\n", HEADER.replace("gyr_y_rad_s", "gyro_y_rad_s"));
    assert_eq!(
        error(&text).to_string(),
        "line 1, column gyr_y_rad_s: expected a column gyr_y_rad_s, found the header \
         \"t_s,gyr_x_rad_s,gyro_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\"; \
         if \"gyro_y_rad_s\" is meant, rename it, and check its unit"
    );
    assert!(error(&text.replace("gyro_y_rad_s", "gyr_y")).advice.contains("if \"gyr_y\" is meant"));
    assert_eq!(error("a,b\n1,2\n").code(), "missing_column");
    let mag = format!("{HEADER},mag_x_ut\n0,0,0,0,0,0,9.8,1\n");
    assert_eq!(error(&mag).column.as_deref(), Some("mag_y_ut"));
    assert_eq!(error(&format!("{HEADER},t_s\n")).code(), "repeated_column");
    assert!(error(&HEADER.replace(',', ";")).to_string().contains("commas"));
}

#[test]
fn files_that_are_no_logs_are_named() {
    assert_eq!(error("").code(), "empty_file");
    assert_eq!(error("\n\n").code(), "empty_file");
    assert!(error(HEADER).to_string().contains("a header and no row"));
    assert_eq!(error("0.0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6\n").code(), "missing_header");
    let picture = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x01\0";
    for piece in 1..picture.len() {
        let error = read_in_pieces(picture, piece).unwrap_err();
        assert_eq!(error.code(), "not_text", "pieces of {piece}");
        assert!(error.to_string().contains("a PNG picture"), "{error}");
    }
    let mut photo = b"\xFF\xD8\xFF\xE0".to_vec();
    photo.extend((0..60_000_u32).map(|i| (i * 7 + 1) as u8 | 0x80));
    assert!(read(&photo).unwrap_err().to_string().contains("a JPEG picture"));
    assert_eq!(read(b"PK\x03\x04\x14\0\0\0").unwrap_err().code(), "not_text");
    assert_eq!(read(b"t\0_\0s\0\n\0").unwrap_err().code(), "not_text");
    assert!(read(b"\xFF\xFEt\0_\0s\0\n\0").unwrap_err().to_string().contains("UTF-16"));
}

#[test]
fn a_wrong_row_is_named_by_line_and_column() {
    let short = error(&format!("{HEADER}\n0.02,0,0\n"));
    assert_eq!((short.code(), short.line), ("wrong_field_count", Some(2)));
    let word = error(&format!("{HEADER}\r\n0,0,zero,0,0,0,9.8\n"));
    assert_eq!(
        (word.code(), word.line, word.column.as_deref()),
        ("not_a_number", Some(2), Some("gyr_y_rad_s"))
    );
    assert!(word.found.contains("zero"));
    let empty = error(&format!("{HEADER}\n0,,0,0,0,0,9.8\n"));
    assert_eq!((empty.code(), empty.line), ("empty_field", Some(2)));
    for time in ["nan", "inf", "99999999999"] {
        let error = error(&format!("{HEADER}\n{time},0,0,0,0,0,9.8\n"));
        assert_eq!((error.code(), error.column.as_deref()), ("bad_time", Some("t_s")), "{time}");
    }
    assert_eq!(error(&format!("{HEADER}\n0,0,\0,0,0,0,9.8\n")).code(), "not_a_number");
    let row = "0,0,0,0,0,0,9.8\n";
    let rest = read(format!("{HEADER}\n{row}{row}0.02,0,0\n{row}").as_bytes()).unwrap();
    assert_eq!(rest.len(), 3, "one wrong line costs itself alone");
}

fn walk(rate: f64, force: f64, rows: usize) -> String {
    let mut text = format!("{HEADER}\n");
    for i in 0..rows {
        let swing = if i % 2 == 0 { rate } else { 0.01 };
        text.push_str(&format!("{},{swing},0,0,0,0,{force}\n", i as f64 * 0.01));
    }
    text
}

#[test]
fn other_units_are_found_out() {
    let degrees = error(&walk(250.0, 9.8, 100));
    assert_eq!(degrees.code(), "degrees_not_radians");
    assert!(degrees.to_string().contains("multiply the three gyr columns by π/180"));
    let g = error(&walk(2.0, 1.0, 100));
    assert_eq!(g.code(), "g_not_metres");
    assert_eq!(read(walk(34.0, 9.8, 100).as_bytes()).unwrap().len(), 100);
    // Found out before the end of a long file, too.
    let mut parser = ImuCsv::new();
    assert_eq!(
        parser.push(walk(250.0, 9.8, 30_000).as_bytes(), &mut Vec::new()).unwrap_err().code(),
        "degrees_not_radians"
    );
}

#[test]
fn a_single_wild_value_is_left_to_the_session() {
    let text = walk(2.0, 9.8, 200) + "2.0,1e6,0,0,0,0,9.8\n2.01,inf,0,0,0,0,0.9\n";
    assert_eq!(read(text.as_bytes()).unwrap().len(), 202);
}

prop_compose! {
    fn any_sample()(
        t_ns in any::<i64>(),
        w_ib_b_rad_s in prop::array::uniform3(-35.0..35.0_f64),
        f_b_m_s2 in prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::INFINITE),
        mag_b_ut in prop::option::of(prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL)),
        pressure_hpa in prop::option::of(prop::num::f64::NORMAL),
    ) -> ImuSample {
        ImuSample { t_ns, w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(samples in prop::collection::vec(any_sample(), 1..30), piece in 1_usize..300) {
        let mut text = String::new();
        write(&samples, true, &mut text);
        prop_assert_eq!(read_in_pieces(text.as_bytes(), piece).unwrap(), samples);
    }

    #[test]
    fn arbitrary_bytes_never_panic_and_pieces_do_not_matter(
        bytes in prop::collection::vec(prop_oneof![any::<u8>(), Just(b','), Just(b'\n'), Just(b'\r'), Just(b'"'), b'0'..=b'9'], 0..300),
        with_header in any::<bool>(),
        piece in 1_usize..50,
    ) {
        let mut file = if with_header { format!("{HEADER}\n").into_bytes() } else { Vec::new() };
        file.extend(bytes);
        let whole = read(&file);
        let pieces = read_in_pieces(&file, piece);
        prop_assert_eq!(format!("{whole:?}"), format!("{pieces:?}"));
    }
}
