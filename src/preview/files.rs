//! Watches the files of a scene for edits. To load it again is left to `session`.

use super::Host;
use super::command::Command;
use super::shared::Shared;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Between two looks at the files.
const PAUSE: Duration = Duration::from_millis(200);

/// When a file was written, and how long it is; none of one that is not there.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let file = std::fs::metadata(path).ok()?;
    Some((file.modified().ok()?, file.len()))
}

/// A file as it was last seen.
struct Watched {
    stamp: Stamp,
    is_missed: bool,
}

impl Watched {
    /// Whether it is another now. One that is gone is waited for once: between a save's removal and its
    /// renaming there may be none.
    fn has_become(&mut self, now: Stamp) -> bool {
        let is_gone = now.is_none() && self.stamp.is_some();
        let was_missed = std::mem::replace(&mut self.is_missed, is_gone);
        if is_gone && !was_missed {
            return false;
        }
        std::mem::replace(&mut self.stamp, now) != now
    }
}

/// Tells when a file of the scene changes, comes to be or goes.
pub(super) fn watch(host: &dyn Host, shared: &Shared) {
    let mut files: BTreeMap<PathBuf, Watched> = BTreeMap::new();
    while !shared.is_closing() {
        let mut has_changed = false;
        for path in host.watched_files() {
            let now = stamp(&path);
            let watched = files.entry(path).or_insert(Watched { stamp: now, is_missed: false });
            has_changed |= watched.has_become(now);
        }
        if has_changed {
            shared.send(Command::Reload);
        }
        std::thread::sleep(PAUSE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Edits, new files and files that stay away are changes; a file that is back in time, as it was, is none.
    #[test]
    fn files_change_once() {
        let at = |seconds: u64| Some((SystemTime::UNIX_EPOCH + Duration::from_secs(seconds), 7));
        let mut watched = Watched { stamp: None, is_missed: false };
        let seen = [None, at(1), at(1), at(2), None, at(2), None, at(3), None, None, None, at(3)];
        let changes = seen.map(|now| watched.has_become(now));
        let expected = [false, true, false, true, false, false, false, true, false, true, false, true];
        assert_eq!(changes, expected);
    }
}
