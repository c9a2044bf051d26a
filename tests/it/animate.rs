//! `fechner animate`: the same frames in any order and from any process, kept when they are there.

use assert_cmd::Command;
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
    std::fs::write(folder.join("scene.toml"), SCENE).expect("written");
    let output = Command::cargo_bin("fechner")
        .expect("the binary is built")
        .current_dir(folder)
        .args(["animate", "scene.toml"])
        .args(arguments)
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    said
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
    let [at_once, backwards] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let common = ["--fps", "4", "--visibility", "8", "-o", "out/shot.##.exr"];
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
        assert!(*bytes == b[name], "{name} differs");
    }
    // Four frames of three bytes a pixel, and their headers.
    assert!(a["/out/shot.y4m"].len() > 4 * 3 * 24 * 16 && a["/out/shot.y4m"].starts_with(b"YUV4MPEG2 W24 H16 F4:1"));
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

/// Noise that is gone in the next frame may be stronger than in a picture that somebody looks at for long: 2.3 times fewer samples, one
/// seed's ratio scattering by 0.25.
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

/// Away from where viewers look, noise may stay: a corner that is looked at costs less than everything, and a frame without a line
/// as much as a shot without gazes.
#[test]
fn frames_are_judged_from_where_they_are_looked_at() {
    let folder = tempfile::tempdir().expect("a folder");
    let display = "name = \"wide\"\npixels_per_degree = 2.0\nwhite_cd_m2 = 200.0\nblack_cd_m2 = 0.2\n";
    std::fs::write(folder.path().join("wide.toml"), display).expect("written");
    let samples = |gazes: Option<&str>| {
        let mut arguments =
            vec!["--frames", "1..1", "--visibility", "2", "--display", "wide.toml", "-o", "shot.##.png"];
        if let Some(gazes) = gazes {
            std::fs::write(folder.path().join("gaze.csv"), gazes).expect("written");
            arguments.extend(["--gaze", "gaze.csv"]);
        }
        animate(folder.path(), &arguments);
        let text = std::fs::read_to_string(folder.path().join("shot.01.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        record["report"]["samples_total"].as_u64().expect("a number")
    };
    let everywhere = samples(None);
    let corner = samples(Some("frame,x,y\n1,0,15\n"));
    assert!(3 * corner < 2 * everywhere, "{corner} and {everywhere} samples");
    assert_eq!(samples(Some("0,0,15\n")), everywhere);
}

#[test]
fn bad_arguments_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.toml"), SCENE).expect("written");
    std::fs::write(folder.path().join("gaze.csv"), "frame,x,y\n0,1\n").expect("written");
    for (arguments, expected) in [
        (&["--frames", "5..2", "-o", "a.#.png"][..], "not a range of frames"),
        (&["--frames", "0..2", "-o", "a.png"], "a sequence's name has #"),
        (&["--frames", "0..2", "--shot", "1..2", "-o", "a.#.png"], "--frames reaches beyond --shot"),
        (&["--frames", "0..2", "-o", "a.#.png", "--video", "a.gif"], "videos end in .y4m or .mp4"),
        (&["--frames", "0..2", "-o", "a.#.png", "--operator", "sepia"], "no tone operator"),
        (&["--frames", "0..2", "-o", "a.#.png", "--fps", "0.1"], "between 1 and 1000"),
        (&["--frames", "0..2", "-o", "a.#.png", "--gaze", "gaze.csv"], "line 2: \"0,1\" is not a frame's number"),
    ] {
        let mut command = Command::cargo_bin("fechner").expect("the binary is built");
        let output = command
            .current_dir(folder.path())
            .args(["animate", "scene.toml"])
            .args(arguments)
            .output()
            .expect("starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains(expected), "{arguments:?}: {said}");
    }
}

/// A sequence does not differ from itself; flicker of its light does, and the same change that stays does not where it is
/// small.
#[test]
fn sequences_are_compared_as_they_move() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    animate(at, &["--frames", "0..3", "--fps", "24", "--spp", "16", "-o", "a.##.exr"]);
    animate(at, &["--frames", "0..3", "--fps", "24", "--spp", "16", "--seed", "7", "-o", "b.##.exr"]);
    let compare = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("fechner").expect("the binary is built");
        let output = command.current_dir(at).arg("compare").args(arguments).output().expect("it starts");
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        (output.status.code(), said)
    };
    let moving = ["--fps", "24", "--velocity", "a.##.exr"];
    let (status, said) = compare(&[&["a.##.exr", "a.##.exr"], &moving[..]].concat());
    assert_eq!(status, Some(0), "{said}");
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
    let mut command = Command::cargo_bin("fechner").expect("the binary is built");
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
    assert!(command.current_dir(at_once.path()).output().expect("starts").status.success());
    let even = json("../even/a.json");
    assert!(even[0]["report"]["visibility_target"].is_null(), "{even}");
    assert_eq!(even[0]["report"]["stop_reason"], "time");
    // By time: every frame has its pilot at the least.
    let said = animate(at_once.path(), &["--frames", "0..1", "--time", "0.2", "-o", "time.##.png"]);
    assert!(said.contains("time.01.png: ") && said.contains("spp in"), "{said}");
}
