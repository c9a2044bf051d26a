//! Everything that rays can hit, in two levels.
//!
//! Meshes that are placed once are put into world space and share one tree; meshes that are placed several times have a
//! tree each, in their own space, and are entered through their instance's transform. Spheres stay analytic.

mod at_hit;
mod build;
#[cfg(test)]
mod tests;

use super::mesh_tree::{MeshHit, MeshTree};
use super::tree::{BinaryTree, Bounds};
use super::wide_tree::TriangleRef;
use super::{Coverage, Ray, sphere};
use crate::sampler::{hash_words, unit_of_hash};
use crate::scene::{Alpha, Instance, Material, MaterialId, ScalarInput, Scene, SpherePlace};
use at_hit::{Placement, interpolate_uv};
use build::{Around, MOST_VERTICES, fixed_triangles, own_triangles, placed_bounds, swept_bounds};
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

/// A scene with its trees.
pub struct World {
    scene: Arc<Scene>,
    /// Triangles of meshes that are placed once.
    fixed: MeshTree,
    /// Trees of meshes that are placed several times.
    shared: Vec<MeshTree>,
    /// Over `items`, when they are more than [`FEW`].
    top: Option<BinaryTree>,
    items: Vec<Item>,
    center: Vec3,
    /// Of the sphere around everything.
    radius: f32,
    has_alpha: bool,
    /// By instance.
    placements: Vec<Placement>,
}

/// Up to so many items are tested one after the other: a walk costs more than it saves.
const FEW: usize = 4;

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
    /// Builds the trees. Deterministic for any number of threads.
    pub fn new(scene: Arc<Scene>) -> Self {
        let uses = count_uses(&scene);
        let fixed = MeshTree::build(&fixed_triangles(&scene, &uses));
        let mut items = BoundedItems::default();
        if fixed.bounds().is_finite() {
            items.push(Item::Fixed, fixed.bounds());
        }
        let shared = place_instances(&scene, &uses, &mut items);
        place_spheres(&scene, &mut items);
        let (center, radius) = sphere_around(&items.bounds);
        let (top, items) = arranged(items);
        let has_alpha = scene.materials.iter().any(|m| m.alpha != Alpha::Opaque);
        let placements = scene
            .instances
            .iter()
            .map(|i| Placement::new(&scene, i, shared.of_mesh[i.mesh.0 as usize].map(|tree| tree as u32)))
            .collect();
        Self { scene, fixed, shared: shared.trees, top, items, center, radius, has_alpha, placements }
    }

    /// The scene that this was built from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Centre of the bounding box and radius of the sphere around it; a unit sphere for an empty scene.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        (self.center, self.radius)
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

/// Items of the top level, each with what holds it.
#[derive(Default)]
struct BoundedItems {
    items: Vec<Item>,
    bounds: Vec<Bounds>,
}

impl BoundedItems {
    fn push(&mut self, item: Item, bounds: Bounds) {
        self.items.push(item);
        self.bounds.push(bounds);
    }
}

/// The trees of meshes that are placed several times, and which one a mesh has.
struct SharedTrees {
    trees: Vec<MeshTree>,
    of_mesh: Vec<Option<usize>>,
}

/// How often each mesh is placed. What moves cannot be put into world space and counts twice.
fn count_uses(scene: &Scene) -> Vec<u32> {
    let mut uses = vec![0u32; scene.meshes.len()];
    for instance in &scene.instances {
        uses[instance.mesh.0 as usize] += if instance.motion.is_some() { 2 } else { 1 };
    }
    uses
}

/// Adds the instances of meshes that are used more than once, and builds the trees of those.
fn place_instances(scene: &Scene, uses: &[u32], items: &mut BoundedItems) -> SharedTrees {
    let is_placed = |instance: &&Instance| uses[instance.mesh.0 as usize] >= 2 && instance.motion.is_none();
    let vertices = |instance: &Instance| scene.meshes[instance.mesh.0 as usize].positions.len();
    let all_vertices = scene.instances.iter().filter(is_placed).map(vertices).sum::<usize>();
    let around = if all_vertices <= MOST_VERTICES { Around::Vertices } else { Around::OwnBox };
    let mut trees: Vec<MeshTree> = Vec::new();
    let mut of_mesh = vec![None; scene.meshes.len()];
    for (number, instance) in scene.instances.iter().enumerate() {
        let mesh = instance.mesh.0 as usize;
        if uses[mesh] < 2 {
            continue;
        }
        let shared = *of_mesh[mesh].get_or_insert_with(|| {
            trees.push(MeshTree::build(&own_triangles(scene, mesh)));
            trees.len() - 1
        });
        let bounds = trees[shared].bounds();
        if !bounds.is_finite() {
            continue;
        }
        let number = number as u32;
        match &instance.motion {
            Some(motion) => items.push(Item::Moving { instance: number, shared }, swept_bounds(motion, bounds)),
            None => {
                let to_mesh = instance.to_world.inverse();
                let placed = placed_bounds(scene, instance, bounds, around);
                items.push(Item::Placed { instance: number, shared, to_mesh }, placed);
            }
        }
    }
    SharedTrees { trees, of_mesh }
}

fn place_spheres(scene: &Scene, items: &mut BoundedItems) {
    for (number, sphere) in scene.spheres.iter().enumerate() {
        let (center, radius) = (Vec3A::from(sphere.center), sphere.radius);
        let object = (scene.instances.len() + number) as u32;
        let bounds = Bounds { min: center - radius, max: center + radius };
        match &sphere.motion {
            Some(motion) => items.push(Item::MovingSphere { object }, swept_bounds(motion, bounds)),
            None => items.push(Item::Sphere { object, center, radius }, bounds),
        }
    }
}

/// Centre and radius of the sphere around the box around everything; a unit sphere where there is nothing.
fn sphere_around(bounds: &[Bounds]) -> (Vec3, f32) {
    let bounds = bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
    if !bounds.is_finite() {
        return (Vec3::ZERO, 1.0);
    }
    let center = (bounds.min + bounds.max) * 0.5;
    (center.into(), (bounds.max - center).length().max(f32::MIN_POSITIVE))
}

/// Items in the order in which they are met, with a tree over them where they are many; those without a finite box are left out.
fn arranged(BoundedItems { items, bounds }: BoundedItems) -> (Option<BinaryTree>, Vec<Item>) {
    if items.len() <= FEW {
        let finite = items.into_iter().zip(bounds).filter(|(_, bounds)| bounds.is_finite());
        return (None, finite.map(|(item, _)| item).collect());
    }
    let tree = BinaryTree::build(&bounds);
    let mut slots: Vec<Option<Item>> = items.into_iter().map(Some).collect();
    let ordered = tree.order().iter().filter_map(|&i| slots[i as usize].take()).collect();
    (Some(tree), ordered)
}

/// A triangle of an object, or the near or far side of a sphere.
#[derive(Clone, Copy)]
struct Part {
    object: u32,
    number: u32,
}

impl Part {
    /// A random number in [0, 1) that is a pure function of the ray and the part: the same ray always agrees with itself, and
    /// parts behind one another know nothing of each other.
    fn chance(self, ray: &Ray) -> f32 {
        let mut h = u64::from(self.object) << 32 | u64::from(self.number);
        for value in ray.origin.to_array().into_iter().chain(ray.direction.to_array()) {
            h = hash_words(h, u64::from(value.to_bits()));
        }
        unit_of_hash(h)
    }
}
