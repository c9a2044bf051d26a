//! The same scene from several formats gives the same picture.

use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::settings::Sampling;
use fechner::adaptive::{Quiet, render};
use fechner::integrator::PathTracer;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, ScalarInput, Surface};
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
    let settings = loop_settings(1.0, Sampling::Uniform, None, Some(128));
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

/// Where a file ends its paths its picture is darker than ours: that is said, in scatterings whatever the format
/// counts.
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

/// A node that turns about another and a camera that drives on blur for as long as a side file holds the shutter
/// open, and are at every moment where the animation has them.
#[test]
fn rigid_nodes_of_gltf_move_while_the_shutter_is_open() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    // A triangle; times 0 and 2; two rotations about y, 0 and 90 degrees; two translations.
    let half = std::f32::consts::FRAC_PI_4;
    let floats = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .into_iter()
        .chain([0.0, 2.0])
        .chain([0.0, 0.0, 0.0, 1.0, 0.0, half.sin(), 0.0, half.cos()])
        .chain([0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    std::fs::write(folder.path().join("a.bin"), floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).unwrap();
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2]}],
"nodes":[{"children":[1]},{"mesh":0,"translation":[3,0,0]},{"camera":0}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}},
{"sampler":1,"target":{"node":2,"path":"translation"}}],"samplers":[{"input":1,"output":2},{"input":1,"output":3}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[2]},
{"bufferView":2,"componentType":5126,"count":2,"type":"VEC4"},{"bufferView":3,"componentType":5126,"count":2,"type":"VEC3"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":8},
{"buffer":0,"byteOffset":44,"byteLength":32},{"buffer":0,"byteOffset":76,"byteLength":24}],
"buffers":[{"byteLength":100,"uri":"a.bin"}]}"#;
    std::fs::write(&path, text).unwrap();
    let at = |seconds: f64| {
        let options = LoadOptions { frame_time: seconds, ..LoadOptions::default() };
        load(&path, &options).unwrap_or_else(|error| panic!("{error}"))
    };
    let still = at(0.5);
    assert!(still.instances[0].motion.is_none() && still.camera.motion.is_none());
    assert!(still.notes.iter().any(|note| note.contains("nothing blurs")), "{:?}", still.notes);

    std::fs::write(folder.path().join("a.fechner.toml"), "[camera]\nshutter_s = 1.0\n").unwrap();
    let moving = at(0.5);
    let camera = moving.camera.motion.as_ref().expect("the camera moves");
    for share in [0.0_f32, 0.3, 0.5, 1.0] {
        let there = at(0.5 + f64::from(share));
        let (found, expected) = (moving.instances[0].transform_at(share), there.instances[0].to_world);
        // Chords of an eighth of 45 degrees on a radius of 3 leave the arc by at most 3·(0.098)²/8.
        assert!(found.translation.distance(expected.translation) < 0.004, "{share}: {found:?}, {expected:?}");
        assert!(found.matrix3.abs_diff_eq(expected.matrix3, 1e-4), "{share}: {found:?}, {expected:?}");
        let lens = camera.at(share).transform_point3(moving.camera.position);
        assert!(lens.abs_diff_eq(there.camera.position, 1e-4), "{share}: {lens}");
    }
}

/// The first pole of a sphere is on its own z in pbrt and Mitsuba, on y in ours, and is turned with it.
#[test]
fn spheres_are_turned_as_their_files_say() {
    let place = tempfile::tempdir().unwrap();
    let pole = |name: &str, text: &str| {
        let path = place.path().join(name);
        std::fs::write(&path, text).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        glam::Vec3::from(scene.spheres[0].axes.y_axis)
    };
    let pbrt = r#"WorldBegin LightSource "infinite" "rgb L" [1 1 1] Rotate 90 1 0 0 Shape "sphere""#;
    assert!(pole("a.pbrt", pbrt).abs_diff_eq(glam::Vec3::NEG_Y, 1e-6));
    let mitsuba = r#"<scene version="3.0.0"><emitter type="constant"/><shape type="sphere">
<transform name="toWorld"><rotate x="1" angle="90"/></transform></shape></scene>"#;
    assert!(pole("a.xml", mitsuba).abs_diff_eq(glam::Vec3::NEG_Y, 1e-6));
    let ours = r#"
[camera]
position = [0, 0, 5]
look_at = [0, 0, 0]
[environment]
luminance_cd_m2 = 100
[materials.white]
type = "diffuse"
reflectance = 0.5
[[objects]]
material = "white"
transform = [ { rotate_deg = 90, axis = [1, 0, 0] } ]
sphere = { center = [0, 0, 0], radius = 1 }
"#;
    assert!(pole("a.toml", ours).abs_diff_eq(glam::Vec3::Z, 1e-6));
}

/// An area light of alpha 0 is one that no ray meets; of other shapes nothing is left.
#[test]
fn alpha_nought_hides_a_light_in_pbrt() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("a.pbrt");
    let text = r#"WorldBegin LightSource "infinite" "rgb L" [1 1 1] AttributeBegin
AreaLightSource "diffuse" "rgb L" [1 1 1] Shape "sphere" "float alpha" [ 0 ] AttributeEnd
Shape "sphere" "float alpha" [ 0 ]"#;
    std::fs::write(&path, text).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let alpha = |sphere: usize| scene.materials[scene.spheres[sphere].material.0 as usize].alpha;
    assert_eq!(alpha(0), Alpha::Unseen);
    assert_eq!(alpha(1), Alpha::Blend { value: ScalarInput::constant(0.0) });
}
