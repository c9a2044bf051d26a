//! Rays, triangles, spheres and the two-level tree that finds what a ray hits.
//!
//! [`World`] is what the rest of the program sees: `closest` and `occluded`, and [`World::surface`] for what is
//! there. Triangles are in eight-wide trees of our own (`wide_tree`), many things in a binary one of obvhs, which
//! builds both ([`tree`]). The triangle test is ours, because a leak at a shared edge is a firefly that an adaptive
//! sampler would chase for ever.

mod collapse;
mod face;
mod facet;
mod mesh_tree;
pub(crate) mod offset;
mod simd;
pub mod sphere;
pub mod surface;
pub mod tree;
pub mod triangle;
mod wide_tree;
mod world;

pub(crate) use face::Face;
pub use facet::Facet;
pub(crate) use simd::{VectorWork, prefetch, with_vectors};
pub use surface::SurfacePoint;
pub use world::{Ball, Hit, World};

use glam::Vec3A;

/// A half-line. `direction` has unit length, so distances along it are scene units.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3A,
    /// Unit direction.
    pub direction: Vec3A,
    /// When, as share of the open shutter, in [0, 1].
    pub time: f32,
    /// What surfaces that blend are to it.
    pub coverage: Coverage,
}

/// How a ray meets surfaces that alpha leaves in place only partly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// Covered by chance, so that the mean over rays is the blend.
    #[default]
    ByChance,
    /// Wherever they cover half or more: for what has one value at a point, such as motion, and would be salt and
    /// pepper by chance.
    ByHalf,
}

impl Ray {
    /// A ray when the shutter opens.
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        Self { origin, direction, time: 0.0, coverage: Coverage::ByChance }
    }
}
