//! Which epochs of a track are stored and which are shown: the first one of each cell of a fixed grid in time.
//!
//! The choice depends on the epochs' times alone, so that a session that is rebuilt from its log
//! stores and shows the same ones; and a correction moves exactly the points that were told before.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::sessions::thinning::{cell_ns, cell_of};

/// At most this many points are shown each second: enough for a walking pace.
const SHOWN_HZ: i64 = 5;
/// How long a chosen epoch is remembered for corrections, ns: longer than the trail that is corrected live, which is five
/// minutes and the rest of a sixth.
const MEMORY_NS: i64 = 400_000_000_000;

/// What becomes of an epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// It lies between the grid's points.
    Skipped,
    /// It is stored.
    Stored,
    /// It is stored and shown.
    Shown,
}

/// The epochs that were chosen so far.
#[derive(Clone, Debug)]
pub(crate) struct Thinning {
    stored_cell_ns: i64,
    /// A multiple of the stored cell, so that a shown point is always a stored one.
    shown_cell_ns: i64,
    /// The recent stored epochs, oldest first.
    recent: VecDeque<Chosen>,
    last_shown_ns: Option<i64>,
}

/// What is saved of it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct SavedThinning {
    newest: Option<(i64, bool)>,
    last_shown_ns: Option<i64>,
}

/// A stored epoch's time, ns, and in the lowest bit whether it was shown: there are thousands of them for each walk.
#[derive(Clone, Copy, Debug)]
struct Chosen(i64);

impl Chosen {
    fn new(t_ns: i64, shown: bool) -> Chosen {
        Chosen(t_ns << 1 | i64::from(shown))
    }

    fn t_ns(self) -> i64 {
        self.0 >> 1
    }

    fn shown(self) -> bool {
        self.0 & 1 == 1
    }
}

impl Thinning {
    /// A grid that stores at most so many points a second.
    pub(crate) fn new(stored_hz: f64) -> Thinning {
        let stored_cell_ns = cell_ns(stored_hz);
        let shown_cell_ns =
            ((1_000_000_000 / SHOWN_HZ + stored_cell_ns - 1) / stored_cell_ns) * stored_cell_ns;
        Thinning { stored_cell_ns, shown_cell_ns, recent: VecDeque::new(), last_shown_ns: None }
    }

    /// What the next choices depend on.
    pub(crate) fn saved(&self) -> SavedThinning {
        let newest = self.recent.back().map(|chosen| (chosen.t_ns(), chosen.shown()));
        SavedThinning { newest, last_shown_ns: self.last_shown_ns }
    }

    /// A grid that chooses on as the one that was saved, and does not know what that chose before.
    pub(crate) fn restored(stored_hz: f64, saved: SavedThinning) -> Thinning {
        let recent = saved.newest.map(|(t_ns, shown)| Chosen::new(t_ns, shown)).into_iter().collect();
        Thinning { recent, last_shown_ns: saved.last_shown_ns, ..Thinning::new(stored_hz) }
    }

    /// Chooses about a new epoch; epochs come in the order of their times.
    pub(crate) fn choose(&mut self, t_ns: i64) -> Choice {
        let in_new_cell =
            |last: Option<i64>, cell: i64| last.is_none_or(|last| cell_of(last, cell) < cell_of(t_ns, cell));
        if !in_new_cell(self.recent.back().map(|chosen| chosen.t_ns()), self.stored_cell_ns) {
            return Choice::Skipped;
        }
        let shown = in_new_cell(self.last_shown_ns, self.shown_cell_ns);
        if shown {
            self.last_shown_ns = Some(t_ns);
        }
        self.recent.push_back(Chosen::new(t_ns, shown));
        while self.recent.front().is_some_and(|oldest| oldest.t_ns() < t_ns - MEMORY_NS) {
            self.recent.pop_front();
        }
        if shown { Choice::Shown } else { Choice::Stored }
    }

    /// What was chosen about an epoch that is now corrected.
    pub(crate) fn chosen(&self, t_ns: i64) -> Choice {
        match self.recent.binary_search_by_key(&t_ns, |chosen| chosen.t_ns()) {
            Ok(found) if self.recent[found].shown() => Choice::Shown,
            Ok(_) => Choice::Stored,
            Err(_) => Choice::Skipped,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_epochs_a_second_are_stored_at_ten_and_shown_at_five() {
        let mut grid = Thinning::new(10.0);
        let choices: Vec<_> = (0..200).map(|i| grid.choose(i * 10_000_000)).collect();
        assert_eq!(choices.iter().filter(|c| **c != Choice::Skipped).count(), 20);
        assert_eq!(choices.iter().filter(|c| **c == Choice::Shown).count(), 10);
        assert_eq!(choices[0], Choice::Shown);
        assert_eq!(choices[10], Choice::Stored);
        assert_eq!(choices[20], Choice::Shown);
    }

    #[test]
    fn a_correction_meets_the_epochs_that_were_chosen() {
        let mut grid = Thinning::new(10.0);
        let times: Vec<i64> = (0..500).map(|i| 3_700_000 + i * 9_900_000).collect();
        let first: Vec<_> = times.iter().map(|t| grid.choose(*t)).collect();
        let again: Vec<_> = times.iter().map(|t| grid.chosen(*t)).collect();
        assert_eq!(first, again);
        assert_eq!(grid.chosen(-1), Choice::Skipped);
    }

    #[test]
    fn a_slower_log_is_kept_whole_and_a_hole_shifts_nothing() {
        let mut grid = Thinning::new(10.0);
        assert_eq!(grid.choose(0), Choice::Shown);
        // The even cell after the hole is empty: the first epoch of the odd one is shown instead.
        assert_eq!(grid.choose(910_000_000), Choice::Shown);
        assert_eq!(grid.choose(1_010_000_000), Choice::Shown);
        assert_eq!(grid.choose(1_110_000_000), Choice::Stored);
    }
}
