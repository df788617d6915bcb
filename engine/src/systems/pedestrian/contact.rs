//! Does the foot stand? The detector looks at a few samples; the strapdown knows the whole swing. Each is believed
//! where it is the better judge, and a swing that does not end is told of.

use nalgebra::{Matrix3, Vector3};

use super::causes::WalkCause;
use super::filter::{Filter, Setting, seconds};
use super::foot::Step;
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
        (step.stance && !self.is_in_flight(setting, step))
            || (step.doubtful && self.comes_to_rest(setting, step))
    }

    /// Whether a foot that is taken to stand is on its way all the same. A runner's swing has a moment that is
    /// as quiet as the ground of a hard run; what tells them apart is the speed that the strapdown has come to.
    /// It is asked only where the threshold of walking would not say that the foot stands, and soon after it
    /// has left the ground.
    #[inline]
    fn is_in_flight(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        let doubtful = step.zupt_sigma_m_s > DOUBTFUL_STAND_M_S && !foot.stance.stands && !foot.lost;
        if !doubtful || seconds(step.t_ns - foot.swing.begun_ns()) > SURE_FLIGHT_S {
            return false;
        }
        foot.nav.v_n.norm() >= setting.tuning.slowest_flight_m_s
            && self.motion(setting, step).is_some_and(|(ratio, _)| ratio > setting.tuning.flight_gate)
    }

    /// Whether a foot of which the detector is not sure has come to rest by its own strapdown. It is asked only
    /// where a contact is overdue: as long as the detector finds the contacts of a gait it is the better judge of
    /// when one begins.
    fn comes_to_rest(&mut self, setting: &Setting, step: &Step) -> bool {
        let foot = &self.feet[step.sensor];
        if foot.lost || !foot.swing.has_begun() {
            return false;
        }
        let landed_ns = if foot.stance.stands { foot.stance.since_ns } else { step.t_ns };
        let tuning = &setting.tuning;
        seconds(landed_ns - foot.swing.begun_ns()) > tuning.longest_swing_s
            && self.motion(setting, step).is_some_and(|(ratio, sigma_m_s)| {
                ratio < tuning.landing_gate && sigma_m_s < tuning.landing_sigma_m_s
            })
    }

    /// How far the velocity is from that of a foot that stands: squared over the variance that it would have; and
    /// the largest sigma of that variance, m/s.
    fn motion(&mut self, setting: &Setting, step: &Step) -> Option<(f64, f64)> {
        if self.feet[step.sensor].transition.dt_s() > 0.0 {
            self.propagate(setting, step.sensor);
        }
        let velocity = ErrorState::Velocity.of(step.sensor);
        let foot = &self.feet[step.sensor];
        // Once a contact is overdue the strapdown is doubted by a share of the motion, as scale, alignment and
        // sampling err by one, all one way: more than white noise says.
        let flown_s = seconds(step.t_ns - foot.swing.begun_ns());
        let overdue = ((flown_s - LONG_SWING_S) / LONG_SWING_S).clamp(0.0, 2.0);
        let doubt_m_s = setting.tuning.swing_doubt * overdue * foot.fastest_m_s;
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
