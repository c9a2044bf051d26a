//! What goes wrong around a command: nobody listens any more, a disk is full, a file is asked for twice.

use crate::support::command::{self, said};
use std::path::Path;
use std::process::{Command, Stdio};

/// A scene that is rendered in a moment.
const SPHERE: &str = "[camera]\nposition = [0, 0, 6]\nlook_at = [0, 0, 0]\nvertical_fov_deg = 45\n\n\
     [[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"grey\"\n\n\
     [materials.grey]\ntype = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]\n\n[environment]\nradiance = [1, 1, 1]\n";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.toml"), SPHERE).expect("written");
    folder
}

fn fechner(folder: &Path) -> Command {
    let mut command = command::fechner();
    command.current_dir(folder);
    command
}

const RENDER: [&str; 6] = ["render", "s.toml", "--size", "16x16", "--visibility", "2"];

/// Where nobody reads what it says, a render still keeps its samples and writes its picture; where nobody reads an
/// answer any more, the exit status is what it would have been.
#[test]
#[cfg(unix)]
fn closed_ends_cost_nothing() {
    let folder = folder();
    let closed = || {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        Stdio::from(writer)
    };
    let status = |arguments: &[&str]| {
        let mut command = fechner(folder.path());
        command.args(arguments).stdout(closed()).stderr(closed());
        command.status().expect("runs").code()
    };
    assert_eq!(status(&[&RENDER[..], &["-o", "a.png", "--checkpoint", "a.film"]].concat()), Some(0));
    assert!(folder.path().join("a.png").exists() && folder.path().join("a.film").exists());
    assert_eq!(status(&["animate", "s.toml", "--frames", "0..1", "--size", "16x16", "-o", "f.##.png"]), Some(0));
    assert!(folder.path().join("f.01.png").exists());
    assert_eq!(status(&[&RENDER[..], &["-o", "b.exr"]].concat()), Some(0));
    assert_eq!(status(&["info", "b.exr"]), Some(0));
    assert_eq!(status(&["compare", "b.exr", "b.exr"]), Some(0));
    assert_eq!(status(&["threshold", "b.exr", "-o", "t.exr"]), Some(0));
    assert_eq!(status(&["tonemap", "b.exr", "-o", "t.png", "--operator", "agx"]), Some(0));
    assert_eq!(status(&["info", "none.exr"]), Some(2));
}

/// An answer that a full disk did not take is an error.
#[test]
#[cfg(target_os = "linux")]
fn an_answer_that_is_lost_is_told() {
    let folder = folder();
    fechner(folder.path()).args(RENDER).args(["-o", "a.png"]).output().expect("runs");
    let full = std::fs::File::create("/dev/full").expect("a device");
    for arguments in [&["info", "a.png"][..], &["--help"], &["--version"], &["render", "--help"]] {
        let full = full.try_clone().expect("a handle");
        let output = fechner(folder.path()).args(arguments).stdout(full).output().expect("runs");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said(&output).contains("cannot write to standard output"), "{}", said(&output));
    }
}

/// A limit to the size of files is told as a full disk is: once while the render goes on, of each file at its end.
/// What else was asked for is written, and what was found is said.
#[test]
#[cfg(unix)]
fn what_cannot_be_written_keeps_nothing_else() {
    let folder = folder();
    let script = r#"ulimit -f 4; exec "$0" "$@""#;
    let render = |size: &str, others: &[&str]| {
        let mut command = Command::new("sh");
        command.current_dir(folder.path()).args(["-c", script]).arg(command::fechner().get_program());
        let output =
            command.args(["render", "s.toml", "--size", size, "--spp", "16"]).args(others).output().expect("runs");
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        let message = said(&output);
        assert!(
            message.contains("samples (16.0 a pixel on average") && !message.contains("rendering goes on"),
            "{message}"
        );
        message.lines().last().expect("an error").to_owned()
    };
    let error = render("8x8", &["-o", "a.png", "--checkpoint", "a.film"]);
    assert!(error.contains("a.film: File too large") && folder.path().join("a.png").exists(), "{error}");
    let error = render("64x64", &["-o", "b.exr", "--checkpoint", "b.film"]);
    assert!(error.contains("b.exr: File too large") && error.contains("b.film: File too large"), "{error}");
}

/// Figures and maps that cannot be written leave the picture, other maps, and what is said of them.
#[test]
#[cfg(unix)]
fn figures_that_are_lost_take_nothing_along() {
    let folder = folder();
    let figures = folder.path().join("figures");
    std::fs::create_dir(&figures).expect("made");
    let mut command = fechner(folder.path());
    command.args(["render", "s.toml", "--size", "64x64", "--time", "1", "--visibility", "0.001", "-o", "a.png"]);
    command.args(["--checkpoint", "a.film", "--checkpoint-every", "0.001"]);
    command.args(["--map", "samples=figures/a.png", "--map", "visibility=kept.png"]);
    let mut child = command.args(["--json", "figures/a.json"]).stderr(Stdio::piped()).spawn().expect("runs");
    // By then it has found that its figures can be written.
    crate::support::wait_for(&folder.path().join("a.film"), &mut child);
    std::fs::remove_dir(&figures).expect("removed");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(2));
    let words = said(&output);
    assert!(words.contains("Stopped because") && words.contains("the picture is in a.png"), "{words}");
    let error = words.lines().last().expect("an error");
    assert!(error.contains("figures/a.json: ") && error.contains("figures/a.png: "), "{words}");
    assert!(folder.path().join("kept.png").exists(), "{words}");
}

/// The picture of a name that no file can have was lost when all of it was rendered: the name that it has until it is
/// complete is a shorter one. No sample is taken for it.
#[test]
#[cfg(unix)]
fn names_that_are_too_long_are_refused_beforehand() {
    let folder = folder();
    let long = |ending: &str| format!("{}{ending}", "w".repeat(256 - ending.len()));
    let (picture, film, map) = (long(".exr"), long(".film"), format!("samples={}", long(".png")));
    let (json, frames, record, video) = (long(".json"), long(".0.png"), "w".repeat(249), long(".y4m"));
    let (frames, record) = (frames.replace(".0.", ".#."), format!("{record}.#.png"));
    let elsewhere = format!("no/such/folder/{frames}");
    let shot = ["animate", "s.toml", "--size", "8x8", "--spp", "4", "--frames", "0..1", "-o"];
    let still = ["render", "s.toml", "--size", "8x8", "--spp", "4", "-o"];
    for arguments in [
        &[&still[..], &[&picture]].concat(),
        &[&still[..], &["a.png", "--checkpoint", &film]].concat(),
        &[&still[..], &["a.png", "--map", &map]].concat(),
        &[&still[..], &["a.png", "--json", &json]].concat(),
        &[&shot[..], &[&frames]].concat(),
        &[&shot[..], &[&elsewhere]].concat(),
        &[&shot[..], &[&record]].concat(),
        &[&shot[..], &["f.#.png", "--video", &video]].concat(),
    ] {
        let output = fechner(folder.path()).args(arguments).output().expect("runs");
        let words = said(&output);
        assert_eq!(output.status.code(), Some(2), "{words}");
        let error = words.lines().last().expect("an error");
        assert!(error.contains("the system takes no name like this one, of 256 bytes"), "{words}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing is written");
    }
}

/// Nor do they replace what the scene is made of.
#[test]
fn outputs_replace_no_texture() {
    let folder = folder();
    let scene = std::fs::read_to_string(folder.path().join("s.toml")).expect("there");
    let textured = format!(
        "{scene}\n[textures.t]\nfile = \"t.1.png\"\n[materials.textured]\ntype = \"diffuse\"\nreflectance = {{ texture = \"t\" }}\n"
    );
    std::fs::write(folder.path().join("c.toml"), textured.replace("t.1.png", "c.contact.png")).expect("written");
    std::fs::write(folder.path().join("t.toml"), textured).expect("written");
    let textures = ["t.1.png", "c.contact.png"].map(|name| folder.path().join(name));
    for texture in &textures {
        image::RgbImage::from_pixel(2, 2, image::Rgb([9, 99, 200])).save(texture).expect("written");
    }
    let before = std::fs::read(&textures[0]).expect("there");
    for arguments in [
        &["render", "t.toml", "--size", "8x8", "--spp", "4", "-o", "t.1.png"][..],
        &["render", "t.toml", "--size", "8x8", "--spp", "4", "-o", "a.png", "--json", "t.1.png"],
        &["animate", "t.toml", "--size", "8x8", "--spp", "4", "--frames", "0..2", "-o", "t.#.png"],
        // The contact sheet's name.
        &["animate", "c.toml", "--size", "8x8", "--spp", "4", "--frames", "0..1", "-o", "c.#.png"],
    ] {
        let output = fechner(folder.path()).args(arguments).output().expect("runs");
        let said = said(&output);
        assert!(output.status.code() == Some(2) && said.contains("that the scene is made of"), "{arguments:?}: {said}");
        for texture in &textures {
            assert_eq!(std::fs::read(texture).expect("there"), before, "{arguments:?}");
        }
    }
}

/// What a command reads is still there afterwards, whatever its outputs are called, and of two outputs none replaces
/// the other.
#[test]
fn outputs_replace_no_inputs() {
    let folder = folder();
    for name in ["a.exr", "b.exr", "f.01.exr", "f.02.exr"] {
        fechner(folder.path()).args(RENDER).args(["-o", name]).output().expect("runs");
    }
    let sequence = ["compare", "f.##.exr", "f.##.exr", "--fps", "24"];
    for name in ["g.json", "g.y4m", "g.0.json", "g.track.json"] {
        std::fs::write(folder.path().join(name), "frame,x,y\n0,4,4\n").expect("written");
    }
    let shot = ["animate", "s.toml", "--size", "8x8", "--spp", "4", "--frames", "0..1", "-o", "g.#.png", "--gaze"];
    let cases: [(&[&str], &str); 13] = [
        (&[&shot[..], &["g.json"]].concat(), "the shot's record would replace the gaze"),
        (&[&shot[..], &["g.0.json"]].concat(), "a frame's record would replace the gaze"),
        (&[&shot[..], &["g.track.json"]].concat(), "the track would replace the gaze"),
        (&[&shot[..], &["g.y4m", "--video", "g.y4m"]].concat(), "--video would replace the gaze"),
        (&[&RENDER[..], &["-o", "c.png", "--json", "s.toml"]].concat(), "--json would replace the scene"),
        (&[&RENDER[..], &["-o", "b.exr", "--importance", "b.exr"]].concat(), "-o would replace the importance map"),
        (&["compare", "a.exr", "b.exr", "--json", "./a.exr"], "--json would replace the reference"),
        (&["compare", "a.exr", "b.exr", "--map", "m.png", "--json", "m.png"], "--map and --json name the same file"),
        (&[&sequence[..], &["--json", "f.02.exr"]].concat(), "--json would replace a frame"),
        (&["threshold", "a.exr", "-o", "a.exr"], "-o would replace the picture"),
        (&["threshold", "a.exr", "--halves", "a.exr", "b.exr", "-o", "b.exr"], "-o would replace a half"),
        (
            &["tonemap", "a.exr", "-o", "c.png", "--operator", "ptyg", "--state", "a.exr"],
            "--state would replace a picture",
        ),
        (
            &["tonemap", "a.exr", "-o", "c.png", "--operator", "ptyg", "--state", "c.png"],
            "-o and --state name the same",
        ),
    ];
    let read = ["s.toml", "a.exr", "b.exr", "f.02.exr", "g.json", "g.y4m", "g.0.json", "g.track.json"]
        .map(|name| folder.path().join(name));
    let before = read.each_ref().map(|path| std::fs::read(path).expect("there"));
    for (arguments, refusal) in cases {
        let output = fechner(folder.path()).args(arguments).output().expect("runs");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said(&output).contains(refusal), "{arguments:?}: {}", said(&output));
    }
    assert!(read.iter().zip(before).all(|(path, before)| std::fs::read(path).is_ok_and(|now| now == before)));
}

/// The name of a sequence that cannot be kept to the byte is refused, not changed.
#[test]
#[cfg(target_os = "linux")]
fn names_are_not_changed() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    fechner(folder.path()).args(RENDER).args(["-o", "a.exr"]).output().expect("runs");
    let name = std::ffi::OsStr::from_bytes(b"t\xff.##.png");
    let mut command = fechner(folder.path());
    let output = command.args(["tonemap", "a.exr", "--operator", "agx", "-o"]).arg(name).output().expect("runs");
    assert!(said(&output).contains("must be UTF-8"), "{}", said(&output));
}

/// A film is written by one process at a time, and another is told by which.
#[test]
fn a_film_has_one_writer() {
    let folder = folder();
    let film = folder.path().join("a.film");
    let endless =
        ["render", "s.toml", "--size", "64x64", "--visibility", "0.001", "-o", "a.png", "--checkpoint", "a.film"];
    let mut command = fechner(folder.path());
    let mut child =
        command.args(endless).args(["--checkpoint-every", "0.01"]).stderr(Stdio::null()).spawn().expect("runs");
    crate::support::wait_for(&film, &mut child);
    let second =
        || fechner(folder.path()).args(RENDER).args(["-o", "b.png", "--checkpoint", "./a.film", "--resume"]).output();
    let refused = second().expect("runs");
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains(&format!("process {} writes this film", child.id())), "{}", said(&refused));
    child.kill().expect("killed");
    child.wait().expect("ended");
    let other_size = second().expect("runs");
    assert!(said(&other_size).contains("64x64"), "free after a kill: {}", said(&other_size));
}

/// A film's picture names the scene as the render's own does.
#[test]
fn a_scene_has_one_name() {
    let folder = folder();
    let run = |arguments: &[&str]| fechner(folder.path()).args(arguments).output().expect("runs");
    run(&[&RENDER[..], &["-o", "a.exr", "--json", "a.json", "--checkpoint", "a.film"]].concat());
    run(&["merge", "a.film", "-o", "b.exr", "--json", "b.json"]);
    let scene = |name: &str| -> serde_json::Value {
        let text = std::fs::read(folder.path().join(name)).expect("written");
        serde_json::from_slice::<serde_json::Value>(&text).expect("JSON")["scene"].clone()
    };
    assert_eq!((scene("a.json"), scene("b.json")), ("s.toml".into(), "s.toml".into()));
}

/// A film that was stopped where the way to the new target does not pass is told; one on it is not.
#[test]
fn a_film_beside_the_ladder_is_told() {
    let folder = folder();
    let render = |visibility: &str, others: &[&str]| {
        let mut command = fechner(folder.path());
        command.args(["render", "s.toml", "--size", "16x16", "-o", "a.png", "--visibility", visibility]).args(others);
        said(&command.output().expect("runs"))
    };
    let note = "note: the film aimed at visibility 4, which a render to 0.5 does not pass";
    let resumed = |from: &str, to: &str, film: &str, denoise: &str| {
        let others = ["--denoise", denoise, "--checkpoint", film];
        render(from, &others);
        render(to, &[&others[..], &["--resume"]].concat())
    };
    assert!(resumed("4", "0.5", "a.film", "builtin").contains(note));
    assert!(!resumed("2", "0.5", "b.film", "builtin").contains("does not pass"));
    assert!(!resumed("4", "2", "c.film", "none").contains("does not pass"));
    // What was left once is not forgotten: 5 is beside the way to 4 and to all below.
    assert!(resumed("5", "4", "d.film", "none").contains("aimed at visibility 5, which a render to 4 does not pass"));
    let others = ["--checkpoint", "d.film", "--resume"];
    assert!(render("2", &others).contains("aimed at visibility 5, which a render to 2 does not pass"));
}

/// A merged film has a seed once it has a sample of it, and not before.
#[test]
fn a_seed_is_entered_with_its_first_sample() {
    let folder = folder();
    let run = |arguments: &[&str]| command::run(fechner(folder.path()).args(arguments));
    let of = |seed: &str, spp: &str, film: &str, more: &[&str]| {
        let arguments =
            ["render", "s.toml", "--size", "16x16", "-o", "a.png", "--sampling", "uniform", "--json", "a.json"];
        let own = ["--seed", seed, "--spp", spp, "--checkpoint", film];
        run(&[&arguments[..], &own, more].concat());
        let figures = std::fs::read(folder.path().join("a.json")).expect("written");
        serde_json::from_slice::<serde_json::Value>(&figures).expect("JSON")["seeds"].clone()
    };
    of("1", "16", "a.film", &[]);
    of("2", "16", "b.film", &[]);
    run(&["merge", "a.film", "b.film", "-o", "sum.film"]);
    assert_eq!(of("9", "16", "sum.film", &["--resume"]), serde_json::json!([1, 2]));
    assert_eq!(of("7", "64", "sum.film", &["--resume"]), serde_json::json!([1, 2, 7]));
}
