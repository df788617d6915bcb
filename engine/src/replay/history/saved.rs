//! What is saved of a history, and a history made of that: one that knows nothing of what came before.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{History, Snapshot};
use crate::replay::filter::{Input, Replayed};
use crate::replay::inputs::{InputStore, Inputs};
use crate::replay::smoothing::{Mark, Smoothing, StretchStart};
use crate::visit::Visit;

/// What is saved of a live session's filter: where the newest stretch of its trail began, and the inputs since.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SavedHistory<F, I> {
    start: StretchStart<F>,
    /// From the one before the stretch's first on.
    inputs: Vec<I>,
    visits: Vec<(Visit, bool)>,
    points: u64,
}

impl<F, I> SavedHistory<F, I> {
    /// When the stretch began, ns.
    pub(crate) fn t_ns(&self) -> i64 {
        self.start.first_ns
    }
}

impl<F: Replayed<B>, const B: usize> History<F, B> {
    /// What is to be saved, when a stretch of the trail has begun since the last time that this was asked.
    pub(crate) fn saved(&mut self) -> Option<SavedHistory<F, F::Input>> {
        if !std::mem::take(&mut self.stretch_begun) {
            return None;
        }
        let start = self.smoothing.as_ref()?.newest_start()?;
        let first = start.first.checked_sub(1)?;
        self.inputs.bring_back(first);
        let inputs = self.inputs.from(first)?;
        Some(SavedHistory { start, inputs, visits: self.visits.clone(), points: self.points })
    }

    /// The history as it was when it was saved, but for what came before the stretch; `None` where the two do not
    /// fit, or an input does not.
    pub(crate) fn restored(
        setting: F::Setting,
        saved: SavedHistory<F, F::Input>,
        store: Option<Box<dyn InputStore>>,
        fits: impl Fn(&F::Input) -> bool,
    ) -> Option<Self> {
        let SavedHistory { start, inputs, visits, points } = saved;
        let next = start.first;
        let first = next.checked_sub(1)?;
        let before_ns = inputs.first()?.t_ns();
        if !inputs.iter().all(fits) {
            return None;
        }
        let newest = Snapshot {
            next,
            before_ns,
            mark: Mark::before(start.first_weighed),
            filter: Box::new(start.filter.clone()),
        };
        let seen = first + inputs.len() as u64;
        let mut history = History {
            setting,
            filter: start.filter.clone(),
            checkpoints: VecDeque::from([newest]),
            smoothing: Some(Smoothing::restored(start)),
            way_back: None,
            trail_bends: false,
            inputs: Inputs::restored(store, first, inputs),
            next,
            points,
            revised: Vec::new(),
            fresh: Vec::new(),
            seen,
            visits,
            t_ns: before_ns,
            stretch_begun: false,
            unknown_until_ns: Some(before_ns),
            lacks_past: false,
        };
        // All of it was told before.
        history.run(&mut Vec::new());
        history.revised.clear();
        history.fresh.clear();
        history.trail_bends = false;
        history.stretch_begun = false;
        Some(history)
    }

    /// Whether it was restored, and a visit wanted to go back to before what was saved: then what it told since is not
    /// what it would have told.
    pub(crate) fn lacks_past(&self) -> bool {
        self.lacks_past
    }
}
