//! The command line: `process` a walk, `simulate` one, `evaluate` many, `predict` how good they can be,
//! `serve` them all; `load`, many at once; `account`, who may sign in; `backup` and `restore`.

mod account;
mod aids;
mod backup;
mod cabin;
mod evaluate;
mod failure;
#[cfg(feature = "cluster")]
mod import;
mod inputs;
mod integers;
mod load;
mod log_file;
mod of_system;
mod output_file;
mod own;
mod plot;
mod pole;
mod predict;
mod print;
mod process;
mod progress;
mod report;
mod rover;
mod run;
mod serve;
mod simulate;
mod site_file;
mod solution;
mod stopping;
mod stream;
mod text_columns;
mod track_output;
mod visits;

use std::ffi::OsString;
use std::io::Write as _;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Positions people and instruments under a roof that hides the sky: inertial sensors on the feet,
/// a track on the map.
#[derive(Debug, Parser)]
#[command(name = "lodestep", version, after_help = EXIT_CODES)]
struct CommandLine {
    #[command(subcommand)]
    verb: Verb,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 something failed inside, or a result could not be written; \
                          2 the command line is wrong; 3 an input file is wrong.";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Makes a track of the logs of one walk, or of one session of another system
    Process(Box<process::ProcessCommand>),
    /// Writes the logs of a walk that never was, or of a session of another system, with its truth
    Simulate(simulate::SimulateCommand),
    /// Scores recordings with the engine's defaults, the same for every file
    Evaluate(evaluate::EvaluateArgs),
    /// Says how good a result will be, before anybody has walked
    Predict(predict::PredictArgs),
    /// Finds the two best whole vectors of float ambiguities with their covariance
    Integers(integers::IntegersArgs),
    /// Serves uploads, live walks and the map
    Serve(serve::ServeArgs),
    /// Brings what receivers send to a server, as one live session
    Stream(stream::StreamCommand),
    /// Loads a server with many inspectors at once, and audits what it kept
    Load(load::LoadArgs),
    /// Makes accounts at the machine itself, while no server runs
    Account(account::AccountArgs),
    /// Copies everything that a server keeps, while it runs
    Backup(backup::BackupArgs),
    /// Brings a backup back, while no server runs
    Restore(backup::RestoreArgs),
    /// Backs up, restores elsewhere and compares, whether a server runs or not; changes nothing
    Drill(backup::DrillArgs),
    /// Moves the database of a one-machine server into PostgreSQL, and compares every row
    #[cfg(feature = "cluster")]
    Import(import::ImportArgs),
}

/// Runs one command; the arguments start with the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let line = match CommandLine::try_parse_from(arguments) {
        Ok(line) => line,
        Err(error) => {
            // Help and version are errors to clap, which knows where each is to be printed.
            let code = if error.use_stderr() { failure::USAGE } else { 0 };
            return match error.print() {
                Ok(()) => ExitCode::from(code),
                Err(_) => ExitCode::from(failure::INTERNAL),
            };
        }
    };
    let done = match line.verb {
        Verb::Process(args) => process::process(&args),
        Verb::Simulate(args) => simulate::simulate(&args),
        Verb::Evaluate(args) => evaluate::evaluate(&args),
        Verb::Predict(args) => predict::predict(&args),
        Verb::Integers(args) => integers::run(&args),
        Verb::Serve(args) => serve::serve(args),
        Verb::Stream(args) => stream::stream(args),
        Verb::Load(args) => load::load(&args),
        Verb::Account(args) => account::account(args),
        Verb::Backup(args) => backup::backup(&args),
        Verb::Restore(args) => backup::restore(&args),
        Verb::Drill(args) => backup::drill(&args),
        #[cfg(feature = "cluster")]
        Verb::Import(args) => import::import(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A closed standard error leaves the exit code to speak.
            let _ = writeln!(std::io::stderr(), "lodestep: {error:#}");
            ExitCode::from(failure::exit_code(&error))
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::{Command, CommandFactory as _};

    use super::*;

    /// What a list of commands says of each.
    fn abouts(command: &Command, path: &str, to: &mut Vec<(String, String)>) {
        for inner in command.get_subcommands() {
            let path = format!("{path} {}", inner.get_name());
            let about = inner.get_about().map(ToString::to_string).unwrap_or_default();
            abouts(inner, &path, to);
            to.push((path, about));
        }
    }

    #[test]
    fn every_command_says_what_it_does() {
        let mut all = Vec::new();
        abouts(&CommandLine::command(), "lodestep", &mut all);
        assert!(all.len() > 30, "{all:?}");
        for (path, about) in all {
            assert!(!about.is_empty() && !about.starts_with("The arguments of"), "{path}: {about:?}");
        }
    }
}
