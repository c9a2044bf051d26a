//! Everything that rays can hit, in two levels.
//!
//! Meshes that are placed once are put into world space and share one tree; meshes that are placed several times have a
//! tree each, in their own space, and are entered through their instance's transform. Spheres stay analytic.

mod at_hit;
mod build;
#[cfg(test)]
mod tests;

use super::mesh_tree::{MeshHit, MeshTree};
use super::tree::BinaryTree;
use super::wide_tree::TriangleRef;
use super::{Coverage, Ray, sphere};
use crate::sampler::{hash_words, unit_of_hash};
use crate::scene::{Alpha, Material, MaterialId, ScalarInput, Scene, SpherePlace};
use at_hit::{Placement, interpolate_uv};
use glam::{Affine3A, Vec2, Vec3, Vec3A};
use std::sync::Arc;

/// What a ray hits.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance along the ray.
    pub distance: f32,
    /// Index of the object: instances first, then spheres.
    pub object: u32,
    /// Triangle of the mesh, 0 for a sphere.
    pub triangle: u32,
    /// Where the instance's tree has the triangle.
    place: u32,
    /// Barycentric weight of the second vertex.
    pub b1: f32,
    /// Barycentric weight of the third vertex.
    pub b2: f32,
}

impl Hit {
    fn on_sphere(object: u32, distance: f32) -> Self {
        Self { distance, object, triangle: 0, place: 0, b1: 0.0, b2: 0.0 }
    }
}

/// A sphere in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre.
    pub center: Vec3,
    /// Its radius, above 0.
    pub radius: f32,
}

/// A scene with its trees.
pub struct World {
    scene: Arc<Scene>,
    /// Triangles of meshes that are placed once.
    fixed: MeshTree,
    /// Trees of meshes that are placed several times.
    shared: Vec<MeshTree>,
    /// Over `items`, where they are many.
    top: Option<BinaryTree>,
    items: Vec<Item>,
    around: Ball,
    has_alpha: bool,
    /// By instance.
    placements: Vec<Placement>,
}

/// What a leaf of the top tree holds.
#[derive(Debug)]
enum Item {
    Fixed,
    Placed {
        instance: u32,
        shared: usize,
        to_mesh: Affine3A,
    },
    /// An instance that moves while the shutter is open.
    Moving {
        instance: u32,
        shared: usize,
    },
    Sphere {
        object: u32,
        center: Vec3A,
        radius: f32,
    },
    MovingSphere {
        object: u32,
    },
}

impl World {
    /// The scene that this was built from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The sphere around the bounding box; a unit sphere for an empty scene.
    pub fn bounding_sphere(&self) -> Ball {
        self.around
    }

    /// Triangles that were left out because they have no area.
    pub fn degenerate_triangles(&self) -> usize {
        self.fixed.degenerate + self.shared.iter().map(|t| t.degenerate).sum::<usize>()
    }

    /// Memory of the trees over triangles in bytes, their copies of the vertices included.
    pub fn tree_bytes(&self) -> usize {
        self.fixed.bytes() + self.shared.iter().map(MeshTree::bytes).sum::<usize>()
    }

    /// The number of the material of an object.
    pub fn material_of(&self, object: u32) -> MaterialId {
        let instances = self.scene.instances.len();
        match self.scene.instances.get(object as usize) {
            Some(instance) => instance.material,
            None => self.scene.spheres[object as usize - instances].material,
        }
    }

    /// What an object is made of.
    pub fn material(&self, object: u32) -> &Material {
        &self.scene.materials[self.material_of(object).0 as usize]
    }

    /// The closest surface along the ray.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut t_max = f32::INFINITY;
        let Some(top) = &self.top else {
            for item in &self.items {
                if let Some(hit) = self.closest_of_item(item, ray, t_max)
                    && hit.distance < t_max
                {
                    t_max = hit.distance;
                    best = Some(hit);
                }
            }
            return best;
        };
        top.closest(ray.origin, ray.direction, t_max, |i, t_max| {
            match self.closest_of_item(&self.items[i], ray, t_max) {
                Some(hit) if hit.distance < t_max => {
                    best = Some(hit);
                    hit.distance
                }
                _ => f32::INFINITY,
            }
        });
        best
    }

    /// The closest surface of an item nearer than `t_max`.
    #[inline]
    fn closest_of_item(&self, item: &Item, ray: &Ray, t_max: f32) -> Option<Hit> {
        match item {
            Item::Fixed => self.closest_fixed(ray, t_max),
            Item::Sphere { object, center, radius } => self
                .meets_sphere(*object, *center, *radius, ray, t_max)
                .map(|distance| Hit::on_sphere(*object, distance)),
            Item::MovingSphere { object } => {
                let SpherePlace { center, radius, .. } = self.sphere_at(*object, ray.time);
                self.meets_sphere(*object, center, radius, ray, t_max).map(|distance| Hit::on_sphere(*object, distance))
            }
            Item::Placed { instance, shared, to_mesh } => {
                self.closest_of_instance(*instance, *shared, &LocalRay::new(ray, to_mesh), ray, t_max)
            }
            Item::Moving { instance, shared } => {
                let to_mesh = self.transform_at(*instance, ray.time).inverse();
                self.closest_of_instance(*instance, *shared, &LocalRay::new(ray, &to_mesh), ray, t_max)
            }
        }
    }

    fn closest_of_instance(
        &self,
        instance: u32,
        shared: usize,
        local: &LocalRay,
        ray: &Ray,
        t_max: f32,
    ) -> Option<Hit> {
        let tree = &self.shared[shared];
        let accept = |h: &MeshHit| self.is_there(tree, Some(instance), h, ray);
        tree.closest(local.origin, local.direction, t_max * local.length, accept).map(|h| Hit {
            distance: h.t / local.length,
            object: instance,
            triangle: tree.triangle(h.place).triangle,
            place: h.place,
            b1: h.b1,
            b2: h.b2,
        })
    }

    /// Whether anything is nearer than `distance` along the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray, distance: f32) -> bool {
        match &self.top {
            None => self.items.iter().any(|item| self.is_before(item, ray, distance)),
            Some(top) => top.any(ray.origin, ray.direction, distance, |i, t_max| {
                if self.is_before(&self.items[i], ray, t_max) { 0.0 } else { f32::INFINITY }
            }),
        }
    }

    /// Whether anything of an item is nearer than `t_max` along the ray.
    #[inline]
    fn is_before(&self, item: &Item, ray: &Ray, t_max: f32) -> bool {
        match item {
            Item::Fixed => self.occluded_by_fixed(ray, t_max),
            Item::Sphere { object, center, radius } => {
                self.meets_sphere(*object, *center, *radius, ray, t_max).is_some()
            }
            Item::MovingSphere { object } => {
                let SpherePlace { center, radius, .. } = self.sphere_at(*object, ray.time);
                self.meets_sphere(*object, center, radius, ray, t_max).is_some()
            }
            Item::Placed { instance, shared, to_mesh } => {
                self.occluded_by_instance(*instance, *shared, &LocalRay::new(ray, to_mesh), ray, t_max)
            }
            Item::Moving { instance, shared } => {
                let to_mesh = self.transform_at(*instance, ray.time).inverse();
                self.occluded_by_instance(*instance, *shared, &LocalRay::new(ray, &to_mesh), ray, t_max)
            }
        }
    }

    fn occluded_by_instance(&self, instance: u32, shared: usize, local: &LocalRay, ray: &Ray, t_max: f32) -> bool {
        let tree = &self.shared[shared];
        let accept = |h: &MeshHit| self.is_there(tree, Some(instance), h, ray);
        tree.any(local.origin, local.direction, t_max * local.length, accept)
    }

    /// Where a sphere is met that alpha leaves in place there.
    #[inline]
    fn meets_sphere(&self, object: u32, center: Vec3A, radius: f32, ray: &Ray, t_max: f32) -> Option<f32> {
        sphere::intersect(ray, center, radius, t_max, |distance, side| {
            !self.has_alpha || self.sphere_is_covered(object, ray, distance, side)
        })
    }

    fn closest_fixed(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        let accept = |h: &MeshHit| self.is_there(&self.fixed, None, h, ray);
        self.fixed.closest(ray.origin, ray.direction, t_max, accept).map(|h| {
            let TriangleRef { instance, triangle } = self.fixed.triangle(h.place);
            Hit { distance: h.t, object: instance, triangle, place: h.place, b1: h.b1, b2: h.b2 }
        })
    }

    fn occluded_by_fixed(&self, ray: &Ray, distance: f32) -> bool {
        self.fixed.any(ray.origin, ray.direction, distance, |h| self.is_there(&self.fixed, None, h, ray))
    }

    /// Whether alpha leaves this point of the surface in place.
    #[inline]
    fn is_there(&self, tree: &MeshTree, instance: Option<u32>, hit: &MeshHit, ray: &Ray) -> bool {
        !self.has_alpha || self.is_covered(tree.triangle(hit.place), instance, hit, ray)
    }

    /// The same of a triangle of an instance, or of the instance that the fixed tree names.
    fn is_covered(&self, triangle: TriangleRef, instance: Option<u32>, hit: &MeshHit, ray: &Ray) -> bool {
        let number = instance.unwrap_or(triangle.instance);
        self.covers(Part { object: number, number: triangle.triangle }, ray, || {
            let mesh = &self.scene.meshes[self.scene.instances[number as usize].mesh.0 as usize];
            interpolate_uv(mesh, triangle.triangle, hit.b1, hit.b2)
        })
    }

    /// The same of a sphere.
    fn sphere_is_covered(&self, object: u32, ray: &Ray, distance: f32, side: sphere::Side) -> bool {
        self.covers(Part { object, number: side as u32 }, ray, || {
            let place = self.sphere_at(object, ray.time);
            place.uv((ray.origin + ray.direction * distance - place.center).normalize_or(Vec3A::Y))
        })
    }

    fn covers(&self, part: Part, ray: &Ray, uv: impl Fn() -> Vec2) -> bool {
        let coverage = |value: &ScalarInput| value.evaluate(&self.scene.textures, uv());
        match &self.material(part.object).alpha {
            Alpha::Opaque => true,
            Alpha::Unseen => false,
            Alpha::Mask { value, cutoff } => coverage(value) >= *cutoff,
            Alpha::Blend { value } => match ray.coverage {
                Coverage::ByChance => coverage(value) > part.chance(ray),
                Coverage::ByHalf => coverage(value) >= 0.5,
            },
        }
    }
}

/// A ray in an instance's mesh space, its direction made unit again: distances there are `length` times longer.
struct LocalRay {
    origin: Vec3A,
    direction: Vec3A,
    length: f32,
}

impl LocalRay {
    fn new(ray: &Ray, to_mesh: &Affine3A) -> Self {
        let direction = to_mesh.transform_vector3a(ray.direction);
        let length = direction.length();
        Self { origin: to_mesh.transform_point3a(ray.origin), direction: direction / length, length }
    }
}

/// A triangle of an object, or the near or far side of a sphere.
#[derive(Clone, Copy)]
struct Part {
    object: u32,
    number: u32,
}

impl Part {
    /// A random number in [0, 1) that is a pure function of the ray and the part: the same ray always agrees with
    /// itself, and parts behind one another know nothing of each other.
    fn chance(self, ray: &Ray) -> f32 {
        let mut h = u64::from(self.object) << 32 | u64::from(self.number);
        for value in ray.origin.to_array().into_iter().chain(ray.direction.to_array()) {
            h = hash_words(h, u64::from(value.to_bits()));
        }
        unit_of_hash(h)
    }
}
