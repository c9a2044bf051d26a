//! Writing what a command found as JSON. Nothing here reads any.

use anyhow::Context as _;
use fechner::output;
use serde::Serialize;
use std::io::Write as _;
use std::path::Path;

/// Writes a value, indented, to a file that appears whole or not at all.
///
/// # Errors
///
/// Where the file cannot be written.
pub(super) fn write_json(path: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    let text = serde_json::to_string_pretty(value)
        .with_context(|| format!("{}: its content could not be put into words", path.display()))?;
    output::write_beside(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}
