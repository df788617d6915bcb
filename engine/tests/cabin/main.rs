//! The cabin's system on simulated runs: what it finds, that it is causal, and that what goes wrong is named.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod bad_input;
mod run;
mod saved_state;
mod session;

use lodestep_engine::sim::cabin::{RunPlan, SimulatedRun, simulate};
use lodestep_engine::systems::cabin::{Aids, CabinConfig, CabinSession, Estimator, Instrument, Row, Status};

use self::run::{Errors, Found, Read, errors, process, spread};

/// A short run: parked, to the source, on it.
fn short(faults: &[&str], seed: u64) -> SimulatedRun {
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    simulate(&RunPlan { hold_s: 30.0, slew_s: 20.0, track_s: 20.0, stations_on_platform: true, faults }, seed)
}

/// The names of all that may correct, where every device is read.
fn cabin_aids(instrument: &Instrument) -> Aids {
    let config = CabinConfig {
        estimator: Estimator::Own,
        smoothed: false,
        rate_hz: 20.0,
        has_stations: true,
        has_encoders: true,
        has_platform_imu: true,
        platform: true,
    };
    CabinSession::new(instrument, config).unwrap().aids().clone()
}

fn largest_m(errors: &[(Errors, &lodestep_engine::systems::cabin::Row)]) -> f64 {
    errors.iter().map(|([e, n, u, ..], _)| (e * e + n * n + u * u).sqrt()).fold(0.0, f64::max)
}

fn named<'a>(
    found: &'a Found,
    source: &str,
    kind: &str,
) -> Option<&'a lodestep_engine::systems::cabin::CabinAnomaly> {
    found.anomalies.iter().find(|anomaly| anomaly.source == source && anomaly.kind == kind)
}

#[test]
fn with_all_aids_cabin_and_platform_are_known_to_the_millimetre_and_the_sigmas_are_honest() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..3 {
        let run = short(&[], seed);
        let found = process(&run, &Read::default()).unwrap();
        for (rows, platform) in [(&found.poses.cabin, false), (&found.poses.platform, true)] {
            let errors = errors(&run, rows, platform, 30.0, 70.0);
            assert_eq!(errors.len(), 800, "a row every 50 ms");
            for (k, [_, _, rms]) in spread(&errors).into_iter().enumerate() {
                let most = if k < 3 { 0.0025 } else { 0.04_f64.to_radians() };
                assert!(rms < most, "seed {seed}, platform {platform}, error {k}: {rms}");
            }
            let protected = errors
                .iter()
                .all(|(e, row)| (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt() < row.protection_level_m());
            assert!(protected, "seed {seed}, platform {platform}");
            for (e, row) in &errors {
                let sigma = row.sigma_n_m();
                inside += (0..3).filter(|&k| e[k].abs() < 1.96 * sigma[k]).count();
                all += 3;
            }
            assert_eq!(errors.last().unwrap().1.status, Status::Full);
        }
        assert!(found.anomalies.is_empty(), "seed {seed}: {:?}", found.anomalies);
    }
    // Over all runs: within one of 40 s the errors hardly change, so that it is a single draw.
    assert!(inside as f64 > 0.85 * all as f64, "{inside} of {all} errors inside");
}

#[test]
fn a_run_that_is_cut_off_gives_the_same_rows_before() {
    let run = short(&["restart@33..34"], 2);
    let whole = process(&run, &Read::default()).unwrap();
    let cut = process(&run, &Read { until_ns: 41_234_000_000, ..Read::default() }).unwrap();
    for (cut, whole) in [(&cut.poses.cabin, &whole.poses.cabin), (&cut.poses.platform, &whole.poses.platform)]
    {
        assert!(cut.len() > 700);
        for (a, b) in cut.iter().zip(whole) {
            let bits = |row: &lodestep_engine::systems::cabin::Row| {
                [row.t_ns as f64, row.p_n.x, row.p_n.y, row.p_n.z, row.c_nb[(0, 1)], row.covariance[(0, 0)]]
                    .map(f64::to_bits)
            };
            assert_eq!((bits(a), a.aids), (bits(b), b.aids), "at {} s", a.t_ns as f64 * 1e-9);
        }
    }
}

#[test]
fn each_fault_is_named_with_its_sensor_within_a_second_and_the_pose_holds() {
    let faults = [
        "wrong_fix.2@31..36",
        "fog@38..44",
        "wrong_prism.1@52..56",
        "wrong_distance.3@58..62",
        "wrong_leg.4@33..49",
        "restart@64..66",
    ];
    let run = short(&faults, 3);
    let found = process(&run, &Read::default()).unwrap();
    for (source, kind, from_s, to_s) in [
        ("A3", "wrong_fix", 31.0, 36.0),
        ("stations", "silent", 38.0, 44.0),
        ("S2", "wrong_prism", 52.0, 56.0),
        ("S4", "wrong_distance", 58.0, 62.0),
        ("leg_5", "wrong_length", 33.0, 49.0),
        ("imu", "silent", 64.0, 66.0),
    ] {
        let told = found.told.iter().find(|(_, one)| one.source == source && one.kind == kind);
        assert!(
            told.is_some_and(|(t_s, _)| (from_s..from_s + 1.0).contains(t_s)),
            "{source} {kind}: {told:?}"
        );
        let anomaly =
            named(&found, source, kind).unwrap_or_else(|| panic!("{source} {kind}: {:?}", found.anomalies));
        assert!((anomaly.t_start_s - from_s).abs() < 1.0, "{anomaly:?}");
        assert!(anomaly.t_end_s > to_s - 1.0 && anomaly.t_end_s < to_s + 4.0, "{anomaly:?}");
    }
    assert!(largest_m(&errors(&run, &found.poses.platform, true, 31.0, 70.0)) < 0.012);
}

#[test]
fn a_restarted_sensor_and_silent_encoders_leave_rows_at_every_tick() {
    let run = short(&["restart@34..38", "no_encoders@55..60"], 4);
    let found = process(&run, &Read { platform_imu: true, ..Read::default() }).unwrap();
    let cabin = errors(&run, &found.poses.cabin, false, 30.0, 70.0);
    let platform = errors(&run, &found.poses.platform, true, 30.0, 70.0);
    assert_eq!((cabin.len(), platform.len()), (800, 800));
    assert!(largest_m(&cabin) < 0.015, "{}", largest_m(&cabin));
    assert!(largest_m(&platform) < 0.015, "{}", largest_m(&platform));
    assert!(named(&found, "imu", "silent").is_some() && named(&found, "encoders", "silent").is_some());
    // What corrects the platform then is its own sensor and the stations, and of the cabin that sensor is no aid.
    let instrument = Instrument::from_toml(&run.instrument).unwrap();
    let aids = cabin_aids(&instrument);
    let at =
        |rows: &[Row]| rows.iter().find(|row| row.t_ns == 58_000_000_000).map(|row| aids.names(row.aids));
    let (cabin, platform) = (at(&found.poses.cabin).unwrap(), at(&found.poses.platform).unwrap());
    assert!(cabin.starts_with("imu+A1") && !cabin.contains("platform_imu"), "{cabin}");
    assert!(platform.starts_with('S') && platform.ends_with("S6+platform_imu"), "{platform}");
}

#[test]
fn while_a_kind_of_aid_is_missing_it_is_told_how_long_the_budget_lasts() {
    let run = short(&["fog@52..64"], 1);
    let found = process(&run, &Read::default()).unwrap();
    let left_s = |t_s: f64| {
        let row = found.poses.platform.iter().find(|row| row.t_ns as f64 * 1e-9 >= t_s);
        row.and_then(|row| row.time_left_s)
    };
    assert_eq!(left_s(50.0), None, "all aids are there");
    // Three millimetres are three sigmas of the platform after some seconds of fog, and more of it leaves nothing.
    let (early_s, late_s) = (left_s(53.2).unwrap(), left_s(63.0).unwrap());
    assert!(early_s > 0.0 && early_s < 30.0 && late_s < early_s, "{early_s} {late_s}");
}

#[test]
fn encoders_that_write_seldom_and_between_the_epochs_leave_the_pose_as_it_is() {
    for seed in 0..2 {
        let mut run = simulate(
            &RunPlan {
                hold_s: 30.0,
                slew_s: 40.0,
                track_s: 30.0,
                stations_on_platform: true,
                faults: Vec::new(),
            },
            seed,
        );
        // Every other row, at tags that are no epoch's: a device that says 20 ms of delay.
        run.instrument += "delay_s = 0.02\n";
        let mut number = 0;
        run.encoders.retain(|_| {
            number += 1;
            number % 2 == 0
        });
        run.encoders.iter_mut().for_each(|row| row.t_ns += 20_000_000);
        let found = process(&run, &Read::default()).unwrap();
        assert!(!found.anomalies.iter().any(|one| one.kind == "late"), "seed {seed}: {:?}", found.anomalies);
        for (rows, platform) in [(&found.poses.cabin, false), (&found.poses.platform, true)] {
            let errors = errors(&run, rows, platform, 40.0, 100.0);
            let beyond = errors.iter().filter(|(e, row)| {
                (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt() > row.protection_level_m()
            });
            assert_eq!(beyond.count(), 0, "seed {seed}, platform {platform}: {} m", largest_m(&errors));
            assert!(largest_m(&errors) < 0.005, "seed {seed}, platform {platform}: {} m", largest_m(&errors));
        }
    }
}

#[test]
fn encoders_that_are_later_than_stated_are_named_and_the_pose_holds() {
    let late = |by_ns: i64| {
        let mut run = simulate(
            &RunPlan {
                hold_s: 30.0,
                slew_s: 40.0,
                track_s: 10.0,
                stations_on_platform: true,
                faults: Vec::new(),
            },
            2,
        );
        run.encoders.iter_mut().for_each(|row| row.t_ns += by_ns);
        let found = process(&run, &Read::default()).unwrap();
        let largest = [(&found.poses.cabin, false), (&found.poses.platform, true)]
            .map(|(rows, platform)| largest_m(&errors(&run, rows, platform, 45.0, 80.0)));
        (named(&found, "encoders", "late").is_some(), largest)
    };
    let (is_named, [cabin_m, platform_m]) = late(20_000_000);
    assert!(is_named && cabin_m < 0.006 && platform_m < 0.006, "{is_named} {cabin_m} {platform_m}");
    assert!(!late(0).0, "those that are as stated are not named");
}

#[test]
fn smoothed_poses_are_nearer_to_the_truth_and_surer() {
    let run = short(&[], 5);
    let read = Read { stations: false, encoders: false, ..Read::default() };
    let filtered = process(&run, &read).unwrap();
    let smoothed = process(&run, &Read { smoothed: true, ..read }).unwrap();
    assert_eq!(filtered.poses.cabin.len(), smoothed.poses.cabin.len());
    let scatter = |found: &Found| {
        let errors = errors(&run, &found.poses.cabin, false, 30.0, 60.0);
        spread(&errors)[..3].iter().map(|[_, scatter, _]| scatter * scatter).sum::<f64>()
    };
    assert!(scatter(&smoothed) < scatter(&filtered));
    let middle = filtered.poses.cabin.len() / 2;
    assert!(smoothed.poses.cabin[middle].largest_sigma_m() < filtered.poses.cabin[middle].largest_sigma_m());
}

#[test]
fn exchanged_antennas_are_named_and_many_of_them_refused() {
    let mut run = short(&[], 6);
    for row in &mut run.antennas {
        row.antenna = [3, 1, 2, 0, 4, 5][row.antenna];
    }
    let found = process(&run, &Read::default()).unwrap();
    assert!(named(&found, "A1", "exchanged").is_some() && named(&found, "A4", "exchanged").is_some());
    assert!(largest_m(&errors(&run, &found.poses.cabin, false, 35.0, 70.0)) < 0.01);

    for row in &mut run.antennas {
        row.antenna = [3, 2, 1, 0, 5, 4][row.antenna];
    }
    let error = process(&run, &Read::default()).unwrap_err();
    assert!(error.to_string().contains("rigid body"), "{error}");
}

#[test]
fn a_leg_in_millimetres_is_refused_and_so_is_a_platform_that_nobody_sees() {
    let mut run = short(&[], 7);
    for row in &mut run.encoders {
        row.legs_m[2] *= 1000.0;
    }
    let error = process(&run, &Read::default()).unwrap_err();
    assert!(error.to_string().contains("legs"), "{error}");
    let nobody = Read { stations: false, encoders: false, ..Read::default() };
    assert!(process(&run, &nobody).unwrap().poses.platform.is_empty());
}

#[test]
fn the_paper_s_filter_runs_on_antennas_and_stations_alone() {
    let run = short(&[], 8);
    let found = process(&run, &Read { paper: true, platform_imu: true, ..Read::default() }).unwrap();
    let cabin = errors(&run, &found.poses.cabin, false, 35.0, 70.0);
    let platform = errors(&run, &found.poses.platform, true, 35.0, 70.0);
    assert!(largest_m(&cabin) < 0.05 && largest_m(&platform) < 0.02);
    assert!(cabin.len() == 700 && platform.len() == 700);
}

#[test]
fn a_whole_make_is_named_though_one_of_its_antennas_has_no_fix() {
    let mut run = short(&["wrong_make.0@55..65"], 9);
    let mut floats = 0;
    for row in run.antennas.iter_mut().filter(|row| row.antenna == 4 && row.t_ns > 40_000_000_000) {
        row.quality = 5;
        floats += 1;
    }
    assert!(floats > 100, "{floats}");
    let found = process(&run, &Read::default()).unwrap();
    let told = found.told.iter().find(|(_, one)| one.kind == "wrong_make");
    assert!(told.is_some_and(|(t_s, _)| (55.0..56.0).contains(t_s)), "{told:?}");
    assert!(largest_m(&errors(&run, &found.poses.cabin, false, 50.0, 70.0)) < 0.008);
}

#[test]
fn a_leg_that_reads_wrongly_from_the_beginning_is_named_and_the_pose_is_that_of_one_that_does_not() {
    for (leg, off_m) in [(0, 0.015), (3, -0.08)] {
        let mut run = short(&[], 10);
        run.encoders.iter_mut().for_each(|row| row.legs_m[leg] += off_m);
        for smoothed in [false, true] {
            let found = process(&run, &Read { smoothed, ..Read::default() }).unwrap();
            let name = format!("leg_{}", leg + 1);
            assert!(named(&found, &name, "wrong_length").is_some(), "{name}: {:?}", found.anomalies);
            for (rows, platform) in [(&found.poses.cabin, false), (&found.poses.platform, true)] {
                let errors = errors(&run, rows, platform, 30.0, 70.0);
                let beyond = |(e, row): &(Errors, &lodestep_engine::systems::cabin::Row)| {
                    (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt() > row.protection_level_m()
                };
                assert!(largest_m(&errors) < 0.008, "{name}, smoothed {smoothed}, platform {platform}");
                assert!(!errors.iter().any(beyond), "{name}, smoothed {smoothed}, platform {platform}");
            }
        }
    }
}
