//! Arguments that say who looks at what. What they see is left to the perception crate.

use super::kept_tone::first_scene;
use super::numbers::{parse_positive, parse_unit};
use super::picture::InputPicture;
use super::targets::{Named, display_file};
use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use fechner::read_file;
use fechner::scene::Scene;
use fechner::scene::load::count_as_read;
use fechner_perception::display::{Display, Viewing};
use fechner_perception::model::{self, ThresholdModel};
use fechner_perception::tone::{self, DEFAULT_OPERATOR};
use fechner_perception::{Error, csf};
use std::path::Path;

/// The display where none is named.
pub(super) const DEFAULT_DISPLAY: &str = "desktop";

/// How a scene is shown: command line before scene before default.
#[derive(Clone, Copy, Debug)]
pub(super) struct Presentation<'a> {
    /// Name or file of the display.
    pub(super) display: &'a str,
    /// Name of the tone operator.
    pub(super) operator: &'a str,
    /// Exposure correction; `None` where nobody asked for one.
    pub(super) exposure_stops: Option<f64>,
}

/// What of [`Presentation`] the command line says.
#[derive(Clone, Copy, Debug)]
pub(super) struct AskedPresentation<'a> {
    pub(super) display: Option<&'a str>,
    pub(super) operator: Option<&'a str>,
    pub(super) exposure_stops: Option<f64>,
}

impl<'a> AskedPresentation<'a> {
    /// What is left open as the scene has it.
    pub(super) fn of_scene(self, scene: &'a Scene) -> Presentation<'a> {
        let view = &scene.viewing;
        Presentation {
            display: self.display.or(view.display.as_deref()).unwrap_or(DEFAULT_DISPLAY),
            operator: self.operator.or(view.operator.as_deref()).unwrap_or(DEFAULT_OPERATOR),
            exposure_stops: self.exposure_stops.or(view.exposure_stops),
        }
    }
}

/// Display, observer and units, for commands that judge pictures.
#[derive(Debug, Args)]
pub(super) struct SeeingArguments {
    #[arg(long, value_name = "NAME|FILE", help = display_help(
        "the one that the first picture whose file says so was made for; else hdr-1000, if one is in PQ; else desktop",
    ))]
    display: Option<String>,
    /// Contrast sensitivity function.
    #[arg(long, value_name = "NAME", default_value = csf::DEFAULT, value_parser = PossibleValuesParser::new(csf::names()))]
    pub(super) csf: String,
    /// Area in deg² over which the eye sums contrast [default: the display's, else 1].
    #[arg(long, value_name = "DEG2", value_parser = parse_positive, allow_negative_numbers = true)]
    csf_area: Option<f64>,
    /// Luminance in cd/m² of RGB (1, 1, 1), for files that do not say it.
    #[arg(long, value_name = "CD_M2", value_parser = parse_unit, allow_negative_numbers = true)]
    pub(super) nits_per_unit: Option<f64>,
}

impl SeeingArguments {
    /// The file that describes the display, if any.
    pub(super) fn display_file(&self) -> Named<'_> {
        display_file(self.display.as_deref())
    }

    /// Says which pictures hold light of a display, and which arguments change nothing of pictures that are all ready
    /// for it.
    pub(super) fn note_what_is_ready(&self, operator: Option<&str>, pictures: &[(&Path, &InputPicture)]) {
        for (path, _) in pictures.iter().filter(|(_, picture)| picture.holds_emitted_light()) {
            say!("note: {} holds light of a display, and is shown as it is", path.display());
        }
        let Some((path, _)) = pictures.first().filter(|_| first_scene(pictures).is_none()) else { return };
        let is_asked = [("--operator", operator.is_some()), ("--nits-per-unit", self.nits_per_unit.is_some())];
        for (argument, _) in is_asked.iter().filter(|(_, is_asked)| *is_asked) {
            say!(
                "note: {argument} changes nothing: {} is ready for the display, and so is all that is seen beside it",
                path.display()
            );
        }
    }

    /// Says which of what was asked for the model does not look at, which may judge colours beside luminance.
    pub(super) fn note_what_is_idle(&self, model: &dyn ThresholdModel, judges_colours: bool) {
        if judges_colours {
            self.note_area_of_colours();
        } else if !model.knows_csf() {
            let is_asked = [("--csf", self.csf != csf::DEFAULT), ("--csf-area", self.csf_area.is_some())];
            for (argument, _) in is_asked.iter().filter(|(_, is_asked)| *is_asked) {
                say!("note: {argument} changes nothing: the model {} does not ask for it", model.name());
            }
        } else if self.csf_area.is_some() && !csf::knows_area(&self.csf) {
            say!("note: --csf-area changes nothing: {} is of no area", self.csf);
        }
    }

    /// Says of what is judged by three channels that the CSF asked for has no area.
    pub(super) fn note_area_of_colours(&self) {
        if self.csf_area.is_some() && !csf::knows_area(&self.csf) {
            say!("note: --csf-area changes only what is seen of colours: {} is of no area", self.csf);
        }
    }

    /// The viewing of pictures that they mean.
    pub(super) fn viewing(&self, pictures: &[(&Path, &InputPicture)]) -> Result<Viewing> {
        viewing_on(display_of(self.display.as_deref(), pictures)?, self.csf_area)
    }
}

/// The viewing for a display's name or file and, where given, a contrast sensitivity area in deg².
pub(super) fn viewing(display: &str, csf_area_deg2: Option<f64>) -> Result<Viewing> {
    viewing_on(find_display(display)?, csf_area_deg2)
}

/// The viewing of a picture that is to be rendered: of square pixels, as cameras draw them and files are tagged.
pub(super) fn viewing_of_render(display: &str, csf_area_deg2: Option<f64>) -> Result<Viewing> {
    let viewing = viewing(display, csf_area_deg2)?;
    let Display { name, pixel_aspect_ratio, .. } = &viewing.display;
    if (pixel_aspect_ratio - 1.0).abs() > 1e-6 {
        bail!(
            "the display \"{name}\" has pixels {pixel_aspect_ratio} times as wide as high, and what is rendered has square ones: render for \
             a display of square pixels (pixel_aspect_ratio = 1); compare, threshold and tonemap take any"
        );
    }
    Ok(viewing)
}

/// The display that was asked for, else the one that the first of the pictures that says so was made for, else a likely
/// one: what a file says goes before what another's codes only suggest, whichever is named first.
pub(super) fn display_of(asked: Option<&str>, pictures: &[(&Path, &InputPicture)]) -> Result<Display> {
    if let Some(name) = asked {
        return find_display(name);
    }
    let said = pictures.iter().find_map(|(_, picture)| picture.made_for()).cloned();
    let likely = || pictures.iter().find_map(|(_, picture)| picture.likely_display());
    Ok(said.or_else(likely).unwrap_or_default())
}

/// The viewing on a display.
pub(super) fn viewing_on(display: Display, csf_area_deg2: Option<f64>) -> Result<Viewing> {
    let mut viewing = Viewing::of(display);
    if let Some(area) = csf_area_deg2 {
        viewing.observer.csf_area_deg2 = area;
    }
    viewing.check().context("--display and --csf-area")?;
    Ok(viewing)
}

/// What `--display` takes, for help.
pub(super) fn display_help(default: &str) -> String {
    format!("Display: a preset ({}) or a TOML file [default: {default}]", Display::preset_names().join(", "))
}

fn find_display(name: &str) -> Result<Display> {
    match Display::named(name) {
        Err(_) if name.ends_with(".toml") => {}
        Err(unknown) => bail!("{unknown}, or a .toml file"),
        Ok(display) => return Ok(display),
    }
    let text = read_file::text(Path::new(name)).with_context(|| format!("display file {name}"))?;
    count_as_read(Path::new(name));
    Display::from_toml(&text).map_err(|error| in_display_file(name, &text, error))
}

/// What is wrong with a display's file, said as of a scene's: "my.toml:2: …".
fn in_display_file(name: &str, text: &str, error: Error) -> anyhow::Error {
    let line_of = |key: &str| text.lines().position(|line| line.trim_start().starts_with(key)).map(|line| line + 1);
    match error {
        Error::OutOfRange { what, .. } if let Some(line) = line_of(what) => anyhow!("{name}:{line}: {error}"),
        Error::Parse { line: Some(line), reason, .. } => anyhow!("{name}:{line}: {reason}"),
        Error::Parse { reason, .. } => anyhow!("{name}: {reason}"),
        other => anyhow!("{name}: {other}"),
    }
}

/// Names of threshold models.
pub(super) fn model_values() -> PossibleValuesParser {
    PossibleValuesParser::new(model::names())
}

/// Names and initials of tone operators.
pub(super) fn operator_values() -> PossibleValuesParser {
    PossibleValuesParser::new(named_operators())
}

/// Names and initials of tone operators, and "all".
pub(super) fn operator_values_or_all() -> PossibleValuesParser {
    PossibleValuesParser::new(named_operators().chain([PossibleValue::new("all")]))
}

fn named_operators() -> impl Iterator<Item = PossibleValue> {
    tone::operator_names().iter().map(|&name| {
        let initials = tone::operator_initials().iter().filter(move |(_, full)| *full == name);
        PossibleValue::new(name).aliases(initials.map(|(initials, _)| *initials))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the message was "display file d.toml: display file: TOML parse error at line 2, column 6; …".
    #[test]
    fn a_wrong_display_file_is_named_once_and_by_its_line() {
        let said = |text: &str| in_display_file("d.toml", text, Display::from_toml(text).expect_err(text)).to_string();
        let curve = said("preset = 'desktop'\neotf = 'gamma22'\n");
        assert!(curve.starts_with("d.toml:2: unknown variant `gamma22`, expected "), "{curve}");
        assert!(said("white_cd_m2 = -5").starts_with("d.toml:1: white_cd_m2 is -5; "));
        assert!(said("width_px = 1920").starts_with("d.toml: pixels a degree follow from"));
    }
}
