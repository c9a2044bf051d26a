//! The program, run as its users run it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program.
pub(crate) fn fechner() -> Command {
    Command::new(env!("CARGO_BIN_EXE_fechner"))
}

/// A scene of the repository.
pub(crate) fn repository_scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

pub(crate) fn cornell_box() -> PathBuf {
    repository_scene("cornell-box.toml")
}

/// What it said on stderr.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs it to a good end.
pub(crate) fn run(command: &mut Command) -> Output {
    let output = command.output().expect("runs");
    assert!(output.status.success(), "{command:?}: {}", said(&output));
    output
}

/// Runs it and expects exit status 2, and one line about it on stderr with all the `fragments`, the last one.
pub(crate) fn assert_refused(command: &mut Command, fragments: &[&str]) {
    let output = command.output().expect("runs");
    let message = said(&output);
    assert_eq!(output.status.code(), Some(2), "{command:?}: {message}");
    let last = message.split_inclusive('\n').next_back().unwrap_or_default();
    for fragment in fragments {
        assert!(last.contains(fragment), "{command:?}: \"{fragment}\" is not in: {message}");
    }
    let errors = message.lines().filter(|line| line.starts_with("fechner:")).count();
    assert!(errors == 1 && last.starts_with("fechner:"), "{command:?}: {message}");
    assert!(!message.contains("panicked"), "{command:?}: {message}");
}
