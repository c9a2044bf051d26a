//! What has been sampled so far: two independent half buffers with their statistics, and what the first surfaces are.
//!
//! The picture is the plain average of the halves' means: weighting by counts would let the data that chose the counts
//! bias the picture. 160 bytes a pixel.

mod block_sum;
mod estimate;
mod features;
mod halves;
mod known_things;
mod merge;
#[cfg(test)]
mod of_samples;
mod over;

pub use block_sum::BlockSum;
pub use estimate::Estimate;
pub use features::{ObjectFlags, PixelFeatures};
pub use halves::{Halves, share_of_mean};
pub use known_things::KnownThings;
#[cfg(test)]
pub(crate) use of_samples::film_of_samples;

use crate::integrator::BlockWork;
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::opponent::OPPONENT_OF_RGB;
use serde::{Deserialize, Serialize};

/// Statistics of one pixel in one half.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HalfPixel {
    /// Mean linear RGB radiance in scene units.
    pub mean: [f64; 3],
    /// Sum of squared deviations of luminance and two opponent channels from their means, scene units squared.
    pub m2: [f32; CHANNELS],
    /// Finite samples in the mean.
    pub samples: u32,
    /// Samples asked for, finite or not: where the pixel's sequence goes on.
    pub taken: u32,
    /// Samples in the mean whose camera ray met nothing.
    pub missed: u32,
}

/// Channels that statistics are kept of: luminance, red–green, yellow–violet.
pub const CHANNELS: usize = 3;

/// Scene-linear luminance and two opponent channels (red–green, yellow–violet) of an RGB value.
pub fn opponent(rgb: [f64; 3]) -> [f64; CHANNELS] {
    OPPONENT_OF_RGB.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

/// A sum of squared deviations as the film keeps it: what is beyond f32 stays at its end, which is finite, and can be
/// read again.
fn kept_m2(m2: f64) -> f32 {
    m2.min(f64::from(f32::MAX)) as f32
}

/// Counts and moments of samples that are added to a pixel's half.
struct Moments {
    mean: [f64; 3],
    m2: [f64; CHANNELS],
    samples: u32,
    taken: u32,
    missed: u32,
}

impl Moments {
    fn of_block(block: &BlockSum) -> Self {
        let samples = f64::from(block.samples.max(1));
        let mean = block.rgb.map(|sum| sum / samples);
        let centre = opponent(mean);
        Self {
            mean,
            m2: std::array::from_fn(|c| (block.squares[c] - samples * centre[c] * centre[c]).max(0.0)),
            samples: block.samples,
            taken: block.samples.saturating_add(block.nonfinite),
            missed: block.missed,
        }
    }

    fn of_half(half: &HalfPixel) -> Self {
        let HalfPixel { mean, m2, samples, taken, missed } = *half;
        Self { mean, m2: m2.map(f64::from), samples, taken, missed }
    }
}

impl HalfPixel {
    /// Adds a block.
    pub(crate) fn merge(&mut self, block: &BlockSum) {
        self.combine(&Moments::of_block(block));
    }

    /// Adds other samples (Chan, Golub and LeVeque 1983). Counts end at their largest: [`Film::add`] and
    /// [`Film::check`] refuse what comes near it.
    fn combine(&mut self, others: &Moments) {
        self.taken = self.taken.saturating_add(others.taken);
        if others.samples == 0 {
            return;
        }
        let (old, new) = (f64::from(self.samples), f64::from(others.samples));
        let (own_centre, centre) = (opponent(self.mean), opponent(others.mean));
        for (c, m2) in self.m2.iter_mut().enumerate() {
            let difference = centre[c] - own_centre[c];
            let between = difference * difference * old * new / (old + new);
            *m2 = kept_m2(f64::from(*m2) + others.m2[c] + between);
        }
        for (mean, other) in self.mean.iter_mut().zip(others.mean) {
            *mean += (other - *mean) * new / (old + new);
        }
        self.samples = self.samples.saturating_add(others.samples);
        self.missed = self.missed.saturating_add(others.missed);
    }

    /// Share of the samples whose camera ray met something; 1 for an empty pixel.
    pub fn coverage(&self) -> f32 {
        1.0 - self.missed as f32 / self.samples.max(1) as f32
    }

    /// Unbiased variance of one sample in an opponent channel; 0 below two samples.
    pub fn sample_variance(&self, channel: usize) -> f64 {
        if self.samples < 2 { 0.0 } else { f64::from(self.m2[channel]) / f64::from(self.samples - 1) }
    }
}

/// The film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Film {
    width: u32,
    height: u32,
    halves: [Vec<HalfPixel>; 2],
    /// Guides of all samples.
    features: Vec<PixelFeatures>,
    /// Guides of the first half's samples. The other's are what is left.
    features_of_a: Vec<PixelFeatures>,
    /// Samples that were not finite.
    pub nonfinite_samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// What is known of things that its samples may pass by, once somebody who knows the scene has said so. Not kept in
    /// files.
    #[serde(skip)]
    pub known_things: Option<KnownThings>,
}

impl Film {
    /// An empty film.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            width,
            height,
            halves: [vec![HalfPixel::default(); pixels], vec![HalfPixel::default(); pixels]],
            features: vec![PixelFeatures::default(); pixels],
            features_of_a: vec![PixelFeatures::default(); pixels],
            nonfinite_samples: 0,
            rays: 0,
            known_things: None,
        }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Number of the film's pixels.
    pub fn pixel_count(&self) -> usize {
        self.features.len()
    }

    /// A value of each pixel, asked for by its number, rows in parallel.
    pub(crate) fn plane(&self, of: impl Fn(usize) -> f32 + Sync) -> Plane {
        let width = self.width as usize;
        Plane::from_fn(width, self.height as usize, |x, y| of(y * width + x))
    }

    /// One half, row-major.
    pub fn half(&self, half: Half) -> &[HalfPixel] {
        &self.halves[half.index()]
    }

    /// A pixel's halves that have samples.
    pub fn halves(&self, pixel: usize) -> Halves<'_> {
        Halves::of(self.halves.each_ref().map(|half| &half[pixel]))
    }

    /// First surfaces, row-major.
    pub fn features(&self) -> &[PixelFeatures] {
        &self.features
    }

    /// First surface of a pixel as the samples of one half have seen it; of both where one half has no samples.
    pub fn features_of_half(&self, half: Half, pixel: usize) -> PixelFeatures {
        let [a, b] = Half::BOTH.map(|half| self.half(half)[pixel].samples);
        let (whole, of_a) = (&self.features[pixel], &self.features_of_a[pixel]);
        match half {
            _ if a == 0 || b == 0 => *whole,
            Half::A => *of_a,
            Half::B => whole.without(of_a, a as f32 / (a as f32 + b as f32)),
        }
    }

    /// Adds a block of samples to a pixel.
    pub fn merge_block(&mut self, work: BlockWork, block: &BlockSum) {
        let pixel = work.pixel as usize;
        let before = Half::BOTH.map(|half| self.half(half)[pixel].samples);
        self.halves[work.half.index()][pixel].merge(block);
        self.nonfinite_samples += u64::from(block.nonfinite);
        self.rays += block.rays;
        self.features[pixel].add_block(block, before[0] + before[1]);
        if work.half == Half::A {
            self.features_of_a[pixel].add_block(block, before[0]);
        }
    }

    /// Whether every pixel was sampled in both halves. Otherwise nothing is known of its noise: in a render of one
    /// sample a pixel, or one that was interrupted in its first pass.
    pub fn has_both_halves(&self) -> bool {
        self.halves.iter().flatten().all(|pixel| pixel.taken > 0)
    }

    /// Share of each pixel that something covers, weighed as the picture is: the mean of the halves.
    pub fn coverage(&self) -> Vec<f32> {
        let of = |half: &HalfPixel| f64::from(half.coverage());
        (0..self.features.len()).map(|pixel| self.halves(pixel).mean(of) as f32).collect()
    }

    /// Whether no sample of a pixel met anything or brought any light: there is nothing in it.
    pub fn is_void(&self, pixel: usize) -> bool {
        self.halves.iter().map(|half| &half[pixel]).all(|half| half.missed == half.samples && half.mean == [0.0; 3])
    }

    /// Samples that one half of a pixel was asked for, finite or not: where its sequence goes on.
    pub fn taken(&self, pixel: usize, half: Half) -> u32 {
        self.half(half)[pixel].taken
    }

    /// Variance of a pixel's mean over that of one sample: [`share_of_mean`].
    pub fn variance_share(&self, pixel: usize) -> f64 {
        share_of_mean(Half::BOTH.map(|half| self.half(half)[pixel].samples))
    }

    /// Samples of a pixel in both halves.
    pub fn samples(&self, pixel: usize) -> u32 {
        self.halves[0][pixel].samples + self.halves[1][pixel].samples
    }

    /// Samples of all pixels.
    pub fn total_samples(&self) -> u64 {
        self.halves.iter().flatten().map(|p| u64::from(p.samples)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::{FirstHit, PathSample};
    use glam::Vec3;

    fn sample(radiance: f32) -> PathSample {
        let first_hit = FirstHit { depth: 2.0, ..FirstHit::WALL };
        PathSample { radiance: Vec3::splat(radiance), first_hit, rays: 1 }
    }

    fn sum_of(values: &[f32]) -> BlockSum {
        let mut sum = BlockSum::default();
        values.iter().for_each(|&v| sum.add(&sample(v)));
        sum
    }

    #[test]
    fn values_that_are_not_finite_are_counted_and_kept_out() {
        let mut film = Film::new(1, 1);
        let work = BlockWork { samples: 4, ..BlockWork::whole(0, Half::A, 0) };
        film.merge_block(work, &sum_of(&[1.0, f32::NAN, f32::INFINITY, 3.0]));
        let pixel = film.half(Half::A)[0];
        assert_eq!((film.nonfinite_samples, pixel.samples, pixel.mean[0]), (2, 2, 2.0));
        assert!((pixel.sample_variance(0) - 2.0).abs() < 1e-6);
        film.merge_block(BlockWork { half: Half::B, ..work }, &sum_of(&[f32::NAN; 4]));
        assert_eq!(film.estimate(1.0).rgb_cd_m2[0], [2.0; 3], "an empty half leaves the picture to the other");
    }

    /// Merging blocks gives what one block of all samples gives; an empty block changes nothing.
    #[test]
    fn merging_is_adding() {
        let values: Vec<f32> = (0..64).map(|i| ((i * 37) % 64) as f32).collect();
        let work = |level| BlockWork::whole(0, Half::A, level);
        let (mut whole, mut parts) = (Film::new(1, 1), Film::new(1, 1));
        whole.merge_block(work(0), &sum_of(&values));
        parts.merge_block(work(0), &sum_of(&values[..17]));
        parts.merge_block(work(1), &BlockSum::default());
        parts.merge_block(work(2), &sum_of(&values[17..]));
        let (whole, parts) = (whole.half(Half::A)[0], parts.half(Half::A)[0]);
        assert_eq!(whole.samples, parts.samples);
        assert!((whole.mean[1] - parts.mean[1]).abs() < 1e-12);
        assert!((whole.sample_variance(0) / parts.sample_variance(0) - 1.0).abs() < 1e-6);
    }

    /// Of one sample in each half, half the squared difference is the variance without bias: 1/12 for uniform noise.
    #[test]
    fn two_single_samples_have_a_variance() {
        let random = |i: u32, half: Half| {
            crate::sampler::unit_of_hash(crate::sampler::hash_words(u64::from(i), half.index() as u64))
        };
        let mut film = Film::new(64, 64);
        for pixel in 0..64 * 64 {
            for half in Half::BOTH {
                assert!(!film.has_both_halves());
                let work = BlockWork { samples: 1, ..BlockWork::whole(pixel, half, 0) };
                film.merge_block(work, &sum_of(&[random(pixel, half)]));
            }
        }
        assert!(film.has_both_halves());
        let mean = (0..64 * 64).map(|pixel| film.halves(pixel).sample_variance(0)).sum::<f64>() / 4096.0;
        assert!((12.0 * mean - 1.0).abs() < 0.06, "{} times the truth", 12.0 * mean);
        let own = film.estimate(1.0).variance_of_mean;
        assert!((24.0 * own.mean() - 1.0).abs() < 0.06, "{} times the truth", 24.0 * own.mean());
        let more = BlockWork { first: 1, samples: 1, ..BlockWork::whole(0, Half::A, 0) };
        film.merge_block(more, &sum_of(&[random(0, Half::A) + 1.0]));
        let found = film.halves(0).sample_variance(0);
        assert!((found - 0.5).abs() < 1e-6, "a half of one sample takes the other's: {found}");
    }

    /// Where one half has all samples, as in a sum of renders of one sample with even seeds, it alone is the picture,
    /// and the variance is that of its mean. Regression: a quarter of it was told.
    #[test]
    fn a_half_without_samples_has_no_say() {
        for half in Half::BOTH {
            let mut film = Film::new(1, 1);
            let work = BlockWork { samples: 3, ..BlockWork::whole(0, half, 0) };
            film.merge_block(work, &sum_of(&[1.0, 2.0, 6.0]));
            assert_eq!((film.halves(0).sample_variance(0), film.halves(0).variance_of_mean(0)), (7.0, 7.0 / 3.0));
            assert_eq!(share_of_mean(Half::BOTH.map(|half| film.half(half)[0].samples)), 1.0 / 3.0);
            let Estimate { luminance_cd_m2, variance_of_mean, half_difference, .. } = film.estimate(2.0);
            let told = [luminance_cd_m2, variance_of_mean, half_difference].map(|plane| plane.get(0, 0));
            assert_eq!(told, [6.0, 28.0 / 3.0, 0.0], "luminance, its variance, and what halves differ by");
        }
    }

    /// Each half knows what its own samples have met, after blocks in any order; a surface at infinity leaves no number
    /// that is none.
    #[test]
    fn halves_have_features_of_their_own() {
        let sum = |albedo: f32, depth: f32, samples: u32| {
            let mut sum = BlockSum::default();
            for _ in 0..samples {
                let first_hit = FirstHit { albedo: Vec3::splat(albedo), depth, ..FirstHit::WALL };
                sum.add(&PathSample { radiance: Vec3::ONE, first_hit, rays: 1 });
            }
            sum
        };
        let mut film = Film::new(1, 1);
        let add = |film: &mut Film, half, level, sum: &BlockSum| {
            film.merge_block(BlockWork { half, ..BlockWork::whole(0, half, level) }, sum);
        };
        add(&mut film, Half::B, 0, &sum(0.25, 2.0, 2));
        assert_eq!(film.features_of_half(Half::A, 0), film.features()[0], "a half without samples has the other's");
        add(&mut film, Half::A, 0, &sum(1.0, 4.0, 2));
        add(&mut film, Half::B, 1, &sum(0.75, 3.0, 6));
        let [a, b] = Half::BOTH.map(|half| film.features_of_half(half, 0));
        assert_eq!((a.albedo[0], a.depth), (1.0, 4.0));
        assert!((b.albedo[0] - 0.625).abs() < 1e-6 && (b.depth - 2.75).abs() < 1e-6, "{b:?}");
        add(&mut film, Half::A, 1, &sum(1.0, f32::INFINITY, 2));
        assert_eq!(film.features_of_half(Half::B, 0).depth, f32::INFINITY, "where the whole is infinite");
    }

    /// Squares of light that is far above all others' are beyond f32: what the film keeps of them can still
    /// be read back and added to.
    #[test]
    fn no_finite_light_makes_a_film_that_cannot_be_read() {
        let film_of = |values: [&[f32]; 2]| {
            let mut film = Film::new(1, 1);
            for (level, values) in values.into_iter().enumerate() {
                for half in Half::BOTH {
                    film.merge_block(BlockWork { half, ..BlockWork::whole(0, half, level as u8) }, &sum_of(values));
                }
            }
            film
        };
        let mut film = film_of([&[0.0, 1e22, 3e22], &[f32::MAX; 2]]);
        film.check().expect("sound");
        film.add(&film_of([&[1e22, 0.0], &[1.0]])).expect("few samples");
        film.check().expect("sound after adding");
        assert_eq!(film.half(Half::B)[0].m2[0], f32::MAX);
    }

    #[test]
    fn a_pixel_takes_at_most_160_bytes() {
        assert!(2 * size_of::<HalfPixel>() + 2 * size_of::<PixelFeatures>() <= 160);
    }
}
