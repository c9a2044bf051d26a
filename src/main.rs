//! The command line of fechner: one file a subcommand under `cli/`.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(code) => code,
        Err(error) => {
            // One line, whatever the chain of causes.
            eprintln!("fechner: {}", format!("{error:#}").replace('\n', " "));
            ExitCode::from(2)
        }
    }
}
