//! How a picture was shown when it was rendered, as its file says: what `compare`, `threshold` and `tonemap` show is
//! what the render judged, with its operator and its exposure. Not for files of other programs, which do not say it.

use super::picture::InputPicture;
use anyhow::Result;
use fechner::exr_read::ExrImage;
use fechner::output::{Attribute, attribute};
use fechner_perception::Plane;
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone::{self, DEFAULT_OPERATOR, FittedTone, SavedTone, SceneGuide, ToneSettings};
use std::path::Path;

/// What `tonemap` says of its EXR files, and its value there: they hold light of a display, by a fit that has done its
/// work.
pub(super) const LIGHT: &str = "fechner.light";
pub(super) const OF_DISPLAY: &str = "display";

/// What brings a picture to the display as it was when it was made.
pub(super) enum KeptTone {
    /// The picture of a render, with its tone.
    Rendered(Box<RenderTone>),
    /// Nothing: it is of a display.
    Displayed,
}

/// The operator as fitted by a render, and the display that it was fitted for.
pub(super) struct RenderTone {
    fitted: SavedTone,
    display: String,
    /// White, black, and the room's light on the screen.
    luminances_cd_m2: [f32; 3],
}

impl KeptTone {
    /// The tone that an EXR file keeps; `None` for files that do not say it.
    pub(super) fn of(exr: &ExrImage) -> Option<Self> {
        if text(exr, LIGHT) == Some(OF_DISPLAY) {
            return Some(Self::Displayed);
        }
        text(exr, attribute::SCENE)?;
        Some(Self::Rendered(Box::new(RenderTone {
            fitted: serde_json::from_str(text(exr, attribute::TONE)?).ok()?,
            display: text(exr, attribute::OBSERVER_DISPLAY)?.to_owned(),
            luminances_cd_m2: [
                number(exr, attribute::OBSERVER_WHITE_CD_M2)?,
                number(exr, attribute::OBSERVER_BLACK_CD_M2)?,
                number(exr, attribute::OBSERVER_AMBIENT_CD_M2)?,
            ],
        })))
    }

    /// The operator, if it was fitted for a display as bright and as dark as this one.
    pub(super) fn on(&self, viewing: &Viewing) -> Option<Box<dyn FittedTone>> {
        match self {
            Self::Rendered(tone) => tone.is_for(&viewing.display).then(|| tone.fitted.clone().restore()),
            // It looks at no picture.
            Self::Displayed => {
                Some(tone::operator("absolute", None)?.fit(&SceneGuide::of(&Plane::filled(1, 1, 1.0)), viewing, None))
            }
        }
    }
}

impl RenderTone {
    fn is_for(&self, display: &Display) -> bool {
        let luminances = [display.white_cd_m2, display.black_cd_m2, display.ambient_cd_m2].map(|cd_m2| cd_m2 as f32);
        luminances == self.luminances_cd_m2
    }
}

fn text<'e>(exr: &'e ExrImage, name: &str) -> Option<&'e str> {
    match exr.attribute(name) {
        Some(Attribute::Text(text)) => Some(text),
        _ => None,
    }
}

fn number(exr: &ExrImage, name: &str) -> Option<f32> {
    match exr.attribute(name) {
        Some(Attribute::Float(number)) => Some(*number),
        _ => None,
    }
}

/// The display of a description, where it is one that can be.
fn described(description: &str) -> Option<Display> {
    serde_json::from_str(description).ok().filter(|display: &Display| display.check().is_ok())
}

/// What to say of a file whose description of its display is damaged.
pub(super) fn display_not_read(exr: &ExrImage) -> Option<String> {
    let description = text(exr, attribute::DISPLAY)?;
    let is_damaged = described(description).is_none();
    is_damaged.then(|| format!("its {} cannot be read, and is not looked at", attribute::DISPLAY))
}

/// The display that a file was made for: as the file has it, else, of an older or a damaged one, the preset that it
/// names, where that is still the same.
pub(super) fn display_in(exr: &ExrImage) -> Option<Display> {
    if let Some(display) = text(exr, attribute::DISPLAY).and_then(described) {
        return Some(display);
    }
    let preset = Display::preset(text(exr, attribute::OBSERVER_DISPLAY)?)?;
    let values = [
        (attribute::OBSERVER_PIXELS_PER_DEGREE, preset.pixels_per_degree),
        (attribute::OBSERVER_WHITE_CD_M2, preset.white_cd_m2),
        (attribute::OBSERVER_BLACK_CD_M2, preset.black_cd_m2),
        (attribute::OBSERVER_AMBIENT_CD_M2, preset.ambient_cd_m2),
    ];
    let is_same = |&(name, value): &(&str, f64)| number(exr, name).is_none_or(|said| said == value as f32);
    values.iter().all(is_same).then_some(preset)
}

/// The first picture that holds a scene's light: the one that an operator is fitted to.
pub(super) fn first_scene<'p>(pictures: &[(&'p Path, &'p InputPicture)]) -> Option<(&'p Path, &'p InputPicture)> {
    pictures.iter().copied().find(|(_, picture)| picture.holds_scene_light())
}

/// The operator by which the first of the pictures that holds a scene's light was shown when it was rendered. Says so,
/// or why not.
pub(super) fn as_rendered(pictures: &[(&Path, &InputPicture)], viewing: &Viewing) -> Option<Box<dyn FittedTone>> {
    let (path, picture) = first_scene(pictures)?;
    let kept = picture.kept_tone()?;
    let KeptTone::Rendered(tone) = kept else { return None };
    let path = path.display();
    let fitted = kept.on(viewing);
    match &fitted {
        Some(fitted) => {
            say!(
                "note: shown as {path} was when it was rendered, by {}; --operator shows it by another",
                fitted.describe()
            );
        }
        None => say!(
            "note: {path} was rendered for the display \"{}\", which is not as bright and dark as \"{}\": it is shown by {DEFAULT_OPERATOR}, \
             and not by the render's operator and exposure",
            tone.display,
            viewing.display.name
        ),
    }
    fitted
}

/// What brings the scene's light of pictures to the display: the operator that was asked for, fitted to the first of
/// them that holds such light; where none was, as that one was shown when it was rendered; else the default one, fitted
/// to it. `None` for pictures that are ready for the display.
pub(super) fn shown_by(
    asked: Option<&str>,
    pictures: &[(&Path, &InputPicture)],
    viewing: &Viewing,
) -> Result<Option<Box<dyn FittedTone>>> {
    if asked.is_none()
        && let Some(fitted) = as_rendered(pictures, viewing)
    {
        return Ok(Some(fitted));
    }
    let operator = tone::operator_named(asked.unwrap_or(DEFAULT_OPERATOR), &ToneSettings::default())?;
    Ok(first_scene(pictures).and_then(|(_, picture)| picture.fit(operator.as_ref(), viewing)))
}
