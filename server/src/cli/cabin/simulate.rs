//! `lodestep simulate cabin`: the files of a run that never was, with its truth.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::{ArgMatches, Args, Command, FromArgMatches as _, ValueEnum};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::cabin::{self, Fault, PoseTruth, RunPlan, SimulatedRun};
use lodestep_engine::track::csv::push_seconds;

use crate::cli::output_file::{self, OutputFile};

#[derive(Debug, Args)]
struct SimulateArgs {
    /// The folder to write into; it is made where it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Which world
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Parked, s
    #[arg(long, value_name = "S", default_value_t = 40.0, value_parser = parse_duration)]
    hold_s: f64,

    /// Change of source, s
    #[arg(long, value_name = "S", default_value_t = 180.0, value_parser = parse_duration)]
    slew_s: f64,

    /// Tracking, s
    #[arg(long, value_name = "S", default_value_t = 600.0, value_parser = parse_duration)]
    track_s: f64,

    /// Whose prisms the stations look at
    #[arg(long, value_enum, default_value_t)]
    stations_on: StationsOn,

    /// What goes wrong, KIND[.NUMBER]@FROM..TO in seconds; may be given often: fog@300..400, no_antennas@.., wrong_fix.2@..,
    /// wrong_make.0@.., wrong_prism.1@.., wrong_distance.2@.., restart@.., late_make.1@.., no_encoders@..,
    /// wrong_leg.3@..
    #[arg(long, value_name = "FAULT")]
    fault: Vec<Fault>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum StationsOn {
    /// The platform's
    #[default]
    Platform,
    /// The cabin's
    Cabin,
}

fn parse_duration(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| (1.0..=36_000.0).contains(value))
        .ok_or_else(|| format!("expected seconds from 1 to 36000, found {text:?}"))
}

/// What the command takes.
pub(in crate::cli) fn command() -> Command {
    SimulateArgs::augment_args(
        Command::new("cabin")
            .about("The feed cabin and its Stewart platform: every device's file, and the truth"),
    )
}

/// Runs it.
pub(in crate::cli) fn run(matches: &ArgMatches) -> Result<()> {
    let args = SimulateArgs::from_arg_matches(matches)?;
    let plan = RunPlan {
        hold_s: args.hold_s,
        slew_s: args.slew_s,
        track_s: args.track_s,
        stations_on_platform: args.stations_on == StationsOn::Platform,
        faults: args.fault.clone(),
    };
    let run = cabin::simulate(&plan, args.seed);
    std::fs::create_dir_all(&args.out).with_context(|| output_file::cannot(&args.out))?;
    write(&args.out, &run)?;
    // For people only: nothing depends on whether it can be shown.
    let _ = writeln!(
        std::io::stderr(),
        "{} s in {}",
        plan.hold_s + plan.slew_s + plan.track_s,
        args.out.display()
    );
    Ok(())
}

/// Writes a table of `header`, a row for each of `rows`.
fn table<R>(
    folder: &Path,
    name: &str,
    header: &str,
    rows: &[R],
    t_ns: impl Fn(&R) -> i64,
    rest: impl Fn(&R) -> String,
) -> Result<()> {
    output_file::write(&folder.join(name), |out: &mut OutputFile| {
        writeln!(out, "{header}")?;
        let mut line = String::new();
        for row in rows {
            line.clear();
            push_seconds(t_ns(row), &mut line);
            writeln!(out, "{line},{}", rest(row))?;
        }
        Ok(())
    })
}

fn numbers(values: &[f64], decimals: usize) -> String {
    values.iter().map(|value| format!("{value:.decimals$}")).collect::<Vec<_>>().join(",")
}

fn write(folder: &Path, run: &SimulatedRun) -> Result<()> {
    output_file::write(&folder.join("cabin.toml"), |out| out.write_all(run.instrument.as_bytes()))?;
    output_file::write(&folder.join("notes.txt"), |out| {
        out.write_all((run.notes.join("\n") + "\n").as_bytes())
    })?;
    const IMU: &str = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2";
    for (name, samples) in [("imu.csv", &run.imu), ("platform_imu.csv", &run.platform_imu)] {
        let row =
            |sample: &ImuSample| numbers(&sample.w_ib_b_rad_s, 12) + "," + &numbers(&sample.f_b_m_s2, 9);
        table(folder, name, IMU, samples, |sample| sample.t_ns, row)?;
    }
    let antennas = "t_s,antenna,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m,quality,ve_m_s,vn_m_s,vu_m_s";
    table(
        folder,
        "antennas.csv",
        antennas,
        &run.antennas,
        |row| row.t_ns,
        |row| {
            format!(
                "A{},{},{},{},{}",
                row.antenna + 1,
                numbers(&row.position_n_m, 4),
                numbers(&row.sigma_n_m, 4),
                row.quality,
                numbers(&row.velocity_n_m_s, 4)
            )
        },
    )?;
    let rays = "t_s,station,target,azimuth_rad,zenith_rad,slant_m";
    table(
        folder,
        "stations.csv",
        rays,
        &run.stations,
        |ray| ray.t_ns,
        |ray| {
            let target = match ray.target.checked_sub(cabin::PRISMS_ON_CABIN) {
                None => format!("C{}", ray.target + 1),
                Some(k) => format!("P{}", k + 1),
            };
            format!(
                "S{},{target},{:.9},{:.9},{:.5}",
                ray.station + 1,
                ray.azimuth_rad,
                ray.zenith_rad,
                ray.slant_m
            )
        },
    )?;
    let encoders = "t_s,a_rad,b_rad,leg_1_m,leg_2_m,leg_3_m,leg_4_m,leg_5_m,leg_6_m";
    table(
        folder,
        "encoders.csv",
        encoders,
        &run.encoders,
        |row| row.t_ns,
        |row| numbers(&row.angles_rad, 9) + "," + &numbers(&row.legs_m, 5),
    )?;
    let pose = "t_s,e_m,n_m,u_m,yaw_rad,pitch_rad,roll_rad,platform_e_m,platform_n_m,platform_u_m,\
                platform_yaw_rad,platform_pitch_rad,platform_roll_rad";
    let both = |row: &PoseTruth| numbers(&row.cabin, 8) + "," + &numbers(&row.platform, 8);
    table(folder, "plan.csv", pose, &run.plan, |row| row.t_ns, both)?;
    let truth = format!("{pose},v_e_m_s,v_n_m_s,v_u_m_s");
    table(
        folder,
        "truth.csv",
        &truth,
        &run.truth,
        |row| row.t_ns,
        |row| both(row) + "," + &numbers(&row.velocity_n_m_s, 6),
    )
}
