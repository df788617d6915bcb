//! `lodestep simulate pole`: the files of a survey that never was, with its truth.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::{ArgMatches, Args, Command, FromArgMatches as _};
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::sim::pole::{GnssEpoch, Route, SimulatedSurvey, Trouble, Worlds, simulate_in};

use crate::cli::output_file::cannot;
use crate::cli::track_output::write_text;

/// The arguments of `lodestep simulate pole`.
#[derive(Debug, Args)]
struct PoleArgs {
    /// Folder to write imu.csv, gnss.csv, gnss_open.csv, contact.csv, points.csv, pole.toml, points_truth.csv and truth.csv to;
    /// made when it is missing
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// The same seed gives the same files, byte by byte
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// The route and the length of its gap, m: I straight, L with a corner, U with two; B so far under the roof and back
    #[arg(long, value_name = "I60|L20|U20|B60", default_value = "I60")]
    route: Route,

    /// What goes wrong: none, slip, slip-on-point, moving-ground, float, float-told, wrong-fix, chatter, tip-off or no-manoeuvre
    #[arg(long, value_name = "TROUBLE", default_value = "none")]
    trouble: Trouble,

    /// The world it happens in: usual, or drawn for another pole, sensor, receiver, ground and walker at each seed
    #[arg(long, value_name = "usual|drawn", default_value = "usual")]
    world: Worlds,
}

/// The command with its help.
pub(super) fn command() -> Command {
    PoleArgs::augment_args(Command::new("pole"))
        .about("Writes the files of a survey with a positioning pole that never was, with its truth")
}

/// Writes one survey.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let args = PoleArgs::from_arg_matches(matches)?;
    let survey = simulate_in(args.world, args.route, args.seed, args.trouble);
    fs::create_dir_all(&args.out).with_context(|| cannot(&args.out))?;
    let frame = survey.site.local_frame();
    let files = [
        ("imu.csv", imu(&survey)),
        ("gnss.csv", gnss(&survey.gnss, &frame)),
        ("gnss_open.csv", gnss(&survey.gnss_open, &frame)),
        ("contact.csv", contact(&survey)),
        ("points.csv", stop(&survey)),
        ("points_truth.csv", point(&survey, &frame)),
        ("pole.toml", pole(&survey)),
        ("truth.csv", truth(&survey)),
    ];
    for (name, text) in files {
        write_text(&args.out.join(name), &text)?;
    }
    Ok(())
}

fn seconds(t_ns: i64) -> f64 {
    t_ns as f64 * 1e-9
}

/// Decimals that a time takes: clocks of drawn worlds do not meet at whole milliseconds.
fn decimals(t_ns: i64) -> usize {
    if t_ns % 1_000_000 == 0 { 3 } else { 6 }
}

// A string takes whatever is written to it: what `write!` gives back below says nothing.

fn imu(survey: &SimulatedSurvey) -> String {
    let mut text = "t_s,gyr_x_rad_s,gyr_y_rad_s,gyr_z_rad_s,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2\n".to_owned();
    for sample in &survey.imu {
        let ([wx, wy, wz], [fx, fy, fz]) = (sample.w_ib_b_rad_s, sample.f_b_m_s2);
        let (t_s, decimals) = (seconds(sample.t_ns), decimals(sample.t_ns));
        let _ = writeln!(text, "{t_s:.decimals$},{wx:.6},{wy:.6},{wz:.6},{fx:.5},{fy:.5},{fz:.5}");
    }
    text
}

fn gnss(epochs: &[GnssEpoch], frame: &LocalFrame) -> String {
    let mut text = "t_s,lat_deg,lon_deg,height_m,sigma_e_m,sigma_n_m,sigma_u_m,quality\n".to_owned();
    for epoch in epochs {
        let place = frame.to_geodetic(epoch.p_n_m);
        let ([e, n, u], quality) = (epoch.sigma_n_m, epoch.quality);
        let decimals = decimals(epoch.t_ns);
        let _ = writeln!(
            text,
            "{:.decimals$},{:.10},{:.10},{:.4},{e:.4},{n:.4},{u:.4},{quality}",
            seconds(epoch.t_ns),
            place.latitude_deg,
            place.longitude_deg,
            place.height_m
        );
    }
    text
}

fn contact(survey: &SimulatedSurvey) -> String {
    let mut text = "t_s,contact\n".to_owned();
    for (t_ns, closed) in &survey.contact {
        let _ = writeln!(text, "{:.3},{}", seconds(*t_ns), u8::from(*closed));
    }
    text
}

fn stop(survey: &SimulatedSurvey) -> String {
    let [from_ns, to_ns] = survey.stop_ns;
    format!("name,t_start_s,t_end_s\nT,{:.3},{:.3}\n", seconds(from_ns), seconds(to_ns))
}

fn point(survey: &SimulatedSurvey, frame: &LocalFrame) -> String {
    let [e, n, u] = survey.point_n_m;
    let place = frame.to_geodetic(survey.point_n_m);
    format!(
        "name,lat_deg,lon_deg,height_m,e_m,n_m,u_m\nT,{:.10},{:.10},{:.4},{e:.4},{n:.4},{u:.4}\n",
        place.latitude_deg, place.longitude_deg, place.height_m
    )
}

fn pole(survey: &SimulatedSurvey) -> String {
    let site = &survey.site;
    let arm = |[x, y, z]: [f64; 3]| format!("[{x:.4}, {y:.4}, {z:.4}]");
    format!(
        "[site]\nname = \"{}\"\nlatitude_deg = {:.10}\nlongitude_deg = {:.10}\nheight_m = {:.4}\n\n[pole]\nantenna_b_m = {}\ntip_b_m = {}\n",
        site.name,
        site.latitude_deg,
        site.longitude_deg,
        site.height_m,
        arm(survey.antenna_b_m),
        arm(survey.tip_b_m)
    )
}

fn truth(survey: &SimulatedSurvey) -> String {
    let mut text =
        "t_s,tip_e_m,tip_n_m,tip_u_m,imu_e_m,imu_n_m,imu_u_m,axis_x_azimuth_rad,lean_e,lean_n\n".to_owned();
    for row in &survey.truth {
        let ([te, tn, tu], [ie, inorth, iu], [le, ln]) = (row.tip_n_m, row.imu_n_m, row.lean);
        let _ = writeln!(
            text,
            "{:.3},{te:.4},{tn:.4},{tu:.4},{ie:.4},{inorth:.4},{iu:.4},{:.4},{le:.4},{ln:.4}",
            seconds(row.t_ns),
            row.axis_x_azimuth_rad
        );
    }
    text
}
