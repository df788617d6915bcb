//! Backups: made while the server runs, and checked before they count.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use time::OffsetDateTime;

use crate::data_folder::{self, BACKUPS, DATABASE};
use crate::store::backup;
use crate::utc;

/// A backup that has been made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Backup {
    /// Its file.
    pub(crate) file: PathBuf,
    /// Its size.
    pub(crate) bytes: u64,
}

/// The folder of backups that the server makes by itself.
pub(crate) fn folder(data: &Path) -> PathBuf {
    data.join(BACKUPS)
}

/// Copies the database of a data folder into a new file of this folder, and reads the copy from end to end. Under a
/// name of its own until it has proved good, so that nothing half-made is taken for a backup.
pub(crate) async fn make(data: &Path, into: &Path) -> Result<Backup> {
    let database = data.join(DATABASE);
    ensure!(
        database.is_file(),
        "expected the database {}, found none: name the server's data folder with --data",
        database.display()
    );
    std::fs::create_dir_all(into).with_context(|| format!("could not make the folder {}", into.display()))?;
    let now = utc::in_a_file_name(utc::now());
    let file = into.join(format!("lodestep-{now}.db"));
    ensure!(!file.exists(), "there is already a backup {}: wait a second", file.display());
    let unproved = file.with_extension("db.part");
    let _ = std::fs::remove_file(&unproved);
    let made = backup::copy(&database, &unproved).await;
    if let Err(error) = made {
        let _ = std::fs::remove_file(&unproved);
        return Err(error).with_context(|| format!("could not back {} up", database.display()));
    }
    std::fs::File::open(&unproved)?.sync_all()?;
    std::fs::rename(&unproved, &file)?;
    data_folder::sync(into)?;
    let bytes = file.metadata()?.len();
    Ok(Backup { file, bytes })
}

/// When the newest backup of a data folder was made; `None` when there is none.
pub(crate) fn newest(data: &Path) -> Option<OffsetDateTime> {
    let files = std::fs::read_dir(folder(data)).ok()?;
    let made = files.filter_map(|file| {
        let file = file.ok()?;
        file.path()
            .extension()
            .is_some_and(|ending| ending == "db")
            .then(|| file.metadata().ok()?.modified().ok())?
    });
    made.max().map(OffsetDateTime::from)
}
