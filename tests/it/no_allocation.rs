//! A path takes no memory from the heap: allocation would be a lock between threads and a tenth of a short path's time.

use crate::support::{block_key, trace_settings};
use fechner::geometry::Ray;
use fechner::integrator::PathTracer;
use fechner::scene::load::{LoadOptions, load};
use glam::{Vec3A, vec3a};
use std::path::Path;
use std::sync::Arc;

/// Meshes, spheres, textures, normal maps, glass and an environment: nothing that a path meets allocates.
#[test]
fn paths_allocate_nothing() {
    for (name, eye) in [
        ("cornell-box", vec3a(0.0, 1.0, 3.0)),
        ("glass-caustic", vec3a(0.02, 0.27, 0.56)),
        ("textured-room", vec3a(0.1, 1.2, 0.2)),
    ] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let scene = load(&file, &LoadOptions::default()).expect("our own scene");
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let trace = |pixel: u32| {
            let angle = pixel as f32;
            let direction = Vec3A::new(angle.sin(), -0.3 + 0.2 * (3.0 * angle).cos(), -angle.cos().abs()).normalize();
            let sample = block_key(pixel).sample(0);
            tracer.trace_path(Ray::new(eye, direction), sample).rays
        };
        // What is made once at first use, such as the sRGB table, may allocate.
        trace(0);
        let mut rays = 0;
        let allocations = allocation_counter::measure(|| rays = (0..500).map(trace).sum());
        assert_eq!(allocations.count_total, 0, "{name}");
        assert!(rays > 1000, "{name}: {rays} rays test too little");
    }
}

/// Nor does a camera that asks at every ray which volumes it is in.
#[test]
fn parallel_rays_partly_in_a_volume_allocate_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("s.toml");
    let text = r#"
[camera]
orthographic_height = 4
position = [0, 0, 0.5]
look_at = [0, 0, -5]
[environment]
radiance = [1, 1, 1]
[materials.glass]
type = "dielectric"
ior = 1.5
absorption = [1.0, 0.5, 0.1]
[[objects]]
box = { min = [-1, -1, -1], max = [1, 1, 1] }
material = "glass"
"#;
    std::fs::write(&file, text).expect("a scene");
    let scene = load(&file, &LoadOptions::default()).expect("a scene");
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
    let trace = |pixel: u32| {
        let origin = vec3a(0.004 * pixel as f32 - 1.0, 0.1, 0.5);
        tracer.trace_path(Ray::new(origin, Vec3A::NEG_Z), block_key(pixel).sample(0)).rays
    };
    trace(0);
    let allocations = allocation_counter::measure(|| assert!((0..500).map(trace).sum::<u32>() > 1000));
    assert_eq!(allocations.count_total, 0);
}
