//! A walk is removed: it is gone at once for everybody who looks, and its rows go in pieces afterwards.

use std::time::Duration;

use futures_util::FutureExt;
use uuid::Uuid;

use crate::state::App;
use crate::store::{StoreError, removal};

/// Pause after a failure.
const AGAIN_AFTER: Duration = Duration::from_secs(5);

/// Removes what hidden sessions have left, until the server stops: those of before it was started first, then each that is told.
pub(crate) async fn work(app: App) {
    while !app.stopping.is_cancelled() {
        // Asked before the table is read, so that no session falls between.
        let asked = app.removals.notified();
        match remove_hidden(&app).await {
            Ok(()) => tokio::select! {
                () = asked => {}
                () = app.stopping.cancelled() => {}
            },
            Err(error) => {
                tracing::warn!(%error, "what removed sessions have left could not be removed yet: {error}");
                tokio::select! {
                    () = tokio::time::sleep(AGAIN_AFTER) => {}
                    () = app.stopping.cancelled() => {}
                }
            }
        }
    }
}

async fn remove_hidden(app: &App) -> Result<(), StoreError> {
    for id in removal::hidden(app.store.read()).await? {
        while !app.stopping.is_cancelled() && remove_piece(app, id).await? {}
    }
    Ok(())
}

/// Removes what the hidden sessions of a carrier have left, now: for what nobody sees any more must not keep the carrier.
pub(crate) async fn finish_of(app: &App, carrier_id: Uuid) -> Result<(), StoreError> {
    for id in removal::hidden_of(app.store.read(), carrier_id).await? {
        while remove_piece(app, id).await? {}
    }
    Ok(())
}

async fn remove_piece(app: &App, id: Uuid) -> Result<bool, StoreError> {
    app.store.writer().run(move |db| async move { removal::remove_piece(db, id).await }.boxed()).await
}
