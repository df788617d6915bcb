//! `lodestep simulate`: the logs of a walk that never was, or of a session of another system, with its truth.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use flate2::Compression;
use flate2::write::GzEncoder;
use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::parse::visits_csv::VisitRow;
use lodestep_engine::parse::{imu_csv, markers_csv, visits_csv};
use lodestep_engine::sim::pedestrian::{Epoch, SensorModel, Simulator, WalkKind};
use lodestep_engine::track::csv::push_seconds;

use crate::cli::failure::Failure;
use crate::cli::of_system::{self, OfSystem, SimulatedArgs};
use crate::cli::output_file::{OutputFile, cannot};
use crate::cli::track_output::write_text;
use crate::cli::{progress, site_file};

/// The arguments of `lodestep simulate`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct SimulateCommand {
    #[command(subcommand)]
    session: Option<OfSystem<SimulatedArgs>>,

    #[command(flatten)]
    walk: Option<SimulateArgs>,
}

/// The arguments for a walk.
#[derive(Debug, Args)]
struct SimulateArgs {
    /// The walk: rectangle (1.4 km), spiral (3.3 km on FAST's road, a visit every 150 m), stairs,
    /// running, line:METRES, slow:METRES, run:METRES, crawl:METRES, block:METRES or standing:SECONDS
    #[arg(long, value_name = "WALK")]
    walk: WalkKind,

    /// The same seed gives the same files, byte by byte
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Folder to write left.csv, right.csv, markers.csv, visits.csv, truth.csv and site.toml to; made
    /// when it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// The site: TOML with name, latitude_deg, longitude_deg, height_m [default: FAST]
    #[arg(long, value_name = "SITE.toml")]
    site: Option<PathBuf>,

    /// The sensors
    #[arg(long, value_enum, default_value_t = Sensors::Cmp10a)]
    sensors: Sensors,

    /// Pack the logs and the truth with gzip, as left.csv.gz and so on
    #[arg(long)]
    gzip: bool,

    /// Write over a walk that is in the folder already
    #[arg(long)]
    force: bool,
}

/// Which sensors are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Sensors {
    /// CMP10A: 100 Hz, ±2000 °/s, ±16 g, 16 bits, with noise, biases and magnetic anomalies
    Cmp10a,
    /// Without noise, bias and rounding
    Perfect,
}

/// Writes one walk, or one session of the system that is named.
pub(super) fn simulate(command: &SimulateCommand) -> Result<()> {
    match (&command.session, &command.walk) {
        (Some(session), _) => of_system::simulate(session),
        (None, Some(walk)) => simulate_walk(walk),
        (None, None) => Err(Failure::usage("expected a walk, or a system, found neither: see --help")),
    }
}

fn simulate_walk(args: &SimulateArgs) -> Result<()> {
    let site = args.site.as_deref().map_or_else(|| Ok(Site::fast()), |path| site_file::read(path, None))?;
    let model = match args.sensors {
        Sensors::Cmp10a => SensorModel::cmp10a(),
        Sensors::Perfect => SensorModel::perfect(),
    };
    fs::create_dir_all(&args.out)
        .with_context(|| format!("the folder {} cannot be made", args.out.display()))?;
    let ending = if args.gzip { "csv.gz" } else { "csv" };
    for name in ["left.csv", "left.csv.gz", "right.csv", "right.csv.gz", "truth.csv", "truth.csv.gz"] {
        if !args.force && args.out.join(name).exists() {
            return Err(Failure::usage(format!(
                "{} holds a walk already ({name}): choose another folder, or add --force",
                args.out.display()
            )));
        }
    }

    let mut simulator = Simulator::new(&args.walk, args.seed, &site, &model);
    let start = simulator.start_n_m();
    let visits: Vec<VisitRow> = simulator
        .visits()
        .iter()
        .map(|visit| VisitRow {
            t_start_ns: visit.t_start_ns,
            t_end_ns: visit.t_end_ns,
            marker: visit.marker.clone(),
        })
        .collect();

    let table = |name: &str| Table::create(&args.out.join(format!("{name}.{ending}")), args.gzip);
    let (mut left, mut right, mut truth) = (table("left")?, table("right")?, table("truth")?);
    let bar = progress::of_count(simulator.epochs() as u64, "epochs");
    let mut text = String::new();
    truth.push(TRUTH_HEADER)?;
    let mut first = true;
    while let Some(epoch) = simulator.next_epoch() {
        for (log, sample) in [(&mut left, &epoch.samples[0]), (&mut right, &epoch.samples[1])] {
            text.clear();
            let logged = match args.sensors {
                Sensors::Cmp10a => sample.as_logged(),
                Sensors::Perfect => *sample,
            };
            imu_csv::write(&[logged], first, &mut text);
            log.push(&text)?;
        }
        text.clear();
        push_truth(&epoch, &mut text);
        truth.push(&text)?;
        first = false;
        bar.inc(1);
    }
    bar.finish_and_clear();
    for file in [left, right, truth] {
        file.finish()?;
    }

    let anchors = if visits.is_empty() { Vec::new() } else { terrain::anchors(&site) };
    let markers = markers_csv::write(anchors.iter().map(|anchor| {
        let [e_m, n_m, u_m] = anchor.position_n_m.map(|value| rounded(value, 1e4));
        (anchor.name.as_str(), e_m, n_m, Some(u_m))
    }));
    write_text(&args.out.join("markers.csv"), &markers)?;
    write_text(&args.out.join("visits.csv"), &visits_csv::write(&visits))?;
    write_text(&args.out.join("site.toml"), &site_toml(&site))?;
    let folder = args.out.display();
    // A zero without a sign.
    let [e, n, u] = start.map(|value| rounded(value, 1e4) + 0.0);
    // For people only: nothing depends on whether it can be shown.
    let _ = writeln!(
        std::io::stderr(),
        "{:.0} s, {:.0} m, {} visits; process it with\n  lodestep process --left {folder}/left.{ending} --right \
         {folder}/right.{ending} --site {folder}/site.toml --markers {folder}/markers.csv --visits {folder}/visits.csv \
         --initial-position {e:.4},{n:.4},{u:.4} --out track.csv\nor score it with\n  lodestep evaluate {folder}",
        simulator.duration_s(),
        simulator.distance_m(),
        visits.len()
    );
    Ok(())
}

const TRUTH_HEADER: &str =
    "t_s,e_m,n_m,u_m,left_e_m,left_n_m,left_u_m,right_e_m,right_n_m,right_u_m,left_stance,right_stance\n";

/// The middle of the feet and both feet, to a tenth of a millimetre.
fn push_truth(epoch: &Epoch, text: &mut String) {
    push_seconds(epoch.t_ns, text);
    let [left, right] = epoch.truth.map(|foot| foot.position_n_m);
    let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (left[axis] + right[axis]));
    for value in middle.iter().chain(&left).chain(&right) {
        write!(text, ",{value:.4}").expect("writing to a string cannot fail");
    }
    for foot in epoch.truth {
        text.push_str(if foot.stance { ",1" } else { ",0" });
    }
    text.push('\n');
}

fn rounded(value: f64, steps_per_unit: f64) -> f64 {
    (value * steps_per_unit).round() / steps_per_unit
}

pub(super) fn site_toml(site: &Site) -> String {
    format!(
        "# Where the site's origin lies: degrees, metres above the WGS84 ellipsoid.\n\
         name = {:?}\nlatitude_deg = {:?}\nlongitude_deg = {:?}\nheight_m = {:?}\n\
         # m/s²; degrees, east of true north positive; degrees below the horizon; µT.\n\
         gravity_m_s2 = {:?}\ndeclination_deg = {:?}\ninclination_deg = {:?}\nfield_ut = {:?}\n\
         azimuth_of_plan_deg = {:?}\n",
        site.name,
        site.latitude_deg,
        site.longitude_deg,
        site.height_m,
        site.gravity_m_s2,
        site.declination_deg,
        site.inclination_deg,
        site.field_ut,
        site.azimuth_of_plan_deg
    )
}

/// A table on its way to a file, packed or not.
enum Table {
    Plain(PathBuf, OutputFile),
    Gzip(PathBuf, GzEncoder<OutputFile>),
}

impl Table {
    fn create(path: &Path, gzip: bool) -> Result<Table> {
        let file = OutputFile::create(path)?;
        Ok(if gzip {
            Table::Gzip(path.to_owned(), GzEncoder::new(file, Compression::default()))
        } else {
            Table::Plain(path.to_owned(), file)
        })
    }

    fn push(&mut self, text: &str) -> Result<()> {
        match self {
            Table::Plain(path, file) => file.write_all(text.as_bytes()).with_context(|| cannot(path)),
            Table::Gzip(path, packer) => packer.write_all(text.as_bytes()).with_context(|| cannot(path)),
        }
    }

    fn finish(self) -> Result<()> {
        match self {
            Table::Plain(_, file) => file.finish(),
            Table::Gzip(path, packer) => packer.finish().with_context(|| cannot(&path))?.finish(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_site_is_read_as_it_was_written() {
        let site = Site::fast();
        assert_eq!(Site::from_toml(&site_toml(&site)).unwrap(), site);
    }
}
