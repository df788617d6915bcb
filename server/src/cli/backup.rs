//! `lodestep backup`, `lodestep restore` and `lodestep drill`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::print::print;
use crate::{backup, data_folder, drill, restore};

/// The arguments of `lodestep backup`.
#[derive(Debug, Args)]
pub(super) struct BackupArgs {
    /// Folder of the server's database; the server may be running.
    #[arg(long, env = "LODESTEP_DATA", value_name = "FOLDER", default_value = "data")]
    data: PathBuf,
    /// Folder for the backup; the folder backups in the data folder, when it is left out.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// The arguments of `lodestep restore`.
#[derive(Debug, Args)]
pub(super) struct RestoreArgs {
    /// The backup
    file: PathBuf,
    /// Folder for the server's database; no server may run there.
    #[arg(long, env = "LODESTEP_DATA", value_name = "FOLDER", default_value = "data")]
    data: PathBuf,
    /// Takes the place of a database that is there; that one is kept beside it.
    #[arg(long)]
    replace: bool,
    /// Restores also what is not as it was written by its own checksums; it is named
    #[arg(long)]
    accept_damaged: bool,
}

/// The arguments of `lodestep drill`.
#[derive(Debug, Args)]
pub(super) struct DrillArgs {
    /// Folder of the server's database; the server may be running.
    #[arg(long, env = "LODESTEP_DATA", value_name = "FOLDER", default_value = "data")]
    data: PathBuf,
    /// Folder for what the drill makes and removes again, twice as large as the database; the system's for such files, when it is
    /// left out.
    #[arg(long, value_name = "FOLDER")]
    into: Option<PathBuf>,
}

/// Makes a backup and says where it is.
pub(super) fn backup(args: &BackupArgs) -> Result<()> {
    let into = args.out.clone().unwrap_or_else(|| backup::folder(&args.data));
    let made = runtime()?.block_on(backup::make(&args.data, &into, backup::ASKED_FOR))?;
    for what in &made.damaged {
        print(&format!("damaged: {what}\n"))?;
    }
    print(&format!("{} ({} bytes, read from end to end)\n", made.file.display(), made.bytes))
}

/// Brings one back.
pub(super) fn restore(args: &RestoreArgs) -> Result<()> {
    let _held = data_folder::hold(&args.data)?;
    let former =
        runtime()?.block_on(restore::restore(&args.file, &args.data, args.replace, args.accept_damaged))?;
    print(&format!("restored {} to {}\n", args.file.display(), args.data.display()))?;
    match former {
        Some(former) => print(&format!("the former database is {}\n", former.display())),
        None => Ok(()),
    }
}

/// Holds a drill and says what came of it.
pub(super) fn drill(args: &DrillArgs) -> Result<()> {
    let into = args.into.clone().unwrap_or_else(std::env::temp_dir);
    let drilled = runtime()?.block_on(drill::drill(&args.data, &into))?;
    let rows: u64 = drilled.tables.values().sum();
    print(&format!(
        "backed up in {:.1} s ({} bytes), restored in {:.1} s: {} tables with {rows} rows are the same, and {} tracks\n",
        drilled.backup_s,
        drilled.bytes,
        drilled.restore_s,
        drilled.tables.len(),
        drilled.tracks
    ))
}

fn runtime() -> Result<tokio::runtime::Runtime> {
    Ok(tokio::runtime::Builder::new_multi_thread().enable_all().build()?)
}
