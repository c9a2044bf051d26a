//! The benchmark from end to end, as small as it gets.

use crate::support::command::{self, cornell_box, fechner, repository_scene, said};
use std::path::{Path, PathBuf};
use std::process::Command;

fn bench(output: &Path, more: &[&str]) -> Command {
    let mut command = fechner();
    command.arg("bench").arg(cornell_box());
    command.args(["--size", "32", "--visibility", "12", "--reference-factor", "4", "-o"]);
    command.arg(output).args(more);
    command
}

#[test]
fn results_are_complete_and_a_second_run_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let arms = ["--seeds", "2", "--arms", "relative,tvi,default,as-asked,uniform-equal-time,to-threshold,oracle"];
    let first = command::run(&mut bench(folder.path(), &arms));
    let results = || -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).expect("written")).expect("JSON")
    };
    let found = results();
    let records = found["records"].as_array().expect("records");
    assert_eq!(found["reference_factor"], 4.0);
    assert_eq!((&found["arms"][0], &found["arms"][7]), (&"uniform".into(), &"oracle".into()));
    assert_eq!(
        (&found["references"][0]["scene"], &found["references"][0]["spp"]),
        (&"cornell-box".into(), &512.into())
    );
    assert_eq!(found["interval_level"], 0.95);
    // Eight arms, two seeds and both together, three coverages.
    assert_eq!(records.len(), 8 * 3 * 3);
    for record in records {
        for key in ["samples", "seconds", "speedup_samples", "efficiency", "flip_mean", "flip_p99", "jod", "relmse"] {
            let value = record[key].as_f64().unwrap_or(f64::NAN);
            assert!(value.is_finite() && value >= 0.0, "{key} of {record}");
        }
        assert!(record["energy_bias"].as_f64().expect("a number").abs() < 0.2, "{record}");
    }
    let report = std::fs::read_to_string(folder.path().join("report.html")).expect("written");
    assert!(report.contains("data:image/png;base64,") && report.contains("</html>"));
    let (table, printed) = (String::from_utf8_lossy(&first.stdout), "95 % intervals by the scatter between seeds");
    assert!(report.contains(printed) && table.contains(printed), "{table}");
    for part in [
        "name=\"viewport\"",
        "prefers-color-scheme: dark",
        "alt=\"cornell-box, arm oracle: true v / v*\"",
        ">v*</text>",
    ] {
        assert!(report.contains(part), "{part}");
    }
    assert!(!report.contains("http") && !report.contains("url("), "the report needs nothing else");
    assert_eq!(std::fs::read_to_string(folder.path().join("results.csv")).expect("written").lines().count(), 1 + 72);

    let renders = |folder: &Path| {
        let mut files: Vec<_> = std::fs::read_dir(folder.join("runs"))
            .expect("runs")
            .map(|entry| entry.expect("an entry").metadata().expect("metadata").modified().expect("a time"))
            .collect();
        files.sort();
        files
    };
    let before = renders(folder.path());
    command::run(&mut bench(folder.path(), &arms));
    assert_eq!(before, renders(folder.path()), "nothing is rendered twice");
    assert_eq!(found, results());
}

/// What was changed, cut or lost is made again, and is told of; before, a reference of zeros took for ever.
#[test]
fn damaged_files_are_made_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path();
    let arms = ["--seeds", "1", "--arms", "uniform"];
    let run = || said(&command::run(&mut bench(output, &arms)));
    run();
    let found = |folder: &str, ending: &str| -> PathBuf {
        let mut entries = std::fs::read_dir(output.join(folder)).expect("a folder").flatten().map(|entry| entry.path());
        entries.find(|path| path.to_string_lossy().ends_with(ending)).expect("such a file")
    };
    for kept in [found("references", ".f32"), found("runs", ".f32")] {
        let sound = std::fs::read(&kept).expect("a file");
        let mut changed = sound.clone();
        changed[sound.len() / 2] ^= 1;
        for damaged in [&changed[..], &sound[..sound.len() - 4], &vec![0; sound.len()], &[7; 4099]] {
            std::fs::write(&kept, damaged).expect("written");
            let said = run();
            let name = kept.file_name().expect("a name").to_string_lossy();
            assert!(said.contains("refused") && said.contains(&*name) && said.contains("it is made anew"), "{said}");
            assert!(std::fs::read(&kept).expect("made anew") == sound, "{name} is another");
        }
    }
    let picture = found("runs", ".picture.png");
    std::fs::remove_file(&picture).expect("was there");
    run();
    assert!(picture.is_file(), "a picture of the report is lost for ever");
    assert!(!run().contains("refused"));
}

/// Scenes of one file name in two folders are two scenes: each has its own figures, compared with its own uniform
/// render.
#[test]
fn scenes_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(cornell_box());
    let text = text.expect("there");
    for (name, reflectance) in [("light", "[0.74, 0.73, 0.70]"), ("dark", "[0.2, 0.2, 0.2]")] {
        std::fs::create_dir(folder.path().join(name)).expect("made");
        let text = text.replace("[0.74, 0.73, 0.70]", reflectance);
        std::fs::write(folder.path().join(name).join("box.toml"), text).expect("written");
    }
    let mut command = fechner();
    command.args(["bench", "light/box.toml", "dark/box.toml", "--size", "32", "--visibility", "12"]);
    command.args(["--reference-factor", "4", "--seeds", "1", "--arms", "uniform,tvi", "-o", "out"]);
    command::run(command.current_dir(folder.path()));
    let results: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out/results.json")).expect("written")).expect("JSON");
    let records = results["records"].as_array().expect("records");
    for scene in ["light/box", "dark/box"] {
        let own: Vec<_> = records.iter().filter(|record| record["scene"] == scene).collect();
        assert_eq!(own.len(), 2 * 2 * 3, "{scene}");
        let uniform = own.iter().filter(|record| record["arm"] == "uniform");
        assert!(uniform.clone().all(|record| record["speedup_samples"] == 1.0), "{scene}");
    }
    assert!(results["summary"][0]["speedup_samples"]["low"].is_null(), "one seed has no interval");
}

#[test]
fn bounds_need_no_arms_and_unknown_arms_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let bound = command::run(&mut bench(folder.path(), &["--bound"]));
    let table = String::from_utf8_lossy(&bound.stdout).into_owned();
    assert_eq!(table.lines().count(), 5, "{table}");
    let refused = bench(folder.path(), &["--arms", "magic"]).output().expect("runs");
    assert_eq!(refused.status.code(), Some(2));
    let told = String::from_utf8_lossy(&refused.stderr);
    assert!(told.contains("magic") && told.contains("no-masking"), "{told}");
}

/// Uniform sampling is a rule like others: its samples are enough for the optimum, too, where it needs fewer than a
/// pilot.
#[test]
fn no_rule_beats_the_bound() {
    let folder = tempfile::tempdir().expect("a folder");
    let bound = command::run(&mut bench(folder.path(), &["--bound"]));
    let table = String::from_utf8_lossy(&bound.stdout).into_owned();
    for row in table.lines().skip(2) {
        let figure =
            |cell: usize| -> f64 { row.split('|').nth(cell).and_then(|c| c.trim().parse().ok()).unwrap_or(0.0) };
        assert!(figure(3) < 16.0 && figure(5) >= 1.0, "{table}");
    }
}

/// What is not installed is told of before the first denoiser's hours.
#[test]
fn denoisers_of_shots_are_opened_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = repository_scene("rolling-ball.toml");
    let mut command = fechner();
    command.arg("bench").arg(scene).args([
        "--suite",
        "animation",
        "--size",
        "32",
        "--fps",
        "24",
        "--reference-factor",
        "1",
    ]);
    command.args(["--denoise", "none,oidn", "-o", "out"]).env("OIDN_DIR", folder.path()).current_dir(folder.path());
    let run = command.output().expect("runs");
    assert_eq!((run.status.code(), run.stdout.len()), (Some(2), 0), "{}", String::from_utf8_lossy(&run.stderr));
    assert!(!folder.path().join("out").exists(), "something was run");
}

/// A scene is judged as it is shown: one that is exposed four stops darker has less noise to be seen.
#[test]
fn scenes_are_judged_at_their_own_exposure() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(cornell_box());
    let text = text.expect("there");
    std::fs::write(folder.path().join("plain.toml"), &text).expect("written");
    let dim = text.replace("[view]\n", "[view]\nexposure_stops = -4.0\n");
    assert_ne!(dim, text);
    std::fs::write(folder.path().join("dim.toml"), dim).expect("written");
    let mut command = fechner();
    command.args(["bench", "plain.toml", "dim.toml", "--size", "32", "--visibility", "4", "--bound", "-o", "out"]);
    let run = command.current_dir(folder.path()).output().expect("runs");
    let table = String::from_utf8_lossy(&run.stdout).into_owned();
    let uniform = |scene: &str| -> f64 {
        let row = table.lines().find(|line| line.contains(scene)).unwrap_or_else(|| panic!("{table}"));
        row.split('|').nth(3).and_then(|cell| cell.trim().parse().ok()).unwrap_or_else(|| panic!("{row}"))
    };
    assert!(uniform("dim") < 0.7 * uniform("plain"), "{table}");
}

/// Nothing but a sky of one colour, or of none: no noise, nothing to see, and still figures.
#[test]
fn scenes_without_noise_or_light_have_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let camera = "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nvertical_fov_deg = 40\n";
    let far = "[[objects]]\nsphere = { center = [0, 0, 90], radius = 1 }\nmaterial = \"m\"\n";
    let grey =
        "[materials.m]\ntype = \"diffuse\"\nreflectance = [0.5, 0.5, 0.5]\n[environment]\nradiance = [0.3, 0.3, 0.3]\n";
    let lamp = "[materials.m]\ntype = \"diffuse\"\nreflectance = [0, 0, 0]\nemission = [9, 9, 9]\n";
    for (name, parts) in [("flat.toml", grey), ("black.toml", lamp)] {
        std::fs::write(folder.path().join(name), [camera, parts, far].concat()).expect("written");
    }
    let run = |more: &[&str]| {
        let mut command = fechner();
        command.args(["bench", "flat.toml", "black.toml", "--size", "32", "--reference-factor", "0.25"]);
        command.args(["-o", "out"]).args(more).current_dir(folder.path());
        let run = command::run(&mut command);
        let said = String::from_utf8_lossy(&[run.stdout, run.stderr].concat()).into_owned();
        assert!(!said.contains("NaN") && !said.contains("inf"), "{more:?}: {said}");
        said
    };
    run(&["--arms", "uniform,relative,as-asked,oracle", "--seeds", "1"]);
    run(&["--suite", "denoise", "--denoise", "builtin", "--law-only", "--seeds", "1"]);
    let table = run(&["--bound"]);
    assert_eq!(table.matches("| 1.0 | 1.0 | 1.00 |").count(), 6, "{table}");
    for name in ["results.csv", "report.html"] {
        let text = std::fs::read_to_string(folder.path().join("out").join(name)).expect("written");
        assert!(!text.contains("NaN") && !text.contains("inf,"), "{name}");
    }
    let records: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out/results.json")).expect("written")).expect("JSON");
    for record in records["records"].as_array().expect("records") {
        assert_eq!(record["energy_bias"].is_null(), record["scene"] == "black", "{record}");
        assert!(record["speedup_samples"].is_null() && record["reached"] == 0.0, "{record}");
    }
}

/// A name with all that CSV and HTML read otherwise.
#[test]
fn names_of_scenes_are_quoted() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("a, <b> & 'c'.toml");
    std::fs::copy(cornell_box(), &scene).expect("copied");
    let mut command = fechner();
    command.arg("bench").arg(&scene).args([
        "--size",
        "32",
        "--visibility",
        "12",
        "--reference-factor",
        "1",
        "--seeds",
        "1",
    ]);
    command::run(command.args(["--arms", "uniform", "-o", "out"]).current_dir(folder.path()));
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).expect("written");
    assert!(read("results.csv").lines().skip(1).all(|line| line.starts_with("\"a, <b> & 'c'\",uniform,")));
    let report = read("report.html");
    assert!(report.contains("<h2>a, &lt;b&gt; &amp; &#39;c&#39;</h2>") && !report.contains("<b>"), "{report}");
}

/// Renders of the suite denoise are kept as those of arms are.
#[test]
fn denoised_renders_are_not_made_twice() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = || {
        let arguments = ["--suite", "denoise", "--denoise", "builtin", "--law-only", "--seeds", "1"];
        command::run(&mut bench(folder.path(), &arguments));
        std::fs::read_to_string(folder.path().join("denoise.json")).expect("written")
    };
    // Seconds are in it, which no two renders share.
    assert_eq!(run(), run());
}

#[test]
fn the_suite_animation_writes_its_rows() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = repository_scene("rolling-ball.toml");
    let mut command = fechner();
    command.arg("bench").arg(scene).args(["--suite", "animation", "--size", "32", "--fps", "24", "--visibility", "12"]);
    command::run(command.args(["--reference-factor", "1", "-o"]).arg(folder.path().join("out")));
    let text = std::fs::read(folder.path().join("out/animation.json")).expect("written");
    let results: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    assert!(results[0]["denoiser"].is_null());
    assert_eq!(results[0]["rows"][0]["scene"], "rolling-ball");
    let even = results[0]["rows"][0]["uniform_spp"].as_object().expect("samples or a bound");
    assert!(["about", "at_most", "more_than"].iter().any(|key| even.contains_key(*key)), "{even:?}");
}

/// One line of what is wrong and what would be right, before anything is rendered.
#[test]
fn what_cannot_be_run_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box();
    let again = scene.with_file_name("../scenes/cornell-box.toml").display().to_string();
    for (arguments, why) in [
        (
            &["--suite", "denoise", "--denoise", "builtin", "--display", "wall"][..],
            "no display preset is called `wall`; there are: ",
        ),
        (&["--suite", "denoise", "--denoise", "none"], "--denoise none: the suite denoise judges denoised pictures"),
        (&[&again], "named twice, here and as "),
        (&["--display", "wall"], "no display preset is called `wall`; there are: "),
        (&["--suite", "animation", "--display", "wall"], "no display preset is called `wall`; there are: "),
    ] {
        let refused = bench(&folder.path().join("out"), arguments).output().expect("runs");
        let said = said(&refused);
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains(why) && said.trim().lines().count() == 1, "{said}");
        assert!(!folder.path().join("out").exists(), "{arguments:?}: something was written");
    }
    for suite in [&["quick"][..], &["denoise", "--denoise", "builtin"], &["animation"]] {
        let mut command = fechner();
        command.args(["bench", "nosuch.toml", "-o", "out", "--suite"]).args(suite).current_dir(folder.path());
        let refused = command.output().expect("runs");
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains("nosuch.toml"), "{suite:?}: {said}");
        assert!(!folder.path().join("out").exists(), "{suite:?}: something was written");
    }
}
