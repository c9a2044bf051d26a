//! What alpha leaves in place: stacks of surfaces, spheres, and lamps that no ray meets.

use crate::support::{
    add_material, add_rectangle, add_sphere, constant_environment, diffuse, empty_scene, radiance_along, trace_settings,
};
use fechner::geometry::Ray;
use fechner::integrator::PathTracer;
use fechner::scene::{Alpha, Instance, MaterialId, ScalarInput, Scene};
use glam::{Affine3A, Vec3, vec3a};
use std::sync::Arc;

/// Adds a black material that is there with probability a half.
fn add_veil(scene: &mut Scene) -> MaterialId {
    let veil = add_material(scene, diffuse(0.0), Vec3::ZERO);
    scene.materials[veil.0 as usize].alpha = Alpha::Blend { value: ScalarInput::constant(0.5) };
    veil
}

fn in_front_of_white() -> Scene {
    Scene { environment: constant_environment(1.0), ..empty_scene() }
}

const RAYS: u32 = 4096;

/// Share of rays along −z that pass everything, of which black takes what it stops.
fn passing(scene: Scene) -> f32 {
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
    let seen = (0..RAYS).map(|i| {
        let (x, y) = ((i % 64) as f32, (i / 64) as f32);
        let ray = Ray::new(vec3a(x * 1e-3 - 0.03, y * 1e-3 - 0.03, 5.0), vec3a(0.0, 0.0, -1.0));
        radiance_along(&tracer, ray, 2, 1).0.x
    });
    seen.sum::<f32>() / RAYS as f32
}

/// Within 4 standard deviations of a binomial share.
fn assert_share(found: f32, expected: f32, what: &str) {
    let deviation = (expected * (1.0 - expected) / RAYS as f32).sqrt();
    assert!((found - expected).abs() < 4.0 * deviation, "{what}: {found}, expected {expected} ± {deviation}");
}

/// Two and four veils behind one another let a quarter and a sixteenth through, with meshes of their own and with a
/// shared one.
#[test]
fn veils_multiply() {
    for (layers, expected) in [(1, 0.5), (2, 0.25), (4, 0.0625)] {
        let mut own = in_front_of_white();
        let veil = add_veil(&mut own);
        for layer in 0..layers {
            add_rectangle(&mut own, Vec3::new(-1.0, -1.0, layer as f32 * 0.3), Vec3::X * 2.0, Vec3::Y * 2.0, veil);
        }
        assert_share(passing(own), expected, &format!("{layers} veils"));

        let mut shared = in_front_of_white();
        let veil = add_veil(&mut shared);
        add_rectangle(&mut shared, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, veil);
        let first = shared.instances[0].clone();
        for layer in 1..layers {
            let to_world = Affine3A::from_translation(Vec3::Z * (layer as f32 * 0.3));
            shared.instances.push(Instance { to_world, ..first.clone() });
        }
        assert_share(passing(shared), expected, &format!("{layers} veils of one mesh"));
    }
}

/// A ray crosses a sphere twice.
#[test]
fn a_sphere_is_a_veil_twice() {
    let mut scene = in_front_of_white();
    let veil = add_veil(&mut scene);
    add_sphere(&mut scene, Vec3::ZERO, 0.8, veil);
    assert_share(passing(scene), 0.25, "sphere");
}

/// A lamp that no ray meets gives what it gives where it is seen, and is not seen.
#[test]
fn an_unseen_lamp_shines_in_full() {
    for with_lamp in [
        (|scene: &mut Scene, lamp| {
            add_rectangle(scene, Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, lamp);
        }) as fn(&mut Scene, MaterialId),
        |scene, lamp| add_sphere(scene, Vec3::Y, 0.4, lamp),
    ] {
        let along = |alpha: Alpha, ray: Ray| {
            let mut scene = empty_scene();
            let floor = add_material(&mut scene, diffuse(0.6), Vec3::ZERO);
            add_rectangle(&mut scene, Vec3::new(-5.0, 0.0, -5.0), Vec3::Z * 10.0, Vec3::X * 10.0, floor);
            let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
            scene.materials[lamp.0 as usize].alpha = alpha;
            with_lamp(&mut scene, lamp);
            let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
            radiance_along(&tracer, ray, 16, 2048)
        };
        let to_floor = Ray::new(vec3a(-0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
        let (seen, unseen) = (along(Alpha::Opaque, to_floor), along(Alpha::Unseen, to_floor));
        let error = seen.1.x.hypot(unseen.1.x);
        assert!((seen.0.x - unseen.0.x).abs() < 4.0 * error, "{} and {} ± {error}", seen.0.x, unseen.0.x);
        assert!(error < 0.01 * seen.0.x, "{error} of {}", seen.0.x);
        let to_lamp = Ray::new(vec3a(0.0, 0.5, 0.0), vec3a(0.0, 1.0, 0.0));
        assert_eq!(along(Alpha::Unseen, to_lamp).0, Vec3::ZERO);
        assert_eq!(along(Alpha::Opaque, to_lamp).0, Vec3::splat(3.0));
    }
}
