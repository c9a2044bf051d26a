//! Everything that rays can hit, in two levels.
//!
//! Meshes that are placed once are put into world space and share one tree; meshes that are placed several times have a
//! tree each, in their own space, and are entered through their instance's transform. Spheres stay analytic.

use super::mesh_tree::{MeshHit, MeshTree};
use super::tree::{BinaryTree, Bounds, PrimitiveTree};
use super::wide_tree::TriangleRef;
use super::{Ray, SurfacePoint, sphere};
use crate::scene::{Alpha, Instance, MaterialId, Motion, ScalarInput, Scene};
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A};
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
    /// Barycentric weight of the second vertex.
    pub b1: f32,
    /// Barycentric weight of the third vertex.
    pub b2: f32,
}

impl Hit {
    fn on_sphere(object: u32, distance: f32) -> Self {
        Self { distance, object, triangle: 0, b1: 0.0, b2: 0.0 }
    }
}

/// A scene with its trees.
pub struct World {
    scene: Arc<Scene>,
    /// Triangles of meshes that are placed once.
    fixed: MeshTree,
    /// Trees of meshes that are placed several times.
    shared: Vec<MeshTree>,
    /// Over `items`, when there is more than the fixed tree.
    top: Option<BinaryTree>,
    items: Vec<Item>,
    center: Vec3,
    /// Of the sphere around everything.
    radius: f32,
    has_alpha: bool,
    /// By instance.
    placements: Vec<Placement>,
}

/// What shading needs of an instance besides its transform.
#[derive(Clone, Copy, Debug)]
struct Placement {
    /// Cofactors of the transform: turns normals, and turns them over where the transform mirrors.
    normal_matrix: Mat3A,
    /// −1 where the transform mirrors.
    flip: f32,
    /// Whether the material has a normal map.
    needs_tangent: bool,
}

impl Placement {
    fn new(scene: &Scene, instance: &Instance, to_world: &Affine3A) -> Self {
        let m = to_world.matrix3;
        let flip = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let cofactors = Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        let needs_tangent = scene.materials[instance.material.0 as usize].needs_tangent();
        Self { normal_matrix: cofactors * flip, flip, needs_tangent }
    }
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
    /// Builds the trees. Deterministic for any number of threads.
    pub fn new(scene: Arc<Scene>) -> Self {
        let mut uses = vec![0u32; scene.meshes.len()];
        for instance in &scene.instances {
            // What moves cannot be put into world space.
            uses[instance.mesh.0 as usize] += if instance.motion.is_some() { 2 } else { 1 };
        }
        let fixed = MeshTree::build(&fixed_triangles(&scene, &uses));
        let mut items = Vec::new();
        let mut item_bounds = Vec::new();
        if fixed.bounds().is_finite() {
            items.push(Item::Fixed);
            item_bounds.push(fixed.bounds());
        }
        let mut shared = Vec::new();
        let mut tree_of_mesh = vec![None; scene.meshes.len()];
        for (number, instance) in scene.instances.iter().enumerate() {
            let mesh = instance.mesh.0 as usize;
            if uses[mesh] < 2 {
                continue;
            }
            let tree = *tree_of_mesh[mesh].get_or_insert_with(|| {
                shared.push(MeshTree::build(&own_triangles(&scene, mesh)));
                shared.len() - 1
            });
            if !shared[tree].bounds().is_finite() {
                continue;
            }
            let number = number as u32;
            items.push(match instance.motion {
                Some(_) => Item::Moving { instance: number, shared: tree },
                None => Item::Placed { instance: number, shared: tree, to_mesh: instance.to_world.inverse() },
            });
            item_bounds.push(match &instance.motion {
                Some(motion) => swept_bounds(motion, shared[tree].bounds()),
                None => placed_bounds(&scene, instance),
            });
        }
        for (number, s) in scene.spheres.iter().enumerate() {
            let (center, radius) = (Vec3A::from(s.center), s.radius);
            let object = (scene.instances.len() + number) as u32;
            let bounds = Bounds { min: center - radius, max: center + radius };
            items.push(match s.motion {
                Some(_) => Item::MovingSphere { object },
                None => Item::Sphere { object, center, radius },
            });
            item_bounds.push(s.motion.as_ref().map_or(bounds, |motion| swept_bounds(motion, bounds)));
        }
        let bounds = item_bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        let only_fixed = matches!(items[..], [Item::Fixed]);
        let (top, items) = if only_fixed {
            (None, items)
        } else {
            let tree = BinaryTree::build(&item_bounds);
            let mut slots: Vec<Option<Item>> = items.into_iter().map(Some).collect();
            let ordered = tree.order().iter().filter_map(|&i| slots[i as usize].take()).collect();
            (Some(tree), ordered)
        };
        let has_alpha = scene.materials.iter().any(|m| m.alpha != Alpha::Opaque);
        let (center, radius) = if bounds.is_finite() {
            let center = (bounds.min + bounds.max) * 0.5;
            (center.into(), (bounds.max - center).length().max(f32::MIN_POSITIVE))
        } else {
            (Vec3::ZERO, 1.0)
        };
        let placements = scene.instances.iter().map(|i| Placement::new(&scene, i, &i.to_world)).collect();
        Self { scene, fixed, shared, top, items, center, radius, has_alpha, placements }
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

    /// How far from a point new rays must start to clear the rounding of the trees' coordinates and of the point's own:
    /// a few units in the last place of both.
    pub fn offset_at(&self, position: Vec3) -> f32 {
        4e-7 * (position.abs().max_element() + self.radius)
    }

    /// The material of an object.
    pub fn material_of(&self, object: u32) -> MaterialId {
        let instances = self.scene.instances.len();
        match self.scene.instances.get(object as usize) {
            Some(instance) => instance.material,
            None => self.scene.spheres[object as usize - instances].material,
        }
    }

    /// The closest surface along the ray.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        if self.top.is_none() {
            return self.closest_fixed(ray, f32::INFINITY);
        }
        let mut best = None;
        self.top.as_ref()?.closest(ray.origin, ray.direction, f32::INFINITY, |i, t_max| {
            let hit = match &self.items[i] {
                Item::Fixed => self.closest_fixed(ray, t_max),
                Item::Placed { instance, shared, to_mesh } => {
                    let local = LocalRay::new(ray, to_mesh);
                    self.shared[*shared]
                        .closest(local.origin, local.direction, t_max * local.length, |h| {
                            self.is_there(*instance, h, ray)
                        })
                        .map(|h| world_hit(*instance, h, h.t / local.length))
                }
                Item::Moving { instance, shared } => {
                    let local = LocalRay::new(ray, &self.transform_at(*instance, ray.time).inverse());
                    self.shared[*shared]
                        .closest(local.origin, local.direction, t_max * local.length, |h| {
                            self.is_there(*instance, h, ray)
                        })
                        .map(|h| world_hit(*instance, h, h.t / local.length))
                }
                Item::Sphere { object, center, radius } => {
                    sphere::intersect(ray, *center, *radius, t_max).map(|distance| Hit::on_sphere(*object, distance))
                }
                Item::MovingSphere { object } => {
                    let (center, radius) = self.sphere_at(*object, ray.time);
                    sphere::intersect(ray, center, radius, t_max).map(|distance| Hit::on_sphere(*object, distance))
                }
            };
            match hit {
                Some(hit) if hit.distance < t_max => {
                    best = Some(hit);
                    hit.distance
                }
                _ => f32::INFINITY,
            }
        });
        best
    }

    /// Whether anything is nearer than `distance` along the ray.
    pub fn occluded(&self, ray: &Ray, distance: f32) -> bool {
        let fixed = |t_max: f32| {
            self.fixed.any(ray.origin, ray.direction, t_max, |h| self.is_there(h.triangle.instance, h, ray))
        };
        let Some(top) = &self.top else {
            return fixed(distance);
        };
        top.any(ray.origin, ray.direction, distance, |i, t_max| {
            let blocked = match &self.items[i] {
                Item::Fixed => fixed(t_max),
                Item::Placed { instance, shared, to_mesh } => {
                    let local = LocalRay::new(ray, to_mesh);
                    self.shared[*shared]
                        .any(local.origin, local.direction, t_max * local.length, |h| self.is_there(*instance, h, ray))
                }
                Item::Moving { instance, shared } => {
                    let local = LocalRay::new(ray, &self.transform_at(*instance, ray.time).inverse());
                    self.shared[*shared]
                        .any(local.origin, local.direction, t_max * local.length, |h| self.is_there(*instance, h, ray))
                }
                Item::Sphere { center, radius, .. } => sphere::intersect(ray, *center, *radius, t_max).is_some(),
                Item::MovingSphere { object } => {
                    let (center, radius) = self.sphere_at(*object, ray.time);
                    sphere::intersect(ray, center, radius, t_max).is_some()
                }
            };
            if blocked { 0.0 } else { f32::INFINITY }
        })
    }

    fn closest_fixed(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        self.fixed
            .closest(ray.origin, ray.direction, t_max, |h| self.is_there(h.triangle.instance, h, ray))
            .map(|h| world_hit(h.triangle.instance, h, h.t))
    }

    /// Whether alpha leaves this point of the surface in place.
    fn is_there(&self, instance: u32, hit: &MeshHit, ray: &Ray) -> bool {
        if !self.has_alpha {
            return true;
        }
        let instance = &self.scene.instances[instance as usize];
        let coverage = |value: &ScalarInput| {
            let mesh = &self.scene.meshes[instance.mesh.0 as usize];
            let uv = interpolate_uv(mesh, hit.triangle.triangle, hit.b1, hit.b2);
            value.evaluate(&self.scene.textures, uv)
        };
        match &self.scene.materials[instance.material.0 as usize].alpha {
            Alpha::Opaque => true,
            Alpha::Mask { value, cutoff } => coverage(value) >= *cutoff,
            // A random number that is a pure function of the ray and the triangle: the same ray always agrees with itself.
            Alpha::Blend { value } => coverage(value) > ray_hash(ray, hit.triangle.triangle),
        }
    }

    /// Object space to world space of an instance at a share of the open shutter.
    pub fn transform_at(&self, object: u32, time: f32) -> Affine3A {
        let instance = &self.scene.instances[object as usize];
        instance.motion.as_ref().map_or(instance.to_world, |motion| motion.at(time))
    }

    /// Centre and radius of a sphere at a share of the open shutter.
    pub fn sphere_at(&self, object: u32, time: f32) -> (Vec3A, f32) {
        let sphere = &self.scene.spheres[object as usize - self.scene.instances.len()];
        let center = Vec3A::from(sphere.center);
        let Some(motion) = &sphere.motion else { return (center, sphere.radius) };
        let moved = motion.at(time);
        (moved.transform_point3a(center), sphere.radius * moved.matrix3.x_axis.length())
    }

    /// World-space corners of a triangle of an instance at a share of the open shutter.
    pub fn triangle_corners(&self, object: u32, triangle: u32, time: f32) -> [Vec3; 3] {
        let to_world = self.transform_at(object, time);
        let mesh = &self.scene.meshes[self.scene.instances[object as usize].mesh.0 as usize];
        mesh.triangles[triangle as usize].map(|i| to_world.transform_point3(mesh.positions[i as usize]))
    }

    /// The surface at a hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let Some(instance) = self.scene.instances.get(hit.object as usize) else {
            let (center, radius) = self.sphere_at(hit.object, ray.time);
            let normal = Vec3::from((ray.origin + ray.direction * hit.distance) - center).normalize_or(Vec3::Y);
            let position = Vec3::from(center) + radius * normal;
            return SurfacePoint {
                position,
                geometric_normal: normal,
                shading_normal: normal,
                tangent: Vec3::Y.cross(normal).normalize_or(Vec3::X),
                handedness: 1.0,
                uv: Vec2::new(
                    0.5 + normal.x.atan2(-normal.z) / std::f32::consts::TAU,
                    normal.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI,
                ),
                object: hit.object,
                triangle: 0,
                offset: self.offset_at(position),
            };
        };
        let mesh = &self.scene.meshes[instance.mesh.0 as usize];
        let corners = self.triangle_corners(hit.object, hit.triangle, ray.time);
        let (b1, b2) = (hit.b1, hit.b2);
        let position = corners[0] * (1.0 - b1 - b2) + corners[1] * b1 + corners[2] * b2;
        let Placement { normal_matrix, flip, needs_tangent } = match instance.motion {
            Some(_) => Placement::new(&self.scene, instance, &self.transform_at(hit.object, ray.time)),
            None => self.placements[hit.object as usize],
        };
        let geometric_normal = flip * (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
        let indices = mesh.triangles[hit.triangle as usize].map(|i| i as usize);
        let shading_normal = if mesh.normals.is_empty() {
            geometric_normal
        } else {
            let [n0, n1, n2] = indices.map(|i| mesh.normals[i]);
            let blended = Vec3A::from(n0 * (1.0 - b1 - b2) + n1 * b1 + n2 * b2);
            let n = Vec3::from(normal_matrix * blended).normalize_or(geometric_normal);
            // A file may wind its triangles against its normals; the geometric side is what counts.
            if n.dot(geometric_normal) < 0.0 { -n } else { n }
        };
        let (tangent, handedness) = if !needs_tangent {
            (corners[1] - corners[0], 1.0)
        } else if mesh.tangents.is_empty() {
            tangent_from_uv(mesh, hit.triangle, &corners)
        } else {
            let [t0, t1, t2] = indices.map(|i| mesh.tangents[i]);
            let blended = t0.truncate() * (1.0 - b1 - b2) + t1.truncate() * b1 + t2.truncate() * b2;
            let world = Vec3::from(self.transform_at(hit.object, ray.time).matrix3 * Vec3A::from(blended));
            (world.normalize_or(Vec3::X), if t0.w < 0.0 { -flip } else { flip })
        };
        SurfacePoint {
            position,
            geometric_normal,
            shading_normal,
            tangent,
            handedness,
            uv: interpolate_uv(mesh, hit.triangle, b1, b2),
            object: hit.object,
            triangle: hit.triangle,
            offset: self.offset_at(position),
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

fn world_hit(instance: u32, hit: MeshHit, distance: f32) -> Hit {
    Hit { distance, object: instance, triangle: hit.triangle.triangle, b1: hit.b1, b2: hit.b2 }
}

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

fn placed_bounds(scene: &Scene, instance: &Instance) -> Bounds {
    let mesh = &scene.meshes[instance.mesh.0 as usize];
    Bounds::of_points(mesh.positions.iter().map(|&p| instance.to_world.transform_point3a(p.into())))
}

/// Where things with these bounds in their own space can be while the shutter is open.
fn swept_bounds(motion: &Motion, own: Bounds) -> Bounds {
    let pick = |corner: u32, bit: u32| if corner >> bit & 1 == 0 { own.min } else { own.max };
    let corners: [Vec3A; 8] =
        std::array::from_fn(|i| Vec3A::new(pick(i as u32, 0).x, pick(i as u32, 1).y, pick(i as u32, 2).z));
    let mut bounds = Bounds::EMPTY;
    motion.sweep(&corners, |center, radius| {
        bounds = bounds.union(Bounds { min: center - radius, max: center + radius });
    });
    bounds
}

fn interpolate_uv(mesh: &crate::scene::Mesh, triangle: u32, b1: f32, b2: f32) -> Vec2 {
    if mesh.uvs.is_empty() {
        return Vec2::ZERO;
    }
    let [i, j, k] = mesh.triangles[triangle as usize].map(|i| mesh.uvs[i as usize]);
    i * (1.0 - b1 - b2) + j * b1 + k * b2
}

/// Direction of growing u on a triangle and the handedness of (u, v), from its texture coordinates.
fn tangent_from_uv(mesh: &crate::scene::Mesh, triangle: u32, corners: &[Vec3; 3]) -> (Vec3, f32) {
    let along_edge = (corners[1] - corners[0]).normalize_or(Vec3::X);
    if mesh.uvs.is_empty() {
        return (along_edge, 1.0);
    }
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| mesh.uvs[i as usize]);
    let (d1, d2) = (b - a, c - a);
    let area = d1.perp_dot(d2);
    let tangent = ((corners[1] - corners[0]) * d2.y - (corners[2] - corners[0]) * d1.y) * area.signum();
    // v runs down the picture, so a texture that is not mirrored has a negative uv area.
    (tangent.try_normalize().unwrap_or(along_edge), if area > 0.0 { -1.0 } else { 1.0 })
}

fn ray_hash(ray: &Ray, triangle: u32) -> f32 {
    let mut h = u64::from(triangle);
    for value in ray.origin.to_array().into_iter().chain(ray.direction.to_array()) {
        h = crate::sampler::hash_words(h, u64::from(value.to_bits()));
    }
    (h >> 40) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, ColorInput, FilmDefaults, Material, Mesh, MeshId, Sphere, Surface, ViewingDefaults};
    use glam::{Quat, vec3a};

    /// A tetrahedron placed by each of the transforms, and a sphere.
    fn scene(transforms: &[Affine3A]) -> Scene {
        let mesh = Mesh {
            name: "tetrahedron".to_owned(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        };
        let material = Material {
            name: "grey".to_owned(),
            surface: Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(0.5)) },
            emission: ColorInput::constant(Vec3::ZERO),
            emits_both_sides: false,
            normal_map: None,
            alpha: Alpha::Opaque,
        };
        let instance = |to_world: &Affine3A| Instance {
            name: String::new(),
            mesh: MeshId(0),
            material: MaterialId(0),
            to_world: *to_world,
            motion: None,
        };
        Scene {
            name: String::new(),
            nits_per_unit: 1.0,
            camera: Camera::pinhole(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0),
            film: FilmDefaults { width: 1, height: 1 },
            viewing: ViewingDefaults::default(),
            meshes: vec![mesh],
            instances: transforms.iter().map(instance).collect(),
            spheres: vec![Sphere {
                name: String::new(),
                center: Vec3::splat(-3.0),
                radius: 1.0,
                material: MaterialId(0),
                motion: None,
            }],
            materials: vec![material],
            textures: Vec::new(),
            lights: Vec::new(),
            environment: None,
            notes: Vec::new(),
        }
    }

    /// The same instances with a mesh of its own each: all of them end in the tree of fixed triangles.
    fn flattened(scene: &Scene) -> Scene {
        let mut flat = scene.clone();
        flat.meshes = vec![scene.meshes[0].clone(); scene.instances.len()];
        flat.instances.iter_mut().enumerate().for_each(|(i, instance)| instance.mesh = MeshId(i as u32));
        flat
    }

    /// Rotated, scaled by a thousandth, stretched and mirrored instances are hit where the flattened ones are.
    #[test]
    fn two_levels_equal_one() {
        let transforms = [
            Affine3A::from_translation(Vec3::X * 2.0),
            Affine3A::from_scale_rotation_translation(Vec3::splat(1e-3), Quat::from_rotation_y(1.0), Vec3::Y),
            Affine3A::from_scale_rotation_translation(Vec3::new(3.0, 0.2, 1.0), Quat::from_rotation_x(2.0), Vec3::ZERO),
            Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        ];
        let placed = scene(&transforms);
        let (two, one) = (World::new(Arc::new(placed.clone())), World::new(Arc::new(flattened(&placed))));
        assert_eq!((two.shared.len(), one.shared.len()), (1, 0));
        let mut hits = [0; 5];
        for i in 0..4000u64 {
            let unit = |k: u64| (crate::sampler::hash_words(i, k) >> 40) as f32 / 16_777_216.0 * 2.0 - 1.0;
            let origin = vec3a(unit(0), unit(1), unit(2)) * 6.0;
            let target = [Vec3A::ZERO, vec3a(2.2, 0.2, 0.2), Vec3A::Y, Vec3A::splat(-3.0)][i as usize % 4];
            let spread = if i % 4 == 2 { 1e-3 } else { 1.0 };
            let direction = (target + vec3a(unit(3), unit(4), unit(5)) * spread - origin).normalize();
            let ray = Ray::new(origin, direction);
            let (a, b) = (two.closest(&ray), one.closest(&ray));
            assert_eq!(a.is_some(), b.is_some(), "ray {i}");
            if let (Some(a), Some(b)) = (a, b) {
                assert_eq!((a.object, a.triangle), (b.object, b.triangle), "ray {i}");
                assert!((a.distance - b.distance).abs() < 1e-5 * b.distance, "ray {i}");
                hits[a.object as usize] += 1;
                let (p, q) = (two.surface(&ray, &a), one.surface(&ray, &b));
                assert!(p.position.distance(q.position) < 1e-4);
                assert!(p.geometric_normal.dot(q.geometric_normal) > 0.999);
                assert!(two.occluded(&ray, a.distance * 1.001) && !two.occluded(&ray, a.distance * 0.999));
            }
        }
        assert!(hits.iter().all(|&h| h > 20), "hits by object: {hits:?}");
    }

    /// The mirrored instance's normals still point outwards.
    #[test]
    fn mirrored_instances_keep_their_outside() {
        let world = World::new(Arc::new(scene(&[Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0))])));
        let ray = Ray::new(vec3a(-2.0, 2.0, 2.0), vec3a(1.0, -1.0, -1.0).normalize());
        let hit = world.closest(&ray).expect("the slanted face");
        assert!(world.surface(&ray, &hit).geometric_normal.dot(Vec3::from(ray.direction)) < 0.0);
    }
}
