//! castleCSF for noise that is new in every frame of a moving picture.
//!
//! Such noise is flicker of all temporal frequencies at once, of which the eye integrates a part: it may be stronger
//! than noise that stands still. Not for pictures that somebody may pause, nor for error that travels with things.

use super::castle::CastleCsf;
use super::castle_chromatic::ChromaticChannel;
use super::castle_temporal::{
    Energies, between_levels, levels_cd_m2, sustained_response, transient, transient_response,
};
use super::{ContrastSensitivity, FrameTiming};
use crate::error::Error;

/// Sensitivity to the spatial frequencies of noise that is independent from frame to frame.
///
/// A pattern of one spatial frequency whose amplitude is drawn anew in each frame, and held for a share of it, has
/// the temporal power density 2T sinc²(f T p) per Hz (T the time of a frame, p the share, sinc(x) = sin πx / πx).
/// Weighted with castleCSF's temporal sensitivity ([`super::CastleTemporal`], squared) it gives the energy that the
/// eye receives; its root is the sensitivity here, so that S of this function stands for S of still noise in every
/// formula.
///
/// Spatial frequency and time separate within both channels, so three integrals over time for each luminance suffice.
#[derive(Clone, Debug)]
pub struct FreshNoise {
    still: CastleCsf,
    /// At the luminances of [`levels_cd_m2`].
    by_luminance: Vec<Energies>,
}

/// Beyond this nothing flickers for the eye: the sustained channel is at e⁻⁴³, the transient at 4 %, both times sinc².
pub(super) const HIGHEST_HZ: f64 = 120.0;
/// Steps of the integrals: at most this, and a sixteenth of the frame rate.
const HZ_STEP: f64 = 0.25;

impl FreshNoise {
    /// The name by which reports call this function.
    pub const NAME: &'static str = "castle-fresh-noise";

    /// Sensitivity to fresh noise for patterns that cover `area_deg2` square degrees, in frames of this timing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an area as in [`CastleCsf::new`] or an impossible timing.
    ///
    /// ```
    /// use fechner_perception::csf::{CastleCsf, ContrastSensitivity, FrameTiming, FreshNoise};
    /// let timing = FrameTiming { frames_per_second: 60.0, persistence: 1.0 };
    /// let (fresh, still) = (FreshNoise::new(1.0, timing)?, CastleCsf::new(1.0)?);
    /// // At 60 frames a second fine noise may have more than four times the variance.
    /// let ratio = still.sensitivity(16.0, 100.0) / fresh.sensitivity(16.0, 100.0);
    /// assert!(ratio * ratio > 4.0);
    /// # Ok::<(), fechner_perception::Error>(())
    /// ```
    pub fn new(area_deg2: f64, timing: FrameTiming) -> Result<Self, Error> {
        timing.check()?;
        let by_luminance = levels_cd_m2()
            .map(|luminance_cd_m2| {
                let transient = |hz: f64| transient_response(hz, luminance_cd_m2);
                Energies {
                    sustained: timing.seen_energy(|hz| sustained_response(hz).powi(2)),
                    mixed: timing.seen_energy(|hz| sustained_response(hz) * transient(hz)),
                    transient: timing.seen_energy(|hz| transient(hz).powi(2)),
                }
            })
            .collect();
        Ok(Self { still: CastleCsf::new(area_deg2)?, by_luminance })
    }

    fn energies(&self, luminance_cd_m2: f64) -> Energies {
        let levels = between_levels(luminance_cd_m2);
        let [low, high] = [levels.below, levels.above].map(|level| self.by_luminance[level]);
        Energies {
            sustained: levels.value(low.sustained, high.sustained),
            mixed: levels.value(low.mixed, high.mixed),
            transient: levels.value(low.transient, high.transient),
        }
    }
}

impl ContrastSensitivity for FreshNoise {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        let sustained = self.still.sensitivity(freq_cpd, luminance_cd_m2);
        let transient = if freq_cpd > 0.0 { transient(freq_cpd, luminance_cd_m2, self.still.area_deg2()) } else { 0.0 };
        self.energies(luminance_cd_m2).seen_by(sustained, transient).sqrt()
    }
}

impl FrameTiming {
    /// Share of the energy of fresh noise in a chromatic channel that the eye receives, against noise that stands
    /// still: castleCSF's chromatic channels (Ashraf et al. 2024) are sustained ones alone.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible timing.
    pub fn chromatic_energy(self, channel: ChromaticChannel) -> Result<f64, Error> {
        self.check()?;
        Ok(self.seen_energy(|hz| chromatic_response(channel, hz).powi(2)))
    }

    /// Steps of integrals over frequency.
    pub(super) fn hz_step(self) -> f64 {
        HZ_STEP.min(self.frames_per_second / 16.0)
    }

    /// ∫ 2T sinc²(f T p) r(f) df over what flickers for the eye, r being a squared response.
    pub(super) fn seen_energy(self, squared_response: impl Fn(f64) -> f64) -> f64 {
        let frame_s = 1.0 / self.frames_per_second;
        let density = |hz: f64| 2.0 * frame_s * self.held(hz).powi(2);
        let hz_step = self.hz_step();
        let steps = (HIGHEST_HZ / hz_step) as usize;
        let middle = |step: usize| (step as f64 + 0.5) * hz_step;
        let energy: f64 = (0..steps).map(|step| density(middle(step)) * squared_response(middle(step))).sum();
        // Frames slower than the eye's own integration stand still for it, and no noise is seen better than that.
        (energy * hz_step).min(1.0)
    }
}

/// Share of a chromatic channel's sensitivity that is left at a flicker frequency in Hz.
pub(super) fn chromatic_response(channel: ChromaticChannel, flicker_hz: f64) -> f64 {
    let (scale, exponent) = match channel {
        ChromaticChannel::RedGreen => (16.4325, 1.155_91),
        ChromaticChannel::YellowViolet => (7.150_12, 0.969_123),
    };
    (-flicker_hz.powf(exponent) / scale).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gain(frames_per_second: f64, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        let timing = FrameTiming { frames_per_second, persistence: 1.0 };
        let fresh = FreshNoise::new(1.0, timing).expect("in range");
        let still = CastleCsf::new(1.0).expect("in range");
        (still.sensitivity(freq_cpd, luminance_cd_m2) / fresh.sensitivity(freq_cpd, luminance_cd_m2)).powi(2)
    }

    /// Against integrals in steps of 0.01 Hz up to 400 Hz (`benches/peers/fresh_noise.py`), fine patterns first,
    /// where the transient channel sees nothing.
    #[test]
    fn integrals_agree_with_fine_quadrature() {
        for (fps, sustained, red_green, yellow_violet) in
            [(24.0, 3.9671, 2.5108, 3.6391), (30.0, 4.8574, 2.9520, 4.3642), (60.0, 9.4348, 5.3265, 8.1627)]
        {
            let timing = FrameTiming { frames_per_second: fps, persistence: 1.0 };
            let own = 1.0 / timing.seen_energy(|hz| sustained_response(hz).powi(2));
            assert!((own / sustained - 1.0).abs() < 2e-3, "{fps}: {own}");
            for (channel, expected) in
                [(ChromaticChannel::RedGreen, red_green), (ChromaticChannel::YellowViolet, yellow_violet)]
            {
                let own = 1.0 / timing.chromatic_energy(channel).expect("in range");
                assert!((own / expected - 1.0).abs() < 5e-3, "{fps} {channel:?}: {own}");
            }
        }
    }

    #[test]
    fn faster_frames_hide_more_and_slow_ones_nothing() {
        for freq_cpd in [2.0, 8.0, 20.0] {
            let gains = [24.0, 30.0, 60.0, 120.0].map(|fps| gain(fps, freq_cpd, 100.0));
            assert!(gains.windows(2).all(|pair| pair[0] < pair[1]), "{freq_cpd} cpd: {gains:?}");
            assert!(gain(1.0, freq_cpd, 100.0) < 1.3, "{freq_cpd}: {}", gain(1.0, freq_cpd, 100.0));
        }
        // Coarse flicker is seen by the transient channel: it gains less than fine noise, and at 24 frames a second
        // it is seen better than a still.
        assert!(gain(24.0, 0.3, 100.0) < 1.0 && gain(60.0, 0.3, 100.0) < gain(60.0, 8.0, 100.0));
    }

    #[test]
    fn nothing_is_out_of_range() {
        let timing = FrameTiming { frames_per_second: 24.0, persistence: 0.5 };
        let fresh = FreshNoise::new(1.0, timing).expect("in range");
        for freq in [0.0, 1e-6, 1.0, 1e6] {
            for luminance in [0.0, 1e-9, 1.0, 1e9] {
                assert!(fresh.sensitivity(freq, luminance).is_finite());
            }
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(FreshNoise::new(1.0, FrameTiming { frames_per_second: bad, persistence: 1.0 }).is_err());
            assert!(FreshNoise::new(1.0, FrameTiming { frames_per_second: 24.0, persistence: bad }).is_err());
        }
    }
}
