//! The command `biscale`: `commands` has one file or folder a command, `common` what they share. Here are the command line as a
//! whole and the exit status.

mod commands;
mod common;

use biscale::error::{Error, Result};
use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, ValueEnum};
use commands::Command;
use common::exit;
use common::flags::Flags;
use common::interrupt;
use common::options::CommonArgs;
use common::output::{self, ColourChoice, Failure};
use std::process::ExitCode;

/// What `--version` says: version, commit, features, target and profile. `build.rs` finds out all but the first.
const LONG_VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ncommit ",
    env!("BISCALE_COMMIT"),
    "\nfeatures ",
    env!("BISCALE_FEATURES"),
    "\ntarget ",
    env!("BISCALE_TARGET"),
    "\nprofile ",
    env!("BISCALE_PROFILE")
);

/// Effective BRDFs of bi-scale materials: from a small-scale surface to its look from afar
#[derive(Parser, Debug)]
#[command(name = "biscale", version, long_version = LONG_VERSION, subcommand_required = true, arg_required_else_help = true, max_term_width = 100)]
#[command(after_help = "Exit status: 0 done; 2 bad input or arguments; 130 interrupted; 1 anything else.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: CommonArgs,
}

impl Cli {
    /// The command line, with the flags of the command that it names.
    fn read() -> Result<Self, clap::Error> {
        let mut command = Self::command().color(output::choose_colour(colour_wanted()));
        command.build();
        let matches = command.try_get_matches_from_mut(std::env::args_os())?;
        let mut cli = Self::from_arg_matches(&matches)?;
        // Of a command of commands the flags are those of the innermost one.
        let (mut running, mut of) = (&command, &matches);
        while let Some((name, inner)) = of.subcommand() {
            let Some(found) = running.find_subcommand(name) else { break };
            (running, of) = (found, inner);
            cli.common.flags = Flags::of(running);
        }
        Ok(cli)
    }
}

/// What `--color` says, before the command line as a whole is read: an error in it is coloured, too.
fn colour_wanted() -> ColourChoice {
    let mut arguments = std::env::args().skip(1).take_while(|a| a != "--");
    let mut wanted = ColourChoice::default();
    while let Some(argument) = arguments.next() {
        let value = match argument.strip_prefix("--color") {
            Some("") => arguments.next(),
            Some(rest) => rest.strip_prefix('=').map(str::to_owned),
            None => None,
        };
        wanted = value.and_then(|value| ColourChoice::from_str(&value, false).ok()).unwrap_or(wanted);
    }
    wanted
}

/// What `--json --version` prints.
fn version() -> serde_json::Value {
    let mut lines = LONG_VERSION.lines();
    let mut object = serde_json::Map::new();
    object.insert("name".to_owned(), "biscale".into());
    object.insert("version".to_owned(), lines.next().unwrap_or_default().into());
    for (key, value) in lines.filter_map(|line| line.split_once(' ')) {
        object.insert(key.to_owned(), value.into());
    }
    object.into()
}

fn main() -> ExitCode {
    let json_wanted = std::env::args_os().any(|a| a == "--json");
    let cli = match Cli::read() {
        Ok(cli) => cli,
        Err(e) => {
            if json_wanted && e.use_stderr() {
                // The exit status tells the same, should standard output be closed.
                let _ = output::print_json(&Failure::arguments(&e));
            }
            if json_wanted && e.kind() == ErrorKind::DisplayVersion {
                let _ = output::print_json(&version());
                return ExitCode::SUCCESS;
            }
            let _ = e.print();
            return if e.use_stderr() { ExitCode::from(exit::BAD_INPUT) } else { ExitCode::SUCCESS };
        }
    };
    interrupt::install();
    // A panic is a bug. It has said what it is; the exit status stays one of those documented.
    match std::panic::catch_unwind(|| run(&cli)) {
        Ok(Ok(status)) => ExitCode::from(status),
        Ok(Err(error)) => ExitCode::from(fail(cli.common.flags.in_error(error), cli.common.json)),
        Err(_) => ExitCode::from(exit::FAILED),
    }
}

/// Runs the command. A command that did its work and has bad news all the same returns the exit status.
fn run(cli: &Cli) -> Result<u8> {
    let threads = usize::from(cli.common.threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| Error::Numeric(format!("cannot start {threads} threads: {e}")))?;
    cli.command.run(&cli.common)
}

/// Says what went wrong and returns the exit status.
fn fail(error: Error, json: bool) -> u8 {
    if output::is_broken_pipe(&error) {
        return 0;
    }
    if json {
        // The exit status and standard error tell the same, should standard output be closed.
        let _ = output::print_json(&Failure::new(&error));
    }
    output::say_error(&error.to_string());
    exit::status(&error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::error::BadInput;

    #[test]
    fn a_field_of_every_command_is_printed_as_its_flag() {
        let mut command = Cli::command();
        command.build();
        let mut seen = 0;
        for running in command.get_subcommands().filter(|c| c.get_name() != "help") {
            let flags = Flags::of(running);
            for argument in running.get_arguments().filter(|a| a.get_id() != "help") {
                let Some(long) = argument.get_long() else { continue };
                let field = argument.get_id().as_str();
                let error = BadInput::new("it is wrong", format!("change `{field}`")).at_field(field);
                let told = flags.in_error(error.into()).to_string();
                assert_eq!(told, format!("--{long}: it is wrong; change `--{long}`"), "{}", running.get_name());
                seen += 1;
            }
        }
        assert!(seen > 100, "{seen}");
    }
}
