//! Reliefs that only shading knows of: normal maps and height maps. The surface itself, its silhouette and its shadows
//! stay as they are; where those are seen, the mesh must have the shape.

use super::{ScalarInput, Texture, TextureLookup};
use glam::{Vec2, Vec3};

/// How a material's shading normal differs from its mesh's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relief {
    /// Normals in tangent space, as linear RGB in [0, 1] for [−1, 1].
    Normals {
        /// The picture.
        map: TextureLookup,
        /// Multiplies x and y of the normals.
        strength: f32,
    },
    /// Heights above the surface along its normal.
    Heights(HeightMap),
}

/// Heights of a relief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightMap {
    /// The height; negative is a dent.
    pub height: ScalarInput,
    /// Unit of the heights.
    pub unit: HeightUnit,
}

/// What a height of 1 is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightUnit {
    /// One unit of the scene (world space), however large the picture is on the surface.
    Scene,
    /// A height of 1 is as high as the picture is wide where it lies on the surface, so that slopes do not
    /// depend on the scene's unit.
    PictureWidth,
}

impl Relief {
    /// The picture that it reads.
    pub fn texture(&self) -> Option<&TextureLookup> {
        match self {
            Self::Normals { map, .. } => Some(map),
            Self::Heights(heights) => heights.height.texture.as_ref().map(|(lookup, _)| lookup),
        }
    }
}

impl HeightMap {
    /// ∂h/∂u and ∂h/∂v at texture coordinates; zero where there is no picture. Always finite for finite heights.
    ///
    /// Differences over one texel, half to each side. Of a bilinear picture that is the slope of its
    /// quadratic B-spline: normals are continuous, where the slope of the bilinear surface itself jumps at
    /// every texel's centre and shows facets.
    pub fn gradient(&self, textures: &[Texture], uv: Vec2) -> Vec2 {
        let Some((lookup, channel)) = &self.height.texture else { return Vec2::ZERO };
        let texture = &textures[lookup.texture.0 as usize];
        let at = lookup.transform(uv);
        let size = Vec2::new(texture.width as f32, texture.height as f32);
        let height = |x: f32, y: f32| texture.sample_rgba(at + Vec2::new(x, y) / size)[usize::from(*channel).min(3)];
        let along = Vec2::new(height(0.5, 0.0) - height(-0.5, 0.0), height(0.0, 0.5) - height(0.0, -0.5)) * size;
        self.height.factor * lookup.transform_gradient(along)
    }
}

impl TextureLookup {
    /// The gradient over the mesh's coordinates of what has the gradient `along` over the picture's: the transposed
    /// derivative of [`Self::transform`].
    fn transform_gradient(&self, along: Vec2) -> Vec2 {
        if self.rotation == 0.0 {
            return self.scale * along;
        }
        let (sin, cos) = self.rotation.sin_cos();
        self.scale * Vec2::new(cos * along.x - sin * along.y, sin * along.x + cos * along.y)
    }

    /// The way on the surface along which the picture's u grows by 1, from the ways along which the mesh's u and v do.
    /// Not finite where the picture is stretched without end.
    pub(crate) fn along_picture(&self, along_u: Vec3, along_v: Vec3) -> Vec3 {
        let (sin, cos) = self.rotation.sin_cos();
        along_u * (cos / self.scale.x) + if sin == 0.0 { Vec3::ZERO } else { along_v * (sin / self.scale.y) }
    }
}
