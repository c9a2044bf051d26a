//! `fechner tonemap`: sheets, sequences in time, HDR displays, and what it refuses.

use crate::support::command::{self, fechner};
use crate::support::pictures::{mean, write_light};
use fechner::exr_read::read_exr;
use fechner::output::{
    Attribute, NITS_PER_UNIT, PIXEL_ASPECT_RATIO, PartOf, Picture, png_pixel_aspect_ratio, write_exr,
};
use std::path::Path;
use std::process::Command;

fn tonemap(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = fechner();
    command.arg("tonemap").args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> String {
    let output = command::run(&mut tonemap(folder, arguments));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A grey picture of 64×36 pixels, cd/m², with a step.
fn write_step(folder: &Path, name: &str, dark: f32, bright: f32) {
    write_light(&folder.join(name), [64, 36], |pixel| [if pixel % 64 < 32 { dark } else { bright }; 3]);
}

#[test]
fn all_operators_make_one_sheet() {
    let folder = tempfile::tempdir().expect("a folder");
    write_step(folder.path(), "a.exr", 1.0, 1000.0);
    run(folder.path(), &["a.exr", "-o", "all.png", "--operator", "all", "--adaptation", "local"]);
    let sheet = image::open(folder.path().join("all.png")).expect("a picture");
    assert!(sheet.width() > 4 * 64 && sheet.height() > 4 * 36);
}

/// Small pictures have the shape of the large one.
#[test]
fn a_sheet_keeps_the_shape_of_pixels() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut picture = Picture::new(16, 9);
    ["R", "G", "B"].into_iter().for_each(|channel| picture.push_f32(channel, vec![40.0; 16 * 9]));
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    picture.push_attribute(PIXEL_ASPECT_RATIO, Attribute::Float(2.0));
    write_exr(&folder.path().join("a.exr"), &picture).expect("written");
    run(folder.path(), &["a.exr", "-o", "all.png", "--operator", "all"]);
    let sheet = std::fs::read(folder.path().join("all.png")).expect("written");
    assert!((png_pixel_aspect_ratio(&sheet) - 2.0).abs() < 1e-3, "{}", png_pixel_aspect_ratio(&sheet));
}

/// Numbers of frames are what names differ by, wherever they stand.
#[test]
fn frames_keep_their_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["s.0010.left.exr", "s.0009.left.exr", "n.-0001.exr", "n.0001.exr"] {
        write_step(folder.path(), name, 1.0, 10.0);
    }
    let how = ["--operator", "pattanaik00"];
    let written = |inputs: [&str; 2]| {
        let said = run(folder.path(), &[&inputs[..], &["-o", "o.####.exr"], &how].concat());
        said.lines().filter_map(|line| Some(line.split_once(':')?.0.to_owned())).collect::<Vec<_>>()
    };
    assert_eq!(written(["s.0010.left.exr", "s.0009.left.exr"]), ["o.0009.exr", "o.0010.exr"]);
    assert_eq!(written(["n.-0001.exr", "n.0001.exr"]), ["o.-001.exr", "o.0001.exr"]);
}

/// A crop of a transparent render: alpha as in the render's own files, and the place in the whole.
#[test]
fn alpha_and_the_place_of_a_crop_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut picture = Picture::new(2, 1);
    // What covers both pixels has 40 cd/m², under a white of 80.
    ["R", "G", "B"].into_iter().for_each(|channel| picture.push_f32(channel, vec![40.0, 10.0]));
    picture.push_f32("A", vec![1.0, 0.25]);
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    picture.part_of = Some(PartOf { origin: [16, 8], whole: [64, 48] });
    write_exr(&folder.path().join("a.exr"), &picture).expect("written");
    for name in ["shown.png", "shown.exr"] {
        run(folder.path(), &["a.exr", "-o", name, "--operator", "srgb"]);
    }
    let png = image::open(folder.path().join("shown.png")).expect("a picture");
    assert_eq!(png.color(), image::ColorType::Rgba8);
    let png = png.into_rgba8();
    let [covered, seen_through] = [0, 1].map(|x| png.get_pixel(x, 0).0);
    assert_eq!((covered[3], seen_through[3]), (255, 64));
    // Codes are dithered by one step.
    assert!(covered[1].abs_diff(188) <= 1 && seen_through[1].abs_diff(188) <= 1, "{covered:?} {seen_through:?}");
    let exr = read_exr(&folder.path().join("shown.exr")).expect("an EXR file");
    assert_eq!((exr.part_of, exr.data_window_origin), (picture.part_of, (16, 8)));
    assert_eq!(exr.channel("A"), Some(&[1.0, 0.25][..]));
    let green = exr.channel("G").expect("green");
    assert!((green[0] - 0.5).abs() < 2e-3 && (green[1] - 0.125).abs() < 2e-3, "{green:?}");
}

/// A flame of 50 cd/m² beside what covers its pixel, under a white of 80: it was gone.
#[test]
fn light_that_covers_nothing_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut picture = Picture::new(2, 1);
    ["R", "G", "B"].into_iter().for_each(|channel| picture.push_f32(channel, vec![20.0, 50.0]));
    picture.push_f32("A", vec![1.0, 0.0]);
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    write_exr(&folder.path().join("a.exr"), &picture).expect("written");
    run(folder.path(), &["a.exr", "-o", "shown.exr", "--operator", "srgb"]);
    let exr = read_exr(&folder.path().join("shown.exr")).expect("an EXR file");
    let green = exr.channel("G").expect("green");
    assert!((green[1] - 0.625).abs() < 2e-3, "{green:?}");
    assert_eq!(exr.channel("A"), Some(&[1.0, 0.0][..]));
    let said =
        tonemap(folder.path(), &["a.exr", "-o", "shown.png", "--operator", "srgb"]).output().expect("runs").stderr;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.contains("light that covers nothing"), "{said}");
    let flame = image::open(folder.path().join("shown.png")).expect("a picture").into_rgba8().get_pixel(1, 0).0;
    // 0.625 of white by alpha alone.
    assert!(flame[3].abs_diff(159) <= 1 && flame[1] == 255, "{flame:?}");
}

/// An alpha multiplies the display's black too: what is not covered holds none, and the file shows what its PNG does.
/// On a display whose black is not dark it was 133 codes off, with a note about flames that are not there.
#[test]
fn a_transparent_exr_is_shown_as_its_png() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("lit.toml"), "name = 'lit'\nwhite_cd_m2 = 200.0\nblack_cd_m2 = 5.0")
        .expect("written");
    let alpha = [1.0, 0.7, 0.4, 0.1, 0.02, 0.0];
    let mut picture = Picture::new(6, 1);
    for (channel, light) in [("R", 90.0), ("G", 30.0), ("B", 0.5)] {
        picture.push_f32(channel, alpha.map(|alpha| light * alpha).to_vec());
    }
    picture.push_f32("A", alpha.to_vec());
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    write_exr(&folder.path().join("a.exr"), &picture).expect("written");
    for display in ["desktop", "lit.toml"] {
        for name in ["direct.png", "via.exr"] {
            run(folder.path(), &["a.exr", "-o", name, "--operator", "absolute", "--display", display]);
        }
        let exr = read_exr(&folder.path().join("via.exr")).expect("an EXR file");
        let last = ["R", "G", "B"].map(|channel| exr.channel(channel).expect("a channel")[5]);
        assert_eq!(last, [0.0; 3], "{display}: light where nothing is");
        let said = command::run(&mut tonemap(folder.path(), &["via.exr", "-o", "via.png"]));
        assert!(said.stderr.is_empty(), "{}", String::from_utf8_lossy(&said.stderr));
        let [direct, via] = ["direct.png", "via.png"]
            .map(|name| image::open(folder.path().join(name)).expect("a picture").into_rgba8());
        assert_eq!(direct, via, "{display}");
        command::run(fechner().args(["compare", "via.exr", "direct.png"]).current_dir(folder.path()));
    }
}

/// Over time the same eye sees the same part of the view.
#[test]
fn equal_frames_are_seen_as_the_still_of_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut picture = Picture::new(64, 36);
    let lamp = |i: i32| if (i % 64 - 32).abs() < 9 && (i / 64 - 18).abs() < 9 { 100.0 } else { 1.0 };
    ["R", "G", "B"].into_iter().for_each(|c| picture.push_f32(c, (0..64 * 36).map(lamp).collect::<Vec<f32>>()));
    picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
    for name in ["f1.exr", "f2.exr"] {
        write_exr(&folder.path().join(name), &picture).expect("written");
    }
    for operator in ["scheel00", "ward94", "ptyg", "fpsg", "tr", "durand-dorsey00"] {
        let still = run(folder.path(), &["f1.exr", "-o", "still.exr", "--operator", operator]);
        let moving = run(folder.path(), &["f1.exr", "f2.exr", "-o", "moving.#.exr", "--operator", operator]);
        let fit = |line: &str| line.split_once(": ").map(|(_, fit)| fit.to_owned());
        for line in moving.lines() {
            assert_eq!(fit(line), fit(still.trim_end()), "{operator}");
        }
    }
}

#[test]
fn a_sequence_is_blinded_and_recovers_and_can_be_continued() {
    let folder = tempfile::tempdir().expect("a folder");
    for frame in 1..=4 {
        write_step(folder.path(), &format!("in{frame}.exr"), 500.0, 2000.0);
    }
    let inputs = ["in1.exr", "in2.exr", "in3.exr", "in4.exr"];
    let common = ["--operator", "ptyg", "--fps", "5"];
    let whole = [&inputs[..], &common[..], &["-o", "whole.##.exr", "--adapted-to", "0.1"][..]].concat();
    run(folder.path(), &whole);
    let course: Vec<f32> = (1..=4).map(|frame| mean(folder.path(), &format!("whole.{frame:02}.exr"), "G")).collect();
    assert!(course[0] > 0.99 && course.windows(2).all(|pair| pair[1] < pair[0] + 1e-6), "{course:?}");
    assert!(course[3] < 0.8, "{course:?}");

    // A shell puts 10 before 9.
    for (frame, name) in [(1, "n8.exr"), (2, "n9.exr"), (3, "n10.exr"), (4, "n11.exr")] {
        std::fs::copy(folder.path().join(format!("in{frame}.exr")), folder.path().join(name)).expect("copied");
    }
    let by_shell = ["n10.exr", "n11.exr", "n8.exr", "n9.exr"];
    run(folder.path(), &[&by_shell[..], &common[..], &["-o", "shell.##.exr", "--adapted-to", "0.1"][..]].concat());
    let again: Vec<f32> = (8..=11).map(|frame| mean(folder.path(), &format!("shell.{frame:02}.exr"), "G")).collect();
    assert_eq!(again, course);

    // Frames that are missing take their time: two steps of a tenth of a second are one of a fifth.
    for (frame, name) in [(1, "gap1.exr"), (2, "gap3.exr")] {
        std::fs::copy(folder.path().join(format!("in{frame}.exr")), folder.path().join(name)).expect("copied");
    }
    let gap = ["gap1.exr", "gap3.exr", "--operator", "ptyg", "--fps", "10", "-o", "gap.#.exr", "--adapted-to", "0.1"];
    run(folder.path(), &gap);
    assert_eq!(mean(folder.path(), "gap.3.exr", "G"), course[1]);

    // The same in two parts by way of a file.
    let start = r#"{"cones":{"neural_cd_m2":0.1,"pigment":1.0},"rods":{"neural_cd_m2":0.1,"pigment":0.3},
        "goal":{"cones_cd_m2":0.1,"rods_cd_m2":0.1}}"#;
    let part = |inputs: &[&str], name: &str, state: &str| {
        let output = [inputs, &common[..], &["-o", name, "--state", state][..]].concat();
        run(folder.path(), &output);
    };
    for state in ["once.json", "twice.json"] {
        std::fs::write(folder.path().join(state), start).expect("written");
    }
    part(&inputs, "once.#.exr", "once.json");
    part(&inputs[..2], "twice.#.exr", "twice.json");
    part(&inputs[2..], "rest.#.exr", "twice.json");
    let last = |name: &str| mean(folder.path(), name, "G");
    // Frames keep the numbers of their inputs.
    assert_eq!(last("once.4.exr").to_bits(), last("rest.4.exr").to_bits());
}

#[test]
fn an_hdr_display_gets_sixteen_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    write_step(folder.path(), "a.exr", 1.0, 1000.0);
    run(folder.path(), &["a.exr", "-o", "a.png", "--operator", "absolute", "--display", "hdr-1000"]);
    let image = image::open(folder.path().join("a.png")).expect("a picture");
    assert!(matches!(image, image::DynamicImage::ImageRgb16(_)));
    // 1000 cd/m² is code 0.7518 of 65535.
    let code = image.to_rgb16().get_pixel(60, 10).0[1];
    assert!((49_200..=49_320).contains(&code), "{code}");
}

#[test]
fn what_makes_no_sense_is_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    write_step(folder.path(), "a.exr", 1.0, 1000.0);
    let refused = |arguments: &[&str], fragment: &str| {
        let output = tonemap(folder.path(), arguments).output().expect("runs");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(fragment) && !message.contains("panicked"), "{arguments:?}: {message}");
    };
    refused(&["a.exr", "-o", "b.png", "--operator", "darkroom"], "constant-long");
    refused(&["a.exr", "a.exr", "-o", "b.png", "--operator", "ptyg"], "one run of #");
    refused(&["a.exr", "a.exr", "-o", "b.#.png", "--operator", "agx"], "does not know an eye that adapts");
    refused(&["a.exr", "-o", "b.png", "--operator", "ptyg", "--gaze", "64,3"], "outside");
    // Once an operator was named for it, it was refused all the same.
    let codes = folder.path().join("codes.png");
    image::RgbImage::from_pixel(2, 2, image::Rgb([9, 99, 200])).save(&codes).expect("written");
    for asked in [&[][..], &["--exposure", "1"], &["--operator", "agx"], &["--operator", "all"]] {
        refused(&[&["codes.png", "-o", "b.png"], asked].concat(), "codes.png: ready for a display already");
    }
    refused(&["a.exr", "-o", "./a.exr", "--operator", "agx"], "would replace a picture that is read");
    refused(&["a.exr", "-o", "b.exr", "--operator", "all"], "end the name in .png");
    refused(
        &["a.exr", "-o", "b.png", "--operator", "tr", "--adaptation", "local", "--adapted-to", "3"],
        "no course in time",
    );
    refused(&["a.exr", "-o", "b.png", "--operator", "agx", "--gaze", "3,3"], "wherever the eye looks");
    refused(&["a.exr", "-o", "b.png", "--operator", "tr", "--state", "no/state.json"], "no/state.json");
    refused(&["a.exr", "-o", "b.png", "--operator", "tr", "--fps", "5"], "no course in time");
    refused(&["a.exr", "-o", "b.png", "--fps", "5"], "name it by --operator");
    // A frame of so many seconds that no number holds them was no time at all.
    refused(
        &["a.exr", "-o", "b.png", "--operator", "ptyg", "--adapted-to", "3", "--fps", "1e-310"],
        "0.001 and 1000 frames",
    );
    for stops in ["nan", "inf", "-101"] {
        refused(&["a.exr", "-o", "b.png", "--operator", "srgb", "--exposure", stops], "is not a number of stops");
    }
    refused(&["a.exr", "-o", "b.png", "--operator", "wrp", "--effects", "none,glare"], "none stands alone");
    refused(&["a.exr", "-o", "b.png", "--operator", "ferwerda96", "--effects", "glare"], "does not show it");
    refused(&["a.exr", "-o", "b.png", "--operator", "agx", "--effects", "none"], "there are none");
    refused(&["a.exr", "-o", "b.png", "--operator", "agx", "--adaptation", "local"], "knows no places");
    let blinded = r#"{"cones":{"neural_cd_m2":1.0,"pigment":1.0},"rods":{"neural_cd_m2":1.0,"pigment":-0.5},
        "goal":{"cones_cd_m2":1.0,"rods_cd_m2":1.0}}"#;
    std::fs::write(folder.path().join("state.json"), blinded).expect("written");
    refused(&["a.exr", "-o", "b.png", "--operator", "ptyg", "--state", "state.json"], "not an eye's state");
    assert!(!folder.path().join("b.png").exists());
    for accepted in [["wrp", "glare,colour"], ["wrp", "none"], ["ferwerda96", "acuity,colour"], ["ferwerda96", "none"]]
    {
        run(folder.path(), &["a.exr", "-o", "b.png", "--operator", accepted[0], "--effects", accepted[1]]);
    }
}
