//! `lodestep process cabin`: the files of one run made into poses of the cabin and the platform.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use clap::{ArgMatches, Args, Command, FromArgMatches as _, ValueEnum};
use lodestep_engine::event::{Event, TrackPoint};
use lodestep_engine::systems::cabin::intake::Device;
use lodestep_engine::systems::cabin::rows::{AidRow, ImuRow};
use lodestep_engine::systems::cabin::{
    self, Aids, CabinAnomaly, CabinConfig, CabinError, CabinSession, Estimator, Instrument, Poses, WINDOW,
};
use lodestep_engine::track::Track;
use serde::Serialize;

use super::aid_rows::{AidParser, ImuParser};
use super::pose_csv;
use super::row_file::RowFile;
use crate::cli::failure::Failure;
use crate::cli::log_file;
use crate::cli::output_file::OutputFile;
use crate::cli::process::parse_rate;
use crate::cli::solution::Solution;
use crate::cli::track_output::write_text;

/// Poses a second of a session.
const SESSION_RATE_HZ: f64 = 20.0;

#[derive(Debug, Args)]
struct CabinArgs {
    /// The cabin's inertial sensor: canonical CSV, means over the interval that ends at t_s
    #[arg(long, value_name = "IMU.csv")]
    imu: PathBuf,

    /// Fixes of the antennas: t_s,antenna,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m,quality and, where told, ve_m_s,vn_m_s,vu_m_s
    #[arg(long, value_name = "ANTENNAS.csv")]
    gnss: PathBuf,

    /// Rays of the total stations: t_s,station,target,azimuth_rad,zenith_rad,slant_m
    #[arg(long, value_name = "STATIONS.csv")]
    stations: Option<PathBuf>,

    /// Rotator and legs: t_s,a_rad,b_rad,leg_1_m..leg_6_m
    #[arg(long, value_name = "ENCODERS.csv")]
    encoders: Option<PathBuf>,

    /// The platform's inertial sensor, as the cabin's
    #[arg(long, value_name = "IMU.csv")]
    platform_imu: Option<PathBuf>,

    /// Where everything is fixed
    #[arg(long, value_name = "CABIN.toml")]
    instrument: PathBuf,

    /// Which filter
    #[arg(long, value_enum, default_value_t)]
    estimator: EstimatorName,

    /// Which solution to give: filtered is causal
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,

    /// Poses a second, Hz
    #[arg(long, value_name = "HZ", default_value = "20", value_parser = parse_rate)]
    rate_hz: f64,

    /// The cabin's poses
    #[arg(long, value_name = "CABIN.csv")]
    out: PathBuf,

    /// The platform's poses; needs --encoders, or --stations that look at its prisms
    #[arg(long, value_name = "PLATFORM.csv")]
    platform_out: Option<PathBuf>,

    /// What was found out, as JSON
    #[arg(long, value_name = "REPORT.json")]
    report: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
enum EstimatorName {
    /// One filter of cabin and platform with every antenna, every ray and the encoders
    #[default]
    Own,
    /// Paper 3: fifteen states, antennas for the cabin, stations for the platform
    Paper,
}

/// What was found out.
#[derive(Serialize)]
struct Report<'a> {
    epochs: u64,
    samples: u64,
    duration_s: f64,
    process_seconds: f64,
    estimator: EstimatorName,
    solution: &'a str,
    cabin_rows: u64,
    platform_rows: u64,
    /// The hash of the track as a session of the same readings has it; at a session's 20 poses a second alone.
    track_sha256: Option<String>,
    anomalies: &'a [CabinAnomaly],
}

/// What the command takes.
pub(in crate::cli) fn command() -> Command {
    CabinArgs::augment_args(Command::new("cabin").about(
        "The feed cabin and its Stewart platform: antennas, inertial sensors, total stations, encoders (paper 3)",
    ))
}

/// Runs it.
pub(in crate::cli) fn run(matches: &ArgMatches) -> Result<()> {
    let args = CabinArgs::from_arg_matches(matches)?;
    if args.rate_hz > 1000.0 {
        return Err(Failure::usage(format!(
            "--rate-hz: expected at most 1000 poses a second, found {}",
            args.rate_hz
        )));
    }
    let began = Instant::now();
    let instrument = read_instrument(&args.instrument)?;
    let config = CabinConfig {
        estimator: match args.estimator {
            EstimatorName::Own => Estimator::Own,
            EstimatorName::Paper => Estimator::Paper,
        },
        smoothed: args.solution == Solution::Smoothed,
        rate_hz: args.rate_hz,
        has_stations: args.stations.is_some(),
        has_encoders: args.encoders.is_some(),
        has_platform_imu: args.platform_imu.is_some(),
        platform: args.platform_out.is_some(),
    };
    let mut session = CabinSession::new(&instrument, config)
        .map_err(|error| Failure::usage(format!("--platform-out: {error}")))?;
    let mut files = Files::open(&args, &instrument)?;
    let mut outputs = Outputs::create(&args, session.aids().clone())?;
    // Of a session all bits are known to be the same by its hash.
    outputs.kept = (args.report.is_some() && args.rate_hz == SESSION_RATE_HZ).then(Poses::default);
    let mut poses = Poses::default();
    let refused = |error: CabinError| Failure::BadInput(error.to_string());
    let (mut samples, mut ends) = (0, None);
    while let Some(next) = files.next()? {
        let t_ns = match next {
            Next::Imu(row) => {
                samples += 1;
                session.push_imu(&row, &mut poses).map_err(refused)?;
                row.t_ns
            }
            Next::PlatformImu(row) => {
                session.push_platform_imu(&row, &mut poses).map_err(refused)?;
                row.t_ns
            }
            Next::Aid(row) => {
                session.push_aid(&row, &mut poses).map_err(refused)?;
                row.t_ns()
            }
        };
        let (first_ns, _) = ends.unwrap_or((t_ns, t_ns));
        ends = Some((first_ns, t_ns));
        outputs.write(&mut poses)?;
    }
    let epochs = session.epochs();
    let mut anomalies = files.anomalies();
    anomalies.extend(session.finish(&mut poses).map_err(refused)?);
    anomalies.sort_by(|a, b| a.t_start_s.total_cmp(&b.t_start_s));
    outputs.write(&mut poses)?;
    let kept = outputs.kept.take();
    let (cabin_rows, platform_rows) = outputs.finish(&args)?;
    let track_sha256 = kept.map(|kept| hash(cabin::track_points(kept), &anomalies, &instrument));
    let duration_s = ends.map_or(0.0, |(first_ns, last_ns)| (last_ns - first_ns) as f64 * 1e-9);
    let process_seconds = began.elapsed().as_secs_f64();
    if let Some(path) = &args.report {
        let report = Report {
            epochs,
            samples,
            duration_s,
            process_seconds,
            estimator: args.estimator,
            solution: if args.solution == Solution::Smoothed { "smoothed" } else { "filtered" },
            cabin_rows,
            platform_rows,
            track_sha256,
            anomalies: &anomalies,
        };
        write_text(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    // For people only: nothing depends on whether it can be shown.
    let _ = writeln!(
        std::io::stderr(),
        "{samples} samples, {duration_s:.1} s, {cabin_rows} poses of the cabin, {platform_rows} of the platform; {} anomalies; {process_seconds:.2} s of work",
        anomalies.len()
    );
    Ok(())
}

fn hash(points: Vec<TrackPoint>, anomalies: &[CabinAnomaly], instrument: &Instrument) -> String {
    let mut track = Track { points, ..Track::default() };
    for found in anomalies {
        track.take(Event::Anomaly(cabin::anomaly(found, instrument)));
    }
    track.sha256()
}

fn read_instrument(path: &Path) -> Result<Instrument> {
    let bytes = log_file::read_small(path)?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Failure::bad_input(path, "expected TOML in UTF-8, found other bytes; save it as UTF-8")
    })?;
    Instrument::from_toml(&text).map_err(|error| Failure::bad_input(path, error))
}

/// The files of a run.
struct Files {
    imu: RowFile<ImuParser>,
    platform_imu: Option<RowFile<ImuParser>>,
    aids: Vec<RowFile<AidParser>>,
}

/// The row that comes next.
enum Next {
    Imu(ImuRow),
    PlatformImu(ImuRow),
    Aid(AidRow),
}

impl Files {
    fn open(args: &CabinArgs, instrument: &Instrument) -> Result<Files> {
        let mut aids = Vec::new();
        for (device, path) in [
            (Device::Encoders, args.encoders.as_ref()),
            (Device::Antennas, Some(&args.gnss)),
            (Device::Stations, args.stations.as_ref()),
        ] {
            if let Some(path) = path {
                aids.push(RowFile::open(path, AidParser::new(device, instrument), WINDOW)?);
            }
        }
        let imu = |path: &Path| RowFile::open(path, ImuParser::default(), 0);
        Ok(Files {
            imu: imu(&args.imu)?,
            platform_imu: args.platform_imu.as_deref().map(imu).transpose()?,
            aids,
        })
    }

    /// The row with the earliest tag.
    fn next(&mut self) -> Result<Option<Next>> {
        let mut earliest: Option<(i64, usize)> = None;
        let mut consider = |t_ns: Option<i64>, which: usize| {
            if let Some(t_ns) = t_ns
                && earliest.is_none_or(|(least_ns, _)| t_ns < least_ns)
            {
                earliest = Some((t_ns, which));
            }
        };
        consider(self.imu.next_ns()?, 0);
        if let Some(file) = &mut self.platform_imu {
            consider(file.next_ns()?, 1);
        }
        for (k, file) in self.aids.iter_mut().enumerate() {
            consider(file.next_ns()?, 2 + k);
        }
        Ok(match earliest {
            None => None,
            Some((_, 0)) => self.imu.next()?.map(Next::Imu),
            Some((_, 1)) => match &mut self.platform_imu {
                Some(file) => file.next()?.map(Next::PlatformImu),
                None => None,
            },
            Some((_, k)) => self.aids[k - 2].next()?.map(Next::Aid),
        })
    }

    /// What was wrong with the files themselves.
    fn anomalies(&self) -> Vec<CabinAnomaly> {
        self.aids.iter().flat_map(|file| file.parser().intake.anomalies()).collect()
    }
}

/// The files that are written.
struct Outputs {
    aids: Aids,
    cabin: OutputFile,
    platform: Option<OutputFile>,
    rows: (u64, u64),
    /// All that was written, for the hash.
    kept: Option<Poses>,
}

impl Outputs {
    fn create(args: &CabinArgs, aids: Aids) -> Result<Outputs> {
        let begin = |path: &Path| -> Result<OutputFile> {
            let mut file = OutputFile::create(path)?;
            writeln!(file, "{}", pose_csv::HEADER)?;
            Ok(file)
        };
        let platform = args.platform_out.as_deref().map(begin).transpose()?;
        Ok(Outputs { aids, cabin: begin(&args.out)?, platform, rows: (0, 0), kept: None })
    }

    fn write(&mut self, poses: &mut Poses) -> Result<()> {
        if let Some(kept) = &mut self.kept {
            kept.cabin.extend(poses.cabin.iter().cloned());
            kept.platform.extend(poses.platform.iter().cloned());
        }
        pose_csv::write(&poses.cabin, &self.aids, &mut self.cabin)?;
        self.rows.0 += poses.cabin.len() as u64;
        poses.cabin.clear();
        if let Some(platform) = &mut self.platform {
            pose_csv::write(&poses.platform, &self.aids, platform)?;
            self.rows.1 += poses.platform.len() as u64;
        }
        poses.platform.clear();
        Ok(())
    }

    fn finish(self, args: &CabinArgs) -> Result<(u64, u64)> {
        if self.platform.is_some() && self.rows.1 == 0 {
            return Err(Failure::usage(format!(
                "--platform-out {}: expected encoders, or rays of stations to the platform's prisms, found none from which its pose follows; give them, or leave the platform out",
                args.platform_out.as_deref().unwrap_or(Path::new("")).display()
            )));
        }
        self.cabin.finish()?;
        if let Some(platform) = self.platform {
            platform.finish()?;
        }
        Ok(self.rows)
    }
}
