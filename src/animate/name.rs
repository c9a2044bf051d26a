//! Names of a sequence's files: `shot.####.exr`, one `#` for each digit of the frame's number at the least.

use std::path::{Path, PathBuf};

/// A file name with a place for the frame's number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameName {
    before: String,
    digits: usize,
    after: String,
}

impl FrameName {
    /// Reads a pattern; `None` unless it has exactly one run of `#`, in the file's name.
    pub fn parse(pattern: &str) -> Option<Self> {
        let start = pattern.find('#')?;
        let (before, rest) = pattern.split_at(start);
        let digits = rest.chars().take_while(|&letter| letter == '#').count();
        let after = &rest[digits..];
        let is_in_folder = after.contains(['#', '/', std::path::MAIN_SEPARATOR]);
        (!is_in_folder).then(|| Self { before: before.to_owned(), digits, after: after.to_owned() })
    }

    /// The file of a frame.
    pub fn of(&self, frame: u32) -> PathBuf {
        PathBuf::from(format!("{}{frame:0digits$}{}", self.before, self.after, digits = self.digits))
    }

    /// A file of the whole sequence: the pattern without its number, with another ending.
    pub fn of_shot(&self, ending: &str) -> PathBuf {
        let before = Path::new(&self.before);
        let stem = before.file_name().map_or("", |name| name.to_str().unwrap_or("")).trim_end_matches(['.', '_', '-']);
        let stem =
            if stem.is_empty() || self.before.ends_with(['/', std::path::MAIN_SEPARATOR]) { "shot" } else { stem };
        let folder = if self.before.ends_with(['/', std::path::MAIN_SEPARATOR]) {
            before
        } else {
            before.parent().unwrap_or(Path::new(""))
        };
        folder.join(format!("{stem}.{ending}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_their_number() {
        let name = FrameName::parse("out/shot.####.exr").expect("a pattern");
        assert_eq!(name.of(7), Path::new("out/shot.0007.exr"));
        assert_eq!(name.of(123_456), Path::new("out/shot.123456.exr"));
        assert_eq!(name.of_shot("json"), Path::new("out/shot.json"));
        assert_eq!(FrameName::parse("##.png").expect("a pattern").of_shot("json"), Path::new("shot.json"));
        assert_eq!(FrameName::parse("out/##.png").expect("a pattern").of_shot("json"), Path::new("out/shot.json"));
        for bad in ["shot.exr", "a#b#.png", "out##/shot.png", ""] {
            assert_eq!(FrameName::parse(bad), None, "{bad}");
        }
    }
}
