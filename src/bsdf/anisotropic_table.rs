//! Directional albedos of facets that are wider along one axis than along the other.
//!
//! They depend on two widths, a cosine and an azimuth. Materials of constant widths, which most are, need only the last
//! two; a texture of roughness gets a coarser table over widths as well. Make one a material.

use super::albedo_table::{average_over_visible_normals, column_of_cosine, cosine_of_column};
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;

/// Columns: cosines, spaced as those of the isotropic table.
const COSINES: usize = 32;
/// Rows: azimuths, equally spaced in |y|/(|x| + |y|).
const AZIMUTHS: usize = 9;
/// Widths along each axis for which a texture's range is tabulated.
const WIDTHS: usize = 9;

/// Which slope widths a material may take along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WidthRange {
    /// Only this one.
    Constant(f32),
    /// All of [0, 1], as a texture says.
    Textured,
}

impl WidthRange {
    /// The widths of `count` nodes in equal steps of perceptual roughness, or the only one.
    pub(crate) fn nodes(self, count: usize) -> Vec<f32> {
        match self {
            Self::Constant(alpha) => vec![alpha],
            Self::Textured => (0..count).map(|node| (node as f32 / (count - 1) as f32).powi(2)).collect(),
        }
    }
}

/// Neighbouring nodes of a width and how far it lies towards the upper one.
pub(crate) fn place_between(alpha: f32, nodes: usize) -> (usize, usize, f32) {
    if nodes == 1 {
        return (0, 0, 0.0);
    }
    let scaled = alpha.sqrt() * (nodes - 1) as f32;
    let low = (scaled as usize).min(nodes - 2);
    (low, low + 1, scaled - low as f32)
}

/// Albedos of one pair of widths.
#[derive(Clone)]
struct Cell {
    /// Mean width, by which cosines are spaced.
    alpha: f32,
    rows: [[f32; COSINES]; AZIMUTHS],
    average: f32,
}

/// A directional albedo, or one less it, as a function of both widths and of direction.
#[derive(Clone)]
pub struct AnisotropicTable {
    /// Widths along each axis.
    counts: [usize; 2],
    /// By width along x, then y.
    cells: Vec<Cell>,
}

/// An [`AnisotropicTable`] at one pair of widths.
#[derive(Clone, Copy)]
pub(crate) struct AnisotropicCurve<'a> {
    cells: [&'a Cell; 4],
    weights: [f32; 4],
}

impl AnisotropicTable {
    /// The light that one reflection off facets of such widths loses, if they reflect everything.
    pub fn missing(ranges: [WidthRange; 2], distribution: Distribution) -> Self {
        Self::new(ranges, distribution, |facets, wo| {
            average_over_visible_normals(facets, wo, |m| 1.0 - super::energy::reflected(facets, wo, m))
        })
    }

    /// Tabulates `albedo(facets, direction)`.
    pub(crate) fn new(
        ranges: [WidthRange; 2],
        distribution: Distribution,
        albedo: impl Fn(&Microfacets, Vec3) -> f32,
    ) -> Self {
        let [x, y] = ranges.map(|range| range.nodes(WIDTHS));
        let mut cells = Vec::with_capacity(x.len() * y.len());
        for &alpha_x in &x {
            for &alpha_y in &y {
                // Models do not use the table where both are smooth, but interpolate from there.
                let facets = Microfacets::new(alpha_x.max(1e-3), alpha_y.max(1e-3), distribution);
                cells.push(Cell::new(&facets, &albedo));
            }
        }
        Self { counts: [x.len(), y.len()], cells }
    }

    pub(crate) fn curve(&self, [alpha_x, alpha_y]: [f32; 2]) -> AnisotropicCurve<'_> {
        let (x0, x1, x) = place_between(alpha_x, self.counts[0]);
        let (y0, y1, y) = place_between(alpha_y, self.counts[1]);
        let at = |x: usize, y: usize| &self.cells[x * self.counts[1] + y];
        AnisotropicCurve {
            cells: [at(x0, y0), at(x0, y1), at(x1, y0), at(x1, y1)],
            weights: [(1.0 - x) * (1.0 - y), (1.0 - x) * y, x * (1.0 - y), x * y],
        }
    }
}

impl Cell {
    fn new(facets: &Microfacets, albedo: &impl Fn(&Microfacets, Vec3) -> f32) -> Self {
        let alpha = facets.mean_alpha();
        let rows = std::array::from_fn(|row| {
            let share = row as f32 / (AZIMUTHS - 1) as f32;
            let (x, y) = ((1.0 - share) / share.hypot(1.0 - share), share / share.hypot(1.0 - share));
            std::array::from_fn(|column| {
                let mu = cosine_of_column(column as f32 / (COSINES - 1) as f32, alpha);
                let radius = (1.0 - mu * mu).max(0.0).sqrt();
                albedo(facets, Vec3::new(radius * x, radius * y, mu))
            })
        });
        let mut cell = Self { alpha, rows, average: 0.0 };
        cell.average = cell.integral();
        cell
    }

    /// 1/π times the integral over the hemisphere, weighted by the cosine, by the midpoint rule in μ^½ and in azimuth.
    fn integral(&self) -> f32 {
        const AZIMUTH_STEPS: usize = 24;
        const COSINE_STEPS: usize = 192;
        let mut sum = 0.0f64;
        for azimuth in 0..AZIMUTH_STEPS {
            let (sin, cos) = (FRAC_PI_2 * (azimuth as f32 + 0.5) / AZIMUTH_STEPS as f32).sin_cos();
            for step in 0..COSINE_STEPS {
                let root = (step as f32 + 0.5) / COSINE_STEPS as f32;
                let mu = root * root;
                let radius = (1.0 - mu * mu).sqrt();
                sum += f64::from(4.0 * root * mu * self.at(Vec3::new(radius * cos, radius * sin, mu)));
            }
        }
        (sum / (AZIMUTH_STEPS * COSINE_STEPS) as f64) as f32
    }

    fn at(&self, w: Vec3) -> f32 {
        let (x, y) = (w.x.abs(), w.y.abs());
        let share = if x + y > 0.0 { y / (x + y) } else { 0.5 };
        let row = share * (AZIMUTHS - 1) as f32;
        let low = (row as usize).min(AZIMUTHS - 2);
        let column = column_of_cosine(w.z.max(f32::MIN_POSITIVE), self.alpha).clamp(0.0, 1.0) * (COSINES - 1) as f32;
        let left = (column as usize).min(COSINES - 2);
        let along = |row: &[f32; COSINES]| row[left] + (row[left + 1] - row[left]) * (column - left as f32);
        let (below, above) = (along(&self.rows[low]), along(&self.rows[low + 1]));
        below + (above - below) * (row - low as f32)
    }
}

impl AnisotropicCurve<'_> {
    fn sum(&self, value: impl Fn(&Cell) -> f32) -> f32 {
        let mut sum = 0.0;
        for (cell, weight) in self.cells.iter().zip(self.weights) {
            if weight > 0.0 {
                sum += weight * value(cell);
            }
        }
        sum
    }

    /// The value for a direction of the upper half.
    pub(crate) fn at(&self, w: Vec3) -> f32 {
        self.sum(|cell| cell.at(w))
    }

    /// 1/π times the integral over the hemisphere, weighted by the cosine.
    pub(crate) fn average(&self) -> f32 {
        self.sum(|cell| cell.average)
    }
}
