//! What was rendered and for whom: small, at the start of the film's file. It can be read without the film behind it.

use super::tracing::Tracing;
use crate::adaptive::settings::{AllocationRule, Limits, LoopSettings, Sampling};
use crate::denoise::{Denoiser, DenoiserKind, OidnError};
use crate::integrator::{Crop, TraceSettings};
use crate::output::PartOf;
use crate::scene::Scene;
use crate::scene::hash::{ContentHash, content_hash};
use fechner_perception::csf::FrameTiming;
use fechner_perception::display::Viewing;
use fechner_perception::eccentricity::Gaze;
use fechner_perception::model::{self, ThresholdModel};
use fechner_perception::tone::{self, SavedTone, ToneSettings};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name of this program, its version and what of its build changes the last bits of a sample: where the
/// target has fused multiply-add (`-C target-cpu=native` without `-C target-feature=-fma`), glam's
/// `Vec3A::cross` and `lerp` use it.
pub const PROGRAM: &str = if cfg!(target_feature = "fma") {
    concat!("fechner ", env!("CARGO_PKG_VERSION"), ", built for FMA")
} else {
    concat!("fechner ", env!("CARGO_PKG_VERSION"))
};

/// The start of a film's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// What the samples are samples of.
    pub origin: Origin,
    /// Whose random numbers they used.
    pub seeds: Seeds,
    /// Settings for whose eyes the samples were spread.
    pub settings: SettingsRecord,
    /// Visibility that was aimed at.
    pub visibility: f64,
    /// Visibilities that were aimed at before, in renders that this one goes on from, first to last.
    pub earlier_visibilities: Vec<f64>,
}

impl Header {
    /// The header of a render from the beginning with one seed.
    #[must_use]
    pub fn begun(origin: Origin, seed: u64, settings: SettingsRecord, visibility: f64) -> Self {
        Self { origin, seeds: Seeds::one(seed), settings, visibility, earlier_visibilities: Vec::new() }
    }
}

/// Everything that a sample is a function of, besides its place in the picture and the seed: only films of equal origin
/// may be added or continued.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// [`PROGRAM`] of the build that traced the samples.
    pub program: String,
    /// The scene's name or, where a file of it was rendered, that file's, for messages and reports.
    pub scene_name: String,
    /// The scene's content.
    pub scene: ContentHash,
    /// Width of the film in pixels.
    pub width: u32,
    /// Height of the film in pixels.
    pub height: u32,
    /// How it was traced.
    pub tracing: Tracing,
}

impl Origin {
    /// The origin of a render's samples.
    pub fn of(scene: &Scene, settings: &TraceSettings) -> Self {
        let Crop { width, height, .. } = settings.film_area();
        Self {
            program: PROGRAM.to_owned(),
            scene_name: scene.name.clone(),
            scene: content_hash(scene),
            width,
            height,
            tracing: Tracing::of(settings),
        }
    }

    /// Pixels of the film; `None` where a file says that it has more than can be numbered.
    pub fn pixels(&self) -> Option<u32> {
        self.width.checked_mul(self.height)
    }

    /// Where the film lies in the whole picture, if it is a crop of it.
    pub fn part_of(&self) -> Option<PartOf> {
        PartOf::of(self.tracing.settings())
    }

    /// What keeps a film from standing beside one of `own` origin; `None` if nothing does.
    pub fn difference(&self, own: &Origin) -> Option<String> {
        if self.program != own.program {
            return Some(format!("it was written by {}, and this is {}", self.program, own.program));
        }
        // Before the scene, whose camera may be framed by it.
        if (self.width, self.height) != (own.width, own.height) {
            return Some(format!(
                "it holds a picture of {}x{} pixels, not of {}x{}",
                self.width, self.height, own.width, own.height
            ));
        }
        if self.scene != own.scene {
            return Some(format!(
                "it holds another scene (\"{}\", content {}) than \"{}\", content {}: the scene file, its side file, a \
                 mesh or a texture has changed, or what --camera, --look-at, --at, --environment, --texture-memory or \
                 --nits-per-unit say of it",
                self.scene_name, self.scene, own.scene_name, own.scene
            ));
        }
        (self.tracing != own.tracing).then(|| {
            let [its, this] = [self.tracing.otherwise_than(&own.tracing), own.tracing.otherwise_than(&self.tracing)];
            format!("its samples were traced with {its}, and these are with {this}")
        })
    }
}

/// Seeds of a film's samples.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seeds {
    /// All seeds, ascending.
    pub all: Vec<u64>,
    /// The one by which the render goes on; none in a merged film, which goes on by a new one.
    pub current: Option<u64>,
}

/// How samples were spread and for whom, in words that can be written down: what [`LoopSettings`] are made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingsRecord {
    /// How samples are spread.
    pub sampling: Sampling,
    /// How counts are found.
    pub allocation: AllocationRule,
    /// Threshold model, by name.
    pub model: String,
    /// Display and observer.
    pub viewing: Viewing,
    /// Luminance in cd/m² of RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// Tone operator, by name.
    pub operator: String,
    /// Exposure correction, where the operator was given one.
    pub exposure_stops: Option<f64>,
    /// The operator as fitted to something else than the picture: to the whole or the shot of which it is a part.
    pub fitted: Option<SavedTone>,
    /// How frames follow, for a frame of a moving picture, whose noise is gone in the next; `None` for a still.
    pub frames: Option<FrameTiming>,
    /// Where one looks, in pixels of the film; none where anybody may look anywhere.
    pub gazes: Vec<Gaze>,
    /// Importance map, where one was given.
    pub importance: Option<ContentHash>,
    /// What makes the output picture out of the mean.
    pub denoiser: Option<DenoiserKind>,
}

/// Why settings that were written down cannot be used here.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// A name that nobody answers to.
    #[error(transparent)]
    Name(#[from] fechner_perception::Error),
    /// The denoiser is not on this machine.
    #[error(transparent)]
    Denoiser(#[from] OidnError),
}

impl Seeds {
    /// A film of one render.
    pub fn one(seed: u64) -> Self {
        Self { all: vec![seed], current: Some(seed) }
    }

    /// The seeds of this film when it goes on by `seed`.
    ///
    /// # Errors
    /// Says which seed would be right.
    pub fn continued_by(&self, seed: u64) -> Result<Self, String> {
        match self.current {
            Some(current) if current == seed => Ok(self.clone()),
            Some(current) => Err(format!("it goes on with --seed {current}, not {seed}")),
            None if self.all.contains(&seed) => Err(format!(
                "it is merged and has the samples of --seed {seed} already: go on with one that is not among {}",
                self.in_words()
            )),
            None => {
                let mut all = self.all.clone();
                all.push(seed);
                all.sort_unstable();
                Ok(Self { all, current: Some(seed) })
            }
        }
    }

    /// All seeds, for people.
    pub fn in_words(&self) -> String {
        self.all.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")
    }
}

impl SettingsRecord {
    /// The record of the default loop, as [`LoopSettings::new`] has it.
    pub fn new(viewing: Viewing, nits_per_unit: f64, operator: impl Into<String>) -> Self {
        Self {
            sampling: Sampling::Adaptive,
            allocation: AllocationRule::default(),
            model: model::DEFAULT.to_owned(),
            viewing,
            nits_per_unit,
            operator: operator.into(),
            exposure_stops: None,
            fitted: None,
            frames: None,
            gazes: Vec::new(),
            importance: None,
            denoiser: None,
        }
    }

    /// Settings for the loop over samples that were traced so, less the importance map, of which only the hash is
    /// here; the denoiser is opened.
    ///
    /// # Errors
    /// For names that nobody answers to, and denoisers that are not installed.
    pub fn loop_settings(&self, limits: Limits, trace: &TraceSettings) -> Result<LoopSettings, SettingsError> {
        let exposure_stops = self.exposure_stops.unwrap_or_default();
        let tone = ToneSettings { exposure_stops, ..ToneSettings::default() };
        let operator = tone::operator_named(&self.operator, &tone)?;
        Ok(LoopSettings {
            sampling: self.sampling,
            allocation: self.allocation,
            model: self.threshold_model()?,
            denoiser: self.denoiser.map(Denoiser::open).transpose()?,
            limits,
            fitted: self.fitted.clone(),
            frames: self.frames,
            gazes: self.gazes.clone(),
            ..LoopSettings::new(trace, self.viewing.clone(), self.nits_per_unit, operator)
        })
    }

    /// `None` for the default, which the loop itself pools over the eye's window.
    fn threshold_model(&self) -> Result<Option<Box<dyn ThresholdModel>>, fechner_perception::Error> {
        let found = model::named(&self.model)?;
        Ok(Some(found).filter(|_| self.model != model::DEFAULT))
    }

    /// Whether pictures made by both are seen alike, however their samples were spread.
    pub fn is_seen_like(&self, other: &Self) -> bool {
        let Self { sampling, allocation, importance, .. } = *self;
        *self == Self { sampling, allocation, importance, ..other.clone() }
    }

    /// Why pictures made by both are not seen alike: all that is so here and not there.
    pub(super) fn seen_otherwise_than(&self, other: &Self) -> String {
        // Without dots, so that a new field has to be thought of.
        let Self {
            sampling: _,
            allocation: _,
            importance: _,
            model,
            viewing,
            nits_per_unit,
            operator,
            exposure_stops,
            fitted,
            frames,
            gazes,
            denoiser,
        } = self;
        let said = [
            fields_only_in(&viewing.display, &other.viewing.display),
            fields_only_in(&viewing.observer, &other.viewing.observer),
            (*model != other.model).then(|| format!("model {model}")),
            (*nits_per_unit != other.nits_per_unit).then(|| format!("{nits_per_unit} cd/m² for RGB (1, 1, 1)")),
            (*operator != other.operator).then(|| format!("operator {operator}")),
            (*exposure_stops != other.exposure_stops)
                .then(|| exposure_stops.map_or("no exposure".to_owned(), |stops| format!("exposure {stops}"))),
            (*fitted != other.fitted).then(|| match fitted {
                None => "the operator fitted to the film".to_owned(),
                Some(_) => "the operator fitted to the whole or the shot of which it is a part".to_owned(),
            }),
            (*frames != other.frames).then(|| match frames {
                None => "noise that stands still".to_owned(),
                Some(timing) => format!("noise that is new {} times a second", timing.frames_per_second),
            }),
            (*gazes != other.gazes).then(|| match &gazes[..] {
                [] => "eyes that look anywhere".to_owned(),
                gazes => format!("eyes that look at {}", listed(gazes)),
            }),
            (*denoiser != other.denoiser)
                .then(|| denoiser.map_or("no denoiser".to_owned(), |denoiser| format!("denoiser {}", denoiser.name()))),
        ];
        said.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

/// "pixel 3,4; pixel 30.5,4".
fn listed(gazes: &[Gaze]) -> String {
    gazes.iter().map(|gaze| format!("pixel {},{}", gaze.x_px, gaze.y_px)).collect::<Vec<_>>().join("; ")
}

/// "pixels per degree 60.5, white cd m2 250.0": the fields of a structure that are others in another of its kind.
fn fields_only_in<T: Serialize>(own: &T, other: &T) -> Option<String> {
    let [Ok(Value::Object(own)), Ok(Value::Object(other))] = [own, other].map(serde_json::to_value) else {
        return None;
    };
    let changed = own.iter().filter(|(name, value)| other.get(*name) != Some(value));
    let said: Vec<String> =
        changed.map(|(name, value)| format!("{} {}", words_of_field(name), value_in_words(value))).collect();
    (!said.is_empty()).then(|| said.join(", "))
}

fn value_in_words(value: &Value) -> String {
    let all = |values: &mut dyn Iterator<Item = String>| values.collect::<Vec<_>>().join(" ");
    match value {
        Value::Null => "none".to_owned(),
        Value::String(text) => text.clone(),
        Value::Array(values) => all(&mut values.iter().map(value_in_words)),
        Value::Object(fields) => {
            all(&mut fields.iter().map(|(name, value)| format!("{} {}", words_of_field(name), value_in_words(value))))
        }
        Value::Bool(_) | Value::Number(_) => value.to_string(),
    }
}

fn words_of_field(name: &str) -> String {
    name.replace(['_', '-'], " ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner_perception::display::Glare;

    #[test]
    fn films_say_what_is_seen_otherwise_in_them() {
        let own = SettingsRecord::new(Viewing::default(), 100.0, "constant");
        let mut other = SettingsRecord { sampling: Sampling::Uniform, ..own.clone() };
        assert!(own.is_seen_like(&other));
        other.denoiser = Some(DenoiserKind::Builtin);
        other.exposure_stops = Some(1.5);
        assert!(!own.is_seen_like(&other));
        assert_eq!(own.seen_otherwise_than(&other), "no exposure, no denoiser");
        assert_eq!(other.seen_otherwise_than(&own), "exposure 1.5, denoiser builtin");
        let mut other = own.clone();
        other.frames = Some(FrameTiming { frames_per_second: 24.0, persistence: 1.0 });
        other.gazes = vec![Gaze { x_px: 3.0, y_px: 4.0 }, Gaze { x_px: 30.5, y_px: 4.0 }];
        assert!(!own.is_seen_like(&other));
        assert_eq!(own.seen_otherwise_than(&other), "noise that stands still, eyes that look anywhere");
        assert_eq!(
            other.seen_otherwise_than(&own),
            "noise that is new 24 times a second, eyes that look at pixel 3,4; pixel 30.5,4"
        );
        let mut other = own.clone();
        other.viewing.display.pixels_per_degree = 60.5;
        other.viewing.observer.sensitivity = 1.75;
        other.viewing.observer.glare = Glare::Cie { age_years: 40.0 };
        assert_eq!(
            other.seen_otherwise_than(&own),
            "pixels per degree 60.5, glare cie age years 40.0, sensitivity 1.75"
        );
        assert_eq!(own.seen_otherwise_than(&other), "pixels per degree 60.0, glare none, sensitivity 1.0");
    }
}
