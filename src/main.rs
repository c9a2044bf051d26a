//! The command line of fechner: one file a subcommand under `cli/`.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))] // `say!` and `answer!` instead: see fechner::say

/// In reach everywhere, as the macros are whose place they take.
#[macro_use(say, answer)]
extern crate fechner;

mod cli;

use std::process::ExitCode;

/// Bad input or a failed write.
const FAILED: u8 = 2;

fn main() -> ExitCode {
    let code = cli::run().unwrap_or_else(|error| {
        say!("fechner: {}", cli::in_a_line(&error));
        ExitCode::from(FAILED)
    });
    match fechner::say::finish() {
        Ok(()) => code,
        Err(error) => {
            say!("fechner: cannot write to standard output: {error}");
            ExitCode::from(FAILED)
        }
    }
}
