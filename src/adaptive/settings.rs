//! What a render is asked to do.

use fechner_perception::display::Viewing;
use fechner_perception::tone::ToneOperator;
use std::time::Duration;

/// How samples are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Where the remaining error can be seen.
    Adaptive,
    /// The same everywhere.
    Uniform,
}

/// When to stop; the first that is reached does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Visibility that may remain; 1 is at threshold. Infinite: only the other limits count.
    pub visibility: f64,
    /// Time since the start; checked between plans.
    pub time: Option<Duration>,
    /// Mean samples a pixel.
    pub mean_samples: Option<u32>,
    /// Most samples of one pixel.
    pub max_samples: u32,
    /// Number of plans, to repeat a render that ended by time.
    pub plans: Option<u32>,
}

/// Everything the loop needs to know besides the scene.
pub struct LoopSettings {
    /// How samples are spread.
    pub sampling: Sampling,
    /// When to stop.
    pub limits: Limits,
    /// Display and observer.
    pub viewing: Viewing,
    /// Luminance in cd/m² of RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// How the picture is shown.
    pub operator: Box<dyn ToneOperator>,
}

/// Samples that a pixel gets at most when nobody says otherwise: beyond it, it is reported as visible instead.
pub const DEFAULT_MAX_SAMPLES: u32 = 1 << 18;

/// The visibilities that are passed on the way to `target`, largest first, `target` last. The ladder is fixed, so that a
/// render continued to a lower rung equals one that went there in one go.
pub fn ladder(target: f64) -> Vec<f64> {
    let rungs = (-8..=4).rev().map(|power| 2f64.powi(power)).take_while(|&rung| rung > target);
    rungs.chain(std::iter::once(target)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ladders_share_their_beginnings() {
        assert_eq!(ladder(1.0), [16.0, 8.0, 4.0, 2.0, 1.0]);
        assert_eq!(ladder(0.5), [16.0, 8.0, 4.0, 2.0, 1.0, 0.5]);
        assert_eq!(ladder(3.0), [16.0, 8.0, 4.0, 3.0]);
        assert_eq!(ladder(100.0), [100.0]);
        assert_eq!(ladder(0.25).last(), Some(&0.25));
    }
}
