//! Made worlds through the rover's estimator: what is called fixed is right, and a base elsewhere is found out.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

use std::collections::BTreeMap;

use lodestep_engine::anomaly::Cause as _;
use lodestep_engine::geo::{Geodetic, LocalFrame};
use lodestep_engine::gnss::ephemeris::Navigation;
use lodestep_engine::gnss::observations::Observations;
use lodestep_engine::gnss::satellite::Constellation;
use lodestep_engine::gnss::{navigation_reader, observation_reader};
use lodestep_engine::sim::rover::{Scene, simulate};
use lodestep_engine::systems::rover::coupling::{CoupledAnchor, CoupledRange};
use lodestep_engine::systems::rover::instrument::Instrument;
use lodestep_engine::systems::rover::row::{Quality, Row};
use lodestep_engine::systems::rover::run::{Inputs, Outcome, run};

/// A made world, read.
struct World {
    rover: Observations,
    base: Observations,
    navigation: Navigation,
    base_place: Geodetic,
    instrument: Instrument,
    ranges: Vec<CoupledRange>,
    anchors: Vec<CoupledAnchor>,
    /// Position by milliseconds of the week.
    truth: BTreeMap<i64, [f64; 3]>,
}

fn world(scene: Scene, seed: u64) -> World {
    let files: BTreeMap<&str, String> =
        simulate(scene, seed).into_iter().map(|file| (file.name, file.text)).collect();
    let rover = observation_reader::read(files["rover.obs"].as_bytes()).unwrap();
    let base = observation_reader::read(files["base.obs"].as_bytes()).unwrap();
    let navigation = navigation_reader::read(files["base.nav"].as_bytes()).unwrap();
    let meta: serde_json::Value = serde_json::from_str(&files["meta.json"]).unwrap();
    let place: Vec<f64> = meta["base"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    let base_place = Geodetic { latitude_deg: place[0], longitude_deg: place[1], height_m: place[2] };
    let instrument =
        files.get("rover.toml").map_or_else(Instrument::default, |text| Instrument::from_toml(text).unwrap());
    let rows = |name: &str| -> Vec<Vec<String>> {
        let text = files.get(name).map_or("", String::as_str);
        text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    let number = |field: &String| -> f64 { field.parse().unwrap() };
    let anchors: Vec<CoupledAnchor> = rows("anchors.csv")
        .iter()
        .map(|row| CoupledAnchor {
            name: row[0].clone(),
            p_n: [number(&row[1]), number(&row[2]), number(&row[3])].into(),
        })
        .collect();
    let ranges = rows("uwb.csv")
        .iter()
        .filter(|row| !row[2].is_empty())
        .map(|row| CoupledRange {
            t_s: number(&row[0]),
            anchor: anchors.iter().position(|one| one.name == row[1]).unwrap(),
            range_m: number(&row[2]),
        })
        .collect();
    let truth = files["truth.csv"]
        .lines()
        .skip(1)
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').take(4).map(|field| field.parse().unwrap()).collect();
            ((numbers[0] * 1e3).round() as i64, [numbers[1], numbers[2], numbers[3]])
        })
        .collect();
    World { rover, base, navigation, base_place, instrument, ranges, anchors, truth }
}

fn worked_out(world: &World, base_place: Geodetic, smoothed: bool) -> Outcome {
    run(&Inputs {
        rover: &world.rover,
        base: &world.base,
        navigation: &world.navigation,
        base_place,
        instrument: &world.instrument,
        systems: &Constellation::ALL,
        ranges: &world.ranges,
        anchors: &world.anchors,
        doubtful: false,
        smoothed,
        paper: false,
        initial_position_m: None,
    })
}

/// Errors in plan of rows of a quality, m.
fn errors_m(world: &World, rows: &[Row], quality: Quality) -> Vec<f64> {
    let of = rows.iter().filter(|row| row.quality == quality);
    of.filter_map(|row| {
        let truth = world.truth.get(&((row.gps_time?.1 * 1e3).round() as i64))?;
        Some((row.p_n_m[0] - truth[0]).hypot(row.p_n_m[1] - truth[1]))
    })
    .collect()
}

#[test]
fn under_the_open_sky_all_but_the_first_epochs_are_fixed_and_right() {
    let world = world(Scene::Open, 3);
    let rows = worked_out(&world, world.base_place, false).rows;
    let fixed = errors_m(&world, &rows, Quality::Fixed);
    assert!(100 * fixed.len() >= 95 * rows.len(), "{} of {}", fixed.len(), rows.len());
    let worst = fixed.iter().copied().fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst}");
}

#[test]
fn through_a_doorway_nothing_fixed_is_wrong_and_smoothing_helps_in_the_hall() {
    let world = world(Scene::Doorway, 1);
    let filtered = worked_out(&world, world.base_place, false).rows;
    let smoothed = worked_out(&world, world.base_place, true).rows;
    for rows in [&filtered, &smoothed] {
        let worst = errors_m(&world, rows, Quality::Fixed).into_iter().fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }
    let mean = |rows: &[Row]| {
        let all = errors_m(&world, rows, Quality::Uwb);
        assert!(all.len() > 20);
        all.iter().sum::<f64>() / all.len() as f64
    };
    let (before, after) = (mean(&filtered), mean(&smoothed));
    assert!(before < 0.3 && after < before, "{before} {after}");
}

#[test]
fn a_base_that_is_a_hundred_metres_elsewhere_is_said_and_nothing_is_called_fixed() {
    let world = world(Scene::Open, 3);
    let elsewhere = LocalFrame::new(world.base_place).to_geodetic([100.0, 0.0, 0.0]);
    let outcome = worked_out(&world, elsewhere, false);
    assert!(
        outcome.anomalies.iter().any(|one| one.sentence().contains("--base-position")),
        "{:?}",
        outcome.anomalies
    );
    assert!(outcome.rows.iter().all(|row| row.quality != Quality::Fixed));
}
