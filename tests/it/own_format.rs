//! Our own format: what lamps of a luminous power and photometric ones emit, keys that change nothing, and files that
//! are found from the scene's folder.

use fechner::scene::hash::content_hash;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, Light, Scene, Surface};
use glam::Vec3;

/// A scene in a folder of its own, at a time in seconds.
fn at(text: &str, seconds: f64) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(&path, text).unwrap();
    let options = LoadOptions { frame_time: seconds, ..LoadOptions::default() };
    load(&path, &options).map_err(|error| error.to_string().replace(&path.display().to_string(), "s.toml"))
}

fn read(text: &str) -> Result<Scene, String> {
    at(text, 0.0)
}

const LIT: &str = "[environment]\nluminance_cd_m2 = 100\n";

/// A square metre of a material.
fn square(material: &str) -> String {
    format!(
        "[materials.m]\n{material}\n[[objects]]\n\
         rectangle = {{ corner = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }}\nmaterial = \"m\"\n"
    )
}

#[test]
fn a_lamp_gives_its_power_through_what_alpha_leaves() {
    let lamp = |alpha: &str| square(&format!("type = \"diffuse\"\nreflectance = 0\npower_lm = 100\n{alpha}"));
    let flux = |alpha: &str, share: f32| {
        let scene = read(&lamp(alpha)).unwrap();
        let own = scene.materials.last().expect("the lamp's own");
        own.emission.factor.x * share * std::f32::consts::PI
    };
    for (alpha, share) in
        [("", 1.0), ("alpha = 0.25", 0.25), ("alpha = 0.6\nalpha_cutoff = 0.5", 1.0), ("alpha = 1", 1.0)]
    {
        assert!((flux(alpha, share) - 100.0).abs() < 1e-3, "{alpha}: {} lm", flux(alpha, share));
    }
    let picture = "[textures.t]\nfile = \"t.png\"\n";
    let refused = read(&format!("{picture}{}", lamp("alpha = { texture = \"t\" }"))).unwrap_err();
    assert!(refused.starts_with("s.toml:10") && refused.contains("use emission_cd_m2"), "{refused}");
}

/// A block of glass within glass took 7 % of the light: there was no way to say what is around it.
#[test]
fn an_index_is_relative_to_what_is_around() {
    let relative = |indices: &str| -> Result<f32, String> {
        let scene = read(&format!("{LIT}{}", square(&format!("type = \"dielectric\"\n{indices}"))))?;
        match scene.materials.iter().find_map(|material| match material.surface {
            Surface::Dielectric { ior, .. } => Some(ior),
            _ => None,
        }) {
            Some(ior) => Ok(ior),
            None => panic!("no dielectric"),
        }
    };
    for (indices, expected) in [
        ("", 1.5),
        ("ior = 1.33", 1.33),
        ("ior = 1.33\nior_outside = 1", 1.33),
        ("ior = 1.5\nior_outside = 1.5", 1.0),
        ("ior = 1\nior_outside = 1.6", 0.625),
        ("ior_outside = 2", 0.75),
    ] {
        assert_eq!(relative(indices), Ok(expected), "{indices}");
    }
    for (outside, problem) in
        [("0", "above 0"), ("-1", "above 0"), ("1e38", "comparable to ior"), ("\"air\"", "number")]
    {
        let refused = relative(&format!("ior = 1e-20\nior_outside = {outside}")).unwrap_err();
        assert!(refused.starts_with("s.toml:6") && refused.contains(problem), "{outside}: {refused}");
    }
}

/// A leaf whose red is 0 was invisible where its alpha is 1.
#[test]
fn coverage_is_the_alpha_of_a_picture_that_has_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    image::RgbaImage::from_pixel(1, 1, image::Rgba([0, 128, 0, 255])).save(folder.path().join("leaf.png")).unwrap();
    image::RgbImage::from_pixel(1, 1, image::Rgb([64, 128, 0])).save(folder.path().join("mask.png")).unwrap();
    for (file, channel, read) in [
        ("leaf.png", "", 3),
        ("leaf.png", ", channel = \"r\"", 0),
        ("leaf.png", ", channel = \"g\"", 1),
        ("mask.png", "", 0),
    ] {
        let leaf = square(&format!("type = \"diffuse\"\nreflectance = 0.5\nalpha = {{ texture = \"t\"{channel} }}"));
        std::fs::write(&path, format!("{LIT}[textures.t]\nfile = \"{file}\"\n{leaf}")).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap();
        let Alpha::Blend { value } = scene.materials[0].alpha else { panic!("{:?}", scene.materials[0].alpha) };
        assert_eq!(value.texture.unwrap().1, read, "{file}{channel}");
    }
}

/// A lamp that grows from nothing is dark while it is flat; one that never has an area is a slip.
#[test]
fn a_lamp_that_is_flat_for_a_moment_is_dark_then() {
    let lamp = "[materials.m]\ntype = \"diffuse\"\nreflectance = 0\npower_lm = 100\n[[objects]]\nname = \"bulb\"\nmaterial = \"m\"\n\
                keyframes = [ { time = 0, scale = -1 }, { time = 2, scale = 1 } ]\n";
    for shape in ["sphere = { center = [0, 0, 0], radius = 1 }", "box = { min = [-1, -1, -1], max = [1, 1, 1] }"] {
        let text = format!("{LIT}{lamp}{shape}\n");
        let flat = at(&text, 1.0).unwrap_or_else(|error| panic!("{shape}: {error}"));
        assert!(flat.notes.iter().any(|note| note.contains("\"bulb\" has no area now")), "{shape}: {:?}", flat.notes);
        assert!(at(&text, 2.0).unwrap().materials.iter().any(|own| own.emission.factor.x > 0.0), "{shape}");
        // The only light of its scene may be off for a while, as other lamps may; what rays meet is beside it.
        let beside = square("type = \"diffuse\"\nreflectance = 0.5").replace("materials.m]", "materials.plain]");
        let alone = format!("{}{lamp}{shape}\n", beside.replace("\"m\"", "\"plain\""));
        assert!(at(&alone, 1.0).is_ok(), "{shape}: {:?}", at(&alone, 1.0).err());
    }
}

#[test]
fn keys_that_change_nothing_are_named() {
    let notes = |material: &str| {
        let notes = read(&format!("{LIT}{}", square(material))).unwrap().notes;
        notes.into_iter().filter(|note| note.contains("has no effect")).collect::<Vec<_>>()
    };
    let volume = "type = \"metal-roughness\"\nattenuation_color = [0.5, 0.5, 0.5]\nattenuation_distance = 1";
    for (material, key) in [
        (volume, "attenuation_color"),
        ("type = \"metal-roughness\"\nabsorption = 1", "absorption"),
        ("type = \"conductor\"\nmetal = \"gold\"\nroughness = 0.3\nstretch_rotation_deg = 30", "stretch_rotation_deg"),
        ("type = \"diffuse\"\nreflectance = 0.5\nemits_both_sides = true", "emits_both_sides"),
    ] {
        let expected = format!("materials.m.{key} has no effect");
        let notes = notes(material);
        assert!(notes.len() == 1 && notes[0].contains(&expected) && notes[0].contains("s.toml:"), "{key}: {notes:?}");
    }
    let idle = format!("{LIT}[textures.idle]\nfile = \"nowhere.png\"\n{}", square("type = \"mirror\""));
    let notes_of_texture = read(&idle).unwrap().notes;
    assert!(
        notes_of_texture.iter().any(|n| n.contains("s.toml:3: textures.idle has no effect")),
        "{notes_of_texture:?}"
    );
    for used in [
        &format!("{volume}\ntransmission = 1"),
        &format!("{volume}\nkeyframes = [ {{ time = 0, transmission = 0 }}, {{ time = 1, transmission = 1 }} ]"),
        "type = \"conductor\"\nmetal = \"gold\"\nroughness = 0.3\nroughness_v = 0.1\nstretch_rotation_deg = 30",
        "type = \"diffuse\"\nreflectance = 0.5\nemission_cd_m2 = 5\nemits_both_sides = true",
        "type = \"diffuse\"\nreflectance = 0.5\nemits_both_sides = false",
    ] {
        assert_eq!(notes(used), Vec::<String>::new(), "{used}");
    }
}

/// One rule for the index of the metal-roughness model, in all formats that have it.
#[test]
fn an_index_of_refraction_is_at_least_1_or_0() {
    let sheet = |ior: f64| read(&format!("{LIT}{}", square(&format!("type = \"metal-roughness\"\nior = {ior}"))));
    for taken in [0.0, 1.0, 1.5] {
        assert!(sheet(taken).is_ok(), "{taken}");
    }
    let refused = sheet(0.5).unwrap_err();
    assert!(refused.contains("materials.m.ior") && refused.contains("at least 1, or 0"), "{refused}");
    let volume = "type = \"metal-roughness\"\nior = 0.0\ntransmission = 1\nabsorption = 1";
    let refused = read(&format!("{LIT}{}", square(volume))).unwrap_err();
    assert!(refused.contains("at least 1 where light enters a volume"), "{refused}");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.gltf");
    let gltf = |ior: f64| {
        let bytes: Vec<u8> =
            [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(folder.path().join("t.bin"), bytes).unwrap();
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"extensionsUsed":["KHR_materials_ior"],
"materials":[{{"name":"pane","extensions":{{"KHR_materials_ior":{{"ior":{ior}}}}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
"buffers":[{{"byteLength":36,"uri":"t.bin"}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}]}}"#
        );
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap().notes
    };
    let named = |notes: &[String]| notes.iter().any(|note| note.contains("\"pane\": ior 0.5 is taken as 1.5"));
    assert!(named(&gltf(0.5)), "{:?}", gltf(0.5));
    assert!(!gltf(0.0).iter().any(|note| note.contains("ior")), "{:?}", gltf(0.0));

    let mitsuba = folder.path().join("s.xml");
    let eta = "<bsdf type=\"principled\"><float name=\"eta\" value=\"0.5\"/></bsdf>";
    let text = format!("<scene version=\"3.0.0\"><shape type=\"sphere\">{eta}</shape></scene>");
    std::fs::write(&mitsuba, text).unwrap();
    let refused = load(&mitsuba, &LoadOptions::default()).expect_err("no index").to_string();
    assert!(refused.contains("eta 0.5: an index of refraction is at least 1, or 0"), "{refused}");
}

/// The display's file is found from the scene's folder, like the scene's other files.
#[test]
fn a_display_file_lies_beside_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    let display = |named: &str| {
        let text = format!("{LIT}[view]\ndisplay = \"{named}\"\n{}", square("type = \"mirror\""));
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).unwrap().viewing.display.expect("named")
    };
    assert_eq!(display("room.toml"), folder.path().join("room.toml").display().to_string());
    assert_eq!(display("/far/room.toml"), "/far/room.toml");
    assert_eq!(display("laptop"), "laptop");
    let mesh = folder.path().join("t.obj");
    std::fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::fs::write(folder.path().join("t.fechner.toml"), "[view]\ndisplay = \"room.toml\"\n").unwrap();
    let beside = load(&mesh, &LoadOptions::default()).unwrap().viewing.display.expect("named");
    assert_eq!(beside, folder.path().join("room.toml").display().to_string());
}

/// The example of `scenes/README.md`, with the files that it names, loads as it stands; so does its other kind of
/// relief.
#[test]
fn the_example_of_the_format_loads() {
    let document = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/README.md")).unwrap();
    let (_, rest) = document.split_once("```toml\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("its end");
    let folder = tempfile::tempdir().unwrap();
    for name in ["textures", "meshes"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    let grey = image::RgbImage::from_pixel(2, 2, image::Rgb([128; 3]));
    for name in ["wood", "bumps", "heights"] {
        grey.save(folder.path().join(format!("textures/{name}.png"))).unwrap();
    }
    image::Rgb32FImage::from_pixel(2, 2, image::Rgb([1.0; 3])).save(folder.path().join("sky.hdr")).unwrap();
    std::fs::write(folder.path().join("downlight.ies"), LAMP).unwrap();
    std::fs::write(folder.path().join("meshes/bunny.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let path = folder.path().join("example.toml");
    let bumpy = example.replace("\nnormal_map =", "\n# normal_map =").replace("\n# bump_map =", "\nbump_map =");
    let walking = example
        .replace("\nposition = [0, 1, 4]\nlook_at = [0, 1, 0]", "")
        .replace("position = [..], look_at = [..] }, ... ]", "position = [0, 1, 4], look_at = [0, 1, 0] } ]")
        .replacen("\n# keyframes", "\nkeyframes", 1);
    assert!(bumpy != example && walking.contains("\nkeyframes = [ { time = 0.0, position = [0"), "the example changed");
    for text in [example, &bumpy, &walking] {
        std::fs::write(&path, text).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.instances.len(), 4, "{:?}", scene.notes);
    }
}

/// As any other value, and in a side file too.
#[test]
fn slips_in_operators_and_displays_have_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("q.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (line, key, guess) in
        [("operator = \"agz\"", "view.operator", "agx"), ("display = \"deskop\"", "view.display", "desktop")]
    {
        write("q.fechner.toml", &format!("[view]\n{line}\n"));
        let error = load(&folder.path().join("q.obj"), &LoadOptions::default()).unwrap_err().to_string();
        let expected = format!("\"{guess}\"");
        assert!(error.contains("q.fechner.toml:2:") && error.contains(key) && error.contains(&expected), "{error}");
    }
    write("q.fechner.toml", "[view]\noperator = \"agx\"\ndisplay = \"own.toml\"\n");
    load(&folder.path().join("q.obj"), &LoadOptions::default()).unwrap();
}

/// A lamp of 400 cd straight down, 200 cd at 60°, and more towards C = 90°.
const LAMP: &str = "IESNA:LM-63-2002\n[TEST] made up\nTILT=NONE\n1 -1 2 3 5 1 2 0 0 0\n1 1 20\n0 60 90\n\
                    0 90 180 270 360\n200 100 0\n200 140 0\n200 100 0\n200 60 0\n200 100 0\n";

/// A scene under photometric lamps in a folder with their file, at a time in seconds.
fn under_lamps(lamps: &str, seconds: f64) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(folder.path().join("lamp.ies"), LAMP).unwrap();
    std::fs::write(folder.path().join("dark.ies"), LAMP.replace(" 2 3 5", " 1e-60 3 5")).unwrap();
    std::fs::write(folder.path().join("negative.ies"), LAMP.replace("140", "-140")).unwrap();
    std::fs::write(folder.path().join("broken.ies"), LAMP.replace("140", "bright")).unwrap();
    std::fs::write(&path, format!("nits_per_unit = 10\n{}{lamps}", square("type = \"mirror\""))).unwrap();
    let options = LoadOptions { frame_time: seconds, ..LoadOptions::default() };
    let own = |text: String| text.replace(&format!("{}/", folder.path().display()), "");
    let mut scene = load(&path, &options).map_err(|error| own(error.to_string()))?;
    scene.notes = scene.notes.into_iter().map(own).collect();
    Ok(scene)
}

/// What a photometric lamp gives in cd in a direction of the world, by channel.
fn candela(scene: &Scene, lamp: usize, direction: Vec3) -> Vec3 {
    let Light::Photometric { from_world, web, per_candela, .. } = &scene.lights[lamp] else {
        panic!("{:?}", scene.lights)
    };
    *per_candela * web.intensity_cd(*from_world * direction.normalize()) * scene.nits_per_unit as f32
}

#[test]
fn photometric_lamps_have_the_candela_of_their_file() {
    let lamp = "[[lights]]\ntype = \"photometric\"\nfile = \"lamp.ies\"\nposition = [0, 3, 0]\n";
    let of = |keys: &str| under_lamps(&format!("{lamp}{keys}"), 0.5).unwrap_or_else(|error| panic!("{keys}: {error}"));
    let near = |found: Vec3, expected: Vec3, what: &str| {
        assert!((found - expected).abs().max_element() < 2e-4 * expected.max_element(), "{what}: {found} {expected}");
    };
    let (sin, cos) = 60f32.to_radians().sin_cos();
    let (ahead, right) = (Vec3::new(0.0, -cos, -sin), Vec3::new(sin, -cos, 0.0));
    for (keys, direction, expected) in [
        ("", Vec3::NEG_Y, 400.0),
        ("", right, 200.0),
        ("", ahead, 280.0),
        ("rotation_deg = 90", ahead, 200.0),
        ("rotation_deg = -90", right, 280.0),
        ("scale = 0.5", ahead, 140.0),
        ("direction = [1, 0, 0]", Vec3::X, 400.0),
        ("target = [2, 3, 0]", Vec3::X, 400.0),
        // Sideways, C = 0 is up and C = 90° to the right of who looks along.
        ("target = [2, 3, 0]", Vec3::new(cos, 0.0, -sin), 280.0),
        ("target = [2, 3, 0]", Vec3::new(cos, sin, 0.0), 200.0),
        ("keyframes = [ { time = 0, rotation_deg = 0 }, { time = 1, rotation_deg = -180 } ]", right, 280.0),
        ("keyframes = [ { time = 0, scale = 0 }, { time = 1, scale = 2 } ]", ahead, 280.0),
    ] {
        near(candela(&of(keys), 0, direction), Vec3::splat(expected), keys);
    }
    // A colour keeps the candela; lumen are those of the whole web.
    let red = of("color = [1, 0, 0]");
    near(candela(&red, 0, ahead), Vec3::X * 280.0 / 0.2126, "red");
    let Light::Photometric { web, .. } = &red.lights[0] else { panic!("{:?}", red.lights) };
    let dimmed = of("power_lm = 100");
    near(candela(&dimmed, 0, ahead), Vec3::splat(280.0 * 100.0 / web.flux_lm() as f32), "lumen");
    // By the trapezoids of each plane: their mean is that of C = 0. ∫ sin: 400 to 200 cd until 60°, to 0 until 90°.
    let (sin, angle) = (f64::from(sin), std::f64::consts::FRAC_PI_3);
    let expected =
        std::f64::consts::TAU * (400.0 - 200.0 * 0.5 - 200.0 * sin / angle + 200.0 * 0.5 - 400.0 * (1.0 - sin) / angle);
    assert!((web.flux_lm() / expected - 1.0).abs() < 1e-6, "{} {expected}", web.flux_lm());
    // Lamps of one kind share their web.
    let two = of(lamp);
    let [Light::Photometric { web: a, .. }, Light::Photometric { web: b, .. }] = &two.lights[..] else { panic!() };
    assert!(std::sync::Arc::ptr_eq(a, b));
    assert_ne!(content_hash(&of("")), content_hash(&of("rotation_deg = 1")));
    let negative = under_lamps(&lamp.replace("lamp.ies", "negative.ies"), 0.0).unwrap();
    assert_eq!(negative.notes[0], "negative.ies:9: intensities below 0 are taken as 0.");
}

#[test]
fn slips_in_photometric_lamps_are_told() {
    let lamp = "[[lights]]\ntype = \"photometric\"\nposition = [0, 3, 0]\n";
    for (keys, expected) in [
        ("", "s.toml:7: lights[0]: \"file\" is missing"),
        ("file = \"none.ies\"", "s.toml:10: none.ies: no such file"),
        ("file = \"s.toml\"", "s.toml:10: s.toml: no line TILT=NONE"),
        ("file = \"broken.ies\"", "s.toml:10: broken.ies:9: expected 5 times 3 intensities, found \"bright\""),
        (
            "file = \"lamp.ies\"\nrotaton_deg = 1",
            "unknown key \"rotaton_deg\" in lights[0]; did you mean \"rotation_deg\"?",
        ),
        ("file = \"lamp.ies\"\nintensity_cd = 1", "unknown key \"intensity_cd\""),
        ("file = \"lamp.ies\"\nscale = 1\npower_lm = 1", "\"power_lm\" and \"scale\" exclude each other"),
        ("file = \"lamp.ies\"\nscale = -1", "lights[0].scale: must be at least 0, not -1"),
        ("file = \"dark.ies\"\npower_lm = 1", "lights[0].power_lm: a file without any light cannot be scaled to it"),
        ("file = \"lamp.ies\"\ntarget = [0, 3, 0]", "lights[0].target: is the light's own position"),
        ("file = \"lamp.ies\"\ncolor = 0", "lights[0].color: a colour of light must not be black"),
    ] {
        let message = under_lamps(&format!("{lamp}{keys}\n"), 0.0).expect_err(keys);
        assert!(message.contains(expected), "{keys}: {message}");
    }
    let message = under_lamps(&lamp.replace("photometric", "photmetric"), 0.0).unwrap_err();
    assert!(message.contains("did you mean \"photometric\"?"), "{message}");
}

/// A file that somebody has only begun says nothing.
#[test]
fn an_empty_side_file_adds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("q.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let hash = || content_hash(&load(&folder.path().join("q.obj"), &LoadOptions::default()).unwrap());
    let alone = hash();
    std::fs::write(folder.path().join("q.fechner.toml"), "").unwrap();
    assert_eq!(hash(), alone);
    std::fs::write(folder.path().join("q.fechner.toml"), "[environment]\nluminance_cd_m2 = 7\n").unwrap();
    assert_ne!(hash(), alone);
}
