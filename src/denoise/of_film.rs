//! The film's picture and both of its halves, denoised.

use super::{Denoiser, NoisyPicture, OidnError, SurfaceGuides};
use crate::film::{Film, HalfPixel};
use crate::sampler::Half;
use fechner_perception::Plane;

/// A film's picture without its noise. Linear RGB in cd/m², row-major.
#[derive(Clone, Debug)]
pub struct DenoisedFilm {
    /// The mean of all samples, denoised: the picture.
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// Each half's mean by itself, denoised with the same guides: their difference is the noise that denoising left.
    pub halves_rgb_cd_m2: [Vec<[f32; 3]>; 2],
}

/// Denoises the mean, and each half by itself, guided by what the film knows of the first surfaces.
///
/// # Errors
/// Where the denoiser fails.
pub fn denoise_film(denoiser: &Denoiser, film: &Film, nits_per_unit: f64) -> Result<DenoisedFilm, OidnError> {
    let (width, height) = (film.width() as usize, film.height() as usize);
    let guides = denoiser.prepare(SurfaceGuides {
        width,
        height,
        albedo: film.guides().iter().map(|guide| guide.albedo).collect(),
        normal: film.guides().iter().map(|guide| guide.normal).collect(),
        depth: film.guides().iter().map(|guide| guide.depth).collect(),
        samples: film.total_samples() as f64 / (width * height).max(1) as f64,
    })?;
    let denoised =
        |rgb: &[[f32; 3]], variance: &Plane| denoiser.denoise(&NoisyPicture { rgb, variance, guides: &guides });
    let estimate = film.estimate(nits_per_unit);
    // What two samples of a half say of their scatter is worth little: beside it stands what the halves differ by.
    let variance = estimate.variance_of_mean.combined(&estimate.half_difference, |own, half| 0.5 * (own + half * half));
    let of_half = |half: Half| {
        let pixels = 0..width * height;
        let rgb: Vec<[f32; 3]> =
            pixels.map(|pixel| mean_cd_m2(film.half_or_other(half, pixel), nits_per_unit)).collect();
        denoised(&rgb, &variance.map(|variance| 2.0 * variance))
    };
    Ok(DenoisedFilm {
        rgb_cd_m2: denoised(&estimate.rgb_cd_m2, &variance)?,
        halves_rgb_cd_m2: [of_half(Half::A)?, of_half(Half::B)?],
    })
}

fn mean_cd_m2(pixel: &HalfPixel, nits_per_unit: f64) -> [f32; 3] {
    pixel.mean.map(|value| (value * nits_per_unit) as f32)
}
