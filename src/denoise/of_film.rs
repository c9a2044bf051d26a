//! The film's picture and both of its halves, denoised.
//!
//! Of lamps that are seen, what is far above the rest of the picture is left out and added again afterwards, each
//! half's own to each half: beside light that is a hundred times as strong a denoiser draws halos.

use super::{Denoiser, NoisyPicture, OidnError, SurfaceGuides};
use crate::film::{Estimate, Film, HalfPixel, Halves, PixelFeatures};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::photometry::luminance;
use glam::Vec3;

/// A film's picture without its noise. Linear RGB in cd/m², row-major.
#[derive(Clone, Debug)]
pub struct DenoisedFilm {
    /// The mean of all samples, denoised: the picture.
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// The halves' means, each by itself, denoised with what its own samples have met: their difference is the noise
    /// that denoising left, and that which guides brought in.
    pub halves_rgb_cd_m2: [Vec<[f32; 3]>; 2],
    /// What shines by itself above this luminance, cd/m², was left as it was sampled.
    pub lamps_from_cd_m2: f32,
}

/// Denoises the mean, and each half by itself, guided by what the film knows of the first surfaces.
///
/// # Errors
/// Where the denoiser fails.
pub fn denoise_film(denoiser: &Denoiser, film: &Film, nits_per_unit: f64) -> Result<DenoisedFilm, OidnError> {
    let (width, height) = (film.width() as usize, film.height() as usize);
    let estimate = film.estimate(nits_per_unit);
    let most = most_of_lamps(film.features(), &estimate.rgb_cd_m2);
    let denoised = |rgb: &[[f32; 3]], variance: &Plane, guides: SurfaceGuides| {
        let guides = denoiser.prepare(guides)?;
        let of_lamp = |(guide, &rgb): (&PixelFeatures, &[f32; 3])| {
            if guide.object.shines() { excess(rgb.into(), most) } else { Vec3::ZERO }
        };
        let lamps: Vec<Vec3> = film.features().iter().zip(rgb).map(of_lamp).collect();
        let rest: Vec<[f32; 3]> = rgb.iter().zip(&lamps).map(|(&rgb, &lamp)| (Vec3::from(rgb) - lamp).into()).collect();
        let mut denoised = denoiser.denoise(&NoisyPicture { rgb: &rest, variance, guides: &guides })?;
        denoised.iter_mut().zip(lamps).for_each(|(rgb, lamp)| *rgb = (Vec3::from(*rgb) + lamp).into());
        leave_the_void_dark(film, &mut denoised);
        Ok::<_, OidnError>(denoised)
    };
    let variance = told_variance(film, &estimate);
    let of_half = |half: Half| {
        let pixels = 0..width * height;
        let rgb: Vec<[f32; 3]> =
            pixels.map(|pixel| mean_cd_m2(film.halves(pixel).half_or_other(half), nits_per_unit)).collect();
        let guides = surface_guides(film, 0.5, |pixel| film.features_of_half(half, pixel));
        denoised(&rgb, &variance.map(|variance| 2.0 * variance), guides)
    };
    let rgb_cd_m2 =
        denoised(&estimate.rgb_cd_m2, &variance, surface_guides(film, 1.0, |pixel| film.features()[pixel]))?;
    // Without both halves each is the picture.
    let halves_rgb_cd_m2 = match film.has_both_halves() {
        true => [of_half(Half::A)?, of_half(Half::B)?],
        false => [rgb_cd_m2.clone(), rgb_cd_m2.clone()],
    };
    Ok(DenoisedFilm { rgb_cd_m2, halves_rgb_cd_m2, lamps_from_cd_m2: most })
}

/// Variance of a lone sample over its squared light, which nothing tells: enough to be taken for what is around it.
const VARIANCE_OF_A_LONE_SAMPLE: f32 = 0.125;

/// What the denoiser is told of the variance of the picture, (cd/m²)².
fn told_variance(film: &Film, estimate: &Estimate) -> Plane {
    let [own, half_difference, luminance] =
        [&estimate.variance_of_mean, &estimate.half_difference, &estimate.luminance_cd_m2].map(Plane::values);
    film.plane(|pixel| {
        let own = own[pixel];
        match film.halves(pixel) {
            // What two samples of a half say of their scatter is worth little: beside it stands what the halves differ
            // by.
            Halves::Both(_) => 0.5 * (own + half_difference[pixel].powi(2)),
            Halves::Only(only) if only.samples > 1 => own,
            Halves::Only(_) => VARIANCE_OF_A_LONE_SAMPLE * luminance[pixel].powi(2),
        }
    })
}

/// What this share of the samples have met.
fn surface_guides(film: &Film, share: f64, at: impl Fn(usize) -> PixelFeatures) -> SurfaceGuides {
    let guides: Vec<PixelFeatures> = (0..film.features().len()).map(at).collect();
    let samples_of_picture = film.total_samples() as f64 / guides.len().max(1) as f64;
    SurfaceGuides {
        width: film.width() as usize,
        height: film.height() as usize,
        albedo: guides.iter().map(|guide| guide.albedo).collect(),
        normal: guides.iter().map(|guide| guide.normal).collect(),
        depth: guides.iter().map(|guide| guide.depth).collect(),
        shines: guides.iter().map(|guide| guide.object.shines()).collect(),
        samples: share * samples_of_picture,
        samples_of_picture,
    }
}

/// Takes away what a denoiser spread into pixels that hold nothing. Behind them may stand another picture, to which it
/// would be added.
pub fn leave_the_void_dark(film: &Film, rgb: &mut [[f32; 3]]) {
    let void = rgb.iter_mut().enumerate().filter(|(pixel, _)| film.is_void(*pixel));
    void.for_each(|(_, rgb)| *rgb = [0.0; 3]);
}

/// What is seen to shine by itself is shown to the denoiser no brighter than so many times what the rest of the picture
/// is on average: mostly above display white, so that edges are still smoothed where they are seen. 5 and 20 are as
/// good (`benches/results/denoising.md`).
const TIMES_THE_REST: f32 = 10.0;

/// The most luminance that the denoiser is shown of what shines by itself, cd/m².
fn most_of_lamps(guides: &[PixelFeatures], rgb_cd_m2: &[[f32; 3]]) -> f32 {
    let rest = || guides.iter().zip(rgb_cd_m2).filter(|(guide, _)| !guide.object.shines());
    let sum: f64 = rest().map(|(_, &rgb)| f64::from(luminance(rgb))).sum();
    match rest().count() {
        0 => f32::INFINITY,
        count => TIMES_THE_REST * (sum / count as f64) as f32,
    }
}

/// What light has above a luminance, of the same colour.
fn excess(light: Vec3, most: f32) -> Vec3 {
    let luminance = luminance(light.to_array());
    if luminance > most { light * (1.0 - most / luminance) } else { Vec3::ZERO }
}

fn mean_cd_m2(pixel: &HalfPixel, nits_per_unit: f64) -> [f32; 3] {
    pixel.mean.map(|value| (value * nits_per_unit) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::DenoiserKind;
    use crate::film::{BlockSum, film_of_samples};
    use crate::integrator::{BlockWork, FirstHit, PathSample};
    use crate::sampler::{hash_words, unit_of_hash};

    /// A denoiser; `None`, with a message, where it is not installed and nobody says that it is.
    fn installed(kind: DenoiserKind) -> Option<Denoiser> {
        let is_required = std::env::var_os("FECHNER_REQUIRE_OIDN").is_some();
        match Denoiser::open(kind) {
            Ok(denoiser) => Some(denoiser),
            Err(error) if is_required => panic!("{error}"),
            Err(error) => {
                eprintln!("{kind:?} is skipped: {error}");
                None
            }
        }
    }

    const SIDE: u32 = 48;

    /// A film of so many samples in each half of every pixel.
    fn film_of(samples: u32, sample: impl FnMut(u32, Half, u32) -> PathSample) -> Film {
        film_of_samples([SIDE; 2], [samples; 2], sample)
    }

    /// A sample that met a wall.
    fn of_wall(albedo: Vec3, radiance: Vec3) -> PathSample {
        PathSample { radiance, first_hit: FirstHit { albedo, ..FirstHit::WALL }, rays: 1 }
    }

    /// A wall of radiance 1 with noise, and before it a lamp two pixels wide that is 10000 times as bright, whose
    /// edges cover pixels by half.
    fn wall_and_lamp() -> Film {
        let mut drawn = 0;
        let mut random = || {
            drawn += 1;
            unit_of_hash(hash_words(drawn, 3))
        };
        film_of(4, |pixel, _, _| {
            let coverage = if (23..25).contains(&(pixel % SIDE)) { 0.5 } else { 0.0 };
            let emitted = Vec3::splat(if random() < coverage { 1e4 } else { 0.0 });
            let mut sample = of_wall(Vec3::ONE, emitted + Vec3::splat(2.0 * random()));
            sample.first_hit.shines = emitted != Vec3::ZERO;
            sample
        })
    }

    /// A noisy wall that ends at the middle column: right of it camera rays meet nothing.
    fn wall_before_nothing() -> Film {
        film_of(4, |pixel, half, index| {
            if pixel % SIDE < SIDE / 2 {
                let light = unit_of_hash(hash_words(u64::from(16 * pixel + 4 * half.index() as u32 + index), 5));
                of_wall(Vec3::ONE, Vec3::splat(2.0 * light))
            } else {
                PathSample { radiance: Vec3::ZERO, first_hit: FirstHit::NOTHING, rays: 1 }
            }
        })
    }

    /// Light by which a black and white pattern, finer than pixels, is seen: all noise is in what is met first, and
    /// guides carry it into the picture. Regression: guides that both halves shared hid it from their difference,
    /// which was 0.08 of the error.
    #[test]
    fn noise_of_the_guides_is_in_the_halves_difference() {
        let film = film_of(8, |pixel, half, index| {
            let word = hash_words(u64::from(32 * pixel + 16 * half.index() as u32 + index), 7);
            let albedo = Vec3::splat(if word >> 63 == 0 { 0.9 } else { 0.1 });
            of_wall(albedo, albedo)
        });
        for kind in [DenoiserKind::Builtin, DenoiserKind::Oidn] {
            let Some(denoiser) = installed(kind) else { continue };
            let DenoisedFilm { rgb_cd_m2, halves_rgb_cd_m2: [a, b], .. } =
                denoise_film(&denoiser, &film, 1.0).expect("denoises");
            let rms = |error: &dyn Fn(usize) -> f32| {
                let squares = (0..rgb_cd_m2.len()).map(|pixel| f64::from(error(pixel)).powi(2));
                (squares.sum::<f64>() / rgb_cd_m2.len() as f64).sqrt()
            };
            let (error, told) = (rms(&|i| rgb_cd_m2[i][1] - 0.5), rms(&|i| 0.5 * (a[i][1] - b[i][1])));
            assert!((0.8..1.6).contains(&(told / error)), "{kind:?}: {told}, not {error}");
        }
    }

    /// In a render of one sample no pixel tells its scatter, and all the same they are taken for what is around them.
    #[test]
    fn lone_samples_are_denoised() {
        let mut film = Film::new(SIDE, SIDE);
        for pixel in 0..SIDE * SIDE {
            let mut sum = BlockSum::default();
            sum.add(&of_wall(Vec3::ONE, Vec3::splat(2.0 * unit_of_hash(hash_words(u64::from(pixel), 9)))));
            film.merge_block(BlockWork::whole(pixel, Half::A, 0), &sum);
        }
        let scatter = |rgb: &[[f32; 3]]| rgb.iter().map(|rgb| (rgb[1] - 1.0).powi(2)).sum::<f32>() / rgb.len() as f32;
        let denoised = denoise_film(&Denoiser::Builtin, &film, 1.0).expect("denoises").rgb_cd_m2;
        let left = scatter(&denoised) / scatter(&film.estimate(1.0).rgb_cd_m2);
        assert!(left < 0.1, "{left} of the variance is left");
    }

    /// Nothing is made of nothing.
    #[test]
    fn black_stays_black() {
        let film = film_of(8, |_, _, _| of_wall(Vec3::ONE, Vec3::ZERO));
        for kind in [DenoiserKind::Builtin, DenoiserKind::Oidn] {
            let Some(denoiser) = installed(kind) else { continue };
            let denoised = denoise_film(&denoiser, &film, 1.0).expect("denoises");
            assert!(denoised.rgb_cd_m2.iter().flatten().all(|&value| value == 0.0), "{kind:?}");
        }
    }

    /// Light of what stands before nothing stays on it, or it would be added to what a compositor puts behind.
    #[test]
    fn nothing_shines_where_nothing_is() {
        let film = wall_before_nothing();
        let denoised = denoise_film(&Denoiser::Builtin, &film, 1.0).expect("denoises");
        for picture in [&denoised.rgb_cd_m2, &denoised.halves_rgb_cd_m2[0], &denoised.halves_rgb_cd_m2[1]] {
            for (pixel, &rgb) in picture.iter().enumerate() {
                let is_wall = pixel as u32 % SIDE < SIDE / 2;
                assert_eq!(rgb != [0.0; 3], is_wall, "{rgb:?} in pixel {pixel}");
            }
        }
    }

    /// The wall beside the lamp stays a wall, and of the lamp's light nothing is lost. Open Image Denoise where it is
    /// installed.
    #[test]
    fn lamps_have_no_halos() {
        let film = wall_and_lamp();
        for kind in [DenoiserKind::Builtin, DenoiserKind::Oidn] {
            let Some(denoiser) = installed(kind) else { continue };
            let DenoisedFilm { rgb_cd_m2, halves_rgb_cd_m2, .. } =
                denoise_film(&denoiser, &film, 1.0).expect("denoises");
            for picture in [&rgb_cd_m2, &halves_rgb_cd_m2[0], &halves_rgb_cd_m2[1]] {
                let column = |x: u32| (0..SIDE).map(|y| picture[(y * SIDE + x) as usize][1]).sum::<f32>() / SIDE as f32;
                for x in (8..21).chain(27..40) {
                    assert!((0.5..2.0).contains(&column(x)), "{kind:?}: {} in column {x}", column(x));
                }
            }
            let sum = |picture: &[[f32; 3]]| picture.iter().map(|rgb| f64::from(rgb[1])).sum::<f64>();
            let raw = film.estimate(1.0).rgb_cd_m2;
            assert!((sum(&rgb_cd_m2) / sum(&raw) - 1.0).abs() < 0.01, "{kind:?}");
        }
    }
}
