//! A system's name on the command line: a subcommand for each that is in the catalogue.

use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::catalogue;

use super::declared;

/// A system by its name, with arguments that are the same for all.
#[derive(Clone, Debug)]
pub(in crate::cli) struct OfSystem<A> {
    pub(super) system: &'static Declaration,
    pub(super) args: A,
}

/// Arguments of a command that a system has or has not.
pub(in crate::cli) trait ForSystems: Args {
    /// Whether a system has the command.
    fn has(system: &Declaration) -> bool;
}

/// The system of this name.
pub(in crate::cli) fn named(name: &str) -> Result<&'static Declaration, String> {
    catalogue::named(name).ok_or_else(|| {
        let known: Vec<&str> = catalogue::SYSTEMS.iter().map(|system| system.name).collect();
        format!("expected one of the systems {}, found {name:?}", known.join(", "))
    })
}

impl<A: ForSystems> FromArgMatches for OfSystem<A> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        let system = catalogue::named(name).ok_or_else(missing)?;
        Ok(OfSystem { system, args: A::from_arg_matches(matches)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = OfSystem::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<A: ForSystems> Subcommand for OfSystem<A> {
    fn augment_subcommands(command: Command) -> Command {
        let systems = catalogue::SYSTEMS.iter().filter(|system| A::has(system));
        systems.fold(
            command.subcommand_value_name("SYSTEM").subcommand_help_heading("Systems"),
            |command, system| {
                let own = Command::new(system.name).about(system.title).after_help(declared::text(system));
                command.subcommand(A::augment_args(own))
            },
        )
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        catalogue::named(name).is_some_and(|system| A::has(system))
    }
}
