//! A drill: a backup is made of a database, with a server on it or without, restored elsewhere, and held against the backup, table by
//! table and track by track. A backup that was never restored is none.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::data_folder::DATABASE;
use crate::store::hashes::of;
use crate::{backup, restore};

/// What a drill came to.
#[derive(Debug)]
pub(crate) struct Drilled {
    /// Tables with how many rows each has.
    pub(crate) tables: BTreeMap<String, u64>,
    /// Tracks that were compared.
    pub(crate) tracks: usize,
    /// Bytes of the backup.
    pub(crate) bytes: u64,
    /// How long each part took, s.
    pub(crate) backup_s: f64,
    pub(crate) restore_s: f64,
}

/// Holds a drill on the database of a data folder, in a folder that is removed afterwards.
pub(crate) async fn drill(data: &Path, into: &Path) -> Result<Drilled> {
    let folder = tempfile::Builder::new().prefix("lodestep-drill-").tempdir_in(into);
    let folder = folder.with_context(|| format!("could not make a folder in {}", into.display()))?;
    let begun = std::time::Instant::now();
    let made = backup::make(data, folder.path(), backup::ASKED_FOR).await?;
    let backup_s = begun.elapsed().as_secs_f64();
    ensure!(made.damaged.is_empty(), "what is stored is damaged: {}", made.damaged.join("; "));
    let elsewhere = folder.path().join("restored");
    std::fs::create_dir(&elsewhere)?;
    let begun = std::time::Instant::now();
    restore::restore(&made.file, &elsewhere, false, false).await?;
    let restore_s = begun.elapsed().as_secs_f64();
    let (backed_up, restored) = (of(&made.file).await?, of(&elsewhere.join(DATABASE)).await?);
    same("table", &backed_up.tables, &restored.tables)?;
    same("track", &backed_up.tracks, &restored.tracks)?;
    // What is finished does not change while the backup is made: the server's own must say the same of each track.
    let standing = of(&data.join(DATABASE)).await?;
    let tracks = backed_up.tracks.iter().filter(|(id, hash)| standing.tracks.get(*id) == Some(*hash)).count();
    let tables = restored.tables.into_iter().map(|(name, (rows, _))| (name, rows)).collect();
    Ok(Drilled { tables, tracks, bytes: made.bytes, backup_s, restore_s })
}

/// Makes sure that what was restored is what was backed up.
fn same<T: PartialEq + std::fmt::Debug>(
    what: &str,
    expected: &BTreeMap<String, T>,
    found: &BTreeMap<String, T>,
) -> Result<()> {
    for (name, hash) in expected {
        ensure!(
            found.get(name) == Some(hash),
            "expected the {what} {name} as it was backed up ({hash:?}), found {:?} after restoring",
            found.get(name)
        );
    }
    ensure!(found.len() == expected.len(), "after restoring there are {what}s that were not backed up");
    Ok(())
}
