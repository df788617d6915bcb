//! `lodestep simulate rover`: observations, orbits and ranges of a rover that never was, with its truth.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::builder::PossibleValuesParser;
use clap::{ArgMatches, Args, Command, FromArgMatches as _};
use lodestep_engine::sim::rover::{Scene, simulate};

use crate::cli::failure::Failure;
use crate::cli::output_file;

/// The arguments of `lodestep simulate rover`.
#[derive(Debug, Args)]
struct SimulateArgs {
    /// Folder to write to; made when it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// The same seed gives the same files, byte by byte
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// doorway: into a hall and out again; hall: ranges only; canopy: standing under trees; open: a walk under the open sky
    #[arg(long, default_value = "doorway", value_parser = PossibleValuesParser::new(Scene::ALL.map(|(word, _)| word)))]
    scene: String,

    /// Write over a world that is in the folder already
    #[arg(long)]
    force: bool,
}

/// The command with its help.
pub(in crate::cli) fn command() -> Command {
    SimulateArgs::augment_args(Command::new("rover"))
        .about("Observations of rover and base, orbits, ranges and their truth")
}

/// Runs the command.
pub(in crate::cli) fn run(matches: &ArgMatches) -> Result<()> {
    let args = SimulateArgs::from_arg_matches(matches).map_err(|error| Failure::usage(error.to_string()))?;
    let scene = Scene::ALL
        .into_iter()
        .find(|(word, _)| *word == args.scene)
        .map(|(_, scene)| scene)
        .ok_or_else(|| Failure::usage(format!("there is no scene {}", args.scene)))?;
    let files = simulate(scene, args.seed);
    fs::create_dir_all(&args.out)
        .with_context(|| format!("the folder {} cannot be made", args.out.display()))?;
    if let Some(there) = files.iter().find(|file| !args.force && args.out.join(file.name).exists()) {
        return Err(Failure::usage(format!(
            "{} is there already; choose another folder, or give --force to write over it",
            args.out.join(there.name).display()
        )));
    }
    for file in &files {
        output_file::write(&args.out.join(file.name), |out| out.write_all(file.text.as_bytes()))?;
    }
    let folder = args.out.display();
    let has = |name: &str| files.iter().any(|file| file.name == name);
    let mut next = String::from("lodestep process rover");
    if has("rover.obs") {
        next += &format!(" --rover {folder}/rover.obs --base {folder}/base.obs --nav {folder}/base.nav");
    }
    if has("uwb.csv") {
        next += &format!(" --uwb {folder}/uwb.csv");
    }
    next += &format!(" --instrument {folder}/rover.toml");
    let out = &mut std::io::stdout();
    writeln!(out, "{folder}: {}", files.iter().map(|file| file.name).collect::<Vec<_>>().join(", "))?;
    writeln!(out, "next: {next} --out {folder}/track.csv --report {folder}/report.json")?;
    Ok(())
}
