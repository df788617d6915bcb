//! A computed walk takes the place of the former one in the store.

use std::collections::HashSet;

use futures_util::FutureExt;
use lodestep_engine::anomaly::Anomaly;
use lodestep_engine::event::TrackPoint;
use lodestep_engine::session::Visit;
use uuid::Uuid;

use super::anomaly_runs;
use super::computation::Computed;
use super::process::ProcessError;
use super::stored_session::StoredSession;
use crate::charts;
use crate::live::session_changes;
use crate::state::App;
use crate::store::anomalies::Gathered;
use crate::store::lab_runs::Provenance;
use crate::store::stands::Stand;
use crate::store::track::{self, TrackKind};
use crate::store::visits::Origin;
use crate::store::{self, StoreError, anomalies, stage};
use crate::utc;
use crate::wire::Change;

/// More anomalies than are ever stored of a walk.
const MOST_KNOWN: u32 = 2_000;

/// Puts the new result in the place of the former one: all of it or nothing. What the former was compared
/// with goes, too. The points are written beside the former ones, in pieces; the last write shows them, and is as short whatever the
/// walk.
pub(super) async fn replace_result(
    app: &App,
    walk: &StoredSession,
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
    let anomalies = anomaly_runs::gathered(anomalies);
    let stands: Vec<_> = main.stands.iter().map(Stand::from).collect();
    let place = track::shown(app.store.read(), session_id).await?.other();
    let Computed { stored: points, summary, report, figures, sha256, .. } = main;
    stage::write(&app.store, session_id, place, vec![(TrackKind::Main, points)])
        .await
        .map_err(gone_when_dangling)?;
    // Who is told of anomalies has heard of those that were known.
    let new = new_among(app, session_id, &anomalies).await?;
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
                track::show(&mut *db, session_id, place).await?;
                for visit in gone {
                    store::visits::delete(&mut *db, visit).await?;
                }
                for visit in &made {
                    store::visits::insert(&mut *db, visit).await?;
                }
                store::stands::clear(&mut *db, session_id).await?;
                store::stands::upsert(&mut *db, session_id, &stands).await?;
                store::visits::clear_outcomes(&mut *db, session_id).await?;
                for outcome in &outcomes {
                    store::visits::set_outcome(&mut *db, session_id, outcome).await?;
                }
                store::webhook_deliveries::announce_anomalies(&mut *db, session_id, &new).await?;
                anomalies::clear(&mut *db, session_id).await?;
                anomalies::insert(&mut *db, session_id, &anomalies).await?;
                store::charts::clear(&mut *db, session_id).await?;
                for series in charts {
                    store::charts::set(&mut *db, session_id, series).await?;
                }
                store::reports::set(&mut *db, session_id, &report, (&figures, &provenance)).await?;
                store::sessions::set_summary(&mut *db, session_id, &summary).await?;
                store::sessions::finish(&mut *db, session_id, ended_at, &sha256).await?;
                store::session_search::count_stored(&mut *db, session_id).await?;
                Ok::<_, StoreError>(())
            }
            .boxed()
        })
        .await;
    stored.map_err(gone_when_dangling)?;
    stage::clear(&app.store, session_id, place.other()).await?;
    app.hub.publish_all(removed.into_iter().map(|id| Change::VisitRemoved { session_id, id }));
    if let Some(session) = store::sessions::get(app.store.read(), session_id).await? {
        app.hub.publish_all(session_changes(&app.store, session).await?);
    }
    Ok(())
}

/// Of these anomalies, those that the session was not known to have. Where it has more than are ever stored now, as by an earlier
/// version, the others go first, in pieces.
async fn new_among(app: &App, session_id: Uuid, found: &[Gathered]) -> Result<Vec<Gathered>, StoreError> {
    loop {
        if !app
            .store
            .writer()
            .run(move |db| {
                async move { anomalies::clear_some(db, session_id, MOST_KNOWN, MOST_KNOWN).await }.boxed()
            })
            .await?
        {
            break;
        }
    }
    let known = anomalies::of_session(app.store.read(), session_id).await?;
    let key = |found: &Anomaly| (found.kind, found.stream, found.t_start_ns, found.t_end_ns, found.samples);
    let known: HashSet<_> =
        known.iter().map(|known| (key(&known.found), known.found.detail.clone())).collect();
    let is_new = |new: &&Gathered| !known.contains(&(key(&new.found), new.found.detail.clone()));
    Ok(found.iter().filter(is_new).cloned().collect())
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
    let mut charts = charts::pack(&charts::of_points(system, TrackKind::Filtered, &filtered))?;
    if let Some(points) = &without_markers {
        charts.extend(charts::pack(&charts::of_points(system, TrackKind::WithoutMarkers, points))?);
    }
    // A reader sees them grow meanwhile; the job ends with their charts.
    let place = track::shown(app.store.read(), session_id).await?;
    for (run, points) in [(TrackKind::Filtered, Some(filtered)), (TrackKind::WithoutMarkers, without_markers)]
    {
        stage::add(&app.store, session_id, (run, place), points.unwrap_or_default())
            .await
            .map_err(gone_when_dangling)?;
    }
    let stored = app
        .store
        .writer()
        .run(move |db| {
            async move {
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
        keyed_shift_ns: 0,
        created_at: utc::now(),
        outcome: None,
    }
}
