//! Makes films of samples that tests make up.

use super::{BlockSum, Film};
use crate::integrator::{BlockWork, PathSample};
use crate::sampler::Half;

/// A film of so many samples of each half of every pixel, made of the pixel, the half and the sample's number.
pub(crate) fn film_of_samples(
    [width, height]: [u32; 2],
    samples: [u32; 2],
    mut sample: impl FnMut(u32, Half, u32) -> PathSample,
) -> Film {
    let mut film = Film::new(width, height);
    for pixel in 0..width * height {
        for (half, samples) in Half::BOTH.into_iter().zip(samples) {
            let mut sum = BlockSum::default();
            (0..samples).for_each(|index| sum.add(&sample(pixel, half, index)));
            film.merge_block(BlockWork { samples, ..BlockWork::whole(pixel, half, 0) }, &sum);
        }
    }
    film
}
