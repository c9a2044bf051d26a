//! Tells how a picture lies on a triangle, by its texture coordinates.

use glam::{Vec2, Vec3};

/// The two edges that leave a triangle's first corner, in space and on the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PicturedEdges {
    pub(crate) in_space: [Vec3; 2],
    pub(crate) on_picture: [Vec2; 2],
}

impl PicturedEdges {
    /// Twice the triangle's area on the picture. v runs down it, so that of a picture that is not mirrored is negative.
    #[inline]
    pub(crate) fn doubled_area(self) -> f32 {
        self.on_picture[0].perp_dot(self.on_picture[1])
    }

    /// Whether the picture is seen mirrored from the triangle's front.
    #[inline]
    pub(crate) fn is_mirrored(self) -> bool {
        self.doubled_area() > 0.0
    }

    /// Way along growing u, times [`Self::doubled_area`].
    #[inline]
    pub(crate) fn along_u_times_area(self) -> Vec3 {
        self.in_space[0] * self.on_picture[1].y - self.in_space[1] * self.on_picture[0].y
    }

    /// Way along growing v, times [`Self::doubled_area`].
    #[inline]
    pub(crate) fn along_v_times_area(self) -> Vec3 {
        self.in_space[1] * self.on_picture[0].x - self.in_space[0] * self.on_picture[1].x
    }

    /// Direction of growing u.
    #[inline]
    pub(crate) fn along_u(self) -> Option<Vec3> {
        (self.along_u_times_area() * self.doubled_area().signum()).try_normalize()
    }
}
