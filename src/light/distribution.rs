//! Piecewise-constant distributions, sampled by inversion. Not for distributions that change: all cells are
//! added up when one is made.

/// A distribution over a row of cells in proportion to their weights.
#[derive(Clone, Debug)]
pub(super) struct Distribution1d {
    /// `cumulative[i]` is the probability of the cells before i; one more entry than cells, the last is 1.
    cumulative: Vec<f32>,
}

/// One cell of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChosenCell {
    pub(super) index: usize,
    pub(super) probability: f32,
}

/// A place along a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceSample {
    /// Place along the row in [0, 1).
    pub(super) place: f32,
    /// Relative to uniform.
    pub(super) density: f32,
}

impl Distribution1d {
    /// A distribution in proportion to weights; `None` unless some weight is above 0 and all are finite.
    pub(super) fn new(weights: &[f64]) -> Option<Self> {
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut cumulative = Vec::with_capacity(weights.len() + 1);
        cumulative.push(0.0);
        let mut running = 0.0;
        for weight in weights {
            running += weight;
            cumulative.push((running / total) as f32);
        }
        *cumulative.last_mut()? = 1.0;
        Some(Self { cumulative })
    }

    /// A cell.
    pub(super) fn choose(&self, u: f32) -> ChosenCell {
        let index = self.cell_of(u);
        ChosenCell { index, probability: self.probability(index) }
    }

    /// A place along the row.
    pub(super) fn sample(&self, u: f32) -> PlaceSample {
        let index = self.cell_of(u);
        let cells = (self.cumulative.len() - 1) as f32;
        let probability = self.probability(index);
        let within = ((u - self.cumulative[index]) / probability).clamp(0.0, 1.0);
        let place = ((index as f32 + within) / cells).min(1.0 - f32::EPSILON / 2.0);
        PlaceSample { place, density: probability * cells }
    }

    /// Probability of a cell.
    pub(super) fn probability(&self, index: usize) -> f32 {
        self.cumulative[index + 1] - self.cumulative[index]
    }

    /// Probability of all cells before this one.
    pub(super) fn cumulative_before(&self, index: usize) -> f32 {
        self.cumulative[index]
    }

    /// The cell with `cumulative[i] ≤ u < cumulative[i + 1]`: never one of probability 0.
    fn cell_of(&self, u: f32) -> usize {
        let u = u.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
        self.cumulative.partition_point(|&c| c <= u) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_chosen_in_proportion() {
        let d = Distribution1d::new(&[1.0, 0.0, 3.0, 0.0]).expect("positive");
        let n = 4000;
        let mut counts = [0; 4];
        for i in 0..n {
            counts[d.choose((i as f32 + 0.5) / n as f32).index] += 1;
        }
        assert_eq!(counts, [1000, 0, 3000, 0]);
        let PlaceSample { place, density } = d.sample(0.625);
        assert!((place - 0.625).abs() < 1e-6 && (density - 3.0).abs() < 1e-6, "{place} {density}");
        assert_eq!(d.choose(1.0).index, 2, "u at its end stays in a cell that has weight");
    }

    #[test]
    fn no_weight_is_no_distribution() {
        assert!(Distribution1d::new(&[]).is_none());
        assert!(Distribution1d::new(&[0.0, 0.0]).is_none());
        assert!(Distribution1d::new(&[f64::NAN]).is_none());
    }
}
