//! A streamed session's state as it is saved and taken up.
//!
//! A cabin looks back to nothing but what its state holds (0.8 s of the strapdown, 24 readings of the encoders), so a session that is
//! restored goes on to the bit from its very next reading. Rows of complete logs, and what is smoothed, are not saved: those
//! are computed in one go.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::intake::Intake;
use super::lead::Lead;
use super::plan::Plan;
use super::points::Pairs;
use super::session::CabinSession;
use super::system::Cabin;
use super::weighing::Weighing;
use crate::system::{NotRestored, Progress, SessionConfig};

/// Between two states, ns.
const SAVED_EVERY_NS: i64 = 90_000_000_000;

/// What changes while a session goes on.
#[derive(Debug, Serialize, Deserialize)]
struct Saved<S, I, P, N, L> {
    told: [u8; 32],
    session: S,
    intakes: I,
    troubles_told: [[bool; 3]; 3],
    lead: L,
    pairs: P,
    weighing: Weighing,
    plan: N,
    newest_ns: i64,
    progress: Progress,
    counted_n_m: Option<[f64; 3]>,
}

/// A hash of what a session is told at its start and its state rests on.
pub(super) fn told(session: &SessionConfig) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(session.instrument.as_deref().unwrap_or_default());
    for stream in &session.streams {
        hash.update([0]);
        hash.update(stream.id.name());
    }
    hash.update(format!("{:?} {:?}", session.solution, session.system.aids()));
    hash.finalize().into()
}

impl Cabin {
    /// The state to be saved now, every minute and a half of a streamed session, with its time, ns; `None` between.
    pub(super) fn saved(&mut self) -> Option<(i64, Vec<u8>)> {
        let session = self.filtered.as_ref().filter(|_| self.is_live())?;
        let is_due = |saved_ns: i64| self.newest_ns >= saved_ns.saturating_add(SAVED_EVERY_NS);
        if session.epochs() == 0 || !self.saved_ns.is_none_or(is_due) {
            return None;
        }
        let saved = Saved {
            told: self.told,
            session,
            intakes: &self.intakes,
            troubles_told: self.troubles_told,
            lead: &self.lead,
            pairs: &self.pairs,
            weighing: self.weighing,
            plan: &self.plan,
            newest_ns: self.newest_ns,
            progress: self.progress,
            counted_n_m: self.counted_n_m,
        };
        let bytes = postcard::to_allocvec(&saved).ok()?;
        self.saved_ns = Some(self.newest_ns);
        Some((self.newest_ns, bytes))
    }

    /// The session whose state this is, begun with what it was told.
    pub(super) fn restored(mut self, bytes: &[u8]) -> Result<Cabin, NotRestored> {
        if !self.is_live() {
            return Err(NotRestored("a session that is not live".to_owned()));
        }
        let saved: Saved<Box<CabinSession>, [Intake; 3], Pairs, Plan, Lead> =
            postcard::from_bytes(bytes).map_err(|error| NotRestored(error.to_string()))?;
        if saved.told != self.told {
            return Err(NotRestored(
                "the state of a session with another instrument or other streams".to_owned(),
            ));
        }
        self.filtered = Some(saved.session);
        self.intakes = saved.intakes;
        self.troubles_told = saved.troubles_told;
        self.lead = saved.lead;
        self.pairs = saved.pairs;
        self.weighing = saved.weighing;
        self.plan = saved.plan;
        self.newest_ns = saved.newest_ns;
        self.progress = saved.progress;
        self.counted_n_m = saved.counted_n_m;
        self.saved_ns = Some(saved.newest_ns);
        Ok(self)
    }
}
