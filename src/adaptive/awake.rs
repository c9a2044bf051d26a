//! Threads that do not fall asleep between the small pieces of a look.
//!
//! A look at a small picture is a hundred steps of a tenth of a millisecond, each cut in two or more. An idle thread of
//! the pool sleeps after a few microseconds and takes as long to wake as its half of a step takes: the look at 128×128
//! that ends a render takes 4.85 % of the time of tracing with two threads, and 5.18 without this
//! (`benches/results/equal-time.md`). Not for work in large pieces.

use rayon::Yield;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Without work for so long, a thread may sleep: where a look is serial for a while, or waits for a denoiser. It is not
/// what keeps steps within steps from waiting for ever: thieves take the oldest job first, so that whoever is within a
/// step finds nobody left to stand by (the test ends with an hour in its place, too).
const PATIENCE: Duration = Duration::from_micros(500);

/// Runs `work` while the other threads of the pool stand by.
pub(super) fn with_threads_awake<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let others = rayon::current_num_threads() - 1;
    if others == 0 {
        return work();
    }
    let is_done = AtomicBool::new(false);
    rayon::scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| stand_by(&is_done));
        }
        let _done = SetOnDrop(&is_done);
        work()
    })
}

/// Set when `work` returns, and when it panics.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// Does what others leave to do.
fn stand_by(is_done: &AtomicBool) {
    let mut idle_since = Instant::now();
    while !is_done.load(Ordering::Acquire) {
        if rayon::yield_now() == Some(Yield::Executed) {
            idle_since = Instant::now();
        } else if idle_since.elapsed() > PATIENCE {
            break;
        } else {
            std::thread::yield_now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    fn pool(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
    }

    /// Steps within steps, on more threads than there are cores: nobody waits for ever, and the sum is right.
    #[test]
    fn nested_steps_end() {
        for threads in [1, 2, 5] {
            let sum = pool(threads).install(|| {
                with_threads_awake(|| {
                    (0..40_u64)
                        .map(|round| (0..64_u64).into_par_iter().map(|i| nested(i + round)).sum::<u64>())
                        .sum::<u64>()
                })
            });
            let expected: u64 = (0..40).map(|round| (0..64).map(|i| 2 * (i + round)).sum::<u64>()).sum();
            assert_eq!(sum, expected, "{threads} threads");
        }
    }

    fn nested(value: u64) -> u64 {
        let (a, b) = rayon::join(|| with_threads_awake(|| value), || (0..4).into_par_iter().map(|_| value).max());
        a + b.unwrap_or_default()
    }

    #[test]
    fn panics_come_through() {
        let caught =
            pool(2).install(|| std::panic::catch_unwind(|| with_threads_awake(|| -> u8 { panic!("as asked") })));
        assert!(caught.is_err());
    }
}
