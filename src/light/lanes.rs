//! Four vectors at once, one a lane. Not for single vectors: those are glam's.

use glam::{Vec3, Vec4};

/// Four vectors, coordinate by coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FourVectors {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl FourVectors {
    pub(super) fn new(vectors: [Vec3; 4]) -> Self {
        let along = |axis: usize| Vec4::from_array(vectors.map(|vector| vector[axis]));
        Self { x: along(0), y: along(1), z: along(2) }
    }

    /// These positions as seen from a point.
    #[inline]
    pub(super) fn seen_from(&self, point: Vec3) -> Self {
        Self { x: self.x - point.x, y: self.y - point.y, z: self.z - point.z }
    }

    /// These vectors, each over a number of its own.
    #[inline]
    pub(super) fn over(&self, lengths: Vec4) -> Self {
        Self { x: self.x / lengths, y: self.y / lengths, z: self.z / lengths }
    }

    /// Products with one vector.
    #[inline]
    pub(super) fn dot(&self, vector: Vec3) -> Vec4 {
        self.x * vector.x + self.y * vector.y + self.z * vector.z
    }

    /// Products with four others, each with its own.
    #[inline]
    pub(super) fn dot_each(&self, others: &Self) -> Vec4 {
        self.x * others.x + self.y * others.y + self.z * others.z
    }
}
