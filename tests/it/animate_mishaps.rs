//! Shots that cannot be, or are not what was meant: refused before anything is rendered, or named.

use crate::support::command::{fechner, said};
use fechner::exr_read::read_exr;
use std::path::Path;

/// A grey sphere that moves in front of a grey sky, seen by a camera that is told apart.
fn scene(camera: &str) -> String {
    format!(
        r#"
nits_per_unit = 100.0
[film]
size = [16, 12]
[environment]
radiance = [0.5, 0.5, 0.5]
[materials.grey]
type = "diffuse"
reflectance = 0.5
[camera]
{camera}
[[objects]]
sphere = {{ center = [0, 0, 0], radius = 0.5 }}
material = "grey"
keyframes = [ {{ time = 0.0, translate = [-1, 0, 0] }}, {{ time = 1.0, translate = [1, 0, 0] }} ]
"#
    )
}

const CAMERA: &str = "position = [0, 0, 5]\nlook_at = [0, 0, 0]";

/// Runs `animate`, cheaply; its exit status and what it said.
fn animate(folder: &Path, scene: &str, arguments: &[&str]) -> (Option<i32>, String) {
    std::fs::write(folder.join("scene.toml"), scene).expect("written");
    let output = fechner()
        .current_dir(folder)
        .args(["animate", "scene.toml", "--visibility", "50", "--max-spp", "16"])
        .args(arguments)
        .output()
        .expect("it starts");
    (output.status.code(), said(&output))
}

/// A camera that looks along its up in the frame after the last: the shot was refused when all but its last frame
/// were rendered.
#[test]
fn a_frame_beyond_the_end_that_cannot_be_read_is_told_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let over = "keyframes = [ { time = 0, position = [0, 5, 1], look_at = [0, 0, 0] }, \
                { time = 1, position = [0, 5, -1], look_at = [0, 0, 0] } ]";
    let (status, said) =
        animate(folder.path(), &scene(over), &["--frames", "0..5", "--fps", "12", "-o", "out/a.#.exr"]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("beyond the last one") && said.contains("at 0.5 s: scene.toml"), "{said}");
    assert!(!folder.path().join("out").exists(), "a run that is refused leaves a folder");
    let (status, said) =
        animate(folder.path(), &scene(over), &["--frames", "0..1", "--fps", "12", "-o", "out/a.#.exr"]);
    assert_eq!(status, Some(0), "{said}");
}

/// What changes nothing is refused, and leaves nothing.
#[test]
fn what_changes_nothing_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for (arguments, expected) in [
        (&["-o", "out/a.#.exr", "--adapted-to", "3"][..], "--adapted-to: constant does not know an eye"),
        (&["-o", "out/a.#.png", "--aov-names", "blender"], "--aov-names blender: PNG frames hold no motion"),
        (&["-o", "out/a#1.####.exr"], "one run of #"),
        (&["-o", "out/a.#.exr", "--video", "scene.toml/"], "a folder's name"),
    ] {
        let (status, said) = animate(folder.path(), &scene(CAMERA), &[&["--frames", "0..1"], arguments].concat());
        assert!(status == Some(2) && said.contains(expected), "{arguments:?}: {said}");
        assert!(!folder.path().join("out").exists(), "{arguments:?} leaves a folder");
    }
}

/// Budgets that cannot be kept, parts that have an exposure each and shutters longer than a frame are named, and
/// nothing else is.
#[test]
fn what_is_not_as_meant_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = ["--shot", "0..3", "-o", "a.#.exr"];
    let (_, said) = animate(folder.path(), &scene(CAMERA), &[&["--frames", "0..1"][..], &whole].concat());
    assert!(!said.contains("note:"), "{said}");
    let (_, said) = animate(folder.path(), &scene(CAMERA), &[&["--frames", "2..3"][..], &whole].concat());
    assert!(!said.contains("note:"), "{said}");
    let (_, said) = animate(folder.path(), &scene(CAMERA), &["--frames", "4", "-o", "a.#.exr"]);
    assert!(said.contains("frames 0 to 3 are there") && said.contains("needs --shot 0..4"), "{said}");

    let open = format!("{CAMERA}\nshutter_s = 1.0");
    let (_, said) = animate(folder.path(), &scene(&open), &["--frames", "0", "-o", "b.#.exr", "--time", "0.001"]);
    assert_eq!(said.matches("as long as 24.0 frames").count(), 1, "{said}");
    assert_eq!(said.matches("were taken of --time's").count(), 1, "{said}");
    // At one frame a second it is a frame.
    let (_, said) = animate(folder.path(), &scene(&open), &["--frames", "0", "-o", "b.#.exr", "--fps", "1"]);
    assert!(!said.contains("as long as"), "{said}");
}

/// The records of frames say which eye they were judged for.
#[test]
fn eyes_that_follow_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let eye_of = |eye: &str| {
        let (status, said) = animate(folder.path(), &scene(CAMERA), &["--frames", "0", "-o", "a.#.exr", "--eye", eye]);
        assert_eq!(status, Some(0), "{said}");
        let record = std::fs::read(folder.path().join("a.0.json")).expect("a record");
        let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
        record["report"]["eye"].as_str().expect("words").to_owned()
    };
    assert_eq!(eye_of("track"), "what moves, which it follows");
    assert_eq!(eye_of("saliency"), "what stands out, which it follows");
}

/// The files of two sequences that differ after the number alone, and the rate that frames tell.
#[test]
fn stereo_frames_have_files_of_their_own() {
    let folder = tempfile::tempdir().expect("a folder");
    for eye in ["left", "right"] {
        let name = format!("s.##.{eye}.exr");
        let (status, said) = animate(folder.path(), &scene(CAMERA), &["--frames", "0..1", "-o", &name, "--fps", "25"]);
        assert_eq!(status, Some(0), "{said}");
        let rate = read_exr(&folder.path().join(format!("s.01.{eye}.exr"))).expect("an EXR file").frames_per_second();
        assert_eq!(rate, Some(25.0), "{eye}");
    }
    for file in ["json", "contact.png", "track.json"] {
        for eye in ["left", "right"] {
            assert!(folder.path().join(format!("s.{eye}.{file}")).exists(), "{eye}: {file}");
        }
        assert!(!folder.path().join(format!("s.{file}")).exists(), "{file}");
    }
    let threshold = fechner()
        .current_dir(folder.path())
        .args(["threshold", "s.01.left.exr", "-o", "t.exr", "--model", "yee", "--velocity", "s.01.left.exr"])
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&threshold.stdout).into_owned();
    assert!(said.contains("at 25 frames a second"), "{said} {}", String::from_utf8_lossy(&threshold.stderr));
}
