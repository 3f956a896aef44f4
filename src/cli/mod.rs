//! The command line: one file a command. Commands only join rooms; what they show comes from the rooms.

#[macro_use]
mod say;

mod check;
mod doc;
mod execute;
mod explain;
mod fmt;
mod front;
mod new;
mod plan;
mod run;
mod test;
mod verdict;

use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};

/// A language, compiler and solvers for woven fabric and parachutes.
#[derive(Parser)]
#[command(name = "ripstop", version, about, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Check scene files: names, units, kinds, values.
    Check(check::Arguments),
    /// Show what would run, in what order, and what is left out and why.
    Plan(plan::Arguments),
    /// Run a scene: every case, with its results in a folder and a table at the end.
    Run(run::Arguments),
    /// Run scenes at their quick sizes and judge their expectations.
    Test(test::Arguments),
    /// Explain the code of a message, such as E0312.
    Explain(explain::Arguments),
    /// Write the reference of kinds, fields, units and materials.
    Doc(doc::Arguments),
    /// Format scene files in place.
    Fmt(fmt::Arguments),
    /// Write a first scene to start from.
    New(new::Arguments),
}

/// How diagnostics are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    #[default]
    Human,
    Json,
}

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Good,
    /// The scene is wrong, an `expect` failed, or a file is not as it should be.
    Failed,
    /// The run was stopped by its watch or by the user.
    Halted,
}

/// Runs the command that the process was started with: exit code 0 for success, 1 for a scene with errors or failed checks,
/// 2 for wrong usage, 3 for a run that was stopped.
pub fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Run(arguments) => run::run(&arguments),
        Command::Test(arguments) => test::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Doc(arguments) => doc::run(&arguments),
        Command::Fmt(arguments) => fmt::run(&arguments),
        Command::New(arguments) => new::run(&arguments),
    };
    match outcome {
        Outcome::Good => ExitCode::SUCCESS,
        Outcome::Failed => ExitCode::from(1),
        Outcome::Halted => ExitCode::from(3),
    }
}
