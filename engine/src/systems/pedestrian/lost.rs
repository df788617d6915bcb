//! A foot of which nothing is known for a while, and how it is found again.

use nalgebra::{Matrix3, Vector3};

use super::filter::{Filter, Setting};
use super::foot::Step;
use crate::ins::error_model::Transition;
use crate::ins::layout::ErrorState;
use crate::rotation::{heading, level};

/// How fast a foot may have moved on the mean while nothing was known of it, m/s.
const UNKNOWN_SPEED_M_S: f64 = 1.5;

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
        let covariance = &mut self.eskf.covariance;
        let way_m = UNKNOWN_SPEED_M_S * dt_s;
        let height_m = 0.2 * dt_s;
        covariance.isolate(
            ErrorState::Velocity.of(sensor),
            Matrix3::identity() * (UNKNOWN_SPEED_M_S * UNKNOWN_SPEED_M_S),
        );
        let turn = (0.3 * dt_s).min(1.0);
        let heading_variance =
            covariance.block(ErrorState::Attitude.of(sensor), ErrorState::Attitude.of(sensor))[(2, 2)];
        covariance.isolate(
            ErrorState::Attitude.of(sensor),
            Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, heading_variance + turn * turn)),
        );
        let position = covariance.upper_mut(ErrorState::Position.of(sensor), ErrorState::Position.of(sensor));
        position[(0, 0)] += way_m * way_m;
        position[(1, 1)] += way_m * way_m;
        position[(2, 2)] += height_m * height_m;
    }

    /// Levels a foot that was lost by its specific force in the first sample of a stance.
    pub(super) fn find_level(&mut self, step: &Step) {
        let foot = &mut self.feet[step.sensor];
        foot.nav.c_nb = level(&(step.f_b - foot.nav.accelerometer_bias_b), heading(&foot.nav.c_nb));
        foot.nav.v_n = Vector3::zeros();
        foot.lost = false;
    }
}
