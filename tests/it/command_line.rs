//! The program as a user runs it: good runs leave whole files, bad input leaves one line and nothing else.

use assert_cmd::Command;
use std::path::{Path, PathBuf};

fn fechner() -> Command {
    Command::cargo_bin("fechner").expect("the binary is built")
}

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)
}

/// Runs and expects exit status 2, one line on stderr with all the `fragments`, and an empty folder.
fn assert_refused(arguments: &[&str], folder: &Path, fragments: &[&str]) {
    let output = fechner().args(arguments).current_dir(folder).output().expect("runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    for fragment in fragments {
        assert!(message.contains(fragment), "{arguments:?}: \"{fragment}\" is not in: {message}");
    }
    let errors = message.lines().filter(|l| l.starts_with("fechner:")).count();
    assert!(errors == 1 || message.contains("Usage") || message.contains("error:"), "{message}");
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn a_render_leaves_a_picture_and_its_figures() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene("cornell-box.toml");
    let arguments = ["--size", "24x16", "--visibility", "8", "--json", "out.json", "-o"];
    for name in ["out.png", "out.exr"] {
        let run = fechner()
            .arg("render")
            .arg(&scene)
            .args(arguments)
            .arg(name)
            .current_dir(folder.path())
            .output()
            .expect("runs");
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    }
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out.json")).expect("written")).expect("JSON");
    for key in [
        "scene",
        "width",
        "height",
        "seed",
        "sampling",
        "model",
        "csf",
        "operator",
        "observer",
        "samples_total",
        "spp_mean",
        "spp_max",
        "seconds_total",
        "seconds_perception",
        "visibility_target",
        "visibility_p99",
        "fraction_visible",
        "detection_probability_p99",
        "nonfinite_samples",
        "peak_memory_bytes",
        "plans",
        "stop_reason",
    ] {
        assert!(!json[key].is_null(), "{key} is missing");
    }
    let picture = image::open(folder.path().join("out.png")).expect("a PNG");
    assert_eq!((picture.width(), picture.height()), (24, 16));
    let exr = fechner::exr_read::read_exr(&folder.path().join("out.exr")).expect("an EXR");
    for channel in [
        "R",
        "G",
        "B",
        "albedo.R",
        "normal.X",
        "depth.Z",
        "id.Y",
        "samples.Y",
        "threshold.Y",
        "visibility.Y",
        "variance.Y",
    ] {
        assert!(exr.channel(channel).is_some(), "{channel} is missing");
    }
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("readable")
        .map(|e| e.expect("an entry").file_name().into_string().expect("text"))
        .collect();
    left.sort();
    assert_eq!(left, ["out.exr", "out.json", "out.png"]);
    let info = fechner().args(["info", "out.exr"]).current_dir(folder.path()).output().expect("runs");
    assert!(String::from_utf8_lossy(&info.stdout).contains("visibility.Y"));
}

#[test]
fn bad_arguments_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let cornell = scene("cornell-box.toml");
    let cornell = cornell.to_str().expect("text");
    let at = folder.path();
    assert_refused(&["render", "missing.toml", "-o", "a.png"], at, &["missing.toml"]);
    assert_refused(&["render", ".", "-o", "a.png"], at, &["is a directory"]);
    assert_refused(&["render", cornell, "-o", "a.gif"], at, &["a.gif", ".exr"]);
    assert_refused(&["render", cornell, "-o", "no/such/a.png"], at, &["no/such"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--size", "0x10"], at, &["0x10", "WIDTHxHEIGHT"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--size", "400000x400000"], at, &["memory", "--size"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--visibility", "-1"], at, &["above 0"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--display", "cinemax"], at, &["cinemax", "cinema"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--operator", "magic"], at, &["magic", "constant"]);
    assert_refused(&["info", "missing.exr"], at, &["missing.exr"]);
    assert_eq!(std::fs::read_dir(at).expect("readable").count(), 0, "something was written");
}
