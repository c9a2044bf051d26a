//! Scenes made in code, and rendering them.

pub(crate) mod command;
pub(crate) mod pictures;

use fechner::adaptive::settings::{Limits, LoopSettings, Sampling, THRESHOLD};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::sampler::{BlockKey, Half, Pixel, Sequence};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{
    Alpha, Camera, ColorInput, Environment, FilmDefaults, Instance, Material, MaterialId, Mesh, MeshId, Scene, Sphere,
    Surface,
};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone;
use glam::{Affine3A, Mat3A, Vec2, Vec3};
use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

/// A scene of nothing, seen from z = 5.
pub(crate) fn empty_scene() -> Scene {
    Scene {
        name: "test".to_owned(),
        nits_per_unit: 100.0,
        camera: Camera { focus_distance: 5.0, ..Camera::pinhole(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z, Vec3::Y, 20.0) },
        film: FilmDefaults { width: 16, height: 16 },
        ..Scene::default()
    }
}

/// The Cornell box of `scenes/`.
pub(crate) fn load_cornell_box() -> Scene {
    load(&command::cornell_box(), &LoadOptions::default()).expect("the first scene loads")
}

/// Light of the same radiance from everywhere.
pub(crate) fn constant_environment(radiance: f32) -> Option<Environment> {
    Some(Environment::constant(Vec3::splat(radiance)))
}

/// Adds a material that scatters like this.
pub(crate) fn add_material(scene: &mut Scene, surface: Surface, emission: Vec3) -> MaterialId {
    scene.materials.push(Material {
        name: format!("material {}", scene.materials.len()),
        surface,
        emission: ColorInput::constant(emission),
        emits_both_sides: true,
        relief: None,
        stretch: None,
        alpha: Alpha::Opaque,
    });
    MaterialId(scene.materials.len() as u32 - 1)
}

pub(crate) fn diffuse(albedo: f32) -> Surface {
    Surface::Diffuse { reflectance: ColorInput::constant(Vec3::splat(albedo)) }
}

pub(crate) fn add_sphere(scene: &mut Scene, center: Vec3, radius: f32, material: MaterialId) {
    scene.spheres.push(Sphere {
        name: "sphere".to_owned(),
        center,
        radius,
        axes: Mat3A::IDENTITY,
        material,
        motion: None,
    });
}

/// Adds a mesh where it is.
pub(crate) fn add_mesh(scene: &mut Scene, mesh: Mesh, material: MaterialId) {
    scene.instances.push(Instance {
        name: mesh.name.clone(),
        mesh: MeshId(scene.meshes.len() as u32),
        material,
        to_world: Affine3A::IDENTITY,
        motion: None,
    });
    scene.meshes.push(mesh);
}

/// Adds a parallelogram with the normal `edge_u` × `edge_v`.
pub(crate) fn add_rectangle(scene: &mut Scene, corner: Vec3, edge_u: Vec3, edge_v: Vec3, material: MaterialId) {
    let mesh = Mesh {
        name: "rectangle".to_owned(),
        positions: vec![corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    add_mesh(scene, mesh, material);
}

/// How tests trace that ask for nothing: as the program does.
pub(crate) fn trace_settings(width: u32, height: u32, seed: u64) -> TraceSettings {
    TraceSettings::new(width, height, seed)
}

/// A block of samples by number, of at most 2^18.
pub(crate) fn block_key(number: u32) -> BlockKey {
    let pixel = Pixel { x: number, y: 0 };
    BlockKey { seed: 1, pixel, half: Half::A, level: 0, log2_samples: 18, sequence: Sequence::PerPixel }
}

/// Mean and standard error of the radiance along one ray, from `blocks` independent blocks of `samples`.
pub(crate) fn radiance_along(
    tracer: &PathTracer,
    ray: fechner::geometry::Ray,
    blocks: u32,
    samples: u32,
) -> (Vec3, Vec3) {
    let means: Vec<Vec3> = (0..blocks)
        .map(|block| {
            let key = block_key(block);
            let sum: Vec3 = key.samples(samples).map(|s| tracer.trace_path(ray, s).radiance).sum();
            sum / samples as f32
        })
        .collect();
    let mean = means.iter().sum::<Vec3>() / blocks as f32;
    let variance = means.iter().map(|m| (m - mean) * (m - mean)).sum::<Vec3>() / (blocks - 1) as f32;
    (mean, (variance / blocks as f32).powf(0.5))
}

/// Settings for the display `desktop` and constant scaling, of what [`trace_settings`] trace.
///
/// Without a visibility only `spp` counts.
pub(crate) fn loop_settings(
    nits_per_unit: f64,
    sampling: Sampling,
    visibility: impl Into<Option<f64>>,
    spp: Option<u32>,
) -> LoopSettings {
    let viewing = Viewing::of(Display::preset("desktop").expect("a preset"));
    let operator = tone::operator("constant", None).expect("an operator");
    let limits = Limits { visibility: visibility.into(), mean_samples: spp, ..Limits::of_visibility(THRESHOLD) };
    LoopSettings { sampling, limits, ..LoopSettings::new(&trace_settings(1, 1, 1), viewing, nits_per_unit, operator) }
}

/// Loads a scene file of such content; what went wrong.
pub(crate) fn write_and_load(file: &Path, content: impl AsRef<[u8]>) -> Result<Scene, String> {
    std::fs::write(file, content).expect("written");
    load(file, &LoadOptions::default()).map_err(|error| error.to_string())
}

/// Whether one of a scene's notes says so.
pub(crate) fn has_note(scene: &Scene, part: &str) -> bool {
    scene.notes.iter().any(|note| note.contains(part))
}

/// Until a file is there that a program under way makes.
pub(crate) fn wait_for(path: &Path, child: &mut Child) {
    let started = Instant::now();
    while !path.exists() {
        assert!(child.try_wait().expect("a child").is_none(), "the program ended before {} was there", path.display());
        assert!(started.elapsed() < Duration::from_secs(300), "no {} after five minutes", path.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Sends a signal by its name for `kill`, as "-TERM".
#[cfg(unix)]
pub(crate) fn signal(child: &Child, name: &str) {
    let sent = std::process::Command::new("kill").args([name, &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
}
