//! Measures what can truly be seen of a render's error, against a reference. Not what a render knows of
//! itself: that is its judgement.

use super::Subject;
use super::metrics::{Metrics, measure};
use super::reference::Reference;
use crate::film::CHANNELS;
use anyhow::Result;
use fechner_perception::colour::{ColourThresholds, colour_thresholds};
use fechner_perception::opponent::opponent;
use fechner_perception::tone::FittedTone;
use fechner_perception::{Display, Plane, ThresholdMap};

/// Sees differences to a reference.
pub(crate) struct Truth {
    pub(crate) tone: Box<dyn FittedTone>,
    pub(crate) thresholds: ColourThresholds,
    display: Display,
    width: usize,
    height: usize,
    /// The reference as displayed, by channel.
    shown: [Plane; CHANNELS],
    /// v² of the reference's own noise, by channel.
    own_energy: [Plane; CHANNELS],
    /// The reference as displayed: linear RGB, 0..1.
    pub(crate) picture: Vec<[f32; 3]>,
}

impl Truth {
    pub(crate) fn new(subject: &Subject, reference: &Reference) -> Result<Self> {
        let tone = reference.fit(subject)?;
        let display = subject.viewing.display.clone();
        let (width, height) = (reference.width, reference.height);
        let picture: Vec<[f32; 3]> = reference.rgb_cd_m2().into_iter().map(|rgb| tone.map_rgb(rgb)).collect();
        let displayed = display.rgb_cd_m2(&picture);
        let thresholds = colour_thresholds(&displayed, width, height, &subject.viewing)?;
        let halves = reference.halves.each_ref().map(|half| {
            let mapped: Vec<[f32; 3]> = half.iter().map(|&rgb| tone.map_rgb(rgb)).collect();
            signals(&display.rgb_cd_m2(&mapped), width, height)
        });
        let own_energy = std::array::from_fn(|c| {
            let half_difference = halves[0][c].half_difference(&halves[1][c]);
            squared_visibility(channel(&thresholds, c), &half_difference)
        });
        let shown = signals(&displayed, width, height);
        Ok(Self { tone, thresholds, display, width, height, shown, own_energy, picture })
    }

    /// A picture as the display shows it: linear RGB, 0..1. `rgb_cd_m2` is of the scene.
    pub(crate) fn displayed(&self, rgb_cd_m2: &[[f32; 3]]) -> Vec<[f32; 3]> {
        rgb_cd_m2.iter().map(|&rgb| self.tone.map_rgb(rgb)).collect()
    }

    /// How far a displayed picture (linear RGB, 0..1) is from the reference by other people's measures.
    pub(crate) fn measure(&self, picture: &[[f32; 3]]) -> Result<Metrics> {
        measure(&self.display, self.width, &self.picture, picture)
    }

    /// v² of a displayed picture's error, without the reference's part in the difference: the channel that shows most.
    /// As of noise, which goes on beyond the border: an error that is the same all over the picture is not in it, but
    /// in the bias of its energy.
    pub(crate) fn squared_visibility(&self, picture: &[[f32; 3]]) -> Plane {
        let shown = signals(&self.display.rgb_cd_m2(picture), self.width, self.height);
        let mut most = Plane::filled(self.width, self.height, 0.0);
        let known = self.shown.iter().zip(&self.own_energy).enumerate();
        for (shown, (c, (reference, own_energy))) in shown.iter().zip(known) {
            let difference = shown.combined(reference, |a, b| a - b);
            let energy = squared_visibility(channel(&self.thresholds, c), &difference);
            let of_render = energy.combined(own_energy, beyond_own);
            most = most.combined(&of_render, f32::max);
        }
        most
    }
}

/// v² of a difference to a reference without the reference's own part; 0 where so little of it is left that the
/// reference cannot tell, or nobody: a hundredth of that part, or the filters' rounding, from which v is some 1e-6.
/// Measured without: a lamp of one pixel needs 7e-12 samples by one seed and 1000 by another, and intervals go up to
/// 8e44.
fn beyond_own(energy: f32, own: f32) -> f32 {
    const MIN_SHARE: f32 = 0.01;
    const LEAST: f32 = 1e-8;
    let beyond = energy - own;
    if beyond > (MIN_SHARE * own).max(LEAST) { beyond } else { 0.0 }
}

fn channel(thresholds: &ColourThresholds, channel: usize) -> &ThresholdMap {
    [&thresholds.achromatic, &thresholds.red_green, &thresholds.yellow_violet][channel]
}

fn squared_visibility(thresholds: &ThresholdMap, error: &Plane) -> Plane {
    thresholds.measured_visibility(error).map(|v| v * v)
}

fn signals(rgb_cd_m2: &[[f32; 3]], width: usize, height: usize) -> [Plane; CHANNELS] {
    let signal = |of: fn([f32; 3]) -> f32| Plane::from_fn(width, height, |x, y| of(rgb_cd_m2[y * width + x]));
    [
        signal(|rgb| opponent(rgb).achromatic),
        signal(|rgb| opponent(rgb).red_green),
        signal(|rgb| opponent(rgb).yellow_violet),
    ]
}

#[cfg(test)]
mod tests {
    use super::beyond_own;

    /// What is far below the reference's own noise is none, not a need of next to no samples.
    #[test]
    fn the_reference_does_not_tell_what_is_far_below_its_noise() {
        let told = [beyond_own(3.0, 1.0), beyond_own(0.5, 1.0), beyond_own(2e-6, 0.0)];
        assert_eq!(told, [2.0, 0.0, 2e-6]);
        assert_eq!([beyond_own(1.0 + f32::EPSILON, 1.0), beyond_own(5e-13, 0.0)], [0.0; 2]);
    }
}
