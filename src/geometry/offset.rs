//! How far rays start off the surfaces that they leave, and shadow rays end before their lamps: beyond the rounding of
//! the place that was hit and of the next test of the same surface.
//!
//! A few units in the last place of the numbers that enter both, and of nothing else: a far or large thing elsewhere
//! in the scene leaves the offsets of small ones alone. What is large itself has large offsets, since a test of it
//! adds numbers of its size.

use glam::{Vec3, Vec3A};

/// Somewhat more than six halves of a unit in the last place.
const ROUNDING: f32 = 4e-7;

/// Offset, in scene units, of a triangle in world space that a transform with this translation has put there; that is
/// zero where the triangle's tree is in world space.
#[inline]
pub(crate) fn of_triangle(corner: Vec3A, edges: [Vec3A; 2], translation: Vec3A) -> f32 {
    let [second, third] = edges.map(|edge| (corner + edge).abs());
    let reach = corner.abs().max(second).max(third).max(translation.abs());
    let extent = edges[0].abs().max(edges[1].abs());
    ROUNDING * (reach + 0.5 * extent).max_element()
}

/// Offset, in scene units, of the end of a ray that leads so far from its origin, if that is more than what is hit
/// there has: the test of what is far away adds numbers of both.
#[inline]
pub(crate) fn of_way(origin: Vec3A, way: Vec3A) -> f32 {
    ROUNDING * origin.abs().max(way.abs()).max_element()
}

/// Offset, in scene units, of a sphere, at a place on it.
#[inline]
pub(crate) fn of_sphere(position: Vec3, radius: f32) -> f32 {
    ROUNDING * (position.abs().max_element() + radius)
}
