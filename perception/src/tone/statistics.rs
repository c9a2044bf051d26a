//! What operators want to know of a picture as a whole.

use crate::plane::Plane;

/// Below this, cd/m², a pixel says nothing about how a picture should be exposed (the floor of human vision).
const FLOOR_CD_M2: f32 = 1e-4;

/// Scene luminances above the floor of vision, in rising order.
#[derive(Clone, Debug)]
pub(crate) struct SceneStatistics {
    sorted_cd_m2: Vec<f32>,
}

impl SceneStatistics {
    /// Leaves out blacks (an empty background is no reason to expose longer) and values that are not finite.
    pub(crate) fn of(luminance_cd_m2: &Plane) -> Self {
        let mut sorted_cd_m2: Vec<f32> = luminance_cd_m2
            .values()
            .iter()
            .copied()
            .filter(|value| value.is_finite() && *value > FLOOR_CD_M2)
            .collect();
        sorted_cd_m2.sort_unstable_by(f32::total_cmp);
        Self { sorted_cd_m2 }
    }

    /// The value below which the share `fraction` of the pixels lies; `None` for a black picture.
    pub(crate) fn quantile(&self, fraction: f64) -> Option<f64> {
        let last = self.sorted_cd_m2.len().checked_sub(1)?;
        Some(f64::from(self.sorted_cd_m2[(fraction.clamp(0.0, 1.0) * last as f64).round() as usize]))
    }

    /// Geometric mean of the pixels between two quantiles; `None` for a black picture.
    pub(crate) fn log_average(&self, from: f64, to: f64) -> Option<f64> {
        let count = self.sorted_cd_m2.len();
        let first = (from * count as f64).floor() as usize;
        let end = ((to * count as f64).ceil() as usize).clamp(first, count);
        let kept = self.sorted_cd_m2.get(first..end).filter(|kept| !kept.is_empty())?;
        Some((kept.iter().map(|&value| f64::from(value).ln()).sum::<f64>() / kept.len() as f64).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blacks_and_fireflies_do_not_move_the_trimmed_average() {
        let mut plane = Plane::filled(100, 10, 3.0);
        plane.values_mut()[..10].fill(1e12);
        plane.values_mut()[10..500].fill(0.0);
        plane.values_mut()[500] = f32::NAN;
        let statistics = SceneStatistics::of(&plane);
        assert!((statistics.log_average(0.03, 0.97).unwrap() - 3.0).abs() < 1e-9);
        assert_eq!(statistics.quantile(0.5), Some(3.0));
        assert!(SceneStatistics::of(&Plane::filled(4, 4, 0.0)).quantile(0.5).is_none());
    }
}
