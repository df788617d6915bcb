//! The state of a live session, saved so that a server that starts again need not go over the whole walk.
//!
//! It is not all that a session knows: what only a look back needs (steps, checkpoints, stretches of the trail before the
//! newest one) is left out, some dozens of kilobytes remain. A session that is restored and given what came after is the one that
//! was never cut as soon as all that it looks back to came after; until then it has told nothing that differs, unless
//! it says that it [lacks its past](Session::lacks_past).

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{EpochGrouping, Session, SessionConfig, Solution, Summary, Walk};
use crate::identify::stands::Stands;
use crate::replay::InputStore;
use crate::replay::history::{self, History, SavedHistory};
use crate::systems::pedestrian::filter::{Filter, Setting};
use crate::systems::pedestrian::kept_step::KeptStep;
use crate::systems::pedestrian::line::FootLine;
use crate::systems::pedestrian::slow_errors::blocks;

/// Names the sources that this engine was built from. What another engine saved is not to be given to this one: the
/// layout of a saved state is that of its own private parts.
pub const SOURCES: &str = env!("LODESTEP_ENGINE_SOURCES");

/// Why a saved state could not be taken up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected the state of a session as this engine saves it, found {0}: give the session all of its samples"
)]
pub struct NotRestored(String);

#[derive(Debug, Serialize, Deserialize)]
struct Saved<'a> {
    lines: Cow<'a, [FootLine]>,
    walk: SavedWalk,
    summary: Summary,
    merged_ns: i64,
    epoch: EpochGrouping,
    first_point_ns: Option<i64>,
    stands: Option<Cow<'a, Stands>>,
}

#[derive(Debug, Serialize, Deserialize)]
enum SavedWalk {
    OneFoot(Box<SavedHistory<Filter<{ blocks(1) }, 1>, KeptStep>>),
    TwoFeet(Box<SavedHistory<Filter<{ blocks(2) }, 2>, KeptStep>>),
}

impl Session {
    /// The state to be saved now, once for every minute of a live walk; `None` between. A restored session that is given
    /// what came after needs so much of it that another state could be saved [`Self::LOOKS_BACK_NS`] after this one's time.
    pub fn state_to_save(&mut self) -> Option<SavedState> {
        let (walk, t_ns) = match &mut self.walk {
            Walk::Waiting => return None,
            Walk::OneFoot(history) => {
                let saved = history.saved()?;
                let t_ns = saved.t_ns();
                (SavedWalk::OneFoot(Box::new(saved)), t_ns)
            }
            Walk::TwoFeet(history) => {
                let saved = history.saved()?;
                let t_ns = saved.t_ns();
                (SavedWalk::TwoFeet(Box::new(saved)), t_ns)
            }
        };
        let saved = Saved {
            lines: Cow::Borrowed(&self.lines),
            walk,
            summary: self.summary,
            merged_ns: self.merged_ns,
            epoch: self.epoch,
            first_point_ns: self.first_point_ns,
            stands: self.stands.as_deref().map(Cow::Borrowed),
        };
        let mut bytes = vec![0; CHECK_BYTES];
        bytes = postcard::to_extend(&saved, bytes).ok()?;
        let check = check(&bytes[CHECK_BYTES..]);
        bytes[..CHECK_BYTES].copy_from_slice(&check);
        Some(SavedState { t_ns, bytes })
    }

    /// A live session looks back so far, ns: a state that was saved longer than this before another one was is enough for
    /// a session that is the same.
    pub const LOOKS_BACK_NS: i64 = history::LOOKS_BACK_NS;

    /// The session whose state this is, told the same at its start, but for the markers, which may be others by now; it goes
    /// on with the samples and visits that came after.
    ///
    /// # Errors
    ///
    /// Where the bytes are not a state that this engine ([`SOURCES`]) has saved, or not one of such a session.
    pub fn restored(
        config: SessionConfig,
        bytes: &[u8],
        store: Option<Box<dyn InputStore>>,
    ) -> Result<Session, NotRestored> {
        let (told, bytes) = bytes.split_at_checked(CHECK_BYTES).ok_or_else(|| damaged(bytes.len()))?;
        if told != check(bytes) {
            return Err(damaged(CHECK_BYTES + bytes.len()));
        }
        let saved: Saved<'_> = postcard::from_bytes(bytes).map_err(|error| NotRestored(error.to_string()))?;
        if config.solution != Solution::Trail {
            return Err(NotRestored("a session that is not live".to_owned()));
        }
        let Saved { lines, walk, summary, merged_ns, epoch, first_point_ns, stands } = saved;
        let mut lines = lines.into_owned();
        for line in &mut lines {
            line.reopen(&config.tuning);
        }
        let setting = Setting::new(&config, &lines);
        let misfit = || NotRestored("steps that do not belong together".to_owned());
        let walk = match walk {
            SavedWalk::OneFoot(saved) if lines.len() == 1 => Walk::OneFoot(Box::new(
                History::restored(setting, *saved, store, |step| step.sensor() < 1).ok_or_else(misfit)?,
            )),
            SavedWalk::TwoFeet(saved) if lines.len() == 2 => Walk::TwoFeet(Box::new(
                History::restored(setting, *saved, store, |step| step.sensor() < 2).ok_or_else(misfit)?,
            )),
            _ => return Err(misfit()),
        };
        let stands = match (&config.identification, stands) {
            (Some(identification), Some(saved)) => {
                Some(Box::new(saved.into_owned().told_again(identification)))
            }
            (None, None) => None,
            _ => return Err(NotRestored("other knowledge of markers".to_owned())),
        };
        Ok(Session {
            config,
            store: None,
            lines,
            walk,
            early_visits: Vec::new(),
            summary,
            merged_ns,
            epoch,
            first_point_ns,
            stands,
        })
    }

    /// Whether a visit reached back to before what a restored session knows: it has to be made again from an older state, or
    /// from all of its samples.
    pub fn lacks_past(&self) -> bool {
        match &self.walk {
            Walk::Waiting => false,
            Walk::OneFoot(history) => history.lacks_past(),
            Walk::TwoFeet(history) => history.lacks_past(),
        }
    }
}

/// So much of the hash of a state stands before it: what was damaged is refused, not believed.
const CHECK_BYTES: usize = 8;

fn check(bytes: &[u8]) -> [u8; CHECK_BYTES] {
    let hash: [u8; 32] = Sha256::digest(bytes).into();
    std::array::from_fn(|k| hash[k])
}

fn damaged(bytes: usize) -> NotRestored {
    NotRestored(format!("{bytes} bytes that were cut or altered"))
}

/// A state that was saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SavedState {
    /// The time from which on the session would know its past, ns.
    pub t_ns: i64,
    /// For [`Session::restored`].
    pub bytes: Vec<u8>,
}
