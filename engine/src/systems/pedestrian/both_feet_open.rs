//! What the swings of both feet alike fail to come to rest by. Scale and axes differ from sensor to sensor, and so does what
//! they leave of a swing; a clock that runs wrongly, or forces that come late, does the same to both.

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::contradictions::Contradiction;
use super::filter::{Filter, Setting};
use crate::event::Event;

/// Swings of each foot that are needed,
const SWINGS: f64 = 20.0;
/// and over about how many a mean is taken.
const SWINGS_OF_A_MEAN: f64 = 32.0;
/// Two sound sensors have less in common along the way: 0.25 % of the fastest speed, 1σ, in drawn worlds;
const ALONG_SHARE: f64 = 0.0095;
/// and less upwards, where soles, slopes and the mounting leave 0.8 %.
const UP_SHARE: f64 = 0.032;
/// And the feet differ by less than this share of what they have in common.
const ALIKE_SHARE: f64 = 0.5;

/// The mean of one foot's swings.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Closing {
    swings: f64,
    /// Along the way and upwards, as shares of the fastest speed.
    open: Vector2<f64>,
}

impl Closing {
    /// A swing has left this velocity, as a share of its fastest: along, across, upwards.
    pub(super) fn take(&mut self, open: &Vector3<f64>) {
        self.swings += 1.0;
        self.open += (Vector2::new(open.x, open.z) - self.open) / self.swings.min(SWINGS_OF_A_MEAN);
    }

    /// What both have in common, as a share, where it is more than chance.
    fn in_common(&self, other: &Closing) -> Option<f64> {
        if self.swings.min(other.swings) < SWINGS {
            return None;
        }
        let (common, apart) = (0.5 * (self.open + other.open), 0.5 * (self.open - other.open));
        let beyond = common.x.abs() > ALONG_SHARE || common.y.abs() > UP_SHARE;
        (beyond && apart.norm() < ALIKE_SHARE * common.norm()).then(|| common.norm())
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// A swing of either foot has come to its end.
    pub(super) fn judge_common_closing(&mut self, setting: &Setting, sensor: usize, told: &mut Vec<Event>) {
        let [own, other] = [sensor, 1 - sensor].map(|k| self.feet[k].doubts.closing);
        // Feet that are not held when they stand leave everything open.
        if !setting.aids.zupt || self.feet.iter().any(|foot| foot.doubts.common_share > 0.0) {
            return;
        }
        let Some(share) = own.in_common(&other) else { return };
        for foot in &mut self.feet {
            foot.doubts.common_share = share;
        }
        self.tell(setting, sensor, &Contradiction::BothFeetOpen { open_percent: 100.0 * share }, told);
        let way_m = self.distance_m();
        self.beyond.reach(share * way_m, share * way_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_both_feet_have_in_common_is_told_apart_from_what_each_has() {
        let of = |along: f64, up: f64| {
            let mut closing = Closing::default();
            (0..40).for_each(|_| closing.take(&Vector3::new(along, 0.001, up)));
            closing
        };
        assert!(of(-0.011, -0.012).in_common(&of(-0.010, -0.017)).is_some());
        assert!(of(-0.011, 0.001).in_common(&of(0.006, 0.0)).is_none());
        assert!(of(0.003, 0.004).in_common(&of(0.002, -0.003)).is_none());
        assert!(Closing::default().in_common(&of(0.1, 0.1)).is_none());
    }
}
