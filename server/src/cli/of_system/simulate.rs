//! `lodestep simulate SYSTEM`: the logs of a session that never was, with its truth.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use lodestep_engine::geo::Site;
use lodestep_engine::parse::{imu_csv, values_csv};
use lodestep_engine::stream::Kind;
use lodestep_engine::system::{Declaration, Simulated};

use super::named::{ForSystems, OfSystem};
use crate::cli::failure::Failure;
use crate::cli::own::{self, OwnCommand};
use crate::cli::simulate::site_toml;
use crate::cli::site_file;
use crate::cli::track_output::write_text;

/// The arguments of `lodestep simulate SYSTEM`.
#[derive(Debug, Args)]
pub(in crate::cli) struct SimulatedArgs {
    /// The same seed gives the same files, byte by byte
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Folder to write STREAM.csv for each stream, truth.csv and site.toml to; made when it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// The site: TOML with name, latitude_deg, longitude_deg, height_m [default: FAST]
    #[arg(long, value_name = "SITE.toml")]
    site: Option<PathBuf>,

    /// Write over a session that is in the folder already
    #[arg(long)]
    force: bool,
}

impl ForSystems for SimulatedArgs {
    const OWN: &'static [OwnCommand] = own::SIMULATE;

    fn has(system: &Declaration) -> bool {
        system.simulate.is_some()
    }
}

/// The columns of the truth beside the time.
const TRUTH: [&str; 3] = ["e_m", "n_m", "u_m"];

/// Writes one session.
pub(in crate::cli) fn simulate(session: &OfSystem<SimulatedArgs>) -> Result<()> {
    match session {
        OfSystem::ByDeclaration { system, args } => simulate_declared(system, args),
        OfSystem::Own { command, matches } => (command.run)(matches),
    }
}

fn simulate_declared(system: &'static Declaration, args: &SimulatedArgs) -> Result<()> {
    let Some(simulate) = system.simulate else {
        return Err(Failure::usage(format!("the {} system cannot be simulated", system.name)));
    };
    let site = args.site.as_deref().map_or_else(|| Ok(Site::fast()), |path| site_file::read(path, None))?;
    let Simulated { streams, truth, start_n_m } = simulate(args.seed, &site);
    fs::create_dir_all(&args.out)
        .with_context(|| format!("the folder {} cannot be made", args.out.display()))?;
    let mut files = Vec::new();
    let mut logs = String::new();
    let folder = args.out.display();
    for simulated in &streams {
        let stream = &simulated.stream;
        let names: Vec<&str> = match stream.kind {
            Kind::Imu => imu_csv::COLUMNS[1..].to_vec(),
            Kind::Values => {
                let columns = system.rule_of(stream).map_or(&[][..], |rule| rule.columns);
                columns.iter().map(|column| column.name).collect()
            }
        };
        let mut text = String::new();
        values_csv::write(&names, simulated.rows.iter().map(|(t_ns, row)| (*t_ns, &row[..])), &mut text);
        logs += &format!(" --stream {0}={folder}/{0}.csv", stream.id);
        files.push((format!("{}.csv", stream.id), text));
    }
    let mut text = String::new();
    values_csv::write(&TRUTH, truth.iter().map(|(t_ns, place)| (*t_ns, &place[..])), &mut text);
    files.push(("truth.csv".to_owned(), text));
    files.push(("site.toml".to_owned(), site_toml(&site)));
    let there = files.iter().find(|(name, _)| args.out.join(name).exists());
    if let Some((name, _)) = there.filter(|_| !args.force) {
        return Err(Failure::usage(format!(
            "{folder} holds a session already ({name}): choose another folder, or add --force"
        )));
    }
    for (name, text) in &files {
        write_text(&args.out.join(name), text)?;
    }
    let [e, n, u] = start_n_m;
    // For people only: nothing depends on whether it can be shown.
    let _ = writeln!(
        std::io::stderr(),
        "{} readings; process them with\n  lodestep process {}{logs} --site {folder}/site.toml \
         --initial-position {e:.4},{n:.4},{u:.4} --out track.csv\nor score it with\n  lodestep evaluate --system {} {folder}",
        streams.iter().map(|simulated| simulated.rows.len()).sum::<usize>(),
        system.name,
        system.name
    );
    Ok(())
}
