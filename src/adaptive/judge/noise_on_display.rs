//! What the display makes of the noise of samples.

use super::super::settings::LoopSettings;
use super::super::statistics::by_channel;
use crate::film::{CHANNELS, Film, share_of_mean};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::seen;
use fechner_perception::tone::FittedTone;

/// Variance of a pixel's mean over that of one sample: [`share_of_mean`].
pub fn variance_share(film: &Film, pixel: usize) -> f64 {
    share_of_mean(Half::BOTH.map(|half| film.half(half)[pixel].samples))
}

/// The same of every pixel.
pub fn variance_shares(film: &Film) -> Plane {
    film.plane(|pixel| variance_share(film, pixel) as f32)
}

/// What the display makes of noise.
pub(super) struct NoiseOnDisplay<'a> {
    /// [`variance_shares`].
    pub(super) shares: &'a Plane,
    pub(super) tone: &'a dyn FittedTone,
    pub(super) settings: &'a LoopSettings,
    /// Multiplies every variance.
    pub(super) inflation: f64,
}

impl NoiseOnDisplay<'_> {
    /// Displayed over scene variance in a channel about a luminance, cd/m². `variance`: of one sample of a pixel, in scene units.
    pub(super) fn scale(&self, channel: usize, light: &Plane, variance: impl Fn(usize) -> f64 + Sync) -> Plane {
        let nits_squared = self.settings.nits_per_unit * self.settings.nits_per_unit * self.inflation;
        let display = &self.settings.viewing.display;
        let scene = Plane::from_fn(light.width(), light.height(), |x, y| {
            let of_mean = variance(y * light.width() + x) * f64::from(self.shares.get(x, y));
            (of_mean * nits_squared) as f32
        });
        let displayed = if channel == 0 {
            seen::display_variance(self.tone, display, light, &scene)
        } else {
            seen::display_chromatic_variance(self.tone, display, light, &scene)
        };
        scene.combined(&displayed, |scene, displayed| {
            let (scene, displayed) = (f64::from(scene), f64::from(displayed));
            match displayed / scene * nits_squared {
                _ if scene == 0.0 => 0.0,
                scale if scale.is_finite() => scale as f32,
                // Nobody can say how it looks, least of all that it cannot be seen.
                _ => f32::INFINITY,
            }
        })
    }
}

/// Displayed variance over scene variance of each pixel, by channel, at the size that its variance has now: what the display
/// makes of a pixel's own noise, before any pooling. From scene units; inflation included. `shares`: [`variance_shares`].
pub fn display_scale(
    film: &Film,
    shares: &Plane,
    guide: &Plane,
    tone: &dyn FittedTone,
    settings: &LoopSettings,
    inflation: f64,
) -> [Plane; CHANNELS] {
    let noise = NoiseOnDisplay { shares, tone, settings, inflation };
    by_channel(|c| noise.scale(c, guide, |pixel| film.halves(pixel).sample_variance(c)))
}
