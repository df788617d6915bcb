use super::*;
use crate::rotation::cayley;

fn wave(seed: f64) -> Vector3<f64> {
    Vector3::new(libm::sin(seed), libm::sin(2.3 * seed + 1.0), libm::cos(1.7 * seed))
}

/// A filter in the middle of a survey: nothing in it is zero.
fn filter() -> Filter {
    let nav = NavState {
        c_nb: cayley(&(wave(0.3) * 0.7)),
        v_n: wave(1.0),
        p_n: wave(2.0) * 3.0,
        gyro_bias_b: wave(3.0) * 1e-2,
        accelerometer_bias_b: wave(4.0) * 1e-1,
    };
    let certainty = Certainty { attitude: Matrix3::identity() * 1e-2, position_m: 0.1 };
    let (antenna, tip) = (Vector3::new(0.01, -0.02, 1.0), Vector3::new(0.02, 0.01, -0.98));
    let mut filter = Filter::new(&Tuning::default(), nav, &certainty, antenna, Some(tip));
    filter.phase = [wave(5.0) * 0.05, wave(6.0) * 0.05];
    filter.slow_n = wave(7.0) * 0.02;
    filter.roundness_m = 0.006;
    filter.place_n = wave(8.0);
    filter
}

/// Holds the Jacobians of a measurement against differences of its innovation.
fn assert_linearised(filter: &Filter, measure: impl Fn(&Filter) -> Observation<3>) {
    let observation = measure(filter);
    for block in 0..BLOCKS {
        let named = observation.jacobians().iter().filter(|(of, _)| *of == block);
        let told: Matrix3<f64> = named.map(|(_, jacobian)| *jacobian).sum();
        for axis in 0..3 {
            if [STATES.roundness, STATES.clock].iter().any(|of| of.block() == block) && axis > 0 {
                continue;
            }
            const STEP: f64 = 1e-5;
            let moved = |by: f64| {
                let mut filter = filter.clone();
                let mut correction = [Vector3::zeros(); BLOCKS];
                correction[block][axis] = by;
                filter.correct(&correction);
                measure(&filter).innovation
            };
            // What is taken off the state is taken off its error.
            let found = (moved(-STEP) - moved(STEP)) / (2.0 * STEP);
            let off = (found - told.column(axis)).norm();
            assert!(off < 1e-7, "block {block}, axis {axis}: {found} {}", told.column(axis));
        }
    }
}

#[test]
fn the_jacobian_of_a_tip_that_stands_is_its_derivative_by_every_error() {
    assert_linearised(&filter(), |filter| filter.stands([0.002, 0.001]).unwrap());
}

#[test]
fn the_jacobian_of_a_fix_is_its_derivative_by_every_error() {
    // By how much an error of the attitude moves the phase centre's own motion is left out: centimetres times that error.
    let mut still = filter();
    still.phase = [Vector3::zeros(); 2];
    let white = Vector3::repeat(0.005);
    assert_linearised(&still, |filter| filter.fix(&Vector3::new(0.1, 0.2, 0.3), &white, &wave(9.0)));
}

#[test]
fn a_tip_that_lands_is_where_the_filter_has_it_and_ties_nothing_to_the_past() {
    let mut filter = filter();
    filter.land();
    let observation = filter.stands([0.002, 0.001]).unwrap();
    assert!(observation.innovation.norm() < 1e-12);
    let before = filter.eskf.covariance.block(STATES.imu.block(Velocity), STATES.imu.block(Velocity));
    let (nis, used) = filter.weigh(&observation, 16.0);
    assert!(used && nis < 1e-9);
    let after = filter.eskf.covariance.block(STATES.imu.block(Velocity), STATES.imu.block(Velocity));
    assert!((before - after).norm() < 1e-4 * before.norm(), "{before} {after}");
}
