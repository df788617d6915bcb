//! How long things took, in the first and in the second half of a run.

use std::time::Duration;

use tokio::time::Instant;

/// Delays, with the moment at which each began.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured(Vec<(Instant, u32)>);

impl Measured {
    /// Adds one that began at a moment and ends now.
    pub(super) fn ended(&mut self, began: Instant, now: Instant) {
        let us = now.saturating_duration_since(began).as_micros();
        self.0.push((began, u32::try_from(us).unwrap_or(u32::MAX)));
    }
}

/// Delays sorted by the half of the run in which they began.
#[derive(Clone, Debug)]
pub(super) struct Delays {
    middle: Instant,
    halves: [Vec<u32>; 2],
}

impl Delays {
    /// None yet.
    pub(super) fn halves(middle: Instant) -> Delays {
        Delays { middle, halves: [Vec::new(), Vec::new()] }
    }

    /// Adds those.
    pub(super) fn extend(&mut self, measured: &Measured) {
        for (began, us) in &measured.0 {
            self.halves[usize::from(*began >= self.middle)].push(*us);
        }
    }

    /// How many there are.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.halves.iter().map(Vec::len).sum()
    }

    /// The delay that a share of them does not pass: of the first half, the second, and all. `None` where there are none.
    pub(super) fn quantile(&self, share: f64) -> [Option<Duration>; 3] {
        let all = self.halves.concat();
        [self.halves[0].clone(), self.halves[1].clone(), all].map(|mut us| {
            let at = (us.len().checked_sub(1)? as f64 * share).round() as usize;
            let (_, value, _) = us.select_nth_unstable(at);
            Some(Duration::from_micros(u64::from(*value)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_are_told_apart_by_the_half_in_which_they_began() {
        let middle = Instant::now();
        let mut measured = Measured::default();
        for ms in 1..=100 {
            let began = middle - Duration::from_secs(1);
            measured.ended(began, began + Duration::from_millis(ms));
            measured.ended(middle, middle + Duration::from_millis(10 * ms));
        }
        let mut delays = Delays::halves(middle);
        delays.extend(&measured);
        let ms = |share| delays.quantile(share).map(|delay| delay.map(|delay| delay.as_millis()));
        assert_eq!(delays.len(), 200);
        assert_eq!(ms(1.0), [Some(100), Some(1_000), Some(1_000)]);
        assert_eq!(ms(0.0), [Some(1), Some(10), Some(1)]);
        assert_eq!(Delays::halves(middle).quantile(0.5), [None; 3]);
    }
}
