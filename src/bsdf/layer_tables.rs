//! Tables of a coat over a metal: how often light meets the metal before it leaves, by the direction that it came from.
//!
//! Light that comes from outside at one direction is followed by [`super::layer_walk`]. What meets the metal once is a
//! lobe of half-way vectors that takes what the coat lets in and out as seen from outside, which forgets that the
//! coat's facets turn light beyond the critical angle: at a width of 0.2 over a smooth metal, seen at a cosine of 0.5,
//! 47 % of what has entered is still inside after the first reflection, not 21 %. The lobe is therefore scaled, by the
//! root of a share for each of both directions, until it brings out what the walk does. What it leaves is split as in
//! the walk into light that meets the metal twice and light that meets it more often.
//!
//! That walk knows no azimuth. Where facets are wider along one axis than along the other, walk and scale are means
//! over azimuths, but what the scaled lobe brings out is tabulated by azimuth, so that what it leaves is right
//! whichever way light comes.
//!
//! Own work; the split of what is missing is Kulla and Conty's.

mod building;

use self::building::CoatOver;
use super::albedo_table::TablePlace;
use super::anisotropic_table::Azimuths;
use super::coat::{Coat, CoatTables};
use super::layer_walk::{Metal, Nodes};
use super::layer_widths::{LayerWidths, Weighed, WidthNodes};
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use rayon::prelude::*;
use std::fmt;

/// Columns of the table, equally spaced in √μ: steep where light grazes.
pub(super) const COLUMNS: usize = 32;
/// Averages divide, and are never 0.
const MIN_AVERAGE: f32 = 1e-9;

/// What is tabulated, at one direction outside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LayerPoint {
    /// Share of the light that has entered which leaves after it met a lossless metal twice.
    pub(super) second: f32,
    /// Share of it which leaves after it met the metal more often.
    pub(super) later: f32,
    /// Scale of the lobe of one reflection, in [0, 1]: its root at each of both directions multiplies the lobe.
    pub(super) brought_out: f32,
    /// Mean cosine at which light meets the metal, over that behind a smooth coat; in [0, 1].
    pub(super) steeper: f32,
}

/// The table of one pair of widths.
#[derive(Clone)]
struct Cell {
    /// One where facets are isotropic, else as many as there are azimuths, from x to y.
    rows: Vec<[LayerPoint; COLUMNS]>,
    azimuths: Azimuths,
    /// Cosine-weighted averages of what enters and leaves after two reflections, or more.
    average_second: f32,
    average_later: f32,
    /// Share of what met the metal twice and is still inside that each further reflection brings out.
    later_escape: f32,
}

/// What a coat over a metal keeps after each reflection off the metal. Make one a material.
#[derive(Clone)]
pub struct LayerTables {
    pub(super) coat: CoatTables,
    coat_nodes: WidthNodes,
    base_nodes: WidthNodes,
    /// By the coat's node, then the metal's.
    cells: Vec<Cell>,
}

impl fmt::Debug for LayerTables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LayerTables").field("coat", &self.coat).finish_non_exhaustive()
    }
}

impl LayerTables {
    /// Computes the tables for a coat of relative index `eta`, at least 1, the distributions of coat and metal, and the
    /// slope widths that they may take.
    pub fn new(eta: f32, distributions: [Distribution; 2], widths: [LayerWidths; 2]) -> Self {
        let coat = CoatTables::new(eta, distributions[0]);
        let coat = match widths[0] {
            LayerWidths::Isotropic(_) => coat,
            LayerWidths::Anisotropic(ranges) => coat.with_anisotropy(ranges),
        };
        let [coat_nodes, base_nodes] = WidthNodes::of_layers(widths);
        let nodes = Nodes::new(eta);
        let bases: Vec<(Microfacets, Metal)> = base_nodes
            .facets(distributions[1])
            .map(|facets| (facets, Metal::new(&nodes, facets.rough().as_ref())))
            .collect();
        let mut cells = Vec::new();
        for facets in coat_nodes.facets(distributions[0]) {
            let over = CoatOver::new(coat.coat(facets.rough().as_ref()), &nodes);
            let cell = |(base, metal): &(Microfacets, Metal)| over.cell(*base, metal);
            cells.par_extend(bases.par_iter().map(cell));
        }
        Self { coat, coat_nodes, base_nodes, cells }
    }

    /// The tables for such facets of coat and metal.
    pub(super) fn curve(&self, coat: &Microfacets, base: &Microfacets) -> LayerCurve<'_> {
        let mut curve = LayerCurve {
            cells: [&self.cells[0]; MAX_CELLS],
            weights: [0.0; MAX_CELLS],
            average_second: 0.0,
            average_later: 0.0,
            later_escape: 0.0,
        };
        let bases = self.base_nodes.beside(base);
        let mut count = 0;
        for of_coat in self.coat_nodes.beside(coat) {
            for of_base in bases {
                let weight = of_coat.weight * of_base.weight;
                if weight > 0.0 && count < MAX_CELLS {
                    let cell = &self.cells[of_coat.index * self.base_nodes.count() + of_base.index];
                    curve.add(count, cell, weight);
                    count += 1;
                }
            }
        }
        curve.average_second = curve.average_second.max(MIN_AVERAGE);
        curve.average_later = curve.average_later.max(MIN_AVERAGE);
        curve
    }
}

/// Cosine outside of a column.
pub(super) fn cosine(column: usize) -> f32 {
    let root = column as f32 / (COLUMNS - 1) as f32;
    // Not quite grazing: at 0 nothing enters, and there is no share of nothing.
    (root * root).max(1e-5)
}

/// The direction inside the coat that is refracted to or from `w` outside.
pub(super) fn inside(w: Vec3, eta: f32) -> Vec3 {
    let (x, y) = (w.x / eta, w.y / eta);
    // Never flatter than outside, which rounding would have it be where the coat's index is 1.
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt().max(w.z))
}

/// The direction outside that is refracted to or from `w` inside, `None` under total internal reflection.
pub(super) fn outside(w: Vec3, eta: f32) -> Option<Vec3> {
    let (x, y) = (w.x * eta, w.y * eta);
    let z2 = 1.0 - x * x - y * y;
    (z2 > 0.0).then(|| Vec3::new(x, y, z2.sqrt()))
}

/// The metal's facets as they look through the coat; `None` where both are smooth.
///
/// A facet of slope m in the coat turns a ray that it lets in by (1 − 1/η)m, and again on the way out; a facet of the
/// metal by 2m. Half-way vectors inside therefore spread by α² + (1 − 1/η)² α_coat²/2.
pub(super) fn seen_through(base: Microfacets, coat: &Coat<'_>) -> Option<Microfacets> {
    let Some(coat_facets) = coat.facets else {
        return base.rough();
    };
    let turn = 1.0 - 1.0 / coat.eta;
    let widen = |alpha: f32, coat_alpha: f32| {
        (alpha * alpha + 0.5 * turn * turn * coat_alpha * coat_alpha).sqrt().max(super::MIN_ALPHA)
    };
    let ([x, y], [coat_x, coat_y]) = (base.alphas(), coat_facets.alphas());
    Some(Microfacets::new(widen(x, coat_x), widen(y, coat_y), base.distribution()))
}

/// Where a cosine outside lies between two columns.
fn place(mu: f32) -> TablePlace {
    TablePlace::of(mu.clamp(0.0, 1.0).sqrt(), COLUMNS)
}

impl Cell {
    /// The rows beside a direction outside and how much each counts.
    fn rows_beside(&self, w: Vec3) -> [Weighed; 2] {
        if self.rows.len() == 1 {
            return [Weighed { index: 0, weight: 1.0 }, Weighed::NOTHING];
        }
        let TablePlace { node: row, fraction } = self.azimuths.place(w);
        [Weighed { index: row, weight: 1.0 - fraction }, Weighed { index: row + 1, weight: fraction }]
    }

    /// Adds what is tabulated for a direction outside, whose cosine lies there between two columns.
    fn add_to(&self, sum: &mut LayerPoint, w: Vec3, column: TablePlace, weight: f32) {
        let TablePlace { node, fraction } = column;
        for Weighed { index, weight: share } in self.rows_beside(w) {
            if share > 0.0 {
                sum.add(&self.rows[index][node], weight * share * (1.0 - fraction));
                sum.add(&self.rows[index][node + 1], weight * share * fraction);
            }
        }
    }
}

/// Cells between which widths may lie: two for each width that a texture gives, of which [`WidthNodes`] has three at
/// most.
const MAX_CELLS: usize = 8;

/// The table at the widths of coat and metal: the cells beside them and their weights.
#[derive(Clone, Copy)]
pub(super) struct LayerCurve<'a> {
    cells: [&'a Cell; MAX_CELLS],
    weights: [f32; MAX_CELLS],
    /// Cosine-weighted averages of what enters and leaves after two reflections, or more; above 0.
    pub(super) average_second: f32,
    pub(super) average_later: f32,
    /// Share of what met the metal twice and is still inside that each further reflection brings out.
    pub(super) later_escape: f32,
}

impl fmt::Debug for LayerCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LayerCurve").field("weights", &self.weights).finish_non_exhaustive()
    }
}

impl<'a> LayerCurve<'a> {
    fn add(&mut self, index: usize, cell: &'a Cell, weight: f32) {
        self.cells[index] = cell;
        self.weights[index] = weight;
        self.average_second += weight * cell.average_second;
        self.average_later += weight * cell.average_later;
        self.later_escape += weight * cell.later_escape;
    }

    /// The table for a direction outside, of the upper half.
    pub(super) fn at(&self, w: Vec3) -> LayerPoint {
        let column = place(w.z);
        let mut sum = LayerPoint::default();
        for (cell, weight) in self.cells.iter().zip(self.weights) {
            // Those after the last have none.
            if weight == 0.0 {
                break;
            }
            cell.add_to(&mut sum, w, column, weight);
        }
        sum
    }
}

impl LayerPoint {
    fn add(&mut self, other: &Self, weight: f32) {
        self.second += weight * other.second;
        self.later += weight * other.later;
        self.brought_out += weight * other.brought_out;
        self.steeper += weight * other.steeper;
    }
}
