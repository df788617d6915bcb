//! Recorded walks as a change indicator, all with the defaults: if a change of the engine moves
//! these figures, it shows. New figures are fine when the commit says why they moved.

#![allow(clippy::print_stdout, reason = "the figures are what an engineer runs these for")]

use std::io::Read as _;
use std::path::PathBuf;

use flate2::read::GzDecoder;
use lodestep_engine::evaluate::pedestrian::{StanceErrors, feet_apart, foot_instants, stances};
use lodestep_engine::evaluate::{MotionCaptureErrors, loop_closure, motion_capture};
use lodestep_engine::parse::ImuCsv;
use lodestep_engine::parse::truth_csv;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::pedestrian::{self, Side};

use crate::scenario::Scenario;
use crate::told::Told;

fn unpacked(name: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    let file = std::fs::File::open(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut bytes = Vec::new();
    GzDecoder::new(file).read_to_end(&mut bytes).expect("gzip");
    bytes
}

fn log(name: &str) -> Vec<ImuSample> {
    let (mut parser, mut samples) = (ImuCsv::new(), Vec::new());
    parser.push(&unpacked(name), &mut samples).expect("a canonical log");
    parser.finish(&mut samples).expect("a canonical log");
    samples
}

/// The log at another rate, as a slower or a faster sensor of the same bandwidth would give it: the
/// mean of what falls into an interval, or a value on the line between neighbours.
fn resampled(log: &[ImuSample], rate_hz: f64) -> Vec<ImuSample> {
    let interval_ns = (1e9 / rate_hz).round() as i64;
    let (first_ns, last_ns) = (log[0].t_ns, log[log.len() - 1].t_ns);
    let mix = |a: [f64; 3], b: [f64; 3], share: f64| std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
    let mut made = Vec::new();
    let mut t_ns = first_ns;
    while t_ns + interval_ns < last_ns {
        let from = log.partition_point(|sample| sample.t_ns < t_ns);
        let to = log.partition_point(|sample| sample.t_ns < t_ns + interval_ns);
        let mut sample = log[from];
        if to - from > 1 {
            for k in 1..to - from {
                let share = 1.0 / (k as f64 + 1.0);
                let next = &log[from + k];
                sample.w_ib_b_rad_s = mix(sample.w_ib_b_rad_s, next.w_ib_b_rad_s, share);
                sample.f_b_m_s2 = mix(sample.f_b_m_s2, next.f_b_m_s2, share);
            }
            sample.t_ns = (log[from].t_ns + log[to - 1].t_ns) / 2;
        } else if sample.t_ns > t_ns {
            let before = &log[from - 1];
            let share = (t_ns - before.t_ns) as f64 / (sample.t_ns - before.t_ns) as f64;
            sample.w_ib_b_rad_s = mix(before.w_ib_b_rad_s, sample.w_ib_b_rad_s, share);
            sample.f_b_m_s2 = mix(before.f_b_m_s2, sample.f_b_m_s2, share);
            sample.t_ns = t_ns;
        }
        made.push(sample);
        t_ns += interval_ns;
    }
    made
}

fn run(feet: &[(Side, &str)]) -> Told {
    let config =
        pedestrian::Config::default().session(&feet.iter().map(|(side, _)| *side).collect::<Vec<_>>());
    let mut logs = [Vec::new(), Vec::new()];
    for (foot, name) in feet {
        logs[foot.index()] = log(name);
    }
    Scenario { config, logs, visits: Vec::new(), truth: Vec::new() }.run()
}

#[test]
fn openshoe_loops_end_where_they_began() {
    for (name, plan_percent, height_m) in
        [("openshoe-gx2/loop_02.csv.gz", 0.4, 0.7), ("openshoe-gx2/loop_31.csv.gz", 0.5, 0.7)]
    {
        let told = run(&[(Side::Right, name)]);
        let closure = loop_closure(&told.track.points, told.summary.distance_m).expect("a walk");
        println!("{name}: {closure:?}");
        assert!((75.0..90.0).contains(&closure.path_m), "{name}: {closure:?}");
        assert!(closure.end_error_percent < plan_percent, "{name}: {closure:?}");
        assert!(closure.height_error_m.abs() < height_m, "{name}: {closure:?}");
    }
}

#[test]
fn a_foot_under_motion_capture_is_found_where_it_was() {
    let told = run(&[(Side::Right, "pyshoe-vicon/2017-11-22-11-25-20.csv.gz")]);
    let truth = truth_csv::read(&unpacked("pyshoe-vicon/2017-11-22-11-25-20.truth.csv.gz"));
    let truth = truth.expect("a truth file");
    let errors = motion_capture(&told.track.points, &truth).expect("track and truth share their time");
    println!("pyshoe-vicon: {errors:?}");
    assert!(errors.armse_m < 0.09, "{errors:?}");
    assert!(errors.mirrored, "the laboratory's frame is left-handed against that of the track");
}

/// Which contacts of a foot under motion capture were seen, and where the track was found.
fn under_motion_capture(name: &str) -> (StanceErrors, MotionCaptureErrors, f64) {
    let told = run(&[(Side::Right, &format!("pyshoe-vicon/{name}.csv.gz"))]);
    let truth = truth_csv::read(&unpacked(&format!("pyshoe-vicon/{name}.truth.csv.gz")));
    let truth = truth.expect("a truth file");
    let points = &told.track.points;
    let stands: Vec<(i64, bool)> = points
        .iter()
        .filter_map(|point| Some((point.t_ns, point.parts.iter().flatten().next()?.stance)))
        .collect();
    let contacts = stances(&foot_instants(&truth), &stands);
    let errors = motion_capture(points, &truth).expect("track and truth share their time");
    println!("{name}: {contacts:?} {errors:?} {:?}", told.summary);
    (contacts, errors, told.summary.distance_m)
}

#[test]
fn fast_and_jerky_steps_whose_contacts_are_never_quiet_are_followed() {
    let (contacts, errors, distance_m) = under_motion_capture("2017-11-27-11-12-44");
    assert!(contacts.contacts > 15 && contacts.missed <= 2, "{contacts:?}");
    assert_eq!(contacts.false_stances, 0, "{contacts:?}");
    assert!(errors.armse_m < 0.12, "{errors:?}");
    assert!(distance_m > 10.0, "{distance_m} m walked");
}

#[test]
fn a_foot_that_glides_evenly_is_not_taken_to_stand() {
    let (contacts, errors, _) = under_motion_capture("2018-02-09-11-19-39");
    assert!(contacts.false_stances <= 3, "{contacts:?}");
    assert!(errors.armse_m < 0.12, "{errors:?}");
}

#[test]
fn a_recording_at_another_rate_gives_much_the_same_track() {
    let name = "pyshoe-vicon/2017-11-22-11-25-20";
    let truth = truth_csv::read(&unpacked(&format!("{name}.truth.csv.gz"))).expect("a truth file");
    let recorded = log(&format!("{name}.csv.gz"));
    for rate_hz in [100.0, 200.0, 400.0, 820.0] {
        let config = pedestrian::Config::default().session(&[Side::Right]);
        let logs = [Vec::new(), resampled(&recorded, rate_hz)];
        let told = Scenario { config, logs, visits: Vec::new(), truth: Vec::new() }.run();
        let errors = motion_capture(&told.track.points, &truth).expect("track and truth share their time");
        println!("pyshoe-vicon at {rate_hz} Hz: {errors:?}");
        // At 100 Hz a heel strike falls between the samples: 0.105 m, 0.06 m at the other rates.
        let largest_m = if rate_hz < 150.0 { 0.13 } else { 0.08 };
        assert!(errors.armse_m < largest_m, "at {rate_hz} Hz: {errors:?}");
    }
}

#[test]
fn both_feet_go_up_the_stairs_together() {
    let told = run(&[
        (Side::Left, "gaitmap-feet/stair_up.left.csv.gz"),
        (Side::Right, "gaitmap-feet/stair_up.right.csv.gz"),
    ]);
    let apart = feet_apart(&told.track.points).expect("two feet");
    let climbed_m = told.last().position_n_m[2];
    println!("gaitmap-feet: {apart:?}, {climbed_m} m up, {:?}", told.summary);
    assert!(apart.at_end_m < 0.35 && apart.largest_m < 1.0, "{apart:?}");
    assert!((4.5..5.3).contains(&climbed_m), "{climbed_m} m up");
}
