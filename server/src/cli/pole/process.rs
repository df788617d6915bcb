//! `lodestep process pole`.

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use clap::{ArgMatches, Args, Command, FromArgMatches as _, ValueEnum};
use lodestep_engine::anomaly::Cause as _;
use lodestep_engine::systems::pole::pole_file;
use lodestep_engine::systems::pole::recorder::Recorder;
use lodestep_engine::systems::pole::survey::{self, Options, Survey};
use lodestep_engine::systems::pole::tuning::Tuning;

use super::{files, report, surveyed, track};
use crate::cli::failure::Failure;
use crate::cli::log_file;
use crate::cli::process::parse_rate;
use crate::cli::site_file;
use crate::cli::track_output::write_text;

const AFTER_HELP: &str = "\
All files are CSV with a header, plain or packed with gzip or zstd.
  imu.csv      t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2: means over the interval before t
  gnss.csv     t_s,lat_deg,lon_deg,height_m,sigma_e_m,sigma_n_m,sigma_u_m,quality (fixed, float, single): the antenna's
               phase centre, WGS84, height above the ellipsoid; or RTKLIB's .pos; or NMEA (GGA with GST)
  contact.csv  t_s,contact: the switch in the tip, a row at each change
  points.csv   name,t_start_s,t_end_s and, where they pass through, code, description: when the tip was held on which point
  pole.toml    [site] name, latitude_deg, longitude_deg, height_m; [pole] antenna_b_m, tip_b_m: from the sensor, in its
               axes, m; without tip_b_m the sensor is in the hand and touches nothing

Exit codes: 0 done; 1 something failed inside, or a result could not be written;
2 the command line is wrong; 3 an input file is wrong.";

/// The arguments of `lodestep process pole`.
#[derive(Debug, Args)]
struct PoleArgs {
    /// Log of the inertial sensor (rad/s, m/s²)
    #[arg(long, value_name = "IMU.csv")]
    imu: PathBuf,

    /// Positions of the antenna
    #[arg(long, value_name = "GNSS.csv")]
    gnss: PathBuf,

    /// The switch in the tip [default: contact is found by the sensor alone]
    #[arg(long, value_name = "CONTACT.csv")]
    contact: Option<PathBuf>,

    /// The pole: lever arms, and the site
    #[arg(long, value_name = "POLE.toml")]
    instrument: PathBuf,

    /// When the tip was held on which point
    #[arg(long, value_name = "POINTS.csv")]
    points: Option<PathBuf>,

    /// The points as surveyed: .csv with all columns, .txt as point, northing, easting, elevation, description, .xml as `LandXML`
    #[arg(long, value_name = "SURVEYED.csv", requires = "points")]
    points_out: Option<PathBuf>,

    /// The site, in place of the one in the pole's file
    #[arg(long, value_name = "SITE.toml")]
    site: Option<PathBuf>,

    /// Which estimator to use
    #[arg(long, value_enum, default_value_t = Estimator::Own)]
    estimator: Estimator,

    /// Which solution to give
    #[arg(long, value_enum, default_value_t = Solution::Smoothed)]
    solution: Solution,

    /// Rows per second in the track, Hz
    #[arg(long, value_name = "HZ", value_parser = parse_rate, default_value = "20")]
    rate_hz: f64,

    /// The track
    #[arg(long, value_name = "TRACK.csv")]
    out: PathBuf,

    /// What was found out, as JSON
    #[arg(long, value_name = "REPORT.json")]
    report: Option<PathBuf>,
}

/// An estimator of the pole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Estimator {
    /// The product's own
    Own,
    /// Paper 4, read straight: 21 states
    Paper,
}

/// A solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Solution {
    /// What was known at the time
    Filtered,
    /// What is known afterwards
    Smoothed,
}

/// The command with its help.
pub(super) fn command() -> Command {
    PoleArgs::augment_args(Command::new("pole"))
        .about("A survey with an inertial positioning pole: carries fixes to points without sky")
        .after_help(AFTER_HELP)
}

/// Processes one survey.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let args = PoleArgs::from_arg_matches(matches)?;
    let began = Instant::now();
    let (instrument, own_site) = pole_file::read(&log_file::read_text(&args.instrument)?)
        .map_err(|error| Failure::bad_input(&args.instrument, error))?;
    let site = match (&args.site, own_site) {
        (Some(path), _) => site_file::read(path, None)?,
        (None, Some(site)) => site,
        (None, None) => {
            return Err(Failure::bad_input(
                &args.instrument,
                "expected a [site] with latitude_deg, longitude_deg and height_m, found none; add it, or give --site SITE.toml",
            ));
        }
    };
    let frame = site.local_frame();
    let mut recorder = Recorder::default();
    files::samples(&args.imu, &mut recorder)?;
    files::positions(&args.gnss, &mut recorder)?;
    if let Some(path) = &args.contact {
        files::switch(path, &mut recorder)?;
    }
    let stops = args.points.as_deref().map(files::stops).transpose()?.unwrap_or_default();
    let recording = recorder.recording(&frame, stops.iter().map(|stop| stop.stop.clone()).collect());
    let imu = &recording.imu;
    let ends = [imu.first().map_or(0, |sample| sample.t_ns), imu.last().map_or(0, |sample| sample.t_ns)];
    let samples = imu.len();
    let tuning = match (args.estimator, instrument.tip_b_m) {
        (Estimator::Paper, _) => Tuning::paper(),
        (Estimator::Own, Some(_)) => Tuning::default(),
        (Estimator::Own, None) => Tuning::handheld(),
    };
    let smoothed = args.solution == Solution::Smoothed;
    let options = Options { tuning, smoothed, rate_hz: args.rate_hz, lands: true };
    let survey = survey::compute(&recording, &instrument, &frame, &options)
        .map_err(|cause| Failure::BadInput(cause.sentence()))?;
    track::write(&args.out, &survey.rows)?;
    if let Some(path) = &args.points_out {
        surveyed::write(path, &survey.points, &stops, &frame)?;
    }
    let process_seconds = began.elapsed().as_secs_f64();
    if let Some(path) = &args.report {
        let estimator = if args.estimator == Estimator::Own { "own" } else { "paper" };
        let solution = if options.smoothed { "smoothed" } else { "filtered" };
        let duration_s = (ends[1] - ends[0]) as f64 * 1e-9;
        let report = report::Report::new(&survey, estimator, solution, samples, duration_s, process_seconds);
        write_text(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    say(&survey, samples, process_seconds);
    Ok(())
}

/// For people only: nothing depends on whether it can be shown.
fn say(survey: &Survey, samples: usize, process_seconds: f64) {
    let mut out = std::io::stderr();
    for finding in &survey.findings {
        let _ = writeln!(out, "{}", finding.detail);
    }
    let figures = &survey.figures;
    let _ = writeln!(
        out,
        "{samples} samples, {} fixes used and {} refused, {} landings, {} points; {process_seconds:.2} s of work",
        figures.fixes_used,
        figures.fixes_refused,
        figures.landings,
        survey.points.len()
    );
}
