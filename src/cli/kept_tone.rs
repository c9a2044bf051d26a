//! How a picture was shown when it was rendered, as its file says: what `compare` and `threshold` see is what the render
//! judged, with its operator and its exposure.

use super::picture::InputPicture;
use super::seeing::{DEFAULT_OPERATOR, tone_operator};
use anyhow::Result;
use fechner::exr_read::ExrImage;
use fechner::output::{Attribute, TONE};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone::{FittedTone, SavedTone, ToneSettings};
use std::path::Path;

/// The operator as fitted by the render, and the display that it was fitted for.
pub(super) struct KeptTone {
    fitted: SavedTone,
    display: String,
    /// White, black, and the room's light on the screen.
    luminances_cd_m2: [f32; 3],
}

impl KeptTone {
    /// `None` for files that do not say it, those of `tonemap` among them: they hold light of the display, by a fit that has done its
    /// work.
    pub(super) fn of(exr: &ExrImage) -> Option<Self> {
        let text = |name: &str| match exr.attribute(name) {
            Some(Attribute::Text(text)) => Some(text.as_str()),
            _ => None,
        };
        let number = |name: &str| match exr.attribute(name) {
            Some(Attribute::Float(number)) => Some(*number),
            _ => None,
        };
        text("fechner.scene")?;
        Some(Self {
            fitted: serde_json::from_str(text(TONE)?).ok()?,
            display: text("fechner.observer.display")?.to_owned(),
            luminances_cd_m2: [
                number("fechner.observer.white_cd_m2")?,
                number("fechner.observer.black_cd_m2")?,
                number("fechner.observer.ambient_cd_m2")?,
            ],
        })
    }

    /// The operator, if it was fitted for a display as bright and as dark as this one.
    pub(super) fn on(&self, display: &Display) -> Option<Box<dyn FittedTone>> {
        let luminances = [display.white_cd_m2, display.black_cd_m2, display.ambient_cd_m2].map(|cd_m2| cd_m2 as f32);
        (luminances == self.luminances_cd_m2).then(|| self.fitted.clone().restore())
    }
}

/// The first picture that holds a scene's light: the one that an operator is fitted to.
pub(super) fn first_scene<'p>(pictures: &[(&'p Path, &'p InputPicture)]) -> Option<(&'p Path, &'p InputPicture)> {
    pictures.iter().copied().find(|(_, picture)| picture.holds_scene_light())
}

/// The operator by which the first of the pictures that holds a scene's light was shown when it was rendered. Says so, or why not.
pub(super) fn as_rendered(pictures: &[(&Path, &InputPicture)], display: &Display) -> Option<Box<dyn FittedTone>> {
    let (path, picture) = first_scene(pictures)?;
    let kept = picture.kept_tone()?;
    let path = path.display();
    let Some(fitted) = kept.on(display) else {
        say!(
            "note: {path} was rendered for the display \"{}\", which is not as bright and dark as \"{}\": it is shown by {DEFAULT_OPERATOR}, \
             and not by the render's operator and exposure",
            kept.display,
            display.name
        );
        return None;
    };
    say!("note: shown as {path} was when it was rendered, by {}; --operator shows it by another", fitted.describe());
    Some(fitted)
}

/// What brings the scene's light of pictures to the display: the operator that was asked for, fitted to the first of them that holds
/// such light; where none was, as that one was shown when it was rendered; else the default one, fitted to it. `None` for pictures
/// that are ready for the display.
pub(super) fn shown_by(
    asked: Option<&str>,
    pictures: &[(&Path, &InputPicture)],
    viewing: &Viewing,
) -> Result<Option<Box<dyn FittedTone>>> {
    if asked.is_none()
        && let Some(fitted) = as_rendered(pictures, &viewing.display)
    {
        return Ok(Some(fitted));
    }
    let operator = tone_operator(asked.unwrap_or(DEFAULT_OPERATOR), &ToneSettings::default())?;
    Ok(first_scene(pictures).and_then(|(_, picture)| picture.fit(operator.as_ref(), viewing)))
}
