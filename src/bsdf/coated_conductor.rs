//! Lacquered or anodised metal: a clear dielectric coat over a conductor, either of them smooth or rough.
//!
//! Parameters: `eta` and `k`, the metal's index of refraction per linear RGB channel relative to air; its facets and the
//! coat's; tables for the coat's index of refraction (at least 1) and for both roughnesses.
//!
//! Light is reflected by the coat's face, or refracted into the coat, reflected once by the metal and refracted out again
//! (exact for a smooth coat; a rough one widens the metal's facets by half the variance that its slopes give to refracted
//! rays, twice), or goes to and fro between coat and metal, which a diffuse-like lobe of exactly the missing energy stands
//! for: reciprocal, and lossless over a lossless metal. With both smooth the series of reflections is summed exactly.
//!
//! Sources: own combination of the half-way vectors of B. Walter et al. (2007), the compensation of C. Kulla & A. Conty
//! (2017) and the series of plane layers, F + T²R/(1 − FR). Not for tinted or thick coats.

use super::albedo_table::{average_over_visible_normals, direction_at};
use super::anisotropic_table::{WidthRange, place_between};
use super::coat::{Coat, CoatTables};
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::{BsdfEvaluation, BsdfSample, fresnel, to_front, turn, warp};
use crate::scene::Distribution;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;
use std::fmt;

/// Columns of the table, equally spaced in √μ: steep where light grazes.
const COLUMNS: usize = 32;
/// Roughnesses at which a texture's range is tabulated.
const NODES: usize = 12;

/// What a coat over a metal keeps after one reflection off the metal. Make one a material.
#[derive(Clone)]
pub struct LayerTables {
    coat: CoatTables,
    coat_nodes: usize,
    base_nodes: usize,
    /// By the coat's node, then the metal's: share of the light that has entered which one reflection off a lossless metal
    /// does not bring out again.
    kept: Vec<[f32; COLUMNS]>,
    /// Cosine-weighted average of that share times what enters.
    average_kept: Vec<f32>,
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
        let mut kept = Vec::new();
        let mut average_kept = Vec::new();
        for &coat_alpha in &coat_alphas {
            let over = coat.coat(Microfacets::isotropic(coat_alpha, coat_distribution).rough().as_ref());
            for &base_alpha in &base_alphas {
                let base = seen_through(Microfacets::isotropic(base_alpha, base_distribution), &over);
                let row: [f32; COLUMNS] =
                    std::array::from_fn(|column| kept_share(&over, base.as_ref(), cosine(column)));
                average_kept.push(average(&row, &over));
                kept.push(row);
            }
        }
        Self { coat, coat_nodes: coat_alphas.len(), base_nodes: base_alphas.len(), kept, average_kept }
    }
}

fn cosine(column: usize) -> f32 {
    let root = column as f32 / (COLUMNS - 1) as f32;
    // Not quite grazing: at 0 nothing enters, and there is no share of nothing.
    (root * root).max(1e-5)
}

/// The direction inside the coat that is refracted to or from `w` outside.
fn inside(w: Vec3, eta: f32) -> Vec3 {
    let (x, y) = (w.x / eta, w.y / eta);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// The direction outside that is refracted to or from `w` inside, `None` under total internal reflection.
fn outside(w: Vec3, eta: f32) -> Option<Vec3> {
    let (x, y) = (w.x * eta, w.y * eta);
    let z2 = 1.0 - x * x - y * y;
    (z2 > 0.0).then(|| Vec3::new(x, y, z2.sqrt()))
}

/// The metal's facets as they look through the coat; `None` where both are smooth.
///
/// A facet of slope m in the coat turns a ray that it lets in by (1 − 1/η)m, and again on the way out; a facet of the
/// metal by 2m. Half-way vectors inside therefore spread by α² + (1 − 1/η)² α_coat²/2.
fn seen_through(base: Microfacets, coat: &Coat<'_>) -> Option<Microfacets> {
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

/// Share of entered light that comes at cosine `mu` and is not out again after one reflection off a lossless metal.
fn kept_share(coat: &Coat<'_>, base: Option<&Microfacets>, mu: f32) -> f32 {
    let wo = direction_at(mu);
    let Some(base) = base else {
        return 1.0 - coat.passed(wo);
    };
    let view = inside(wo, coat.eta);
    let gone = average_over_visible_normals(base, view, |m| {
        let reflected = 2.0 * view.dot(m) * m - view;
        match outside(reflected, coat.eta) {
            Some(wi) if reflected.z > 0.0 => base.unshadowed(view, reflected) * coat.passed(wi),
            _ => 0.0,
        }
    });
    (1.0 - gone).clamp(0.0, 1.0)
}

fn interpolate(row: &[f32; COLUMNS], mu: f32) -> f32 {
    let scaled = mu.clamp(0.0, 1.0).sqrt() * (COLUMNS - 1) as f32;
    let column = (scaled as usize).min(COLUMNS - 2);
    row[column] + (row[column + 1] - row[column]) * (scaled - column as f32)
}

/// 2∫ kept·passed·μ dμ by the midpoint rule in √μ.
fn average(row: &[f32; COLUMNS], coat: &Coat<'_>) -> f32 {
    const STEPS: usize = 512;
    let sum: f32 = (0..STEPS)
        .map(|step| {
            let root = (step as f32 + 0.5) / STEPS as f32;
            let mu = root * root;
            4.0 * root * mu * interpolate(row, mu) * coat.passed(direction_at(mu))
        })
        .sum();
    sum / STEPS as f32
}

/// Up to four rows of the table and their weights.
#[derive(Clone, Copy)]
struct Kept<'a> {
    rows: [&'a [f32; COLUMNS]; 4],
    weights: [f32; 4],
    average: f32,
}

impl fmt::Debug for Kept<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Kept").field("weights", &self.weights).finish_non_exhaustive()
    }
}

impl LayerTables {
    fn kept(&self, coat_alpha: f32, base_alpha: f32) -> Kept<'_> {
        let (coat_low, coat_high, coat_fraction) = place_between(coat_alpha, self.coat_nodes);
        let (base_low, base_high, base_fraction) = place_between(base_alpha, self.base_nodes);
        let at = |coat: usize, base: usize| coat * self.base_nodes + base;
        let places =
            [at(coat_low, base_low), at(coat_low, base_high), at(coat_high, base_low), at(coat_high, base_high)];
        let (c, b) = (coat_fraction, base_fraction);
        let weights = [(1.0 - c) * (1.0 - b), (1.0 - c) * b, c * (1.0 - b), c * b];
        Kept {
            rows: places.map(|place| &self.kept[place]),
            weights,
            average: (0..4).map(|i| weights[i] * self.average_kept[places[i]]).sum::<f32>().max(1e-9),
        }
    }
}

impl Kept<'_> {
    fn at(&self, mu: f32) -> f32 {
        let mut sum = 0.0;
        for (row, weight) in self.rows.iter().zip(self.weights) {
            if weight > 0.0 {
                sum += weight * interpolate(row, mu);
            }
        }
        sum
    }
}

/// A clear coat over a metal.
#[derive(Clone, Copy, Debug)]
pub struct CoatedConductor<'a> {
    coat: Coat<'a>,
    /// The metal's index relative to the coat.
    eta: Vec3,
    k: Vec3,
    /// The metal as seen through the coat; `None` where both are smooth.
    rough: Option<Rough<'a>>,
}

/// What there is if coat or metal are rough.
#[derive(Clone, Copy, Debug)]
struct Rough<'a> {
    base: Microfacets,
    kept: Kept<'a>,
    /// Reflectance of light that met the metal twice or more.
    multiple: Vec3,
}

/// Probabilities of the coat's face, one reflection off the metal, and the rest.
struct Shares {
    coat: f32,
    single: f32,
    multiple: f32,
}

impl<'a> CoatedConductor<'a> {
    /// The metal's index relative to air, the facets of metal and coat, and the tables of both.
    pub fn new(eta: Vec3, k: Vec3, base: Microfacets, coat_facets: Microfacets, tables: &'a LayerTables) -> Self {
        let coat = tables.coat.coat(coat_facets.rough().as_ref());
        let (eta, k) = (eta / coat.eta, k / coat.eta);
        let rough = seen_through(base, &coat).map(|seen| {
            let kept = tables.kept(coat_facets.mean_alpha(), base.mean_alpha());
            let fresnel = fresnel::conductor_average(eta, k);
            let turned_back = (kept.average / coat.average_passed()).clamp(0.0, 1.0);
            let multiple = fresnel * fresnel * (1.0 - turned_back) / (Vec3::ONE - fresnel * turned_back);
            Rough { base: seen, kept, multiple }
        });
        Self { coat, eta, k, rough }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.rough.is_some()
    }

    fn shares(&self, rough: &Rough<'_>, wo: Vec3) -> Shares {
        let passed = self.coat.passed(wo);
        let kept = rough.kept.at(wo.z);
        let fresnel = fresnel::conductor(inside(wo, self.coat.eta).z, self.eta, self.k).max_element();
        let coat = 1.0 - passed;
        let single = passed * (1.0 - kept) * fresnel;
        let multiple = passed * kept * rough.multiple.max_element();
        let total = coat + single + multiple;
        if total > 0.0 {
            Shares { coat: coat / total, single: single / total, multiple: multiple / total }
        } else {
            Shares { coat: 1.0, single: 0.0, multiple: 0.0 }
        }
    }

    fn evaluate_front(&self, rough: &Rough<'_>, shares: &Shares, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let eta = self.coat.eta;
        let passed = self.coat.passed(wo) * self.coat.passed(wi);
        let multiple = passed * rough.kept.at(wo.z) * rough.kept.at(wi.z) * wi.z * FRAC_1_PI / rough.kept.average;
        let mut value = rough.multiple * multiple;
        let mut pdf = shares.multiple * warp::cosine_hemisphere_pdf(wi.z);

        let (view, light) = (inside(wo, eta), inside(wi, eta));
        let facet = rough.base.reflect(view, light);
        // Steradians inside per steradian outside.
        let jacobian = wi.z / (eta * eta * light.z);
        value += fresnel::conductor(facet.cos_half, self.eta, self.k) * (passed * facet.value * jacobian);
        pdf += shares.single * facet.pdf * jacobian;

        if let Some(facets) = &self.coat.facets {
            let facet = facets.reflect(wo, wi);
            value += Vec3::splat(fresnel::dielectric(facet.cos_half, eta).reflectance * facet.value);
            pdf += shares.coat * facet.pdf;
        }
        BsdfEvaluation { value, pdf }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        match &self.rough {
            Some(rough) if wo.z > 0.0 && wi.z > 0.0 => self.evaluate_front(rough, &self.shares(rough, wo), wo, wi),
            _ => BsdfEvaluation::BLACK,
        }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let mirrored = reflect_about_normal(wo);
        let Some(rough) = &self.rough else {
            return Some(BsdfSample::reflected_delta(mirrored, self.smooth_reflectance(front), 1.0));
        };
        let shares = self.shares(rough, front);
        let point = [u[0], u[1]];
        let wi = if u[2] < shares.coat {
            match &self.coat.facets {
                Some(facets) => facets.sample_reflection(front, point)?,
                None => {
                    let weight = Vec3::splat(self.coat.reflectance(front) / shares.coat);
                    return Some(BsdfSample::reflected_delta(mirrored, weight, shares.coat));
                }
            }
        } else if u[2] < shares.coat + shares.single {
            let light = rough.base.sample_reflection(inside(front, self.coat.eta), point)?;
            outside(light, self.coat.eta)?
        } else {
            warp::cosine_hemisphere(point)
        };
        self.evaluate_front(rough, &shares, front, wi).sample_turned(wi, wo)
    }

    /// The sum of all reflections between two smooth faces.
    fn smooth_reflectance(&self, wo: Vec3) -> Vec3 {
        let face = self.coat.reflectance(wo);
        let metal = fresnel::conductor(inside(wo, self.coat.eta).z, self.eta, self.k);
        Vec3::splat(face) + metal * ((1.0 - face) * (1.0 - face)) / (Vec3::ONE - metal * face).max(Vec3::splat(1e-6))
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let (up, _) = to_front(wo, wo);
        match &self.rough {
            None => self.smooth_reflectance(up),
            Some(rough) => {
                let passed = self.coat.passed(up);
                let kept = rough.kept.at(up.z);
                let metal = fresnel::conductor(inside(up, self.coat.eta).z, self.eta, self.k);
                Vec3::splat(1.0 - passed) + passed * (metal * (1.0 - kept) + rough.multiple * kept)
            }
        }
    }
}
