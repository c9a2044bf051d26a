//! How a world is built: what goes into which tree, and the boxes of what is placed.

use super::super::mesh_tree::MeshTree;
use super::super::tree::{BinaryTree, Bounds};
use super::super::wide_tree::TriangleRef;
use super::at_hit::Placement;
use super::{Ball, Item, World};
use crate::scene::{Alpha, Instance, Motion, Scene};
use glam::{Vec3, Vec3A};
use std::sync::Arc;

/// Up to so many items are tested one after the other: a walk costs more than it saves.
const FEW: usize = 4;

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
        let around = sphere_around(&items.bounds);
        let (top, items) = arranged(items);
        let has_alpha = scene.materials.iter().any(|m| m.alpha != Alpha::Opaque);
        let placements = scene
            .instances
            .iter()
            .map(|i| Placement::new(&scene, i, shared.of_mesh[i.mesh.0 as usize].map(|tree| tree as u32)))
            .collect();
        Self { scene, fixed, shared: shared.trees, top, items, around, has_alpha, placements }
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
    let around = if all_vertices <= MAX_VERTICES { Around::Vertices } else { Around::OwnBox };
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

/// The sphere around the box around everything; a unit sphere where there is nothing.
fn sphere_around(bounds: &[Bounds]) -> Ball {
    let bounds = bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
    if !bounds.is_finite() {
        return Ball { center: Vec3::ZERO, radius: 1.0 };
    }
    let center = (bounds.min + bounds.max) * 0.5;
    Ball { center: center.into(), radius: (bounds.max - center).length().max(f32::MIN_POSITIVE) }
}

/// Items in the order in which they are met, with a tree over them where they are many; those without a finite box are
/// left out.
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

/// A mesh in its own space.
fn own_triangles(scene: &Scene, mesh: usize) -> Vec<([Vec3A; 3], TriangleRef)> {
    let mesh = &scene.meshes[mesh];
    mesh.triangles
        .iter()
        .enumerate()
        .map(|(triangle, indices)| {
            let corners = indices.map(|i| Vec3A::from(mesh.positions[i as usize]));
            (corners, TriangleRef { instance: 0, triangle: triangle as u32 })
        })
        .collect()
}

/// All meshes that are placed once, in world space.
fn fixed_triangles(scene: &Scene, uses: &[u32]) -> Vec<([Vec3A; 3], TriangleRef)> {
    let mut triangles = Vec::new();
    for (number, instance) in scene.instances.iter().enumerate() {
        if uses[instance.mesh.0 as usize] != 1 {
            continue;
        }
        for (corners, reference) in own_triangles(scene, instance.mesh.0 as usize) {
            let world = corners.map(|p| instance.to_world.transform_point3a(p));
            triangles.push((world, TriangleRef { instance: number as u32, ..reference }));
        }
    }
    triangles
}

/// Vertices of all placed instances up to which boxes are made around each; of more, around the corners of the meshes'
/// boxes.
const MAX_VERTICES: usize = 30_000_000;

/// What a box is made around.
#[derive(Clone, Copy, Debug)]
enum Around {
    /// As tightly as can be.
    Vertices,
    /// The corners of the mesh's own box.
    OwnBox,
}

/// Bounds of an instance whose mesh has these bounds of its own.
fn placed_bounds(scene: &Scene, instance: &Instance, own: Bounds, around: Around) -> Bounds {
    let place = |point| instance.to_world.transform_point3a(point);
    match around {
        Around::Vertices => {
            let mesh = &scene.meshes[instance.mesh.0 as usize];
            Bounds::of_points(mesh.positions.iter().map(|&point| place(point.into())))
        }
        Around::OwnBox => Bounds::of_points(own.corners().map(place)),
    }
}

/// Where things with these bounds in their own space can be while the shutter is open.
fn swept_bounds(motion: &Motion, own: Bounds) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    motion.sweep(&own.corners(), |center, radius| {
        bounds = bounds.union(Bounds { min: center - radius, max: center + radius });
    });
    bounds
}
