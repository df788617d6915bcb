//! What noise alone would leave: the end of recorded walks as least squares over the whole log would know
//! it, if the sensor erred by the white noise and the bias walks of its data sheet and by nothing else.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use indicatif::ProgressBar;
use lodestep_engine::evaluate::{loop_closure, motion_capture};
use lodestep_engine::event::TrackPoint;
use lodestep_engine::parse::truth_csv;
use lodestep_engine::session::SessionConfig;
use lodestep_engine::systems::pedestrian;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::foot_noise::FootNoise;

use super::recordings::{self, Judge, Recording};
use crate::cli::failure::Failure;
use crate::cli::log_file::{LogFile, read_small};
use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::run::{Walked, run};

/// The arguments of `lodestep evaluate bounds`.
#[derive(Debug, Args)]
pub(super) struct BoundsArgs {
    /// Recordings of one foot that end where they began or have motion capture, or folders of them
    #[arg(value_name = "DIR|FILES", required = true)]
    paths: Vec<PathBuf>,

    /// Angle random walk of the gyro, rad/√s: the CMP10A's 0.01 °/s/√Hz unless given
    #[arg(long, value_name = "RAD", default_value_t = 1.75e-4)]
    angle_random_walk_rad_sqrt_s: f64,

    /// Velocity random walk of the accelerometer, m/s/√s: the CMP10A's unless given
    #[arg(long, value_name = "M_S", default_value_t = 1.8e-3)]
    velocity_random_walk_m_s_sqrt_s: f64,
}

/// The ends of one set, sums of squares.
#[derive(Default)]
struct Sums {
    walks: f64,
    reached_plan_m2: f64,
    reached_up_m2: f64,
    told_plan_m2: f64,
    told_up_m2: f64,
    bound_plan_m2: f64,
    bound_up_m2: f64,
}

/// Prints the table.
pub(super) fn bounds(args: &BoundsArgs) -> Result<()> {
    let found: Vec<Recording> = recordings::find(&args.paths, false)?
        .into_iter()
        .filter(|recording| {
            matches!(recording.judge, Judge::ClosedLoop | Judge::MotionCapture(_))
                && recording.left.is_some() != recording.right.is_some()
        })
        .collect();
    if found.is_empty() {
        return Err(Failure::BadInput(
            "no recording of one foot whose end is known: expected NAME.csv in a folder whose name holds openshoe or \
             ngimu, or beside NAME.truth.csv"
                .to_owned(),
        )
        .into());
    }
    let bar = progress::of_count(found.len() as u64, "walks");
    let mut out = format!(
        "One foot, all aids that the data allow. *Noise alone* is the end as least squares over the whole log would know it, if the \
         sensor erred by its noise alone ({:.3} mrad/√s, {:.1} mm/s/√s, bias walks of the CMP10A) and the foot by what a stance is \
         allowed for: the covariance of the same filter, without what it allows for scale, misalignment, heel strikes and soles. At the last \
         sample filter, smoother and least squares are one (`adjoint_tests`). All are rms over the walks of a set, from the start to the end.\n\n\
         | set | walks | plan: error, m | told, m | noise alone, m | height: error, m | told, m | noise alone, m |\n\
         |---|---|---|---|---|---|---|---|\n",
        1e3 * args.angle_random_walk_rad_sqrt_s,
        1e3 * args.velocity_random_walk_m_s_sqrt_s,
    );
    for set in found.chunk_by(|a, b| a.set == b.set) {
        let mut sums = Sums::default();
        for recording in set {
            sums.add(recording, args)?;
            bar.inc(1);
        }
        let rms = |sum_m2: f64| (sum_m2 / sums.walks).sqrt();
        writeln!(
            out,
            "| {} | {:.0} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
            set.first().map_or("", |recording| recording.set.as_str()),
            sums.walks,
            rms(sums.reached_plan_m2),
            rms(sums.told_plan_m2),
            rms(sums.bound_plan_m2),
            rms(sums.reached_up_m2),
            rms(sums.told_up_m2),
            rms(sums.bound_up_m2),
        )
        .expect("writing to a string cannot fail");
    }
    bar.finish_and_clear();
    print(&out)
}

impl Sums {
    fn add(&mut self, recording: &Recording, args: &BoundsArgs) -> Result<()> {
        let told = walked(recording, pedestrian::two_feet())?;
        let points = &told.track.points;
        let reached = match &recording.judge {
            Judge::MotionCapture(path) => {
                let known =
                    truth_csv::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))?;
                motion_capture(points, &known).map(|errors| (errors.end_error_m, errors.end_height_error_m))
            }
            _ => loop_closure(points, told.summary.distance_m)
                .map(|closure| (closure.end_error_m, closure.height_error_m)),
        };
        let bound = walked(recording, by_noise_alone(args))?;
        let (Some((plan_m, up_m)), Some(told), Some(bound)) =
            (reached, grown_m2(points), grown_m2(&bound.track.points))
        else {
            return Ok(());
        };
        self.walks += 1.0;
        self.reached_plan_m2 += plan_m * plan_m;
        self.reached_up_m2 += up_m * up_m;
        self.told_plan_m2 += told.0;
        self.told_up_m2 += told.1;
        self.bound_plan_m2 += bound.0;
        self.bound_up_m2 += bound.1;
        Ok(())
    }
}

/// The defaults without all that stands for more than the sensor's noise.
fn by_noise_alone(args: &BoundsArgs) -> SessionConfig {
    let mut config = pedestrian::two_feet();
    let tuning = &mut pedestrian::Config::of_mut(&mut config).tuning;
    tuning.imu_noise = FootNoise {
        angle_random_walk_rad_sqrt_s: args.angle_random_walk_rad_sqrt_s,
        angle_random_walk_share_sqrt_s: 0.0,
        velocity_random_walk_m_s_sqrt_s: args.velocity_random_walk_m_s_sqrt_s,
        velocity_random_walk_share_sqrt_s: 0.0,
        gyro_bias_random_walk_rad_s_sqrt_s: 2.6e-5,
        accelerometer_bias_random_walk_m_s2_sqrt_s: 2e-4,
        height_random_walk_m_sqrt_s: 0.0,
        ..tuning.imu_noise
    };
    tuning.slow_errors.stride_share = 0.0;
    tuning.slow_errors.stride_up_share = 0.0;
    tuning.slow_errors.stride_walk_sqrt_s = 0.0;
    config
}

fn walked(recording: &Recording, config: SessionConfig) -> Result<Walked> {
    let logs = [(Side::Left, &recording.left), (Side::Right, &recording.right)];
    let Some((foot, path)) = logs.into_iter().find_map(|(foot, log)| Some((foot, log.as_ref()?))) else {
        return Err(Failure::BadInput(format!("{} has no log", recording.name)).into());
    };
    let log = LogFile::open(path, &ProgressBar::hidden())?;
    run(SessionConfig { streams: vec![pedestrian::stream(foot)], ..config }, &[], [(foot, log)])
}

/// By how much the variances in plan and of the height have grown from the first point to the last, m².
fn grown_m2(points: &[TrackPoint]) -> Option<(f64, f64)> {
    let (first, last) = (points.first()?.sigma_n_m, points.last()?.sigma_n_m);
    let grown = |axis: usize| (last[axis] * last[axis] - first[axis] * first[axis]).max(0.0);
    Some((grown(0) + grown(1), grown(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_alone_leaves_less_than_the_defaults_tell_and_not_nothing() {
        use lodestep_engine::geo::Site;
        use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};

        use crate::cli::evaluate::ladder::InMemory;

        let site = Site::fast();
        let walk = simulate(&WalkKind::Line { metres: 30.0 }, 1, &site, &SensorModel::cmp10a());
        let args = BoundsArgs {
            paths: Vec::new(),
            angle_random_walk_rad_sqrt_s: 1.75e-4,
            velocity_random_walk_m_s_sqrt_s: 1.8e-3,
        };
        let height_m2 = |config: SessionConfig| {
            let mut config = SessionConfig {
                streams: vec![pedestrian::stream(Side::Left)],
                gravity_m_s2: site.gravity_m_s2,
                ..config
            };
            pedestrian::Config::of_mut(&mut config).aids.altimeter = false;
            let walked = run(config, &[], [(Side::Left, InMemory(&walk.left))]).unwrap();
            grown_m2(&walked.track.points).unwrap().1
        };
        let (told, bound) = (height_m2(pedestrian::two_feet()), height_m2(by_noise_alone(&args)));
        assert!(bound > 1e-6 && bound < 0.25 * told, "{bound} and {told} m²");
    }
}
