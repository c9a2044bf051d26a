//! Two levels against one, and mirrored instances.

use super::*;
use crate::scene::{ColorInput, Material, Mesh, MeshId, Sphere, Surface};
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
        relief: None,
        stretch: None,
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
        meshes: vec![mesh],
        instances: transforms.iter().map(instance).collect(),
        spheres: vec![Sphere {
            name: String::new(),
            center: Vec3::splat(-3.0),
            radius: 1.0,
            axes: glam::Mat3A::IDENTITY,
            material: MaterialId(0),
            motion: None,
        }],
        materials: vec![material],
        ..Scene::default()
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
