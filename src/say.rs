//! Words of the program to whoever started it, which cost nothing where nobody listens any more.
//!
//! `eprintln!` and `println!` panic where the other end is closed: a terminal that hangs up, or
//! `2>&1 | head -1`, would end a render of hours without its picture. [`say!`](crate::say!) and
//! [`answer!`](crate::answer!) take their place everywhere.

use crate::poison::Unpoisoned as _;
use std::fmt::Arguments;
use std::io::{self, Write, stderr, stdout};
use std::sync::{OnceLock, RwLock};

/// Lets words be written where something else stands on the terminal, such as a bar: it is called with what writes.
type MakesWay = Box<dyn Fn(&dyn Fn()) + Send + Sync>;

/// What stands on the terminal while it does.
static STANDING: RwLock<Option<MakesWay>> = RwLock::new(None);

/// Why an answer is not complete.
static FAILURE: OnceLock<io::Error> = OnceLock::new();

/// A line for people, on standard error, as `eprintln!` writes it.
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => { $crate::say::line(format_args!($($words)*)) };
}

/// A line of what was asked for, on standard output, as `println!` writes it.
#[macro_export]
macro_rules! answer {
    ($($words:tt)*) => { $crate::say::answer_line(format_args!($($words)*)) };
}

/// What [`say!`](crate::say!) does: all at once, so that threads do not mix their words.
pub fn line(words: Arguments) {
    part(format_args!("{words}\n"));
}

/// Words without the end of their line, for those that are written over each other.
pub fn part(words: Arguments) {
    let words = words.to_string();
    // Nobody is left to be told that telling failed.
    let write = || drop(stderr().write_all(words.as_bytes()));
    match &*STANDING.read().unpoisoned() {
        Some(makes_way) => makes_way(&write),
        None => write(),
    }
}

/// From here on `makes_way` is asked to let words be written; with `None` they are written at once again.
pub fn beside(makes_way: Option<MakesWay>) {
    *STANDING.write().unpoisoned() = makes_way;
}

/// What [`answer!`](crate::answer!) does.
pub fn answer_line(words: Arguments) {
    answered(writeln!(stdout(), "{words}"));
}

/// Writes out what is left of the answers. To be called at the end of the program.
///
/// # Errors
/// If answers did not reach a standard output that still wanted them, as a file on a full disk.
pub fn finish() -> Result<(), &'static io::Error> {
    answered(stdout().flush());
    FAILURE.get().map_or(Ok(()), Err)
}

/// Notes whether an answer that was written in another way has arrived. A reader that has read enough, as `head`, is
/// content.
pub fn answered(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        // The first one says why.
        let _ = FAILURE.set(error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Other tests may say something meanwhile, too.
    #[test]
    fn what_stands_on_the_terminal_makes_way() {
        let ways = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&ways);
        beside(Some(Box::new(move |write| {
            counted.fetch_add(1, Ordering::Relaxed);
            write();
        })));
        part(format_args!(""));
        assert!(ways.load(Ordering::Relaxed) > 0);
        beside(None);
        assert_eq!(Arc::strong_count(&ways), 1, "what stood there is gone");
    }
}
