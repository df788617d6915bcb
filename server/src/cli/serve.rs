//! `lodestep serve`: the server until it is told to stop.

use std::env::VarError;
use std::io::IsTerminal;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use super::failure::Failure;
use super::stopping::asked_to_stop;
use crate::config::Config;
use crate::serve::bind;

/// The arguments of `lodestep serve`.
#[derive(Debug, Args)]
pub(super) struct ServeArgs {
    #[command(flatten)]
    config: Config,

    /// File with the setup token for the first account, 20 letters or more; the variable LODESTEP_SETUP_TOKEN may
    /// hold it, too. Without either, one is made by chance and printed at the start.
    #[arg(long, env = "LODESTEP_SETUP_TOKEN_FILE", value_name = "FILE")]
    setup_token_file: Option<PathBuf>,

    /// What earlier versions took, for everybody to read who lists processes
    #[arg(long, value_name = "TEXT", hide = true)]
    setup_token: Option<String>,

    /// How the log on standard error is written: lines for people, or one JSON object a line for programs.
    #[arg(long, env = "LODESTEP_LOG_FORMAT", value_name = "FORMAT", default_value = "text")]
    log_format: LogFormat,
}

/// How the log is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LogFormat {
    /// Lines for people.
    Text,
    /// One JSON object a line: time, level, what was said, the fields, and those of the request or session it is about.
    Json,
}

/// Begins the log of this process.
fn begin_log(format: LogFormat) {
    let wanted =
        tracing_subscriber::EnvFilter::try_from_env("LODESTEP_LOG").unwrap_or_else(|_| "info".into());
    let log = tracing_subscriber::fmt().with_env_filter(wanted).with_writer(std::io::stderr);
    match format {
        // Colours are for a person at a terminal; in a file they are noise.
        LogFormat::Text => log.with_ansi(std::io::stderr().is_terminal()).init(),
        LogFormat::Json => {
            log.json().flatten_event(true).with_current_span(false).with_span_list(true).init()
        }
    }
}

impl ServeArgs {
    /// The setup token that was chosen, from where only this user reads it.
    fn chosen_setup_token(&self) -> Result<Option<String>> {
        if self.setup_token.is_some() {
            return Err(Failure::usage(
                "--setup-token would show the token to everybody who lists processes: give it in the variable LODESTEP_SETUP_TOKEN, or in a file with --setup-token-file FILE",
            ));
        }
        if let Some(file) = &self.setup_token_file {
            let token = std::fs::read_to_string(file);
            return Ok(Some(token.map_err(|error| Failure::bad_input(file, error))?.trim().to_owned()));
        }
        match std::env::var("LODESTEP_SETUP_TOKEN") {
            Ok(token) => Ok(Some(token)),
            Err(VarError::NotPresent) => Ok(None),
            Err(VarError::NotUnicode(_)) => Err(Failure::usage("LODESTEP_SETUP_TOKEN is not UTF-8 text")),
        }
    }
}

/// Serves until SIGINT or SIGTERM.
pub(super) fn serve(args: ServeArgs) -> Result<()> {
    begin_log(args.log_format);
    let config = Config { setup_token: args.chosen_setup_token()?, ..args.config };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the threads of the server cannot be started")?;
    runtime.block_on(async {
        let listener = bind(&config).await?;
        let stop = asked_to_stop()?;
        crate::serve::serve(config, listener, stop).await
    })
}
