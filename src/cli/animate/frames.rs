//! Numbers of frames and their rate, as the command line has them.

use crate::cli::seeing::parse_positive;

/// A range of frames, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frames {
    pub(super) first: u32,
    pub(super) last: u32,
}

pub(super) fn parse_frames(text: &str) -> Result<Frames, String> {
    let wrong = || format!("\"{text}\" is not a range of frames; expected FIRST..LAST such as 0..47");
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().trim_start_matches('=').parse::<u32>().map_err(|_| wrong());
    let frames = Frames { first: number(first)?, last: number(last)? };
    if frames.first > frames.last || frames.last - frames.first >= 1_000_000 { Err(wrong()) } else { Ok(frames) }
}

pub(in crate::cli) fn parse_rate(text: &str) -> Result<f64, String> {
    parse_positive(text).and_then(|rate| {
        if (1.0..=1000.0).contains(&rate) {
            Ok(rate)
        } else {
            Err(format!("\"{text}\": between 1 and 1000 frames a second"))
        }
    })
}
