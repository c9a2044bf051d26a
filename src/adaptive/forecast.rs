//! What a plan will leave to be seen, without a look at what it will find.

use super::judge::Judgement;
use super::stop::TOLERATED_SHARE;
use crate::film::{Film, share_of_mean};
use crate::integrator::SamplePlan;
use crate::sampler::Half;
use fechner_perception::Plane;

/// Forecasts aim at so much of the visibility asked for, since estimates will move and the worst pixels count: with
/// 0.98 three scenes at 128×128 took 12, 12 and 6 looks, with this 10, 9 and 4, for as many samples (counted by hand
/// on 22 November 2026, in `plans` of `render --json`).
const AIM: f64 = 0.9;

/// A film and how it was judged, from which the visibility after more samples is foretold: variances of a sample as
/// they were, and each band's smear as it was.
pub(super) struct Forecast<'a> {
    film: &'a Film,
    judgement: &'a Judgement,
    smear: Plane,
}

impl<'a> Forecast<'a> {
    pub(super) fn of(film: &'a Film, judgement: &'a Judgement) -> Self {
        /// Beyond this the noise of a pixel's surroundings is another matter than its own.
        const RANGE: (f32, f32) = (0.5, 1.5);
        let rough = judgement.rough_visibility_of(&variance(film, judgement, |pixel| film.variance_share(pixel)));
        let smear = rough.combined(&judgement.predicted, |rough, predicted| {
            let ratio = rough / predicted;
            if ratio.is_finite() { ratio.clamp(RANGE.0, RANGE.1) } else { 1.0 }
        });
        Self { film, judgement, smear }
    }

    /// Factor on the visibility that the allocation may leave at each pixel: importance, a bound, and what the bands'
    /// smear makes of the noise around it, which the allocation's constraints leave out. A dark strip beside bright
    /// noise sees more of it than the strip's own.
    pub(super) fn tolerance(&self) -> Plane {
        let mut tolerance = self.smear.clone();
        if let Some(map) = &self.judgement.importance {
            tolerance = tolerance.combined(map, |tolerance, importance| tolerance * importance);
        }
        if let Some(factor) = &self.judgement.bound_factor {
            tolerance = tolerance.combined(factor, |tolerance, factor| tolerance / factor);
        }
        tolerance
    }

    /// Whether the plan will bring the picture to a visibility, if nothing new is found.
    pub(super) fn is_reached_by(&self, plan: &SamplePlan, visibility: f64) -> bool {
        let mut counts = self.counts();
        for block in &plan.blocks {
            counts[block.pixel as usize][block.half.index()] += block.samples;
        }
        let share = |pixel: usize| share_of_mean(counts[pixel]);
        let rough = self.judgement.rough_visibility_of(&variance(self.film, self.judgement, share));
        let above = rough.values().iter().zip(self.smear.values());
        let above = above.filter(|&(rough, smear)| f64::from(rough / smear) > AIM * visibility).count();
        above as f64 <= 0.5 * TOLERATED_SHARE * rough.values().len() as f64
    }

    fn counts(&self) -> Vec<[u32; 2]> {
        let halves = Half::BOTH.map(|half| self.film.half(half));
        halves[0].iter().zip(halves[1]).map(|(a, b)| [a.samples, b.samples]).collect()
    }
}

/// Displayed variance of every pixel's mean, (cd/m²)², where it is `share(pixel)` of one sample's.
fn variance(film: &Film, judgement: &Judgement, share: impl Fn(usize) -> f64 + Sync) -> Plane {
    let per_sample = judgement.pooled_variance_per_sample.values();
    film.plane(|pixel| (f64::from(per_sample[pixel]) * share(pixel)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::judge::judge;
    use crate::adaptive::plan::uniform_plan;
    use crate::adaptive::test_films::{film_of, settings};
    use glam::Vec3;

    /// Where noise is the same everywhere, twice the samples leave it 1/√2 as visible, and are told to.
    #[test]
    fn twice_the_samples_reach_what_they_should() {
        let film = film_of(|_, random| Vec3::splat(0.5 + 0.3 * random));
        let judgement = judge(&film, &settings(), 1.0).expect("judges");
        let forecast = Forecast::of(&film, &judgement);
        let [middle, worst] = [0.5, 1.0].map(|share| judgement.predicted.quantile(share) / 2.0_f64.sqrt());
        let doubled = uniform_plan(&film, 64);
        assert!(forecast.is_reached_by(&doubled, worst / AIM * 1.01));
        assert!(!forecast.is_reached_by(&doubled, middle / AIM * 0.99), "half of the picture would stay above");
        assert!(!forecast.is_reached_by(&SamplePlan::default(), worst), "without samples nothing changes");
    }

    /// Beside noise a quiet pixel sees more than its own: the allocation may leave less there than the pixel alone
    /// would suffer. Amid even noise its own is what it sees.
    #[test]
    fn less_is_tolerated_beside_noise() {
        let film = film_of(|pixel, random| {
            let amplitude = if pixel % 64 < 32 { 0.4 } else { 0.01 };
            Vec3::splat(0.5 + amplitude * random)
        });
        let mut judgement = judge(&film, &settings(), 1.0).expect("judges");
        let tolerance = Forecast::of(&film, &judgement).tolerance();
        let column = |x: usize| (8..56).map(|y| f64::from(tolerance.get(x, y))).sum::<f64>() / 48.0;
        // Pooling alone brings the noise some 20 pixels far; bands bring it further, and there the quiet pixel's own
        // is least.
        let (amid, beside) = (column(12), column(60));
        assert!((amid - 1.0).abs() < 0.01, "amid noise {amid}");
        assert!((0.9..0.98).contains(&beside), "beside it {beside}");
        judgement.importance = Some(Plane::filled(64, 64, 0.5));
        judgement.predicted = judgement.predicted.map(|visibility| visibility / 0.5);
        let of_half = Forecast::of(&film, &judgement).tolerance();
        assert!((of_half.get(12, 30) / tolerance.get(12, 30) - 0.5).abs() < 1e-6);
    }
}
