//! Tables of the light that single scattering off microfacets keeps, and what is needed to give the rest back.
//!
//! A microfacet model follows light to its first facet only; what the shadowing term removes has in truth gone on to
//! another facet. Kulla & Conty add a diffuse-like lobe of exactly the missing energy,
//! (1 − E(μo))(1 − E(μi)) / (π(1 − E_avg)), where E(μ) is the directional albedo of single scattering at incident cosine
//! μ and E_avg = 2∫E(μ)μ dμ: reciprocal by its symmetry and lossless by its norm, whatever the interpolation error of
//! the table at μi.
//!
//! Sources: C. Kulla & A. Conty, *Revisiting physically based shading at Imageworks* (SIGGRAPH course 2017), the
//! compensation, its tint and the split for dielectrics; C. Kelemen & L. Szirmay-Kalos (2001) for the form; S. Hill, *A
//! multi-faceted exploration* (2018) for the tint's squared F_avg. The tables are computed here, by quadrature over visible normals.

use super::fresnel;
use super::ggx::Ggx;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};
use std::fmt;
use std::sync::LazyLock;

/// Rows of a table, equally spaced in roughness over [0, 1].
const ROUGHNESS_NODES: usize = 32;
/// Columns of a table.
const COSINE_NODES: usize = 40;
/// Nodes of the averages, a multiple of the rows' spacing apart so that every row is one.
const AVERAGE_NODES: usize = 4 * (ROUGHNESS_NODES - 1) + 1;

/// Most of the samples that may go to single scattering. The rest keeps the compensation reachable where the energy
/// that it gives back is too small for single precision to tell 1 − E from 0.
pub(crate) const LARGEST_SINGLE_SHARE: f32 = 0.9999;

/// A directional albedo, or one less it, as a function of cosine and roughness.
#[derive(Clone)]
pub(crate) struct AlbedoTable {
    rows: [[f32; COSINE_NODES]; ROUGHNESS_NODES],
    /// 2∫ of the curve at each of more closely spaced roughnesses times μ dμ, over roughness⁴ = α². The average falls like α² towards smooth surfaces, where linear
    /// interpolation of the average itself would be wrong by a tenth; of the ratio it is not.
    averages_over_alpha2: [f32; AVERAGE_NODES],
}

/// An [`AlbedoTable`] at one roughness.
#[derive(Clone, Copy)]
pub(crate) struct AlbedoCurve<'a> {
    lower: &'a [f32; COSINE_NODES],
    upper: &'a [f32; COSINE_NODES],
    fraction: f32,
    alpha: f32,
    average: f32,
}

/// Quadrature points over the cap of visible normals.
const POINTS: usize = 400;

/// A point of quadrature.
struct Point {
    /// Height on the cap as a uniform number.
    u: f32,
    /// Sine and cosine of the azimuth.
    azimuth: (f32, f32),
    weight: f32,
}

/// A Fibonacci lattice over azimuth and s, where u = s²(3 − 2s) smooths the square roots at both ends of the cap.
///
/// No two points share a height or an azimuth: total internal reflection has an edge in the integrand, on which a grid
/// of as many points would be wrong by 1 %. The weights sum to 1, so that a constant comes out exact.
static QUADRATURE: LazyLock<[Point; POINTS]> = LazyLock::new(|| {
    const GOLDEN: f32 = 0.618_034;
    let height = |index: usize| (index as f32 + 0.5) / POINTS as f32;
    let weight = |s: f32| s * (1.0 - s);
    let total: f32 = (0..POINTS).map(|index| weight(height(index))).sum();
    std::array::from_fn(|index| {
        let s = height(index);
        Point {
            u: s * s * (3.0 - 2.0 * s),
            azimuth: (TAU * (index as f32 * GOLDEN).fract()).sin_cos(),
            weight: weight(s) / total,
        }
    })
});

/// Where the columns lie: t = (√(μ(1 + α)/(μ + α)) + μ)/2.
///
/// Masking depends on μ/α at grazing angles: the root follows the dip of E there at every roughness, down to its steep
/// start at μ = 0, where equal steps of μ would miss it when the surface is nearly smooth. The other half of the columns
/// is equally spaced, for what depends on μ alone, such as total internal reflection.
fn column_of_cosine(mu: f32, alpha: f32) -> f32 {
    0.5 * ((mu * (1.0 + alpha) / (mu + alpha)).sqrt() + mu)
}

/// Inverse of [`column_of_cosine`], by bisection.
fn cosine_of_column(t: f32, alpha: f32) -> f32 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if column_of_cosine(middle, alpha) < t {
            low = middle;
        } else {
            high = middle;
        }
    }
    if t >= 1.0 { 1.0 } else { 0.5 * (low + high) }
}

fn node(index: usize, count: usize) -> f32 {
    index as f32 / (count - 1) as f32
}

/// Roughness of a node. That of the first is not quite 0: models do not use the table there, but interpolate from it.
fn node_roughness(index: usize, count: usize) -> f32 {
    node(index, count).max(1e-2)
}

impl AlbedoTable {
    /// Tabulates `albedo(cosine, α)`.
    fn new(albedo: impl Fn(f32, f32) -> f32) -> Self {
        let rows = std::array::from_fn(|row| {
            let roughness = node_roughness(row, ROUGHNESS_NODES);
            let alpha = roughness * roughness;
            std::array::from_fn(|column| albedo(cosine_of_column(node(column, COSINE_NODES), alpha), alpha))
        });
        let mut table = Self { rows, averages_over_alpha2: [0.0; AVERAGE_NODES] };
        table.averages_over_alpha2 = std::array::from_fn(|index| {
            let roughness = node_roughness(index, AVERAGE_NODES);
            cosine_average(&table.curve(roughness)) / roughness.powi(4)
        });
        table
    }

    /// The table at `roughness` in [0, 1].
    pub(crate) fn curve(&self, roughness: f32) -> AlbedoCurve<'_> {
        let (row, fraction) = position(roughness, ROUGHNESS_NODES);
        let (average, average_fraction) = position(roughness, AVERAGE_NODES);
        let alpha = roughness * roughness;
        AlbedoCurve {
            lower: &self.rows[row],
            upper: &self.rows[row + 1],
            fraction,
            alpha,
            average: alpha
                * alpha
                * lerp(self.averages_over_alpha2[average], self.averages_over_alpha2[average + 1], average_fraction),
        }
    }
}

impl AlbedoCurve<'_> {
    /// The value at an incident cosine in (0, 1].
    pub(crate) fn at(&self, mu: f32) -> f32 {
        let t = column_of_cosine(mu.max(f32::MIN_POSITIVE), self.alpha);
        let (column, fraction) = position(t, COSINE_NODES);
        lerp(
            lerp(self.lower[column], self.lower[column + 1], fraction),
            lerp(self.upper[column], self.upper[column + 1], fraction),
            self.fraction,
        )
    }

    /// 2∫ of the curve times μ dμ.
    pub(crate) fn average(&self) -> f32 {
        self.average
    }

    /// The average of a curve of missing energy, never 0 since it divides.
    pub(crate) fn missing_average(&self) -> f32 {
        self.average.max(1e-9)
    }
}

/// Kulla and Conty's lobe without its tint, times cos θi: the light that single scattering loses, given by `missing` = 1 − E.
pub(crate) fn missing_lobe(missing: &AlbedoCurve<'_>, cos_o: f32, cos_i: f32) -> f32 {
    missing.at(cos_o) * missing.at(cos_i) * cos_i * FRAC_1_PI / missing.missing_average()
}

/// Tint of light that bounced off two or more facets of average reflectance `fresnel`; 1 for a lossless metal.
pub(crate) fn multiple_bounce_tint(fresnel: Vec3, albedo_average: f32) -> Vec3 {
    fresnel * fresnel * albedo_average / (Vec3::ONE - fresnel * (1.0 - albedo_average))
}

/// What reflection off GGX facets keeps after one bounce.
pub(crate) struct GgxTables {
    /// 1 − E, of facets that reflect everything.
    pub(crate) missing: AlbedoTable,
    /// Albedo of facets that reflect Schlick's (1 − wo·h)⁵, less (1 − μ)⁵: what is left is smooth even where the columns
    /// are wide apart. See [`SchlickCurve`].
    pub(crate) schlick: AlbedoTable,
}

/// The tables of reflection, made on first use.
pub(crate) static GGX: LazyLock<GgxTables> = LazyLock::new(|| {
    let reflect_with = |quantity: fn(f32, f32, f32) -> f32| {
        AlbedoTable::new(move |mu, alpha| {
            let ggx = Ggx::isotropic(alpha);
            average_over_visible_normals(&ggx, mu, |wo, m| {
                let cos = wo.dot(m);
                quantity(cos, mu, reflected(&ggx, wo, m))
            })
        })
    };
    GgxTables {
        missing: reflect_with(|_, _, unshadowed| 1.0 - unshadowed),
        schlick: reflect_with(|cos, mu, unshadowed| {
            fresnel::schlick_weight(cos) * unshadowed - fresnel::schlick_weight(mu)
        }),
    }
});

/// Albedo of facets that reflect Schlick's (1 − wo·h)⁵ at one roughness: the part S of a GGX lobe's albedo
/// F0·E + (1 − F0)·S.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SchlickCurve {
    above_smooth: AlbedoCurve<'static>,
}

impl SchlickCurve {
    /// S at `roughness` in [0, 1].
    pub(crate) fn new(roughness: f32) -> Self {
        Self { above_smooth: GGX.schlick.curve(roughness) }
    }

    /// S at an incident cosine in (0, 1].
    pub(crate) fn at(&self, mu: f32) -> f32 {
        (self.above_smooth.at(mu) + fresnel::schlick_weight(mu)).max(0.0)
    }

    /// 2∫S(μ)μ dμ.
    pub(crate) fn average(&self) -> f32 {
        self.above_smooth.average + fresnel::SCHLICK_AVERAGE
    }
}

/// What a rough dielectric boundary of one index keeps after one facet, for both sides, and how what it loses is split
/// between reflection and transmission. Make one per index of refraction and share it.
#[derive(Clone)]
pub struct DielectricTables {
    eta: f32,
    /// 1 − E of reflection and transmission together, by energy, for light that arrives from outside.
    outside: AlbedoTable,
    /// The same for light that arrives from inside.
    inside: AlbedoTable,
    /// Average transmittance of a smooth boundary times the squared index of the side that light comes from: the same
    /// for both sides.
    throughput: f32,
}

/// The compensation of a dielectric at one roughness, for a path that is on one side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DielectricCompensation<'a> {
    /// Energy that single scattering loses on the path's side.
    pub(crate) near: AlbedoCurve<'a>,
    /// The same on the other side.
    pub(crate) far: AlbedoCurve<'a>,
    /// Share of the missing energy that is transmitted; the rest is reflected.
    pub(crate) transmitted_share: f32,
}

// Tables are not for reading: the parameters that they were made for are.
impl fmt::Debug for DielectricTables {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DielectricTables").field("eta", &self.eta).finish_non_exhaustive()
    }
}

impl fmt::Debug for AlbedoCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AlbedoCurve")
            .field("alpha", &self.alpha)
            .field("average", &self.average)
            .finish_non_exhaustive()
    }
}

impl DielectricTables {
    /// Computes the tables for a relative index `eta_inside_over_outside` above 0.
    pub fn new(eta_inside_over_outside: f32) -> Self {
        let eta = eta_inside_over_outside;
        let side = |eta: f32| {
            AlbedoTable::new(move |mu, alpha| {
                let ggx = Ggx::isotropic(alpha);
                average_over_visible_normals(&ggx, mu, |wo, m| {
                    let cos = wo.dot(m).max(0.0);
                    let boundary = fresnel::dielectric(cos, eta);
                    let reflectance = boundary.reflectance;
                    let through = transmitted(&ggx, wo, m, eta, boundary.cos_transmitted);
                    1.0 - reflectance * reflected(&ggx, wo, m) - (1.0 - reflectance) * through
                })
            })
        };
        let (outside, inside) = rayon::join(|| side(eta), || side(1.0 / eta));
        Self { eta, outside, inside, throughput: 1.0 - dielectric_average(eta) }
    }

    /// The relative index that the tables were made for.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// The compensation at `roughness` for a path that is outside or inside.
    ///
    /// Reciprocity asks that b·(1 − E_avg)·η² be the same for both sides, b being the transmitted share. Kulla and Conty
    /// leave one number free; it is set so that b is the smooth boundary's average transmittance on the side that loses
    /// less, which keeps b in [0, 1] on both.
    pub(crate) fn compensation(&self, roughness: f32, outside: bool) -> DielectricCompensation<'_> {
        let outer = self.outside.curve(roughness);
        let inner = self.inside.curve(roughness);
        let (near, far, index) = if outside { (outer, inner, 1.0) } else { (inner, outer, self.eta) };
        let transmittance = self.throughput / (index * index);
        DielectricCompensation {
            near,
            far,
            transmitted_share: transmittance * (far.missing_average() / near.missing_average()).min(1.0),
        }
    }
}

/// Average reflectance 2∫F(μ)μ dμ of a smooth dielectric boundary, by the midpoint rule in μ².
fn dielectric_average(eta: f32) -> f32 {
    const STEPS: usize = 1024;
    let sum: f32 = (0..STEPS)
        .map(|step| {
            let mu2 = (step as f32 + 0.5) / STEPS as f32;
            fresnel::dielectric(mu2.sqrt(), eta).reflectance
        })
        .sum();
    sum / STEPS as f32
}

/// Share of light that leaves after being reflected by facet `m`.
fn reflected(ggx: &Ggx, wo: Vec3, m: Vec3) -> f32 {
    let wi = 2.0 * wo.dot(m) * m - wo;
    if wi.z > 0.0 { ggx.unshadowed(wo, wi) } else { 0.0 }
}

/// Share of light that leaves on the other side after being refracted by facet `m`.
fn transmitted(ggx: &Ggx, wo: Vec3, m: Vec3, eta: f32, cos_transmitted: f32) -> f32 {
    let wi = m * (wo.dot(m) / eta - cos_transmitted) - wo / eta;
    if wi.z < 0.0 { ggx.unshadowed(wo, super::turn(wi)) } else { 0.0 }
}

/// Mean of `f(wo, m)` over the facet normals m visible from `wo` at cosine `mu`.
fn average_over_visible_normals(ggx: &Ggx, mu: f32, f: impl Fn(Vec3, Vec3) -> f32) -> f32 {
    let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let cap = ggx.visible_cap(wo);
    QUADRATURE.iter().map(|point| point.weight * f(wo, cap.normal(point.azimuth, point.u))).sum()
}

/// 2∫curve(μ)μ dμ, by three-point Gauss–Legendre quadrature on every interval of the table.
fn cosine_average(curve: &AlbedoCurve<'_>) -> f32 {
    const NODES: [(f32, f32); 3] = [(0.112_701_67, 0.277_777_8), (0.5, 0.444_444_45), (0.887_298_35, 0.277_777_8)];
    let mut sum = 0.0;
    let mut low = 0.0;
    for column in 1..COSINE_NODES {
        let high = cosine_of_column(node(column, COSINE_NODES), curve.alpha);
        for (at, weight) in NODES {
            let mu = low + (high - low) * at;
            sum += 2.0 * (high - low) * weight * mu * curve.at(mu);
        }
        low = high;
    }
    sum
}

/// Index of the node below `x` in [0, 1] and how far `x` lies towards the next.
fn position(x: f32, nodes: usize) -> (usize, f32) {
    let scaled = x.clamp(0.0, 1.0) * (nodes - 1) as f32;
    let index = (scaled as usize).min(nodes - 2);
    (index, scaled - index as f32)
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}
