//! One stream's raw samples out of the store, a few chunks at a time.

use lodestep_engine::stream::{Kind, Readings, StreamId};
use tokio::runtime::Handle;
use uuid::Uuid;

use super::merge_by_time::StreamReadings;
use crate::store::logs;
use crate::store::raw_chunks::{self, Origin};
use crate::store::{Store, StoreError};

/// Samples held of one stream at a time, at least one chunk.
const SAMPLES_AT_ONCE: u64 = 8_192;

/// Where a stream's samples lie, and how many there are.
#[derive(Clone, Debug)]
pub(crate) struct Recording {
    pub(crate) stream: StreamId,
    pub(crate) origin: Origin,
    pub(crate) samples: u64,
    /// Of a log, over its bytes as they were sent, lower-case hex.
    pub(crate) log_sha256: Option<String>,
}

/// The recording that stands for a stream: the log accepted last, or else the stream.
pub(crate) async fn recording(
    store: &Store,
    session_id: Uuid,
    stream: StreamId,
) -> Result<Option<Recording>, StoreError> {
    let (origin, log_sha256) = match logs::latest_accepted(store.read(), session_id, stream).await? {
        Some(log) => (Origin::Log(log.id), log.sha256),
        None => (Origin::Stream { session_id, stream }, None),
    };
    let samples = raw_chunks::samples(store.read(), origin).await?;
    Ok((samples > 0).then_some(Recording { stream, origin, samples, log_sha256 }))
}

/// Reads a recording from a thread that may block. No connection is held between two reads.
pub(crate) struct StoredSamples {
    store: Store,
    runtime: Handle,
    origin: Origin,
    next_sequence: u64,
    /// Taken off its times: its clock is ahead by so much, ns.
    ahead_ns: i64,
}

impl StoredSamples {
    pub(crate) fn new(store: Store, runtime: Handle, origin: Origin) -> StoredSamples {
        StoredSamples { store, runtime, origin, next_sequence: 0, ahead_ns: 0 }
    }

    /// The same, of a log whose clock is ahead of the session's.
    pub(crate) fn ahead_by(self, ahead_ns: i64) -> StoredSamples {
        StoredSamples { ahead_ns, ..self }
    }
}

impl StreamReadings for StoredSamples {
    fn next_piece(&mut self) -> anyhow::Result<Readings> {
        let mut piece: Option<Readings> = None;
        let next = raw_chunks::next(self.store.read(), self.origin, self.next_sequence, SAMPLES_AT_ONCE);
        for chunk in self.runtime.block_on(next)? {
            self.next_sequence = chunk.first_sequence + chunk.sequences;
            match &mut piece {
                None => piece = Some(chunk.readings),
                Some(piece) => piece.append(chunk.readings),
            }
        }
        let mut piece = piece.unwrap_or_else(|| Readings::none_of(Kind::Imu, 0));
        if let (Readings::Imu(samples), 1.. | ..=-1) = (&mut piece, self.ahead_ns) {
            samples.iter_mut().for_each(|sample| sample.t_ns = sample.t_ns.saturating_sub(self.ahead_ns));
        }
        Ok(piece)
    }
}
