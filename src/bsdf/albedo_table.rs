//! Tables of directional albedos over cosine and roughness, and the quadrature that fills them.
//!
//! Own work; the columns' spacing and the lattice are explained where they stand.

use super::anisotropic_table::{AnisotropicCurve, AnisotropicTable};
use super::microfacets::Microfacets;
use glam::Vec3;
use std::fmt;
use std::sync::LazyLock;

/// Rows of a table, equally spaced in roughness over [0, 1].
const ROUGHNESS_NODES: usize = 32;
/// Columns of a table.
const COSINE_NODES: usize = 40;
/// Nodes of the averages, a multiple of the rows' spacing apart so that every row is one.
const AVERAGE_NODES: usize = 4 * (ROUGHNESS_NODES - 1) + 1;

/// A directional albedo, or one less it, as a function of cosine and roughness.
#[derive(Clone)]
pub(crate) struct AlbedoTable {
    rows: [[f32; COSINE_NODES]; ROUGHNESS_NODES],
    /// 2∫ of the curve at each of more closely spaced roughnesses times μ dμ, over roughness⁴ = α². The average
    /// falls like α² towards smooth surfaces, where linear interpolation of the average itself would be wrong by a
    /// tenth; of the ratio it is not.
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
    /// Uniform numbers from which a visible normal is made.
    u: [f32; 2],
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
        Point { u: [(index as f32 * GOLDEN).fract(), s * s * (3.0 - 2.0 * s)], weight: weight(s) / total }
    })
});

/// Where the columns lie: t = (√(μ(1 + α)/(μ + α)) + μ)/2.
///
/// Masking depends on μ/α at grazing angles: the root follows the dip of E there at every roughness, down to its steep
/// start at μ = 0, where equal steps of μ would miss it when the surface is nearly smooth. The other half of the
/// columns is equally spaced, for what depends on μ alone, such as total internal reflection.
pub(super) fn column_of_cosine(mu: f32, alpha: f32) -> f32 {
    0.5 * ((mu * (1.0 + alpha) / (mu + alpha)).sqrt() + mu)
}

/// Inverse of [`column_of_cosine`], by bisection.
pub(super) fn cosine_of_column(t: f32, alpha: f32) -> f32 {
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
    pub(crate) fn new(albedo: impl Fn(f32, f32) -> f32) -> Self {
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
        let TablePlace { node, fraction } = position(roughness, ROUGHNESS_NODES);
        let average = position(roughness, AVERAGE_NODES).value(&self.averages_over_alpha2);
        let alpha = roughness * roughness;
        AlbedoCurve {
            lower: &self.rows[node],
            upper: &self.rows[node + 1],
            fraction,
            alpha,
            average: alpha * alpha * average,
        }
    }
}

impl AlbedoCurve<'_> {
    /// The value at an incident cosine in (0, 1].
    pub(crate) fn at(&self, mu: f32) -> f32 {
        let t = column_of_cosine(mu.max(f32::MIN_POSITIVE), self.alpha);
        let column = position(t, COSINE_NODES);
        lerp(column.value(self.lower), column.value(self.upper), self.fraction)
    }
}

/// An [`AlbedoTable`] for facets that may be wider along one axis than along the other.
#[derive(Clone, Copy)]
pub(crate) struct DirectionalCurve<'a> {
    isotropic: AlbedoCurve<'a>,
    anisotropic: Option<AnisotropicCurve<'a>>,
    average: f32,
}

impl AlbedoTable {
    /// The table for such facets. Where they are anisotropic and no table of their own is given, their mean width
    /// counts, which is wrong by a tenth at widths of 4 to 1.
    pub(crate) fn along<'a>(
        &'a self,
        facets: &Microfacets,
        anisotropic: Option<&'a AnisotropicTable>,
    ) -> DirectionalCurve<'a> {
        let isotropic = self.curve(facets.mean_alpha().sqrt());
        match anisotropic.filter(|_| !facets.is_isotropic()) {
            None => DirectionalCurve { isotropic, anisotropic: None, average: isotropic.average },
            Some(table) => {
                let curve = table.curve(facets.alphas());
                DirectionalCurve { isotropic, anisotropic: Some(curve), average: curve.average() }
            }
        }
    }
}

impl DirectionalCurve<'_> {
    /// The value for a direction of the upper half.
    pub(crate) fn at(&self, w: Vec3) -> f32 {
        match &self.anisotropic {
            None => self.isotropic.at(w.z),
            Some(curve) => curve.at(w),
        }
    }

    /// 1/π times the integral over the hemisphere, weighted by the cosine.
    pub(crate) fn average(&self) -> f32 {
        self.average
    }

    /// The average of a curve of missing energy, never 0 since it divides.
    pub(crate) fn missing_average(&self) -> f32 {
        self.average.max(1e-9)
    }
}

impl fmt::Debug for DirectionalCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DirectionalCurve").field("isotropic", &self.isotropic).finish_non_exhaustive()
    }
}

/// Two tables side by side: what is looked up together is found together, for one computation of the place.
pub(crate) struct PairTable {
    rows: Vec<[[f32; 2]; COSINE_NODES]>,
    averages_over_alpha2: Vec<[f32; 2]>,
}

/// A [`PairTable`] at one roughness.
#[derive(Clone, Copy)]
pub(crate) struct PairCurve<'a> {
    lower: &'a [[f32; 2]; COSINE_NODES],
    upper: &'a [[f32; 2]; COSINE_NODES],
    fraction: f32,
    alpha: f32,
    averages: [f32; 2],
}

impl PairTable {
    pub(crate) fn new(first: &AlbedoTable, second: &AlbedoTable) -> Self {
        let rows = (0..ROUGHNESS_NODES)
            .map(|row| std::array::from_fn(|column| [first.rows[row][column], second.rows[row][column]]))
            .collect();
        let averages_over_alpha2 = (0..AVERAGE_NODES)
            .map(|node| [first.averages_over_alpha2[node], second.averages_over_alpha2[node]])
            .collect();
        Self { rows, averages_over_alpha2 }
    }

    /// The tables at `roughness` in [0, 1].
    pub(crate) fn curve(&self, roughness: f32) -> PairCurve<'_> {
        let TablePlace { node: row, fraction } = position(roughness, ROUGHNESS_NODES);
        let average = position(roughness, AVERAGE_NODES);
        let alpha = roughness * roughness;
        let [low, high] = [average.node, average.node + 1].map(|node| self.averages_over_alpha2[node]);
        let averages = [0, 1].map(|k| alpha * alpha * lerp(low[k], high[k], average.fraction));
        PairCurve { lower: &self.rows[row], upper: &self.rows[row + 1], fraction, alpha, averages }
    }
}

impl PairCurve<'_> {
    /// Values of both tables at an incident cosine in (0, 1].
    pub(crate) fn at(&self, mu: f32) -> [f32; 2] {
        let t = column_of_cosine(mu.max(f32::MIN_POSITIVE), self.alpha);
        let TablePlace { node: column, fraction } = position(t, COSINE_NODES);
        let (lower, upper) =
            ([self.lower[column], self.lower[column + 1]], [self.upper[column], self.upper[column + 1]]);
        [0, 1].map(|k| {
            lerp(lerp(lower[0][k], lower[1][k], fraction), lerp(upper[0][k], upper[1][k], fraction), self.fraction)
        })
    }

    /// Averages of both curves over the hemisphere: twice their integrals times μ dμ.
    pub(crate) fn averages(&self) -> [f32; 2] {
        self.averages
    }
}

impl fmt::Debug for PairCurve<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PairCurve").field("alpha", &self.alpha).finish_non_exhaustive()
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

/// The direction of the upper half at cosine `mu` and azimuth 0.
pub(super) fn direction_at(mu: f32) -> Vec3 {
    Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu)
}

/// Mean of `f` over the facet normals visible from `wo`.
pub(super) fn average_over_visible_normals(facets: &Microfacets, wo: Vec3, f: impl Fn(Vec3) -> f32) -> f32 {
    visible_normals_and_weights(facets, wo).map(|(weight, m)| weight * f(m)).sum()
}

/// Facet normals visible from `wo`, and weights whose sum is 1.
pub(super) fn visible_normals_and_weights(facets: &Microfacets, wo: Vec3) -> impl Iterator<Item = (f32, Vec3)> {
    let visible = facets.visible_normals(wo);
    QUADRATURE.iter().map(move |point| (point.weight, visible.normal(point.u)))
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

/// A place between two nodes of a table.
#[derive(Clone, Copy, Debug)]
pub(super) struct TablePlace {
    /// The lower one.
    pub(super) node: usize,
    /// How far it lies towards the next, in [0, 1].
    pub(super) fraction: f32,
}

impl TablePlace {
    /// The place of `x` in [0, 1] among so many nodes, two at least.
    #[inline]
    pub(super) fn of(x: f32, nodes: usize) -> Self {
        let scaled = x * (nodes - 1) as f32;
        let node = (scaled as usize).min(nodes - 2);
        Self { node, fraction: scaled - node as f32 }
    }

    /// A table's value there.
    #[inline]
    fn value(self, nodes: &[f32]) -> f32 {
        lerp(nodes[self.node], nodes[self.node + 1], self.fraction)
    }
}

/// The place of `x`, which may lie outside of [0, 1], among so many nodes.
#[inline]
fn position(x: f32, nodes: usize) -> TablePlace {
    TablePlace::of(x.clamp(0.0, 1.0), nodes)
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}
