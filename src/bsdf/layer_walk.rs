//! Light that goes to and fro between a coat and the metal beneath, by cosine alone.
//!
//! Where light goes depends on the cosine at which it comes: what a layer does to light is a matrix over a few cosines,
//! and a function of the cosine (such as the share that leaves) is straight between them. Anisotropic facets do what
//! they do on the average over azimuths: that light between the layers favours some of these is left out. Own work, in
//! the manner of adding layers; the light between the facets of one layer is spread as by Kulla & Conty (2017).

use super::albedo_table::{direction_at, visible_normals_and_weights};
use super::dielectric_tables::transmitted;
use super::energy::reflected;
use super::fresnel;
use super::layer_tables::{COLUMNS, cosine, inside, outside};
use super::microfacets::Microfacets;
use glam::Vec3;
use std::f32::consts::FRAC_PI_2;

/// Nodes beyond the critical angle, equally spaced in the cosine.
const TRAPPED: usize = 16;
/// All nodes. The others are the table's columns, refracted: what a smooth coat lets out is steep at the critical
/// angle, and smooth by the cosine outside.
const CROSSINGS: usize = TRAPPED + COLUMNS;
/// Reflections off the metal that are followed. What has entered and is left then is 0.6 % at widths of 0.03 over 0,
/// and less where layers are rougher; between smooth ones it never leaves.
const REFLECTIONS: usize = 64;

/// Azimuths of a quadrant over which what anisotropic facets do is averaged.
const AZIMUTHS: usize = 8;

/// What layers do at one azimuth and another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OverAzimuths {
    /// The same at all azimuths.
    Alike,
    /// Not the same at all azimuths.
    Varying,
}

impl OverAzimuths {
    /// What layers with such facets, or none, do at different azimuths.
    pub(super) fn of<'a>(facets: impl IntoIterator<Item = &'a Microfacets>) -> Self {
        if facets.into_iter().all(Microfacets::is_isotropic) { Self::Alike } else { Self::Varying }
    }
}

/// Directions of cosine `mu` and how much each counts: one where all azimuths are alike, else the middles of
/// equal parts of a quadrant.
pub(super) fn directions(mu: f32, over_azimuths: OverAzimuths) -> impl Iterator<Item = (f32, Vec3)> {
    let along_x = direction_at(mu);
    let count = match over_azimuths {
        OverAzimuths::Alike => 1,
        OverAzimuths::Varying => AZIMUTHS,
    };
    (0..count).map(move |index| {
        if over_azimuths == OverAzimuths::Alike {
            return (1.0, along_x);
        }
        let (sin, cos) = (FRAC_PI_2 * (index as f32 + 0.5) / AZIMUTHS as f32).sin_cos();
        (1.0 / AZIMUTHS as f32, Vec3::new(along_x.x * cos, along_x.x * sin, along_x.z))
    })
}

/// Directions of cosine `mu`, facet normals visible from there, and weights before both, whose sum is 1.
fn seen_facets(facets: &Microfacets, mu: f32) -> impl Iterator<Item = (f32, Vec3, Vec3)> {
    directions(mu, OverAzimuths::of([facets])).flat_map(move |(share, w)| {
        visible_normals_and_weights(facets, w).map(move |(weight, m)| (share * weight, w, m))
    })
}

/// A function of the cosine inside at the nodes, or a measure: what of a function counts at each node.
#[derive(Clone, Copy, Debug)]
struct Row([f32; CROSSINGS]);

impl Default for Row {
    fn default() -> Self {
        Self([0.0; CROSSINGS])
    }
}

impl Row {
    fn dot(&self, other: &Self) -> f32 {
        self.0.iter().zip(&other.0).map(|(a, b)| a * b).sum()
    }

    fn total(&self) -> f32 {
        self.0.iter().sum()
    }

    fn add(&mut self, other: &Self, weight: f32) {
        for (sum, term) in self.0.iter_mut().zip(&other.0) {
            *sum += weight * term;
        }
    }

    /// This row with a total of 1, or nothing.
    fn normalized(mut self) -> Self {
        let total = self.total().max(1e-12);
        self.0.iter_mut().for_each(|value| *value /= total);
        self
    }

    fn map(&self, other: &Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|node| f(self.0[node], other.0[node])))
    }
}

/// For light at each node, where it goes: functions after become functions before.
#[derive(Clone, Debug)]
struct Matrix(Vec<Row>);

impl Matrix {
    fn apply(&self, function: &Row) -> Row {
        Row(std::array::from_fn(|node| self.0[node].dot(function)))
    }
}

/// The cosines inside a coat of one index.
pub(super) struct Nodes {
    eta: f32,
    critical_cosine: f32,
    cosines: Row,
    /// 2∫ of a function times μ dμ.
    diffuse: Row,
}

impl Nodes {
    /// Nodes for a coat of relative index `eta`, at least 1.
    pub(super) fn new(eta: f32) -> Self {
        let critical_cosine = (1.0 - 1.0 / (eta * eta)).max(0.0).sqrt();
        let cosines = Row(std::array::from_fn(|node| match node.checked_sub(TRAPPED) {
            None => (critical_cosine * node as f32 / TRAPPED as f32).max(1e-4),
            Some(column) => inside(direction_at(cosine(column)), eta).z,
        }));
        let mut nodes = Self { eta, critical_cosine, cosines, diffuse: Row::default() };
        nodes.diffuse = nodes.evenly();
        nodes
    }

    /// By the midpoint rule in μ².
    fn evenly(&self) -> Row {
        const STEPS: usize = 4096;
        let mut diffuse = Row::default();
        for step in 0..STEPS {
            let mu2 = (step as f32 + 0.5) / STEPS as f32;
            self.spread(&mut diffuse, mu2.sqrt(), 1.0 / STEPS as f32);
        }
        diffuse
    }

    /// Adds the value at a cosine, `weight` times, to a measure.
    fn spread(&self, measure: &mut Row, mu: f32, weight: f32) {
        let scaled = match outside(direction_at(mu), self.eta) {
            Some(w) => TRAPPED as f32 + w.z.min(1.0).sqrt() * (COLUMNS - 1) as f32,
            None => TRAPPED as f32 * (mu / self.critical_cosine).min(1.0),
        };
        let node = (scaled as usize).min(CROSSINGS - 2);
        let fraction = scaled - node as f32;
        measure.0[node] += weight * (1.0 - fraction);
        measure.0[node + 1] += weight * fraction;
    }

    /// Directions of light that comes at cosine `mu` outside and has been refracted into the coat.
    pub(super) fn entering(&self, facets: Option<&Microfacets>, mu: f32) -> Entering {
        let mut measure = Row::default();
        match facets {
            None => self.spread(&mut measure, inside(direction_at(mu), self.eta).z, 1.0),
            Some(facets) => {
                for (weight, wo, m) in seen_facets(facets, mu) {
                    let cos = wo.dot(m);
                    let boundary = fresnel::dielectric(cos, self.eta);
                    let cosine = wo.z / self.eta - m.z * (cos / self.eta - boundary.cos_transmitted);
                    let unshadowed = transmitted(facets, wo, m, self.eta, boundary.cos_transmitted);
                    self.spread(&mut measure, cosine.max(0.0), weight * (1.0 - boundary.reflectance) * unshadowed);
                }
            }
        }
        let measure = measure.normalized();
        Entering { measure, mean_cosine: measure.dot(&self.cosines) }
    }
}

/// How light that has entered is spread over the cosines inside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entering {
    measure: Row,
    mean_cosine: f32,
}

impl Entering {
    pub(super) fn mean_cosine(&self) -> f32 {
        self.mean_cosine
    }

    /// Adds `weight` times as much as there is of another.
    pub(super) fn add(&mut self, other: &Self, weight: f32) {
        self.measure.add(&other.measure, weight);
        self.mean_cosine += weight * other.mean_cosine;
    }
}

/// What a lossless metal does at one of its facets.
pub(super) struct Metal {
    single: Matrix,
    /// Share that is between facets afterwards.
    between: Row,
    /// Where that goes when it leaves them.
    from_between: Row,
    /// Share of it that leaves them at the next facet.
    leaves_between: f32,
}

impl Metal {
    /// A metal of such facets, or a smooth one.
    pub(super) fn new(nodes: &Nodes, facets: Option<&Microfacets>) -> Self {
        let single = Matrix((0..CROSSINGS).map(|node| mirrored(nodes, facets, node, |_| 1.0)).collect());
        let between = Row(std::array::from_fn(|node| (1.0 - single.0[node].total()).max(0.0)));
        let from_between = nodes.diffuse.map(&between, |weight, share| weight * share);
        Self { between, leaves_between: 1.0 - from_between.total(), from_between: from_between.normalized(), single }
    }
}

/// Where light at a node goes that a layer's facets reflect once, by `reflectance` of the cosine to the facet.
fn mirrored(nodes: &Nodes, facets: Option<&Microfacets>, node: usize, reflectance: impl Fn(f32) -> f32) -> Row {
    let mu = nodes.cosines.0[node];
    let mut row = Row::default();
    match facets {
        None => row.0[node] = reflectance(mu),
        Some(facets) => {
            for (weight, w, m) in seen_facets(facets, mu) {
                let cos = w.dot(m);
                let turned = 2.0 * cos * m.z - w.z;
                nodes.spread(&mut row, turned.max(0.0), weight * reflectance(cos) * reflected(facets, w, m));
            }
        }
    }
    row
}

/// What the coat does to light that comes from within.
pub(super) struct Underside {
    /// Share that leaves.
    leaves: Row,
    /// Where the rest goes.
    turned_back: Matrix,
}

impl Underside {
    /// The underside of a coat of such facets, or of a smooth one, that lets in `average_passed` of what comes evenly.
    ///
    /// What one facet loses leaves or is turned back, in such parts that as much even light leaves as reciprocity with
    /// what enters asks: average_passed/η² of it.
    pub(super) fn new(nodes: &Nodes, facets: Option<&Microfacets>, average_passed: f32) -> Self {
        let (eta, out) = (nodes.eta, 1.0 / nodes.eta);
        let reflectance = |cos: f32| fresnel::dielectric(cos, out).reflectance;
        let mut rows: Vec<Row> = (0..CROSSINGS).map(|node| mirrored(nodes, facets, node, reflectance)).collect();
        let single = Row(std::array::from_fn(|node| {
            let mu = nodes.cosines.0[node];
            let Some(facets) = facets else { return 1.0 - reflectance(mu) };
            let through = |(weight, w, m): (f32, Vec3, Vec3)| {
                let boundary = fresnel::dielectric(w.dot(m), out);
                weight * (1.0 - boundary.reflectance) * transmitted(facets, w, m, out, boundary.cos_transmitted)
            };
            seen_facets(facets, mu).map(through).sum()
        }));
        let lost = Row(std::array::from_fn(|node| (1.0 - single.0[node] - rows[node].total()).max(0.0)));
        let lost_evenly = nodes.diffuse.dot(&lost);
        let owed = average_passed / (eta * eta) - nodes.diffuse.dot(&single);
        let part = (owed / lost_evenly.max(1e-9)).clamp(0.0, 1.0);
        let from_between = nodes.diffuse.map(&lost, |weight, share| weight * share).normalized();
        for (row, share) in rows.iter_mut().zip(lost.0) {
            row.add(&from_between, (1.0 - part) * share);
        }
        Self { leaves: single.map(&lost, |single, lost| single + part * lost), turned_back: Matrix(rows) }
    }
}

/// Share of light that leaves after it met the metal's facets just so many times, by the cosine at which it first
/// comes.
pub(super) struct LeavingByReflections(Vec<Row>);

/// Follows light from the metal on.
pub(super) fn follow(metal: &Metal, underside: &Underside) -> LeavingByReflections {
    let mut leaving = metal.single.apply(&underside.leaves);
    let mut leaving_from_between = metal.leaves_between * metal.from_between.dot(&underside.leaves);
    let mut all = vec![leaving];
    for _ in 1..REFLECTIONS {
        let turned_back = underside.turned_back.apply(&leaving);
        leaving = metal.single.apply(&turned_back);
        leaving.add(&metal.between, leaving_from_between);
        leaving_from_between = metal.leaves_between * metal.from_between.dot(&turned_back)
            + (1.0 - metal.leaves_between) * leaving_from_between;
        all.push(leaving);
    }
    LeavingByReflections(all)
}

impl LeavingByReflections {
    /// Share that leaves after one.
    pub(super) fn first(&self, entering: &Entering) -> f32 {
        self.0[0].dot(&entering.measure)
    }

    /// Share of the rest that leaves after the second.
    pub(super) fn second_share(&self, entering: &Entering) -> f32 {
        (self.0[1].dot(&entering.measure) / (1.0 - self.first(entering)).max(1e-6)).clamp(0.0, 1.0)
    }

    /// Share that each reflection after the second brings out, such that the mean number of them is right.
    pub(super) fn later_escape(&self, entering: &Entering) -> f32 {
        let (mut all, mut counted) = (0.0, 0.0);
        for (index, leaving) in self.0.iter().enumerate().skip(2) {
            let share = leaving.dot(&entering.measure);
            all += share;
            counted += (index - 1) as f32 * share;
        }
        if counted > 0.0 { (all / counted).clamp(0.0, 1.0) } else { 1.0 }
    }
}
