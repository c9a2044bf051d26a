//! What viewers ask for while something else is under way, and what becomes of it.

use super::{View, Viewer, cornell_box, is_stopped};
use serde_json::{Value, json};
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

fn orbit() -> Value {
    json!({ "do": "camera", "by": "orbit", "right": 0.3, "up": 0.1 })
}

/// What is asked for while the camera moves is done to the picture that it moves to, once that has something
/// everywhere.
#[test]
fn a_picture_in_motion_is_stopped_paused_and_saved_where_it_comes_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of(&cornell_box(), folder.path(), &["--visibility", "0.05"]);
    let mut viewer = view.viewer();
    let home = viewer.status("a plan", |status| !status["rung"].is_null());
    viewer.send(&orbit());
    let saved = viewer.saved(folder.path(), "exr", "cornell-box-1.exr");
    let picture = fechner::exr_read::decode_exr(Path::new("saved"), &saved).expect("a picture");
    let samples = picture.channel("samples.Y").expect("samples");
    assert!(samples.iter().all(|&samples| samples >= 2.0), "{samples:?}");
    let normals = |picture: &fechner::exr_read::ExrImage| picture.channel("normal.Z").expect("normals").to_vec();
    viewer.send(&json!({ "do": "pause" }));
    viewer.status("a rest", |status| status["phase"] == "paused");
    let at_rest = viewer.saved(folder.path(), "exr", "cornell-box-2.exr");
    let at_rest = fechner::exr_read::decode_exr(Path::new("saved"), &at_rest).expect("a picture");
    assert_eq!(normals(&at_rest).len(), normals(&picture).len());
    let alike = normals(&at_rest).iter().zip(normals(&picture)).filter(|(a, b)| (**a - b).abs() < 0.1).count();
    assert!(alike > 900, "of another camera: {alike} normals of 1024 are alike");

    for (rest, phase) in [("pause", "paused"), ("stop", "stopped")] {
        viewer.send(&json!({ "do": "resume" }));
        viewer.status("going on", |status| status["phase"] == "rendering");
        viewer.send(&orbit());
        viewer.send(&json!({ "do": rest }));
        let status = viewer.status(rest, |status| status["phase"] == phase);
        assert_ne!(status["camera"], home["camera"]);
        assert!(status["total_samples"].as_u64() >= Some(2048), "{rest}: {status}");
    }
}

/// A pause in the first pass does not make files of black pixels: that pass is traced to its end for a file, and the
/// pause goes on.
#[test]
fn a_picture_that_was_paused_early_is_saved_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of_size("320x240", &cornell_box(), folder.path(), &["--visibility", "1"]);
    let mut viewer = view.viewer();
    let early = |status: &Value| status["phase"] == "paused" && status["mean_samples"].as_f64() < Some(2.0);
    let pause = |viewer: &mut Viewer| {
        viewer.status("the first samples", |status| {
            status["phase"] == "rendering"
                && status["mean_samples"].as_f64().is_some_and(|mean| mean > 0.0 && mean < 2.0)
        });
        viewer.send(&json!({ "do": "pause" }));
        viewer.status("an early rest", early);
    };
    pause(&mut viewer);
    let saved = viewer.saved(folder.path(), "exr", "cornell-box-1.exr");
    let picture = fechner::exr_read::decode_exr(Path::new("saved"), &saved).expect("a picture");
    let samples = picture.channel("samples.Y").expect("samples");
    let unseen = samples.iter().filter(|&&samples| samples < 2.0).count();
    assert_eq!(unseen, 0, "pixels without samples");
    viewer.status("the rest again", |status| status["phase"] == "paused");
    viewer.send(&json!({ "do": "restart" }));
    pause(&mut viewer);
    viewer.send(&json!({ "do": "stop" }));
    let stopped = viewer.status("a stop", is_stopped);
    assert!(stopped["mean_samples"].as_f64() >= Some(2.0), "{stopped}");
}

/// A camera that moves during the look that a file takes does not take the file away.
#[test]
fn a_picture_that_was_asked_for_is_saved_whatever_comes_then() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of_size("200x150", &cornell_box(), folder.path(), &["--visibility", "0.05"]);
    let mut viewer = view.viewer();
    viewer.status("a whole picture", |status| status["mean_samples"].as_f64() > Some(4.5));
    viewer.send(&json!({ "do": "save", "format": "png" }));
    // Longer than a batch, in the middle of the look.
    std::thread::sleep(Duration::from_millis(60));
    viewer.send(&orbit());
    // The note of it may be gone with the movement before anybody is told.
    let picture = folder.path().join("cornell-box-1.png");
    viewer.status("the picture", |_| picture.exists());
}

/// A camera with nothing before its middle turns about what else it sees, from the first movement on and right after
/// it has come home; pbrt's pinholes have their focus a million units away.
#[test]
fn a_camera_that_looks_past_everything_stays_with_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("sky.pbrt");
    let text = "Scale -1 1 1
LookAt 0 1.5 5  0 1.5 0  0 1 0
Camera \"perspective\" \"float fov\" 50
WorldBegin
LightSource \"infinite\" \"rgb L\" [1 1 1]
Shape \"sphere\" \"float radius\" 1
Translate 0 3 0
Shape \"sphere\" \"float radius\" 1
";
    std::fs::write(&scene, text).expect("written");
    let view = View::of(&scene, folder.path(), &["--visibility", "16"]);
    let mut viewer = view.viewer();
    let mut camera = viewer.status("the end", is_stopped)["camera"].clone();
    for goes_home in [false, true] {
        if goes_home {
            viewer.send(&json!({ "do": "camera-home" }));
        }
        viewer.send(&json!({ "do": "camera", "by": "orbit", "right": 0.3, "up": 0.0 }));
        viewer.send(&json!({ "do": "camera", "by": "dolly", "steps": 1.0 }));
        let status = viewer.status("another camera", |status| status["camera"] != camera && is_stopped(status));
        camera = status["camera"].clone();
        let position = camera.as_str().and_then(|text| text.lines().nth(1)).expect("a position");
        let numbers = position.split(['[', ',', ']']).filter_map(|word| word.trim().parse::<f64>().ok());
        let farthest = numbers.fold(0.0, |farthest: f64, number| farthest.max(number.abs()));
        assert!((3.0..6.0).contains(&farthest), "{position}");
    }
}

/// A paused picture is shown as it is saved, whoever has looked at it last.
#[test]
fn a_paused_picture_is_what_is_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["--visibility", "0.05", "--operator", "reinhard02", "--denoise", "builtin"];
    let view = View::of_size("64x64", &cornell_box(), folder.path(), &arguments);
    let mut viewer = view.viewer();
    viewer.status("a plan", |status| !status["rung"].is_null());
    viewer.send(&json!({ "do": "pause" }));
    viewer.status("a rest", |status| status["phase"] == "paused" && !status["visible_share"].is_null());
    for (stops, name) in [(0.0, "cornell-box-1.png"), (1.5, "cornell-box-2.png")] {
        viewer.send(&json!({ "do": "exposure", "stops": stops }));
        viewer.status("the exposure", |status| status["phase"] == "paused" && status["exposure"] == stops);
        viewer.saved(folder.path(), "png", name);
        let saved = image::open(folder.path().join(name)).expect("a picture").into_rgb8();
        view.viewer().frame(0, "the saved picture", |picture| *picture == saved);
    }
}

/// Who stopped the picture finds it at rest, wherever the pointer goes.
#[test]
fn no_gaze_undoes_a_stop() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of_size("64x64", &cornell_box(), folder.path(), &["--visibility", "0.05", "--foveated"]);
    let mut viewer = view.viewer();
    viewer.send(&json!({ "do": "gaze", "at": [32, 32] }));
    viewer.status("a plan", |status| !status["rung"].is_null());
    viewer.send(&json!({ "do": "stop" }));
    let stopped = viewer.status("a stop", is_stopped);
    viewer.send(&json!({ "do": "gaze", "at": null }));
    // Gazes are followed every 0.7 s, and a picture at rest tells of itself every second.
    for _ in 0..4 {
        let later = viewer.status("another word", |_| true);
        assert_eq!((&later["phase"], &later["total_samples"]), (&stopped["phase"], &stopped["total_samples"]));
    }
}

/// What is dragged follows the hand, also where a part of the picture is shown.
#[test]
fn a_part_is_dragged_by_its_own_height() {
    let folder = tempfile::tempdir().expect("a folder");
    let position = |crop: &str| -> f64 {
        let view = View::of(&cornell_box(), folder.path(), &["--visibility", "16", "--crop", crop]);
        let mut viewer = view.viewer();
        let home = viewer.status("the end", is_stopped);
        viewer.send(&json!({ "do": "camera", "by": "pan", "right": 0.25, "up": 0.0 }));
        let moved = viewer.status("another camera", |status| status["camera"] != home["camera"] && is_stopped(status));
        let (_, numbers) = moved["camera"].as_str().and_then(|text| text.split_once("position = [")).expect("TOML");
        numbers.split(',').next().and_then(|x| x.parse().ok()).expect("a number")
    };
    // Around the same middle, one four times as high as the other.
    let (whole, part) = (position("0,0,32,32"), position("12,12,8,8"));
    assert!((whole / part - 4.0).abs() < 0.2, "{whole} and {part}");
}

/// Motion is found again after each movement.
#[test]
fn motion_is_shown_from_another_camera_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/rolling-ball.toml");
    let view = View::of(&scene, folder.path(), &["--visibility", "0.05"]);
    let mut viewer = view.viewer();
    viewer.send(&json!({ "do": "layer", "layer": "velocity" }));
    let is_known = |legend: &str| legend.starts_with("right orange") || legend == "nothing moves here";
    viewer.legend(9, "motion", is_known);
    let mut camera = viewer.status("a camera", |status| status["phase"] == "rendering")["camera"].clone();
    for movement in [orbit(), json!({ "do": "camera-home" })] {
        viewer.send(&movement);
        let is_new = |status: &Value| status["phase"] == "rendering" && status["camera"] != camera;
        camera = viewer.status("another camera", is_new)["camera"].clone();
        viewer.legend(9, "motion again", is_known);
    }
}

/// The back wall is in focus whichever of its pixels is pointed at, and stays so when the scene file is edited.
#[test]
fn focus_is_on_a_plane_and_outlives_an_edit() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    let text = std::fs::read_to_string(cornell_box()).expect("a scene");
    let text = text.replace("[camera]", "[camera]\naperture_radius = 0.01\nfocus_distance = 2.0");
    std::fs::write(&scene, &text).expect("written");
    let view = View::of(&scene, folder.path(), &["--visibility", "8"]);
    let mut viewer = view.viewer();
    let focus_distance = |status: &Value| -> f64 {
        let camera = status["camera"].as_str().expect("TOML");
        let (_, after) = camera.split_once("focus_distance = ").expect("a focus");
        after.trim().parse().expect("a number")
    };
    let mut distance = focus_distance(&viewer.status("the end", is_stopped));
    let mut found = Vec::new();
    for (x, y) in [(16, 10), (9, 7), (22, 7)] {
        viewer.send(&json!({ "do": "focus", "x": x, "y": y }));
        let is_new = |status: &Value| is_stopped(status) && focus_distance(status) != distance;
        distance = focus_distance(&viewer.status("another focus", is_new));
        found.push(distance);
    }
    // From 3.79 before the middle of the room to its back, 1 behind it.
    assert!(found.iter().all(|distance| (distance / 4.79 - 1.0).abs() < 0.005), "{found:?}");
    std::fs::write(&scene, format!("{text}\n# The same.\n")).expect("written");
    let edited = viewer
        .status("the edited scene", |status| status["note"] == "the scene was loaded again, seen from where you are");
    assert_eq!(focus_distance(&edited), distance);
}

/// A picture that has reached its target goes on towards a lower one, and at rest says nothing that does not hold any
/// more.
#[test]
fn another_target_is_another_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    // So dark that the pilot's noise is not seen.
    let view = View::of(&cornell_box(), folder.path(), &["--visibility", "4", "--exposure", "-6"]);
    let mut viewer = view.viewer();
    let before = viewer.status("the end", is_stopped);
    assert!(before["reason"].as_str().is_some_and(|reason| reason.starts_with("nothing more")), "{before}");
    viewer.send(&json!({ "do": "exposure", "stops": 0.0 }));
    let brighter = viewer.status("the exposure", |status| status["exposure"] == 0.0 && is_stopped(status));
    assert!(brighter["visible_share"].as_f64() > Some(0.2), "{brighter}");
    assert_eq!(brighter["reason"], "Resume goes on");
    viewer.send(&json!({ "do": "exposure", "stops": -6.0 }));
    let again = viewer.status("as before", |status| status["exposure"] == -6.0 && is_stopped(status));
    assert_eq!(again["reason"], before["reason"]);
    viewer.send(&json!({ "do": "visibility", "target": 0.05 }));
    viewer.status("more of it", |status| status["phase"] == "rendering" && status["target"] == 0.05);
}

/// A display of the user's own is on offer like the presets; an error stays until the same thing goes right.
#[test]
fn an_own_display_can_be_chosen_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let own = "name = \"mine\"\npixels_per_degree = 40.0\nwhite_cd_m2 = 300.0\nblack_cd_m2 = 0.1\n";
    std::fs::write(folder.path().join("mine.toml"), own).expect("written");
    let view = View::of(&cornell_box(), folder.path(), &["--visibility", "8", "--display", "mine.toml"]);
    let mut viewer = view.viewer();
    for name in ["desktop", "mine"] {
        viewer.send(&json!({ "do": "display", "name": name }));
        let chosen = viewer.status("another display", |status| status["display"] == name);
        assert!(chosen["displays"].as_array().is_some_and(|names| names.contains(&json!("mine"))), "{chosen}");
    }
    let density = viewer.status("its density", |status| status["pixels_per_degree"] == 40.0);
    assert!(density["error"].is_null(), "{density}");
    viewer.send(&json!({ "do": "display", "name": "nobody's" }));
    viewer.status("a refusal", |status| !status["error"].is_null());
    viewer.send(&json!({ "do": "save", "format": "png" }));
    let saved = viewer.status("a picture", |status| !status["note"].is_null());
    assert!(saved["error"].as_str().is_some_and(|error| error.contains("nobody's")), "{saved}");
    viewer.send(&json!({ "do": "display", "name": "desktop" }));
    viewer.status("no error", |status| status["error"].is_null() && status["display"] == "desktop");
}

/// An eye that was asked for looks at every display.
#[test]
fn another_display_leaves_the_eye_as_it_was_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["--visibility", "8", "--csf-area", "16", "--sampling", "uniform", "--spp", "16"];
    let view = View::of(&cornell_box(), folder.path(), &arguments);
    let mut viewer = view.viewer();
    viewer.status("the end", is_stopped);
    viewer.send(&json!({ "do": "display", "name": "laptop" }));
    viewer.status("the laptop", |status| status["display"] == "laptop" && is_stopped(status));
    let saved = viewer.saved(folder.path(), "exr", "cornell-box-1.exr");
    let on_laptop: Vec<&str> = arguments.into_iter().chain(["--display", "laptop"]).collect();
    let thresholds = |bytes: &[u8]| {
        let picture = fechner::exr_read::decode_exr(Path::new("saved"), bytes).expect("a picture");
        picture.channel("threshold.Y").expect("thresholds").to_vec()
    };
    let rendered = thresholds(&super::rendered(folder.path(), &on_laptop, "laptop.exr"));
    assert!(thresholds(&saved) == rendered, "the thresholds are another eye's");
}

/// Who opens connections and has no token takes no file from the picture, and no viewer's place.
#[cfg(unix)]
#[test]
fn strangers_do_not_cost_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let render = format!(
        "ulimit -n 64; exec {:?} render {:?} --view --size 32x32 --threads 1 --visibility 0.01 --exposure 2 -o kept.png",
        env!("CARGO_BIN_EXE_fechner"),
        cornell_box()
    );
    let mut command = Command::new("sh");
    command.args(["-c", &render]).current_dir(folder.path()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("runs");
    let said = child.stderr.take().expect("piped");
    let mut view = View::that_says(child, said);
    let mut viewer = view.viewer();
    let status = viewer.status("a picture", |status| status["total_samples"].as_u64() > Some(0));
    assert_eq!(status["exposure"], 2.0);
    let strangers = || -> Vec<TcpStream> {
        let stranger = |_| {
            let mut stream = TcpStream::connect(&view.address).expect("the system takes it");
            stream.set_read_timeout(Some(Duration::from_secs(1))).expect("a time");
            stream.write_all(b"GET / HTTP/1.1\r\nHost: elsewhere\r\n\r\n").expect("the system takes it");
            stream
        };
        (0..80).map(stranger).collect()
    };
    // Those that are refused may stay for a while; the others are not even let in to be refused.
    let there = strangers();
    let is_answered = |mut stream: &TcpStream| stream.read(&mut [0]).is_ok_and(|bytes| bytes > 0);
    let answered = there.iter().take_while(|stream| is_answered(stream)).count();
    assert!((1..=16).contains(&answered), "{answered} connections are open");
    drop(there);
    view.viewer().status("a second viewer", |status| status["total_samples"].as_u64() > Some(0));
    let _there = strangers();
    viewer.send(&json!({ "do": "stop" }));
    viewer.status("the last word", is_stopped);
    assert!(view.child.wait().expect("ended").success());
    assert!(image::open(folder.path().join("kept.png")).is_ok());
}
