//! Tells how far apart two brightnesses are of which a few paths each tell.

/// What is less, over the darker surroundings, is left to chance: of a sixteenth of a pixel sixteen samples would
/// scatter by 2 %.
pub(super) const MIN_CONTRAST: f32 = 0.3;
/// So is what is fewer standard errors of these paths.
const MIN_ERRORS: f32 = 2.0;

/// Luminances that paths found.
#[derive(Default)]
pub(super) struct Luminances {
    count: f32,
    sum: f32,
    squares: f32,
}

impl FromIterator<f32> for Luminances {
    fn from_iter<I: IntoIterator<Item = f32>>(numbers: I) -> Self {
        numbers.into_iter().fold(Self::default(), |Self { count, sum, squares }, number| Self {
            count: count + 1.0,
            sum: sum + number,
            squares: squares + number * number,
        })
    }
}

impl Luminances {
    /// How far the mean is from that of surroundings; 0 where that is too little, or no more than chance.
    pub(super) fn difference(&self, surroundings: &Self) -> f32 {
        let difference = (self.mean() - surroundings.mean()).abs();
        let error = (self.variance_of_mean() + surroundings.variance_of_mean()).sqrt();
        let is_seen = difference >= MIN_CONTRAST * surroundings.mean() && difference >= MIN_ERRORS * error;
        if is_seen { difference } else { 0.0 }
    }

    fn mean(&self) -> f32 {
        self.sum / self.count.max(1.0)
    }

    fn variance_of_mean(&self) -> f32 {
        (self.squares / self.count.max(1.0) - self.mean().powi(2)).max(0.0) / (self.count - 1.0).max(1.0)
    }
}
