//! Adds films of the same picture, and checks one that was in a file. Whether they are of one scene is left to
//! `checkpoint`.

use super::{Film, HalfPixel, Moments, PixelFeatures};
use crate::sampler::Half;
use fechner_perception::PIXELS_PER_TASK;
use rayon::prelude::*;

/// Most samples of a pixel's half that a film may hold: sums of a few films stay far from where counts wrap around.
const MAX_TAKEN: u32 = 1 << 29;

impl Film {
    /// Most samples of a pixel that a film may hold.
    pub const MAX_SAMPLES_PER_PIXEL: u32 = 2 * MAX_TAKEN;
    /// Most pixels that a film may have: they are numbered by `u32`, and halves of them counted.
    pub const MAX_PIXELS: u32 = u32::MAX / 2;

    /// Adds the samples of another film, half to half: as if one film had taken both. The other must be of this size
    /// and of other random numbers.
    ///
    /// # Errors
    /// Where a pixel would hold more samples than can be counted; nothing is added then.
    ///
    /// # Panics
    /// For a film of another size.
    pub fn add(&mut self, other: &Film) -> Result<(), &'static str> {
        assert_eq!((self.width, self.height), (other.width, other.height), "films of one size");
        let overflows = |(own, others): (&HalfPixel, &HalfPixel)| own.taken.saturating_add(others.taken) > MAX_TAKEN;
        if self.halves.iter().zip(&other.halves).any(|(own, others)| own.iter().zip(others).any(overflows)) {
            return Err("a pixel would have more samples than can be counted");
        }
        let [a, b] = &mut self.halves;
        let [other_a, other_b] = &other.halves;
        let pixels = (&mut self.features, &mut self.features_of_a, a, b).into_par_iter();
        let others = (&other.features, &other.features_of_a, other_a, other_b).into_par_iter();
        pixels.zip(others).with_min_len(PIXELS_PER_TASK).for_each(
            |((features, features_of_a, a, b), (other_features, other_features_of_a, other_a, other_b))| {
                features.add(other_features, a.samples + b.samples, other_a.samples + other_b.samples);
                features_of_a.add(other_features_of_a, a.samples, other_a.samples);
                a.combine(&Moments::of_half(other_a));
                b.combine(&Moments::of_half(other_b));
            },
        );
        self.nonfinite_samples = self.nonfinite_samples.saturating_add(other.nonfinite_samples);
        self.rays = self.rays.saturating_add(other.rays);
        Ok(())
    }

    /// This film with its halves in each other's place.
    #[must_use]
    pub fn with_halves_swapped(mut self) -> Self {
        let of_b: Vec<PixelFeatures> =
            (0..self.features.len()).map(|pixel| self.features_of_half(Half::B, pixel)).collect();
        self.features_of_a = of_b;
        self.halves.swap(0, 1);
        self
    }

    /// Whether one half has more samples than the other.
    pub fn has_uneven_halves(&self) -> bool {
        let [a, b] = self.halves.each_ref().map(|half| half.iter().map(|pixel| u64::from(pixel.taken)).sum::<u64>());
        a != b
    }

    /// Finds what no render leaves in a film.
    ///
    /// # Errors
    /// Says what is wrong.
    pub fn check(&self) -> Result<(), &'static str> {
        let pixels = u64::from(self.width) * u64::from(self.height);
        if pixels == 0 || pixels > u64::from(Self::MAX_PIXELS) {
            return Err("its size makes no sense");
        }
        let lengths = [self.halves[0].len(), self.halves[1].len(), self.features.len(), self.features_of_a.len()];
        if lengths.iter().any(|&length| length as u64 != pixels) {
            return Err("its pixels are not as many as its size says");
        }
        let is_sound = |pixel: &HalfPixel| {
            pixel.missed <= pixel.samples
                && pixel.samples <= pixel.taken
                && pixel.taken <= MAX_TAKEN
                && pixel.mean.iter().all(|mean| mean.is_finite())
                && pixel.m2.iter().all(|m2| m2.is_finite() && *m2 >= 0.0)
        };
        let are_sound_features = |features: &PixelFeatures| {
            let finite = |values: &[f32; 3]| values.iter().all(|value| value.is_finite());
            finite(&features.albedo) && finite(&features.normal) && !features.depth.is_nan()
        };
        if !self.halves.iter().flatten().all(is_sound)
            || !self.features.iter().chain(&self.features_of_a).all(are_sound_features)
        {
            return Err("a pixel holds what no samples can sum up to");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{BlockSum, opponent};
    use crate::integrator::{BlockWork, FirstHit, PathSample};
    use glam::Vec3;

    /// Samples of more than this have met a bright sky.
    const MISSED_FROM: f32 = 4.0;

    fn film_of(values: &[f32]) -> Film {
        let mut film = Film::new(1, 1);
        for (half, values) in Half::BOTH.into_iter().zip(values.chunks(values.len().div_ceil(2))) {
            let mut sum = BlockSum::default();
            for &value in values {
                let first_hit = FirstHit {
                    albedo: Vec3::splat(value),
                    normal: Vec3::Z,
                    depth: value,
                    object_id: if value > MISSED_FROM { 0 } else { 7 },
                    shines: value > MISSED_FROM,
                };
                sum.add(&PathSample { radiance: Vec3::new(value, 2.0 * value, 0.5), first_hit, rays: 3 });
            }
            film.merge_block(BlockWork { half, ..BlockWork::whole(0, half, 0) }, &sum);
        }
        film
    }

    /// The sum of two films has the counts, means, variances and features of all their samples together.
    #[test]
    fn sums_add() {
        let values: Vec<f32> = (0..40).map(|i| ((i * 29) % 40) as f32 * 0.1 + 0.3).collect();
        let (first, second) = values.split_at(14);
        let mut sum = film_of(first);
        sum.add(&film_of(second)).expect("few samples");
        sum.check().expect("sound");
        for half in Half::BOTH {
            let own = |values: &[f32]| -> Vec<f64> {
                let part = values.chunks(values.len().div_ceil(2)).nth(half.index()).expect("two halves");
                part.iter().map(|&v| f64::from(v)).collect()
            };
            let all = [own(first), own(second)].concat();
            let n = all.len() as f64;
            let mean = all.iter().sum::<f64>() / n;
            let luminance: Vec<f64> = all.iter().map(|&v| opponent([v, f64::from(2.0 * v as f32), 0.5])[0]).collect();
            let centre = luminance.iter().sum::<f64>() / n;
            let variance = luminance.iter().map(|y| (y - centre).powi(2)).sum::<f64>() / (n - 1.0);
            let pixel = sum.half(half)[0];
            assert_eq!((pixel.samples, pixel.taken), (all.len() as u32, all.len() as u32));
            let missed = all.iter().filter(|&&value| value > f64::from(MISSED_FROM)).count();
            assert_eq!(pixel.missed as usize, missed);
            assert!((pixel.mean[0] - mean).abs() < 1e-12, "{} for {mean}", pixel.mean[0]);
            assert!((pixel.sample_variance(0) / variance - 1.0).abs() < 1e-6);
        }
        let mean = values.iter().sum::<f32>() / 40.0;
        let features = sum.features()[0];
        assert!((features.depth - mean).abs() < 1e-5 && (features.albedo[2] - mean).abs() < 1e-5);
        assert_eq!((features.object.id(), features.object.shines(), sum.rays), (7, true, 120));
    }

    #[test]
    fn an_empty_film_changes_nothing_and_takes_everything() {
        let film = film_of(&[1.0, 2.0, 5.0]);
        let mut sum = film.clone();
        sum.add(&Film::new(1, 1)).expect("few samples");
        assert_eq!(sum, film);
        let mut sum = Film::new(1, 1);
        sum.add(&film).expect("few samples");
        assert_eq!(sum, film);
    }

    #[test]
    fn a_sum_that_cannot_be_counted_is_not_begun() {
        let film = film_of(&[1.0, 2.0]);
        let mut full = film.clone();
        full.halves[1][0].taken = MAX_TAKEN;
        let mut sum = film.clone();
        sum.add(&full).expect_err("too many");
        assert_eq!(sum, film);
    }

    #[test]
    fn what_no_render_leaves_is_found() {
        let changed = |change: &dyn Fn(&mut Film)| {
            let mut film = film_of(&[1.0, 2.0]);
            change(&mut film);
            film.check().is_err()
        };
        assert!(!changed(&|_| {}));
        assert!(changed(&|film| film.width = 0));
        assert!(changed(&|film| film.height = 2));
        assert!(changed(&|film| (film.width, film.height) = (1 << 16, 1 << 16)));
        assert!(changed(&|film| film.halves[1][0].mean[2] = f64::NAN));
        assert!(changed(&|film| film.halves[0][0].m2[1] = -1.0));
        assert!(changed(&|film| film.halves[0][0].samples = 9));
        assert!(changed(&|film| film.halves[1][0].missed = 2), "alpha would be below 0");
        assert!(changed(&|film| film.halves[0][0].taken = u32::MAX));
        assert!(changed(&|film| film.features[0].albedo[0] = f32::INFINITY));
        assert!(changed(&|film| film.features.clear()));
        assert!(changed(&|film| film.features_of_a[0].normal[1] = f32::NAN));
        assert!(changed(&|film| film.features_of_a.clear()));
    }
}
