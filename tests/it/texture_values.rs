//! What the values of EXR pictures come to, as textures and as surroundings.

use exr::image::{AnyChannel, AnyChannels, FlatSamples, Image};
use exr::meta::attribute::Chromaticities;
use exr::prelude::{Vec2 as Pair, WritableImage};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Scene, Surface};
use glam::{Vec2, Vec3};
use std::path::Path;

/// Rec. ITU-R BT.2020-2, table 3.
const REC2020: Chromaticities = Chromaticities {
    red: Pair(0.708, 0.292),
    green: Pair(0.170, 0.797),
    blue: Pair(0.131, 0.046),
    white: Pair(0.3127, 0.3290),
};

/// Writes a picture of 2 × 2 pixels.
fn write(path: &Path, channels: &[(&str, [f32; 4])], chromaticities: Option<Chromaticities>) {
    let channel = |&(name, values): &(&str, [f32; 4])| AnyChannel::new(name, FlatSamples::F32(values.to_vec()));
    let mut image = Image::from_channels((2, 2), AnyChannels::sort(channels.iter().map(channel).collect()));
    image.attributes.chromaticities = chromaticities;
    image.write().to_file(path).unwrap();
}

fn even<'a>(channels: &[(&'a str, f32)]) -> Vec<(&'a str, [f32; 4])> {
    channels.iter().map(|&(name, value)| (name, [value; 4])).collect()
}

/// A scene with the picture `p.exr` around it, and a metal of which it is the colour and the roughness.
fn scene(channels: &[(&str, [f32; 4])], chromaticities: Option<Chromaticities>) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("p.exr"), channels, chromaticities);
    let path = folder.path().join("s.toml");
    let text = "[environment]\nimage = \"p.exr\"\n[textures.p]\nfile = \"p.exr\"\n[materials.m]\ntype = \"metal-roughness\"\n\
                base_color = { texture = \"p\" }\nroughness = { texture = \"p\", channel = \"g\" }\n\
                [[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n";
    std::fs::write(&path, text).unwrap();
    load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The surface's colour, its roughness and the radiance of the surroundings.
fn seen(scene: &Scene) -> (Vec3, f32, Vec3) {
    let Surface::MetalRoughness(model) = &scene.materials[0].surface else { panic!("a metal-roughness surface") };
    let middle = Vec2::splat(0.5);
    let (color, roughness) =
        (model.base_color.evaluate(&scene.textures, middle), model.roughness.evaluate(&scene.textures, middle));
    (color, roughness, scene.environment.as_ref().unwrap().radiance(Vec3::Y))
}

fn notes(scene: &Scene, text: &str) -> usize {
    scene.notes.iter().filter(|note| note.contains(text)).count()
}

/// Rec. ITU-R BT.2087-0 has the matrix; what is no colour stays.
#[test]
fn colours_of_other_primaries_are_brought_to_rec_709() {
    let wide = scene(&even(&[("R", 0.3), ("G", 0.5), ("B", 0.2)]), Some(REC2020));
    let expected = Vec3::new(
        1.6605 * 0.3 - 0.5876 * 0.5 - 0.0728 * 0.2,
        -0.1246 * 0.3 + 1.1329 * 0.5 - 0.0083 * 0.2,
        -0.0182 * 0.3 - 0.1006 * 0.5 + 1.1187 * 0.2,
    );
    let (color, roughness, around) = seen(&wide);
    assert!(color.abs_diff_eq(expected, 2e-3) && around.abs_diff_eq(expected, 2e-3), "{color} {around} {expected}");
    assert!((roughness - 0.5).abs() < 1e-6, "{roughness}");
    assert_eq!(
        notes(&wide, "p.exr: colours brought from the file's chromaticities to Rec.709."),
        2,
        "{:?}",
        wide.notes
    );
    let plain = scene(&even(&[("R", 0.3), ("G", 0.5), ("B", 0.2)]), None);
    assert_eq!((seen(&plain).0, notes(&plain, "p.exr")), (Vec3::new(0.3, 0.5, 0.2), 0));
}

/// Green of Rec.2020 is 0.678 of white. With its negative channels it was light that is taken away, with them cut off
/// 19 % too bright.
#[test]
fn colours_outside_rec_709_are_light_of_their_own_luminance() {
    let green = scene(&even(&[("R", 0.0), ("G", 1.0), ("B", 0.0)]), Some(REC2020));
    let (color, roughness, around) = seen(&green);
    for light in [color, around] {
        let luminance = light.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((luminance - 0.678).abs() < 1e-3 && light.min_element() >= 0.0, "{light}");
        assert!(light.max_element() <= 1.0, "a share of light: {light}");
    }
    assert_eq!(roughness, 1.0);
    // Numbers may be negative, heights among them.
    let mixed = scene(&[("R", [10.0, -0.5, -0.5, -0.5]), ("G", [-0.5; 4]), ("B", [1.0, -0.5, -0.5, -0.5])], None);
    assert_eq!((seen(&mixed).0.min_element(), seen(&mixed).1), (0.0, -0.5));
}

/// As Blender writes them: the first by the alphabet was taken.
#[test]
fn the_picture_of_many_layers_is_the_finished_one() {
    let (ao, combined) = ("ViewLayer.AO", "ViewLayer.Combined");
    let names = |layer: &str| ["R", "G", "B"].map(|part| format!("{layer}.{part}"));
    let layered = |first: &str, second: &str| {
        let (first, second) = (names(first), names(second));
        let mut channels: Vec<(&str, f32)> = first.iter().map(|name| (name.as_str(), 0.1)).collect();
        channels.extend(second.iter().map(String::as_str).zip([0.25, 0.5, 0.75]));
        scene(&even(&channels), None)
    };
    let light = Vec3::new(0.25, 0.5, 0.75);
    let blender = layered(ao, combined);
    assert_eq!((seen(&blender), notes(&blender, "is taken for")), ((light, 0.5, light), 0), "{:?}", blender.notes);
    let unsure = layered("one", "two");
    assert_eq!(
        (seen(&unsure).2, notes(&unsure, "the layer one is taken for the picture, of one, two")),
        (Vec3::splat(0.1), 2)
    );
    // A texture may be a layer that is no finished picture.
    assert_eq!(seen(&layered("normal", "albedo")).2, light);
    let small = scene(&even(&[("r", 0.25), ("g", 0.5), ("b", 0.75)]), None);
    assert_eq!(seen(&small), (light, 0.5, light));
    assert_eq!(seen(&scene(&even(&[("y", 0.25)]), None)).0, Vec3::splat(0.25));
}

/// RY = (R − Y) / Y; the picture was grey.
#[test]
fn luminance_and_chroma_and_xyz_are_colours() {
    let color = Vec3::new(0.4, 0.3, 0.1);
    let y = color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let chroma = scene(&even(&[("Y", y), ("RY", color.x / y - 1.0), ("BY", color.z / y - 1.0)]), None);
    assert!(seen(&chroma).0.abs_diff_eq(color, 1e-3), "{}", seen(&chroma).0);
    assert!((seen(&chroma).1 - y).abs() < 1e-6, "a roughness from luminance");
    let xyz = scene(&even(&[("X", 0.2903), ("Y", 0.3068), ("Z", 0.1385)]), None);
    assert!(seen(&xyz).0.abs_diff_eq(color, 2e-3), "{}", seen(&xyz).0);
    assert_eq!(seen(&scene(&even(&[("Y", 0.25)]), None)).0, Vec3::splat(0.25));
    assert_eq!(seen(&scene(&even(&[("beauty.Y", 0.25)]), None)).0, Vec3::splat(0.25));
}

/// Files of halves clip a sun to infinity: it was black.
#[test]
fn infinity_is_the_largest_half_and_what_is_no_number_is_nothing() {
    let halves = [f32::INFINITY; 4];
    let sun = scene(&[("R", halves), ("G", [f32::NAN; 4]), ("B", [f32::NEG_INFINITY; 4])], None);
    let environment = sun.environment.as_ref().unwrap();
    assert!(environment.texels.iter().all(|texel| *texel == Vec3::new(65_504.0, 0.0, 0.0)), "{:?}", environment.texels);
    let said = "p.exr: 12 values that are not finite were replaced: infinity by 65504, others by 0.";
    assert_eq!(notes(&sun, said), 2, "{:?}", sun.notes);
    // A picture of floats may be brighter than that.
    let bright = scene(&[("R", [1e6, 1.0, 1.0, f32::INFINITY]), ("G", [0.0; 4]), ("B", [0.0; 4])], None);
    assert_eq!(bright.environment.as_ref().unwrap().texels.last(), Some(&Vec3::new(1e6, 0.0, 0.0)));
}

/// It became black without a word. A colour outside Rec.709 is light for all its negative channels.
#[test]
fn light_below_zero_is_told() {
    let negative = scene(&[("R", [-1.0, 1.0, 1.0, -0.5]), ("G", [-1.0, 1.0, -0.1, -0.5]), ("B", [0.5; 4])], None);
    let said = "p.exr: luminance below 0 in 2 pixels was replaced by black.";
    assert_eq!(notes(&negative, said), 2, "{:?}", negative.notes);
    let wide = scene(&even(&[("R", 0.0), ("G", 1.0), ("B", 0.0)]), Some(REC2020));
    assert_eq!(notes(&wide, "luminance below 0"), 0, "{:?}", wide.notes);
}

#[test]
fn a_picture_without_blue_has_none() {
    let yellow = scene(&even(&[("R", 0.1), ("G", 0.2)]), None);
    assert_eq!(seen(&yellow), (Vec3::new(0.1, 0.2, 0.0), 0.2, Vec3::new(0.1, 0.2, 0.0)));
    assert_eq!(notes(&yellow, "no channel B"), 2, "{:?}", yellow.notes);
    assert_eq!(seen(&scene(&even(&[("R", 0.1)]), None)).0, Vec3::splat(0.1));
}

/// The colours of an EXR file are multiplied by its alpha, those of a PNG file are not. As a card, whose alpha says
/// where it is, both are what is there; as a colour alone they are as they stand.
#[test]
fn the_colours_of_a_card_are_not_multiplied_by_alpha_twice() {
    let folder = tempfile::tempdir().unwrap();
    // Covered by half, by nothing with a glow, by nothing, in full.
    let (alpha, light) = ([0.5, 0.0, 0.0, 1.0], [0.2, 0.3, 0.0, 0.4]);
    let channels = [("R", light), ("G", light), ("B", light), ("A", alpha)];
    write(&folder.path().join("p.exr"), &channels, None);
    let colors = |file: &str, text: &str| -> Vec<f32> {
        std::fs::write(folder.path().join(file), text).unwrap();
        let scene = load(&folder.path().join(file), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let color = scene.materials[0].surface.base_color().expect("a colour");
        let at = |[x, y]: [f32; 2]| color.evaluate(&scene.textures, Vec2::new(x, y)).x;
        [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]].map(at).to_vec()
    };
    let toml = |alpha: &str| {
        format!(
            "[environment]\nluminance_cd_m2 = 1\n[textures.p]\nfile = \"p.exr\"\nnearest = true\n[materials.m]\ntype = \"diffuse\"\n\
             reflectance = {{ texture = \"p\" }}\n{alpha}[[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"m\"\n"
        )
    };
    assert_eq!(colors("card.toml", &toml("alpha = { texture = \"p\", channel = \"a\" }\n")), [0.4, 0.3, 0.0, 0.4]);
    assert_eq!(colors("plain.toml", &toml("")), light);
    let quad = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";
    std::fs::write(folder.path().join("m.mtl"), "newmtl m\nillum 1\nmap_Kd p.exr\nmap_d p.exr\n").unwrap();
    assert_eq!(colors("card.obj", quad)[0], 0.4);
}

/// A Radiance picture of 2 × 1 pixels.
fn radiance(format: &str, resolution: &str, pixels: [[u8; 4]; 2]) -> Vec<u8> {
    let header = format!("#?RADIANCE\nFORMAT={format}\n\n{resolution}\n");
    [header.as_bytes(), pixels.as_flattened()].concat()
}

fn environment(bytes: &[u8]) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("p.hdr"), bytes).unwrap();
    let path = folder.path().join("s.toml");
    let text = "[environment]\nimage = \"p.hdr\"\n[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n\
                [materials.m]\ntype = \"diffuse\"\nreflectance = 0.5\n";
    std::fs::write(&path, text).unwrap();
    load(&path, &LoadOptions::default()).map_err(|error| error.to_string())
}

/// Radiance writes CIE XYZ as well, in its own primaries' white of equal energy, and rows in any order. What is not
/// read is said to be not read, not to be damaged.
#[test]
fn radiance_pictures_of_other_kinds_are_told_apart() {
    let grey = [[128, 128, 128, 128], [64, 64, 64, 128]];
    let plain = environment(&radiance("32-bit_rle_rgbe", "-Y 1 +X 2", grey)).expect("read").environment.unwrap();
    let xyz = environment(&radiance("32-bit_rle_xyze", "-Y 1 +X 2", grey)).expect("read").environment.unwrap();
    for (plain, xyz) in plain.texels.iter().zip(xyz.texels.iter()) {
        assert!(plain.abs_diff_eq(*xyz, 1e-3), "{plain} and {xyz}: equal energy is white");
    }
    for (resolution, what) in [("+Y 1 +X 2", "+Y +X"), ("-Y 1 -X 2", "-Y -X"), ("+X 2 -Y 1", "+X -Y")] {
        let error = environment(&radiance("32-bit_rle_rgbe", resolution, grey)).unwrap_err();
        assert!(error.contains(&format!("Orientation {what}")) && error.contains("not read"), "{error}");
    }
}
