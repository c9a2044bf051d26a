//! What pbrt's files mean.

use crate::support::{has_note, write_and_load};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, FilmDefaults, Light, Parametrisation, Projection, Scene, ScreenWindow, Surface};
use fechner_perception::eotf::srgb_to_linear;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::path::Path;

const SQUARE: &str =
    r#"Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] "#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let half = image::GrayImage::from_pixel(2, 2, image::Luma([128]));
    half.save(folder.path().join("grey.png")).unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([0, 255, 255])).save(folder.path().join("cyan.png")).unwrap();
    let leaf = image::RgbaImage::from_fn(4, 2, |x, _| image::Rgba([0, 255, 0, if x < 1 { 255 } else { 0 }]));
    for name in ["leaf.png", "leaf.tga"] {
        leaf.save(folder.path().join(name)).unwrap();
    }
    folder
}

fn try_load(folder: &Path, head: &str, world: &str) -> Result<Scene, String> {
    let film = r#"Film "rgb" "integer xresolution" 32 "integer yresolution" 32"#;
    let text = format!("{head} {film} WorldBegin LightSource \"infinite\"\n{world}\n");
    write_and_load(&folder.join("scene.pbrt"), text)
}

fn scene(head: &str, world: &str) -> Scene {
    try_load(folder().path(), head, world).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn inner_attributes_win_and_wrong_ones_are_refused() {
    let inner = r#"Attribute "shape" "float radius" 0.3 AttributeBegin Attribute "shape" "float radius" 2 Shape "sphere" AttributeEnd"#;
    assert_eq!(scene("", inner).spheres[0].radius, 2.0);
    let wrong = try_load(folder().path(), "", r#"Attribute "shapes" "float radius" 2"#).unwrap_err();
    assert!(wrong.contains(r#"scene.pbrt:2: Attribute "shapes"; did you mean "shape"?"#), "{wrong}");
}

/// pbrt looks for objects when it has read everything.
#[test]
fn objects_may_be_placed_before_they_are_there() {
    let object = r#"ObjectBegin "a" Shape "sphere" "float radius" 0.3 ObjectEnd"#;
    let place = r#"AttributeBegin Translate 1 2 3 ObjectInstance "a" AttributeEnd"#;
    let placed = |world: &str| scene("", world).instances[0].to_world;
    assert_eq!(placed(&format!("{place} {object}")), placed(&format!("{object} {place}")));
    let unknown = try_load(folder().path(), "", &format!("{place} ObjectBegin \"b\" ObjectEnd")).unwrap_err();
    assert!(unknown.contains(r#"scene.pbrt:2: there is no object "a"; did you mean "b"?"#), "{unknown}");
}

/// Dropped without a word, the picture was brighter than pbrt's.
#[test]
fn a_film_that_limits_samples_is_told() {
    let folder = folder();
    let load = |limit: &str| {
        let text =
            format!("Camera \"perspective\" Film \"rgb\" {limit} WorldBegin LightSource \"infinite\"\n{SQUARE}\n");
        write_and_load(&folder.path().join("scene.pbrt"), text).unwrap_or_else(|error| panic!("{error}"))
    };
    assert!(has_note(&load(r#""float maxcomponentvalue" 10"#), "--clamp 10 "));
    assert!(!has_note(&load(""), "maxcomponentvalue"));
}

/// pbrt knows four colour spaces; of those that are not ours a note tells.
#[test]
fn colour_spaces_are_told_and_unknown_ones_refused() {
    for (name, told) in [("srgb", false), ("rec2020", true), ("dci-p3", true), ("aces2065-1", true)] {
        let scene = scene("", &format!("ColorSpace \"{name}\" {SQUARE}"));
        assert_eq!(scene.notes.iter().any(|note| note.contains("are taken for Rec.709")), told, "{name}");
    }
    let wrong = try_load(folder().path(), "", &format!("ColorSpace \"foo\" {SQUARE}")).unwrap_err();
    assert!(wrong.contains("scene.pbrt:2: unknown colour space \"foo\": srgb, rec2020"), "{wrong}");
}

/// pbrt-v4 has a name and one value; a list of parameters was all that was read.
#[test]
fn options_are_a_name_and_a_value() {
    for (option, told) in [
        (r#""seed" 0"#, "\"seed\""),
        (r#""disablepixeljitter" true"#, "\"disablepixeljitter\""),
        (r#""rendercoordsys" "world""#, "\"rendercoordsys\""),
        (r#""bool disablepixeljitter" true"#, "\"bool disablepixeljitter\""),
    ] {
        let scene = scene(&format!("Option {option}"), SQUARE);
        let is_told = |note: &String| note.ends_with(&format!("scene.pbrt:1: Option: not used: {told}."));
        assert!(scene.notes.iter().any(is_told), "{option}: {:?}", scene.notes);
    }
    let wrong = try_load(folder().path(), "Option \"seed\"", SQUARE).unwrap_err();
    assert!(wrong.contains("scene.pbrt:1: expected a value, found Film"), "{wrong}");
}

/// What is read but not rendered is told, of textures, media and lights as well: `power` made distant lights as many
/// times as bright.
#[test]
fn what_is_not_rendered_is_told() {
    let texture = r#"Texture "t" "spectrum" "constant" "float valu" 1 Material "diffuse" "texture reflectance" "t""#;
    for (directives, told) in [
        (texture, r#"texture "t": not used: "float valu"."#),
        (r#"MakeNamedMedium "m" "rgb sigma_s" [0 0 0] "rgb Le" [5 5 5]"#, r#"medium "m": not used: "rgb Le"."#),
        (r#"LightSource "distant" "float power" 10"#, r#"light "distant": not used: "float power"."#),
        (
            r#"Material "diffusetransmission" "rgb reflectance" [0.8 0.2 0.1] "rgb transmittance" [0.8 0.2 0.1]"#,
            "make light together, [1.6, 0.4, 0.2]: both are scaled down to 1 in each such channel.",
        ),
        (
            r#"MakeNamedMedium "m" "rgb sigma_s" [0 0 0] MediumInterface "" "m" ReverseOrientation"#,
            "the medium outside of a reversed shape is not rendered.",
        ),
        (
            r#"MakeNamedMedium "m" "rgb sigma_s" [0 0 0] MediumInterface "" "m" Scale -1 1 1 Shape "disk""#,
            "the medium outside of a reversed shape is not rendered.",
        ),
    ] {
        let scene = scene("", &format!("{directives} {SQUARE}"));
        assert!(scene.notes.iter().any(|note| note.ends_with(told)), "{directives}: {:?}", scene.notes);
    }
}

/// pbrt's "glass-F5" is Schott's SF5, of 1.6727 and not of 1.6034.
#[test]
fn glasses_go_by_pbrts_names() {
    for (name, ior) in [("BK7", 1.5168), ("F5", 1.6727), ("F10", 1.7283), ("F11", 1.7847)] {
        let scene = scene("", &format!(r#"Material "dielectric" "spectrum eta" "glass-{name}" {SQUARE}"#));
        let found = scene.materials.iter().find_map(|material| match material.surface {
            Surface::Dielectric { ior, .. } => Some(ior),
            _ => None,
        });
        assert!(found.is_some_and(|found| (found - ior).abs() < 1e-4), "{name}: {found:?}");
    }
}

#[test]
fn imports_keep_their_state_to_themselves() {
    let folder = folder();
    std::fs::write(folder.path().join("part.pbrt"), "Translate 5 0 0\n").unwrap();
    for (directive, x) in [("Import", 0.0), ("Include", 5.0)] {
        let scene = try_load(folder.path(), "", &format!(r#"{directive} "part.pbrt" Shape "sphere""#)).unwrap();
        assert_eq!(scene.spheres[0].center.x, x, "{directive}");
    }
}

/// Version 4 reads `TransformBegin` as `AttributeBegin`: material, light, orientation and active transforms ended
/// with the file.
#[test]
fn transform_blocks_keep_their_whole_state_to_themselves() {
    for block in ["Attribute", "Transform"] {
        let inside = r#"Translate 5 0 0 ReverseOrientation Material "diffuse" "rgb reflectance" [1 0 0]
AreaLightSource "diffuse" "rgb L" [9 9 9] ActiveTransform EndTime"#;
        let scene = scene("", &format!(r#"{block}Begin {inside} {block}End Translate 1 0 0 Shape "sphere""#));
        let ball = &scene.spheres[0];
        let material = &scene.materials[ball.material.0 as usize];
        let Surface::Diffuse { reflectance } = &material.surface else { panic!("diffuse") };
        assert_eq!((ball.center, ball.motion.is_none()), (Vec3::X, true), "{block}");
        assert_eq!((reflectance.factor, material.emission.factor), (Vec3::splat(0.5), Vec3::ZERO), "{block}");
    }
    let wrong = try_load(folder().path(), "", "TransformEnd").unwrap_err();
    assert!(wrong.contains("scene.pbrt:2: TransformEnd without AttributeBegin"), "{wrong}");
}

#[test]
fn files_of_version_3_are_told_what_to_do() {
    let old = try_load(folder().path(), "", &format!(r#"Material "matte" {SQUARE}"#)).unwrap_err();
    assert!(
        old.ends_with("\"matte\" of pbrt-v3: `pbrt --upgrade` writes the file for version 4, which is read"),
        "{old}"
    );
    let old =
        try_load(folder().path(), "", r#"Texture "t" "color" "imagemap" "string filename" "grey.png""#).unwrap_err();
    assert!(old.contains("texture \"t\" is of \"color\" of pbrt-v3: `pbrt --upgrade`"), "{old}");
}

/// The shorter side of the whole film spans [−1, 1] at every size of the picture; only what the file states is
/// stretched.
#[test]
fn pictures_of_another_size_have_square_pixels() {
    let folder = folder();
    let path = folder.path().join("scene.pbrt");
    let window = |camera: &str, film: &str, width: u32, height: u32| {
        let film = format!(r#"Film "rgb" "integer xresolution" 32 "integer yresolution" 32 {film}"#);
        std::fs::write(&path, format!("{film} {camera} WorldBegin LightSource \"infinite\" {SQUARE}")).unwrap();
        let options = LoadOptions { film: Some(FilmDefaults { width, height }), ..LoadOptions::default() };
        let window = load(&path, &options).unwrap().camera.screen_window.unwrap();
        [window.min.x, window.max.x, window.min.y, window.max.y]
    };
    let (camera, crop) = (r#"Camera "perspective""#, r#""float cropwindow" [0.25 0.75 0 0.5]"#);
    assert_eq!(window(camera, crop, 16, 16), [-0.5, 0.5, 0.0, 1.0]);
    assert_eq!(window(camera, crop, 64, 32), [-1.0, 1.0, 0.0, 1.0]);
    assert_eq!(window(camera, crop, 16, 32), [-0.5, 0.5, 0.0, 2.0]);
    assert_eq!(window(camera, "", 16, 32), [-1.0, 1.0, -2.0, 2.0]);
    let stated = r#"Camera "perspective" "float screenwindow" [-1 2 -1 1]"#;
    assert_eq!(window(stated, "", 16, 32), [-1.0, 2.0, -1.0, 1.0]);
}

/// Bounds in pixels are as many pixels as they say, at every place.
#[test]
fn pixel_bounds_are_exact() {
    let folder = folder();
    let path = folder.path().join("scene.pbrt");
    for (bounds, width, height) in
        [("241 273 69 101", 32, 32), ("0 5000 0 1080", 1920, 1080), ("-7 1 -1 2", 1, 2), ("1919 1920 1079 1080", 1, 1)]
    {
        let film = r#"Film "rgb" "integer xresolution" 1920 "integer yresolution" 1080 "integer pixelbounds""#;
        std::fs::write(&path, format!("{film} [{bounds}] WorldBegin LightSource \"infinite\" {SQUARE}")).unwrap();
        let scene = load(&path, &LoadOptions::default()).unwrap();
        assert_eq!(scene.film, FilmDefaults { width, height }, "{bounds}");
    }
}

#[test]
fn frames_and_scales_change_what_the_camera_sees() {
    let camera = |head: &str| scene(head, SQUARE).camera;
    let window = |x: f32, y: f32| Some(ScreenWindow { min: -Vec2::new(x, y), max: Vec2::new(x, y) });
    let usual = camera(r#"LookAt 1 2 4 0 0 0 0 1 0 Camera "perspective""#);
    assert_eq!(usual.screen_window, None);
    assert_eq!(camera(r#"Camera "perspective" "float frameaspectratio" 2"#).screen_window, window(2.0, 1.0));
    assert_eq!(camera(r#"Scale 0.5 0.5 1 Camera "orthographic""#).screen_window, window(2.0, 2.0));
    assert_eq!(camera(r#"Scale 0.5 1 1 Camera "perspective""#).screen_window, window(2.0, 1.0));
    let lens = camera(r#"Scale 2 2 2 Camera "perspective" "float lensradius" 0.8 "float focaldistance" 16"#);
    assert_eq!((lens.screen_window, lens.aperture_radius, lens.focus_distance), (None, 0.4, 8.0));
    assert_eq!(lens.projection, Projection::Perspective { vertical_fov_deg: 90.0 });
}

#[test]
fn pictures_are_scaled_before_they_are_inverted() {
    let texture = r#"Texture "q" "spectrum" "imagemap" "string filename" "grey.png" "bool invert" true "float scale" 0.5
"string encoding" "linear" Material "diffuse" "texture reflectance" "q" "#;
    let scene = scene("", &format!("{texture}{SQUARE}"));
    let Surface::Diffuse { reflectance } = &scene.materials[0].surface else { panic!("diffuse") };
    let seen = reflectance.evaluate(&scene.textures, Vec2::splat(0.5)).x;
    assert!((seen - (1.0 - 0.5 * 128.0 / 255.0)).abs() < 1e-6, "{seen}");
}

/// The colour of a diffuse surface at a place, and its scene.
fn reflectance(textures: &str, at: Vec2) -> (Vec3, Scene) {
    let scene = scene("", &format!("{textures} Material \"diffuse\" \"texture reflectance\" \"t\" {SQUARE}"));
    let Surface::Diffuse { reflectance } = &scene.materials[0].surface else { panic!("diffuse") };
    (reflectance.evaluate(&scene.textures, at), scene)
}

const PICTURES: &str = r#"Texture "cyan" "spectrum" "imagemap" "string filename" "cyan.png"
Texture "share" "float" "imagemap" "string filename" "cyan.png" "#;

/// pbrt-v4 warns and goes on without the light.
#[test]
fn what_is_not_there_does_not_shine() {
    let light = r#"AreaLightSource "diffuse" "rgb L" [9 9 9]"#;
    let scene = scene("", &format!("{SQUARE} {light} Material \"interface\" {SQUARE}"));
    assert_eq!(scene.instances.len(), 1);
    assert!(scene.materials.iter().all(|material| material.emission.factor == Vec3::ZERO));
    assert!(scene.notes.iter().any(|note| note.contains("\"interface\" do not shine")), "{:?}", scene.notes);
}

/// pbrt's `MIPMap::Bilerp<Float>`: alpha, or the mean of three channels. It was the red one.
#[test]
fn a_number_of_a_picture_is_its_alpha_or_its_mean() {
    let alpha = |file: &str| {
        let texture = format!("Texture \"a\" \"float\" \"imagemap\" \"string filename\" \"{file}\" ");
        let scene = scene("", &format!("{texture} {SQUARE} \"texture alpha\" \"a\""));
        let (Alpha::Mask { value, .. } | Alpha::Blend { value }) = scene.materials[0].alpha else { panic!("no alpha") };
        [0.125, 0.625].map(|u| value.evaluate(&scene.textures, Vec2::new(u, 0.5)))
    };
    assert_eq!(alpha("leaf.png"), [1.0, 0.0]);
    assert!(alpha("cyan.png").iter().all(|share| (share - 2.0 / 3.0).abs() < 1e-6), "{:?}", alpha("cyan.png"));
    let grey = srgb_to_linear(128.0 / 255.0);
    assert!(alpha("grey.png").iter().all(|share| (share - grey).abs() < 1e-4), "{:?}", alpha("grey.png"));
}

/// pbrt's `Image::Read` takes all but PNG and light for sRGB and drops their alpha.
#[test]
fn pictures_that_pbrt_leaves_to_stb_are_srgb_without_alpha() {
    let folder = folder();
    for name in ["grey.tga", "grey.bmp"] {
        image::GrayImage::from_pixel(2, 2, image::Luma([128])).save(folder.path().join(name)).unwrap();
    }
    let alpha = |picture: &str| {
        let texture = format!("Texture \"a\" \"float\" \"imagemap\" \"string filename\" {picture} ");
        let world = format!("{texture} {SQUARE} \"texture alpha\" \"a\"");
        let scene = try_load(folder.path(), "", &world).unwrap_or_else(|error| panic!("{error}"));
        let (Alpha::Mask { value, .. } | Alpha::Blend { value }) = scene.materials[0].alpha else { panic!("no alpha") };
        value.evaluate(&scene.textures, Vec2::new(0.625, 0.5))
    };
    let grey = srgb_to_linear(128.0 / 255.0);
    for (picture, expected) in [
        (r#""leaf.png""#, 0.0),
        (r#""leaf.tga""#, 1.0 / 3.0),
        (r#""grey.png" "string encoding" "linear""#, 128.0 / 255.0),
        (r#""grey.tga" "string encoding" "linear""#, grey),
        (r#""grey.bmp" "string encoding" "gamma 1.5""#, grey),
    ] {
        assert!((alpha(picture) - expected).abs() < 1e-4, "{picture}: {}, not {expected}", alpha(picture));
    }
}

/// What has no place for a picture takes its mean; it took 1.
#[test]
fn pictures_inside_others_count_by_their_mean() {
    let note = |scene: &Scene, text: &str| scene.notes.iter().any(|note| note.contains(text));
    let first_square = Vec2::new(0.25, 0.25);
    let board = r#"Texture "t" "spectrum" "checkerboard" "texture tex1" "cyan" "texture tex2" "cyan" "#;
    let (color, scene) = reflectance(&format!("{PICTURES}{board}"), first_square);
    assert_eq!(color, Vec3::new(0.0, 1.0, 1.0));
    assert!(note(&scene, "textures inside a checkerboard: their mean colours"), "{:?}", scene.notes);

    let product = r#"Texture "t" "spectrum" "scale" "texture tex" "cyan" "texture scale" "share" "#;
    let (color, scene) = reflectance(&format!("{PICTURES}{product}"), first_square);
    assert!(color.abs_diff_eq(Vec3::new(0.0, 2.0, 2.0) / 3.0, 1e-6), "{color}");
    assert!(note(&scene, "its scale's texture: its mean"), "{:?}", scene.notes);

    // A colour times a picture of numbers is exact.
    let tinted = r#"Texture "t" "spectrum" "scale" "rgb tex" [0.3 0.6 0.9] "texture scale" "share" "#;
    let (color, scene) = reflectance(&format!("{PICTURES}{tinted}"), first_square);
    assert!(color.abs_diff_eq(Vec3::new(0.2, 0.4, 0.6), 1e-6), "{color}");
    assert!(!note(&scene, "mean"), "{:?}", scene.notes);

    let mix = r#"Texture "t" "spectrum" "mix" "rgb tex1" [0 0 0] "rgb tex2" [0.9 0.6 0.3] "texture amount" "share" "#;
    let (color, scene) = reflectance(&format!("{PICTURES}{mix}"), first_square);
    assert!(color.abs_diff_eq(Vec3::new(0.6, 0.4, 0.2), 1e-6), "{color}");
    assert!(note(&scene, "its amount's texture: its mean"), "{:?}", scene.notes);
}

/// What ends at 1 is a picture times its scale: the scale was cut to 1 first.
#[test]
fn pictures_may_be_scaled_by_more_than_1() {
    let picture =
        r#"Texture "dark" "float" "imagemap" "string filename" "grey.png" "string encoding" "linear" "float scale" "#;
    let doubled = r#"Texture "t" "float" "scale" "texture tex" "dark" "float scale" 1.5 "#;
    for (textures, name) in [(format!("{picture} 1.5"), "dark"), (format!("{picture} 1 {doubled}"), "t")] {
        let scene = scene("", &format!("{textures} Material \"conductor\" \"texture roughness\" \"{name}\" {SQUARE}"));
        let Surface::Conductor { roughness, .. } = &scene.materials[0].surface else { panic!("a metal") };
        let seen = roughness.u.evaluate(&scene.textures, Vec2::splat(0.5));
        assert!((seen - 1.5 * 128.0 / 255.0).abs() < 1e-6, "{seen}");
    }
    let sheet = r#"Material "diffusetransmission" "rgb reflectance" [0.2 0.2 0.2] "float scale" 2"#;
    let sheet = scene("", &format!("{sheet} {SQUARE}")).materials.remove(0).surface;
    assert!(matches!(sheet, Surface::DiffuseTransmission { reflectance, .. } if reflectance.factor.x == 0.4));
}

/// A metal's picture was ignored, and its factor of 1 a perfect mirror.
#[test]
fn a_metals_picture_is_what_it_reflects() {
    let dark = r#"Texture "t" "spectrum" "imagemap" "string filename" "grey.png" "string encoding" "linear" "#;
    let board = r#"Texture "t" "spectrum" "checkerboard" "rgb tex1" [0.2 0.4 0.6] "rgb tex2" [0.1 0.2 0.3] "#;
    // 2 sqrt(r) / sqrt(1 - r) of the brightest texel.
    let face_on = |k: f32| k * k / (4.0 + k * k);
    for (texture, expected) in [(dark, Vec3::splat(128.0 / 255.0)), (board, Vec3::new(0.2, 0.4, 0.6))] {
        let scene = scene("", &format!("{texture} Material \"conductor\" \"texture reflectance\" \"t\" {SQUARE}"));
        let Surface::Conductor { eta, k, tint, .. } = &scene.materials[0].surface else { panic!("a metal") };
        let seen = tint.evaluate(&scene.textures, Vec2::splat(0.25)) * k.map(face_on);
        assert!(*eta == Vec3::ONE && seen.abs_diff_eq(expected, 1e-5), "{seen}, not {expected}");
        assert!(scene.notes.iter().any(|note| note.contains("textured reflectance")), "{:?}", scene.notes);
    }
    let coated = scene("", &format!("{board} Material \"coatedconductor\" \"texture reflectance\" \"t\" {SQUARE}"));
    let Surface::CoatedConductor { k, .. } = &coated.materials[0].surface else { panic!("a coated metal") };
    assert!(k.map(face_on).abs_diff_eq(Vec3::new(0.15, 0.3, 0.45), 1e-5), "{k}");
}

#[test]
fn a_whole_disk_has_pbrts_coordinates() {
    let mesh = &scene("", r#"Shape "disk" "float radius" 2 "float height" 1"#).meshes[0];
    let up = mesh.positions.iter().position(|p| p.abs_diff_eq(Vec3::new(0.0, 2.0, 1.0), 1e-5)).unwrap();
    // A quarter turn, v = 0 at the rim; our v runs the other way.
    assert!(mesh.uvs[up].abs_diff_eq(Vec2::new(0.25, 1.0), 1e-6), "{}", mesh.uvs[up]);
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Facing {
    AsMade,
    TurnedOver,
}

/// Where the front of the only shape is, in its own coordinates: spheres, disks and cylinders are made to face
/// outwards or up.
fn facing(scene: &Scene) -> Facing {
    let Some(instance) = scene.instances.first() else { return Facing::AsMade };
    let mesh = &scene.meshes[instance.mesh.0 as usize];
    let as_made = mesh.triangles.iter().filter(|triangle| {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        (b - a).cross(c - a).dot(a + b + c) > 0.0
    });
    match as_made.count() {
        0 => Facing::TurnedOver,
        count if count == mesh.triangles.len() => Facing::AsMade,
        count => panic!("{count} of {} triangles face outwards", mesh.triangles.len()),
    }
}

/// pbrt's `Sphere`, `Disk` and `Cylinder::InteractionFromIntersection`; shapes that move have its `identity` for a
/// transform.
#[test]
fn mirroring_turns_quadrics_over_and_no_mesh() {
    use Facing::{AsMade, TurnedOver};
    let glass = r#"Material "dielectric""#;
    let light = r#"AreaLightSource "diffuse" "rgb L" [1 1 1]"#;
    let mesh = r#"Shape "trianglemesh" "point3 P" [0 0 1 1 0 1 0 1 1]"#;
    for (change, quadric, of_mesh) in [
        ("", AsMade, AsMade),
        ("Scale 2 1 1", AsMade, AsMade),
        ("ReverseOrientation", TurnedOver, TurnedOver),
        ("Scale -1 1 1", TurnedOver, AsMade),
        ("ReverseOrientation Scale -1 1 1", AsMade, TurnedOver),
        ("Scale -1 1 1 Scale 1 -1 1", AsMade, AsMade),
        ("Scale -1 1 1 ActiveTransform EndTime Translate 1 0 0", AsMade, AsMade),
    ] {
        for kind in [
            r#""sphere""#,
            r#""sphere" "float zmax" 0.5"#,
            r#""disk" "float height" 1"#,
            r#""disk" "float height" 1 "float phimax" 90"#,
            r#""cylinder""#,
        ] {
            for surface in [glass, light] {
                assert_eq!(
                    facing(&scene("", &format!("{surface} {change} Shape {kind}"))),
                    quadric,
                    "{change}, {kind}"
                );
            }
        }
        assert_eq!(facing(&scene("", &format!("{glass} {change} {mesh}"))), of_mesh, "{change}");
    }
    // A front that does not show leaves it analytic.
    for (material, expected) in [(r#""diffuse""#, AsMade), (r#""diffuse" "string normalmap" "cyan.png""#, TurnedOver)] {
        assert_eq!(
            facing(&scene("", &format!("Scale -1 1 1 Material {material} Shape \"sphere\""))),
            expected,
            "{material}"
        );
    }
}

/// What a grid would have at a pole or in a disk's middle.
#[test]
fn curved_shapes_have_no_triangles_without_area() {
    for shape in [
        r#"Material "dielectric" ReverseOrientation Shape "sphere""#,
        r#"Shape "sphere" "float zmax" 0.5"#,
        r#"Shape "disk" "float phimax" 180"#,
    ] {
        let scene = scene("", shape);
        assert!(!scene.notes.iter().any(|note| note.contains("without area")), "{shape}: {:?}", scene.notes);
    }
}

#[test]
fn triangles_without_coordinates_have_pbrts() {
    let texture = r#"Texture "q" "spectrum" "imagemap" "string filename" "grey.png" Material "diffuse" "texture reflectance" "q" "#;
    let textured = scene("", &format!("{texture}{SQUARE}"));
    assert_eq!(textured.meshes[0].uvs[..3], [Vec2::Y, Vec2::ONE, Vec2::X]);
    assert!(scene("", SQUARE).meshes[0].uvs.is_empty());
}

/// pbrt looks names up once it has read the file, and what that includes.
#[test]
fn names_may_be_used_before_they_are_defined() {
    let folder = folder();
    let color = |world: &str| {
        let scene = try_load(folder.path(), "", world).unwrap_or_else(|error| panic!("{error}"));
        let Surface::Diffuse { reflectance } = &scene.materials[0].surface else { panic!("diffuse") };
        reflectance.factor
    };
    let expected = Vec3::new(0.2, 0.4, 0.6);
    let made = r#"MakeNamedMaterial "later" "string type" "diffuse" "rgb reflectance" [0.2 0.4 0.6]"#;
    let texture = r#"Texture "t" "spectrum" "constant" "rgb value" [0.2 0.4 0.6]"#;
    std::fs::write(folder.path().join("made.pbrt"), format!("AttributeBegin {made} AttributeEnd")).unwrap();
    for rest in [made, r#"Include "made.pbrt""#] {
        assert_eq!(color(&format!(r#"NamedMaterial "later" {rest} {SQUARE}"#)), expected);
        assert_eq!(color(&format!(r#"NamedMaterial "later" {SQUARE} {rest}"#)), expected);
    }
    assert_eq!(color(&format!(r#"Material "diffuse" "texture reflectance" "t" {SQUARE} {texture}"#)), expected);
    let medium = r#"MakeNamedMedium "wine" "rgb sigma_a" [1 2 3] "rgb sigma_s" [0 0 0]"#;
    let glass = r#"MediumInterface "wine" "" Material "dielectric""#;
    let wine = try_load(folder.path(), "", &format!("{glass} {SQUARE} {medium}")).unwrap();
    assert_eq!(wine.materials[0].surface.interior_absorption(), Some(Vec3::new(1.0, 2.0, 3.0)));
}

/// Each level names the one before twice: 2^30 look-ups if each were followed.
#[test]
fn textures_are_followed_once_each() {
    let mut world = r#"Texture "t0" "spectrum" "constant" "rgb value" [0.2 0.2 0.2] "#.to_owned();
    for level in 1..=30 {
        let last = level - 1;
        world += &format!(r#"Texture "t{level}" "spectrum" "mix" "texture tex1" "t{last}" "texture tex2" "t{last}" "#);
    }
    scene("", &format!(r#"{world} Material "diffuse" "texture reflectance" "t30" {SQUARE}"#));
}

#[test]
fn notes_of_many_lines_are_one() {
    let scene = scene("", &"Shape \"sphere\" \"float odd\" 1\n".repeat(3));
    let notes: Vec<&String> = scene.notes.iter().filter(|note| note.contains("odd")).collect();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].ends_with("\"float odd\" (and 2 more like it)."), "{notes:?}");
}

/// A goniometric light has the intensity that its picture has in a direction, y up in it, and so many lumen.
#[test]
fn goniometric_lights_shine_by_their_pictures() {
    let folder = folder();
    let size = 64u32;
    // 1 on the mean of the channels, brighter towards +x and up.
    let pattern = |d: Vec3| 1.0 + 0.5 * d.x + 0.25 * d.z;
    let texel = |x: u32, y: u32| {
        let uv = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / size as f32;
        image::Rgb([3.0 * pattern(Parametrisation::EqualArea.to_direction(uv)), 0.0, 0.0])
    };
    image::Rgb32FImage::from_fn(size, size, texel).save(folder.path().join("lamp.hdr")).unwrap();
    for (amount, per_unit) in [("\"float scale\" 8", 8.0), ("\"float power\" 100", 100.0 / (4.0 * PI))] {
        let light = format!(
            "Translate 0 3 0 Rotate 90 0 1 0 LightSource \"goniometric\" \"rgb I\" [1 1 1] {amount} \"string filename\" \"lamp.hdr\""
        );
        let scene = try_load(folder.path(), "", &format!("AttributeBegin {light} AttributeEnd {SQUARE}")).unwrap();
        let [Light::Photometric { position, from_world, web, per_candela }] = &scene.lights[..] else {
            panic!("{:?}", scene.lights)
        };
        assert_eq!(*position, Vec3::Y * 3.0);
        for direction in [Vec3::X, Vec3::NEG_Z, Vec3::Y, Vec3::new(0.6, -0.48, 0.64), Vec3::NEG_Y] {
            // pbrt's quarter turn about y takes its x to −z; the picture's z is up.
            let expected = per_unit * (1.0 - 0.5 * direction.z + 0.25 * direction.y);
            let found = per_candela.x * web.intensity_cd(*from_world * direction);
            assert!((found / expected - 1.0).abs() < 0.01, "{amount} {direction}: {found} {expected}");
        }
    }
}
