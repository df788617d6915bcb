//! Rot is found before somebody needs what it has eaten: all that is stored is read again, slowly, as long as the server runs.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use time::OffsetDateTime;

use crate::state::App;
use crate::store::{StoreError, scrub};
use crate::utc;

/// After a piece the scrub rests so many times as long as that took: a hundredth of one reader and of the disk.
const RESTS: u32 = 99;
/// At most so long.
const LONGEST_REST: Duration = Duration::from_secs(2);
/// Pause between two rounds, and after a failure.
const NEXT_ROUND_AFTER: Duration = Duration::from_secs(600);
/// Sentences that are kept.
const MOST_KEPT: usize = 100;

/// What the last round has found.
#[derive(Debug, Default)]
pub(crate) struct Scrubbed(Mutex<Round>);

/// One round.
#[derive(Clone, Debug, Default)]
pub(crate) struct Round {
    /// When the last whole round ended.
    pub(crate) ended_at: Option<OffsetDateTime>,
    /// What is damaged, each in a sentence, of the last whole round and of the one that is on its way.
    pub(crate) damaged: BTreeSet<String>,
}

impl Scrubbed {
    /// As it stands.
    pub(crate) fn round(&self) -> Round {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Round> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes what was found; it is told when it is new.
    fn found(&self, damaged: Vec<String>) {
        let mut round = self.lock();
        for what in damaged {
            if round.damaged.len() < MOST_KEPT && round.damaged.insert(what.clone()) {
                tracing::error!("what is stored has changed on the disk: {what}");
            }
        }
        metrics::gauge!("lodestep_damaged").set(round.damaged.len() as f64);
    }

    /// A round has ended that found this much.
    fn ended(&self, damaged: BTreeSet<String>) {
        let mut round = self.lock();
        metrics::gauge!("lodestep_damaged").set(damaged.len() as f64);
        *round = Round { ended_at: Some(utc::now()), damaged };
    }
}

/// Reads round after round until the server stops.
pub(crate) async fn work(app: App) {
    loop {
        match read_all(&app).await {
            Ok(Some(damaged)) => app.scrubbed.ended(damaged),
            Ok(None) => return,
            Err(error) => tracing::warn!(%error, "what is stored could not be read to its end: {error}"),
        }
        if app.stopping.run_until_cancelled(tokio::time::sleep(NEXT_ROUND_AFTER)).await.is_none() {
            return;
        }
    }
}

/// One round; `None` when the server stops.
async fn read_all(app: &App) -> Result<Option<BTreeSet<String>>, StoreError> {
    let (mut place, mut all) = (Some(scrub::Place::default()), BTreeSet::new());
    while let Some(at) = place {
        let begun = Instant::now();
        let looked = {
            let mut reader = app.store.read().acquire().await?;
            scrub::look(&mut reader, at).await?
        };
        metrics::counter!("lodestep_scrubbed_rows_total").increment(looked.rows);
        all.extend(looked.damaged.iter().take(MOST_KEPT.saturating_sub(all.len())).cloned());
        app.scrubbed.found(looked.damaged);
        place = looked.next;
        let rest = (begun.elapsed() * RESTS).min(LONGEST_REST);
        if app.stopping.run_until_cancelled(tokio::time::sleep(rest)).await.is_none() {
            return Ok(None);
        }
    }
    Ok(Some(all))
}
