//! A result that is written in pieces beside the one that is shown, so that others write in between: each piece is a write of its
//! own, and the writer does what waits before it does the next.

use futures_util::FutureExt;
use lodestep_engine::event::TrackPoint;
use uuid::Uuid;

use super::track::{self, Place, TrackKind};
use super::{Store, StoreError};

/// Points in a piece: some tens of milliseconds.
const POINTS: usize = 2_000;
/// Points that are removed at once.
const REMOVED: u32 = 5_000;

/// Puts the points of runs into a place that is not shown, in pieces; what lay there goes first.
pub async fn write(
    store: &Store,
    session_id: Uuid,
    place: Place,
    runs: Vec<(TrackKind, Vec<TrackPoint>)>,
) -> Result<(), StoreError> {
    clear(store, session_id, place).await?;
    for (run, points) in runs {
        add(store, session_id, (run, place), points).await?;
    }
    Ok(())
}

/// Adds points in pieces.
pub async fn add(
    store: &Store,
    session_id: Uuid,
    run: (TrackKind, Place),
    points: Vec<TrackPoint>,
) -> Result<(), StoreError> {
    let mut rest = points;
    while !rest.is_empty() {
        let later = rest.split_off(rest.len().min(POINTS));
        let piece = std::mem::replace(&mut rest, later);
        store
            .writer()
            .run(move |db| async move { track::upsert(db, session_id, run, &piece).await }.boxed())
            .await?;
    }
    Ok(())
}

/// Empties a place that is not shown, in pieces.
pub async fn clear(store: &Store, session_id: Uuid, place: Place) -> Result<(), StoreError> {
    loop {
        if !store
            .writer()
            .run(move |db| async move { track::clear_some(db, session_id, place, REMOVED).await }.boxed())
            .await?
        {
            return Ok(());
        }
    }
}
