//! Weighted fits of planes through a pixel's neighbours, tile by tile, eight pixels at once.
//!
//! Loops, not closures: what a tile's work calls must be inlined to be compiled for wide vectors (see
//! [`with_vectors`]).

use super::lanes::{LANES, Lanes};
use super::likeness::{Likeness, Scratch, TileWeights};
use super::planes::{PaddedPlane, TILE};
use super::taps::Tap;
use crate::geometry::{VectorWork, with_vectors};
use rayon::prelude::*;

/// Albedo, normal, depth.
pub(super) const FEATURES: usize = 7;
const _: () = assert!(TILE.is_multiple_of(LANES), "a tile's rows are whole groups");
/// Neighbours that a fit by features takes at once: its 60 sums do not fit into registers, and are read and
/// written once for all of these.
const AT_ONCE: usize = 4;
/// Neighbours of less weight are passed over.
const MIN_WEIGHT: f32 = 1e-4;
/// Variance of a sample's feature, about: what a fit follows may be the features' own noise, which is this over the
/// samples.
const FEATURE_VARIANCE: f64 = 0.004;
/// What keeps a fit by place level where all neighbours that count lie in one line, square pixels.
const PLACE_RIDGE: f32 = 0.58;

/// A picture, and what is left of its light's variance.
pub(super) struct Fitted {
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) variance: Vec<f32>,
}

/// Fits each pixel's colour by a plane through its neighbours' features, each the mean of so many samples, and the
/// variance of a mean with the same weights.
pub(super) fn by_features<const PATCH: usize>(
    colours: &[PaddedPlane; 3],
    features: &[PaddedPlane; FEATURES],
    samples: f64,
    likeness: &Likeness<'_, PATCH>,
) -> Fitted {
    let ridge = (FEATURE_VARIANCE / samples.max(1.0)).clamp(1e-6, FEATURE_VARIANCE) as f32;
    let found = by_tiles(likeness, &ByFeatures { colours, features, ridge });
    Fitted {
        rgb: found.par_iter().map(|&[red, green, blue, _]| [red, green, blue]).collect(),
        variance: found.par_iter().map(|&[_, _, _, variance]| variance).collect(),
    }
}

/// Fits each pixel's colour by a plane through its neighbours' places: a mean would make steps of what changes slowly.
pub(super) fn by_place<const PATCH: usize>(
    colours: &[PaddedPlane; 3],
    likeness: &Likeness<'_, PATCH>,
) -> Vec<[f32; 3]> {
    by_tiles(likeness, &ByPlace { colours })
}

/// Where the first of the pixels that are fitted at once is.
#[derive(Clone, Copy)]
struct Place {
    y: isize,
    x: isize,
}

impl Place {
    #[inline(always)]
    fn at(self, tap: Tap) -> Self {
        Self { y: self.y + tap.dy, x: self.x + tap.dx }
    }
}

/// Values of a plane, from a place on.
#[inline(always)]
fn at_place(plane: &PaddedPlane, place: Place) -> Lanes {
    Lanes(*plane.row(place.y, place.x))
}

/// `N` values of pixels from their neighbours.
trait FromNeighbours<const N: usize>: Sync {
    /// Of the pixels from a place on. `#[inline(always)]`.
    fn values(&self, place: Place, neighbours: &Neighbours<'_>) -> [Lanes; N];
}

/// The taps of a tile, what they weigh, and which of its pixels are looked at.
struct Neighbours<'a> {
    taps: &'a [Tap],
    weights: &'a [TileWeights],
    variance: &'a PaddedPlane,
    row: usize,
    column: usize,
}

impl Neighbours<'_> {
    /// How much a tap counts; `None` where that is next to nothing.
    #[inline(always)]
    fn weight(&self, tap: usize) -> Option<Lanes> {
        let mut weight = Lanes::ZERO;
        weight.0.copy_from_slice(&self.weights[tap][self.row][self.column..self.column + LANES]);
        if weight.any_is_at_least(MIN_WEIGHT) { Some(weight) } else { None }
    }
}

struct ByFeatures<'a> {
    colours: &'a [PaddedPlane; 3],
    features: &'a [PaddedPlane; FEATURES],
    ridge: f32,
}

impl FromNeighbours<4> for ByFeatures<'_> {
    #[inline(always)]
    fn values(&self, place: Place, neighbours: &Neighbours<'_>) -> [Lanes; 4] {
        let mut centers = [Lanes::ZERO; FEATURES];
        for (center, plane) in centers.iter_mut().zip(self.features) {
            *center = at_place(plane, place);
        }
        let mut equations = Equations::<{ FEATURES + 1 }>::new();
        let (mut variance, mut total) = (Lanes::ZERO, Lanes::ZERO);
        let mut seen = [Neighbour::<{ FEATURES + 1 }>::NONE; AT_ONCE];
        let mut waiting = 0;
        for (number, &tap) in neighbours.taps.iter().enumerate() {
            let Some(weight) = neighbours.weight(number) else { continue };
            let at = place.at(tap);
            let neighbour = &mut seen[waiting];
            neighbour.weight = weight;
            for ((term, plane), &center) in neighbour.terms.iter_mut().zip(self.features).zip(&centers) {
                *term = at_place(plane, at).less(center);
            }
            neighbour.colours = colours_at(self.colours, at);
            total.add_product(weight, Lanes::ONE);
            variance.add_product(weight.times(weight), at_place(neighbours.variance, at));
            waiting += 1;
            if waiting == AT_ONCE {
                equations.add(&seen);
                waiting = 0;
            }
        }
        for neighbour in seen.iter().take(waiting) {
            equations.add(std::array::from_ref(neighbour));
        }
        let [red, green, blue] = equations.value_at_center(self.ridge);
        [red, green, blue, variance.over(total.times(total))]
    }
}

struct ByPlace<'a> {
    colours: &'a [PaddedPlane; 3],
}

impl FromNeighbours<3> for ByPlace<'_> {
    #[inline(always)]
    fn values(&self, place: Place, neighbours: &Neighbours<'_>) -> [Lanes; 3] {
        let mut equations = Equations::<3>::new();
        for (number, &tap) in neighbours.taps.iter().enumerate() {
            let Some(weight) = neighbours.weight(number) else { continue };
            let terms = [Lanes([tap.dx as f32; LANES]), Lanes([tap.dy as f32; LANES]), Lanes::ONE];
            equations.add(&[Neighbour { weight, terms, colours: colours_at(self.colours, place.at(tap)) }]);
        }
        equations.value_at_center(PLACE_RIDGE)
    }
}

#[inline(always)]
fn colours_at(colours: &[PaddedPlane; 3], place: Place) -> [Lanes; 3] {
    let [red, green, blue] = colours;
    [at_place(red, place), at_place(green, place), at_place(blue, place)]
}

/// Runs a fit over the picture, `N` values for each pixel.
fn by_tiles<const N: usize, const PATCH: usize>(
    likeness: &Likeness<'_, PATCH>,
    fit: &impl FromNeighbours<N>,
) -> Vec<[f32; N]> {
    let (width, height) = likeness.surfaces.size();
    let mut found = vec![[0.0; N]; width * height];
    found.par_chunks_mut(TILE * width).enumerate().for_each_init(
        || (vec![[[0.0; TILE]; TILE]; likeness.taps.all().len()], Box::<Scratch>::default()),
        |(weights, scratch), (tile_y, rows)| {
            for x in (0..width).step_by(TILE) {
                with_vectors(TileWork { likeness, fit, weights, scratch, y: tile_y * TILE, x, rows, width });
            }
        },
    );
    found
}

/// A tile that is to be fitted.
struct TileWork<'a, F, const N: usize, const PATCH: usize> {
    likeness: &'a Likeness<'a, PATCH>,
    fit: &'a F,
    /// Room for the weights of each tap.
    weights: &'a mut [TileWeights],
    scratch: &'a mut Scratch,
    /// The first row and column.
    y: usize,
    x: usize,
    /// The values of the tile's rows, from the picture's left to its right.
    rows: &'a mut [[f32; N]],
    /// Width of the picture.
    width: usize,
}

impl<F: FromNeighbours<N>, const N: usize, const PATCH: usize> VectorWork for TileWork<'_, F, N, PATCH> {
    #[inline(always)]
    fn run(self) {
        let taps = self.likeness.taps.all();
        for (weights, &tap) in self.weights.iter_mut().zip(taps) {
            self.likeness.weigh(self.y as isize, self.x as isize, tap, self.scratch, weights);
        }
        for (row, pixels) in self.rows.chunks_exact_mut(self.width).enumerate() {
            let end = self.width.min(self.x + TILE);
            let mut first = self.x;
            while first < end {
                let neighbours = Neighbours {
                    taps,
                    weights: self.weights,
                    variance: &self.likeness.light.variance,
                    row,
                    column: first - self.x,
                };
                let place = Place { y: (self.y + row) as isize, x: first as isize };
                let values = self.fit.values(place, &neighbours);
                for (lane, pixel) in pixels[first..end.min(first + LANES)].iter_mut().enumerate() {
                    for (value, lanes) in pixel.iter_mut().zip(&values) {
                        *value = lanes.0[lane];
                    }
                }
                first += LANES;
            }
        }
    }
}

/// What a tap finds for each of the pixels that are fitted at once.
#[derive(Clone, Copy)]
struct Neighbour<const UNKNOWNS: usize> {
    weight: Lanes,
    /// Relative to the pixel, so that it is where they are 0; the last is 1.
    terms: [Lanes; UNKNOWNS],
    colours: [Lanes; 3],
}

impl<const UNKNOWNS: usize> Neighbour<UNKNOWNS> {
    const NONE: Self = Self { weight: Lanes::ZERO, terms: [Lanes::ONE; UNKNOWNS], colours: [Lanes::ZERO; 3] };
}

/// Normal equations of several pixels' fits, the constant last.
struct Equations<const UNKNOWNS: usize> {
    /// The upper triangle.
    matrix: [[Lanes; UNKNOWNS]; UNKNOWNS],
    right: [[Lanes; 3]; UNKNOWNS],
}

impl<const UNKNOWNS: usize> Equations<UNKNOWNS> {
    #[inline(always)]
    fn new() -> Self {
        Self { matrix: [[Lanes::ZERO; _]; _], right: [[Lanes::ZERO; _]; _] }
    }

    /// One after the other, so that it makes no difference to a sum how many come at once.
    #[inline(always)]
    fn add<const NEIGHBOURS: usize>(&mut self, neighbours: &[Neighbour<UNKNOWNS>; NEIGHBOURS]) {
        for i in 0..UNKNOWNS {
            let mut weighted = [Lanes::ZERO; NEIGHBOURS];
            for (weighted, neighbour) in weighted.iter_mut().zip(neighbours) {
                *weighted = neighbour.weight.times(neighbour.terms[i]);
            }
            for j in i..UNKNOWNS {
                let mut sum = self.matrix[i][j];
                for (&weighted, neighbour) in weighted.iter().zip(neighbours) {
                    sum.add_product(weighted, neighbour.terms[j]);
                }
                self.matrix[i][j] = sum;
            }
            for c in 0..3 {
                let mut sum = self.right[i][c];
                for (&weighted, neighbour) in weighted.iter().zip(neighbours) {
                    sum.add_product(weighted, neighbour.colours[c]);
                }
                self.right[i][c] = sum;
            }
        }
    }

    /// The constant, by elimination: what the fit says of the pixel itself, not below 0. That one is among
    /// its neighbours with full weight, so the last pivot is 1 at least. `ridge` is added to each other
    /// term's square, per weight.
    #[inline(always)]
    fn value_at_center(mut self, ridge: f32) -> [Lanes; 3] {
        let last = UNKNOWNS - 1;
        let damping = self.matrix[last][last].times(Lanes([ridge; LANES]));
        for k in 0..last {
            let mut pivot = self.matrix[k][k].at_least(0.0);
            pivot.add_product(damping, Lanes::ONE);
            let (row, right) = (self.matrix[k], self.right[k]);
            for i in k + 1..UNKNOWNS {
                let share = row[i].over(pivot);
                for (sum, &term) in self.matrix[i][i..].iter_mut().zip(&row[i..]) {
                    sum.subtract_product(share, term);
                }
                for (sum, &colour) in self.right[i].iter_mut().zip(&right) {
                    sum.subtract_product(share, colour);
                }
            }
        }
        let pivot = self.matrix[last][last].at_least(1.0);
        let [red, green, blue] = self.right[last];
        [red.over(pivot).at_least(0.0), green.over(pivot).at_least(0.0), blue.over(pivot).at_least(0.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three unknowns, colours of a plane: the constant comes out, also where some neighbours count for little.
    #[test]
    fn a_plane_is_found() {
        let mut equations = Equations::<3>::new();
        for i in 0..25 {
            let (dx, dy) = ((i % 5) as f32 - 2.0, (i / 5) as f32 - 1.0);
            let value = 7.0 + 2.0 * dx - 3.0 * dy;
            let weight = if (dx, dy) == (0.0, 0.0) { 1.0 } else { 1.0 / (1.0 + i as f32) };
            let terms = [Lanes([dx; LANES]), Lanes([dy; LANES]), Lanes::ONE];
            let colours = [Lanes([value; LANES]); 3];
            equations.add(&[Neighbour { weight: Lanes([weight; LANES]), terms, colours }]);
        }
        let [red, ..] = equations.value_at_center(1e-6);
        assert!((red.0[0] - 7.0).abs() < 1e-3, "{red:?}");
    }

    /// To the last bit.
    #[test]
    fn neighbours_at_once_are_neighbours_one_by_one() {
        let number = |of: usize, seed: usize| ((of * 7919 + seed * 104_729) % 1009) as f32 / 1009.0;
        let lanes = |seed: usize| Lanes(std::array::from_fn(|lane| number(lane, seed)));
        let neighbours: [Neighbour<8>; AT_ONCE] = std::array::from_fn(|n| Neighbour {
            weight: lanes(n),
            terms: std::array::from_fn(|term| lanes(10 * n + term)),
            colours: std::array::from_fn(|colour| lanes(100 * n + colour)),
        });
        let (mut at_once, mut one_by_one) = (Equations::<8>::new(), Equations::<8>::new());
        at_once.add(&neighbours);
        neighbours.iter().for_each(|neighbour| one_by_one.add(std::array::from_ref(neighbour)));
        assert_eq!((at_once.matrix, at_once.right), (one_by_one.matrix, one_by_one.right));
    }

    /// One pixel alone, whose features say nothing: its own colour.
    #[test]
    fn a_pixel_alone_keeps_its_colour() {
        let mut equations = Equations::<8>::new();
        let mut terms = [Lanes::ZERO; 8];
        terms[7] = Lanes::ONE;
        equations.add(&[Neighbour { weight: Lanes::ONE, terms, colours: [Lanes([5.0; LANES]); 3] }]);
        assert_eq!(equations.value_at_center(1e-6)[0], Lanes([5.0; LANES]));
    }
}
