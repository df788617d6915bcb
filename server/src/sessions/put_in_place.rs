//! A computed walk takes the place of the former one in the store.

use futures_util::FutureExt;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::session::Visit;
use uuid::Uuid;

use super::process::ProcessError;
use super::run::Computed;
use super::stored_walk::Walk;
use crate::charts;
use crate::live::session_changes;
use crate::state::App;
use crate::store::lab_runs::Provenance;
use crate::store::track::Run;
use crate::store::visits::Origin;
use crate::store::{self, StoreError};
use crate::utc;
use crate::wire::Change;

/// Puts the new result in the place of the former one: all of it or nothing. What the former was compared
/// with goes, too.
pub(super) async fn put_in_place(
    app: &App,
    walk: &Walk,
    (main, provenance): (Computed, Provenance),
) -> Result<(), ProcessError> {
    let session_id = walk.session.id;
    let last_ns = main.stored.last().map_or(0, |point| point.t_ns);
    let ended_at = utc::at(walk.session.started_at, last_ns);
    let made: Vec<_> = walk.made().iter().map(|visit| automatic_row(session_id, visit)).collect();
    let is_made = |known: &store::visits::Visit| {
        made.iter().any(|made| made.marker == known.marker && made.t_start_ns == known.t_start_ns)
    };
    let removed: Vec<Uuid> =
        walk.automatic.iter().filter(|known| !is_made(known)).map(|known| known.id).collect();
    let gone = removed.clone();
    let charts = charts::pack(&main.charts)?;
    let outcomes: Vec<_> = main.visits.iter().chain(&walk.outcomes).cloned().collect();
    let anomalies: Vec<_> = main.anomalies.iter().chain(&walk.anomalies).cloned().collect();
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                for run in [Run::Main, Run::Filtered, Run::WithoutMarkers] {
                    store::track::clear(&mut *db, session_id, run).await?;
                }
                store::track::upsert(&mut *db, session_id, Run::Main, &main.stored).await?;
                for visit in gone {
                    store::visits::delete(&mut *db, visit).await?;
                }
                for visit in &made {
                    store::visits::insert(&mut *db, visit).await?;
                }
                store::stands::clear(&mut *db, session_id).await?;
                let stands: Vec<_> = main.stands.iter().map(store::stands::Stand::from).collect();
                store::stands::upsert(&mut *db, session_id, &stands).await?;
                store::visits::clear_outcomes(&mut *db, session_id).await?;
                for outcome in &outcomes {
                    store::visits::set_outcome(&mut *db, session_id, outcome).await?;
                }
                // Who is told of anomalies has heard of those that were known.
                let known = store::anomalies::of_session(&mut *db, session_id).await?;
                let new: Vec<_> = anomalies
                    .iter()
                    .filter(|found| known.iter().all(|known| !known.found.says_the_same(found)))
                    .cloned()
                    .collect();
                store::webhook_deliveries::announce_anomalies(&mut *db, session_id, &new).await?;
                store::anomalies::clear(&mut *db, session_id).await?;
                for anomaly in &anomalies {
                    store::anomalies::insert(&mut *db, session_id, anomaly).await?;
                }
                store::charts::clear(&mut *db, session_id).await?;
                for series in charts {
                    store::charts::set(&mut *db, session_id, series).await?;
                }
                store::reports::set(&mut *db, session_id, &main.report, (&main.figures, &provenance)).await?;
                store::sessions::set_summary(&mut *db, session_id, &main.summary).await?;
                store::sessions::finish(&mut *db, session_id, ended_at, &main.sha256).await?;
                store::session_search::count_stored(&mut *db, session_id).await?;
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)?;
    app.hub.publish_all(removed.into_iter().map(|id| Change::VisitRemoved { session_id, id }));
    if let Some(session) = store::sessions::get(app.store.read(), session_id).await? {
        app.hub.publish_all(session_changes(&app.store, session).await?);
    }
    Ok(())
}

/// Stores the runs that the main one is compared with.
pub(super) async fn put_beside(
    app: &App,
    session_id: Uuid,
    filtered: Vec<TrackPoint>,
    without_markers: Option<Vec<TrackPoint>>,
) -> Result<(), ProcessError> {
    let session = store::sessions::get(app.store.read(), session_id).await?;
    let system = session.ok_or(ProcessError::SessionGone)?.declaration();
    let mut charts = charts::pack(&charts::of_points(system, Run::Filtered, &filtered))?;
    if let Some(points) = &without_markers {
        charts.extend(charts::pack(&charts::of_points(system, Run::WithoutMarkers, points))?);
    }
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                store::track::upsert(&mut *db, session_id, Run::Filtered, &filtered).await?;
                if let Some(points) = without_markers {
                    store::track::upsert(&mut *db, session_id, Run::WithoutMarkers, &points).await?;
                }
                for series in charts {
                    store::charts::set(&mut *db, session_id, series).await?;
                }
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)
}

pub(super) fn gone_when_dangling(error: StoreError) -> ProcessError {
    if error.is_dangling() { ProcessError::SessionGone } else { error.into() }
}

/// A visit that automatic mode has made, as it is stored.
fn automatic_row(session_id: Uuid, visit: &Visit) -> store::visits::Visit {
    store::visits::Visit {
        id: Uuid::now_v7(),
        session_id,
        marker: visit.marker.clone(),
        t_start_ns: visit.t_start_ns,
        t_end_ns: visit.t_end_ns,
        origin: Origin::Automatic,
        created_at: utc::now(),
        outcome: None,
    }
}
