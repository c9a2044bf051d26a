//! Pictures of any renderer as the input of `compare` and `threshold`.

use super::channels::{self, Colour};
use super::kept_tone::{self, KeptTone};
use anyhow::{Context, Result, bail};
use fechner::exr_read::ExrImage;
use fechner::hdr_read::{HdrHeader, with_known_header};
use fechner::jpeg_read;
use fechner::output::{self, Attribute, NITS_PER_UNIT, PartOf, PngTransfer};
use fechner::scene;
use fechner_perception::Plane;
use fechner_perception::display::{Display, Eotf, Viewing};
use fechner_perception::photometry::luminance;
use fechner_perception::primaries::{Primaries, apply};
use fechner_perception::tone::{FittedTone, SceneLight, ToneOperator, gamut, map_picture, map_pixels};
use image::GenericImageView as _;
use image::{DynamicImage, ImageFormat};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// A picture from a file.
pub(super) struct InputPicture {
    width: usize,
    height: usize,
    rgb: Vec<[f32; 3]>,
    content: Content,
    /// Width of a pixel over its height.
    pixel_aspect_ratio: f64,
    /// The display that it was made for, where that is known.
    made_for: Option<Display>,
    /// How it was shown when it was rendered, where its file says so.
    kept_tone: Option<KeptTone>,
    /// How much of each pixel it covers, 0 to 1, where an EXR file leaves some of any uncovered. Its values are multiplied by it.
    alpha: Option<Vec<f32>>,
    /// Where it lies, if it is a part of a larger picture.
    part_of: Option<PartOf>,
}

/// Brings scene light, cd/m², of a picture this wide to linear display RGB.
type Mapping = fn(&dyn FittedTone, usize, &[[f32; 3]]) -> Vec<[f32; 3]>;

/// What the values mean.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    /// Linear radiance; RGB (1, 1, 1) has this luminance in cd/m².
    Scene { nits_per_unit: f64 },
    /// The same of what a display emits, as `tonemap` writes it: nothing more has to bring it there.
    Emitted { nits_per_unit: f64 },
    /// Code values, 0 to 1.
    Display(Codes),
}

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
    fn in_cd_m2(self, path: &Path, own: impl FnOnce() -> Option<f64>) -> Result<f64> {
        let Self::OfLight(asked) = self else { return Ok(1.0) };
        let own = own();
        if let (Some(own), Some(asked)) = (own, asked) {
            note(
                path,
                &format!("its own unit of {own} cd/m² stands; --nits-per-unit {asked} is for files that do not say it"),
            );
        }
        own.or(asked).with_context(|| no_unit(path))
    }
}

/// What code values mean.
#[derive(Clone, Copy, PartialEq)]
enum Codes {
    /// Light of the display between its black and its white, under the curve of sRGB: colour management brings it to a display
    /// of any other transfer function.
    Srgb(Primaries),
    /// The same light as it is.
    Linear(Primaries),
    /// cd/m² under the curve of SMPTE ST 2084.
    Pq(Primaries),
    /// What the display gets.
    Display,
}

impl InputPicture {
    /// Reads an EXR, HDR, PNG or JPEG file. `nits_per_unit` is needed for scene-linear files that do not say it.
    pub(super) fn read(path: &Path, nits_per_unit: Option<f64>) -> Result<Self> {
        Self::read_in(path, Unit::OfLight(nits_per_unit))
    }

    /// Luminance of the values as the file has them, which may be no light and have no unit.
    pub(super) fn read_values(path: &Path) -> Result<Plane> {
        Ok(Self::read_in(path, Unit::Meaningless)?.values())
    }

    fn read_in(path: &Path, unit: Unit) -> Result<Self> {
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        match ending.as_deref() {
            Some("exr") => Self::from_exr(path, &channels::read_picture(path)?, unit),
            Some("hdr") => Self::from_hdr(path, unit.in_cd_m2(path, || None)?),
            Some("png" | "jpg" | "jpeg") => Self::from_codes(path),
            _ => bail!("{}: not a picture that can be judged: .exr, .hdr, .png and .jpg are read", path.display()),
        }
    }

    fn from_exr(path: &Path, exr: &ExrImage, unit: Unit) -> Result<Self> {
        let nits_per_unit = unit.in_cd_m2(path, || unit_in_file(path, exr))?;
        let Some(picture) = exr.scene_picture(picture_channel) else {
            bail!("{}: there are no channels R, G and B, nor Y; `fechner info` lists what there is", path.display());
        };
        for text in channels::guess(exr).iter().chain(&picture.notes) {
            note(path, text);
        }
        let kept_tone = KeptTone::of(exr);
        let content = match kept_tone {
            Some(KeptTone::Displayed) => Content::Emitted { nits_per_unit },
            _ => Content::Scene { nits_per_unit },
        };
        let (width, height) = (picture.width as usize, picture.height as usize);
        Ok(Self {
            width,
            height,
            rgb: picture.rgb,
            content,
            pixel_aspect_ratio: exr.pixel_aspect_ratio,
            made_for: kept_tone::display_in(exr),
            kept_tone,
            alpha: alpha(path, exr),
            part_of: exr.part_of,
        })
    }

    fn from_hdr(path: &Path, nits_per_unit: f64) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
        let header = HdrHeader::of(&with_known_header(&bytes));
        let mut picture = Self::from_image(decoded_image(path, &bytes)?, Content::Scene { nits_per_unit });
        picture.rgb.iter_mut().for_each(|rgb| *rgb = header.light(*rgb));
        picture.pixel_aspect_ratio = header.pixel_aspect_ratio;
        Ok(picture)
    }

    fn from_codes(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
        let mut image = decoded_image(path, &bytes)?;
        let colour = output::png_colour(&bytes);
        for text in colour.notes.iter().chain(&jpeg_read::notes(&bytes)) {
            note(path, text);
        }
        let of = |primaries: Primaries| colour.primaries.unwrap_or(primaries);
        let codes = match colour.transfer {
            PngTransfer::Pq => Codes::Pq(of(Primaries::REC2020)),
            PngTransfer::HybridLogGamma => bail!("{}: hybrid log-gamma is not read", path.display()),
            PngTransfer::Linear => Codes::Linear(of(Primaries::REC709)),
            PngTransfer::Untagged if bytes_a_channel(&image) > 1 => Codes::Display,
            PngTransfer::Srgb | PngTransfer::Untagged => Codes::Srgb(of(Primaries::REC709)),
        };
        if image.color().has_alpha() && image.pixels().any(|(_, _, pixel)| pixel.0[3] < u8::MAX) {
            if matches!(codes, Codes::Srgb(_)) {
                note(path, "what is transparent lies before black");
                image = before_black(image);
            } else {
                note(path, "alpha is not looked at: each pixel is seen in the colour that it has");
            }
        }
        Ok(Self::from_image(image, Content::Display(codes)))
    }

    fn from_image(image: DynamicImage, content: Content) -> Self {
        let picture = image.into_rgb32f();
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let rgb = picture.pixels().map(|p| p.0).collect();
        let is_pq = matches!(content, Content::Display(Codes::Pq(_)));
        let made_for = if is_pq { Display::preset("hdr-1000") } else { None };
        Self {
            width,
            height,
            rgb,
            content,
            pixel_aspect_ratio: 1.0,
            made_for,
            kept_tone: None,
            alpha: None,
            part_of: None,
        }
    }

    /// The viewing of this picture, whose pixels may be oblong: its lines are as dense as the display's and its columns closer
    /// together or wider apart, as players stretch them.
    pub(super) fn viewed(&self, viewing: &Viewing) -> Result<Viewing> {
        let mut viewing = viewing.clone();
        viewing.display.pixels_per_degree /= self.pixel_aspect_ratio;
        viewing.display.pixel_aspect_ratio *= self.pixel_aspect_ratio;
        viewing.check().with_context(|| format!("pixels {} times as wide as high", self.pixel_aspect_ratio))?;
        Ok(viewing)
    }

    /// Width of a pixel over its height.
    pub(super) fn pixel_aspect_ratio(&self) -> f64 {
        self.pixel_aspect_ratio
    }

    /// How much of each pixel it covers, 0 to 1; `None` where it covers all of all.
    pub(super) fn alpha(&self) -> Option<&[f32]> {
        self.alpha.as_deref()
    }

    /// Where it lies, if it is a part of a larger picture.
    pub(super) fn part_of(&self) -> Option<PartOf> {
        self.part_of
    }

    fn values(&self) -> Plane {
        Plane::from_fn(self.width, self.height, |x, y| luminance(self.rgb[y * self.width + x]))
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The display that it was made for, where its file says so; one that shows PQ, of pictures in PQ.
    pub(super) fn made_for(&self) -> Option<&Display> {
        self.made_for.as_ref()
    }

    /// How it was shown when it was rendered, where its file says so.
    pub(super) fn kept_tone(&self) -> Option<&KeptTone> {
        self.kept_tone.as_ref()
    }

    /// Whether an operator has to bring it to a display.
    pub(super) fn holds_scene_light(&self) -> bool {
        matches!(self.content, Content::Scene { .. })
    }

    /// Whether it holds the light of a display, and not its codes.
    pub(super) fn holds_emitted_light(&self) -> bool {
        matches!(self.content, Content::Emitted { .. })
    }

    /// The operator fitted to this picture; `None` for one that is ready for the display.
    pub(super) fn fit(&self, operator: &dyn ToneOperator, viewing: &Viewing) -> Option<Box<dyn FittedTone>> {
        let light = SceneLight::of(operator, self.width, &self.scene_rgb_cd_m2()?);
        Some(operator.fit(&light.guide(), viewing, None))
    }

    /// Linear RGB in cd/m² that the display sends to the eye.
    pub(super) fn displayed_rgb(&self, tone: Option<&dyn FittedTone>, viewing: &Viewing) -> Vec<[f32; 3]> {
        let display = &viewing.display;
        let cd_m2 = |relative: f32| display.luminance_cd_m2(f64::from(relative)) as f32;
        self.relative_rgb(tone, display, map_picture).into_iter().map(|rgb| rgb.map(cd_m2)).collect()
    }

    /// Linear display RGB, 0 the display's black and 1 its white; `map` brings a scene there.
    fn relative_rgb(&self, tone: Option<&dyn FittedTone>, display: &Display, map: Mapping) -> Vec<[f32; 3]> {
        match (self.scene_rgb_cd_m2(), tone) {
            (Some(scene), Some(tone)) => map(tone, self.width, &scene),
            _ => self.decoded(display),
        }
    }

    /// The same of codes that are ready for the display.
    fn decoded(&self, display: &Display) -> Vec<[f32; 3]> {
        let linear = |eotf: Eotf| {
            let light = |code: f32| eotf.decode(f64::from(code), display.white_cd_m2) as f32;
            self.rgb.iter().map(|rgb| rgb.map(light)).collect()
        };
        match self.content {
            Content::Display(Codes::Pq(primaries)) => output::decode_pq(&self.rgb, &primaries, display),
            Content::Display(Codes::Display) if display.eotf == Eotf::Pq => {
                output::decode_pq(&self.rgb, &Primaries::REC2020, display)
            }
            Content::Display(Codes::Display) => linear(display.eotf),
            Content::Display(Codes::Srgb(primaries)) => in_rec709(linear(Eotf::Srgb), &primaries),
            Content::Display(Codes::Linear(primaries)) => in_rec709(self.rgb.clone(), &primaries),
            Content::Scene { nits_per_unit } | Content::Emitted { nits_per_unit } => {
                self.emitted(nits_per_unit, display)
            }
        }
    }

    /// The same of what a display emits in such a unit.
    fn emitted(&self, nits_per_unit: f64, display: &Display) -> Vec<[f32; 3]> {
        let relative = |value: f32| display.relative_of_emitted(f64::from(value) * nits_per_unit) as f32;
        self.rgb.iter().map(|rgb| rgb.map(relative)).collect()
    }

    /// Linear RGB in cd/m² of the scene; `None` for a picture that is ready for the display.
    pub(super) fn scene_rgb_cd_m2(&self) -> Option<Vec<[f32; 3]>> {
        self.light_cd_m2().filter(|_| self.holds_scene_light())
    }

    /// Linear RGB in cd/m² of the scene, or of the display whose light it holds; `None` for code values.
    pub(super) fn light_cd_m2(&self) -> Option<Vec<[f32; 3]>> {
        let (Content::Scene { nits_per_unit } | Content::Emitted { nits_per_unit }) = self.content else { return None };
        let cd_m2 = |value: f32| (f64::from(value) * nits_per_unit).clamp(-1e30, 1e30) as f32;
        Some(self.rgb.iter().map(|pixel| pixel.map(cd_m2)).collect())
    }

    /// The values as the file has them; 0 to 1 in a picture that is ready for the display.
    pub(super) fn codes(&self) -> &[[f32; 3]] {
        &self.rgb
    }

    /// The values as bytes, R′G′B′ after R′G′B′: of a picture that is ready for the display.
    pub(super) fn codes8(&self) -> Vec<u8> {
        let byte = |code: f32| (255.0 * code.clamp(0.0, 1.0)).round() as u8;
        self.rgb.iter().flat_map(|rgb| rgb.map(byte)).collect()
    }

    /// Luminance in cd/m² that the display sends to the eye, of the colours that it shows: those that it clips too.
    pub(super) fn displayed(&self, tone: Option<&dyn FittedTone>, viewing: &Viewing) -> Plane {
        self.luminance_of(&self.relative_rgb(tone, &viewing.display, map_picture), &viewing.display)
    }

    /// The same without the operator's loss of acuity: for noise that is judged by an eye behind it.
    pub(super) fn displayed_sharp(&self, tone: Option<&dyn FittedTone>, viewing: &Viewing) -> Plane {
        self.luminance_of(&self.relative_rgb(tone, &viewing.display, map_pixels), &viewing.display)
    }

    fn luminance_of(&self, relative: &[[f32; 3]], display: &Display) -> Plane {
        Plane::from_fn(self.width, self.height, |x, y| {
            // What a channel has beyond the display's black and white is not seen.
            let shown = relative[y * self.width + x].map(|light| light.clamp(0.0, 1.0));
            display.luminance_cd_m2(f64::from(luminance(shown))) as f32
        })
    }
}

/// Light of other primaries, 0 to 1, in those of Rec.709: what they do not reach is brought in at the luminance that it has.
fn in_rec709(light: Vec<[f32; 3]>, primaries: &Primaries) -> Vec<[f32; 3]> {
    let Some(matrix) = primaries.to_other(&Primaries::REC709) else { return light };
    let inside = |rgb: [f32; 3]| gamut::fit_into_display(apply(&matrix, rgb.map(f64::from)).map(|value| value as f32));
    light.into_iter().map(inside).collect()
}

fn bytes_a_channel(image: &DynamicImage) -> u8 {
    let color = image.color();
    color.bytes_per_pixel() / color.channel_count()
}

/// Straight alpha of sRGB codes laid before black, as the premultiplied channels of an EXR file are seen.
fn before_black(image: DynamicImage) -> DynamicImage {
    let mut picture = image.into_rgba32f();
    for pixel in picture.pixels_mut() {
        let [colour @ .., alpha] = &mut pixel.0;
        for code in colour {
            let light = Eotf::Srgb.decode(f64::from(*code), 1.0) * f64::from(*alpha);
            *code = Eotf::Srgb.encode(light, 1.0) as f32;
        }
    }
    DynamicImage::ImageRgba32F(picture)
}

/// A picture of a limited size. What its values mean goes by its name, so that its bytes must be what that says.
fn decoded_image(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
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
    limits.max_alloc = Some(1 << 30);
    reader.limits(limits);
    reader.decode().with_context(|| format!("{}: not a readable picture", path.display()))
}

/// What files of a format are called.
fn words_of(format: ImageFormat) -> String {
    let endings = format.extensions_str().first();
    endings.map_or_else(|| format!("{format:?}"), |ending| format!(".{ending}"))
}

/// How much of each pixel an EXR picture covers; `None` where that is all of all of them.
fn alpha(path: &Path, exr: &ExrImage) -> Option<Vec<f32>> {
    let covered = |&alpha: &f32| if alpha.is_nan() { 0.0 } else { alpha.clamp(0.0, 1.0) };
    let alpha = exr.in_display_window(channels::alpha(exr)?.iter().map(covered).collect());
    if alpha.iter().all(|&a| a == 0.0) {
        note(path, "its alpha is 0 all over, and is not looked at");
        return None;
    }
    alpha.iter().any(|&a| a < 1.0).then_some(alpha)
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

/// Luminance of RGB (1, 1, 1) as the file says it, where it is one that a picture can have: `whiteLuminance` is written by many and read
/// by few.
fn unit_in_file(path: &Path, exr: &ExrImage) -> Option<f64> {
    let said = [NITS_PER_UNIT, "whiteLuminance"].into_iter().find_map(|name| match exr.attribute(name) {
        Some(Attribute::Float(nits)) if *nits > 0.0 => Some((name, *nits)),
        _ => None,
    });
    let (name, nits) = said?;
    // As files round it.
    let (least, most) = (*scene::NITS_PER_UNIT.start() as f32, *scene::NITS_PER_UNIT.end() as f32);
    if (least..=most).contains(&nits) {
        return Some(f64::from(nits));
    }
    note(path, &format!("{name} {nits:e} is not a luminance from {least:e} to {most:e} cd/m², and is not looked at"));
    None
}

/// Says something of a file, once of all the frames of a sequence, whose names differ by digits.
pub(super) fn note(path: &Path, text: &str) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let of_sequence = format!("{}: {text}", path.display()).replace(|c: char| c.is_ascii_digit(), "#");
    if SAID.lock().unwrap_or_else(PoisonError::into_inner).insert(of_sequence) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// P3's and Rec.2020's primaries under the curve of sRGB: with their negative channels cut off they were 14 to 35 % too bright.
    #[test]
    fn colours_of_wider_primaries_keep_their_luminance() {
        for primaries in [Primaries::DISPLAY_P3, Primaries::REC2020] {
            let weights = primaries.to_xyz().expect("a space")[1];
            for rgb in [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [1.0; 3]] {
                let shown = in_rec709(vec![rgb], &primaries)[0];
                let meant: f64 = rgb.iter().zip(weights).map(|(light, weight)| f64::from(*light) * weight).sum();
                let found = f64::from(luminance(shown));
                assert!((found / meant - 1.0).abs() < 1e-3, "{rgb:?}: {found} for {meant}");
                assert!(shown.iter().all(|light| (0.0..=1.0).contains(light)), "{shown:?}");
            }
        }
    }

    /// What was written for a PQ display is seen as it was meant: its own primaries, and its black once.
    #[test]
    fn pq_pictures_are_seen_as_they_were_written() {
        let viewing = Viewing::of(Display::preset("hdr-1000").expect("a preset"));
        let light = [[0.0, 0.0, 0.0], [0.5, 0.1, 0.02], [0.001, 0.2, 0.9], [1.0, 1.0, 1.0]];
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.png");
        output::write_pq_png(&file, 4, 1, &light, &viewing.display).expect("written");
        let picture = InputPicture::read(&file, None).expect("read");
        let cd_m2 = |relative: f32| viewing.display.luminance_cd_m2(f64::from(relative)) as f32;
        let close = |found: f32, meant: f32| assert!((found - meant).abs() < 2e-3 * meant, "{found}, not {meant}");
        for (found, meant) in picture.displayed_rgb(None, &viewing).iter().flatten().zip(light.iter().flatten()) {
            // The darkest channel of a saturated colour is a small difference of large ones.
            if *meant == 0.0 || *meant > 0.05 {
                close(*found, cd_m2(*meant));
            }
        }
        let displayed = picture.displayed(None, &viewing);
        light.iter().enumerate().for_each(|(x, rgb)| close(displayed.get(x, 0), cd_m2(luminance(*rgb))));
    }
}
