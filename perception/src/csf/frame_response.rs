//! What a frame of a moving picture leaves in the eye's temporal channels, a frame and several frames away.

use super::castle_chromatic::ChromaticChannel;
use super::castle_temporal::{sustained_response, transient_response};
use super::fresh_noise::{HIGHEST_HZ, chromatic_response};
use super::{ContrastSensitivity, FrameTiming};
use crate::error::Error;
use std::f64::consts::TAU;

/// Seconds before and after a moment whose frames it is seen with: the sustained channel's response has fallen to 1 % by then.
const REACH_S: f64 = 0.2;
/// Transient responses are tabulated from this decade of luminance on, in steps of a quarter.
const LOWEST_DECADE: f64 = -3.0;
const DECADE_STEPS: usize = 4;
const LEVELS: usize = 7 * DECADE_STEPS + 1;

/// Weights of frames by their distance in time from the one that is looked at, 0 first.
pub(crate) type Weights = Vec<f32>;

/// castleCSF's temporal channels (Ashraf et al. 2024) as weights of frames.
///
/// A channel with the temporal response R(f), taken without phase, leaves h(k) = T ∫ R(f) sinc(f T p) cos(2π f k T) df of a
/// frame k frames away (T the time of a frame, p the share of it for which it is lit). The sustained channels' weights add
/// up to 1, so that what stands still is seen as in a still; the transient one's to 0, with the energy for fresh noise that
/// [`super::FreshNoise`] has.
#[derive(Clone, Debug)]
pub(crate) struct FrameResponses {
    pub(crate) sustained: Weights,
    pub(crate) red_green: Weights,
    pub(crate) yellow_violet: Weights,
    /// By luminance.
    transient: Vec<Weights>,
}

impl FrameResponses {
    pub(crate) fn new(timing: FrameTiming) -> Result<Self, Error> {
        timing.check()?;
        let transient = (0..LEVELS).map(|level| {
            let luminance_cd_m2 = 10f64.powf(LOWEST_DECADE + level as f64 / DECADE_STEPS as f64);
            timing.transient_weights(|hz| transient_response(hz, luminance_cd_m2))
        });
        let chromatic = |channel| timing.still_weights(|hz| chromatic_response(channel, hz));
        Ok(Self {
            transient: transient.collect(),
            red_green: chromatic(ChromaticChannel::RedGreen),
            yellow_violet: chromatic(ChromaticChannel::YellowViolet),
            sustained: timing.still_weights(sustained_response),
        })
    }

    /// Frames to each side that have a weight.
    pub(crate) fn reach(&self) -> usize {
        self.sustained.len() - 1
    }

    /// The transient channel's weight of a frame that is this far away, for an eye adapted to a luminance.
    pub(crate) fn transient(&self, distance: usize, adaptation_cd_m2: f32) -> f32 {
        let decades = f64::from(adaptation_cd_m2.max(1e-6)).log10() - LOWEST_DECADE;
        let position = (decades * DECADE_STEPS as f64).clamp(0.0, (LEVELS - 1) as f64);
        let below = (position as usize).min(LEVELS - 2);
        let share = (position - below as f64) as f32;
        let [low, high] = [below, below + 1].map(|level| self.transient[level][distance]);
        low + share * (high - low)
    }
}

impl FrameTiming {
    /// Frames to each side of one that reach it: up to 200 at the highest rate.
    fn reach(self) -> usize {
        ((REACH_S * self.frames_per_second).ceil() as usize).max(1)
    }

    /// h(k) for k from 0 on.
    fn weights(self, response: impl Fn(f64) -> f64) -> Vec<f64> {
        let frame_s = 1.0 / self.frames_per_second;
        let hz_step = 0.25f64.min(self.frames_per_second / 64.0);
        let middles: Vec<f64> =
            (0..(HIGHEST_HZ / hz_step) as usize).map(|step| (step as f64 + 0.5) * hz_step).collect();
        let densities: Vec<f64> =
            middles.iter().map(|&hz| 2.0 * frame_s * hz_step * response(hz) * self.held(hz)).collect();
        let at = |frames: usize| {
            let phase = TAU * frames as f64 * frame_s;
            middles.iter().zip(&densities).map(|(hz, density)| density * (phase * hz).cos()).sum()
        };
        (0..=self.reach()).map(at).collect()
    }

    /// Weights of a channel that sees what stands still whole.
    fn still_weights(self, response: impl Fn(f64) -> f64) -> Weights {
        with_sum(self.weights(response), 1.0).iter().map(|&weight| weight as f32).collect()
    }

    /// Weights of a channel that sees nothing of what stands still.
    fn transient_weights(self, response: impl Fn(f64) -> f64 + Copy) -> Weights {
        let weights = with_sum(self.weights(response), 0.0);
        let energy = sum_both_sides(&weights, |weight| weight * weight).max(1e-30);
        let scale = (self.seen_energy(|hz| response(hz).powi(2)) / energy).sqrt();
        weights.iter().map(|weight| (weight * scale) as f32).collect()
    }
}

/// What the window's end cuts off is slow: it is spread evenly over all frames.
fn with_sum(weights: Vec<f64>, sum: f64) -> Vec<f64> {
    let missing = (sum - sum_both_sides(&weights, |weight| weight)) / (2 * weights.len() - 1) as f64;
    weights.iter().map(|weight| weight + missing).collect()
}

/// Over frames before, at and after.
fn sum_both_sides(weights: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    2.0 * weights.iter().map(|&weight| of(weight)).sum::<f64>() - of(weights[0])
}

/// The transient channel's spatial sensitivity, at its best flicker.
pub(crate) struct CastleTransient {
    pub(crate) area_deg2: f64,
}

impl ContrastSensitivity for CastleTransient {
    fn name(&self) -> &'static str {
        "castle-transient"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        if freq_cpd > 0.0 { super::castle_temporal::transient(freq_cpd, luminance_cd_m2, self.area_deg2) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The weights' energy for noise that is new in every frame is what the integrals over all frequencies say: exactly for the
    /// transient channel, but for what frames alias for the sustained one.
    #[test]
    fn fresh_noise_keeps_its_energy() {
        for frames_per_second in [24.0, 30.0, 60.0, 120.0] {
            let timing = FrameTiming { frames_per_second, persistence: 1.0 };
            let responses = FrameResponses::new(timing).unwrap();
            let energy = |weights: &Weights| {
                sum_both_sides(&weights.iter().map(|&w| f64::from(w)).collect::<Vec<_>>(), |w| w * w)
            };
            let expected = timing.seen_energy(|hz| sustained_response(hz).powi(2));
            let ratio = energy(&responses.sustained) / expected;
            assert!((ratio - 1.0).abs() < 0.04, "{frames_per_second}: {ratio}");
            let transient: Weights = (0..=responses.reach()).map(|k| responses.transient(k, 100.0)).collect();
            let expected = timing.seen_energy(|hz| transient_response(hz, 100.0).powi(2));
            assert!((energy(&transient) / expected - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn what_stands_still_is_for_the_sustained_channels_alone() {
        for frames_per_second in [1.0, 24.0, 240.0, 1000.0] {
            let timing = FrameTiming { frames_per_second, persistence: 0.5 };
            let responses = FrameResponses::new(timing).unwrap();
            let sum =
                |weights: &[f32]| sum_both_sides(&weights.iter().map(|&w| f64::from(w)).collect::<Vec<_>>(), |w| w);
            for weights in [&responses.sustained, &responses.red_green, &responses.yellow_violet] {
                assert!((sum(weights) - 1.0).abs() < 1e-5);
            }
            for luminance in [0.0, 1e-3, 7.0, 1e9] {
                let transient: Weights = (0..=responses.reach()).map(|k| responses.transient(k, luminance)).collect();
                assert!(sum(&transient).abs() < 1e-5, "{frames_per_second} {luminance}: {transient:?}");
            }
        }
    }
}
