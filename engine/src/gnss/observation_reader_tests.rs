//! Oddities of observation files, one a test.

use super::observation_reader::read;
use super::observations::Observations;
use super::satellite::Satellite;
use super::time::GpsTime;

fn header(version: &str, lines: &[String]) -> String {
    let mut text =
        format!("{version:>9}           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n");
    for line in lines {
        text.push_str(line);
        text.push('\n');
    }
    text.push_str(&labelled("", "END OF HEADER"));
    text.push('\n');
    text
}

fn labelled(content: &str, label: &str) -> String {
    format!("{content:<60}{label}")
}

fn types(system: char, names: &[&str]) -> String {
    let list: String = names.iter().map(|name| format!(" {name:<3}")).collect();
    labelled(&format!("{system}  {:3}{list}", names.len()), "SYS / # / OBS TYPES")
}

/// A line of a satellite: (value, flags behind it), blank where there is none.
fn line(satellite: &str, fields: &[Option<(f64, &str)>]) -> String {
    let mut text = satellite.to_owned();
    for field in fields {
        match field {
            Some((value, flags)) => text.push_str(&format!("{value:14.3}{flags:<2}")),
            None => text.push_str(&" ".repeat(16)),
        }
    }
    text.trim_end().to_owned() + "\n"
}

const CODE: f64 = 21_000_000.125;
const PHASE: f64 = 110_000_000.250;

fn usual() -> String {
    let mut text = header("3.04", &[types('G', &["C1C", "L1C", "S1C"])]);
    text.push_str("> 2024 06 24 08 20  0.0000000  0  2\n");
    text.push_str(&line("G05", &[Some((CODE, " 7")), Some((PHASE, "17")), Some((45.5, ""))]));
    text.push_str(&line("G12", &[Some((CODE + 1.0, "")), None, None]));
    text.push_str("> 2024 06 24 08 20  1.0000000  0  1\n");
    text.push_str(&line("G05", &[Some((CODE, "")), Some((PHASE, "")), Some((45.5, ""))]));
    text
}

fn first(file: &Observations, satellite: &str) -> super::observations::Signal {
    let satellite = Satellite::read(satellite.as_bytes(), b'G').unwrap();
    let epoch = &file.epochs[0];
    let tracked = epoch.satellites.iter().find(|one| one.satellite == satellite).unwrap();
    epoch.signals_of(tracked)[0]
}

#[test]
fn a_usual_file_is_read_with_its_flags() {
    let file = read(usual().as_bytes()).unwrap();
    assert_eq!(file.epochs.len(), 2);
    assert_eq!(file.epochs[0].time, GpsTime::from_calendar(2024, 6, 24, 8, 20, 0));
    let signal = first(&file, "G05");
    assert_eq!((signal.code_m, signal.phase_cycles, signal.strength_db_hz), (CODE, PHASE, 45.5));
    assert!(signal.lost_lock && !signal.half_cycle);
    assert_eq!(first(&file, "G12").phase_cycles, 0.0);
    assert!(file.notes.is_empty());
}

#[test]
fn a_channel_number_among_the_types_shifts_no_column() {
    let mut text = header("3.04", &[types('G', &["X1", "C1C", "D1C", "L1C"])]);
    text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
    text.push_str(&line("G05", &[Some((9.0, "")), Some((CODE, "")), Some((-12.0, "")), Some((PHASE, ""))]));
    let signal = first(&read(text.as_bytes()).unwrap(), "G05");
    assert_eq!((signal.code_m, signal.phase_cycles), (CODE, PHASE));
}

#[test]
fn more_types_than_fit_on_a_line_go_on_on_the_next() {
    let names = ["C1C", "L1C", "D1C", "S1C", "C2W", "L2W", "D2W", "S2W", "C2L", "L2L", "D2L", "S2L", "C5Q"];
    let mut second = types('G', &["L5Q"]);
    second.replace_range(0..6, "      ");
    let mut all = types('G', &names);
    all.replace_range(3..6, " 14");
    let mut text = header("3.04", &[all, second]);
    text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
    let mut fields = vec![None; 14];
    fields[13] = Some((PHASE, ""));
    text.push_str(&line("G05", &fields));
    let signal = first(&read(text.as_bytes()).unwrap(), "G05");
    assert_eq!((signal.band, signal.attribute, signal.phase_cycles), (5, b'Q', PHASE));
}

#[test]
fn carriage_returns_and_a_byte_order_mark_change_nothing() {
    let text = format!("\u{feff}{}", usual().replace('\n', "\r\n"));
    assert_eq!(read(text.as_bytes()).unwrap(), read(usual().as_bytes()).unwrap());
}

#[test]
fn scale_factors_are_taken_out_of_all_types_or_of_those_that_are_named() {
    for (factor, named) in [("G   10", true), ("G  100", false)] {
        let content = if named { format!("{factor}   1 L1C") } else { factor.to_owned() };
        let mut text =
            header("3.04", &[types('G', &["C1C", "L1C"]), labelled(&content, "SYS / SCALE FACTOR")]);
        text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
        let by = if named { 1.0 } else { 100.0 };
        let of_phase = if named { 10.0 } else { 100.0 };
        text.push_str(&line("G05", &[Some((2.0e7 * by, "")), Some((1.0e7 * of_phase, ""))]));
        let signal = first(&read(text.as_bytes()).unwrap(), "G05");
        assert_eq!((signal.code_m, signal.phase_cycles), (2.0e7, 1.0e7), "{factor}");
    }
}

#[test]
fn beidou_s_first_signal_is_the_same_as_1i_and_2i() {
    for (version, band) in [("3.02", '1'), ("3.03", '2'), ("3.04", '1')] {
        let names = [format!("C{band}I"), format!("L{band}I")];
        let mut text = header(version, &[types('C', &[&names[0], &names[1]])]);
        text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
        text.push_str(&line("C27", &[Some((CODE, "")), Some((PHASE, ""))]));
        let signal = first(&read(text.as_bytes()).unwrap(), "C27");
        assert_eq!((signal.band, signal.attribute), (2, b'I'), "{version}");
    }
}

#[test]
fn events_are_passed_over_and_new_types_within_them_hold_from_then_on() {
    let mut text = header("3.04", &[types('G', &["C1C", "L1C"])]);
    text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
    text.push_str(&line("G05", &[Some((CODE, "")), Some((PHASE, ""))]));
    text.push_str(">                              4  2\n");
    text.push_str(&labelled("the antenna was moved", "COMMENT"));
    text.push('\n');
    text.push_str(&types('G', &["L1C", "C1C"]));
    text.push('\n');
    text.push_str("> 2024 06 24 08 20  0.5000000  5  0\n");
    text.push_str("> 2024 06 24 08 20  0.7000000  2\n");
    text.push_str("> 2024 06 24 08 20  1.0000000  1  1\n");
    text.push_str(&line("G05", &[Some((PHASE, "")), Some((CODE, ""))]));
    text.push_str("> 2024 06 24 08 20  1.0000000  6  1\n");
    text.push_str(&line("G05", &[None, Some((1.0, ""))]));
    let file = read(text.as_bytes()).unwrap();
    assert_eq!(file.epochs.len(), 2);
    assert!(file.epochs[1].power_failure && !file.epochs[0].power_failure);
    assert_eq!(file.epochs[1].signals[0].code_m, CODE);
    assert!(file.notes.is_empty(), "{:?}", file.notes);
}

#[test]
fn an_epoch_that_is_cut_off_is_dropped_with_a_note_wherever_the_cut_is() {
    let text = usual();
    let second = text.rfind('>').unwrap();
    // Every place within the second epoch but its last two columns, where nothing of it is missing that was written.
    for end in second + 1..text.len() - 3 {
        let file = read(&text.as_bytes()[..end]).unwrap();
        if file.epochs.len() == 2 {
            // Cut between two fields: what is there is whole.
            let rest = &text[end..];
            assert!(rest.starts_with(' ') || text[..end].ends_with(' ') || rest.starts_with('4'), "{rest:?}");
        } else {
            assert_eq!((file.epochs.len(), file.notes.len()), (1, 1), "cut at {end}");
        }
    }
}

#[test]
fn an_epoch_that_is_shorter_than_it_says_does_not_swallow_the_next() {
    let text = usual().replace("0  2\n", "0  3\n");
    let file = read(text.as_bytes()).unwrap();
    assert_eq!((file.epochs.len(), file.notes.len()), (1, 1));
    assert!(file.notes[0].contains("fewer satellites"), "{:?}", file.notes);
}

#[test]
fn epochs_that_come_twice_are_dropped_with_a_note() {
    let text = usual();
    let begin = text.find('>').unwrap();
    let file = read(format!("{text}{}", &text[begin..]).as_bytes()).unwrap();
    assert_eq!(file.epochs.len(), 2);
    assert!(file.notes[0].contains("2 epochs"), "{:?}", file.notes);
}

#[test]
fn beidou_time_is_fourteen_seconds_behind() {
    let first = labelled("  2024     6    24     8    20    0.0000000     BDT", "TIME OF FIRST OBS");
    let mut text = header("3.04", &[types('C', &["C2I", "L2I"]), first]);
    text.push_str("> 2024 06 24 08 20  0.0000000  0  1\n");
    text.push_str(&line("C27", &[Some((CODE, "")), Some((PHASE, ""))]));
    let file = read(text.as_bytes()).unwrap();
    assert_eq!(file.epochs[0].time, GpsTime::from_calendar(2024, 6, 24, 8, 20, 14_000_000_000));
}

/// A file of version 2.11 with seven types (two lines a satellite) and thirteen satellites (two lines at the head).
fn version_2() -> String {
    let list = ["L1", "L2", "C1", "P2", "P1", "S1", "S2"];
    let content = format!("{:6}{}", list.len(), list.map(|name| format!("    {name}")).concat());
    let mut text = header("2.11", &[labelled(&content, "# / TYPES OF OBSERV")]);
    text.push_str(" 24  6 24  8 20  0.0000000  0 13");
    for number in 1..=12 {
        text.push_str(&format!("G{number:2}"));
    }
    text.push_str(&format!("\n{}R 3\n", " ".repeat(32)));
    for number in 1..=13 {
        let code = CODE + f64::from(number);
        text.push_str(&line(
            "",
            &[Some((PHASE, " 7")), Some((PHASE * 0.78, "5")), Some((code, "")), Some((code, ""))],
        ));
        text.push_str(&line("", &[Some((45.0, ""))]).replace("45.000", "40.000"));
    }
    text
}

#[test]
fn version_2_has_more_lines_for_many_satellites_and_for_many_types() {
    let file = read(version_2().as_bytes()).unwrap();
    let epoch = &file.epochs[0];
    assert_eq!(epoch.satellites.len(), 12, "GLONASS is passed over");
    let twelfth = epoch.signals_of(&epoch.satellites[11]);
    assert_eq!((twelfth[0].band, twelfth[0].code_m, twelfth[0].phase_cycles), (1, CODE + 12.0, PHASE));
    let second = twelfth.iter().find(|signal| signal.band == 2).unwrap();
    assert!(second.lost_lock && !second.half_cycle, "5 is lock lost and anti-spoofing");
}

#[test]
fn a_receiver_that_squares_the_second_band_counts_half_cycles() {
    let factor = labelled("     1     2", "WAVELENGTH FACT L1/2");
    let text = version_2();
    let end = text.find(&labelled("", "END OF HEADER")).unwrap();
    let text = format!("{}{factor}\n{}", &text[..end], &text[end..]);
    let file = read(text.as_bytes()).unwrap();
    let signals = file.epochs[0].signals_of(&file.epochs[0].satellites[0]);
    assert!(signals.iter().all(|signal| signal.half_cycle == (signal.band == 2)));
}

#[test]
fn what_is_no_observation_file_is_refused_with_what_to_do() {
    let navigation = usual().replacen("OBSERVATION DATA", "NAVIGATION DATA ", 1);
    let hatanaka = "1.0                 COMPACT RINEX FORMAT                    CRINEX VERS   / TYPE\n";
    let empty = header("3.04", &[types('G', &["C1C"])]);
    let headless = usual().replace("END OF HEADER", "COMMENT      ");
    for (text, expected) in [
        (navigation.as_str(), "--nav"),
        (hatanaka, "crx2rnx"),
        ("t_s,anchor,range_m\n1,A1,2\n", "RINEX VERSION"),
        (empty.as_str(), "no observation epochs"),
        (headless.as_str(), "END OF HEADER"),
        ("", "RINEX VERSION"),
    ] {
        let error = read(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
