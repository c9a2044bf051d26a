//! Tables of a coat over a metal: how often light meets the metal before it leaves, by the direction that it came from.
//!
//! Light that comes from outside at one direction is followed by [`super::layer_walk`]. What meets the metal once is a lobe
//! of half-way vectors that takes what the coat lets in and out as seen from outside, which forgets that the coat's facets
//! turn light beyond the critical angle: at a width of 0.2 over a smooth metal, seen at a cosine of 0.5, 47 % of what has
//! entered is still inside after the first reflection, not 21 %. The lobe is therefore scaled, by the root of a share for each
//! of both directions, until it brings out what the walk does. What it leaves is split as in the walk into light that meets
//! the metal twice and light that meets it more often.
//!
//! Own work; the split of what is missing is Kulla and Conty's.

use super::albedo_table::{direction_at, visible_normals_and_weights};
use super::anisotropic_table::{WidthRange, place_between};
use super::coat::{Coat, CoatTables};
use super::layer_walk::{Entering, LeavingByReflections, Metal, Nodes, Underside, follow};
use super::microfacets::Microfacets;
use crate::scene::Distribution;
use glam::Vec3;
use std::fmt;

/// Columns of the table, equally spaced in √μ: steep where light grazes.
pub(super) const COLUMNS: usize = 32;
/// Roughnesses at which a texture's range is tabulated.
const NODES: usize = 12;
/// Rounds of scaling. Each halves the error, which of what has entered is up to 6 % after the first and 0.5 % after four.
const ROUNDS: usize = 4;
/// Averages divide, and are never 0.
const SMALLEST_AVERAGE: f32 = 1e-9;

/// What is tabulated, at one direction outside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LayerPoint {
    /// Share of the light that has entered which leaves after it met a lossless metal twice.
    pub(super) second: f32,
    /// Share of it which leaves after it met the metal more often.
    pub(super) later: f32,
    /// By its root at each of both directions the lobe of one reflection is scaled; in [0, 1].
    pub(super) brought_out: f32,
    /// Mean cosine at which light meets the metal, over that behind a smooth coat; in [0, 1].
    pub(super) steeper: f32,
}

/// The table of one pair of widths.
#[derive(Clone)]
struct Cell {
    points: [LayerPoint; COLUMNS],
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
    coat_nodes: usize,
    base_nodes: usize,
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
    /// mean slope widths that they may take.
    pub fn new(
        eta: f32,
        [coat_distribution, base_distribution]: [Distribution; 2],
        [coat_range, base_range]: [WidthRange; 2],
    ) -> Self {
        let coat = CoatTables::new(eta, coat_distribution);
        let (coat_alphas, base_alphas) = (coat_range.nodes(NODES), base_range.nodes(NODES));
        let nodes = Nodes::new(eta);
        let bases = base_alphas.iter().map(|&alpha| Microfacets::isotropic(alpha, base_distribution));
        let bases: Vec<(Microfacets, Metal)> =
            bases.map(|facets| (facets, Metal::new(&nodes, facets.rough().as_ref()))).collect();
        let mut cells = Vec::new();
        for &coat_alpha in &coat_alphas {
            let over = coat.coat(Microfacets::isotropic(coat_alpha, coat_distribution).rough().as_ref());
            let coat = CoatOver::new(over, &nodes);
            cells.extend(bases.iter().map(|(base, metal)| coat.cell(*base, metal)));
        }
        Self { coat, coat_nodes: coat_alphas.len(), base_nodes: base_alphas.len(), cells }
    }

    /// The tables at such mean slope widths.
    pub(super) fn curve(&self, coat_alpha: f32, base_alpha: f32) -> LayerCurve<'_> {
        let (coat_low, coat_high, c) = place_between(coat_alpha, self.coat_nodes);
        let (base_low, base_high, b) = place_between(base_alpha, self.base_nodes);
        let at = |coat: usize, base: usize| &self.cells[coat * self.base_nodes + base];
        let cells =
            [at(coat_low, base_low), at(coat_low, base_high), at(coat_high, base_low), at(coat_high, base_high)];
        let weights = [(1.0 - c) * (1.0 - b), (1.0 - c) * b, c * (1.0 - b), c * b];
        let sum = |value: fn(&Cell) -> f32| (0..4).map(|i| weights[i] * value(cells[i])).sum::<f32>();
        LayerCurve {
            cells,
            weights,
            average_second: sum(|cell| cell.average_second).max(SMALLEST_AVERAGE),
            average_later: sum(|cell| cell.average_later).max(SMALLEST_AVERAGE),
            later_escape: sum(|cell| cell.later_escape),
        }
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
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
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
        (alpha * alpha + 0.5 * turn * turn * coat_alpha * coat_alpha).sqrt().max(super::SMALLEST_ALPHA)
    };
    let ([x, y], [coat_x, coat_y]) = (base.alphas(), coat_facets.alphas());
    Some(Microfacets::new(widen(x, coat_x), widen(y, coat_y), base.distribution()))
}

/// Column below a cosine outside and how far it lies towards the next.
fn place(mu: f32) -> (usize, f32) {
    let scaled = mu.clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
    let column = (scaled as usize).min(COLUMNS - 2);
    (column, scaled - column as f32)
}

/// A coat, and what of it does not depend on the metal.
struct CoatOver<'a> {
    coat: Coat<'a>,
    entering: [Entering; COLUMNS],
    /// What light that comes evenly from outside does after it has entered.
    entering_evenly: Entering,
    underside: Underside,
    /// 2∫ passed·μ dμ over a function that is straight between columns: its weights at them.
    column_weights: [f32; COLUMNS],
}

impl<'a> CoatOver<'a> {
    fn new(coat: Coat<'a>, nodes: &Nodes) -> Self {
        let facets = coat.facets.as_ref();
        let entering: [Entering; COLUMNS] =
            std::array::from_fn(|column| nodes.entering(facets, direction_at(cosine(column))));
        let column_weights = column_weights(&coat);
        let mut entering_evenly = Entering::default();
        for (column, weight) in entering.iter().zip(column_weights) {
            entering_evenly.add(column, weight / coat.average_passed());
        }
        let underside = Underside::new(nodes, facets, coat.average_passed());
        Self { coat, entering, entering_evenly, underside, column_weights }
    }

    fn cell(&self, base: Microfacets, metal: &Metal) -> Cell {
        let leaving = follow(metal, &self.underside);
        let mut points = self.scaled_lobe(seen_through(base, &self.coat).as_ref(), &leaving);
        for (point, entering) in points.iter_mut().zip(&self.entering) {
            let kept = point.second + point.later;
            point.second = kept * leaving.second_share(entering);
            point.later = kept - point.second;
        }
        let average = |value: fn(&LayerPoint) -> f32| {
            points.iter().zip(self.column_weights).map(|(point, weight)| weight * value(point)).sum()
        };
        Cell {
            average_second: average(|point| point.second),
            average_later: average(|point| point.later),
            later_escape: leaving.later_escape(&self.entering_evenly),
            points,
        }
    }

    /// Scales the lobe of one reflection until it brings out what the walk does. All that it leaves is put into `later`.
    fn scaled_lobe(&self, seen: Option<&Microfacets>, leaving: &LeavingByReflections) -> [LayerPoint; COLUMNS] {
        let mut points: [LayerPoint; COLUMNS] = std::array::from_fn(|column| {
            let behind_smooth = inside(direction_at(cosine(column)), self.coat.eta).z;
            let steeper = (self.entering[column].mean_cosine() / behind_smooth).min(1.0);
            LayerPoint { brought_out: 1.0, steeper, ..LayerPoint::default() }
        });
        let Some(seen) = seen else {
            // The series of smooth layers is summed without this table, which is only interpolated from here.
            for (column, point) in points.iter_mut().enumerate() {
                point.later = 1.0 - self.coat.passed(direction_at(cosine(column)));
            }
            return points;
        };
        let lobe: [Vec<Reflected>; COLUMNS] = std::array::from_fn(|column| self.reflected_once(seen, cosine(column)));
        for _ in 0..ROUNDS {
            let last = points;
            for (column, point) in points.iter_mut().enumerate() {
                let wanted = leaving.first(&self.entering[column]);
                let gone = leaving_by_lobe(&lobe[column], &last, last[column].brought_out);
                point.brought_out = (point.brought_out * wanted / gone.max(SMALLEST_AVERAGE)).clamp(0.0, 1.0);
            }
        }
        let last = points;
        for (column, point) in points.iter_mut().enumerate() {
            point.later = (1.0 - leaving_by_lobe(&lobe[column], &last, last[column].brought_out)).clamp(0.0, 1.0);
        }
        points
    }

    /// Where the lobe of one reflection off a lossless metal brings light that has entered at cosine `mu`.
    fn reflected_once(&self, seen: &Microfacets, mu: f32) -> Vec<Reflected> {
        let view = inside(direction_at(mu), self.coat.eta);
        let reflected = |(weight, m): (f32, Vec3)| {
            let light = 2.0 * view.dot(m) * m - view;
            let wi = outside(light, self.coat.eta).filter(|_| light.z > 0.0)?;
            let share = weight * seen.unshadowed(view, light) * self.coat.passed(wi);
            let (column, fraction) = place(wi.z);
            Some(Reflected { share, column, fraction })
        };
        visible_normals_and_weights(seen, view).filter_map(reflected).collect()
    }
}

/// Light that leaves towards one direction.
struct Reflected {
    share: f32,
    /// Where that direction lies between columns.
    column: usize,
    fraction: f32,
}

/// Share of what has entered that the scaled lobe brings out.
fn leaving_by_lobe(lobe: &[Reflected], points: &[LayerPoint; COLUMNS], brought_out: f32) -> f32 {
    let scaled = |to: &Reflected| {
        let (low, high) = (points[to.column].brought_out, points[to.column + 1].brought_out);
        to.share * ((low + (high - low) * to.fraction) * brought_out).sqrt()
    };
    lobe.iter().map(scaled).sum()
}

/// See [`CoatOver::column_weights`]; by the midpoint rule in √μ.
fn column_weights(coat: &Coat<'_>) -> [f32; COLUMNS] {
    const STEPS: usize = 512;
    let mut weights = [0.0; COLUMNS];
    for step in 0..STEPS {
        let root = (step as f32 + 0.5) / STEPS as f32;
        let mu = root * root;
        let weight = 4.0 * root * mu * coat.passed(direction_at(mu)) / STEPS as f32;
        let (column, fraction) = place(mu);
        weights[column] += weight * (1.0 - fraction);
        weights[column + 1] += weight * fraction;
    }
    weights
}

/// The table at one pair of widths: up to four cells and their weights.
#[derive(Clone, Copy)]
pub(super) struct LayerCurve<'a> {
    cells: [&'a Cell; 4],
    weights: [f32; 4],
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

impl LayerCurve<'_> {
    /// The table at a cosine outside.
    pub(super) fn at(&self, mu: f32) -> LayerPoint {
        let (column, fraction) = place(mu);
        let mut sum = LayerPoint::default();
        for (cell, weight) in self.cells.iter().zip(self.weights) {
            if weight > 0.0 {
                sum.add(&cell.points[column], weight * (1.0 - fraction));
                sum.add(&cell.points[column + 1], weight * fraction);
            }
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
