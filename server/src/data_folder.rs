//! The data folder: one program's at a time, with one whole database in it whenever a program was killed.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use crate::private;

/// The database, in the data folder.
pub(crate) const DATABASE: &str = "lodestep.db";
/// What SQLite puts beside a database that was not closed in good order. It holds rows that are in no other file.
const LOGS: [&str; 2] = ["-wal", "-journal"];
/// How the name of a database begins that a restored one took the place of.
pub(crate) const KEPT: &str = "lodestep-before-restore-";
/// The folder of backups that the server makes by itself, in the data folder.
pub(crate) const BACKUPS: &str = "backups";
/// How the names of a new database, of a restored one and of a backup begin while they are not complete.
pub(crate) const NEW: &str = "lodestep-new-";
pub(crate) const RESTORE: &str = "lodestep-restore-";
pub(crate) const BACKUP: &str = "lodestep-backup-";
/// How they end then.
const PART: &str = ".part";

/// Makes the data folder this program's own for as long as the file is held.
pub(crate) fn hold(data: &Path) -> Result<File> {
    let path = data.join("lodestep.lock");
    private::folder(data).with_context(|| format!("could not make the data folder {}", data.display()))?;
    let opened = private::file().write(true).create(true).truncate(false).open(&path);
    let file = opened.with_context(|| format!("could not open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => {
            if let Err(error) = private::close(data) {
                // It may be somebody else's, and lent to this user.
                tracing::warn!(%error, "others may read what is in {}: {error}", data.display());
            }
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => bail!(
            "the data folder {} is in use by another server (or a restore): stop that one, or give this one a folder of its own with --data",
            data.display()
        ),
        Err(TryLockError::Error(error)) => {
            Err(error).with_context(|| format!("could not lock {}", path.display()))
        }
    }
}

/// The same for who is about to open the database: with what a killed program left cleared away, and refused where an empty
/// database would be begun in the place of one that was there.
pub(crate) fn hold_for_its_database(data: &Path) -> Result<File> {
    let held = hold(data)?;
    expect_what_was_there(data)?;
    clear_unfinished(data)
        .with_context(|| format!("could not clear away what is unfinished in {}", data.display()))?;
    Ok(held)
}

/// Brings the names in a folder to disk; where folders cannot be opened, the system does it by itself.
pub(crate) fn sync(folder: &Path) -> io::Result<()> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Brings the names in the data folder to disk, and its own, which is on disk only when the folder that holds it is.
pub(crate) fn sync_with_its_name(data: &Path) -> Result<()> {
    for folder in [Some(data), data.parent()].into_iter().flatten() {
        sync(folder).with_context(|| format!("could not bring the folder {} to disk", folder.display()))?;
    }
    Ok(())
}

/// Makes sure that no empty database is begun where there was one: the first to reach such a server would be its administrator.
pub(crate) fn expect_what_was_there(data: &Path) -> Result<()> {
    let database = data.join(DATABASE);
    // What PostgreSQL keeps is not in this folder.
    if cfg!(feature = "cluster") || fs::symlink_metadata(&database).is_ok() || !data.exists() {
        return Ok(());
    }
    let traces = traces(data).with_context(|| format!("could not look into {}", data.display()))?;
    ensure!(
        traces.is_empty(),
        "expected the database {}, found none, though there was one: {}. To begin an empty one all the same, give another folder with --data",
        database.display(),
        traces.join("; ")
    );
    Ok(())
}

/// What shows that a folder without a database had one, each with what to do about it.
fn traces(data: &Path) -> io::Result<Vec<String>> {
    let restore = |file: &Path| format!("`lodestep restore {} --data {}`", file.display(), data.display());
    let mut told = Vec::new();
    for (ending, log) in logs_of(&data.join(DATABASE)) {
        told.push(format!(
            "the log {} may hold what was acknowledged: give it the name of its database with {ending} at the end, and restore that",
            log.display()
        ));
    }
    if newest(data, is_of_a_restore)?.is_some() {
        told.push("a restore was not finished: run it again".to_owned());
    }
    if let Some(kept) = newest(data, is_kept)? {
        told.push(format!("a restore has kept one: bring it back with {}", restore(&kept)));
    }
    if let Some(backup) = newest_backup(&data.join(BACKUPS))? {
        told.push(format!("there are backups: bring the last one back with {}", restore(&backup)));
    }
    Ok(told)
}

/// The newest backup in a folder of them.
pub(crate) fn newest_backup(folder: &Path) -> io::Result<Option<PathBuf>> {
    newest(folder, |path| path.extension().is_some_and(|ending| ending == "db"))
}

/// The newest file or folder of a kind; none, where there is no such folder.
fn newest(folder: &Path, is_wanted: impl Fn(&Path) -> bool) -> io::Result<Option<PathBuf>> {
    let mut newest = None;
    if !folder.is_dir() {
        return Ok(None);
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if is_wanted(&path) {
            newest = newest.max(Some((fs::symlink_metadata(&path)?.modified()?, path)));
        }
    }
    Ok(newest.map(|(_, path)| path))
}

/// Clears away what a program that was killed left unfinished, in a folder that is held.
pub(crate) fn clear_unfinished(data: &Path) -> io::Result<()> {
    let database = data.join(DATABASE);
    for entry in fs::read_dir(data)? {
        let path = entry?.path();
        if is_of_a_restore(&path) || is_part(&path, NEW) {
            remove(&path)?;
        } else if is_kept(&path) && is_same_file(&path, &database)? {
            // A restore was about to replace the database, which has both names, and did not.
            fs::remove_file(&path)?;
        }
    }
    Ok(())
}

/// The same in a folder of backups, while no other is made there.
pub(crate) fn clear_unfinished_backups(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_of_another = [RESTORE, NEW].iter().any(|other| is_part(&path, other));
        if is_part(&path, "lodestep-") && !is_of_another {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Where something is made that is not complete yet: in a file or folder with such a name.
pub(crate) fn part(of_what: &str) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(of_what).suffix(PART);
    builder
}

/// A name for a new database that nothing in the folder has: `stem.db`, or `stem-2.db`, and so on.
pub(crate) fn free_name(folder: &Path, stem: &str) -> PathBuf {
    let mut path = folder.join(format!("{stem}.db"));
    let mut number = 1;
    while fs::symlink_metadata(&path).is_ok() {
        number += 1;
        path = folder.join(format!("{stem}-{number}.db"));
    }
    path
}

/// The logs of a database, with what its name and theirs end with; not those that hold nothing.
pub(crate) fn logs_of(database: &Path) -> Vec<(&'static str, PathBuf)> {
    let logs = LOGS.map(|ending| (ending, with_ending(database, ending)));
    logs.into_iter().filter(|(_, log)| log.metadata().is_ok_and(|file| file.len() > 0)).collect()
}

/// A file whose name has this at its end, too.
pub(crate) fn with_ending(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// Whether both are names of one file.
#[cfg(unix)]
pub(crate) fn is_same_file(one: &Path, other: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt as _;
    let of = |path: &Path| match path.metadata() {
        Ok(file) => Ok(Some((file.dev(), file.ino()))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    };
    let one = of(one)?;
    Ok(one.is_some() && one == of(other)?)
}

/// Whether both are names of one file; where that cannot be told, they are not.
#[cfg(not(unix))]
pub(crate) fn is_same_file(one: &Path, other: &Path) -> io::Result<bool> {
    Ok(one == other)
}

fn name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

fn is_part(path: &Path, begins: &str) -> bool {
    name(path).starts_with(begins) && name(path).ends_with(PART)
}

fn is_of_a_restore(path: &Path) -> bool {
    // The other is what earlier versions made.
    is_part(path, RESTORE) || name(path) == "lodestep.db.part"
}

fn is_kept(path: &Path) -> bool {
    name(path).starts_with(KEPT) && name(path).ends_with(".db")
}

fn remove(path: &Path) -> io::Result<()> {
    // A link goes itself, not what it leads to.
    if fs::symlink_metadata(path)?.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }
}
