//! What is at a hit: position, normals, texture coordinates, and the frame in which the BSDF works.

use glam::{Mat3, Vec2, Vec3, Vec3A};

/// A point on a surface, ready for shading.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// World position.
    pub position: Vec3,
    /// Unit normal of the flat triangle or sphere, on the side from which the winding is counter-clockwise.
    pub geometric_normal: Vec3,
    /// Unit normal for shading, on the same side.
    pub shading_normal: Vec3,
    /// Along growing u where the material asks for it (`needs_tangent`), else `None`; neither of unit length nor
    /// perpendicular to the shading normal.
    pub tangent: Option<Vec3>,
    /// +1 or −1: the bitangent is this times shading_normal × tangent.
    pub handedness: f32,
    /// Texture coordinates; zero where the scene has no texture.
    pub uv: Vec2,
    /// Colour of the vertices around, which multiplies what the material reflects; white where they have none.
    pub color: Vec3,
    /// Index of the object: instances first, then spheres.
    pub object: u32,
    /// Triangle of the mesh, 0 for a sphere.
    pub triangle: u32,
    /// How far new rays start off the surface, to clear its rounding error, in scene units.
    pub offset: f32,
}

impl SurfacePoint {
    /// Origin for a ray that leaves in `direction`: off the surface on that side.
    pub fn spawn(&self, direction: Vec3) -> Vec3A {
        let side = if direction.dot(self.geometric_normal) >= 0.0 { self.offset } else { -self.offset };
        Vec3A::from(self.position + side * self.geometric_normal)
    }
}

/// Where a surface goes as its texture coordinates grow, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDerivatives {
    /// ∂p/∂u.
    pub along_u: Vec3,
    /// ∂p/∂v.
    pub along_v: Vec3,
}

/// An orthonormal frame: columns are tangent, bitangent, normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame(Mat3);

impl Frame {
    /// Frame around a unit normal whose x axis leans towards `tangent`, where there is one and that is possible.
    #[inline]
    pub fn new(normal: Vec3, tangent: Option<Vec3>) -> Self {
        let Some(tangent) = tangent else {
            let (x, y) = normal.any_orthonormal_pair();
            return Self(Mat3::from_cols(x, y, normal));
        };
        let along = tangent - normal * normal.dot(tangent);
        let x = along.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        Self(Mat3::from_cols(x, normal.cross(x), normal))
    }

    /// The normal.
    pub fn normal(&self) -> Vec3 {
        self.0.z_axis
    }

    /// World to local.
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        self.0.transpose() * world
    }

    /// Local to world, for a direction whose length is 1 to within 1e-4: in the world it is 1 to within f32, by one
    /// step of Newton's towards the inverse root.
    pub fn to_world_direction(&self, local: Vec3) -> Vec3 {
        let world = self.to_world(local);
        world * (1.5 - 0.5 * world.length_squared())
    }

    /// Local to world.
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.0 * local
    }
}
