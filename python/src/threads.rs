//! Threads that survive a fork.
//!
//! `multiprocessing` forks by default on Linux up to Python 3.13. A child has the memory of rayon's global pool, but
//! not its threads, and would wait for them for ever; it gets a pool of its own.

use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// The process that rayon's global pool works in: the first that asked.
static FIRST_PROCESS: OnceLock<u32> = OnceLock::new();

/// The pool of a forked process, and which one that is: it may fork again.
static FORKED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Runs `task` on threads that this process has.
pub(crate) fn in_this_process<T: Send>(task: impl FnOnce() -> T + Send) -> T {
    let process = process::id();
    if *FIRST_PROCESS.get_or_init(|| process) == process {
        return task();
    }
    match forked_pool(process) {
        Some(pool) => pool.install(task),
        // No thread can be made: rayon then works on the one that asks, if on any.
        None => task(),
    }
}

fn forked_pool(process: u32) -> Option<Arc<ThreadPool>> {
    let mut forked = FORKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, pool)) = forked.as_ref()
        && *of == process
    {
        return Some(Arc::clone(pool));
    }
    let pool = Arc::new(ThreadPoolBuilder::new().build().ok()?);
    // The parent's is forgotten, not dropped: it would wait for threads that are not here.
    std::mem::forget(forked.replace((process, Arc::clone(&pool))));
    Some(pool)
}
