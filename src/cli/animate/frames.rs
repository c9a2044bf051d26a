//! Numbers of frames and their rate, as the command line has them. Which of them are there already is left to `shot`.

use crate::cli::numbers::parse_positive;

/// Most frames of a shot: eleven hours and a half at 24 a second.
const MAX_FRAMES: u32 = 1_000_000;

/// A range of frames, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frames {
    pub(super) first: u32,
    pub(super) last: u32,
}

impl Frames {
    /// Whether they are few enough.
    pub(super) fn is_a_shot(self) -> bool {
        self.last - self.first < MAX_FRAMES
    }
}

pub(super) fn parse_frames(text: &str) -> Result<Frames, String> {
    let wrong = || format!("\"{text}\" is not a range of frames; expected FIRST..LAST such as 0..47");
    // A number alone is that frame.
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    if [first, last].iter().any(|number| number.trim().starts_with('-')) {
        return Err(format!("\"{text}\": frames are numbered from 0; expected FIRST..LAST such as 0..47"));
    }
    let number = |text: &str| text.trim().trim_start_matches('=').parse::<u32>().map_err(|_| wrong());
    let frames = Frames { first: number(first)?, last: number(last)? };
    if frames.first > frames.last {
        return Err(format!("\"{text}\" ends before it begins; expected FIRST..LAST such as 0..47"));
    }
    if !frames.is_a_shot() {
        return Err(format!("\"{text}\": at most {MAX_FRAMES} frames, both ends included"));
    }
    Ok(frames)
}

pub(in crate::cli) fn parse_rate(text: &str) -> Result<f64, String> {
    parse_rate_from(1.0, text)
}

/// Reads a rate in frames a second, from one in a thousand seconds on: for time lapses that eyes adapt along.
pub(in crate::cli) fn parse_lapse_rate(text: &str) -> Result<f64, String> {
    parse_rate_from(0.001, text)
}

fn parse_rate_from(least: f64, text: &str) -> Result<f64, String> {
    parse_positive(text).and_then(|rate| {
        if (least..=1000.0).contains(&rate) {
            Ok(rate)
        } else {
            Err(format!("\"{text}\": between {least} and 1000 frames a second"))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_range_is_said() {
        assert_eq!(parse_frames("0..999999"), Ok(Frames { first: 0, last: 999_999 }));
        assert_eq!(parse_frames("5"), Ok(Frames { first: 5, last: 5 }));
        for (text, said) in [
            ("0..1000000", "at most 1000000 frames"),
            ("3..1", "ends before"),
            ("3-4", "not a range"),
            ("-3..2", "from 0"),
        ] {
            let error = parse_frames(text).expect_err(text);
            assert!(error.contains(said), "{error}");
        }
    }
}
