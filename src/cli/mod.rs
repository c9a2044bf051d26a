//! The command line: one module for each subcommand, and what several of them share.

mod animate;
mod bench;
mod channels;
mod claim;
mod compare;
mod console;
mod denoise;
mod farm;
mod finished;
mod importance;
mod info;
mod job;
mod keeper;
mod kept_tone;
mod maps;
mod merge;
mod numbers;
mod picture;
mod render;
mod report;
mod seeing;
mod signals;
mod staging;
mod system_memory;
mod targets;
mod tev;
mod threads;
mod threshold;
mod tonemap;
mod view;
mod words;

use anyhow::bail;
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

pub(crate) use words::in_a_line;

/// A path tracer that stops sampling where the eye stops seeing.
#[derive(Debug, Parser)]
#[command(version, about, max_term_width = 100)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene until nothing more can be seen, or until a limit. Exits with 75 where a signal stopped it
    /// early: --resume goes on from its --checkpoint.
    Render(Box<render::RenderArguments>),
    /// Show a render in a browser while it is made: layers, live exposure and camera, stop, save.
    View(Box<view::ViewArguments>),
    /// Render the frames of a scene that moves, each until nothing more can be seen of its noise in motion.
    Animate(Box<animate::AnimateArguments>),
    /// Measure what adaptive sampling saves against uniform sampling and other renderers' rules.
    Bench(bench::BenchArguments),
    /// Say whether one picture can be told from another by eye: exit status 0 same, 1 visible, 2 error.
    Compare(compare::CompareArguments),
    /// Show HDR pictures as a display and an eye would have them: tone operators, eyes that adapt over time.
    Tonemap(tonemap::TonemapArguments),
    /// Map how much noise may stay in a picture of any renderer before it is seen.
    Threshold(threshold::ThresholdArguments),
    /// Add up renders of different seeds that were kept by --checkpoint, or make a picture of a single one.
    Merge(merge::MergeArguments),
    /// Render by many processes and machines that share a folder, to the bytes of one process.
    Farm(Box<farm::FarmArguments>),
    /// Say what is in a picture's or film's file.
    Info {
        /// EXR, PNG, HDR or JPEG file, or a film kept by render --checkpoint.
        file: PathBuf,
    },
}

/// A signal ended it, or it has to wait: to be called again (`EX_TEMPFAIL` of sysexits.h).
const CALL_AGAIN: u8 = 75;

/// The arguments; one line about those that make no sense. Help and version are printed, and end the program.
fn parsed() -> anyhow::Result<ControlFlow<ExitCode, CommandLine>> {
    match CommandLine::try_parse() {
        Ok(arguments) => Ok(ControlFlow::Continue(arguments)),
        Err(help)
            if matches!(
                help.kind(),
                ErrorKind::DisplayHelp
                    | ErrorKind::DisplayVersion
                    | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
            ) =>
        {
            fechner::say::answered(help.print());
            Ok(ControlFlow::Break(ExitCode::from(help.exit_code() as u8)))
        }
        Err(error) => bail!(words::in_a_line_of_arguments(&error)),
    }
}

/// Runs what the arguments ask for. Exit status 0: done; 1: `compare` sees a difference; 2: bad input or a failed
/// write; 75: a render or a farm's work was stopped by a signal, or has to wait, and should be called again.
pub(crate) fn run() -> anyhow::Result<ExitCode> {
    signals::outlive_file_limits();
    let arguments = match parsed()? {
        ControlFlow::Continue(arguments) => arguments,
        ControlFlow::Break(code) => return Ok(code),
    };
    match arguments.command {
        Command::Render(arguments) => return render::run(&arguments),
        Command::View(arguments) => view::run(&arguments)?,
        Command::Animate(arguments) => animate::run(&arguments)?,
        Command::Bench(arguments) => bench::run(&arguments)?,
        Command::Compare(arguments) => return compare::run(&arguments),
        Command::Tonemap(arguments) => tonemap::run(&arguments)?,
        Command::Threshold(arguments) => threshold::run(&arguments)?,
        Command::Merge(arguments) => merge::run(&arguments)?,
        Command::Farm(arguments) => return farm::run(&arguments),
        Command::Info { file } => info::run(&file)?,
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// What values are called that are no numbers.
    const NO_NUMBERS: [&str; 17] = [
        "A",
        "ARM,…",
        "BY",
        "DIR",
        "FILE",
        "FILE.csv",
        "FILE.exr",
        "FILE.json",
        "FILE.png",
        "HOST:PORT",
        "IP",
        "LAYER=FILE.png",
        "LIST",
        "MAP",
        "NAME",
        "NAME|FILE",
        "NAME|all",
    ];

    fn is_number(argument: &clap::Arg) -> bool {
        let names = argument.get_value_names().unwrap_or_default();
        let is_word = names.first().is_some_and(|name| NO_NUMBERS.contains(&name.as_str()));
        argument.get_action().takes_values() && argument.get_possible_values().is_empty() && !is_word
    }

    /// Calls `visit` with each command that has no others, and the words that lead to it.
    fn walk(command: &clap::Command, words: &[String], visit: &mut impl FnMut(&clap::Command, &[String])) {
        let words = [words, &[command.get_name().to_owned()]].concat();
        if command.get_subcommands().next().is_none() {
            visit(command, &words);
        }
        command.get_subcommands().for_each(|sub| walk(sub, &words, visit));
    }

    /// A number below 0 is told what would be right, and is not taken for the name of an option.
    #[test]
    fn options_that_take_numbers_read_negative_ones() {
        let mut wrong = Vec::new();
        let mut count = 0;
        walk(&CommandLine::command(), &[], &mut |command, words| {
            for argument in command.get_arguments().filter(|argument| is_number(argument)) {
                let Some(long) = argument.get_long() else { continue };
                let option = format!("--{long}");
                let value = if argument.is_allow_hyphen_values_set() { "-1,0x-2" } else { "-1" };
                let error = CommandLine::try_parse_from(words.iter().chain([&option, &value.to_owned()]));
                count += 1;
                if error.is_err_and(|error| error.kind() == ErrorKind::UnknownArgument) {
                    wrong.push(format!("{} {option}", words.join(" ")));
                }
            }
        });
        assert!(wrong.is_empty(), "without allow_negative_numbers: {wrong:?}");
        assert!(count > 70, "{count} options take numbers");
    }
}
