//! Which marker a stand was at, as people decide it: a visit that is made of it, or taken back.

use futures_util::FutureExt;
use serde_json::json;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::jobs;
use crate::sessions::uploads::publish_session;
use crate::state::App;
use crate::store::dialect::Connection;
use crate::store::sessions::{self, Session, SessionState};
use crate::store::stands::{self, Stand};
use crate::store::visits::{self, Origin, Visit};
use crate::store::{audit, markers};
use crate::utc;
use crate::wire::Change;

/// Makes a visit of a stand, in the place of one that was chosen or made automatically.
pub(crate) async fn choose(
    app: &App,
    caller: &Caller,
    session_id: Uuid,
    number: u32,
    marker: String,
) -> Result<Visit> {
    let (session, stand) = find(app, session_id, number).await?;
    if markers::get(app.store.read(), &marker).await?.is_none() {
        return Err(Error::not_found("marker", &marker));
    }
    let visit = Visit {
        id: Uuid::now_v7(),
        session_id,
        marker,
        t_start_ns: stand.t_start_ns,
        t_end_ns: stand.t_end_ns,
        origin: Origin::Chosen,
        keyed_shift_ns: 0,
        created_at: utc::now(),
        outcome: None,
    };
    let row = visit.clone();
    let caller = caller.clone();
    let removed = app
        .store
        .writer()
        .run(move |db| {
            async move {
                let removed = remove(&mut *db, session_id, &stand).await?;
                visits::insert(&mut *db, &row).await?;
                let before = serde_json::to_value(&removed).ok();
                let after = serde_json::to_value(&row).ok();
                audit::insert(db, &caller.did("visit.chosen", session_id, before, after)).await?;
                Ok::<_, Error>(removed)
            }
            .boxed()
        })
        .await?;
    let replaces = !removed.is_empty();
    tell_removed(app, session_id, removed);
    app.hub.publish(Change::Visit(visit.clone()));
    if session.state == SessionState::Live {
        if replaces {
            app.live.work_out_again(session_id).await;
        }
        app.live.add_visits(session_id, vec![visit.clone()]).await;
    } else {
        jobs::queue::enqueue(app, session_id).await?;
    }
    Ok(visit)
}

/// Takes back the visit that was chosen or made automatically of a stand.
pub(crate) async fn take_back(app: &App, caller: &Caller, session_id: Uuid, number: u32) -> Result<()> {
    let (session, stand) = find(app, session_id, number).await?;
    let caller = caller.clone();
    let removed = app
        .store
        .writer()
        .run(move |db| {
            async move {
                let removed = remove(&mut *db, session_id, &stand).await?;
                let before = serde_json::to_value(&removed).ok();
                audit::insert(db, &caller.did("visit.taken_back", session_id, before, None)).await?;
                Ok::<_, Error>(removed)
            }
            .boxed()
        })
        .await?;
    if removed.is_empty() {
        return Err(Error::not_found("choice of stand", number));
    }
    tell_removed(app, session_id, removed);
    work_out_again(app, &session).await
}

/// Takes back a visit that somebody keyed in, chose, or that automatic mode made; the track is worked out
/// without it.
pub(crate) async fn take_visit_back(
    app: &App,
    caller: &Caller,
    session_id: Uuid,
    visit_id: Uuid,
) -> Result<()> {
    let db = app.store.read();
    let session = sessions::get(db, session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    let known = visits::of_session(db, session_id).await?.into_iter().find(|visit| visit.id == visit_id);
    let visit = known.ok_or_else(|| Error::not_found("visit", visit_id))?;
    let row = visit.clone();
    let entry = caller.did("visit.taken_back", session_id, serde_json::to_value(&visit).ok(), None);
    app.store
        .writer()
        .run(move |db| {
            async move {
                if row.origin == Origin::Automatic {
                    for stand in stands::of_session(&mut *db, session_id).await? {
                        if stand.overlaps(row.t_start_ns, row.t_end_ns) {
                            stands::undo(&mut *db, session_id, stand.t_start_ns).await?;
                        }
                    }
                }
                visits::delete(&mut *db, visit_id).await?;
                audit::insert(db, &entry).await
            }
            .boxed()
        })
        .await?;
    tell_removed(app, session_id, vec![visit]);
    work_out_again(app, &session).await
}

/// Switches automatic mode of a session.
pub(crate) async fn set_automatic(app: &App, caller: &Caller, id: Uuid, automatic: bool) -> Result<Session> {
    let before = sessions::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("session", id))?;
    if before.automatic_visits == automatic {
        return Ok(before);
    }
    let entry = caller.did(
        "session.changed",
        id,
        Some(json!({"automatic_visits": before.automatic_visits})),
        Some(json!({"automatic_visits": automatic})),
    );
    app.store
        .writer()
        .run(move |db| {
            async move {
                sessions::set_automatic_visits(&mut *db, id, automatic).await?;
                Ok::<_, Error>(audit::insert(db, &entry).await?)
            }
            .boxed()
        })
        .await?;
    publish_session(app, id).await?;
    work_out_again(app, &before).await?;
    sessions::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("session", id))
}

async fn find(app: &App, session_id: Uuid, number: u32) -> Result<(Session, Stand)> {
    let db = app.store.read();
    let session = sessions::get(db, session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    let stand = stands::get(db, session_id, number).await?;
    Ok((session, stand.ok_or_else(|| Error::not_found("stand", number))?))
}

/// Removes the visits that were made of a stand; automatic mode will not make them again. What
/// somebody keyed in stays, and nothing is chosen beside it.
async fn remove(db: &mut Connection, session_id: Uuid, stand: &Stand) -> Result<Vec<Visit>> {
    let mut of_stand = visits::of_session(&mut *db, session_id).await?;
    of_stand.retain(|visit| stand.overlaps(visit.t_start_ns, visit.t_end_ns));
    if let Some(keyed) = of_stand.iter().find(|visit| visit.origin == Origin::Keyed) {
        return Err(Error::conflict(
            "stand_keyed",
            format!(
                "expected a stand at which nobody keyed a marker in, found {} keyed in: what was keyed in stands",
                keyed.marker
            ),
        ));
    }
    for visit in &of_stand {
        if visit.origin == Origin::Automatic {
            stands::undo(&mut *db, session_id, stand.t_start_ns).await?;
        }
        visits::delete(&mut *db, visit.id).await?;
    }
    Ok(of_stand)
}

fn tell_removed(app: &App, session_id: Uuid, removed: Vec<Visit>) {
    app.hub.publish_all(removed.into_iter().map(|visit| Change::VisitRemoved { session_id, id: visit.id }));
}

/// The track without what was taken back: now where the session is live, else by a job. A session that
/// has no track yet gets it with its first.
async fn work_out_again(app: &App, session: &Session) -> Result<()> {
    match session.state {
        SessionState::Live => app.live.work_out_again(session.id).await,
        SessionState::Created | SessionState::Receiving => {}
        SessionState::Processing | SessionState::Finished | SessionState::Failed => {
            jobs::queue::enqueue(app, session.id).await?;
        }
    }
    Ok(())
}
