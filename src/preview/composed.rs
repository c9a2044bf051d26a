//! The picture that is shown, put together from a film or from what a look has denoised. Linear light: it is mapped
//! for the display elsewhere.

use super::coarse::stand_in;
use super::spectator::Stage;
use crate::film::Film;
use crate::integrator::PILOT_SAMPLES_PER_HALF;
use crate::sampler::Half;
use rayon::prelude::*;
use std::sync::Arc;

/// A picture, row-major, and how many samples each of its pixels has.
pub(super) struct Composed {
    /// Linear RGB in cd/m².
    pub(super) rgb_cd_m2: Arc<Vec<[f32; 3]>>,
    pub(super) samples: Vec<u32>,
}

impl Composed {
    /// A denoised picture, of whose film the samples alone are asked for.
    pub(super) fn of_denoised(rgb_cd_m2: &Arc<Vec<[f32; 3]>>, film: &Film) -> Self {
        let samples = (0..film.pixel_count()).into_par_iter().map(|pixel| film.samples(pixel)).collect();
        Self { rgb_cd_m2: Arc::clone(rgb_cd_m2), samples }
    }

    /// The picture of the film itself; where a pixel has no samples, another's. In one walk: a film is many
    /// times as large as a picture.
    pub(super) fn of_film(film: &Film, nits_per_unit: f64, stage: Stage) -> Self {
        // While a pixel's pilot is traced one half is ahead of the other, and their samples count alike.
        let is_in_pilot =
            |pixel: usize| Half::BOTH.iter().all(|&half| film.taken(pixel, half) <= PILOT_SAMPLES_PER_HALF);
        let light = |pixel: usize| {
            let light = match stage {
                Stage::UnderWay if is_in_pilot(pixel) => Film::mean_of_samples_cd_m2,
                _ => Film::rgb_cd_m2,
            };
            light(film, pixel, nits_per_unit)
        };
        let of_pixel = |pixel: usize| match film.samples(pixel) {
            0 => (stand_in(film, pixel).map_or([0.0; 3], light), 0),
            samples => (light(pixel), samples),
        };
        let (mut rgb_cd_m2, mut samples) = (Vec::new(), Vec::new());
        (0..film.pixel_count()).into_par_iter().map(of_pixel).unzip_into_vecs(&mut rgb_cd_m2, &mut samples);
        Self { rgb_cd_m2: Arc::new(rgb_cd_m2), samples }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::BlockSum;
    use crate::integrator::{BlockWork, PathSample};
    use glam::Vec3;

    /// In a pixel's pilot samples count alike, later and at rest halves do, whatever was looked at before.
    #[test]
    fn a_half_that_is_ahead_counts_for_its_samples_only_in_the_pilot() {
        let mut film = Film::new(2, 1);
        let mut add = |work: BlockWork, grey: f32| {
            let mut sum = BlockSum::default();
            (0..work.samples).for_each(|_| sum.add(&PathSample::of_wall(Vec3::splat(grey))));
            film.merge_block(work, &sum);
        };
        for pixel in [0, 1] {
            add(BlockWork::whole(pixel, Half::A, 0), 1.0);
        }
        add(BlockWork { samples: 2, ..BlockWork::whole(0, Half::B, 0) }, 2.0);
        add(BlockWork::whole(1, Half::B, 0), 2.0);
        add(BlockWork::whole(1, Half::A, 1), 1.0);
        let composed = |stage| Composed::of_film(&film, 1.0, stage);
        let greys = |stage| composed(stage).rgb_cd_m2.iter().map(|rgb| rgb[0]).collect::<Vec<f32>>();
        assert_eq!(greys(Stage::UnderWay), [1.2, 1.5]);
        assert_eq!(greys(Stage::AtRest), [1.5, 1.5]);

        // A denoised picture changes nothing about samples, and is not copied.
        let rgb_cd_m2 = Arc::new(vec![[7.0; 3]; 2]);
        let denoised = Composed::of_denoised(&rgb_cd_m2, &film);
        assert!(Arc::ptr_eq(&denoised.rgb_cd_m2, &rgb_cd_m2));
        assert_eq!(denoised.samples, composed(Stage::AtRest).samples);
    }
}
