//! Whether the stopped picture is as noisy as the loop thinks.
//!
//! On a stratified 2 % of tiles, six at least, as many fresh samples as the tile has are taken and thrown away. What
//! can be seen of the difference between fresh and kept, over what the variance predicts, is the audit's ratio: 1 if
//! the variance is right, above 1 where light was found that the stopping samples had missed. Denoised pictures have an
//! audit of their own ([`audit_unproven`]).

mod unproven;

pub use unproven::audit_unproven;

use super::beginning;
use super::judge::{JudgeError, Judgement, check_cancelled};
use super::plan::blocks_between;
use super::settings::LoopSettings;
use crate::film::{BlockSum, Film, HalfPixel, Halves};
use crate::integrator::{BlockWork, PathTracer, SamplePlan};
use crate::sampler::{Half, hash_words};
use crate::student::t_half_width;
use fechner_perception::{Plane, seen};
use serde::{Deserialize, Serialize};

/// Side of a tile, pixels. The noise of independent pixels, most of whose visible energy lies above 2 cycles a degree,
/// is judged as well in small tiles, and there are more of them.
const TILE: usize = 16;
/// Tiles of which one is audited.
const STRATUM: usize = 50;
/// Fewer tiles' scatter says nothing of how sure the ratio is: two give −2.53 ± 0.24 on `cornell-glass`.
const MIN_TILES: usize = 6;
/// Keeps audits' random numbers apart from the picture's.
const AUDIT_STREAM: u64 = 0x0041_5544_4954;

/// What the variance may be multiplied by in all after audits that disagree.
pub const MAX_INFLATION: f64 = 4.0;

/// What an audit found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Audit {
    /// Tiles that were sampled again.
    pub tiles: usize,
    /// Samples that it took.
    pub samples: u64,
    /// Visible energy of fresh less kept, over what was predicted; 1 where nothing was.
    pub ratio: f64,
    /// Standard error of the ratio, from the scatter between tiles; infinite of a single tile, and where nothing was
    /// predicted.
    pub standard_error: f64,
}

impl Audit {
    /// Whether nothing was predicted to show in its tiles, so that there is nothing to compare fresh samples with. Of
    /// one tile that is not known.
    pub fn had_nothing_to_find(&self) -> bool {
        self.tiles > 1 && self.standard_error.is_infinite()
    }

    /// Whether the variance is too low, at one-sided 95 %, by more than a tenth. By Student's t, since a few
    /// tiles' scatter is surer to be too small than a normal's is: 2.015 standard errors for six tiles, 1.645 for
    /// many. One tile has no scatter.
    pub fn disagrees(&self) -> bool {
        /// Outside of a two-sided interval, half of what is left out lies on each side.
        const TWO_SIDED_LEVEL: f64 = 0.9;
        let is_known = self.tiles > 1;
        is_known && self.ratio - t_half_width(TWO_SIDED_LEVEL, (self.tiles - 1) as f64) * self.standard_error > 1.1
    }
}

/// Whether a picture of these tiles is audited: of fewer than 150, the least number of tiles would cost too much.
fn is_large_enough(all: &[Tile]) -> bool {
    2 * all.len() >= MIN_TILES * STRATUM
}

/// Audits a film. `None` for pictures of fewer than 150 tiles.
///
/// # Errors
/// [`JudgeError::Cancelled`] alone.
pub fn audit(
    tracer: &PathTracer,
    film: &Film,
    judgement: &Judgement,
    settings: &LoopSettings,
    round: u32,
) -> Result<Option<Audit>, JudgeError> {
    let all = Tile::all(film, TILE);
    if !is_large_enough(&all) {
        return Ok(None);
    }
    let tiles = choose_tiles(&all, ((all.len() + STRATUM / 2) / STRATUM).max(MIN_TILES), round);
    let width = film.width() as usize;
    let pixels: Vec<usize> = tiles.iter().flat_map(|tile| tile.pixels(width)).collect();
    let fresh = FreshSamples::take(tracer, film, &pixels, 1, settings, round)?;

    let nits = settings.nits_per_unit;
    let mut difference = Plane::filled(width, film.height() as usize, 0.0);
    let mut variance = Plane::filled(width, film.height() as usize, 0.0);
    for (&pixel, halves) in pixels.iter().zip(&fresh.halves) {
        let kept = film.halves(pixel).mean(HalfPixel::luminance);
        let again = Halves::of(halves.each_ref()).mean(HalfPixel::luminance);
        // Fresh less kept has twice the variance of one of them.
        difference.values_mut()[pixel] = (nits * (again - kept) / std::f64::consts::SQRT_2) as f32;
        let per_sample = f64::from(judgement.met_per_sample.values()[pixel]);
        variance.values_mut()[pixel] = (per_sample * film.variance_share(pixel)) as f32;
    }
    let displayed = seen::display_half_difference(
        judgement.tone.as_ref(),
        &settings.viewing.display,
        &judgement.estimate.luminance_cd_m2,
        &difference,
    );
    let found = judgement.thresholds.in_bands.measured_visibility(&displayed);
    let predicted = judgement.thresholds.in_bands.predicted_visibility(&variance);
    let energy = |tile: &Tile| Energy { found: tile.energy(&found), predicted: tile.energy(&predicted) };
    Ok(Some(Audit::of(&tiles.iter().map(energy).collect::<Vec<_>>(), fresh.samples)))
}

/// A square of pixels.
#[derive(Clone, Copy, Debug)]
struct Tile {
    left: usize,
    top: usize,
    side: usize,
}

impl Tile {
    /// All whole tiles of a film, in reading order.
    fn all(film: &Film, side: usize) -> Vec<Self> {
        let columns = film.width() as usize / side;
        let rows = film.height() as usize / side;
        (0..columns * rows)
            .map(|index| Self { left: index % columns * side, top: index / columns * side, side })
            .collect()
    }

    fn pixels(self, width: usize) -> impl Iterator<Item = usize> {
        let Self { left, top, side } = self;
        (top..top + side).flat_map(move |y| (left..left + side).map(move |x| y * width + x))
    }

    /// Σ v² of the tile and, since the eye's window spreads it, of half a tile around.
    fn energy(self, visibility: &Plane) -> f64 {
        let Self { left, top, side } = self;
        let rows = top.saturating_sub(side / 2)..(top + 3 * side / 2).min(visibility.height());
        let columns = left.saturating_sub(side / 2)..(left + 3 * side / 2).min(visibility.width());
        let squared = |x: usize, y: usize| f64::from(visibility.get(x, y)).powi(2);
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| squared(x, y)).sum()
    }
}

/// One of every stratum of tiles in reading order, chosen by chance.
fn choose_tiles(tiles: &[Tile], strata: usize, round: u32) -> Vec<Tile> {
    let chosen = |stratum: usize| {
        let (start, end) = (stratum * tiles.len() / strata, (stratum + 1) * tiles.len() / strata);
        tiles[start + hash_words(u64::from(round), stratum as u64) as usize % (end - start)]
    };
    (0..strata).map(chosen).collect()
}

/// Samples of some pixels that are in no picture.
struct FreshSamples {
    /// Sums of both halves, of each pixel.
    halves: Vec<[HalfPixel; 2]>,
    /// How many in all.
    samples: u64,
}

impl FreshSamples {
    /// Takes `times` as many as each of the pixels has.
    fn take(
        tracer: &PathTracer,
        film: &Film,
        pixels: &[usize],
        times: u32,
        settings: &LoopSettings,
        round: u32,
    ) -> Result<Self, JudgeError> {
        /// Between two questions whether the audit is still wanted.
        const SAMPLES_PER_PIECE: u64 = 1 << 17;
        let plan = repetition(film, pixels, times);
        let seed = hash_words(tracer.settings().seed, AUDIT_STREAM + u64::from(round));
        let mut halves = vec![[HalfPixel::default(); 2]; pixels.len()];
        // Blocks come in the order of `pixels`.
        let mut place = 0;
        let mut merge = |work: BlockWork, sum: &BlockSum| {
            while pixels[place] != work.pixel as usize {
                place += 1;
            }
            halves[place][work.half.index()].merge(sum);
        };
        let mut left = plan.blocks.as_slice();
        while !left.is_empty() {
            check_cancelled(settings)?;
            let piece = beginning(left, SAMPLES_PER_PIECE);
            tracer.trace_into(&SamplePlan { blocks: piece.to_vec() }, seed, &mut merge, &|_| {});
            left = &left[piece.len()..];
        }
        Ok(Self { halves, samples: plan.samples() })
    }
}

/// A plan of as many samples as these pixels have, `times` over.
fn repetition(film: &Film, pixels: &[usize], times: u32) -> SamplePlan {
    let mut plan = SamplePlan::default();
    for &pixel in pixels {
        for half in Half::BOTH {
            let wanted = film.taken(pixel, half).saturating_mul(times);
            plan.blocks.extend(blocks_between(pixel as u32, half, 0, wanted));
        }
    }
    plan
}

/// Visible energy of a tile.
#[derive(Clone, Copy, Debug)]
struct Energy {
    found: f64,
    predicted: f64,
}

impl Audit {
    /// By the energies of its tiles: Σ found / Σ predicted and the usual ratio estimator's standard error.
    fn of(energies: &[Energy], samples: u64) -> Self {
        let tiles = energies.len();
        let found: f64 = energies.iter().map(|energy| energy.found).sum();
        let predicted: f64 = energies.iter().map(|energy| energy.predicted).sum();
        if predicted <= 0.0 {
            return Self { tiles, samples, ratio: 1.0, standard_error: f64::INFINITY };
        }
        let (n, ratio) = (tiles as f64, found / predicted);
        let scatter: f64 = energies.iter().map(|energy| (energy.found - ratio * energy.predicted).powi(2)).sum();
        let standard_error = if n > 1.0 { (scatter * n / (n - 1.0)).sqrt() / predicted } else { f64::INFINITY };
        Self { tiles, samples, ratio, standard_error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_tiles_are_less_sure() {
        let disagrees = |tiles: usize, ratio: f64| Audit { tiles, samples: 0, ratio, standard_error: 0.5 }.disagrees();
        assert!(disagrees(50, 2.0) && !disagrees(6, 2.0) && !disagrees(1, 2.0) && !disagrees(0, 2.0));
        // 2.015 for five degrees of freedom.
        assert!(disagrees(6, 1.1 + 0.5 * 2.016) && !disagrees(6, 1.1 + 0.5 * 2.014));
    }
}
