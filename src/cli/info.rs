//! `fechner info FILE`: what a picture or a film holds. It changes nothing.

mod film;

use anyhow::{Context, anyhow, bail};
use fechner::checkpoint::{is_checkpoint, read_checkpoint};
use fechner::digits::significant;
use fechner::exr_read::{ExrImage, MEMORY_LIMIT_BYTES, SampleType, read_exr_channels};
use fechner::hdr_read::{is_xyze, with_known_header};
use fechner::jpeg_read;
use fechner::read_file;
use image::ImageDecoder;
use std::fmt::Write as _;
use std::io::{Cursor, Read as _};
use std::path::Path;

/// Prints what is in a picture file: size, channels with their range, attributes, colour tags.
pub(crate) fn run(path: &Path) -> anyhow::Result<()> {
    answer!("{}", describe(path)?.trim_end());
    Ok(())
}

/// The text that [`run`] prints.
fn describe(path: &Path) -> anyhow::Result<String> {
    if is_film(path)? {
        return Ok(film::describe(&read_checkpoint(path)?));
    }
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("exr") => describe_exr(path),
        Some("png") => describe_png(path),
        Some("hdr") => describe_hdr(path),
        Some("jpg" | "jpeg") => describe_jpeg(path),
        _ => bail!("cannot tell what {} is: .exr, .png, .hdr and .jpg files and films are known", path.display()),
    }
}

/// A film's file may have any name.
fn is_film(path: &Path) -> anyhow::Result<bool> {
    let cannot_read = || format!("cannot read {}", path.display());
    let mut start = Vec::new();
    read_file::open(path).and_then(|file| file.take(16).read_to_end(&mut start)).with_context(cannot_read)?;
    Ok(is_checkpoint(&start))
}

/// The range of the finite values among `values`.
struct Range {
    min: f32,
    mean: f64,
    max: f32,
    nonfinite: usize,
}

impl Range {
    fn of(values: impl Iterator<Item = f32>) -> Self {
        let mut range = Self { min: f32::INFINITY, mean: 0.0, max: f32::NEG_INFINITY, nonfinite: 0 };
        let mut count = 0_u64;
        for value in values {
            if value.is_finite() {
                range.min = range.min.min(value);
                range.max = range.max.max(value);
                range.mean += f64::from(value);
                count += 1;
            } else {
                range.nonfinite += 1;
            }
        }
        range.mean /= count as f64;
        range
    }

    fn row(&self, text: &mut String, name: &str, kind: &str, width: usize) {
        let Self { min, mean, max, nonfinite } = self;
        if mean.is_nan() {
            let none = if *nonfinite > 0 { format!("{nonfinite} values, none finite") } else { "no values".to_owned() };
            let _ = writeln!(text, "  {name:width$}  {kind:5}  {none:>12}");
            return;
        }
        let _ = write!(
            text,
            "  {name:width$}  {kind:5}  {:>12}  {:>12}  {:>12}",
            significant((*min).into(), 6),
            significant(*mean, 6),
            significant((*max).into(), 6)
        );
        if *nonfinite > 0 {
            let _ = write!(text, "  and {nonfinite} not finite");
        }
        text.push('\n');
    }
}

fn heading(text: &mut String, first: &str, width: usize) {
    let _ = writeln!(text, "  {first:width$}  type   {:>12}  {:>12}  {:>12}", "min", "mean", "max");
}

/// What a channel holds.
struct ChannelRow {
    name: String,
    kind: SampleType,
    range: Range,
}

fn channel_rows(image: &ExrImage) -> Vec<ChannelRow> {
    let channels = image.channels.iter().zip(&image.types);
    channels
        .map(|((name, values), &kind)| ChannelRow {
            name: name.clone(),
            kind,
            range: Range::of(values.iter().copied()),
        })
        .collect()
}

/// As many channels at once as memory is meant for: production files have more.
fn describe_exr(path: &Path) -> anyhow::Result<String> {
    let image = read_exr_channels(path, |_| Vec::new())?;
    let mut rows = channel_rows(&image);
    let bytes_a_channel = 4 * u64::from(image.width) * u64::from(image.height);
    let at_once = (MEMORY_LIMIT_BYTES / bytes_a_channel.max(1)).max(1) as usize;
    for names in image.unread.chunks(at_once) {
        rows.extend(channel_rows(&read_exr_channels(path, |_| names.to_vec())?));
    }
    Ok(exr_in_words(&image, &rows))
}

fn exr_in_words(image: &ExrImage, rows: &[ChannelRow]) -> String {
    let mut text = format!("OpenEXR, {}×{} pixels", image.width, image.height);
    if image.data_window_origin != (0, 0) {
        let _ = write!(text, " from ({}, {})", image.data_window_origin.0, image.data_window_origin.1);
    }
    text.push_str("\n\n");
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0).max(7);
    heading(&mut text, "channel", width);
    for ChannelRow { name, kind, range } in rows {
        range.row(&mut text, name, &kind.to_string(), width);
    }
    for part in &image.parts_left_out {
        let _ = writeln!(text, "  part \"{part}\" lies elsewhere and is not shown");
    }
    if !image.attributes.is_empty() {
        text.push('\n');
        let width = image.attributes.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (name, value) in &image.attributes {
            let _ = writeln!(text, "  {name:width$}  {value}");
        }
    }
    text
}

/// Refuses what a small file can ask for.
fn check_bytes(path: &Path, (width, height): (u32, u32), bytes: u64) -> anyhow::Result<()> {
    if bytes > MEMORY_LIMIT_BYTES {
        let limit = MEMORY_LIMIT_BYTES >> 30;
        bail!("cannot read {}: {width}×{height} pixels need more than {limit} GiB", path.display());
    }
    Ok(())
}

fn describe_png(path: &Path) -> anyhow::Result<String> {
    let problem = || format!("cannot read {}: damaged or no PNG file", path.display());
    let file = std::fs::File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_limits(png::Limits { bytes: 1 << 28 });
    let mut reader = decoder.read_info().with_context(problem)?;
    let info = reader.info();
    let bits = info.bit_depth as u8;
    let mut text =
        format!("PNG, {}×{} pixels, {:?}, {bits} bits a channel\n", info.width, info.height, info.color_type);
    let _ = writeln!(text, "colour tags: {}", colour_tags(info));

    let (columns, rows) = (info.width, info.height);
    let size = reader.output_buffer_size().with_context(problem)?;
    check_bytes(path, (columns, rows), size as u64)?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).with_context(problem)?;
    pixels.truncate(frame.buffer_size());
    if bits == 8 || bits == 16 {
        text.push('\n');
        write_png_channels(&mut text, &pixels, frame.color_type, bits);
    }
    Ok(text)
}

/// What a PNG's chunks say of its colours.
fn colour_tags(info: &png::Info<'_>) -> String {
    let mut tags = Vec::new();
    if let Some(intent) = info.srgb {
        tags.push(format!("sRGB ({intent:?})"));
    }
    if let Some(cicp) = info.coding_independent_code_points {
        tags.push(format!("CICP primaries {}, transfer {}", cicp.color_primaries, cicp.transfer_function));
    }
    if let Some(profile) = &info.icc_profile {
        tags.push(format!("ICC profile of {} bytes", profile.len()));
    }
    if let Some(gamma) = info.gama_chunk {
        tags.push(format!("gamma {}", gamma.into_value()));
    }
    if tags.is_empty() { "none".to_owned() } else { tags.join(", ") }
}

/// The table of a PNG's channels, whose values have 8 or 16 bits.
fn write_png_channels(text: &mut String, pixels: &[u8], colour: png::ColorType, bits: u8) {
    let names: &[&str] = match colour {
        png::ColorType::Grayscale => &["grey"],
        png::ColorType::GrayscaleAlpha => &["grey", "alpha"],
        png::ColorType::Rgb => &["red", "green", "blue"],
        png::ColorType::Rgba => &["red", "green", "blue", "alpha"],
        png::ColorType::Indexed => &["index"],
    };
    heading(text, "channel", 7);
    for (c, name) in names.iter().enumerate() {
        let bytes = usize::from(bits / 8);
        // 16 bits have their high byte first; of 8 there is one.
        let value = |value: &[u8]| f32::from(value.iter().fold(0, |high: u16, &low| (high << 8) | u16::from(low)));
        let values = pixels.chunks_exact(bytes).skip(c).step_by(names.len()).map(value);
        Range::of(values).row(text, name, if bits == 8 { "8-bit" } else { "16-bit" }, 7);
    }
}

fn describe_jpeg(path: &Path) -> anyhow::Result<String> {
    let problem = || format!("cannot read {}: damaged or no JPEG file", path.display());
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let decoder = image::codecs::jpeg::JpegDecoder::new(Cursor::new(&bytes[..])).with_context(problem)?;
    let (width, height) = decoder.dimensions();
    let mut text = format!("JPEG, {width}×{height} pixels, {:?}\n", decoder.color_type());
    if !jpeg_read::has_end(&bytes) {
        let _ = writeln!(text, "{}", jpeg_read::CUT_OFF);
    }
    for note in jpeg_read::notes(&bytes) {
        let _ = writeln!(text, "{note}");
    }
    Ok(text)
}

fn describe_hdr(path: &Path) -> anyhow::Result<String> {
    let problem = || format!("cannot read {}: damaged or no Radiance file", path.display());
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut decoder =
        image::codecs::hdr::HdrDecoder::new(Cursor::new(with_known_header(&bytes))).map_err(|error| match error {
            image::ImageError::Unsupported(_) => {
                anyhow!("{}: a Radiance file of a kind that is not read: {error}", path.display())
            }
            _ => anyhow::Error::new(error).context(problem()),
        })?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MEMORY_LIMIT_BYTES);
    decoder.set_limits(limits).with_context(problem)?;
    let meta = decoder.metadata();
    let (width, height) = decoder.dimensions();
    check_bytes(path, (width, height), decoder.total_bytes())?;
    let pixels = image::DynamicImage::from_decoder(decoder).with_context(problem)?.into_rgb32f();
    let mut text = format!("Radiance HDR, {width}×{height} pixels, shared exponent\n");
    if let Some(exposure) = meta.exposure {
        let _ = writeln!(text, "exposure {exposure}");
    }
    text.push('\n');
    heading(&mut text, "channel", 7);
    let (names, kind) = if is_xyze(&bytes) { (["X", "Y", "Z"], "xyze") } else { (["R", "G", "B"], "rgbe") };
    for (c, name) in names.iter().enumerate() {
        Range::of(pixels.pixels().map(|pixel| pixel.0[c])).row(&mut text, name, kind, 7);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner::output::{Attribute, Picture, write_exr, write_png};

    #[test]
    fn an_exr_file_is_described() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.EXR");
        let mut picture = Picture::new(2, 1);
        picture.push_f32("R", vec![0.25, 1.0]);
        picture.push_u32("samples.Y", vec![8, 1024]);
        picture.push_attribute("seed", Attribute::Integer(7));
        write_exr(&path, &picture).unwrap();
        let text = describe(&path).unwrap();
        assert!(text.starts_with("OpenEXR, 2×1 pixels\n"), "{text}");
        let row = |name: &str| {
            let line = text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_default();
            line.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(row("R "), ["R", "float", "0.25", "0.625", "1"]);
        assert_eq!(row("samples.Y"), ["samples.Y", "uint", "8", "516", "1024"]);
        assert_eq!(row("seed"), ["seed", "7"]);
    }

    #[test]
    fn a_png_file_is_described_with_its_colour_tags() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_png(&path, 2, 2, &[[1.0, 0.0, 0.0]; 4]).unwrap();
        let text = describe(&path).unwrap();
        assert!(text.contains("2×2 pixels, Rgb, 8 bits") && text.contains("sRGB"), "{text}");
    }

    #[test]
    fn sixteen_bits_have_a_table_and_forty_thousand_rows_no_memory() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let write = |(width, height): (u32, u32), depth, pixels: &[u8]| {
            let mut encoder = png::Encoder::new(std::fs::File::create(&path).unwrap(), width, height);
            encoder.set_color(png::ColorType::Grayscale);
            encoder.set_depth(depth);
            let mut writer = encoder.write_header().unwrap();
            // Of the larger, no row is whole: its header alone asks for the memory.
            match pixels {
                [] => writer.write_chunk(png::chunk::IDAT, &[0x78, 0x9c]).unwrap(),
                pixels => writer.write_image_data(pixels).unwrap(),
            }
        };
        write((2, 1), png::BitDepth::Sixteen, &[1, 0, 0, 3]);
        let text = describe(&path).unwrap();
        let row: Vec<_> = text.lines().last().unwrap().split_whitespace().collect();
        assert_eq!(row, ["grey", "16-bit", "3", "129.5", "256"], "{text}");
        write((40_000, 40_000), png::BitDepth::Eight, &[]);
        assert!(format!("{:#}", describe(&path).unwrap_err()).contains("40000×40000 pixels need more than 1 GiB"));
    }

    #[test]
    fn a_picture_without_pixels_has_no_range() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        std::fs::write(&path, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n").unwrap();
        let text = describe(&path).unwrap();
        assert!(text.contains("no values") && !text.contains("inf"), "{text}");
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_refused_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert!(format!("{:#}", describe(&path).unwrap_err()).contains("not a regular file"));
    }

    #[test]
    fn what_cannot_be_described_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let message = |name: &str| format!("{:#}", describe(&folder.path().join(name)).unwrap_err());
        std::fs::write(folder.path().join("a.txt"), "words").unwrap();
        assert!(message("a.txt").contains(".exr, .png, .hdr and .jpg files and films are known"));
        for name in ["a.png", "a.hdr", "a.exr", "a.jpg"] {
            assert!(message(name).contains(name), "{}", message(name));
            std::fs::write(folder.path().join(name), "rubbish").unwrap();
            assert!(message(name).contains("damaged or no"), "{}", message(name));
        }
    }
}
