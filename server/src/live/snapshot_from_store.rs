//! The picture with which a server starts: what was on disk when it stopped.

use super::snapshot::{Board, RESTING_SHOWN};
use crate::sessions::unknown_start::is_unknown;
use crate::store::sessions::{Filter, Session, SessionState};
use crate::store::track::TrackKind;
use crate::store::{
    Store, StoreError, alarms, anomalies, faults, inspectors, markers, sessions, stands, track, visits,
};
use crate::utc;
use crate::wire::{Change, Motion, Position};

/// Reads the picture.
pub async fn snapshot_from_store(store: &Store) -> Result<Board, StoreError> {
    let db = store.read();
    let mut board = Board::default();
    board.apply(&Change::Inspectors { inspectors: inspectors::list(db).await? });
    board.apply(&Change::Markers { revision: markers::revision(db).await? });
    for fault in faults::standing(db).await? {
        board.apply(&Change::Fault { fault });
    }
    for alarm in alarms::standing(db).await? {
        board.apply(&Change::AlarmRaised { alarm });
    }
    let live = Filter { state: Some(SessionState::Live), ..Filter::default() };
    let live = sessions::list(db, live).await?;
    // Of the newest so many, live ones among them, no more rest than are shown.
    let newest = (RESTING_SHOWN + live.len()) as u32;
    let newest = sessions::page(db, Filter::default(), None, newest).await?;
    let resting = newest.into_iter().filter(|session| session.state != SessionState::Live);
    for session in live.iter().cloned().chain(resting.take(RESTING_SHOWN)) {
        for change in session_changes(store, session).await? {
            board.apply(&change);
        }
    }
    Ok(board)
}

/// A stored session as the changes that show it: the session, its trail, where it was last, its stands,
/// visits and anomalies. For a server that starts, and for a track that was computed anew.
pub async fn session_changes(store: &Store, session: Session) -> Result<Vec<Change>, StoreError> {
    let db = store.read();
    let session_id = session.id;
    let mut changes = vec![Change::Session { session: Some(session.clone()), deleted: None }];
    let last = track::last_at(db, session_id, i64::MAX).await?.filter(|last| !is_unknown(last.sigma_n_m));
    if let Some(last) = last {
        let points = track::trail(db, session_id, TrackKind::Main).await?;
        changes.push(Change::Revision { session_id, points });
        changes.push(Change::Position(Position {
            session_id,
            inspector_id: session.inspector_id,
            t_ns: last.t_ns,
            position_m: last.position_n_m,
            heading_rad: last.heading_rad,
            sigma_m: last.sigma_n_m,
            covariance_en_m2: last.covariance_en_m2,
            speed_m_s: 0.0,
            state: Motion::Silent,
            since_marker_s: session.since_marker_s,
            since_marker_m: session.since_marker_m,
            distance_m: session.distance_m,
            received_at: utc::at(session.started_at, last.t_ns),
        }));
    }
    let stands = stands::of_session(db, session_id).await?;
    changes.push(Change::Stands { session_id, all: true, stands });
    changes.extend(visits::of_session(db, session_id).await?.into_iter().map(Change::Visit));
    changes.extend(anomalies::of_session(db, session_id).await?.into_iter().map(Change::Anomaly));
    Ok(changes)
}
