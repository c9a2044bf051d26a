//! One piece of a surface in the world. For those who look at surfaces, not for rays.

use glam::Vec3;

/// A triangle or a sphere, where a ray would meet it.
#[derive(Clone, Copy, Debug)]
pub enum Facet {
    /// A triangle, by its corners.
    Triangle([Vec3; 3]),
    /// A sphere.
    Sphere {
        /// Its centre.
        center: Vec3,
        /// Its radius.
        radius: f32,
    },
}

impl Facet {
    /// Middle of the facet.
    pub fn center(&self) -> Vec3 {
        match self {
            Self::Triangle(corners) => corners.iter().sum::<Vec3>() / 3.0,
            Self::Sphere { center, .. } => *center,
        }
    }
}
