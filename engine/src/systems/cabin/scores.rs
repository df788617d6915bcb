//! Whether the innovations still have the mean and the size that the filter says.
//!
//! Innovations of a filter whose world is as it believes are white, of the covariance that it states. Two things are kept of them. For
//! each error state the *score* Σ h'S⁻¹ν, whose variance is Σ h'S⁻¹h: it leaves its bounds when that state goes where its own process
//! cannot follow, as an error that creeps in does, however small each innovation is. And for each device the mean of ν'S⁻¹ν / 3, which
//! is 1: where most devices of a kind have more, their rows scatter more than is stated, whoever is to blame.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::covariance::Sparse;

/// What was weighed is forgotten by half in this time, s: for scores, and for mean squares.
const HALF_S: f64 = 2.0;
const SQUARES_HALF_S: f64 = 4.0;
/// A mean square says something from so many rows on, those of long ago counted less.
const FEWEST_ROWS: f64 = 6.0;
/// One row counts as so many times its share at most: a wrong one is refused, and says nothing of noise.
const MOST_OF_ROW: f64 = 10.0;

/// Sums of one hypothesis.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Sum {
    own: f64,
    with: f64,
}

impl Sum {
    fn score(&self) -> f64 {
        if self.own > 0.0 { self.with / self.own.sqrt() } else { 0.0 }
    }
}

/// Rows and the sum of their squares.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct Squares {
    rows: f64,
    nis: f64,
}

/// A row that was weighed: the innovation, the inverse of its covariance, and whether it was taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation<'a> {
    pub(super) jacobian: &'a Sparse,
    pub(super) innovation: &'a Vector3<f64>,
    pub(super) information: &'a Matrix3<f64>,
    pub(super) taken: bool,
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Scores {
    states: Vec<Sum>,
    devices: Vec<Squares>,
    last_ns: Option<i64>,
}

impl Scores {
    /// A device's row; what was refused says nothing of states, which it could not move.
    pub(super) fn note(&mut self, aid: usize, row: &Innovation<'_>) {
        if self.devices.len() <= aid {
            self.devices.resize(aid + 1, Squares::default());
        }
        let weighed = row.information * row.innovation;
        for (state, column) in row.jacobian {
            let column = Vector3::from(*column);
            let (own, with) = (column.dot(&(row.information * column)), column.dot(&weighed));
            if row.taken {
                if self.states.len() <= *state {
                    self.states.resize(state + 1, Sum::default());
                }
                let sum = &mut self.states[*state];
                *sum = Sum { own: sum.own + own, with: sum.with + with };
            }
        }
        let squares = &mut self.devices[aid];
        squares.rows += 1.0;
        squares.nis += (row.innovation.dot(&weighed) / 3.0).min(MOST_OF_ROW);
    }

    /// The end of an epoch.
    pub(super) fn pass(&mut self, t_ns: i64) {
        let dt_s = self.last_ns.map_or(0.0, |last_ns| (t_ns - last_ns).max(0) as f64 * 1e-9);
        self.last_ns = Some(t_ns);
        let [kept, squares_kept] = [HALF_S, SQUARES_HALF_S].map(|half_s| libm::exp2(-dt_s / half_s));
        for sum in &mut self.states {
            *sum = Sum { own: sum.own * kept, with: sum.with * kept };
        }
        for squares in &mut self.devices {
            *squares = Squares { rows: squares.rows * squares_kept, nis: squares.nis * squares_kept };
        }
    }

    /// The score of a state, and how far off it is by itself, in its unit.
    pub(super) fn of(&self, state: usize) -> (f64, f64) {
        self.states.get(state).map_or((0.0, 0.0), |sum| (sum.score(), sum.with / sum.own.max(1e-300)))
    }

    /// The mean square of the normalised innovations of the device in the middle of those numbered so; `None` where too few write.
    pub(super) fn mean_square(&self, aids: std::ops::Range<usize>) -> Option<f64> {
        let of = self.devices.get(aids.start..aids.end.min(self.devices.len()))?;
        let seen = of.iter().filter(|squares| squares.rows >= FEWEST_ROWS);
        let mut means: Vec<f64> = seen.map(|squares| squares.nis / squares.rows).collect();
        means.sort_by(f64::total_cmp);
        // Of two devices the lesser: one that is wrong must not make the other noisy.
        means.get(means.len().checked_sub(1)? / 2).copied()
    }

    /// What was known is of no use any more.
    pub(super) fn forget(&mut self) {
        *self = Scores::default();
    }

    /// The same of one state.
    pub(super) fn forget_state(&mut self, state: usize) {
        if let Some(sum) = self.states.get_mut(state) {
            *sum = Sum::default();
        }
    }
}
