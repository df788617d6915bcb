//! A backup brought back: copied, checked, synced, and only then put in the place of the database that stands there.
//!
//! Whatever fails, and whenever this is killed, the data folder holds one whole database under the name that a server opens: the
//! former one until the one call that puts the new one there, the new one from then on. The former is kept as a complete file of
//! its own.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use crate::data_folder::{self, DATABASE};
use crate::store::{StoreError, backup};
use crate::{private, utc};

/// Puts a backup in the place of the database of a data folder that is held; where the former one is kept.
pub(crate) async fn restore(
    file: &Path,
    data: &Path,
    replace: bool,
    accept_damaged: bool,
) -> Result<Option<PathBuf>> {
    ensure!(file.is_file(), "expected a backup, found no file {}: check its name", file.display());
    data_folder::clear_unfinished(data)
        .with_context(|| format!("could not clear what an earlier restore left in {}", data.display()))?;
    let standing = Standing::look(data.join(DATABASE))?;
    ensure!(
        !data_folder::is_same_file(file, &standing.database)?,
        "{} is the database that stands there: give the backup that is to take its place",
        file.display()
    );
    if standing.is_there && !replace {
        bail!(
            "there is already a database {}: give --replace to put the backup in its place (it is kept beside it), or another folder with --data",
            standing.database.display()
        );
    }
    let _unused = not_in_use(file)?;
    let what_stands = "nothing was restored, and what stood there is as it was";
    // Gone when this ends, with all that is in it; after a kill, at the next start.
    let part = data_folder::part(data_folder::RESTORE).tempdir_in(data).context(what_stands)?;
    let copy = checked_copy(file, &part.path().join(DATABASE), accept_damaged).await.context(what_stands)?;
    let kept = standing.keep(data).await.context(what_stands)?;
    let placed = fs::rename(&copy, &standing.database)
        .map_err(anyhow::Error::from)
        .and_then(|()| data_folder::sync_with_its_name(data));
    if let Err(error) = placed {
        standing.put_back(kept.as_deref())?;
        return Err(error).context(what_stands);
    }
    Ok(kept)
}

/// Makes sure that no server works on the file that is to be restored: a copy of it would be of two moments.
fn not_in_use(file: &Path) -> Result<Option<File>> {
    let lock = file.with_file_name("lodestep.lock");
    if file.file_name().is_none_or(|name| name != DATABASE) || !lock.is_file() {
        return Ok(None);
    }
    let lock = File::open(&lock).with_context(|| format!("could not open {}", lock.display()))?;
    ensure!(
        lock.try_lock().is_ok(),
        "{} is the database of a server that runs: make a backup with `lodestep backup --data {}` and restore that",
        file.display(),
        file.parent().unwrap_or(Path::new(".")).display()
    );
    Ok(Some(lock))
}

/// Copies a backup, with what a log beside it holds, into one file; proves it good, and brings it to disk.
async fn checked_copy(file: &Path, copy: &Path, accept_damaged: bool) -> Result<PathBuf> {
    let logs = data_folder::logs_of(file);
    let logs = logs.into_iter().map(|(ending, log)| (log, data_folder::with_ending(copy, ending)));
    for (from, to) in [(file.to_owned(), copy.to_owned())].into_iter().chain(logs) {
        copy_bytes(&from, &to)
            .with_context(|| format!("could not copy {} to {}", from.display(), to.display()))?;
    }
    let good = async {
        backup::take_in_log(copy).await?;
        backup::check(copy).await
    };
    let damaged = good.await.with_context(|| format!("{} is no good backup", file.display()))?;
    ensure!(
        damaged.is_empty() || accept_damaged,
        "in {} something is not as it was written: {}. Take another backup, or give --accept-damaged to restore it all the same: all else of it can be read",
        file.display(),
        damaged.join("; ")
    );
    File::open(copy)?.sync_all().with_context(|| format!("could not bring {} to disk", copy.display()))?;
    Ok(copy.to_owned())
}

/// Without the permissions of the original.
fn copy_bytes(from: &Path, to: &Path) -> io::Result<()> {
    let mut out = private::file().write(true).create_new(true).open(to)?;
    io::copy(&mut File::open(from)?, &mut out)?;
    Ok(())
}

/// What stands where a backup is to go.
struct Standing {
    database: PathBuf,
    is_there: bool,
}

impl Standing {
    fn look(database: PathBuf) -> Result<Standing> {
        let bytes = match fs::symlink_metadata(&database) {
            Ok(file) if file.is_file() => Some(file.len()),
            Ok(_) => bail!(
                "expected {} to be a file, found a link or a folder: move it elsewhere, or give another folder with --data",
                database.display()
            ),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => {
                return Err(error).with_context(|| format!("could not look at {}", database.display()));
            }
        };
        if bytes.unwrap_or(0) == 0
            && let Some((ending, log)) = data_folder::logs_of(&database).first()
        {
            bail!(
                "expected the database {} that the log {} belongs to, found none: that log may hold what was acknowledged. Give it the name of its database with {ending} at the end, or move it elsewhere, and restore then",
                database.display(),
                log.display()
            );
        }
        Ok(Standing { database, is_there: bytes.is_some() })
    }

    /// Gives what stands there a second name, under which it stays: complete, without a log.
    async fn keep(&self, data: &Path) -> Result<Option<PathBuf>> {
        if !self.is_there {
            return Ok(None);
        }
        let database = self.database.display();
        match backup::take_in_log(&self.database).await {
            Ok(()) => {}
            // What is damaged is kept as it is, unless its log would be left behind.
            Err(StoreError::Damaged { .. }) if data_folder::logs_of(&self.database).is_empty() => {}
            Err(error @ StoreError::Damaged { .. }) => {
                return Err(error).with_context(|| {
                    format!("the log beside {database} cannot be taken in and may hold what was acknowledged: move both together to another folder, and restore then")
                });
            }
            Err(error) => {
                return Err(error).with_context(|| format!("could not take in the log of {database}"));
            }
        }
        let synced = File::open(&self.database).and_then(|file| file.sync_all());
        synced.with_context(|| format!("could not bring {database} to disk"))?;
        let stem = format!("{}{}", data_folder::KEPT, utc::in_a_file_name(utc::now()));
        let kept = data_folder::free_name(data, &stem);
        // Never in the place of another: a link to a name that is taken is refused.
        fs::hard_link(&self.database, &kept).with_context(|| {
            format!("could not give {database} the name {} to keep it under: move it elsewhere by hand, and restore then", kept.display())
        })?;
        if let Err(error) = data_folder::sync(data) {
            self.put_back(Some(&kept))?;
            return Err(error).with_context(|| format!("could not bring {} to disk", data.display()));
        }
        Ok(Some(kept))
    }

    /// Makes the database what it was before, after its place was taken or was not.
    fn put_back(&self, kept: Option<&Path>) -> Result<()> {
        let back = match kept {
            Some(kept) if data_folder::is_same_file(kept, &self.database)? => fs::remove_file(kept),
            Some(kept) => fs::rename(kept, &self.database),
            None => match fs::remove_file(&self.database) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
                removed => removed,
            },
        };
        back.with_context(|| match kept {
            Some(kept) => format!("could not put {} back: it is complete, restore it", kept.display()),
            None => format!("could not remove {}", self.database.display()),
        })
    }
}
