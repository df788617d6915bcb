//! What an actor hands to the writer, and what follows when that is on disk.
//!
//! Never are batches sent to the disk while others are on their way: if those failed, there would be a hole.

use std::collections::BTreeMap;
use std::time::Duration;

use futures_util::StreamExt;
use futures_util::future::FutureExt;
use lodestep_engine::parse::live_message::Answer;
use lodestep_engine::stream::StreamId;
use tokio::time::Instant;

use super::actor::{Actor, Go};
use super::device;
use super::live_session::Findings;
use crate::error::{Error, Result};
use crate::store::Record;
use crate::store::live_states::LiveState;
use crate::store::raw_chunks::Samples;
use crate::store::stands::Stand;
use crate::store::visits::Visit;
use crate::wire::Change;

/// In a crowd new points, and how far the walk has come, are written this often: what they follow from is on disk with
/// each acknowledgement, and a thousand walks have as many pages on which their points go on.
const POINTS_EVERY: Duration = Duration::from_secs(2);

/// Batches that were taken, and what came out of them.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) raw: Vec<Samples>,
    pub(super) findings: Findings,
    pub(super) automatic: Vec<Visit>,
    pub(super) then: Then,
    pub(super) samples: usize,
}

/// A write that has ended, and what was to follow it.
pub(super) struct Written {
    result: Result<()>,
    submitted_at: Instant,
    then: Then,
}

/// What follows when something is on disk.
#[derive(Default)]
pub(super) struct Then {
    /// The last batch of each stream that is in it.
    pub(super) batches: BTreeMap<StreamId, u64>,
    pub(super) answers: Vec<Answer>,
    pub(super) changes: Vec<Change>,
    pub(super) finished: bool,
}

impl Actor {
    /// Hands what was gathered to the writer, when nothing is on its way.
    pub(super) fn write_gathered(&mut self) {
        if self.gathered.raw.is_empty() {
            return;
        }
        debug_assert!(self.underway.is_empty(), "batches never follow batches that may yet fail");
        self.pace.begin(Instant::now());
        let Gathered { raw, findings, automatic, then, .. } = std::mem::take(&mut self.gathered);
        self.record(raw, findings, automatic, then);
    }

    /// Hands samples and what came out of them to the writer.
    pub(super) fn record(
        &mut self,
        raw: Vec<Samples>,
        findings: Findings,
        automatic: Vec<Visit>,
        then: Then,
    ) {
        let mut findings = findings;
        self.points.append(&mut findings.points);
        let all = raw.is_empty()
            || findings.revised
            || self.points_at.elapsed() >= POINTS_EVERY
            || !self.app.store.writer().is_crowded();
        let (points, summary) = if all {
            self.points_at = Instant::now();
            (std::mem::take(&mut self.points), Some(self.walk.summary()))
        } else {
            (BTreeMap::new(), None)
        };
        // Only here has the walk taken just what is on disk, or on its way there with it.
        let state = if raw.is_empty() { None } else { self.state_to_save() };
        let record = Record {
            session_id: self.session.id,
            place: self.place,
            raw,
            points: points.into_values().collect(),
            revised: Vec::new(),
            stands: findings.stands.values().map(Stand::from).collect(),
            automatic,
            anomalies: findings.new_anomalies().collect(),
            visits: findings.visits,
            more_anomalies: findings.more_anomalies,
            summary,
            state,
        };
        let writer = self.app.store.writer().clone();
        self.submit(async move { writer.record(record).await }, then);
    }

    fn state_to_save(&mut self) -> Option<LiveState> {
        let (t_ns, body) = self.walk.state_to_save()?;
        Some(LiveState {
            t_ns,
            fits: self.fits.clone(),
            samples: self.walk.samples_taken(),
            next_sequences: self.sequences.iter().map(|(id, stream)| (*id, stream.next_taken())).collect(),
            body,
        })
    }

    pub(super) fn submit<E: Into<Error>>(
        &mut self,
        write: impl Future<Output = Result<(), E>> + Send + 'static,
        then: Then,
    ) {
        let submitted_at = Instant::now();
        let written = async move { Written { result: write.await.map_err(Into::into), submitted_at, then } };
        self.underway.push_back(written.boxed());
    }

    /// Something is on disk, or is not.
    pub(super) fn on_written(&mut self, first: Written) -> Go {
        let mut acknowledged = BTreeMap::new();
        let mut next = Some(first);
        let mut go = Go::On;
        while let Some(Written { result, submitted_at, then }) = next.take() {
            metrics::histogram!("lodestep_live_commit_seconds").record(submitted_at.elapsed().as_secs_f64());
            if let Err(error) = result {
                // What is on disk and what the walk has taken have parted: start again from the disk. What was taken
                // after it has not been acknowledged, and comes again.
                self.gathered = Gathered::default();
                self.points.clear();
                let told = device::told(error.into_problem());
                self.last_answer(told);
                return Go::Ended;
            }
            for (stream, sequence) in then.batches {
                self.sequences.entry(stream).or_default().on_disk(sequence);
                acknowledged.insert(stream, Answer::Ack { stream, sequence });
            }
            self.app.hub.publish_all(then.changes);
            for answer in then.answers {
                self.answer(answer);
            }
            if then.finished {
                go = Go::Ended;
            }
            // One acknowledgement stands for all batches of one commit.
            next = self.underway.next().now_or_never().flatten();
        }
        for answer in acknowledged.into_values() {
            metrics::counter!("lodestep_live_acks_total").increment(1);
            self.answer(answer);
        }
        if let Go::Ended = go {
            self.last_answer(Answer::Finished);
        }
        go
    }

    /// Waits until all that was taken, and what came out of it, is on disk.
    pub(super) async fn all_on_disk(&mut self) -> Go {
        loop {
            while let Some(written) = self.underway.next().await {
                if let Go::Ended = self.on_written(written) {
                    return Go::Ended;
                }
            }
            if !self.gathered.raw.is_empty() {
                self.write_gathered();
            } else if !self.points.is_empty() {
                self.record(Vec::new(), Findings::default(), Vec::new(), Then::default());
            } else {
                return Go::On;
            }
        }
    }
}
