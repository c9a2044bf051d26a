//! Displays from TOML files.

use serde::Deserialize;

use super::{Display, Eotf, pixels_per_degree};
use crate::error::Error;

/// What errors are of.
const WHAT: &str = "display file";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DisplayFile {
    name: Option<String>,
    preset: Option<String>,
    pixels_per_degree: Option<f64>,
    pixel_aspect_ratio: Option<f64>,
    width_px: Option<f64>,
    width_m: Option<f64>,
    white_cd_m2: Option<f64>,
    black_cd_m2: Option<f64>,
    ambient_cd_m2: Option<f64>,
    eotf: Option<Eotf>,
    distance_m: Option<f64>,
    csf_area_deg2: Option<f64>,
    frames_per_second: Option<f64>,
    persistence: Option<f64>,
}

/// How a file says how many pixels a degree has.
enum Density {
    /// As the file's preset has it.
    Preset,
    /// By the number of pixels a degree itself.
    Stated(f64),
    /// By the screen's width and distance.
    Follows { width_px: f64, width_m: f64, distance_m: f64 },
}

impl DisplayFile {
    fn read(text: &str) -> Result<Self, Error> {
        toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| 1 + text[..span.start].matches('\n').count());
            Error::Parse { what: WHAT, line, reason: error.message().trim_end().replace('\n', "; ") }
        })
    }

    fn base(&self) -> Result<Display, Error> {
        let preset = self.preset.as_deref().unwrap_or("desktop");
        let mut base = Display::named(preset)?;
        if self.preset.is_none() {
            "file".clone_into(&mut base.name);
        }
        Ok(base)
    }

    fn density(&self, distance_m: Option<f64>) -> Result<Density, Error> {
        match (self.pixels_per_degree, self.width_px, self.width_m, distance_m) {
            (None, None, None, None) => Ok(Density::Preset),
            (Some(pixels_per_degree), None, None, _) => Ok(Density::Stated(pixels_per_degree)),
            (None, Some(width_px), Some(width_m), Some(distance_m)) => {
                Ok(Density::Follows { width_px, width_m, distance_m })
            }
            (Some(_), ..) => Err(wrong(
                "`pixels_per_degree` follows from `width_px`, `width_m` and `distance_m`: give it or the widths, not both",
            )),
            (None, None, None, Some(_)) => Err(wrong(
                "`distance_m` alone does not say how many pixels a degree has: give `pixels_per_degree` beside it, or \
                 `width_px` and `width_m`",
            )),
            _ => Err(wrong(
                "pixels a degree follow from `width_px`, `width_m` and `distance_m` together: give all three, or \
                 `pixels_per_degree`",
            )),
        }
    }
}

fn wrong(reason: impl Into<String>) -> Error {
    Error::Parse { what: WHAT, line: None, reason: reason.into() }
}

impl Display {
    /// Reads a display file: a TOML table whose keys are the fields of [`Display`], all optional.
    ///
    /// `preset` names the display that fills what is left out (`desktop` if absent). A file without a `name` is
    /// called as its preset, "desktop, changed" where it differs from that, and "file" without one. Instead of
    /// `pixels_per_degree` a file may give `width_px`, `width_m` and `distance_m`.
    ///
    /// ```
    /// use fechner_perception::Display;
    /// let mine = Display::from_toml("name = 'mine'\nwidth_px = 1920\nwidth_m = 0.531\ndistance_m = 0.6").unwrap();
    /// assert!((mine.pixels_per_degree - 37.9).abs() < 0.1);
    /// ```
    ///
    /// # Errors
    /// [`Error::Parse`] for what is no TOML or has unknown keys, [`Error::UnknownName`] for an unknown preset and
    /// [`Error::OutOfRange`] for values that no display has.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let file = DisplayFile::read(text)?;
        let base = file.base()?;
        let distance_m = file.distance_m.or(base.distance_m);
        let mut display = Self {
            pixels_per_degree: match file.density(distance_m)? {
                Density::Preset => base.pixels_per_degree,
                Density::Stated(stated) => stated,
                Density::Follows { width_px, width_m, distance_m } => pixels_per_degree(width_px, width_m, distance_m)?,
            },
            name: base.name.clone(),
            pixel_aspect_ratio: file.pixel_aspect_ratio.unwrap_or(base.pixel_aspect_ratio),
            white_cd_m2: file.white_cd_m2.unwrap_or(base.white_cd_m2),
            black_cd_m2: file.black_cd_m2.unwrap_or(base.black_cd_m2),
            ambient_cd_m2: file.ambient_cd_m2.unwrap_or(base.ambient_cd_m2),
            eotf: file.eotf.unwrap_or(base.eotf),
            distance_m,
            csf_area_deg2: file.csf_area_deg2.or(base.csf_area_deg2),
            frames_per_second: file.frames_per_second.unwrap_or(base.frames_per_second),
            persistence: file.persistence.unwrap_or(base.persistence),
        };
        display.check()?;
        display.name = match file.name {
            Some(name) => name,
            // Beside the preset itself two displays of one name would be told apart by nobody.
            None if file.preset.is_some() && display != base => format!("{}, changed", base.name),
            None => base.name,
        };
        Ok(display)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_files_say_what_would_be_right() {
        let error = |text: &str| Display::from_toml(text).unwrap_err().to_string();
        assert!(error("distance_m = 0.6").contains("`distance_m` alone"));
        assert!(error("pixels_per_degree = 60.0\nwidth_px = 1920").contains("not both"));
        assert!(error("width_px = 1920").contains("give all three"));
        let bright = error("eotf = 'pq'\nwhite_cd_m2 = 20000.0");
        assert!(bright.contains("white_cd_m2") && bright.contains("10000"), "{bright}");
        assert!(Display::from_toml("eotf = 'pq'\nwhite_cd_m2 = 10000.0").is_ok());
    }

    #[test]
    fn bad_files_say_why() {
        assert!(matches!(Display::from_toml("white_cd_m2 = -5"), Err(Error::OutOfRange { .. })));
        let even = Display::from_toml("white_cd_m2 = 100\nblack_cd_m2 = 100");
        assert!(even.unwrap_err().to_string().contains("below white_cd_m2"));
        assert!(matches!(Display::from_toml("colour = 'red'"), Err(Error::Parse { line: Some(1), .. })));
        let curve = Display::from_toml("preset = 'desktop'\neotf = 'gamma22'").unwrap_err();
        assert!(matches!(curve, Error::Parse { line: Some(2), .. }), "{curve:?}");
        assert!(curve.to_string().starts_with("display file, line 2: unknown variant `gamma22`"), "{curve}");
        assert!(matches!(Display::from_toml("preset = 'wall'"), Err(Error::UnknownName { .. })));
        assert!(matches!(Display::from_toml("width_px = 1920"), Err(Error::Parse { .. })));
        assert!(matches!(Display::from_toml("preset = 'desktop'\ndistance_m = 1.2"), Err(Error::Parse { .. })));
        let phone = Display::from_toml("preset = 'phone'\nwhite_cd_m2 = 700").unwrap();
        assert_eq!((phone.white_cd_m2, phone.pixels_per_degree), (700.0, 90.0));
    }

    /// A display that is not the preset has not its name. Regression: messages said that "desktop" is not as bright as
    /// "desktop".
    #[test]
    fn a_changed_preset_is_called_so() {
        let name = |text: &str| Display::from_toml(text).unwrap().name;
        assert_eq!(name("preset = 'phone'\nwhite_cd_m2 = 700"), "phone, changed");
        assert_eq!(name("preset = 'phone'"), "phone");
        assert_eq!(name("preset = 'phone'\nwhite_cd_m2 = 500"), "phone");
        assert_eq!(name("preset = 'phone'\nname = 'mine'\nwhite_cd_m2 = 700"), "mine");
        assert_eq!(name("white_cd_m2 = 100"), "file");
    }
}
