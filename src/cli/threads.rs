//! Makes threads of a command's own.

use anyhow::Context;

/// A pool of so many threads, or of as many as the machine has; `name` is what the system shows them by.
pub(super) fn pool(threads: Option<u32>, name: &'static str) -> anyhow::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0) as usize)
        .thread_name(move |i| format!("{name}-{i}"))
        .build()
        .context("the threads could not be started")
}
