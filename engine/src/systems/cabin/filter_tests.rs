//! Jacobians and the growth of errors against differences of the filter itself.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::*;
use crate::systems::cabin::instrument::tests::example;
use crate::systems::cabin::legs::Seated;
use crate::systems::cabin::rows::{AntennaRow, EncoderRow, RayRow};

fn readings(k: i64) -> ImuRow {
    let t_s = k as f64 * 0.005;
    ImuRow {
        t_ns: k * 5_000_000,
        w_s: [0.02 * libm::sin(t_s), -0.015, 0.01 * libm::cos(2.0 * t_s)],
        f_s: [0.3 * libm::cos(t_s), -0.2, 9.8 + 0.1 * libm::sin(3.0 * t_s)],
    }
}

fn started() -> Filter {
    let start = Start {
        t_ns: 0,
        p_n: Vector3::new(10.0, -20.0, 145.0),
        v_n: Vector3::new(0.2, -0.1, 0.05),
        c_nb: cayley(&Vector3::new(0.08, -0.05, 0.7)),
        sigma_p_m: 0.05,
        sigma_v_m_s: 0.1,
        sigma_attitude_rad: 1e-3,
    };
    let mut filter = Filter::new(Rig::of_cabin(&example(), true), Tuning::OWN, [0.006, 0.008], &start, false);
    for k in 1..=40 {
        filter.advance(&readings(k));
    }
    for (t_ns, leg) in [(100_000_000, 2.131), (150_000_000, 2.133), (200_000_000, 2.135)] {
        let row = EncoderRow { t_ns, a_rad: 0.04, b_rad: -0.03, legs_m: [leg, 2.14, 2.12, 2.13, 2.15, 2.13] };
        assert_eq!(filter.encoders(&row), Seated::Taken);
    }
    filter.propagate();
    filter
}

/// Measured − predicted after an error of a state has been put right.
fn innovation(
    filter: &Filter,
    state: usize,
    by: f64,
    measure: &impl Fn(&Filter) -> Measured,
) -> Vector3<f64> {
    let mut moved = filter.clone();
    moved.dx[state] = by;
    moved.correct();
    measure(&moved).innovation
}

fn check(filter: &Filter, measure: impl Fn(&Filter) -> Measured, tolerance: f64) {
    let measured = measure(filter);
    for state in 0..filter.states.n {
        let by = match state {
            0..3 | 18..21 | 24..27 => 1e-5,
            9..18 => 0.0,
            _ => 1e-4,
        };
        if by == 0.0 {
            continue;
        }
        let [ahead, behind] = [by, -by].map(|by| innovation(filter, state, by, &measure));
        let found = (behind - ahead) / (2.0 * by);
        let told = (measured.jacobian.iter().filter(|(k, _)| *k == state))
            .fold(Vector3::zeros(), |sum, (_, h)| sum + Vector3::from(*h));
        assert!((found - told).norm() < tolerance * (1.0 + told.norm()), "state {state}: {found:?} {told:?}");
    }
}

#[test]
fn the_jacobians_of_an_antenna_and_of_a_ray_are_their_derivatives() {
    let filter = started();
    let antenna = AntennaRow {
        t_ns: 200_000_000,
        antenna: 2,
        position_n: [12.0, -15.0, 146.0],
        sigma_n: [0.006, 0.006, 0.008],
        quality: 4,
        velocity_n: None,
    };
    check(&filter, |filter| filter.measure_antenna(&antenna).unwrap(), 2e-3);
    for target in [1, 4] {
        let ray = RayRow {
            t_ns: 190_000_000,
            station: 1,
            target,
            azimuth_rad: 2.5,
            zenith_rad: 0.7,
            slant_m: 180.0,
        };
        check(&filter, |filter| filter.measure_ray(&ray).unwrap(), 2e-3);
    }
}

#[test]
fn an_error_of_the_strapdown_grows_as_its_covariance_says() {
    let filter = started();
    // By how much a small error of each state moves attitude, velocity and position within a second.
    for (state, by) in
        [(0, 1e-5), (2, 1e-5), (4, 1e-4), (8, 1e-2), (10, 1e-6), (12, 1e-3), (13, 1e-3), (17, 1e-4)]
    {
        let mut told = filter.clone();
        for k in 0..told.states.n {
            told.covariance.reset(k, 0.0);
            told.states.process[k].variance = 0.0;
            told.states.process[k].walk = 0.0;
        }
        told.rig.noise.angle_random_walk = 0.0;
        told.rig.noise.velocity_random_walk = 0.0;
        told.covariance.reset(state, by * by);
        let (mut plain, mut moved) = (filter.clone(), filter.clone());
        moved.dx[state] = by;
        moved.correct();
        for k in 41..=240 {
            for each in [&mut told, &mut plain, &mut moved] {
                each.advance(&readings(k));
            }
            if k % 10 == 0 {
                told.propagate();
            }
        }
        let turned =
            Rotation3::from_matrix_unchecked(moved.nav().c_nb * plain.nav().c_nb.transpose()).scaled_axis();
        let found = [turned, moved.nav().v_n - plain.nav().v_n, moved.nav().p_n - plain.nav().p_n];
        for (block, found) in found.iter().enumerate() {
            for axis in 0..3 {
                let k = 3 * block + axis;
                let sigma = told.covariance.row(k)[k].max(0.0).sqrt();
                let largest = found.norm().max(by * 1e-6);
                assert!(
                    (found[axis].abs() - sigma).abs() < 2e-2 * largest,
                    "state {state} on {k}: {} {sigma}",
                    found[axis]
                );
            }
        }
    }
}

#[test]
fn a_row_beyond_the_gate_changes_nothing_and_one_within_makes_the_pose_surer() {
    let mut filter = started();
    let before = filter.covariance.row(POSITION)[POSITION];
    let far = Measured {
        jacobian: (0..3).map(|axis| (POSITION + axis, unit(axis))).collect(),
        innovation: Vector3::new(5.0, 0.0, 0.0),
        noise: Matrix3::identity() * 1e-4,
    };
    assert!(!filter.weigh(&far, 30.0));
    assert_eq!(filter.covariance.row(POSITION)[POSITION], before);
    let near = Measured { innovation: Vector3::new(0.05, 0.0, 0.0), ..far };
    assert!(filter.weigh(&near, 30.0));
    assert!(filter.covariance.row(POSITION)[POSITION] < 0.1 * before);
    assert!(filter.dx[POSITION] > 0.04 && filter.dx[POSITION] < 0.05);
}

fn unit(axis: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 })
}
