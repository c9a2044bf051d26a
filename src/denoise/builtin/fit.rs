//! Weighted fits of planes through a pixel's neighbours, tile by tile, four pixels at once.

use super::likeness::{Likeness, TileWeights};
use super::planes::{PaddedPlane, TILE};
use super::taps::Tap;
use glam::Vec4;
use rayon::prelude::*;

/// Albedo, normal, depth.
pub(super) const FEATURES: usize = 7;
/// Pixels that are fitted at once: a vector register of the baseline.
const LANES: usize = 4;
/// Neighbours of less weight are passed over.
const LEAST_WEIGHT: f32 = 1e-4;
/// Variance of a sample's feature, about: what a fit follows may be the features' own noise, which is this over the samples.
const FEATURE_VARIANCE: f64 = 0.004;
/// What keeps a fit by place level where all neighbours that count lie in one line. Places are in units of the taps' radius.
const PLACE_RIDGE: f32 = 1e-3;

/// A picture, and what is left of its light's variance.
pub(super) struct Fitted {
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) variance: Vec<f32>,
}

/// Each pixel's colour by a plane through its neighbours' features, each the mean of so many samples, and the variance of a mean with
/// the same weights.
pub(super) fn by_features<const PATCH: usize>(
    colours: &[PaddedPlane; 3],
    features: &[PaddedPlane; FEATURES],
    samples: f64,
    likeness: &Likeness<'_, PATCH>,
) -> Fitted {
    let ridge = (FEATURE_VARIANCE / samples.max(1.0)).clamp(1e-6, FEATURE_VARIANCE) as f32;
    let found = by_tiles(likeness, |place, weights| {
        let centers = features.each_ref().map(|plane| four(plane, place));
        let mut equations = Equations::<{ FEATURES + 1 }>::default();
        for (weight, tap) in neighbours(likeness, weights) {
            let at = place.at(tap);
            let terms = |i: usize| if i < FEATURES { four(&features[i], at) - centers[i] } else { Vec4::ONE };
            equations.add(weight, std::array::from_fn(terms), colours.each_ref().map(|plane| four(plane, at)));
        }
        let [red, green, blue] = equations.value_at_center(ridge);
        [red, green, blue, mean_variance(likeness, place, weights)]
    });
    Fitted {
        rgb: found.iter().map(|&[red, green, blue, _]| [red, green, blue]).collect(),
        variance: found.iter().map(|&[_, _, _, variance]| variance).collect(),
    }
}

/// Each pixel's colour by a plane through its neighbours' places: a mean would make steps of what changes slowly.
pub(super) fn by_place<const PATCH: usize>(
    colours: &[PaddedPlane; 3],
    likeness: &Likeness<'_, PATCH>,
) -> Vec<[f32; 3]> {
    let per_radius = 1.0 / likeness.taps.radius() as f32;
    by_tiles(likeness, |place, weights| {
        let mut equations = Equations::<3>::default();
        for (weight, tap) in neighbours(likeness, weights) {
            let [dx, dy] = [tap.dx, tap.dy].map(|step| Vec4::splat(step as f32 * per_radius));
            equations.add(weight, [dx, dy, Vec4::ONE], colours.each_ref().map(|plane| four(plane, place.at(tap))));
        }
        equations.value_at_center(PLACE_RIDGE)
    })
}

/// Where the first of four pixels is.
#[derive(Clone, Copy)]
struct Place {
    y: isize,
    x: isize,
}

impl Place {
    fn at(self, tap: Tap) -> Self {
        Self { y: self.y + tap.dy, x: self.x + tap.dx }
    }
}

/// Where four pixels' weights are in a tile's.
#[derive(Clone, Copy)]
struct InTile<'a> {
    weights: &'a [TileWeights],
    row: usize,
    column: usize,
}

/// Runs `of(place, weights)` over groups of four pixels, `N` values for each.
fn by_tiles<const N: usize, const PATCH: usize>(
    likeness: &Likeness<'_, PATCH>,
    of: impl Fn(Place, InTile<'_>) -> [Vec4; N] + Sync,
) -> Vec<[f32; N]> {
    let (width, height) = likeness.surfaces.size();
    let mut found = vec![[0.0; N]; width * height];
    found.par_chunks_mut(TILE * width).enumerate().for_each_init(Vec::new, |weights, (tile_y, rows)| {
        for x in (0..width).step_by(TILE) {
            likeness.weigh_tile((tile_y * TILE) as isize, x as isize, weights);
            for (row, pixels) in rows.chunks_exact_mut(width).enumerate() {
                for column in (x..width.min(x + TILE)).step_by(LANES) {
                    let place = Place { y: (tile_y * TILE + row) as isize, x: column as isize };
                    let in_tile = InTile { weights, row, column: column - x };
                    let values = of(place, in_tile).map(|value| value.to_array());
                    for (lane, pixel) in pixels[column..].iter_mut().take(LANES).enumerate() {
                        *pixel = std::array::from_fn(|value| values[value][lane]);
                    }
                }
            }
        }
    });
    found
}

/// Four pixels' neighbours that count, and their weights.
#[inline(always)]
fn neighbours<'a, const PATCH: usize>(
    likeness: &'a Likeness<'_, PATCH>,
    in_tile: InTile<'a>,
) -> impl Iterator<Item = (Vec4, Tap)> + 'a {
    let weighed = likeness.taps.all().iter().zip(in_tile.weights);
    weighed.filter_map(move |(&tap, weights)| {
        let weight = Vec4::from_slice(&weights[in_tile.row][in_tile.column..]);
        (weight.max_element() >= LEAST_WEIGHT).then_some((weight, tap))
    })
}

#[inline(always)]
fn four(plane: &PaddedPlane, place: Place) -> Vec4 {
    Vec4::from_array(*plane.row::<LANES>(place.y, place.x))
}

fn mean_variance<const PATCH: usize>(likeness: &Likeness<'_, PATCH>, place: Place, weights: InTile<'_>) -> Vec4 {
    let (mut variance, mut total) = (Vec4::ZERO, Vec4::ZERO);
    for (weight, tap) in neighbours(likeness, weights) {
        total += weight;
        variance += weight * weight * four(&likeness.light.variance, place.at(tap));
    }
    variance / (total * total)
}

/// Normal equations of four pixels' fits, the constant last.
struct Equations<const UNKNOWNS: usize> {
    /// The upper triangle.
    matrix: [[Vec4; UNKNOWNS]; UNKNOWNS],
    right: [[Vec4; 3]; UNKNOWNS],
}

impl<const UNKNOWNS: usize> Default for Equations<UNKNOWNS> {
    fn default() -> Self {
        Self { matrix: [[Vec4::ZERO; _]; _], right: [[Vec4::ZERO; _]; _] }
    }
}

impl<const UNKNOWNS: usize> Equations<UNKNOWNS> {
    /// `terms` are relative to the pixel, so that it is where they are 0; the last is 1.
    #[inline(always)]
    fn add(&mut self, weight: Vec4, terms: [Vec4; UNKNOWNS], colours: [Vec4; 3]) {
        for (i, &term) in terms.iter().enumerate() {
            let weighted = weight * term;
            let row = self.matrix[i].iter_mut().zip(terms).skip(i);
            row.for_each(|(sum, other)| *sum += weighted * other);
            self.right[i].iter_mut().zip(colours).for_each(|(sum, colour)| *sum += weighted * colour);
        }
    }

    /// The constant, by elimination: what the fit says of the pixel itself, not below 0. That one is among its neighbours with full
    /// weight, so the last pivot is 1 at least. `ridge` is added to each other term's square, per weight.
    fn value_at_center(mut self, ridge: f32) -> [Vec4; 3] {
        let last = UNKNOWNS - 1;
        let damping = self.matrix[last][last] * ridge;
        for k in 0..last {
            let per_pivot = (self.matrix[k][k].max(Vec4::ZERO) + damping).recip();
            for i in k + 1..UNKNOWNS {
                let share = self.matrix[k][i] * per_pivot;
                for j in i..UNKNOWNS {
                    let part = share * self.matrix[k][j];
                    self.matrix[i][j] -= part;
                }
                for c in 0..3 {
                    let part = share * self.right[k][c];
                    self.right[i][c] -= part;
                }
            }
        }
        let pivot = self.matrix[last][last].max(Vec4::ONE);
        self.right[last].map(|value| (value / pivot).max(Vec4::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three unknowns, colours of a plane: the constant comes out, also where some neighbours count for little.
    #[test]
    fn a_plane_is_found() {
        let mut equations = Equations::<3>::default();
        for i in 0..25 {
            let (dx, dy) = ((i % 5) as f32 - 2.0, (i / 5) as f32 - 1.0);
            let value = 7.0 + 2.0 * dx - 3.0 * dy;
            let weight = if (dx, dy) == (0.0, 0.0) { 1.0 } else { 1.0 / (1.0 + i as f32) };
            let terms = [Vec4::splat(dx), Vec4::splat(dy), Vec4::ONE];
            equations.add(Vec4::splat(weight), terms, [Vec4::splat(value); 3]);
        }
        let [red, ..] = equations.value_at_center(1e-6);
        assert!((red.x - 7.0).abs() < 1e-3, "{red}");
    }

    /// One pixel alone, whose features say nothing: its own colour.
    #[test]
    fn a_pixel_alone_keeps_its_colour() {
        let mut equations = Equations::<8>::default();
        let mut terms = [Vec4::ZERO; 8];
        terms[7] = Vec4::ONE;
        equations.add(Vec4::ONE, terms, [Vec4::splat(5.0); 3]);
        assert_eq!(equations.value_at_center(1e-6)[0], Vec4::splat(5.0));
    }
}
