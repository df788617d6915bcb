//! What does not belong together is named in one sentence, and no row of it is called fixed.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use lodestep_engine::sim::rover::{Scene, simulate};
use lodestep_server::cli;
use serde_json::Value;
use tempfile::TempDir;

/// A made world in a folder, to be spoilt.
struct World {
    folder: TempDir,
}

impl World {
    fn made(scene: Scene, seed: u64) -> World {
        let world = World { folder: tempfile::tempdir().unwrap() };
        for file in simulate(scene, seed) {
            fs::write(world.path(file.name), file.text).unwrap();
        }
        world
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn change(&self, name: &str, change: impl Fn(&str) -> String) {
        fs::write(self.path(name), change(&self.text(name))).unwrap();
    }

    /// Runs the command; its exit, and the report where there is one.
    fn process(&self, more: &[&str]) -> (ExitCode, Option<Value>) {
        let of = |name: &str| self.path(name).to_str().unwrap().to_owned();
        let mut line = vec!["lodestep".to_owned(), "process".to_owned(), "rover".to_owned()];
        let files =
            [("--rover", "rover.obs"), ("--base", "base.obs"), ("--nav", "base.nav"), ("--uwb", "uwb.csv")];
        for (flag, name) in files.into_iter().chain([("--instrument", "rover.toml")]) {
            line.extend([flag.to_owned(), of(name)]);
        }
        line.extend(["--out".to_owned(), of("track.csv"), "--report".to_owned(), of("report.json")]);
        line.extend(more.iter().map(|word| (*word).to_owned()));
        let _ = fs::remove_file(self.path("report.json"));
        let exit = cli::run(line.into_iter().map(OsString::from));
        let report = fs::read(self.path("report.json")).ok();
        (exit, report.map(|bytes| serde_json::from_slice(&bytes).unwrap()))
    }
}

/// The sentences of a report that say one of these; no row is fixed.
fn said(report: &Value, words: &[&str]) -> usize {
    assert_eq!(report["fixed"], 0, "{report}");
    let sentences = report["anomalies"].as_array().unwrap();
    let fits = |sentence: &&Value| words.iter().all(|word| sentence.as_str().unwrap().contains(word));
    sentences.iter().filter(fits).count()
}

/// Every line of epochs' times, moved by whole seconds.
fn later(text: &str, seconds: u32) -> String {
    let (head, body) = text.split_once("END OF HEADER").unwrap();
    let moved = |line: &str| {
        let Some(rest) = line.strip_prefix("> ") else { return line.to_owned() };
        // `2024 11 13 08 20 15.0000000`
        let number = |from: usize, to: usize| rest[from..to].trim().parse::<f64>().unwrap();
        let all = 3600.0 * number(11, 13) + 60.0 * number(14, 16) + number(16, 27) + f64::from(seconds);
        let (hour, left) = ((all / 3600.0).floor(), all % 3600.0);
        let (minute, second) = ((left / 60.0).floor(), left % 60.0);
        format!("> {}{hour:02} {minute:02}{second:11.7}{}", &rest[..11], &rest[27..])
    };
    format!("{head}END OF HEADER{}", body.lines().map(moved).collect::<Vec<_>>().join("\n"))
}

#[test]
fn files_that_do_not_belong_together_are_named_in_a_sentence_and_never_called_fixed() {
    let world = World::made(Scene::Doorway, 2);
    let (_, good) = world.process(&[]);
    let good = good.unwrap();
    assert!(good["fixed"].as_u64().unwrap() > 30, "the world is good: {good}");

    // A base that is 100 m away.
    let site: toml::Table = world.text("site.toml").parse().unwrap();
    let place = |key: &str| site[key].as_float().unwrap();
    let off = format!("{},{},{}", place("latitude_deg") + 0.0009, place("longitude_deg"), place("height_m"));
    let (_, report) = world.process(&["--base-position", &off]);
    assert_eq!(said(&report.unwrap(), &["base's position", "100 m in plan"]), 1);

    // Rover and base of different days, and no orbit of the rover's: other worlds have other weeks or hours.
    let other = World::made(Scene::Doorway, 5);
    let base = world.text("base.obs");
    fs::write(world.path("base.obs"), other.text("base.obs")).unwrap();
    let (_, report) = world.process(&[]);
    assert_eq!(said(&report.unwrap(), &["no time in common"]), 1);
    fs::write(world.path("base.obs"), base).unwrap();

    let orbits = world.text("base.nav");
    world.change("base.nav", |text| text.split_inclusive("END OF HEADER").next().unwrap().to_owned() + "\n");
    let (exit, report) = world.process(&[]);
    assert!(exit != ExitCode::SUCCESS || said(&report.unwrap(), &["no orbit"]) == 1);
    fs::write(world.path("base.nav"), orbits).unwrap();

    // Anchors with each other's place.
    let known = world.text("rover.toml");
    let mut names: Vec<&str> = known.lines().filter(|line| line.starts_with("name = ")).collect();
    names.dedup();
    let (first, second) = (names[0], names[1]);
    world.change("rover.toml", |text| {
        text.replace(first, "name = \"x\"").replace(second, first).replace("name = \"x\"", second)
    });
    let (_, report) = world.process(&[]);
    assert_eq!(said(&report.unwrap(), &["seem to be swapped"]), 1);
    fs::write(world.path("rover.toml"), known).unwrap();

    // Ranges in millimetres are refused.
    let ranges = world.text("uwb.csv");
    let scaled = |line: &str| match line
        .rsplit_once(',')
        .and_then(|(rest, cell)| Some((rest, cell.parse::<f64>().ok()?)))
    {
        Some((rest, range_m)) => format!("{rest},{:.0}", range_m * 1000.0),
        None => line.to_owned(),
    };
    world.change("uwb.csv", |text| text.lines().map(scaled).collect::<Vec<_>>().join("\n") + "\n");
    assert_ne!(world.process(&[]).0, ExitCode::SUCCESS);

    // Their clock is 10 s off.
    let late = |line: &str| match line
        .split_once(',')
        .and_then(|(time, rest)| Some((time.parse::<f64>().ok()?, rest)))
    {
        Some((t_s, rest)) => format!("{:.4},{rest}", t_s + 10.0),
        None => line.to_owned(),
    };
    fs::write(world.path("uwb.csv"), ranges.lines().map(late).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let (_, report) = world.process(&[]);
    assert_eq!(said(&report.unwrap(), &["ranges' clock", "10.0 s"]), 1);
    fs::write(world.path("uwb.csv"), ranges).unwrap();

    // The rover's clock is.
    world.change("rover.obs", |text| later(text, 10));
    let (_, report) = world.process(&[]);
    assert_eq!(said(&report.unwrap(), &["rover's time tags", "10 s off"]), 1);
    assert!(Path::new(&world.path("track.csv")).exists());
}
