//! Where a farm's files are, and how units are numbered. What is in the files is left to those who write them.

use super::manifest::{FrameEntry, Manifest, ManifestError, Work};
use crate::animate::name::FrameName;
use crate::json_file;
use crate::output::{OutputError, PictureFormat, write_beside};
use crate::read_file;
use crate::scene::hash::ContentHash;
use std::io::Write as _;
use std::path::{Path, PathBuf};

const CONCLUDED: &str = "concluded";

/// A folder with a manifest.
#[derive(Clone, Debug)]
pub struct Farm {
    folder: PathBuf,
    manifest: Manifest,
    /// Hash of the manifest's file: units of other farms have another.
    id: ContentHash,
}

/// A unit's round, frame and place in the round. Its number says all three for ever:
/// (round × frames + frame's index) × passes + part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitPlace {
    /// Plans traced of the frame before the round.
    pub round: u32,
    /// Index of the frame in the manifest.
    pub frame_index: usize,
    /// Part of the round.
    pub part: u32,
}

impl Farm {
    /// Writes the manifest of a new farm into a folder that exists.
    ///
    /// # Errors
    /// If it cannot be written, as where the name of its directory is not Unicode.
    pub fn create(folder: &Path, manifest: Manifest) -> Result<Self, OutputError> {
        let path = Self::manifest_file(folder);
        let text = json_file::indented(&path, &manifest)?;
        write_beside(&path, |file| file.write_all(&text))?;
        Ok(Self { folder: folder.to_owned(), manifest, id: ContentHash::of_bytes(&text) })
    }

    /// What is left in a folder of a farm whose manifest is gone, if anything is: it would pass for a new farm's work.
    pub fn remains(folder: &Path) -> Option<PathBuf> {
        let is_remains = |name: &str| name.starts_with("frame-") || name == CONCLUDED;
        let mut entries = folder.read_dir().ok()?.flatten();
        entries.find(|entry| entry.file_name().to_str().is_some_and(is_remains)).map(|entry| entry.path())
    }

    /// Opens one.
    ///
    /// # Errors
    /// If there is none that this program can work on.
    pub fn open(folder: &Path) -> Result<Self, ManifestError> {
        let path = Self::manifest_file(folder);
        let text = read_file::bytes(&path).map_err(|error| ManifestError::Io { path: path.clone(), error })?;
        let manifest = Manifest::parse(&path, &text)?;
        Ok(Self { folder: folder.to_owned(), manifest, id: ContentHash::of_bytes(&text) })
    }

    /// The manifest's file.
    pub fn manifest_file(folder: &Path) -> PathBuf {
        folder.join("manifest.json")
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What is rendered.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Hash of the manifest's file.
    pub fn id(&self) -> ContentHash {
        self.id
    }

    /// A frame's entry.
    pub fn frame(&self, frame_index: usize) -> &FrameEntry {
        &self.manifest.frames[frame_index]
    }

    /// Path of the mark that is there once all is made that needs all frames.
    pub fn concluded(&self) -> PathBuf {
        self.folder.join(CONCLUDED)
    }

    /// Finished pictures.
    pub fn pictures(&self) -> PathBuf {
        self.folder.join("pictures")
    }

    /// The name of the pictures of a shot that are of a format.
    pub fn frame_pattern(format: PictureFormat) -> String {
        format!("frame.####.{}", format.ending())
    }

    /// The picture of a finished frame.
    pub fn picture(&self, frame_index: usize) -> PathBuf {
        let (format, number) = (self.manifest.picture_format, self.frame(frame_index).frame);
        let of_shot = || FrameName::parse(&Self::frame_pattern(format)).map(|name| name.of(number));
        let name = match self.manifest.work {
            Work::Render => None,
            Work::Animate => of_shot(),
        };
        self.pictures().join(name.unwrap_or_else(|| PathBuf::from(format!("picture.{}", format.ending()))))
    }

    /// Whether the picture of a finished frame is there, with something in it.
    pub fn has_picture(&self, frame_index: usize) -> bool {
        self.picture(frame_index).metadata().is_ok_and(|file| file.is_file() && file.len() > 0)
    }

    /// A frame's own folder.
    pub fn frame_folder(&self, frame_index: usize) -> PathBuf {
        self.folder.join(format!("frame-{:04}", self.frame(frame_index).frame))
    }

    /// Path of a frame's film: all rounds merged so far, and the open one's plan; missing before the first merge and
    /// after the end.
    pub fn film(&self, frame_index: usize) -> PathBuf {
        self.frame_folder(frame_index).join("film")
    }

    /// The film of a finished frame, where it is kept.
    pub fn finished_film(&self, frame_index: usize) -> PathBuf {
        self.frame_folder(frame_index).join("finished.film")
    }

    /// Figures of a finished frame; where it is, the frame is done.
    pub fn result(&self, frame_index: usize) -> PathBuf {
        self.frame_folder(frame_index).join("result.json")
    }

    /// Locked while a frame is merged.
    pub fn frame_lock(&self, frame_index: usize) -> PathBuf {
        self.frame_folder(frame_index).join("lock")
    }

    /// The folder of a round.
    pub fn round_folder(&self, frame_index: usize, round: u32) -> PathBuf {
        self.frame_folder(frame_index).join(format!("round-{round:03}"))
    }

    /// A unit's file: order, partial, sums or lock.
    pub fn unit_file(&self, unit: u64, ending: &str) -> PathBuf {
        let UnitPlace { round, frame_index, .. } = self.place(unit);
        self.round_folder(frame_index, round).join(format!("unit-{unit:06}.{ending}"))
    }

    /// A unit's number.
    pub fn number(&self, place: UnitPlace) -> u64 {
        let UnitPlace { round, frame_index, part } = place;
        let frame = u64::from(round) * self.manifest.frames.len() as u64 + frame_index as u64;
        frame * u64::from(self.manifest.passes) + u64::from(part)
    }

    /// What a unit's number says.
    pub fn place(&self, unit: u64) -> UnitPlace {
        let (passes, frames) = (u64::from(self.manifest.passes), self.manifest.frames.len() as u64);
        UnitPlace {
            round: u32::try_from(unit / passes / frames).unwrap_or(u32::MAX),
            frame_index: (unit / passes % frames) as usize,
            part: (unit % passes) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checkpoint::{Origin, Tracing};
    use crate::farm::FrameEntry;
    use crate::integrator::TraceSettings;

    #[test]
    fn numbers_and_places_are_one_to_one() {
        let hash = ContentHash::of_bytes(b"");
        let origin = Origin {
            program: String::new(),
            scene_name: String::new(),
            scene: hash,
            width: 1,
            height: 1,
            tracing: Tracing::of(&TraceSettings::new(1, 1, 0)),
        };
        let entry = |frame| FrameEntry { frame, seed: 0, origin: origin.clone(), judged_by: hash };
        let manifest = Manifest {
            passes: 4,
            ..Manifest::new(Work::Animate, PathBuf::new(), Vec::new(), [3, 5, 9].map(entry).to_vec())
        };
        let farm = Farm { folder: PathBuf::from("f"), manifest, id: hash };
        for unit in 0..60 {
            assert_eq!(farm.number(farm.place(unit)), unit);
        }
        assert_eq!(farm.place(29), UnitPlace { round: 2, frame_index: 1, part: 1 });
        assert_eq!(farm.unit_file(29, "sums"), Path::new("f/frame-0005/round-002/unit-000029.sums"));
        farm.place(u64::MAX);
    }

    /// JSON has no words for it: an error, and no panic.
    #[cfg(unix)]
    #[test]
    fn a_directory_that_is_not_unicode_is_refused() {
        use std::os::unix::ffi::OsStrExt as _;
        let folder = tempfile::tempdir().expect("a folder");
        let directory = PathBuf::from(std::ffi::OsStr::from_bytes(b"bad\xff"));
        let refused = Farm::create(folder.path(), Manifest::new(Work::Render, directory, Vec::new(), Vec::new()));
        assert!(refused.expect_err("not Unicode").to_string().contains("manifest.json"));
    }

    #[test]
    fn what_a_farm_left_is_found() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("pictures")).expect("made");
        assert_eq!(Farm::remains(folder.path()), None);
        std::fs::create_dir(folder.path().join("frame-0000")).expect("made");
        assert_eq!(Farm::remains(folder.path()), Some(folder.path().join("frame-0000")));
    }
}
