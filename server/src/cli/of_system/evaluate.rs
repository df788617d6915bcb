//! `lodestep evaluate --system SYSTEM`: sessions with their truth, as `simulate SYSTEM` writes them, scored with the engine's
//! defaults.

use std::path::{Path, PathBuf};

use anyhow::Result;
use lodestep_engine::evaluate::{TruthErrors, against_truth};
use lodestep_engine::geo::Site;
use lodestep_engine::parse::truth_csv;
use lodestep_engine::stream::Stream;
use lodestep_engine::system::Declaration;
use serde::Serialize;

use super::process::{StreamLog, run_logs, session_config};
use crate::cli::failure::Failure;
use crate::cli::log_file::read_small;
use crate::cli::print::print;
use crate::cli::site_file;
use crate::cli::solution::Solution;
use crate::cli::text_columns::push_aligned;

/// What a session came to.
#[derive(Debug, Serialize)]
struct Score {
    name: String,
    system: &'static str,
    samples: u64,
    duration_s: f64,
    /// As the engine measures it, m.
    distance_m: f64,
    anomalies: usize,
    process_seconds: f64,
    track_sha256: String,
    /// None where the track and the truth have no time in common.
    truth: Option<TruthErrors>,
}

/// Scores each folder.
pub(in crate::cli) fn evaluate(
    system: &'static Declaration,
    folders: &[PathBuf],
    solution: Solution,
    json: bool,
) -> Result<()> {
    let scores = folders.iter().map(|folder| score(system, folder, solution)).collect::<Result<Vec<_>>>()?;
    if json {
        return print(&(serde_json::to_string_pretty(&scores)? + "\n"));
    }
    let heads = ["session", "s", "m", "plan m", "height m", "end m", "anomalies"];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    for score in &scores {
        let number = |value: fn(&TruthErrors) -> f64| {
            score.truth.as_ref().map_or_else(|| "-".to_owned(), |truth| format!("{:.2}", value(truth)))
        };
        rows.push(vec![
            score.name.clone(),
            format!("{:.0}", score.duration_s),
            format!("{:.1}", score.distance_m),
            number(|truth| truth.horizontal.rms_m),
            number(|truth| truth.height_rms_m),
            number(|truth| truth.end_error_m),
            score.anomalies.to_string(),
        ]);
    }
    let mut out = String::new();
    push_aligned(&rows, &mut out);
    print(&out)
}

fn score(system: &'static Declaration, folder: &Path, solution: Solution) -> Result<Score> {
    let mut found: Vec<(Stream, PathBuf)> = Vec::new();
    for rule in system.streams {
        for stream in (0..rule.most).filter_map(|nth| rule.nth(nth)).filter_map(|id| system.stream(id)) {
            let path = folder.join(format!("{}.csv", stream.id));
            if path.exists() {
                found.push((stream, path));
            }
        }
    }
    let logs: Vec<StreamLog<'_>> =
        found.iter().map(|(stream, path)| (stream.clone(), path.as_path())).collect();
    let streams: Vec<Stream> = found.iter().map(|(stream, _)| stream.clone()).collect();
    system.check_streams(&streams).map_err(|error| Failure::bad_input(folder, error))?;
    let truth_path = folder.join("truth.csv");
    let known =
        truth_csv::read(&read_small(&truth_path)?).map_err(|error| Failure::bad_input(&truth_path, error))?;
    let site_path = folder.join("site.toml");
    let site: Option<Site> = if site_path.exists() { Some(site_file::read(&site_path, None)?) } else { None };
    let mut config = session_config(system, &logs, site.as_ref());
    config.initial_position_n_m = known.first().map_or([0.0; 3], |place| place.position_m);
    config.solution = solution.into();
    let walked = run_logs(config, &[], &logs)?;
    Ok(Score {
        name: folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
        system: system.name,
        samples: walked.summary.samples,
        duration_s: walked.summary.duration_s,
        distance_m: walked.summary.distance_m,
        anomalies: walked.track.anomalies.len(),
        process_seconds: walked.process_seconds,
        track_sha256: walked.track.sha256(),
        truth: against_truth(&walked.track.points, &known),
    })
}
