//! `fechner farm`: many processes on one folder make the bytes of one process, whatever happens to them.

use crate::support::command::{self, repository_scene, said};
#[cfg(unix)]
use crate::support::{signal, wait_for};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The still that is rendered here: as one process, and as farms.
pub(crate) const OPTIONS: [&str; 6] = ["--size", "48x48", "--visibility", "4", "--seed", "3"];

pub(crate) fn fechner(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = command::fechner();
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

pub(crate) fn scene() -> String {
    command::cornell_box().display().to_string()
}

/// Runs and expects this exit status; what it said.
pub(crate) fn run(folder: &Path, status: i32, arguments: &[&str]) -> String {
    let output = fechner(folder, arguments).output().expect("runs");
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}", said(&output));
    said(&output)
}

pub(crate) fn file(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The picture of one process, in a folder of its own.
pub(crate) fn one_process(options: &[&str]) -> (tempfile::TempDir, Vec<u8>) {
    let folder = tempfile::tempdir().expect("a folder");
    run(folder.path(), 0, &[&["render", &scene(), "-o", "one.exr"], options].concat());
    let picture = file(&folder.path().join("one.exr"));
    (folder, picture)
}

/// A farm of small units under a name.
pub(crate) fn plan(folder: &Path, name: &str, options: &[&str]) -> PathBuf {
    let plan = ["farm", "plan", &scene(), "--passes", "4", "--unit-samples", "6000", "-o", name, "--"];
    run(folder, 0, &[&plan, options].concat());
    folder.join(name)
}

/// Numbers of the units that are missing.
pub(crate) fn missing(folder: &Path) -> Vec<String> {
    let output = command::run(&mut fechner(folder, &["farm", "status", ".", "--list", "units"]));
    String::from_utf8(output.stdout).expect("numbers").lines().map(str::to_owned).collect()
}

pub(crate) fn is_done(folder: &Path) -> bool {
    let output = fechner(folder, &["farm", "status", ".", "--json"]).output().expect("runs");
    let status: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    status["done"] == true
}

pub(crate) fn picture(farm: &Path) -> Vec<u8> {
    file(&farm.join("pictures/picture.exr"))
}

#[test]
fn any_number_of_workers_makes_the_bytes_of_one_process() {
    let (folder, whole) = one_process(&OPTIONS);
    for workers in 1..=3 {
        let farm = plan(folder.path(), &format!("workers-{workers}"), &OPTIONS);
        let work = ["farm", "work", ".", "--threads", "1"];
        let children: Vec<Child> = (0..workers).map(|_| fechner(&farm, &work).spawn().expect("runs")).collect();
        let mut rendered = 0;
        for child in children {
            let output = child.wait_with_output().expect("ended");
            assert!(output.status.success(), "{}", said(&output));
            rendered += said(&output).lines().filter(|line| line.contains(" samples in ")).count();
        }
        assert!(rendered > 8, "only {rendered} units are no farm");
        assert!(picture(&farm) == whole, "{workers} workers made another picture");
        assert!(is_done(&farm) && missing(&farm).is_empty());
        let mut left: Vec<_> = std::fs::read_dir(farm.join("frame-0000")).expect("a folder").flatten().collect();
        left.retain(|entry| entry.file_name() != "lock" && entry.file_name() != "result.json");
        assert!(left.is_empty(), "{left:?}");
    }
}

/// Backwards, twice, late, damaged, from elsewhere: nothing of it reaches the picture.
#[test]
fn order_repetition_and_bad_files_change_nothing() {
    let (folder, whole) = one_process(&OPTIONS);
    let farm = plan(folder.path(), "farm", &OPTIONS);
    let other = plan(folder.path(), "other", &["--size", "48x48", "--visibility", "4", "--seed", "4"]);
    run(&other, 0, &["farm", "unit", ".", "0", "1"]);
    let unit = |number: &str| run(&farm, 0, &["farm", "unit", ".", number]);
    let sums = |number: usize| farm.join(format!("frame-0000/round-000/unit-{number:06}.sums"));

    let message = run(&farm, 75, &["farm", "merge", "."]);
    assert!(message.contains("frame 0: waits for units 0, 1, 2, 3"), "{message}");
    assert_eq!(missing(&farm), ["0", "1", "2", "3"]);
    for number in ["3", "2", "1", "0"] {
        unit(number);
    }
    let first = file(&sums(0));
    assert!(unit("0").contains("unit 0: is there"));
    assert!(file(&sums(0)) == first, "a unit that is there was rendered again");

    // Another farm's, another unit's, half a file, and none of ours.
    std::fs::copy(other.join("frame-0000/round-000/unit-000000.sums"), sums(0)).expect("copied");
    std::fs::copy(sums(2), sums(1)).expect("copied");
    let half = file(&sums(2));
    std::fs::write(sums(2), &half[..half.len() / 2]).expect("written");
    std::fs::write(sums(3), "something else").expect("written");
    let message = run(&farm, 75, &["farm", "merge", "."]);
    for fragment in [
        "unit-000000.sums does not fit",
        "unit-000001.sums does not fit",
        "unit-000002.sums: it is damaged",
        "unit-000003.sums: it is not a unit's sums",
    ] {
        assert!(message.contains(fragment), "{fragment} is not in {message}");
    }
    assert_eq!(missing(&farm), ["0", "1", "2", "3"], "what is refused is rendered again");
    // A unit refuses bad files as well: its result and its checkpoint. A lost order is written again.
    std::fs::write(sums(2), &half[..half.len() - 1]).expect("written");
    std::fs::write(sums(3).with_extension("partial"), &first).expect("written");
    std::fs::remove_file(sums(1).with_extension("order")).expect("was there");
    assert!(unit("2").contains("refused"));
    let message = unit("3");
    assert!(message.contains("unit-000003.partial") && message.contains("refused"), "{message}");
    assert!(run(&farm, 2, &["farm", "unit", ".", "1"]).contains("fechner farm merge writes it again"));
    run(&farm, 75, &["farm", "merge", "."]);
    unit("1");
    unit("0");
    let late = file(&sums(1));
    run(&farm, 0, &["farm", "merge", "."]);

    // What comes after its round is merged counts no second time.
    std::fs::create_dir_all(sums(1).parent().expect("a folder")).expect("made");
    std::fs::write(sums(1), late).expect("written");
    assert!(unit("1").contains("is merged"));
    assert!(run(&farm, 2, &["farm", "unit", ".", "3999"]).contains("unit 3999 is not planned"));
    while !is_done(&farm) {
        for number in missing(&farm).iter().rev() {
            unit(number);
        }
        run(&farm, 0, &["farm", "merge", "."]);
    }
    run(&farm, 0, &["farm", "merge", "."]);
    assert!(unit("1").contains("is merged"));
    let message = run(&farm, 2, &["farm", "unit", ".", "3999"]);
    assert!(message.contains("unit 3999 is not planned: frame 0 is done, after "), "{message}");
    assert!(picture(&farm) == whole, "the picture differs from one process's");
}

/// SIGUSR1 writes the checkpoint and goes on, SIGTERM writes it and ends, SIGKILL leaves the last: each time the next
/// process goes on from there.
#[cfg(unix)]
#[test]
fn a_unit_goes_on_from_its_checkpoint() {
    let options = ["--size", "256x256", "--sampling", "uniform", "--spp", "16"];
    let (folder, whole) = one_process(&options);
    run(
        folder.path(),
        0,
        &[&["farm", "plan", &scene(), "--passes", "1", "--unit-samples", "1", "-o", "farm", "--"], &options[..]]
            .concat(),
    );
    let farm = folder.path().join("farm");
    let partial = farm.join("frame-0000/round-000/unit-000000.partial");
    let seldom = ["farm", "unit", ".", "0", "--threads", "1"];
    let always = [&seldom[..], &["--checkpoint-every", "0.001"]].concat();

    let mut child = fechner(&farm, &seldom).spawn().expect("runs");
    let lock = partial.with_extension("lock");
    wait_for(&lock, &mut child);
    std::thread::sleep(std::time::Duration::from_millis(100));
    signal(&child, "-USR1");
    wait_for(&partial, &mut child);
    assert!(child.try_wait().expect("a child").is_none(), "USR1 ends nothing");
    signal(&child, "-TERM");
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(75), "{}", said(&output));
    assert!(said(&output).contains("its checkpoint is there"), "{}", said(&output));
    let before = file(&partial);

    let mut child = fechner(&farm, &always).spawn().expect("runs");
    while file(&partial) == before && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().expect("SIGKILL");
    let output = child.wait_with_output().expect("ended");
    assert!(said(&output).contains("goes on from its checkpoint"), "{}", said(&output));
    assert!(!partial.with_extension("sums").exists(), "the kill came too late to show anything");

    let message = run(&farm, 0, &seldom);
    assert!(message.contains("goes on from its checkpoint"), "{message}");
    assert!(!partial.exists());
    run(&farm, 0, &["farm", "merge", "."]);
    assert!(picture(&farm) == whole, "the resumed picture differs");
}

/// Frames of a shot have the bytes that `animate` gives them, and `animate` finds them there.
#[test]
fn frames_are_those_of_animate() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let scene = repository_scene("rolling-ball.toml").display().to_string();
    let options = ["--fps", "12", "--size", "32x18", "--visibility", "8"];
    let animate = ["animate", &scene, "--frames", "4..6", "-o", "whole/frame.####.exr"];
    run(at, 0, &[&animate[..], &options].concat());
    let plan =
        ["farm", "plan", &scene, "--frames", "4..6", "--passes", "3", "--unit-samples", "1000", "-o", "farm", "--"];
    run(at, 0, &[&plan[..], &options, &["--video", "shot.y4m"]].concat());
    let farm = at.join("farm");
    let works: Vec<Child> = (0..2).map(|_| fechner(&farm, &["farm", "work", "."]).spawn().expect("runs")).collect();
    for work in works {
        let output = work.wait_with_output().expect("ended");
        assert!(output.status.success(), "{}", said(&output));
    }
    for name in ["frame.0004.exr", "frame.0005.exr", "frame.0006.exr", "frame.track.json"] {
        assert!(file(&at.join("whole").join(name)) == file(&farm.join("pictures").join(name)), "{name} differs");
    }
    assert!(at.join("shot.y4m").exists());
    let again = ["animate", &scene, "--frames", "4..6", "-o", "farm/pictures/frame.####.exr"];
    let message = run(at, 0, &[&again[..], &options].concat());
    assert_eq!(message.matches("is there").count(), 3, "{message}");
}

/// A film that was kept makes its frame's picture again, and is a beginning for `render`, to whom it is a still.
#[test]
fn kept_films_are_those_of_their_frames() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("gaze.csv"), "6,10,20\n").expect("written");
    let scene = repository_scene("light-switch.toml").display().to_string();
    let plan = ["farm", "plan", &scene, "--frames", "5..6", "--keep-films", "--format", "png", "-o", "farm", "--"];
    let how = ["--size", "48x27", "--visibility", "4"];
    run(at, 0, &[&plan[..], &how, &["--shot", "5..10", "--gaze", "gaze.csv"]].concat());
    run(at, 0, &["farm", "work", "farm", "--threads", "1"]);
    let json = |name: &str| -> serde_json::Value { serde_json::from_slice(&file(&at.join(name))).expect("JSON") };
    for frame in ["0005", "0006"] {
        let film = format!("farm/frame-{frame}/finished.film");
        run(at, 0, &["merge", &film, "-o", "again.png", "--json", "again.json"]);
        let picture = at.join(format!("farm/pictures/frame.{frame}.png"));
        assert!(file(&at.join("again.png")) == file(&picture), "the film of frame {frame} shows another picture");
        let (again, of_frame) = (json("again.json"), json(&format!("farm/pictures/frame.{frame}.json")));
        for figure in ["scene", "seed", "seeds", "csf", "eye", "operator", "stop_reason"] {
            assert_eq!(again[figure], of_frame["report"][figure], "{figure} of frame {frame}");
        }
        // Films do not say which small things their frames were known to have: the noise of few pixels is told
        // otherwise.
        let [told, of_frame] = [&again, &of_frame["report"]].map(|report| report["visibility_max"].as_f64());
        let ratio = told.zip(of_frame).map(|(told, of_frame)| told / of_frame).expect("two visibilities");
        assert!((ratio - 1.0).abs() < 1e-3, "visibility of frame {frame}: {ratio} times as strong");
    }
    let film = "farm/frame-0006/finished.film";
    let said = run(at, 0, &["merge", film, "-o", "again.exr"]);
    assert!(said.contains("films keep no motion"), "{said}");

    // At rest its noise is seen better than in motion: it takes more samples.
    let before = json("again.json");
    let (seed, seconds) = (before["seed"].to_string(), (6.0 / 24.0).to_string());
    let still = ["render", &scene, "--at", &seconds, "--seed", &seed, "-o", "still.png", "--json", "still.json"];
    let said = run(at, 0, &[&still[..], &how, &["--checkpoint", film, "--resume"]].concat());
    assert!(said.contains("its samples are kept, its ladder begins anew"), "{said}");
    let after = json("still.json");
    assert_eq!(after["stop_reason"], "visibility", "{said}");
    assert!(after["samples_total"].as_u64() > before["samples_total"].as_u64(), "{said}");
}

#[test]
fn what_cannot_be_farmed_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let copy = at.join("box.toml");
    std::fs::copy(scene(), &copy).expect("copied");
    let plan = |name: &str, options: &[&str]| {
        let output = fechner(at, &[&["farm", "plan", "box.toml", "-o", name, "--"], options].concat()).output();
        let output = output.expect("runs");
        (output.status.code(), said(&output))
    };
    for (options, fragment) in [
        (&["--time", "3"][..], "--time"),
        (&["--sizes", "3"][..], "--sizes"),
        (&["--checkpoint", "a.film"][..], "--checkpoint"),
        (&["--size", "0x3"][..], "0x3"),
        (&["--plans", "3"][..], "--plans"),
        (&["--threads", "3"][..], "--threads is of one process"),
        (&["--display", "wall"][..], "wall"),
    ] {
        let (status, message) = plan("farm", options);
        assert!(status == Some(2) && message.contains(fragment), "{fragment}: {message}");
        assert!(!message.contains("panicked"), "{message}");
        assert!(!at.join("farm").exists(), "{fragment}: what a failed plan made is left");
    }
    assert!(run(at, 2, &["farm", "status", "."]).contains("manifest.json"));
    let options = ["--size", "32x32", "--visibility", "16"];
    assert_eq!(plan("farm", &options).0, Some(0));
    let (status, message) = plan("farm", &options);
    assert!(status == Some(2) && message.contains("is a farm already"), "{message}");

    // A scene that changes under a farm.
    let text = std::fs::read_to_string(&copy).expect("text");
    std::fs::write(&copy, text.replacen("0.", "0.1", 1)).expect("written");
    assert!(run(at, 2, &["farm", "merge", "farm"]).contains("another scene"));
    std::fs::write(&copy, &text).expect("written");
    run(at, 0, &["farm", "merge", "farm"]);

    let manifest = at.join("farm/manifest.json");
    let text = std::fs::read_to_string(&manifest).expect("text");
    for (from, to, fragment) in [
        ("\"fechner ", "\"fechner 9", "planned by"),
        ("\"farm_format\": 1", "\"farm_format\": 7", "version 7"),
        ("\"passes\": 16", "\"passes\": 0", "passes"),
        ("\"frames\"", "\"framez\"", "frames"),
        ("\"width\": ", "\"width\": 42949672", "more pixels"),
        ("\"directory\": \"", "\"directory\": \"/nowhere", "mount"),
    ] {
        assert!(text.contains(from), "{from} is not in {text}");
        std::fs::write(&manifest, text.replacen(from, to, 1)).expect("written");
        let message = run(at, 2, &["farm", "unit", "farm", "0"]);
        assert!(message.contains(fragment) && message.contains("manifest") | message.contains("mount"), "{message}");
    }
}
