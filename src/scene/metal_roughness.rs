//! The metal-roughness model of glTF 2.0, as scene files tell it. How it scatters is left to `bsdf`.

use super::{ColorInput, Relief, ScalarInput, USUAL_IOR};
use glam::Vec3;

/// Which normal a clear coat has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CoatRelief {
    /// The relief of what the coat covers.
    OfBase,
    /// The mesh's, or that of a relief of its own: lacquer is smooth over bumps.
    Own(Option<Relief>),
}

/// Parameters of glTF's metal-roughness model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetalRoughness {
    /// Base colour in [0, 1].
    pub base_color: ColorInput,
    /// 0 dielectric, 1 metal.
    pub metallic: ScalarInput,
    /// Perceptual roughness in [0, 1].
    pub roughness: ScalarInput,
    /// Index of refraction of the dielectric part: [`USUAL_IOR`] unless told, as
    /// [`MetalRoughness::problem_with_ior`] takes it.
    pub ior: f32,
    /// Share of the dielectric part's light that goes through, not into diffuse reflection: straight through a thin
    /// sheet, or refracted into a volume if there is one.
    pub transmission: ScalarInput,
    /// Absorption per scene unit of the volume behind the surface; `None` for a thin sheet.
    pub volume: Option<Vec3>,
    /// Strength of the dielectric's reflection in [0, 1].
    pub specular: ScalarInput,
    /// Tint of the dielectric's reflection face on.
    pub specular_color: ColorInput,
    /// Stretch of facets in [0, 1] along the tangent, which the material's stretch direction turns.
    pub anisotropy: ScalarInput,
    /// Coverage of a clear coat of index 1.5, in [0, 1].
    pub clearcoat: ScalarInput,
    /// Perceptual roughness of the coat in [0, 1].
    pub clearcoat_roughness: ScalarInput,
    /// Normal of the coat.
    pub coat_relief: CoatRelief,
    /// Albedo of fibres that stand on the surface, in [0, 1].
    pub sheen_color: ColorInput,
    /// Perceptual roughness of the sheen's fibres in [0, 1].
    pub sheen_roughness: ScalarInput,
}

impl Default for MetalRoughness {
    /// White, dielectric, of roughness 0.5 and index 1.5.
    fn default() -> Self {
        Self {
            base_color: ColorInput::constant(Vec3::ONE),
            metallic: ScalarInput::constant(0.0),
            roughness: ScalarInput::constant(0.5),
            ior: USUAL_IOR,
            transmission: ScalarInput::constant(0.0),
            volume: None,
            specular: ScalarInput::constant(1.0),
            specular_color: ColorInput::constant(Vec3::ONE),
            anisotropy: ScalarInput::constant(0.0),
            clearcoat: ScalarInput::constant(0.0),
            clearcoat_roughness: ScalarInput::constant(0.0),
            coat_relief: CoatRelief::OfBase,
            sheen_color: ColorInput::constant(Vec3::ZERO),
            sheen_roughness: ScalarInput::constant(0.0),
        }
    }
}

impl MetalRoughness {
    /// Why it has no such index of refraction, with or without a volume behind it: the one rule of all loaders.
    pub fn problem_with_ior(ior: f32, has_volume: bool) -> Option<&'static str> {
        match has_volume {
            _ if (1.0..f32::INFINITY).contains(&ior) => None,
            false if ior == 0.0 => None,
            false => Some("an index of refraction is at least 1, or 0 for a surface that reflects everything"),
            true => Some("an index of refraction is at least 1 where light enters a volume"),
        }
    }

    /// The relief of its coat where that has one of its own.
    pub fn own_coat_relief(&self) -> Option<&Relief> {
        match &self.coat_relief {
            CoatRelief::Own(Some(relief)) if self.clearcoat.factor > 0.0 => Some(relief),
            _ => None,
        }
    }

    /// Whether a coat or fibres lie over the rest.
    pub fn is_varnished(&self) -> bool {
        self.clearcoat.factor > 0.0 || self.sheen_color.factor != Vec3::ZERO
    }
}
