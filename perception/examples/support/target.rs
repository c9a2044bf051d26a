//! Where an example's picture goes.

use std::path::PathBuf;

/// The first argument, or `name` in the system's folder for temporary files.
pub(crate) fn target(name: &str) -> PathBuf {
    std::env::args().nth(1).map_or_else(|| std::env::temp_dir().join(name), PathBuf::from)
}
