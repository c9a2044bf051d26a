//! Files whose data reach beyond what is to be shown.

use crate::support::command::{cornell_box, fechner};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
    Vec2, WritableImage,
};

/// Motion is laid out like the picture of its file: `threshold` and `compare` take both from one.
#[test]
fn motion_fits_its_own_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let channel = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; 1600]));
    let values = [("R", 20.0), ("G", 20.0), ("B", 20.0), ("velocity.X", 3.0), ("velocity.Y", 0.0)];
    let channels = AnyChannels::sort(values.map(|(name, value)| channel(name, value)).into_iter().collect());
    let attributes = LayerAttributes { layer_position: Vec2(-4, -4), ..LayerAttributes::default() };
    let layer = Layer::new((40, 40), attributes, Encoding::FAST_LOSSLESS, channels);
    let shown = ImageAttributes::new(IntegerBounds::from_dimensions((32, 32)));
    let image = Image::empty(shown).with_layer(layer);
    for frame in ["a.00.exr", "a.01.exr"] {
        image.write().to_file(folder.path().join(frame)).expect("written");
    }
    let threshold = ["threshold", "a.00.exr", "--velocity", "a.00.exr", "-o", "out.exr"];
    let compare = ["compare", "a.##.exr", "a.##.exr", "--velocity", "a.##.exr", "--fps", "24"];
    for arguments in [&threshold[..], &compare[..]] {
        let mut command = fechner();
        command.args(arguments).args(["--nits-per-unit", "1"]).current_dir(folder.path());
        let output = command.output().expect("runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// A crop says where it lies, to compositors; every command here takes it for a picture of its own, also out of a film.
#[test]
fn a_crop_lies_where_it_belongs() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box().display().to_string();
    let run = |arguments: &[&str]| {
        let mut command = fechner();
        let output = command.args(arguments).current_dir(folder.path()).output().expect("runs");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let render =
        ["render", &scene, "--size", "48x40", "--crop", "20,11,24,16", "--spp", "16", "--checkpoint", "a.film"];
    run(&[&render[..], &["-o", "part.exr"]].concat());
    run(&[&render[..], &["--resume", "-o", "resumed.exr"]].concat());
    run(&["merge", "a.film", "-o", "merged.exr"]);
    for name in ["part.exr", "resumed.exr", "merged.exr"] {
        let meta = exr::meta::MetaData::read_from_file(folder.path().join(name), true).expect("an EXR file");
        let header = &meta.headers[0];
        let shown = header.shared_attributes.display_window;
        assert_eq!((shown.position, shown.size), (Vec2(0, 0), Vec2(48, 40)), "{name}");
        assert_eq!((header.own_attributes.layer_position, header.layer_size), (Vec2(20, 11), Vec2(24, 16)), "{name}");
        run(&["compare", "part.exr", name]);
    }
    assert!(run(&["info", "part.exr"]).contains("24×16 pixels from (20, 11)"));
    run(&["threshold", "part.exr", "-o", "threshold.exr"]);
    run(&["tonemap", "part.exr", "--operator", "constant", "-o", "part.png"]);
    let png = image::open(folder.path().join("part.png")).expect("a picture");
    assert_eq!((png.width(), png.height()), (24, 16));
}
