//! What the caller's unit and picture size change of a scene, and what stays.

use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{FilmDefaults, Light, Projection, Scene};

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";

/// A scene whose files are written first.
fn read(files: &[(&str, &str)], options: &LoadOptions) -> Scene {
    let place = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(place.path().join(name), text).unwrap();
    }
    load(&place.path().join(files[0].0), options).unwrap_or_else(|error| panic!("{error}"))
}

fn at_unit(nits_per_unit: f64) -> LoadOptions {
    LoadOptions { nits_per_unit: Some(nits_per_unit), ..LoadOptions::default() }
}

/// Largest luminance of what surrounds a scene in cd/m².
fn surroundings_cd_m2(scene: &Scene) -> f64 {
    let environment = scene.environment.as_ref().expect("surroundings");
    let largest = environment.texels.iter().map(|texel| texel.max_element()).fold(0.0, f32::max);
    f64::from(largest * environment.scale) * scene.nits_per_unit
}

#[test]
fn the_studio_is_as_bright_in_any_unit() {
    let quad = format!("{QUAD}f 1 2 3 4\n");
    let plain = read(&[("quad.obj", &quad)], &LoadOptions::default());
    let side = ("quad.fechner.toml", "nits_per_unit = 100\n");
    for other in
        [read(&[("quad.obj", &quad)], &at_unit(100.0)), read(&[("quad.obj", &quad), side], &LoadOptions::default())]
    {
        assert_eq!(other.nits_per_unit, 100.0);
        assert!((surroundings_cd_m2(&other) / surroundings_cd_m2(&plain) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn lamps_are_told_by_the_final_unit() {
    let lamp = format!("mtllib lamp.mtl\n{QUAD}usemtl lamp\nf 1 2 3 4\n");
    let lamp: &[(&str, &str)] = &[("lamp.obj", &lamp), ("lamp.mtl", "newmtl lamp\nKd 0 0 0\nKe 5 5 5\n")];
    let has = |scene: &Scene, start: &str| scene.notes.iter().any(|note| note.starts_with(start));
    let weak = read(lamp, &LoadOptions::default());
    assert!(weak.environment.is_some() && has(&weak, "Only emitters below 10 cd/m²"), "{:?}", weak.notes);
    assert!(read(lamp, &at_unit(100.0)).environment.is_none());
    let side: &[(&str, &str)] = &[lamp[0], lamp[1], ("lamp.fechner.toml", "nits_per_unit = 100\n")];
    assert!(read(side, &LoadOptions::default()).environment.is_none());
    // The command line stands over the side file.
    assert!(read(side, &at_unit(1.0)).environment.is_some());
}

#[test]
fn photometric_amounts_stay_what_they_are() {
    let toml = "nits_per_unit = 2\n[materials.lamp]\ntype = \"diffuse\"\nreflectance = 0\nemission_cd_m2 = 500\n\
                [[objects]]\nrectangle = { corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }\n\
                material = \"lamp\"\n[[lights]]\ntype = \"point\"\nposition = [0, 0, 2]\nintensity_cd = 100\n";
    let gltf = GLTF_LAMP.replace("ASPECT", "1");
    for (name, text, emitted) in [("lamp.toml", toml, 500.0), ("lamp.gltf", gltf.as_str(), 3.0)] {
        for options in [LoadOptions::default(), at_unit(10.0)] {
            let scene = read(&[(name, text)], &options);
            let nits = scene.nits_per_unit as f32;
            let emission = scene.materials[scene.instances[0].material.0 as usize].emission.factor.x * nits;
            assert!((emission - emitted).abs() < 1e-3, "{name}: {emission}");
            let Light::Point { intensity, .. } = scene.lights[0] else { panic!("a point light") };
            assert!((intensity.x * nits - 100.0).abs() < 1e-3, "{name}: {intensity}");
        }
    }
}

/// How wide and high a camera sees at distance 1, or in parallel.
fn view(scene: &Scene, film: FilmDefaults) -> [f32; 2] {
    let height = match scene.camera.projection {
        Projection::Perspective { vertical_fov_deg } => 2.0 * (0.5 * vertical_fov_deg).to_radians().tan(),
        Projection::Orthographic { height } => height,
    };
    [height * film.width as f32 / film.height as f32, height]
}

#[test]
fn default_views_are_framed_for_the_picture() {
    let wide = "v -5 0 0\nv 5 0 0\nv 5 1 0\nv -5 1 0\nf 1 2 3 4\n";
    let portrait = FilmDefaults { width: 32, height: 128 };
    let options = LoadOptions { film: Some(portrait), ..LoadOptions::default() };
    let side = ("wide.fechner.toml", "[film]\nsize = [32, 128]\n");
    let told = read(&[("wide.obj", wide)], &options);
    assert_eq!(told.camera, read(&[("wide.obj", wide), side], &LoadOptions::default()).camera);
    let [width, _] = view(&told, portrait);
    for x in [-5.0, 5.0] {
        let axes = told.camera.axes();
        let way = glam::Vec3::new(x, 0.5, 0.0) - told.camera.position;
        assert!(way.dot(axes.right).abs() / way.dot(axes.forward) < 0.5 * width, "{x} is cropped");
    }
}

#[test]
fn nothing_a_gltf_camera_shows_is_cropped() {
    let text = GLTF_LAMP.replace("ASPECT", "2");
    let own = read(&[("lamp.gltf", &text)], &LoadOptions::default());
    assert_eq!(own.film, FilmDefaults { width: 512, height: 256 });
    let [width, height] = view(&own, own.film);
    for (size, expected) in [((64, 16), height), ((64, 32), height), ((64, 64), 2.0 * height), ((32, 64), 4.0 * height)]
    {
        let film = FilmDefaults { width: size.0, height: size.1 };
        let scene = read(&[("lamp.gltf", &text)], &LoadOptions { film: Some(film), ..LoadOptions::default() });
        let seen = view(&scene, film);
        assert!((seen[1] / expected - 1.0).abs() < 1e-4 && seen[0] > 0.999 * width, "{size:?}: {seen:?}");
    }
}

/// A triangle of 3 cd/m² under a lamp of 100 cd, seen by a camera.
const GLTF_LAMP: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2]}],
"extensionsUsed":["KHR_lights_punctual","KHR_materials_emissive_strength"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":100}]}},
"nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[0,0,2]},{"camera":0,"translation":[0,0,3]}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.6,"znear":0.1,"aspectRatio":ASPECT}}],
"materials":[{"emissiveFactor":[1,1,1],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":3}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// What is left out of a light is said where a file asks for it.
#[test]
fn the_range_of_a_gltf_light_is_named() {
    let plain = GLTF_LAMP.replace("ASPECT", "1");
    let cut = plain.replace(r#""intensity":100"#, r#""intensity":100,"range":1"#);
    for (text, is_named) in [(plain, false), (cut, true)] {
        let scene = read(&[("lamp.gltf", &text)], &LoadOptions::default());
        let names = scene.notes.iter().any(|note| note.contains("range of lights is not rendered"));
        assert_eq!(names, is_named, "{:?}", scene.notes);
    }
}

/// The surroundings of a side file take the sun away with the sky that they replace.
#[test]
fn a_side_files_surroundings_replace_the_sun() {
    let sunny = "<scene version=\"3.0.0\"><emitter type=\"sunsky\"><vector name=\"sun_direction\" x=\"0\" y=\"1\" z=\"1\"/>\
                 </emitter><shape type=\"sphere\"/></scene>";
    let suns =
        |side: &str| read(&[("sunny.xml", sunny), ("sunny.fechner.toml", side)], &LoadOptions::default()).lights.len();
    assert_eq!(suns("[film]\nsize = [8, 8]\n"), 1);
    assert_eq!(suns("[environment]\nluminance_cd_m2 = 1000\n"), 0);
    assert_eq!(suns("[environment]\nsky = { sun_elevation_deg = 20 }\n"), 1);
}
