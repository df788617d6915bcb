//! How far along the way a disturbance of the magnetic field stays the same: two metres beside a crate, ten or twenty in
//! a hall of steel. Strength and dip of the field show it from stance to stance. The deflection, which does not show, is
//! taken to stay the same as far; within that length many stances tell hardly more of the heading than one.

use std::collections::VecDeque;

use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Ways over which two stances are compared, m.
const LAGS_M: [f64; 4] = [2.0, 4.0, 8.0, 16.0];
/// A pair of stances counts for a way that differs from its own by less than this share.
const NEAR_SHARE: f64 = 0.3;
/// Stances nearer than this are one, m.
const SAME_PLACE_M: f64 = 0.4;
/// Stances that are kept, at most: the longest way at the shortest steps.
const KEPT: usize = 48;
/// As many independent places as the assumed length is worth.
const ASSUMED_PLACES: f64 = 3.0;
/// Less correlation than this is none.
const NO_CORRELATION: f64 = 0.05;

/// What the stances of one foot have shown of that length.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FieldReach {
    place_n: Option<Vector3<f64>>,
    walked_m: f64,
    /// How far the foot had walked, and how far the field was from the usual there, µT: horizontal and upwards.
    seen: VecDeque<(f64, Vector2<f64>)>,
    /// Sum and weight of the products over each way.
    products: [(f64, f64); LAGS_M.len()],
    squares: (f64, f64),
}

impl FieldReach {
    /// The foot has stood at `place_n`, where the field was off the usual by so much, µT.
    pub(super) fn take(&mut self, place_n: &Vector3<f64>, off_ut: Vector2<f64>) {
        let step_m = self.place_n.map_or(f64::INFINITY, |last_n| (place_n - last_n).xy().norm());
        if step_m < SAME_PLACE_M {
            return;
        }
        if step_m.is_finite() {
            self.walked_m += step_m;
        }
        self.place_n = Some(*place_n);
        for (sums, lag_m) in self.products.iter_mut().zip(LAGS_M) {
            let off_lag = |seen: &&(f64, Vector2<f64>)| (self.walked_m - seen.0 - lag_m).abs();
            let before = self.seen.iter().min_by(|a, b| off_lag(a).total_cmp(&off_lag(b)));
            if let Some(before) = before.filter(|seen| off_lag(seen) < NEAR_SHARE * lag_m) {
                sums.0 += off_ut.dot(&before.1);
                sums.1 += 1.0;
            }
        }
        self.squares.0 += off_ut.norm_squared();
        self.squares.1 += 1.0;
        self.seen.push_back((self.walked_m, off_ut));
        if self.seen.len() > KEPT {
            self.seen.pop_front();
        }
    }

    /// How many places the foot has been at of which one says nothing of the next.
    pub(super) fn places(&self, assumed_m: f64) -> f64 {
        self.walked_m / self.length_m(assumed_m)
    }

    /// The length over which the field's disturbance is correlated, m: the integral of its correlation, drawn towards
    /// the assumed one while few places have been seen.
    pub(super) fn length_m(&self, assumed_m: f64) -> f64 {
        let mean_square = self.squares.0 / self.squares.1.max(1.0);
        if mean_square <= 0.0 {
            return assumed_m;
        }
        let mut length_m = 0.0;
        let mut before = (0.0, 1.0);
        for ((sum, weight), lag_m) in self.products.into_iter().zip(LAGS_M) {
            if weight < 1.0 {
                break;
            }
            let correlation = (sum / weight / mean_square).clamp(0.0, 1.0);
            length_m += 0.5 * (before.1 + correlation) * (lag_m - before.0);
            if correlation < NO_CORRELATION {
                break;
            }
            before = (lag_m, correlation);
        }
        if length_m <= 0.0 {
            return assumed_m;
        }
        let places = self.walked_m / length_m;
        (assumed_m * ASSUMED_PLACES + length_m * places) / (ASSUMED_PLACES + places)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ins::differences::Random;

    #[test]
    fn a_length_of_two_metres_and_one_of_twelve_are_told_apart_over_many_seeds() {
        for (drawn_m, bounds_m) in [(2.0, 1.0..3.5), (12.0, 6.0..14.0)] {
            let mut lengths_m: Vec<f64> = (0..40)
                .map(|seed| {
                    let mut random = Random::new(seed);
                    let mut normal = || random.normal();
                    let mut reach = FieldReach::default();
                    let mut off_ut = Vector2::new(normal(), normal()) * 5.0;
                    for step in 0..200 {
                        let kept: f64 = libm::exp(-1.3 / drawn_m);
                        off_ut = off_ut * kept
                            + Vector2::new(normal(), normal()) * 5.0 * (1.0 - kept * kept).sqrt();
                        reach.take(&Vector3::new(1.3 * f64::from(step), 0.0, 0.0), off_ut);
                    }
                    reach.length_m(2.0)
                })
                .collect();
            lengths_m.sort_by(f64::total_cmp);
            assert!(bounds_m.contains(&lengths_m[4]) && bounds_m.contains(&lengths_m[35]), "{lengths_m:?}");
        }
    }

    #[test]
    fn who_has_hardly_walked_has_the_assumed_length() {
        let mut reach = FieldReach::default();
        assert_eq!(reach.length_m(2.0), 2.0);
        for k in 0..500 {
            // Standing in a disturbed place says nothing of how far it reaches.
            reach.take(&Vector3::new(0.0005 * f64::from(k), 0.0, 0.0), Vector2::new(9.0, -4.0));
        }
        assert_eq!(reach.length_m(2.0), 2.0);
    }
}
