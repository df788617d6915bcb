//! What two feet know of each other: how near they pass, and how evenly a stride lies about the
//! standing foot.

use nalgebra::{Matrix2x3, RowVector3};
use serde::{Deserialize, Serialize};

use super::aids;
use super::filter::{Filter, GATE_1, GATE_2, Setting, seconds};
use super::foot_separation::{Beside, by_its_direction, foot_separation, stride_symmetry};
use super::slow_errors::{SEPARATION, surroundings, surroundings_row};
use super::swing::Following;
use crate::event::{AidOutcome, Event};
use crate::ins::layout::ErrorState;

/// Strides whose symmetry means something, m.
const SHORTEST_STRIDE_M: f64 = 0.7;
const LONGEST_STRIDE_M: f64 = 2.5;
/// At heel strike the other foot may have left the ground this long ago, s.
const JUST_LEFT_S: f64 = 0.25;

/// The moment at which a foot in its swing was nearest to the other. That it was, is known only when the
/// foot has passed: until then the error of the distance is set aside in the filter.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Passing {
    /// The swinging foot's sensor.
    sensor: usize,
    /// The distance across the swing at that moment, m.
    distance_m: f64,
}

impl<const B: usize, const F: usize> Filter<B, F> {
    pub(super) fn swing(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        if F < 2 || !setting.aids.separation || self.feet_out_of_step {
            return;
        }
        let other = &self.feet[1 - sensor];
        let (other_stands, other_p_n) = (other.stance.stands, other.nav.p_n);
        let foot = &mut self.feet[sensor];
        if !other_stands {
            return;
        }
        match foot.swing.follow(&foot.nav.p_n, &foot.nav.v_n, &other_p_n) {
            Following::Nothing => {}
            Following::Nearest => self.set_distance_aside(setting, sensor),
            Following::Passed => self.apply_separation(setting, sensor, told),
        }
    }

    /// Keeps the distance across the swing of this foot as it is now, with its error.
    fn set_distance_aside(&mut self, setting: &Setting, sensor: usize) {
        // The errors have to be those of the positions of now: what has not been brought into the covariance yet would
        // tell of the heading.
        self.propagate_all(setting);
        let [left_p_n, right_p_n] = [self.feet[0].nav.p_n, self.feet[1].nav.p_n];
        let beside = Beside::new(&left_p_n, &right_p_n, &self.feet[sensor].nav.v_n);
        self.passing = Some(Passing { sensor, distance_m: beside.distance_m });
        self.eskf.set_aside(&[
            (ErrorState::Position.of(0), beside.to_left_n),
            (ErrorState::Position.of(1), -beside.to_left_n),
            (ErrorState::Attitude.of(sensor), by_its_direction(&beside.to_left_n, &(left_p_n - right_p_n))),
        ]);
    }

    /// This foot has passed the other: at the moment set aside their distance was the separation.
    pub(super) fn apply_separation(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let passing = self.passing.take().filter(|passing| passing.sensor == sensor);
        let (Some(passing), Some(corrected_m)) = (passing, self.eskf.corrected_aside()) else { return };
        let tuning = &setting.tuning;
        let observation = foot_separation(
            passing.distance_m - corrected_m,
            tuning.separation_m + self.slow.surroundings[SEPARATION],
            tuning.separation_sigma_m,
        )
        .with(surroundings(F), surroundings_row(SEPARATION, 1.0));
        let update = self.eskf.update_aside(&observation, GATE_1);
        if let Some(correction) = &update.correction {
            self.correct(correction);
        }
        told.push(Event::Aid(AidOutcome {
            t_ns: self.feet[sensor].t_ns,
            stream: None,
            aid: aids::SEPARATION,
            nis: update.nis,
            degrees_of_freedom: 1,
            updates: 1,
            accepted: update.correction.is_some(),
        }));
    }

    /// The stride that this foot has just made lies evenly about the other foot.
    pub(super) fn apply_symmetry(&mut self, setting: &Setting, sensor: usize) {
        let foot = &self.feet[sensor];
        let (from_p_n, to_p_n) = (*foot.swing.start_p_n(), foot.nav.p_n);
        let length_m = (to_p_n - from_p_n).xy().norm();
        if !foot.swing.has_begun() || !(SHORTEST_STRIDE_M..LONGEST_STRIDE_M).contains(&length_m) {
            return;
        }
        let other = &self.feet[1 - sensor];
        // At heel strike the other may be about to leave the ground: where it stood is meant.
        let standing_p_n = if other.stance.stands { other.nav.p_n } else { *other.swing.start_p_n() };
        let just_left = seconds(foot.t_ns - other.swing.begun_ns()) < JUST_LEFT_S;
        let stood_just_now = other.stance.stands || (other.swing.has_begun() && just_left);
        if !stood_just_now {
            return;
        }
        self.propagate_all(setting);
        let sigma_along_m = setting.tuning.symmetry_share * length_m;
        let observation = stride_symmetry(
            sensor,
            1 - sensor,
            &from_p_n,
            &to_p_n,
            &standing_p_n,
            sigma_along_m,
            setting.tuning.symmetry_sigma_up_m,
        );
        let stride_n = to_p_n - from_p_n;
        let along_n = RowVector3::new(stride_n.x, stride_n.y, 0.0) / length_m;
        // The errors are those of where both feet are now.
        let turned = by_its_direction(&along_n, &(to_p_n - self.feet[1 - sensor].nav.p_n));
        let observation = observation
            .with(ErrorState::Attitude.of(sensor), Matrix2x3::from_rows(&[turned, RowVector3::zeros()]));
        self.update(&observation, GATE_2);
    }
}
