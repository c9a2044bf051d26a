//! What a person sees while a picture is made: a progress bar on a terminal, plain lines elsewhere.

use fechner::adaptive::{Monitor, Progress};
use fechner::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

pub(super) struct Console {
    bar: Option<ProgressBar>,
    time_limit: Option<Duration>,
}

impl Console {
    pub(super) fn new(time_limit: Option<Duration>) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(0);
            let style = ProgressStyle::with_template("{bar:24} {msg}  {elapsed}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style);
            bar.enable_steady_tick(Duration::from_millis(200));
            let stands = bar.clone();
            say::beside(Some(Box::new(move |write| stands.suspend(write))));
            bar
        });
        Self { bar, time_limit }
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            say::beside(None);
        }
    }

    /// Time left in words, from the rate so far.
    fn time_left(&self, progress: &Progress, pixels: f64) -> String {
        let elapsed = progress.seconds;
        let rate = progress.mean_samples * pixels / elapsed.max(1e-3);
        let by_samples = progress.remaining_samples.max(0.0) / rate;
        let by_limit = self.time_limit.map_or(f64::INFINITY, |limit| (limit.as_secs_f64() - elapsed).max(0.0));
        let seconds = by_samples.min(by_limit);
        if seconds.is_finite() { format!("about {} left", duration_in_words(seconds)) } else { String::new() }
    }
}

/// Also of a render that failed: its error would be written above a bar that stays.
impl Drop for Console {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Monitor for Console {
    fn looked(&self, progress: &Progress) {
        let visible = progress.visible_share.map_or_else(
            || "too few samples to tell".to_owned(),
            |share| format!("{:.1} % still visible", 100.0 * share),
        );
        let message = format!(
            "look {}  {:.1} spp  {visible}  {}",
            progress.look,
            progress.mean_samples,
            self.time_left(progress, progress.pixels),
        );
        match &self.bar {
            Some(bar) => {
                let done = (progress.mean_samples * progress.pixels) as u64;
                bar.set_length(done + progress.remaining_samples.min(1e15).max(progress.next_samples as f64) as u64);
                bar.set_position(done);
                bar.set_message(message);
            }
            None => say!("{message}"),
        }
    }

    fn samples_done(&self, samples: u64) {
        if let Some(bar) = &self.bar {
            bar.inc(samples);
        }
    }
}

/// One line that counts decoded textures on a terminal; elsewhere a line at their end, where there are many.
pub(super) fn texture_decoded(done: usize, total: usize) {
    const MANY: usize = 8;
    match (std::io::stderr().is_terminal(), done == total) {
        (true, false) => say::part(format_args!("\rtextures: {done} of {total}\x1b[K")),
        (true, true) => say::part(format_args!("\r\x1b[K")),
        (false, true) if total >= MANY => say!("textures: {total}"),
        (false, _) => {}
    }
}

/// Counts what takes long: on a terminal in one line, elsewhere by a line every ten seconds.
pub(super) struct Counter {
    what: &'static str,
    total: usize,
    on_terminal: bool,
    said: Cell<Instant>,
}

impl Counter {
    const QUIET: Duration = Duration::from_secs(10);

    pub(super) fn new(what: &'static str, total: usize) -> Self {
        Self { what, total, on_terminal: std::io::stderr().is_terminal(), said: Cell::new(Instant::now()) }
    }

    /// Tells that so many are done, if it is time to.
    pub(super) fn count(&self, done: usize) {
        if let Some(words) = self.words(done, Instant::now()) {
            say::part(format_args!("{words}"));
        }
    }

    /// What is to be said of it at a time.
    fn words(&self, done: usize, now: Instant) -> Option<String> {
        let Self { what, total, on_terminal, ref said } = *self;
        match (on_terminal, done == total) {
            (true, false) => Some(format!("\r{what}: {done} of {total}\x1b[K")),
            (true, true) => Some("\r\x1b[K".to_owned()),
            (false, false) if now.duration_since(said.get()) >= Self::QUIET => {
                said.set(now);
                Some(format!("{what}: {done} of {total}\n"))
            }
            (false, _) => None,
        }
    }
}

/// "40 ms", "0.8 s", "42 s", "3 min 20 s", "2 h 5 min".
pub(super) fn duration_in_words(seconds: f64) -> String {
    let (whole_seconds, whole_minutes) = (seconds.round(), (seconds / 60.0).round());
    match seconds {
        s if (5e-4..0.095).contains(&s) => format!("{:.0} ms", s * 1e3),
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min {:.0} s", (whole_seconds / 60.0).floor(), whole_seconds % 60.0),
        _ => format!("{:.0} h {:.0} min", (whole_minutes / 60.0).floor(), whole_minutes % 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_long_is_counted_now_and_then() {
        let counter = Counter { on_terminal: false, ..Counter::new("looking", 4) };
        let began = counter.said.get();
        let said = |done: usize, seconds| counter.words(done, began + Duration::from_secs(seconds));
        let expected = [None, Some("looking: 2 of 4\n".to_owned()), None, None];
        assert_eq!([said(1, 9), said(2, 11), said(3, 20), said(4, 40)], expected);
        let on_terminal = Counter { on_terminal: true, ..counter };
        assert!(on_terminal.words(1, began).is_some_and(|words| words.starts_with("\rlooking: 1 of 4")));
    }

    /// No 60 seconds or minutes beside the next larger unit.
    #[test]
    fn durations_are_rounded_before_they_are_split() {
        let words = [0.0, 0.04, 0.84, 9.97, 42.4, 99.7, 119.7, 200.0, 5999.6, 10_799.0].map(duration_in_words);
        let expected = [
            "0.0 s",
            "40 ms",
            "0.8 s",
            "10 s",
            "42 s",
            "1 min 40 s",
            "2 min 0 s",
            "3 min 20 s",
            "100 min 0 s",
            "3 h 0 min",
        ];
        assert_eq!(words, expected);
    }
}
