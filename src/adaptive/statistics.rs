//! Variance that can be trusted at 16 samples and on heavy tails.
//!
//! A count that is chosen by the same samples that it extends biases the picture dark: pixels stop when they were
//! lucky. So the count of a half depends only on (a) the variance of the pixel's neighbours, the pixel itself left out,
//! and (b) the pixel's own variance as the *other* half saw it. Measured on synthetic fields, this leaves +0.26 ± 0.1 %
//! of bias on a lognormal of coefficient of variation 4, where a pixel's own variance costs −13.6 %.

mod pooling;

use crate::film::{CHANNELS, Film, HalfPixel, Halves, opponent, share_of_mean};
use crate::sampler::Half;
use fechner_perception::{PIXELS_PER_TASK, Plane};
use pooling::{PixelSurfaces, Pooled, pooled_by_neighbours};
use rayon::prelude::*;

/// Variance of one sample in one opponent channel, per pixel, in the unit of the scale that was given, and what
/// stratification makes of it.
#[derive(Clone, Debug)]
pub struct ChannelStatistics {
    /// Pooled over the neighbours of like surface, the pixel itself left out.
    pub pooled: Plane,
    /// Ratio of the halves' squared difference to what independent samples would show, pooled: below 1 where
    /// stratification pays, and where a display that clips light shows less of its spread than its variance tells.
    pub low_discrepancy_factor: Plane,
    /// Ratio of [`Self::low_discrepancy_factor`] with the pixel itself counted in. For reports, not for decisions.
    pub factor_with_own: Plane,
}

impl ChannelStatistics {
    /// Pooled variance of one sample with what stratification makes of it.
    pub(super) fn stratified_variance(&self) -> Plane {
        self.pooled.combined(&self.low_discrepancy_factor, |variance, factor| variance * factor)
    }
}

/// Statistics of luminance and the two chromatic channels.
#[derive(Clone, Debug)]
pub struct SampleStatistics {
    /// Statistics by channel, in the order of [`crate::film::opponent`].
    pub channels: [ChannelStatistics; CHANNELS],
}

/// What the halves differ by as they are displayed, by channel, (cd/m²)².
pub struct DifferenceOnDisplay {
    /// Square of half of it.
    pub squared: [Plane; CHANNELS],
    /// What that would be of independent samples which scatter as they are taken to.
    pub expected: [Plane; CHANNELS],
    /// How many times that the differences may show.
    pub most_factor: f32,
}

/// Most times of what independent samples would differ by that the halves count as differing: stratified samples do
/// better, hardly ever worse.
pub const MAX_FACTOR: f32 = 1.2;

impl SampleStatistics {
    /// Pools a film. `scale` turns each pixel's scene variance, by channel, into what counts: displayed variance, since
    /// a lamp's border scatters far above what the display can show, and its dark neighbours must not inherit that.
    pub fn of(film: &Film, scale: &[Plane; CHANNELS]) -> Self {
        Self::by(film, scale, MAX_FACTOR, |_, evidence| evidence)
    }

    /// Pools a film as [`Self::of`], with the halves' differences as the display shows them: of what is mostly beyond
    /// white, variance times a scale tells up to 7 times the noise that is seen (`benches/results/beyond-white.md`).
    pub fn of_displayed(film: &Film, scale: &[Plane; CHANNELS], difference: &DifferenceOnDisplay) -> Self {
        let DifferenceOnDisplay { squared, expected, most_factor } = difference;
        Self::by(film, scale, *most_factor, |pixel, mut evidence| {
            for (evidence, (squared, expected)) in evidence.iter_mut().zip(squared.iter().zip(expected)) {
                evidence.squared_difference = f64::from(squared.values()[pixel]);
                evidence.expected_difference = f64::from(expected.values()[pixel]);
            }
            evidence
        })
    }

    fn by(
        film: &Film,
        scale: &[Plane; CHANNELS],
        most_factor: f32,
        refined: impl Fn(usize, [PixelEvidence; CHANNELS]) -> [PixelEvidence; CHANNELS] + Sync,
    ) -> Self {
        let width = film.width() as usize;
        let (a, b) = (film.half(Half::A), film.half(Half::B));
        let evidence: Vec<[PixelEvidence; CHANNELS]> = (0..a.len())
            .into_par_iter()
            .with_min_len(PIXELS_PER_TASK)
            .map(|i| refined(i, PixelEvidence::of_pixel(&a[i], &b[i], scale.each_ref().map(|s| s.values()[i]))))
            .collect();
        let surfaces = PixelSurfaces { features: film.features(), known_things: film.known_things.as_ref() };
        let pooled = pooled_by_neighbours(&evidence, &surfaces, width);
        let channels = pooled.map(|Pooled { variance, factor, factor_with_own }| ChannelStatistics {
            pooled: variance,
            low_discrepancy_factor: factor.map(|factor| factor.min(most_factor)),
            factor_with_own,
        });
        Self { channels }
    }

    /// Variance of one sample that a half of the film decides by: pooled, or the pixel's own variance seen by the other
    /// half where that is larger. `scale` as in [`Self::of`].
    pub fn for_half(&self, film: &Film, scale: &Plane, half: Half, channel: usize) -> Plane {
        let pooled = &self.channels[channel].pooled;
        let other = film.half(half.other());
        Plane::from_fn(pooled.width(), pooled.height(), |x, y| {
            let own = cautious_variance(&other[y * pooled.width() + x], channel) * f64::from(scale.get(x, y));
            pooled.get(x, y).max(own as f32)
        })
    }

    /// Variance of one sample that a half decides by, [`Self::for_half`], with what stratification makes of it.
    pub(super) fn stratified_variance_for_half(&self, film: &Film, scale: &Plane, half: Half, channel: usize) -> Plane {
        let factor = &self.channels[channel].low_discrepancy_factor;
        self.for_half(film, scale, half, channel).combined(factor, |variance, factor| variance * factor)
    }

    /// Statistics of luminance.
    pub fn luminance(&self) -> &ChannelStatistics {
        &self.channels[0]
    }
}

/// What is found for each channel by itself, side by side: a small picture's planes are one piece of work each.
pub(super) fn by_channel<T: Send>(of: impl Fn(usize) -> T + Sync) -> [T; CHANNELS] {
    let (luminance, (red_green, yellow_violet)) = rayon::join(|| of(0), || rayon::join(|| of(1), || of(2)));
    [luminance, red_green, yellow_violet]
}

/// Variance of the picture's luminance in (scene cd/m²)²: each pixel's own scatter, and what stratification makes of it
/// around the pixel. For reports, not for decisions.
pub fn picture_variance(film: &Film, nits_per_unit: f64) -> Plane {
    let own = film.estimate(nits_per_unit).variance_of_mean;
    let factor = SampleStatistics::of(film, &scene_units(film)).channels[0].factor_with_own.clone();
    let samples = |pixel: usize| Half::BOTH.iter().map(|&half| film.half(half)[pixel].samples).sum::<u32>();
    Plane::from_fn(own.width(), own.height(), |x, y| {
        let is_known = samples(y * own.width() + x) > 1;
        if is_known { own.get(x, y) * factor.get(x, y) } else { f32::INFINITY }
    })
}

/// The scale that leaves variances in scene units.
pub fn scene_units(film: &Film) -> [Plane; CHANNELS] {
    std::array::from_fn(|_| Plane::filled(film.width() as usize, film.height() as usize, 1.0))
}

/// A pixel's own variance, lowered by two of its standard errors under normal samples: the maximum with the pooled
/// value would otherwise pick the lucky scatter of every pixel and spend about 1.3 times too much, while the isolated
/// hard pixels that this term is for stand out by far more.
fn cautious_variance(pixel: &HalfPixel, channel: usize) -> f64 {
    if pixel.samples < 2 {
        return 0.0;
    }
    let standard_error = (2.0 / f64::from(pixel.samples - 1)).sqrt();
    pixel.sample_variance(channel) / (1.0 + 2.0 * standard_error)
}

/// What one pixel has to say about variance in one channel.
#[derive(Clone, Copy)]
struct PixelEvidence {
    /// Sample variance from the squared deviations of both halves about their own means; of two single
    /// samples, from their difference.
    variance: f64,
    /// Squared half difference; none where a half is empty.
    squared_difference: f64,
    /// Its expectation for independent samples.
    expected_difference: f64,
}

impl PixelEvidence {
    fn of_pixel(a: &HalfPixel, b: &HalfPixel, scale: [f32; CHANNELS]) -> [Self; CHANNELS] {
        let means = [opponent(a.mean), opponent(b.mean)];
        let count = |h: &HalfPixel| f64::from(h.samples.max(1));
        let has_both = a.samples > 0 && b.samples > 0;
        let degrees_of_freedom = (count(a) - 1.0) + (count(b) - 1.0);
        std::array::from_fn(|c| {
            let difference = means[0][c] - means[1][c];
            let m2 = f64::from(a.m2[c]) + f64::from(b.m2[c]);
            let scale = f64::from(scale[c]);
            let variance = if degrees_of_freedom > 0.0 {
                scale * m2 / degrees_of_freedom
            } else if has_both {
                // A sample in each half: what they differ by is all that is known.
                0.5 * scale * difference * difference
            } else {
                0.0
            };
            let of_difference = if has_both { 0.25 } else { 0.0 };
            Self {
                variance,
                squared_difference: of_difference * scale * difference * difference,
                expected_difference: of_difference * variance * (1.0 / count(a) + 1.0 / count(b)),
            }
        })
    }
}

/// Pixels that stand out of their surroundings by light that few samples find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outliers {
    /// How many.
    pub pixels: usize,
    /// Half difference of their halves, over the energy of the picture.
    pub energy_share: f64,
}

/// Finds pixels whose halves differ by more than five standard errors of what their neighbours show.
pub fn find_outliers(film: &Film) -> Outliers {
    const STANDARD_ERRORS: f64 = 5.0;
    let statistics = SampleStatistics::of(film, &scene_units(film));
    let (mut pixels, mut excess, mut energy) = (0, 0.0, 0.0);
    for i in 0..film.pixel_count() {
        let Halves::Both([a, b]) = film.halves(i) else { continue };
        let means = [a.luminance(), b.luminance()];
        energy += 0.5 * (means[0] + means[1]);
        let half_difference = 0.5 * (means[0] - means[1]).abs();
        let per_sample = f64::from(statistics.luminance().pooled.values()[i]);
        let of_neighbours = per_sample * share_of_mean([a.samples, b.samples]);
        if half_difference > STANDARD_ERRORS * of_neighbours.sqrt() && half_difference > 0.0 {
            pixels += 1;
            excess += half_difference;
        }
    }
    Outliers { pixels, energy_share: if energy > 0.0 { excess / energy } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::test_films::film_of_halves;
    use crate::film::BlockSum;
    use crate::integrator::{BlockWork, PathSample};
    use glam::Vec3;

    /// A film whose pixel values come from `value(pixel, random in [0,1))`, with independent samples.
    fn film_of(width: u32, height: u32, levels: u8, value: impl Fn(u32, f32) -> f32) -> Film {
        let mut film = Film::new(width, height);
        let mut counter = 0u64;
        for pixel in 0..width * height {
            for half in Half::BOTH {
                for level in 0..levels {
                    let work = BlockWork::whole(pixel, half, level);
                    let mut sum = BlockSum::default();
                    for _ in 0..work.samples {
                        counter += 1;
                        let u = crate::sampler::unit_of_hash(crate::sampler::hash_words(counter, 99));
                        sum.add(&PathSample::of_wall(Vec3::splat(value(pixel, u))));
                    }
                    film.merge_block(work, &sum);
                }
            }
        }
        film
    }

    /// Luminance variance that a half decides by, in scene units.
    fn for_half(film: &Film, half: Half) -> Plane {
        let scale = scene_units(film);
        SampleStatistics::of(film, &scale).for_half(film, &scale[0], half, 0)
    }

    /// Uniform noise has variance 1/12, and independent halves differ as expected: factor 1.
    #[test]
    fn flat_noise_is_estimated_right() {
        let film = film_of(32, 32, 2, |_, u| u);
        let statistics = SampleStatistics::of(&film, &scene_units(&film));
        let mean = |p: &Plane| p.values().iter().sum::<f32>() / p.values().len() as f32;
        assert!(
            (mean(&statistics.luminance().pooled) * 12.0 - 1.0).abs() < 0.02,
            "{}",
            mean(&statistics.luminance().pooled) * 12.0
        );
        let factor = mean(&statistics.luminance().low_discrepancy_factor);
        // The clamp at 1.2 cuts the upper half of a ±20 % scatter.
        assert!((factor - 1.0).abs() < 0.1, "{factor}");
        let excess = mean(&for_half(&film, Half::A)) / mean(&statistics.luminance().pooled);
        assert!(excess < 1.05, "maximum of pooled and own spends {excess}");
    }

    /// Halves that differ by far more than their scatter tells are believed up to 1.2 times it, and up to what
    /// is asked for as displayed.
    #[test]
    fn halves_are_believed_up_to_a_factor() {
        let grey = |half: Half, random: f32| Vec3::splat(0.1 * random + if half == Half::A { 1.0 } else { 3.0 });
        let film = film_of_halves([8; 2], |_| false, |_, half, random| grey(half, random));
        let scale = scene_units(&film);
        let like = |value: f32| std::array::from_fn(|_| scale[0].map(|_| value));
        let difference = DifferenceOnDisplay { squared: like(1.0), expected: like(0.01), most_factor: 4.0 };
        let factor = |statistics: &SampleStatistics| statistics.luminance().low_discrepancy_factor.mean();
        assert!((factor(&SampleStatistics::of(&film, &scale)) - f64::from(MAX_FACTOR)).abs() < 1e-6);
        assert_eq!(factor(&SampleStatistics::of_displayed(&film, &scale, &difference)), 4.0);
    }

    /// A hard pixel among easy ones is seen through the other half, and does not hide in the pool.
    #[test]
    fn an_isolated_hard_pixel_is_caught() {
        let hard = 16 * 33 + 16;
        let film = film_of(33, 33, 2, |pixel, u| if pixel == hard { u * 10.0 } else { u });
        let statistics = SampleStatistics::of(&film, &scene_units(&film));
        let at = |p: &Plane| f64::from(p.values()[hard as usize]);
        assert!(at(&statistics.luminance().pooled) < 0.2, "the pool leaves the pixel itself out");
        assert!(Half::BOTH.iter().all(|&half| at(&for_half(&film, half)) > 2.0));
    }

    /// A pixel's decision for half A must not change with A's own samples of that pixel.
    #[test]
    fn a_half_does_not_decide_for_itself() {
        let pixel = 12 * 24 + 12;
        let base = film_of(24, 24, 1, |_, u| u);
        let mut changed = base.clone();
        let wild = PathSample::of_wall(Vec3::splat(1000.0));
        let mut sum = BlockSum::default();
        sum.add(&wild);
        changed.merge_block(BlockWork { samples: 1, ..BlockWork::whole(pixel, Half::A, 1) }, &sum);
        let at = |film: &Film, half: Half| for_half(film, half).values()[pixel as usize];
        let before = at(&base, Half::A);
        assert_eq!(before, at(&changed, Half::A));
        assert!(at(&changed, Half::B) > before * 100.0);
    }
}
