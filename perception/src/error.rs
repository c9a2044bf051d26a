//! What can be wrong with an input.

use thiserror::Error;

/// Why a question about a picture could not be answered.
///
/// Sizes that do not fit, values outside a model's domain and malformed files end here. The few functions that want
/// planes of one size and give no `Result` say so under "Panics".
#[derive(Debug, Error, Clone, PartialEq)]
pub enum Error {
    /// Two planes of one question have different sizes.
    #[error("{what} is {found_width}×{found_height} pixels, but {width}×{height} are needed")]
    SizeMismatch {
        /// Which input.
        what: &'static str,
        /// Width wanted, pixels.
        width: usize,
        /// Height wanted, pixels.
        height: usize,
        /// Width found, pixels.
        found_width: usize,
        /// Height found, pixels.
        found_height: usize,
    },
    /// The number of values is not width × height.
    #[error("{found} values given for a plane of {width}×{height} pixels")]
    ValueCount {
        /// Width of the plane, pixels.
        width: usize,
        /// Height of the plane, pixels.
        height: usize,
        /// Number of values given.
        found: usize,
    },
    /// A picture without pixels.
    #[error("{what} has no pixels")]
    Empty {
        /// Which input.
        what: &'static str,
    },
    /// A NaN, an infinite or a negative value where a luminance or a variance was asked for.
    #[error("{what} holds {value} at pixel ({x}, {y}); it must be finite and not negative")]
    BadPixel {
        /// Which input.
        what: &'static str,
        /// The value found.
        value: f32,
        /// Column of the pixel.
        x: usize,
        /// Row of the pixel.
        y: usize,
    },
    /// A parameter outside its range.
    #[error("{what} is {}; it must be {expected}", brief(*.value))]
    OutOfRange {
        /// Which parameter.
        what: &'static str,
        /// The value found.
        value: f64,
        /// The range in words, e.g. "between 1 and 1000 pixels per degree".
        expected: &'static str,
    },
    /// A name that nothing answers to.
    #[error("no {kind} is called `{name}`; there are: {known}")]
    UnknownName {
        /// What was looked for, e.g. "display preset".
        kind: &'static str,
        /// The name given.
        name: String,
        /// The names there are, separated by commas.
        known: String,
    },
    /// A file that is not what it should be.
    #[error("{what}{}: {reason}", of_line(*.line))]
    Parse {
        /// Which file or text.
        what: &'static str,
        /// The line that is wrong, from 1, where it is one.
        line: Option<usize>,
        /// What is wrong with it.
        reason: String,
    },
}

impl Error {
    /// The error that nothing of a kind has this name.
    pub(crate) fn unknown_name(kind: &'static str, name: &str, known: &[&str]) -> Self {
        Self::UnknownName { kind, name: name.to_owned(), known: known.join(", ") }
    }
}

/// ", line 3", where it is known.
fn of_line(line: Option<usize>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line}"))
}

/// A number in words, of few digits however large it is.
fn brief(value: f64) -> String {
    if value == 0.0 || (1e-5..1e15).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// `Ok` when `value` lies in `[low, high]`; NaN never does.
pub(crate) fn check_range(
    what: &'static str,
    value: f64,
    low: f64,
    high: f64,
    expected: &'static str,
) -> Result<(), Error> {
    if value >= low && value <= high { Ok(()) } else { Err(Error::OutOfRange { what, value, expected }) }
}
