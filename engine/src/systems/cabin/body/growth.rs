//! How fast a pose's sigma grows, and when it will have used up its budget.

use serde::{Deserialize, Serialize};

/// Growth is taken over so long, ns: from one fix to the next a sigma goes up and down.
const OVER_NS: i64 = 500_000_000;
/// Slower growth is none, m/s: a budget of millimetres lasts for hours then.
const LEAST_M_S: f64 = 1e-7;

/// The sigma of a pose as it was, and how it has grown since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Growth {
    then: Option<(i64, f64)>,
    rate_m_s: f64,
}

impl Growth {
    /// The sigma now, m.
    pub(super) fn note(&mut self, t_ns: i64, sigma_m: f64) {
        let (then_ns, then_m) = *self.then.get_or_insert((t_ns, sigma_m));
        if t_ns - then_ns >= OVER_NS {
            self.rate_m_s = (sigma_m - then_m) / ((t_ns - then_ns) as f64 * 1e-9);
            self.then = Some((t_ns, sigma_m));
        }
    }

    /// Until a sigma that is now so large is at `most_m`, s; `None` while it does not grow.
    pub(super) fn left_s(&self, sigma_m: f64, most_m: f64) -> Option<f64> {
        (self.rate_m_s > LEAST_M_S).then(|| ((most_m - sigma_m) / self.rate_m_s).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_that_is_left_is_that_of_the_growth_over_half_a_second_whatever_goes_up_and_down_between() {
        let mut growth = Growth::default();
        for k in 0..=40_i64 {
            let wave_m = if k % 10 == 0 { 0.0 } else { 2e-3 };
            growth.note(k * 50_000_000, 1e-3 + 1e-3 * (k as f64 * 0.05) + wave_m);
        }
        // 3 mm after two seconds, by 1 mm/s.
        let left_s = growth.left_s(3e-3, 5e-3).unwrap();
        assert!((left_s - 2.0).abs() < 1e-6, "{left_s}");
        assert_eq!(growth.left_s(6e-3, 5e-3), Some(0.0), "it is used up");
        for k in 41..=80_i64 {
            growth.note(k * 50_000_000, 2e-3);
        }
        assert_eq!(growth.left_s(2e-3, 5e-3), None, "it grows no more");
    }
}
