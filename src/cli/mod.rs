//! The command line.

mod console;
mod info;
mod render;
mod report;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// A path tracer that stops sampling where the eye stops seeing.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene until nothing more can be seen, or until a limit.
    Render(Box<render::RenderArguments>),
    /// Say what is in a picture file.
    Info {
        /// EXR, PNG or HDR file.
        file: PathBuf,
    },
}

/// Runs what the arguments ask for. Exit status 0: done; 2: bad input or a failed write.
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    match CommandLine::parse().command {
        Command::Render(arguments) => render::run(&arguments)?,
        Command::Info { file } => info::run(&file)?,
    }
    Ok(ExitCode::SUCCESS)
}
