//! A film whose uncovered parts let an even ground through. For judging, never for the picture that is written.

use super::{CHANNELS, Film, HalfPixel};

impl Film {
    /// The film as shown before a ground that is `ground_cd_m2` brighter than black: luminance alone, in cd/m².
    /// `scale`: displayed variance over scene variance of each pixel's luminance, row-major.
    ///
    /// # Panics
    /// Where there are fewer scales than pixels.
    #[must_use]
    pub fn over_ground(&self, scale: &[f32], ground_cd_m2: f64) -> Self {
        let over = |half: &Vec<HalfPixel>| -> Vec<HalfPixel> {
            half.iter().zip(scale).map(|(pixel, &scale)| pixel.over_ground(f64::from(scale), ground_cd_m2)).collect()
        };
        assert!(scale.len() >= self.features.len(), "a scale for each pixel");
        Self { halves: self.halves.each_ref().map(over), ..self.clone() }
    }
}

impl HalfPixel {
    /// A sample that met nothing brought no light, so the sum of light times coverage is that of light, and what both
    /// do together is known without having been summed: the squared deviations are those of
    /// light + ground · (1 − coverage).
    fn over_ground(&self, scale: f64, ground_cd_m2: f64) -> Self {
        let samples = f64::from(self.samples);
        let missed = f64::from(self.missed);
        let missed_share = missed / samples.max(1.0);
        let mut over = Self { m2: [0.0; CHANNELS], ..*self };
        if !scale.is_finite() {
            over.m2[0] = f32::INFINITY;
            return over;
        }
        let light = scale.sqrt() * self.luminance();
        let of_light = scale * f64::from(self.m2[0]);
        let of_ground = ground_cd_m2 * ground_cd_m2 * missed * (1.0 - missed_share);
        let of_both = -2.0 * ground_cd_m2 * missed * light;
        over.m2[0] = (of_light + of_ground + of_both).max(0.0) as f32;
        over.mean = [light + ground_cd_m2 * missed_share; 3];
        over
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::BlockSum;
    use crate::integrator::{BlockWork, FirstHit, PathSample};
    use crate::sampler::Half;
    use glam::Vec3;

    /// Mean and variance are those of the samples with the ground behind them.
    #[test]
    fn a_ground_shines_where_samples_met_nothing() {
        let (scale, ground) = (4.0f32, 10.0);
        let samples = [Some(0.5f32), None, Some(1.5), None, None, Some(3.0)];
        let mut sum = BlockSum::default();
        for sample in samples {
            let object_id = u32::from(sample.is_some());
            let first_hit = FirstHit { object_id, ..FirstHit::WALL };
            sum.add(&PathSample { radiance: Vec3::splat(sample.unwrap_or(0.0)), first_hit, rays: 1 });
        }
        let mut film = Film::new(1, 1);
        film.merge_block(BlockWork { samples: 6, ..BlockWork::whole(0, Half::A, 0) }, &sum);
        let over = film.over_ground(&[scale], ground);
        let shown = samples.map(|sample| sample.map_or(ground, |light| f64::from(2.0 * light)));
        let mean = shown.iter().sum::<f64>() / 6.0;
        let variance = shown.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 5.0;
        let found = over.half(Half::A)[0];
        assert!((found.mean[0] - mean).abs() < 1e-6, "{} for {mean}", found.mean[0]);
        assert!(
            (found.sample_variance(0) / variance - 1.0).abs() < 1e-5,
            "{} for {variance}",
            found.sample_variance(0)
        );
    }
}
