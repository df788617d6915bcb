//! North from the markers. Where nothing says how a walk is turned, its shape is known all the same: two places of it
//! that are known, some metres apart, give the turn.
//!
//! An error filter cannot learn an angle of which nothing is known, as it is linear. So the turn is found in closed form:
//! it is the one that lays the walk, as the strapdowns have it, upon its known places (the start and the markers), by
//! least squares in the plane. The whole state is turned by it about the last known place, the heading is given a
//! variance that says next to nothing, and the visit is then weighed as any other: so it is correlated with everything as it
//! should be, and nothing counts twice.
//!
//! Two places fit by a turn whenever their distance is right. So known places are kept, and at each visit it is asked anew which
//! turn most of them agree on: three outvote two, and where it stands one against one, the turn is unknown again.

use nalgebra::{Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::contradictions::Contradiction;
use super::filter::{Filter, Setting};
use super::known_places::{
    Agreement, Anchor, SURE_RAD, agreement_about, apart_m2, are_mirrored, distance_fits, most_agree, turned,
};
use super::slow_errors::Slow;
use crate::anomaly::Cause;
use crate::event::Event;
use crate::ins::layout::ErrorState;
use crate::rotation::{heading, skew, wrap};

/// The heading is left so much less sure than the known places make it, so that these, weighed after it, count once.
const OPEN: f64 = 4.0;
/// And so sure at most, and at least, rad.
const OPEN_RAD: (f64, f64) = (0.03, 0.5);
/// So many known places are kept: the first and the newest.
const MOST_ANCHORS: usize = 12;
/// A magnetometer that is contradicted by more than this is left out from there on, rad.
const FIELD_WRONG_RAD: f64 = 0.35;

/// What is known of how a walk is turned, while that is not known from the start.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct North {
    anchors: Vec<Anchor>,
    /// Where the walk is now without what visits have corrected, m; where the track was after the last of them, m, and its
    /// variance on each axis, m².
    walked_n: Vector2<f64>,
    last_n: Vector2<f64>,
    last_m2: f64,
    /// By how much the track is turned against the walk, counterclockwise seen from above, rad.
    turned_rad: f64,
    /// Sigma of the turn that was found, rad; `None` while there is none.
    sigma_rad: Option<f64>,
    /// How often it has been found, or lost.
    turns: u32,
    /// Moments of the visits that contradict the others, ns.
    refused_ns: Vec<i64>,
    /// All is known that the session has to say: the walk is run again.
    settled: bool,
    /// No turn will do, as the walk or its places are mirrored.
    mirrored: bool,
}

/// The turn about the vertical, counterclockwise seen from above.
fn about_up(rad: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(rad);
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}

impl North {
    /// Nothing says how the walk is turned, which is at `place_n`, known by this variance on each axis, m².
    fn unknown(t_ns: i64, place_n: Vector2<f64>, variance_m2: f64) -> North {
        North {
            anchors: vec![Anchor { t_ns, walked_n: Vector2::zeros(), place_n, variance_m2, grown_m2: 0.0 }],
            walked_n: Vector2::zeros(),
            last_n: place_n,
            last_m2: variance_m2,
            turned_rad: 0.0,
            sigma_rad: None,
            turns: 0,
            refused_ns: Vec::new(),
            settled: false,
            mirrored: false,
        }
    }

    /// Takes a visit among the known places; the track is at `middle_n` with this variance on each axis, m².
    fn take(&mut self, middle_n: Vector2<f64>, plan_m2: f64, t_ns: i64, place_n: Vector2<f64>, sigma_m: f64) {
        self.walked_n += turned(-self.turned_rad, &(middle_n - self.last_n));
        if self.anchors.len() == MOST_ANCHORS {
            let gone = self.anchors.remove(1);
            self.anchors[1].grown_m2 += gone.grown_m2;
        }
        let grown_m2 = (plan_m2 - self.last_m2).max(0.0);
        let variance_m2 = sigma_m * sigma_m;
        self.anchors.push(Anchor { t_ns, walked_n: self.walked_n, place_n, variance_m2, grown_m2 });
    }

    /// The places that agree with the turn as it is.
    fn present_agreement(&self) -> Option<Agreement> {
        let sigma_rad = self.sigma_rad?;
        (0..self.anchors.len())
            .map(|pivot| agreement_about(&self.anchors, pivot, self.turned_rad, sigma_rad))
            .max_by(|a, b| a.count().cmp(&b.count()).then(b.off.total_cmp(&a.off)))
    }

    /// Visits at other places than these are not used in hindsight.
    fn refuse_all_but(&mut self, members: &[bool]) {
        let is_member = |k: usize| members.get(k).copied().unwrap_or(false);
        self.refused_ns =
            (1..self.anchors.len()).filter(|k| !is_member(*k)).map(|k| self.anchors[k].t_ns).collect();
    }
}

/// What is to be done with a visit.
pub(super) enum Sought {
    /// It is weighed as any other.
    Weigh,
    /// It is turned down, for this reason.
    Refuse(String),
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// Nothing says how what was walked since `place_n` is turned.
    pub(super) fn lose_north(&mut self, place_n: Vector3<f64>, variance_m2: f64) {
        self.beyond.lose_north(place_n);
        let t_ns = self.last_marker.0;
        self.north.get_or_insert_with(|| Box::new(North::unknown(t_ns, place_n.xy(), variance_m2)));
    }

    /// A visit at `t_ns` to a marker at `marker_n_m`, before it is weighed: what it says of how the walk is turned. The
    /// state is turned where that is told.
    pub(super) fn seek_north(
        &mut self,
        setting: &Setting,
        t_ns: i64,
        marker_n_m: &Vector3<f64>,
        told: &mut Vec<Event>,
    ) -> Sought {
        let Some(mut north) = self.north.take() else { return Sought::Weigh };
        let sought = self.seek(&mut north, setting, t_ns, marker_n_m, told);
        self.north = Some(north);
        sought
    }

    fn seek(
        &mut self,
        north: &mut North,
        setting: &Setting,
        t_ns: i64,
        marker_n_m: &Vector3<f64>,
        told: &mut Vec<Event>,
    ) -> Sought {
        if north.refused_ns.contains(&t_ns) {
            return Sought::Refuse("it contradicts the other markers".to_owned());
        }
        if north.settled || north.mirrored {
            return Sought::Weigh;
        }
        let middle_n = self.middle_p_n();
        let plan_m2 = self.own_plan_m2();
        north.take(middle_n.xy(), plan_m2, t_ns, marker_n_m.xy(), setting.tuning.marker_sigma_m);
        let new = north.anchors.len() - 1;
        if are_mirrored(&north.anchors) {
            north.mirrored = true;
            told.push(self.said(t_ns, Contradiction::MarkersMirrored { markers: new as u32 }));
            self.give_up_north(north, middle_n.z);
            return Sought::Weigh;
        }
        if let Some(present) = north.present_agreement() {
            let best = most_agree(&north.anchors, None);
            if let Some(best) = best.filter(|best| best.count() > present.count().max(2)) {
                let other = wrap(best.turn_rad - north.turned_rad);
                told.push(self.said(t_ns, Contradiction::MarkersTurned { off_deg: other.to_degrees() }));
                self.turn_to(north, setting, &best, t_ns);
                return if best.members[new] { Sought::Weigh } else { refused() };
            }
            let own = most_agree(&north.anchors, Some(new));
            if !present.members[new]
                && let Some(own) = own.filter(|own| own.count() == present.count())
            {
                let off_deg = wrap(own.turn_rad - north.turned_rad).to_degrees();
                told.push(self.said(t_ns, Contradiction::MarkersDisagree { off_deg }));
                self.give_up_north(north, middle_n.z);
                // Which of them is wrong is not known: in hindsight neither is used.
                north.refuse_all_but(&[]);
                return Sought::Refuse(format!(
                    "by it the walk is turned by {off_deg:.0}° against what another marker says: one of them is wrong, and a third will tell"
                ));
            }
            return Sought::Weigh;
        }
        let best = most_agree(&north.anchors, Some(new)).filter(|best| best.sigma_rad <= SURE_RAD);
        // Where it stands one against one, nothing is decided.
        let disputed = north.turns > 0 && best.as_ref().is_some_and(|best| best.count() < 3);
        if let Some(best) = best.filter(|_| !disputed) {
            self.turn_to(north, setting, &best, t_ns);
            return Sought::Weigh;
        }
        if disputed || !(0..new).any(|other| distance_fits(&north.anchors, other, new)) {
            return refused();
        }
        Sought::Weigh
    }

    fn said(&self, t_ns: i64, cause: Contradiction) -> Event {
        Event::Anomaly(cause.anomaly(None, [self.last_marker.0.min(t_ns), t_ns], 0))
    }

    /// What was found does not hold: the walk may go any way from its start.
    fn give_up_north(&mut self, north: &mut North, up_m: f64) {
        north.sigma_rad = None;
        north.turns += 1;
        let start_n = north.anchors[0].place_n;
        self.beyond.lose_north(Vector3::new(start_n.x, start_n.y, up_m));
    }

    /// The whole state is turned to what most known places agree on; the newest of them is where it is now.
    fn turn_to(&mut self, north: &mut North, setting: &Setting, found: &Agreement, t_ns: i64) {
        let by_rad = wrap(found.turn_rad - north.turned_rad);
        let open_rad = (OPEN * found.sigma_rad).clamp(OPEN_RAD.0, OPEN_RAD.1);
        let about_n = Vector3::new(north.last_n.x, north.last_n.y, 0.0);
        self.turn(setting, by_rad, open_rad, &about_n);
        if by_rad.abs() > FIELD_WRONG_RAD {
            for foot in self.feet.iter_mut().filter(|foot| foot.usual_field_ut.is_some()) {
                foot.doubts.field_left_out = true;
            }
        }
        let new = north.anchors.len() - 1;
        let last_agrees = north.anchors[..new]
            .iter()
            .zip(&found.members)
            .rfind(|(anchor, _)| !north.refused_ns.contains(&anchor.t_ns))
            .is_some_and(|(_, member)| *member);
        let pivot = (0..new)
            .filter(|k| found.members[*k])
            .min_by(|a, b| apart_m2(&north.anchors, *a, new).total_cmp(&apart_m2(&north.anchors, *b, new)));
        if let Some(pivot) = pivot.filter(|_| !last_agrees || north.turns > 0) {
            // The track has been at a place that is not among them: it goes back to where the others have it.
            let way = north.anchors[new].walked_n - north.anchors[pivot].walked_n;
            let place_n = north.anchors[pivot].place_n + turned(found.turn_rad, &way);
            let by_n = place_n - self.middle_p_n().xy();
            self.shift(&Vector3::new(by_n.x, by_n.y, 0.0));
            let variance = apart_m2(&north.anchors, pivot, new);
            let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
            self.eskf.add_noise(&positions, &Vector3::new(variance, variance, 0.0));
        }
        north.turned_rad = found.turn_rad;
        north.sigma_rad = Some(found.sigma_rad);
        north.turns += 1;
        north.refuse_all_but(&found.members);
        north.refused_ns.retain(|refused_ns| *refused_ns != t_ns);
        self.beyond.find_north();
    }

    /// After a visit: what it has corrected is none of the walk's own way. It began with sensor 0 at this heading, rad.
    pub(super) fn note_for_north(&mut self, heading_before_rad: f64) {
        let (middle_n, plan_m2) = (self.middle_p_n(), self.own_plan_m2());
        let after_rad = heading(&self.feet[0].nav.c_nb);
        let Some(north) = &mut self.north else { return };
        north.last_n = middle_n.xy();
        north.last_m2 = plan_m2;
        // A heading runs clockwise.
        north.turned_rad = wrap(north.turned_rad - wrap(after_rad - heading_before_rad));
    }

    /// Variance of the middle of the feet by the filter alone, the mean of both axes, m².
    fn own_plan_m2(&self) -> f64 {
        let covariance = self.middle_covariance();
        0.5 * (covariance[(0, 0)] + covariance[(1, 1)]) + self.beyond.plan_m2()
    }

    /// Turns everything about the vertical through `about_n`, counterclockwise seen from above, and makes the heading, with
    /// all that turns with it, unsure by `open_rad` more.
    fn turn(&mut self, setting: &Setting, by_rad: f64, open_rad: f64, about_n: &Vector3<f64>) {
        self.propagate_all(setting);
        let r = about_up(by_rad);
        for foot in &mut self.feet {
            foot.turn(&r, about_n);
            foot.doubts.turn(&r);
        }
        self.walked.turn(&r, about_n);
        self.slow.turn(&r, about_n);
        self.last_sure_place_n = about_n + r * (self.last_sure_place_n - about_n);
        let turning: Vec<usize> = (0..F)
            .flat_map(|sensor| {
                [ErrorState::Attitude, ErrorState::Position, ErrorState::Velocity]
                    .map(|state| state.of(sensor))
            })
            .collect();
        self.eskf.turn(&turning, &r);
        self.open_turn(open_rad, about_n);
    }

    /// Makes the heading, with all that turns with it about `about_n`, unsure by `open_rad` more: one turn of all, of the
    /// attitudes alone while position and velocity are told without their part of it.
    fn open_turn(&mut self, open_rad: f64, about_n: &Vector3<f64>) {
        let with_the_turn = |filter: &mut Self, sign: f64| {
            for sensor in 0..F {
                let nav = &filter.feet[sensor].nav;
                let lever_n = nav.p_n - about_n;
                let parts = [
                    (ErrorState::Position, skew(&Vector3::new(lever_n.x, lever_n.y, 0.0))),
                    (ErrorState::Velocity, skew(&nav.v_n)),
                ];
                for (state, by) in parts {
                    filter.eskf.add_multiple(state.of(sensor), ErrorState::Attitude.of(sensor), &(by * sign));
                }
            }
        };
        with_the_turn(self, -1.0);
        let attitudes: [usize; F] = std::array::from_fn(|sensor| ErrorState::Attitude.of(sensor));
        self.eskf.add_noise(&attitudes, &Vector3::new(0.0, 0.0, open_rad * open_rad));
        with_the_turn(self, 1.0);
    }

    fn shift(&mut self, by_n: &Vector3<f64>) {
        for (sensor, foot) in self.feet.iter_mut().enumerate() {
            foot.nav.p_n += by_n;
            foot.swing.shift(by_n);
            self.walked.shift(sensor, by_n);
        }
    }

    /// Puts into `start`, this walk's filter at an earlier moment, what it should have known of north; says whether
    /// there was anything.
    pub(super) fn teach_north(&self, setting: &Setting, start: &mut Self) -> bool {
        let Some(learnt) = self
            .north
            .as_ref()
            .filter(|north| north.turns > start.north.as_ref().map_or(0, |before| before.turns))
        else {
            return false;
        };
        let left_out = |foot: &super::foot::FootState| foot.doubts.field_left_out;
        let more_left_out =
            self.feet.iter().zip(&start.feet).any(|(foot, at_start)| left_out(foot) && !left_out(at_start));
        if more_left_out {
            // Without that field the walk has another shape: its turn is to be found anew.
            for (foot, at_start) in self.feet.iter().zip(&mut start.feet) {
                at_start.doubts.field_left_out = left_out(foot);
            }
            if start.north.is_none() {
                let place_n = start.middle_p_n();
                let variance_m2 = start.own_plan_m2();
                start.lose_north(place_n, variance_m2);
            }
            return true;
        }
        let Some(mut north) = start.north.take() else { return false };
        north.turns = learnt.turns;
        north.settled = true;
        north.refused_ns.clone_from(&learnt.refused_ns);
        if let Some(sigma_rad) = learnt.sigma_rad {
            let open_rad = (OPEN * sigma_rad).clamp(OPEN_RAD.0, OPEN_RAD.1);
            let about_n = Vector3::new(north.last_n.x, north.last_n.y, 0.0);
            start.turn(setting, wrap(learnt.turned_rad - north.turned_rad), open_rad, &about_n);
            start.beyond.find_north();
        }
        start.north = Some(north);
        true
    }
}

fn refused() -> Sought {
    Sought::Refuse(
        "no turn of the walk, whose heading is unknown, brings it here: a wrong marker, or a track that has gone astray; two later visits that agree will be believed"
            .to_owned(),
    )
}

impl Slow {
    fn turn(&mut self, r: &Matrix3<f64>, about_n: &Vector3<f64>) {
        self.place_n = about_n + r * (self.place_n - about_n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_in_common_is_seen_by_attitude_position_and_velocity_alike_and_leaves_a_covariance() {
        use crate::ins::nav_state::NavState;
        use crate::systems::pedestrian::foot::FootState;
        use crate::systems::pedestrian::slow_errors::blocks;

        let foot = |east_m: f64| {
            let nav = NavState {
                c_nb: about_up(0.3),
                v_n: Vector3::new(0.7, -0.2, 0.1),
                p_n: Vector3::new(east_m, 4.0, 1.0),
                gyro_bias_b: Vector3::zeros(),
                accelerometer_bias_b: Vector3::zeros(),
            };
            FootState::new(nav, 0, Vector3::zeros())
        };
        let mut filter = Filter::<{ blocks(2) }, 2>::new([foot(6.0), foot(6.2)]);
        let some = |k: f64| Matrix3::new(2.0, k, 0.1, k, 1.0, -0.2, 0.1, -0.2, 0.5) * 0.01;
        for sensor in 0..2 {
            filter.set_first_covariance(sensor, [0.1, 0.2, 0.3, 0.4, 0.5].map(some));
        }
        filter.set_first_positions(0.1, 0.05);
        let before = filter.eskf.covariance.dense();
        let (about_n, by_rad, open_rad) = (Vector3::new(1.0, 2.0, 0.0), 0.9, 0.4);
        let (r, parts) = (about_up(by_rad), 3 * blocks(2));
        let mut turn = nalgebra::DMatrix::<f64>::identity(parts, parts);
        let mut seen = nalgebra::DVector::<f64>::zeros(parts);
        for sensor in 0..2 {
            for state in [ErrorState::Attitude, ErrorState::Position, ErrorState::Velocity] {
                turn.fixed_view_mut::<3, 3>(3 * state.of(sensor), 3 * state.of(sensor)).copy_from(&r);
            }
            let (lever_n, v_n) =
                (r * (filter.feet[sensor].nav.p_n - about_n), r * filter.feet[sensor].nav.v_n);
            // True is turned by φ against estimated: estimated − true = −φ × lever.
            let up = Vector3::z();
            let mut set = |state: ErrorState, value: Vector3<f64>| {
                seen.fixed_rows_mut::<3>(3 * state.of(sensor)).copy_from(&value);
            };
            set(ErrorState::Attitude, up);
            set(ErrorState::Position, -up.cross(&Vector3::new(lever_n.x, lever_n.y, 0.0)));
            set(ErrorState::Velocity, -up.cross(&v_n));
        }
        let expected = &turn * before * turn.transpose() + &seen * seen.transpose() * (open_rad * open_rad);
        filter.eskf.turn(
            &[0, 1]
                .map(|s| [ErrorState::Attitude, ErrorState::Position, ErrorState::Velocity].map(|e| e.of(s)))
                .concat(),
            &r,
        );
        for foot in &mut filter.feet {
            foot.turn(&r, &about_n);
        }
        filter.open_turn(open_rad, &about_n);
        let found = filter.eskf.covariance.dense();
        assert!((&found - &expected).amax() < 1e-12, "{}", (&found - &expected).amax());
        let eigenvalues = found.symmetric_eigenvalues();
        assert!(eigenvalues.min() > -1e-12, "{}", eigenvalues.min());
    }
}
