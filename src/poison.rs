//! Opens values behind mutexes, whatever became of the threads that changed them. Not where a half-made change could be
//! seen.

use std::sync::LockResult;

/// What a mutex or a condition gives, whether or not a thread panicked while it held the lock.
pub trait Unpoisoned<T> {
    /// The value as it was left. What is locked here is changed in single steps, so that it is whole wherever
    /// a thread may panic, and that thread has said what went wrong: a second panic would only keep others
    /// from saving what they have.
    fn unpoisoned(self) -> T;
}

impl<T> Unpoisoned<T> for LockResult<T> {
    fn unpoisoned(self) -> T {
        self.unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn a_panic_leaves_the_value_to_others() {
        let value = Mutex::new(1);
        let panicked = std::thread::scope(|scope| {
            scope
                .spawn(|| {
                    *value.lock().unpoisoned() = 2;
                    let _held = value.lock().unpoisoned();
                    std::panic::resume_unwind(Box::new(()));
                })
                .join()
        });
        assert!(panicked.is_err() && value.is_poisoned());
        assert_eq!(*value.lock().unpoisoned(), 2);
    }
}
