//! The upper layers of glTF's materials: a clear coat, and a sheen of fibres, over the metal-roughness model or
//! the boundary of a volume.
//!
//! Parameters: `clearcoat`, coverage in [0, 1] of a coat of index 1.5, and its perceptual roughness in [0, 1];
//! `sheen_color` per linear RGB channel in [0, 1], and `sheen_roughness` in [0, 1], perceptual.
//!
//! A layer that reflects E(ω) lets (1 − E(ωo))(1 − E(ωi))/(1 − E(normal)) through to what lies beneath: reciprocal, and
//! never more than came in, since a layer passes most face on. It is right face on and loses light towards grazing
//! angles, where what the layer turns back inside is not followed. What goes through a volume's boundary passes the
//! layer once, by 1 − E of the direction outside; light that stays inside does not meet it.
//!
//! A coat may be smooth over bumps: then it has a frame of its own, and what is on the one side of it and on the other
//! of what lies beneath passes nothing.
//!
//! Source: Khronos Group, KHR_materials_clearcoat. The fibres are in [`super::sheen`].

use super::albedo_table::direction_at;
use super::coat::{Coat, CoatTables};
use super::metal_roughness::MetalRoughness;
use super::microfacets::Microfacets;
use super::mirror::reflect_about_normal;
use super::sheen::Sheen;
use super::{Bsdf, BsdfEvaluation, BsdfSample, fresnel, turn, warp};
use crate::scene::Distribution;
use glam::{Mat3, Vec3};
use std::sync::LazyLock;

static COAT: LazyLock<CoatTables> = LazyLock::new(|| CoatTables::new(1.5, Distribution::Ggx));

/// What lies beneath the layers.
#[derive(Clone, Copy, Debug)]
pub enum Varnished<'a> {
    /// A sheet: both sides have the layers.
    Sheet(MetalRoughness),
    /// The boundary of a volume, which has the layers on its outside.
    Boundary(&'a Bsdf<'a>),
}

impl Varnished<'_> {
    fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        match self {
            Self::Sheet(base) => base.evaluate(wo, wi),
            Self::Boundary(base) => base.evaluate(wo, wi),
        }
    }

    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Self::Sheet(base) => base.sample(wo, u),
            Self::Boundary(base) => base.sample(wo, u),
        }
    }

    fn albedo(&self, wo: Vec3) -> Vec3 {
        match self {
            Self::Sheet(base) => base.albedo(wo),
            Self::Boundary(base) => base.albedo(wo),
        }
    }

    fn has_smooth_lobe(&self) -> bool {
        match self {
            Self::Sheet(base) => base.has_smooth_lobe(),
            Self::Boundary(base) => base.has_smooth_lobe(),
        }
    }
}

/// Clear coat and sheen over a base.
#[derive(Clone, Copy, Debug)]
pub struct Varnish<'a> {
    base: Varnished<'a>,
    /// From the frame of the coat; `None` where both have the same.
    to_base: Option<Mat3>,
    coat: Coat<'static>,
    clearcoat: f32,
    /// What the coat passes face on.
    coat_passes: f32,
    sheen: Option<Sheen>,
}

/// The base is sampled with at least this share of what passes the coat: the weight of what it gives stays bounded.
const LEAST_OF_BASE: f32 = 0.05;

/// A coat of index 1.5.
fn coat_of(roughness: f32) -> Coat<'static> {
    COAT.coat(Microfacets::from(roughness.clamp(0.0, 1.0)).rough().as_ref())
}

/// What a clear coat of such coverage and roughness leaves of light that comes from beneath it and goes on at this
/// cosine, in [0, 1].
pub fn passed_by_clearcoat(clearcoat: f32, roughness: f32, cosine: f32) -> f32 {
    1.0 - clearcoat.clamp(0.0, 1.0) * coat_of(roughness).reflectance(direction_at(cosine.clamp(0.0, 1.0)))
}

/// A direction in the frame of the coat and in that of what lies beneath.
#[derive(Clone, Copy, Debug)]
struct CoatAndBaseDirections {
    by_coat: Vec3,
    by_base: Vec3,
}

impl CoatAndBaseDirections {
    /// Whether it is on the same side of both. What is not would leak light.
    fn sides_agree(&self) -> bool {
        let [coat, base] = [self.by_coat.z, self.by_base.z];
        coat > 0.0 && base > 0.0 || coat < 0.0 && base < 0.0
    }

    /// The direction mirrored in the plane of each.
    fn turned(self) -> Self {
        Self { by_coat: turn(self.by_coat), by_base: turn(self.by_base) }
    }

    /// As seen from the side of the coat that `wo` is on.
    fn seen_from(self, wo: &Self) -> Self {
        if wo.by_coat.z < 0.0 { self.turned() } else { self }
    }
}

impl<'a> Varnish<'a> {
    /// Layers as in the file's head over a base.
    pub fn new(
        base: Varnished<'a>,
        clearcoat: f32,
        clearcoat_roughness: f32,
        sheen_color: Vec3,
        sheen_roughness: f32,
    ) -> Self {
        let coat = coat_of(clearcoat_roughness);
        let clearcoat = clearcoat.clamp(0.0, 1.0);
        let color = sheen_color.clamp(Vec3::ZERO, Vec3::ONE);
        Self {
            base,
            to_base: None,
            coat,
            clearcoat,
            coat_passes: 1.0 - clearcoat * coat.reflectance(Vec3::Z),
            sheen: (color != Vec3::ZERO).then(|| Sheen::new(color, sheen_roughness)),
        }
    }

    /// These layers where what lies beneath the coat has another normal. Directions are then in the frame of the coat,
    /// and the rotation takes them to that of the fibres and the base.
    pub fn over_relief(self, to_base: Option<Mat3>) -> Self {
        Self { to_base, ..self }
    }

    fn in_both_frames(&self, w: Vec3) -> CoatAndBaseDirections {
        CoatAndBaseDirections { by_coat: w, by_base: self.to_base.map_or(w, |to_base| to_base * w) }
    }

    pub(super) fn has_smooth_lobe(&self) -> bool {
        self.base.has_smooth_lobe() || self.sheen.is_some() || self.clearcoat > 0.0 && self.coat.facets.is_some()
    }

    fn coat_passed(&self, w: &CoatAndBaseDirections) -> f32 {
        1.0 - self.clearcoat * self.coat.reflectance(w.by_coat)
    }

    /// What the coat and the sheen leave of what passes both ways; directions of the upper half.
    fn passed_to_base(&self, wo: &CoatAndBaseDirections, wi: &CoatAndBaseDirections) -> f32 {
        let coat = self.coat_passed(wo) * self.coat_passed(wi) / self.coat_passes;
        let sheen =
            self.sheen.as_ref().map_or(1.0, |sheen| sheen.passed(wo.by_base) * sheen.passed(wi.by_base) / sheen.passes);
        coat * sheen
    }

    /// What the layers leave of light that comes from `wo` above and goes to `wi` through the base, on either side.
    fn passed(&self, wo: &CoatAndBaseDirections, wi: &CoatAndBaseDirections) -> f32 {
        match self.base {
            _ if wi.by_coat.z > 0.0 => self.passed_to_base(wo, wi),
            Varnished::Sheet(_) => self.passed_to_base(wo, &wi.turned()),
            Varnished::Boundary(_) => self.passed_once(wo),
        }
    }

    /// What the coat and the sheen leave of what passes them once, to or from `w` above.
    fn passed_once(&self, w: &CoatAndBaseDirections) -> f32 {
        self.coat_passed(w) * self.sheen.as_ref().map_or(1.0, |sheen| sheen.passed(w.by_base))
    }

    /// Whether a direction is in the volume.
    fn is_inside(&self, w: &CoatAndBaseDirections) -> bool {
        matches!(self.base, Varnished::Boundary(_)) && w.by_coat.z < 0.0
    }

    /// What the layers leave of light that meets the boundary from inside and goes to `wi`.
    fn passed_from_inside(&self, wi: &CoatAndBaseDirections) -> f32 {
        if wi.by_coat.z > 0.0 { self.passed_once(wi) } else { 1.0 }
    }

    /// Probabilities of coat and sheen; the rest is the base's.
    fn shares(&self, wo: &CoatAndBaseDirections) -> [f32; 2] {
        if !wo.sides_agree() {
            return [1.0, 0.0];
        }
        let passed = self.coat_passed(wo);
        let sheen =
            self.sheen.as_ref().map_or(0.0, |sheen| passed * sheen.color.max_element() * sheen.albedo(wo.by_base));
        let left = passed - sheen;
        let base = (left * self.base.albedo(wo.by_base).max_element()).max(LEAST_OF_BASE * left);
        let total = 1.0 - passed + sheen + base;
        [(1.0 - passed) / total, sheen / total]
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> BsdfEvaluation {
        let (wo, wi) = (self.in_both_frames(wo), self.in_both_frames(wi));
        if self.is_inside(&wo) {
            let BsdfEvaluation { value, pdf } = self.evaluate_base(&wo, &wi);
            return BsdfEvaluation { value: value * self.passed_from_inside(&wi), pdf };
        }
        if wo.by_coat.z == 0.0 || wi.by_coat.z == 0.0 {
            return BsdfEvaluation::BLACK;
        }
        let shares = self.shares(&wo.seen_from(&wo));
        self.evaluate_layers(shares, wo, wi)
    }

    fn evaluate_base(&self, wo: &CoatAndBaseDirections, wi: &CoatAndBaseDirections) -> BsdfEvaluation {
        match wo.sides_agree() && wi.sides_agree() {
            true => self.base.evaluate(wo.by_base, wi.by_base),
            false => BsdfEvaluation::BLACK,
        }
    }

    /// For a `wo` that is not in a volume.
    fn evaluate_layers(
        &self,
        [coat_share, sheen_share]: [f32; 2],
        wo: CoatAndBaseDirections,
        wi: CoatAndBaseDirections,
    ) -> BsdfEvaluation {
        let base = self.evaluate_base(&wo, &wi);
        let (wo, wi) = (wo.seen_from(&wo), wi.seen_from(&wo));
        let reaches_base = wo.sides_agree() && wi.sides_agree();
        let mut value = if reaches_base { base.value * self.passed(&wo, &wi) } else { Vec3::ZERO };
        let mut pdf = base.pdf * (1.0 - coat_share - sheen_share).max(0.0);
        if wi.by_coat.z > 0.0 {
            if let Some(sheen) = self.sheen.as_ref().filter(|_| reaches_base) {
                let coat = self.coat_passed(&wo) * self.coat_passed(&wi) / self.coat_passes;
                value += sheen.scattered(coat, wo.by_base, wi.by_base);
                pdf += sheen_share * warp::cosine_hemisphere_pdf(wi.by_base.z);
            }
            if let Some(facets) = &self.coat.facets {
                let facet = facets.reflect(wo.by_coat, wi.by_coat);
                let reflectance = fresnel::dielectric(facet.cos_half, self.coat.eta).reflectance;
                value += Vec3::splat(self.clearcoat * reflectance * facet.value);
                pdf += coat_share * facet.pdf;
            }
        }
        BsdfEvaluation { value, pdf }
    }

    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let seen = self.in_both_frames(wo);
        if self.is_inside(&seen) {
            let sample = self.sample_base(&seen, u)?;
            let passed = self.passed_from_inside(&self.in_both_frames(sample.wi));
            return Some(BsdfSample { weight: sample.weight * passed, ..sample });
        }
        let is_turned = wo.z < 0.0;
        let front = seen.seen_from(&seen);
        let shares = self.shares(&front);
        let [coat_share, sheen_share] = shares;
        let point = [u[0], u[1]];
        if u[2] < coat_share {
            let Some(facets) = &self.coat.facets else {
                let weight = Vec3::splat(self.clearcoat * self.coat.reflectance(front.by_coat) / coat_share);
                return Some(BsdfSample::reflected_delta(reflect_about_normal(wo), weight, coat_share));
            };
            let wi = facets.sample_reflection(front.by_coat, point)?;
            return self.sampled(shares, seen, if is_turned { turn(wi) } else { wi });
        }
        if u[2] < coat_share + sheen_share {
            let wi = warp::cosine_hemisphere(point);
            return self.sampled(shares, seen, self.above_base(if is_turned { turn(wi) } else { wi })?);
        }
        let base_share = (1.0 - coat_share - sheen_share).max(1e-6);
        let of_base = warp::choose(u[2], coat_share + sheen_share);
        let sample = self.sample_base(&seen, [u[0], u[1], of_base.rest])?;
        if sample.lobe.is_delta() {
            let wi = self.in_both_frames(sample.wi).seen_from(&seen);
            let weight = sample.weight * (self.passed(&front, &wi) / base_share);
            return Some(BsdfSample { weight, pdf: base_share * sample.pdf, ..sample });
        }
        let whole = self.sampled(shares, seen, sample.wi)?;
        Some(BsdfSample { crossed_index: sample.crossed_index, ..whole })
    }

    /// The sample of a smooth lobe that chose `wi`.
    fn sampled(&self, shares: [f32; 2], wo: CoatAndBaseDirections, wi: Vec3) -> Option<BsdfSample> {
        let front = if wo.by_coat.z < 0.0 { turn(wi) } else { wi };
        self.evaluate_layers(shares, wo, self.in_both_frames(wi)).sample_turned(front, wo.by_coat)
    }

    /// A sample of the base in the frame of the coat.
    fn sample_base(&self, wo: &CoatAndBaseDirections, u: [f32; 3]) -> Option<BsdfSample> {
        let sample = self.base.sample(Some(wo).filter(|wo| wo.sides_agree())?.by_base, u)?;
        Some(BsdfSample { wi: self.above_base(sample.wi)?, ..sample })
    }

    /// A direction of the base's frame in that of the coat; `None` where it is on the other side there.
    fn above_base(&self, w: Vec3) -> Option<Vec3> {
        let Some(to_base) = &self.to_base else { return Some(w) };
        let by_coat = (to_base.transpose() * w).normalize_or(w);
        (CoatAndBaseDirections { by_coat, by_base: w }).sides_agree().then_some(by_coat)
    }

    pub(super) fn straight_through(&self, wo: Vec3) -> Vec3 {
        match &self.base {
            Varnished::Sheet(base) => {
                let wo = self.in_both_frames(wo);
                let front = wo.seen_from(&wo);
                if !front.sides_agree() {
                    return Vec3::ZERO;
                }
                let back = CoatAndBaseDirections { by_coat: -front.by_coat, by_base: -front.by_base };
                base.straight_through(front.by_base) * self.passed(&front, &back)
            }
            Varnished::Boundary(_) => Vec3::ZERO,
        }
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let wo = self.in_both_frames(wo);
        if self.is_inside(&wo) {
            return self.base.albedo(wo.by_base);
        }
        let up = wo.seen_from(&wo);
        let passed = self.coat_passed(&up);
        if !up.sides_agree() {
            return Vec3::splat(1.0 - passed);
        }
        let (sheen, left) = match &self.sheen {
            None => (Vec3::ZERO, 1.0),
            Some(sheen) => (sheen.color * sheen.albedo(up.by_base), sheen.passed(up.by_base)),
        };
        Vec3::splat(1.0 - passed) + passed * (sheen + left * self.base.albedo(up.by_base))
    }
}
