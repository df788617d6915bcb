//! What unfinished uploads leave behind, cleared away.

use std::time::{Duration, SystemTime};

use futures_util::FutureExt;

use super::upload_file;
use super::uploads::disk_error;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::IS_SHARED;
use crate::store::logs::{self, LogState};
use crate::{data_folder, private, utc};

/// How long an upload that nobody goes on with is kept.
const KEPT_FOR: Duration = Duration::from_secs(7 * 24 * 3600);

/// Looked for again so long after the start, when a clock that was ahead has been put right.
const LOOK_AFTER: Duration = Duration::from_secs(3600);
/// And then so often.
const LOOK_EVERY: Duration = Duration::from_secs(24 * 3600);

/// Removes uploads that nobody goes on with, until the server stops.
pub(crate) async fn work(app: App) {
    let mut pause = LOOK_AFTER;
    while app.stopping.run_until_cancelled(tokio::time::sleep(pause)).await.is_some() {
        pause = LOOK_EVERY;
        if let Err(error) = clear_idle(&app).await {
            tracing::warn!(%error, "uploads that nobody goes on with could not be removed: {error}");
        }
    }
}

/// Removes uploads that were not written to for a week.
async fn clear_idle(app: &App) -> Result<()> {
    let folder = app.config.uploads();
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
    Ok(())
}

/// When the database was last written to, by the clock of that time; asked before it is opened. `None` where there was none.
pub(crate) fn last_written(config: &Config) -> Option<SystemTime> {
    let database = config.database();
    let log = data_folder::with_ending(&database, "-wal");
    [database, log].iter().filter_map(|file| file.metadata().ok()?.modified().ok()).max()
}

/// Whether a clock that is ahead would make everything look old: then nothing has been written for as long as an upload is kept.
fn may_be_ahead(last_written: Option<SystemTime>) -> bool {
    last_written.is_some_and(|at| at.elapsed().is_ok_and(|ago| ago > KEPT_FOR))
}

/// Removes at the start the uploads that nobody goes on with, but where the clock may be ahead; and files whose log is finished or
/// gone.
pub(crate) async fn clear(app: &App, last_written: Option<SystemTime>) -> Result<()> {
    if may_be_ahead(last_written) {
        tracing::info!(
            "nothing has been written for a week, by this clock: uploads on their way are kept for now"
        );
    } else {
        clear_idle(app).await?;
    }
    let folder = app.config.uploads();
    private::folder(&folder).map_err(disk_error)?;
    let files = upload_file::all(&folder).await.map_err(disk_error)?;
    let receiving = logs::in_state(app.store.read(), LogState::Receiving).await?;
    for (id, _) in files {
        // Where others may have gone on with it, what lies here may be of before: it is brought anew.
        if IS_SHARED || !receiving.iter().any(|log| log.id == id) {
            upload_file::remove(&folder, id).await.map_err(disk_error)?;
        }
    }
    upload_file::remove_spills(&folder).await.map_err(disk_error)
}

#[cfg(test)]
#[cfg(not(feature = "cluster"))]
mod tests {
    use super::*;
    use crate::serve;

    #[tokio::test]
    async fn a_clock_that_is_ahead_when_the_server_starts_removes_no_upload() {
        let folder = tempfile::tempdir().unwrap();
        let config = Config::for_testing(folder.path());
        assert_eq!(last_written(&config), None);
        let app = serve::open(config).await.unwrap();
        let eight_days = Duration::from_secs(8 * 24 * 3600);
        assert!(!may_be_ahead(last_written(&app.config)));
        let database = std::fs::File::options().write(true).open(app.config.database()).unwrap();
        app.store.close().await;
        // As it looks to a clock that is eight days ahead.
        database.set_modified(SystemTime::now() - eight_days).unwrap();
        assert!(may_be_ahead(last_written(&app.config)));
    }
}
