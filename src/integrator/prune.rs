//! Roulette of light that could not be seen beside what its path has found already.
//!
//! "If an intensity change is below threshold, do not render it" is an old idea for saving rays (with the threshold of
//! the eye as a function of the luminance that it is adapted to). Left out, such light would be missing; traced by
//! chance in proportion and weighted by the inverse, it is not. Only light straight from lamps is tried: how much a
//! further bounce will bring nobody knows, and the roulette of whole paths by throughput is many times stricter than a
//! threshold of five per cent.
//!
//! Not for speed: see `benches/results/transport.md`.

use fechner_perception::tvi::combined_monotone;
use serde::{Deserialize, Serialize};

/// Which light is left to chance. A path's samples stay a pure function of their key.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pruning {
    /// Luminance in cd/m² of RGB (1, 1, 1), at which scene units are seen.
    pub nits_per_unit: f64,
}

/// log₂ of the darkest luminance in cd/m² that the table tells apart.
const DARKEST: f32 = -20.0;
/// Entries of the table for each doubling of luminance.
const STEPS_PER_DOUBLING: f32 = 4.0;
const ENTRIES: usize = 200;
/// Light is never traced less often, so what gets through is never multiplied by more than the inverse.
const MIN_SURVIVAL: f32 = 0.125;

/// Thresholds at luminances a quarter of a doubling apart, all in scene units.
pub(super) struct ThresholdTable {
    nits_per_unit: f32,
    thresholds: Vec<f32>,
}

impl ThresholdTable {
    pub(super) fn new(Pruning { nits_per_unit }: Pruning) -> Self {
        let luminance_cd_m2 = |entry: usize| f64::from(DARKEST + entry as f32 / STEPS_PER_DOUBLING).exp2();
        let threshold = |entry: usize| (combined_monotone(luminance_cd_m2(entry)) / nits_per_unit) as f32;
        Self { nits_per_unit: nits_per_unit as f32, thresholds: (0..ENTRIES).map(threshold).collect() }
    }

    /// Share of the times that a change of luminance beside a luminance seen is to be traced, both in scene units.
    pub(super) fn survival(&self, change: f32, seen: f32) -> f32 {
        let entry = STEPS_PER_DOUBLING * ((self.nits_per_unit * seen).log2() - DARKEST);
        let nearest = (entry + 0.5).clamp(0.0, (ENTRIES - 1) as f32) as usize;
        let share = change / self.thresholds[nearest];
        if share.is_nan() { 1.0 } else { share.clamp(MIN_SURVIVAL, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// About five per cent of 100 cd/m² is the threshold, more of the dark, whatever the scene's unit.
    #[test]
    fn light_below_threshold_is_left_to_chance() {
        for nits_per_unit in [1.0, 100.0] {
            let table = ThresholdTable::new(Pruning { nits_per_unit });
            let survival =
                |change: f64, seen: f64| table.survival((change / nits_per_unit) as f32, (seen / nits_per_unit) as f32);
            assert_eq!(survival(6.0, 100.0), 1.0);
            let half = 0.5 * combined_monotone(100.0);
            assert!((survival(half, 100.0) - 0.5).abs() < 0.05, "{}", survival(half, 100.0));
            assert_eq!(survival(1e-6, 100.0), MIN_SURVIVAL);
            assert_eq!(survival(0.01, 0.0), 1.0, "in the dark a hundredth of a cd/m² is seen");
            assert_eq!(survival(f64::NAN, 100.0), 1.0);
            assert_eq!(survival(1.0, f64::INFINITY), MIN_SURVIVAL);
        }
    }
}
