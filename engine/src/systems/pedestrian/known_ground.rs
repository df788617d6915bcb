//! Where a walk has been before. What bends the field at a place bends it again when somebody comes by again: rounds, stairs
//! and ways back tell of the heading what they have told already, and nothing new.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Places are kept so far from each other, m.
const SPACING_M: f64 = 2.0;
/// So many at most; a walk whose ground is larger forgets what it saw first.
const KEPT: usize = 256;
/// A place is met again where the way there was longer than so many times its distance …
const WAY_TIMES: f64 = 2.0;
/// … and by this besides, m. Straight on and around a corner nothing is met again.
const WAY_M: f64 = 1.5;
/// Ground that is farther from all that is known than this share of the length of a deflection is new.
const NEW_SHARE: f64 = 0.5;

/// The places of a walk.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct KnownGround {
    walked_m: f64,
    /// The part of it on new ground, m.
    new_m: f64,
    /// How far had been walked, m, and where that was.
    places: Vec<(f64, Vector3<f64>)>,
    oldest: usize,
}

impl KnownGround {
    /// A foot stands at `place_n` after another `walked_m`; a deflection reaches as far as `length_m`. How new the ground
    /// is, from 0 to 1.
    pub(super) fn take(&mut self, place_n: &Vector3<f64>, walked_m: f64, length_m: f64) -> f64 {
        self.walked_m += walked_m;
        let (mut nearest_m, mut nearest_met_m) = (f64::INFINITY, f64::INFINITY);
        for (at_m, known_n) in &self.places {
            let away_m = (place_n - known_n).norm();
            nearest_m = nearest_m.min(away_m);
            if self.walked_m - at_m > WAY_TIMES * away_m + WAY_M {
                nearest_met_m = nearest_met_m.min(away_m);
            }
        }
        if nearest_m > SPACING_M {
            let place = (self.walked_m, *place_n);
            if self.places.len() < KEPT {
                self.places.push(place);
            } else {
                self.places[self.oldest] = place;
                self.oldest = (self.oldest + 1) % KEPT;
            }
        }
        let new = (nearest_met_m / (NEW_SHARE * length_m)).min(1.0);
        self.new_m += new * walked_m;
        new
    }

    /// The share of the way that led over new ground.
    pub(super) fn new_share(&self) -> f64 {
        if self.walked_m > 0.0 { self.new_m / self.walked_m } else { 1.0 }
    }

    /// Turns all places about the vertical through `about_n`.
    pub(super) fn turn(&mut self, r: &Matrix3<f64>, about_n: &Vector3<f64>) {
        for (_, place_n) in &mut self.places {
            *place_n = about_n + r * (*place_n - about_n);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of new ground on a way through these corners, in steps of 0.7 m.
    fn new_share(corners: &[[f64; 2]]) -> f64 {
        let mut ground = KnownGround::default();
        for pair in corners.windows(2) {
            let [from, to] = [0, 1].map(|k| Vector3::new(pair[k][0], pair[k][1], 0.0));
            let steps = ((to - from).norm() / 0.7).ceil();
            for step in 1..=steps as u32 {
                let place_n = from + (to - from) * (f64::from(step) / steps);
                ground.take(&place_n, (to - from).norm() / steps, 6.0);
            }
        }
        ground.new_share()
    }

    #[test]
    fn straight_on_and_around_corners_all_is_new_and_on_the_way_back_nothing() {
        assert_eq!(new_share(&[[0.0, 0.0], [100.0, 0.0]]), 1.0);
        assert_eq!(new_share(&[[0.0, 0.0], [50.0, 0.0], [50.0, 50.0], [100.0, 50.0]]), 1.0);
        let back = new_share(&[[0.0, 0.0], [100.0, 0.0], [0.0, 0.5]]);
        assert!((0.5..0.65).contains(&back), "{back}");
        let square = [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0], [0.0, 0.0]];
        let rounds: Vec<_> = square.iter().cycle().take(5 * 4 + 1).copied().collect();
        let share = new_share(&rounds);
        assert!((0.15..0.35).contains(&share), "{share}");
    }
}
