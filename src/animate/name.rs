//! Names of a sequence's files: `shot.####.exr`, one `#` for each digit of the frame's number at the least. Which
//! frames there are is left to the caller.

use crate::output::folder_of;
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
        let name = name_start(pattern);
        let start = name + pattern[name..].find('#')?;
        let (before, rest) = pattern.split_at(start);
        let digits = rest.chars().take_while(|&letter| letter == '#').count();
        let after = &rest[digits..];
        let is_one_run = !after.contains('#');
        is_one_run.then(|| Self { before: before.to_owned(), digits, after: after.to_owned() })
    }

    /// The file of a frame.
    pub fn of(&self, frame: impl Into<i64>) -> PathBuf {
        let frame = frame.into();
        let (sign, number) = (if frame < 0 { "-" } else { "" }, frame.unsigned_abs().to_string());
        // Not by a width of a format, which ends at 65,535 in a panic.
        let zeros = "0".repeat(self.digits.saturating_sub(sign.len() + number.len()));
        PathBuf::from(format!("{}{sign}{zeros}{number}{}", self.before, self.after))
    }

    /// Numbers of the frames whose files are there, ascending.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn numbers(&self) -> std::io::Result<Vec<u32>> {
        let example = self.of(0);
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(folder_of(&example))? {
            let name = entry?.file_name();
            let is_digit = |letter: char| letter.is_ascii_digit();
            // Digits are all that stands between the name's two ends; any of them leads back to the file.
            let text: String = name.to_string_lossy().into_owned();
            let digits = text.strip_prefix(self.split().1).and_then(|rest| rest.strip_suffix(self.after.as_str()));
            let digits = digits.filter(|digits| !digits.is_empty() && digits.chars().all(is_digit));
            let number = digits.and_then(|digits| digits.parse::<u32>().ok());
            numbers.extend(number.filter(|&number| self.of(number).file_name() == Some(name.as_os_str())));
        }
        numbers.sort_unstable();
        Ok(numbers)
    }

    /// A file of the whole sequence: the pattern without its number, with another ending. What stands between number
    /// and ending stays: it may be all that tells the left eye's frames from the right one's.
    pub fn of_shot(&self, ending: &str) -> PathBuf {
        let (folder, start) = self.split();
        let stem = start.trim_end_matches(['.', '_', '-']);
        let stem = if stem.is_empty() { "shot" } else { stem };
        let between = self.after.rfind('.').map_or("", |dot| &self.after[..dot]);
        Path::new(folder).join(format!("{stem}{between}.{ending}"))
    }

    /// The folder, and what file names in it begin with. Not by [`Path`], to which a name that is a dot so far is none.
    fn split(&self) -> (&str, &str) {
        self.before.split_at(name_start(&self.before))
    }
}

/// Where the file's name begins in a path.
fn name_start(path: &str) -> usize {
    path.rfind(['/', std::path::MAIN_SEPARATOR]).map_or(0, |separator| separator + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_their_number() {
        let name = FrameName::parse("out/shot.####.exr").expect("a pattern");
        assert_eq!(name.of(7), Path::new("out/shot.0007.exr"));
        assert_eq!(name.of(-1), Path::new("out/shot.-001.exr"));
        assert_eq!(name.of(123_456), Path::new("out/shot.123456.exr"));
        assert_eq!(name.of_shot("json"), Path::new("out/shot.json"));
        assert_eq!(FrameName::parse("##.png").expect("a pattern").of_shot("json"), Path::new("shot.json"));
        assert_eq!(FrameName::parse("out/##.png").expect("a pattern").of_shot("json"), Path::new("out/shot.json"));
        // A name that begins with a dot is not its folder's.
        assert_eq!(FrameName::parse("out/.####.exr").expect("a pattern").of_shot("json"), Path::new("out/shot.json"));
        assert_eq!(FrameName::parse(".##.exr").expect("a pattern").of_shot("json"), Path::new("shot.json"));
        assert_eq!(FrameName::parse("a#b/shot.##.exr").expect("a pattern").of(7), Path::new("a#b/shot.07.exr"));
        // Two that differ after the number have two tracks.
        for (pattern, expected) in
            [("s.##.left.exr", "s.left.json"), ("s_##_r.exr", "s_r.json"), ("##.a.exr", "shot.a.json")]
        {
            assert_eq!(FrameName::parse(pattern).expect("a pattern").of_shot("json"), Path::new(expected));
        }
        let long = FrameName::parse(&"#".repeat(70_000)).expect("a pattern").of(-7);
        assert_eq!(long.as_os_str().len(), 70_000);
        assert!(long.to_string_lossy().starts_with("-00") && long.to_string_lossy().ends_with("07"));
        for bad in ["shot.exr", "a#b#.png", "out##/shot.png", ""] {
            assert_eq!(FrameName::parse(bad), None, "{bad}");
        }
    }

    #[test]
    fn files_that_are_there_have_numbers() {
        let folder = tempfile::tempdir().expect("a folder");
        for file in ["a.0007.png", "a.0012.png", "a.12345.png", "a.12.png", "a.0001.exr", "b.0002.png", "a.00x1.png"] {
            std::fs::write(folder.path().join(file), "").expect("written");
        }
        let pattern = folder.path().join("a.####.png");
        let name = FrameName::parse(pattern.to_str().expect("a path")).expect("a pattern");
        assert_eq!(name.numbers().expect("readable"), [7, 12, 12345]);
        std::fs::write(folder.path().join(".03.png"), "").expect("written");
        let hidden = FrameName::parse(folder.path().join(".##.png").to_str().expect("a path")).expect("a pattern");
        assert_eq!(hidden.numbers().expect("readable"), [3]);
    }
}
