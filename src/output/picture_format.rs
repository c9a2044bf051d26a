//! Formats of the pictures that are written, by the ending of a file's name. Not of those that are read.

use super::OutputError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A kind of picture file that can be written. In JSON it is called by its ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureFormat {
    /// The picture as the display shows it: 8-bit sRGB, or 16-bit PQ for an HDR display.
    Png,
    /// Linear data, many channels.
    Exr,
}

impl PictureFormat {
    /// The format that a file's name asks for, by its ending, upper or lower case.
    ///
    /// # Errors
    /// For any other ending.
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
        ending
            .and_then(|ending| Self::of_ending(&ending))
            .ok_or_else(|| OutputError::UnknownExtension { path: path.to_owned() })
    }

    /// The format whose files' names end so, in lower case.
    pub fn of_ending(ending: &str) -> Option<Self> {
        [Self::Png, Self::Exr].into_iter().find(|format| format.ending() == ending)
    }

    /// How its files' names end.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of files, commands of viewers and manifests of farms mean the same by the same word.
    #[test]
    fn a_format_has_one_name() {
        for format in [PictureFormat::Png, PictureFormat::Exr] {
            let ending = format.ending();
            assert_eq!(PictureFormat::of(Path::new(&format!("a.b.{}", ending.to_uppercase()))).ok(), Some(format));
            assert_eq!(serde_json::to_string(&format).expect("a word"), format!("\"{ending}\""));
        }
        assert!(PictureFormat::of(Path::new("png")).is_err() && PictureFormat::of(Path::new("a.jpg")).is_err());
    }
}
