//! `lodestep predict`: how good a result will be, before anybody has walked.

mod height;
mod height_sweep;
mod survey;

use anyhow::Result;
use clap::{Args, Subcommand};

/// The arguments of `lodestep predict`.
#[derive(Debug, Args)]
pub(super) struct PredictArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// How well the height is known with zero velocity and an altimeter, and when (paper 2)
    Height(height::HeightArgs),
    /// What sigma a point under the roof will have that is surveyed with the pole (paper 4)
    Survey(survey::SurveyArgs),
}

/// Predicts.
pub(super) fn predict(args: &PredictArgs) -> Result<()> {
    match &args.what {
        What::Height(args) => height::height(args),
        What::Survey(args) => survey::survey(args),
    }
}
