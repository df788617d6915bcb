//! Does the foot stand? The detector looks at a few samples; the strapdown knows the whole swing. Each is believed
//! where it is the better judge, and a swing that does not end is told of.

use nalgebra::{Matrix3, Vector3};

use super::causes::WalkCause;
use super::filter::{Filter, Setting, seconds};
use super::foot::Step;
use super::stance_aids::{FASTEST_LANDING_M_S, SHORTEST_STAND_S};
use crate::anomaly::Cause;
use crate::event::Event;
use crate::ins::layout::ErrorState;

/// A stance of walking is surer than this, m/s: beyond, the foot rolls by a radian a second or is shaken.
const DOUBTFUL_STAND_M_S: f64 = 0.075;
/// After so long in the air a foot may have come down, whatever its speed: the strapdown of a hard run, whose
/// gyro has met its limit, is wrong by metres a second, s.
const SURE_FLIGHT_S: f64 = 0.35;
/// A swing of a walk or a run is over by then, s, and as long again later nothing is left to believe.
const LONG_SWING_S: f64 = 0.55;
/// No foot glides so evenly for so long, s.
const LONGEST_EVEN_S: f64 = 1.0;
/// For so many strides after a contact that the detector has missed it is taken to miss others.
const HASTY_STRIDES: u8 = 4;
/// After so many landings at a speed that no foot lands with, of the last eight, the strapdown is no judge of contacts.
const CONTRADICTED_LANDINGS: u32 = 3;
/// No step takes so long, s.
const ENDLESS_S: f64 = 3.0;
/// A swing that does not end is told of again after this long, s.
const TELL_AGAIN_S: f64 = 60.0;
/// How fast the velocity of a foot goes astray that is never held, m/s/√s: half a percent of the rates of a walk,
/// 3 rad/s or so, tilt it by a degree in a second, and gravity does the rest.
const FREE_DRIFT_M_S_SQRT_S: f64 = 0.2;

impl<const B: usize, const F: usize> Filter<B, F> {
    /// Whether the foot stands, by detector and strapdown together.
    #[inline]
    pub(super) fn is_in_contact(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &mut self.feet[step.sensor];
        if !step.stance {
            foot.quiet_since_ns = step.t_ns;
            foot.contradicted = false;
        }
        if step.stance && (foot.stance.stands || !self.is_on_its_way(setting, step)) {
            self.feet[step.sensor].sure_contact = true;
            return true;
        }
        step.doubtful && self.comes_to_rest(setting, step)
    }

    /// Whether a foot that looks still is on its way all the same. A runner's swing has a moment that is as quiet
    /// as the ground of a hard run, and on slow stairs a foot glides as evenly as one that stands; what tells them
    /// apart is the speed that the strapdown has come to. It is asked as long as that can be believed: of a hard run
    /// soon after the foot has left the ground.
    #[inline]
    fn is_on_its_way(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        if foot.lost || !foot.swing.has_begun() {
            return false;
        }
        let tuning = &setting.tuning;
        let (slowest_m_s, longest_s, gate) = if step.zupt_sigma_m_s > DOUBTFUL_STAND_M_S {
            (tuning.slowest_flight_m_s, SURE_FLIGHT_S, tuning.flight_gate)
        } else {
            (tuning.slowest_glide_m_s, tuning.longest_glide_s, tuning.glide_gate)
        };
        let asked = foot.fast_landings.count_ones() < CONTRADICTED_LANDINGS
            && seconds(step.t_ns - foot.swing.begun_ns()) <= longest_s
            && seconds(step.t_ns - foot.quiet_since_ns) < LONGEST_EVEN_S
            && foot.nav.v_n.norm() >= slowest_m_s;
        let moves = asked && self.motion(setting, step).is_some_and(|(ratio, _)| ratio > gate);
        if moves {
            self.note_contradiction(step);
        }
        moves
    }

    /// A foot that has looked still for as long as a stance and should be on its way as fast as no foot lands: once or
    /// twice the strapdown may be right, again and again it is wrong, as with axes or a scale that are not the log's.
    fn note_contradiction(&mut self, step: &Step) {
        let foot = &mut self.feet[step.sensor];
        let lasting = seconds(step.t_ns - foot.quiet_since_ns) >= SHORTEST_STAND_S;
        if lasting && !foot.contradicted && foot.nav.v_n.norm() > FASTEST_LANDING_M_S {
            foot.contradicted = true;
            foot.fast_landings = (foot.fast_landings << 1) | 1;
        }
    }

    /// Whether a foot of which the detector is not sure has come to rest by its own strapdown. It is asked only
    /// where a contact is overdue, and for some strides after one that was: as long as the detector finds the
    /// contacts of a gait it is the better judge of when one begins and ends.
    fn comes_to_rest(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        if foot.lost || !foot.swing.has_begun() {
            return false;
        }
        let tuning = &setting.tuning;
        let overdue =
            !foot.stance.stands && seconds(step.t_ns - foot.swing.begun_ns()) > tuning.longest_swing_s;
        let asked = overdue || foot.hasty_strides > 0 || (foot.stance.stands && !foot.sure_contact);
        asked
            && self.motion(setting, step).is_some_and(|(ratio, sigma_m_s)| {
                ratio < tuning.landing_gate && sigma_m_s < tuning.landing_sigma_m_s
            })
    }

    /// The foot leaves the ground: whether the gait is one whose contacts the detector misses.
    pub(super) fn note_gait(&mut self, sensor: usize) {
        let foot = &mut self.feet[sensor];
        foot.hasty_strides =
            if foot.sure_contact { foot.hasty_strides.saturating_sub(1) } else { HASTY_STRIDES };
        foot.sure_contact = false;
    }

    /// How far the velocity is from that of a foot that stands: squared over the variance that it would have; and
    /// the largest sigma of that variance, m/s.
    fn motion(&mut self, setting: &Setting, step: &Step) -> Option<(f64, f64)> {
        if self.feet[step.sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, step.sensor);
        }
        let velocity = ErrorState::Velocity.of(step.sensor);
        let foot = &self.feet[step.sensor];
        // Once a contact is overdue the strapdown is doubted by what scale, bandwidth and sampling make of the
        // motion, all one way and with its square: more than white noise says, and little in a slow swing.
        let flown_s = seconds(step.t_ns - foot.swing.begun_ns());
        let overdue = ((flown_s - LONG_SWING_S) / LONG_SWING_S).clamp(0.0, 2.0);
        let doubt_m_s = setting.tuning.swing_doubt_s_m * overdue * foot.fastest_m_s * foot.fastest_m_s;
        let covariance = self.eskf.covariance.block(velocity, velocity)
            + Matrix3::from_diagonal_element(
                step.zupt_sigma_m_s * step.zupt_sigma_m_s + doubt_m_s * doubt_m_s,
            );
        let v_n = foot.nav.v_n;
        let ratio = v_n.dot(&covariance.cholesky()?.solve(&v_n));
        Some((ratio, covariance.diagonal().max().sqrt()))
    }

    /// A swing that does not end although the foot moves: no contact is recognised, and a free strapdown drifts by
    /// what scale and alignment make of the motion.
    #[inline]
    pub(super) fn watch_swing(&mut self, setting: &Setting, step: &Step, dt_s: f64, told: &mut Vec<Event>) {
        let foot = &mut self.feet[step.sensor];
        if foot.lost || !foot.swing.has_begun() {
            return;
        }
        let begun_ns = foot.swing.begun_ns();
        let flown_s = seconds(step.t_ns - begun_ns);
        if flown_s < ENDLESS_S {
            return;
        }
        if foot
            .endless_told_ns
            .is_none_or(|told_ns| told_ns < begun_ns && seconds(step.t_ns - told_ns) >= TELL_AGAIN_S)
        {
            foot.endless_told_ns = Some(step.t_ns);
            let cause = WalkCause::NoContact { flown_s };
            let stream = setting.feet[step.sensor].stream();
            told.push(Event::Anomaly(cause.anomaly(Some(stream), [begun_ns, step.t_ns], 0)));
        }
        let grown = FREE_DRIFT_M_S_SQRT_S * FREE_DRIFT_M_S_SQRT_S * dt_s.min(0.2);
        self.eskf.add_noise(&[ErrorState::Velocity.of(step.sensor)], &Vector3::repeat(grown));
    }
}
