//! The display, and who looks at it from where.
//!
//! A display is as fine to the eye everywhere as at its centre. Not for flat screens that fill the view: pixels are
//! finer to the eye towards their rim.

mod file;

use serde::{Deserialize, Serialize};

use crate::csf::check_area_deg2;
pub use crate::eotf::Eotf;
use crate::eotf::PQ_PEAK_CD_M2;
use crate::error::{Error, check_range};
pub use crate::pixel_density::PixelDensity;
pub use crate::viewing::{Glare, Observer, Viewing};

/// A display at its viewing distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Display {
    /// The display's name in reports.
    pub name: String,
    /// Pixels a degree of visual angle along a row, at the centre: 2 d tan(0.5°) / pixel pitch.
    pub pixels_per_degree: f64,
    /// Width of a pixel over its height (as in an EXR's `pixelAspectRatio`): 1 for square pixels. `pixels_per_degree`
    /// is counted along the rows; along the columns there are this many times as many.
    #[serde(default = "square")]
    pub pixel_aspect_ratio: f64,
    /// Luminance of full white, cd/m².
    pub white_cd_m2: f64,
    /// Luminance of full black in a dark room, cd/m².
    pub black_cd_m2: f64,
    /// Room light reflected by the screen, cd/m², added to everything it shows.
    pub ambient_cd_m2: f64,
    /// Transfer function between code values and light.
    pub eotf: Eotf,
    /// Viewing distance in metres, where known: some contrast sensitivity functions depend on it.
    pub distance_m: Option<f64>,
    /// Contrast sensitivity area this display asks for, deg²; `None` leaves the observer's.
    pub csf_area_deg2: Option<f64>,
    /// New frames a second that the display shows of a moving picture.
    pub frames_per_second: f64,
    /// Share of a frame's time that a pixel is lit: 1 for sample-and-hold, towards 0 for a strobed display.
    pub persistence: f64,
}

fn square() -> f64 {
    1.0
}

struct Preset {
    name: &'static str,
    pixels_per_degree: f64,
    white_cd_m2: f64,
    black_cd_m2: f64,
    eotf: Eotf,
    csf_area_deg2: Option<f64>,
}

const fn preset(name: &'static str, pixels_per_degree: f64, white_cd_m2: f64, black_cd_m2: f64) -> Preset {
    Preset { name, pixels_per_degree, white_cd_m2, black_cd_m2, eotf: Eotf::Srgb, csf_area_deg2: None }
}

const PRESETS: [Preset; 8] = [
    preset("desktop", 60.0, 200.0, 0.2),
    preset("fullhd", 38.0, 200.0, 0.2),
    preset("laptop", 80.0, 300.0, 0.3),
    Preset { eotf: Eotf::Bt1886, ..preset("uhd-tv", 110.0, 300.0, 0.05) },
    preset("phone", 90.0, 500.0, 0.05),
    Preset { eotf: Eotf::Bt1886, ..preset("cinema", 50.0, 48.0, 0.02) },
    Preset { eotf: Eotf::Pq, ..preset("hdr-1000", 60.0, 1000.0, 0.005) },
    Preset { csf_area_deg2: Some(7.0), ..preset("strict", 30.0, 400.0, 0.1) },
];

const PRESET_NAMES: [&str; 8] = {
    let mut names = [""; 8];
    let mut index = 0;
    while index < PRESETS.len() {
        names[index] = PRESETS[index].name;
        index += 1;
    }
    names
};

impl Default for Display {
    /// The preset `desktop`: 60 pixels a degree, white 200 cd/m², black 0.2 cd/m².
    fn default() -> Self {
        Self::from_preset(&PRESETS[0])
    }
}

impl Display {
    /// The preset of that name, a display that everybody has a name for; `None` where there is none; see
    /// [`Display::preset_names`].
    ///
    /// ```
    /// use fechner_perception::Display;
    /// assert_eq!(Display::preset("desktop").unwrap().pixels_per_degree, 60.0);
    /// assert!(Display::preset("television of 1936").is_none());
    /// ```
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        PRESETS.iter().find(|preset| preset.name == name).map(Self::from_preset)
    }

    /// The preset of a name that somebody has given: [`Display::preset`], with an error instead of `None`.
    ///
    /// # Errors
    /// [`Error::UnknownName`], which lists those that there are.
    pub fn named(name: &str) -> Result<Self, Error> {
        Self::preset(name).ok_or_else(|| Error::unknown_name("display preset", name, Self::preset_names()))
    }

    /// The names that [`Display::preset`] knows.
    #[must_use]
    pub fn preset_names() -> &'static [&'static str] {
        &PRESET_NAMES
    }

    fn from_preset(preset: &Preset) -> Self {
        Self {
            name: preset.name.to_owned(),
            pixels_per_degree: preset.pixels_per_degree,
            pixel_aspect_ratio: square(),
            white_cd_m2: preset.white_cd_m2,
            black_cd_m2: preset.black_cd_m2,
            ambient_cd_m2: 0.0,
            eotf: preset.eotf,
            distance_m: None,
            csf_area_deg2: preset.csf_area_deg2,
            frames_per_second: 60.0,
            persistence: 1.0,
        }
    }

    /// Pixels a degree along both axes.
    ///
    /// ```
    /// use fechner_perception::Display;
    /// let anamorphic = Display { pixel_aspect_ratio: 2.0, ..Display::default() };
    /// assert_eq!(anamorphic.pixel_density().vertical, 120.0);
    /// ```
    #[must_use]
    pub fn pixel_density(&self) -> PixelDensity {
        let horizontal = self.pixels_per_degree;
        PixelDensity { horizontal, vertical: horizontal * self.pixel_aspect_ratio }
    }

    /// Luminance, cd/m², of a mid grey, at which contrast sensitivity is taken where it has to be one for all of the
    /// picture.
    #[must_use]
    pub fn grey_cd_m2(&self) -> f64 {
        0.2 * self.white_cd_m2
    }

    /// Luminance, cd/m², that this display shows for linear light `relative` (clamped to 0..1; NaN counts as 0):
    /// black + ambient + (white − black) · relative.
    #[must_use]
    pub fn luminance_cd_m2(&self, relative: f64) -> f64 {
        self.emitted_cd_m2(relative) + self.ambient_cd_m2
    }

    /// Linear RGB, cd/m², that this display shows for linear light of each channel: what
    /// [`luminance_cd_m2`](Self::luminance_cd_m2) says of each.
    #[must_use]
    pub fn rgb_cd_m2(&self, relative: &[[f32; 3]]) -> Vec<[f32; 3]> {
        relative.iter().map(|rgb| rgb.map(|light| self.luminance_cd_m2(f64::from(light)) as f32)).collect()
    }

    /// Luminance, cd/m², that this display itself emits for linear light `relative` (clamped to 0..1; NaN counts as 0):
    /// [`Display::luminance_cd_m2`] without what the screen reflects of the room's light.
    #[must_use]
    pub fn emitted_cd_m2(&self, relative: f64) -> f64 {
        let light = if relative.is_nan() { 0.0 } else { relative.clamp(0.0, 1.0) };
        self.black_cd_m2 + (self.white_cd_m2 - self.black_cd_m2) * light
    }

    /// Linear display RGB, 0 the display's black and 1 its white, of a code value (clamped to 0..1; NaN counts as 0)
    /// that the display gets as it is. With [`Eotf::Bt1886`] a code V is emitted as a (V + b)^2.4, where white and
    /// black decide a and b (Recommendation ITU-R BT.1886, annex 1); with [`Eotf::Pq`] as the luminance that it
    /// means, as far as the display reaches; with others the curve lies between black and white.
    ///
    /// ```
    /// use fechner_perception::Display;
    /// let tv = Display::preset("uhd-tv").unwrap();
    /// // Of a white of 300 and a black of 0.05 cd/m².
    /// assert!((tv.emitted_cd_m2(tv.light_of_code(0.05)) - 0.605).abs() < 1e-3);
    /// ```
    #[must_use]
    pub fn light_of_code(&self, code: f64) -> f64 {
        let code = if code.is_nan() { 0.0 } else { code.clamp(0.0, 1.0) };
        match self.eotf {
            Eotf::Bt1886 => {
                let [white, black] = [self.white_cd_m2, self.black_cd_m2].map(|cd_m2| cd_m2.powf(1.0 / 2.4));
                // a (V + b)^2.4 with the root of a taken into the bracket.
                self.relative_of_emitted((code * (white - black) + black).powf(2.4)).clamp(0.0, 1.0)
            }
            Eotf::Pq => {
                let cd_m2 = Eotf::Pq.decode(code, PQ_PEAK_CD_M2) * PQ_PEAK_CD_M2;
                self.relative_of_emitted(cd_m2).clamp(0.0, 1.0)
            }
            Eotf::Srgb | Eotf::Linear => self.eotf.decode(code, self.white_cd_m2),
        }
    }

    /// Linear display light that is emitted as `cd_m2` cd/m²: the inverse of [`Display::emitted_cd_m2`], 0 at black and
    /// 1 at white, beyond them where the display cannot reach it.
    #[must_use]
    pub fn relative_of_emitted(&self, cd_m2: f64) -> f64 {
        (cd_m2 - self.black_cd_m2) / (self.white_cd_m2 - self.black_cd_m2).max(1e-6)
    }

    /// Rejects a display with a field outside its range.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], naming the field.
    pub fn check(&self) -> Result<(), Error> {
        const PPD: &str = "between 1 and 1000 pixels per degree";
        const LIGHT: &str = "between 0 and 1e8 cd/m²";
        check_range("pixels_per_degree", self.pixels_per_degree, 1.0, 1000.0, PPD)?;
        check_range("pixel_aspect_ratio", self.pixel_aspect_ratio, 0.1, 10.0, "between 0.1 and 10")?;
        check_range("white_cd_m2", self.white_cd_m2, 1e-3, 1e8, "between 0.001 and 1e8 cd/m²")?;
        if self.eotf == Eotf::Pq {
            check_range("white_cd_m2", self.white_cd_m2, 1e-3, PQ_PEAK_CD_M2, "at most 10000 cd/m² with the pq curve")?;
        }
        check_range(
            "black_cd_m2",
            self.black_cd_m2,
            0.0,
            self.white_cd_m2.next_down(),
            "at least 0 and below white_cd_m2",
        )?;
        check_range("ambient_cd_m2", self.ambient_cd_m2, 0.0, 1e8, LIGHT)?;
        check_range("frames_per_second", self.frames_per_second, 1.0, 1e3, "between 1 and 1000")?;
        check_range("persistence", self.persistence, 0.0, 1.0, "between 0 and 1")?;
        if let Some(distance_m) = self.distance_m {
            check_range("distance_m", distance_m, 0.01, 1000.0, "between 0.01 and 1000 m")?;
        }
        if let Some(area) = self.csf_area_deg2 {
            check_area_deg2("csf_area_deg2", area)?;
        }
        Ok(())
    }
}

/// Pixels a degree at the centre of a flat display: 2 d tan(0.5°) / pitch.
///
/// # Errors
/// [`Error::OutOfRange`] for sizes and distances that are not positive and finite.
pub fn pixels_per_degree(width_px: f64, width_m: f64, distance_m: f64) -> Result<f64, Error> {
    const POSITIVE: &str = "positive and finite";
    check_range("width_px", width_px, 1.0, 1e6, "between 1 and 1000000 pixels")?;
    check_range("width_m", width_m, f64::MIN_POSITIVE, f64::MAX, POSITIVE)?;
    check_range("distance_m", distance_m, f64::MIN_POSITIVE, f64::MAX, POSITIVE)?;
    Ok(2.0 * distance_m * 0.5_f64.to_radians().tan() * width_px / width_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_possible_display() {
        for name in Display::preset_names() {
            let display = Display::preset(name).unwrap();
            assert_eq!(&display.name, name);
            display.check().unwrap();
        }
    }

    #[test]
    fn geometry_of_known_screens() {
        // 24 in 1920×1080 at 0.6 m, 27 in 3840×2160 at 0.6 m.
        assert!((pixels_per_degree(1920.0, 0.531_36, 0.6).unwrap() - 37.843).abs() < 0.01);
        assert!((pixels_per_degree(3840.0, 0.597_7, 0.6).unwrap() - 67.277).abs() < 0.02);
        assert!(pixels_per_degree(1920.0, 0.0, 0.6).is_err());
    }

    #[test]
    fn luminance_spans_black_to_white() {
        let display = Display { ambient_cd_m2: 1.0, ..Display::default() };
        assert_eq!(display.luminance_cd_m2(-1.0), 1.2);
        assert_eq!(display.luminance_cd_m2(f64::NAN), 1.2);
        assert!((display.luminance_cd_m2(7.0) - 201.0).abs() < 1e-9);
    }

    /// BT.1886 lifts its curve by the display's black. Regression: code 0.05 came out as 0.28 cd/m² on a television
    /// that shows 0.61.
    #[test]
    fn codes_are_shown_from_black_to_white() {
        for name in Display::preset_names() {
            let display = Display::preset(name).unwrap();
            assert!(display.light_of_code(f64::NAN).abs() < 1e-9 && (display.light_of_code(7.0) - 1.0).abs() < 1e-9);
            let steps: Vec<f64> = (0..=100).map(|step| display.light_of_code(f64::from(step) / 100.0)).collect();
            assert!(steps.windows(2).all(|pair| pair[1] >= pair[0]), "{name}: {steps:?}");
        }
        let emitted = |name: &str, code: f64| {
            let display = Display::preset(name).unwrap();
            display.emitted_cd_m2(display.light_of_code(code))
        };
        // a (V + b)^2.4 of the recommendation, by its own two formulas for a and b.
        for (name, white, black) in [("uhd-tv", 300.0_f64, 0.05_f64), ("cinema", 48.0, 0.02)] {
            let [white_root, black_root] = [white, black].map(|cd_m2| cd_m2.powf(1.0 / 2.4));
            let (a, b) = ((white_root - black_root).powf(2.4), black_root / (white_root - black_root));
            for code in [0.0, 0.05, 0.1, 0.5, 1.0] {
                let meant = a * (code + b).powf(2.4);
                assert!((emitted(name, code) / meant - 1.0).abs() < 1e-9, "{name}, {code}: not {meant}");
            }
        }
        // ST 2084: code 0.508 is 100 cd/m².
        assert!((emitted("hdr-1000", 0.508_078) - 100.0).abs() < 0.01);
    }
}
