//! Makes a live session's walk again from what is on disk.
//!
//! The engine is a function of what it is given, so samples and visits are given in the order in which
//! they were taken the first time; the walk then goes on as if the server had never stopped. It is given all of them, or a
//! state that was saved some minutes before the end of the walk and what came after: either way it comes to the same.

use std::collections::BTreeMap;

use futures_util::{Stream, TryStreamExt};
use lodestep_engine::session::{SOURCES, SessionConfig};
use lodestep_engine::stream::StreamId;
use sha2::{Digest, Sha256};
use uuid::Uuid;

use super::live_session::{Findings, LiveSession};
use super::sequence::Sequence;
use crate::sessions::provenance::hex;
use crate::state::App;
use crate::store::raw_chunks::Samples;
use crate::store::sessions::Session;
use crate::store::stream_visits::{self, StreamVisit};
use crate::store::{StoreError, live_states, stream_chunks};

/// The layout of a saved state is that of the private parts of these files.
const LAYOUT: [&str; 2] = [include_str!("live_session.rs"), include_str!("thinning.rs")];

/// A walk, and where its device goes on.
#[derive(Debug)]
pub(super) struct Rebuilt {
    pub(super) walk: LiveSession,
    /// What it found on the way.
    pub(super) findings: Findings,
    /// By stream.
    pub(super) sequences: BTreeMap<StreamId, Sequence>,
    /// Visits that the walk has been told.
    pub(super) told: Vec<StreamVisit>,
    /// What may take up the states that it will save.
    pub(super) fits: String,
}

/// What a walk is told beside its samples.
#[derive(Clone, Debug)]
pub(super) struct Told {
    config: SessionConfig,
    stored_hz: f64,
    visits: Vec<StreamVisit>,
    /// Names the program and all of the above but the visits.
    fits: String,
}

impl Told {
    pub(super) async fn of(app: &App, session: &Session) -> Result<Told, StoreError> {
        let db = app.store.read();
        let config = super::hello::session_config(app, session).await?;
        let stored_hz = app.config.track_rate_hz;
        let fits = fits(&config, stored_hz);
        Ok(Told { config, stored_hz, visits: stream_visits::of_session(db, session.id).await?, fits })
    }
}

/// Names this program and what a walk is told at its start, but for the markers: whatever it saves calls them by name, and
/// which of them its stands may have been at is thought over again with those that there are now.
fn fits(config: &SessionConfig, stored_hz: f64) -> String {
    let mut config = config.clone();
    if let Some(identification) = &mut config.identification {
        identification.markers = Default::default();
    }
    let mut hash = Sha256::new();
    hash.update(SOURCES);
    for source in LAYOUT {
        hash.update(source);
    }
    hash.update(format!("{config:?} {stored_hz}"));
    hex(&hash.finalize())
}

/// Replays the whole stored stream of a session.
pub(super) async fn from_all_samples(
    app: &App,
    session_id: Uuid,
    told: &Told,
) -> Result<Rebuilt, StoreError> {
    let inputs = Box::new(app.input_file.of_session());
    let walk = LiveSession::new(told.config.clone(), told.stored_hz, Some(inputs)).map_err(|error| {
        StoreError::Damaged { what: format!("the streams of session {session_id}"), why: error.to_string() }
    })?;
    let chunks = stream_chunks::as_received(app.store.read(), session_id);
    replay(walk, BTreeMap::new(), 0, told, chunks).await
}

/// Replays what came after a saved state from before all that the walk can look back to; `None` where there is none, as in
/// the first minutes of a walk, or after a new release.
pub(super) async fn from_a_saved_state(
    app: &App,
    session_id: Uuid,
    told: &Told,
) -> Result<Option<Rebuilt>, StoreError> {
    let db = app.store.read();
    let before_ns = told.config.system.looks_back_ns();
    for state in live_states::from_before_the_newest(db, session_id, &told.fits, before_ns).await? {
        let inputs = Box::new(app.input_file.of_session());
        let Some(walk) = LiveSession::restored(told.config.clone(), told.stored_hz, inputs, &state) else {
            tracing::warn!(session = %session_id, "a saved state could not be read: the walk is made from its samples");
            continue;
        };
        let chunks = stream_chunks::as_received_from(db, session_id, &state.next_sequences);
        let rebuilt = replay(walk, state.next_sequences, state.samples, told, chunks).await?;
        if !rebuilt.walk.lacks_past() {
            metrics::counter!("lodestep_live_states_taken_up_total").increment(1);
            return Ok(Some(rebuilt));
        }
    }
    Ok(None)
}

/// Gives a walk that has taken so many samples what came after: `next` is the next batch of each stream.
async fn replay(
    mut walk: LiveSession,
    mut next: BTreeMap<StreamId, u64>,
    samples: u64,
    told: &Told,
    chunks: impl Stream<Item = Result<Samples, StoreError>>,
) -> Result<Rebuilt, StoreError> {
    let mut findings = Findings::default();
    // A state is saved with samples, and a visit comes after those that are on disk: one at the same place is later.
    let taken = told.visits.partition_point(|visit| visit.after_samples < samples);
    let mut visits = told.visits[taken..].iter().peekable();
    let mut chunks = std::pin::pin!(chunks);
    while let Some(chunk) = chunks.try_next().await? {
        while let Some(earlier) = visits.next_if(|visit| visit.after_samples <= walk.samples_taken()) {
            findings.add(walk.visit(earlier.for_engine()));
        }
        findings.add(walk.take(chunk.stream, &chunk.readings));
        next.insert(chunk.stream, chunk.first_sequence + chunk.sequences);
    }
    for visit in visits {
        findings.add(walk.visit(visit.for_engine()));
    }
    // A device of a system that is older than streams reads all of the system's streams, whichever the session has.
    let declared = told.config.system.declaration().usual_streams().into_iter().map(|stream| stream.id);
    let streams = declared.chain(told.config.streams.iter().map(|stream| stream.id));
    let resumed = |stream: StreamId| Sequence::resumed_at(next.get(&stream).copied().unwrap_or(0));
    let sequences = streams.map(|stream| (stream, resumed(stream))).collect();
    Ok(Rebuilt { walk, findings, sequences, told: told.visits.clone(), fits: told.fits.clone() })
}
