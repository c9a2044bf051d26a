//! What moves in glTF while the shutter is open: jumps, things that are there for a part of it, and shapes that change.

use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Instance, Scene};
use serde_json::{Value, json};
use std::path::Path;

/// Animates a property of a node: interpolation, times and values.
struct Channel<'a>(&'a str, &'a str, &'a [f32], &'a [f32]);

/// Writes a triangle with one morph target, whose node is animated by channels, and a side file with a shutter.
fn write(folder: &Path, shutter_s: f64, weight: f32, channels: &[Channel]) {
    let mut floats: Vec<f32> = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    floats.extend([0.0, 0.0, 0.5].repeat(3));
    let accessor = |view: usize, count: usize, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind, "min": [0, 0, 0], "max": [1, 1, 1]});
    let mut accessors = vec![accessor(0, 3, "VEC3"), accessor(1, 3, "VEC3")];
    let mut views =
        vec![json!({"buffer": 0, "byteLength": 36}), json!({"buffer": 0, "byteOffset": 36, "byteLength": 36})];
    let mut add = |values: &[f32], kind: &str, width: usize| {
        views.push(json!({"buffer": 0, "byteOffset": 4 * floats.len(), "byteLength": 4 * values.len()}));
        floats.extend(values);
        let mut made = accessor(views.len() - 1, values.len() / width, kind);
        made.as_object_mut().unwrap().retain(|key, _| key != "min" && key != "max");
        accessors.push(made);
        accessors.len() - 1
    };
    let (mut targets, mut samplers) = (Vec::<Value>::new(), Vec::<Value>::new());
    for Channel(path, interpolation, times, values) in channels {
        let (input, output) = (add(times, "SCALAR", 1), add(values, "VEC3", 3));
        targets.push(json!({"sampler": samplers.len(), "target": {"node": 0, "path": path}}));
        samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    }
    let text = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "weights": [weight]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}]}],
        "animations": [{"channels": targets, "samplers": samplers}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": 4 * floats.len(), "uri": "a.bin"}]});
    std::fs::write(folder.join("a.bin"), floats.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).unwrap();
    std::fs::write(folder.join("a.gltf"), text.to_string()).unwrap();
    std::fs::write(folder.join("a.fechner.toml"), format!("[camera]\nshutter_s = {shutter_s}\n")).unwrap();
}

fn read(folder: &Path, seconds: f64) -> Scene {
    let options = LoadOptions { frame_time: seconds, ..LoadOptions::default() };
    load(&folder.join("a.gltf"), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Place along x and size of the scene's one instance at a share of the shutter.
fn place(scene: &Scene, share: f32) -> (f32, f32) {
    let transform = Instance::transform_at(&scene.instances[0], share);
    (transform.translation.x, transform.matrix3.x_axis.length())
}

/// A jump inside the shutter is none before its key, and one as the shutter closes is not seen: both were smeared
/// from an eighth of the shutter before.
#[test]
fn jumps_are_not_smeared() {
    let folder = tempfile::tempdir().unwrap();
    let jump = Channel("translation", "STEP", &[0.0, 0.1], &[0.0, 0.0, 0.0, 12.0, 0.0, 0.0]);
    write(folder.path(), 0.09, 0.0, &[jump]);
    let inside = read(folder.path(), 0.06);
    let share = 0.04 / 0.09;
    for (share, x) in [(0.0, 0.0), (0.4, 0.0), (share - 1e-5, 0.0), (share + 1e-5, 12.0), (1.0, 12.0)] {
        assert_eq!(place(&inside, share).0, x, "at {share}");
    }
    for opens in [0.01, 0.1] {
        let rests = read(folder.path(), opens);
        assert!(rests.instances[0].motion.is_none(), "from {opens}: {:?}", rests.instances[0].motion);
    }
    // The same frame's key does not open its shutter twice.
    let third = 1.0 / 30.0;
    let jump = Channel("translation", "STEP", &[0.0, third as f32], &[0.0, 0.0, 0.0, 12.0, 0.0, 0.0]);
    write(folder.path(), 0.02, 0.0, &[jump]);
    assert!(third as f32 as f64 > third, "no such key");
    let frame = read(folder.path(), third);
    assert!(frame.instances[0].motion.is_none() && place(&frame, 0.0).0 == 12.0, "{:?}", frame.instances[0]);
}

/// A thing that is hidden, or appears, inside the shutter moves for as long as it is there.
#[test]
fn what_is_hidden_in_the_shutter_blurs_until_then() {
    let folder = tempfile::tempdir().unwrap();
    let moves = || Channel("translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 8.0, 0.0, 0.0]);
    for (scales, seen) in [([1.0, 0.0], 0.25), ([0.0, 1.0], 0.75)] {
        let scales = scales.map(|scale| [scale; 3]).concat();
        write(folder.path(), 1.0, 0.0, &[moves(), Channel("scale", "STEP", &[0.0, 0.5], &scales)]);
        let scene = read(folder.path(), 0.0);
        for share in [0.0, 0.25, 0.49, 0.51, 0.75, 1.0] {
            let (x, size) = place(&scene, share);
            assert!((x - 8.0 * share).abs() < 1e-4, "{x} at {share}");
            let expected = if (share < 0.5) == (seen < 0.5) { 1.0 } else { 0.0 };
            assert!((size - expected).abs() < 1e-3, "{size} at {share}");
        }
        let mesh = &scene.meshes[scene.instances[0].mesh.0 as usize];
        assert_eq!(mesh.triangles.len(), 1, "it is there");
    }
    // Hidden all the time it is nothing.
    write(folder.path(), 1.0, 0.0, &[moves(), Channel("scale", "STEP", &[0.0, 2.0], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0])]);
    let scene = read(folder.path(), 0.0);
    assert!(
        scene.instances[0].motion.is_none() && scene.meshes[scene.instances[0].mesh.0 as usize].triangles.is_empty()
    );
}

/// A node with morph targets moves in the shutter whatever their weights: it blurred in those frames alone whose
/// weights were all 0.
#[test]
fn morphing_nodes_move_on() {
    let folder = tempfile::tempdir().unwrap();
    for weight in [0.0, 0.5] {
        let moves = Channel("translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 8.0, 0.0, 0.0]);
        write(folder.path(), 0.5, weight, &[moves]);
        let scene = read(folder.path(), 0.25);
        assert!((place(&scene, 0.0).0 - 2.0).abs() < 1e-5 && (place(&scene, 1.0).0 - 6.0).abs() < 1e-5, "{weight}");
        let mesh = &scene.meshes[scene.instances[0].mesh.0 as usize];
        assert!((mesh.positions[0].z - 0.5 * weight).abs() < 1e-6, "{weight}: {:?}", mesh.positions);
        assert!(scene.notes.iter().any(|note| note.contains("shapes of morph targets")), "{:?}", scene.notes);
    }
}
