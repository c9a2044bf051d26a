//! What can go wrong while a scene is loaded, told apart by who can mend it. Every message is one line.

use std::fmt;
use std::path::{Path, PathBuf};

/// Why a scene could not be loaded. Its text is one line: file, line where there is one, what is wrong, what would be
/// right.
#[derive(Clone, Debug, thiserror::Error)]
pub enum LoadError {
    /// The operating system did not give us the file.
    #[error("{}: {problem}", file.display())]
    Unreadable {
        /// The file that was asked for.
        file: PathBuf,
        /// What the operating system said.
        problem: String,
    },
    /// The file's contents are wrong: its author or the program that wrote it can mend it.
    #[error("{place}: {problem}")]
    Invalid {
        /// Where.
        place: Place,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// The file may be right, but we do not read such files.
    #[error("{place}: {problem}")]
    Unsupported {
        /// Where.
        place: Place,
        /// What is not read, and what is.
        problem: String,
    },
    /// The file asks for more memory than we are ready to give.
    #[error("{}: {problem}", file.display())]
    TooLarge {
        /// The file that is too large.
        file: PathBuf,
        /// Its size and the limit.
        problem: String,
    },
    /// The caller asked for something that the scene does not have.
    #[error("{problem}")]
    Option {
        /// What was asked for, and what there is.
        problem: String,
    },
    /// A scene that moves is wrong at a time, and not at its beginning.
    #[error("at {} s: {fault}", (seconds * 1e6).round() / 1e6)]
    AtTime {
        /// The time.
        seconds: f64,
        /// What is wrong then; told by this error's own text, so not its source.
        fault: Box<LoadError>,
    },
    /// Another file that this one names is at fault.
    #[error("{place}: {fault}")]
    Referenced {
        /// Where the other file is named.
        place: Place,
        /// What is wrong with it; told by this error's own text, so not its source.
        fault: Box<LoadError>,
    },
}

/// A file and, where known, the line in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: PathBuf,
    /// Line, counted from 1.
    pub line: Option<usize>,
}

impl Place {
    /// A file as a whole.
    pub fn file(file: &Path) -> Self {
        Self { file: file.to_owned(), line: None }
    }

    /// A line of a file, counted from 1.
    pub fn line(file: &Path, line: usize) -> Self {
        Self { file: file.to_owned(), line: Some(line) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(formatter, "{}:{line}", self.file.display()),
            None => write!(formatter, "{}", self.file.display()),
        }
    }
}

impl LoadError {
    /// The file as a whole is wrong.
    pub fn invalid(file: &Path, problem: impl fmt::Display) -> Self {
        Self::Invalid { place: Place::file(file), problem: one_line(problem) }
    }

    /// A line of the file is wrong.
    pub fn invalid_at(place: Place, problem: impl fmt::Display) -> Self {
        Self::Invalid { place, problem: one_line(problem) }
    }

    /// The file is of a kind that is not read.
    pub fn unsupported(file: &Path, problem: impl fmt::Display) -> Self {
        Self::Unsupported { place: Place::file(file), problem: one_line(problem) }
    }

    /// The file asks for too much memory.
    pub fn too_large(file: &Path, problem: impl fmt::Display) -> Self {
        Self::TooLarge { file: file.to_owned(), problem: one_line(problem) }
    }

    /// The file could not be read.
    pub fn unreadable(file: &Path, error: &std::io::Error) -> Self {
        let problem = match error.kind() {
            std::io::ErrorKind::NotFound => "no such file".to_owned(),
            std::io::ErrorKind::PermissionDenied => "no permission to read it".to_owned(),
            _ => one_line(error),
        };
        Self::Unreadable { file: file.to_owned(), problem }
    }

    /// This error, with the place that named the file.
    pub fn referenced_from(self, place: Place) -> Self {
        Self::Referenced { place, fault: Box::new(self) }
    }

    /// Whether the file is not there at all (other than damaged).
    pub fn is_unreadable(&self) -> bool {
        matches!(self, Self::Unreadable { .. })
    }

    /// Whether the file is of a kind that is not read (other than damaged).
    pub fn is_unsupported(&self) -> bool {
        matches!(self, Self::Unsupported { .. })
    }
}

/// Text on one line: what other crates say may hold line breaks, and damaged files may hold control characters.
pub(crate) fn one_line(text: impl fmt::Display) -> String {
    const LONGEST: usize = 400;
    let text = text.to_string();
    let words: Vec<&str> =
        text.split(|c: char| c.is_control() || c.is_whitespace()).filter(|w| !w.is_empty()).collect();
    let mut line = words.join(" ");
    if line.chars().count() > LONGEST {
        line = line.chars().take(LONGEST).chain("...".chars()).collect();
    }
    line
}

/// The candidate nearest to what was written, if near enough to be a slip.
pub(crate) fn nearest<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (edit_distance(written, candidate), candidate))
        .filter(|&(distance, candidate)| distance <= 1 + written.chars().count().max(candidate.chars().count()) / 3)
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

/// `"; did you mean "x"?"`, or else the list of what is known, or nothing when nothing is known.
pub(crate) fn suggestion<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    if let Some(candidate) = nearest(written, candidates.clone()) {
        return format!("; did you mean \"{candidate}\"?");
    }
    let known: Vec<&str> = candidates.into_iter().take(24).collect();
    if known.is_empty() { String::new() } else { format!("; known: {}", known.join(", ")) }
}

/// The message of what is written in place of one of these: `unknown texture "wod"; did you mean "wood"?`.
pub(crate) fn unknown<'a>(kind: &str, written: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    format!("unknown {kind} \"{written}\"{}", suggestion(written, candidates))
}

/// The message of a name that is none of those that the file itself gives, in whatever order they are held:
/// `there is no medium "fgo"; did you mean "fog"?`.
pub(crate) fn no_such<'a>(kind: impl fmt::Display, name: &str, given: impl Iterator<Item = &'a String>) -> String {
    let mut given: Vec<&str> = given.map(String::as_str).collect();
    given.sort_unstable();
    format!("there is no {kind} \"{name}\"{}", suggestion(name, given))
}

/// The names of a table of kinds, as messages list them.
pub(crate) fn names_of<T>(kinds: &[(&str, T)]) -> String {
    kinds.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// Levenshtein's distance with adjacent swaps counted once (the commonest slip of the fingers).
fn edit_distance(a: &str, b: &str) -> usize {
    // Keys are short; what is longer is no slip of a key, and the table below is quadratic.
    const LONGEST: usize = 64;
    let a: Vec<char> = a.chars().take(LONGEST).collect();
    let b: Vec<char> = b.chars().take(LONGEST).collect();
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    rows[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        rows[i][0] = i;
        for j in 1..=b.len() {
            let change = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            rows[i][j] = change.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                rows[i][j] = rows[i][j].min(rows[i - 2][j - 2] + 1);
            }
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_key_that_was_meant() {
        let keys = ["reflectance", "roughness", "emission"];
        assert_eq!(nearest("reflectence", keys), Some("reflectance"));
        assert_eq!(nearest("ruoghness", keys), Some("roughness"));
        assert_eq!(nearest("colour", keys), None);
        assert_eq!(edit_distance("abc", "acb"), 1);
    }

    /// As the program prints it, with all sources.
    #[test]
    fn a_fault_in_another_file_is_told_once() {
        let fault = LoadError::invalid(Path::new("b.ply"), "wrong");
        let error = fault.referenced_from(Place::line(Path::new("a.pbrt"), 5));
        assert_eq!(format!("{:#}", anyhow::Error::from(error)), "a.pbrt:5: b.ply: wrong");
        let path = Path::new("a.film").to_owned();
        let sealed = crate::sealed::SealedError::Io { path, error: std::io::Error::other("gone") };
        assert_eq!(format!("{:#}", anyhow::Error::from(sealed)), "cannot read a.film: gone");
    }

    #[test]
    fn messages_stay_on_one_line() {
        let error = LoadError::invalid(Path::new("a.toml"), "first\nsecond\u{7}");
        assert_eq!(error.to_string(), "a.toml: first second");
    }
}
