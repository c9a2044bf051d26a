use super::*;
use crate::output::{Picture, write_exr};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::AttributeValue;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, WritableImage, f16,
};

/// Peak memory of this process in KiB, where the system tells.
fn peak_memory_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// A file or folder among those of others: in the folder FECHNER_ASSETS, where it must be, else beside the project.
pub(super) fn asset(name: &str) -> Option<PathBuf> {
    let named = std::env::var_os("FECHNER_ASSETS").map(PathBuf::from);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    let path = named.clone().unwrap_or_else(beside).join(name);
    if path.exists() {
        return Some(path);
    }
    assert!(named.is_none(), "{} is not there", path.display());
    println!("skipped: {} is not there", path.display());
    None
}

#[test]
fn damaged_files_end_in_an_error_or_a_picture_and_in_little_memory() {
    let Some(folder) = asset("faults/exr-damaged") else { return };
    let mut readable = 0;
    let mut refused = 0;
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        match read_exr(&path) {
            Ok(image) => {
                readable += 1;
                assert!(image.channels.iter().all(|(_, v)| v.len() == (image.width * image.height) as usize));
            }
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                assert!(message.starts_with("cannot read ") && !message.contains('\n'), "{message}");
                println!("{message}");
            }
        }
    }
    println!("{readable} readable, {refused} refused, peak {:?} KiB", peak_memory_kib());
    assert!(refused > 50, "{refused} refused");
    if let Some(kib) = peak_memory_kib() {
        assert!(kib < 1 << 20, "peak memory {kib} KiB");
    }
}

/// A small sound file, to be damaged.
fn sound_file(folder: &Path) -> Vec<u8> {
    let path = folder.join("sound.exr");
    let mut picture = Picture::new(16, 16);
    let values: Vec<f32> = (0..256).map(|i| (i * i % 17) as f32).collect();
    picture.push_f32("R", &values[..]);
    picture.push_f16("G", &values[..]);
    write_exr(&path, &picture).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn every_cut_of_a_file_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = sound_file(folder.path());
    let path = folder.path().join("cut.exr");
    for length in 0..bytes.len() {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(read_exr(&path).is_err(), "cut to {length} of {} bytes", bytes.len());
    }
}

#[test]
fn any_changed_byte_is_survived() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = sound_file(folder.path());
    let path = folder.path().join("changed.exr");
    for at in 0..bytes.len() {
        for value in [0x00, 0x7f, 0xff] {
            let mut changed = bytes.clone();
            changed[at] = value;
            std::fs::write(&path, changed).unwrap();
            if let Ok(image) = read_exr(&path) {
                assert!(u64::from(image.width) * u64::from(image.height) * 8 <= MEMORY_LIMIT_BYTES);
            }
        }
    }
}

#[test]
fn a_picture_too_large_for_memory_is_refused_by_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = sound_file(folder.path());
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&99_999i32.to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&99_999i32.to_le_bytes());
    let path = folder.path().join("large.exr");
    std::fs::write(&path, bytes).unwrap();
    let message = read_exr(&path).unwrap_err().to_string();
    assert!(message.contains("100000×100000 pixels of 1 channel need 38146 MiB"), "{message}");
}

#[test]
fn what_is_no_exr_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let message = |path: &Path| read_exr(path).unwrap_err().to_string();
    assert!(message(folder.path()).contains("is a directory, not a file"));
    assert!(message(&folder.path().join("none.exr")).contains("none.exr"));
    let path = folder.path().join("text.exr");
    std::fs::write(&path, "").unwrap();
    assert!(message(&path).contains("it is empty"));
    std::fs::write(&path, "not a picture").unwrap();
    assert!(message(&path).contains("damaged or no EXR file"));
}

/// Writes a file of parts that hold one channel each, at their places and of one size.
fn write_parts(path: &Path, display: [i32; 4], size: usize, parts: &[(&str, [i32; 2], f32)]) {
    let layers: Vec<Layer<AnyChannels<FlatSamples>>> = parts
        .iter()
        .map(|&(name, [x, y], value)| {
            let attributes = LayerAttributes { layer_position: Vec2(x, y), ..LayerAttributes::named(name) };
            let values = (0..size * size).map(|pixel| value + pixel as f32).collect();
            let channels = AnyChannels::sort([AnyChannel::new("Y", FlatSamples::F32(values))].into_iter().collect());
            Layer::new((size, size), attributes, Encoding::FAST_LOSSLESS, channels)
        })
        .collect();
    let [x, y, width, height] = display;
    let attributes = ImageAttributes::new(IntegerBounds::new((x, y), (width as usize, height as usize)));
    Image::from_layers(attributes, layers).write().to_file(path).unwrap();
}

/// Each pixel of a part stays where it is, and a part that is elsewhere altogether is left out.
#[test]
fn parts_stand_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    write_parts(&path, [0, 0, 2, 2], 2, &[("a", [0, 0], 1.0), ("b", [1, 0], 5.0), ("c", [9, 9], 0.0)]);
    let image = read_exr(&path).unwrap();
    assert_eq!(image.channel("a.Y").unwrap(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(image.channel("b.Y").unwrap(), [0.0, 5.0, 0.0, 7.0]);
    assert_eq!(image.parts_left_out, ["c"]);
}

/// A part that was cropped or overscanned is put to the picture's pixels, and what the picture's part lacks is taken
/// from others.
#[test]
fn parts_of_other_sizes_stand_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    let part = |name: &str, [x, y]: [i32; 2], size: usize, names: &[&str], nits: Option<f32>| {
        let attributes =
            LayerAttributes { layer_position: Vec2(x, y), white_luminance: nits, ..LayerAttributes::named(name) };
        let first = if size == 1 { 7 } else { 0 };
        let values =
            |value: usize| FlatSamples::F32((0..size * size).map(|pixel| (first + value + pixel) as f32).collect());
        let channels = names.iter().enumerate().map(|(number, name)| AnyChannel::new(*name, values(100 * number)));
        Layer::new((size, size), attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels.collect()))
    };
    let layers: Vec<Layer<AnyChannels<FlatSamples>>> = vec![
        part("depth", [1, 1], 1, &["Z"], None),
        part("beauty", [-1, -1], 4, &["B", "G", "R"], Some(80.0)),
        part("albedo", [0, 0], 2, &["B", "G", "R"], None),
    ];
    let attributes = ImageAttributes::new(IntegerBounds::new((0, 0), (2, 2)));
    Image::from_layers(attributes, layers).write().to_file(&path).unwrap();
    let image = read_exr(&path).unwrap();
    assert_eq!((image.width, image.height, image.data_window_origin), (4, 4, (-1, -1)));
    assert_eq!(super::size(&path, &std::fs::read(&path).unwrap()).unwrap(), [4, 4]);
    let shown = |name: &str| image.in_display_window(image.channel(name).unwrap().to_vec());
    assert_eq!(shown("depth.Z"), [0.0, 0.0, 0.0, 7.0]);
    assert_eq!(shown("beauty.B"), [5.0, 6.0, 9.0, 10.0]);
    assert_eq!(shown("albedo.G"), [100.0, 101.0, 102.0, 103.0]);
    assert_eq!(image.attribute("whiteLuminance"), Some(&Attribute::Float(80.0)));
    assert!(image.parts_left_out.is_empty());
}

/// A block of DWAA says how much it unpacks to, and is not believed.
#[test]
fn a_block_that_claims_the_memory_of_the_world_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dwaa.exr");
    let values = FlatSamples::F16((0..64 * 64).map(|pixel| f16::from_f32(pixel as f32 * 0.01)).collect());
    let channels = AnyChannels::sort([AnyChannel::new("Y", values)].into_iter().collect());
    let encoding =
        Encoding { compression: Compression::DWAA(None), blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = Layer::new((64, 64), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_file(&path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    read_exr(&path).unwrap();
    // Its first block follows the table of the two blocks' places: line, length, then eleven counts.
    let MetaData { headers, .. } = MetaData::read_from_buffered(Cursor::new(&whole), false).unwrap();
    assert_eq!(headers[0].chunk_count, 2);
    let place = (0..whole.len() - 16).find(|&at| {
        let word = |at: usize| u64::from_le_bytes(whole[at..at + 8].try_into().unwrap());
        word(at) as usize == at + 16 && word(at + 8) as usize > at + 16
    });
    let counts = place.unwrap() + 16 + 8;
    for count in super::dwa::UNPACKED {
        let mut bytes = whole.clone();
        bytes[counts + 8 * count..counts + 8 * count + 8].copy_from_slice(&(1_u64 << 49).to_le_bytes());
        let error = decode_exr(&path, &bytes).unwrap_err().to_string();
        assert!(error.contains("claims more than its pixels"), "{error}");
    }
}

/// What is laid out like the data, as motion is, can be laid out like the picture.
#[test]
fn channels_come_into_the_display_window() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shifted.exr");
    write_parts(&path, [0, 0, 3, 1], 2, &[("a", [1, -1], 1.0)]);
    let image = read_exr(&path).unwrap();
    assert_eq!(image.in_display_window(image.channel("Y").unwrap().to_vec()), [0.0, 3.0, 4.0]);
}

/// A display window that the memory has no room for is left out, with a word about it.
#[test]
fn a_display_window_too_large_for_memory_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.exr");
    write_parts(&path, [0, 0, 9600, 9600], 1200, &[("a", [0, 0], 0.0)]);
    let image = read_exr(&path).unwrap();
    assert_eq!((image.display_window.width, image.display_window.height), (1200, 1200));
    let picture = image.scene_picture(ExrImage::channel).unwrap();
    assert_eq!((picture.width, picture.notes.len()), (1200, 1), "{:?}", picture.notes);
}

/// What is not asked for is passed over, counted as no memory, and named.
#[test]
fn only_channels_that_are_asked_for_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    write_parts(&path, [0, 0, 1, 1], 2, &[("beauty", [0, 0], 1.0), ("depth", [0, 0], 5.0)]);
    let depth_alone: fn(&[String]) -> Vec<String> = |all| {
        assert_eq!(all, ["beauty.Y", "depth.Y"]);
        vec!["depth.Y".to_owned()]
    };
    let image = read_exr_channels(&path, depth_alone).unwrap();
    let whole = read_exr(&path).unwrap();
    assert_eq!((image.channels.len(), image.types.len(), &image.unread[..]), (1, 1, &["beauty.Y".to_owned()][..]));
    assert_eq!((image.channel("depth.Y"), image.channel("beauty.Y")), (whole.channel("depth.Y"), None));
    assert!(whole.unread.is_empty());

    // Two such channels would be more than is allowed.
    let mut headers = read_headers(&path, &std::fs::read(&path).unwrap()).unwrap();
    headers.iter_mut().for_each(|header| header.layer_size = Vec2(8192, 24_000));
    let refused = |choose: fn(&[String]) -> Vec<String>| {
        let wanted = Wanted::of(&headers, choose);
        check_memory(&path, &headers, &wanted).map_err(|error| error.to_string()).err()
    };
    assert_eq!(refused(depth_alone), None);
    let message = refused(|all| all.to_vec()).unwrap();
    assert!(message.contains("8192×24000 pixels of 2 channels need 1500 MiB"), "{message}");
}

/// The named linear spaces of the Color Interop Forum, and the flag of an ACES container, say what chromaticities
/// would. Regression: AP1's red was taken for Rec.709's.
#[test]
fn colour_spaces_are_known_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let read = |name: &str, value: AttributeValue| {
        let channel = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; 4]));
        let channels = [channel("R", 0.5), channel("G", 0.25), channel("B", 0.125)];
        let mut attributes = LayerAttributes::default();
        attributes.other.insert(Text::new_or_none(name).unwrap(), value);
        let channels = AnyChannels::sort(channels.into_iter().collect());
        Image::from_layer(Layer::new((2, 2), attributes, Encoding::FAST_LOSSLESS, channels))
            .write()
            .to_file(&path)
            .unwrap();
        let shown = read_exr(&path).unwrap().scene_picture(|image, name| image.channel(name)).unwrap();
        (shown.rgb[0], shown.notes)
    };
    let named = |id: &str| read("colorInteropID", AttributeValue::Text(Text::new_or_none(id).unwrap()));
    let meant = |primaries: Primaries| {
        let matrix = primaries.to(&Primaries::REC709).unwrap();
        fechner_perception::primaries::apply(&matrix, [0.5, 0.25, 0.125]).map(|channel| channel as f32)
    };
    for (id, primaries) in [
        ("lin_ap0_scene", Primaries::ACES_AP0),
        ("lin_ap1_scene", Primaries::ACES_AP1),
        ("lin_rec709_scene", Primaries::REC709),
        ("lin_p3d65_scene", Primaries::DISPLAY_P3),
        ("lin_rec2020_scene", Primaries::REC2020),
        ("lin_adobergb_scene", Primaries::ADOBE_RGB),
        ("lin_ciexyzd65_scene", Primaries::XYZ),
    ] {
        let (found, notes) = named(id);
        assert!(found.iter().zip(meant(primaries)).all(|(a, b)| (a - b).abs() < 1e-6), "{id}: {found:?}");
        assert_eq!(notes.len(), usize::from(primaries != Primaries::REC709), "{id}: {notes:?}");
    }
    let (container, _) = read("acesImageContainerFlag", AttributeValue::I32(1));
    assert_eq!(container, named("lin_ap0_scene").0);
    let (taken, notes) = named("srgb_rec709_scene");
    assert!(taken == [0.5, 0.25, 0.125] && notes[0].contains("\"srgb_rec709_scene\" is not heeded"), "{notes:?}");
    assert!(named("data").1.is_empty());
}
