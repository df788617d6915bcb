//! `lodestep process`: the logs of one walk, or of a session of another system, made into a track.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use lodestep_engine::geo::Site;
use lodestep_engine::parameters::Parameters;
use lodestep_engine::parse::ReadOptions;
use lodestep_engine::parse::mapping::Mapping;
use lodestep_engine::session::SessionConfig;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{self, Aids};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::cli::failure::Failure;
use crate::cli::inputs::Inputs;
use crate::cli::log_file::{self, Clocks, LogFile};
use crate::cli::of_system::{self, OfSystem, SessionArgs};
use crate::cli::report::Report;
use crate::cli::run::{Walked, run};
use crate::cli::solution::Solution;
use crate::cli::track_output::{TrackOutput, write_text};
use crate::cli::{aids, progress, site_file, visits};

const AFTER_HELP: &str = "\
A log is CSV with a header, plain or packed with gzip or zstd, columns in any order:
  t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2
  and, where recorded, mag_x_ut,mag_y_ut,mag_z_ut,pressure_hpa
or, recognised by its content, a log of x-io (NGIMU, x-IMU3), MicroStrain (SensorConnect), Xsens
(MT Manager, DOT), WitMotion (CMP10A; text log or serial dump), Shimmer or APDM; a ZIP or a folder of one
sensor's files (Sensor Logger, Phyphox, x-IMU3); any other table with --mapping.
Such a log counts its time from its first sample; two whose clocks are one, from the earlier one.
Positions are metres east, north and up of the site's origin; headings run clockwise from true north.

Exit codes: 0 done; 1 something failed inside, or a result could not be written;
2 the command line is wrong; 3 an input file is wrong.";

/// The arguments of `lodestep process`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct ProcessCommand {
    #[command(subcommand)]
    session: Option<OfSystem<SessionArgs>>,

    #[command(flatten)]
    walk: Option<ProcessArgs>,
}

/// The arguments for a walk.
#[derive(Debug, Args)]
struct ProcessArgs {
    /// Log of the left foot (rad/s, m/s², µT, hPa)
    #[arg(long, value_name = "L.csv", required_unless_present = "right")]
    left: Option<PathBuf>,

    /// Log of the right foot
    #[arg(long, value_name = "R.csv")]
    right: Option<PathBuf>,

    /// Which column is which channel, JSON as the upload page keeps it: {"time":{"column":"t","unit":"ms"},
    /// "gyr":{"columns":["gx","gy","gz"],"unit":"deg_s"},"acc":{"columns":["ax","ay","az"],"unit":"g"}}
    #[arg(long, value_name = "MAPPING.json")]
    mapping: Option<PathBuf>,

    /// Samples a second of a log that does not tell the time, Hz
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    sensor_rate_hz: Option<f64>,

    /// How much one count of the magnetometer is, µT, for a log that tells it in counts [default: such a
    /// field is left out]
    #[arg(long, value_name = "UT", value_parser = parse_rate)]
    field_ut_per_count: Option<f64>,

    /// The site: TOML with name, latitude_deg, longitude_deg, height_m; gives gravity and declination
    #[arg(long, value_name = "SITE.toml")]
    site: Option<PathBuf>,

    /// Surveyed markers: name,e_m,n_m,u_m or name,lat_deg,lon_deg,height_m
    #[arg(long, value_name = "M.csv", requires = "visits")]
    markers: Option<PathBuf>,

    /// When the inspector stood at which marker: t_start_s,t_end_s,marker
    #[arg(long, value_name = "V.csv", requires = "markers")]
    visits: Option<PathBuf>,

    /// Where the middle of the feet starts, m [default: 0,0,0]
    #[arg(long, value_name = "E,N,U", value_parser = parse_position, allow_hyphen_values = true)]
    initial_position: Option<[f64; 3]>,

    /// Heading of the first sensor's x axis at the start, degrees clockwise from true north
    /// [default: by the magnetometer, or else that axis points east]
    #[arg(long, value_name = "H", value_parser = parse_angle_deg, allow_hyphen_values = true)]
    initial_heading_deg: Option<f64>,

    /// Magnetic declination, degrees, east positive [default: the site's, or 0]
    #[arg(long, value_name = "D", value_parser = parse_angle_deg, allow_hyphen_values = true)]
    declination_deg: Option<f64>,

    /// Local gravity, m/s² [default: the site's, or 9.80665]
    #[arg(long, value_name = "G", value_parser = parse_gravity)]
    gravity_m_s2: Option<f64>,

    /// When the logs began, UTC, such as 2026-05-01T08:00:00Z: the day of the declination, and the
    /// times in GPX and KML
    #[arg(long, value_name = "TIME", value_parser = parse_utc)]
    started_at: Option<OffsetDateTime>,

    /// Which solution to give; the server gives the smoothed one of a finished walk, too
    #[arg(long, value_enum, default_value_t = Solution::Smoothed)]
    solution: Solution,

    /// Aids to use, of zupt,heading,maru,separation,markers,altimeter; or none [default: all that the
    /// data allow]
    #[arg(long, value_name = "LIST", value_parser = aids::parse)]
    aid: Option<Aids>,

    /// Values of parameters, JSON by key as the laboratory of the page gives them: {"marker_sigma_m": 0.5}
    #[arg(long, value_name = "PARAMETERS.json")]
    parameters: Option<PathBuf>,

    /// One parameter, on top of those of --parameters; may be given often: --set marker_sigma_m=0.5
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_setting)]
    set: Vec<(String, f64)>,

    /// Points per second in the track, Hz [default: one for every epoch]
    #[arg(long, value_name = "HZ", value_parser = parse_rate)]
    rate_hz: Option<f64>,

    /// The track: .csv, .geojson, .gpx or .kml by its ending, or - for CSV on standard output
    #[arg(long, value_name = "FILE", value_parser = TrackOutput::by_name, allow_hyphen_values = true)]
    out: TrackOutput,

    /// What was found out, as JSON
    #[arg(long, value_name = "REPORT.json")]
    report: Option<PathBuf>,
}

/// Processes one walk, or one session of the system that is named.
pub(super) fn process(command: &ProcessCommand) -> Result<()> {
    match (&command.session, &command.walk) {
        (Some(session), _) => of_system::process(session),
        (None, Some(walk)) => process_walk(walk),
        (None, None) => {
            Err(Failure::usage("expected the logs of a walk, or a system, found neither: see --help"))
        }
    }
}

fn process_walk(args: &ProcessArgs) -> Result<()> {
    args.check()?;
    let site = args.site.as_deref().map(|path| site_file::read(path, args.started_at)).transpose()?;
    let frame = site.as_ref().map(Site::local_frame);
    let visits = match (&args.markers, &args.visits) {
        (Some(markers), Some(visits)) => visits::read(markers, visits, frame)?,
        _ => Vec::new(),
    };
    let parameters = args.parameters()?;
    let mut config = args.session_config(site.as_ref());
    parameters.apply(&mut config);

    let reading = args.reading()?;
    let mut clocks = Clocks::default();
    if let (Some(left), Some(right)) = (&args.left, &args.right) {
        clocks = log_file::clocks_of_feet([left, right], &reading)?;
    }
    let bar = progress::of_bytes();
    let mut feet = Vec::new();
    for (foot, path) in [(Side::Left, &args.left), (Side::Right, &args.right)] {
        if let Some(path) = path {
            let reading = ReadOptions { clock_zero_ns: clocks.zero_ns(foot), ..reading.clone() };
            feet.push((foot, LogFile::open_as(path, reading, &bar)?));
        }
    }
    let walked = run(config.clone(), &visits, feet);
    bar.finish_and_clear();
    let mut walked = walked?;
    walked.read_with.extend(clocks.anomaly);
    if walked.track.points.is_empty() {
        return Err(Failure::BadInput(args.no_track(&walked)).into());
    }

    let start_unix_ns = args.started_at.and_then(|start| i64::try_from(start.unix_timestamp_nanos()).ok());
    args.out.write(config.system.declaration(), &walked.track, args.rate_hz, frame, start_unix_ns)?;
    if let Some(path) = &args.report {
        let inputs = Inputs::read([args.left.as_deref(), args.right.as_deref()], &visits)?;
        let report = serde_json::to_string_pretty(&Report::new(&config, &parameters, inputs, &walked))?;
        write_text(path, &(report + "\n"))?;
    }
    // For people only: nothing depends on whether it can be shown.
    let mut people = std::io::stderr();
    let _ = writeln!(people, "{}", in_a_line(&walked));
    for anomaly in &walked.read_with {
        let log = anomaly.stream.map_or_else(String::new, |stream| format!("{}: ", stream.name()));
        let _ = writeln!(people, "{log}{}", anomaly.detail);
    }
    Ok(())
}

impl ProcessArgs {
    /// What the parts of the command line say together.
    fn check(&self) -> Result<()> {
        if self.out.needs_site() && self.site.is_none() {
            return Err(Failure::usage(
                "GeoJSON, GPX and KML need to know where the site lies: add --site SITE.toml, or write .csv",
            ));
        }
        if let Some(aids) = self.aid {
            if aids.separation && (self.left.is_none() || self.right.is_none()) {
                return Err(Failure::usage(
                    "--aid separation needs both feet: give --left and --right, or take it off the list",
                ));
            }
            if aids.markers && self.visits.is_none() {
                return Err(Failure::usage(
                    "--aid markers needs --markers and --visits: add them, or take it off the list",
                ));
            }
        }
        Ok(())
    }

    /// The parameters that are not as they are by default.
    fn parameters(&self) -> Result<Parameters> {
        let mut parameters = match &self.parameters {
            None => Parameters::default(),
            Some(path) => serde_json::from_slice(&log_file::read_small(path)?).map_err(|error| {
                Failure::bad_input(path, format!("expected parameters as JSON, such as {{\"marker_sigma_m\": 0.5}}, found something else ({error})"))
            })?,
        };
        for (key, value) in &self.set {
            parameters.set(key, *value).map_err(|error| Failure::usage(format!("--set {key}: {error}")))?;
        }
        if let Some((key, _)) = parameters.iter().find(|(key, _)| key.starts_with("identification.")) {
            return Err(Failure::usage(format!(
                "{key} belongs to the naming of stands, which process does not do: leave it out, or work the walk out on the server"
            )));
        }
        Ok(parameters)
    }

    /// What the command line says of the logs.
    fn reading(&self) -> Result<ReadOptions> {
        let mapping = match &self.mapping {
            None => None,
            Some(path) => {
                let mapping: Mapping = serde_json::from_slice(&log_file::read_small(path)?)
                    .map_err(|error| Failure::bad_input(path, format!("expected a mapping of columns as JSON, found something else ({error}); see --help")))?;
                mapping.check().map_err(|error| Failure::bad_input(path, error))?;
                Some(mapping)
            }
        };
        Ok(ReadOptions {
            mapping,
            rate_hz: self.sensor_rate_hz,
            field_ut_per_count: self.field_ut_per_count,
            clock_zero_ns: None,
        })
    }

    fn session_config(&self, site: Option<&Site>) -> SessionConfig {
        let worn = [(Side::Left, &self.left), (Side::Right, &self.right)];
        let sides: Vec<Side> =
            worn.into_iter().filter(|(_, log)| log.is_some()).map(|(side, _)| side).collect();
        let own = pedestrian::Config { aids: self.aid.unwrap_or_default(), ..Default::default() };
        let mut config = own.session(&sides);
        if let Some(site) = site {
            config.gravity_m_s2 = site.gravity_m_s2;
            config.declination_rad = site.declination_deg.to_radians();
            config.site_field = Some(site.field());
        }
        if let Some(gravity_m_s2) = self.gravity_m_s2 {
            config.gravity_m_s2 = gravity_m_s2;
        }
        if let Some(declination_deg) = self.declination_deg {
            config.declination_rad = declination_deg.to_radians();
        }
        if let Some(position_n_m) = self.initial_position {
            config.initial_position_n_m = position_n_m;
        }
        config.initial_heading_rad = self.initial_heading_deg.map(f64::to_radians);
        config.solution = self.solution.into();
        config
    }

    fn no_track(&self, walked: &Walked) -> String {
        let logs: Vec<String> =
            [&self.left, &self.right].into_iter().flatten().map(|path| path.display().to_string()).collect();
        let mut sentence = format!(
            "{}: expected a walk that begins with about 10 s of standing still, found {} samples, too few to align on",
            logs.join(", "),
            walked.summary.samples
        );
        for anomaly in walked.read_with.iter().chain(&walked.track.anomalies).take(5) {
            sentence += &format!("; {}", anomaly.detail);
        }
        sentence
    }
}

fn in_a_line(walked: &Walked) -> String {
    let summary = walked.summary;
    let sigma_m = walked.track.points.last().map_or([f64::NAN; 3], |point| point.sigma_n_m);
    let [e, n, u] = sigma_m;
    format!(
        "{} samples, {} epochs, {:.1} s, {:.1} m walked; sigma at the end {e:.2} m east, {n:.2} m north, {u:.2} m up; \
         {} visits, {} anomalies; {:.2} s of work",
        summary.samples,
        summary.epochs,
        summary.duration_s,
        summary.distance_m,
        walked.track.visits.len(),
        walked.read_with.len() + walked.track.anomalies.len(),
        walked.process_seconds
    )
}

pub(super) fn parse_position(text: &str) -> Result<[f64; 3], String> {
    let values: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match values[..] {
        [e, n, u] if text.split(',').count() == 3 && values.iter().all(|v| v.is_finite()) => Ok([e, n, u]),
        _ => {
            Err(format!("expected three numbers in metres such as 12.5,-3,0 (east,north,up), found {text:?}"))
        }
    }
}

pub(super) fn parse_angle_deg(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.abs() <= 360.0).ok_or_else(|| {
        format!("expected a number of degrees from -360 to 360, such as -2.45, found {text:?}")
    })
}

fn parse_gravity(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| (9.7..=9.9).contains(value))
        .ok_or_else(|| format!("expected gravity in m/s², from 9.7 to 9.9, found {text:?}"))
}

pub(super) fn parse_setting(text: &str) -> Result<(String, f64), String> {
    let found = text.split_once('=').and_then(|(key, value)| Some((key.trim(), value.trim().parse().ok()?)));
    let (key, value) = found
        .ok_or_else(|| format!("expected a key and a number such as marker_sigma_m=0.5, found {text:?}"))?;
    Ok((key.to_owned(), value))
}

pub(super) fn parse_rate(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| *value > 0.0 && value.is_finite())
        .ok_or_else(|| format!("expected a positive number, found {text:?}"))
}

pub(super) fn parse_utc(text: &str) -> Result<OffsetDateTime, String> {
    OffsetDateTime::parse(text, &Rfc3339)
        .map_err(|_| format!("expected a time such as 2026-05-01T08:00:00Z, found {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_three_numbers() {
        assert_eq!(parse_position("1,-2.5, 3").unwrap(), [1.0, -2.5, 3.0]);
        for wrong in ["", "1,2", "1,2,3,4", "1,x,3", "1,2,nan", "1,2,3,"] {
            assert!(parse_position(wrong).unwrap_err().contains("east,north,up"), "{wrong}");
        }
    }
}
