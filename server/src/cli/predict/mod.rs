//! `lodestep predict`: how good a result will be, before anybody has walked.

mod height;
mod height_sweep;

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
}

/// Predicts.
pub(super) fn predict(args: &PredictArgs) -> Result<()> {
    match &args.what {
        What::Height(args) => height::height(args),
    }
}
