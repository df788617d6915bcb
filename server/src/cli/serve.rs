//! `lodestep serve`: the server until it is told to stop.

use std::io::IsTerminal;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use super::stopping::asked_to_stop;
use crate::config::Config;
use crate::serve::bind;

/// The arguments of `lodestep serve`.
#[derive(Debug, Args)]
pub(super) struct ServeArgs {
    #[command(flatten)]
    config: Config,

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

/// Serves until SIGINT or SIGTERM.
pub(super) fn serve(args: ServeArgs) -> Result<()> {
    begin_log(args.log_format);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .context("the threads of the server cannot be started")?;
    runtime.block_on(async {
        let listener = bind(&args.config).await?;
        let stop = asked_to_stop()?;
        crate::serve::serve(args.config, listener, stop).await
    })
}
