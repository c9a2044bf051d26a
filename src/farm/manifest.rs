//! What a farm renders, as all its processes read it. How far it is stands in the folder, never here.

use crate::checkpoint::{Origin, PROGRAM};
use crate::output::PictureFormat;
use crate::scene::hash::ContentHash;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Raised whenever a field means something else.
pub(super) const FORMAT: u32 = 1;

/// What all processes of a farm must agree on; written once, before the first round.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this file.
    pub farm_format: u32,
    /// The [`PROGRAM`] that planned it; no other may work on it.
    pub program: String,
    /// Whose work it is.
    pub work: Work,
    /// Where it was planned: relative names in `arguments` begin here.
    pub directory: PathBuf,
    /// Scene and options of that command.
    pub arguments: Vec<String>,
    /// What finished frames become.
    pub picture_format: PictureFormat,
    /// Most units that a round of a frame is cut into.
    pub passes: u32,
    /// Fewest samples of a unit; a round with fewer is traced by the merge that planned it.
    pub unit_samples: u64,
    /// Whether finished frames keep their films.
    pub keeps_films: bool,
    /// What is rendered, in order.
    pub frames: Vec<FrameEntry>,
}

/// The command that does the same in one process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Work {
    /// `fechner render`: one still.
    Render,
    /// `fechner animate`: frames of a shot.
    Animate,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameEntry {
    /// Number of the frame; 0 for a still.
    pub frame: u32,
    /// Seed of its samples.
    pub seed: u64,
    /// What its samples are samples of: by this a process knows that its scene and assets are those that were planned.
    pub origin: Origin,
    /// Hash of everything by which its film is judged.
    pub judged_by: ContentHash,
}

/// Why a farm's manifest could not be used.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The operating system refused.
    #[error("cannot read {}: {error}; fechner farm plan writes it", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// Not JSON, or not of this form.
    #[error("{}: not a farm's manifest: {error}", .path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        error: serde_json::Error,
    },
    /// Well-formed, and cannot be.
    #[error("{}: {problem}", .path.display())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what would be right.
        problem: String,
    },
}

impl Manifest {
    /// A manifest of this program and format.
    pub fn new(work: Work, directory: PathBuf, arguments: Vec<String>, frames: Vec<FrameEntry>) -> Self {
        Self {
            farm_format: FORMAT,
            program: PROGRAM.to_owned(),
            work,
            directory,
            arguments,
            picture_format: PictureFormat::Exr,
            passes: 1,
            unit_samples: 0,
            keeps_films: false,
            frames,
        }
    }

    /// Reads and checks one; `path` is for messages.
    pub(super) fn parse(path: &Path, text: &[u8]) -> Result<Self, ManifestError> {
        let manifest: Self =
            serde_json::from_slice(text).map_err(|error| ManifestError::Syntax { path: path.to_owned(), error })?;
        match manifest.problem() {
            None => Ok(manifest),
            Some(problem) => Err(ManifestError::Wrong { path: path.to_owned(), problem }),
        }
    }

    fn problem(&self) -> Option<String> {
        let own = PROGRAM;
        let is_ascending = self.frames.windows(2).all(|pair| pair[0].frame < pair[1].frame);
        if self.farm_format != FORMAT {
            Some(format!("its format is version {}, and this program reads version {FORMAT}", self.farm_format))
        } else if self.program != own {
            Some(format!("it was planned by {}, and this is {own}: finish it with that, or plan anew", self.program))
        } else if self.frames.is_empty() || !is_ascending {
            Some("its frames must ascend, and there must be one".to_owned())
        } else if self.frames.iter().any(|entry| entry.origin.pixels().is_none()) {
            Some("a film's width and height make more pixels than can be numbered".to_owned())
        } else if self.passes == 0 {
            Some("passes must be at least 1".to_owned())
        } else {
            None
        }
    }
}
