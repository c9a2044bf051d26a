//! Files whose data reach beyond what is to be shown.

use assert_cmd::Command;
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
        let mut command = Command::cargo_bin("fechner").expect("the binary is built");
        command.args(arguments).args(["--nits-per-unit", "1"]).current_dir(folder.path());
        let output = command.output().expect("runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
