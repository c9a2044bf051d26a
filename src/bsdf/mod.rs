//! How surfaces scatter light, one file a model.
//!
//! # Conventions
//!
//! Directions are unit vectors in the local shading frame: z is the shading normal, `wo` points towards where the path
//! came from (the camera), `wi` towards where it goes on (the light), and both point **away** from the surface.
//!
//! Values are for **radiance** carried from `wi` to `wo`. Where light is refracted, radiance divided by the squared
//! index of refraction is what stays constant along a ray, so a transmission lobe carries the factor
//! (η of `wo`'s side / η of `wi`'s side)²: a camera path that enters glass is multiplied by 1/η², one that leaves it by
//! η², and one through a whole slab by 1. Reciprocity of transmission then reads
//! f(A→B)/η_B² = f(B→A)/η_A² with light going from A to B (Veach 1997, eq. 5.14).
//!
//! Opaque reflectors are two-sided: with `wo` below the surface they scatter as if the normal were turned over.
//! Dielectrics are real boundaries, and the sign of `wo.z` says on which side the path is.
//!
//! Roughness r is perceptual, in [0, 1]; the microfacet slope width is α = r² (Burley 2012, section 5.4).

mod albedo_table;
mod anisotropic_table;
mod beckmann;
mod coat;
mod coated_conductor;
mod coated_diffuse;
mod conductor;
mod dielectric;
mod dielectric_tables;
mod diffuse_transmission;
mod energy;
mod fresnel;
mod he_torrance;
mod lambert;
mod layer_tables;
mod layer_walk;
mod layer_widths;
mod metal_roughness;
mod microfacets;
mod mirror;
mod mix;
mod oren_nayar;
mod phong;
mod sheen;
#[cfg(test)]
mod tests;
mod thin_dielectric;
mod varnish;
mod ward;
mod warp;

use glam::Vec3;

pub use anisotropic_table::{AnisotropicTable, WidthRange};
pub use coat::CoatTables;
pub use coated_conductor::CoatedConductor;
pub use coated_diffuse::{CoatedDiffuse, Saturation};
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use dielectric_tables::DielectricTables;
pub use diffuse_transmission::DiffuseTransmission;
pub use he_torrance::HeTorrance;
pub use lambert::Lambert;
pub use layer_tables::LayerTables;
pub use layer_widths::LayerWidths;
pub use metal_roughness::{MetalRoughness, MetalRoughnessParameters};
pub use microfacets::Microfacets;
pub use mirror::Mirror;
pub use mix::Mix;
pub use oren_nayar::OrenNayar;
pub use phong::Phong;
pub use thin_dielectric::ThinDielectric;
pub use varnish::{Varnish, Varnished, passed_by_clearcoat};
pub use ward::Ward;

/// Slope width α below which a microfacet surface counts as perfectly smooth. Its lobe would be 0.06° wide: less than a
/// pixel of any display at any distance, and the half-way vector in single precision starts to blur it.
pub const MIN_ALPHA: f32 = 1e-3;

/// What [`Bsdf::evaluate`] tells of one pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfEvaluation {
    /// f(wo, wi)·|cos θi| per linear RGB channel, in 1/sr; 0 for what only a delta lobe would scatter.
    pub value: Vec3,
    /// Probability per steradian that [`Bsdf::sample`] chooses `wi` by one of its smooth lobes.
    pub pdf: f32,
}

impl BsdfEvaluation {
    /// The evaluation where nothing is scattered and nothing is ever sampled.
    pub const BLACK: Self = Self { value: Vec3::ZERO, pdf: 0.0 };

    /// The sample of a smooth lobe that chose `wi`, or `None` where it carries nothing.
    ///
    /// The weight is value / pdf of the *whole* mixture of lobes, so that a sample and an evaluation always agree.
    fn into_sample(self, wi: Vec3) -> Option<BsdfSample> {
        let lobe = if wi.z > 0.0 { Lobe::Smooth } else { Lobe::SmoothTransmission };
        // A pdf above zero but so small that the weight overflows comes only from rounding.
        let weight = self.value / self.pdf;
        (self.pdf > 0.0 && weight.is_finite()).then_some(BsdfSample {
            wi,
            weight,
            pdf: self.pdf,
            lobe,
            crossed_index: None,
        })
    }

    /// A sample as seen from the other side of the surface: for models that turn both directions over.
    fn sample_turned(self, wi: Vec3, wo: Vec3) -> Option<BsdfSample> {
        self.into_sample(wi).map(|sample| sample.turned_like(wo))
    }
}

/// A direction chosen by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction in which the path goes on.
    pub wi: Vec3,
    /// f·|cos θi| / pdf: what the path's throughput is multiplied with.
    pub weight: Vec3,
    /// Probability per steradian; for a delta lobe its discrete probability.
    pub pdf: f32,
    /// Which kind of lobe was chosen.
    pub lobe: Lobe,
    /// Where the path entered or left a volume: the index of refraction that it comes into over the one it leaves.
    /// `None` for reflection, and for transmission through sheets without an inside.
    pub crossed_index: Option<f32>,
}

impl BsdfSample {
    /// Reflection into exactly one direction, chosen with a probability of `pdf`.
    fn reflected_delta(wi: Vec3, weight: Vec3, pdf: f32) -> Self {
        Self { wi, weight, pdf, lobe: Lobe::Delta, crossed_index: None }
    }

    /// Whether the path goes on through a thin sheet as if it were not there.
    pub fn goes_straight_on(&self) -> bool {
        self.lobe == Lobe::DeltaTransmission && self.crossed_index.is_none()
    }

    /// Turns the direction over if `wo` lies below the surface (the model having worked above it).
    fn turned_like(mut self, wo: Vec3) -> Self {
        if wo.z < 0.0 {
            self.wi.z = -self.wi.z;
        }
        self
    }
}

/// The kind of lobe that a sample came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lobe {
    /// Reflection with a finite pdf.
    Smooth,
    /// Transmission with a finite pdf.
    SmoothTransmission,
    /// Reflection into exactly one direction.
    Delta,
    /// Transmission into exactly one direction.
    DeltaTransmission,
}

impl Lobe {
    /// Whether only one direction is possible, so that light sampling can never find it.
    pub const fn is_delta(self) -> bool {
        matches!(self, Self::Delta | Self::DeltaTransmission)
    }

    /// Whether the path changes sides.
    pub const fn is_transmission(self) -> bool {
        matches!(self, Self::SmoothTransmission | Self::DeltaTransmission)
    }
}

/// A scattering model with its parameters resolved at one point of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf<'a> {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Ideal specular reflection.
    Mirror(Mirror),
    /// Metal, smooth or rough.
    Conductor(Conductor<'a>),
    /// Boundary of a volume, smooth or rough.
    Dielectric(Dielectric<'a>),
    /// Thin clear sheet.
    ThinDielectric(ThinDielectric),
    /// The material of glTF 2.0.
    MetalRoughness(MetalRoughness),
    /// Clear coat and sheen over the material of glTF 2.0.
    Varnish(Varnish<'a>),
    /// Rough diffuse reflection.
    OrenNayar(OrenNayar),
    /// Thin diffuse sheet.
    DiffuseTransmission(DiffuseTransmission),
    /// Clear coat over a diffuse base.
    CoatedDiffuse(CoatedDiffuse<'a>),
    /// Clear coat over a metal.
    CoatedConductor(CoatedConductor<'a>),
    /// Diffuse base and a lobe around the mirror direction.
    Phong(Phong),
    /// Diffuse base and a Gaussian lobe of half-way vectors.
    Ward(Ward),
    /// Relief of the size of a wavelength.
    HeTorrance(HeTorrance),
    /// Weighted sum of two models.
    Mix(Mix<'a>),
}

impl<'a> Bsdf<'a> {
    /// Ideal diffuse reflection with albedo `reflectance` in [0, 1].
    pub fn lambert(reflectance: Vec3) -> Self {
        Self::Lambert(Lambert::new(reflectance))
    }

    /// Ideal specular reflection with `reflectance` in [0, 1].
    pub fn mirror(reflectance: Vec3) -> Self {
        Self::Mirror(Mirror::new(reflectance))
    }

    /// Metal of complex index η + ik per RGB channel, seen in air; a number stands for perceptual roughness of GGX.
    pub fn conductor(eta: Vec3, k: Vec3, facets: impl Into<Microfacets>) -> Self {
        Self::Conductor(Conductor::new(eta, k, Vec3::ONE, facets.into(), None))
    }

    /// Boundary of a volume whose index is `eta_inside_over_outside`; `transmittance` tints each crossing. Without
    /// `tables` a rough boundary loses the light that bounces between its facets.
    pub fn dielectric(
        eta_inside_over_outside: f32,
        facets: impl Into<Microfacets>,
        transmittance: Vec3,
        tables: Option<&'a DielectricTables>,
    ) -> Self {
        Self::Dielectric(Dielectric::new(eta_inside_over_outside, facets.into(), transmittance, tables))
    }

    /// Clear coat, of the tables' index, over a diffuse base of albedo `reflectance`.
    pub fn coated_diffuse(reflectance: Vec3, facets: impl Into<Microfacets>, tables: &'a CoatTables) -> Self {
        Self::CoatedDiffuse(CoatedDiffuse::new(reflectance, facets.into(), Saturation::Repeated, tables))
    }

    /// Clear coat, of the tables' index, over a metal.
    pub fn coated_conductor(
        eta: Vec3,
        k: Vec3,
        facets: impl Into<Microfacets>,
        coat_facets: impl Into<Microfacets>,
        tables: &'a LayerTables,
    ) -> Self {
        Self::CoatedConductor(CoatedConductor::new(eta, k, facets.into(), coat_facets.into(), tables))
    }

    /// Weighted sum of two models, `amount` in [0, 1] being the second's share.
    pub fn mix(first: &'a Bsdf<'a>, second: &'a Bsdf<'a>, amount: f32) -> Self {
        Self::Mix(Mix::new(first, second, amount))
    }

    /// Thin sheet of a clear material; `transmittance` tints what goes through.
    pub fn thin_dielectric(ior: f32, transmittance: Vec3) -> Self {
        Self::ThinDielectric(ThinDielectric::new(ior, transmittance))
    }

    /// The metal-roughness material of glTF 2.0 with its extensions for the index of refraction and for transmission.
    pub fn metal_roughness(base_color: Vec3, metallic: f32, roughness: f32, ior: f32, transmission: f32) -> Self {
        Self::MetalRoughness(MetalRoughness::new(&MetalRoughnessParameters {
            base_color,
            metallic,
            roughness,
            ior,
            transmission,
            ..MetalRoughnessParameters::default()
        }))
    }

    /// Rough diffuse reflection with walls of albedo `reflectance` and `roughness`, both in [0, 1].
    pub fn oren_nayar(reflectance: Vec3, roughness: f32) -> Self {
        Self::OrenNayar(OrenNayar::new(reflectance, roughness))
    }

    /// Thin diffuse sheet; `reflectance` + `transmittance` at most 1.
    pub fn diffuse_transmission(reflectance: Vec3, transmittance: Vec3) -> Self {
        Self::DiffuseTransmission(DiffuseTransmission::new(reflectance, transmittance))
    }

    /// Value and pdf for a pair of unit directions. Delta lobes count as 0 in both.
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        match self {
            Self::Lambert(model) => model.evaluate(wo, wi),
            Self::Mirror(_) | Self::ThinDielectric(_) => BsdfEvaluation::BLACK,
            Self::Conductor(model) => model.evaluate(wo, wi),
            Self::Dielectric(model) => model.evaluate(wo, wi),
            Self::MetalRoughness(model) => model.evaluate(wo, wi),
            Self::Varnish(model) => model.evaluate(wo, wi),
            Self::OrenNayar(model) => model.evaluate(wo, wi),
            Self::DiffuseTransmission(model) => model.evaluate(wo, wi),
            Self::CoatedDiffuse(model) => model.evaluate(wo, wi),
            Self::CoatedConductor(model) => model.evaluate(wo, wi),
            Self::Phong(model) => model.evaluate(wo, wi),
            Self::Ward(model) => model.evaluate(wo, wi),
            Self::HeTorrance(model) => model.evaluate(wo, wi),
            Self::Mix(model) => model.evaluate(wo, wi),
        }
    }

    /// Chooses where the path goes on, from three independent numbers in [0, 1); `None` where it ends.
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Self::Lambert(model) => model.sample(wo, u),
            Self::Mirror(model) => model.sample(wo),
            Self::Conductor(model) => model.sample(wo, u),
            Self::Dielectric(model) => model.sample(wo, u),
            Self::ThinDielectric(model) => model.sample(wo, u),
            Self::MetalRoughness(model) => model.sample(wo, u),
            Self::Varnish(model) => model.sample(wo, u),
            Self::OrenNayar(model) => model.sample(wo, u),
            Self::DiffuseTransmission(model) => model.sample(wo, u),
            Self::CoatedDiffuse(model) => model.sample(wo, u),
            Self::CoatedConductor(model) => model.sample(wo, u),
            Self::Phong(model) => model.sample(wo, u),
            Self::Ward(model) => model.sample(wo, u),
            Self::HeTorrance(model) => model.sample(wo, u),
            Self::Mix(model) => model.sample(wo, u),
        }
    }

    /// Whether [`Self::evaluate`] can be other than 0; if not, light sampling is of no use.
    pub fn has_smooth_lobe(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::OrenNayar(_) | Self::DiffuseTransmission(_) | Self::Phong(_) | Self::Ward(_) => {
                true
            }
            Self::Mirror(_) | Self::ThinDielectric(_) => false,
            Self::Conductor(model) => model.has_smooth_lobe(),
            Self::Dielectric(model) => model.has_smooth_lobe(),
            Self::MetalRoughness(model) => model.has_smooth_lobe(),
            Self::Varnish(model) => model.has_smooth_lobe(),
            Self::CoatedDiffuse(model) => model.has_smooth_lobe(),
            Self::CoatedConductor(model) => model.has_smooth_lobe(),
            Self::HeTorrance(model) => model.has_smooth_lobe(),
            Self::Mix(model) => model.has_smooth_lobe(),
        }
    }

    /// Share of light from `wo` that a delta lobe lets through straight on, as smooth thin sheets do; 0 of all others.
    pub fn straight_through(&self, wo: Vec3) -> Vec3 {
        match self {
            Self::ThinDielectric(model) => model.straight_through(wo),
            Self::MetalRoughness(model) => model.straight_through(wo),
            Self::Varnish(model) => model.straight_through(wo),
            Self::Mix(model) => model.straight_through(wo),
            Self::Lambert(_)
            | Self::Mirror(_)
            | Self::Conductor(_)
            | Self::Dielectric(_)
            | Self::OrenNayar(_)
            | Self::DiffuseTransmission(_)
            | Self::CoatedDiffuse(_)
            | Self::CoatedConductor(_)
            | Self::Phong(_)
            | Self::Ward(_)
            | Self::HeTorrance(_) => Vec3::ZERO,
        }
    }

    /// Approximate share of light that is scattered, reflected and transmitted together, for AOVs and guides.
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        match self {
            Self::Lambert(model) => model.albedo(),
            Self::Mirror(model) => model.albedo(),
            Self::Conductor(model) => model.albedo(wo),
            Self::Dielectric(model) => model.albedo(wo),
            Self::ThinDielectric(model) => model.albedo(wo),
            Self::MetalRoughness(model) => model.albedo(wo),
            Self::Varnish(model) => model.albedo(wo),
            Self::OrenNayar(model) => model.albedo(wo),
            Self::DiffuseTransmission(model) => model.albedo(),
            Self::CoatedDiffuse(model) => model.albedo(wo),
            Self::CoatedConductor(model) => model.albedo(wo),
            Self::Phong(model) => model.albedo(),
            Self::Ward(model) => model.albedo(),
            Self::HeTorrance(model) => model.albedo(wo),
            Self::Mix(model) => model.albedo(wo),
        }
    }
}

/// A model that only reflects, alike on both sides, told for directions above the surface.
trait Reflector {
    /// For two directions above the surface.
    fn evaluate_front(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation;

    /// A direction for a `wo` above the surface, by the density that [`Reflector::evaluate_front`] states; one below
    /// the surface carries nothing.
    fn sample_front(&self, wo: Vec3, u: [f32; 3]) -> Vec3;

    fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = to_front(wo, wi);
        if wo.z > 0.0 && wi.z > 0.0 { self.evaluate_front(wo, wi) } else { BsdfEvaluation::BLACK }
    }

    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let front = if wo.z < 0.0 { turn(wo) } else { wo };
        let wi = self.sample_front(front, u);
        if wi.z > 0.0 { self.evaluate_front(front, wi).sample_turned(wi, wo) } else { None }
    }
}

/// Turns both directions over if `wo` lies below the surface, so that an opaque model only sees its front.
fn to_front(wo: Vec3, wi: Vec3) -> (Vec3, Vec3) {
    if wo.z < 0.0 { (turn(wo), turn(wi)) } else { (wo, wi) }
}

/// The direction mirrored in the surface's plane.
fn turn(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}
