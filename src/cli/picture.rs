//! Pictures of any renderer as the input of `compare`, `threshold` and `tonemap`, as frames of a video, and as maps of
//! importance.

mod from_file;

pub(super) use self::from_file::{BEFORE_BLACK, LIGHT_RAISES_ALPHA, Source, is_of_codes, note};
use super::kept_tone::KeptTone;
use anyhow::{Context, Result};
use fechner::output::covered::{Covered, Mapping};
use fechner::output::{self, PartOf};
use fechner_perception::Plane;
use fechner_perception::display::{Display, Eotf, Viewing};
use fechner_perception::photometry::luminance;
use fechner_perception::primaries::{Primaries, apply};
use fechner_perception::tone::{FittedTone, SceneLight, ToneOperator, gamut, map_picture};

/// A picture from a file.
pub(super) struct InputPicture {
    width: usize,
    height: usize,
    rgb: Vec<[f32; 3]>,
    content: Content,
    /// Width of a pixel over its height.
    pixel_aspect_ratio: f64,
    /// The display that it was made for, where its file says so.
    made_for: Option<Display>,
    /// How it was shown when it was rendered, where its file says so.
    kept_tone: Option<KeptTone>,
    coverage: Coverage,
    /// Where it lies, if it is a part of a larger picture.
    part_of: Option<PartOf>,
}

/// How much of each pixel a picture covers.
enum Coverage {
    Whole,
    /// All, of an EXR file that has light and an alpha of 0 all over, as passes have it, which is not looked at.
    Pass,
    /// So much of each, 0 to 1, by which an EXR file's values are multiplied.
    Premultiplied(Vec<f32>),
    /// So much of each, 0 to 1, by which the light of a file of codes is not multiplied.
    Straight(Vec<f32>),
}

impl Coverage {
    fn alpha(&self) -> Option<&[f32]> {
        match self {
            Self::Whole | Self::Pass => None,
            Self::Premultiplied(alpha) | Self::Straight(alpha) => Some(alpha),
        }
    }

    fn premultiplied(&self) -> Option<&[f32]> {
        self.alpha().filter(|_| matches!(self, Self::Premultiplied(_)))
    }

    fn straight(&self) -> Option<&[f32]> {
        self.alpha().filter(|_| matches!(self, Self::Straight(_)))
    }
}

/// What lies behind a picture that does not cover all.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Ground {
    Black,
    White,
}

/// What pictures must have in common to be compared.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Width and height in pixels.
    pub(super) size: (usize, usize),
    /// Width of a pixel over its height.
    pub(super) pixel_aspect_ratio: f64,
}

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

/// What code values mean.
#[derive(Clone, Copy, PartialEq)]
enum Codes {
    /// Light of the display between its black and its white, under the curve of sRGB: colour management brings it to a
    /// display of any other transfer function.
    Srgb(Primaries),
    /// The same light as it is.
    Linear(Primaries),
    /// cd/m² under the curve of SMPTE ST 2084.
    Pq(Primaries),
    /// What the display gets.
    Display,
}

impl InputPicture {
    /// The viewing of this picture, whose pixels may be oblong: its lines are as dense as the display's and its columns
    /// closer together or wider apart, as players stretch them.
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

    /// How much of each pixel it covers, 0 to 1, by which its values are multiplied; `None` where it covers all of all.
    pub(super) fn premultiplied_alpha(&self) -> Option<&[f32]> {
        self.coverage.premultiplied()
    }

    /// Where it lies, if it is a part of a larger picture.
    pub(super) fn part_of(&self) -> Option<PartOf> {
        self.part_of
    }

    /// Luminance of the values as they are stored, before black.
    fn stored_luminance(&self) -> Plane {
        let alpha = |pixel: usize| self.coverage.straight().map_or(1.0, |alpha| alpha[pixel]);
        let value = |pixel: usize| luminance(self.rgb[pixel]) * alpha(pixel);
        Plane::from_fn(self.width, self.height, |x, y| value(y * self.width + x))
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Size and shape of pixels.
    pub(super) fn shape(&self) -> Shape {
        Shape { size: self.size(), pixel_aspect_ratio: self.pixel_aspect_ratio }
    }

    /// Whether what lies behind it is seen.
    pub(super) fn is_transparent(&self) -> bool {
        self.coverage.alpha().is_some()
    }

    /// Beside a pass what covers nothing is a pass, too, in which no light is.
    pub(super) fn be_a_pass_beside(&mut self, other: &Self) {
        let covers_nothing = self.coverage.alpha().is_some_and(|alpha| alpha.iter().all(|&covered| covered == 0.0));
        if matches!(other.coverage, Coverage::Pass) && covers_nothing {
            self.coverage = Coverage::Pass;
        }
    }

    /// Says where a picture lies that does not cover all.
    pub(super) fn note_if_transparent(&self, source: Source<'_>, lies: &str) {
        if self.is_transparent() {
            source.note(&format!("what is transparent {lies}"));
        }
    }

    /// The display that it was made for, where its file says so.
    pub(super) fn made_for(&self) -> Option<&Display> {
        self.made_for.as_ref()
    }

    /// A display that its codes are likely for, where no file says more: one that shows PQ, of pictures in PQ.
    pub(super) fn likely_display(&self) -> Option<Display> {
        matches!(self.content, Content::Display(Codes::Pq(_))).then(|| Display::preset("hdr-1000")).flatten()
    }

    /// How it was shown when it was rendered, where its file says so.
    pub(super) fn kept_tone(&self) -> Option<&KeptTone> {
        self.kept_tone.as_ref()
    }

    /// Whether an operator has to bring it to a display.
    pub(super) fn holds_scene_light(&self) -> bool {
        matches!(self.content, Content::Scene { .. })
    }

    /// Whether it holds light as another picture of as many pixels does, if perhaps by another unit, or the same codes.
    pub(super) fn has_values_like(&self, other: &Self) -> bool {
        let are_alike = match (self.content, other.content) {
            (Content::Display(own), Content::Display(other)) => own == other,
            (own, other) => std::mem::discriminant(&own) == std::mem::discriminant(&other),
        };
        are_alike && self.rgb.len() == other.rgb.len()
    }

    /// Luminance of RGB (1, 1, 1), cd/m²; 1 of codes.
    pub(super) fn light_of_one_cd_m2(&self) -> f64 {
        match self.content {
            Content::Scene { nits_per_unit } | Content::Emitted { nits_per_unit } => nits_per_unit,
            Content::Display(_) => 1.0,
        }
    }

    /// Whether it holds what is sent to a display, from 0 to 1.
    pub(super) fn holds_codes(&self) -> bool {
        matches!(self.content, Content::Display(_))
    }

    /// Whether it holds the light of a display, and not its codes.
    pub(super) fn holds_emitted_light(&self) -> bool {
        matches!(self.content, Content::Emitted { .. })
    }

    /// The operator fitted to this picture; `None` for one that is ready for the display.
    pub(super) fn fit(&self, operator: &dyn ToneOperator, viewing: &Viewing) -> Option<Box<dyn FittedTone>> {
        Some(operator.fit(&self.scene_light(operator)?.guide_for(operator), viewing, None))
    }

    /// What an operator is fitted to, which is what the picture covers; `None` for one that is ready for the display.
    pub(super) fn scene_light(&self, operator: &dyn ToneOperator) -> Option<SceneLight> {
        let light = SceneLight::of(operator, self.width, &self.scene_rgb_cd_m2()?);
        Some(match self.coverage.premultiplied() {
            Some(alpha) => light.where_covered(alpha),
            None => light,
        })
    }

    /// Linear RGB in cd/m² that the display sends to the eye.
    pub(super) fn displayed_rgb(&self, tone: Option<&dyn FittedTone>, viewing: &Viewing) -> Vec<[f32; 3]> {
        self.displayed_rgb_over(Ground::Black, tone, viewing)
    }

    /// Linear RGB in cd/m² that the display sends to the eye, with its black or white behind the picture.
    pub(super) fn displayed_rgb_over(
        &self,
        ground: Ground,
        tone: Option<&dyn FittedTone>,
        viewing: &Viewing,
    ) -> Vec<[f32; 3]> {
        let mut shown = self.relative_rgb(tone, &viewing.display, map_picture);
        if ground == Ground::White {
            for (rgb, coverage) in shown.iter_mut().zip(self.coverage.alpha().into_iter().flatten()) {
                // Light that alpha does not hold hides what lies behind, as in a PNG.
                let held = rgb.iter().fold(*coverage, |held, light| held.max(*light)).min(1.0);
                *rgb = rgb.map(|light| light + (1.0 - held));
            }
        }
        viewing.display.rgb_cd_m2(&shown)
    }

    /// Linear display RGB, 0 the display's black and 1 its white; `map` brings a scene there.
    fn relative_rgb(&self, tone: Option<&dyn FittedTone>, display: &Display, map: Mapping) -> Vec<[f32; 3]> {
        match (self.scene_rgb_cd_m2(), tone, self.coverage.premultiplied()) {
            // An operator shows what covers a pixel, as in the PNG of a render: of light times alpha it would make
            // another thing.
            (Some(scene), Some(tone), Some(alpha)) => Covered::of(tone, map, self.width, &scene, alpha).premultiplied(),
            (Some(scene), Some(tone), None) => map(tone, self.width, &scene),
            _ => self.before_black(self.decoded(display)),
        }
    }

    /// Light of codes before the display's black, where they have an alpha.
    fn before_black(&self, mut light: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        for (rgb, alpha) in light.iter_mut().zip(self.coverage.straight().into_iter().flatten()) {
            *rgb = rgb.map(|channel| channel * alpha);
        }
        light
    }

    /// Linear display RGB of codes that are ready for the display.
    fn decoded(&self, display: &Display) -> Vec<[f32; 3]> {
        let linear = |decode: &dyn Fn(f64) -> f64| -> Vec<[f32; 3]> {
            self.rgb.iter().map(|rgb| rgb.map(|code| decode(f64::from(code)) as f32)).collect()
        };
        match self.content {
            Content::Display(Codes::Pq(primaries)) => output::decode_pq(&self.rgb, &primaries, display),
            Content::Display(Codes::Display) if display.eotf == Eotf::Pq => {
                output::decode_pq(&self.rgb, &Primaries::REC2020, display)
            }
            Content::Display(Codes::Display) => linear(&|code| display.light_of_code(code)),
            Content::Display(Codes::Srgb(primaries)) => {
                in_rec709(linear(&|code| Eotf::Srgb.decode(code, display.white_cd_m2)), &primaries)
            }
            Content::Display(Codes::Linear(primaries)) => in_rec709(self.rgb.clone(), &primaries),
            Content::Scene { nits_per_unit } | Content::Emitted { nits_per_unit } => {
                self.emitted(nits_per_unit, display)
            }
        }
    }

    /// The same of what a display emits in such a unit.
    fn emitted(&self, nits_per_unit: f64, display: &Display) -> Vec<[f32; 3]> {
        let relative = |(pixel, rgb): (usize, &[f32; 3])| {
            // What lies behind a picture with alpha adds the rest of the display's black.
            let uncovered = self.coverage.premultiplied().map_or(0.0, |alpha| 1.0 - f64::from(alpha[pixel]));
            let behind_cd_m2 = uncovered * display.black_cd_m2;
            rgb.map(|value| display.relative_of_emitted(f64::from(value) * nits_per_unit + behind_cd_m2) as f32)
        };
        self.rgb.iter().enumerate().map(relative).collect()
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
    pub(super) fn stored_rgb(&self) -> &[[f32; 3]] {
        &self.rgb
    }

    /// The values as bytes, R′G′B′ after R′G′B′: of a picture that is ready for the display.
    pub(super) fn codes8(&self) -> Vec<u8> {
        let byte = |code: f32| (255.0 * code.clamp(0.0, 1.0)).round() as u8;
        self.rgb.iter().flat_map(|rgb| rgb.map(byte)).collect()
    }

    /// Luminance in cd/m² that the display sends to the eye, of the colours that it shows: those that it clips too.
    /// Scenes are brought there with the operator's loss of acuity, or by `map_pixels` without it: for an eye behind
    /// it.
    pub(super) fn displayed(&self, tone: Option<&dyn FittedTone>, viewing: &Viewing, map: Mapping) -> Plane {
        self.luminance_of(&self.relative_rgb(tone, &viewing.display, map), &viewing.display)
    }

    /// Linear RGB in cd/m² of the same colours.
    pub(super) fn displayed_rgb_by(
        &self,
        tone: Option<&dyn FittedTone>,
        viewing: &Viewing,
        map: Mapping,
    ) -> Vec<[f32; 3]> {
        viewing.display.rgb_cd_m2(&self.relative_rgb(tone, &viewing.display, map))
    }

    fn luminance_of(&self, relative: &[[f32; 3]], display: &Display) -> Plane {
        Plane::from_fn(self.width, self.height, |x, y| {
            // What a channel has beyond the display's black and white is not seen.
            let shown = relative[y * self.width + x].map(|light| light.clamp(0.0, 1.0));
            display.luminance_cd_m2(f64::from(luminance(shown))) as f32
        })
    }
}

/// Light of other primaries, 0 to 1, in those of Rec.709: what they do not reach is brought in at the luminance that it
/// has.
fn in_rec709(light: Vec<[f32; 3]>, primaries: &Primaries) -> Vec<[f32; 3]> {
    let Some(matrix) = primaries.to_other(&Primaries::REC709) else { return light };
    let inside = |rgb: [f32; 3]| gamut::fit_into_display(apply(&matrix, rgb.map(f64::from)).map(|value| value as f32));
    light.into_iter().map(inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner_perception::tone::map_pixels;

    /// P3's and Rec.2020's primaries under the curve of sRGB. Regression: with their negative channels cut off they
    /// were 14 to 35 % too bright.
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
        output::write_png_for(&file, &output::DisplayedPicture::opaque((4, 1), &light), &viewing.display)
            .expect("written");
        let picture = InputPicture::read(&file, None).expect("read");
        let cd_m2 = |relative: f32| viewing.display.luminance_cd_m2(f64::from(relative)) as f32;
        let close = |found: f32, meant: f32| assert!((found - meant).abs() < 2e-3 * meant, "{found}, not {meant}");
        for (found, meant) in picture.displayed_rgb(None, &viewing).iter().flatten().zip(light.iter().flatten()) {
            // The darkest channel of a saturated colour is a small difference of large ones.
            if *meant == 0.0 || *meant > 0.05 {
                close(*found, cd_m2(*meant));
            }
        }
        let displayed = picture.displayed(None, &viewing, map_pixels);
        light.iter().enumerate().for_each(|(x, rgb)| close(displayed.get(x, 0), cd_m2(luminance(*rgb))));
    }

    /// Codes of 16 bits without a tag have an alpha as those of sRGB, and lie before black. Regression: with black
    /// they were seen in full light.
    #[test]
    fn codes_of_any_curve_lie_before_black() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.png");
        let pixels = [[65_535, 32_768, 0, 16_384], [65_535, 65_535, 65_535, 0], [20_000, 20_000, 20_000, 65_535_u16]];
        let image = image::ImageBuffer::<image::Rgba<u16>, _>::from_raw(3, 1, pixels.concat()).expect("three pixels");
        image.save(&file).expect("written");
        let viewing = Viewing::of(Display { eotf: Eotf::Linear, ..Display::default() });
        let shown = InputPicture::read(&file, None).expect("read").displayed_rgb(None, &viewing);
        for (shown, [codes @ .., alpha]) in shown.iter().zip(pixels) {
            for (shown, code) in shown.iter().zip(codes) {
                let light = f64::from(code) / 65_535.0 * f64::from(alpha) / 65_535.0;
                let meant = viewing.display.luminance_cd_m2(light) as f32;
                assert!((shown - meant).abs() < 1e-3 * meant, "{shown}, not {meant}");
            }
        }
    }
}
