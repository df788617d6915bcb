//! What two feet know of each other: how near they pass, and how evenly a stride lies about the
//! standing foot.

use super::filter::{Demand, Filter, GATE_1, GATE_2, Setting, seconds};
use super::slow_errors::{SEPARATION, surroundings, surroundings_row};
use crate::detect::swing::Following;
use crate::event::{AidKind, AidOutcome, Event};
use crate::measure::foot_separation::{foot_separation, stride_symmetry};

/// Strides whose symmetry means something, m.
const SHORTEST_STRIDE_M: f64 = 0.7;
const LONGEST_STRIDE_M: f64 = 2.5;
/// At heel strike the other foot may have left the ground this long ago, s.
const JUST_LEFT_S: f64 = 0.25;

impl<const B: usize, const F: usize> Filter<B, F> {
    pub(super) fn swing(&mut self, setting: &Setting, sensor: usize) -> Demand {
        if F < 2 || !setting.aids.separation {
            return Demand::None;
        }
        let other = &self.feet[1 - sensor];
        let (other_stands, other_p_n) = (other.stance.stands, other.nav.p_n);
        let foot = &mut self.feet[sensor];
        if !other_stands {
            return Demand::None;
        }
        match foot.swing.follow(&foot.nav.p_n, &foot.nav.v_n, &other_p_n) {
            Following::Nothing => Demand::None,
            Following::Nearest => Demand::Remember { sensor },
            Following::Passed => Demand::GoBack { sensor },
        }
    }

    /// The separation of the feet, at the moment that `self` is a memory of.
    pub(crate) fn apply_separation(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        self.propagate_all(setting);
        let tuning = &setting.tuning;
        let along_n = *self.feet[sensor].swing.velocity_then_n();
        let observation = foot_separation(
            &self.feet[0].nav.p_n,
            &self.feet[1].nav.p_n,
            &along_n,
            tuning.separation_m + self.slow.surroundings[SEPARATION],
            tuning.separation_sigma_m,
        )
        .with(surroundings(F), surroundings_row(SEPARATION, 1.0));
        let (nis, accepted) = self.update(&observation, GATE_1);
        self.feet[sensor].swing.mark_used();
        told.push(Event::Aid(AidOutcome {
            t_ns: self.feet[sensor].t_ns,
            foot: None,
            aid: AidKind::Separation,
            nis,
            degrees_of_freedom: 1,
            updates: 1,
            accepted,
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
        self.update(&observation, GATE_2);
    }
}
