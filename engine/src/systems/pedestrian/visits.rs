//! A visit to a marker: weighed in plan and height, believed or turned down with a reason.

use nalgebra::Vector3;

use super::filter::{Filter, Setting};
use super::north::Sought;
use crate::event::{Event, VisitOutcome};
use crate::ins::layout::ErrorState;
use crate::measure::marker_position::marker_position;
use crate::rotation::heading;
use crate::visit::Visit;

/// A visit is turned down beyond this: one in ten million of three normal squares.
const GATE_VISIT: f64 = 35.0;

impl<const B: usize, const F: usize> Filter<B, F> {
    /// A visit, applied to the feet as they are now.
    pub(crate) fn apply_visit(
        &mut self,
        setting: &Setting,
        visit: &Visit,
        t_ns: i64,
        told: &mut Vec<Event>,
    ) -> VisitOutcome {
        self.propagate_all(setting);
        let (east_m, north_m, up_m) = visit.position_n_m;
        let marker_n_m = Vector3::new(east_m, north_m, up_m.unwrap_or_default());
        let untouched = self.middle_p_n();
        let sought = self.seek_north(setting, t_ns, &marker_n_m, told);
        let heading_before_rad = heading(&self.feet[0].nav.c_nb);
        if matches!(sought, Sought::Weigh) {
            self.take_in_beyond();
        }
        let middle = self.middle_p_n();
        let marker_n_m = Vector3::new(east_m, north_m, up_m.unwrap_or(middle.z));
        let sigma = setting.tuning.marker_sigma_m;
        // A height that was never surveyed is measured with a sigma that says nothing; and as height
        // drifts by scale errors that are no state, it weighs less the more it is off, so that it
        // never turns a visit down that is right in plan.
        let sigma_up = if up_m.is_some() { sigma.max((middle.z - marker_n_m.z).abs() / 4.0) } else { 1e4 };
        let sigma_m = Vector3::new(sigma, sigma, sigma_up);
        let positions: Vec<(usize, Vector3<f64>)> =
            self.present().map(|sensor| (sensor, self.feet[sensor].nav.p_n)).collect();
        let before = untouched - marker_n_m;
        let mut outcome = VisitOutcome {
            marker: visit.marker.clone(),
            t_ns,
            before_minus_marker_n_m: before.into(),
            after_minus_marker_n_m: before.into(),
            nis: 0.0,
            degrees_of_freedom: if up_m.is_some() { 3 } else { 2 },
            accepted: false,
            reason: String::new(),
        };
        if let Sought::Refuse(reason) = sought {
            let (covariance, _) = self.told_covariance();
            let variance = 0.5 * (covariance[(0, 0)] + covariance[(1, 1)]) + sigma * sigma;
            outcome.nis = before.xy().norm_squared() / variance;
            outcome.reason = reason;
            self.note_for_north(heading_before_rad);
            return outcome;
        }
        let before = middle - marker_n_m;
        let observation = marker_position(&positions, &marker_n_m, &sigma_m);
        let (nis, accepted) = self.update(&observation, GATE_VISIT);
        outcome.nis = nis;
        outcome.accepted = accepted;
        // Two visits in a row that both say the same of the track outweigh the track.
        if !accepted
            && self.turned_down.is_some_and(|last| (last - before).norm() < 5.0 + 0.3 * before.norm())
        {
            self.widen_position(&before);
            outcome.accepted = self.update(&observation, f64::INFINITY).1;
        }
        self.turned_down = (!outcome.accepted).then_some(before);
        self.beyond_is_here();
        if outcome.accepted {
            self.last_sure_place_n = self.middle_p_n();
            self.last_marker = (t_ns, self.walked.distance_m(F));
        } else {
            outcome.reason = format!(
                "{:.1} m from the marker in plan, where the track is sure to {:.1} m (1σ): a wrong marker, or a track that has gone astray; a second visit that says the same will be believed",
                before.xy().norm(),
                self.sigma_plan_m()
            );
        }
        self.note_for_north(heading_before_rad);
        outcome.after_minus_marker_n_m = (self.middle_p_n() - marker_n_m).into();
        outcome
    }

    /// Adds to the position's uncertainty, the same for all feet, so that an error `by` is nothing
    /// special any more.
    pub(super) fn widen_position(&mut self, by: &Vector3<f64>) {
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        self.eskf.add_noise(&positions, &Vector3::repeat(by.norm_squared()));
    }
}
