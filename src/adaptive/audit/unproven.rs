//! Whether a denoised picture is as wrong as the loop thinks where no witness tells.
//!
//! What a place's own raw noise is too strong to show is inferred from the rest of the picture. Of the tiles where that
//! is so, one in fifty is sampled again, twice as often as it was, and the picture is compared with these samples: the
//! energy of the difference less that of their own noise is the picture's whole squared error, without bias, since no
//! denoiser saw them. Its sum over the tiles, over what was predicted, goes for all that is unproven.
//!
//! A tile is looked at through a window that fades to nothing at its borders, for the eye's filters would see
//! an edge there (Welch 1967).
//!
//! In a shot both are by thresholds of noise that is new in every frame.

use super::{Audit, Energy, FreshSamples, MIN_TILES, STRATUM, Tile, choose_tiles, is_large_enough};
use crate::adaptive::judge::{JudgeError, Judgement};
use crate::adaptive::settings::LoopSettings;
use crate::film::{Film, HalfPixel, Halves};
use crate::integrator::PathTracer;
use fechner_perception::{Plane, seen};
use std::f64::consts::PI;

/// Side of a tile, pixels: what a denoiser leaves are blotches, wider than raw noise.
const TILE: usize = 32;
/// Fresh samples over those that a tile has.
const TIMES: u32 = 2;
/// A tile is a candidate if so much of it is unproven.
const UNPROVEN_SHARE: f64 = 0.5;

/// Audits what is unproven of a denoised picture at a target. `None` for raw pictures, where fewer than six tiles are
/// unproven, and for pictures of fewer than 150 tiles, of which six would cost too much.
///
/// # Errors
/// [`JudgeError::Cancelled`] alone.
pub fn audit_unproven(
    tracer: &PathTracer,
    film: &Film,
    judgement: &Judgement,
    settings: &LoopSettings,
    target: f64,
    round: u32,
) -> Result<Option<Audit>, JudgeError> {
    let (Some(denoised), Some(error)) = (&judgement.denoised, judgement.denoised_error()) else { return Ok(None) };
    let width = film.width() as usize;
    let unproven = error.unproven(target);
    let all = Tile::all(film, TILE);
    let share = |tile: &Tile| {
        tile.pixels(width).map(|pixel| f64::from(unproven.values()[pixel])).sum::<f64>() / (TILE * TILE) as f64
    };
    let candidates: Vec<Tile> = all.iter().copied().filter(|tile| share(tile) >= UNPROVEN_SHARE).collect();
    if candidates.len() < MIN_TILES || !is_large_enough(&all) {
        return Ok(None);
    }
    let tiles = choose_tiles(&candidates, (candidates.len() / STRATUM).max(MIN_TILES), round);
    let pixels: Vec<usize> = tiles.iter().flat_map(|tile| tile.pixels(width)).collect();
    let fresh = FreshSamples::take(tracer, film, &pixels, TIMES, settings, round)?;

    let slope = seen::display_slope(judgement.tone.as_ref(), &settings.viewing.display, &denoised.luminance_cd_m2);
    let expected = denoised.error_as_noise.as_ref().unwrap_or(&denoised.error);
    let nothing = || Plane::filled(width, film.height() as usize, 0.0);
    let (mut difference, mut noise, mut predicted) = (nothing(), nothing(), nothing());
    for (at, (&pixel, halves)) in pixels.iter().zip(&fresh.halves).enumerate() {
        let window = window(at % (TILE * TILE));
        let shown = window * slope.values()[pixel];
        let mean = Mean::of(halves, settings.nits_per_unit);
        difference.values_mut()[pixel] = shown * (denoised.luminance_cd_m2.values()[pixel] - mean.luminance_cd_m2);
        noise.values_mut()[pixel] = shown * mean.noise_cd_m2;
        predicted.values_mut()[pixel] = window * expected.visibility.values()[pixel];
    }
    // Not pooled over the eye's window, which would carry a third of it out of the tile's reach.
    let [difference, noise] =
        [difference, noise].map(|shown| judgement.thresholds.in_bands.measured_error(&shown).amplitude);
    let energies = tiles.iter().map(|tile| {
        // v² is twice the amplitude's square.
        let found = 2.0 * (tile.energy(&difference) - tile.energy(&noise));
        Energy { found, predicted: tile.energy(&predicted) }
    });
    Ok(Some(Audit::of(&energies.collect::<Vec<_>>(), fresh.samples)))
}

/// What fresh samples say of a pixel, in scene units.
struct Mean {
    luminance_cd_m2: f32,
    /// Half the halves' difference: as strong as the mean's own noise; 0 where only one half has samples that are
    /// finite.
    noise_cd_m2: f32,
}

impl Mean {
    fn of(halves: &[HalfPixel; 2], nits_per_unit: f64) -> Self {
        let halves = Halves::of(halves.each_ref());
        let luminance = |half: &HalfPixel| nits_per_unit * half.luminance();
        let (mean, difference) = (halves.mean(luminance), halves.half_difference(luminance));
        Self { luminance_cd_m2: mean as f32, noise_cd_m2: difference as f32 }
    }
}

/// How much the difference at a place of the tile counts: 1 in the middle, nothing at the border.
fn window(place: usize) -> f32 {
    let along = |at: usize| (PI * (at as f64 + 0.5) / TILE as f64).sin();
    (along(place % TILE) * along(place / TILE)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: such a half was taken for black, and the mean for half as light as it is.
    #[test]
    fn a_half_without_finite_samples_has_no_say() {
        let half = |light: f64, samples| HalfPixel { mean: [light; 3], samples, taken: 8, ..HalfPixel::default() };
        let told = |halves: [HalfPixel; 2]| {
            let mean = Mean::of(&halves, 10.0);
            [mean.luminance_cd_m2, mean.noise_cd_m2]
        };
        assert_eq!(told([half(0.0, 0), half(4.0, 8)]), [40.0, 0.0]);
        assert_eq!(told([half(6.0, 8), half(4.0, 8)]), [50.0, 10.0]);
    }
}
