//! What the neighbours of a pixel say of its variance: weighted sums over 7×7 pixels of like surface.
//!
//! In planes, [`LANES`] columns at a time, whose sums stay in registers and in the first cache.

use super::PixelEvidence;
use crate::film::{CHANNELS, KnownThings, PixelFeatures};
use fechner_perception::Plane;
use glam::Vec4;
use rayon::prelude::*;
use std::slice::ChunksMut;

/// Pixels to each side that are pooled.
const POOL_RADIUS: usize = 3;
/// Least low-discrepancy factor.
const MIN_FACTOR: f32 = 0.02;
/// Evidence is cut here, so that sums and products of weights stay finite.
const MAX_EVIDENCE: f64 = 1e36;

/// A channel's statistics of every pixel.
pub(super) struct Pooled {
    pub(super) variance: Plane,
    pub(super) factor: Plane,
    pub(super) factor_with_own: Plane,
}

/// The rows of [`Pooled`] that are still to be handed out.
struct PooledRows<'a> {
    variance: ChunksMut<'a, f32>,
    factor: ChunksMut<'a, f32>,
    factor_with_own: ChunksMut<'a, f32>,
}

#[derive(Default)]
struct PooledRow<'a> {
    variance: &'a mut [f32],
    factor: &'a mut [f32],
    factor_with_own: &'a mut [f32],
}

impl Pooled {
    fn new(width: usize, height: usize) -> Self {
        let plane = || Plane::filled(width, height, 0.0);
        Self { variance: plane(), factor: plane(), factor_with_own: plane() }
    }

    /// Of a picture that is not empty.
    fn rows(&mut self) -> PooledRows<'_> {
        let width = self.variance.width();
        PooledRows {
            variance: self.variance.values_mut().chunks_mut(width),
            factor: self.factor.values_mut().chunks_mut(width),
            factor_with_own: self.factor_with_own.values_mut().chunks_mut(width),
        }
    }
}

impl<'a> PooledRows<'a> {
    /// The next row, empty after the last.
    fn next(&mut self) -> PooledRow<'a> {
        PooledRow {
            variance: self.variance.next().unwrap_or_default(),
            factor: self.factor.next().unwrap_or_default(),
            factor_with_own: self.factor_with_own.next().unwrap_or_default(),
        }
    }
}

/// Columns that are pooled at once: a vector register of the baseline. Of two, the sums do not fit the registers.
const LANES: usize = 4;
/// Columns of a [`Tile`].
const TILE: usize = 32;

/// Pools the neighbours of every pixel of a picture that is `width` wide, row-major. Each neighbour weighs the same
/// whatever its count, so that a region's variance is not that of its hardest pixels.
///
/// `surfaces`: of each pixel.
pub(super) fn pooled_by_neighbours(
    evidence: &[[PixelEvidence; CHANNELS]],
    surfaces: &PixelSurfaces<'_>,
    width: usize,
) -> [Pooled; CHANNELS] {
    let height = evidence.len().checked_div(width).unwrap_or(0);
    let mut pooled: [Pooled; CHANNELS] = std::array::from_fn(|_| Pooled::new(width, height));
    if width == 0 {
        return pooled;
    }
    let facts = Facts::of(evidence, surfaces, width);
    let mut rows = pooled.each_mut().map(Pooled::rows);
    let rows: Vec<[PooledRow<'_>; CHANNELS]> = (0..height).map(|_| rows.each_mut().map(PooledRows::next)).collect();
    rows.into_par_iter().zip(evidence.par_chunks(width)).enumerate().for_each(|(y, (mut rows, evidence))| {
        for (chunk, evidence) in evidence.chunks(LANES).enumerate() {
            let column = chunk * LANES;
            let sums = Sums::of(facts.window(y, column / TILE), column % TILE);
            for (lane, own) in evidence.iter().enumerate() {
                sums.write(lane, own, &mut rows, column + lane);
            }
        }
    });
    pooled
}

// Of a pixel's facts.
/// The first of what its surface looks like, in units in which a distance of 1 halves a neighbour's weight.
const LOOKS: usize = 0;
/// Normal, albedo and the logarithm of the depth.
const LOOK_FACTS: usize = 7;
const DEPTH_LOOK: usize = LOOK_FACTS - 1;
/// What a neighbour weighs at the least.
const MIN_WEIGHT: usize = LOOKS + LOOK_FACTS;
/// The first of each channel's three; see [`PixelEvidence`].
const EVIDENCE: usize = MIN_WEIGHT + 1;
const VARIANCE: usize = 0;
const SQUARED_DIFFERENCE: usize = 1;
const EXPECTED_DIFFERENCE: usize = 2;
const FACTS: usize = EVIDENCE + 3 * CHANNELS;

/// How surfaces look that are as unlike as can be: the weight of a neighbour beyond the picture is 0.
const NOWHERE: f32 = 1e20;

/// What pixels see first.
pub(super) struct PixelSurfaces<'a> {
    /// Guide of each pixel.
    pub(super) features: &'a [PixelFeatures],
    /// Small things of which few of these samples tell.
    pub(super) known_things: Option<&'a KnownThings>,
}

/// How a pixel counts as a neighbour.
struct AsNeighbour {
    looks: [f32; LOOK_FACTS],
    least_weight: f32,
}

impl PixelSurfaces<'_> {
    fn as_neighbour(&self, pixel: usize) -> AsNeighbour {
        /// How far: such a pixel weighs nothing beside others, however strong its noise.
        const APART: f32 = 1e10;
        let mut looks = looks(&self.features[pixel]);
        let share = self.known_things.map_or(0.0, |things| things.share(pixel));
        if share == 0.0 {
            // Never 0, so that a lone pixel still learns something.
            return AsNeighbour { looks, least_weight: 0.02 };
        }
        // The noise of the sun's rim is not that of the sky around it. With a thousandth of it pooled in, 144 pixels
        // of sky take 18,626 samples where 16 are enough. Apart along another axis than the depth, where that is all
        // that is left of a number.
        looks[LOOKS] += APART;
        looks[DEPTH_LOOK] += libm::logf(share);
        AsNeighbour { looks, least_weight: 0.0 }
    }
}

/// What a surface looks like. Half weight at: normals 25° apart, albedo 0.1 apart, depth 5 % apart.
fn looks(guide: &PixelFeatures) -> [f32; LOOK_FACTS] {
    let [nx, ny, nz] = guide.normal.map(|part| 2.3 * part);
    let [red, green, blue] = guide.albedo.map(|band| 10.0 * band);
    // Nothing has been hit at depth 0.
    let depth = 20.0 * libm::logf(guide.depth.max(f32::MIN_POSITIVE));
    [nx, ny, nz, red, green, blue, depth]
}

/// The facts of [`TILE`] pixels of a row, and of their neighbours in it, fact by fact. Of a size that the compiler
/// knows: where it did not, half of the instructions of pooling asked whether they might read.
type Tile = [[f32; TILE + 2 * POOL_RADIUS]; FACTS];

/// What is known of each pixel: its first surface, and what it says about variance. Around the picture lies a border,
/// so that every pixel has a whole window of neighbours: these say and weigh nothing.
struct Facts {
    /// Tiles in a row.
    across: usize,
    tiles: Vec<Tile>,
}

impl Facts {
    fn of(evidence: &[[PixelEvidence; CHANNELS]], surfaces: &PixelSurfaces<'_>, width: usize) -> Self {
        let (across, height) = (width.div_ceil(TILE), evidence.len() / width);
        let mut beyond = [[0.0; TILE + 2 * POOL_RADIUS]; FACTS];
        beyond[LOOKS].fill(NOWHERE);
        let mut tiles = vec![beyond; (height + 2 * POOL_RADIUS) * across];
        let rows = tiles.par_chunks_mut(across).skip(POOL_RADIUS);
        rows.zip(evidence.par_chunks(width)).enumerate().for_each(|(y, (tiles, evidence))| {
            for (x, evidence) in evidence.iter().enumerate() {
                let facts = facts_of(&surfaces.as_neighbour(y * width + x), evidence);
                // Near its edge a pixel is a neighbour to the tile beside its own, too.
                let first = x.saturating_sub(TILE + POOL_RADIUS - 1).div_ceil(TILE);
                let last = ((x + POOL_RADIUS) / TILE).min(across - 1);
                for (number, tile) in tiles.iter_mut().enumerate().take(last + 1).skip(first) {
                    let place = x + POOL_RADIUS - number * TILE;
                    tile.iter_mut().zip(facts).for_each(|(row, fact)| row[place] = fact);
                }
            }
        });
        Self { across, tiles }
    }

    /// The tiles of the rows around row `y`.
    fn window(&self, y: usize, tile: usize) -> [&Tile; 2 * POOL_RADIUS + 1] {
        std::array::from_fn(|row| &self.tiles[(y + row) * self.across + tile])
    }
}

fn facts_of(surface: &AsNeighbour, evidence: &[PixelEvidence; CHANNELS]) -> [f32; FACTS] {
    let mut facts = [0.0; FACTS];
    facts[LOOKS..MIN_WEIGHT].copy_from_slice(&surface.looks);
    facts[MIN_WEIGHT] = surface.least_weight;
    for (facts, pixel) in facts[EVIDENCE..].chunks_exact_mut(3).zip(evidence) {
        let bounded = |value: f64| value.min(MAX_EVIDENCE) as f32;
        facts[VARIANCE] = bounded(pixel.variance);
        facts[SQUARED_DIFFERENCE] = bounded(pixel.squared_difference);
        facts[EXPECTED_DIFFERENCE] = bounded(pixel.expected_difference);
    }
    facts
}

/// A fact of [`LANES`] pixels.
#[inline(always)]
fn fact(tile: &Tile, fact: usize, at: usize) -> Vec4 {
    Vec4::from_slice(&tile[fact][at..at + LANES])
}

/// What the first surfaces of some pixels of a row look like.
struct Surfaces([Vec4; LOOK_FACTS]);

impl Surfaces {
    #[inline(always)]
    fn of(tile: &Tile, at: usize) -> Self {
        Self(std::array::from_fn(|look| fact(tile, LOOKS + look, at)))
    }

    /// How alike the surfaces of neighbours are, in [0.02, 1]; 0 beyond the picture.
    #[inline(always)]
    fn likeness(&self, tile: &Tile, at: usize) -> Vec4 {
        let mut unlike = Vec4::ONE;
        for (look, own) in self.0.iter().enumerate() {
            let apart = *own - fact(tile, LOOKS + look, at);
            unlike += apart * apart;
        }
        unlike.recip().max(fact(tile, MIN_WEIGHT, at))
    }
}

/// Weighted sums over the neighbours of some pixels of a row.
#[derive(Default)]
struct Sums {
    weight: Vec4,
    channels: [ChannelSums; CHANNELS],
}

#[derive(Default)]
struct ChannelSums {
    variance: Vec4,
    squared: Vec4,
    expected: Vec4,
    /// The largest expectation of a single neighbour, weighted.
    most_expected: Vec4,
}

impl Sums {
    /// Of the pixels that begin at `column` of the window.
    fn of(window: [&Tile; 2 * POOL_RADIUS + 1], column: usize) -> Self {
        let own = Surfaces::of(window[POOL_RADIUS], column + POOL_RADIUS);
        let mut sums = Self::default();
        for (row, tile) in window.into_iter().enumerate() {
            for shift in 0..=2 * POOL_RADIUS {
                if (row, shift) != (POOL_RADIUS, POOL_RADIUS) {
                    let at = column + shift;
                    sums.add(own.likeness(tile, at), tile, at);
                }
            }
        }
        sums
    }

    #[inline(always)]
    fn add(&mut self, weights: Vec4, tile: &Tile, at: usize) {
        self.weight += weights;
        for (channel, sums) in self.channels.iter_mut().enumerate() {
            let weighted = |what: usize| weights * fact(tile, EVIDENCE + 3 * channel + what, at);
            let expected = weighted(EXPECTED_DIFFERENCE);
            sums.variance += weighted(VARIANCE);
            sums.squared += weighted(SQUARED_DIFFERENCE);
            sums.expected += expected;
            sums.most_expected = sums.most_expected.max(expected);
        }
    }

    fn write(&self, lane: usize, own: &[PixelEvidence; CHANNELS], rows: &mut [PooledRow<'_>; CHANNELS], column: usize) {
        let weight = self.weight[lane];
        for ((sums, own), row) in self.channels.iter().zip(own).zip(rows) {
            // A pixel like none of its neighbours has only itself to go by.
            row.variance[column] = if weight > 0.0 { sums.variance[lane] / weight } else { own.variance as f32 };
            row.factor[column] = sums.factor(lane).max(MIN_FACTOR);
            row.factor_with_own[column] = match f64::from(sums.expected[lane]) + own.expected_difference {
                0.0 => 1.0,
                expected => ((f64::from(sums.squared[lane]) + own.squared_difference) / expected) as f32,
            };
        }
    }
}

impl ChannelSums {
    /// Squared differences over their expectation, drawn towards 1 by one observation as heavy as the heaviest where
    /// that holds a sixth of all or more, by less where none stands out: where a single pixel outweighs the others, its
    /// half difference may be small by luck. Not drawn by the whole of it everywhere: noise of an even wall, which
    /// stratification brings down to a fifth, comes out 1.25 times too strong then.
    fn factor(&self, lane: usize) -> f32 {
        /// Share of the evidence from which on one observation outweighs the others.
        const HEAVY: f32 = 1.0 / 6.0;
        let (most, all) = (self.most_expected[lane], self.expected[lane]);
        let drawn = most * (most / (HEAVY * all)).min(1.0);
        if all > 0.0 { (self.squared[lane] + drawn) / (all + drawn) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::ObjectFlags;
    use crate::sampler::{hash_words, unit_f64_of_hash};

    /// Of three tiles in a row.
    const SIZE: [usize; 2] = [69, 6];

    fn random(pixel: usize, what: u64) -> f64 {
        unit_f64_of_hash(hash_words(pixel as u64, what))
    }

    fn picture() -> (Vec<[PixelEvidence; CHANNELS]>, Vec<PixelFeatures>) {
        let evidence = |pixel: usize| {
            std::array::from_fn(|c| PixelEvidence {
                variance: random(pixel, c as u64),
                squared_difference: random(pixel, 10 + c as u64),
                expected_difference: random(pixel, 20 + c as u64),
            })
        };
        let guide = |pixel: usize| PixelFeatures {
            albedo: std::array::from_fn(|band| (0.3 * random(pixel, 30 + band as u64)) as f32),
            normal: std::array::from_fn(|axis| random(pixel, 40 + axis as u64) as f32),
            depth: 2.0 + 0.2 * random(pixel, 50) as f32,
            object: ObjectFlags::default(),
        };
        let pixels = SIZE[0] * SIZE[1];
        ((0..pixels).map(evidence).collect(), (0..pixels).map(guide).collect())
    }

    fn surfaces(features: &[PixelFeatures]) -> PixelSurfaces<'_> {
        PixelSurfaces { features, known_things: None }
    }

    /// A lamp in the middle of an even sky scatters, which is not the noise of the sky beside it.
    #[test]
    fn what_has_no_lamp_has_not_its_noise() {
        let mut features = picture().1;
        features.fill(PixelFeatures { albedo: [1.0; 3], ..PixelFeatures::default() });
        let lamp = 3 * SIZE[0] + 20;
        let evidence: Vec<[PixelEvidence; CHANNELS]> = (0..features.len())
            .map(|pixel| {
                let variance = if pixel == lamp { 4.8e9 } else { 1.0 };
                [PixelEvidence { variance, squared_difference: 1.0, expected_difference: 1.0 }; CHANNELS]
            })
            .collect();
        let mut lamps = KnownThings::new(features.len());
        lamps.add(lamp, 0.1, 1.0, true);
        let beside = |known_things: Option<&KnownThings>| {
            let surfaces = PixelSurfaces { features: &features, known_things };
            pooled_by_neighbours(&evidence, &surfaces, SIZE[0])[0].variance.values()[lamp + 1]
        };
        let (unknown, known) = (beside(None), beside(Some(&lamps)));
        assert!(unknown > 1e7 && (known - 1.0).abs() < 1e-3, "{unknown}, {known}");
    }

    /// The sums, pixel by pixel as they are defined.
    fn expected(
        pixel: usize,
        channel: usize,
        evidence: &[[PixelEvidence; CHANNELS]],
        features: &[PixelFeatures],
    ) -> [f64; 3] {
        let at = |pixel: usize| [pixel % SIZE[0], pixel / SIZE[0]];
        let neighbours = (0..evidence.len()).filter(|&other| {
            other != pixel && at(other).iter().zip(at(pixel)).all(|(&a, b)| a.abs_diff(b) <= POOL_RADIUS)
        });
        let (mut weights, mut variance, mut squared, mut expected, mut most) = (0.0, 0.0, 0.0, 0.0, 0.0_f64);
        for other in neighbours {
            let (p, q) = (&features[pixel], &features[other]);
            let square =
                |p: [f32; 3], q: [f32; 3]| -> f64 { p.iter().zip(q).map(|(a, b)| f64::from(a - b).powi(2)).sum() };
            let depth = f64::from(p.depth / q.depth).ln();
            let unlike = 5.29 * square(p.normal, q.normal) + 100.0 * square(p.albedo, q.albedo) + 400.0 * depth * depth;
            let weight = (1.0 / (1.0 + unlike)).max(0.02);
            let neighbour = &evidence[other][channel];
            weights += weight;
            variance += weight * neighbour.variance;
            squared += weight * neighbour.squared_difference;
            expected += weight * neighbour.expected_difference;
            most = most.max(weight * neighbour.expected_difference);
        }
        let own = &evidence[pixel][channel];
        let with_own = (squared + own.squared_difference) / (expected + own.expected_difference);
        let drawn = most * (6.0 * most / expected).min(1.0);
        [variance / weights, ((squared + drawn) / (expected + drawn)).max(0.02), with_own]
    }

    /// By rows and in planes comes out what the definition says, at borders too.
    #[test]
    fn rows_pool_what_pixels_would() {
        let (evidence, features) = picture();
        let pooled = pooled_by_neighbours(&evidence, &surfaces(&features), SIZE[0]);
        for (channel, pooled) in pooled.iter().enumerate() {
            let planes = [&pooled.variance, &pooled.factor, &pooled.factor_with_own];
            assert!(planes.iter().all(|plane| plane.values().len() == evidence.len()));
            for pixel in 0..evidence.len() {
                let found = planes.map(|plane| plane.values()[pixel]);
                let expected = expected(pixel, channel, &evidence, &features);
                for (found, expected) in found.into_iter().zip(expected) {
                    let error = (f64::from(found) / expected - 1.0).abs();
                    assert!(error < 1e-5, "pixel {pixel}, channel {channel}: {found} for {expected}");
                }
            }
        }
    }

    /// Of 48 neighbours alike, whose halves differ by a fifth of what independent samples would, nearly a fifth; of one
    /// that outweighs the others, half.
    #[test]
    fn a_factor_is_drawn_towards_one_by_what_outweighs_the_others() {
        let factor = |squared: f32, expected: f32, most: f32| {
            let sums = [squared, expected, most].map(Vec4::splat);
            ChannelSums { variance: Vec4::ONE, squared: sums[0], expected: sums[1], most_expected: sums[2] }.factor(0)
        };
        let alike = factor(0.2 * 48.0, 48.0, 1.0);
        assert!((0.2..0.203).contains(&alike), "{alike}");
        let outweighed = factor(0.01 * 48.0, 1e3, 1e3 - 48.0);
        assert!((0.48..0.5).contains(&outweighed), "{outweighed}");
        assert_eq!(factor(0.0, 0.0, 0.0), 1.0);
    }

    #[test]
    fn a_lone_pixel_goes_by_itself() {
        let (evidence, features) = picture();
        let pooled = pooled_by_neighbours(&evidence[..1], &surfaces(&features[..1]), 1);
        assert_eq!(pooled[1].variance.values(), [evidence[0][1].variance as f32]);
    }
}
