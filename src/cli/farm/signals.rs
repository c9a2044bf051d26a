//! Turns signals into what they ask of a unit.

use crate::cli::signals::listen;
use anyhow::Result;
use fechner::farm::unit::Wish;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Signals that came so far.
pub(super) struct Signals {
    leave: Arc<AtomicBool>,
    keep: Arc<AtomicBool>,
}

impl Signals {
    /// Listens to signals from here on: SIGINT, SIGTERM and SIGHUP end with a checkpoint, and one that comes seconds
    /// later at once; SIGUSR1 asks for a checkpoint.
    pub(super) fn listen() -> Result<Self> {
        let leave = listen(|| {})?;
        let keep = Arc::new(AtomicBool::new(false));
        #[cfg(unix)]
        anyhow::Context::context(
            signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&keep)),
            "SIGUSR1 cannot be waited for",
        )?;
        Ok(Self { leave, keep })
    }

    /// Whether there is no more time.
    pub(super) fn leaves(&self) -> bool {
        self.leave.load(Ordering::Relaxed)
    }

    /// What to do between two batches. A checkpoint is asked for once.
    pub(super) fn wish(&self) -> Wish {
        match (self.leaves(), self.keep.swap(false, Ordering::Relaxed)) {
            (true, _) => Wish::Leave,
            (false, true) => Wish::Keep,
            (false, false) => Wish::GoOn,
        }
    }
}
