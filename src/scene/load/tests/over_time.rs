//! What one file holds at different times: the same things under the same numbers, seen and lit in the same way, where
//! nothing in the file changes that.

use crate::scene::hash::content_hash;
use crate::scene::load::{LoadError, LoadOptions, load};
use crate::scene::{Light, Motion, Scene};
use glam::{Quat, Vec3};
use std::path::PathBuf;

/// A file in a folder of its own, read at any time.
struct File {
    folder: tempfile::TempDir,
    path: PathBuf,
}

impl File {
    fn new(name: &str, text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        Self { folder, path }
    }

    /// A glTF file beside a buffer of floats: a unit triangle, the times 0, 1 and 2 s, then `values`.
    fn gltf(nodes: &str, rest: &str, values: &[f32]) -> Self {
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],"nodes":[{nodes}],{rest},
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.7,"znear":0.1}}}}],
"buffers":[{{"byteLength":{bytes},"uri":"a.bin"}}],"bufferViews":[{{"buffer":0,"byteLength":36}},
{{"buffer":0,"byteOffset":36,"byteLength":12}},{{"buffer":0,"byteOffset":48,"byteLength":{of_values}}}]}}"#,
            bytes = 48 + 4 * values.len(),
            of_values = 4 * values.len(),
        );
        let file = Self::new("a.gltf", &text);
        let fixed = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0];
        let bytes: Vec<u8> = fixed.iter().chain(values).flat_map(|number| number.to_le_bytes()).collect();
        std::fs::write(file.folder.path().join("a.bin"), bytes).expect("written");
        file
    }

    fn try_at(&self, seconds: f64) -> Result<Scene, LoadError> {
        load(&self.path, &LoadOptions { frame_time: seconds, ..LoadOptions::default() })
    }

    fn at(&self, seconds: f64) -> Scene {
        self.try_at(seconds).unwrap_or_else(|error| panic!("{error}"))
    }
}

/// What a glTF file has beside its nodes where the third view holds three values a key of `path` of node 0 or 1.
fn animated(node: usize, path: &str, kind: &str, interpolation: &str) -> String {
    format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"animations":[{{"channels":[{{"sampler":0,"target":{{"node":{node},"path":"{path}"}}}}],
"samplers":[{{"input":1,"output":2,"interpolation":"{interpolation}"}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
{{"bufferView":1,"componentType":5126,"count":3,"type":"SCALAR","min":[0],"max":[2]}},
{{"bufferView":2,"componentType":5126,"count":3,"type":"{kind}"}}]"#
    )
}

const TOML: &str = r#"
[camera]
position = [0, 0, 5]
look_at = [0, 0, 0]
[materials.white]
type = "diffuse"
reflectance = 0.5
"#;

const LIT: &str = "[environment]\nluminance_cd_m2 = 100\n";

/// Whether everything in the file has one number, and each mesh as many triangles, at all of these times.
fn is_numbered_alike(file: &File, times: &[f64]) {
    let numbers = |scene: &Scene| {
        let instances = scene.instances.iter().map(|instance| instance.name.clone());
        let spheres = scene.spheres.iter().map(|sphere| sphere.name.clone());
        (instances.collect::<Vec<_>>(), spheres.collect::<Vec<_>>())
    };
    let first = numbers(&file.at(times[0]));
    for &time in &times[1..] {
        assert_eq!(numbers(&file.at(time)), first, "at {time} s");
    }
}

/// glTF's way to hide a thing is a scale of 0. Regression: whatever came after it was renumbered, and so had velocities
/// of other things: 20.6 pixels instead of 0.9.
#[test]
fn what_is_hidden_keeps_its_number() {
    let scales = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let nodes = r#"{"mesh":0,"name":"hidden"},{"mesh":0,"name":"after it"}"#;
    let file = File::gltf(nodes, &animated(0, "scale", "VEC3", "STEP"), &scales);
    is_numbered_alike(&file, &[0.0, 1.0, 2.0]);
    let hidden = file.at(1.0);
    assert!(hidden.meshes[hidden.instances[0].mesh.0 as usize].triangles.is_empty());
    assert_eq!(hidden.meshes[hidden.instances[1].mesh.0 as usize].triangles.len(), 1);

    let through_nothing = r#"
[[objects]]
name = "box"
box = { min = [0, 0, 0], max = [1, 1, 1] }
material = "white"
keyframes = [ { time = 0, scale = 1 }, { time = 1, scale = -1 } ]
[[objects]]
name = "ball"
sphere = { center = [0, 0, 0], radius = 1 }
material = "white"
keyframes = [ { time = 0, scale = 1 }, { time = 1, scale = -1 } ]
[[objects]]
name = "wall"
box = { min = [2, 0, 0], max = [3, 1, 1] }
material = "white"
"#;
    is_numbered_alike(&File::new("a.toml", &format!("{TOML}{LIT}{through_nothing}")), &[0.0, 0.5, 1.0]);
}

/// A frame in which everything is hidden shows nothing; a file that holds nothing is still refused.
#[test]
fn everything_may_be_hidden_for_a_while() {
    let scales = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let file =
        File::gltf(r#"{"mesh":0},{"camera":0,"translation":[0,0,5]}"#, &animated(0, "scale", "VEC3", "STEP"), &scales);
    assert_eq!(file.at(1.0).instances.len(), 1);
    let unseen = File::gltf(r#"{"mesh":0},{"mesh":0}"#, &animated(0, "scale", "VEC3", "STEP"), &scales);
    assert!(unseen.at(1.0).camera.position.is_finite());
    let hidden_first = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let late = File::gltf(r#"{"mesh":0},{}"#, &animated(0, "scale", "VEC3", "STEP"), &hidden_first);
    assert!([0.0, 1.0, 2.0].into_iter().all(|time| late.at(time).camera.position.is_finite()));
    let flat = format!("{TOML}{LIT}[[objects]]\nbox = {{ min = [0, 0, 0], max = [1, 1, 1] }}\nmaterial = \"white\"\n");
    let flat = flat + "transform = [ { scale = [1e-30, 1e-30, 1e-30] } ]\n";
    let said = File::new("a.toml", &flat).try_at(1.0).expect_err("nothing is there").to_string();
    assert!(said.contains("nothing to render"), "{said}");
}

/// A sphere that is squashed later is a mesh from the start.
#[test]
fn a_sphere_or_a_mesh_is_one_at_all_times() {
    let squashed = r#"
[[objects]]
name = "squashed"
sphere = { center = [0, 0, 0], radius = 1 }
material = "white"
keyframes = [ { time = 1, scale = 1 }, { time = 2, scale = [1.3, 0.7, 1.3] } ]
[[objects]]
name = "mirrored"
sphere = { center = [0, 0, 0], radius = 1 }
material = "white"
keyframes = [ { time = 1, scale = 1 }, { time = 2, scale = [1, 1, -1] } ]
[[objects]]
name = "round"
sphere = { center = [3, 0, 0], radius = 1 }
material = "white"
keyframes = [ { time = 1, scale = 1 }, { time = 2, scale = 2 } ]
"#;
    let file = File::new("a.toml", &format!("{TOML}{LIT}{squashed}"));
    is_numbered_alike(&file, &[0.0, 1.25, 3.0]);
    assert_eq!(file.at(0.0).spheres.len(), 1);
}

/// Triangles that a morph target flattens keep their numbers. Regression: a face at rest had 26.8 pixels of motion.
#[test]
fn triangles_of_what_deforms_keep_their_numbers() {
    // Weights 0, 1, 0; then the target, which puts the third corner into the first.
    let values = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0];
    let rest = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":3}]}]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],"samplers":[{"input":1,"output":2}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":1,"componentType":5126,"count":3,"type":"SCALAR","min":[0],"max":[2]},
{"bufferView":2,"componentType":5126,"count":3,"type":"SCALAR"},
{"bufferView":2,"byteOffset":12,"componentType":5126,"count":3,"type":"VEC3","min":[0,-1,0],"max":[0,0,0]}]"#;
    let file = File::gltf(r#"{"mesh":0},{"camera":0,"translation":[0,0,5]}"#, rest, &values);
    for time in [0.0, 0.5, 1.0, 2.0] {
        let scene = file.at(time);
        assert_eq!(scene.meshes[scene.instances[0].mesh.0 as usize].triangles.len(), 1, "at {time} s");
    }
}

/// The studio that stands in for light stays where it is when the camera turns: a wall in front of it went from 613 to
/// 901 cd/m².
#[test]
fn a_studio_does_not_turn_with_the_camera() {
    let turns: Vec<f32> = [0.0_f32, 1.0, 2.0].iter().flat_map(|a| Quat::from_rotation_y(*a).to_array()).collect();
    let file = File::gltf(r#"{"mesh":0},{"camera":0}"#, &animated(1, "rotation", "VEC4", "LINEAR"), &turns);
    let [first, later] = [0.0, 1.5].map(|time| file.at(time));
    assert!(first.camera.forward.distance(later.camera.forward) > 1.0, "it turns");
    let [first, later] = [first, later].map(|scene| scene.environment.expect("a studio"));
    assert!(first.texels == later.texels && first.from_world == later.from_world);
}

/// A file without a camera is seen by one that stands still, whatever flies away.
#[test]
fn the_default_view_stands_still() {
    let file = File::gltf(
        r#"{"mesh":0},{"mesh":0}"#,
        &animated(1, "translation", "VEC3", "LINEAR"),
        &[1.0, 0.0, 0.0, 4.0, 0.0, 0.0, 9.0, 0.0, 0.0],
    );
    let toml = "[materials.white]\ntype = \"diffuse\"\nreflectance = 0.5\n[environment]\nluminance_cd_m2 = 100\n\
                [[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"white\"\n\
                keyframes = [ { time = 0 }, { time = 2, translate = [9, 0, 0] } ]\n";
    for file in [file, File::new("a.toml", toml)] {
        let [first, later] = [0.0, 1.5].map(|time| file.at(time).camera);
        assert_eq!((first.position, first.forward), (later.position, later.forward), "{}", file.path.display());
    }
}

/// A lamp may be off for a while; a scene without one is still refused.
#[test]
fn light_may_come_at_another_time() {
    let object = "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"white\"\n";
    let point =
        |strength: &str| format!("{TOML}{object}[[lights]]\ntype = \"point\"\nposition = [0, 3, 0]\n{strength}\n");
    let fades = "keyframes = [ { time = 0, intensity_cd = 0 }, { time = 1, intensity_cd = 50 } ]";
    let dark = File::new("a.toml", &point(fades)).at(0.0);
    assert!(matches!(dark.lights[..], [Light::Point { intensity: Vec3::ZERO, .. }]) && dark.environment.is_none());
    let lamp = |emission: &str| {
        let lamp = format!("[materials.lamp]\ntype = \"diffuse\"\nreflectance = 0.5\n{emission}\n");
        format!("{TOML}{lamp}{}", object.replace("white", "lamp"))
    };
    File::new("a.toml", &lamp("keyframes = [ { time = 0, power_lm = 0 }, { time = 1, power_lm = 800 } ]")).at(0.0);
    for unlit in [point("intensity_cd = 0"), lamp("emission_cd_m2 = 0")] {
        let said = File::new("a.toml", &unlit).try_at(0.0).expect_err("no light at any time").to_string();
        assert!(said.contains("no light"), "{said}");
    }
}

fn pbrt(shutter: &str, times: &str, moves: &str, shape: &str) -> File {
    let text = format!(
        "TransformTimes {times}\nLookAt 0 0 6 0 0 0 0 1 0\nCamera \"perspective\" {shutter}\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [1 1 1]\nActiveTransform EndTime\n{moves}\nActiveTransform All\n{shape}\n"
    );
    File::new("a.pbrt", &text)
}

/// A sphere that the end of its transform makes an ellipsoid is a mesh: as a sphere it grew in all directions.
#[test]
fn a_sphere_of_pbrt_that_is_squashed_is_a_mesh() {
    let sphere = "Shape \"sphere\" \"float radius\" 0.4";
    let squashed = pbrt("", "0 1", "Scale 4 1 1", sphere).at(0.0);
    assert!(squashed.spheres.is_empty() && squashed.instances[0].motion.is_some());
    assert_eq!(pbrt("", "0 1", "Scale 4 4 4", sphere).at(0.0).spheres.len(), 1);
}

/// pbrt turns instance and part each by itself. Regression: a part beside the axis of a quarter turn went along the
/// chord, 0.92 from the axis half way instead of 1.3, and one that turned inside a stretched instance was bent.
#[test]
fn parts_of_pbrts_objects_go_with_their_instances() {
    /// Where a point of the part is at a share of the way.
    type Way<'a> = &'a dyn Fn(f32, Vec3) -> Vec3;
    let quarter = "ActiveTransform EndTime Rotate 90 0 0 1 ActiveTransform All";
    let turned = |share: f32, point: Vec3| Quat::from_rotation_z(share * std::f32::consts::FRAC_PI_2) * point;
    let beside = Vec3::X * 1.3;
    // The pose of a part that moves as a whole has its place on the chord.
    let own_pose = |share: f32, point: Vec3| beside.lerp(Vec3::Y * 1.3, share) + turned(share, point);
    let turning_beside = format!("{quarter} Translate 1.3 0 0");
    let beside_turning = format!("Translate 1.3 0 0 {quarter}");
    let cases: [(&str, &str, Way); 4] = [
        ("Translate 1.3 0 0", quarter, &|share, point| turned(share, beside + point)),
        (&turning_beside, "Scale -2 2 2", &|share, point| Vec3::new(-2.0, 2.0, 2.0) * own_pose(share, point)),
        (&turning_beside, "Scale 2 .6 1", &|share, point| Vec3::new(2.0, 0.6, 1.0) * own_pose(share, point)),
        (&beside_turning, quarter, &|share, point| turned(share, beside + turned(share, point))),
    ];
    for (part, instance, expected) in cases {
        let triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";
        let object = format!("ObjectBegin \"o\" {part} {triangle} ObjectEnd {instance} ObjectInstance \"o\"");
        let placed = pbrt("", "0 1", "", &object).at(0.0).instances.remove(0);
        for point in [Vec3::ZERO, Vec3::X, Vec3::Y] {
            let opens = placed.to_world.transform_point3(point);
            assert!(opens.distance(expected(0.0, point)) < 1e-5, "{part} in {instance}: {opens}");
            for share in [0.0, 0.13, 0.5, 0.77, 1.0] {
                let found = placed.transform_at(share).transform_point3(point);
                assert!(found.distance(expected(share, point)) < 1e-3, "{part} in {instance} at {share}: {found}");
            }
        }
    }
}

/// The shutter may open before and close after `TransformTimes`, beyond which everything rests.
#[test]
fn motion_of_pbrt_ends_where_its_times_do() {
    let shutter = "\"float shutteropen\" 0 \"float shutterclose\" 1";
    let scene = pbrt(shutter, "0.25 0.5", "Translate 3 0 0", "Shape \"sphere\"").at(0.0);
    let motion = scene.spheres[0].motion.as_ref().expect("it moves");
    for (share, x) in [(0.0, 0.0), (0.25, 0.0), (0.375, 1.5), (0.5, 3.0), (1.0, 3.0)] {
        let moved = motion.at(share).transform_point3(scene.spheres[0].center) - scene.spheres[0].center;
        assert!((moved.x - x).abs() < 1e-4, "{share}: {moved}");
    }
}

/// Times of day in seconds: an f32 of 28 hours counts by 1/128 s, and 24 frames a second moved by fits and starts.
#[test]
fn late_times_are_as_fine_as_early_ones() {
    let still = "\"float shutteropen\" 0 \"float shutterclose\" 0";
    let file = pbrt(still, "100000 100010", "Translate 10 0 0", "Shape \"sphere\"");
    for frame in 0..20 {
        let seconds = f64::from(frame) / 24.0;
        let x = f64::from(file.at(1e5 + seconds).spheres[0].center.x);
        assert!((x - seconds).abs() < 1e-5, "{x}, not {seconds}");
    }
}

/// Rotations go the way and as far as they are written, also while the shutter is open.
#[test]
fn turns_go_as_far_as_they_are_written() {
    let turning = |keyframes: &str, shutter_s: f64| {
        let text = format!(
            "{}{LIT}[[objects]]\nbox = {{ min = [0, 0, 0], max = [1, 1, 1] }}\nmaterial = \"white\"\nkeyframes = {keyframes}\n",
            TOML.replace("look_at = [0, 0, 0]", &format!("look_at = [0, 0, 0]\nshutter_s = {shutter_s}"))
        );
        File::new("a.toml", &text)
    };
    let about_y = |from: f64, to: f64| {
        format!(
            "[ {{ time = 0, rotate_deg = {from}, axis = [0, 1, 0] }}, {{ time = 1, rotate_deg = {to}, axis = [0, 1, 0] }} ]"
        )
    };
    for (from, to) in [(0.0, 90.0), (0.0, 190.0), (0.0, 270.0), (0.0, 360.0), (30.0, -690.0)] {
        let still = turning(&about_y(from, to), 0.0);
        let open = turning(&about_y(from, to), 1.0).at(0.0);
        let motion = open.instances[0].motion.as_ref().expect("it moves");
        for share in [0.0_f32, 0.1, 0.3, 0.5, 0.85, 1.0] {
            let degrees = from + (to - from) * f64::from(share);
            let expected = Quat::from_rotation_y(degrees.to_radians() as f32) * Vec3::X;
            let at_rest = still.at(f64::from(share)).instances[0].to_world.transform_vector3(Vec3::X);
            let meanwhile = motion.at(share).transform_vector3(Vec3::X);
            assert!(at_rest.distance(expected) < 1e-4, "{from} to {to} at {share}: {at_rest}, not {expected}");
            assert!(meanwhile.distance(expected) < 1e-4, "{from} to {to} at {share}: {meanwhile}, not {expected}");
        }
    }
    let two_axes = |degrees: f64| {
        format!(
            "[ {{ time = 0, rotate_deg = 10, axis = [0, 1, 0] }}, {{ time = 1, rotate_deg = {degrees}, axis = [1, 0, 0] }} ]"
        )
    };
    turning(&two_axes(90.0), 0.0).at(0.5);
    let said = turning(&two_axes(200.0), 0.0).try_at(0.5).expect_err("either way is as good").to_string();
    assert!(said.contains("half a turn"), "{said}");
}

/// Regression: beyond 65,535 bytes reading them ended in a panic. Blanks, as many as a format's width,
/// brought them to their place.
#[test]
fn keyframes_may_stand_anywhere_in_a_long_file() {
    let object = "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"late\"\n";
    let long = |material: &str, light: &str| {
        let comments = "# a comment\n".repeat(6_000);
        let material = format!("[materials.late]\ntype = \"diffuse\"\n{material}\n");
        let light = format!("[[lights]]\ntype = \"point\"\nposition = [0, 3, 0]\n{light}\n");
        File::new("a.toml", &format!("{TOML}{comments}{material}{object}{light}"))
    };
    let moving = long(
        "keyframes = [ { time = 0, reflectance = [0.5, 0, 0] }, { time = 2, reflectance = [0, 0.5, 0] } ]",
        "keyframes = [ { time = 0, intensity_cd = 10 }, { time = 2, intensity_cd = 30 } ]",
    );
    let fixed = long("reflectance = [0.375, 0.125, 0]", "intensity_cd = 15");
    assert_eq!(content_hash(&moving.at(0.5)), content_hash(&fixed.at(0.5)));
    let lit = "intensity_cd = 15";
    let wrong = long("keyframes = [ { time = 0, \"réflectance\" = 0.5 } ]", lit).try_at(0.0).expect_err("no such key");
    let expected = ":6010: unknown key \"réflectance\" in materials.late; did you mean \"reflectance\"?";
    assert!(wrong.to_string().ends_with(expected), "{wrong}");
    let wrong =
        long("keyframes = [ { time = 0, reflectance = [0.5, -1, 0] } ]", lit).try_at(0.0).expect_err("negative");
    assert!(wrong.to_string().contains(":6010: materials.late.reflectance: "), "{wrong}");
}

/// Keyframes are cut into pieces of a quarter turn. Regression: 46 kB of them were 116 MB, 1024 pieces from each to the
/// next one, and so were 113 kB of objects.
#[test]
fn keyframes_of_many_turns_are_few_poses() {
    let turning = |keyframes: &str| {
        format!(
            "[[objects]]\nbox = {{ min = [0, 0, 0], max = [1, 1, 1] }}\nmaterial = \"white\"\nkeyframes = [{keyframes}]\n"
        )
    };
    let motions = |objects: &str| -> Vec<Motion> {
        let open = TOML.replace("look_at = [0, 0, 0]", "look_at = [0, 0, 0]\nshutter_s = 1");
        let scene = File::new("a.toml", &format!("{open}{LIT}{objects}")).at(0.0);
        scene.instances.into_iter().filter_map(|instance| instance.motion).collect()
    };
    let poses = |objects: &str| -> usize { motions(objects).iter().map(|motion| motion.keys().len()).sum() };
    let keyframe = |number: u32| {
        format!(
            "{{ time = {}, rotate_deg = {}, axis = [0, 1, 0] }}",
            f64::from(number) / 1000.0,
            number % 2 * 1_000_000
        )
    };
    let of_one = poses(&turning(&(0..=1000).map(keyframe).collect::<Vec<_>>().join(", ")));
    assert!((1001..=2100).contains(&of_one), "{of_one}");
    let fast = turning("{ time = 0 }, { time = 1, rotate_deg = 1e6, axis = [0, 1, 0] }");
    assert_eq!(poses(&fast), 1025);
    let of_many = poses(&fast.repeat(1000));
    assert!((200_000..=270_000).contains(&of_many), "{of_many}");
    let still = "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"white\"\n".repeat(1000);
    assert_eq!(poses(&format!("{still}{fast}")), 1025, "what has no keyframes takes no share");
    // 2000 turns, then three quarters of one: the short way of those would be back.
    let slowing = "{ time = 0, axis = [0, 1, 0], rotate_deg = 0 }, { time = 0.01, axis = [0, 1, 0], rotate_deg = 720000 }, \
                   { time = 1, axis = [0, 1, 0], rotate_deg = 720270 }";
    let motion = &motions(&turning(slowing))[0];
    assert!(motion.keys().len() <= 1026, "{}", motion.keys().len());
    let x = motion.at(0.505).transform_vector3(Vec3::X);
    let expected = Vec3::new(135_f32.to_radians().cos(), 0.0, -135_f32.to_radians().sin());
    assert!(x.distance(expected) < 0.02, "{x} for {expected}");
}
