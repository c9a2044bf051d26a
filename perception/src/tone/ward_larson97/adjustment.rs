//! The histogram, trimmed until no contrast is exaggerated.

use serde::{Deserialize, Serialize};

use super::super::words::Shown;
use crate::display::Display;
use crate::table::Between;
use crate::tvi;

/// What bounds the displayed contrast of a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ceiling {
    /// The scene's own contrast: what an exposure would show.
    Linear,
    /// What can be seen of it: thresholds of the scene's luminance must not be exceeded by those of the display's.
    #[default]
    Human,
}

const BINS: usize = 100;
/// Share of the samples that a pass may trim to be the last, and that has to be left lest the picture is given up for a
/// linear scale (`pcond`).
const TOLERANCE: f64 = 0.025;
/// Share of the samples that a last pass may cut: then at most a thousandth of the display's range (in logarithms) is
/// not used.
const SETTLED: f64 = 1e-3;
const MIN_CD_M2: f64 = 1e-4;
/// Each pass trims more than the tolerance, so that there are at most ln(1 / 0.025) / 0.025 = 148.
const MAX_PASSES: usize = 200;

/// What a display shows, in natural logarithms of cd/m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DisplayRange {
    pub(super) least: f64,
    pub(super) greatest: f64,
}

impl DisplayRange {
    /// A display without black is given a contrast of 10 000:1.
    pub(super) fn of(display: &Display) -> Self {
        let white_cd_m2 = display.luminance_cd_m2(1.0).max(f64::MIN_POSITIVE);
        let black_cd_m2 = display.luminance_cd_m2(0.0).max(1e-4 * white_cd_m2);
        Self { least: black_cd_m2.ln(), greatest: white_cd_m2.ln() }
    }

    pub(super) fn middle_cd_m2(self) -> f64 {
        (0.5 * (self.least + self.greatest)).exp()
    }
}

/// Samples over the natural logarithm of luminance.
#[derive(Clone, Debug)]
pub(super) struct Histogram {
    least: f64,
    step: f64,
    counts: Vec<f64>,
    mean: f64,
}

impl Histogram {
    /// `None` without samples.
    pub(super) fn of(samples_cd_m2: Vec<f64>) -> Option<Self> {
        let logs: Vec<f64> =
            samples_cd_m2.into_iter().filter(|v| v.is_finite()).map(|v| v.max(MIN_CD_M2).ln()).collect();
        let least = logs.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if logs.is_empty() {
            return None;
        }
        let step = (greatest - least) / BINS as f64;
        let mut counts = vec![0.0; BINS];
        for log in &logs {
            let bin = if step > 0.0 { ((log - least) / step) as usize } else { 0 };
            counts[bin.min(BINS - 1)] += 1.0;
        }
        Some(Self { least, step, counts, mean: logs.iter().sum::<f64>() / logs.len() as f64 })
    }

    /// Trims bins to their ceiling until hardly anything is trimmed. What then is left is the map; if hardly anything
    /// is left, or the scene fits the display as it is, the map is a scale.
    pub(super) fn adjust(mut self, range: DisplayRange, ceiling: Ceiling) -> Adjustment {
        let linear = Adjustment::Linear {
            scale: tvi::combined(range.middle_cd_m2()) / tvi::combined(self.mean.exp()),
            adaptation_cd_m2: self.mean.exp(),
        };
        if self.step * BINS as f64 <= range.greatest - range.least {
            return linear;
        }
        let Some(mut stop) = self.trim_as_published(range, ceiling) else { return linear };
        let whole = match ceiling {
            Ceiling::Linear => stop.before - stop.trimmed,
            Ceiling::Human => self.settle(range, ceiling, &mut stop),
        };
        Adjustment::Curve(self.curve(range, whole, stop.passes))
    }

    /// Passes until one cuts hardly anything; `None` where hardly anything is left.
    fn trim_as_published(&mut self, range: DisplayRange, ceiling: Ceiling) -> Option<LastPass> {
        let all: f64 = self.counts.iter().sum();
        for passes in 1..=MAX_PASSES {
            let (before, trimmed) = self.trim(range, ceiling);
            if before - trimmed <= TOLERANCE * all {
                return None;
            }
            if trimmed <= TOLERANCE * before {
                return Some(LastPass { before, trimmed, passes });
            }
        }
        None
    }

    /// The map, `whole` samples of which would fill the display.
    fn curve(&self, range: DisplayRange, whole: f64, passes: usize) -> Curve {
        Curve {
            least: self.least,
            step: self.step,
            range_least: range.least,
            range: range.greatest - range.least,
            cumulative: self.cumulative_of(whole),
            passes,
        }
    }

    /// Where the published passes stop, the last one has cut up to [`TOLERANCE`] of the samples, by which the rest
    /// would grow above the ceiling it was just cut to. A few more passes make that less, as long as no more than
    /// that is lost in all; what is left of it stays as light that the display has and the curve does not use.
    /// Returns the samples that stand for all of the display's range: those before the last cut, so that every bin
    /// keeps to its ceiling.
    fn settle(&mut self, range: DisplayRange, ceiling: Ceiling, last: &mut LastPass) -> f64 {
        let least = (1.0 - TOLERANCE) * (last.before - last.trimmed);
        while last.trimmed > SETTLED * last.before && last.passes < MAX_PASSES {
            let mut next = self.clone();
            let (before, trimmed) = next.trim(range, ceiling);
            if before - trimmed < least {
                break;
            }
            *self = next;
            *last = LastPass { before, trimmed, passes: last.passes + 1 };
        }
        last.before
    }

    /// One pass; the samples there were and those cut off.
    fn trim(&mut self, range: DisplayRange, ceiling: Ceiling) -> (f64, f64) {
        let cumulative = self.cumulative();
        let total: f64 = self.counts.iter().sum();
        let span = range.greatest - range.least;
        let mut trimmed = 0.0;
        for (bin, count) in self.counts.iter_mut().enumerate() {
            let scene_cd_m2 = (self.least + (bin as f64 + 0.5) * self.step).exp();
            let shown_cd_m2 = (range.least + span * 0.5 * (cumulative[bin] + cumulative[bin + 1])).exp();
            let most = total * self.step / span * ceiling.contrast(scene_cd_m2, shown_cd_m2);
            if *count > most {
                trimmed += *count - most;
                *count = most;
            }
        }
        (total, trimmed)
    }

    /// Share of the samples below each edge of the bins.
    fn cumulative(&self) -> Vec<f64> {
        self.cumulative_of(self.counts.iter().sum())
    }

    /// Samples below each edge of the bins, as shares of `total`.
    fn cumulative_of(&self, total: f64) -> Vec<f64> {
        let total = total.max(f64::MIN_POSITIVE);
        let mut sum = 0.0;
        let mut shares = vec![0.0];
        shares.extend(self.counts.iter().map(|count| {
            sum += count;
            sum / total
        }));
        shares
    }
}

/// What the last pass over a histogram did.
struct LastPass {
    /// Samples before it.
    before: f64,
    /// Samples that it cut off.
    trimmed: f64,
    /// Passes so far.
    passes: usize,
}

impl Ceiling {
    /// The greatest ratio of displayed to scene contrast.
    fn contrast(self, scene_cd_m2: f64, shown_cd_m2: f64) -> f64 {
        match self {
            Self::Linear => 1.0,
            Self::Human => tvi::combined(shown_cd_m2) / shown_cd_m2 * scene_cd_m2 / tvi::combined(scene_cd_m2),
        }
    }
}

/// From scene luminance to display luminance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Adjustment {
    /// A curve by the histogram.
    Curve(Curve),
    /// One factor, which matches thresholds at the means.
    Linear { scale: f64, adaptation_cd_m2: f64 },
}

/// The cumulative distribution as a curve in logarithms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Curve {
    least: f64,
    step: f64,
    range_least: f64,
    range: f64,
    cumulative: Vec<f64>,
    passes: usize,
}

impl Curve {
    fn display_cd_m2(&self, scene_cd_m2: f64) -> f64 {
        let place = (scene_cd_m2.max(MIN_CD_M2).ln() - self.least) / self.step;
        let edges = Between::of(place, self.cumulative.len());
        let [low, high] = [edges.below, edges.above].map(|edge| self.cumulative.get(edge).copied().unwrap_or(0.0));
        (self.range_least + self.range * edges.value(low, high)).exp()
    }
}

impl Adjustment {
    pub(super) fn display_cd_m2(&self, scene_cd_m2: f64) -> f64 {
        match self {
            Self::Curve(curve) => curve.display_cd_m2(scene_cd_m2),
            Self::Linear { scale, .. } => scale * scene_cd_m2,
        }
    }
}

impl std::fmt::Display for Adjustment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Curve(curve) => write!(
                f,
                "a histogram from {} to {} cd/m² trimmed in {} passes",
                Shown(curve.least.exp()),
                Shown((curve.least + curve.step * BINS as f64).exp()),
                curve.passes
            ),
            Self::Linear { scale, adaptation_cd_m2 } => {
                write!(f, "a scale of {} for an adaptation of {} cd/m²", Shown(*scale), Shown(*adaptation_cd_m2))
            }
        }
    }
}

#[cfg(test)]
mod tests;
