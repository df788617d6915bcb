//! The command line as its users meet it: the built binary on small files, its sentences and its
//! exit codes.

#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const HEADER: &str = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2";
const SITE: &str = "name = \"Test\"\nlatitude_deg = 25.65\nlongitude_deg = 106.85\nheight_m = 1000\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn with(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, content).unwrap();
        path
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(self.0.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

fn lodestep(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lodestep")).args(arguments).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The exit code and what standard error says.
fn failed(arguments: &[&str]) -> (i32, String) {
    let output = lodestep(arguments);
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

/// A foot that stands still for so many seconds, 100 Hz.
fn standing(seconds: usize) -> String {
    let mut log = format!("{HEADER}\n");
    for i in 0..seconds * 100 {
        // A little life in every channel: a sensor that repeats itself is a broken one.
        let wiggle = ((i * 7919) % 101) as f64 * 1e-5;
        writeln!(
            log,
            "{},{wiggle},{},{wiggle},{wiggle},{},{}",
            i as f64 / 100.0,
            -wiggle,
            wiggle * 3.0,
            9.8 + wiggle
        )
        .unwrap();
    }
    log
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn a_standing_foot_stays_where_it_is_told_to_start() {
    let folder = Folder::new();
    let (log, out, report) =
        (folder.with("l.csv", standing(20)), folder.path("t.csv"), folder.path("r.json"));
    let output = lodestep(&[
        "process",
        "--left",
        text(&log),
        "--out",
        text(&out),
        "--report",
        text(&report),
        "--initial-position",
        "5,-6,7",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let track = fs::read_to_string(&out).unwrap();
    let mut lines = track.lines();
    assert_eq!(
        lines.next().unwrap(),
        "t_s,e_m,n_m,u_m,heading_rad,sigma_e_m,sigma_n_m,sigma_u_m,left_e_m,left_n_m,left_u_m,\
         right_e_m,right_n_m,right_u_m,left_stance,right_stance"
    );
    let last: Vec<&str> = lines.next_back().unwrap().split(',').collect();
    assert_eq!(last.len(), 16);
    assert_eq!(last[0], "19.99");
    for (field, expected) in last[1..4].iter().zip([5.0, -6.0, 7.0]) {
        assert!((field.parse::<f64>().unwrap() - expected).abs() < 0.05, "{last:?}");
    }
    assert_eq!((last[11], last[14], last[15]), ("", "1", ""), "the right foot is not recorded");

    let report: serde_json::Value = serde_json::from_slice(&fs::read(&report).unwrap()).unwrap();
    for key in ["epochs", "samples", "duration_s", "distance_m", "process_seconds", "anomalies", "visits"] {
        assert!(!report[key].is_null(), "the report lacks {key}");
    }
    assert_eq!(report["samples"], 2000);
    assert_eq!(report["track_sha256"].as_str().unwrap().len(), 64);
    assert_eq!(folder.names(), ["l.csv", "r.json", "t.csv"], "nothing is left beside the results");
}

#[test]
fn packed_and_plain_logs_give_the_same_bytes() {
    let folder = Folder::new();
    let log = standing(15);
    let plain = folder.with("plain.csv", &log);
    let packed = folder.with("packed.bin", gzip(log.as_bytes()));
    let zstd = folder.with("zstd.bin", zstd::encode_all(log.as_bytes(), 3).unwrap());
    let track = |path: &Path| {
        let output = lodestep(&["process", "--left", text(path), "--out", "-"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let expected = track(&plain);
    assert!(expected.len() > 10_000);
    assert!(track(&packed) == expected && track(&zstd) == expected);
}

#[test]
fn fewer_points_when_a_rate_is_asked_for() {
    let folder = Folder::new();
    let log = folder.with("l.csv", standing(20));
    let output = lodestep(&["process", "--left", text(&log), "--rate-hz", "1", "--out", "-"]);
    let rows = String::from_utf8(output.stdout).unwrap().lines().count();
    assert!((18..=22).contains(&rows), "{rows} rows of 20 s at 1 Hz");
}

#[test]
fn maps_are_written_where_the_site_is_known() {
    let folder = Folder::new();
    let (log, site) = (folder.with("l.csv", standing(15)), folder.with("site.toml", SITE));
    for (name, start) in
        [("t.geojson", "{\"type\":\"FeatureCollection\""), ("t.gpx", "<?xml"), ("t.kml", "<?xml")]
    {
        let out = folder.path(name);
        let output = lodestep(&["process", "--left", text(&log), "--site", text(&site), "--out", text(&out)]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let content = fs::read_to_string(&out).unwrap();
        assert!(content.starts_with(start) && content.contains("25.6"), "{name}");
        fs::remove_file(&out).unwrap();
        let (code, sentence) = failed(&["process", "--left", text(&log), "--out", text(&out)]);
        assert_eq!(code, 2);
        assert!(sentence.contains("add --site SITE.toml"), "{sentence}");
        assert!(!out.exists());
    }
}

/// Processes a log with this content, which must fail as bad input, and gives the sentence.
fn refused(content: &[u8]) -> String {
    let folder = Folder::new();
    let (log, out) = (folder.with("log.csv", content), folder.path("t.csv"));
    let (code, sentence) = failed(&["process", "--left", text(&log), "--out", text(&out)]);
    assert_eq!(code, 3, "{sentence}");
    assert!(!out.exists(), "nothing is half written");
    assert_eq!(folder.names(), ["log.csv"]);
    assert!(sentence.starts_with("lodestep: ") && sentence.contains("log.csv"), "{sentence}");
    assert_eq!(sentence.trim_end().lines().count(), 1, "{sentence}");
    sentence
}

#[test]
fn every_wrong_log_has_its_sentence() {
    let log = standing(12);
    // Of less than a second: more is read as far as it goes.
    let few: String = log.split_inclusive('\n').take(80).collect();
    let mut damaged = gzip(few.as_bytes());
    // In the checksum at the end.
    let at = damaged.len() - 6;
    damaged[at] ^= 0xFF;
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("empty", Vec::new(), "empty"),
        ("a picture", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), "a PNG picture"),
        ("a header alone", format!("{HEADER}\n").into(), "a header and no row"),
        ("no header", log.lines().skip(1).collect::<Vec<_>>().join("\n").into(), "expected a header"),
        ("a wrong column", log.replacen("gyr_x_rad_s", "gyr_x", 1).into(), "\"gyr_x\" is meant"),
        ("a truncated gzip", gzip(few.as_bytes())[..200].to_vec(), "cut off"),
        ("a damaged gzip", damaged, "damaged"),
        (
            "too short to align",
            standing(12).lines().take(4).collect::<Vec<_>>().join("\n").into(),
            "standing still",
        ),
    ];
    for (what, content, expected) in cases {
        let sentence = refused(&content);
        assert!(sentence.contains(expected), "{what}: {sentence}");
    }
}

#[test]
fn a_wrong_line_costs_itself_alone_and_is_told() {
    let log = standing(12);
    let rows = |content: &str| {
        let folder = Folder::new();
        let path = folder.with("log.csv", content);
        let output = lodestep(&["process", "--left", text(&path), "--out", "-"]);
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{told}");
        (String::from_utf8(output.stdout).unwrap().lines().count(), told)
    };
    let (all, nothing) = rows(&log);
    assert!(!nothing.contains("left out"), "{nothing}");
    for (what, content, expected) in [
        (
            "a word",
            log.replacen("\n0.05,", "\n0.05,much", 1),
            "line 7, column gyr_x_rad_s: expected a number",
        ),
        ("a short row", log.replacen("\n0.05,", "\n0.05\n0.05,", 1), "line 7: expected 7 fields"),
        (
            "a time that is none",
            log.replacen("\n0.05,", "\nnan,", 1),
            "line 7, column t_s: expected a finite time",
        ),
    ] {
        let (left, told) = rows(&content);
        assert!(all - left <= 1, "{what}: {left} of {all} rows");
        assert!(told.contains("left out") && told.contains(expected), "{what}: {told}");
    }
}

#[test]
fn other_units_are_found_out() {
    let in_units = |rate: f64, force: f64| {
        let mut log = format!("{HEADER}\n");
        for i in 0..600 {
            writeln!(
                log,
                "{},{},0,0,0,0,{force}",
                f64::from(i) / 100.0,
                if i % 3 == 0 { rate } else { 0.01 }
            )
            .unwrap();
        }
        refused(log.as_bytes())
    };
    assert!(in_units(180.0, 9.8).contains("multiply the three gyr columns by π/180"));
    assert!(in_units(1.0, 1.0).contains("multiply the three acc columns by 9.80665"));
}

#[test]
fn a_command_line_that_cannot_be_has_its_sentence_and_exit_code() {
    let folder = Folder::new();
    let log = folder.with("l.csv", standing(12));
    let cases: [(&[&str], &str); 14] = [
        (&["--solution", "sharpened"], "possible values: filtered, smoothed"),
        (&["--aid", "zupt,gps"], "there is no aid \"gps\""),
        (&["--aid", "zupt,separation"], "needs both feet"),
        (&["--aid", "zupt,markers"], "needs --markers and --visits"),
        (&["--initial-position", "1,2"], "expected three numbers in metres"),
        (&["--initial-heading-deg", "north"], "expected a number of degrees"),
        (&["--gravity-m-s2", "1"], "from 9.7 to 9.9"),
        (&["--rate-hz", "0"], "expected a positive number"),
        (&["--started-at", "yesterday"], "2026-05-01T08:00:00Z"),
        (&["--markers", "m.csv"], "--visits"),
        (&["--set", "marker_sigma_m"], "such as marker_sigma_m=0.5"),
        (&["--set", "marker_sigma_m=99"], "from 0.01 to 20 m, found 99"),
        (&["--set", "magic=1"], "no parameter \"magic\""),
        (&["--set", "identification.slip=0.1"], "which process does not do"),
    ];
    for (extra, expected) in cases {
        let arguments = [&["process", "--left", text(&log), "--out", "-"], extra].concat();
        let (code, sentence) = failed(&arguments);
        assert_eq!(code, 2, "{extra:?}: {sentence}");
        assert!(sentence.contains(expected), "{extra:?}: {sentence}");
    }
    let (code, sentence) = failed(&["process", "--left", text(&log), "--out", "track.xlsx"]);
    assert!(code == 2 && sentence.contains(".geojson"), "{sentence}");
    let (code, sentence) = failed(&["process", "--out", "-"]);
    assert!(code == 2 && sentence.contains("--left"), "{sentence}");
    let (code, sentence) = failed(&["process", "--left", "/there/is/no/such.csv", "--out", "-"]);
    assert!(code == 3 && sentence.contains("/there/is/no/such.csv: cannot be read"), "{sentence}");
    let empty = folder.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let (code, sentence) = failed(&["process", "--left", text(&empty), "--out", "-"]);
    assert!(
        code == 3 && sentence.contains("a folder is read where it holds the files of one sensor"),
        "{sentence}"
    );
    let nowhere = folder.path("no/folder/t.csv");
    let (code, sentence) = failed(&["process", "--left", text(&log), "--out", text(&nowhere)]);
    assert!(code == 1 && sentence.contains("cannot be written"), "{sentence}");
}

#[test]
fn visits_need_their_markers() {
    let folder = Folder::new();
    let log = folder.with("l.csv", standing(12));
    let markers = folder.with("m.csv", "name,e_m,n_m,u_m\nA1,0,0,0\n");
    let geodetic = folder.with("g.csv", "name,lat_deg,lon_deg,height_m\nA1,25.65,106.85,1000\n");
    let run = |markers: &Path, visits: &Path| {
        failed(&[
            "process",
            "--left",
            text(&log),
            "--markers",
            text(markers),
            "--visits",
            text(visits),
            "--out",
            "-",
        ])
    };
    let visits = folder.with("v.csv", "t_start_s,t_end_s,marker\n1,2,A7\n");
    let (code, sentence) = run(&markers, &visits);
    assert!(code == 3 && sentence.contains("found \"A7\""), "{sentence}");
    let visits = folder.with("w.csv", "t_start_s,t_end_s,marker\n2,1,A1\n");
    let (code, sentence) = run(&markers, &visits);
    assert!(code == 3 && sentence.contains("line 2, column t_end_s"), "{sentence}");
    let visits = folder.with("x.csv", "t_start_s,t_end_s,marker\n6,9,A1\n");
    assert_eq!(run(&markers, &visits).0, 0);
    let (code, sentence) = run(&geodetic, &visits);
    assert!(code == 2 && sentence.contains("--site"), "{sentence}");
}

#[test]
fn a_simulated_walk_is_repeatable_and_can_be_processed_and_scored() {
    let folder = Folder::new();
    let (first, second) = (folder.path("first"), folder.path("second"));
    for out in [&first, &second] {
        let output =
            lodestep(&["simulate", "--walk", "line:30", "--seed", "7", "--gzip", "--out", text(out)]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    for name in ["left.csv.gz", "right.csv.gz", "truth.csv.gz", "markers.csv", "visits.csv", "site.toml"] {
        assert!(fs::read(first.join(name)).unwrap() == fs::read(second.join(name)).unwrap(), "{name}");
    }
    let (code, sentence) = failed(&["simulate", "--walk", "line:30", "--out", text(&first)]);
    assert!(code == 2 && sentence.contains("--force"), "{sentence}");
    let (code, sentence) = failed(&["simulate", "--walk", "moon", "--out", text(&first)]);
    assert!(code == 2 && sentence.contains("rectangle"), "{sentence}");

    let output = lodestep(&["evaluate", text(&first), "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let score = &json["recordings"][0];
    assert_eq!((score["name"].as_str(), score["feet"].as_u64()), (Some("first"), Some(2)));
    let truth = &score["figures"]["truth"];
    assert!((truth["path_m"].as_f64().unwrap() - 30.0).abs() < 3.0, "{truth}");
    assert!(truth["end_error_m"].as_f64().unwrap() < 3.0, "{truth}");
    let table = String::from_utf8(lodestep(&["evaluate", text(&first)]).stdout).unwrap();
    assert!(table.contains("first") && table.contains("rms_m"), "{table}");
}

/// Row by row the numbers of a table in `text`; a dash is no number.
fn numbers(text: &str) -> Vec<Vec<f64>> {
    let row = |line: &str| {
        line.split_whitespace().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>()
    };
    text.lines().map(row).filter(|row| row.len() == 8 && row[0].is_finite() && row[7].is_finite()).collect()
}

#[test]
fn the_height_s_sigma_is_predicted_by_a_formula_that_agrees_with_the_filter_over_both_sweeps() {
    let paper =
        ["--velocity-random-walk-m-s-sqrt-s", "0.000226", "--altimeter-sigma-m", "0.1", "--trials", "100"];
    for (sweep, rows) in [("sigma", 13), ("rate", 7)] {
        for sensor in [&["--altimeter-sigma-m", "0.1", "--trials", "100"][..], &paper] {
            let output = lodestep(&[&["predict", "height", "--sweep", sweep], sensor].concat());
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            let text = String::from_utf8(output.stdout).unwrap();
            let table = numbers(&text);
            assert_eq!(table.len(), rows, "{text}");
            for row in table {
                let (varied, closed_m, filter_m, drawn_m) = (row[0], row[1], row[2], row[3]);
                let dull = sweep == "rate" || (0.05..=1.0).contains(&varied);
                let allowed = if dull { 0.1 } else { 0.2 };
                assert!((closed_m / filter_m - 1.0).abs() < allowed, "{sweep} {row:?}");
                // A hundred errors tell their rms to 7 %.
                assert!((drawn_m / filter_m - 1.0).abs() < 0.3, "{sweep} {row:?}");
            }
        }
    }
}

#[test]
fn a_prediction_says_its_figures_in_sentences_and_draws_them() {
    let folder = Folder::new();
    let plot = folder.path("height.svg");
    let output = lodestep(&["predict", "height", "--plot", text(&plot)]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    for sentence in
        ["settles at a sigma of", "within 10 % of that after", "sample by sample", "as printed", "└──"]
    {
        assert!(said.contains(sentence), "{sentence}: {said}");
    }
    let drawn = fs::read_to_string(plot).unwrap();
    assert!(
        drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>") && drawn.contains("closed form")
    );
    for (wrong, expected) in [
        (["--altimeter-sigma-m", "0"], "altimeter sigma has to be a positive number of m"),
        (["--altimeter-rate-hz", "400"], "at most once for each IMU sample"),
        (["--stance-share", "1.2"], "between 0 and 1"),
        (["--start-sigma-m", "nan"], "start sigma"),
        (["--plot", "height.png"], "ends in .svg"),
        (["--sweep", "gait"], "sigma, rate"),
    ] {
        let (code, sentence) = failed(&[&["predict", "height"], &wrong[..]].concat());
        assert!(code == 2 && sentence.contains(expected), "{wrong:?}: {sentence}");
    }
}

#[test]
fn help_names_units_and_exit_codes() {
    let help = |arguments: &[&str]| {
        let output = lodestep(arguments);
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    let process = help(&["process", "--help"]);
    for word in ["rad/s", "m/s²", "µT", "hPa", "Exit codes", "--initial-heading-deg", "degrees clockwise"] {
        assert!(process.contains(word), "{word}");
    }
    assert!(help(&["--help"]).contains("simulate"));
    let (code, sentence) = failed(&["evaluate", "/there/is/none"]);
    assert!(code == 3 && sentence.contains("cannot be read"), "{sentence}");
}

/// Feet that stand, as x-io's software writes them: its clock shows 500 s when the right one begins, and the left
/// one begins half a second later.
#[test]
fn logs_of_another_maker_are_recognised_and_keep_together_by_their_clock() {
    let folder = Folder::new();
    let x_io = |first_s: f64| {
        let mut log = "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n".to_owned();
        for i in 0..1500 {
            let wiggle = ((i * 7919) % 101) as f64 * 1e-4;
            let t_s = first_s + i as f64 / 100.0;
            writeln!(log, "{t_s:.3},{wiggle},{},{wiggle},{wiggle},0,{}", -wiggle, 1.0 + wiggle * 0.01)
                .unwrap();
        }
        log
    };
    let (left, right) =
        (folder.with("l.csv", x_io(500.5)), folder.with("r.csv", gzip(x_io(500.0).as_bytes())));
    let out = folder.path("t.csv");
    let output = lodestep(&["process", "--left", text(&left), "--right", text(&right), "--out", text(&out)]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let track = fs::read_to_string(&out).unwrap();
    let last: Vec<&str> = track.lines().next_back().unwrap().split(',').collect();
    assert_eq!(last[0], "15.49", "counted from the right foot's first sample");

    let own = "n;wx;wy;wz;fx;fy;fz\n0;0;0;0;0;0;9.8\n1;0;0;0;0;0;9.8\n";
    let log = folder.with("own.csv", own);
    let (code, sentence) = failed(&["process", "--left", text(&log), "--out", "-"]);
    assert_eq!(code, 3);
    assert!(sentence.contains("n, wx, wy") && sentence.contains("SensorConnect"), "{sentence}");
    let mapping = folder.with(
        "m.json",
        r#"{"delimiter":"semicolon","time":{"column":"n","unit":"samples","rate_hz":100},
            "gyr":{"columns":["wx","wy","wz"],"unit":"rad_s"},"acc":{"columns":["fx","fy","fz"],"unit":"m_s2"}}"#,
    );
    let (code, sentence) =
        failed(&["process", "--left", text(&log), "--mapping", text(&mapping), "--out", "-"]);
    // It is read; two samples are no walk.
    assert_eq!(code, 3);
    assert!(sentence.contains("found 2 samples"), "{sentence}");
    let (code, sentence) = failed(&["process", "--left", text(&log), "--mapping", text(&log), "--out", "-"]);
    assert!(code == 3 && sentence.contains("expected a mapping of columns as JSON"), "{sentence}");
}
