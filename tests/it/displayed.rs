//! `fechner compare` and `threshold` see what the display shows: colours that it clips, PQ and sRGB files, rods,
//! acuity, the room's light.

use crate::support::command;
use crate::support::pictures::{mean, write_light};
use fechner::exr_read::read_exr;
use fechner::output::{Attribute, NITS_PER_UNIT, PIXEL_ASPECT_RATIO, Picture, write_exr, write_png};
use std::path::Path;

pub(crate) const SIDE: usize = 64;

pub(crate) fn fechner(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = command::fechner().args(arguments).current_dir(folder).output().expect("runs");
    let said = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&said).into_owned())
}

pub(crate) fn run(folder: &Path, arguments: &[&str]) -> String {
    let (code, said) = fechner(folder, arguments);
    assert_eq!(code, 0, "{arguments:?}: {said}");
    said
}

/// A picture of light in cd/m², [`SIDE`] pixels wide and high, `rgb` of each pixel's number.
pub(crate) fn write(folder: &Path, name: &str, rgb: impl Fn(usize) -> [f32; 3]) {
    write_light(&folder.join(name), [SIDE as u32; 2], rgb);
}

/// From -1 to 1, another number for each pixel and key.
pub(crate) fn random(pixel: usize, key: u64) -> f32 {
    let mut hash = (pixel as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(key << 32);
    for _ in 0..3 {
        hash = (hash ^ (hash >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (hash >> 40) as f32 / 8_388_608.0 - 1.0
}

pub(crate) fn visibility(said: &str) -> f32 {
    let number = said.split("worst visibility ").nth(1).and_then(|rest| rest.split_whitespace().next());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("no visibility in {said}"))
}

/// Blue far above the clip: what the green below it does is seen, and the eye is adapted to what is shown.
#[test]
fn noise_beside_a_clipped_channel_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let noise = |key| move |pixel| [0.0, 80.0 * (0.11 + 0.09 * random(pixel, key)), 1600.0];
    write(folder.path(), "g.exr", |_| [0.0, 8.8, 1600.0]);
    write(folder.path(), "a.exr", noise(1));
    write(folder.path(), "b.exr", noise(2));
    for operator in ["srgb", "linear"] {
        let arguments = ["threshold", "g.exr", "--halves", "a.exr", "b.exr", "--operator", operator, "-o", "t.exr"];
        run(folder.path(), &arguments);
        let (adaptation, seen) =
            (mean(folder.path(), "t.exr", "adaptation.Y"), mean(folder.path(), "t.exr", "visibility.Y"));
        assert!(adaptation < 60.0 && seen > 1.0, "{operator}: adapted to {adaptation} cd/m², visibility {seen}");
    }
}

/// Noise of red against green has no luminance: two such halves were 0.12 visible, while `compare` tells their mean
/// from the truth at 3.0.
#[test]
fn noise_of_colour_is_seen_in_halves() {
    let folder = tempfile::tempdir().expect("a folder");
    let noise = |key| {
        move |pixel| {
            let red = 69.0 * random(pixel, key);
            [100.0 + red, 100.0 - red * 0.2126 / 0.7152, 100.0]
        }
    };
    write(folder.path(), "g.exr", |_| [100.0; 3]);
    write(folder.path(), "a.exr", noise(1));
    write(folder.path(), "b.exr", noise(2));
    let seen = |model: &str| {
        let halves = ["threshold", "g.exr", "--halves", "a.exr", "b.exr", "-o", "t.exr"];
        let how = ["--operator", "absolute", "--display", "hdr-1000", "--model", model];
        run(folder.path(), &[&halves[..], &how[..]].concat());
        mean(folder.path(), "t.exr", "visibility.Y")
    };
    assert!(seen("csf-bands") > 1.5, "{}", seen("csf-bands"));
    assert!(seen("tvi") < 0.1, "of a model of luminance {}", seen("tvi"));
}

/// Halves in scene light are shown by the operator even where the guide is ready for the display.
#[test]
fn halves_of_a_scene_are_fitted_where_the_guide_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, key) in [("a.exr", 1), ("b.exr", 2)] {
        write(folder.path(), name, |pixel| [10.0 + 5.0 * random(pixel, key); 3]);
    }
    write_png(&folder.path().join("g.png"), SIDE as u32, SIDE as u32, &[[0.18; 3]; SIDE * SIDE]).expect("written");
    run(folder.path(), &["threshold", "g.png", "--halves", "a.exr", "b.exr", "-o", "t.exr"]);
    let seen = mean(folder.path(), "t.exr", "visibility.Y");
    assert!(seen > 1.0, "{seen}");
}

/// Noise of the picture itself, where the halves tell it: in the mean of them, or in one of them, it hid more than
/// half of itself.
#[test]
fn noise_in_a_mean_of_the_halves_does_not_hide_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let white = |pixel, key: u64| (0..12).map(|term| random(pixel, 100 * key + term)).sum::<f32>() / 2.0;
    write(folder.path(), "clean.exr", |_| [40.0; 3]);
    for relative in [0.05, 0.2, 0.6] {
        let half = |key| move |pixel| 40.0 * (1.0 + std::f32::consts::SQRT_2 * relative * white(pixel, key)).max(0.0);
        let (a, b) = (half(1), half(2));
        write(folder.path(), "a.exr", |pixel| [a(pixel); 3]);
        write(folder.path(), "b.exr", |pixel| [b(pixel); 3]);
        write(folder.path(), "mean.exr", |pixel| [0.5 * (a(pixel) + b(pixel)); 3]);
        write(folder.path(), "more.exr", |pixel| [0.75 * a(pixel) + 0.25 * b(pixel); 3]);
        let ask = |guide: &str| {
            let arguments = ["threshold", guide, "--halves", "a.exr", "b.exr", "--operator", "absolute", "-o", "t.exr"];
            let said = run(folder.path(), &arguments);
            let [allowed, seen] = ["threshold.Y", "visibility.Y"].map(|layer| mean(folder.path(), "t.exr", layer));
            (allowed, seen, said)
        };
        let (allowed, seen, said) = ask("clean.exr");
        println!("{relative}: {seen} by grey alone, {allowed} cd/m² allowed");
        assert!(!said.contains("of the halves"), "{said}");
        let (its_allowed, its_seen, said) = ask("mean.exr");
        println!("{relative}, by the mean: {its_seen}, {its_allowed} cd/m²");
        assert!(said.contains("it is the mean of the halves"), "{said}");
        assert!((its_seen / seen - 1.0).abs() < 0.1, "{relative}: {its_seen}, not {seen}");
        assert!((its_allowed / allowed - 1.0).abs() < 0.1, "{relative}: {its_allowed}, not {allowed}");
        // What has been marked in a place, or kept by a format with loss, is the mean still.
        let mean_of = |pixel| 0.5 * (a(pixel) + b(pixel));
        write(folder.path(), "marked.exr", |pixel| [if pixel == 77 { 300.0 } else { mean_of(pixel) }; 3]);
        write(folder.path(), "coded.exr", |pixel| [mean_of(pixel) * (1.0 + 0.1 * relative * white(pixel, 3)); 3]);
        for guide in ["marked.exr", "coded.exr"] {
            let (_, seen_so, said) = ask(guide);
            assert!(said.contains("it is the mean of the halves"), "{guide}: {said}");
            assert!((seen_so / seen - 1.0).abs() < 0.12, "{guide}, {relative}: {seen_so}, not {seen}");
        }
        for guide in ["more.exr", "a.exr", "b.exr"] {
            let (_, _, said) = ask(guide);
            assert!(said.contains("it is one of the halves, or has more of one"), "{guide}: {said}");
        }
    }
    // A reference beside a render has none of the render's noise, and clean pictures lie between halves that hardly
    // differ.
    write(folder.path(), "b.exr", |_| [40.0; 3]);
    let ask = |guide: &str| {
        run(
            folder.path(),
            &["threshold", guide, "--halves", "a.exr", "b.exr", "--operator", "absolute", "-o", "t.exr"],
        );
        mean(folder.path(), "t.exr", "threshold.Y")
    };
    assert_eq!(ask("b.exr"), ask("clean.exr"));
}

/// Texture loses what the operator blurs once, as noise does: lost twice, it hid little, and noise was up to 4 times
/// as visible as on the display that shows it.
#[test]
fn texture_behind_a_loss_of_acuity_hides_what_it_hides_on_the_display() {
    let folder = tempfile::tempdir().expect("a folder");
    let wave = |cpd: f32, at: usize| (std::f32::consts::TAU * cpd * (at as f32 + 0.5) / 60.0).cos();
    for (name, noise) in [("u", 0.0), ("a", 0.02), ("b", -0.02)] {
        let light = |pixel: usize| 0.02 * (1.0 + 0.8 * wave(3.75, pixel % SIDE) + noise * wave(3.75, pixel / SIDE));
        write(folder.path(), &format!("{name}.exr"), |pixel| [light(pixel); 3]);
        let shown = format!("{name}-shown.exr");
        run(folder.path(), &["tonemap", &format!("{name}.exr"), "-o", &shown, "--operator", "ferwerda96"]);
    }
    let seen = |model: &str, files: [&str; 3], how: &[&str]| {
        let [guide, a, b] = files;
        let arguments = ["threshold", guide, "--halves", a, b, "--model", model, "-o", "t.exr"];
        run(folder.path(), &[&arguments[..], how].concat());
        mean(folder.path(), "t.exr", "visibility.Y")
    };
    // The other model asks for no contrast sensitivity behind which the loss could stand.
    for model in ["csf-bands", "tvi"] {
        let of_scene = seen(model, ["u.exr", "a.exr", "b.exr"], &["--operator", "ferwerda96"]);
        let on_display = seen(model, ["u-shown.exr", "a-shown.exr", "b-shown.exr"], &[]);
        assert!((of_scene / on_display - 1.0).abs() < 0.1, "{model}: {of_scene}, and on the display {on_display}");
    }
}

/// Black before black is all one; over white it is not.
#[test]
fn coverage_alone_is_seen_over_white() {
    let folder = tempfile::tempdir().expect("a folder");
    let inside = |pixel: usize| (pixel % SIDE).abs_diff(SIDE / 2) < 12 && (pixel / SIDE).abs_diff(SIDE / 2) < 12;
    for (name, outside) in [("whole", 1.0), ("disc", 0.0)] {
        let alpha: Vec<f32> = (0..SIDE * SIDE).map(|pixel| if inside(pixel) { 1.0 } else { outside }).collect();
        let mut picture = Picture::new(SIDE as u32, SIDE as u32);
        ["R", "G", "B"].into_iter().for_each(|letter| picture.push_f32(letter, vec![0.0; SIDE * SIDE]));
        picture.push_f32("A", alpha.clone());
        picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
        write_exr(&folder.path().join(format!("{name}.exr")), &picture).expect("written");
        let codes = alpha.iter().flat_map(|alpha| [0, 0, 0, (255.0 * alpha) as u8]).collect();
        let image = image::RgbaImage::from_raw(SIDE as u32, SIDE as u32, codes).expect("pixels");
        image.save(folder.path().join(format!("{name}.png"))).expect("written");
    }
    for ending in ["exr", "png"] {
        let [whole, disc] = ["whole", "disc"].map(|name| format!("{name}.{ending}"));
        let (code, said) = fechner(folder.path(), &["compare", &whole, &disc, "--operator", "absolute"]);
        assert!(code == 1 && visibility(&said) > 10.0 && said.contains("over white"), "{ending}: {said}");
        let (code, said) = fechner(folder.path(), &["compare", &disc, &disc, "--operator", "absolute"]);
        assert!(code == 0 && visibility(&said) == 0.0, "{ending}: {said}");
    }
    let (code, said) = fechner(folder.path(), &["compare", "disc.exr", "disc.png", "--operator", "absolute"]);
    assert_eq!(code, 0, "{said}");
}

/// A frame before its figure comes covers nothing. It passed for opaque black, and `tonemap` wrote it so between
/// frames that are not; a pass has light and no alpha, and beside it black is what it has none in.
#[test]
fn what_covers_nothing_is_transparent_and_passes_are_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let kinds = [("nothing", 0.0, 0.0), ("black", 0.0, 1.0), ("pass", 40.0, 0.0)];
    for (name, light, alpha) in kinds {
        let mut picture = Picture::new(SIDE as u32, SIDE as u32);
        ["R", "G", "B"].into_iter().for_each(|letter| picture.push_f32(letter, vec![light; SIDE * SIDE]));
        picture.push_f32("A", vec![alpha; SIDE * SIDE]);
        picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
        write_exr(&folder.path().join(format!("{name}.exr")), &picture).expect("written");
    }
    run(folder.path(), &["tonemap", "nothing.exr", "-o", "nothing.png", "--operator", "absolute"]);
    let shown = image::open(folder.path().join("nothing.png")).expect("a picture").into_rgba8();
    assert!(shown.pixels().all(|pixel| pixel.0[3] == 0));
    let compare = |test: &str| fechner(folder.path(), &["compare", "nothing.exr", test, "--operator", "absolute"]);
    let (code, said) = compare("nothing.png");
    assert!(code == 0 && visibility(&said) == 0.0, "{said}");
    let (code, said) = compare("black.exr");
    assert!(code == 1 && said.contains("over white"), "{said}");
    let (code, said) = compare("pass.exr");
    assert!(code == 1 && said.contains("not looked at") && !said.contains("over white"), "{said}");
}

/// Two pictures of no number at all were the same to the eye.
#[test]
fn a_picture_without_a_finite_value_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let broken = folder.path().join("broken.exr");
    exr::prelude::write_rgb_file(&broken, 8, 8, |_, _| (f32::NAN, f32::INFINITY, f32::NAN)).expect("written");
    let (code, said) = fechner(folder.path(), &["compare", "broken.exr", "broken.exr", "--nits-per-unit", "1"]);
    assert!(code == 2 && said.contains("none of its values is finite"), "{said}");
}

/// Detail in the dark is there whatever the room adds, in PQ as in sRGB.
#[test]
fn dark_detail_of_an_hdr_picture_survives_a_lit_room() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("room.toml"), "preset = 'hdr-1000'\nambient_cd_m2 = 5").expect("written");
    for (name, light) in [("one", 1.0), ("three", 3.0)] {
        let exr = format!("{name}.exr");
        write(folder.path(), &exr, |pixel| [if pixel / 8 % 2 == 0 { light } else { 1.0 }; 3]);
        let png = format!("{name}.png");
        run(folder.path(), &["tonemap", &exr, "-o", &png, "--operator", "absolute", "--display", "room.toml"]);
    }
    let (code, said) = fechner(folder.path(), &["compare", "one.png", "three.png", "--display", "room.toml"]);
    assert!(code == 1 && visibility(&said) > 3.0, "{said}");
}

/// The program's own PNG of a picture looks like the picture: to rods, behind a loss of acuity, on displays of any
/// curve.
#[test]
fn a_picture_looks_like_its_own_png() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "blue.exr", |_| [0.002, 0.01, 0.05]);
    write(folder.path(), "night.exr", |pixel| [0.01 * (1.0 + 0.5 * random(pixel, 3)); 3]);
    write(folder.path(), "ramp.exr", |pixel| [80.0 * 0.01_f32.powf((pixel % SIDE) as f32 / SIDE as f32); 3]);
    for (picture, operator, display) in [
        ("blue.exr", "ferwerda96", "desktop"),
        ("blue.exr", "pattanaik00", "desktop"),
        ("night.exr", "ferwerda96", "desktop"),
        ("ramp.exr", "srgb", "cinema"),
        ("ramp.exr", "srgb", "uhd-tv"),
        ("ramp.exr", "srgb", "hdr-1000"),
    ] {
        let how = ["--operator", operator, "--display", display];
        run(folder.path(), &[&["tonemap", picture, "-o", "shown.png"][..], &how[..]].concat());
        let (_, said) = fechner(folder.path(), &[&["compare", picture, "shown.png"][..], &how[..]].concat());
        // One step of eight bits in the dark is near threshold.
        assert!(visibility(&said) < 1.5, "{picture} by {operator} on {display}: {said}");
    }
}

/// What a render judged is what is compared: its operator with its exposure, on the display that they are for.
#[test]
fn a_render_is_seen_as_it_was_judged() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &command::cornell_box().display().to_string();
    for (name, how) in [("dimmed", &["--exposure", "-2"][..]), ("adapted", &["--operator", "pattanaik00"])] {
        for ending in ["exr", "png"] {
            let common = ["render", scene, "--size", "48x48", "--spp", "16", "-o"];
            run(folder.path(), &[&common[..], &[&format!("{name}.{ending}")], how].concat());
        }
        let files = [format!("{name}.exr"), format!("{name}.png")];
        let compare = |more: &[&str]| {
            let (_, said) = fechner(folder.path(), &[&["compare", &files[0], &files[1]], more].concat());
            (visibility(&said), said)
        };
        let (kept, said) = compare(&["--json", "figures.json"]);
        assert!(kept < 1.5 && said.contains("when it was rendered"), "{name}: {said}");
        let figures = std::fs::read_to_string(folder.path().join("figures.json")).expect("written");
        assert!(figures.contains("\"operator\": \""), "{figures}");
        let (by_another, said) = compare(&["--operator", "constant"]);
        assert!(by_another > 2.0 && !said.contains("when it was rendered"), "{name}: {said}");
        let (_, said) = compare(&["--display", "hdr-1000"]);
        assert!(said.contains("was rendered for the display \"desktop\""), "{said}");
        run(folder.path(), &["tonemap", &files[0], "-o", "again.png"]);
        let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("there");
        assert!(bytes("again.png") == bytes(&files[1]), "{name}: tonemap shows another picture");
        let threshold = |more: &[&str]| {
            let arguments = ["threshold", &files[0], "-o", "thresholds.exr"];
            run(folder.path(), &[&arguments[..], more].concat());
            mean(folder.path(), "thresholds.exr", "adaptation.Y")
        };
        assert!((threshold(&[]) / threshold(&["--operator", "constant"])).ln().abs() > 0.01, "{name}");
    }
}

/// Premultiplied in the EXR file and straight in the PNG, a transparent picture is one: by operators that scale light
/// and by those that do not, which made another picture of light times alpha (50 by ferwerda96), in sRGB and in PQ.
#[test]
fn transparent_pictures_are_seen_alike() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/meshes/chess-pawn.obj");
    let sky = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/skies/studio.hdr");
    for how in [
        &["--operator", "constant"][..],
        &["--operator", "constant", "--display", "hdr-1000"],
        &["--operator", "ferwerda96"],
        &["--operator", "pattanaik00"],
        &["--operator", "durand-dorsey00"],
        &["--operator", "ward94"],
    ] {
        for name in ["a.exr", "a.png"] {
            let common =
                ["render", scene, "--environment", sky, "--transparent", "--size", "48x48", "--plans", "1", "-o", name];
            run(folder.path(), &[&common[..], how].concat());
        }
        let (_, said) = fechner(folder.path(), &["compare", "a.exr", "a.png"]);
        assert!(visibility(&said) < 1.5 && said.contains("before black"), "{how:?}: {said}");
    }
}

/// A lamp that lets four fifths through sends more than its alpha times white: `render` cut it there where `tonemap`
/// and `compare` kept it, and the picture's two files were told apart by 29.7 of a threshold. Edges of what is whole
/// keep their alpha.
#[test]
fn lamps_that_let_light_through_are_one_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = |of_lamp: &str| {
        format!(
            "nits_per_unit = 100\nenvironment = {{ luminance_cd_m2 = 50 }}\nmaterials.lamp = {{ type = 'diffuse', reflectance = 0, {of_lamp} }}\n\
             materials.white = {{ type = 'diffuse', reflectance = 0.8 }}\n\
             camera = {{ position = [0, 1, 4], look_at = [0, 1, 0], vertical_fov_deg = 39 }}\n\
             [[objects]]\nmaterial = 'lamp'\nsphere = {{ center = [0.5, 1, 0], radius = 0.4 }}\n\
             [[objects]]\nmaterial = 'white'\nrectangle = {{ corner = [-1, 0.2, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }}\n"
        )
    };
    let alphas = |name: &str| -> Vec<u8> {
        let picture = image::open(folder.path().join(name)).expect("a picture").into_rgba8();
        picture.pixels().map(|pixel| pixel.0[3]).collect()
    };
    for (of_lamp, is_bright) in [("emission = [3, 0.1, 0.1], alpha = 0.2", true), ("emission = [0, 0, 0]", false)] {
        std::fs::write(folder.path().join("lamp.toml"), scene(of_lamp)).expect("written");
        for operator in ["constant", "linear", "srgb"] {
            let how =
                ["--transparent", "--size", "48x48", "--sampling", "uniform", "--spp", "16", "--operator", operator];
            let [_, said] = ["a.exr", "a.png"]
                .map(|name| run(folder.path(), &[&["render", "lamp.toml", "-o", name][..], &how].concat()));
            assert_eq!(said.contains("light that covers nothing"), is_bright, "{operator}: {said}");
            let (_, said) = fechner(folder.path(), &["compare", "a.exr", "a.png"]);
            assert!(visibility(&said) < 1.5, "{operator}, {of_lamp}: {said}");
            run(folder.path(), &["tonemap", "a.exr", "-o", "b.png"]);
            let [rendered, shown] = ["a.png", "b.png"].map(alphas);
            let apart = rendered.iter().zip(&shown).map(|(a, b)| a.abs_diff(*b)).max().expect("pixels");
            assert!(apart <= 1, "{operator}, {of_lamp}: {apart} codes of alpha");
        }
    }
}

/// What a file says of its display goes before what another's curve suggests, whichever is named first: it was 0.4
/// and 25.
#[test]
fn a_display_that_is_told_goes_before_a_guess() {
    let folder = tempfile::tempdir().expect("a folder");
    let display =
        "name = 'mine'\npixels_per_degree = 110\nwhite_cd_m2 = 600\nblack_cd_m2 = 0.4\nambient_cd_m2 = 30\neotf = 'pq'";
    std::fs::write(folder.path().join("my.toml"), display).expect("written");
    let scene = &command::cornell_box().display().to_string();
    for name in ["a.exr", "a.png"] {
        let common = ["render", scene, "--size", "32x32", "--spp", "16", "--display", "my.toml", "-o", name];
        run(folder.path(), &common);
    }
    for [reference, test] in [["a.exr", "a.png"], ["a.png", "a.exr"]] {
        let (_, said) = fechner(folder.path(), &["compare", reference, test]);
        assert!(visibility(&said) < 1.0 && said.contains("on \"mine\""), "{reference} first: {said}");
    }
}

/// What alpha says is not there is no night: eyes that took it for one showed a figure in daylight flat white. By a
/// render and by `tonemap`.
#[test]
fn eyes_adapt_to_what_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/meshes/chess-pawn.obj");
    for operator in ["pattanaik00", "ferwerda96", "ward94", "durand-dorsey00", "scheel00", "ward-larson97"] {
        let how = ["--size", "32x32", "--sampling", "uniform", "--spp", "16", "--operator", operator, "-o"];
        for name in ["a.png", "a.exr"] {
            let common = ["render", scene, "--environment", "sky:30,60", "--transparent"];
            run(folder.path(), &[&common[..], &how[..], &[name]].concat());
        }
        run(folder.path(), &["tonemap", "a.exr", "-o", "b.png", "--operator", operator]);
        for name in ["a.png", "b.png"] {
            let picture = image::open(folder.path().join(name)).expect("a picture").into_rgba8();
            let whole: Vec<u8> = picture.pixels().filter(|pixel| pixel.0[3] == 255).map(|pixel| pixel.0[1]).collect();
            let white = whole.iter().filter(|&&code| code == 255).count();
            // Sunlit sides are white to some.
            assert!(!whole.is_empty() && 4 * white < 3 * whole.len(), "{operator}, {name}: {white} of {}", whole.len());
        }
        let (_, said) = fechner(folder.path(), &["compare", "a.exr", "a.png"]);
        assert!(visibility(&said) < 1.5, "{operator}: {said}");
    }
}

/// Pixels twice as wide as high are so in the PNG too, which was judged as if they were square, or refused.
#[test]
fn the_shape_of_pixels_is_kept_in_a_png() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut picture = Picture::new(SIDE as u32, SIDE as u32);
    for letter in ["R", "G", "B"] {
        picture.push_f32(letter, (0..SIDE * SIDE).map(|pixel| 50.0 + 20.0 * random(pixel, 4)).collect::<Vec<_>>());
    }
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    picture.push_attribute(PIXEL_ASPECT_RATIO, Attribute::Float(2.0));
    write_exr(&folder.path().join("a.exr"), &picture).expect("written");
    for display in ["desktop", "hdr-1000"] {
        let how = ["--operator", "absolute", "--display", display];
        run(folder.path(), &[&["tonemap", "a.exr", "-o", "a.png"][..], &how[..]].concat());
        let said = run(folder.path(), &[&["compare", "a.exr", "a.png"][..], &how[..]].concat());
        assert!(visibility(&said) < 1.0 && said.contains("at 30 pixels"), "{said}");
    }
}

/// A render's pixels are square: for a display whose own are not it drew and tagged square ones, which that display
/// stretched.
#[test]
fn nothing_is_rendered_for_pixels_that_are_not_square() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &command::cornell_box().display().to_string();
    std::fs::write(folder.path().join("wide.toml"), "name = 'wide'\npixel_aspect_ratio = 2.0").expect("written");
    let (code, said) =
        fechner(folder.path(), &["render", scene, "-o", "a.png", "--size", "8x8", "--display", "wide.toml"]);
    assert!(code == 2 && said.contains("\"wide\"") && said.contains("square"), "{said}");
    let shot = ["animate", scene, "--frames", "0..1", "-o", "a.##.png", "--size", "8x8", "--display", "wide.toml"];
    let (code, said) = fechner(folder.path(), &shot);
    assert!(code == 2 && said.contains("square"), "{said}");
    write(folder.path(), "a.exr", |_| [50.0; 3]);
    run(folder.path(), &["tonemap", "a.exr", "-o", "a.png", "--operator", "absolute", "--display", "wide.toml"]);
}

/// Who names no display sees a render on the one that it was made for.
#[test]
fn a_render_is_seen_on_its_own_display() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &command::cornell_box().display().to_string();
    for name in ["a.exr", "a.png"] {
        let common = ["render", scene, "--size", "32x32", "--spp", "16", "--operator", "absolute", "-o", name];
        run(folder.path(), &[&common[..], &["--display", "hdr-1000"]].concat());
    }
    let (_, said) = fechner(folder.path(), &["compare", "a.exr", "a.png"]);
    assert!(said.contains("on \"hdr-1000\"") && visibility(&said) < 1.0, "{said}");
    run(folder.path(), &["tonemap", "a.exr", "-o", "b.png"]);
    // Of 16 bits the last ones are rounding.
    let (_, said) = fechner(folder.path(), &["compare", "a.png", "b.png", "--display", "hdr-1000"]);
    assert!(visibility(&said) < 0.1, "{said}");
    let (code, said) = fechner(folder.path(), &["tonemap", "a.exr", "-o", "b.png", "--display", "laptop"]);
    assert!(code == 2 && said.contains("give --operator"), "{said}");
}

/// A display of one's own is kept with what was made for it: with a preset's name and another distance, with a name
/// beyond ASCII.
#[test]
fn a_render_is_seen_on_a_display_of_ones_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &command::cornell_box().display().to_string();
    for (file, display) in [
        ("near.toml", "preset = 'phone'\npixels_per_degree = 20.0"),
        ("wide.toml", "preset = 'desktop'\ncsf_area_deg2 = 7.0"),
        ("named.toml", "name = 'Büro 🖥'\nwhite_cd_m2 = 90.0"),
    ] {
        std::fs::write(folder.path().join(file), display).expect("written");
        for seed in ["1", "2"] {
            let (exr, shown) = (format!("{seed}.exr"), format!("shown{seed}.exr"));
            let common = ["render", scene, "--size", "32x32", "--sampling", "uniform", "--spp", "16", "--seed", seed];
            run(folder.path(), &[&common[..], &["--display", file, "-o", &exr]].concat());
            run(folder.path(), &["tonemap", &exr, "-o", &shown]);
        }
        for pictures in [["1.exr", "2.exr"], ["shown1.exr", "shown2.exr"]] {
            let compare =
                |more: &[&str]| visibility(&fechner(folder.path(), &[&["compare"], &pictures[..], more].concat()).1);
            let (own, preset) = (compare(&["--display", file]), compare(&["--display", "laptop"]));
            assert_eq!(compare(&[]), own, "{file}, {pictures:?}");
            assert!(preset != own, "{file}: nothing is told by {preset}");
        }
    }
}

/// The display that a scene names is one of its files.
#[test]
fn the_display_of_a_scene_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("d.toml"), "white_cd_m2 = 250").expect("written");
    let scene = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n[view]\ndisplay = \"d.toml\"\n[materials.m]\ntype = \"diffuse\"\n\
                 reflectance = [0, 0, 0]\nemission = [1, 1, 1]\n[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n";
    std::fs::write(folder.path().join("s.toml"), scene).expect("written");
    let arguments = ["render", "s.toml", "-o", "a.png", "--size", "8x8", "--plans", "1", "--json", "d.toml"];
    let (code, said) = fechner(folder.path(), &arguments);
    assert!(code == 2 && said.contains("--json would replace"), "{said}");
    assert_eq!(std::fs::read(folder.path().join("d.toml")).expect("kept"), b"white_cd_m2 = 250");
}

/// Light that only an HDR display has is seen on one, in the files that `tonemap` makes for it, and no more of it
/// than it has.
#[test]
fn pictures_for_hdr_displays_are_seen_on_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let square = |pixel: usize| (24..40).contains(&(pixel % SIDE)) && (24..40).contains(&(pixel / SIDE));
    write(folder.path(), "even.exr", |_| [400.0; 3]);
    write(folder.path(), "square.exr", |pixel| [if square(pixel) { 800.0 } else { 400.0 }; 3]);
    for ending in ["exr", "png"] {
        let shown = ["even", "square"].map(|name| format!("{name}-shown.{ending}"));
        for (scene, shown) in ["even.exr", "square.exr"].iter().zip(&shown) {
            run(folder.path(), &["tonemap", scene, "-o", shown, "--operator", "absolute", "--display", "hdr-1000"]);
        }
        let (code, said) = fechner(folder.path(), &["compare", &shown[0], &shown[1]]);
        assert!(code == 1 && visibility(&said) > 20.0 && said.contains("hdr-1000"), "{ending}: {said}");
    }
    let adaptation = |red_cd_m2: f32| {
        write(folder.path(), "red.exr", |_| [red_cd_m2, 0.0, 0.0]);
        run(
            folder.path(),
            &["tonemap", "red.exr", "-o", "red-shown.exr", "--operator", "absolute", "--display", "hdr-1000"],
        );
        run(folder.path(), &["threshold", "red-shown.exr", "--display", "desktop", "-o", "t.exr"]);
        mean(folder.path(), "t.exr", "adaptation.Y")
    };
    let (clipped, at_most) = (adaptation(800.0), adaptation(200.0));
    assert!((clipped / at_most).ln().abs() < 0.01, "adapted to {clipped} cd/m² where the display has {at_most}");
}

/// A part of a picture, and a frame, have the exposure of the whole, where small lamps decide it, too.
#[test]
fn parts_and_frames_are_exposed_as_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/many-lights.toml");
    let white = |arguments: &[&str], picture: &str| -> f32 {
        let common = ["--size", "384x288", "--sampling", "uniform", "--spp", "4", "-o"];
        let name = picture.replace("00", "##");
        run(folder.path(), &[&arguments[..1], &[scene], &arguments[1..], &common[..], &[&name]].concat());
        let exr = read_exr(&folder.path().join(picture)).expect("a picture");
        let Some(Attribute::Text(operator)) = exr.attribute("fechner.operator") else { panic!("no operator") };
        let number = operator.split("white at ").nth(1).and_then(|rest| rest.split_whitespace().next());
        number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{operator}"))
    };
    let whole = white(&["render"], "whole.exr");
    for (arguments, picture) in
        [(&["render", "--crop", "100,80,40,40"][..], "part.exr"), (&["animate", "--frames", "0..0"], "frame.00.exr")]
    {
        let found = white(arguments, picture);
        assert!((found / whole).log2().abs() < 0.15, "{picture}: white at {found}, of the whole at {whole} cd/m²");
    }
}

/// A tone-mapped EXR says what the screen emits, and is that again when it is shown as it is.
#[test]
fn a_tone_mapped_exr_is_shown_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "dark.exr", |pixel| [80.0 * 1e-4_f32.powf((pixel % SIDE) as f32 / SIDE as f32); 3]);
    for output in ["once.exr", "once.png"] {
        run(folder.path(), &["tonemap", "dark.exr", "-o", output, "--operator", "srgb"]);
    }
    run(folder.path(), &["tonemap", "once.exr", "-o", "twice.exr", "--operator", "absolute"]);
    let values = |name: &str| read_exr(&folder.path().join(name)).expect("read").channel("G").expect("green").to_vec();
    for (once, twice) in values("once.exr").iter().zip(values("twice.exr")) {
        assert!((once - twice).abs() < 1e-6, "{once} became {twice}");
    }
    let (_, said) = fechner(folder.path(), &["compare", "once.exr", "once.png", "--operator", "absolute"]);
    assert!(visibility(&said) < 1.5, "{said}");
    let (_, said) = fechner(folder.path(), &["compare", "once.exr", "once.png"]);
    assert!(visibility(&said) < 1.5 && said.contains("holds light of a display"), "{said}");
    // Nor does the operator that shows the scene beside it, whichever is the reference.
    for pair in [["dark.exr", "once.exr"], ["once.exr", "dark.exr"]] {
        let (_, said) = fechner(folder.path(), &[&["compare"], &pair[..], &["--operator", "srgb"]].concat());
        assert!(visibility(&said) < 0.1, "{said}");
    }
}
