//! Tests two levels against one, and mirrored instances.

use super::*;
use crate::scene::{ColorInput, Instance, Material, Mesh, MeshId, Sphere, Surface};
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
        let unit = |k: u64| unit_of_hash(hash_words(i, k)) * 2.0 - 1.0;
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

/// How many of the rays that leave convex bodies where they are hit meet the body again.
fn self_hits(world: &World, aims: &[(Vec3A, f32)]) -> usize {
    let unit = |i: u64, k: u64| unit_of_hash(hash_words(i, k)) * 2.0 - 1.0;
    let direction = |i: u64, k: u64| vec3a(unit(i, k), unit(i, k + 1), unit(i, k + 2)).normalize_or(Vec3A::X);
    let mut met_again = 0;
    let mut hits = 0;
    for (number, &(center, size)) in aims.iter().enumerate() {
        for i in 0..4000u64 {
            let from = center + direction(i, 0) * size * 4.0;
            let target = center + direction(i, 3) * size * unit(i, 6) * 0.8;
            let ray = Ray::new(from, (target - from).normalize());
            let Some(hit) = world.closest(&ray).filter(|hit| hit.distance < 6.0 * size) else { continue };
            let point = world.surface(&ray, &hit);
            let mut away = Vec3::from(direction(i, 7 + number as u64));
            // Every other ray grazes the surface.
            if i % 2 == 0 {
                away = (away - point.geometric_normal * point.geometric_normal.dot(away) * 0.99).normalize();
            }
            away *= point.geometric_normal.dot(away).signum();
            hits += 1;
            let next = Ray::new(point.spawn(away), away.into());
            met_again += usize::from(world.occluded(&next, 8.0 * size));
        }
    }
    assert!(hits > 1000 * aims.len(), "{hits} hits: the test tests too little");
    met_again
}

/// Rays leave what they hit without meeting it again, near the origin and far from it, in a tree of its own and in the
/// common one, beside something small or huge.
#[test]
fn no_ray_meets_the_triangle_that_it_leaves() {
    let turned = |scale: f32, at: Vec3| {
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(scale),
            Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.4),
            at,
        )
    };
    let way = Vec3::new(1.0, -0.7, 0.4);
    for shift in [0.0, 1.0, 1e2, 1e4, 1e5, 1e6] {
        for scale in [1.0, 50.0] {
            let at = way * shift;
            let mut placed = scene(&[turned(scale, at), turned(scale, -at - 1000.0 * Vec3::Y)]);
            placed.meshes[0] = crate::scene::load::shapes::cuboid(-Vec3::ONE, Vec3::ONE);
            placed.spheres.clear();
            for scene in [flattened(&placed), placed] {
                let aims = scene.instances.iter().map(|i| (i.to_world.translation, scale)).collect::<Vec<_>>();
                let world = World::new(Arc::new(scene));
                assert_eq!(self_hits(&world, &aims), 0, "shift {shift}, scale {scale}, trees {}", world.shared.len());
            }
        }
    }
}

/// The same of a mesh whose own coordinates are far away, moved back by its transform.
#[test]
fn no_ray_meets_the_triangle_of_a_mesh_that_is_moved_back() {
    for shift in [1e2, 1e4, 1e6] {
        let far = Vec3::splat(shift);
        let mut placed = scene(&[Affine3A::from_translation(-far), Affine3A::from_translation(Vec3::X * 30.0 - far)]);
        placed.meshes[0] = crate::scene::load::shapes::cuboid(far - 1.0, far + 1.0);
        placed.spheres.clear();
        for scene in [flattened(&placed), placed] {
            let world = World::new(Arc::new(scene));
            assert_eq!(self_hits(&world, &[(Vec3A::ZERO, 1.0), (Vec3A::X * 30.0, 1.0)]), 0, "shift {shift}");
        }
    }
}

/// Planks two hundred and two thousand times as long as wide, turned, do not shadow themselves, nor a lamp of that
/// shape itself.
#[test]
fn long_thin_triangles_do_not_meet_their_own_rays() {
    for width in [0.02, 0.002] {
        let half = Vec3::new(2.0, 0.5 * width, 0.5 * width);
        let turned = Affine3A::from_axis_angle(Vec3::new(0.2, 1.0, 0.3).normalize(), 0.65);
        let mut placed = scene(&[turned, Affine3A::from_translation(Vec3::Y * 9.0) * turned]);
        placed.meshes[0] = crate::scene::load::shapes::cuboid(-half, half);
        placed.spheres.clear();
        for scene in [flattened(&placed), placed] {
            let world = World::new(Arc::new(scene));
            let (mut left, mut met, mut hidden) = (0, 0, 0);
            for i in 0..20_000u64 {
                let unit = |k: u64| unit_of_hash(hash_words(i, k)) * 2.0 - 1.0;
                let aim = turned.transform_point3a(vec3a(1.99 * unit(0), 0.0, 0.0));
                let direction = vec3a(unit(1), unit(2), unit(3)).normalize_or(Vec3A::Y);
                let ray = Ray::new(aim - 3.0 * direction, direction);
                let Some(hit) = world.closest(&ray) else { continue };
                let point = world.surface(&ray, &hit);
                left += 1;
                // A convex body: whatever leaves it goes free.
                let normal = Vec3A::from(point.geometric_normal);
                let out = vec3a(unit(4), unit(5), unit(6)).normalize_or(Vec3A::Y);
                let out = if out.dot(normal) < 0.0 { -out } else { out };
                met +=
                    u32::from(world.closest(&Ray::new(point.spawn(out.into()), out)).is_some_and(|h| h.distance < 5.0));
                // A shadow ray from outside ends before it.
                let way = Vec3A::from(point.position) + point.offset * normal - ray.origin;
                hidden += u32::from(world.occluded(&Ray::new(ray.origin, way / way.length()), way.length()));
            }
            assert!(left > 10_000, "{left}");
            assert_eq!((met, hidden), (0, 0), "of {left}, width {width}, trees {}", world.shared.len());
        }
    }
}

/// A huge thing beside a small one does not lift rays off the small one.
#[test]
fn offsets_are_those_of_what_is_hit() {
    let with = |size: f32| {
        let mut both = flattened(&scene(&[Affine3A::IDENTITY, Affine3A::from_translation(Vec3::Y * -size)]));
        both.meshes[1] = crate::scene::load::shapes::rectangle(
            Vec3::new(-size, size - 1.0, -size),
            Vec3::Z * 2.0 * size,
            Vec3::X * 2.0 * size,
        );
        let world = World::new(Arc::new(both));
        let ray = Ray::new(vec3a(0.2, 0.2, -1.0), Vec3A::Z);
        world.surface(&ray, &world.closest(&ray).expect("the tetrahedron")).offset
    };
    assert_eq!(with(10.0), with(1e6));
    assert!(with(10.0) < 1e-6);
}

/// A flat quad that its instance mirrors has the frame of one whose corners are mirrored.
#[test]
fn mirrored_instances_keep_their_bitangents() {
    use crate::scene::{Relief, TextureId, TextureLookup};
    let mut quad = crate::scene::load::shapes::rectangle(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0);
    quad.normals.clear();
    quad.tangents.clear();
    quad.uvs = quad.positions.iter().map(|p| Vec2::new(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y)).collect();
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mut mirrored = quad.clone();
    mirrored.positions.iter_mut().for_each(|position| position.x = -position.x);
    mirrored.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let frame = |mesh: Mesh, to_world: Affine3A| {
        let mut one = scene(&[to_world]);
        one.spheres.clear();
        one.meshes = vec![mesh];
        one.materials[0].relief = Some(Relief::Normals { map: TextureLookup::plain(TextureId(0)), strength: 1.0 });
        let world = World::new(Arc::new(one));
        let ray = Ray::new(vec3a(0.3, 0.2, 1.0), -Vec3A::Z);
        let point = world.surface(&ray, &world.closest(&ray).expect("the quad"));
        let tangent = point.tangent.expect("asked for");
        (tangent.normalize(), point.handedness * point.shading_normal.cross(tangent).normalize())
    };
    let (by_instance, by_corners) = (frame(quad.clone(), mirror), frame(mirrored, Affine3A::IDENTITY));
    assert!(by_instance.0.abs_diff_eq(by_corners.0, 1e-6) && by_instance.1.abs_diff_eq(by_corners.1, 1e-6));
    let plain = frame(quad, Affine3A::IDENTITY);
    assert!(plain.0.abs_diff_eq(Vec3::X, 1e-6) && plain.1.abs_diff_eq(Vec3::Y, 1e-6), "{plain:?}");
}

/// Where formats say so, a mirrored sphere's bitangent is normal × growing u like that of meshes.
#[test]
fn mirrored_spheres_have_the_bitangents_of_their_format() {
    let handedness = |bitangent_ignores_v: bool| {
        let mut mirrored = Scene { bitangent_ignores_v, ..scene(&[]) };
        mirrored.spheres[0].axes = glam::Mat3A::from_diagonal(Vec3::new(-1.0, 1.0, 1.0));
        let world = World::new(Arc::new(mirrored));
        let ray = Ray::new(vec3a(-3.0, -3.0, 3.0), -Vec3A::Z);
        world.surface(&ray, &world.closest(&ray).expect("the sphere")).handedness
    };
    assert_eq!((handedness(false), handedness(true)), (-1.0, 1.0));
}

/// However large or small a triangle is, its normals are its own: of the plane, and those of its corners.
#[test]
fn triangles_of_any_size_have_their_normals() {
    let slanted = Vec3::ONE.normalize();
    for size in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
        let to_world = Affine3A::from_scale(Vec3::splat(size));
        // Two of them, so that a mesh is placed by its instances.
        let mut placed = scene(&[to_world, to_world * Affine3A::from_translation(4.0 * Vec3::X)]);
        placed.spheres.clear();
        let mut smooth = placed.clone();
        smooth.meshes[0].normals = vec![Vec3::new(0.6, 0.8, 0.0); 4];
        let expected_of_corners = Vec3::new(0.6, 0.8, 0.0);
        for (scene, expected) in [
            (flattened(&placed), slanted),
            (placed, slanted),
            (flattened(&smooth), expected_of_corners),
            (smooth, expected_of_corners),
        ] {
            let world = World::new(Arc::new(scene));
            let ray = Ray::new(Vec3A::splat(size), Vec3A::NEG_ONE.normalize());
            let hit = world.closest(&ray).unwrap_or_else(|| panic!("the slanted face, {size:e}"));
            let point = world.surface(&ray, &hit);
            assert!(point.geometric_normal.abs_diff_eq(slanted, 1e-6), "{size:e}: {}", point.geometric_normal);
            assert!(point.shading_normal.abs_diff_eq(expected, 1e-6), "{size:e}: {}", point.shading_normal);
        }
    }
}
