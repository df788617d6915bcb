//! The command: which files, which way.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use clap::{ArgMatches, Args, Command, FromArgMatches as _, ValueEnum};
use lodestep_engine::geo::Geodetic;
use lodestep_engine::gnss::observations::Observations;
use lodestep_engine::gnss::satellite::Constellation;
use lodestep_engine::systems::rover::coupling::{CoupledAnchor, CoupledRange};
use lodestep_engine::systems::rover::instrument::Instrument;
use lodestep_engine::systems::rover::row::{HEADER, Row};
use lodestep_engine::systems::rover::{ranges_alone, ranges_check, run as whole_run};

use super::files;
use super::report::{AnchorLine, Report};
use crate::cli::failure::Failure;
use crate::cli::output_file;

/// Which estimator works it out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Estimator {
    /// Lodestep's own
    #[default]
    Own,
    /// The straight reading of paper 5, to compare with
    Paper,
}

/// Which solution is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Solution {
    /// Each row by what came before it
    #[default]
    Filtered,
    /// Each row by all observations
    Smoothed,
}

/// The arguments of `lodestep process rover`.
#[derive(Debug, Args)]
struct RoverArgs {
    /// The rover's observations, RINEX 2.10 to 4, packed by gzip or not
    #[arg(long, value_name = "R.obs", requires = "nav", requires = "base")]
    rover: Option<PathBuf>,

    /// The base's observations
    #[arg(long, value_name = "B.obs", requires = "rover")]
    base: Option<PathBuf>,

    /// Navigation: broadcast orbits and clocks; may be given often
    #[arg(long, value_name = "N.nav", requires = "rover")]
    nav: Vec<PathBuf>,

    /// The base's antenna, degrees and ellipsoidal metres, WGS84 [default: the base file's APPROX POSITION XYZ and ANTENNA
    /// DELTA]
    #[arg(long, value_name = "LAT,LON,H", value_parser = parse_place, allow_hyphen_values = true, requires = "base")]
    base_position: Option<[f64; 3]>,

    /// Ranges of the tag: t_s,anchor,range_m
    #[arg(long, value_name = "uwb.csv", requires = "anchors")]
    uwb: Option<PathBuf>,

    /// The anchors: anchor,e_m,n_m,u_m
    #[arg(long, value_name = "anchors.csv", requires = "uwb")]
    anchors: Option<PathBuf>,

    /// What is known of the rover's instruments, TOML
    #[arg(long, value_name = "rover.toml")]
    instrument: Option<PathBuf>,

    /// Where the rover's antenna is at the start, m in the frame of the track
    #[arg(long, value_name = "E,N,U", value_parser = parse_position, allow_hyphen_values = true)]
    initial_position: Option<[f64; 3]>,

    /// Which estimator works it out
    #[arg(long, value_enum, default_value_t)]
    estimator: Estimator,

    /// Which solution is given
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,

    /// Satellite systems to use, with commas in between: G GPS, C BeiDou, E Galileo, J QZSS
    #[arg(long, value_name = "LIST", default_value = "G,C,E,J", value_parser = parse_systems)]
    systems: Systems,

    /// The track, CSV
    #[arg(long, value_name = "track.csv")]
    out: PathBuf,

    /// What the run came to, JSON
    #[arg(long, value_name = "report.json")]
    report: Option<PathBuf>,
}

#[derive(Clone, Debug)]
struct Systems(Vec<Constellation>);

fn parse_systems(text: &str) -> Result<Systems, String> {
    let one = |word: &str| {
        let word = word.trim().to_ascii_uppercase();
        match word.as_bytes() {
            [letter] => Constellation::from_letter(*letter),
            _ => None,
        }
        .ok_or_else(|| format!("expected G, C, E or J, found {word:?}"))
    };
    text.split(',').map(one).collect::<Result<_, _>>().map(Systems)
}

fn parse_position(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> = text.split(',').map_while(|word| word.trim().parse().ok()).collect();
    match numbers.as_slice() {
        [a, b, c] if text.split(',').count() == 3 && numbers.iter().all(|number| number.is_finite()) => {
            Ok([*a, *b, *c])
        }
        _ => Err(format!("expected three numbers with commas in between, found {text:?}")),
    }
}

fn parse_place(text: &str) -> Result<[f64; 3], String> {
    let place = parse_position(text)?;
    let [latitude, longitude, height] = place;
    if latitude.abs() > 90.0 || longitude.abs() > 360.0 || !(-1000.0..20_000.0).contains(&height) {
        return Err(format!(
            "expected degrees north, degrees east and metres above the ellipsoid, found {text:?}"
        ));
    }
    Ok(place)
}

/// The command with its help.
pub(in crate::cli) fn command() -> Command {
    RoverArgs::augment_args(
        Command::new("rover").about("A satellite receiver and a UWB tag, from the open sky into the hall"),
    )
}

/// Runs the command.
pub(in crate::cli) fn run(matches: &ArgMatches) -> Result<()> {
    let args = RoverArgs::from_arg_matches(matches).map_err(|error| Failure::usage(error.to_string()))?;
    let began = Instant::now();
    let instrument = files::instrument(args.instrument.as_deref())?;
    let done = match (&args.rover, &args.base) {
        (Some(rover), Some(base)) => with_satellites(&args, rover, base, &instrument)?,
        _ => ranges_only(&args, &instrument)?,
    };
    let mut text = String::with_capacity(170 * (done.rows.len() + 1));
    text.push_str(HEADER);
    done.rows.iter().for_each(|row| row.write(&mut text));
    output_file::write(&args.out, |out| out.write_all(text.as_bytes()))?;
    let report = Report {
        rows: &done.rows,
        process_seconds: began.elapsed().as_secs_f64(),
        slips: done.slips,
        anchors: done.anchors,
        uwb_clock_offset_s: done.clock_offset_s,
        anomalies: &done.anomalies,
        estimator: if args.estimator == Estimator::Own { "own" } else { "paper" },
        solution: if args.solution == Solution::Filtered { "filtered" } else { "smoothed" },
    };
    if let Some(place) = &args.report {
        let json = serde_json::to_string_pretty(&report.json())?;
        output_file::write(place, |out| writeln!(out, "{json}"))?;
    }
    for anomaly in &done.anomalies {
        let _ = writeln!(std::io::stderr(), "lodestep: {anomaly}");
    }
    let _ = writeln!(std::io::stderr(), "{}", report.sentence(&args.out));
    Ok(())
}

/// What either way comes to.
#[derive(Default)]
struct Done {
    rows: Vec<Row>,
    slips: usize,
    anchors: Vec<AnchorLine>,
    clock_offset_s: Option<[f64; 2]>,
    anomalies: Vec<String>,
}

fn with_satellites(
    args: &RoverArgs,
    rover_path: &std::path::Path,
    base_path: &std::path::Path,
    instrument: &Instrument,
) -> Result<Done> {
    let mut anomalies = Vec::new();
    let rover = files::observations(rover_path, &mut anomalies)?;
    let base = files::observations(base_path, &mut anomalies)?;
    let navigation = files::navigation(&args.nav, &mut anomalies)?;
    let base_place = match args.base_position {
        Some([latitude_deg, longitude_deg, height_m]) => Geodetic { latitude_deg, longitude_deg, height_m },
        None => place_of(&base).ok_or_else(|| {
            Failure::bad_input(
                base_path,
                "the header has no APPROX POSITION XYZ; give the base's place by --base-position LAT,LON,H",
            )
        })?,
    };
    let (ranges, anchors, mut doubts) = match (&args.uwb, &args.anchors) {
        (Some(uwb), Some(surveyed)) => coupled(uwb, surveyed, &mut anomalies)?,
        _ => Default::default(),
    };
    let outcome = whole_run::run(&whole_run::Inputs {
        rover: &rover,
        base: &base,
        navigation: &navigation,
        base_place,
        instrument,
        systems: &args.systems.0,
        ranges: &ranges,
        anchors: &anchors,
        doubtful: !doubts.is_empty(),
        smoothed: args.solution == Solution::Smoothed,
        paper: args.estimator == Estimator::Paper,
        initial_position_m: args.initial_position,
    });
    anomalies.append(&mut doubts);
    anomalies.extend(outcome.anomalies);
    if outcome.rows.is_empty() {
        let why = anomalies.last().cloned();
        let why = why
            .unwrap_or_else(|| "no epoch has enough satellites with known orbits for a position".to_owned());
        return Err(Failure::bad_input(rover_path, why));
    }
    let anchors = outcome.anchors.into_iter().map(|one| AnchorLine {
        anchor: one.anchor,
        bias_m: one.bias_m,
        sigma_m: one.sigma_m,
        used: one.used as u64,
        rejected: one.rejected as u64,
    });
    Ok(Done {
        rows: outcome.rows,
        slips: outcome.slips,
        anchors: anchors.collect(),
        clock_offset_s: outcome.clock_offset_s,
        anomalies,
    })
}

/// Ranges and anchors by number, and what speaks against them.
type Coupled = (Vec<CoupledRange>, Vec<CoupledAnchor>, Vec<String>);

fn coupled(
    uwb: &std::path::Path,
    surveyed: &std::path::Path,
    anomalies: &mut Vec<String>,
) -> Result<Coupled> {
    let ranges = files::ranges(uwb, anomalies)?;
    let anchors = files::anchors(surveyed)?;
    let matched =
        ranges_check::matched(&ranges, &anchors).map_err(|sentence| Failure::bad_input(uwb, sentence))?;
    ranges_check::check_unit(&ranges.rows, &matched, &anchors)
        .map_err(|sentence| Failure::bad_input(uwb, sentence))?;
    anomalies.extend(ranges.notes.iter().map(|note| format!("{}: {note}", uwb.display())));
    anomalies.extend(ranges_check::unknown(&ranges, &matched));
    let doubts: Vec<String> = ranges_check::swapped(&ranges.rows, &matched, &anchors).into_iter().collect();
    let known = ranges
        .rows
        .iter()
        .filter(|row| row.range_m.is_finite())
        .filter_map(|row| {
            Some(CoupledRange {
                t_s: row.t_ns as f64 * 1e-9,
                anchor: matched[row.anchor]?,
                range_m: row.range_m,
            })
        })
        .collect();
    let anchors =
        anchors.into_iter().map(|one| CoupledAnchor { name: one.name, p_n: one.p_n.into() }).collect();
    Ok((known, anchors, doubts))
}

/// The antenna by a file's header.
fn place_of(file: &Observations) -> Option<Geodetic> {
    let marker = Geodetic::from_ecef_m(file.approximate_position_m?);
    let [up, east, north] = file.antenna_delta_hen_m;
    Some(lodestep_engine::geo::LocalFrame::new(marker).to_geodetic([east, north, up]))
}

fn ranges_only(args: &RoverArgs, instrument: &Instrument) -> Result<Done> {
    let (Some(uwb), Some(anchors)) = (&args.uwb, &args.anchors) else {
        return Err(Failure::usage(
            "give --rover, --base and --nav for satellites, or --uwb and --anchors for ranges alone",
        ));
    };
    let mut anomalies = Vec::new();
    let ranges = files::ranges(uwb, &mut anomalies)?;
    let surveyed = files::anchors(anchors)?;
    let smoothed = args.solution == Solution::Smoothed;
    let outcome = ranges_alone::run(&ranges, &surveyed, instrument, args.initial_position, smoothed)
        .map_err(|sentence| Failure::bad_input(uwb, sentence))?;
    anomalies.extend(outcome.anomalies);
    let anchors = outcome.anchors.into_iter().map(|(anchor, one)| AnchorLine {
        anchor,
        bias_m: one.bias_m,
        sigma_m: one.bias_sigma_m,
        used: one.used,
        rejected: one.rejected,
    });
    Ok(Done { rows: outcome.rows, anchors: anchors.collect(), anomalies, ..Done::default() })
}
