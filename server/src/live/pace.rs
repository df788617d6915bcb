//! How often a session writes: a device that sends each of hundreds of samples a second in a frame of its own would have the
//! disk's answer to each, at several times the cost of the samples.

use std::time::Duration;

use tokio::time::Instant;

/// Writes begin this far apart on the mean: where batches come more seldom, nobody waits.
const EVERY: Duration = Duration::from_millis(20);
/// So much of the mean may be ahead: what comes in bursts, as the frames of two feet do, is not held back.
const AHEAD: Duration = Duration::from_millis(200);

/// So many samples are worth a write of their own: a device that sends what it has gathered and waits for each answer is not
/// held back.
const ENOUGH: usize = 10;

/// The pace of one session's writes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// When all writes so far would have begun, had they been evenly apart.
    due: Instant,
    /// When the last one began.
    begun: Instant,
}

impl Pace {
    /// Of a session that has not written yet.
    pub(super) fn new(now: Instant) -> Pace {
        Pace { due: now, begun: now }
    }

    /// When a write of so many samples may begin.
    pub(super) fn from(&self, samples: usize) -> Instant {
        let due = self.due.checked_sub(AHEAD).unwrap_or(self.due);
        if samples < ENOUGH { due } else { due.min(self.begun) }
    }

    /// A write begins.
    pub(super) fn begin(&mut self, now: Instant) {
        self.begun = now;
        // Writes of many samples do not add up to a debt.
        self.due = (self.due.max(now) + EVERY).min(now + AHEAD + EVERY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// When writes begin that are wanted so far apart, ms after the first.
    fn begun_ms(apart_ms: u64, count: u64) -> Vec<u64> {
        let start = Instant::now();
        let mut pace = Pace::new(start);
        let begin = |k| {
            let now = (start + Duration::from_millis(k * apart_ms)).max(pace.from(1));
            pace.begin(now);
            (now - start).as_millis() as u64
        };
        (0..count).map(begin).collect()
    }

    #[test]
    fn two_feet_never_wait_and_a_sample_in_each_frame_makes_fifty_writes_a_second() {
        let feet = begun_ms(25, 400);
        assert!(feet.iter().zip(0..).all(|(begun, k)| *begun == k * 25));
        let samples = begun_ms(2, 500);
        let in_the_last_second = samples.iter().filter(|begun| **begun > samples[499] - 1000).count();
        assert_eq!(in_the_last_second, 50);
    }

    #[test]
    fn who_sends_many_samples_and_waits_for_each_answer_is_not_held_back() {
        let start = Instant::now();
        let mut pace = Pace::new(start);
        (0..1000).for_each(|_| pace.begin(start));
        assert!(pace.from(100) <= start);
        assert!(pace.from(1) <= start + EVERY);
    }
}
