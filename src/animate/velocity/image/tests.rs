//! Images in mirrors and glass against closed forms, and against what the other frame shows where they are said to be.

use super::super::point_of_triangle;
use super::*;
use crate::geometry::Hit;
use crate::integrator::TraceSettings;
use crate::scene::{
    Camera, ColorInput, Instance, Material, MaterialId, Mesh, MeshId, Roughness, Scene, Sphere, Surface,
};
use glam::{Affine3A, Mat3A, Quat, Vec3};
use std::sync::Arc;

const SIZE: u32 = 48;

/// Nothing but a camera.
fn empty(camera: Camera) -> Scene {
    Scene { camera, ..Scene::default() }
}

fn add_material(scene: &mut Scene, surface: Surface) -> MaterialId {
    scene.materials.push(Material::plain("", surface));
    MaterialId(scene.materials.len() as u32 - 1)
}

/// A square in the plane z = 0, with sides of 2, made place by `to_world`.
fn add_square(scene: &mut Scene, to_world: Affine3A, surface: Surface) {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    scene.meshes.push(Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    });
    let mesh = MeshId(scene.meshes.len() as u32 - 1);
    let material = add_material(scene, surface);
    scene.instances.push(Instance { name: String::new(), mesh, material, to_world, motion: None });
}

fn add_ball(scene: &mut Scene, center: Vec3, radius: f32, surface: Surface) {
    let material = add_material(scene, surface);
    let name = String::new();
    scene.spheres.push(Sphere { name, center, radius, axes: Mat3A::IDENTITY, material, motion: None });
}

fn diffuse() -> Surface {
    Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(0.5)) }
}

fn mirror() -> Surface {
    Surface::Mirror { reflectance: ColorInput::constant(Vec3::ONE) }
}

fn tracer(scene: Scene) -> PathTracer {
    PathTracer::new(Arc::new(scene), TraceSettings::new(SIZE, SIZE, 0))
}

/// Frames −1, 0 and 1 of a scene.
fn frames(scene: impl Fn(f32) -> Scene) -> [PathTracer; 3] {
    [-1.0, 0.0, 1.0].map(|frame| tracer(scene(frame)))
}

fn map_of([previous, now, next]: &[PathTracer; 3]) -> VelocityMap {
    VelocityMap::of_images(now, previous, next)
}

fn surfaces_of([previous, now, next]: &[PathTracer; 3]) -> VelocityMap {
    VelocityMap::new(now, previous.world().scene(), next.world().scene())
}

fn centers() -> impl Iterator<Item = (usize, Vec2)> {
    (0..SIZE * SIZE).map(|pixel| (pixel as usize, Vec2::new((pixel % SIZE) as f32, (pixel / SIZE) as f32) + 0.5))
}

/// How the mirror of [`mirror_room`] has moved and tilted.
fn mirror_place(frame: f32) -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(0.03 * frame), Vec3::Z * 0.2 * frame)
        * Affine3A::from_scale(Vec3::splat(20.0))
}

/// A ball beside the view of a camera that walks, and moves, seen in a mirror that moves and tilts.
fn mirror_room(frame: f32) -> Scene {
    let eye = Vec3::new(0.1 * frame, 0.05 * frame, 9.0);
    let mut scene = empty(Camera::pinhole(eye, Vec3::NEG_Z, Vec3::Y, 60.0));
    add_square(&mut scene, mirror_place(frame), mirror());
    add_ball(&mut scene, Vec3::new(3.5 + 0.3 * frame, 0.2 * frame, 6.0), 1.5, diffuse());
    scene
}

/// In a plane mirror a point is where its reflection in the plane is.
#[test]
fn a_plane_mirror_shows_what_lies_behind_it() {
    let tracers = frames(mirror_room);
    let [previous, now, next] = &tracers;
    let (map, now) = (map_of(&tracers), Moment::of(now));
    let mut checked = 0;
    for (pixel, center) in centers() {
        let Some(path) = now.tracer.follow_specular(ray_through(&now.camera, center)) else { continue };
        if path.end.is_none() {
            continue;
        }
        let seen = seen_along(now.tracer, &path.last_ray, path.end);
        for (other, frame, motion) in [(next, 1.0, map.to_next[pixel]), (previous, -1.0, map.to_previous[pixel])] {
            let Some(Target::Point(point)) = target_in(other.world().scene(), &seen) else { panic!("a point") };
            let plane = mirror_place(frame);
            let normal = plane.transform_vector3(Vec3::Z).normalize();
            let origin = plane.transform_point3(Vec3::ZERO);
            let behind = point - 2.0 * normal.dot(point - origin) * normal;
            let expected = Moment::of(other).camera.project(behind).expect("before the camera") - center;
            assert!(motion.distance(expected) < 0.02, "{center} {frame}: {motion}, not {expected}");
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked}");
    // The mirror's own motion is another.
    let surfaces = surfaces_of(&tracers);
    let apart = map.to_next.iter().zip(&surfaces.to_next).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(apart > 1.0, "{apart}");
}

/// The material point of the first mesh's triangle that a hit is on.
fn mark(tracer: &PathTracer, hit: &Hit) -> Option<Vec3> {
    let scene = tracer.world().scene();
    (hit.object == 0)
        .then(|| point_of_triangle(scene, hit))
        .flatten()
        .map(|point| scene.instances[0].to_world.inverse().transform_point3(point))
}

/// Where the first square is seen over mirrors or glass in both frames, the map leads to the same mark on it; the share
/// of the pixels that show it so for which that holds, and how many they are.
fn same_marks(tracers: &[PathTracer; 3], scale: f32) -> (f64, u32) {
    let [previous, now, next] = tracers;
    let (map, now) = (map_of(tracers), Moment::of(now));
    let (mut seen, mut same) = (0, 0);
    for (pixel, center) in centers() {
        let path = now.tracer.follow_specular(ray_through(&now.camera, center));
        let Some(own) = path.and_then(|path| mark(now.tracer, &path.end?)) else { continue };
        for (other, motion) in [(next, map.to_next[pixel]), (previous, map.to_previous[pixel])] {
            let other = Moment::of(other);
            let place = center + motion;
            if place.min_element() < 0.0 || place.max_element() > SIZE as f32 {
                continue;
            }
            let there = other.tracer.follow_specular(ray_through(&other.camera, place));
            // What has come before it, or left the ball, does not count.
            let Some(there) = there.and_then(|path| mark(other.tracer, &path.end?)) else { continue };
            seen += 1;
            same += u32::from(own.distance(there) < scale);
        }
    }
    (f64::from(same) / f64::from(seen), seen)
}

/// A wall of marks, that slides, seen by a camera that walks.
fn wall_and_camera(frame: f32, wall: Affine3A) -> Scene {
    let eye = Vec3::new(0.05 * frame, 0.1 * frame, 6.0);
    let mut scene = empty(Camera::pinhole(eye, Vec3::NEG_Z, Vec3::Y, 40.0));
    let slid = Affine3A::from_translation(Vec3::new(0.1 * frame, 0.0, 0.0));
    add_square(&mut scene, slid * wall * Affine3A::from_scale(Vec3::splat(10.0)), diffuse());
    scene
}

#[test]
fn a_mirror_ball_shows_the_same_marks_where_its_map_says() {
    let tracers = frames(|frame| {
        let mut scene = wall_and_camera(frame, Affine3A::from_translation(Vec3::Z * 9.0));
        add_ball(&mut scene, Vec3::new(0.1 * frame, -0.05 * frame, 0.0), 1.5, mirror());
        scene
    });
    let (share, count) = same_marks(&tracers, 0.05);
    assert!(share > 0.98 && count > 400, "{share} of {count}");
}

#[test]
fn a_glass_ball_shows_the_same_marks_where_its_map_says() {
    let tracers = frames(|frame| {
        let mut scene = wall_and_camera(frame, Affine3A::from_translation(Vec3::Z * -5.0));
        add_ball(&mut scene, Vec3::new(0.1 * frame, -0.05 * frame, 0.0), 1.5, Surface::clear_dielectric(1.5));
        scene
    });
    let (share, count) = same_marks(&tracers, 0.05);
    assert!(share > 0.95 && count > 500, "{share} of {count}");
}

/// A ball behind a camera at rest, seen in a mirror at rest, that moves far in a frame.
#[test]
fn a_mirror_at_rest_shows_fast_things() {
    let at = |frame: f32| Vec3::new(8.0 * frame, 0.0, 12.0);
    let tracers = frames(|frame| {
        let mut scene = empty(Camera::pinhole(Vec3::new(0.0, 0.0, 9.0), Vec3::NEG_Z, Vec3::Y, 60.0));
        add_square(&mut scene, Affine3A::from_scale(Vec3::splat(20.0)), mirror());
        add_ball(&mut scene, at(frame), 2.0, diffuse());
        scene
    });
    // In the mirror's plane z = 0 it stands at a depth of 9 + 12, less its radius at its middle.
    let px_per_tangent = SIZE as f32 / 2.0 / 30.0_f32.to_radians().tan();
    let expected_px = 8.0 / 19.0 * px_per_tangent;
    let map = map_of(&tracers);
    let beside_the_middle = (SIZE / 2 * SIZE + SIZE / 2) as usize;
    for (motion, side) in [(map.to_next[beside_the_middle], 1.0), (map.to_previous[beside_the_middle], -1.0)] {
        let expected = Vec2::new(side * expected_px, 0.0);
        assert!(expected_px > 16.0 && motion.distance(expected) < 0.1, "{motion}, not {expected}");
    }
}

/// A pane at rest changes no velocity of what is behind it.
#[test]
fn a_pane_shows_what_is_behind_it() {
    let ball = |frame: f32| {
        let mut scene = empty(Camera::pinhole(Vec3::new(0.0, 0.0, 9.0), Vec3::NEG_Z, Vec3::Y, 60.0));
        add_ball(&mut scene, Vec3::new(0.4 * frame, 0.1 * frame, 0.0), 2.0, diffuse());
        scene
    };
    let bare = surfaces_of(&frames(ball));
    let behind = map_of(&frames(|frame| {
        let mut scene = ball(frame);
        let place = Affine3A::from_translation(Vec3::Z * 5.0) * Affine3A::from_scale(Vec3::splat(20.0));
        let transmittance = ColorInput::constant(Vec3::ONE);
        add_square(&mut scene, place, Surface::ThinDielectric { ior: 1.5, transmittance });
        scene
    }));
    let middle = (SIZE / 2 * SIZE + SIZE / 2) as usize;
    assert!(bare.to_next[middle].length() > 1.0);
    for (found, expected) in behind.to_next.iter().zip(&bare.to_next) {
        assert!(found.distance(*expected) < 0.02, "{found}, not {expected}");
    }
}

/// What has no image, or none in the other frame, moves as its surface does.
#[test]
fn what_has_no_image_moves_as_its_surface() {
    let rough = |frame: f32| {
        let mut scene = mirror_room(frame);
        scene.materials[0].surface = Surface::conductor(Vec3::splat(0.2), Vec3::splat(3.0), Roughness::constant(0.5));
        scene
    };
    assert_eq!(map_of(&frames(rough)), surfaces_of(&frames(rough)));
    // The mirror is gone in the other frames: a diffuse thing is in its place.
    let gone = |frame: f32| {
        let mut scene = mirror_room(frame);
        if frame != 0.0 {
            scene.materials[0].surface = diffuse();
        }
        scene
    };
    assert_eq!(map_of(&frames(gone)), surfaces_of(&frames(gone)));
}

/// Every pixel is found by itself.
#[test]
fn threads_change_no_velocity() {
    let tracers = frames(mirror_room);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool").install(|| map_of(&tracers));
    assert_eq!(map_of(&tracers), alone);
}
