//! Listens to signals that ask a command to end. What is kept then is left to the command.

use anyhow::{Context, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A signal this much later than the first ends at once. Earlier ones are its copies: `timeout` sends SIGTERM to the
/// program and to its group, Slurm to all processes of a job, and so does the script that it started.
const PATIENCE: Duration = Duration::from_secs(3);

/// Listens to signals from here on: SIGINT, SIGTERM and SIGHUP set the flag that it returns and call `asked`, once; one
/// that comes seconds later ends the program.
pub(super) fn listen(asked: impl Fn() + Send + 'static) -> Result<Arc<AtomicBool>> {
    let leave = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&leave);
    let mut first = None;
    ctrlc::set_handler(move || {
        if !flag.swap(true, Ordering::Relaxed) {
            asked();
        }
        if first.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            std::process::exit(130);
        }
    })
    .context("signals cannot be waited for")?;
    Ok(leave)
}

/// Makes writes outlive limits: from here on a write beyond the size that the system allows a file (`ulimit -f`) is an
/// error, as on a full disk, in place of the program's end.
pub(super) fn outlive_file_limits() {
    #[cfg(unix)]
    {
        // That the signal is handled is all; where it cannot be, the render may still be lucky.
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)));
    }
}
