//! `fechner compare` and `tonemap` heed what a picture's file says of its unit, its curve and its colours.

use crate::displayed::{SIDE, fechner, random, run, visibility, write};
use crate::support::pictures::mean;
use fechner::output::{Attribute, NITS_PER_UNIT, Picture, write_exr};
use fechner_perception::display::Eotf;
use fechner_perception::primaries::{Primaries, apply};

/// A file's own unit stands, and the argument is for those without.
#[test]
fn the_unit_is_for_files_that_do_not_say_theirs() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "own.exr", |pixel| [10.0 + pixel as f32 / 100.0; 3]);
    let mut other = Picture::new(SIDE as u32, SIDE as u32);
    for name in ["R", "G", "B"] {
        let of = |pixel| (10.0 + pixel as f32 / 100.0) / 25.0;
        other.push_f32(name, (0..SIDE * SIDE).map(of).collect::<Vec<_>>());
    }
    write_exr(&folder.path().join("other.exr"), &other).expect("written");
    let (_, said) = fechner(folder.path(), &["compare", "own.exr", "other.exr", "--nits-per-unit", "25"]);
    assert!(visibility(&said) < 0.01 && said.contains("note: own.exr: its own unit of 1 cd/m"), "{said}");
    other.push_attribute(NITS_PER_UNIT, Attribute::Float(1e30));
    write_exr(&folder.path().join("other.exr"), &other).expect("written");
    let (_, said) = fechner(folder.path(), &["compare", "own.exr", "other.exr", "--nits-per-unit", "25"]);
    assert!(visibility(&said) < 0.01 && said.contains("nits_per_unit 1e30 is not a luminance"), "{said}");
}

/// XYZ is a colour like others.
#[test]
fn pictures_in_xyz_are_seen_in_their_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    let colour = |pixel: usize| [20.0 + random(pixel, 1), 30.0, 10.0 + 20.0 * random(pixel, 2)];
    write(folder.path(), "rgb.exr", colour);
    let to_xyz = Primaries::REC709.to_xyz().expect("a space");
    let mut xyz = Picture::new(SIDE as u32, SIDE as u32);
    for (row, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        let of = |pixel| apply(&to_xyz, colour(pixel).map(f64::from))[row] as f32;
        xyz.push_f32(name, (0..SIDE * SIDE).map(of).collect::<Vec<_>>());
    }
    xyz.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    write_exr(&folder.path().join("xyz.exr"), &xyz).expect("written");
    let (_, said) = fechner(folder.path(), &["compare", "rgb.exr", "xyz.exr"]);
    assert!(visibility(&said) < 0.01 && said.contains("taken for CIE XYZ"), "{said}");
}

/// Curves and primaries that a PNG file names are heeded.
#[test]
fn a_png_is_seen_in_its_own_curve_and_primaries() {
    let folder = tempfile::tempdir().expect("a folder");
    // What both spaces reach: more could not be one picture.
    let light = |pixel: usize| [0.2 + 0.2 * random(pixel, 1), 0.3, 0.1 + 0.1 * random(pixel, 2)];
    let in_p3 = Primaries::REC709.to(&Primaries::DISPLAY_P3).expect("spaces");
    let p3 = |pixel: usize| apply(&in_p3, light(pixel).map(f64::from)).map(|value| value as f32);
    let curve = |value: f32| Eotf::Srgb.encode(f64::from(value), 1.0) as f32;
    type Codes<'a> = &'a dyn Fn(usize) -> [f32; 3];
    let save = |name: &str, codes: Codes, tag: &[u8]| {
        let of = |pixel| codes(pixel).map(|code| (code * 65535.0).round() as u16).map(u16::to_be_bytes);
        let bytes: Vec<u8> = (0..SIDE * SIDE).flat_map(of).flatten().collect();
        let file = std::fs::File::create(folder.path().join(name)).expect("made");
        let mut encoder = png::Encoder::new(file, SIDE as u32, SIDE as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Sixteen);
        let mut writer = encoder.write_header().expect("written");
        writer.write_chunk(png::chunk::ChunkType([tag[0], tag[1], tag[2], tag[3]]), &tag[4..]).expect("written");
        writer.write_image_data(&bytes).expect("written");
    };
    let plain = |pixel: usize| light(pixel).map(curve);
    save("srgb.png", &plain, b"sRGB\0");
    save("p3.png", &|pixel| p3(pixel).map(curve), b"cICP\x0c\x0d\0\x01");
    save("linear.png", &light, b"cICP\x01\x08\0\x01");
    save("gamma.png", &light, b"gAMA\x00\x01\x86\xa0");
    for name in ["p3.png", "linear.png", "gamma.png"] {
        let (_, said) = fechner(folder.path(), &["compare", "srgb.png", name]);
        assert!(visibility(&said) < 0.1 && !said.contains("not heeded"), "{name}: {said}");
    }
    // White and primaries of Rec.709, in 1/100,000.
    let places = [31_270_u32, 32_900, 64_000, 33_000, 30_000, 60_000, 15_000, 6_000].map(u32::to_be_bytes).concat();
    save("display.png", &plain, &[&b"cHRM"[..], &places].concat());
    let (_, said) = fechner(folder.path(), &["compare", "display.png", "display.png"]);
    assert!(said.contains("display.png: its chromaticities are not heeded"), "{said}");
}

/// A Radiance picture that was brightened says by how much.
#[test]
fn exposure_of_radiance_pictures_is_taken_off() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, lines) in [("plain.hdr", ""), ("bright.hdr", "EXPOSURE=8\n")] {
        let mut bytes = format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n").into_bytes();
        bytes.extend([128_u8, 128, 128, 128].repeat(16));
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let shown = |name: &str| {
        run(folder.path(), &["tonemap", name, "-o", "o.exr", "--operator", "absolute", "--nits-per-unit", "100"]);
        200.0 * mean(folder.path(), "o.exr", "G")
    };
    let (plain, bright) = (shown("plain.hdr"), shown("bright.hdr"));
    assert!((plain / 50.0 - 1.0).abs() < 0.02 && (bright / 6.25 - 1.0).abs() < 0.02, "{plain} {bright}");
}
