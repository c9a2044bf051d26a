//! How much a neighbour counts: by its surroundings, less what noise alone would make of them, and by its surface.

use super::SurfaceGuides;
use super::lanes::{LANES, Lanes};
use super::planes::{Beyond, PaddedPlane, TILE};
use super::taps::{Tap, Taps};
use fechner_perception::guide::{BEYOND, DEPTH_SLOPES, FARTHEST_SURFACE, GONE, depth_slopes};
use fechner_perception::photometry::luminance;
use rayon::prelude::*;

/// A neighbour gets 1/e of the weight where the cosine between the normals is below 1 by one part in so many.
const NORMAL_SHARPNESS: f32 = 12.0;
/// A neighbour that is farther off by this share of the depth gets 1/e of the weight where the surface has no slope.
const DEPTH_SHARE: f32 = 2e-3;
/// Depth where there is no surface.
const NO_SURFACE: f32 = 0.5 * BEYOND;

/// About exp(−x), 0 from [`GONE`] on, without the cost of an exponential.
#[inline(always)]
fn falling(x: f32) -> f32 {
    let base = positive(1.0 - x / GONE);
    let fourth = base * base * base * base;
    fourth * fourth
}

/// At least 0. `f32::max` would look for what is not a number, too, where there is none.
#[inline(always)]
fn positive(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// The lesser of two numbers, likewise.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Light that falls on surfaces: luminance, and its variance.
pub(super) struct Light {
    luminance: PaddedPlane,
    pub(super) variance: PaddedPlane,
}

impl Light {
    pub(super) fn of(guides: &SurfaceGuides, rgb: &[[f32; 3]], variance: &[f32]) -> Self {
        let plane =
            |of: &(dyn Fn(usize) -> f32 + Sync)| PaddedPlane::new(guides.width, guides.height, Beyond::Edge, of);
        // A variance of nothing at all would make nothing of any difference: 0 over 0.
        Self { luminance: plane(&|i| luminance(rgb[i])), variance: plane(&|i| variance[i].max(1e-12)) }
    }
}

/// Surfaces as they are told apart.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    /// Columns and rows.
    size: (usize, usize),
    normal: [PaddedPlane; 3],
    /// [`NORMAL_SHARPNESS`], 0 where there is no normal.
    sharpness: PaddedPlane,
    depth: PaddedPlane,
    /// 1 over the difference of depth, per pixel of distance, at which a neighbour gets 1/e of the weight.
    per_depth: PaddedPlane,
    /// [`GONE`] where something shines by itself, else 0: its light may not leak out of it.
    shining: PaddedPlane,
}

impl Surfaces {
    pub(super) fn of(guides: &SurfaceGuides) -> Self {
        let (width, height) = (guides.width, guides.height);
        let normals: Vec<[f32; 3]> = guides.normal.par_iter().map(|&normal| unit(normal)).collect();
        let depth = |i: usize| {
            if guides.depth[i].is_finite() { guides.depth[i].clamp(0.0, FARTHEST_SURFACE) } else { NO_SURFACE }
        };
        let slopes = depth_slopes(&guides.depth, width);
        let per_depth = |i: usize| {
            1.0 / (DEPTH_SLOPES * slopes[i].min(FARTHEST_SURFACE) + DEPTH_SHARE * depth(i) + f32::MIN_POSITIVE)
        };
        Self {
            size: (width, height),
            normal: std::array::from_fn(|axis| PaddedPlane::new(width, height, Beyond::Edge, |i| normals[i][axis])),
            sharpness: PaddedPlane::new(width, height, Beyond::Edge, |i| {
                if normals[i] == [0.0; 3] { 0.0 } else { NORMAL_SHARPNESS }
            }),
            depth: PaddedPlane::new(width, height, Beyond::Value(BEYOND), depth),
            per_depth: PaddedPlane::new(width, height, Beyond::Value(0.0), |i| per_depth(i).min(1e6)),
            shining: PaddedPlane::new(width, height, Beyond::Edge, |i| if guides.shines[i] { GONE } else { 0.0 }),
        }
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> (usize, usize) {
        self.size
    }
}

fn unit(normal: [f32; 3]) -> [f32; 3] {
    let length = normal.iter().map(|part| part * part).sum::<f32>().sqrt();
    if length > 1e-3 && length.is_finite() { normal.map(|part| part / length) } else { [0.0; 3] }
}

/// What tells how much each of the taps counts: `PATCH` pixels to each side are compared.
pub(super) struct Likeness<'a, const PATCH: usize> {
    pub(super) taps: &'a Taps,
    pub(super) light: &'a Light,
    pub(super) surfaces: &'a Surfaces,
    /// Standard errors of the difference at which a neighbour gets 1/e of the weight.
    pub(super) tolerance: f32,
    /// A neighbour's variance counts as at most so many times the pixel's own: what is as bright as a lamp's reflection
    /// has the variance to be anything, and would be taken for what is around it.
    pub(super) most_variance_ratio: f32,
}

/// Weights of one tap for a tile's pixels.
pub(super) type TileWeights = [[f32; TILE]; TILE];
/// Room for what is found of one tap on the way to its weights.
#[derive(Default)]
pub(super) struct Scratch {
    /// Unlikeness of each pixel of the tile and around it.
    unlike: [[f32; WIDEST]; TILE + 2 * MAX_PATCH],
    along: [[f32; TILE]; TILE + 2 * MAX_PATCH],
}

/// The most pixels to each side that are compared.
const MAX_PATCH: usize = 2;
/// Widest row of a tile's neighbourhoods: as wide as they are and more, in whole vectors.
pub(super) const WIDEST: usize = TILE + 8;

impl<const PATCH: usize> Likeness<'_, PATCH> {
    const FITS: () = assert!(PATCH <= MAX_PATCH, "a patch is wider than there is room for");

    /// Weights of a tap for the pixels of the tile whose first pixel this is. Inlined, as all that it calls, for wide
    /// vectors.
    #[inline(always)]
    pub(super) fn weigh(&self, y: isize, x: isize, tap: Tap, scratch: &mut Scratch, weights: &mut TileWeights) {
        let () = Self::FITS;
        self.unlike_surroundings(y, x, tap, scratch);
        // The slope explains more the farther one goes.
        let per_distance = 1.0 / tap.distance().max(1.0);
        for (row, weights) in weights.iter_mut().enumerate() {
            let unlike = Self::mean_of_rows(&scratch.along, row);
            let y = y + row as isize;
            let (other_y, other_x) = (y + tap.dy, x + tap.dx);
            let [nx, ny, nz] = &self.surfaces.normal;
            let own = [nx.row::<TILE>(y, x), ny.row(y, x), nz.row(y, x)];
            let other = [nx.row::<TILE>(other_y, other_x), ny.row(other_y, other_x), nz.row(other_y, other_x)];
            let depth = [self.surfaces.depth.row::<TILE>(y, x), self.surfaces.depth.row(other_y, other_x)];
            let shining = [self.surfaces.shining.row::<TILE>(y, x), self.surfaces.shining.row(other_y, other_x)];
            let per_depth = self.surfaces.per_depth.row::<TILE>(y, x);
            let sharpness = self.surfaces.sharpness.row::<TILE>(y, x);
            for i in 0..TILE {
                let cosine = own[0][i] * other[0][i] + own[1][i] * other[1][i] + own[2][i] * other[2][i];
                let turned = sharpness[i] * positive(1.0 - cosine);
                let apart = (depth[0][i] - depth[1][i]).abs() * per_depth[i] * per_distance;
                weights[i] = falling(unlike[i] + turned + apart + (shining[0][i] - shining[1][i]).abs());
            }
        }
    }

    /// How the pixels around differ from those around the neighbour, squared, less what noise makes of it on average,
    /// in units of the tolerance: summed along rows.
    #[inline(always)]
    fn unlike_surroundings(&self, y: isize, x: isize, tap: Tap, scratch: &mut Scratch) {
        let patch = PATCH as isize;
        let squared_tolerance = self.tolerance * self.tolerance;
        for (row, unlike) in scratch.unlike.iter_mut().enumerate().take(TILE + 2 * PATCH) {
            let (y, x) = (y + row as isize - patch, x - patch);
            let (other_y, other_x) = (y + tap.dy, x + tap.dx);
            let own = self.light.luminance.row::<WIDEST>(y, x);
            let other = self.light.luminance.row::<WIDEST>(other_y, other_x);
            let own_variance = self.light.variance.row::<WIDEST>(y, x);
            let other_variance = self.light.variance.row::<WIDEST>(other_y, other_x);
            for i in 0..WIDEST {
                let difference = own[i] - other[i];
                let a = own_variance[i];
                let b = lesser(other_variance[i], self.most_variance_ratio * a);
                // Of a neighbour that is noisier than the pixel no more is taken off than the pixel's own:
                // Rousselle et al. 2012, eq. 3.
                unlike[i] = (difference * difference - (a + lesser(a, b))) / (squared_tolerance * (a + b));
            }
        }
        // Only now: what is read right after it was written, from another column on, has to wait.
        for (along, unlike) in scratch.along.iter_mut().zip(&scratch.unlike).take(TILE + 2 * PATCH) {
            for column in (0..TILE).step_by(LANES) {
                let mut sum = Lanes::of(unlike, column);
                for step in 1..=2 * PATCH {
                    sum.add(Lanes::of(unlike, column + step));
                }
                along[column..column + LANES].copy_from_slice(&sum.0);
            }
        }
    }

    /// The mean over a row's pixels' surroundings of what sums along rows say: 0 where it is no more than noise.
    #[inline(always)]
    fn mean_of_rows(along: &[[f32; TILE]], row: usize) -> [f32; TILE] {
        let side = 2 * PATCH + 1;
        let share = 1.0 / (side * side) as f32;
        let mut mean = [0.0; TILE];
        for column in (0..TILE).step_by(LANES) {
            let mut sum = Lanes::of(&along[row], column);
            for below in 1..side {
                sum.add(Lanes::of(&along[row + below], column));
            }
            for i in 0..LANES {
                mean[column + i] = positive(sum.0[i] * share);
            }
        }
        mean
    }
}
