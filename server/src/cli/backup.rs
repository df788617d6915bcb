//! `lodestep backup` and `lodestep restore`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::print::print;
use crate::{backup, data_folder, restore};

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
}

/// Makes a backup and says where it is.
pub(super) fn backup(args: &BackupArgs) -> Result<()> {
    let into = args.out.clone().unwrap_or_else(|| backup::folder(&args.data));
    let made = runtime()?.block_on(backup::make(&args.data, &into))?;
    print(&format!("{} ({} bytes, read from end to end)\n", made.file.display(), made.bytes))
}

/// Brings one back.
pub(super) fn restore(args: &RestoreArgs) -> Result<()> {
    let _held = data_folder::hold(&args.data)?;
    let former = runtime()?.block_on(restore::restore(&args.file, &args.data, args.replace))?;
    print(&format!("restored {} to {}\n", args.file.display(), args.data.display()))?;
    match former {
        Some(former) => print(&format!("the former database is {}\n", former.display())),
        None => Ok(()),
    }
}

fn runtime() -> Result<tokio::runtime::Runtime> {
    Ok(tokio::runtime::Builder::new_multi_thread().enable_all().build()?)
}
