//! The benchmark from end to end, as small as it gets.

use assert_cmd::Command;
use std::path::{Path, PathBuf};

fn bench(output: &Path, more: &[&str]) -> std::process::Output {
    let scene: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let mut command = Command::cargo_bin("fechner").expect("the binary is built");
    command.arg("bench").arg(scene).args(["--size", "32", "--visibility", "12", "--reference-factor", "4", "-o"]);
    command.arg(output).args(more).output().expect("runs")
}

#[test]
fn results_are_complete_and_a_second_run_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let arms = ["--seeds", "2", "--arms", "relative,tvi,default,as-asked,uniform-equal-time,to-threshold,oracle"];
    let first = bench(folder.path(), &arms);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let results = || -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).expect("written")).expect("JSON")
    };
    let found = results();
    let records = found["records"].as_array().expect("records");
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
    let again = bench(folder.path(), &arms);
    assert!(again.status.success());
    assert_eq!(before, renders(folder.path()), "nothing is rendered twice");
    assert_eq!(found, results());
}

/// Scenes of one file name in two folders are two scenes: each has its own figures, compared with its own uniform render.
#[test]
fn scenes_of_one_name_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml"));
    let text = text.expect("there");
    for (name, reflectance) in [("light", "[0.74, 0.73, 0.70]"), ("dark", "[0.2, 0.2, 0.2]")] {
        std::fs::create_dir(folder.path().join(name)).expect("made");
        let text = text.replace("[0.74, 0.73, 0.70]", reflectance);
        std::fs::write(folder.path().join(name).join("box.toml"), text).expect("written");
    }
    let mut command = Command::cargo_bin("fechner").expect("the binary is built");
    command.args(["bench", "light/box.toml", "dark/box.toml", "--size", "32", "--visibility", "12"]);
    command.args(["--reference-factor", "4", "--seeds", "1", "--arms", "uniform,tvi", "-o", "out"]);
    let run = command.current_dir(folder.path()).output().expect("runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
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
    let bound = bench(folder.path(), &["--bound"]);
    let table = String::from_utf8_lossy(&bound.stdout).into_owned();
    assert!(bound.status.success() && table.lines().count() == 5, "{table}");
    let refused = bench(folder.path(), &["--arms", "magic"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("there is no arm \"magic\""));
}
