//! The door and a walk behind it: smoothing again, and looks inside.

use crate::event::{Part, TrackPoint};
use crate::geo::Site;
use crate::session::{Session, SessionConfig, Solution};
use crate::sim::pedestrian::{SensorModel, WalkKind, simulate};
use crate::systems::pedestrian::system::{Filters, Pedestrian};
use crate::systems::pedestrian::{self, Side};
use crate::track::{self, Track};
use crate::visit::Visit;

/// Three minutes of the spiral, smoothed; with one of its visits told 20 s late.
fn smoothed(run_again: bool) -> Track {
    let site = Site::fast();
    let walk = simulate(&WalkKind::Spiral, 1, &site, &SensorModel::cmp10a());
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        solution: Solution::Smoothed,
        ..pedestrian::two_feet()
    };
    let (mut session, mut events) = (Session::new(config).unwrap(), Vec::new());
    let mut visits = walk.visits.iter();
    let mut next = visits.next();
    for (left, right) in walk.left.iter().zip(&walk.right).take(26_000) {
        session.push(Side::Left, left, &mut events);
        session.push(Side::Right, right, &mut events);
        if let Some(visit) = next.filter(|visit| left.t_ns > visit.t_end_ns + 20_000_000_000) {
            let [e, n, u] = visit.position_n_m;
            session.visit(
                Visit {
                    marker: visit.marker.clone(),
                    t_start_ns: visit.t_start_ns,
                    t_end_ns: visit.t_end_ns,
                    position_n_m: (e, n, Some(u)),
                },
                &mut events,
            );
            next = visits.next();
        }
    }
    session.finish_filter(&mut events);
    let walk: &mut Pedestrian = session.system.as_any().unwrap().downcast_mut().unwrap();
    if run_again && let Filters::TwoFeet(history) = walk.filters() {
        history.forget_recordings();
    }
    while session.smooth_next(&mut events) {}
    let mut track = Track::default();
    events.into_iter().for_each(|event| track.take(event));
    assert!(track.visits.iter().any(|visit| visit.accepted));
    assert!(track.revised_points >= track.points.len() as u64);
    track
}

#[test]
fn stretches_that_are_run_again_give_the_same_smoothed_track_to_the_bit() {
    assert_eq!(smoothed(false).sha256(), smoothed(true).sha256());
}

#[test]
fn a_look_inside_tells_biases_with_sigmas_and_the_field_s_heading_and_changes_nothing() {
    let site = Site::fast();
    let walk = simulate(&WalkKind::Line { metres: 20.0 }, 1, &site, &SensorModel::cmp10a());
    let config = SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        ..pedestrian::two_feet()
    };
    let (mut looked_at, mut left_alone) =
        (Session::new(config.clone()).unwrap(), Session::new(config).unwrap());
    let (mut told, mut same) = (Vec::new(), Vec::new());
    let (mut headings, mut last) = (0, Vec::new());
    assert!(looked_at.sensors().is_empty());
    for (left, right) in walk.left.iter().zip(&walk.right) {
        for (foot, sample) in [(Side::Left, left), (Side::Right, right)] {
            looked_at.push(foot, sample, &mut told);
            left_alone.push(foot, sample, &mut same);
        }
        let sensors = looked_at.sensors();
        let fields = sensors.iter().filter_map(|sensor| sensor.magnetic_minus_heading_rad);
        headings += fields.inspect(|off_rad| assert!(off_rad.abs() < 0.5, "{off_rad}")).count();
        if !sensors.is_empty() {
            last = sensors;
        }
    }
    assert_eq!(told, same);
    assert!(headings > 100, "{headings}");
    assert_eq!(last.iter().map(|sensor| sensor.stream).collect::<Vec<_>>(), pedestrian::BOTH);
    for sensor in last {
        for (bias, sigma) in sensor.gyro_bias_b_rad_s.iter().zip(sensor.sigma_gyro_bias_rad_s) {
            assert!(sigma > 0.0 && sigma < 0.02 && bias.abs() < 0.1, "{bias} ± {sigma} rad/s");
        }
        let forces = sensor.accelerometer_bias_b_m_s2.iter().zip(sensor.sigma_accelerometer_bias_m_s2);
        for (bias, sigma) in forces {
            assert!(sigma > 0.0 && sigma <= 0.08 && bias.abs() < 0.5, "{bias} ± {sigma} m/s²");
        }
    }
}

#[test]
fn a_foot_that_is_missing_is_empty_fields_in_the_track_s_csv() {
    let point = TrackPoint {
        t_ns: 1_250_000_000,
        position_n_m: [1.0, -2.5, 0.1],
        heading_rad: 0.3,
        sigma_heading_rad: 0.01,
        sigma_n_m: [0.1, 0.2, 0.3],
        covariance_en_m2: 0.001,
        tilt: None,
        parts: [None, Some(Part { position_n_m: [1.1, -2.4, 0.0], stance: true })],
    };
    let mut out = Vec::new();
    track::csv::write(&pedestrian::DECLARATION, &[point], &mut out).unwrap();
    assert_eq!(
        String::from_utf8(out).unwrap(),
        "t_s,e_m,n_m,u_m,heading_rad,sigma_e_m,sigma_n_m,sigma_u_m,left_e_m,left_n_m,left_u_m,\
         right_e_m,right_n_m,right_u_m,left_stance,right_stance\n\
         1.25,1,-2.5,0.1,0.3,0.1,0.2,0.3,,,,1.1,-2.4,0,,1\n"
    );
}
