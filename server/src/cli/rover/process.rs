//! The command: which files, which way.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use clap::{ArgMatches, Args, Command, FromArgMatches as _, ValueEnum};
use lodestep_engine::anomaly::Cause as _;
use lodestep_engine::gnss::satellite::Constellation;
use lodestep_engine::systems::rover::causes::RoverCause;
use lodestep_engine::systems::rover::computation::{self, Done, Means};
use lodestep_engine::systems::rover::instrument::{Anchor, Place};
use lodestep_engine::systems::rover::recording::Recording;
use lodestep_engine::systems::rover::told::{self, Placement};
use lodestep_engine::track::Track;

use super::report::Report;
use super::{files, track_file};
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
    #[arg(long, value_name = "uwb.csv")]
    uwb: Option<PathBuf>,

    /// The anchors: anchor,e_m,n_m,u_m [default: those of the instrument]
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

    /// The track: RTKLIB's .pos or .nmea by its ending, else CSV
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

pub(in crate::cli) fn parse_place(text: &str) -> Result<[f64; 3], String> {
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
    RoverArgs::augment_args(Command::new("rover"))
        .about("A satellite receiver and a UWB tag, from the open sky into the hall")
}

/// Runs the command.
pub(in crate::cli) fn run(matches: &ArgMatches) -> Result<()> {
    let args = RoverArgs::from_arg_matches(matches).map_err(|error| Failure::usage(error.to_string()))?;
    let began = Instant::now();
    let Some(main) = args.rover.as_ref().or(args.uwb.as_ref()) else {
        return Err(Failure::usage(
            "give --rover, --base and --nav for satellites, or --uwb and --anchors for ranges alone",
        ));
    };
    let means = means(&args)?;
    let mut notes = Vec::new();
    let recording = recording(&args, &mut notes)?;
    let smoothed = args.solution == Solution::Smoothed;
    let done = computation::compute(&recording, &means, smoothed, args.estimator == Estimator::Paper)
        .map_err(|cause| Failure::bad_input(blamed(&cause, &args).unwrap_or(main), cause.sentence()))?;
    notes.extend(done.anomalies.iter().map(RoverCause::sentence));
    track_file::write(&args.out, &done.rows)?;
    let report = Report {
        done: &done,
        process_seconds: began.elapsed().as_secs_f64(),
        anomalies: &notes,
        estimator: if args.estimator == Estimator::Own { "own" } else { "paper" },
        solution: if smoothed { "smoothed" } else { "filtered" },
    };
    if let Some(place) = &args.report {
        let json =
            serde_json::to_string_pretty(&report.json(&track_sha256(&done, &means, recording.zero_ns())))?;
        output_file::write(place, |out| writeln!(out, "{json}"))?;
    }
    for note in &notes {
        let _ = writeln!(std::io::stderr(), "lodestep: {note}");
    }
    let _ = writeln!(std::io::stderr(), "{}", report.sentence(&args.out));
    Ok(())
}

/// The file that such a cause is about, where it is another than the main one.
fn blamed<'a>(cause: &RoverCause, args: &'a RoverArgs) -> Option<&'a PathBuf> {
    match cause {
        RoverCause::NoBasePlace => args.base.as_ref(),
        RoverCause::WrongUnit { .. } | RoverCause::NoKnownAnchor { .. } => args.uwb.as_ref(),
        RoverCause::NoOrbits { .. } => args.nav.first(),
        _ => None,
    }
}

/// Reads the files.
fn recording(args: &RoverArgs, notes: &mut Vec<String>) -> Result<Recording> {
    let mut recording = Recording::default();
    if let (Some(rover), Some(base)) = (&args.rover, &args.base) {
        recording.rover = files::observations(rover, notes)?;
        recording.base = files::observations(base, notes)?;
        recording.navigation = files::navigation(&args.nav, notes)?;
    }
    if let Some(uwb) = &args.uwb {
        recording.ranges = files::ranges(uwb, notes)?;
    }
    Ok(recording)
}

/// What is known beforehand; what the command line says goes before the instrument's file.
fn means(args: &RoverArgs) -> Result<Means> {
    let mut instrument = files::instrument(args.instrument.as_deref())?;
    if let Some(anchors) = &args.anchors {
        instrument.anchors = files::anchors(anchors)?.into_iter().map(Anchor::from).collect();
    }
    if let Some([latitude_deg, longitude_deg, height_m]) = args.base_position {
        instrument.base = Some(Place { latitude_deg, longitude_deg, height_m });
    }
    Ok(Means {
        instrument,
        systems: args.systems.0.clone(),
        initial_position_m: args.initial_position,
        with_ranges: true,
    })
}

/// The hash of the track that a session of the server comes to with the same files, where the site is that of the instrument's file.
fn track_sha256(done: &Done, means: &Means, zero_ns: i64) -> String {
    let site = means.instrument.site.map(|site| site.geodetic());
    let placement = Placement::new(done.base, site);
    let mut track = Track { points: told::points(done, placement, zero_ns), ..Track::default() };
    told::anomalies(done, placement, zero_ns).into_iter().for_each(|event| track.take(event));
    track.sha256()
}
