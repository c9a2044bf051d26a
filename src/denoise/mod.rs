//! Denoisers of the output picture: our own joint filter, and Intel's where it is installed.
//!
//! The raw mean stays what it is in the film, in checkpoints and in the EXR's `raw` layer: a denoised picture is made
//! from a copy. What may be seen of its error is judged by `fechner_perception::denoised`. Not for animation as such:
//! each frame is denoised by itself.

mod builtin;
mod of_film;
pub mod oidn;

pub use of_film::{DenoisedFilm, denoise_film, leave_the_void_dark};
pub use oidn::{Oidn, OidnError};

use fechner_perception::Plane;
use serde::{Deserialize, Serialize};

/// Which denoiser, as a setting that can be written down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DenoiserKind {
    /// Our own joint filter.
    Builtin,
    /// Open Image Denoise.
    Oidn,
}

impl DenoiserKind {
    /// Name of the denoiser, as `--denoise` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Builtin => "builtin",
            Self::Oidn => "oidn",
        }
    }
}

/// A denoiser, ready.
#[derive(Clone, Debug)]
pub enum Denoiser {
    /// Our own joint filter: always there, equal bytes on any number of threads.
    Builtin,
    /// Open Image Denoise.
    Oidn(Oidn),
}

/// What is known of the first surfaces of a picture, row-major with `width * height` entries each.
#[derive(Clone, Debug)]
pub struct SurfaceGuides {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Albedo of the first surface, 0..1.
    pub albedo: Vec<[f32; 3]>,
    /// Normal of the first surface; 0 where there is none.
    pub normal: Vec<[f32; 3]>,
    /// Distance of the first surface, scene units; what is not there counts as 0 in a film's mean, and is infinitely
    /// far where it is not finite.
    pub depth: Vec<f32>,
    /// Whether something that is seen there shines by itself.
    pub shines: Vec<bool>,
    /// Samples that each is the mean of, on average.
    pub samples: f64,
    /// Samples of the picture that they, or half of it, belong to: halves are denoised as the whole is.
    pub samples_of_picture: f64,
}

/// Guides as a denoiser wants them, made by [`Denoiser::prepare`].
#[derive(Clone, Debug)]
pub struct PreparedGuides {
    guides: SurfaceGuides,
    /// As the built-in denoiser reads them; `None` for the other, and for a picture without pixels.
    builtin: Option<builtin::Prepared>,
}

impl PreparedGuides {
    fn get(&self) -> &SurfaceGuides {
        &self.guides
    }
}

/// A noisy picture and what guides its denoising.
#[derive(Clone, Copy, Debug)]
pub struct NoisyPicture<'a> {
    /// Mean of the samples, linear RGB in cd/m², row-major.
    pub rgb: &'a [[f32; 3]],
    /// Variance of the mean's luminance, (cd/m²)².
    pub variance: &'a Plane,
    /// Guides that the same denoiser has prepared.
    pub guides: &'a PreparedGuides,
}

impl Denoiser {
    /// Makes a denoiser ready.
    ///
    /// # Errors
    /// [`OidnError::NotFound`] where the library is not installed.
    pub fn open(kind: DenoiserKind) -> Result<Self, OidnError> {
        match kind {
            DenoiserKind::Builtin => Ok(Self::Builtin),
            DenoiserKind::Oidn => Oidn::opened().map(Self::Oidn),
        }
    }

    /// Which one it is.
    pub fn kind(&self) -> DenoiserKind {
        match self {
            Self::Builtin => DenoiserKind::Builtin,
            Self::Oidn(_) => DenoiserKind::Oidn,
        }
    }

    /// Name and version.
    pub fn name(&self) -> String {
        match self {
            Self::Builtin => "builtin".to_owned(),
            Self::Oidn(oidn) => oidn.name(),
        }
    }

    /// Makes guides ready, once for all pictures that they guide. Open Image Denoise is told to trust them, and while
    /// they are the mean of few samples gets them denoised, each by itself: worth up to 0.6 JOD
    /// (`benches/results/denoising.md`).
    ///
    /// # Errors
    /// [`OidnError::Failed`] where the library fails.
    pub fn prepare(&self, guides: SurfaceGuides) -> Result<PreparedGuides, OidnError> {
        Ok(match self {
            Self::Builtin => {
                let builtin = (guides.width * guides.height > 0).then(|| builtin::Prepared::of(&guides));
                PreparedGuides { guides, builtin }
            }
            Self::Oidn(oidn) => PreparedGuides { guides: oidn.prepare(guides)?, builtin: None },
        })
    }

    /// The picture without its noise, as far as the denoiser can tell noise from detail; finite and not negative.
    ///
    /// # Errors
    /// [`OidnError::Failed`] where the library fails.
    pub fn denoise(&self, picture: &NoisyPicture<'_>) -> Result<Vec<[f32; 3]>, OidnError> {
        // Of black Open Image Denoise makes up to 4e-5, to which an operator then fits its exposure.
        if picture.rgb.iter().flatten().all(|&value| value == 0.0) {
            return Ok(picture.rgb.to_vec());
        }
        let mut denoised = match self {
            Self::Builtin => match (&picture.guides.builtin, picture.rgb.is_empty()) {
                (_, true) => Vec::new(),
                (Some(prepared), _) => builtin::denoise(picture, prepared),
                // Prepared for the other: dearer, and no other picture.
                (None, _) => builtin::denoise(picture, &builtin::Prepared::of(picture.guides.get())),
            },
            Self::Oidn(oidn) => oidn.denoise(picture)?,
        };
        for value in denoised.iter_mut().flatten() {
            *value = if value.is_finite() { value.max(0.0) } else { 0.0 };
        }
        Ok(denoised)
    }
}
