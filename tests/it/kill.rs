//! The program, killed and interrupted, resumed and merged: as a farm or a power cut would do it.

use crate::support::command::{assert_refused, cornell_box, fechner, repository_scene, run, said};
#[cfg(unix)]
use crate::support::signal;
use crate::support::wait_for;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

fn render(folder: &Path, arguments: &[&str]) -> Command {
    render_sized(folder, "64x64", arguments)
}

fn render_sized(folder: &Path, size: &str, arguments: &[&str]) -> Command {
    let mut command = fechner();
    command.arg("render").arg(cornell_box()).args(["--size", size]).args(arguments).current_dir(folder);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn file(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("readable");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

const UNTIL: [&str; 4] = ["--visibility", "3", "--seed", "11"];

/// Killed twice in the middle and resumed, the picture has the bytes of an uninterrupted one; so has one that a signal
/// ended, and that made its picture so far.
#[test]
fn a_killed_render_resumes_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let whole = ["-o", "whole.exr"];
    run(&mut render(at, &[&UNTIL[..], &whole].concat()));

    let parts = ["-o", "parts.exr", "--checkpoint", "a.film", "--checkpoint-every", "0.001"];
    let parts = [&UNTIL[..], &parts].concat();
    let resumed = [&parts[..], &["--resume"]].concat();
    let mut child = render(at, &parts).spawn().expect("runs");
    wait_for(&at.join("a.film"), &mut child);
    child.kill().expect("SIGKILL");
    assert!(!child.wait().expect("ended").success());
    assert!(!at.join("parts.exr").exists(), "the kill came too late to show anything");
    assert_refused(&mut render(at, &parts), &["a.film", "--resume"]);
    // As a kill leaves what it cuts short.
    for written in ["parts.exr", "a.film"] {
        std::fs::write(at.join(format!(".{written}.x1Y2z3.part")), "half").expect("written");
    }

    let before = file(at, "a.film");
    let mut child = render(at, &resumed).spawn().expect("runs");
    while file(at, "a.film") == before && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    // Harmless if it has ended meanwhile.
    child.kill().expect("SIGKILL");
    child.wait().expect("ended");

    let message = said(&run(&mut render(at, &resumed)));
    assert!(message.contains("Checkpoint a.film"), "{message}");
    assert!(file(at, "parts.exr") == file(at, "whole.exr"), "the resumed picture differs");
    assert_eq!(names(at), ["a.film", "parts.exr", "whole.exr"], "something was left behind");
}

/// Killed in the middle of a shot and called again, `animate` keeps the frames that were done and makes the others,
/// to the bytes of a run in one go; no picture has its name before it is whole.
#[test]
fn a_killed_shot_goes_on_to_the_same_bytes() {
    let [whole, parts] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let (whole, parts) = (whole.path(), parts.path());
    let shot = |folder: &Path| {
        let mut command = fechner();
        command.arg("animate").arg(repository_scene("rolling-ball.toml")).current_dir(folder);
        command.args(["--frames", "0..7", "--size", "48x27", "--visibility", "3", "-o", "shot.#.exr"]);
        command.args(["--video", "shot.y4m"]).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    run(&mut shot(whole));
    let mut child = shot(parts).spawn().expect("runs");
    wait_for(&parts.join("shot.1.json"), &mut child);
    child.kill().expect("SIGKILL");
    assert!(!child.wait().expect("ended").success(), "the kill came too late");

    let pictures: Vec<String> = (0..8).map(|frame| format!("shot.{frame}.exr")).collect();
    let is_done = |picture: &&String| parts.join(picture).with_extension("json").exists();
    let done: Vec<&String> = pictures.iter().filter(is_done).collect();
    assert!((2..8).contains(&done.len()), "{} frames were done", done.len());
    for picture in pictures.iter().filter(|picture| parts.join(picture).exists()) {
        assert!(file(parts, picture) == file(whole, picture), "{picture} was there and not whole");
    }
    for written in ["shot.0.exr", "shot.7.exr", "shot.7.json", "shot.json", "shot.contact.png", "shot.y4m"] {
        std::fs::write(parts.join(format!(".{written}.x1Y2z3.part")), "half").expect("written");
    }
    let message = said(&run(&mut shot(parts)));
    assert_eq!(message.matches(": is there").count(), done.len(), "{message}");
    assert!(done.iter().all(|picture| message.contains(&format!("{picture}: is there"))), "{message}");
    assert_eq!(names(parts), names(whole), "something was left behind");
    for name in names(whole).iter().filter(|name| !name.ends_with(".json") || name.ends_with("track.json")) {
        assert!(file(parts, name) == file(whole, name), "{name} differs");
    }
}

/// Frames that are finished stay, and the exit status says that there are more to make.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_shot_between_whole_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut command = fechner();
    command.arg("animate").arg(cornell_box()).args([
        "--size",
        "32x32",
        "--frames",
        "0..30",
        "--visibility",
        "0.3",
        "-o",
        "f.####.png",
    ]);
    let mut child = command.current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("runs");
    wait_for(&at.join("f.0000.json"), &mut child);
    signal(&child, "-INT");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(75), "{}", said(&output));
    assert!(said(&output).contains("the same command makes the others"), "{}", said(&output));
    assert_eq!(image::open(at.join("f.0000.png")).expect("a picture").width(), 32);
}

/// Of what was traced otherwise, only that is named.
#[test]
fn a_film_that_was_traced_otherwise_says_how() {
    let folder = tempfile::tempdir().expect("a folder");
    let with = |depth: &'static str, more: &[&'static str]| {
        let common = ["--spp", "4", "--max-depth", depth, "-o", "a.png", "--checkpoint", "a.film"];
        render(folder.path(), &[&common[..], more].concat())
    };
    run(&mut with("3", &[]));
    let output = with("5", &["--resume"]).output().expect("runs");
    let message = said(&output);
    assert!(message.contains("traced with max depth 3, and these are with max depth 5"), "{message}");
    assert!(!message.contains("clamp"), "{message}");
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_render_with_its_picture_so_far() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let endless = ["--visibility", "0.01", "-o", "a.png", "--json", "a.json", "--checkpoint", "a.film"];
    let mut child = render(at, &[&endless[..], &["--checkpoint-every", "0.001"]].concat()).spawn().expect("runs");
    wait_for(&at.join("a.film"), &mut child);
    // Twice, as `timeout` sends it to the program and to its group.
    for _ in 0..2 {
        signal(&child, "-TERM");
    }
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(75), "{}", said(&output));
    assert!(said(&output).contains("Stopped by a signal"), "{}", said(&output));
    assert_eq!(image::open(at.join("a.png")).expect("a picture").width(), 64);
    let json: serde_json::Value = serde_json::from_slice(&file(at, "a.json")).expect("JSON");
    assert_eq!(json["stop_reason"], "interrupted");
    let mut info = fechner();
    info.args(["info", "a.film"]).current_dir(at);
    let shown = String::from_utf8(info.output().expect("runs").stdout).expect("text");
    for fragment in ["64×64", "seeds", "--seed 0", "desktop", "0.01 aimed at", "after"] {
        assert!(shown.contains(fragment), "{fragment} is not in {shown}");
    }
    assert_eq!(names(at), ["a.film", "a.json", "a.png"]);
}

/// Where a picture cannot be written at the end, its samples are not lost.
#[cfg(unix)]
#[test]
fn a_picture_whose_folder_is_gone_is_kept_elsewhere() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let [gone, temporary] = ["gone", "temporary"].map(|name| at.join(name));
    [&gone, &temporary].into_iter().for_each(|folder| std::fs::create_dir(folder).expect("made"));
    let endless = ["--visibility", "0.01", "-o", "gone/a.png", "--checkpoint", "a.film", "--checkpoint-every", "0.001"];
    let mut child = render(at, &endless).env("TMPDIR", &temporary).spawn().expect("runs");
    wait_for(&at.join("a.film"), &mut child);
    std::fs::remove_dir_all(&gone).expect("removed");
    signal(&child, "-TERM");
    let output = child.wait_with_output().expect("ended");
    let message = said(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    let [own] = &names(&temporary)[..] else { panic!("no folder: {message}") };
    let kept = temporary.join(own).join("a.png");
    assert!(message.contains(&kept.display().to_string()), "{message}");
    assert!(message.contains("cannot write gone/a.png"), "{message}");
    assert_eq!(image::open(kept).expect("a picture").width(), 64);
}

/// Merged films are looked at again; what does not fit is refused by name.
#[test]
fn films_are_merged_and_judged_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let spent = ["--sampling", "uniform", "--visibility", "4", "--spp", "32", "-o", "x.png"];
    for seed in ["1", "2"] {
        let film = format!("{seed}.film");
        run(&mut render(at, &[&spent[..], &["--seed", seed, "--checkpoint", &film]].concat()));
    }
    let merge = |arguments: &[&str]| {
        let mut command = fechner();
        command.arg("merge").args(arguments).current_dir(at).stderr(Stdio::piped());
        command
    };
    let message = said(&run(&mut merge(&["1.film", "2.film", "-o", "sum.exr", "--json", "sum.json"])));
    assert!(message.contains("seeds 1, 2") && message.contains("above the target visibility 4"), "{message}");
    run(&mut merge(&["2.film", "1.film", "-o", "mus.exr"]));
    assert!(file(at, "sum.exr") == file(at, "mus.exr"), "the order of the films changes the picture");
    let json: serde_json::Value = serde_json::from_slice(&file(at, "sum.json")).expect("JSON");
    assert_eq!((&json["samples_total"], &json["seeds"]), (&(64 * 64 * 64).into(), &serde_json::json!([1, 2])));
    // One film's picture without another sample is the one that its render made.
    run(&mut merge(&["2.film", "-o", "again.png"]));
    assert!(file(at, "again.png") == file(at, "x.png"));

    run(&mut merge(&["1.film", "2.film", "-o", "sum.film"]));
    let on = ["--visibility", "4", "--spp", "128", "-o", "x.png", "--checkpoint", "sum.film", "--resume", "--seed"];
    assert_refused(&mut render(at, &[&on[..], &["2"]].concat()), &["sum.film", "1, 2"]);
    run(&mut render(at, &[&on[..], &["3"]].concat()));
    assert_refused(&mut merge(&["sum.film", "2.film", "-o", "y.exr"]), &["2.film", "sum.film", "seed 2"]);
    assert_refused(&mut merge(&["1.film", "1.film", "-o", "y.exr"]), &["1.film", "seed 1"]);
    assert_refused(&mut merge(&["1.film", "x.png", "-o", "y.exr"]), &["x.png", "not a film"]);
    assert_refused(&mut merge(&["1.film", "-o", "y.gif"]), &["y.gif"]);

    let resumed = ["-o", "z.png", "--checkpoint", "1.film", "--resume", "--spp", "64", "--seed"];
    assert_refused(&mut render(at, &[&resumed[..], &["5"]].concat()), &["1.film", "--seed 1"]);
    assert_refused(&mut render_sized(at, "32x64", &[&resumed[..], &["1"]].concat()), &["1.film", "64x64", "32x64"]);
    assert_refused(&mut render(at, &[&resumed[..], &["1", "--clamp", "9"]].concat()), &["1.film", "clamp"]);
    let short = file(at, "1.film");
    std::fs::write(at.join("cut.film"), &short[..short.len() - 100]).expect("written");
    assert_refused(&mut merge(&["cut.film", "2.film", "-o", "y.exr"]), &["cut.film", "damaged"]);
    assert!(
        names(at).iter().all(|name| !name.starts_with('.') && name != "y.exr" && name != "z.png"),
        "{:?}",
        names(at)
    );
}

/// Samples that sight has spread were called uniform by whoever resumed so, without one more, and the word on dark
/// surroundings was gone. Even ones may go on by any rule; and a sum of both kinds is not uniform.
#[test]
fn counts_are_called_by_the_rule_that_chose_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let sampling = |name: &str| -> serde_json::Value {
        let json: serde_json::Value = serde_json::from_slice(&file(at, name)).expect("JSON");
        json["sampling"].clone()
    };
    let by = |film: &str, how: &[&str]| {
        let common = ["--spp", "40", "--visibility", "1", "-o", "x.png", "--json", "x.json", "--checkpoint", film];
        render(at, &[&common[..], how].concat())
    };
    run(&mut by("seen.film", &["--seed", "2"]));
    let as_uniform = ["--seed", "2", "--resume", "--sampling", "uniform"];
    assert_refused(
        &mut by("seen.film", &as_uniform),
        &["seen.film does not fit", "by --sampling adaptive", "go on by adaptive"],
    );
    run(&mut by("even.film", &["--seed", "1", "--plans", "1"]));
    run(&mut by("even.film", &["--seed", "1", "--resume", "--sampling", "uniform"]));
    assert_eq!(sampling("x.json"), "uniform");
    let mut merge = fechner();
    merge.args(["merge", "even.film", "seen.film", "-o", "sum.png", "--json", "sum.json"]).current_dir(at);
    run(&mut merge);
    assert_eq!(sampling("sum.json"), "adaptive");
}
