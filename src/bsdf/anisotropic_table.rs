//! Directional albedos of facets that are wider along one axis than along the other.
//!
//! They depend on two widths, a cosine and an azimuth. Materials of constant widths, which most are, need only the last
//! two; a texture of roughness gets a coarser table over widths as well. Make one a material.

use super::albedo_table::{TablePlace, average_over_visible_normals, column_of_cosine, cosine_of_column};
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;
use std::fmt;

/// Columns: cosines, spaced as those of the isotropic table.
const COSINES: usize = 32;
/// Rows: azimuths, as [`Azimuths`] places them.
pub(super) const AZIMUTHS: usize = 13;
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

/// Nodes beside a width, which are the same where there is only one.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodesBeside {
    pub(super) low: usize,
    pub(super) high: usize,
    /// How far the width lies towards the upper one.
    pub(super) fraction: f32,
}

impl NodesBeside {
    /// The nodes beside a width in [0, 1], among as many as [`WidthRange::nodes`] made.
    pub(super) fn of(alpha: f32, nodes: usize) -> Self {
        if nodes == 1 {
            return Self { low: 0, high: 0, fraction: 0.0 };
        }
        let TablePlace { node, fraction } = TablePlace::of(alpha.sqrt(), nodes);
        Self { low: node, high: node + 1, fraction }
    }
}

/// The azimuths of a table's rows, from x to y: equally spaced in w/(1 + w), where w = |y|√α_y/(|x|√α_x).
///
/// That lies between equal steps of azimuth and those after stretching by the widths. What is seen along the narrow
/// axis changes within an azimuth of α_x/α_y: with steps of the first kind a coat of 0.01 by 1 gives back 1.04 there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Azimuths {
    /// √α along x and y.
    roots: [f32; 2],
}

impl Azimuths {
    /// The azimuths of rows for slope widths above 0 along x and y.
    pub(super) fn new(alphas: [f32; 2]) -> Self {
        Self { roots: alphas.map(f32::sqrt) }
    }

    /// The direction of cosine `mu` in a row.
    pub(super) fn direction(&self, row: usize, mu: f32) -> Vec3 {
        let share = row as f32 / (AZIMUTHS - 1) as f32;
        let (x, y) = ((1.0 - share) / self.roots[0], share / self.roots[1]);
        let radius = (1.0 - mu * mu).max(0.0).sqrt() / x.hypot(y);
        Vec3::new(radius * x, radius * y, mu)
    }

    /// Where a direction lies between two rows.
    pub(super) fn place(&self, w: Vec3) -> TablePlace {
        let (x, y) = (w.x.abs() * self.roots[0], w.y.abs() * self.roots[1]);
        // Along the normal all rows are one.
        let share = if x + y > 0.0 { y / (x + y) } else { 0.5 };
        TablePlace::of(share, AZIMUTHS)
    }
}

/// Albedos of one pair of widths.
#[derive(Clone)]
struct Cell {
    /// Mean width, by which cosines are spaced.
    alpha: f32,
    azimuths: Azimuths,
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
            // Rounding makes less than nothing of it where facets are almost smooth.
            average_over_visible_normals(facets, wo, |m| 1.0 - super::energy::reflected(facets, wo, m)).max(0.0)
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
        let NodesBeside { low: x0, high: x1, fraction: x } = NodesBeside::of(alpha_x, self.counts[0]);
        let NodesBeside { low: y0, high: y1, fraction: y } = NodesBeside::of(alpha_y, self.counts[1]);
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
        let azimuths = Azimuths::new(facets.alphas());
        let rows = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let mu = cosine_of_column(column as f32 / (COSINES - 1) as f32, alpha);
                albedo(facets, azimuths.direction(row, mu))
            })
        });
        let mut cell = Self { alpha, azimuths, rows, average: 0.0 };
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
        let TablePlace { node: low, fraction: towards } = self.azimuths.place(w);
        let column = column_of_cosine(w.z.max(f32::MIN_POSITIVE), self.alpha).clamp(0.0, 1.0) * (COSINES - 1) as f32;
        let left = (column as usize).min(COSINES - 2);
        let along = |row: &[f32; COSINES]| row[left] + (row[left + 1] - row[left]) * (column - left as f32);
        let (below, above) = (along(&self.rows[low]), along(&self.rows[low + 1]));
        below + (above - below) * towards
    }
}

impl fmt::Debug for AnisotropicCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AnisotropicCurve").field("weights", &self.weights).finish_non_exhaustive()
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
