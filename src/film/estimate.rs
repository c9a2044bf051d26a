//! What the film says so far, in cd/m².

use super::{Film, HalfPixel, opponent, variance_of_mean};
use crate::sampler::Half;
use fechner_perception::Plane;

/// The picture and its statistics, row-major, in cd/m².
#[derive(Clone, Debug)]
pub struct Estimate {
    /// (A + B) / 2: linear RGB whose luminance is in cd/m².
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// Luminance of the picture.
    pub luminance_cd_m2: Plane,
    /// Variance of the picture's luminance from the samples' own scatter, (s_A²/n_A + s_B²/n_B) / 4, in (cd/m²)²; see
    /// [`Film::sample_variances`]. Above the true variance where samples are stratified.
    pub variance_of_mean: Plane,
    /// (A − B) / 2 in luminance: a realisation of the picture's error.
    pub half_difference: Plane,
}

/// A render of one sample has an empty half: the other is then the picture.
fn average(of_a: f64, of_b: f64, a: &HalfPixel, b: &HalfPixel) -> f64 {
    match (a.samples, b.samples) {
        (_, 0) => of_a,
        (0, _) => of_b,
        _ => 0.5 * (of_a + of_b),
    }
}

impl Film {
    /// One pixel of [`Estimate::rgb_cd_m2`], for who needs no more.
    pub fn rgb_cd_m2(&self, pixel: usize, nits_per_unit: f64) -> [f32; 3] {
        let [a, b] = Half::BOTH.map(|half| &self.half(half)[pixel]);
        std::array::from_fn(|c| (nits_per_unit * average(a.mean[c], b.mean[c], a, b)) as f32)
    }

    /// The mean of all samples of a pixel, whichever half they are in: less noisy than [`Self::rgb_cd_m2`] where one half has more,
    /// and without bias only as long as counts do not depend on samples, as in a pilot.
    pub fn mean_of_samples_cd_m2(&self, pixel: usize, nits_per_unit: f64) -> [f32; 3] {
        let [a, b] = Half::BOTH.map(|half| &self.half(half)[pixel]);
        let share = f64::from(b.samples) / f64::from((a.samples + b.samples).max(1));
        std::array::from_fn(|c| (nits_per_unit * (a.mean[c] + share * (b.mean[c] - a.mean[c]))) as f32)
    }

    /// The picture so far. `nits_per_unit`: luminance in cd/m² of RGB (1, 1, 1).
    pub fn estimate(&self, nits_per_unit: f64) -> Estimate {
        let (width, height) = (self.width() as usize, self.height() as usize);
        let (a, b) = (self.half(Half::A), self.half(Half::B));
        let plane = |value: &(dyn Fn(&HalfPixel, &HalfPixel) -> f64 + Sync)| {
            Plane::from_fn(width, height, |x, y| value(&a[y * width + x], &b[y * width + x]) as f32)
        };
        let nits = nits_per_unit;
        let y = |half: &HalfPixel| opponent(half.mean)[0];
        let variance = |x: usize, y: usize| {
            let pixel = y * width + x;
            let samples = [a[pixel].samples, b[pixel].samples];
            (nits * nits * variance_of_mean(self.sample_variances(pixel, 0), samples)) as f32
        };
        Estimate {
            rgb_cd_m2: (0..a.len()).map(|pixel| self.rgb_cd_m2(pixel, nits)).collect(),
            luminance_cd_m2: plane(&|a, b| nits * average(y(a), y(b), a, b)),
            variance_of_mean: Plane::from_fn(width, height, variance),
            half_difference: plane(&|a, b| 0.5 * nits * (y(a) - y(b))),
        }
    }
}
