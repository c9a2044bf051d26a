//! Materials: how a surface scatters, emits and covers, and what a renderer asks of them besides values at a point.
//! What there is at a point is left to the integrator.

use super::{ColorInput, Relief, ScalarInput, Surface, Texture, TextureId, TextureLookup};
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
    /// Where the facets of an anisotropic surface are turned; `None` where they lie along growing u.
    pub stretch: Option<StretchDirection>,
    /// Coverage; what it cuts away is not there at all.
    pub alpha: Alpha,
}

/// The direction, in the plane of the surface, that an anisotropic surface takes for its tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchDirection {
    /// Radians from growing u towards the top of the picture (falling v).
    pub rotation: f32,
    /// Picture whose red and green are the direction before the rotation, [0, 1] for [−1, 1]: (1, 0.5) is growing u.
    pub map: Option<TextureLookup>,
}

impl StretchDirection {
    /// Components along growing u and falling v at texture coordinates; of no particular length, (1, 0) where the
    /// picture has no direction.
    pub fn evaluate(&self, textures: &[Texture], uv: Vec2) -> Vec2 {
        let mapped = self.map.map_or(Vec2::X, |map| {
            let texel = textures[map.texture.0 as usize].sample_rgba(map.transform(uv));
            2.0 * Vec2::new(texel.x, texel.y) - 1.0
        });
        // Grey bytes are 1/255 away from 0.
        let direction = if mapped.length_squared() > 1e-4 { mapped } else { Vec2::X };
        Vec2::from_angle(self.rotation).rotate(direction)
    }
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
        /// Threshold, at least 0; nothing is there above 1.
        cutoff: f32,
    },
    /// Points are there with this probability.
    Blend {
        /// Coverage in [0, 1].
        value: ScalarInput,
    },
    /// No ray meets it, and yet it shines in full (area lights of alpha 0 in pbrt-v4).
    Unseen,
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
            stretch: None,
            alpha: Alpha::Opaque,
        }
    }

    /// Reliefs of the material and of its coat.
    pub fn reliefs(&self) -> impl Iterator<Item = &Relief> {
        let of_coat = match &self.surface {
            Surface::MetalRoughness(model) => model.own_coat_relief(),
            _ => None,
        };
        self.relief.iter().chain(of_coat)
    }

    /// Whether shading needs to know along which way texture coordinates grow.
    pub fn needs_tangent(&self) -> bool {
        self.reliefs().any(|relief| matches!(relief, Relief::Normals { .. })) || self.surface.is_anisotropic()
    }

    /// Whether one place of the surface may look unlike another, or one direction along it unlike another.
    pub fn has_places(&self) -> bool {
        self.reads_pictures() || self.reliefs().next().is_some() || self.surface.is_anisotropic()
    }

    /// Whether anything about it comes from a picture.
    pub fn reads_pictures(&self) -> bool {
        let reads_color = |color: &ColorInput| color.texture.is_some();
        let covers = match &self.alpha {
            Alpha::Opaque | Alpha::Unseen => false,
            Alpha::Mask { value, .. } | Alpha::Blend { value } => value.texture.is_some(),
        };
        covers
            || reads_color(&self.emission)
            || self.reliefs().any(|relief| relief.texture().is_some())
            || self.surface.colors().into_iter().any(reads_color)
            || self.surface.scalars().into_iter().any(|scalar| scalar.texture.is_some())
    }

    /// What it emits, in scene units, where that is the same all over it: nowhere a picture, nowhere covered by alpha.
    pub fn even_emission(&self) -> Option<Vec3> {
        let is_even = self.emission.texture.is_none() && self.alpha == Alpha::Opaque;
        (is_even && self.emission.factor.max_element() > 0.0).then_some(self.emission.factor)
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
    /// The texture whose alpha channel is the coverage.
    pub fn texture_of_coverage(&self) -> Option<TextureId> {
        match self {
            Self::Opaque | Self::Unseen => None,
            Self::Mask { value, .. } | Self::Blend { value } => {
                value.texture.filter(|(_, channel)| *channel == 3).map(|(lookup, _)| lookup.texture)
            }
        }
    }

    /// Share of what the surface emits that it sends out, at texture coordinates: the probability that it is there.
    pub fn coverage(&self, textures: &[Texture], uv: Vec2) -> f32 {
        match self {
            Self::Opaque | Self::Unseen => 1.0,
            Self::Mask { value, cutoff } => f32::from(u8::from(value.evaluate(textures, uv) >= *cutoff)),
            Self::Blend { value } => value.evaluate(textures, uv).clamp(0.0, 1.0),
        }
    }
}
