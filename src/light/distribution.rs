//! Piecewise-constant distributions, sampled by inversion.

/// Over a row of cells in proportion to their weights.
#[derive(Clone, Debug)]
pub(super) struct Distribution1d {
    /// `cumulative[i]` is the probability of the cells before i; one more entry than cells, the last is 1.
    cumulative: Vec<f32>,
}

impl Distribution1d {
    /// `None` unless some weight is above 0 and all are finite.
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

    /// A cell and its probability.
    pub(super) fn sample_discrete(&self, u: f32) -> (usize, f32) {
        let index = self.cell_of(u);
        (index, self.probability(index))
    }

    /// A position in [0, 1) along the row, and its density relative to uniform.
    pub(super) fn sample_continuous(&self, u: f32) -> (f32, f32) {
        let index = self.cell_of(u);
        let cells = (self.cumulative.len() - 1) as f32;
        let probability = self.probability(index);
        let within = ((u - self.cumulative[index]) / probability).clamp(0.0, 1.0);
        (((index as f32 + within) / cells).min(1.0 - f32::EPSILON / 2.0), probability * cells)
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
            counts[d.sample_discrete((i as f32 + 0.5) / n as f32).0] += 1;
        }
        assert_eq!(counts, [1000, 0, 3000, 0]);
        let (x, density) = d.sample_continuous(0.625);
        assert!((x - 0.625).abs() < 1e-6 && (density - 3.0).abs() < 1e-6, "{x} {density}");
        assert_eq!(d.sample_discrete(1.0).0, 2, "u at its end stays in a cell that has weight");
    }

    #[test]
    fn no_weight_is_no_distribution() {
        assert!(Distribution1d::new(&[]).is_none());
        assert!(Distribution1d::new(&[0.0, 0.0]).is_none());
        assert!(Distribution1d::new(&[f64::NAN]).is_none());
    }
}
