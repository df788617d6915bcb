//! Does the track follow the truth? With both feet, with one, and with less than all sensors.

use lodestep_engine::event::HeadingSource;
use lodestep_engine::sim::faults::Fault;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind};
use lodestep_engine::systems::pedestrian::{Side, aids};

use crate::scenario::{Scenario, short_walk};
use crate::told::Told;

/// Largest error in plan over time, error at the end, largest height error at the end; m.
#[track_caller]
fn assert_follows(scenario: &Scenario, told: &Told, [largest_m, end_m, height_m]: [f64; 3]) {
    let errors = told.errors(scenario);
    assert!(
        errors.horizontal.max_m <= largest_m
            && errors.end_error_m <= end_m
            && errors.end_height_error_m.abs() <= height_m,
        "{errors:?}"
    );
    assert_eq!(told.track.points.len(), scenario.truth.len(), "a point for every epoch");
}

fn perfect(kind: WalkKind) -> Scenario {
    Scenario::simulated(kind, 1, &SensorModel::perfect()).with_true_heading()
}

#[test]
fn perfect_sensors_on_a_straight_line() {
    let scenario = perfect(WalkKind::Line { metres: 60.0 });
    let told = scenario.run();
    assert_follows(&scenario, &told, [0.35, 0.3, 0.1]);
    assert!((told.summary.distance_m - 60.0).abs() < 1.5, "{:?}", told.summary);
    assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
}

#[test]
fn perfect_sensors_on_stairs_up_and_down() {
    let scenario = perfect(WalkKind::Stairs);
    let told = scenario.run();
    assert_follows(&scenario, &told, [0.8, 0.6, 0.3]);
    // Six flights of twelve treads of 0.17 m.
    let top_m = told.track.points.iter().map(|point| point.position_n_m[2]).fold(f64::MIN, f64::max);
    assert!((top_m - 12.24).abs() < 0.4, "{top_m} m up");
    assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
}

#[test]
fn the_cmp10a_on_a_straight_line_by_its_own_compass() {
    let scenario = short_walk();
    let told = scenario.run();
    assert_follows(&scenario, &told, [2.0, 2.0, 0.5]);
    assert!(
        told.track.alignments.iter().all(|alignment| alignment.heading_source == HeadingSource::Magnetic)
    );
    assert_eq!(told.track.alignments.len(), 2);
    for aid in [aids::ZUPT, aids::HEADING, aids::MARU, aids::SEPARATION] {
        assert!(
            told.track.aids.get(&aid).is_some_and(|tally| tally.accepted > 10),
            "{aid:?}: {:?}",
            told.track.aids
        );
    }
}

#[test]
fn the_cmp10a_on_stairs() {
    let scenario = Scenario::simulated(WalkKind::Stairs, 2, &SensorModel::cmp10a());
    let told = scenario.run();
    assert_follows(&scenario, &told, [3.0, 3.0, 1.0]);
}

#[test]
fn the_cmp10a_around_the_first_corner_of_the_rectangle() {
    let scenario = Scenario::beginning(WalkKind::Rectangle, 3, &SensorModel::cmp10a(), 260.0);
    let told = scenario.run();
    let errors = told.errors(&scenario);
    assert!(errors.end_error_percent < 3.0, "{errors:?}");
    // East after the corner: seen on a foot that stands, as a swinging one turns.
    let standing =
        told.track.points.iter().rev().find(|point| point.parts[0].is_some_and(|left| left.stance));
    let heading_rad = standing.expect("a stance").heading_rad;
    assert!((heading_rad - std::f64::consts::FRAC_PI_2).abs() < 0.15, "{heading_rad}");
}

#[test]
fn one_foot_alone() {
    for foot in Side::BOTH {
        let scenario = short_walk().with_true_heading().with_one_foot(foot);
        let told = scenario.run();
        assert_follows(&scenario, &told, [2.0, 2.0, 0.6]);
        let point = told.last();
        assert_eq!(
            (point.parts[0].is_some(), point.parts[1].is_some()),
            (foot == Side::Left, foot == Side::Right)
        );
        assert!(!told.track.aids.contains_key(&aids::SEPARATION), "one foot has no separation");
    }
}

#[test]
fn without_magnetometer_and_barometer_a_given_heading_is_kept() {
    let scenario = short_walk()
        .with_true_heading()
        .with_fault(Side::Left, &Fault::InertialOnly)
        .with_fault(Side::Right, &Fault::InertialOnly);
    let told = scenario.run();
    // The right sensor sits turned by 26° against the left one, which nothing has told.
    assert_follows(&scenario, &told, [3.0, 3.0, 0.5]);
    assert!(!told.track.aids.contains_key(&aids::HEADING), "{:?}", told.track.aids);
    assert_eq!(told.track.alignments[0].heading_source, HeadingSource::Given);
}

#[test]
fn without_pressure_nothing_but_the_height_is_lost() {
    let without = |_: usize, sample: &mut lodestep_engine::sample::ImuSample| sample.pressure_hpa = None;
    let scenario = short_walk().with_samples(Side::Left, without).with_samples(Side::Right, without);
    assert_follows(&scenario, &scenario.run(), [2.0, 2.0, 0.5]);
}

#[test]
fn with_no_heading_at_all_the_first_x_axis_points_east() {
    let scenario = short_walk()
        .with_fault(Side::Left, &Fault::InertialOnly)
        .with_fault(Side::Right, &Fault::InertialOnly);
    let told = scenario.run();
    assert_eq!(told.track.alignments[0].heading_source, HeadingSource::Assumed);
    // The walk goes north; the track goes where north lies for somebody who takes x for east.
    let turned_rad = std::f64::consts::FRAC_PI_2 - scenario.truth[0][0].heading_rad;
    let [e_m, n_m, _] = told.last().position_n_m;
    let off_rad = lodestep_engine::rotation::wrap(e_m.atan2(n_m) - turned_rad);
    assert!((e_m.hypot(n_m) - 30.0).abs() < 1.0, "{e_m} {n_m}");
    assert!(off_rad.abs() < 0.1, "{off_rad} rad off");
}

#[test]
fn feet_on_different_clocks_and_rates() {
    let mut scenario = short_walk().with_true_heading();
    let mut every_second = 0;
    scenario.logs[1].retain_mut(|sample| {
        sample.t_ns += 3_700_000;
        every_second += 1;
        every_second % 2 == 0
    });
    let told = scenario.run();
    let errors = told.errors(&scenario);
    assert!(errors.horizontal.max_m < 2.0 && errors.end_height_error_m.abs() < 0.6, "{errors:?}");
    assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
    assert!(
        told.track.points.len() >= scenario.truth.len() - 2,
        "an epoch for every sample of the faster foot"
    );
}

#[test]
fn a_clock_that_starts_late_and_drifts_is_no_gap() {
    let drifts = Fault::Clock { ppm: 40.0, offset_ns: 120_000_000 };
    let scenario = short_walk().with_true_heading().with_fault(Side::Right, &drifts);
    let told = scenario.run();
    let errors = told.errors(&scenario);
    assert!(errors.horizontal.max_m < 2.0, "{errors:?}");
    assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
}

#[test]
fn a_lap_walked_and_a_lap_run() {
    let scenario = Scenario::simulated(WalkKind::Running, 2, &SensorModel::cmp10a()).with_true_heading();
    let told = scenario.run();
    assert_follows(&scenario, &told, [2.5, 1.2, 0.8]);
    // A foot that flies past at 7 m/s is not held there: each stride keeps its length.
    let places = scenario.true_places();
    let truth_m = places.windows(2).map(|w| {
        let [a, b] = [w[0].position_m, w[1].position_m];
        (b[0] - a[0]).hypot(b[1] - a[1])
    });
    let share = told.summary.distance_m / truth_m.sum::<f64>();
    assert!((share - 1.0).abs() < 0.03, "{share} of the path");
    assert!(told.track.anomalies.is_empty(), "running is no trouble: {:?}", told.track.anomalies);
}

#[test]
fn a_start_of_five_or_two_seconds_does_as_well_as_one_of_ten() {
    let whole = Scenario::simulated(WalkKind::Line { metres: 40.0 }, 3, &SensorModel::cmp10a());
    let end_m = whole.run().errors(&whole).end_error_m;
    for missing_s in [7, 10] {
        let mut scenario = whole.clone();
        for log in &mut scenario.logs {
            log.drain(..missing_s * 100);
        }
        let told = scenario.run();
        let errors = told.errors(&scenario);
        assert!((errors.end_error_m - end_m).abs() < 0.3, "{errors:?}, {end_m} m with all of it");
        let [e, n, _] = told.last().sigma_n_m;
        assert!(errors.end_error_m < 3.0 * e.hypot(n), "{errors:?}");
        assert!(told.track.anomalies.is_empty(), "{:?}", told.track.anomalies);
    }
}
