//! Reads pictures for the commands: what a file's bytes, channels and header say of its values. How they are
//! shown is left to [`super`].

use super::{Codes, Content, Coverage, InputPicture};
use crate::cli::channels::{self, Colour};
use crate::cli::importance;
use crate::cli::kept_tone::{self, KeptTone};
use anyhow::{Context, Result, bail};
use fechner::digits::significant;
use fechner::exr_read::{ExrImage, MEMORY_LIMIT_BYTES, negative_light};
use fechner::hdr_read::{self, HdrHeader, with_known_header};
use fechner::jpeg_read;
use fechner::output::{self, Attribute, NITS_PER_UNIT, PngTransfer};
use fechner::poison::Unpoisoned as _;
use fechner::read_file;
use fechner::scene;
use fechner_perception::Plane;
use fechner_perception::primaries::Primaries;
use image::{DynamicImage, ImageFormat};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;

/// Where what does not cover all lies, if nothing else is said.
pub(in crate::cli) const BEFORE_BLACK: &str = "lies before black";

/// What becomes of light that alpha does not hold, in a PNG.
pub(in crate::cli) const LIGHT_RAISES_ALPHA: &str = "light that covers nothing (flames, glows) is kept, and covers what lies behind as far as a PNG's alpha must to hold it";

/// Where the luminance of RGB (1, 1, 1) comes from.
#[derive(Clone, Copy)]
enum Unit {
    /// The file, or else what is asked for.
    OfLight(Option<f64>),
    /// Nowhere: the values are no light.
    Meaningless,
}

impl Unit {
    /// In cd/m², for a file that says this.
    fn in_cd_m2(self, source: Source<'_>, own: impl FnOnce() -> Option<f64>) -> Result<f64> {
        let Self::OfLight(asked) = self else { return Ok(1.0) };
        let own = own();
        if let (Some(own), Some(asked)) = (own, asked) {
            source.note(&format!(
                "its own unit of {own} cd/m² stands; --nits-per-unit {asked} is for files that do not say it"
            ));
        }
        own.or(asked).with_context(|| no_unit(source.path))
    }
}

impl InputPicture {
    /// Reads an EXR, HDR, PNG or JPEG file. `nits_per_unit` is needed for scene-linear files that do not say it.
    pub(in crate::cli) fn read(path: &Path, nits_per_unit: Option<f64>) -> Result<Self> {
        Self::read_in(Source::single(path), Unit::OfLight(nits_per_unit))
    }

    /// Reads one of many frames as [`Self::read`] does; a note about all of them is said once.
    pub(in crate::cli) fn read_frame(path: &Path, nits_per_unit: Option<f64>) -> Result<Self> {
        Self::read_in(Source::frame(path), Unit::OfLight(nits_per_unit))
    }

    /// Luminance of the values as the file has them, which may be no light and have no unit.
    pub(in crate::cli) fn read_values(path: &Path) -> Result<Plane> {
        let source = Source::single(path);
        let picture = Self::read_in(source, Unit::Meaningless)?;
        picture.note_if_transparent(source, BEFORE_BLACK);
        Ok(picture.stored_luminance())
    }

    fn read_in(source: Source<'_>, unit: Unit) -> Result<Self> {
        let path = source.path;
        match ending_of(path).as_deref() {
            Some("exr") => Self::from_exr(source, &channels::read_picture(path)?, unit),
            Some("hdr") => Self::from_hdr(source, unit.in_cd_m2(source, || None)?),
            _ if is_of_codes(path) => Self::from_codes(source),
            _ => bail!("{}: not a picture that can be judged: .exr, .hdr, .png and .jpg are read", path.display()),
        }
    }

    fn from_exr(source: Source<'_>, exr: &ExrImage, unit: Unit) -> Result<Self> {
        let nits_per_unit = unit.in_cd_m2(source, || unit_in_file(source, exr))?;
        if let Unit::Meaningless = unit
            && let Some((value, at)) = first_not_finite(exr)
        {
            // Light that is none of a number is replaced; a map has nothing that would be right in its place.
            bail!(importance::refusal(source.path, value, at));
        }
        if channels::colour(exr).is_some_and(|colour| !colour.channels().flatten().any(|value| value.is_finite())) {
            bail!("{}: none of its values is finite, so that there is nothing to look at", source.path.display());
        }
        let Some(picture) = exr.scene_picture(picture_channel) else {
            bail!(
                "{}: there are no channels R, G and B of one layer, nor Y of the root or of a layer that is called as pictures are; \
                 `fechner info` lists what there is",
                source.path.display()
            );
        };
        for text in channels::guess(exr).iter().chain(&picture.notes).chain(&kept_tone::display_not_read(exr)) {
            source.note(text);
        }
        if let Unit::OfLight(_) = unit {
            negative_light(&picture.rgb).iter().for_each(|text| source.note(text));
        }
        let kept_tone = KeptTone::of(exr);
        let content = match kept_tone {
            Some(KeptTone::Displayed) => Content::Emitted { nits_per_unit },
            _ => Content::Scene { nits_per_unit },
        };
        let (width, height) = (picture.width as usize, picture.height as usize);
        let alpha = alpha(exr);
        let is_pass = has_uncovered_light(&picture.rgb, alpha.as_deref());
        let coverage = match alpha {
            Some(_) if is_pass => {
                source.note("its alpha is 0 all over, and is not looked at");
                Coverage::Pass
            }
            Some(alpha) => Coverage::Premultiplied(alpha),
            None => Coverage::Whole,
        };
        Ok(Self {
            width,
            height,
            rgb: picture.rgb,
            content,
            pixel_aspect_ratio: exr.pixel_aspect_ratio,
            made_for: kept_tone::display_in(exr),
            kept_tone,
            coverage,
            part_of: exr.part_of,
        })
    }

    fn from_hdr(source: Source<'_>, nits_per_unit: f64) -> Result<Self> {
        let path = source.path;
        let bytes = read_file::bytes(path).with_context(|| format!("{}", path.display()))?;
        let mut picture = Self::from_image(decoded_image(path, &bytes)?, Content::Scene { nits_per_unit });
        let known = with_known_header(&bytes);
        hdr_read::notes(&known).iter().for_each(|text| source.note(text));
        let header = HdrHeader::of(&known);
        picture.rgb.iter_mut().for_each(|rgb| *rgb = header.light(*rgb));
        picture.pixel_aspect_ratio = header.pixel_aspect_ratio;
        Ok(picture)
    }

    fn from_codes(source: Source<'_>) -> Result<Self> {
        let path = source.path;
        let bytes = read_file::bytes(path).with_context(|| format!("{}", path.display()))?;
        let image = decoded_image(path, &bytes)?;
        let colour = output::png_colour(&bytes);
        for text in colour.notes.iter().chain(&jpeg_read::notes(&bytes)) {
            source.note(text);
        }
        let of = |primaries: Primaries| colour.primaries.unwrap_or(primaries);
        let codes = match colour.transfer {
            PngTransfer::Pq => Codes::Pq(of(Primaries::REC2020)),
            PngTransfer::HybridLogGamma => bail!("{}: hybrid log-gamma is not read", path.display()),
            PngTransfer::Linear => Codes::Linear(of(Primaries::REC709)),
            PngTransfer::Untagged if bytes_a_channel(&image) > 1 => {
                if colour.primaries.is_some() {
                    source.note(
                        "its chromaticities are not heeded: 16 bits without a transfer are the display's own codes",
                    );
                }
                Codes::Display
            }
            PngTransfer::Srgb | PngTransfer::Untagged => Codes::Srgb(of(Primaries::REC709)),
        };
        let coverage = straight_alpha(&image).map_or(Coverage::Whole, Coverage::Straight);
        let pixel_aspect_ratio = output::png_pixel_aspect_ratio(&bytes);
        Ok(Self { coverage, pixel_aspect_ratio, ..Self::from_image(image, Content::Display(codes)) })
    }

    fn from_image(image: DynamicImage, content: Content) -> Self {
        let picture = image.into_rgb32f();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let rgb = picture.pixels().map(|p| p.0).collect();
        Self {
            width,
            height,
            rgb,
            content,
            pixel_aspect_ratio: 1.0,
            made_for: None,
            kept_tone: None,
            coverage: Coverage::Whole,
            part_of: None,
        }
    }
}

/// Whether a file of this name holds what is sent to a display: what values mean goes by their file's name.
pub(in crate::cli) fn is_of_codes(path: &Path) -> bool {
    matches!(ending_of(path).as_deref(), Some("png" | "jpg" | "jpeg"))
}

/// In lower case.
fn ending_of(path: &Path) -> Option<String> {
    path.extension()?.to_str().map(str::to_ascii_lowercase)
}

fn bytes_a_channel(image: &DynamicImage) -> u8 {
    let color = image.color();
    color.bytes_per_pixel() / color.channel_count()
}

/// How much of each pixel an image covers, 0 to 1; `None` where that is all of all of them.
fn straight_alpha(image: &DynamicImage) -> Option<Vec<f32>> {
    if !image.color().has_alpha() {
        return None;
    }
    let alpha: Vec<f32> = image.to_rgba32f().pixels().map(|pixel| pixel.0[3]).collect();
    alpha.iter().any(|&alpha| alpha < 1.0).then_some(alpha)
}

/// A picture of a limited size. What its values mean goes by its name, so that its bytes must be what that says.
fn decoded_image(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
    if bytes.is_empty() {
        bail!("{}: it is empty", path.display());
    }
    let bytes = &*with_known_header(bytes);
    let named = ImageFormat::from_path(path).with_context(|| format!("{}", path.display()))?;
    let found = image::guess_format(bytes).with_context(|| format!("{}: not a readable picture", path.display()))?;
    if found != named {
        bail!("{}: its bytes are those of a file of another kind ({}): name it so", path.display(), words_of(found));
    }
    if found == ImageFormat::Jpeg && !jpeg_read::has_end(bytes) {
        bail!("{}: {}", path.display(), jpeg_read::CUT_OFF);
    }
    let mut reader = image::ImageReader::with_format(std::io::Cursor::new(bytes), found);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(1 << 15);
    limits.max_image_height = Some(1 << 15);
    limits.max_alloc = Some(MEMORY_LIMIT_BYTES);
    reader.limits(limits);
    let image = reader.decode().with_context(|| format!("{}: not a readable picture", path.display()))?;
    if found == ImageFormat::Jpeg && !jpeg_read::is_complete(bytes, &image) {
        bail!("{}: {}", path.display(), jpeg_read::INCOMPLETE);
    }
    Ok(image)
}

/// What files of a format are called.
fn words_of(format: ImageFormat) -> String {
    let endings = format.extensions_str().first();
    endings.map_or_else(|| format!("{format:?}"), |ending| format!(".{ending}"))
}

/// How much of each pixel an EXR picture covers; `None` where that is all of all of them.
fn alpha(exr: &ExrImage) -> Option<Vec<f32>> {
    let covered = |&alpha: &f32| if alpha.is_nan() { 0.0 } else { alpha.clamp(0.0, 1.0) };
    let alpha = exr.in_display_window(channels::alpha(exr)?.iter().map(covered).collect());
    alpha.iter().any(|&a| a < 1.0).then_some(alpha)
}

/// Whether alpha is 0 all over a picture that has light: of one that covers nothing neither has any.
fn has_uncovered_light(rgb: &[[f32; 3]], alpha: Option<&[f32]>) -> bool {
    alpha.is_some_and(|alpha| alpha.iter().all(|&a| a == 0.0)) && rgb.as_flattened().iter().any(|&value| value != 0.0)
}

/// The first value of a picture that is not finite, and the pixel of what is shown that has it.
fn first_not_finite(exr: &ExrImage) -> Option<(f32, (usize, usize))> {
    let width = exr.display_window.width as usize;
    channels::colour(exr)?.channels().find_map(|channel| {
        let shown = exr.in_display_window(channel.to_vec());
        let index = shown.iter().position(|value| !value.is_finite())?;
        Some((shown[index], (index % width, index / width)))
    })
}

/// A channel of the file's picture by its last name, all three from one layer.
fn picture_channel<'a>(exr: &'a ExrImage, name: &str) -> Option<&'a [f32]> {
    let Some(Colour::Rgb([r, g, b])) = channels::colour(exr) else { return None };
    match name {
        "R" => Some(r),
        "G" => Some(g),
        "B" => Some(b),
        _ => None,
    }
}

/// Luminance of RGB (1, 1, 1) as the file says it, where it is one that a picture can have: `whiteLuminance` is
/// written by many and read by few.
fn unit_in_file(source: Source<'_>, exr: &ExrImage) -> Option<f64> {
    let said = [NITS_PER_UNIT, "whiteLuminance"].into_iter().find_map(|name| match exr.attribute(name) {
        Some(Attribute::Float(nits)) => Some((name, *nits)),
        _ => None,
    });
    let (name, nits) = said?;
    // As files round it.
    let (least, most) = (*scene::NITS_PER_UNIT.start() as f32, *scene::NITS_PER_UNIT.end() as f32);
    if (least..=most).contains(&nits) {
        return Some(f64::from(nits));
    }
    let nits = significant(nits.into(), 6);
    source.note(&format!("{name} {nits} is not a luminance from {least:e} to {most:e} cd/m², and is not looked at"));
    None
}

/// A file, as notes name it.
#[derive(Clone, Copy)]
pub(in crate::cli) struct Source<'a> {
    path: &'a Path,
    kind: SourceKind,
}

#[derive(Clone, Copy)]
enum SourceKind {
    /// A picture by itself.
    Single,
    /// One of many, whose names differ by digits.
    Frame,
}

impl<'a> Source<'a> {
    /// A picture by itself.
    pub(in crate::cli) fn single(path: &'a Path) -> Self {
        Self { path, kind: SourceKind::Single }
    }

    /// The source of one of many frames; a note about all of them is said once.
    pub(in crate::cli) fn frame(path: &'a Path) -> Self {
        Self { path, kind: SourceKind::Frame }
    }

    /// Says something of a picture once, or once of all frames.
    pub(in crate::cli) fn note(self, text: &str) {
        match self.kind {
            SourceKind::Single => note_once(self.path, text, format!("{}: {text}", self.path.display())),
            SourceKind::Frame => note(self.path, text),
        }
    }
}

/// Says something of a file, once of all the frames of a sequence, whose names differ by their longest number.
pub(in crate::cli) fn note(path: &Path, text: &str) {
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let numbers = name.split(|c: char| !c.is_ascii_digit());
    let frame = numbers.max_by_key(|digits| digits.len()).filter(|digits| !digits.is_empty());
    let of_sequence = frame.map_or_else(|| name.to_string(), |digits| name.replacen(digits, "#", 1));
    let folder = path.parent().unwrap_or(path).display();
    note_once(path, text, format!("{folder}/{of_sequence}: {}", text.replace(|c: char| c.is_ascii_digit(), "#")));
}

/// Says something of a file, unless something under the same key was said before.
fn note_once(path: &Path, text: &str, key: String) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    if SAID.lock().unpoisoned().insert(key) {
        say!("note: {}: {text}", path.display());
    }
}

fn no_unit(path: &Path) -> String {
    format!(
        "{}: the file does not say how bright RGB (1, 1, 1) is, and nothing can be seen in a picture without a unit: give \
         --nits-per-unit in cd/m²",
        path.display()
    )
}
