//! Backups: made while the server runs, checked before they count, and brought back.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use time::OffsetDateTime;

use crate::serve::sync_folder;
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
    data.join("backups")
}

/// Copies the database of a data folder into a new file of this folder, and reads the copy from end to end. Under a
/// name of its own until it has proved good, so that nothing half-made is taken for a backup.
pub(crate) async fn make(data: &Path, into: &Path) -> Result<Backup> {
    let database = data.join("lodestep.db");
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
    sync_folder(into)?;
    let bytes = file.metadata()?.len();
    Ok(Backup { file, bytes })
}

/// Puts a backup in the place of a data folder's database; the former one is kept beside it. No server may run there.
pub(crate) async fn restore(file: &Path, data: &Path, replace: bool) -> Result<Option<PathBuf>> {
    ensure!(file.is_file(), "expected a backup, found no file {}: check its name", file.display());
    backup::check(file).await.with_context(|| format!("{} is no good backup", file.display()))?;
    let database = data.join("lodestep.db");
    let former = if database.exists() {
        if !replace {
            bail!(
                "there is already a database {}: give --replace to put the backup in its place (it is kept beside it), or another folder with --data",
                database.display()
            );
        }
        let now = utc::in_a_file_name(utc::now());
        let former = data.join(format!("lodestep-before-restore-{now}.db"));
        // What the log of the former one holds goes with it.
        for ending in ["", "-wal", "-shm"] {
            let (from, to) = (with_ending(&database, ending), with_ending(&former, ending));
            if from.exists() {
                std::fs::rename(&from, &to)
                    .with_context(|| format!("could not move {} aside", from.display()))?;
            }
        }
        Some(former)
    } else {
        None
    };
    std::fs::create_dir_all(data)?;
    let unproved = data.join("lodestep.db.part");
    std::fs::copy(file, &unproved).with_context(|| format!("could not copy {}", file.display()))?;
    std::fs::File::open(&unproved)?.sync_all()?;
    std::fs::rename(&unproved, &database)?;
    sync_folder(data)?;
    Ok(former)
}

fn with_ending(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
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
