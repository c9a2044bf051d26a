//! Velocity maps against scenes whose motion is known, and against their own reprojection.

use super::*;
use crate::integrator::TraceSettings;
use crate::scene::{
    Alpha, Camera, ColorInput, Environment, Instance, Material, MaterialId, Mesh, MeshId, Parametrisation, Relief,
    ScalarInput, Sphere, Surface, TextureId, TextureLookup,
};
use glam::{Affine3A, Mat3A, Quat};
use std::sync::Arc;

/// A wall behind a ball, which have moved by so much; seen by a camera that has turned by `yaw` and gone aside.
fn scene(wall: Vec3, ball: Vec3, yaw: f32, aside: Vec3) -> Scene {
    let corners = [[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]];
    let mesh = Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let forward = Quat::from_rotation_y(yaw) * Vec3::NEG_Z;
    Scene {
        camera: Camera::pinhole(aside + Vec3::new(0.0, 0.0, 10.0), forward, Vec3::Y, 90.0),
        meshes: vec![mesh],
        instances: vec![Instance {
            name: String::new(),
            mesh: MeshId(0),
            material: MaterialId(0),
            to_world: Affine3A::from_translation(wall),
            motion: None,
        }],
        spheres: vec![Sphere {
            name: String::new(),
            center: Vec3::new(0.0, 0.0, 5.0) + ball,
            radius: 1.0,
            axes: Mat3A::IDENTITY,
            material: MaterialId(0),
            motion: None,
        }],
        materials: vec![Material {
            name: String::new(),
            surface: Surface::Diffuse { reflectance: ColorInput::constant(Vec3::ONE) },
            emission: ColorInput::constant(Vec3::ONE),
            emits_both_sides: true,
            relief: None,
            stretch: None,
            alpha: Alpha::Opaque,
        }],
        ..Scene::default()
    }
}

const SIZE: u32 = 64;

fn tracer(scene: Scene) -> PathTracer {
    PathTracer::new(Arc::new(scene), TraceSettings::new(SIZE, SIZE, 0))
}

#[test]
fn things_move_by_what_they_move() {
    let at = |t: f32| scene(Vec3::X * t, Vec3::Y * t, 0.0, Vec3::ZERO);
    let map = VelocityMap::new(&tracer(at(0.0)), &at(-1.0), &at(1.0));
    // 32 pixels to a unit at distance 1: the wall is 10 away, the ball's middle 4.
    let (wall, ball) = (5 * SIZE + 5, 32 * SIZE + 32);
    let near = |found: Vec2, expected: Vec2| assert!(found.distance(expected) < 0.02, "{found}, not {expected}");
    near(map.to_next[wall as usize], Vec2::new(3.2, 0.0));
    near(map.to_previous[wall as usize], Vec2::new(-3.2, 0.0));
    near(map.to_next[ball as usize], Vec2::new(0.0, -8.0));
    near(map.to_previous[ball as usize], Vec2::new(0.0, 8.0));
}

/// The marks on a ball that spins go along with it, where it has any.
#[test]
fn only_what_is_marked_is_seen_to_turn() {
    let at = |t: f32, marked: bool| {
        let mut scene = scene(Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO);
        scene.spheres[0].axes = Mat3A::from_rotation_y(0.02 * t);
        if marked {
            scene.materials[0].alpha = Alpha::Mask { value: ScalarInput::constant(1.0), cutoff: 0.5 };
            scene.materials[0].relief =
                Some(Relief::Normals { map: TextureLookup::plain(TextureId(0)), strength: 1.0 });
        }
        scene
    };
    let ball = (32 * SIZE + 32) as usize;
    let to_next =
        |marked| VelocityMap::new(&tracer(at(0.0, marked)), &at(-1.0, marked), &at(1.0, marked)).to_next[ball];
    assert!(to_next(false).length() < 1e-3, "{}", to_next(false));
    // The front of the ball is 4 away: 8 pixels to a unit.
    assert!(to_next(true).distance(Vec2::new(8.0 * 0.02, 0.0)) < 0.01, "{}", to_next(true));
}

/// A camera that turns and walks: the point that a pixel shows, looked for where its velocity says, is the same point.
#[test]
fn reprojection_finds_the_same_point() {
    let at = |t: f32| scene(Vec3::Z * t, Vec3::new(t, 0.2 * t, 0.0), 0.05 * t, Vec3::new(0.5 * t, 0.0, -0.3 * t));
    let now = tracer(at(0.0));
    for (other, next) in [(1.0, true), (-1.0, false)] {
        let map = VelocityMap::new(&now, &at(-1.0), &at(1.0));
        let motion = if next { &map.to_next } else { &map.to_previous };
        let there = tracer(at(other));
        let (rays_now, rays_there) =
            [&now, &there].map(|t| CameraRays::new(&t.world().scene().camera, SIZE, SIZE)).into();
        let (mut both, mut same) = (0, 0);
        for pixel in 0..SIZE * SIZE {
            let center = Vec2::new((pixel % SIZE) as f32, (pixel / SIZE) as f32) + 0.5;
            let (Seen::Triangle(hit), place) = (seen_at(&now, &rays_now, center), center + motion[pixel as usize])
            else {
                continue;
            };
            if place.min_element() < 0.0 || place.max_element() > SIZE as f32 {
                continue;
            }
            // What is hidden there by the ball does not count.
            if let Seen::Triangle(found) = seen_at(&there, &rays_there, place) {
                both += 1;
                let [a, b] = [&hit, &found].map(|hit| point_of_triangle(now.world().scene(), hit).expect("a triangle"));
                same += u32::from(a.distance(b) < 0.01);
            }
        }
        assert!(both > 2000 && same == both, "{same} of {both} points");
    }
}

/// A background turns with the camera and does not move with it.
#[test]
fn a_background_turns() {
    let empty = |yaw: f32, aside: Vec3| Scene {
        instances: Vec::new(),
        spheres: Vec::new(),
        ..scene(Vec3::ZERO, Vec3::ZERO, yaw, aside)
    };
    let still = VelocityMap::new(&tracer(empty(0.0, Vec3::ZERO)), &empty(0.0, Vec3::X), &empty(0.0, -Vec3::X));
    assert!(still.to_next.iter().chain(&still.to_previous).all(|motion| motion.length() < 1e-3));
    let turned = VelocityMap::new(&tracer(empty(0.0, Vec3::ZERO)), &empty(-0.1, Vec3::ZERO), &empty(0.1, Vec3::ZERO));
    // Turning left by 0.1 takes the middle right by tan 0.1 · 32.
    let middle = (32 * SIZE + 32) as usize;
    assert!((turned.to_next[middle].x - 3.26).abs() < 0.1, "{}", turned.to_next[middle]);
    assert!((turned.to_previous[middle].x + 3.16).abs() < 0.1, "{}", turned.to_previous[middle]);
}

/// A picture around the scene that turns takes its pixels along.
#[test]
fn a_background_turns_by_itself() {
    let at = |t: f32| Scene {
        instances: Vec::new(),
        spheres: Vec::new(),
        environment: Some(Environment {
            parametrisation: Parametrisation::LatLong,
            width: 1,
            height: 1,
            texels: Arc::new(vec![Vec3::ONE]),
            scale: 1.0,
            from_world: Mat3::from_rotation_x(0.3) * Mat3::from_rotation_y(-0.1 * t),
        }),
        ..scene(Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO)
    };
    let map = VelocityMap::new(&tracer(at(0.0)), &at(-1.0), &at(1.0));
    // To the left of a camera that looks along -z, by tan 0.1 · 32, as if the camera had turned to the right.
    let middle = (32 * SIZE + 32) as usize;
    assert!((map.to_next[middle].x + 3.16).abs() < 0.1, "{}", map.to_next[middle]);
    assert!((map.to_previous[middle].x - 3.26).abs() < 0.1, "{}", map.to_previous[middle]);
}

/// A veil before the wall moves: it is there in all pixels or in none, and not by chance.
#[test]
fn a_veil_has_one_motion() {
    for (coverage, expected) in [(0.6, 8.0), (0.4, 0.0)] {
        let at = |t: f32| {
            let mut scene = scene(Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO);
            scene.spheres.clear();
            let blend = Alpha::Blend { value: ScalarInput::constant(coverage) };
            scene.materials.push(Material { alpha: blend, ..scene.materials[0].clone() });
            let to_world = Affine3A::from_translation(Vec3::new(t, 0.0, 6.0));
            scene.instances.push(Instance { material: MaterialId(1), to_world, ..scene.instances[0].clone() });
            scene
        };
        let map = VelocityMap::new(&tracer(at(0.0)), &at(-1.0), &at(1.0));
        let others = map.to_next.iter().filter(|motion| (motion.x - expected).abs() > 0.02).count();
        assert_eq!(others, 0, "at a coverage of {coverage}");
    }
}
