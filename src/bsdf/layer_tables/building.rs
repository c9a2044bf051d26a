//! How the tables of a coat over a metal are made: a lobe of one reflection, scaled until it brings out what the walk
//! does.

use super::{COLUMNS, Cell, LayerPoint, MIN_AVERAGE, cosine, inside, outside, place, seen_through};
use crate::bsdf::albedo_table::{TablePlace, direction_at, visible_normals_and_weights};
use crate::bsdf::anisotropic_table::{AZIMUTHS, Azimuths};
use crate::bsdf::coat::Coat;
use crate::bsdf::layer_walk::{
    Entering, LeavingByReflections, Metal, Nodes, OverAzimuths, Underside, directions, follow,
};
use crate::bsdf::microfacets::Microfacets;
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;

/// Rounds of scaling. Each halves the error, which of what has entered is up to 6 % after the first and 0.5 % after
/// four.
const ROUNDS: usize = 4;

/// A coat, and what of it does not depend on the metal.
pub(super) struct CoatOver<'a> {
    coat: Coat<'a>,
    entering: [Entering; COLUMNS],
    /// What light that comes evenly from outside does after it has entered.
    entering_evenly: Entering,
    underside: Underside,
    /// 2∫ passed·μ dμ over a function that is straight between columns: its weights at them.
    column_weights: [f32; COLUMNS],
}

impl<'a> CoatOver<'a> {
    pub(super) fn new(coat: Coat<'a>, nodes: &Nodes) -> Self {
        let facets = coat.facets.as_ref();
        let entering: [Entering; COLUMNS] = std::array::from_fn(|column| nodes.entering(facets, cosine(column)));
        let column_weights = column_weights(&coat);
        let mut entering_evenly = Entering::default();
        for (column, weight) in entering.iter().zip(column_weights) {
            entering_evenly.add(column, weight / coat.average_passed());
        }
        let underside = Underside::new(nodes, facets, coat.average_passed());
        Self { coat, entering, entering_evenly, underside, column_weights }
    }

    pub(super) fn cell(&self, base: Microfacets, metal: &Metal) -> Cell {
        let leaving = follow(metal, &self.underside);
        let seen = seen_through(base, &self.coat);
        let mut points = self.scaled_lobe(seen.as_ref(), &leaving);
        if let Some(seen) = seen.filter(|seen| self.over_azimuths(seen) == OverAzimuths::Varying) {
            return self.by_azimuth(&seen, &points, &leaving);
        }
        for (point, entering) in points.iter_mut().zip(&self.entering) {
            point.split(leaving.second_share(entering));
        }
        let average = |value: fn(&LayerPoint) -> f32| {
            points.iter().zip(self.column_weights).map(|(point, weight)| weight * value(point)).sum()
        };
        Cell {
            average_second: average(|point| point.second),
            average_later: average(|point| point.later),
            later_escape: leaving.later_escape(&self.entering_evenly),
            rows: vec![points],
            azimuths: Azimuths::new([1.0; 2]),
        }
    }

    fn over_azimuths(&self, seen: &Microfacets) -> OverAzimuths {
        OverAzimuths::of(self.coat.facets.iter().chain([seen]))
    }

    /// The table of anisotropic facets, whose lobe is scaled as `points` say.
    fn by_azimuth(&self, seen: &Microfacets, points: &[LayerPoint; COLUMNS], leaving: &LeavingByReflections) -> Cell {
        let azimuths = Azimuths::new(seen.alphas());
        let row = |row: usize| {
            let mut along = *points;
            for (column, point) in along.iter_mut().enumerate() {
                let lobe = reflected_once(seen, &self.coat, azimuths.direction(row, cosine(column)), 1.0);
                let gone: f32 = leaving_by_lobe(&lobe.collect::<Vec<_>>(), points, point.brought_out);
                point.later = (1.0 - gone).clamp(0.0, 1.0);
                point.split(leaving.second_share(&self.entering[column]));
            }
            along
        };
        let mut cell = Cell {
            rows: (0..AZIMUTHS).map(row).collect(),
            azimuths,
            average_second: 0.0,
            average_later: 0.0,
            later_escape: leaving.later_escape(&self.entering_evenly),
        };
        [cell.average_second, cell.average_later] = cell.averages(&self.coat);
        cell
    }

    /// Scales the lobe of one reflection until it brings out what the walk does. All that it leaves is put into
    /// `later`.
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
        let over_azimuths = self.over_azimuths(seen);
        let lobe: [Vec<Reflected>; COLUMNS] = std::array::from_fn(|column| {
            directions(cosine(column), over_azimuths)
                .flat_map(|(share, wo)| reflected_once(seen, &self.coat, wo, share))
                .collect()
        });
        for _ in 0..ROUNDS {
            let last = points;
            for (column, point) in points.iter_mut().enumerate() {
                let wanted = leaving.first(&self.entering[column]);
                let gone = leaving_by_lobe(&lobe[column], &last, last[column].brought_out);
                point.brought_out = (point.brought_out * wanted / gone.max(MIN_AVERAGE)).clamp(0.0, 1.0);
            }
        }
        let last = points;
        for (column, point) in points.iter_mut().enumerate() {
            point.later = (1.0 - leaving_by_lobe(&lobe[column], &last, last[column].brought_out)).clamp(0.0, 1.0);
        }
        points
    }
}

/// Where the lobe of one reflection off a lossless metal brings so much light that has entered from `wo`.
fn reflected_once<'a>(
    seen: &'a Microfacets,
    coat: &'a Coat<'_>,
    wo: Vec3,
    entered: f32,
) -> impl Iterator<Item = Reflected> + 'a {
    let view = inside(wo, coat.eta);
    let reflected = move |(weight, m): (f32, Vec3)| {
        let light = 2.0 * view.dot(m) * m - view;
        let wi = outside(light, coat.eta).filter(|_| light.z > 0.0)?;
        let share = entered * weight * seen.unshadowed(view, light) * coat.passed(wi);
        Some(Reflected { share, column: place(wi.z) })
    };
    visible_normals_and_weights(seen, view).filter_map(reflected)
}

impl LayerPoint {
    /// Splits what the lobe of one reflection leaves, which is all in `later` so far.
    fn split(&mut self, second_share: f32) {
        let kept = self.second + self.later;
        self.second = kept * second_share;
        self.later = kept - self.second;
    }
}

impl Cell {
    /// 1/π times the integrals over the hemisphere of what enters and leaves after two reflections, or more, weighted
    /// by the cosine; by the midpoint rule in √μ and in azimuth.
    fn averages(&self, coat: &Coat<'_>) -> [f32; 2] {
        const AZIMUTH_STEPS: usize = 48;
        const COSINE_STEPS: usize = 128;
        let mut sums = [0.0f64; 2];
        for azimuth in 0..AZIMUTH_STEPS {
            let (sin, cos) = (FRAC_PI_2 * (azimuth as f32 + 0.5) / AZIMUTH_STEPS as f32).sin_cos();
            for step in 0..COSINE_STEPS {
                let root = (step as f32 + 0.5) / COSINE_STEPS as f32;
                let mu = root * root;
                let radius = (1.0 - mu * mu).max(0.0).sqrt();
                let w = Vec3::new(radius * cos, radius * sin, mu);
                let weight = f64::from(4.0 * root * mu * coat.passed(w));
                let mut point = LayerPoint::default();
                self.add_to(&mut point, w, place(mu), 1.0);
                sums[0] += weight * f64::from(point.second);
                sums[1] += weight * f64::from(point.later);
            }
        }
        sums.map(|sum| (sum / (AZIMUTH_STEPS * COSINE_STEPS) as f64) as f32)
    }
}

/// Light that leaves towards one direction.
struct Reflected {
    share: f32,
    /// Where that direction lies between columns.
    column: TablePlace,
}

/// Share of what has entered that the scaled lobe brings out.
fn leaving_by_lobe(lobe: &[Reflected], points: &[LayerPoint; COLUMNS], brought_out: f32) -> f32 {
    let scaled = |to: &Reflected| {
        let TablePlace { node, fraction } = to.column;
        let (low, high) = (points[node].brought_out, points[node + 1].brought_out);
        to.share * ((low + (high - low) * fraction) * brought_out).sqrt()
    };
    lobe.iter().map(scaled).sum()
}

/// See [`CoatOver::column_weights`]; by the midpoint rule in √μ.
fn column_weights(coat: &Coat<'_>) -> [f32; COLUMNS] {
    const STEPS: usize = 512;
    let over_azimuths = OverAzimuths::of(&coat.facets);
    let mut weights = [0.0; COLUMNS];
    for step in 0..STEPS {
        let root = (step as f32 + 0.5) / STEPS as f32;
        let mu = root * root;
        let passed: f32 = directions(mu, over_azimuths).map(|(share, w)| share * coat.passed(w)).sum();
        let weight = 4.0 * root * mu * passed / STEPS as f32;
        let TablePlace { node: column, fraction } = place(mu);
        weights[column] += weight * (1.0 - fraction);
        weights[column + 1] += weight * fraction;
    }
    weights
}
