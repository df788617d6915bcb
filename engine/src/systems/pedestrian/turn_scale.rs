//! Do the gyro and the field agree on how far a foot turns? From stance to stance the field's azimuth has to change by as
//! much as the gyro says; what differs in proportion to the turn is a scale of the gyro about the vertical.

use serde::{Deserialize, Serialize};

use super::filter::Filter;
use crate::rotation::wrap;

/// A stride that turns by more is none, rad.
const LARGEST_TURN_RAD: f64 = 2.5;
/// Sum of the squares of the turns that is needed, rad²: about two corners.
const ENOUGH_RAD2: f64 = 1.2;
/// The field's azimuth from stance to stance scatters by this at least, rad.
const LEAST_SCATTER_RAD: f64 = 0.03;
/// A share is believed to be wrong beyond so many sigmas of it …
const GATE: f64 = 3.0;
/// … by as much as lies beyond so many.
const BY_CHANCE: f64 = 2.0;
/// How far apart in a round the places are, as a share of its way.
const PART_OF_A_ROUND: f64 = 0.25;
/// Over about so many strides the gyro keeps the heading better than the field tells it.
const STRIDES_OF_A_GYRO: f64 = 40.0;

/// The turns of one foot so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct TurnScale {
    /// Heading after the last stance, and what it left of the field's azimuth, rad.
    last: Option<(f64, f64)>,
    strides: f64,
    turns_rad2: f64,
    /// Sum of turn times what the field turned less, and of the square of that, rad².
    products_rad2: f64,
    squares_rad2: f64,
    /// How far the field has strayed from what the gyro kept over the last strides, rad.
    pub(super) strayed_rad: f64,
    /// The share by which turns may be misread.
    pub(super) misread_share: f64,
}

impl TurnScale {
    /// A stance with the heading `heading_rad` as the swing has left it, from which the field differs by `off_rad`; after the
    /// update these are `after_rad` and `left_rad`.
    pub(super) fn take(&mut self, heading_rad: f64, off_rad: f64, after_rad: f64, left_rad: f64) {
        let before = self.last.replace((after_rad, left_rad));
        let Some((last_rad, last_off_rad)) = before else { return };
        let (turn_rad, open_rad) = (wrap(heading_rad - last_rad), wrap(off_rad - last_off_rad));
        if turn_rad.abs() > LARGEST_TURN_RAD {
            self.strayed_rad = 0.0;
            return;
        }
        self.strayed_rad += open_rad - self.strayed_rad / STRIDES_OF_A_GYRO;
        self.strides += 1.0;
        self.turns_rad2 += turn_rad * turn_rad;
        self.products_rad2 += turn_rad * open_rad;
        self.squares_rad2 += open_rad * open_rad;
    }

    /// The sums of both feet.
    fn with(&self, other: &TurnScale) -> TurnScale {
        TurnScale {
            strides: self.strides + other.strides,
            turns_rad2: self.turns_rad2 + other.turns_rad2,
            products_rad2: self.products_rad2 + other.products_rad2,
            squares_rad2: self.squares_rad2 + other.squares_rad2,
            ..TurnScale::default()
        }
    }

    /// The share by which the field turns more than the gyro says, with its sigma.
    fn share(&self) -> Option<(f64, f64)> {
        if self.turns_rad2 < ENOUGH_RAD2 {
            return None;
        }
        let share = self.products_rad2 / self.turns_rad2;
        let scatter = (self.squares_rad2 - share * self.products_rad2) / self.strides;
        Some((share, (scatter.max(LEAST_SCATTER_RAD * LEAST_SCATTER_RAD) / self.turns_rad2).sqrt()))
    }

    /// What of that share is beyond chance.
    fn beyond_chance(&self) -> f64 {
        let Some((share, sigma)) = self.share() else { return 0.0 };
        if share.abs() > GATE * sigma { share.abs() - BY_CHANCE * sigma } else { 0.0 }
    }
}

impl<const B: usize, const F: usize> Filter<B, F> {
    /// A swing has come to its end: the sigmas take account of turns that gyro and field read differently.
    pub(super) fn judge_turns(&mut self) {
        let all = self.feet.iter().fold(TurnScale::default(), |sum, foot| sum.with(&foot.doubts.turn_scale));
        let share = all.beyond_chance();
        for foot in &mut self.feet {
            foot.doubts.turn_scale.misread_share = share;
        }
        if share > 0.0 {
            // The way since then is bent by what a corner was misread by; a way in rounds by some of it.
            let way_m = (self.middle_p_n() - self.last_sure_place_n).xy().norm();
            self.beyond.reach(share * way_m.max(PART_OF_A_ROUND * self.distance_m()), 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_of_the_gyro_shows_in_corners_and_a_bent_field_does_not() {
        let walked = |scale: f64, bent_rad: f64| {
            let mut turns = TurnScale::default();
            let (mut truth_rad, mut kept_rad): (f64, f64) = (0.0, 0.0);
            for stride in 0..120 {
                let turn_rad = if stride % 24 < 4 { 0.39 } else { 0.0 };
                truth_rad += turn_rad;
                let swung_rad = kept_rad + scale * turn_rad;
                let field_rad = truth_rad + bent_rad * libm::sin(0.9 * f64::from(stride));
                let off_rad = wrap(field_rad - swung_rad);
                // The filter takes a third of it.
                kept_rad = swung_rad + off_rad / 3.0;
                turns.take(wrap(swung_rad), off_rad, wrap(kept_rad), 2.0 * off_rad / 3.0);
            }
            turns.beyond_chance()
        };
        assert_eq!(walked(1.0, 0.05), 0.0);
        assert!((0.02..0.12).contains(&walked(0.9, 0.02)), "{}", walked(0.9, 0.02));
    }
}
