//! The run's motion belongs together, and its devices show it.

use nalgebra::Vector3;

use super::super::motion::tests::largest_inconsistency;
use super::*;

fn short() -> RunPlan {
    RunPlan { hold_s: 10.0, slew_s: 20.0, track_s: 10.0, ..RunPlan::default() }
}

#[test]
fn positions_and_their_derivatives_belong_together_for_cabin_and_platform() {
    for seed in 0..3 {
        let (plan, geometry) = (short(), Geometry::drawn(seed));
        let course = Course::drawn(&plan, &geometry, seed);
        for k in 0..39 {
            let t_s = 0.7 + f64::from(k);
            let cabin = largest_inconsistency(|t_s| course.at_time(t_s, true).cabin, t_s);
            let platform = largest_inconsistency(|t_s| course.at_time(t_s, true).platform, t_s);
            assert!(cabin < 1e-5 && platform < 1e-5, "seed {seed} at {t_s} s: {cabin} {platform}");
        }
    }
}

#[test]
fn a_run_repeats_and_another_seed_is_another_world() {
    let (once, again, other) = (simulate(&short(), 4), simulate(&short(), 4), simulate(&short(), 5));
    assert_eq!(once, again);
    assert_ne!(once.instrument, other.instrument);
    assert_eq!(once.imu.len(), 8000);
    assert_eq!(once.truth.len(), 801);
    assert!(once.antennas.len() > 4500 && once.stations.len() > 1000 && once.encoders.len() == 801);
}

#[test]
fn fixes_and_rays_are_about_the_truth_at_their_moment_and_faults_are_where_they_should_be() {
    let faults = vec!["fog@20..25".parse().unwrap(), "wrong_fix.2@12..14".parse().unwrap()];
    let run = simulate(&RunPlan { faults, ..short() }, 1);
    let geometry = Geometry::drawn(1);
    let course = Course::drawn(&short(), &geometry, 1);
    for row in &run.antennas {
        let t_s = row.t_ns as f64 * 1e-9 - geometry.delay_s[row.antenna % 2];
        if row.quality == 5 || t_s < 0.0 {
            continue;
        }
        let place =
            course.at_time(t_s, true).cabin.at_lever_arm(&geometry.antennas_b[row.antenna]).position_n_m;
        let off = (Vector3::from(row.position_n_m) - place).norm();
        let tag_s = row.t_ns as f64 * 1e-9;
        let wrong = row.antenna == 2 && (12.0..14.0).contains(&tag_s);
        assert!(off < if wrong { 0.26 } else { 0.04 } && (!wrong || off > 0.02), "{off} m at {tag_s} s");
    }
    assert!(run.stations.iter().all(|ray| !(20.1..25.0).contains(&(ray.t_ns as f64 * 1e-9))));
}

#[test]
fn faults_are_read_as_they_are_written() {
    for text in ["fog@100..400", "wrong_fix.3@5..6.5", "late_make.1@0..900"] {
        assert_eq!(text.parse::<Fault>().unwrap().to_string(), text);
    }
    for wrong in ["fog", "fog@3", "fog@4..3", "rain@1..2", "wrong_fix.x@1..2", "fog@a..b"] {
        assert!(wrong.parse::<Fault>().unwrap_err().contains("wrong_fix.2@300..320"), "{wrong}");
    }
}
