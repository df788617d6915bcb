//! A foot of which nothing is known for a while, and how it is found again.

use nalgebra::{Matrix3, Vector3};

use super::filter::{Filter, Setting, seconds};
use super::foot::Step;
use crate::ins::error_model::Transition;
use crate::ins::layout::ErrorState;
use crate::rotation::{heading, level};

/// How fast a foot may have moved on the mean while nothing was known of it, m/s.
const UNKNOWN_SPEED_M_S: f64 = 1.5;
/// Nobody has gone farther than this meanwhile, m: a time stamp of another year must not make the
/// covariance so large that the first marker cancels it to nothing.
const FARTHEST_M: f64 = 5_000.0;
/// How far apart two feet are on the way, sigma in plan, m.
const WITHIN_A_STEP_M: f64 = 0.6;
/// And upwards, m.
const WITHIN_A_STAIR_M: f64 = 0.25;

impl<const B: usize, const F: usize> Filter<B, F> {
    /// Nothing is known of this foot for `dt_s`: it may be anywhere near, at any attitude.
    pub(super) fn lose(&mut self, setting: &Setting, sensor: usize, dt_s: f64) {
        if self.feet[sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, sensor);
        }
        let foot = &mut self.feet[sensor];
        foot.nav.v_n = Vector3::zeros();
        foot.transition = Transition::none();
        foot.lost = true;
        foot.stance.stands = false;
        foot.swing = Default::default();
        let way_m = (UNKNOWN_SPEED_M_S * dt_s).min(FARTHEST_M);
        let height_m = (0.2 * dt_s).min(FARTHEST_M);
        self.eskf.isolate(
            ErrorState::Velocity.of(sensor),
            Matrix3::identity() * (UNKNOWN_SPEED_M_S * UNKNOWN_SPEED_M_S),
        );
        let turn = (0.3 * dt_s).min(1.0);
        let attitude = ErrorState::Attitude.of(sensor);
        let heading_variance = self.eskf.covariance.block(attitude, attitude)[(2, 2)];
        self.eskf.isolate(
            attitude,
            Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, heading_variance + turn * turn)),
        );
        if way_m > WITHIN_A_STEP_M && self.other_keeps_up(sensor, dt_s) {
            self.place_beside_the_other(sensor);
            return;
        }
        let by_axis = Vector3::new(way_m * way_m, way_m * way_m, height_m * height_m);
        self.eskf.add_noise(&[ErrorState::Position.of(sensor)], &by_axis);
    }

    /// Whether the other foot has been followed all the while that this one was not.
    fn other_keeps_up(&self, sensor: usize, dt_s: f64) -> bool {
        F == 2 && dt_s - seconds(self.feet[1 - sensor].t_ns - self.feet[sensor].t_ns) < 0.1
    }

    /// A foot that comes back is within a step of the other, wherever it was lost.
    fn place_beside_the_other(&mut self, sensor: usize) {
        let other = 1 - sensor;
        self.feet[sensor].nav.p_n = self.feet[other].nav.p_n;
        let (own, its) = (ErrorState::Position.of(sensor), ErrorState::Position.of(other));
        let (along, up) = (WITHIN_A_STEP_M * WITHIN_A_STEP_M, WITHIN_A_STAIR_M * WITHIN_A_STAIR_M);
        self.eskf.copy(its, own, &Vector3::new(along, along, up));
    }

    /// Levels a foot that was lost by its specific force in the first sample of a stance.
    pub(super) fn find_level(&mut self, step: &Step) {
        let foot = &mut self.feet[step.sensor];
        foot.nav.c_nb = level(&(step.f_b - foot.nav.accelerometer_bias_b), heading(&foot.nav.c_nb));
        foot.nav.v_n = Vector3::zeros();
        foot.lost = false;
        // What was put in their place has nothing to do with the errors that were there.
        for state in [ErrorState::Attitude, ErrorState::Velocity] {
            let block = state.of(step.sensor);
            self.eskf.isolate(block, self.eskf.covariance.block(block, block));
        }
    }
}
