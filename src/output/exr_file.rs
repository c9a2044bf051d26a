//! OpenEXR files of one part, whose channel names carry the layer (`albedo.R`), as most tools read them.

use super::beside::write_beside;
use super::exr_header::sort_attributes;
use super::{
    Attribute, CROP, ChannelValues, FRAMES_PER_SECOND, NITS_PER_UNIT, OutputError, PIXEL_ASPECT_RATIO, PartOf, Picture,
    REPLACED_VALUES, check_size, frame_rate,
};
use ::exr::meta::attribute::{AttributeValue, Chromaticities};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, Text, Vec2, WritableImage, f16,
};
use fechner_perception::primaries::Primaries;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Largest finite half float.
const F16_MAX: f32 = 65504.0;

/// Writes a picture as an EXR file: ZIP-compressed scan lines, Rec.709 primaries, and `whiteLuminance` from the
/// attribute [`NITS_PER_UNIT`] if there is one. A part of a picture has its place as data window and the whole as
/// display window.
///
/// Values that a file should not hold are replaced rather than refused, since a picture may be hours of work: NaN by 0,
/// infinities and halves out of range by the largest finite value. The attribute [`REPLACED_VALUES`] then counts them.
///
/// # Errors
/// If the file cannot be written.
pub fn write_exr(path: &Path, picture: &Picture<'_>) -> Result<(), OutputError> {
    check(path, picture)?;
    let mut replaced = 0;
    let channels = picture
        .channels
        .iter()
        .map(|channel| {
            let name = Text::new_or_none(&channel.name).expect("checked above");
            AnyChannel::new(name, flat_samples(&channel.values, &mut replaced))
        })
        .collect();

    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let image = Image::empty(image_attributes(picture)).with_layer(Layer::new(
        Vec2(picture.width as usize, picture.height as usize),
        layer_attributes(picture, replaced),
        encoding,
        AnyChannels::sort(channels),
    ));
    write_beside(path, |file| {
        // Our own buffer, flushed by us: the library's is flushed when dropped, where a full disk goes unnoticed.
        let mut buffered = BufWriter::new(&mut *file);
        image.write().to_buffered(&mut buffered).map_err(io_error)?;
        buffered.flush()?;
        drop(buffered);
        sort_attributes(file)
    })
}

/// What a picture says of itself, but for its shape; `replaced`: of its values.
fn layer_attributes(picture: &Picture<'_>, replaced: usize) -> LayerAttributes {
    let mut attributes = LayerAttributes { software_name: Some("fechner".into()), ..LayerAttributes::default() };
    for (name, value) in &picture.attributes {
        match (name.as_str(), value) {
            (PIXEL_ASPECT_RATIO, Attribute::Float(_)) => continue,
            (FRAMES_PER_SECOND, &Attribute::Float(rate)) => {
                attributes.frames_per_second = frame_rate::rational(rate);
                continue;
            }
            (NITS_PER_UNIT, &Attribute::Float(nits)) => attributes.white_luminance = Some(nits),
            _ => {}
        }
        attributes.other.insert(text(name), attribute_value(value));
    }
    if replaced > 0 {
        let count = i32::try_from(replaced).unwrap_or(i32::MAX);
        attributes.other.insert(text(REPLACED_VALUES), AttributeValue::I32(count));
    }
    if let Some(PartOf { origin: [x, y], .. }) = picture.part_of {
        let place = format!("{x},{y},{},{}", picture.width, picture.height);
        attributes.other.insert(text(CROP), AttributeValue::Text(text(&place)));
        attributes.layer_position = Vec2(x as i32, y as i32);
    }
    attributes
}

/// The whole that is shown, of which the picture may be a part, the shape of its pixels and its primaries.
fn image_attributes(picture: &Picture<'_>) -> ImageAttributes {
    let [width, height] = picture.part_of.map_or([picture.width, picture.height], |part| part.whole);
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(width as usize, height as usize)));
    for (name, value) in &picture.attributes {
        if let (PIXEL_ASPECT_RATIO, &Attribute::Float(ratio)) = (name.as_str(), value) {
            attributes.pixel_aspect = ratio;
        }
    }
    let Primaries { red, green, blue, white } = Primaries::REC709;
    let [red, green, blue, white] = [red, green, blue, white].map(|[x, y]| Vec2(x as f32, y as f32));
    attributes.chromaticities = Some(Chromaticities { red, green, blue, white });
    attributes
}

fn io_error(error: ::exr::error::Error) -> std::io::Error {
    match error {
        ::exr::error::Error::Io(error) => error,
        other => std::io::Error::other(other.to_string()),
    }
}

/// Finds what the format cannot hold, before anything is written.
fn check(path: &Path, picture: &Picture<'_>) -> Result<(), OutputError> {
    let bad = |problem: String| OutputError::BadPicture { path: path.to_owned(), problem };
    let lengths: Vec<(&str, usize)> = picture.channels.iter().map(|c| (c.name.as_str(), c.values.len())).collect();
    check_size(path, picture.width, picture.height, &lengths)?;
    if picture.channels.is_empty() {
        return Err(bad("the picture has no channels".to_owned()));
    }
    let mut names: Vec<&str> = picture.channels.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(bad(format!("two channels are called \"{}\"", pair[0])));
    }
    for name in names {
        if name.is_empty() || !name.bytes().all(|b| b.is_ascii_graphic()) || name.len() > 255 {
            return Err(bad(format!("\"{name}\" cannot be a channel's name: 1 to 255 letters, digits and signs")));
        }
    }
    Ok(())
}

fn flat_samples(values: &ChannelValues<'_>, replaced: &mut usize) -> FlatSamples {
    let mut finite = |value: f32, limit: f32| {
        if value.is_nan() {
            *replaced += 1;
            0.0
        } else if value.abs() > limit {
            *replaced += 1;
            limit.copysign(value)
        } else {
            value
        }
    };
    match values {
        ChannelValues::F32(values) => FlatSamples::F32(values.iter().map(|&v| finite(v, f32::MAX)).collect()),
        ChannelValues::F16(values) => {
            FlatSamples::F16(values.iter().map(|&v| f16::from_f32(finite(v, F16_MAX))).collect())
        }
        ChannelValues::U32(values) => FlatSamples::U32(values.to_vec()),
    }
}

/// Text in ASCII: the format does not say what the bytes above it mean, and Python's OpenEXR refuses files that have
/// any.
fn text(text: &str) -> Text {
    let plain = |c: char| match c {
        '²' => '2',
        '³' => '3',
        '×' => 'x',
        '–' | '—' | '−' => '-',
        c if c.is_ascii() => c,
        _ => '?',
    };
    Text::new_or_none(text.chars().map(plain).collect::<String>()).expect("every character fits a byte")
}

fn attribute_value(value: &Attribute) -> AttributeValue {
    match value {
        Attribute::Text(value) => AttributeValue::Text(text(value)),
        Attribute::Float(value) => AttributeValue::F32(*value),
        Attribute::Integer(value) => AttributeValue::I32(*value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr_read::{SampleType, read_exr};

    fn sample_picture(red: &[f32]) -> Picture<'_> {
        let mut picture = Picture::new(3, 2);
        picture.push_f32("R", red);
        picture.push_f16("G", vec![0.0, 0.25, 0.5, 1.0, 2.0, 65504.0]);
        picture.push_f32("B", vec![0.1; 6]);
        picture.push_f32("normal.X", vec![-1.0, 0.0, 1.0, -0.5, 0.5, 0.25]);
        picture.push_u32("samples.Y", vec![0, 1, 2, 3, 1024, 16_777_216]);
        picture.push_attribute("observer", Attribute::Text("60 ppd, 200 cd/m²".to_owned()));
        picture.push_attribute("seed", Attribute::Integer(-7));
        picture.push_attribute(NITS_PER_UNIT, Attribute::Float(123.5));
        picture
    }

    const RED: [f32; 6] = [0.0, 1e-30, 0.1, 1.0, 1e6, -3.0];

    #[test]
    fn channels_and_attributes_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, &sample_picture(&RED)).unwrap();
        let image = read_exr(&path).unwrap();
        assert_eq!((image.width, image.height), (3, 2));
        let names: Vec<&str> = image.channels.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["B", "G", "R", "normal.X", "samples.Y"]);
        assert_eq!(image.channel("R").unwrap(), RED);
        assert_eq!(image.channel("G").unwrap(), [0.0, 0.25, 0.5, 1.0, 2.0, 65504.0]);
        assert_eq!(image.channel("samples.Y").unwrap()[5], 16_777_216.0);
        assert_eq!(image.types[1], SampleType::Half);
        assert_eq!(image.types[4], SampleType::Uint);
        for (name, value) in sample_picture(&RED).attributes {
            let plain = match value {
                Attribute::Text(text) => Attribute::Text(text.replace("m²", "m2")),
                other => other,
            };
            assert_eq!(image.attribute(&name), Some(&plain), "{name}");
        }
        assert_eq!(image.attribute("whiteLuminance"), Some(&Attribute::Float(123.5)));
        assert_eq!(image.attribute(REPLACED_VALUES), None);
        assert!(image.attribute("chromaticities").is_some());
    }

    #[test]
    fn the_same_picture_gives_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let picture = sample_picture(&RED);
        let files: Vec<Vec<u8>> = (0..8)
            .map(|i| {
                let path = folder.path().join(format!("{i}.exr"));
                write_exr(&path, &picture).unwrap();
                std::fs::read(path).unwrap()
            })
            .collect();
        assert!(files.iter().all(|file| *file == files[0]));
    }

    #[test]
    fn values_that_are_not_finite_are_replaced_and_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut picture = Picture::new(2, 2);
        picture.push_f32("R", vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0]);
        picture.push_f16("G", vec![1e6, -1e6, f32::NAN, 65519.0]);
        write_exr(&path, &picture).unwrap();
        let image = read_exr(&path).unwrap();
        assert_eq!(image.channel("R").unwrap(), [0.0, f32::MAX, f32::MIN, 1.0]);
        assert_eq!(image.channel("G").unwrap(), [65504.0, -65504.0, 0.0, 65504.0]);
        assert_eq!(image.attribute(REPLACED_VALUES), Some(&Attribute::Integer(7)));
    }

    #[test]
    fn one_pixel_and_odd_sizes_come_back() {
        let folder = tempfile::tempdir().unwrap();
        for (width, height) in [(1, 1), (1, 40), (37, 1), (33, 17)] {
            let path = folder.path().join("a.exr");
            let values: Vec<f32> = (0..width * height).map(|i| i as f32 * 0.37).collect();
            let mut picture = Picture::new(width, height);
            picture.push_f32("Y", &values[..]);
            write_exr(&path, &picture).unwrap();
            assert_eq!(read_exr(&path).unwrap().channel("Y").unwrap(), values);
        }
    }

    #[test]
    fn a_picture_that_makes_no_sense_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let message = |change: &dyn Fn(&mut Picture<'_>)| {
            let mut picture = Picture::new(1, 1);
            picture.push_f32("R", vec![1.0]);
            change(&mut picture);
            write_exr(&path, &picture).unwrap_err().to_string()
        };
        assert!(message(&|p| p.push_f32("R", vec![1.0])).contains("two channels are called \"R\""));
        assert!(message(&|p| p.push_f32("G", vec![1.0, 2.0])).contains("G has 2 values for 1×1"));
        assert!(message(&|p| p.channels.clear()).contains("no channels"));
        assert!(message(&|p| p.push_f32("ü", vec![1.0])).contains("cannot be a channel's name"));
        assert!(message(&|p| p.width = 0).contains("no pixels"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    /// Compositors put a part where it belongs; here it is read as what it is, a picture of its own.
    #[test]
    fn a_part_has_its_place_in_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let part_of = Some(PartOf { origin: [20, 11], whole: [64, 48] });
        write_exr(&path, &Picture { part_of, ..sample_picture(&RED) }).unwrap();
        let header = &::exr::meta::MetaData::read_from_file(&path, true).unwrap().headers[0];
        let shown = header.shared_attributes.display_window;
        assert_eq!((shown.position, shown.size), (Vec2(0, 0), Vec2(64, 48)));
        assert_eq!((header.own_attributes.layer_position, header.layer_size), (Vec2(20, 11), Vec2(3, 2)));
        let image = read_exr(&path).unwrap();
        assert_eq!((image.data_window_origin, image.part_of), ((20, 11), part_of));
        assert_eq!(image.channel("R").unwrap(), RED);
        let picture = image.scene_picture(|image, name| image.channel(name)).unwrap();
        assert_eq!((picture.width, picture.height, picture.notes), (3, 2, Vec::new()));
        assert_eq!(picture.rgb[4][0], RED[4]);
        assert_eq!(image.in_display_window(RED.to_vec()), RED);
    }
}
