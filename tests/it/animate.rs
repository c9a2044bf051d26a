//! `fechner animate`: the same frames in any order and from any process, kept when they are there.

use crate::support::command::{self, fechner, said};
use std::collections::BTreeMap;
use std::path::Path;

/// A lamp, a floor and a ball that crosses in a second, under a camera that turns.
const SCENE: &str = r#"
nits_per_unit = 100.0
[film]
size = [24, 16]
[camera]
keyframes = [
    { time = 0.0, position = [0, 1, 4], look_at = [0, 0.6, 0] },
    { time = 1.0, position = [0.5, 1, 4], look_at = [0.2, 0.6, 0] },
]
[materials.grey]
type = "diffuse"
reflectance = [0.5, 0.5, 0.5]
[materials.lamp]
type = "diffuse"
reflectance = [0, 0, 0]
emission = [8, 8, 8]
[[objects]]
rectangle = { corner = [-4, 0, 4], edge_u = [8, 0, 0], edge_v = [0, 0, -8] }
material = "grey"
[[objects]]
rectangle = { corner = [-1, 3, -1], edge_u = [2, 0, 0], edge_v = [0, 0, 2] }
material = "lamp"
[[objects]]
sphere = { center = [0, 0.5, 0], radius = 0.5 }
material = "grey"
keyframes = [ { time = 0.0, translate = [-1, 0, 0] }, { time = 1.0, translate = [1, 0, 0] } ]
"#;

/// Runs `animate` in a folder that has the scene; what it said.
fn animate(folder: &Path, arguments: &[&str]) -> String {
    animate_scene(folder, SCENE, arguments)
}

/// The same with another scene.
fn animate_scene(folder: &Path, scene: &str, arguments: &[&str]) -> String {
    std::fs::write(folder.join("scene.toml"), scene).expect("written");
    let output = command::run(fechner().current_dir(folder).args(["animate", "scene.toml"]).args(arguments));
    said(&output)
}

/// Every picture and track in a folder. Records hold times, which differ.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder.join("out"))
        .expect("there are frames")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| !path.ends_with("shot.json") && !path.to_string_lossy().contains("shot.0"))
        .chain((0..4).map(|frame| folder.join(format!("out/shot.0{frame}.exr"))))
        .map(|path| {
            (path.to_string_lossy()[folder.to_string_lossy().len()..].to_owned(), std::fs::read(&path).expect("read"))
        })
        .collect()
}

#[test]
fn frames_do_not_depend_on_order_or_process() {
    for options in [&[][..], &["--eye", "saliency", "--velocity-of", "image"]] {
        let [at_once, backwards] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let common = [&["--fps", "4", "--visibility", "8", "-o", "out/shot.##.exr"], options].concat();
        animate(at_once.path(), &[&["--frames", "0..3", "--video", "out/shot.y4m"], &common[..]].concat());
        for frame in (0..4).rev() {
            let frames = format!("{frame}..{frame}");
            let last: &[&str] = if frame == 0 { &["--video", "out/shot.y4m"] } else { &[] };
            animate(
                backwards.path(),
                &[&["--frames", &frames, "--shot", "0..3", "--threads", "1"], &common[..], last].concat(),
            );
        }
        let (a, b) = (files(at_once.path()), files(backwards.path()));
        assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
        for (name, bytes) in &a {
            assert!(*bytes == b[name], "{name} differs {options:?}");
        }
        // Four frames of three bytes a pixel, and their headers.
        let video = &a["/out/shot.y4m"];
        assert!(video.len() > 4 * 3 * 24 * 16 && video.starts_with(b"YUV4MPEG2 W24 H16 F4:1"));
    }
}

/// A run that was broken off goes on with what is missing; another target makes frames anew.
#[test]
fn finished_frames_are_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["--frames", "0..1", "--spp", "16", "-o", "shot.##.png"];
    animate(folder.path(), &arguments);
    let frame = |number: u32| folder.path().join(format!("shot.0{number}.png"));
    let first = std::fs::read(frame(0)).expect("read");
    std::fs::remove_file(frame(1)).expect("removed");
    let said = animate(folder.path(), &arguments);
    assert!(said.contains("shot.00.png: is there") && !said.contains("shot.01.png: is there"), "{said}");
    assert!(frame(1).is_file() && std::fs::read(frame(0)).expect("read") == first);
    let said = animate(folder.path(), &["--frames", "0..1", "--spp", "17", "-o", "shot.##.png"]);
    assert!(!said.contains("is there"), "{said}");
}

/// A frame names its rate, even one that may be paused, and that is judged alike at any rate.
#[test]
fn frames_of_another_rate_are_made_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let said = |rate: &str| {
        let arguments = ["--frames", "0..0", "--spp", "4", "--pausable", "-o", "shot.##.exr", "--fps", rate];
        let still = SCENE.replace(
            "keyframes = [ { time = 0.0, translate = [-1, 0, 0] }, { time = 1.0, translate = [1, 0, 0] } ]",
            "",
        );
        let still = still.replace(
            "time = 1.0, position = [0.5, 1, 4], look_at = [0.2",
            "time = 1.0, position = [0, 1, 4], look_at = [0",
        );
        animate_scene(folder.path(), &still, &arguments)
    };
    said("24");
    assert!(said("24").contains("is there"));
    assert!(!said("60").contains("is there"));
}

/// The operator's settings are a frame's own as much as its name, from the command line and from the scene, budget or
/// not.
#[test]
fn another_exposure_makes_frames_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let frame = || std::fs::read(folder.path().join("shot.00.png")).expect("read");
    let brighter = format!("{SCENE}\n[view]\nexposure_stops = 3.0\n");
    for target in [["--visibility", "8"], ["--spp", "16"]] {
        let common = [&["--frames", "0..1", "-o", "shot.##.png"], &target[..]].concat();
        animate(folder.path(), &[&common, &["--exposure", "0"][..]].concat());
        let dark = frame();
        let said = animate(folder.path(), &[&common, &["--exposure", "3"][..]].concat());
        let bright = frame();
        assert!(!said.contains("is there") && bright != dark, "{said}");
        let said = animate(folder.path(), &common);
        assert!(!said.contains("is there") && frame() == dark, "{said}");
        let said = animate_scene(folder.path(), &brighter, &common);
        assert!(!said.contains("is there") && frame() == bright, "{said}");
    }
}

/// Pictures of another format, other settings or other bytes than their record's are frames to be made, for the shot
/// as well.
#[test]
fn what_a_run_would_make_otherwise_is_not_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let both = |spp: &str, name: &str| animate(at, &["--frames", "0..1", "--spp", spp, "-o", name]);
    let first = |spp: &str| animate(at, &["--frames", "0..0", "--shot", "0..1", "--spp", spp, "-o", "a.##.png"]);
    both("16", "a.##.png");
    assert!(both("16", "a.##.png").matches("is there").count() == 2 && at.join("a.contact.png").is_file());
    let said = both("16", "a.##.exr");
    assert!(!said.contains("is there"), "{said}");
    let said = both("16", "a.##.png");
    assert!(!said.contains("is there"), "the records are those of the .exr files: {said}");
    assert!(said.contains("a.00.png: its record is that of a.00.exr, made anew"), "{said}");
    // The second frame is of other settings, and what was written of the whole shot is of others than the first.
    let said = first("17");
    assert!(said.contains("frame 1 of the shot is not there yet"), "{said}");
    assert!(
        said.contains("of the shot as it was before, until all its frames are there: a.json, a.contact.png"),
        "{said}"
    );
    both("17", "a.##.png");
    let whole = std::fs::read(at.join("a.01.png")).expect("read");
    std::fs::write(at.join("a.01.png"), std::fs::read(at.join("a.00.png")).expect("read")).expect("written");
    let said = first("17");
    assert!(said.contains("frame 1 of the shot is not there yet"), "another picture under its record: {said}");
    let said = both("17", "a.##.png");
    assert!(said.contains("a.00.png: is there") && !said.contains("a.01.png: is there"), "{said}");
    assert!(std::fs::read(at.join("a.01.png")).expect("read") == whole);
    std::fs::remove_file(at.join("a.01.png")).expect("removed");
    let said = first("17");
    assert!(said.contains("frame 1 of the shot is not there yet"), "without its picture: {said}");
}

/// A change between the ends makes the track anew, and the frames that it shows in.
#[test]
fn an_edit_in_the_middle_is_rendered() {
    let folder = tempfile::tempdir().expect("a folder");
    let ball = |middle: &str| {
        let ends = "{ time = 0.0, translate = [-1, 0, 0] }, { time = 1.0, translate = [1, 0, 0] }";
        let moved = format!(
            "{{ time = 0.0, translate = [-1, 0, 0] }}, {{ time = 0.4, translate = [0, 0, 0] }}, \
             {{ time = 0.5, translate = {middle} }}, {{ time = 0.6, translate = [0, 0, 0] }}, \
             {{ time = 1.0, translate = [1, 0, 0] }}"
        );
        assert!(SCENE.contains(ends));
        SCENE.replace(ends, &moved)
    };
    let arguments = ["--frames", "0..4", "--fps", "4", "--spp", "16", "--operator", "linear", "-o", "out/shot.##.png"];
    let frame = |number: u32| std::fs::read(folder.path().join(format!("out/shot.0{number}.png"))).expect("read");
    animate_scene(folder.path(), &ball("[0, 0, 0]"), &arguments);
    let before: Vec<_> = (0..5).map(frame).collect();
    let said = animate_scene(folder.path(), &ball("[0, 0.8, 0]"), &arguments);
    assert!(said.contains("made anew"), "{said}");
    assert!(frame(2) != before[2] && !said.contains("shot.02.png: is there"), "{said}");
}

/// Frames for an HDR display hold other codes than a video does: both kinds of frames make the same one.
#[test]
fn videos_of_hdr_frames_are_not_hdr() {
    let folder = tempfile::tempdir().expect("a folder");
    let video = |ending: &str| {
        let (frames, name) = (format!("{ending}.##.{ending}"), format!("{ending}.y4m"));
        let arguments = ["--frames", "0..1", "--spp", "16", "--display", "hdr-1000", "-o", &frames, "--video", &name];
        animate(folder.path(), &arguments);
        std::fs::read(folder.path().join(name)).expect("a video")
    };
    let (of_png, of_exr) = (video("png"), video("exr"));
    assert_eq!(of_png.len(), of_exr.len());
    let far = of_png.iter().zip(&of_exr).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(far <= Some(2), "{far:?} codes apart");
}

/// Noise that is gone in the next frame may be stronger than in a picture that somebody looks at for long: 2.3 times
/// fewer samples, one seed's ratio scattering by 0.25.
#[test]
fn motion_needs_fewer_samples_than_a_pause() {
    let folder = tempfile::tempdir().expect("a folder");
    let samples = |arguments: &[&str]| -> f64 {
        let of_seed = |seed: u32| {
            let seed = seed.to_string();
            let always =
                ["--frames", "1..1", "--visibility", "0.5", "-o", "shot.##.png", "--fps", "60", "--seed", &seed];
            animate(folder.path(), &[&always, arguments].concat());
            let text = std::fs::read_to_string(folder.path().join("shot.01.json")).expect("a record");
            let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            record["report"]["samples_total"].as_f64().expect("a number")
        };
        (0..4).map(of_seed).sum()
    };
    let (moving, paused) = (samples(&[]), samples(&["--pausable"]));
    assert!(2.0 * moving < paused, "{moving} and {paused} samples");
}

/// Away from where viewers look, noise may stay: a corner that is looked at costs less than everything, and a frame
/// without a line as much as a shot without gazes.
#[test]
fn frames_are_judged_from_where_they_are_looked_at() {
    let folder = tempfile::tempdir().expect("a folder");
    let display = "name = \"wide\"\npixels_per_degree = 2.0\nwhite_cd_m2 = 200.0\nblack_cd_m2 = 0.2\n";
    std::fs::write(folder.path().join("wide.toml"), display).expect("written");
    let samples = |gazes: Option<&str>| {
        let mut arguments = vec!["--frames", "1..1", "--shot", "0..1", "--visibility", "2", "--display", "wide.toml"];
        arguments.extend(["-o", "shot.##.png"]);
        if let Some(gazes) = gazes {
            std::fs::write(folder.path().join("gaze.csv"), gazes).expect("written");
            arguments.extend(["--gaze", "gaze.csv"]);
        }
        animate(folder.path(), &arguments);
        let text = std::fs::read_to_string(folder.path().join("shot.01.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let told = |key: &str| record["report"][key].clone();
        (told("samples_total").as_u64().expect("a number"), told("eye"))
    };
    let (everywhere, anywhere) = samples(None);
    let (corner, looked_at) = samples(Some("frame,x,y\n1,0,15\n"));
    assert!(3 * corner < 2 * everywhere, "{corner} and {everywhere} samples");
    assert_eq!((anywhere.as_str(), looked_at.as_str()), (Some("anywhere"), Some("pixel 0,15")));
    assert_eq!(samples(Some("0,0,15\n")), (everywhere, anywhere));
}

/// Noise that an eye smears as it follows what moves may be stronger. Frames of another eye are made anew.
#[test]
fn eyes_that_follow_let_noise_be_stronger() {
    let folder = tempfile::tempdir().expect("a folder");
    let gaze: String = (0..3).map(|frame| format!("{frame},{},8\n", 4 + 8 * frame)).collect();
    std::fs::write(folder.path().join("gaze.csv"), gaze).expect("written");
    // Everything goes by, some three pixels a frame.
    let panned =
        SCENE.replace("look_at = [0.2, 0.6, 0]", "look_at = [1.5, 0.6, 0]").replace("time = 1.0", "time = 0.1");
    let samples_of_seed = |options: &[&str], seed: &str| {
        let always = ["--frames", "1..1", "--fps", "24", "--visibility", "0.25", "-o", "shot.##.png", "--seed", seed];
        let said = animate_scene(folder.path(), &panned, &[&always, options].concat());
        assert!(!said.contains("is there"), "{options:?}: {said}");
        let text = std::fs::read_to_string(folder.path().join("shot.01.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record["report"]["samples_total"].as_f64().expect("a number")
    };
    // Of one seed, which doublings a picture so small still needs is luck: 0.74 to 0.94 of the samples.
    let samples =
        |options: &[&str]| ["0", "1", "2", "3"].map(|seed| samples_of_seed(options, seed)).iter().sum::<f64>();
    let [rests, track, saliency] = ["none", "track", "saliency"].map(|eye| samples(&["--eye", eye]));
    eprintln!("of the samples for eyes at rest: track {:.2}, saliency {:.2}", track / rests, saliency / rests);
    // Saliency had 0.98 of the samples of tracking everything.
    assert!(track < 0.9 * rests && track <= 1.05 * saliency && saliency <= rests, "{rests} {saliency} {track}");
    let [still, watched] = ["none", "gaze"].map(|eye| samples(&["--gaze", "gaze.csv", "--eye", eye]));
    // The next frame's line alone says how fast the eye is.
    std::fs::write(folder.path().join("gaze.csv"), "0,4,8\n1,12,8\n2,13,8\n").expect("written");
    let slower = samples(&["--gaze", "gaze.csv", "--eye", "gaze"]);
    assert!(slower > watched, "{slower} {watched}");
    eprintln!("with a gaze that moves {:.2}", watched / still);
    assert!(watched < 0.6 * still, "{still} {watched}");
}

#[test]
fn bad_arguments_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    std::fs::write(folder.path().join("gaze.csv"), "frame,x,y\n0,1\n").expect("written");
    for (arguments, expected) in [
        (&["--frames", "5..2", "-o", "a.#.png"][..], "ends before it begins"),
        (&["--frames", "-3..2", "-o", "a.#.png"], "frames are numbered from 0"),
        (&["--frames", "0..2", "-o", "a.png"], "a sequence's name has one run of #"),
        (&["--frames", "0..2", "--shot", "1..2", "-o", "a.#.png"], "--frames reaches beyond --shot"),
        (&["--frames", "0..2", "-o", "a.#.png", "--video", "a.gif"], "videos end in .y4m or .mp4"),
        (&["--frames", "0..2", "-o", "a.#.png", "--video", "a.mp4/"], "this is a folder's name"),
        (&["--frames", "0..2", "-o", "a.#.png", "--video", "no/such.y4m"], "the folder no does not exist"),
        (&["--frames", "0..2", "-o", "a.#.png", "--operator", "sepia"], "constant-long"),
        (&["--frames", "0..2", "-o", "a.#.png", "--fps", "0.1"], "between 1 and 1000"),
        (&["--frames", "0..2", "-o", "a.#.png", "--gaze", "gaze.csv"], "line 2: \"0,1\" is not a frame's number"),
        (&["--frames", "0..2", "-o", "a.#.png", "--eye", "track", "--pausable"], "frames that may be paused"),
        (&["--frames", "0..2", "-o", "a.#.png", "--eye", "gaze"], "--gaze says where viewers look"),
        (&["--frames", "0..2", "-o", "a.#.png", "--velocity-of", "image"], "PNG frames hold no motion"),
    ] {
        let mut command = fechner();
        let output = command
            .current_dir(folder.path())
            .args(["animate", "scene.toml"])
            .args(arguments)
            .output()
            .expect("starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(expected), "{arguments:?}: {said}");
        assert!(!folder.path().join("a.0.png").exists(), "{arguments:?}: rendered before it was refused");
    }
}

/// A sequence does not differ from itself; flicker of its light does, and the same change that stays does not where
/// it is small.
#[test]
fn sequences_are_compared_as_they_move() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    animate(at, &["--frames", "0..3", "--fps", "24", "--spp", "4", "-o", "a.##.exr"]);
    animate(at, &["--frames", "0..3", "--fps", "24", "--spp", "4", "--seed", "7", "-o", "b.##.exr"]);
    let compare = |arguments: &[&str]| {
        let mut command = fechner();
        let output = command.current_dir(at).arg("compare").args(arguments).output().expect("it starts");
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        (output.status.code(), said)
    };
    let moving = ["--fps", "24", "--velocity", "a.##.exr"];
    let (status, said) = compare(&[&["a.##.exr", "a.##.exr"], &moving[..]].concat());
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("worst visibility 0.00 in frame 0 "), "the first of equals: {said}");
    let files = ["--map", "map.##.png", "--json", "figures.json"];
    let (status, said) = compare(&[&["a.##.exr", "b.##.exr"], &moving[..], &files].concat());
    assert_eq!(status, Some(1), "{said}");
    let figures: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at.join("figures.json")).expect("written")).expect("JSON");
    assert!(figures["worst_visibility"].as_f64().expect("a number") > 1.0 && figures["eye_follows"] == true);
    assert_eq!(figures["frames"].as_array().expect("frames").len(), 4);
    assert!((0..4).all(|frame| at.join(format!("map.0{frame}.png")).is_file()));
    for (arguments, expected) in [
        (&["a.##.exr", "b.##.exr"][..], "--fps"),
        (&["a.##.exr", "b.00.exr", "--fps", "24"], "has # for each digit"),
        (&["c.##.exr", "b.##.exr", "--fps", "24"], "no such files"),
        (&["a.00.exr", "b.00.exr", "--fps", "24"], "are for sequences"),
        (&["a.##.exr", "b.##.exr", "--fps", "24", "--csf", "daly98"], "only castle"),
    ] {
        let (status, said) = compare(arguments);
        assert!(status == Some(2) && said.contains(expected), "{arguments:?}: {said}");
    }
    // What only one of them has is named before anything is compared.
    std::fs::remove_file(at.join("b.03.exr")).expect("removed");
    for pair in [["a.##.exr", "b.##.exr"], ["b.##.exr", "a.##.exr"]] {
        let (status, said) = compare(&[&pair[..], &["--fps", "24"]].concat());
        let expected = "a.##.exr: frame 3 is there, and missing of b.##.exr";
        assert!(status == Some(2) && said.contains(expected), "{pair:?}: {said}");
    }
    let (status, said) = compare(&["a.##.exr", "a.##.exr", "--fps", "24", "--velocity", "b.##.exr"]);
    assert!(status == Some(2) && said.contains("missing of b.##.exr"), "{said}");
}

/// The largest number of a frame, after which there is none.
#[test]
fn the_last_frames_are_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    animate(at, &["--frames", "4294967294..4294967295", "--spp", "16", "-o", "a.##.exr"]);
    let mut command = fechner();
    let output = command.current_dir(at).args(["compare", "a.##.exr", "a.##.exr", "--fps", "24"]).output();
    let output = output.expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A table of another shot's frames is a slip where the eye is to follow it.
#[test]
fn a_gaze_table_says_something_of_the_shot() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("scene.toml"), SCENE).expect("written");
    let say = |table: &str, eye: &str| {
        std::fs::write(at.join("gaze.csv"), table).expect("written");
        let mut command = fechner();
        let asked = ["--frames", "0..1", "--spp", "16", "--gaze", "gaze.csv", "--eye", eye, "-o", "a.##.png"];
        let output = command.current_dir(at).args(["animate", "scene.toml"]).args(asked).output().expect("it starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    // With the eye at rest all of these were taken, with a note at most.
    for (table, expected) in [
        ("100,4,8\n101,4,8\n", "says nothing of frames 0 to 1: it has lines of frames 100 to 101"),
        ("frame,x,y\n", "it has no line of any frame"),
        ("", "it has no line of any frame"),
        ("0,4,8\n1,1e6,8\n", "gaze.csv: line 2: 1000000,8 is outside "),
    ] {
        for eye in ["gaze", "none"] {
            let (status, said) = say(table, eye);
            assert!(status == Some(2) && said.contains(expected), "{table}: {said}");
        }
    }
    let (status, said) = say("0,4,8\n", "none");
    assert!(status == Some(0) && said.contains("says of 1 of 2 frames"), "{said}");
    let (status, said) = say("\u{feff}0,4,8\n1,4,8\n", "gaze");
    assert!(status == Some(0) && !said.contains("says of"), "{said}");
}

/// A lamp that is off at first: black frames, and light in the later ones.
#[test]
fn a_shot_may_begin_in_the_dark() {
    let folder = tempfile::tempdir().expect("a folder");
    let glow = "keyframes = [ { time = 0, emission = [0, 0, 0] }, { time = 0.05, emission = [0, 0, 0] }, { time = 0.1, emission = [8, 8, 8] } ]";
    let scene = SCENE.replace("emission = [8, 8, 8]", glow);
    animate_scene(folder.path(), &scene, &["--frames", "0..2", "--spp", "16", "-o", "a.##.png"]);
    let brightest = |frame: u32| {
        let picture = image::open(folder.path().join(format!("a.0{frame}.png"))).expect("a picture").to_rgb8();
        picture.pixels().map(|pixel| pixel.0[1]).max()
    };
    assert_eq!(brightest(0), Some(0));
    assert!(brightest(2) > Some(100));
}

/// Whichever sequence holds the scene's light is shown as it was rendered: it looks like its own frames for the
/// display, where eyes adapt from frame to frame, too. An operator that is asked for is fitted to it, whether it is
/// the reference or not.
#[test]
fn a_sequence_for_the_display_is_compared_with_one_of_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let worst = |files: [&str; 2], more: &[&str]| {
        let mut command = fechner();
        let arguments = ["compare", files[0], files[1], "--fps", "24", "--json", "figures.json"];
        let output = command.current_dir(at).args([&arguments[..], more].concat()).output().expect("it starts");
        assert!(output.status.code() < Some(2), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read(at.join("figures.json")).expect("written");
        let figures: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        figures["worst_visibility"].as_f64().expect("a number")
    };
    for (name, how) in [("plain", &["--exposure", "-1"][..]), ("eyes", &["--operator", "pattanaik00"])] {
        let [light, display] = ["exr", "png"].map(|ending| format!("{name}.##.{ending}"));
        for output in [&light, &display] {
            animate(at, &[&["--frames", "0..1", "--fps", "24", "--spp", "64", "-o", output], how].concat());
        }
        for files in [[&*light, &display], [&display, &light]] {
            let kept = worst(files, &[]);
            assert!(kept < 1.5, "{files:?}: {kept}");
        }
    }
    let swapped = [["plain.##.exr", "plain.##.png"], ["plain.##.png", "plain.##.exr"]];
    let fitted = swapped.map(|files| worst(files, &["--operator", "constant"]));
    assert!((fitted[0] / fitted[1]).ln().abs() < 0.7, "{fitted:?} by one operator");
}

/// A lamp over a floor that is bright in frame 7 of 24 a second alone, which equal steps would miss.
const FLASH: &str = r#"
nits_per_unit = 100.0
[film]
size = [16, 12]
[view]
display = "desktop"
[camera]
position = [0, 1.2, 5]
look_at = [0, 1, 0]
vertical_fov_deg = 35
[materials.grey]
type = "diffuse"
reflectance = [0.6, 0.6, 0.6]
[materials.lamp]
type = "diffuse"
reflectance = [0, 0, 0]
emission_color = [1, 0.9, 0.7]
keyframes = [
    { time = 0.0, power_lm = 0.5 },
    { time = 0.27, power_lm = 0.5 },
    { time = 0.285, power_lm = 1500 },
    { time = 0.30, power_lm = 1500 },
    { time = 0.315, power_lm = 0.5 },
]
[[objects]]
rectangle = { corner = [-2, 0, 2], edge_u = [4, 0, 0], edge_v = [0, 0, -4] }
material = "grey"
[[objects]]
rectangle = { corner = [-0.4, 2.5, -0.4], edge_u = [0.8, 0, 0], edge_v = [0, 0, 0.8] }
material = "lamp"
[[objects]]
box = { min = [-0.3, 0, -0.3], max = [0.3, 0.9, 0.3] }
material = "grey"
"#;

/// A frame that is lit alone has what it needs of the shot's budget, if that is enough.
#[test]
fn a_flash_has_its_share_of_a_budget() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    animate_scene(
        at,
        FLASH,
        &["--frames", "6..8", "--shot", "0..11", "--visibility", "1", "--spp", "48", "-o", "f.##.png"],
    );
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(at.join(name)).expect("written")).expect("JSON")
    };
    let track = json("f.track.json");
    let shares: Vec<u64> = track["frames"]
        .as_array()
        .expect("frames")
        .iter()
        .map(|frame| frame["mean_samples"].as_u64().expect("a share"))
        .collect();
    assert_eq!(shares.iter().sum::<u64>(), 12 * 48);
    for frame in [6, 7, 8] {
        let report = &json(&format!("f.{frame:02}.json"))["report"];
        assert_eq!(report["stop_reason"], "visibility", "frame {frame} of {shares:?}: {report}");
    }
    let dark = shares.iter().enumerate().filter(|&(frame, _)| frame != 7).map(|(_, &share)| share);
    assert!(shares[7] > 2 * dark.max().expect("frames"), "{shares:?}");
}

/// Where the first look takes most of a budget of time, that is said, and what helps.
#[test]
fn little_time_that_is_left_for_the_frames_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let said = |time: &str| {
        animate(folder.path(), &["--frames", "0..1", "--visibility", "16", "--time", time, "-o", "a.##.png"])
    };
    let little = said("0.001");
    assert!(little.contains("It is kept: stop and call again, or give more --time."), "{little}");
    let enough = said("20");
    assert!(!enough.contains("are left for the frames"), "{enough}");
}

/// A budget of the shot adds up, whoever renders which of its frames; a whole shot has a contact sheet.
#[test]
fn a_budget_is_the_whole_shots() {
    let [at_once, alone] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let common = ["--fps", "4", "--spp", "24", "-o", "out/shot.##.exr"];
    animate(at_once.path(), &[&["--frames", "0..3"], &common[..]].concat());
    animate(alone.path(), &[&["--frames", "2..2", "--shot", "0..3", "--threads", "1"], &common[..]].concat());
    let bytes = |folder: &Path| std::fs::read(folder.join("out/shot.02.exr")).expect("read");
    assert!(bytes(at_once.path()) == bytes(alone.path()), "frame 2 differs");
    let json = |name: &str| -> serde_json::Value {
        let text = std::fs::read_to_string(at_once.path().join("out").join(name)).expect("written");
        serde_json::from_str(&text).expect("JSON")
    };
    let track = json("shot.track.json");
    let shares =
        track["frames"].as_array().expect("frames").iter().map(|f| f["mean_samples"].as_u64().expect("a share"));
    assert_eq!(shares.sum::<u64>(), 4 * 24);
    let shot = json("shot.json");
    let spent =
        shot.as_array().expect("frames").iter().map(|f| f["report"]["samples_total"].as_u64().expect("a count"));
    assert!(spent.sum::<u64>() <= 4 * 25 * 24 * 16);
    let sheet = image::open(at_once.path().join("out/shot.contact.png")).expect("a contact sheet");
    // Two by two, 4 pixels between them and around.
    assert_eq!((sheet.width(), sheet.height()), (2 * 24 + 12, 2 * 16 + 12));
    assert!(!alone.path().join("out/shot.contact.png").exists());
    // By time, uniform: the scene's visibility, reached at once, is not what ends it.
    std::fs::write(at_once.path().join("easy.toml"), format!("{SCENE}[view]\nvisibility = 50.0\n")).expect("written");
    let mut command = fechner();
    command.args([
        "animate",
        "easy.toml",
        "--frames",
        "0..0",
        "--time",
        "0.3",
        "--sampling",
        "uniform",
        "-o",
        "even/a.#.png",
    ]);
    command::run(command.current_dir(at_once.path()));
    let even = json("../even/a.json");
    assert!(even[0]["report"]["visibility_target"].is_null(), "{even}");
    assert_eq!(even[0]["report"]["stop_reason"], "time");
    // By time: every frame has its pilot at the least.
    let said = animate(at_once.path(), &["--frames", "0..1", "--time", "0.2", "-o", "time.##.png"]);
    assert!(said.contains("time.01.png: ") && said.contains("spp in"), "{said}");
}
