//! Physics that a strapdown on a turning Earth has to show.

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::geo::gravity::normal_gravity_m_s2;
use lodestep_engine::ins::earth::Earth;
use lodestep_engine::ins::layout::{Layout, SensorStates};
use lodestep_engine::ins::strapdown::ImuInterval;
use nalgebra::{Rotation3, Vector3};

use super::motion::{Motion, SITE};

const STATES: SensorStates = Layout::of_strapdowns(1).without_scale_factors(0);

#[test]
fn a_perfect_sensor_in_swift_motion_is_followed_for_a_minute_to_half_a_millimetre() {
    let (frame, motion) = (LocalFrame::new(SITE), Motion::pole());
    let earth = Earth::turning(&frame);
    let mut strapdown = motion.start(STATES);
    let (mut apart_m, mut turned_rad) = (0.0_f64, 0.0_f64);
    for (k, interval) in motion.readings(&frame, 0.005, 12_000).iter().enumerate() {
        strapdown.advance(&earth, interval);
        let truth = motion.pose(0.005 * (k + 1) as f64);
        apart_m = apart_m.max((strapdown.nav.p_n - truth.p_n).norm());
        turned_rad = turned_rad.max((strapdown.nav.c_nb - truth.c_nb).norm());
    }
    assert!(apart_m < 5e-4, "{apart_m} m");
    assert!(turned_rad < 2e-7, "{turned_rad} rad");
}

#[test]
fn a_body_at_rest_stays_at_rest_for_an_hour() {
    let (frame, motion) = (LocalFrame::new(SITE), Motion::rest());
    let earth = Earth::turning(&frame);
    let reading = motion.readings(&frame, 0.01, 1)[0];
    let mut strapdown = motion.start(STATES);
    for _ in 0..360_000 {
        strapdown.advance(&earth, &reading);
    }
    let nav = &strapdown.nav;
    // Height is unstable: what gravity's own digits leave grows by e in 570 s.
    assert!(nav.p_n.norm() < 0.05 && nav.v_n.norm() < 1e-4, "{} {}", nav.p_n, nav.v_n);
    assert!((nav.c_nb - motion.pose(0.0).c_nb).norm() < 1e-9);
}

#[test]
fn a_gyro_at_rest_reads_earth_rate_and_one_that_reads_nothing_turns_back_by_it() {
    let (frame, motion) = (LocalFrame::new(SITE), Motion::rest());
    let reading = motion.readings(&frame, 1.0, 1)[0];
    assert!((reading.w_ib_b.norm().to_degrees() * 3600.0 - 15.041_067).abs() < 1e-5);
    // A body that keeps still among the stars turns westward against n, about the pole, 15.04° in an hour.
    let mut strapdown = motion.start(STATES);
    for _ in 0..3600 {
        let still = ImuInterval { w_ib_b: Vector3::zeros(), ..reading };
        strapdown.advance(&Earth::turning(&frame), &still);
    }
    let turn = Rotation3::from_matrix_unchecked(strapdown.nav.c_nb * motion.pose(0.0).c_nb.transpose());
    let latitude = SITE.latitude_deg.to_radians();
    let pole_n = Vector3::new(0.0, latitude.cos(), latitude.sin());
    assert!((turn.scaled_axis() + pole_n * 15.041_067_f64.to_radians()).norm() < 1e-8, "{turn}");
}

#[test]
fn a_wrong_velocity_swings_with_schuler_s_period_and_turns_as_foucault_s_pendulum() {
    let frame = LocalFrame::new(SITE);
    let (earth, motion) = (Earth::turning(&frame), Motion::rest());
    let reading = motion.readings(&frame, 1.0, 1)[0];
    let mut strapdown = motion.start(STATES);
    // Northward, at first.
    strapdown.nav.v_n = Vector3::new(0.0, 0.01, 0.0);
    let (mut t_s, mut last) = (0.0, strapdown.nav.clone());
    let mut crossings = Vec::new();
    while crossings.len() < 2 {
        last.clone_from(&strapdown.nav);
        strapdown.advance(&earth, &reading);
        t_s += 1.0;
        // The height is held, as in every free inertial system.
        strapdown.nav.p_n.z = 0.0;
        strapdown.nav.v_n.z = 0.0;
        // Back at the origin, between two steps: where the distance is least.
        let (before, after) = (last.p_n.dot(&last.v_n), strapdown.nav.p_n.dot(&strapdown.nav.v_n));
        if before < 0.0 && after >= 0.0 {
            crossings.push(t_s - after / (after - before));
        }
    }
    let latitude = SITE.latitude_deg.to_radians();
    let gravity_m_s2 = normal_gravity_m_s2(SITE.latitude_deg, 0.0);
    // The meridian's radius of curvature, as the swing is northward.
    let e2 = 0.006_694_379_990_14;
    let radius_m = 6_378_137.0 * (1.0 - e2) / (1.0 - e2 * latitude.sin().powi(2)).powf(1.5);
    let schuler_s = std::f64::consts::TAU * (radius_m / gravity_m_s2).sqrt();
    assert!((schuler_s / 60.0 - 84.3).abs() < 0.3, "the textbooks' 84.4 min");
    assert!((crossings[1] / schuler_s - 1.0).abs() < 1e-3, "{crossings:?} s, {schuler_s} s");
    // After a whole period it moves northward again, but for the turn of its plane: clockwise, ω sin φ.
    let turned_rad = last.v_n.x.atan2(last.v_n.y);
    let foucault_rad = earth.w_ie_n().z * crossings[1];
    assert!((turned_rad / foucault_rad - 1.0).abs() < 0.02, "{turned_rad} rad, {foucault_rad} rad");
}
