//! `lodestep integers`: the two best whole vectors of float ambiguities, for problems of any origin.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use lodestep_engine::adjust::integers::integers;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::failure::Failure;
use super::{log_file, output_file};

/// The arguments of `lodestep integers`.
#[derive(Debug, Args)]
pub(super) struct IntegersArgs {
    /// The problems: [{"a": [..], "Q": [[..]]}], float vectors and their covariances
    #[arg(value_name = "PROBLEMS.json")]
    problems: PathBuf,

    /// The answers: [{"best": [..], "second": [..], "norms": [.., ..]}]
    #[arg(long, value_name = "ANSWERS.json")]
    out: PathBuf,
}

#[derive(Deserialize)]
struct Problem {
    a: Vec<f64>,
    #[serde(rename = "Q")]
    q: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Answer {
    best: Vec<i64>,
    second: Vec<i64>,
    norms: [f64; 2],
    success: f64,
}

/// Runs the command.
pub(super) fn run(args: &IntegersArgs) -> Result<()> {
    let bytes = log_file::read_small(&args.problems)?;
    let problems: Vec<Problem> = serde_json::from_slice(&bytes).map_err(|error| {
        Failure::bad_input(&args.problems, format!("expected [{{\"a\": [..], \"Q\": [[..]]}}]: {error}"))
    })?;
    let mut answers = Vec::with_capacity(problems.len());
    for (k, problem) in problems.iter().enumerate() {
        let wrong =
            |sentence: String| Failure::bad_input(&args.problems, format!("problem {}: {sentence}", k + 1));
        let n = problem.a.len();
        if problem.q.len() != n || problem.q.iter().any(|row| row.len() != n) {
            return Err(wrong(format!("expected {n} rows and columns of Q, one for each of a")));
        }
        let q = DMatrix::from_fn(n, n, |i, j| 0.5 * (problem.q[i][j] + problem.q[j][i]));
        let found = integers(&problem.a, &q).map_err(|error| wrong(error.to_string()))?;
        let whole = |values: &[f64]| values.iter().map(|value| *value as i64).collect();
        answers.push(Answer {
            best: whole(&found.best),
            second: whole(&found.second),
            norms: found.norms,
            success: found.success,
        });
    }
    let json = serde_json::to_string(&answers)?;
    output_file::write(&args.out, |out| writeln!(out, "{json}"))
}
