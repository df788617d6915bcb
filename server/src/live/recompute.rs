//! A walk worked out again while it is live: a visit was taken back, or automatic mode was switched.
//!
//! The engine is a function of what it is given. Given all but what was taken back, it comes to the very
//! state that it would be in without it; what is stored and shown takes the place of what was.

use futures_util::FutureExt;

use super::actor::{Actor, Go, from_disk};
use super::changes::{automatic_visits, is_same};
use super::device;
use super::snapshot_from_store::session_changes;
use crate::error::Error;
use crate::store::stands::{self, Stand};
use crate::store::track::{self, TrackKind};
use crate::store::visits::{self, Visit};
use crate::store::{StoreError, live_states, sessions, stage};
use crate::wire::Change;

impl Actor {
    /// Works the walk out again from what is on disk.
    pub(super) async fn work_out_again(&mut self) -> Go {
        if let Go::Ended = self.all_on_disk().await {
            return Go::Ended;
        }
        match self.put_again().await {
            Ok(()) => Go::On,
            Err(error) => {
                // What is on disk and what the walk has taken have parted: start again from the disk.
                self.last_answer(device::told(Error::from(error).into_problem()));
                Go::Ended
            }
        }
    }

    async fn put_again(&mut self) -> Result<(), StoreError> {
        let id = self.session.id;
        let Some(session) = sessions::get(self.app.store.read(), id).await? else { return Ok(()) };
        self.session = session;
        let (rebuilt, before) = from_disk(&self.app, &self.session).await?;
        let findings = rebuilt.findings;
        self.walk = rebuilt.walk;
        self.fits = rebuilt.fits;
        self.sequences = rebuilt.sequences;
        self.told = rebuilt.told;
        // One that was made before, and is made again, stays the same row.
        let made: Vec<Visit> = automatic_visits(id, &findings)
            .map(|made| before.iter().find(|known| is_same(known, &made)).cloned().unwrap_or(made))
            .collect();
        let removed = before.iter().filter(|known| !made.iter().any(|made| made.id == known.id));
        let removed: Vec<_> = removed.map(|known| known.id).collect();
        self.automatic.clone_from(&made);
        let gone = removed.clone();
        let points: Vec<_> = findings.points.into_values().collect();
        let place = self.place.other();
        stage::write(&self.app.store, id, place, vec![(TrackKind::Main, points)]).await?;
        self.app
            .store
            .writer()
            .run(move |db| {
                async move {
                    track::show(&mut *db, id, place).await?;
                    stands::clear(&mut *db, id).await?;
                    live_states::clear(&mut *db, id).await?;
                    let told: Vec<_> = findings.stands.values().map(Stand::from).collect();
                    stands::upsert(&mut *db, id, &told).await?;
                    for visit in gone {
                        visits::delete(&mut *db, visit).await?;
                    }
                    for visit in &made {
                        visits::insert(&mut *db, visit).await?;
                    }
                    visits::clear_outcomes(&mut *db, id).await?;
                    for outcome in &findings.visits {
                        visits::set_outcome(&mut *db, id, outcome).await?;
                    }
                    Ok::<_, StoreError>(())
                }
                .boxed()
            })
            .await?;
        self.place = place;
        stage::clear(&self.app.store, id, place.other()).await?;
        let mut changes = session_changes(&self.app.store, self.session.clone()).await?;
        // Where the inspector is comes with the next samples; anomalies are what they were.
        changes.retain(|change| !matches!(change, Change::Position(_) | Change::Anomaly(_)));
        changes.extend(removed.into_iter().map(|visit| Change::VisitRemoved { session_id: id, id: visit }));
        self.app.hub.publish_all(changes);
        Ok(())
    }
}
