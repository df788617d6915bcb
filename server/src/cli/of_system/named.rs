//! A system's name on the command line: a subcommand for each that is in the catalogue.

use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use lodestep_engine::system::Declaration;
use lodestep_engine::systems::catalogue;

use super::declared;
use crate::cli::own::OwnCommand;

/// A system by its name.
#[derive(Clone, Debug)]
pub(in crate::cli) enum OfSystem<A> {
    /// With arguments that are the same for all.
    ByDeclaration { system: &'static Declaration, args: A },
    /// With a command line of its own, and what was found on it.
    Own { command: &'static OwnCommand, matches: ArgMatches },
}

/// Arguments of a command that a system has or has not.
pub(in crate::cli) trait ForSystems: Args {
    /// The systems whose command is their own.
    const OWN: &'static [OwnCommand];
    /// Whether a system has the command.
    fn has(system: &Declaration) -> bool;
}

/// The command of this name among those that are a system's own.
fn own<A: ForSystems>(name: &str) -> Option<&'static OwnCommand> {
    A::OWN.iter().find(|command| command.name == name)
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
        if let Some(command) = own::<A>(name) {
            return Ok(OfSystem::Own { command, matches: matches.clone() });
        }
        let system = catalogue::named(name).ok_or_else(missing)?;
        Ok(OfSystem::ByDeclaration { system, args: A::from_arg_matches(matches)? })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = OfSystem::from_arg_matches(matches)?;
        Ok(())
    }
}

impl<A: ForSystems> Subcommand for OfSystem<A> {
    fn augment_subcommands(command: Command) -> Command {
        let command = command.subcommand_value_name("SYSTEM").subcommand_help_heading("Systems");
        let declared =
            catalogue::SYSTEMS.iter().filter(|system| A::has(system) && own::<A>(system.name).is_none());
        let command = declared.fold(command, |command, system| {
            // The line of help after the arguments: these bring one of their own.
            let of_system = A::augment_args(Command::new(system.name));
            command.subcommand(of_system.about(system.title).after_help(declared::text(system)))
        });
        A::OWN.iter().fold(command, |command, own| command.subcommand((own.command)().name(own.name)))
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        own::<A>(name).is_some() || catalogue::named(name).is_some_and(|system| A::has(system))
    }
}
