//! `lodestep evaluate`: recordings scored with the engine's defaults, the same for every file.

mod bounds;
mod contradictions;
mod honesty;
mod ladder;
mod left_out;
mod markers;
mod picture;
mod recordings;
mod score;
mod stance;
mod text_table;
mod worlds;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, Subcommand};
use lodestep_engine::parameters::Parameters;
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::pedestrian::Aids;
use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::print::print;
use crate::cli::solution::Solution;
use crate::cli::track_output::write_text;
use crate::cli::{aids, of_system, progress};
use score::Score;

const AFTER_HELP: &str = "\
NAME.csv[.gz|.zst] is a walk of one foot, NAME.left.csv and NAME.right.csv one of two. Beside it may lie
  NAME.truth.csv   t_s,x_m,y_m,z_m: motion capture; scored by ARMSE, start and first heading aligned
  NAME.points.csv  t_s,x_m,y_m: ground points in a frame of their own; mean distance after a rigid fit
A folder with left.csv, right.csv and truth.csv is a simulated walk, scored in its own frame. Walks in a
folder whose name holds openshoe or ngimu end where they began. Distances are in metres.";

/// The arguments of `lodestep evaluate`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct EvaluateArgs {
    #[command(subcommand)]
    study: Option<Study>,

    /// Recordings, or folders of them
    #[arg(value_name = "DIR|FILES", required = true)]
    paths: Vec<PathBuf>,

    /// Score folders of this system, as `simulate SYSTEM` writes them, instead of walks
    #[arg(long, value_name = "SYSTEM", value_parser = of_system::named, conflicts_with_all = ["closed", "aid", "hold_back", "picture"])]
    system: Option<&'static Declaration>,

    /// Walks without truth end where they began
    #[arg(long)]
    closed: bool,

    /// Aids to use, of zupt,heading,maru,separation,markers,altimeter; or none [default: all that the
    /// data allow]
    #[arg(long, value_name = "LIST", value_parser = aids::parse)]
    aid: Option<Aids>,

    /// Which solution to score
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,

    /// Keep every Nth visit of a simulated walk from the filter, and measure the track at its marker
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    hold_back: Option<u16>,

    /// The tracks upon what is known of the walks, as a file; SVG
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,

    /// JSON instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Study {
    /// The ladder of aids on simulated walks: ZUPT, + heading, + MARU, + separation, + markers
    Ladder(ladder::LadderArgs),
    /// Errors over their own sigmas on simulated walks: does the filter know how wrong it is?
    Honesty(honesty::HonestyArgs),
    /// The same over drawn worlds: other sensors, iron, gaits, mountings and weather for each seed
    Worlds(worlds::WorldsArgs),
    /// Sensors that contradict each other: is each contradiction told, or covered by the sigma?
    Contradictions(contradictions::ContradictionsArgs),
    /// What the sensor's noise alone would leave of the errors of recorded walks
    Bounds(bounds::BoundsArgs),
    /// Standing feet: which contacts are recognised, missed or false, by gait and sample rate
    Stance(stance::StanceArgs),
    /// Every set of recordings judged with the value of a parameter that the other sets choose
    LeftOut(left_out::LeftOutArgs),
    /// Which marker is it? Candidates on simulated walks: right first, calibration, automatic mode
    Markers(markers::MarkersArgs),
}

/// Scores recordings, or makes one of the studies on simulated walks.
pub(super) fn evaluate(args: &EvaluateArgs) -> Result<()> {
    match &args.study {
        Some(Study::Ladder(args)) => return ladder::ladder(args),
        Some(Study::Honesty(args)) => return honesty::honesty(args),
        Some(Study::Worlds(args)) => return worlds::worlds(args),
        Some(Study::Contradictions(args)) => return contradictions::contradictions(args),
        Some(Study::Bounds(args)) => return bounds::bounds(args),
        Some(Study::Stance(args)) => return stance::stance(args),
        Some(Study::LeftOut(args)) => return left_out::left_out(args),
        Some(Study::Markers(args)) => return markers::markers(args),
        None => {}
    }
    if let Some(system) = args.system {
        return of_system::evaluate(system, &args.paths, args.solution, args.json);
    }
    if args.picture.as_ref().is_some_and(|path| path.extension().is_none_or(|ending| ending != "svg")) {
        return Err(Failure::usage("--picture writes SVG: give a name that ends in .svg"));
    }
    let found = recordings::find(&args.paths, args.closed)?;
    if found.is_empty() {
        return Err(Failure::BadInput(format!(
            "no recording in {}: expected files such as NAME.csv.gz, or a folder with left.csv and right.csv",
            args.paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
        ))
        .into());
    }
    let bar = progress::of_count(found.len() as u64, "walks");
    let mut scores = Vec::with_capacity(found.len());
    for recording in &found {
        let hold_back = args.hold_back.map(usize::from);
        scores.push(score::score(
            recording,
            args.aid.unwrap_or_default(),
            args.solution,
            hold_back,
            &Parameters::default(),
        )?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(path) = &args.picture {
        write_text(path, &picture::of_scores(&scores))?;
    }
    print(&if args.json { json(&scores)? } else { text_table::of_scores(&scores) })
}

fn json(scores: &[Score]) -> Result<String> {
    #[derive(Serialize)]
    struct All<'a> {
        engine_version: &'static str,
        recordings: &'a [Score],
    }
    let all = All { engine_version: env!("CARGO_PKG_VERSION"), recordings: scores };
    Ok(serde_json::to_string_pretty(&all)? + "\n")
}
