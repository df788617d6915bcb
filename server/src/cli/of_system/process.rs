//! `lodestep process SYSTEM`: the logs of one session made into a track.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use lodestep_engine::event::AidKind;
use lodestep_engine::geo::Site;
use lodestep_engine::parameters::Parameters;
use lodestep_engine::parse::ReadOptions;
use lodestep_engine::session::{ConfigError, SessionConfig, Visit};
use lodestep_engine::stream::{Kind, Stream, StreamId};
use lodestep_engine::system::Declaration;
use time::OffsetDateTime;

use super::named::{ForSystems, OfSystem};
use crate::cli::failure::Failure;
use crate::cli::inputs::Inputs;
use crate::cli::log_file::{self, LogFile};
use crate::cli::own::{self, OwnCommand};
use crate::cli::process::{parse_angle_deg, parse_position, parse_rate, parse_setting, parse_utc};
use crate::cli::report::Report;
use crate::cli::run::{Walked, run};
use crate::cli::solution::Solution;
use crate::cli::track_output::{TrackOutput, write_text};
use crate::cli::{progress, site_file, visits};

/// The arguments of `lodestep process SYSTEM`.
#[derive(Debug, Args)]
pub(in crate::cli) struct SessionArgs {
    /// The log of a stream, by the stream's name; once for each stream
    #[arg(long, value_name = "NAME=FILE", required = true, value_parser = parse_stream)]
    stream: Vec<(StreamId, PathBuf)>,

    /// The site: TOML with name, latitude_deg, longitude_deg, height_m; gives gravity and declination
    #[arg(long, value_name = "SITE.toml")]
    site: Option<PathBuf>,

    /// What the instrument is like, TOML as the help of a system with one shows it
    #[arg(long, value_name = "INSTRUMENT.toml")]
    instrument: Option<PathBuf>,

    /// Surveyed markers: name,e_m,n_m,u_m or name,lat_deg,lon_deg,height_m
    #[arg(long, value_name = "M.csv", requires = "visits")]
    markers: Option<PathBuf>,

    /// When the carrier stood at which marker: t_start_s,t_end_s,marker
    #[arg(long, value_name = "V.csv", requires = "markers")]
    visits: Option<PathBuf>,

    /// Where the system's point is at the start, m [default: 0,0,0]
    #[arg(long, value_name = "E,N,U", value_parser = parse_position, allow_hyphen_values = true)]
    initial_position: Option<[f64; 3]>,

    /// Heading at the start, degrees clockwise from true north [default: found by the system]
    #[arg(long, value_name = "H", value_parser = parse_angle_deg, allow_hyphen_values = true)]
    initial_heading_deg: Option<f64>,

    /// When the session began, UTC, such as 2026-05-01T08:00:00Z: the day of the declination, and the times in GPX and
    /// KML
    #[arg(long, value_name = "TIME", value_parser = parse_utc)]
    started_at: Option<OffsetDateTime>,

    /// Which solution to give
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,

    /// Aids to use, with commas in between; or none [default: all that the data allow]
    #[arg(long, value_name = "LIST")]
    aid: Option<String>,

    /// One parameter; may be given often
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

impl ForSystems for SessionArgs {
    const OWN: &'static [OwnCommand] = own::PROCESS;

    fn has(_: &Declaration) -> bool {
        true
    }
}

/// Processes one session.
pub(in crate::cli) fn process(session: &OfSystem<SessionArgs>) -> Result<()> {
    match session {
        OfSystem::ByDeclaration { system, args } => process_declared(system, args),
        OfSystem::Own { command, matches } => (command.run)(matches),
    }
}

fn process_declared(system: &'static Declaration, args: &SessionArgs) -> Result<()> {
    if args.out.needs_site() && args.site.is_none() {
        return Err(Failure::usage(
            "GeoJSON, GPX and KML need to know where the site lies: add --site SITE.toml, or write .csv",
        ));
    }
    let site = args.site.as_deref().map(|path| site_file::read(path, args.started_at)).transpose()?;
    let frame = site.as_ref().map(Site::local_frame);
    let visits = match (&args.markers, &args.visits) {
        (Some(markers), Some(visits)) => visits::read(markers, visits, frame)?,
        _ => Vec::new(),
    };
    let logs = logs(system, &args.stream)?;
    let parameters = Parameters::of(system, args.set.iter().map(|(key, value)| (key, *value)))
        .map_err(|error| Failure::usage(format!("--set: {error}")))?;
    let mut config = session_config(system, &logs, site.as_ref());
    if let Some(list) = &args.aid {
        config.system.use_aids(&aids(system, list).map_err(Failure::usage)?);
    }
    if let Some(position_n_m) = args.initial_position {
        config.initial_position_n_m = position_n_m;
    }
    config.initial_heading_rad = args.initial_heading_deg.map(f64::to_radians);
    config.solution = args.solution.into();
    config.instrument = args.instrument.as_deref().map(log_file::read_text).transpose()?;
    parameters.apply(&mut config);

    let walked = run_logs(config.clone(), &visits, &logs)?;
    if walked.track.points.is_empty() {
        return Err(Failure::BadInput(no_track(&logs, &walked)).into());
    }
    let start_unix_ns = args.started_at.and_then(|start| i64::try_from(start.unix_timestamp_nanos()).ok());
    args.out.write(system, &walked.track, args.rate_hz, frame, start_unix_ns)?;
    if let Some(path) = &args.report {
        let inputs = Inputs::read(logs.iter().map(|(_, path)| Some(*path)), &visits)?;
        let report = serde_json::to_string_pretty(&Report::new(&config, &parameters, inputs, &walked))?;
        write_text(path, &(report + "\n"))?;
    }
    // For people only: nothing depends on whether it can be shown.
    let _ = writeln!(std::io::stderr(), "{}", in_a_line(&walked));
    Ok(())
}

/// A log with its stream.
pub(super) type StreamLog<'a> = (Stream, &'a Path);

/// The logs by the numbers of their streams.
fn logs<'a>(system: &Declaration, given: &'a [(StreamId, PathBuf)]) -> Result<Vec<StreamLog<'a>>> {
    let mut logs: Vec<StreamLog<'a>> = Vec::new();
    for (id, path) in given {
        let stream = system.stream(*id).ok_or_else(|| {
            let names: Vec<&str> = system.streams.iter().map(|rule| rule.name).collect();
            Failure::usage(format!(
                "--stream: expected a stream of the {} system ({}), found {id}: name one of these",
                system.name,
                names.join(", ")
            ))
        })?;
        if logs.iter().any(|(known, _)| known.id == stream.id) {
            return Err(Failure::usage(format!(
                "--stream: expected the stream {id} once, found it twice: name each once"
            )));
        }
        logs.push((stream, path));
    }
    logs.sort_by_key(|(stream, _)| stream.number);
    let streams: Vec<Stream> = logs.iter().map(|(stream, _)| stream.clone()).collect();
    system.check_streams(&streams).map_err(|error| Failure::usage(format!("--stream: {error}")))?;
    Ok(logs)
}

/// How a session of these streams is configured on a site.
pub(super) fn session_config(
    system: &Declaration,
    logs: &[StreamLog<'_>],
    site: Option<&Site>,
) -> SessionConfig {
    let streams = logs.iter().map(|(stream, _)| stream.clone()).collect();
    let mut config = SessionConfig::new((system.config)(), streams);
    if let Some(site) = site {
        config.gravity_m_s2 = site.gravity_m_s2;
        config.declination_rad = site.declination_deg.to_radians();
        config.site_field = Some(site.field());
        config.origin = Some(site.local_frame().origin());
    }
    config
}

/// Runs the engine over these logs.
pub(super) fn run_logs(config: SessionConfig, visits: &[Visit], logs: &[StreamLog<'_>]) -> Result<Walked> {
    let system = config.system.declaration();
    let sensors = logs.iter().filter(|(stream, _)| stream.kind == Kind::Imu);
    let paths: Vec<&Path> = sensors.map(|(_, path)| *path).collect();
    let clock_zero_ns = log_file::shared_zero_ns(&paths, &ReadOptions::default())?;
    let bar = progress::of_bytes();
    let mut streams = Vec::new();
    for (stream, path) in logs {
        let unknown = || ConfigError::Own(format!("the {} system has no stream {}", system.name, stream.id));
        let rule = system.rule_of(stream).ok_or_else(unknown)?;
        let clock_zero_ns = clock_zero_ns.filter(|_| stream.kind == Kind::Imu);
        let reading = ReadOptions { clock_zero_ns, ..ReadOptions::default() };
        streams.push((stream.id, LogFile::open_of(rule, path, reading, &bar)?));
    }
    let walked = run(config, visits, streams);
    bar.finish_and_clear();
    walked
}

/// The aids of a list with commas in between, or none.
fn aids(system: &Declaration, list: &str) -> Result<Vec<AidKind>, String> {
    let mut aids: Vec<AidKind> = Vec::new();
    if list.trim() == "none" {
        return Ok(aids);
    }
    for name in list.split(',').map(str::trim) {
        let aid = system.aid(name).ok_or_else(|| {
            let known: Vec<&str> = system.aids.iter().map(|aid| aid.kind.as_str()).collect();
            match known[..] {
                [] => {
                    format!("--aid: the {} system has no aids, found {name:?}: leave --aid out", system.name)
                }
                _ => format!(
                    "--aid: there is no aid {name:?}: choose from {}, or write none",
                    known.join(", ")
                ),
            }
        })?;
        if aids.contains(&aid.kind) {
            return Err(format!("--aid: the aid {name:?} is there twice: name each once"));
        }
        aids.push(aid.kind);
    }
    Ok(aids)
}

fn no_track(logs: &[StreamLog<'_>], walked: &Walked) -> String {
    let paths: Vec<String> = logs.iter().map(|(_, path)| path.display().to_string()).collect();
    let mut sentence = format!(
        "{}: expected readings that give a position, found {} that give none; check that these are the logs that were meant",
        paths.join(", "),
        walked.summary.samples
    );
    for anomaly in walked.track.anomalies.iter().take(5) {
        sentence += &format!("; {}", anomaly.detail);
    }
    sentence
}

fn in_a_line(walked: &Walked) -> String {
    let summary = walked.summary;
    let [e, n, u] = walked.track.points.last().map_or([f64::NAN; 3], |point| point.sigma_n_m);
    format!(
        "{} readings, {} epochs, {:.1} s, {:.1} m of path; sigma at the end {e:.2} m east, {n:.2} m north, {u:.2} m up; \
         {} visits, {} anomalies; {:.2} s of work",
        summary.samples,
        summary.epochs,
        summary.duration_s,
        summary.distance_m,
        walked.track.visits.len(),
        walked.track.anomalies.len(),
        walked.process_seconds
    )
}

fn parse_stream(text: &str) -> Result<(StreamId, PathBuf), String> {
    let found = text.split_once('=').filter(|(_, file)| !file.is_empty());
    found.and_then(|(name, file)| Some((StreamId::read(name.trim())?, PathBuf::from(file)))).ok_or_else(
        || format!("expected a stream's name and a file such as fix=positions.csv, found {text:?}"),
    )
}

#[cfg(test)]
mod tests {
    use lodestep_engine::systems::catalogue;

    use super::*;

    #[test]
    fn a_log_comes_with_the_name_of_its_stream() {
        assert_eq!(parse_stream("fix=a=b.csv").unwrap(), (StreamId::named("fix"), "a=b.csv".into()));
        for wrong in ["fix", "fix=", "=a.csv", "Fix=a.csv"] {
            assert!(parse_stream(wrong).unwrap_err().contains("fix=positions.csv"), "{wrong}");
        }
    }

    #[test]
    fn streams_are_those_that_the_system_declares_each_once() {
        let system = catalogue::named("fixes").unwrap();
        let given = |names: &[&str]| -> Vec<(StreamId, PathBuf)> {
            names.iter().map(|name| (StreamId::named(name), PathBuf::from(name))).collect()
        };
        assert_eq!(logs(system, &given(&["fix"])).unwrap().len(), 1);
        for (names, said) in [(&["left"][..], "found left"), (&["fix", "fix"], "twice"), (&[], "found 0")] {
            let error = logs(system, &given(names)).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        let pedestrian = given(&["right", "left"]);
        let sorted = logs(catalogue::usual(), &pedestrian).unwrap();
        assert_eq!(sorted.iter().map(|(stream, _)| stream.id.name()).collect::<Vec<_>>(), ["left", "right"]);
    }

    #[test]
    fn aids_are_those_that_the_system_declares() {
        let usual = catalogue::usual();
        let words: Vec<&str> = usual.aids.iter().map(|aid| aid.kind.as_str()).collect();
        assert_eq!(aids(usual, &words.join(", ")).unwrap().len(), words.len());
        assert_eq!(aids(usual, "none").unwrap(), []);
        assert!(aids(usual, "gps").unwrap_err().contains("there is no aid \"gps\""));
        assert!(aids(usual, &[words[0], words[0]].join(",")).unwrap_err().contains("twice"));
        let none = aids(catalogue::named("fixes").unwrap(), "zupt").unwrap_err();
        assert!(none.contains("has no aids"), "{none}");
    }
}
