//! One walk run with the engine's defaults, and the figures by which the field judges it.

use anyhow::Result;
use indicatif::ProgressBar;
use lodestep_engine::evaluate::pedestrian::{FeetApart, feet_apart};
use lodestep_engine::evaluate::{
    self, GroundPointErrors, LoopClosure, MotionCaptureErrors, Overlay, Spread, TruthErrors, VisitErrors,
};
use lodestep_engine::geo::Site;
use lodestep_engine::parameters::Parameters;
use lodestep_engine::parse::truth_csv::{self, KnownPlace};
use lodestep_engine::session::SessionConfig;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_engine::systems::pedestrian::{self, Aids};
use serde::Serialize;

use super::recordings::{Judge, Recording};
use crate::cli::failure::Failure;
use crate::cli::log_file::{LogFile, read_small};
use crate::cli::run::run;
use crate::cli::solution::Solution;
use crate::cli::{site_file, visits};

/// What a walk came to.
#[derive(Debug, Serialize)]
pub(super) struct Score {
    pub(super) set: String,
    pub(super) name: String,
    pub(super) feet: usize,
    pub(super) samples: u64,
    pub(super) duration_s: f64,
    /// As the engine measures it, m.
    pub(super) distance_m: f64,
    pub(super) anomalies: usize,
    pub(super) process_seconds: f64,
    track_sha256: String,
    #[serde(flatten)]
    pub(super) figures: Figures,
    /// The track upon what is known.
    #[serde(skip)]
    pub(super) overlay: Overlay,
}

/// The figures of one measure; none where the track gave too little to compare.
#[derive(Debug, Serialize)]
#[serde(tag = "measure", content = "figures", rename_all = "snake_case")]
pub(super) enum Figures {
    MotionCapture(Option<MotionCaptureErrors>),
    GroundPoints(Option<GroundPointErrors>),
    ClosedLoop(Option<LoopClosure>),
    Feet(Option<FeetApart>),
    Simulated { truth: Option<TruthErrors>, visits: Option<VisitErrors>, held_back: Option<Spread> },
    Nothing,
}

/// Runs and judges one walk. Of its visits every `hold_back`th is not told, and measures the track.
pub(super) fn score(
    recording: &Recording,
    aids: Aids,
    solution: Solution,
    hold_back: Option<usize>,
    parameters: &Parameters,
) -> Result<Score> {
    let bar = ProgressBar::hidden();
    let mut feet = Vec::new();
    for (foot, log) in [(Side::Left, &recording.left), (Side::Right, &recording.right)] {
        if let Some(path) = log {
            feet.push((foot, LogFile::open(path, &bar)?));
        }
    }
    let sides: Vec<Side> = feet.iter().map(|(side, _)| *side).collect();
    let own = pedestrian::Config { aids, ..Default::default() };
    let mut config = SessionConfig { solution: solution.into(), ..own.session(&sides) };
    parameters.apply(&mut config);
    let mut known = Vec::new();
    let mut told = Vec::new();
    match &recording.judge {
        Judge::MotionCapture(path) | Judge::GroundPoints(path) => known = read_places(path)?,
        Judge::Simulated { truth, folder } => {
            known = read_places(truth)?;
            config.initial_position_n_m = known.first().map_or([0.0; 3], |place| place.position_m);
            let (site_path, markers, visits) =
                (folder.join("site.toml"), folder.join("markers.csv"), folder.join("visits.csv"));
            if site_path.exists() {
                let site: Site = site_file::read(&site_path, None)?;
                config.gravity_m_s2 = site.gravity_m_s2;
                config.declination_rad = site.declination_deg.to_radians();
                config.site_field = Some(site.field());
            }
            if markers.exists() && visits.exists() {
                told = visits::read(&markers, &visits, None)?;
            }
        }
        Judge::ClosedLoop | Judge::Feet | Judge::Nothing => {}
    }
    let mut held_back = Vec::new();
    if let Some(every) = hold_back {
        let mut number = 0;
        held_back = told
            .extract_if(.., |_| {
                number += 1;
                number % every == 0
            })
            .map(|visit| {
                let (e_m, n_m, u_m) = visit.position_n_m;
                let t_ns = visit.t_start_ns + (visit.t_end_ns - visit.t_start_ns) / 2;
                KnownPlace { t_ns, position_m: [e_m, n_m, u_m.unwrap_or_default()] }
            })
            .collect();
    }
    let count = feet.len();
    let walked = run(config, &told, feet)?;
    let points = &walked.track.points;
    let figures = match recording.judge {
        Judge::MotionCapture(_) => Figures::MotionCapture(evaluate::motion_capture(points, &known)),
        Judge::GroundPoints(_) => Figures::GroundPoints(evaluate::ground_points(points, &known)),
        Judge::ClosedLoop => Figures::ClosedLoop(evaluate::loop_closure(points, walked.summary.distance_m)),
        Judge::Feet => Figures::Feet(feet_apart(points)),
        Judge::Simulated { .. } => Figures::Simulated {
            truth: evaluate::against_truth(points, &known),
            visits: evaluate::visits(&walked.track.visits),
            held_back: evaluate::held_back(points, &held_back),
        },
        Judge::Nothing => Figures::Nothing,
    };
    let overlay = match recording.judge {
        Judge::MotionCapture(_) => Overlay::on_motion_capture(points, &known).unwrap_or_default(),
        Judge::GroundPoints(_) => Overlay::on_ground_points(points, &known).unwrap_or_default(),
        Judge::ClosedLoop => {
            let start =
                points.first().map(|point| KnownPlace { t_ns: point.t_ns, position_m: point.position_n_m });
            Overlay::in_one_frame(points, start.as_slice())
        }
        Judge::Feet | Judge::Simulated { .. } | Judge::Nothing => Overlay::in_one_frame(points, &known),
    };
    Ok(Score {
        set: recording.set.clone(),
        name: recording.name.clone(),
        feet: count,
        samples: walked.summary.samples,
        duration_s: walked.summary.duration_s,
        distance_m: walked.summary.distance_m,
        anomalies: walked.track.anomalies.len(),
        process_seconds: walked.process_seconds,
        track_sha256: walked.track.sha256(),
        figures,
        overlay,
    })
}

fn read_places(path: &std::path::Path) -> Result<Vec<KnownPlace>> {
    truth_csv::read(&read_small(path)?).map_err(|error| Failure::bad_input(path, error))
}
