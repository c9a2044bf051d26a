//! Every model with parameters worth testing, and the directions it is seen from.

use super::sphere::Peak;
use crate::bsdf::{
    AnisotropicTable, Bsdf, CoatTables, Conductor, DielectricTables, HeTorrance, LayerTables, LayerWidths,
    MetalRoughness, MetalRoughnessParameters, Microfacets, Phong, Varnish, Varnished, Ward, WidthRange,
};
use crate::scene::Distribution;
use glam::{Mat3, Vec3};
use std::sync::LazyLock;

/// What a model must give back of the light that falls on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Budget {
    /// All of it, within 0.5 %.
    Lossless,
    /// All of it, within 1 %: dielectrics and interpolated widths of anisotropic facets.
    NearlyLossless,
    /// No more than all.
    AtMost,
    /// No more than all, but for the 4 % by which the Kirchhoff approximation of the source overshoots at grazing
    /// angles.
    Kirchhoff,
}

/// A model under test.
#[derive(Clone)]
pub(super) struct Case {
    pub(super) name: String,
    pub(super) bsdf: Bsdf<'static>,
    pub(super) budget: Budget,
    /// Index below the surface over that above; 1 unless the surface bounds a volume.
    pub(super) eta: f32,
    /// Width of the narrowest lobe in radians.
    pub(super) width: f64,
}

impl Case {
    fn new(name: impl Into<String>, bsdf: Bsdf<'static>, budget: Budget, width: f64) -> Self {
        Self { name: name.into(), bsdf, budget, eta: 1.0, width }
    }

    /// What turns radiance back into energy: (index on the side of `wi` / index on the side of `wo`)².
    pub(super) fn energy_per_radiance(&self, wo: Vec3, wi: Vec3) -> f64 {
        let index = |w: Vec3| f64::from(if w.z > 0.0 { 1.0 } else { self.eta });
        (index(wi) / index(wo)).powi(2)
    }

    /// Where the model may be narrow when seen from `wo`.
    pub(super) fn peaks(&self, wo: Vec3) -> Vec<Peak> {
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let (x, y) = (-wo.x / eta, -wo.y / eta);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt().copysign(-wo.z);
        [Vec3::new(-wo.x, -wo.y, wo.z), Vec3::new(x, y, z)]
            .into_iter()
            .map(|direction| Peak { direction: direction.normalize(), width: 0.5 * self.width })
            .collect()
    }
}

/// Directions to look from, on both sides; none in a plane of symmetry of the bins.
pub(super) fn views() -> Vec<Vec3> {
    [1.0f32, 0.9, 0.7, 0.4, 0.15, 0.03, -0.95, -0.7, -0.3, -0.08]
        .into_iter()
        .map(|z| {
            let (sin, cos) = 0.7f32.sin_cos();
            let radius = (1.0 - z * z).sqrt();
            Vec3::new(radius * cos, radius * sin, z)
        })
        .collect()
}

pub(super) static GLASS: LazyLock<DielectricTables> = LazyLock::new(|| DielectricTables::new(1.5, Distribution::Ggx));
pub(super) static WATER: LazyLock<DielectricTables> = LazyLock::new(|| DielectricTables::new(1.33, Distribution::Ggx));
pub(super) static DIAMOND: LazyLock<DielectricTables> = LazyLock::new(|| DielectricTables::new(2.4, Distribution::Ggx));

const GRAY_BLUE: Vec3 = Vec3::new(0.2, 0.5, 0.8);
const GOLD_ETA: Vec3 = Vec3::new(0.143, 0.375, 1.442);
const GOLD_K: Vec3 = Vec3::new(3.983, 2.386, 1.603);

pub(super) static BECKMANN_GLASS: LazyLock<DielectricTables> =
    LazyLock::new(|| DielectricTables::new(1.5, Distribution::Beckmann));
pub(super) static COAT: LazyLock<CoatTables> = LazyLock::new(|| CoatTables::new(1.5, Distribution::Ggx));
/// Layers of any roughness, as with textures.
pub(super) static LAYERS: LazyLock<LayerTables> =
    LazyLock::new(|| LayerTables::new(1.5, [Distribution::Ggx; 2], [LayerWidths::Isotropic(WidthRange::Textured); 2]));

/// Facets twice as wide along one axis as the mean, half as wide along the other.
fn brushed(distribution: Distribution, roughness: f32) -> Microfacets {
    let alpha = roughness * roughness;
    Microfacets::new((2.0 * alpha).min(1.0), 0.5 * alpha, distribution)
}

/// Both distributions, isotropic and not.
fn facet_cases(cases: &mut Vec<Case>) {
    use Budget::{Lossless, NearlyLossless};
    use Distribution::{Beckmann, Ggx};
    let lossless = |facets| Bsdf::conductor(Vec3::ZERO, Vec3::splat(3.0), facets);
    // A material's tables live as long as the material; a test's as long as the test.
    let brushed_metal = |facets: Microfacets, distribution, ranges| {
        let table: &'static AnisotropicTable = Box::leak(Box::new(AnisotropicTable::missing(ranges, distribution)));
        Bsdf::Conductor(Conductor::new(Vec3::ZERO, Vec3::splat(3.0), Vec3::ONE, facets, Some(table)))
    };
    let textured: &'static AnisotropicTable =
        Box::leak(Box::new(AnisotropicTable::missing([WidthRange::Textured; 2], Ggx)));
    for roughness in [0.2f32, 0.6, 1.0] {
        let alpha = roughness * roughness;
        let width = f64::from(alpha);
        let widths = [(2.0 * alpha).min(1.0), 0.5 * alpha].map(WidthRange::Constant);
        let mut metal = |name: &str, bsdf, width| {
            cases.push(Case::new(format!("{name} metal {roughness}"), bsdf, Lossless, width));
        };
        metal("Beckmann", lossless(Microfacets::isotropic(alpha, Beckmann)), width);
        for distribution in [Ggx, Beckmann] {
            let facets = brushed(distribution, roughness);
            metal(&format!("brushed {distribution:?}"), brushed_metal(facets, distribution, widths), 0.5 * width);
        }
        let textured = Conductor::new(Vec3::ZERO, Vec3::splat(3.0), Vec3::ONE, brushed(Ggx, roughness), Some(textured));
        cases.push(Case::new(
            format!("textured brushed metal {roughness}"),
            Bsdf::Conductor(textured),
            NearlyLossless,
            0.5 * width,
        ));
        let mut glass = |name: &str, facets: Microfacets, tables, width| {
            cases.push(Case {
                eta: 1.5,
                ..Case::new(
                    format!("{name} glass {roughness}"),
                    Bsdf::dielectric(1.5, facets, Vec3::ONE, Some(tables)),
                    NearlyLossless,
                    0.3 * width,
                )
            });
        };
        glass("Beckmann", Microfacets::isotropic(alpha, Beckmann), &*BECKMANN_GLASS, width);
        let brushed_glass = DielectricTables::new(1.5, Ggx).with_anisotropy(widths);
        glass("brushed", brushed(Ggx, roughness), Box::leak(Box::new(brushed_glass)), 0.5 * width);
    }
}

/// Coats over metals of which at least one is brushed, by slope widths along x and y.
fn brushed_layer_cases(cases: &mut Vec<Case>) {
    let lossless = (Vec3::splat(1.0), Vec3::splat(1e5));
    let facets = |[x, y]: [f32; 2]| Microfacets::new(x, y, Distribution::Ggx);
    let mut add = |name: String, ior, coat: [f32; 2], base: [f32; 2], widths, budget| {
        let tables = Box::leak(Box::new(LayerTables::new(ior, [Distribution::Ggx; 2], widths)));
        // The coat's facets widen the metal's to 0.17 of their own.
        let seen = f64::from((0.17 * coat[0]).hypot(base[0]).min((0.17 * coat[1]).hypot(base[1])));
        let of_coat = coat[0].min(coat[1]);
        let width = if of_coat > 0.0 { seen.min(f64::from(of_coat)) } else { seen };
        let bsdf = |(eta, k)| Bsdf::coated_conductor(eta, k, facets(base), facets(coat), tables);
        cases.push(Case::new(format!("coated lossless {name}"), bsdf(lossless), budget, width));
        cases.push(Case::new(format!("coated gold {name}"), bsdf((GOLD_ETA, GOLD_K)), Budget::AtMost, width));
    };
    let constant = |[x, y]: [f32; 2]| LayerWidths::Anisotropic([x, y].map(WidthRange::Constant));
    for (ior, coat, base) in [
        (1.5, [0.0; 2], [0.04, 0.64]),
        (1.5, [0.0; 2], [0.64, 0.04]),
        (1.5, [0.0; 2], [0.05, 0.2]),
        (1.0, [0.0; 2], [0.04, 0.64]),
        (1.5, [0.04, 0.64], [0.0; 2]),
        (1.5, [0.04, 0.64], [0.64, 0.04]),
        (1.5, [0.04, 0.64], [0.2, 0.2]),
        (1.5, [0.04, 0.16], [0.04, 0.16]),
    ] {
        let name = format!("brushed metal, index {ior}, {coat:?} over {base:?}");
        add(name, ior, coat, base, [coat, base].map(constant), Budget::Lossless);
    }
    let extreme = [[0.01, 1.0]; 2];
    let widths = extreme.map(constant);
    add("metal brushed to the utmost".to_owned(), 1.5, extreme[0], extreme[1], widths, Budget::NearlyLossless);
    let (coat, base) = ([0.0; 2], [0.05, 0.3]);
    let widths =
        [LayerWidths::Isotropic(WidthRange::Constant(0.0)), LayerWidths::Anisotropic([WidthRange::Textured; 2])];
    add("textured brushed metal".to_owned(), 1.5, coat, base, widths, Budget::NearlyLossless);
    let widths = [WidthRange::Textured; 2];
    let widths = [LayerWidths::Isotropic(WidthRange::Textured), LayerWidths::Anisotropic(widths)];
    add("textured brushed metal under a textured coat".to_owned(), 1.5, [0.1; 2], base, widths, Budget::NearlyLossless);
}

/// Coats over other models, and mixes.
fn layered_cases(cases: &mut Vec<Case>) {
    use Budget::{AtMost, Lossless};
    let lossless = (Vec3::splat(1.0), Vec3::splat(1e5));
    for roughness in [0.0f32, 0.3, 1.0] {
        let width = if roughness > 0.0 { f64::from(roughness * roughness) } else { 1.0 };
        cases.push(Case::new(
            format!("white plastic {roughness}"),
            Bsdf::coated_diffuse(Vec3::ONE, roughness, &COAT),
            Lossless,
            width,
        ));
        cases.push(Case::new(
            format!("plastic {roughness}"),
            Bsdf::coated_diffuse(GRAY_BLUE, roughness, &COAT),
            AtMost,
            width,
        ));
    }
    for (coat, metal) in [(0.0f32, 0.3f32), (0.3, 0.0), (0.2, 0.5), (1.0, 1.0), (0.0, 1.0)] {
        // The coat's facets widen a smooth metal's to 0.17 of their own.
        let width =
            f64::from(0.17 * coat * coat + metal * metal).min(if coat > 0.0 { f64::from(coat * coat) } else { 1.0 });
        cases.push(Case::new(
            format!("coated lossless metal {coat} {metal}"),
            Bsdf::coated_conductor(lossless.0, lossless.1, metal, coat, &LAYERS),
            Lossless,
            width,
        ));
        cases.push(Case::new(
            format!("coated gold {coat} {metal}"),
            Bsdf::coated_conductor(GOLD_ETA, GOLD_K, metal, coat, &LAYERS),
            AtMost,
            width,
        ));
    }
    static WHITE: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::lambert(Vec3::ONE));
    static SILVER: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::conductor(Vec3::ZERO, Vec3::splat(3.0), 0.3));
    static REFLECTOR: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::mirror(Vec3::ONE));
    static NESTED: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::mix(&WHITE, &SILVER, 0.5));
    cases.push(Case::new("mix of smooth lobes", Bsdf::mix(&WHITE, &SILVER, 0.3), Lossless, 0.09));
    cases.push(Case::new("mix with a mirror", Bsdf::mix(&REFLECTOR, &NESTED, 0.6), Lossless, 0.09));
}

/// The material of glTF with its extensions.
fn gltf_cases(cases: &mut Vec<Case>) {
    let extended = MetalRoughness::new(&MetalRoughnessParameters {
        base_color: GRAY_BLUE,
        roughness: 0.4,
        anisotropy: 0.6,
        specular: 0.6,
        specular_color: Vec3::new(1.0, 0.5, 0.2),
        transmission: 0.3,
        ..MetalRoughnessParameters::default()
    });
    cases.push(Case::new("extended metal-roughness", Bsdf::MetalRoughness(extended), Budget::AtMost, 0.16));
    let white = MetalRoughness::new(&MetalRoughnessParameters::default());
    static CLEAR: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::dielectric(1.5, 0.0, Vec3::ONE, Some(&*GLASS)));
    static FROSTED: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::dielectric(1.5, 0.4, Vec3::ONE, Some(&*GLASS)));
    for (clearcoat, roughness, sheen, sheen_roughness) in
        [(1.0f32, 0.0f32, 0.0f32, 0.5f32), (1.0, 0.3, 0.0, 0.5), (0.0, 0.0, 1.0, 0.3), (0.6, 0.2, 0.5, 0.8)]
    {
        let over = |base: Varnished<'static>| {
            Bsdf::Varnish(Varnish::new(base, clearcoat, roughness, Vec3::splat(sheen), sheen_roughness))
        };
        let width = if clearcoat > 0.0 && roughness > 0.0 { roughness * roughness } else { 0.25 };
        let name = format!("varnish {clearcoat} {roughness}, sheen {sheen} {sheen_roughness}");
        cases.push(Case::new(name.as_str(), over(Varnished::Sheet(white)), Budget::AtMost, f64::from(width)));
        for (of, boundary, width) in [("clear", &*CLEAR, 1.0), ("frosted", &*FROSTED, 0.3 * 0.16_f32)] {
            // Of delta lobes alone, two of them in one direction, these tests cannot tell.
            if of == "clear" && sheen == 0.0 && roughness == 0.0 {
                continue;
            }
            let bsdf = over(Varnished::Boundary(boundary));
            let width = if clearcoat > 0.0 && roughness > 0.0 { width.min(roughness * roughness) } else { width };
            let case = Case::new(format!("{name} over {of} glass"), bsdf, Budget::AtMost, f64::from(width));
            cases.push(Case { eta: 1.5, ..case });
        }
    }
}

/// Coats over a base whose normal is another. Not reciprocal by the cosines of the coat, and sampled in a frame of the
/// base's, so that the last bits of a sample and an evaluation may differ.
pub(super) fn bumpy_cases() -> Vec<Case> {
    static FROSTED: LazyLock<Bsdf<'static>> = LazyLock::new(|| Bsdf::dielectric(1.5, 0.4, Vec3::ONE, Some(&*GLASS)));
    let white = MetalRoughness::new(&MetalRoughnessParameters::default());
    let mut cases = Vec::new();
    let bumps = Some(Mat3::from_rotation_x(0.3) * Mat3::from_rotation_z(1.0));
    for (roughness, sheen) in [(0.0, 0.0), (0.3, 0.5)] {
        let over = |base: Varnished<'static>| {
            Bsdf::Varnish(Varnish::new(base, 0.8, roughness, Vec3::splat(sheen), 0.5).over_relief(bumps))
        };
        let name = format!("varnish {roughness}, sheen {sheen} over bumps");
        cases.push(Case::new(name.as_str(), over(Varnished::Sheet(white)), Budget::AtMost, 0.09));
        let bsdf = over(Varnished::Boundary(&FROSTED));
        let case = Case::new(format!("{name} of frosted glass"), bsdf, Budget::AtMost, 0.3 * 0.09);
        cases.push(Case { eta: 1.5, ..case });
    }
    cases
}

/// Models without microfacets.
fn empirical_cases(cases: &mut Vec<Case>) {
    use Budget::AtMost;
    let half = Vec3::splat(0.5);
    for (exponent, width) in [(0.0f32, 1.0), (10.0, 0.3), (1000.0, 0.03)] {
        let phong = |diffuse, specular| Bsdf::Phong(Phong::new(diffuse, specular, exponent));
        cases.push(Case::new(format!("phong {exponent}"), phong(half, half), AtMost, width));
        cases.push(Case::new(format!("phong lobe {exponent}"), phong(Vec3::ZERO, Vec3::ONE), AtMost, width));
    }
    for alphas in [[0.1f32, 0.1], [0.3, 0.1], [1.0, 1.0]] {
        let ward = |diffuse, specular| Bsdf::Ward(Ward::new(diffuse, specular, alphas));
        let width = f64::from(alphas[1]);
        cases.push(Case::new(format!("ward {alphas:?}"), ward(half, half), AtMost, width));
        cases.push(Case::new(format!("ward lobe {alphas:?}"), ward(Vec3::ZERO, Vec3::ONE), AtMost, width));
    }
    // Rms height and autocorrelation length in nanometres.
    // Few, for each value costs a sum of up to a hundred terms.
    for (height, correlation) in [(50.0f32, 1500.0f32), (800.0, 4000.0)] {
        let relief = |eta, k, diffuse| Bsdf::HeTorrance(HeTorrance::new(eta, k, height, correlation, diffuse));
        let width = 0.1;
        let name = format!("{height} nm, {correlation} nm");
        cases.push(Case::new(
            format!("lossless relief {name}"),
            relief(Vec3::ZERO, Vec3::splat(3.0), Vec3::ZERO),
            Budget::Kirchhoff,
            width,
        ));
        cases.push(Case::new(
            format!("ceramic relief {name}"),
            relief(Vec3::splat(1.5), Vec3::ZERO, Vec3::ONE),
            AtMost,
            width,
        ));
    }
}

/// Models with at least one smooth lobe.
pub(super) fn smooth_cases() -> Vec<Case> {
    static CASES: LazyLock<Vec<Case>> = LazyLock::new(all_smooth_cases);
    CASES.clone()
}

fn all_smooth_cases() -> Vec<Case> {
    use Budget::{AtMost, Lossless};
    let mut cases = vec![
        Case::new("lambert white", Bsdf::lambert(Vec3::ONE), Lossless, 1.0),
        Case::new("lambert", Bsdf::lambert(GRAY_BLUE), AtMost, 1.0),
    ];
    for roughness in [0.1f32, 0.4, 1.0] {
        let width = f64::from(roughness * roughness);
        cases.push(Case::new(
            format!("lossless conductor {roughness}"),
            Bsdf::conductor(Vec3::ZERO, Vec3::splat(3.0), roughness),
            Lossless,
            width,
        ));
        cases.push(Case::new(format!("gold {roughness}"), Bsdf::conductor(GOLD_ETA, GOLD_K, roughness), AtMost, width));
        for (name, eta, tables) in
            [("glass", 1.5f32, &GLASS), ("water from below", 1.0 / 1.33, &WATER_REVERSED), ("diamond", 2.4, &DIAMOND)]
        {
            cases.push(Case {
                eta,
                ..Case::new(
                    format!("{name} {roughness}"),
                    Bsdf::dielectric(eta, roughness, Vec3::ONE, Some(tables)),
                    Lossless,
                    0.3 * width,
                )
            });
        }
        cases.push(Case {
            eta: 1.33,
            ..Case::new(
                format!("tinted water {roughness}"),
                Bsdf::dielectric(1.33, roughness, GRAY_BLUE, Some(&WATER)),
                AtMost,
                0.3 * width,
            )
        });
        cases.push(Case {
            eta: 1.5,
            ..Case::new(
                format!("glass without tables {roughness}"),
                Bsdf::dielectric(1.5, roughness, Vec3::ONE, None),
                AtMost,
                0.3 * width,
            )
        });
        for (metallic, transmission) in [(0.0, 0.0), (1.0, 0.0), (0.4, 0.5), (0.0, 1.0)] {
            cases.push(Case::new(
                format!("white metal-roughness {metallic} {roughness} {transmission}"),
                Bsdf::metal_roughness(Vec3::ONE, metallic, roughness, 1.5, transmission),
                Lossless,
                width,
            ));
        }
        cases.push(Case::new(
            format!("metal-roughness {roughness}"),
            Bsdf::metal_roughness(GRAY_BLUE, 0.3, roughness, 1.8, 0.4),
            AtMost,
            width,
        ));
    }
    for roughness in [0.0f32, 0.5, 1.0] {
        cases.push(Case::new(
            format!("white oren-nayar {roughness}"),
            Bsdf::oren_nayar(Vec3::ONE, roughness),
            Lossless,
            1.0,
        ));
        cases.push(Case::new(format!("oren-nayar {roughness}"), Bsdf::oren_nayar(GRAY_BLUE, roughness), AtMost, 1.0));
    }
    cases.push(Case::new("white sheet", Bsdf::diffuse_transmission(Vec3::splat(0.7), Vec3::splat(0.3)), Lossless, 1.0));
    cases.push(Case::new("sheet", Bsdf::diffuse_transmission(0.5 * GRAY_BLUE, Vec3::new(0.6, 0.1, 0.0)), AtMost, 1.0));
    for transmission in [0.0, 0.6] {
        cases.push(Case::new(
            format!("white smooth metal-roughness {transmission}"),
            Bsdf::metal_roughness(Vec3::ONE, 0.0, 0.0, 1.5, transmission),
            Lossless,
            1.0,
        ));
    }
    facet_cases(&mut cases);
    layered_cases(&mut cases);
    brushed_layer_cases(&mut cases);
    gltf_cases(&mut cases);
    empirical_cases(&mut cases);
    cases
}

static WATER_REVERSED: LazyLock<DielectricTables> =
    LazyLock::new(|| DielectricTables::new(1.0 / 1.33, Distribution::Ggx));

/// Models that consist of delta lobes.
pub(super) fn delta_cases() -> Vec<Case> {
    use Budget::{AtMost, Lossless};
    let glass = |name: &str, eta, tint, budget| Case {
        eta,
        ..Case::new(name, Bsdf::dielectric(eta, 0.0, tint, None), budget, 1.0)
    };
    vec![
        Case::new("mirror", Bsdf::mirror(GRAY_BLUE), AtMost, 1.0),
        Case::new("white mirror", Bsdf::mirror(Vec3::ONE), Lossless, 1.0),
        Case::new("smooth gold", Bsdf::conductor(GOLD_ETA, GOLD_K, 0.0), AtMost, 1.0),
        glass("smooth glass", 1.5, Vec3::ONE, Lossless),
        glass("smooth bubble", 0.7, Vec3::ONE, Lossless),
        glass("smooth tinted glass", 1.5, GRAY_BLUE, AtMost),
        Case::new("pane", Bsdf::thin_dielectric(1.5, Vec3::ONE), Lossless, 1.0),
        Case::new("tinted pane", Bsdf::thin_dielectric(1.5, GRAY_BLUE), AtMost, 1.0),
        Case::new(
            "coated mirror",
            Bsdf::coated_conductor(Vec3::ONE, Vec3::splat(1e5), 0.0, 0.0, &LAYERS),
            Lossless,
            1.0,
        ),
        Case::new(
            "flat relief",
            Bsdf::HeTorrance(HeTorrance::new(Vec3::ZERO, Vec3::splat(3.0), 0.0, 1000.0, Vec3::ZERO)),
            Lossless,
            1.0,
        ),
        Case::new("smooth metal", Bsdf::metal_roughness(Vec3::ONE, 1.0, 0.0, 1.5, 0.0), Lossless, 1.0),
    ]
}
