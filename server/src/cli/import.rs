//! `lodestep import`: a one-machine server's database, moved into PostgreSQL.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::print::print;
use crate::store::import;

/// The arguments of `lodestep import`.
#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// The database file, or a backup of it; no server may write to it meanwhile.
    file: PathBuf,
    /// Address of the PostgreSQL database, an empty one.
    #[arg(long, env = "LODESTEP_DATABASE", value_name = "ADDRESS", hide_env_values = true)]
    database: String,
}

/// Moves it and says what was moved.
pub(super) fn import(args: &ImportArgs) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let moved = runtime
        .block_on(import::import(&args.file, Path::new(&args.database)))
        .with_context(|| format!("could not move {} in", args.file.display()))?;
    for table in &moved {
        print(&format!(
            "{:>10} rows of {}, the same in both ({})\n",
            table.rows,
            table.table,
            &table.sha256[..16]
        ))?;
    }
    let rows: u64 = moved.iter().map(|table| table.rows).sum();
    print(&format!("{rows} rows of {} tables moved in and compared\n", moved.len()))
}
