//! How the platform goes on beyond the encoders' last reading: along a line in the cabin, or along one in n.
//!
//! Rotator and legs that hold the platform on its target take the cabin's swing out: in n it hardly accelerates, while in the cabin
//! it does as the cabin swings. Where they stand still it is the other way round. Which holds is seen at every reading: both lines
//! are compared with where the platform then is.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::filter::Filter;
use super::joints::PlatformInCabin;

/// The mean squares are over so many readings.
const READINGS: f64 = 40.0;
/// So many have to have been compared.
const FEWEST: u32 = 8;

/// Mean squares of how far off both lines were.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Steadiness {
    /// In the cabin and in n, m².
    off_m2: [f64; 2],
    readings: u32,
}

impl Steadiness {
    fn note(&mut self, off_m: [f64; 2]) {
        self.readings = self.readings.saturating_add(1);
        let share = 1.0 / f64::from(self.readings).min(READINGS);
        for (mean, off_m) in self.off_m2.iter_mut().zip(off_m) {
            *mean += share * (off_m * off_m - *mean);
        }
    }

    /// How much farther off the line in n is than the one in the cabin, where it is the better one.
    pub(super) fn in_n(&self) -> Option<f64> {
        let [in_cabin, in_n] = self.off_m2;
        (self.readings >= FEWEST && in_n < in_cabin).then(|| (in_n / in_cabin).sqrt())
    }
}

impl Filter {
    /// A place of b, m, that was `from_b` and then, at the first time, `to_b`, and its rate in b, m/s, where it is at the second time
    /// after going on in n; times in ns, `span_s` before and `after_s` after the first.
    pub(super) fn goes_on_in_n(
        &self,
        [from_b, to_b]: [&Vector3<f64>; 2],
        [to_ns, t_ns]: [i64; 2],
        span_s: f64,
        after_s: f64,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let rest = Vector3::zeros();
        let from = self.point(to_ns - (span_s * 1e9) as i64, from_b, &rest)?.p_n;
        let to = self.point(to_ns, to_b, &rest)?.p_n;
        let v_n = (to - from) / span_s;
        let origin = self.point(t_ns, &rest, &rest)?;
        let at_b = origin.c_nb.tr_mul(&(to + v_n * after_s - origin.p_n));
        let carried = self.point(t_ns, &at_b, &rest)?;
        Some((at_b, origin.c_nb.tr_mul(&(v_n - carried.v_n))))
    }

    /// A new seat of the platform, compared with where both lines have it.
    pub(super) fn note_steadiness(&mut self, tag_ns: i64, seat: &PlatformInCabin) {
        let count = self.seats.len();
        let Some((from, to)) = count.checked_sub(2).map(|k| (self.seats[k], self.seats[k + 1])) else {
            return;
        };
        let (span_s, after_s) = ((to.0 - from.0) as f64 * 1e-9, (tag_ns - to.0) as f64 * 1e-9);
        if !(span_s > 0.0 && after_s > 0.0 && span_s < 0.5 && after_s < 0.5) {
            return;
        }
        let (from_b, to_b) = (from.1.position_b, to.1.position_b);
        let in_cabin = to_b + (to_b - from_b) * (after_s / span_s);
        let delay_ns = self.encoder_delay_ns();
        let times = [to.0 - delay_ns, tag_ns - delay_ns];
        if let Some((in_n, _)) = self.goes_on_in_n([&from_b, &to_b], times, span_s, after_s) {
            self.steady.note([in_cabin, in_n].map(|at_b| (at_b - seat.position_b).norm()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_that_was_closer_is_taken_and_none_before_some_readings() {
        let mut steady = Steadiness::default();
        for k in 0..20 {
            assert_eq!(steady.in_n().is_some(), k >= FEWEST, "{k}");
            steady.note([3e-3, 1e-3]);
        }
        assert!((steady.in_n().unwrap() - 1.0 / 3.0).abs() < 1e-12);
        // The rotator stands still: the platform goes with the cabin.
        (0..80).for_each(|_| steady.note([1e-4, 3e-3]));
        assert_eq!(steady.in_n(), None);
    }
}
