//! Materials: how a surface scatters, emits and covers, and what a renderer asks of them besides values at a point.

use super::{ColorInput, Relief, ScalarInput, Surface, Texture};
use glam::{Vec2, Vec3};

/// How a surface looks.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// How it scatters.
    pub surface: Surface,
    /// Emitted radiance in scene units; black for most.
    pub emission: ColorInput,
    /// Whether it emits from its back side too.
    pub emits_both_sides: bool,
    /// Where the shading normal differs from the mesh's.
    pub relief: Option<Relief>,
    /// Coverage; what it cuts away is not there at all.
    pub alpha: Alpha,
}

/// Coverage of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Everything is there.
    Opaque,
    /// Points whose value is below the cutoff are not there.
    Mask {
        /// Coverage.
        value: ScalarInput,
        /// Threshold in [0, 1].
        cutoff: f32,
    },
    /// Points are there with this probability.
    Blend {
        /// Coverage in [0, 1].
        value: ScalarInput,
    },
}

impl Material {
    /// A surface that neither emits nor is cut out.
    pub fn plain(name: impl Into<String>, surface: Surface) -> Self {
        Self {
            name: name.into(),
            surface,
            emission: ColorInput::constant(Vec3::ZERO),
            emits_both_sides: false,
            relief: None,
            alpha: Alpha::Opaque,
        }
    }

    /// Whether shading needs to know along which way texture coordinates grow.
    pub fn needs_tangent(&self) -> bool {
        matches!(self.relief, Some(Relief::Normals { .. })) || self.surface.is_anisotropic()
    }

    /// Mean emitted radiance over the texture's square, in scene units; `None` where nothing is emitted.
    pub fn mean_emission(&self, textures: &[Texture]) -> Option<Vec3> {
        if self.emission.factor.max_element() <= 0.0 {
            return None;
        }
        let mean = match &self.emission.texture {
            None => self.emission.factor,
            Some(lookup) => self.emission.factor * textures[lookup.texture.0 as usize].mean_color(),
        };
        (mean.max_element() > 0.0).then_some(mean)
    }
}

impl Alpha {
    /// Probability that the surface is there, at texture coordinates.
    pub fn coverage(&self, textures: &[Texture], uv: Vec2) -> f32 {
        match self {
            Self::Opaque => 1.0,
            Self::Mask { value, cutoff } => f32::from(u8::from(value.evaluate(textures, uv) >= *cutoff)),
            Self::Blend { value } => value.evaluate(textures, uv).clamp(0.0, 1.0),
        }
    }
}
