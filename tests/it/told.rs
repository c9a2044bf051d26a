//! What `fechner compare` and `threshold` say of pictures that they refuse, or heed in part.

use crate::displayed::{SIDE, fechner, run, write};
use crate::support::command::cornell_box;
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage as _};
use fechner::exr_read::read_exr;
use fechner::output::{Attribute, NITS_PER_UNIT, PIXEL_ASPECT_RATIO, Picture, write_exr, write_png};

/// Motion that is no number rests, as before, and is told.
#[test]
fn motion_that_is_no_number_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.exr", |_| [50.0; 3]);
    for (name, bad, is_told) in [("still.exr", 0.0, false), ("bad.exr", f32::NAN, true)] {
        // Our own writer would put a number in its place.
        let across: Vec<f32> = (0..SIDE * SIDE).map(|pixel| if pixel == 0 { bad } else { 1.0 }).collect();
        let channel = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
        let channels = [channel("velocity.X", across), channel("velocity.Y", vec![0.0; SIDE * SIDE])];
        let motion = Image::from_channels((SIDE, SIDE), AnyChannels::sort(channels.into_iter().collect()));
        motion.write().to_file(folder.path().join(name)).expect("written");
        let said = run(folder.path(), &["threshold", "a.exr", "-o", "t.exr", "--velocity", name]);
        assert_eq!(said.contains("motion that is not finite"), is_told, "{said}");
    }
}

/// Motion to the frame before alone was refused by a message that had it among those that are known.
#[test]
fn motion_to_the_frame_before_alone_is_heeded() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.exr", |_| [50.0; 3]);
    let motion = |name: &str, channels: [&str; 2], pixels_a_frame: [f32; 2]| {
        let mut picture = Picture::new(SIDE as u32, SIDE as u32);
        channels.iter().zip(pixels_a_frame).for_each(|(name, value)| picture.push_f32(name, vec![value; SIDE * SIDE]));
        write_exr(&folder.path().join(name), &picture).expect("written");
        let threshold = ["threshold", "a.exr", "-o", "t.exr", "--velocity", name];
        let said = run(folder.path(), &threshold);
        let seen = read_exr(&folder.path().join("t.exr")).expect("read");
        (seen.channel("threshold.Y").expect("thresholds").to_vec(), said)
    };
    let (forward, said) = motion("forward.exr", ["velocity.X", "velocity.Y"], [3.0, 1.0]);
    assert!(!said.contains("before alone"), "{said}");
    let (still, _) = motion("still.exr", ["velocity.X", "velocity.Y"], [0.0; 2]);
    let most_apart =
        |one: &[f32], other: &[f32]| one.iter().zip(other).fold(0.0, |most: f32, (a, b)| most.max((a / b - 1.0).abs()));
    let apart = most_apart(&forward, &still);
    assert!(apart > 1e-3, "what moves is seen otherwise than what rests: {apart}");
    for channels in [["backward.u", "backward.v"], ["velocity_previous.X", "velocity_previous.Y"]] {
        let (backward, said) = motion("before.exr", channels, [3.0, 1.0]);
        // Upwards in the one is downwards in the other, which beside the middle is not quite as fast.
        assert!(most_apart(&backward, &forward) < 1e-4, "as fast the other way");
        assert!(said.contains("note: before.exr: it has motion to the frame before alone"), "{said}");
        let layer = channels[0].split('.').next().expect("a layer");
        assert!(said.contains(&format!("motion from the channels of {layer} at")), "{said}");
    }
}

/// It became black without a word.
#[test]
fn light_below_zero_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.exr", |pixel| if pixel < 3 { [-5.0; 3] } else { [50.0, 50.0, -5.0] });
    write(folder.path(), "wide.exr", |_| [50.0, 50.0, -5.0]);
    let said = "note: a.exr: luminance below 0 in 3 pixels was replaced by black";
    for arguments in [
        &["threshold", "a.exr", "-o", "t.exr"][..],
        &["tonemap", "a.exr", "-o", "t.png", "--operator", "agx"],
        &["compare", "wide.exr", "a.exr"],
    ] {
        let (_, words) = fechner(folder.path(), arguments);
        assert_eq!(words.matches("luminance below 0").count(), 1, "{words}");
        assert!(words.contains(said), "{words}");
    }
}

/// Frames of one sequence have one shape.
#[test]
fn pixels_that_change_their_shape_are_no_sequence() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, wide: f32| {
        let mut picture = Picture::new(16, 16);
        ["R", "G", "B"].into_iter().for_each(|letter| picture.push_f32(letter, vec![20.0; 256]));
        picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
        picture.push_attribute(PIXEL_ASPECT_RATIO, Attribute::Float(wide));
        write_exr(&folder.path().join(name), &picture).expect("written");
    };
    for (frame, wide) in [(1, 1.0), (2, 1.0), (3, 2.0)] {
        write(&format!("a.{frame}.exr"), wide);
        write(&format!("b.{frame}.exr"), wide);
    }
    let (code, said) = fechner(folder.path(), &["compare", "a.#.exr", "b.#.exr", "--fps", "24"]);
    assert!(code == 2 && said.contains("a.3.exr 2 times"), "{said}");
}

/// Where no noise is predicted an audit has nothing to compare with: it said "1.00 ± inf times".
#[test]
fn an_audit_of_no_noise_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let wall = r#"
        [film]
        size = [208, 208]
        [camera]
        position = [0, 0, 5]
        look_at = [0, 0, 0]
        [environment]
        luminance_cd_m2 = 100
        [materials.white]
        type = "diffuse"
        reflectance = [0.73, 0.73, 0.73]
        [[objects]]
        rectangle = { corner = [-5, -5, -1], edge_u = [10, 0, 0], edge_v = [0, 10, 0] }
        material = "white"
    "#;
    std::fs::write(folder.path().join("wall.toml"), wall).expect("written");
    let said = run(folder.path(), &["render", "wall.toml", "-o", "wall.png", "--json", "wall.json"]);
    assert!(said.contains("Audit: nothing is predicted to show in ") && !said.contains("inf"), "{said}");
    let told = std::fs::read_to_string(folder.path().join("wall.json")).expect("written");
    assert!(told.contains("\"audit_ratio\": null"), "{told}");
}

/// "after 1 plans", it said.
#[test]
fn one_is_told_as_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &cornell_box().display().to_string();
    let film = ["--checkpoint", "a.film"];
    let one = ["render", scene, "-o", "a.png", "--size", "1x1", "--sampling", "uniform", "--spp", "1"];
    for arguments in [&[&one[..], &film].concat()[..], &["info", "a.film"]] {
        let said = run(folder.path(), arguments);
        let words: Vec<&str> = said.split_whitespace().map(|word| word.trim_matches(['.', ',', ';', ':'])).collect();
        let of_one = |what: &str| words.windows(2).any(|pair| pair == ["1", what]);
        assert!(of_one("plan"), "{said}");
        assert!(!["plans", "samples", "times", "pixels"].into_iter().any(of_one), "{said}");
    }
}

/// What tells nothing of noise is not taken for its absence: halves of one seed, one sample, a denoised crop of one
/// pixel.
#[test]
fn what_tells_nothing_of_noise_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = &cornell_box().display().to_string();
    let render = |more: &[&str]| {
        let common = ["render", scene, "--sampling", "uniform", "--json", "j.json"];
        run(folder.path(), &[&common[..], more].concat());
        let text = std::fs::read_to_string(folder.path().join("j.json")).expect("written");
        serde_json::from_str::<serde_json::Value>(&text).expect("JSON")
    };
    render(&["--size", "16x16", "--spp", "1", "-o", "one.exr"]);
    let variance = read_exr(&folder.path().join("one.exr")).expect("an EXR file");
    assert!(variance.channel("variance.Y").expect("the channel").iter().all(|&variance| variance == f32::MAX));
    let (code, said) =
        fechner(folder.path(), &["threshold", "one.exr", "--halves", "one.exr", "one.exr", "-o", "t.exr"]);
    assert!(code == 2 && said.contains("one seed") && !folder.path().join("t.exr").exists(), "{said}");
    let crop = ["--size", "256x256", "--crop", "20,20,1,1", "--spp", "4", "-o", "a.png"];
    let seen = |figures: serde_json::Value| figures["visibility_p99"].as_f64().expect("known");
    let (raw, denoised) = (seen(render(&crop)), seen(render(&[&crop[..], &["--denoise", "builtin"]].concat())));
    assert!(denoised >= 0.99 * raw && raw > 1.0, "{denoised} denoised, {raw} raw");
}

/// What values mean goes by a file's ending, so that its bytes must be of that kind, and whole.
#[test]
fn files_of_another_kind_and_cut_off_ones_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |name: &str, expected: &str| {
        let (code, said) = fechner(folder.path(), &["compare", name, name, "--nits-per-unit", "100"]);
        assert!(code == 2 && said.contains(name) && said.contains(expected), "{name}: {said}");
    };
    let png = folder.path().join("a.png");
    write_png(&png, SIDE as u32, SIDE as u32, &[[0.18; 3]; SIDE * SIDE]).expect("written");
    std::fs::copy(&png, folder.path().join("b.hdr")).expect("copied");
    refused("b.hdr", "of another kind (.png)");
    let photo = folder.path().join("c.jpg");
    image::open(&png).expect("read").into_rgb8().save(&photo).expect("written");
    let (code, said) = fechner(folder.path(), &["compare", "c.jpg", "c.jpg"]);
    assert_eq!(code, 0, "{said}");
    let bytes = std::fs::read(&photo).expect("read");
    std::fs::write(&photo, &bytes[..bytes.len() * 9 / 10]).expect("written");
    refused("c.jpg", "is cut off");
}

/// What has no end was read until memory ended, and a pipe for ever.
#[cfg(unix)]
#[test]
fn what_has_no_end_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.exr", |_| [50.0; 3]);
    std::fs::write(folder.path().join("s.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").expect("written");
    std::fs::create_dir(folder.path().join("farm")).expect("made");
    for name in ["z.exr", "z.hdr", "z.png", "z.jpg", "z.csv", "z.toml", "z.film", "farm/manifest.json"] {
        std::os::unix::fs::symlink("/dev/zero", folder.path().join(name)).expect("a link");
    }
    let shot = ["animate", "s.obj", "--frames", "0..1", "--size", "8x8", "-o", "f.#.exr"];
    let render = ["render", "s.obj", "--size", "8x8", "-o", "o.exr"];
    for arguments in [
        &["compare", "a.exr", "z.exr"][..],
        &["compare", "a.exr", "z.hdr", "--nits-per-unit", "1"],
        &["compare", "a.exr", "z.png"],
        &["compare", "a.exr", "z.jpg"],
        &["threshold", "a.exr", "-o", "t.exr", "--velocity", "z.exr"],
        &["tonemap", "a.exr", "-o", "t.png", "--display", "z.toml"],
        &["merge", "z.film", "z.film", "-o", "m.film"],
        &["info", "z.film"],
        &["farm", "status", "farm"],
        &[&render[..], &["--importance", "z.png"]].concat(),
        &[&shot[..], &["--gaze", "z.csv"]].concat(),
    ] {
        let (code, said) = fechner(folder.path(), arguments);
        assert!(code == 2 && said.contains("is not a regular file"), "{arguments:?}: {said}");
    }
}

/// What headers say and cannot be is told, and is as if it were not there.
#[test]
fn headers_that_say_what_cannot_be_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let hdr = b"#?RADIANCE\nEXPOSURE=nan\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80";
    std::fs::write(folder.path().join("a.hdr"), hdr).expect("written");
    let (_, said) = fechner(folder.path(), &["compare", "a.hdr", "a.hdr", "--nits-per-unit", "1"]);
    assert!(said.contains("its EXPOSURE says what cannot be, and is not looked at"), "{said}");
    for (name, attribute, expected) in [
        ("n.exr", (NITS_PER_UNIT, Attribute::Float(-5.0)), "nits_per_unit -5 is not a luminance"),
        ("d.exr", ("fechner.display", Attribute::Text("{".to_owned())), "its fechner.display cannot be read"),
    ] {
        let mut picture = Picture::new(16, 16);
        for channel in ["R", "G", "B"] {
            picture.push_f32(channel, vec![0.5; 256]);
        }
        picture.push_attribute(attribute.0, attribute.1);
        write_exr(&folder.path().join(name), &picture).expect("written");
        let (code, said) = fechner(folder.path(), &["compare", name, name, "--nits-per-unit", "100"]);
        assert!(code == 0 && said.contains(expected), "{name}: {said}");
    }
}

/// What is no picture to look at is refused.
#[test]
fn a_map_is_a_png() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a.exr", |_| [1.0; 3]);
    let (code, said) = fechner(folder.path(), &["compare", "a.exr", "a.exr", "--map", "map.exr"]);
    assert!(code == 2 && said.contains("end the name in .png"), "{code}: {said}");
}

/// Two pictures are two, whatever their names: only frames of a sequence share a note.
#[test]
fn a_note_is_said_of_each_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["v1.png", "v2.png", "shot-01.png", "shot-02.png"] {
        image::RgbaImage::from_pixel(8, 8, image::Rgba([90, 90, 90, 128]))
            .save(folder.path().join(name))
            .expect("written");
    }
    let notes = |arguments: &[&str]| run(folder.path(), arguments).matches("what is transparent").count();
    assert_eq!(notes(&["compare", "v1.png", "v2.png"]), 2);
    assert_eq!(notes(&["compare", "shot-##.png", "shot-##.png", "--fps", "30"]), 1);
    for (own, other) in [("v1/f.##.png", "v2/f.##.png"), ("f1.##.png", "f2.##.png")] {
        for frame in ["01", "02"] {
            for name in [own, other].map(|name| folder.path().join(name.replace("##", frame))) {
                std::fs::create_dir_all(name.parent().expect("a folder")).expect("made");
                std::fs::copy(folder.path().join("v1.png"), name).expect("copied");
            }
        }
        assert_eq!(notes(&["compare", own, other, "--fps", "30"]), 2, "{own}");
    }
}

/// What changes nothing of pictures that are ready for the display is told, and what shows a scene's light is not.
#[test]
fn idle_arguments_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["1.png", "2.png"] {
        write_png(&folder.path().join(name), SIDE as u32, SIDE as u32, &[[0.18; 3]; SIDE * SIDE]).expect("written");
    }
    write(folder.path(), "1.exr", |_| [10.0; 3]);
    let more = ["--operator", "agx", "--nits-per-unit", "3"];
    let (code, told) = fechner(folder.path(), &[&["compare", "1.png", "2.png"], &more[..]].concat());
    assert_eq!(code, 0, "{told}");
    for argument in ["--operator", "--nits-per-unit"] {
        assert!(told.contains(&format!("note: {argument} changes nothing: 1.png")), "{told}");
    }
    for (csf, is_told) in [("castle", false), ("laird06", true)] {
        let (_, told) = fechner(folder.path(), &["compare", "1.png", "2.png", "--csf", csf, "--csf-area", "7"]);
        assert_eq!(told.contains("note: --csf-area changes only what is seen of colours"), is_told, "{told}");
    }
    for pictures in [["compare", "1.exr", "1.exr"], ["compare", "1.png", "1.exr"]] {
        let (_, told) = fechner(folder.path(), &[&pictures[..], &more].concat());
        assert!(!told.contains("changes nothing"), "{told}");
    }
}
