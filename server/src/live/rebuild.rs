//! Makes a live session's walk again from what is on disk.
//!
//! The engine is a function of what it is given, so samples and visits are given in the order in which
//! they were taken the first time; the walk then goes on as if the server had never stopped.

use futures_util::TryStreamExt;
use lodestep_engine::sample::Foot;
use lodestep_engine::session::SessionConfig;
use lodestep_engine::systems::pedestrian::Attic;
use uuid::Uuid;

use super::sequence::Sequence;
use super::walk::{Findings, Walk};
use crate::store::stream_visits::{self, StreamVisit};
use crate::store::{Store, StoreError, stream_chunks};

/// A walk, and where its device goes on.
#[derive(Debug)]
pub(super) struct Rebuilt {
    pub(super) walk: Walk,
    /// All that it found on the way.
    pub(super) findings: Findings,
    /// By foot.
    pub(super) sequences: [Sequence; 2],
    /// Visits that the walk has been told.
    pub(super) told: Vec<StreamVisit>,
}

/// Replays the stored stream of a session.
pub(super) async fn from_store(
    store: &Store,
    session_id: Uuid,
    config: SessionConfig,
    stored_hz: f64,
    attic: Box<dyn Attic>,
) -> Result<Rebuilt, StoreError> {
    let told = stream_visits::of_session(store.read(), session_id).await?;
    let mut walk = Walk::new(config, stored_hz);
    walk.put_past_in(attic);
    let mut findings = Findings::default();
    let mut next = [0; 2];
    let mut visits = told.iter().peekable();
    let chunks = stream_chunks::as_received(store.read(), session_id);
    let mut chunks = std::pin::pin!(chunks);
    while let Some(chunk) = chunks.try_next().await? {
        while let Some(earlier) = visits.next_if(|visit| visit.after_samples <= walk.samples_taken()) {
            findings.add(walk.visit(earlier.for_engine()));
        }
        findings.add(walk.take(chunk.foot, &chunk.samples));
        next[chunk.foot.index()] = chunk.first_sequence + chunk.sequences;
    }
    for visit in visits {
        findings.add(walk.visit(visit.for_engine()));
    }
    let sequences = Foot::BOTH.map(|foot| Sequence::resumed_at(next[foot.index()]));
    Ok(Rebuilt { walk, findings, sequences, told })
}
