//! The `motorcade` program.

mod ablate;
mod arguments;
mod batch;
mod calibrate;
mod checkpoint;
mod demo;
mod draw;
mod drive;
mod evaluate;
mod evaluation;
mod exit;
mod export;
mod external;
mod files;
mod fingerprint;
mod frameless;
mod graph;
mod growing_tracks;
mod inspect;
mod interruption;
mod live;
mod map;
mod models;
mod printer;
mod probe;
mod progress;
mod run;
mod saved_state;
mod shape;
mod simulate;
mod tables;
mod threads;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use crate::arguments::{Cli, Command};

fn main() -> ExitCode {
    // Logs go to stderr; stdout carries data.
    let filter =
        tracing_subscriber::EnvFilter::try_from_env("MOTORCADE_LOG").unwrap_or_else(|_| "warn".into());
    // Its own errors would be printed with a macro that panics when stderr is full.
    let logs = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    logs.log_internal_errors(false).init();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return exit::usage(&error),
    };
    // Its message is on stderr by then.
    std::panic::catch_unwind(|| answer(cli.command)).unwrap_or(ExitCode::from(exit::BUG))
}

/// Runs a command.
fn answer(command: Command) -> ExitCode {
    let outcome = match command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Batch(arguments) => batch::batch(&arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(&arguments),
        Command::Inspect(arguments) => inspect::inspect(&arguments),
        Command::Ablate(command) => ablate::ablate(&command),
        Command::Demo(arguments) => demo::demo(&arguments),
        Command::Simulate(arguments) => simulate::simulate(&arguments),
        Command::Draw(arguments) => draw::draw(&arguments),
        Command::Export(arguments) => export::export(&arguments),
        Command::Map(command) => map::map(&command),
        Command::Tables(arguments) => tables::tables(&arguments),
        Command::Evaluate(arguments) => evaluate::evaluate(&arguments),
        Command::Shape(command) => shape::shape(&command),
        Command::Graph(command) => graph::graph(&command),
        Command::Models(arguments) => models::models(&arguments),
        Command::ProbeModels(arguments) => probe::probe(&arguments),
        Command::Config(arguments) => run::print_configuration(&arguments),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "motorcade", &mut script);
            let script = String::from_utf8_lossy(&script);
            exit::print(script.trim_end()).map(|()| exit::FINE).map_err(Into::into)
        }
    };
    exit::report(outcome)
}
