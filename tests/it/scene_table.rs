//! Every scene of others, small: triangles, seconds to load, seconds to visibilities 4 and 1 (the table in
//! scenes/README.md).

use crate::load_assets::assets;
use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::settings::Sampling;
use fechner::adaptive::{Quiet, StopReason, render};
use fechner::integrator::PathTracer;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

const WIDTH: u32 = 160;
/// A render that is expected to take longer than this is not begun.
const LONGEST: Duration = Duration::from_secs(45);

const SCENES: &[&str] = &[
    "scenes-pbrt/cornell-box/scene-v4.pbrt",
    "scenes-pbrt/veach-mis/scene-v4.pbrt",
    "scenes-pbrt/veach-ajar/scene-v4.pbrt",
    "scenes-pbrt/staircase2/scene-v4.pbrt",
    "scenes-pbrt/coffee/scene-v4.pbrt",
    "scenes-pbrt/water-caustic/scene-v4.pbrt",
    "scenes-mitsuba/living-room/scene.xml",
    "scenes-mitsuba/cbox/cbox.xml",
    "scenes-mitsuba/veach_mi/mi.xml",
    "gltf/ToyCar/glTF/ToyCar.gltf",
    "gltf/FlightHelmet/FlightHelmet.gltf",
    "gltf/CesiumMilkTruck/CesiumMilkTruck.glb",
    "gltf/Fox/Fox.glb",
    "gltf/SimpleSkin/SimpleSkin.gltf",
    "gltf/MorphStressTest/MorphStressTest.gltf",
    "gltf/AnimatedMorphCube/glTF/AnimatedMorphCube.gltf",
    "gltf/CornellBox/CornellBox.glb",
    "gltf/ClearCoat-glTF/ClearCoatTest.gltf",
    "gltf/textureTransform/TextureTransformTest.gltf",
    "gltf/TonemappingTest/TonemappingTest.gltf",
    "gltf/BoxTexcoords-glTF/boxTexcoords.gltf",
    "gltf/Cube/Cube.gltf",
    "gltf/cameras/Cameras.gltf",
    "obj/teapot/teapot.obj",
    "obj/tinyobjloader-models/cornell_box.obj",
    "obj/assimp-OBJ/spider.obj",
    "obj/trimesh-models/two_objects.obj",
];

/// Seconds to a visibility, or `None` where the time ran out.
fn seconds_to(scene: &Arc<Scene>, visibility: f64) -> Option<f64> {
    let height = (WIDTH * scene.film.height / scene.film.width).max(1);
    let start = Instant::now();
    let tracer = PathTracer::new(Arc::clone(scene), trace_settings(WIDTH, height, 1));
    let mut settings = loop_settings(scene.nits_per_unit, Sampling::Adaptive, visibility, None);
    settings.limits.time = Some(LONGEST);
    let rendered = render(&tracer, &settings, &Quiet).expect("the perception model takes the picture");
    (rendered.stop_reason == StopReason::Visibility).then(|| start.elapsed().as_secs_f64())
}

fn row(path: &Path, name: &str) {
    let start = Instant::now();
    let scene = Arc::new(load(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")));
    let loaded = start.elapsed().as_secs_f64();
    let triangles: usize = scene.instances.iter().map(|i| scene.meshes[i.mesh.0 as usize].triangles.len()).sum();
    let at_4 = seconds_to(&scene, 4.0);
    // Samples go as the inverse square of visibility.
    let worth_trying = at_4.is_some_and(|seconds| 16.0 * seconds < LONGEST.as_secs_f64());
    let at_1 = if worth_trying { seconds_to(&scene, 1.0) } else { None };
    let shown = |seconds: Option<f64>| seconds.map_or("above".to_owned(), |seconds| format!("{seconds:.1}"));
    println!("| {name} | {triangles} | {loaded:.2} | {} | {} |", shown(at_4), shown(at_1));
}

/// `cargo test --release -p fechner --test it scene_table -- --ignored --nocapture` (part of a scene's path in
/// FECHNER_SCENE)
#[test]
#[ignore = "minutes of rendering"]
fn seconds_to_load_and_to_see_nothing() {
    let Some(folder) = assets() else { return };
    let only = std::env::var("FECHNER_SCENE").unwrap_or_default();
    println!("| scene | triangles | load s | s to visibility 4 | s to visibility 1 |");
    for name in SCENES.iter().filter(|name| name.contains(&only)) {
        let path = folder.join(name);
        if path.is_file() { row(&path, name) } else { println!("not there: {name}") }
    }
}
