//! A new database: made whole beside its place, and put there when it is on disk. So a process that is killed meanwhile leaves no
//! database, and an empty file in that place is one that lost what it held.

use std::io;
use std::path::Path;

use sqlx::{Connection, SqliteConnection};

use super::{StoreError, migrations};
use crate::data_folder::{self, NEW};

/// Makes the database at `path`, where there is none.
pub(super) async fn create(path: &Path) -> Result<(), StoreError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let part = data_folder::part(NEW).tempfile_in(folder).map_err(not_written)?;
    let mut db = SqliteConnection::connect("sqlite::memory:").await?;
    migrations::run(&mut db).await?;
    sqlx::query("vacuum into ?1").bind(part.path().to_string_lossy().into_owned()).execute(&mut db).await?;
    db.close().await?;
    part.as_file().sync_all().map_err(not_written)?;
    part.persist_noclobber(path).map_err(|failed| not_written(failed.error))?;
    data_folder::sync(folder).map_err(not_written)
}

fn not_written(error: io::Error) -> StoreError {
    StoreError::Database(error.into())
}
