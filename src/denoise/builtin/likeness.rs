//! How much a neighbour counts: by its surroundings, less what noise alone would make of them, and by its surface.

use super::SurfaceGuides;
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
    let base = (1.0 - x / GONE).max(0.0);
    let fourth = base * base * base * base;
    fourth * fourth
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
    /// A neighbour's variance counts as at most so many times the pixel's own: what is as bright as a lamp's reflection has the
    /// variance to be anything, and would be taken for what is around it.
    pub(super) most_variance_ratio: f32,
}

/// Weights of one tap for a tile's pixels.
pub(super) type TileWeights = [[f32; TILE]; TILE];
/// The widest that a tile's neighbourhoods are.
const WIDEST: usize = TILE + 4;

impl<const PATCH: usize> Likeness<'_, PATCH> {
    const FITS: () = assert!(2 * PATCH <= WIDEST - TILE, "a patch is wider than there is room for");

    /// Weights of a tap for the pixels of the tile whose first pixel this is. Inlined, as all that it calls, for wide vectors.
    #[inline(always)]
    pub(super) fn weigh(&self, y: isize, x: isize, tap: Tap, weights: &mut TileWeights) {
        let () = Self::FITS;
        let unlike = self.unlike_surroundings(y, x, tap);
        // The slope explains more the farther one goes.
        let per_distance = 1.0 / tap.distance().max(1.0);
        for row in 0..TILE {
            let y = y + row as isize;
            let (other_y, other_x) = (y + tap.dy, x + tap.dx);
            let [nx, ny, nz] = &self.surfaces.normal;
            let own = [nx.row::<TILE>(y, x), ny.row(y, x), nz.row(y, x)];
            let other = [nx.row::<TILE>(other_y, other_x), ny.row(other_y, other_x), nz.row(other_y, other_x)];
            let depth = [self.surfaces.depth.row::<TILE>(y, x), self.surfaces.depth.row(other_y, other_x)];
            let shining = [self.surfaces.shining.row::<TILE>(y, x), self.surfaces.shining.row(other_y, other_x)];
            let per_depth = self.surfaces.per_depth.row::<TILE>(y, x);
            for i in 0..TILE {
                let has_normal = own[0][i].abs() + own[1][i].abs() + own[2][i].abs();
                let cosine = own[0][i] * other[0][i] + own[1][i] * other[1][i] + own[2][i] * other[2][i];
                let turned = if has_normal > 0.0 { NORMAL_SHARPNESS * (1.0 - cosine).max(0.0) } else { 0.0 };
                let apart = (depth[0][i] - depth[1][i]).abs() * per_depth[i] * per_distance;
                weights[row][i] = falling(unlike[row][i] + turned + apart + (shining[0][i] - shining[1][i]).abs());
            }
        }
    }

    /// Mean over the pixels around of their squared difference from those around the neighbour, less what noise makes of it on
    /// average, in units of the tolerance: 0 where it is no more than noise.
    #[inline(always)]
    fn unlike_surroundings(&self, y: isize, x: isize, tap: Tap) -> TileWeights {
        let patch = PATCH as isize;
        let side = 2 * PATCH + 1;
        let squared_tolerance = self.tolerance * self.tolerance;
        let mut along = [[0.0_f32; TILE]; WIDEST];
        for (row, along) in along.iter_mut().enumerate().take(TILE + 2 * PATCH) {
            let (y, x) = (y + row as isize - patch, x - patch);
            let (other_y, other_x) = (y + tap.dy, x + tap.dx);
            let own = self.light.luminance.row::<WIDEST>(y, x);
            let other = self.light.luminance.row::<WIDEST>(other_y, other_x);
            let own_variance = self.light.variance.row::<WIDEST>(y, x);
            let other_variance = self.light.variance.row::<WIDEST>(other_y, other_x);
            let mut unlike = [0.0_f32; WIDEST];
            for i in 0..WIDEST {
                let difference = own[i] - other[i];
                let a = own_variance[i];
                let b = other_variance[i].min(self.most_variance_ratio * a);
                // Of a neighbour that is noisier than the pixel no more is taken off than the pixel's own: Rousselle et al. 2012, eq. 3.
                unlike[i] = (difference * difference - (a + a.min(b))) / (squared_tolerance * (a + b));
            }
            for step in 0..side {
                for i in 0..TILE {
                    along[i] += unlike[i + step];
                }
            }
        }
        let share = 1.0 / (side * side) as f32;
        let mut mean = [[0.0_f32; TILE]; TILE];
        for (row, mean) in mean.iter_mut().enumerate() {
            for along in &along[row..row + side] {
                for i in 0..TILE {
                    mean[i] += along[i];
                }
            }
            for value in mean {
                *value = (*value * share).max(0.0);
            }
        }
        mean
    }
}
