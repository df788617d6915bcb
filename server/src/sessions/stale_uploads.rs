//! What unfinished uploads leave behind, cleared away when the server starts.

use std::time::Duration;

use futures_util::FutureExt;

use super::upload_file;
use super::uploads::disk_error;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::logs::{self, LogState};
use crate::{private, utc};

/// How long an upload that nobody goes on with is kept.
const KEPT_FOR: Duration = Duration::from_secs(7 * 24 * 3600);

/// Removes uploads that were given up: those not written to for a week, and files whose log is
/// finished or gone.
pub(crate) async fn clear(app: &App) -> Result<()> {
    let folder = app.config.uploads();
    private::folder(&folder).map_err(disk_error)?;
    let files = upload_file::all(&folder).await.map_err(disk_error)?;
    let receiving = logs::in_state(app.store.read(), LogState::Receiving).await?;
    for log in &receiving {
        let idle = files.iter().find(|(id, _)| *id == log.id).map(|(_, idle)| *idle);
        // Without a file there is only the row's own age.
        let idle = idle.unwrap_or_else(|| (utc::now() - log.created_at).try_into().unwrap_or_default());
        if idle > KEPT_FOR {
            let id = log.id;
            app.store
                .writer()
                .run(move |db| async move { Ok::<_, Error>(logs::delete(&mut *db, id).await?) }.boxed())
                .await?;
            upload_file::remove(&folder, id).await.map_err(disk_error)?;
            tracing::info!(log_id = %id, "an upload that nobody went on with for a week was removed");
        }
    }
    for (id, _) in files {
        if !receiving.iter().any(|log| log.id == id) {
            upload_file::remove(&folder, id).await.map_err(disk_error)?;
        }
    }
    upload_file::remove_spills(&folder).await.map_err(disk_error)
}
