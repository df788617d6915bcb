//! What is saved of a history, and a history made of that: one that knows nothing of what came before.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::{History, Snapshot};
use crate::session::Visit;
use crate::systems::pedestrian::filter::Setting;
use crate::systems::pedestrian::kept_step::KeptStep;
use crate::systems::pedestrian::smoothing::{Mark, Smoothing, StretchStart};
use crate::systems::pedestrian::steps::{Attic, Steps};

/// What is saved of a live walk's filter: where the newest stretch of its trail began, and the steps since.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SavedHistory<const B: usize, const F: usize> {
    start: StretchStart<B, F>,
    /// From the one before the stretch's first on.
    steps: Vec<KeptStep>,
    visits: Vec<(Visit, bool)>,
    told_points: u64,
}

impl<const B: usize, const F: usize> SavedHistory<B, F> {
    /// When the stretch began, ns.
    pub(crate) fn t_ns(&self) -> i64 {
        self.start.first_ns
    }
}

impl<const B: usize, const F: usize> History<B, F> {
    /// What is to be saved, when a stretch of the trail has begun since the last time that this was asked.
    pub(crate) fn saved(&mut self) -> Option<SavedHistory<B, F>> {
        if !std::mem::take(&mut self.stretch_begun) {
            return None;
        }
        let start = self.smoothing.as_ref()?.newest_start()?;
        let first = start.first.checked_sub(1)?;
        self.steps.bring_back(first);
        let steps = self.steps.from(first)?;
        Some(SavedHistory { start, steps, visits: self.visits.clone(), told_points: self.told_points })
    }

    /// The history as it was when it was saved, but for what came before the stretch; `None` where the two do not fit.
    pub(crate) fn restored(
        setting: Setting,
        saved: SavedHistory<B, F>,
        attic: Option<Box<dyn Attic>>,
    ) -> Option<Self> {
        let SavedHistory { start, steps, visits, told_points } = saved;
        let next = start.first;
        let first = next.checked_sub(1)?;
        let before_ns = steps.first()?.t_ns;
        if steps.iter().any(|step| step.sensor() >= F) {
            return None;
        }
        let newest = Snapshot {
            next,
            before_ns,
            mark: Mark::before(start.first_weighed),
            filter: Box::new(start.filter.clone()),
        };
        let seen = first + steps.len() as u64;
        let mut history = History {
            setting,
            filter: start.filter.clone(),
            checkpoints: VecDeque::from([newest]),
            smoothing: Some(Smoothing::restored(start)),
            way_back: None,
            trail_bends: false,
            steps: Steps::restored(attic, first, steps),
            next,
            told_points,
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
