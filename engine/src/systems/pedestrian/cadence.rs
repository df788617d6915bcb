//! How often a foot sets off. A foot that does so far more often than any can has a clock that runs too fast, a time in
//! another unit, or a sensor that shakes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A foot that turns faster than this is on its way, rad/s,
const MOVES_RAD_S: f64 = 2.5;
/// and one that turns slower than this is not, rad/s.
const RESTS_RAD_S: f64 = 1.0;
/// So many times,
const TIMES: usize = 24;
/// in so long, ns: eight a second. Of the recorded walks, runs, stairs and crawls none comes to more than four.
const WITHIN_NS: i64 = 3_000_000_000;

/// No foot sets off more often, 1/s.
pub(crate) const MOST_PER_S: f64 = TIMES as f64 / (WITHIN_NS as f64 * 1e-9);

/// Counts how often one foot sets off.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cadence {
    moves: bool,
    /// When it last set off, the oldest at `next`, ns.
    at_ns: [i64; TIMES],
    next: usize,
}

impl Cadence {
    pub(crate) fn new() -> Cadence {
        Cadence { moves: false, at_ns: [i64::MIN; TIMES], next: 0 }
    }

    /// Takes the rate of the next sample: how often the foot now sets off where that is more than it can, 1/s.
    pub(crate) fn take(&mut self, t_ns: i64, w_ib_b: &[f64; 3]) -> Option<f64> {
        let rate_rad_s = Vector3::from(*w_ib_b).norm();
        if self.moves {
            self.moves = rate_rad_s >= RESTS_RAD_S;
            return None;
        }
        if rate_rad_s <= MOVES_RAD_S {
            return None;
        }
        self.moves = true;
        let first_ns = std::mem::replace(&mut self.at_ns[self.next], t_ns);
        self.next = (self.next + 1) % TIMES;
        let took_ns = t_ns.saturating_sub(first_ns);
        (took_ns < WITHIN_NS).then(|| TIMES as f64 / (took_ns.max(1) as f64 * 1e-9))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most that is told of a foot which sets off so often for ten seconds, 1/s.
    fn told(per_s: f64) -> Option<f64> {
        let mut cadence = Cadence::new();
        (0..10_000)
            .filter_map(|k| {
                let t_s = f64::from(k) * 1e-3;
                let swings = (t_s * per_s).fract() < 0.5;
                let rate_rad_s = if swings { 5.0 } else { 0.1 };
                cadence.take((t_s * 1e9) as i64, &[0.0, rate_rad_s, 0.0])
            })
            .reduce(f64::max)
    }

    #[test]
    fn a_runner_is_possible_and_what_shakes_is_not() {
        assert_eq!(told(4.0), None);
        assert_eq!(told(7.5), None);
        let per_s = told(15.0).unwrap();
        assert!((per_s - 15.0).abs() < 0.5, "{per_s}");
    }
}
