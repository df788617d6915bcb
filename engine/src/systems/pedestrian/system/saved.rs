//! A walk's state as it is saved and taken up.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::{Filters, Pedestrian};
use crate::merge::Epochs;
use crate::replay::InputStore;
use crate::replay::history::{History, SavedHistory};
use crate::system::{NotRestored, SessionConfig, Solution};
use crate::systems::pedestrian::config::Config;
use crate::systems::pedestrian::filter::{Filter, Setting};
use crate::systems::pedestrian::kept_step::KeptStep;
use crate::systems::pedestrian::preprocess::FootLine;
use crate::systems::pedestrian::slow_errors::blocks;

#[derive(Debug, Serialize, Deserialize)]
struct Saved<'a> {
    lines: Cow<'a, [FootLine]>,
    filters: SavedFilters,
    late_samples: u64,
    merged_ns: i64,
    epochs: Epochs<2>,
}

#[derive(Debug, Serialize, Deserialize)]
enum SavedFilters {
    OneFoot(Box<SavedHistory<Filter<{ blocks(1) }, 1>, KeptStep>>),
    TwoFeet(Box<SavedHistory<Filter<{ blocks(2) }, 2>, KeptStep>>),
}

impl Pedestrian {
    /// The state to be saved now, once for every minute of a live walk, with its time, ns; `None` between.
    pub(super) fn saved(&mut self) -> Option<(i64, Vec<u8>)> {
        let (t_ns, filters) = match &mut self.filters {
            Filters::Waiting => return None,
            Filters::OneFoot(history) => {
                let saved = history.saved()?;
                (saved.t_ns(), SavedFilters::OneFoot(Box::new(saved)))
            }
            Filters::TwoFeet(history) => {
                let saved = history.saved()?;
                (saved.t_ns(), SavedFilters::TwoFeet(Box::new(saved)))
            }
        };
        let saved = Saved {
            lines: Cow::Borrowed(&self.lines),
            filters,
            late_samples: self.late_samples,
            merged_ns: self.merged_ns,
            epochs: self.epochs,
        };
        Some((t_ns, postcard::to_allocvec(&saved).ok()?))
    }

    /// The walk whose state this is.
    pub(crate) fn restored(
        session: &SessionConfig,
        config: &Config,
        bytes: &[u8],
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Pedestrian, NotRestored> {
        let saved: Saved<'_> = postcard::from_bytes(bytes).map_err(|error| NotRestored(error.to_string()))?;
        if session.solution != Solution::Trail {
            return Err(NotRestored("a session that is not live".to_owned()));
        }
        let Saved { lines, filters, late_samples, merged_ns, epochs } = saved;
        let mut lines = lines.into_owned();
        for line in &mut lines {
            line.reopen(&config.tuning);
        }
        let setting = Setting::new(session, config, &lines);
        let misfit = || NotRestored("steps that do not belong together".to_owned());
        let filters = match filters {
            SavedFilters::OneFoot(saved) if lines.len() == 1 => Filters::OneFoot(Box::new(
                History::restored(setting, *saved, store, |step| step.sensor() < 1).ok_or_else(misfit)?,
            )),
            SavedFilters::TwoFeet(saved) if lines.len() == 2 => Filters::TwoFeet(Box::new(
                History::restored(setting, *saved, store, |step| step.sensor() < 2).ok_or_else(misfit)?,
            )),
            _ => return Err(misfit()),
        };
        let mut walk = Pedestrian::new(session, config, None);
        walk.lines = lines;
        walk.filters = filters;
        walk.late_samples = late_samples;
        walk.merged_ns = merged_ns;
        walk.epochs = epochs;
        Ok(walk)
    }
}
