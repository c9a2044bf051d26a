//! Intel's Open Image Denoise as a denoiser that may or may not be there.
//!
//! Found at run time: the default build needs nothing. Not for reading weights or training; the filter is `RT` with its
//! own weights, HDR, guided by albedo and normal.

mod find;
mod frame;
mod library;

use super::{NoisyPicture, SurfaceGuides};
use crate::poison::Unpoisoned as _;
use find::{Environment, candidates};
use frame::Frame;
use library::{Device, Guide, Size};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};

/// Why Open Image Denoise cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum OidnError {
    /// The library is in none of the places.
    #[error(
        "Open Image Denoise (version 2) is not found: set OIDN_DIR to the folder of its release, install the system's \
         package, or `pip install pyoidn` in a Python environment that is active; --denoise builtin needs nothing{}",
        tried(.0)
    )]
    NotFound(Vec<String>),
    /// A file is there and cannot be used.
    #[error("{}: not usable as Open Image Denoise version 2: {problem}", path.display())]
    Library {
        /// The library.
        path: PathBuf,
        /// What the loader says.
        problem: String,
    },
    /// The library reports an error.
    #[error("Open Image Denoise failed: {0}")]
    Failed(String),
}

fn tried(problems: &[String]) -> String {
    problems.iter().map(|problem| format!("\n  tried {problem}")).collect()
}

/// Guides of as many samples are trusted as they are: to denoise them costs half as much again as picture and halves
/// do, and is worth 0.011 JOD where a shutter is open, 0.002 and 0.004 elsewhere (`benches/results/denoising.md`).
const CLEAN_ENOUGH_SAMPLES: f64 = 16.0;

/// The library, opened.
#[derive(Clone)]
pub struct Oidn {
    device: Arc<Mutex<Device>>,
    path: PathBuf,
    version: i32,
}

impl fmt::Debug for Oidn {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Oidn").field("path", &self.path).field("version", &self.version).finish_non_exhaustive()
    }
}

/// The library of this process: opening it takes longer than denoising a small picture.
static OPENED: Mutex<Option<Oidn>> = Mutex::new(None);

impl Oidn {
    /// The library with as many threads as there are cores, opened once for the whole program.
    ///
    /// # Errors
    /// As [`Oidn::open`].
    pub fn opened() -> Result<Self, OidnError> {
        let mut opened = OPENED.lock().unpoisoned();
        if opened.is_none() {
            *opened = Some(Self::open(0)?);
        }
        opened.clone().ok_or_else(|| OidnError::NotFound(Vec::new()))
    }

    /// Opens the first library that can be opened. `threads` of its own, 0 for as many as there are cores.
    ///
    /// # Errors
    /// [`OidnError::NotFound`] with what was tried.
    pub fn open(threads: usize) -> Result<Self, OidnError> {
        let mut problems = Vec::new();
        for path in candidates(&Environment::of_process()) {
            match Self::open_at(&path, threads) {
                Ok(opened) => return Ok(opened),
                Err(error) => problems.push(error.to_string()),
            }
        }
        Err(OidnError::NotFound(problems))
    }

    fn open_at(path: &Path, threads: usize) -> Result<Self, OidnError> {
        let device = Device::open(path, threads)?;
        let version = device.version();
        if version / 10_000 != 2 {
            let problem = format!("it is version {}", in_words(version));
            return Err(OidnError::Library { path: path.to_owned(), problem });
        }
        Ok(Self { device: Arc::new(Mutex::new(device)), path: path.to_owned(), version })
    }

    /// Name and version.
    pub fn name(&self) -> String {
        format!("Open Image Denoise {}", in_words(self.version))
    }

    /// Albedo and normal without the noise of edges, lenses and shutters, as far as that matters: guides that
    /// [`Self::denoise`] may trust.
    pub(super) fn prepare(&self, guides: SurfaceGuides) -> Result<SurfaceGuides, OidnError> {
        if guides.samples_of_picture >= CLEAN_ENOUGH_SAMPLES {
            return Ok(guides);
        }
        let (device, frame) = (self.device(), Frame::around(size_of(&guides)));
        let denoised = |guide, values: &[[f32; 3]]| {
            device.denoise_alone(guide, frame.size(), &frame.put_around(values)).map(|values| frame.cut_off(values))
        };
        let (albedo, normal) = (denoised(Guide::Albedo, &guides.albedo)?, denoised(Guide::Normal, &guides.normal)?);
        Ok(SurfaceGuides { albedo, normal, ..guides })
    }

    /// Denoises a picture of non-negative radiance, any unit.
    pub(super) fn denoise(&self, picture: &NoisyPicture<'_>) -> Result<Vec<[f32; 3]>, OidnError> {
        let guides = picture.guides.get();
        let frame = Frame::around(size_of(guides));
        let [rgb, albedo, normal] =
            [picture.rgb, &guides.albedo, &guides.normal].map(|values| frame.put_around(values));
        Ok(frame.cut_off(self.device().denoise(frame.size(), &rgb, &albedo, &normal)?))
    }

    fn device(&self) -> MutexGuard<'_, Device> {
        // A lock is poisoned by a panic of another thread between two calls; the device is whole.
        self.device.lock().unpoisoned()
    }
}

fn size_of(guides: &SurfaceGuides) -> Size {
    Size { width: guides.width, height: guides.height }
}

fn in_words(version: i32) -> String {
    format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
}
