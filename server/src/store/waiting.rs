//! How long what devices have sent waits for the writer: what an inspector in the field feels.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The live records that are not on disk yet, in the order in which they came.
#[derive(Clone, Debug, Default)]
pub(super) struct Waiting(Arc<Mutex<Queue>>);

#[derive(Debug, Default)]
struct Queue {
    next: u64,
    since: BTreeMap<u64, Instant>,
}

/// A record waits for as long as this is held.
#[derive(Debug)]
pub(super) struct Waits<'a>(&'a Waiting, u64);

impl Waiting {
    /// One more waits.
    pub(super) fn begin(&self) -> Waits<'_> {
        let mut queue = self.queue();
        let number = queue.next;
        queue.next += 1;
        queue.since.insert(number, Instant::now());
        Waits(self, number)
    }

    /// How long the one has waited that waits longest.
    pub(super) fn longest(&self) -> Duration {
        self.queue().since.first_key_value().map_or(Duration::ZERO, |(_, since)| since.elapsed())
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Waits<'_> {
    fn drop(&mut self) {
        self.0.queue().since.remove(&self.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_wait_is_that_of_the_oldest_that_still_waits() {
        let waiting = Waiting::default();
        assert_eq!(waiting.longest(), Duration::ZERO);
        let first = waiting.begin();
        std::thread::sleep(Duration::from_millis(2));
        let second = waiting.begin();
        let both = waiting.longest();
        assert!(both >= Duration::from_millis(2), "{both:?}");
        drop(second);
        assert!(waiting.longest() >= both);
        drop(first);
        assert_eq!(waiting.longest(), Duration::ZERO);
    }
}
