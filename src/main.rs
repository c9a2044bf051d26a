//! The command line of fechner: one file a subcommand under `cli/`.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("fechner: {}", cli::in_a_line(&error));
            ExitCode::from(2)
        }
    }
}
