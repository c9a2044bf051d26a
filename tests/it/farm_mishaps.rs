//! `fechner farm` where a file is lost, a command was interrupted or what is asked for cannot be.

use crate::farm::{OPTIONS, fechner, file, is_done, missing, one_process, picture, plan, run, scene};
use crate::support::command::{repository_scene, said};
#[cfg(unix)]
use crate::support::{signal, wait_for};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Works until the end, which comes within minutes.
fn work(farm: &Path) -> String {
    let mut child = fechner(farm, &["farm", "work", "."]).spawn().expect("runs");
    let started = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if started.elapsed() > Duration::from_secs(200) {
            child.kill().expect("killed");
            panic!("farm work does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().expect("ended");
    assert!(output.status.success(), "{}", said(&output));
    said(&output)
}

/// A farm whose second round is handed out.
fn in_its_second_round(folder: &Path, name: &str) -> PathBuf {
    let farm = plan(folder, name, &OPTIONS);
    run(&farm, 0, &["farm", "unit", ".", "0", "1", "2", "3"]);
    run(&farm, 0, &["farm", "merge", "."]);
    assert!(!missing(&farm).is_empty(), "one round is enough to show nothing");
    farm
}

/// The frame begins anew, and ends with the same bytes.
#[test]
fn a_film_that_is_lost_or_damaged_is_made_anew() {
    let (folder, whole) = one_process(&OPTIONS);
    let lost = in_its_second_round(folder.path(), "lost");
    std::fs::remove_file(lost.join("frame-0000/film")).expect("was there");
    assert!(missing(&lost).is_empty(), "units of a round without its film are of no use");
    work(&lost);
    assert!(picture(&lost) == whole, "the picture differs from one process's");

    let damaged = in_its_second_round(folder.path(), "damaged");
    let film = damaged.join("frame-0000/film");
    let bytes = file(&film);
    std::fs::write(&film, &bytes[..bytes.len() / 2]).expect("written");
    let leftover = damaged.join("frame-0000/.film.x1Y2z3.part");
    std::fs::write(&leftover, "of a merge that was killed").expect("written");
    let message = work(&damaged);
    assert!(message.contains("it is damaged") && message.contains("begins anew"), "{message}");
    assert!(film.with_extension("refused").exists() && !leftover.exists());
    assert!(picture(&damaged) == whole, "the picture differs from one process's");
}

/// Squares of such light are beyond f32, and what the film keeps of them must be read again: by a farm, and by a
/// render that goes on.
#[test]
fn extreme_light_comes_to_an_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let lit = std::fs::read_to_string(scene()).expect("the scene");
    let lines =
        lit.lines().map(|line| if line.starts_with("emission") { "emission = [1e22, 1e22, 1e22]" } else { line });
    std::fs::write(folder.path().join("lit.toml"), lines.collect::<Vec<_>>().join("\n")).expect("written");
    let uniform = ["--size", "16x16", "--sampling", "uniform", "--spp"];
    let plan = ["farm", "plan", "lit.toml", "-o", "farm", "--unit-samples", "1000", "--passes", "2", "--"];
    run(folder.path(), 0, &[&plan, &uniform[..], &["64"]].concat());
    let said = work(&folder.path().join("farm"));
    assert!(!said.contains("begins anew"), "{said}");
    for spp in ["16", "32"] {
        let film = ["--checkpoint", "lit.film", "--resume", "-o", "lit.exr"];
        run(folder.path(), 0, &[&["render", "lit.toml"], &uniform[..], &[spp], &film].concat());
    }
}

/// Rounds that come without a look have numbers of their own: nothing of an earlier one is found in their folder.
#[test]
fn rounds_without_a_look_are_rounds() {
    let uniform = ["--size", "48x48", "--seed", "3", "--filter", "mitchell", "--sampling", "uniform", "--spp", "64"];
    for options in [&[&OPTIONS[..], &["--denoise", "builtin"]].concat()[..], &uniform] {
        let (folder, whole) = one_process(options);
        let farm = plan(folder.path(), "farm", options);
        let message = work(&farm);
        assert!(!message.contains("refused"), "{message}");
        assert!(picture(&farm) == whole, "{options:?}: the picture differs from one process's");
    }
}

#[test]
fn a_plan_that_was_interrupted_goes_on_and_remains_are_no_farm() {
    let (folder, whole) = one_process(&OPTIONS);
    let farm = plan(folder.path(), "farm", &OPTIONS);
    std::fs::remove_dir_all(farm.join("frame-0000")).expect("was there");
    work(&farm);
    assert!(picture(&farm) == whole, "the picture differs from one process's");

    std::fs::remove_file(farm.join("manifest.json")).expect("was there");
    let again = ["farm", "plan", &scene(), "-o", "farm", "--", "--size", "32x32", "--visibility", "16"];
    let message = run(folder.path(), 2, &again);
    assert!(message.contains("frame-0000 is left of a farm") || message.contains("concluded is left"), "{message}");
}

/// A merge that traces itself ends by a signal with its film, and goes on from there.
#[cfg(unix)]
#[test]
fn a_merge_that_traces_goes_on_from_its_film() {
    let options = ["--size", "256x256", "--sampling", "uniform", "--spp", "64"];
    let (folder, whole) = one_process(&options);
    let plan = ["farm", "plan", &scene(), "--unit-samples", "1000000000", "-o", "farm", "--"];
    let said_of_plan = run(folder.path(), 0, &[&plan[..], &options].concat());
    // 16 × 256² samples.
    let why = "a frame's first round has 1.05 million samples, fewer than --unit-samples 1000000000";
    assert!(said_of_plan.contains(why) && !said_of_plan.contains("0 units"), "{said_of_plan}");
    let farm = folder.path().join("farm");
    let film = farm.join("frame-0000/film");
    let merge = ["farm", "merge", ".", "--threads", "1", "--checkpoint-every", "0.001"];
    let mut child = fechner(&farm, &merge).spawn().expect("runs");
    wait_for(&film, &mut child);
    signal(&child, "-TERM");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(75), "{}", said(&output));
    assert!(said(&output).contains("its film is there"), "{}", said(&output));
    run(&farm, 0, &merge);
    assert!(picture(&farm) == whole, "the picture differs from one process's");
}

/// A shot of three frames in a folder whose name has a place for numbers.
fn plan_shot(at: &Path, options: &[&str]) -> (i32, String) {
    let scene = repository_scene("rolling-ball.toml").display().to_string();
    let plan = ["farm", "plan", &scene, "--frames", "4..6", "--unit-samples", "1000", "-o", "a#b/farm", "--"];
    let arguments = [&plan[..], &["--size", "32x18", "--visibility", "8"], options].concat();
    let output = fechner(at, &arguments).output().expect("runs");
    (output.status.code().expect("no signal"), said(&output))
}

#[test]
fn a_shot_is_whole_with_its_video_and_its_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (options, fragment) in [
        (&["--time", "3"][..], "--time and --plans end one process"),
        (&["--threads", "3"], "--threads is of one process"),
        (&["--video", "shot.avi"], "videos end in .y4m or .mp4"),
        (&["--video", "shot.y4m", "--shot", "0..9"], "--video needs all 10 frames of the shot"),
        (&["--video", "nowhere/shot.y4m"], "nowhere"),
    ] {
        let (status, message) = plan_shot(at, options);
        assert!(status == 2 && message.contains(fragment), "{fragment}: {message}");
        assert!(!at.join("a#b").exists(), "{fragment}: what a failed plan made is left");
    }
    let videos = at.join("videos");
    std::fs::create_dir(&videos).expect("made");
    let (status, message) = plan_shot(at, &["--video", "videos/shot.y4m"]);
    assert!(status == 0 && message.contains("3 frames"), "{message}");
    let farm = at.join("a#b/farm");
    std::fs::remove_dir(&videos).expect("removed");
    assert!(run(&farm, 2, &["farm", "work", "."]).contains("videos/shot.y4m"));
    assert!(!is_done(&farm), "without its video a shot is not done");
    std::fs::create_dir(&videos).expect("made");
    run(&farm, 0, &["farm", "merge", "."]);
    assert!(is_done(&farm) && videos.join("shot.y4m").exists());

    let lost = farm.join("pictures/frame.0005.exr");
    let before = file(&lost);
    let status = || {
        let output = fechner(&farm, &["farm", "status", "."]).output().expect("runs");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    assert!(status().contains("frame 5: done\n"), "{}", status());
    std::fs::write(&lost, "").expect("emptied");
    assert!(status().contains("frame 5: done, but its picture is gone or empty") && !is_done(&farm), "{}", status());
    let message = run(&farm, 2, &["farm", "work", "."]);
    assert!(
        message.contains("frame.0005.exr is gone or empty") && message.contains("frame-0005/result.json"),
        "{message}"
    );
    std::fs::remove_file(farm.join("frame-0005/result.json")).expect("was there");
    work(&farm);
    assert!(file(&lost) == before, "the picture made again differs");
}
