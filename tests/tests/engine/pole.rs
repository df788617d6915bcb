//! Surveys that never were: what goes wrong on them is said, and what is said of the points holds.

use lodestep_engine::parse::gnss::{GnssQuality, GnssRow};
use lodestep_engine::sim::pole::{Route, SimulatedSurvey, Trouble, Worlds, simulate, simulate_in};
use lodestep_engine::systems::pole::points::Point;
use lodestep_engine::systems::pole::recorder::Recorder;
use lodestep_engine::systems::pole::recording::{Instrument, Stop};
use lodestep_engine::systems::pole::survey::{Options, Survey, compute};
use lodestep_engine::systems::pole::tuning::Tuning;

const ROUTE: Route = Route::I(20.0);

/// Computed as it was recorded; `moved_m` is how far east the fixes lie after the gap.
fn computed(simulated: &SimulatedSurvey, switch: bool, moved_m: f64) -> Survey {
    let frame = simulated.site.local_frame();
    let mut recorder = Recorder::default();
    for sample in &simulated.imu {
        recorder.sample(sample);
    }
    let mut last_ns = None;
    let mut off_m = 0.0;
    for epoch in &simulated.gnss {
        if last_ns.is_some_and(|last_ns| epoch.t_ns - last_ns > 3_000_000_000) {
            off_m = moved_m;
        }
        last_ns = Some(epoch.t_ns);
        let [e, n, u] = epoch.p_n_m;
        let place = frame.to_geodetic([e + off_m, n, u]);
        let quality = if epoch.quality == "fixed" { GnssQuality::Fixed } else { GnssQuality::Float };
        recorder.position(GnssRow { t_ns: epoch.t_ns, place, sigma_n_m: Some(epoch.sigma_n_m), quality });
    }
    if switch {
        simulated.contact.iter().for_each(|(t_ns, closed)| recorder.contact(*t_ns, *closed));
    }
    let [t_start_ns, t_end_ns] = simulated.stop_ns;
    let stop = Stop { name: "T".to_owned(), t_start_ns, t_end_ns };
    let instrument =
        Instrument { antenna_b_m: simulated.antenna_b_m.into(), tip_b_m: Some(simulated.tip_b_m.into()) };
    let options = Options { tuning: Tuning::default(), smoothed: true, rate_hz: 20.0, lands: true };
    compute(&recorder.recording(&frame, vec![stop]), &instrument, &frame, &options).unwrap()
}

fn kinds(survey: &Survey) -> Vec<&str> {
    survey.findings.iter().map(|finding| finding.kind.as_str()).collect()
}

/// How many sigmas the point is off.
fn sigmas(point: &Point, simulated: &SimulatedSurvey) -> f64 {
    let off = point.p_n_m - nalgebra::Vector3::from(simulated.point_n_m);
    off.dot(&(point.covariance_n_m2.try_inverse().unwrap() * off)).sqrt()
}

#[test]
fn a_tip_that_slips_on_the_point_is_said_and_the_point_is_no_surer_than_the_slip() {
    for seed in 0..2 {
        let simulated = simulate(ROUTE, seed, Trouble::SlipOnPoint);
        for switch in [true, false] {
            let survey = computed(&simulated, switch, 0.0);
            let said = kinds(&survey);
            assert!(said.contains(&"moved_on_point"), "seed {seed}, switch {switch}: {said:?}");
            let [point] = &survey.points[..] else { panic!("one point was visited") };
            let sigma_m = point.covariance_n_m2[(0, 0)].sqrt();
            assert!(sigma_m > 0.05, "seed {seed}, switch {switch}: {sigma_m}");
            assert!(sigmas(point, &simulated) < 4.0, "seed {seed}, switch {switch}");
        }
    }
}

#[test]
fn a_survey_on_which_nothing_went_wrong_says_nothing_and_its_sigmas_hold() {
    for seed in 0..3 {
        let simulated = simulate(ROUTE, seed, Trouble::None);
        let survey = computed(&simulated, true, 0.0);
        let [point] = &survey.points[..] else { panic!("one point was visited") };
        assert!(sigmas(point, &simulated) < 4.0 && point.moved_m == 0.0, "seed {seed}: {point:?}");
        let [closure] = survey.figures.closures[..] else { panic!("there was one gap") };
        assert!(closure.sigmas < 2.33 && closure.gap_s > 20.0, "seed {seed}: {closure:?}");
        assert!(survey.findings.is_empty(), "seed {seed}: {:?}", kinds(&survey));
    }
}

#[test]
fn a_gap_that_does_not_close_is_said() {
    let simulated = simulate(ROUTE, 0, Trouble::None);
    let said = kinds(&computed(&simulated, true, 0.7)).join(" ");
    assert!(said.contains("misclosure"), "{said}");
}

#[test]
fn the_point_of_a_way_there_and_back_lies_where_it_turns() {
    let simulated = simulate(Route::B(20.0), 0, Trouble::None);
    let [e, n, _] = simulated.point_n_m;
    assert!((e.hypot(n) - 30.0).abs() < 0.5, "{e} {n}");
    let [first, last] = [simulated.truth[0].tip_n_m, simulated.truth[simulated.truth.len() - 1].tip_n_m];
    assert!((first[0] - last[0]).hypot(first[1] - last[1]) < 0.6, "it ends where it began");
    assert!(computed(&simulated, true, 0.0).points.len() == 1);
}

/// Another pole, sensor, receiver, ground and walker each time.
#[test]
fn in_worlds_that_are_drawn_a_point_is_within_its_sigmas_or_something_is_said() {
    for seed in 0..4 {
        let simulated = simulate_in(Worlds::Drawn, ROUTE, seed, Trouble::None);
        let survey = computed(&simulated, true, 0.0);
        let [point] = &survey.points[..] else { panic!("seed {seed}: one point was visited") };
        let off = sigmas(point, &simulated);
        assert!(off < 4.0 || !survey.findings.is_empty(), "seed {seed}: {off} sigmas, {point:?}");
    }
}

/// A receiver whose clock is ahead of the sensor's by a fortieth of a second.
#[test]
fn clocks_that_are_apart_are_found_to_be() {
    let mut simulated = simulate(ROUTE, 1, Trouble::None);
    simulated.gnss.iter_mut().for_each(|epoch| epoch.t_ns += 25_000_000);
    let survey = computed(&simulated, true, 0.0);
    let apart_s = survey.figures.clock_apart_s;
    assert!((apart_s - 0.025).abs() < 0.004, "{apart_s}");
    assert!(sigmas(&survey.points[0], &simulated) < 4.0);
}

/// Many receivers give one position a second.
#[test]
fn a_receiver_of_one_position_a_second_will_do() {
    for seed in 0..3 {
        let mut simulated = simulate(ROUTE, seed, Trouble::None);
        simulated.gnss.retain(|epoch| epoch.t_ns / 200_000_000 % 5 == 0);
        assert!(simulated.gnss.windows(2).all(|pair| pair[1].t_ns - pair[0].t_ns > 900_000_000));
        let survey = computed(&simulated, true, 0.0);
        let [point] = &survey.points[..] else { panic!("one point was visited") };
        assert!(sigmas(point, &simulated) < 4.0, "seed {seed}: {point:?}");
        let off_m = (point.p_n_m - nalgebra::Vector3::from(simulated.point_n_m)).norm();
        assert!(off_m < 0.06, "seed {seed}: {off_m}");
    }
}
