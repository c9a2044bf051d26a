//! What a frame of a moving picture leaves in the eye's temporal channels, a frame and several frames away.
//!
//! For frames within 0.2 s of the one that is shown. Not for the flicker that a display of short flashes adds to all
//! that it shows, which is left out.

use super::castle_chromatic::ChromaticChannel;
use super::castle_temporal::{between_levels, levels_cd_m2, sustained_response, transient_response};
use super::fresh_noise::{HIGHEST_HZ, chromatic_response};
use super::{ContrastSensitivity, FrameTiming};
use crate::error::Error;
use crate::table::Between;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Seconds before and after a moment whose frames it is seen with: the sustained channel's response has fallen to 1 %
/// by then.
const REACH_S: f64 = 0.2;

/// Looks at a display in a second, at the least: a step of light is seen most some 20 ms before and after it, and
/// flicker of 12 Hz at its peak. Measured on flicker of ±3 % at 12 Hz: one look in the middle of each of 24 frames
/// finds 0.80 of its contrast over threshold.
const LOOKS_PER_SECOND: f64 = 120.0;

/// Weights of frames around the one that is shown, from [`FrameResponses::reach`] frames earlier to as many later.
pub(crate) type Weights = Vec<f32>;

/// castleCSF's temporal channels (Ashraf et al. 2024) as weights of frames, at several moments while one of them is
/// shown.
///
/// A channel with the temporal response R(f), taken without phase, leaves h(k, t) = T ∫ R(f) sinc(f T p) cos(2π f (k
/// T − t)) df of a frame k frames away, t after the middle of the one that is shown (T the time of a frame, p the
/// share of it for which it is lit). Without a scale of its own: over all moments fresh noise has the energy of
/// [`super::FreshNoise`], and the same light is seen alike at any frame rate.
///
/// What stands still is seen as in a still: the sustained channels' weights add up to 1, and the transient one's to
/// 0. The flicker that a display of short flashes adds to all that it shows is left out.
#[derive(Clone, Debug)]
pub(crate) struct FrameResponses {
    reach: usize,
    /// What the sustained channels hold in the middle of a frame.
    pub(crate) middle: Sustained,
    /// How much of what each frame shows any channel holds at any look, as shares of 1.
    pub(crate) most: Weights,
    /// Spread evenly over the time of a frame.
    pub(crate) looks: Vec<Look>,
}

/// Weights of luminance, red–green and yellow–violet in the sustained channels.
pub(crate) type Sustained = [Weights; 3];

/// What frames leave at one moment.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub(crate) sustained: Sustained,
    /// At the luminances of [`levels_cd_m2`].
    transient: Vec<Weights>,
}

/// Where a luminance stands between those that transient responses are tabulated for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    below: usize,
    above: usize,
    share: f32,
}

impl Level {
    pub(crate) fn of(adaptation_cd_m2: f32) -> Self {
        let Between { below, above, share } = between_levels(f64::from(adaptation_cd_m2));
        Self { below, above, share: share as f32 }
    }
}

impl Look {
    /// The transient channel's weight of a frame, for an eye adapted to a luminance.
    pub(crate) fn transient(&self, frame: usize, level: Level) -> f32 {
        let [low, high] = [level.below, level.above].map(|level| self.transient[level][frame]);
        low + level.share * (high - low)
    }
}

impl FrameResponses {
    pub(crate) fn new(timing: FrameTiming) -> Result<Self, Error> {
        timing.check()?;
        let count = (LOOKS_PER_SECOND / timing.frames_per_second).ceil() as usize;
        let frame_s = 1.0 / timing.frames_per_second;
        let moment_s = |look: usize| ((look as f64 + 0.5) / count as f64 - 0.5) * frame_s;
        let looks: Vec<Look> = (0..count).map(|look| Moment::new(timing, moment_s(look)).look()).collect();
        let middle = Moment::new(timing, 0.0).sustained();
        Ok(Self { reach: timing.reach(), middle, most: most_held(&looks), looks })
    }

    /// Frames to each side that have a weight.
    pub(crate) fn reach(&self) -> usize {
        self.reach
    }

    /// These responses where only so many frames are before the one that is shown and so many after it: those that
    /// nobody has are expected to go on as the others do, in what stands still and in what changes from frame to frame
    /// and back, and leave them what they weigh in both. What stands still is then seen as in a still, flicker of every
    /// other frame as amid others, slower flicker on 100 cd/m² at 24 to 60 frames a second 0.73 to 1.18 as well (in dim
    /// light or colours, where next to nothing is seen amid others, several times that), and noise that is new in every
    /// frame nearly as amid others: the sustained channel holds 1.05 of it at 24 frames a second and at 60. *Turned
    /// down:* the mean alone (the first frame of a flicker of ±5 % at 30 Hz has 3.2 times the visibility of those
    /// within); ends that stand still (1.46 and 1.89 of noise); frames that come again as in a mirror (1.15 and 1.30).
    pub(crate) fn within(&self, earlier: usize, later: usize) -> Self {
        let there = self.reach.saturating_sub(earlier)..=self.reach + later.min(self.reach);
        let of = |weights: &Weights| shared(weights, &there);
        let sustained = |weights: &Sustained| weights.each_ref().map(of);
        let look = |look: &Look| Look {
            sustained: sustained(&look.sustained),
            transient: look.transient.iter().map(of).collect(),
        };
        let looks: Vec<Look> = self.looks.iter().map(look).collect();
        Self { reach: self.reach, middle: sustained(&self.middle), most: most_held(&looks), looks }
    }
}

/// [`FrameResponses::most`].
fn most_held(looks: &[Look]) -> Weights {
    let channels = || looks.iter().flat_map(|look| look.transient.iter().chain(&look.sustained[..1]));
    let most_of = |frame: usize| channels().map(|weights| weights[frame].abs()).fold(0.0, f32::max);
    let most: Vec<f32> = (0..looks[0].sustained[0].len()).map(most_of).collect();
    let sum: f32 = most.iter().sum();
    most.into_iter().map(|weight| weight / sum).collect()
}

/// Weights of the frames that are there, which take those of the others: what they add to light that stands still,
/// and to light that changes from frame to frame and back.
fn shared(weights: &[f32], there: &RangeInclusive<usize>) -> Weights {
    let alternating = |frame: usize| if frame.is_multiple_of(2) { 1.0 } else { -1.0 };
    let missing = || weights.iter().enumerate().filter(|(frame, _)| !there.contains(frame));
    let still: f32 = missing().map(|(_, weight)| weight).sum();
    let flicker: f32 = missing().map(|(frame, weight)| alternating(frame) * weight).sum();
    let count = there.clone().count() as f32;
    let in_step: f32 = there.clone().map(alternating).sum();
    // Weights a + b (−1)^k of the frames k that are there with these two sums; of a lone frame, the first alone.
    let determinant = count * count - in_step * in_step;
    let (even, odd) = if determinant > 0.0 {
        ((count * still - in_step * flicker) / determinant, (count * flicker - in_step * still) / determinant)
    } else {
        (still, 0.0)
    };
    let of_frame = |(frame, weight): (usize, &f32)| {
        if there.contains(&frame) { weight + even + odd * alternating(frame) } else { 0.0 }
    };
    weights.iter().enumerate().map(of_frame).collect()
}

impl FrameTiming {
    /// Frames to each side of one that reach it: up to 200 at the highest rate.
    fn reach(self) -> usize {
        ((REACH_S * self.frames_per_second).ceil() as usize).max(1)
    }
}

/// One moment, and how the waves of all frequencies stand to it.
struct Moment {
    timing: FrameTiming,
    hz_step: f64,
    hz: Vec<f64>,
    /// Waves of each frame, by frequency.
    waves: Vec<Vec<f64>>,
}

impl Moment {
    /// The moment `moment_s` seconds after the middle of the frame that is shown.
    fn new(timing: FrameTiming, moment_s: f64) -> Self {
        let hz_step = timing.hz_step();
        let hz: Vec<f64> = (0..(HIGHEST_HZ / hz_step) as usize).map(|step| (step as f64 + 0.5) * hz_step).collect();
        let reach = timing.reach() as f64;
        let of_frame = |frame: usize| {
            let distance_s = (frame as f64 - reach) / timing.frames_per_second - moment_s;
            hz.iter().map(|hz| (TAU * hz * distance_s).cos()).collect()
        };
        let waves = (0..=2 * timing.reach()).map(of_frame).collect();
        Self { timing, hz_step, hz, waves }
    }

    /// h(k, t) of a display that is lit for a share of its time.
    fn weights(&self, response: impl Fn(f64) -> f64, persistence: f64) -> Vec<f64> {
        let timing = FrameTiming { persistence, ..self.timing };
        let scale = 2.0 * self.hz_step / timing.frames_per_second;
        let densities: Vec<f64> = self.hz.iter().map(|&hz| scale * response(hz) * timing.held(hz)).collect();
        self.waves.iter().map(|wave| wave.iter().zip(&densities).map(|(wave, density)| wave * density).sum()).collect()
    }

    /// Weights in a sustained channel of frames that are held. They add up to 1: what the window's ends cut off is
    /// slow, and is spread evenly over all frames.
    fn held(&self, response: impl Fn(f64) -> f64) -> Vec<f64> {
        let weights = self.weights(response, 1.0);
        let cut_off = (1.0 - weights.iter().sum::<f64>()) / weights.len() as f64;
        weights.iter().map(|weight| weight + cut_off).collect()
    }

    /// Weights in a channel that leaves `still` of what stands still. Nothing is scaled, since what is there may be
    /// near 0: what the window's ends cut off is spread evenly, and what a display's flashes add to a still is taken
    /// from frames as the eye holds them.
    fn with_sum(&self, response: impl Fn(f64) -> f64 + Copy, still: f64, held: &[f64]) -> Weights {
        let weights = self.weights(response, self.timing.persistence);
        let sum_if_held = self.weights(response, 1.0).iter().sum::<f64>();
        let cut_off = (still - sum_if_held) / weights.len() as f64;
        let of_flashes = weights.iter().sum::<f64>() - sum_if_held;
        weights.iter().zip(held).map(|(weight, held)| (weight + cut_off - of_flashes * held) as f32).collect()
    }

    fn still(&self, response: impl Fn(f64) -> f64 + Copy) -> Weights {
        self.with_sum(response, 1.0, &self.held(response))
    }

    fn sustained(&self) -> Sustained {
        let chromatic = |channel| self.still(|hz| chromatic_response(channel, hz));
        [
            self.still(sustained_response),
            chromatic(ChromaticChannel::RedGreen),
            chromatic(ChromaticChannel::YellowViolet),
        ]
    }

    fn look(&self) -> Look {
        let held = self.held(sustained_response);
        let transient = levels_cd_m2().map(|luminance_cd_m2| {
            let response = |hz: f64| transient_response(hz, luminance_cd_m2);
            self.with_sum(response, 0.0, &held)
        });
        Look { transient: transient.collect(), sustained: self.sustained() }
    }
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

    fn sum(weights: &[f32], of: impl Fn(f64) -> f64) -> f64 {
        weights.iter().map(|&weight| of(f64::from(weight))).sum()
    }

    fn transient(look: &Look, luminance_cd_m2: f32) -> Weights {
        (0..look.sustained[0].len()).map(|frame| look.transient(frame, Level::of(luminance_cd_m2))).collect()
    }

    /// Over all looks, the weights' energy for noise that is new in every frame is what the integrals over all
    /// frequencies say.
    #[test]
    fn fresh_noise_keeps_its_energy() {
        for frames_per_second in [6.0, 24.0, 30.0, 60.0, 120.0] {
            let timing = FrameTiming { frames_per_second, persistence: 1.0 };
            let looks = FrameResponses::new(timing).unwrap().looks;
            let mean = |of: &dyn Fn(&Look) -> f64| looks.iter().map(of).sum::<f64>() / looks.len() as f64;
            let energy = mean(&|look| sum(&look.sustained[0], |weight| weight * weight));
            let ratio = energy / timing.seen_energy(|hz| sustained_response(hz).powi(2));
            assert!((ratio - 1.0).abs() < 0.04, "{frames_per_second}, sustained: {ratio}");
            for luminance in [10.0, 100.0, 1000.0] {
                let energy = mean(&|look| sum(&transient(look, luminance), |weight| weight * weight));
                let ratio = energy / timing.seen_energy(|hz| transient_response(hz, f64::from(luminance)).powi(2));
                assert!((ratio - 1.0).abs() < 0.04, "{frames_per_second}, {luminance} cd/m²: {ratio}");
            }
        }
    }

    #[test]
    fn what_stands_still_is_for_the_sustained_channels_alone() {
        for (frames_per_second, persistence) in
            [(1.0, 0.5), (1.0, 1e-3), (3.0, 0.5), (24.0, 0.5), (24.0, 1.0), (240.0, 0.5), (1000.0, 0.5)]
        {
            let responses = FrameResponses::new(FrameTiming { frames_per_second, persistence }).unwrap();
            for look in &responses.looks {
                for weights in look.sustained.iter().chain(&responses.middle) {
                    assert!((sum(weights, |weight| weight) - 1.0).abs() < 1e-5);
                }
                for luminance in [0.0, 1e-3, 7.0, 1e9] {
                    let weights = transient(look, luminance);
                    let sum = sum(&weights, |weight| weight);
                    assert!(sum.abs() < 1e-5, "{frames_per_second} {luminance}: {weights:?}");
                }
            }
        }
    }

    /// At an end of a sequence, nearly as amid its frames; and what stands still as in a still, however few there are.
    #[test]
    fn ends_of_sequences_weigh_like_their_middles() {
        let energy = |responses: &FrameResponses, of: &dyn Fn(&Look) -> Weights| {
            responses.looks.iter().map(|look| sum(&of(look), |weight| weight * weight)).sum::<f64>()
        };
        for frames_per_second in [6.0, 12.0, 24.0, 30.0, 60.0, 120.0] {
            let responses = FrameResponses::new(FrameTiming { frames_per_second, persistence: 1.0 }).unwrap();
            let reach = responses.reach();
            for (earlier, later) in [(0, reach), (reach, 0), (0, 0), (1, 0), (1, reach), (reach, usize::MAX)] {
                let end = responses.within(earlier, later);
                let both = |of: &dyn Fn(&Look) -> Weights| (energy(&end, of) / energy(&responses, of)).sqrt();
                let sustained = both(&|look| look.sustained[0].clone());
                let flicker = both(&|look| transient(look, 100.0));
                println!(
                    "{frames_per_second} a second, {earlier} before and {later} after: {sustained:.3} {flicker:.3}"
                );
                if earlier == reach || later == reach {
                    assert!((sustained - 1.0).abs() < 0.1 && (flicker - 0.9).abs() < 0.12, "{sustained} {flicker}");
                }
                for look in &end.looks {
                    assert!((sum(&look.sustained[0], |weight| weight) - 1.0).abs() < 1e-5);
                    assert!(sum(&transient(look, 100.0), |weight| weight).abs() < 1e-5);
                }
            }
        }
    }

    /// Flicker of frame after frame is seen at an end of a sequence as amid its frames, and slower flicker not much
    /// better. Regression: with what is beyond taken for the mean of what is there, the first frame of a flicker at
    /// 30 Hz and 60 frames a second had 3 times the visibility of those within.
    #[test]
    fn flicker_is_seen_alike_at_ends() {
        for frames_per_second in [24.0, 30.0, 50.0, 60.0, 120.0] {
            let responses = FrameResponses::new(FrameTiming { frames_per_second, persistence: 1.0 }).unwrap();
            let end = responses.within(0, responses.reach());
            for frames_a_period in [2.0, 3.0, 4.0, 6.0] {
                // The best phase of each look.
                let seen = |responses: &FrameResponses| {
                    let energy = |look: &Look| {
                        let weights = transient(look, 100.0);
                        let wave = |phase: f64| {
                            let at = |frame: usize| (TAU * frame as f64 / frames_a_period + phase).cos();
                            weights.iter().enumerate().map(|(k, &weight)| at(k) * f64::from(weight)).sum::<f64>()
                        };
                        wave(0.0).powi(2) + wave(0.25 * TAU).powi(2)
                    };
                    (responses.looks.iter().map(energy).sum::<f64>() / responses.looks.len() as f64).sqrt()
                };
                let [at_end, within] = [seen(&end), seen(&responses)];
                println!(
                    "{frames_per_second} a second, {frames_a_period} frames a period: {at_end:.4} for {within:.4}"
                );
                let ratio = at_end / within;
                let is_alike = match frames_a_period {
                    2.0 => (ratio - 1.0).abs() < 0.01,
                    // Of flicker at 40 and 30 Hz, at 120 frames a second, nearly nothing is seen within and little at
                    // an end.
                    3.0 | 4.0 if frames_per_second == 120.0 => at_end < 0.35,
                    _ => (0.72..1.2).contains(&ratio),
                };
                assert!(is_alike, "{frames_per_second}, {frames_a_period} frames a period: {at_end} for {within}");
            }
        }
    }

    /// No weights grow out of nearly nothing: they are at most what the channel leaves of all light.
    #[test]
    fn slow_frames_have_no_great_weights() {
        for frames_per_second in [1.0, 1.5, 2.0, 3.0, 3.9, 4.0, 5.0] {
            let responses = FrameResponses::new(FrameTiming { frames_per_second, persistence: 1.0 }).unwrap();
            for look in &responses.looks {
                let greatest =
                    |weights: &[f32]| weights.iter().fold(0f32, |greatest, weight| greatest.max(weight.abs()));
                assert!(greatest(&look.sustained[0]) < 1.05 && greatest(&transient(look, 100.0)) < 0.7);
            }
        }
    }
}
