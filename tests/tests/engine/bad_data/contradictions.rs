//! Sensors that contradict each other: every reading by itself is one that such a sensor gives. Each kind is named, or the
//! sigma covers what it does; none is wrong without a word.

use lodestep_engine::anomaly::AnomalyKind;
use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::contradictions::{CONTRADICTIONS, Worn};
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::contradictions::{
    FEET_CONTRADICT, FIELD_CONTRADICTION, GYRO_CHANGED, HEIGHTS_DISAGREE, LOW_RATE, SPIKES,
    SWINGS_DO_NOT_CLOSE,
};

use crate::scenario::Scenario;
use crate::told::Told;

const WRONG_MOUNTING: AnomalyKind = AnomalyKind::WRONG_MOUNTING;
const UNCERTAIN: AnomalyKind = AnomalyKind::HEADING_UNCERTAIN;

/// A kind with its severity, and what it is told as.
pub(super) const NAMED: &[(&str, f64, AnomalyKind)] = &[
    ("force with the other sign", 1.0, FIELD_CONTRADICTION),
    ("force with the other sign, right foot alone", 1.0, FIELD_CONTRADICTION),
    ("field with the other sign", 1.0, FIELD_CONTRADICTION),
    ("field with the other sign, right foot alone", 1.0, FIELD_CONTRADICTION),
    ("rate with the other sign", 1.0, SWINGS_DO_NOT_CLOSE),
    ("rate of axis {} with the other sign", 0.0, WRONG_MOUNTING),
    ("rate of axis {} with the other sign", 1.0, SWINGS_DO_NOT_CLOSE),
    ("rate of axis {} with the other sign", 2.0, WRONG_MOUNTING),
    ("rate of axis {} with the other sign, right foot alone", 1.0, SWINGS_DO_NOT_CLOSE),
    ("force of axis {} with the other sign", 0.0, WRONG_MOUNTING),
    ("force of axis {} with the other sign", 2.0, WRONG_MOUNTING),
    ("field of axis {} with the other sign", 0.0, FIELD_CONTRADICTION),
    ("field of axis {} with the other sign", 2.0, FIELD_CONTRADICTION),
    ("left-handed axes, {} mirrored", 0.0, WRONG_MOUNTING),
    ("left-handed axes, {} mirrored", 1.0, WRONG_MOUNTING),
    ("left-handed axes, {} mirrored", 2.0, WRONG_MOUNTING),
    ("field in the axes y, x, -z", 1.0, FIELD_CONTRADICTION),
    ("field in the axes y, x, -z, right foot alone", 1.0, FIELD_CONTRADICTION),
    ("field in the axes y, z, x", 1.0, FIELD_CONTRADICTION),
    ("field in the axes x, -y, -z", 1.0, FIELD_CONTRADICTION),
    ("field in the axes -x, -y, z", 1.0, FIELD_CONTRADICTION),
    ("field turned by {} deg about the vertical", 90.0, FIELD_CONTRADICTION),
    ("field turned by {} deg about the vertical", 180.0, FIELD_CONTRADICTION),
    ("rates in the axes y, x, z", 1.0, WRONG_MOUNTING),
    ("rates in the axes y, z, x", 1.0, WRONG_MOUNTING),
    ("rates in the axes -y, x, z", 1.0, WRONG_MOUNTING),
    ("forces in the axes y, x, z", 1.0, WRONG_MOUNTING),
    ("forces in the axes x, z, y, right foot alone", 1.0, WRONG_MOUNTING),
    ("rates times {}", 0.017_453_3, WRONG_MOUNTING),
    ("rates times {}", 0.5, SWINGS_DO_NOT_CLOSE),
    ("rates times {}", 2.0, SWINGS_DO_NOT_CLOSE),
    ("rates times {}", 57.295_78, AnomalyKind::SATURATION),
    ("force times {}", 0.101_97, AnomalyKind::IMPOSSIBLE_REST_GRAVITY),
    ("force times {}", 2.0, AnomalyKind::IMPOSSIBLE_REST_GRAVITY),
    ("field times {}", 1.5, FIELD_CONTRADICTION),
    ("rate of axis {} noise alone", 1.0, SWINGS_DO_NOT_CLOSE),
    ("force of axis {} noise alone", 0.0, SWINGS_DO_NOT_CLOSE),
    ("force of axis {} noise alone", 2.0, AnomalyKind::IMPOSSIBLE_REST_GRAVITY),
    ("field of axis {} noise alone", 2.0, FIELD_CONTRADICTION),
    ("field that does not turn with the foot", 1.0, FIELD_CONTRADICTION),
    ("rates late by {} samples", 10.0, SWINGS_DO_NOT_CLOSE),
    ("forces late by {} samples", 2.0, SWINGS_DO_NOT_CLOSE),
    ("forces late by {} samples", 5.0, SWINGS_DO_NOT_CLOSE),
    ("both clocks {} times as fast", 1.1, SWINGS_DO_NOT_CLOSE),
    ("rate off by {} rad/s on x from the middle on", 0.02, GYRO_CHANGED),
    ("rate off by {} rad/s on z from the middle on", 0.02, SWINGS_DO_NOT_CLOSE),
    ("sensor turned by {} deg about z in the middle", 10.0, SWINGS_DO_NOT_CLOSE),
    ("rate off by {} rad/s on x from the middle on", 0.2, WRONG_MOUNTING),
    ("sensor turned by {} deg about x in the middle", 40.0, WRONG_MOUNTING),
    ("sensor turned by {} deg about z in the middle", 90.0, WRONG_MOUNTING),
    ("a lift of {} m at the end", 16.0, HEIGHTS_DISAGREE),
    ("a lift of {} m at the end", -8.0, HEIGHTS_DISAGREE),
    ("a lift of {} m in the middle of a stand", 3.0, HEIGHTS_DISAGREE),
    ("an escalator of {} m at the end", 5.0, HEIGHTS_DISAGREE),
    ("pressure of the right foot off by {} hPa from the middle on", 1.0, HEIGHTS_DISAGREE),
    ("the log of the left foot for both", 1.0, FEET_CONTRADICT),
    ("the clock of the right foot ahead by {} s", 0.6, FEET_CONTRADICT),
    ("{} spikes of one sample a foot", 50.0, SPIKES),
    ("every {}th sample alone", 4.0, LOW_RATE),
    ("every {}th sample alone", 10.0, LOW_RATE),
    ("no magnetometer", 1.0, UNCERTAIN),
];

/// 50 m around a block, the heading by the magnetometer.
fn around_a_block() -> Scenario {
    let mut scenario = Scenario::simulated(WalkKind::Block { metres: 50.0 }, 1, &SensorModel::cmp10a());
    scenario.config.site_field = Some(Site::fast().field());
    scenario
}

/// The walk with a contradiction, run, and the truth with it.
fn run(scenario: &Scenario, name: &str, by: f64) -> (Told, Worn) {
    let truth = scenario.true_places().into_iter().map(|place| (place.t_ns, place.position_m)).collect();
    let mut worn = Worn { logs: scenario.logs.clone(), truth };
    let kind = CONTRADICTIONS.iter().find(|kind| kind.name == name);
    kind.unwrap_or_else(|| panic!("no kind {name}")).spoil(&mut worn, by);
    let told = Scenario { logs: worn.logs.clone(), ..scenario.clone() }.run();
    (told, worn)
}

/// The error of the last point in plan and in height, over its sigmas.
fn end_over_sigma(told: &Told, worn: &Worn) -> [f64; 2] {
    let (end, truth) = (told.last(), worn.truth.last().expect("a walk has an end").1);
    let off: [f64; 3] = std::array::from_fn(|axis| end.position_n_m[axis] - truth[axis]);
    let [e, n, u] = end.sigma_n_m;
    [off[0].hypot(off[1]) / e.hypot(n), off[2].abs() / u]
}

#[test]
fn every_contradiction_is_named() {
    let scenario = around_a_block();
    assert!(scenario.run().track.anomalies.is_empty(), "{:?}", scenario.run().track.anomalies);
    let mut unnamed = Vec::new();
    for (name, by, kind) in NAMED {
        let (told, _) = run(&scenario, name, *by);
        if !told.track.anomalies.iter().any(|anomaly| anomaly.kind == *kind) {
            let found: std::collections::BTreeSet<_> = told.track.anomalies.iter().map(|a| a.kind).collect();
            unnamed.push(format!("{name} {by}: expected {kind:?}, found {found:?}"));
        }
    }
    assert!(unnamed.is_empty(), "{}", unnamed.join("\n"));
}

#[test]
fn where_north_is_unknown_the_sigma_covers_the_way_and_the_height_is_none_the_worse() {
    // Seen while it is far from where it began.
    let mut scenario = around_a_block();
    for log in &mut scenario.logs {
        log.truncate(3_200);
    }
    scenario.truth.truncate(3_200);
    for name in [
        "force with the other sign",
        "field with the other sign",
        "field in the axes y, x, -z",
        "no magnetometer",
    ] {
        let (told, worn) = run(&scenario, name, 1.0);
        let [plan, height] = end_over_sigma(&told, &worn);
        assert!(plan < 3.0 && height < 3.0, "{name}: {plan:.1} and {height:.1} sigma");
        assert!(told.last().sigma_heading_rad > 1.5, "{name}");
    }
}

#[test]
fn a_lift_is_followed_and_pressure_alone_is_not() {
    let scenario = around_a_block();
    for (name, by) in [
        ("a lift of {} m at the end", 16.0),
        ("a lift of {} m in the middle of a stand", 16.0),
        ("an escalator of {} m at the end", 5.0),
    ] {
        let (told, worn) = run(&scenario, name, by);
        let [_, height] = end_over_sigma(&told, &worn);
        let off_m = told.last().position_n_m[2] - worn.truth.last().expect("a walk has an end").1[2];
        // A slow escalator may be half believed: then the sigma covers both.
        let followed = off_m.abs() < 2.5 || name.contains("escalator");
        assert!(height < 3.0 && followed, "{name}: {off_m:.2} m, {height:.1} sigma");
    }
    let (told, worn) = run(&scenario, "pressure of the right foot off by {} hPa from the middle on", 5.0);
    let off_m = told.last().position_n_m[2] - worn.truth.last().expect("a walk has an end").1[2];
    assert!(off_m.abs() < 0.5, "{off_m} m");
}

#[test]
fn spikes_are_taken_out() {
    let (told, worn) = run(&around_a_block(), "{} spikes of one sample a foot", 5.0);
    let end = told.last().position_n_m;
    let truth = worn.truth.last().expect("a walk has an end").1;
    assert!((end[0] - truth[0]).hypot(end[1] - truth[1]) < 1.0, "{end:?} {truth:?}");
    assert!(told.track.anomalies.iter().all(|anomaly| anomaly.kind == SPIKES));
    assert!(told.track.anomalies.iter().any(|anomaly| anomaly.stream == Some(Side::Left.stream())));
}

#[test]
fn mixtures_are_not_wrong_by_five_sigma_without_a_word() {
    let scenario = around_a_block();
    let denied: Vec<String> = (0..24_usize)
        .filter_map(|k| {
            let [(first, by, _), (second, with, _)] =
                [NAMED[(7 * k) % NAMED.len()], NAMED[(11 * k + 5) % NAMED.len()]];
            let truth =
                scenario.true_places().into_iter().map(|place| (place.t_ns, place.position_m)).collect();
            let mut worn = Worn { logs: scenario.logs.clone(), truth };
            for (name, by) in [(first, by), (second, with)] {
                CONTRADICTIONS.iter().find(|kind| kind.name == name)?.spoil(&mut worn, by);
            }
            let told = Scenario { logs: worn.logs.clone(), ..scenario.clone() }.run();
            (told.track.anomalies.is_empty() && end_over_sigma(&told, &worn)[0] > 5.0)
                .then(|| format!("{first} {by} with {second} {with}"))
        })
        .collect();
    assert!(denied.is_empty(), "{denied:?}");
}
