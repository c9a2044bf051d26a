//! How a film was traced: all settings that change its samples but the seed, to be kept, compared and said.

use crate::integrator::{Crop, Pruning, TraceSettings};
use serde::{Deserialize, Serialize};

/// Settings whose seed counts for nothing: a film has its own list of seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tracing(TraceSettings);

impl Tracing {
    /// How a render traces its samples, whatever its seed.
    pub fn of(settings: &TraceSettings) -> Self {
        Self(TraceSettings { seed: 0, ..*settings })
    }

    /// The settings, with a seed that says nothing.
    pub fn settings(&self) -> &TraceSettings {
        &self.0
    }

    /// "max depth 1000, filter gaussian, crop 8,0,32,16". Settings that ask for nothing, and the picture's size, are
    /// left out.
    pub fn in_words(&self) -> String {
        joined(self.said().into_iter().filter(|setting| setting.asks))
    }

    /// The settings that are others elsewhere, those that ask for nothing too.
    pub(super) fn otherwise_than(&self, other: &Self) -> String {
        let pairs = self.said().into_iter().zip(other.said());
        joined(pairs.filter(|(own, other)| own.words != other.words).map(|(own, _)| own))
    }

    fn said(&self) -> [Setting; 9] {
        // Without dots, so that a new setting has to be thought of.
        let TraceSettings { width, height, seed: _, max_depth, filter, clamp, sequence, crop, transparent, prune } =
            self.0;
        // The unit that pruning knows is the scene's, of which a film keeps the hash.
        [
            Setting { words: format!("width {width}"), asks: false },
            Setting { words: format!("height {height}"), asks: false },
            Setting { words: format!("max depth {max_depth}"), asks: true },
            Setting { words: format!("filter {}", filter.in_words()), asks: true },
            Setting::where_any("clamp", clamp.map(|clamp| format!("{clamp:?}"))),
            Setting { words: format!("sequence {}", sequence.in_words()), asks: true },
            Setting::where_any("crop", crop.map(|Crop { x, y, width, height }| format!("{x},{y},{width},{height}"))),
            Setting { words: if transparent { "transparent" } else { "not transparent" }.into(), asks: transparent },
            Setting::where_any("prune", prune.map(|Pruning { nits_per_unit: _ }| "tvi".to_owned())),
        ]
    }
}

/// A setting for people.
struct Setting {
    words: String,
    /// Whether it does anything.
    asks: bool,
}

impl Setting {
    /// "crop 1,2,3,4", "no crop".
    fn where_any(name: &str, value: Option<String>) -> Self {
        let asks = value.is_some();
        Self { words: value.map_or_else(|| format!("no {name}"), |value| format!("{name} {value}")), asks }
    }
}

fn joined(settings: impl Iterator<Item = Setting>) -> String {
    settings.map(|setting| setting.words).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{PixelFilter, Sequence};

    fn plain() -> TraceSettings {
        TraceSettings::new(64, 48, 7)
    }

    #[test]
    fn tracing_is_said_without_what_it_does_not_do() {
        let words = |settings: TraceSettings| Tracing::of(&settings).in_words();
        assert_eq!(words(plain()), "max depth 1000, filter gaussian, sequence per pixel");
        let settings = TraceSettings {
            filter: PixelFilter::BlackmanHarris,
            clamp: Some(9.0),
            sequence: Sequence::ZOrder,
            crop: Some(Crop { x: 1, y: 2, width: 3, height: 4 }),
            transparent: true,
            ..plain()
        };
        let all = "max depth 1000, filter blackman harris, clamp 9.0, sequence z order, crop 1,2,3,4, transparent";
        assert_eq!(words(settings), all);
    }

    #[test]
    fn what_differs_is_said_from_both_sides() {
        let from_both = |a: TraceSettings, b: TraceSettings| {
            let [a, b] = [a, b].map(|settings| Tracing::of(&settings));
            [a.otherwise_than(&b), b.otherwise_than(&a)]
        };
        let whole = TraceSettings { prune: Some(Pruning { nits_per_unit: 100.0 }), ..plain() };
        let crop = Crop { x: 0, y: 0, width: 32, height: 32 };
        let part = TraceSettings { crop: Some(crop), transparent: true, ..plain() };
        let said = ["no crop, not transparent, prune tvi", "crop 0,0,32,32, transparent, no prune"];
        assert_eq!(from_both(whole, part), said);
        let other = TraceSettings { crop: Some(Crop { y: 4, ..crop }), ..part };
        assert_eq!(from_both(part, other), ["crop 0,0,32,32", "crop 0,4,32,32"]);
        assert_eq!(from_both(plain(), TraceSettings { width: 80, seed: 8, ..plain() }), ["width 64", "width 80"]);
    }
}
