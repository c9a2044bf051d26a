//! Samples go where a user's map sends them, and the film remembers by which map.

use crate::support::command::{self, cornell_box, fechner};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage as _};
use fechner::exr_read::{ExrImage, read_exr};
use fechner::output::{Attribute, NITS_PER_UNIT, Picture, write_exr};
use std::path::Path;
use std::process::Command;

const SIZE: usize = 48;

fn render(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = fechner();
    command.arg("render").arg(cornell_box()).args(["--size", "48x48", "--visibility", "4", "--display", "strict"]);
    command.args(arguments).current_dir(folder);
    command
}

fn rendered(folder: &Path, name: &str, arguments: &[&str]) -> ExrImage {
    command::run(&mut render(folder, &[&["-o", name], arguments].concat()));
    read_exr(&folder.join(name)).expect("readable")
}

/// A map of 8×8 values, by column.
fn write_map(folder: &Path, name: &str, value_at: impl Fn(usize) -> f32) {
    let mut map = Picture::new(8, 8);
    map.push_f32("Y", (0..64).map(|i| value_at(i % 8)).collect::<Vec<f32>>());
    write_exr(&folder.join(name), &map).expect("written");
}

/// Samples of the left third over those of the right third.
fn left_over_right(picture: &ExrImage) -> f64 {
    let counts = picture.channel("samples.Y").expect("counts");
    let sum = |columns: std::ops::Range<usize>| -> f64 {
        (0..SIZE).flat_map(|y| columns.clone().map(move |x| f64::from(counts[y * SIZE + x]))).sum()
    };
    sum(0..SIZE / 3) / sum(2 * SIZE / 3..SIZE)
}

/// Thresholds halved on the left and doubled on the right, in a picture whose halves are alike.
#[test]
fn samples_go_where_the_map_sends_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    write_map(at, "left.exr", |x| if x < 4 { 0.5 } else { 2.0 });
    write_map(at, "one.exr", |_| 1.0);
    let plain = rendered(at, "plain.exr", &[]);
    let left = rendered(at, "left-matters.exr", &["--importance", "left.exr", "--json", "left.json"]);
    let (before, after) = (left_over_right(&plain), left_over_right(&left));
    println!("left over right {before:.2}, with the map {after:.2}");
    // Free counts would become 16 times as many; the right cannot have fewer than the pilot's.
    assert!(after > 2.0 * before, "{before} became {after}");
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at.join("left.json")).expect("written")).expect("JSON");
    assert_eq!(json["importance_range"], serde_json::json!([0.5, 2.0]));
    assert!(json["visibility_p999"].as_f64().expect("a number") <= 4.0);

    // A map of ones changes no bit of the picture.
    let one = rendered(at, "one-everywhere.exr", &["--importance", "one.exr"]);
    assert_eq!(one.channels, plain.channels);

    // Nor does one whose file says a unit, of which there is nothing to tell.
    let mut map = Picture::new(8, 8);
    map.push_f32("Y", vec![1.0; 64]);
    map.push_attribute(NITS_PER_UNIT, Attribute::Float(100.0));
    write_exr(&at.join("unit.exr"), &map).expect("written");
    let output = command::run(&mut render(at, &["-o", "with-unit.exr", "--importance", "unit.exr"]));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("unit.exr"), "{said}");
    assert_eq!(read_exr(&at.join("with-unit.exr")).expect("readable").channels, plain.channels);
}

/// Another map, or none, begins the ladder anew over the samples there are; the same one goes on.
#[test]
fn a_film_remembers_its_map() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    write_map(at, "left.exr", |x| if x < 4 { 0.5 } else { 2.0 });
    let film = ["--checkpoint", "a.film", "--plans", "1"];
    rendered(at, "a.exr", &[&film[..], &["--importance", "left.exr"]].concat());
    let again = [&["-o", "b.exr", "--resume", "--importance", "left.exr"], &film[..]].concat();
    let again = command::run(&mut render(at, &again));
    let told = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(!told.contains("other settings"), "{told}");
    let merge = ["merge", "a.film", "-o", "merged.png"];
    let merged = fechner().args(merge).current_dir(at).output();
    let told = String::from_utf8_lossy(&merged.expect("runs").stderr).into_owned();
    assert!(told.contains("note: sampled under an importance map"), "{told}");
    let without = command::run(&mut render(at, &[&["-o", "c.exr", "--resume"], &film[..]].concat()));
    let told = String::from_utf8_lossy(&without.stderr).into_owned();
    assert!(told.contains("other settings"), "{told}");
}

#[test]
fn maps_that_cannot_multiply_thresholds_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    write_map(at, "zero.exr", |x| x as f32);
    let mut wide = Picture::new(4, 2);
    wide.push_f32("Y", vec![1.0; 8]);
    write_exr(&at.join("wide.exr"), &wide).expect("written");
    write_map(at, "faint.exr", |x| if x == 3 { 1e-30 } else { 1.0 });
    // Our own writer would put a number in its place.
    let values = (0..64).map(|i| if i % 8 == 3 { f32::NAN } else { 1.0 }).collect();
    let channel = AnyChannel::new("Y", FlatSamples::F32(values));
    let map = Image::from_channels((8, 8), AnyChannels::sort([channel].into_iter().collect()));
    map.write().to_file(at.join("nan.exr")).expect("written");
    let cases: [(&[&str], &[&str]); 6] = [
        // It was told of a "threshold map" and of a "tolerance".
        (&["--importance", "faint.exr"], &["faint.exr", "1e-30 at (3, 0)", "at least 1e-11"]),
        // It was told to be 0, after a note that it was replaced.
        (&["--importance", "nan.exr"], &["nan.exr", "not a number at (3, 0)"]),
        (&["--importance", "zero.exr"], &["zero.exr", "0 at (0, 0)", "above 0"]),
        (&["--importance", "wide.exr"], &["wide.exr", "4x2", "48x48"]),
        (&["--importance", "none.exr"], &["none.exr"]),
        (&["--importance", "wide.exr", "--sampling", "relative"], &["--sampling has none"]),
    ];
    for (arguments, fragments) in cases {
        let output = render(at, &[&["-o", "a.png"], arguments].concat()).output().expect("runs");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(fragments.iter().all(|fragment| message.contains(fragment)), "{fragments:?} not in: {message}");
    }
}
