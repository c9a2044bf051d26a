//! Geometric means over scenes, and how sure they are.

use crate::sampler::hash_words;
use serde::Serialize;

/// A geometric mean over scenes with a bootstrap interval over seeds within scenes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GeometricMean {
    /// The mean.
    pub value: f64,
    /// 2.5th percentile of the resampled means; `None` where a scene has one seed, whose scatter nobody knows.
    pub low: Option<f64>,
    /// 97.5th percentile.
    pub high: Option<f64>,
    /// The worst scene.
    pub least: f64,
}

impl GeometricMean {
    /// "1.93 (1.81 to 2.05)", or "1.93" where its interval is not known.
    pub fn in_words(&self) -> String {
        match (self.low, self.high) {
            (Some(low), Some(high)) => format!("{:.2} ({low:.2} to {high:.2})", self.value),
            _ => format!("{:.2}", self.value),
        }
    }
}

const RESAMPLES: u64 = 1000;

/// Geometric mean of ratios: each scene's is `ratios[scene]` by seed, and `pooled[scene]` for all its seeds together, which is
/// what the mean is taken of.
pub(crate) fn geometric_mean(pooled: &[f64], ratios: &[Vec<f64>]) -> GeometricMean {
    let mean = |logs: &[f64]| (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
    let value = mean(&pooled.iter().map(|r| r.ln()).collect::<Vec<_>>());
    let least = pooled.iter().copied().fold(f64::INFINITY, f64::min);
    if ratios.iter().any(|seeds| seeds.len() < 2) {
        return GeometricMean { value, low: None, high: None, least };
    }
    // Scatter between seeds, about each scene's own mean.
    let mut resampled: Vec<f64> = (0..RESAMPLES)
        .map(|round| {
            let scenes: Vec<f64> = ratios
                .iter()
                .enumerate()
                .map(|(scene, seeds)| {
                    let own = seeds.iter().map(|r| r.ln()).sum::<f64>() / seeds.len() as f64;
                    let drawn: f64 = (0..seeds.len())
                        .map(|draw| {
                            let word = (scene as u64) << 32 | draw as u64;
                            seeds[hash_words(round, word) as usize % seeds.len()].ln() - own
                        })
                        .sum();
                    drawn / seeds.len() as f64
                })
                .collect();
            value * mean(&scenes)
        })
        .collect();
    resampled.sort_by(f64::total_cmp);
    let at = |share: f64| Some(resampled[(share * (resampled.len() - 1) as f64) as usize]);
    GeometricMean { value, low: at(0.025), high: at(0.975), least }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_geometric_and_inside_its_interval() {
        let found = geometric_mean(&[2.0, 8.0], &[vec![1.8, 2.0, 2.2], vec![7.5, 8.0, 8.6]]);
        assert!((found.value - 4.0).abs() < 1e-12);
        let (low, high) = (found.low.expect("three seeds"), found.high.expect("three seeds"));
        assert!(low < 4.0 && high > 4.0 && low > 3.5 && high < 4.5, "{found:?}");
        assert_eq!(found.least, 2.0);
    }

    /// The scatter of one seed is not nothing, but unknown.
    #[test]
    fn one_seed_has_no_interval() {
        let found = geometric_mean(&[2.0, 8.0], &[vec![2.0], vec![8.0]]);
        assert_eq!((found.low, found.high, found.in_words().as_str()), (None, None, "4.00"));
    }
}
