//! The barometer against the feet: a lift takes somebody up who stands, a door and the weather change the pressure alone.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::contradictions::Contradiction;
use super::filter::{Filter, Setting, seconds};
use super::slow_errors::surroundings;
use crate::anomaly::Cause;
use crate::event::Event;
use crate::ins::layout::ErrorState;
use crate::ins::observation::Observation;

/// Less than this is a matter of noise and drift, m.
const LEAST_RISE_M: f64 = 1.5;
/// Barometer and force that differ by less than this and …, m,
const AGREE_M: f64 = 0.7;
/// … this share of the rise agree.
const AGREE_SHARE: f64 = 0.35;
/// A door that is opened changes the pressure for a shorter time, s.
const LASTING_S: f64 = 9.0;
/// In so many stances at least it has to show.
const LASTING_STANCES: u32 = 3;
/// A foot whose forces say that it moves slower and less far than this stands, m/s and m.
const STILL_M_S: f64 = 0.3;
const STILL_M: f64 = 0.8;
/// Who has stood for so long does not walk, s.
const LONG_STAND_S: f64 = 2.0;
/// Over about so many stances the mean of the altimeter's innovations is taken.
const STANCES_OF_A_MEAN: f64 = 12.0;
/// Up to this that mean says nothing.
const USUAL_NIS: f64 = 2.5;
/// One innovation counts at most this much in it.
const MOST_NIS: f64 = 30.0;

/// A foot that comes down so near to where it stood has not stepped, m: a lift that sets off looks like a swing.
const NO_STEP_M: f64 = 0.3;
/// The other foot's barometer speaks for now for so long, s.
const OTHERS_WORD_S: f64 = 4.0;
/// Air that is 14 K warmer than standard makes a rise by so much too small, as a share.
const AIR_SHARE: f64 = 0.05;
/// One whose forces say that it moves faster is moved, m/s.
const MOVED_M_S: f64 = 0.5;
/// The barometer follows a ride within this, s.
const LONGEST_START_S: f64 = 20.0;
/// So long after a ride its height is still looked at often, s.
const JUST_MOVED_S: f64 = 6.0;
/// A contradiction that goes on is told again after this long, s.
const TELL_AGAIN_S: f64 = 60.0;

/// What a standing foot feels upwards.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Ride {
    /// Length of the specific force at rest, m/s²; 0 before any.
    pub(crate) rest_m_s2: f64,
    /// Since when the foot has not stepped, ns, and how high it was then, m.
    since_ns: i64,
    from_m: f64,
    speed_m_s: f64,
    rise_m: f64,
    /// Since when the barometer has been off to one side, ns, and in how many stances.
    off_since_ns: Option<i64>,
    off_stances: u32,
    off_up: bool,
    /// When it last agreed with the track, ns.
    agreed_ns: Option<i64>,
    /// When the foot was last moved, or the barometer said so, ns.
    moved_ns: Option<i64>,
}

impl Ride {
    fn begin(&mut self, t_ns: i64, height_m: f64) {
        (self.since_ns, self.from_m, self.speed_m_s, self.rise_m) = (t_ns, height_m, 0.0, 0.0);
    }

    /// Takes a sample.
    #[inline]
    pub(super) fn take(&mut self, force_m_s2: f64, dt_s: f64) {
        if self.rest_m_s2 > 0.0 {
            self.speed_m_s += (force_m_s2 - self.rest_m_s2) * dt_s;
            self.rise_m += self.speed_m_s * dt_s;
        }
    }

    /// Whether the foot is being moved at this time, or the barometer says so, or either was so just now.
    pub(super) fn moves(&self, t_ns: i64) -> bool {
        self.off_since_ns.is_some()
            || self.agreed_ns.is_some() && self.speed_m_s.abs() > MOVED_M_S
            || self.moved_ns.is_some_and(|moved_ns| seconds(t_ns - moved_ns) < JUST_MOVED_S)
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// The foot comes down: where it has stepped, what it feels upwards counts from here.
    pub(super) fn begin_ride(&mut self, sensor: usize) {
        let foot = &mut self.feet[sensor];
        let stepped = (foot.nav.p_n - foot.swing.start_p_n()).xy().norm() > NO_STEP_M;
        if stepped || !foot.swing.has_begun() {
            foot.ride.begin(foot.t_ns, foot.nav.p_n.z);
        }
    }

    /// By how much more than usual the pressure drifts, as the altimeter's innovations of this walk say.
    pub(super) fn pressure_unrest(&self) -> f64 {
        (self.altimeter_nis / USUAL_NIS).max(1.0)
    }

    /// Weighs the height by the barometer; where the two contradict each other, asks the forces.
    pub(super) fn weigh_height(
        &mut self,
        setting: &Setting,
        sensor: usize,
        observation: &Observation<1>,
        gate: f64,
        told: &mut Vec<Event>,
    ) -> (f64, bool) {
        let (nis, accepted) = self.update(observation, gate);
        self.altimeter_nis += (nis.min(MOST_NIS) - self.altimeter_nis) / STANCES_OF_A_MEAN;
        // What the barometer says more than the track: the innovation is estimated − measured.
        let rise_m = -observation.innovation[0];
        let foot = &mut self.feet[sensor];
        let (t_ns, height_m) = (foot.t_ns, foot.nav.p_n.z);
        let mean_force_m_s2 = foot.stance.force_sum.norm() / f64::from(foot.stance.samples.max(1));
        let ride = &mut foot.ride;
        let stood_s = seconds(t_ns - ride.since_ns);
        let still =
            ride.speed_m_s.abs() < STILL_M_S && (ride.rise_m - (height_m - ride.from_m)).abs() < STILL_M;
        if !accepted || ride.speed_m_s.abs() > MOVED_M_S {
            ride.moved_ns = Some(t_ns);
        }
        if accepted || rise_m.abs() < LEAST_RISE_M {
            ride.off_since_ns = None;
            ride.agreed_ns = Some(t_ns);
            // The barometer says that nothing has moved: what the forces say is their own error, unless a ride begins.
            let begins = ride.speed_m_s.abs() > MOVED_M_S && stood_s < LONGEST_START_S;
            if stood_s >= LONG_STAND_S && !begins {
                ride.rest_m_s2 = mean_force_m_s2;
                ride.begin(t_ns, height_m);
            }
            return (nis, accepted);
        }
        if ride.off_since_ns.is_none() || ride.off_up != (rise_m > 0.0) {
            (ride.off_since_ns, ride.off_stances, ride.off_up) = (Some(t_ns), 0, rise_m > 0.0);
        }
        ride.off_stances += 1;
        let since_ns = ride.off_since_ns.unwrap_or(t_ns);
        let lasts = seconds(t_ns - since_ns) >= LASTING_S && ride.off_stances >= LASTING_STANCES;
        let whole_m = rise_m + height_m - ride.from_m;
        let agree_m = AGREE_M + AGREE_SHARE * whole_m.abs();
        let felt = stood_s >= LONG_STAND_S
            && ride.rise_m.abs() > LEAST_RISE_M
            && (ride.rise_m - whole_m).abs() < agree_m;
        let alone = stood_s >= LASTING_S && still;
        let agreed =
            |ride: &Ride| ride.agreed_ns.is_some_and(|agreed_ns| seconds(t_ns - agreed_ns) < OTHERS_WORD_S);
        let other_agrees = F == 2 && agreed(&self.feet[1 - sensor].ride);
        let height = Vector3::new(0.0, 0.0, rise_m * rise_m);
        let drift = Vector3::new(0.0, rise_m * rise_m, 0.0);
        let positions: [usize; F] = std::array::from_fn(|sensor| ErrorState::Position.of(sensor));
        let cause = if felt {
            self.eskf.add_noise(&positions, &height);
            self.beyond.reach(0.0, AIR_SHARE * whole_m.abs());
            Contradiction::Lifted { rise_m: whole_m }
        } else if !lasts {
            return (nis, accepted);
        } else if other_agrees {
            let zero_m = &mut self.feet[sensor].altimeter_zero_m;
            *zero_m = zero_m.map(|zero_m| zero_m - rise_m);
            Contradiction::PressureAlone { rise_m }
        } else if alone {
            self.eskf.add_noise(&[surroundings(F)], &drift);
            Contradiction::PressureAlone { rise_m }
        } else {
            self.eskf.add_noise(&positions, &height);
            self.eskf.add_noise(&[surroundings(F)], &drift);
            Contradiction::HeightsDisagree { rise_m }
        };
        self.feet.iter_mut().for_each(|foot| foot.ride.off_since_ns = None);
        if self.heights_told_ns.is_none_or(|told_ns| seconds(t_ns - told_ns) >= TELL_AGAIN_S) {
            self.heights_told_ns = Some(t_ns);
            let stream = Some(setting.feet[sensor].stream());
            told.push(Event::Anomaly(cause.anomaly(stream, [since_ns, t_ns], 0)));
        }
        if other_agrees && !felt {
            return (nis, false);
        }
        (nis, self.update(observation, f64::INFINITY).1)
    }
}
