//! What live sessions found out, many of them in a few statements: each statement costs as much as several rows.

use lodestep_engine::event::{TrackPoint, VisitOutcome};
use lodestep_engine::session::Summary;
use uuid::Uuid;

use super::anomalies::Gathered;
use super::dialect::Connection;
use super::live_states::{self, LiveState};
use super::raw_chunks::{Packed, Samples};
use super::stands::{self, Stand};
use super::track::{self, Place, TrackKind};
use super::visits::Visit;
use super::{StoreError, anomalies, sessions, stream_chunks, visits, webhook_deliveries};

/// So much of a walk's states is kept, ns: there is one every two minutes, and from the newest a session looks back
/// over five; two of those before are enough.
const STATES_KEPT_NS: i64 = 600_000_000_000;

/// What a live session found out and wants on disk, all or nothing.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// The walk.
    pub session_id: Uuid,
    /// Its samples, as they came.
    pub raw: Vec<Samples>,
    /// Where its result lies.
    pub place: Place,
    /// New points of its main run.
    pub points: Vec<TrackPoint>,
    /// Points that were corrected in hindsight; those that are not stored are passed over.
    pub revised: Vec<TrackPoint>,
    /// Where its inspector stood.
    pub stands: Vec<Stand>,
    /// Visits that automatic mode has made.
    pub automatic: Vec<Visit>,
    /// What became of its visits.
    pub visits: Vec<VisitOutcome>,
    /// What was found wrong.
    pub anomalies: Vec<Gathered>,
    /// What goes into the last row of its kind and stream.
    pub more_anomalies: Vec<Gathered>,
    /// What it amounts to so far.
    pub summary: Option<Summary>,
    /// Its state after all of these samples.
    pub state: Option<LiveState>,
}

/// A record with its samples packed.
#[derive(Debug)]
pub(super) struct PackedRecord {
    record: Record,
    raw: Vec<Packed>,
}

impl PackedRecord {
    /// Packs the samples; done by the caller's thread, so that the one writer only writes.
    pub(super) fn new(mut record: Record) -> Result<PackedRecord, StoreError> {
        let raw = record.raw.iter().map(Packed::new).collect::<Result<Vec<_>, _>>()?;
        record.raw = Vec::new();
        Ok(PackedRecord { record, raw })
    }

    /// How many bytes its samples and its state take in their tables.
    pub(super) fn bytes(&self) -> usize {
        let state = self.record.state.as_ref().map_or(0, |state| state.body.len());
        self.raw.iter().map(Packed::bytes).sum::<usize>() + state
    }
}

/// Writes records, in their order. An error leaves it open which part of them was written: the caller takes all back.
pub(super) async fn write(db: &mut Connection, records: &[&PackedRecord]) -> Result<(), StoreError> {
    let ids: Vec<String> = records.iter().map(|packed| packed.record.session_id.to_string()).collect();
    let with_ids = || records.iter().zip(ids.iter().map(String::as_str));
    let raw = with_ids().flat_map(|(packed, id)| packed.raw.iter().map(move |chunk| (id, chunk))).collect();
    stream_chunks::insert(db, raw).await?;
    let points = with_ids().flat_map(|(packed, id)| {
        packed.record.points.iter().map(move |point| (id, packed.record.place, point))
    });
    track::upsert_of(db, TrackKind::Main, &points.collect::<Vec<_>>()).await?;
    for PackedRecord { record, .. } in records {
        let id = record.session_id;
        track::revise(db, id, (TrackKind::Main, record.place), &record.revised).await?;
        stands::upsert(&mut *db, id, &record.stands).await?;
        for visit in &record.automatic {
            visits::insert(&mut *db, visit).await?;
        }
        for told in &record.visits {
            visits::set_outcome(&mut *db, id, told).await?;
        }
        anomalies::insert(db, id, &record.anomalies).await?;
        for more in &record.more_anomalies {
            anomalies::add_to_last(&mut *db, id, more).await?;
        }
        webhook_deliveries::announce_anomalies(&mut *db, id, &record.anomalies).await?;
        if let Some(state) = &record.state {
            live_states::save(&mut *db, id, state, STATES_KEPT_NS).await?;
        }
    }
    let summaries =
        with_ids().filter_map(|(packed, id)| packed.record.summary.as_ref().map(|told| (id, told)));
    sessions::set_summaries(db, &summaries.collect::<Vec<_>>()).await
}
