//! Backups: made while the server runs, and checked before they count.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use tempfile::NamedTempFile;
use time::OffsetDateTime;

use crate::data_folder::{self, BACKUPS, DATABASE};
use crate::store::health::Disk;
use crate::store::{StoreError, backup};
use crate::{private, utc};

/// A backup that has been made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Backup {
    /// Its file.
    pub(crate) file: PathBuf,
    /// Its size.
    pub(crate) bytes: u64,
    /// What is damaged in it as it is in the database; all else can be read.
    pub(crate) damaged: Vec<String>,
}

/// Why none was made.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotMade {
    /// The disk of the folder is too full.
    #[error(
        "there is no room for a backup in {}: it takes up to {needed_bytes} bytes, and {free_bytes} are free. Remove backups that are no longer needed, or make it in a folder on another disk (`lodestep backup --out FOLDER`)",
        folder.display()
    )]
    NoRoom {
        /// Where it was to be.
        folder: PathBuf,
        /// How large the database is.
        needed_bytes: u64,
        /// How much the disk has left.
        free_bytes: u64,
    },
    /// One is on its way to the same folder.
    #[error("another backup is being made in {}: wait until it is done", .0.display())]
    Another(PathBuf),
    /// A restore would refuse it.
    #[error("the copy is no good backup: {0}")]
    NotGood(StoreError),
    /// Anything else.
    #[error(transparent)]
    Failed(#[from] anyhow::Error),
}

/// The folder of backups that the server makes by itself.
pub(crate) fn folder(data: &Path) -> PathBuf {
    data.join(BACKUPS)
}

/// How the name of a backup begins that somebody asked for.
pub(crate) const ASKED_FOR: &str = "lodestep-";
/// How the name of one begins that the server makes by itself, and removes again when others have taken its place.
pub(crate) const SCHEDULED: &str = "lodestep-scheduled-";

/// Copies the database of a data folder into a new file of this folder, whose name begins like this, and reads the copy from end to end. Under a
/// name of its own until it has proved good, so that nothing half-made is taken for a backup.
pub(crate) async fn make(data: &Path, into: &Path, begins: &str) -> Result<Backup, NotMade> {
    let database = data.join(DATABASE);
    if cfg!(feature = "cluster") {
        backup::copy(&database, into).await.map_err(|error| NotMade::Failed(error.into()))?;
    }
    if !database.is_file() {
        return Err(NotMade::Failed(anyhow!(
            "expected the database {}, found none: name the server's data folder with --data",
            database.display()
        )));
    }
    let room = Room { folder: into.to_owned(), needed_bytes: bytes_of(&database) };
    private::folder(into)
        .map_err(|error| room.or_none(error, || format!("could not make the folder {}", into.display())))?;
    let _turn = turn(into)?;
    let not_written = |error| room.or_none(error, || format!("could not write to {}", into.display()));
    data_folder::clear_unfinished_backups(into).map_err(not_written)?;
    // Not tried where it cannot succeed: until it failed, everybody else would find the disk full.
    if room.free_bytes() < room.needed_bytes {
        return Err(room.none());
    }
    let part = data_folder::part(data_folder::BACKUP).tempfile_in(into).map_err(not_written)?;
    let damaged = backup::copy(&database, part.path()).await.map_err(|error| match error {
        error if error.disk() == Some(Disk::Full) => room.none(),
        error @ (StoreError::Open(_) | StoreError::Damaged { .. } | StoreError::Corrupt(_)) => {
            NotMade::NotGood(error)
        }
        error => NotMade::Failed(
            anyhow::Error::new(error).context(format!("could not back {} up", database.display())),
        ),
    })?;
    let stem = format!("{begins}{}", utc::in_a_file_name(utc::now()));
    let file = data_folder::free_name(into, &stem);
    // Bringing a large file to disk takes a tenth of a second and more: no live session waits for it.
    let named = tokio::task::spawn_blocking({
        let (into, file) = (into.to_owned(), file.clone());
        move || named(part, &into, &file)
    });
    let bytes = named.await.map_err(|error| NotMade::Failed(error.into()))?.map_err(not_written)?;
    for what in &damaged {
        tracing::error!("the backup {} was made of a database in which {what}", file.display());
    }
    Ok(Backup { file, bytes, damaged })
}

/// Brings a copy to disk, gives it its name, and says how large it is.
fn named(part: NamedTempFile, into: &Path, file: &Path) -> io::Result<u64> {
    part.as_file().sync_all()?;
    part.persist_noclobber(file).map_err(|failed| failed.error)?;
    data_folder::sync(into)?;
    Ok(file.metadata()?.len())
}

/// One at a time in a folder: each clears away what one that was killed left there.
fn turn(into: &Path) -> Result<File, NotMade> {
    let path = into.join(".lodestep-backup.lock");
    let opened = private::file().write(true).create(true).truncate(false).open(&path);
    let file = opened.with_context(|| format!("could not open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(NotMade::Another(into.to_owned())),
        Err(TryLockError::Error(error)) => {
            Err(anyhow::Error::new(error).context(format!("could not lock {}", path.display())).into())
        }
    }
}

/// The database with its log: what its copy takes at most.
fn bytes_of(database: &Path) -> u64 {
    let log = data_folder::with_ending(database, "-wal");
    [database, &log].iter().filter_map(|file| file.metadata().ok()).map(|file| file.len()).sum()
}

/// The room that a backup needs.
struct Room {
    folder: PathBuf,
    needed_bytes: u64,
}

impl Room {
    /// What the disk has left; where that cannot be told, it is tried.
    fn free_bytes(&self) -> u64 {
        fs4::available_space(&self.folder).unwrap_or(u64::MAX)
    }

    fn none(&self) -> NotMade {
        let (folder, needed_bytes) = (self.folder.clone(), self.needed_bytes);
        NotMade::NoRoom { folder, needed_bytes, free_bytes: self.free_bytes() }
    }

    fn or_none(&self, error: io::Error, what: impl FnOnce() -> String) -> NotMade {
        match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => self.none(),
            _ => NotMade::Failed(anyhow::Error::new(error).context(what())),
        }
    }
}

/// When the newest backup of a data folder was made; `None` when there is none.
pub(crate) fn newest(data: &Path) -> Option<OffsetDateTime> {
    let newest = data_folder::newest_backup(&folder(data)).ok()??;
    Some(newest.metadata().ok()?.modified().ok()?.into())
}
