//! The same scene from several formats gives the same picture.

use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::settings::Sampling;
use fechner::adaptive::{Quiet, render};
use fechner::integrator::PathTracer;
use fechner::scene::Surface;
use fechner::scene::load::{LoadOptions, load};
use std::path::Path;
use std::sync::Arc;

const SIZE: u32 = 32;
/// Regions along each side.
const REGIONS: u32 = 4;

/// Mean and its variance of each channel of each region.
fn regions(file: &str, seed: u64) -> Vec<[f64; 2]> {
    let mut scene = load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file), &LoadOptions::default())
        .unwrap_or_else(|error| panic!("{error}"));
    scene.nits_per_unit = 1.0;
    let settings = loop_settings(1.0, Sampling::Uniform, 0.0, Some(128));
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(SIZE, SIZE, seed));
    let rendered = render(&tracer, &settings, &Quiet).expect("the perception model takes the picture");
    let estimate = &rendered.judgement.estimate;
    let mut sums = vec![[0.0; 2]; (3 * REGIONS * REGIONS) as usize];
    let side = SIZE / REGIONS;
    for (i, rgb) in estimate.rgb_cd_m2.iter().enumerate() {
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let region = (y / side * REGIONS + x / side) as usize;
        let luminance = f64::from(estimate.luminance_cd_m2.values()[i]).max(1e-9);
        for (channel, value) in rgb.iter().enumerate() {
            let value = f64::from(*value);
            // Noise of one channel, in proportion to its share of luminance; red walls have little of the others.
            let share = value / luminance;
            sums[3 * region + channel][0] += value;
            sums[3 * region + channel][1] += f64::from(estimate.variance_of_mean.values()[i]) * share * share;
        }
    }
    let count = f64::from(side * side);
    sums.into_iter().map(|[sum, variance]| [sum / count, variance / (count * count)]).collect()
}

/// 48 Z tests a format, two-sided at 1e-4 together by Bonferroni: |z| below 5.
#[test]
fn the_cornell_box_is_the_same_in_three_formats() {
    let ours = regions("scenes/cornell-box.toml", 1);
    for (file, seed) in [("scenes/other-formats/cornell-box.pbrt", 2), ("scenes/other-formats/cornell-box.xml", 3)] {
        let theirs = regions(file, seed);
        let mut worst = 0.0_f64;
        for (place, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            let z = (a[0] - b[0]) / (a[1] + b[1]).sqrt();
            worst = if z.abs() > worst.abs() { z } else { worst };
            assert!(
                z.abs() < 5.0,
                "{file}: region {}, channel {}: {} and {}, z = {z:.1}",
                place / 3,
                place % 3,
                a[0],
                b[0]
            );
        }
        println!("{file}: largest z {worst:.2}");
    }
}

/// Colours of vertices come linear from both formats that have them: glTF's as they stand, OBJ's through sRGB's curve.
#[test]
fn vertex_colours_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).meshes.swap_remove(0).colors
    };
    let obj = read("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 0 1 0 0 0 1\nf 1 2 3\n");
    assert!(obj[1].abs_diff_eq(glam::Vec3::new(0.0, 0.21404, 0.0), 1e-5), "{obj:?}");
    let some = read("b.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nf 1 2 3\n");
    assert!(some.is_empty(), "{some:?}");
    // Three positions (9 floats), then three normalised colours of 4 bytes.
    let bytes: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .chain([255, 0, 0, 255, 0, 51, 0, 255, 0, 0, 255, 255])
        .collect();
    std::fs::write(folder.path().join("a.bin"), bytes).unwrap();
    let gltf = read(
        "a.gltf",
        r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],
"buffers":[{"byteLength":48,"uri":"a.bin"}]}"#,
    );
    assert!(gltf[1].abs_diff_eq(glam::Vec3::new(0.0, 0.2, 0.0), 1e-6), "{gltf:?}");
}

/// Normals of faces in a smoothing group are shared across their edges; elsewhere faces are flat.
#[test]
fn smoothing_groups_round_edges() {
    let folder = tempfile::tempdir().unwrap();
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\ns 1\nf 1 2 3 4\nf 5 1 4 6\n";
    let normals = |text: &str| {
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).meshes.swap_remove(0).normals
    };
    let round = normals(text);
    let edge = glam::Vec3::new(1.0, 0.0, 1.0).normalize();
    assert_eq!(round.iter().filter(|normal| normal.abs_diff_eq(edge, 1e-5)).count(), 2, "{round:?}");
    assert!(normals(&text.replace("s 1", "s off")).is_empty());
    // Errors still name the file's own line.
    let path = folder.path().join("bad.obj");
    std::fs::write(&path, format!("{text}vt a b\n")).unwrap();
    let error = load(&path, &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("bad.obj:10:"), "{error}");
}

/// Where a file ends its paths its picture is darker than ours: that is said, in scatterings whatever the format counts.
#[test]
fn the_depth_of_the_files_paths_is_named() {
    let pbrt = |integrator: &str| {
        format!("{integrator} WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1] Shape \"sphere\"")
    };
    let mitsuba = |depth: i32| {
        format!(
            "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"maxDepth\" value=\"{depth}\"/></integrator>\
             <emitter type=\"constant\"/><shape type=\"sphere\"/></scene>"
        )
    };
    let place = tempfile::tempdir().unwrap();
    for (name, text, scatterings) in [
        ("said.pbrt", pbrt("Integrator \"path\" \"integer maxdepth\" [ 7 ]"), Some(7)),
        ("default.pbrt", pbrt("Integrator \"volpath\""), Some(5)),
        ("deep.pbrt", pbrt("Integrator \"path\" \"integer maxdepth\" [ 1000 ]"), None),
        ("eight-edges.xml", mitsuba(8), Some(7)),
        ("endless.xml", mitsuba(-1), None),
    ] {
        let path = place.path().join(name);
        std::fs::write(&path, text).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let said = scene.notes.iter().find(|note| note.contains("scatterings"));
        match scatterings {
            None => assert_eq!(said, None, "{name}"),
            Some(count) => {
                assert!(
                    said.is_some_and(|note| note.contains(&format!("after {count} scatterings"))),
                    "{name}: {said:?}"
                );
            }
        }
    }
}

/// KHR_materials_anisotropy: a strength with its texture's blue, a direction from red and green and a rotation.
#[test]
fn the_direction_of_anisotropy_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let read = |anisotropy: &str| {
        let path = folder.path().join("a.gltf");
        let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"extensionsUsed":["KHR_materials_anisotropy"],"images":[{"uri":"missing.png"}],"textures":[{"source":0}],
"materials":[{"extensions":{"KHR_materials_anisotropy":{ANISOTROPY}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"a.bin"}]}"#;
        let bytes: Vec<u8> =
            [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(folder.path().join("a.bin"), bytes).unwrap();
        std::fs::write(&path, text.replace("ANISOTROPY", anisotropy)).unwrap();
        let mut scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.notes.iter().all(|note| !note.contains("not used")), "{:?}", scene.notes);
        (scene.materials.swap_remove(0), scene.textures)
    };
    let (plain, _) = read(r#""anisotropyStrength":0.5"#);
    assert_eq!(plain.stretch, None);
    let (turned, _) = read(r#""anisotropyStrength":0.5,"anisotropyRotation":0.75"#);
    assert_eq!(turned.stretch.map(|stretch| (stretch.rotation, stretch.map)), Some((0.75, None)));
    // The missing picture is one of full strength along u.
    let (mapped, textures) = read(r#""anisotropyStrength":0.5,"anisotropyTexture":{"index":0}"#);
    let direction = mapped.stretch.expect("a direction").evaluate(&textures, glam::Vec2::ZERO);
    assert!(direction.abs_diff_eq(glam::Vec2::X, 0.01), "{direction}");
    let Surface::MetalRoughness(model) = &mapped.surface else { panic!("{:?}", mapped.surface) };
    assert!((model.anisotropy.evaluate(&textures, glam::Vec2::ZERO) - 0.5).abs() < 1e-6);
}
