//! What signals ask of a unit.

use anyhow::{Context, Result};
use fechner::farm::unit::Wish;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A signal this much later than the first ends at once. Earlier ones are its copies: Slurm sends SIGTERM to all processes of
/// a job, and so does the script that it started.
const PATIENCE: Duration = Duration::from_secs(3);

/// Signals that came so far.
pub(super) struct Signals {
    leave: Arc<AtomicBool>,
    keep: Arc<AtomicBool>,
}

impl Signals {
    /// From here on SIGINT, SIGTERM and SIGHUP end with a checkpoint, and one that comes seconds later at once; SIGUSR1 asks for a checkpoint.
    pub(super) fn listen() -> Result<Self> {
        let leave = Arc::new(AtomicBool::new(false));
        let keep = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&leave);
        let mut first = None;
        ctrlc::set_handler(move || {
            asked.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                std::process::exit(130);
            }
        })
        .context("signals cannot be waited for")?;
        #[cfg(unix)]
        signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&keep))
            .context("SIGUSR1 cannot be waited for")?;
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
