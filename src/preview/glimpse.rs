//! What is shown while the camera moves: few pixels, as many as can be traced and shown in a frame's time.
//!
//! A glimpse has the first sample that the whole picture has at every `step`-th pixel, on a film of its own. It is
//! shown and thrown away; not for anything that is judged or kept.

use crate::film::Film;
use crate::integrator::{BlockWork, Crop, PathTracer};
use crate::sampler::Half;
use std::time::Duration;

/// Time that a glimpse may take, traced, encoded and sent: a tenth of a second less what waits before it.
const FRAME: Duration = Duration::from_millis(60);
/// Pixels of the first glimpse, before anything was measured.
const FIRST_PIXELS: f64 = 4096.0;
/// Fewer say nothing.
const MIN_PIXELS: f64 = 512.0;
/// How far off the wished number of pixels may be before the resolution changes: one that jumps is worse than either.
const TOLERANCE: f64 = 1.5;

/// A picture of few pixels.
pub(super) struct Glimpse {
    pub(super) film: Film,
    /// Distance in pixels of the whole picture between neighbours.
    pub(super) step: u32,
}

impl Glimpse {
    /// One sample at the middle of every square of `step`² pixels.
    pub(super) fn of(tracer: &PathTracer, step: u32) -> Self {
        let Crop { width, height, .. } = tracer.settings().film_area();
        let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
        let middle = |index: u32, size: u32| (index * step + step / 2).min(size - 1);
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        let of_place = |(x, y)| middle(y, height) * width + middle(x, width);
        let one = |pixel| BlockWork { samples: 1, ..BlockWork::whole(pixel, Half::A, 0) };
        let blocks: Vec<BlockWork> = places.map(of_place).map(one).collect();
        let mut sums = Vec::with_capacity(blocks.len());
        while sums.len() < blocks.len() {
            tracer.sum_batch(&blocks[sums.len()..], &mut sums, &|_| {});
        }
        let mut film = Film::new(columns, rows);
        for (place, (block, sum)) in (0..).zip(blocks.iter().zip(&sums)) {
            film.merge_block(BlockWork { pixel: place, ..*block }, sum);
        }
        Self { film, step }
    }
}

/// Follows what pixels cost, so that glimpses come in time.
pub(super) struct Resolution {
    pixels: f64,
    step: u32,
}

impl Resolution {
    pub(super) fn new() -> Self {
        Self { pixels: FIRST_PIXELS, step: 0 }
    }

    /// Distance between the pixels of the next glimpse of a picture of this size.
    pub(super) fn step(&mut self, width: u32, height: u32) -> u32 {
        let whole = f64::from(width) * f64::from(height);
        let now = whole / f64::from(self.step * self.step);
        if self.step == 0 || now > self.pixels * TOLERANCE || now * TOLERANCE < self.pixels {
            self.step = ((whole / self.pixels).sqrt().ceil() as u32).clamp(1, width.min(height));
        }
        self.step
    }

    /// A glimpse of so many pixels took so long: the next may have at most four times as many.
    pub(super) fn took(&mut self, pixels: u32, time: Duration) {
        let affordable = f64::from(pixels) * FRAME.as_secs_f64() / time.as_secs_f64().max(1e-4);
        self.pixels = affordable.clamp(MIN_PIXELS, 4.0 * self.pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::TraceSettings;
    use crate::scene::Scene;
    use std::sync::Arc;

    #[test]
    fn every_part_of_the_picture_has_its_pixel() {
        let tracer = PathTracer::new(Arc::new(Scene::default()), TraceSettings::new(40, 23, 1));
        for step in [1, 3, 7, 23, 64] {
            let glimpse = Glimpse::of(&tracer, step);
            let size = (glimpse.film.width(), glimpse.film.height());
            assert_eq!(size, (40_u32.div_ceil(step), 23_u32.div_ceil(step)));
            assert_eq!(glimpse.film.total_samples(), u64::from(size.0 * size.1));
        }
    }

    /// On a machine that is ten times as slow from some moment on, the resolution follows, and then stays.
    #[test]
    fn resolution_follows_the_machine() {
        let mut resolution = Resolution::new();
        let mut steps = Vec::new();
        for (frame, seconds_a_pixel) in [1e-6; 8].into_iter().chain([1e-5; 8]).enumerate() {
            let step = resolution.step(1920, 1080);
            let pixels = 1920_u32.div_ceil(step) * 1080_u32.div_ceil(step);
            // A tenth more or less is noise.
            let noise = if frame % 2 == 0 { 1.1 } else { 0.9 };
            resolution.took(pixels, Duration::from_secs_f64(f64::from(pixels) * seconds_a_pixel * noise));
            steps.push(step);
        }
        assert!(steps[4..8].iter().all(|&step| step == steps[4]) && steps[12..].iter().all(|&step| step == steps[12]));
        let pixels = |step: u32| 1920.0 * 1080.0 / f64::from(step * step);
        assert!((3e4..1.2e5).contains(&pixels(steps[7])) && (3e3..1.2e4).contains(&pixels(steps[15])), "{steps:?}");
    }
}
