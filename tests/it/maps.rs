//! Maps beside a picture: `render --map LAYER=FILE`.

use crate::support::command::{self, cornell_box, fechner, said};
use std::path::Path;
use std::process::Command;

fn render(arguments: &[&str], folder: &Path) -> Command {
    let mut command = fechner();
    command.arg("render").arg(cornell_box()).args(["--size", "24x16"]).args(arguments).current_dir(folder);
    command
}

/// Where counts are even the map has one colour; at a target far above what is left all is blue, far below it nothing
/// is.
#[test]
fn maps_show_counts_and_what_can_be_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = |name: &str, more: &[&str]| {
        let asked = format!("{name}=map.png");
        let run = command::run(&mut render(&[&["-o", "a.png", "--map", &asked][..], more].concat(), folder.path()));
        let said = said(&run);
        assert!(said.contains("map.png: "), "{said}");
        image::open(folder.path().join("map.png")).expect("a picture").into_rgb8()
    };
    let even = map("samples", &["--sampling", "uniform", "--spp", "16"]);
    assert_eq!((even.width(), even.height()), (24, 16));
    assert!(even.pixels().all(|pixel| pixel == even.get_pixel(0, 0)));
    let is_blue = |picture: &image::RgbImage| picture.pixels().all(|pixel| pixel.0[0] == 0);
    assert!(is_blue(&map("visibility", &["--visibility", "1000"])));
    assert!(!is_blue(&map("visibility", &["--visibility", "0.01", "--spp", "16"])));
    let thresholds = map("threshold", &["--spp", "16"]);
    assert!(thresholds.pixels().any(|pixel| pixel != thresholds.get_pixel(0, 0)), "one threshold everywhere");
}

/// Of one sample a pixel nothing is known, which was shown as the most visible noise.
#[test]
fn what_is_not_known_is_grey() {
    let folder = tempfile::tempdir().expect("a folder");
    let asked = ["-o", "a.png", "--sampling", "uniform", "--spp", "1", "--map", "visibility=map.png"];
    let said = said(&command::run(&mut render(&asked, folder.path())));
    assert!(said.contains("map.png: grey: not known"), "{said}");
    let map = image::open(folder.path().join("map.png")).expect("a picture").into_rgb8();
    assert!(map.pixels().all(|image::Rgb([r, g, b])| r == g && g == b), "{:?}", map.get_pixel(0, 0));
}

#[test]
fn maps_that_cannot_be_are_refused_before_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    for (asked, words) in [
        ("heat=a.png", "a layer among samples, threshold, visibility"),
        ("samples", "expected LAYER=FILE.png"),
        ("samples=b.exr", "end the name in .png"),
        ("samples=a.png", "-o and --map name the same file"),
    ] {
        let run = render(&["-o", "a.png", "--map", asked], folder.path()).output().expect("runs");
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.code() == Some(2) && said.contains(words), "{asked}: {said}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 0, "{asked}");
    }
}
