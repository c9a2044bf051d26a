//! Puts errors and figures as people read them.

/// What every figure of the perception model has to be read with.
pub(super) const OF_THE_MODEL: &str = "model-predicted; calibrated on gratings, not on renderings";

/// An error and its causes in one line. A cause that its effect's words end with, as those of many libraries do, is not
/// said again; lines of a file that a parser quotes are left out, since its words name line and column.
pub(crate) fn in_a_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain().map(|cause| without_quotes(&cause.to_string())) {
        if !line.ends_with(&cause) {
            line.push_str(if line.is_empty() { "" } else { ": " });
            line.push_str(&cause);
        }
    }
    line
}

/// What is wrong with the arguments, in one line: the message and its hint, without the usage and where to find help.
/// That a file may be called `--name` is no hint for who mistypes an argument.
pub(super) fn in_a_line_of_arguments(error: &clap::Error) -> String {
    let is_of_files = |line: &&str| line.starts_with("tip: to pass '-") && line.contains("as a value, use '-- ");
    let text = error.to_string();
    let lines =
        text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    let words: Vec<&str> = lines.filter(|line| !line.is_empty() && !is_of_files(line)).collect();
    words.join("; ").trim_start_matches("error: ").replacen("; [", " [", 1).replacen(":; ", ": ", 1)
}

/// The lines of a message less those that begin as "3 |" or "|".
fn without_quotes(message: &str) -> String {
    let is_quoted = |line: &str| line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ').starts_with('|');
    let mut words = String::new();
    for line in message.lines().map(str::trim).filter(|line| !line.is_empty() && !is_quoted(line)) {
        words.push_str(if words.is_empty() { "" } else { "; " });
        words.push_str(line);
    }
    words
}

/// "1 frame", "2 frames".
pub(super) fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// "6000 samples", "4.25 million samples".
pub(super) fn samples_in_words(samples: u64) -> String {
    match samples {
        0..100_000 => count(samples as usize, "sample"),
        _ => format!("{:.2} million samples", samples as f64 / 1e6),
    }
}

/// A number with two digits after the point, three of a small number that count, without a tail of zeros; as a power
/// of ten where that is long.
pub(super) fn rounded(value: f64) -> String {
    /// Powers of ten within which digits can be read.
    const READABLE: std::ops::Range<f64> = -9.0..15.0;
    let size = value.abs().log10().floor();
    if size.is_finite() && !READABLE.contains(&size) {
        return format!("{value:e}");
    }
    let digits = if size < 0.0 && size.is_finite() { (2.0 - size).min(12.0) as usize } else { 2 };
    format!("{value:.digits$}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Numbers one after the other, and of many only the first and how many more there are.
pub(super) fn listed<T: std::fmt::Display>(numbers: &[T]) -> String {
    const MOST: usize = 12;
    let first: Vec<String> = numbers.iter().take(MOST).map(T::to_string).collect();
    match numbers.len().saturating_sub(MOST) {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn a_cause_is_said_once_and_quotes_are_not() {
        let error = anyhow!("permission denied").context("cannot write a.png: permission denied").context("-o");
        assert_eq!(in_a_line(&error), "-o: cannot write a.png: permission denied");
        let parsed = anyhow!("TOML parse error at line 1, column 6\n  |\n1 | base=\n  |      ^\nno value\n");
        assert_eq!(in_a_line(&parsed.context("a.toml")), "a.toml: TOML parse error at line 1, column 6; no value");
    }

    #[test]
    fn figures_are_short() {
        assert_eq!((count(1, "frame"), count(0, "frame")), ("1 frame".to_owned(), "0 frames".to_owned()));
        assert_eq!(listed(&[3, 5]), "3, 5");
        assert!(listed(&(0..100).collect::<Vec<u32>>()).ends_with("10, 11 and 88 more"));
        assert_eq!(samples_in_words(6000), "6000 samples");
        assert_eq!(samples_in_words(4_250_000), "4.25 million samples");
        for (value, text) in [
            (94.84294051843514, "94.84"),
            (60.0, "60"),
            (0.2, "0.2"),
            (0.005, "0.005"),
            (0.0, "0"),
            (200.0, "200"),
            (1e300, "1e300"),
            (2.5e-12, "2.5e-12"),
        ] {
            assert_eq!(rounded(value), text);
        }
    }
}
