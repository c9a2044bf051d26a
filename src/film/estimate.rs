//! Reads what the film says so far, in cd/m². It takes no samples and changes nothing.

use super::{Film, HalfPixel, Halves};
use crate::sampler::Half;
use fechner_perception::Plane;

/// The picture and its statistics, row-major, in cd/m².
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Mean of the halves, (A + B) / 2, or the one half that has samples: linear RGB whose luminance is in cd/m².
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// Luminance of the picture.
    pub luminance_cd_m2: Plane,
    /// Variance of the picture's luminance from the samples' own scatter, in (cd/m²)²; see
    /// [`Halves::variance_of_mean`]. Above the true variance where samples are stratified.
    pub variance_of_mean: Plane,
    /// Half the halves' difference in luminance, (A − B) / 2, cd/m²: a realisation of the picture's error. 0 where
    /// only one half has samples.
    pub half_difference: Plane,
}

impl Film {
    /// RGB of one pixel of [`Estimate::rgb_cd_m2`], for who needs no more.
    pub fn rgb_cd_m2(&self, pixel: usize, nits_per_unit: f64) -> [f32; 3] {
        let halves = self.halves(pixel);
        std::array::from_fn(|c| (nits_per_unit * halves.mean(|half| half.mean[c])) as f32)
    }

    /// The mean of all samples of a pixel, whichever half they are in: less noisy than [`Self::rgb_cd_m2`] where one
    /// half has more, and without bias only as long as counts do not depend on samples, as in a pilot.
    pub fn mean_of_samples_cd_m2(&self, pixel: usize, nits_per_unit: f64) -> [f32; 3] {
        let [a, b] = Half::BOTH.map(|half| &self.half(half)[pixel]);
        let share = f64::from(b.samples) / f64::from((a.samples + b.samples).max(1));
        std::array::from_fn(|c| (nits_per_unit * (a.mean[c] + share * (b.mean[c] - a.mean[c]))) as f32)
    }

    /// The picture so far. `nits_per_unit`: luminance in cd/m² of RGB (1, 1, 1).
    pub fn estimate(&self, nits_per_unit: f64) -> Estimate {
        let plane = |value: &(dyn Fn(Halves<'_>) -> f64 + Sync)| self.plane(|pixel| value(self.halves(pixel)) as f32);
        let nits = nits_per_unit;
        Estimate {
            rgb_cd_m2: (0..self.pixel_count()).map(|pixel| self.rgb_cd_m2(pixel, nits)).collect(),
            luminance_cd_m2: plane(&|halves| nits * halves.mean(HalfPixel::luminance)),
            variance_of_mean: plane(&|halves| nits * nits * halves.variance_of_mean(0)),
            half_difference: plane(&|halves| nits * halves.half_difference(HalfPixel::luminance)),
        }
    }
}
