//! What is rendered: camera, shapes, materials, textures, lights, environment.
//!
//! Plain data, filled by `load` (one file a format) and read by everybody else. Lengths are in scene units, radiance is
//! linear Rec.709 RGB in scene units: RGB (1, 1, 1) has a luminance of [`Scene::nits_per_unit`] cd/m².

mod material;

use glam::{Affine3A, Mat3, Vec2, Vec3, Vec4};
use std::sync::Arc;

pub mod hash;
pub mod load;
pub mod texture;

/// Index into [`Scene::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub u32);
/// Index into [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);
/// Index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// Everything that is rendered, in memory.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The scene's name, for reports.
    pub name: String,
    /// Luminance in cd/m² of linear RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// The camera.
    pub camera: Camera,
    /// Picture size when the command line names none.
    pub film: FilmDefaults,
    /// Display, quality and operator when the command line names none.
    pub viewing: ViewingDefaults,
    /// Triangle meshes in object space.
    pub meshes: Vec<Mesh>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Analytic spheres in world space.
    pub spheres: Vec<Sphere>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Decoded textures.
    pub textures: Vec<Texture>,
    /// Point, spot and directional lights. Area lights are surfaces whose material emits.
    pub lights: Vec<Light>,
    /// What rays see that hit nothing; `None` is black.
    pub environment: Option<Environment>,
    /// What the loader assumed or left out, one sentence each, shown to the user once.
    pub notes: Vec<String>,
}

/// Picture size in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmDefaults {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
}

/// What the scene file asks of display, quality and picture; the command line overrides it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewingDefaults {
    /// Display preset's name or file.
    pub display: Option<String>,
    /// Visibility that the render may leave (1 = at threshold).
    pub visibility: Option<f64>,
    /// Tone operator's name.
    pub operator: Option<String>,
    /// Exposure correction in stops for the operator `constant`.
    pub exposure_stops: Option<f64>,
}

/// A thin-lens camera that looks along `forward` with `up` towards the top of the picture.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Centre of the lens, world space.
    pub position: Vec3,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Up vector, need not be perpendicular to `forward`, not parallel to it.
    pub up: Vec3,
    /// Full vertical field of view in degrees, in (0, 180).
    pub vertical_fov_deg: f32,
    /// Radius of the lens in scene units; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance of the plane in focus along `forward`, scene units, above 0.
    pub focus_distance: f32,
}

/// A triangle mesh in object space. Every index is in range and every position finite: loaders guarantee it.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, one a position, or empty for flat shading.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a position, or empty. v runs down the image as in glTF (v = 0 is the top row).
    pub uvs: Vec<Vec2>,
    /// Tangent (xyz) and handedness (w), one a position, or empty (then derived from `uvs`).
    pub tangents: Vec<Vec4>,
    /// Vertex indices of each triangle, counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Name for messages.
    pub name: String,
    /// Which mesh.
    pub mesh: MeshId,
    /// Which material.
    pub material: MaterialId,
    /// Object space to world space; invertible.
    pub to_world: Affine3A,
}

/// An analytic sphere in world space.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Name for messages.
    pub name: String,
    /// Centre.
    pub center: Vec3,
    /// Radius, above 0.
    pub radius: f32,
    /// Which material.
    pub material: MaterialId,
}

/// A colour that is constant or read from a texture and multiplied by a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorInput {
    /// Constant, or the factor of the texture. Linear Rec.709.
    pub factor: Vec3,
    /// Texture that multiplies `factor`.
    pub texture: Option<TextureLookup>,
}

/// A scalar that is constant or read from one channel of a texture and multiplied by a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarInput {
    /// Constant, or the factor of the texture.
    pub factor: f32,
    /// Texture whose channel (0 red .. 3 alpha) multiplies `factor`.
    pub texture: Option<(TextureLookup, u8)>,
}

/// A texture and how its coordinates are made: uv' = R(rotation)·(scale·uv) + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureLookup {
    /// Which texture.
    pub texture: TextureId,
    /// Added to the coordinates.
    pub offset: Vec2,
    /// Rotation in radians, as in glTF's KHR_texture_transform.
    pub rotation: f32,
    /// Scale of the coordinates.
    pub scale: Vec2,
}

impl ColorInput {
    /// The same colour everywhere.
    pub const fn constant(factor: Vec3) -> Self {
        Self { factor, texture: None }
    }
}

impl ScalarInput {
    /// The same value everywhere.
    pub const fn constant(factor: f32) -> Self {
        Self { factor, texture: None }
    }
}

impl TextureLookup {
    /// The texture with the mesh's own coordinates.
    pub const fn plain(texture: TextureId) -> Self {
        Self { texture, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

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
    /// Tangent-space normal map and the strength of its x and y.
    pub normal_map: Option<(TextureLookup, f32)>,
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

/// How a surface scatters light. Roughness is perceptual: the microfacet width α is its square; 0 is smooth.
#[derive(Clone, Debug)]
pub enum Surface {
    /// Lambert.
    Diffuse {
        /// Albedo in [0, 1].
        reflectance: ColorInput,
    },
    /// A perfect mirror.
    Mirror {
        /// Reflectance in [0, 1].
        reflectance: ColorInput,
    },
    /// A metal with complex index of refraction η + ik per RGB channel.
    Conductor {
        /// Real part.
        eta: Vec3,
        /// Imaginary part.
        k: Vec3,
        /// Perceptual roughness in [0, 1].
        roughness: ScalarInput,
    },
    /// Glass, water: the boundary of a clear volume.
    Dielectric {
        /// Index of refraction inside relative to outside, above 0.
        ior: f32,
        /// Perceptual roughness in [0, 1].
        roughness: ScalarInput,
        /// Tint of the transmitted light at each crossing; white for clear glass.
        transmittance: ColorInput,
    },
    /// A thin clear sheet: light goes straight through or is reflected.
    ThinDielectric {
        /// Index of refraction of the sheet.
        ior: f32,
        /// Tint of the transmitted light.
        transmittance: ColorInput,
    },
    /// The metal-roughness model of glTF 2.0.
    MetalRoughness {
        /// Base colour.
        base_color: ColorInput,
        /// 0 dielectric, 1 metal.
        metallic: ScalarInput,
        /// Perceptual roughness in [0, 1].
        roughness: ScalarInput,
        /// Index of refraction of the dielectric part, 1.5 unless told.
        ior: f32,
        /// Share of the dielectric part's light that goes through (thin), not into diffuse reflection.
        transmission: ScalarInput,
    },
}

/// How texel values are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Colour under the sRGB transfer function.
    Srgb,
    /// Values as they stand.
    Linear,
}

/// What lies outside [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Start again.
    Repeat,
    /// Start again, mirrored.
    Mirror,
    /// The edge's value.
    Clamp,
}

/// A decoded texture.
#[derive(Clone, Debug)]
pub struct Texture {
    /// File name, for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// RGBA texels, row 0 at the top.
    pub texels: Texels,
    /// What lies beyond the left and right edges.
    pub wrap_u: Wrap,
    /// What lies beyond the top and bottom edges.
    pub wrap_v: Wrap,
    /// Nearest texel instead of bilinear.
    pub nearest: bool,
}

/// Texels of a texture, 4 values each.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits a value; the encoding says what rgb mean, alpha is always linear.
    Bytes(Arc<Vec<[u8; 4]>>, Encoding),
    /// Linear floats.
    Floats(Arc<Vec<[f32; 4]>>),
}

/// A light without area.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Shines equally in all directions.
    Point {
        /// World position.
        position: Vec3,
        /// Radiant intensity in scene units × area: luminous intensity in cd is `nits_per_unit` × its luminance.
        intensity: Vec3,
    },
    /// Shines in a cone.
    Spot {
        /// World position.
        position: Vec3,
        /// Unit axis of the cone, away from the light.
        direction: Vec3,
        /// Intensity on the axis.
        intensity: Vec3,
        /// Half angle in radians inside which it shines fully.
        inner_angle: f32,
        /// Half angle in radians outside which it is dark.
        outer_angle: f32,
    },
    /// Shines from infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it: illuminance in lx is `nits_per_unit` × its luminance.
        irradiance: Vec3,
    },
}

/// Radiance from infinitely far away.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Lat-long picture of linear RGB radiance; a constant one is 1×1. Row 0 is +y (up), the middle column is −z.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Texels, row-major.
    pub texels: Arc<Vec<Vec3>>,
    /// Multiplies the texels.
    pub scale: f32,
    /// World directions to the picture's directions (a rotation).
    pub from_world: Mat3,
}
