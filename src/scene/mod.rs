//! What is rendered: camera, shapes, materials, textures, lights, environment.
//!
//! Plain data, filled by `load` (one file a format) and read by everybody else. Lengths are in scene units, radiance is
//! linear Rec.709 RGB in scene units: RGB (1, 1, 1) has a luminance of [`Scene::nits_per_unit`] cd/m².

mod camera;
mod environment;
mod light;
mod material;
mod metal_roughness;
mod motion;
mod photometric_web;
pub(crate) mod pictured_edges;
mod relief;
mod roughness;
mod surface;

pub mod hash;
pub mod load;
pub mod texture;

pub(crate) use camera::right_of;
pub use camera::{Camera, CameraAxes, Projection, ScreenWindow};
pub use environment::{Environment, Parametrisation};
pub use light::{Light, SpotFalloff};
pub use material::{Alpha, Material, StretchDirection};
pub use metal_roughness::{CoatRelief, MetalRoughness};
pub use motion::{Motion, MotionKey, Pose};
pub use photometric_web::PhotometricWeb;
pub use relief::{HeightMap, HeightUnit, Relief};
pub use roughness::{Distribution, Roughness, RoughnessScale};
pub use surface::Surface;

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A, Vec4};
use std::f32::consts::{PI, TAU};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Index of refraction where none is told: that of glass, which reflects 4 % face on.
pub const USUAL_IOR: f32 = 1.5;

/// Index into [`Scene::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(pub u32);
/// Index into [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);
/// Index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// What [`Scene::nits_per_unit`] may be, with room on both sides of any unit in use: beyond it single-precision
/// variances in (cd/m²)² vanish or are infinite, and nothing can be said of noise.
pub const NITS_PER_UNIT: RangeInclusive<f64> = 1e-6..=1e9;
/// Stops that exposure may be corrected by at most, up or down.
pub const MAX_EXPOSURE_STOPS: f64 = 100.0;

/// What is rendered, in memory: geometry, materials, lights and camera.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The scene's name, for reports.
    pub name: String,
    /// Luminance in cd/m² of linear RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// The camera.
    pub camera: Camera,
    /// Seconds for which its shutter stays open, of which motions hold what they do; for who writes the camera down.
    pub shutter_s: f64,
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
    /// Whether the second axis of normal maps is normal × growing u whichever way v runs, as in pbrt and Mitsuba;
    /// else it is that of falling v.
    pub bitangent_ignores_v: bool,
    /// Point, spot, photometric and directional lights, and the sun's disc. Area lights are surfaces whose material
    /// emits.
    pub lights: Vec<Light>,
    /// What rays see that hit nothing; `None` is black.
    pub environment: Option<Environment>,
    /// What the loader assumed or left out, one sentence each, shown to the user once.
    pub notes: Vec<String>,
}

impl Default for Scene {
    /// Nothing, seen from the origin along −z on one pixel; 1 cd/m² to the unit.
    fn default() -> Self {
        Self {
            name: String::new(),
            nits_per_unit: 1.0,
            camera: Camera::pinhole(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, Camera::USUAL_FOV_DEG),
            shutter_s: 0.0,
            film: FilmDefaults { width: 1, height: 1 },
            viewing: ViewingDefaults::default(),
            meshes: Vec::new(),
            instances: Vec::new(),
            spheres: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            bitangent_ignores_v: false,
            lights: Vec::new(),
            environment: None,
            notes: Vec::new(),
        }
    }
}

impl Scene {
    /// Whether anything moves while the shutter is open.
    pub fn moves(&self) -> bool {
        self.camera.motion.is_some()
            || self.instances.iter().any(|instance| instance.motion.is_some())
            || self.spheres.iter().any(|sphere| sphere.motion.is_some())
    }

    /// Puts surroundings, and their sun if there is one, in the place of those that it has: the old sun sets with its
    /// sky.
    pub fn surround(&mut self, environment: Environment, sun: Option<Light>) {
        self.environment = Some(environment);
        self.lights.retain(|light| !matches!(light, Light::Directional { is_of_sky: true, .. }));
        self.lights.extend(sun);
    }
}

/// Picture size in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmDefaults {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
}

impl FilmDefaults {
    /// A film whose longer side has so many pixels, for a view of this width over height.
    pub fn of_aspect(longer_side: u32, aspect: f32) -> Self {
        let shorter = |share: f32| (longer_side as f32 * share).round().max(1.0) as u32;
        Self { width: shorter(aspect.min(1.0)), height: shorter((1.0 / aspect).min(1.0)) }
    }
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
    /// Tangent (xyz) and handedness (w), one a position, or empty (then each triangle has that of its `uvs`).
    pub tangents: Vec<Vec4>,
    /// Linear colour that multiplies what the material reflects (its base colour), one a position, or empty for white.
    pub colors: Vec<Vec3>,
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
    /// Object space to world space when the shutter opens; invertible.
    pub to_world: Affine3A,
    /// Object space to world space while the shutter is open; `None` where it rests.
    pub motion: Option<Motion>,
}

impl Instance {
    /// Object space to world space at a share of the open shutter.
    pub fn transform_at(&self, time: f32) -> Affine3A {
        self.motion.as_ref().map_or(self.to_world, |motion| motion.at(time))
    }
}

/// An analytic sphere in world space.
#[derive(Clone, Debug)]
pub struct Sphere {
    /// Name for messages.
    pub name: String,
    /// Centre.
    pub center: Vec3,
    /// Radius in scene units, above 0.
    pub radius: f32,
    /// Axes of the sphere in the world: orthonormal, mirrored where its transform mirrors. Pictures lie around its own
    /// y.
    pub axes: Mat3A,
    /// Which material.
    pub material: MaterialId,
    /// Moves it while the shutter is open (similarities only); `None` where it rests.
    pub motion: Option<Motion>,
}

/// Where a sphere is at a moment, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpherePlace {
    /// Centre.
    pub center: Vec3A,
    /// Radius in scene units, above 0.
    pub radius: f32,
    /// Axes of the sphere at that moment, orthonormal.
    pub axes: Mat3A,
}

impl Sphere {
    /// The axes of a sphere that a similarity has put into the world.
    pub fn axes_of(to_world: &Affine3A) -> Mat3A {
        let Mat3A { x_axis, y_axis, z_axis } = to_world.matrix3;
        Mat3A::from_cols(x_axis.normalize_or(Vec3A::X), y_axis.normalize_or(Vec3A::Y), z_axis.normalize_or(Vec3A::Z))
    }

    /// The axes of a sphere that a similarity has put into the world, where the format's spheres have their poles on
    /// their own z and count their turn from x to y (pbrt, Mitsuba).
    pub fn axes_with_poles_on_z(to_world: &Affine3A) -> Mat3A {
        let axes = Self::axes_of(to_world);
        Mat3A::from_cols(axes.x_axis, axes.z_axis, -axes.y_axis)
    }

    /// Where it is at a share of the open shutter.
    pub fn place_at(&self, time: f32) -> SpherePlace {
        let center = Vec3A::from(self.center);
        let Some(motion) = &self.motion else { return SpherePlace { center, radius: self.radius, axes: self.axes } };
        let moved = motion.at(time);
        SpherePlace {
            center: moved.transform_point3a(center),
            radius: self.radius * moved.matrix3.x_axis.length(),
            axes: Self::axes_of(&moved) * self.axes,
        }
    }
}

impl SpherePlace {
    /// Texture coordinates where the unit normal is `normal`, as those of the mesh that stands in for a sphere: u runs
    /// from its own +x against the clock seen from its own +y, v from +y down.
    pub fn uv(&self, normal: Vec3A) -> Vec2 {
        let own = self.axes.transpose() * normal;
        let turn = (-own.z).atan2(own.x) / TAU;
        Vec2::new(if turn < 0.0 { turn + 1.0 } else { turn }, own.y.clamp(-1.0, 1.0).acos() / PI)
    }
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
    /// An input that is the same colour everywhere.
    pub const fn constant(factor: Vec3) -> Self {
        Self { factor, texture: None }
    }
}

impl ScalarInput {
    /// An input that is the same value everywhere.
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
