//! How much a shot's error changes from frame to frame, beyond what moves.
//!
//! The error of a frame less the error of the one before, brought together along the exact velocity maps, over √2 so
//! that errors that have nothing to do with each other count as one frame's, in threshold units. Decisions that jump
//! from frame to frame would show here. Luminance only. Not a prediction of what is seen in motion: see
//! [`fechner_perception::sequence`].

use super::MAIN_COVERAGE;
use crate::animate::velocity::VelocityMap;
use crate::integrator::PathTracer;
use crate::scene::Scene;
use anyhow::Result;
use fechner_perception::Plane;
use fechner_perception::csf::CastleCsf;
use fechner_perception::display::Viewing;
use fechner_perception::photometry::luminance;
use fechner_perception::threshold::{ThresholdInputs, ThresholdMap, threshold_map};
use glam::Vec2;
use std::sync::Arc;

/// Motion there and back may miss its beginning by this, in pixels: more, and one of the frames does not see the point.
const MAX_MISSED_PX: f32 = 0.75;

/// What is told of a shot's frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steadiness {
    /// Visibility of the error in a frame, as of a still, at the 99th percentile, mean of the frames.
    pub(super) visibility: f64,
    /// Root mean square visibility of what changes.
    pub(super) flicker: f64,
}

/// Judges frames of one shot against those of its reference.
pub(super) struct FlickerJudge {
    size: (usize, usize),
    reference: Vec<Plane>,
    thresholds: Vec<ThresholdMap>,
    /// Pixel of the frame before that shows the same point, for all frames but the first.
    before: Vec<Vec<Option<usize>>>,
}

impl FlickerJudge {
    /// A judge for frames of displayed RGB and the tracers and scenes that they were made with.
    pub(super) fn new(
        reference: &[Vec<f32>],
        tracers: &[PathTracer],
        scenes: &[Arc<Scene>],
        viewing: &Viewing,
    ) -> Result<Self> {
        let settings = tracers[0].settings();
        let size = (settings.width as usize, settings.height as usize);
        let reference: Vec<Plane> = reference.iter().map(|light| luminance_of(light, size)).collect();
        let csf = CastleCsf::new(viewing.observer.csf_area_deg2)?;
        let of = |picture: &Plane| {
            let inputs = ThresholdInputs::clean(picture);
            threshold_map(&inputs, viewing, &csf)
        };
        let thresholds = reference.iter().map(of).collect::<Result<Vec<_>, _>>()?;
        let around = |frame: usize| {
            let next = &scenes[(frame + 1).min(scenes.len() - 1)];
            VelocityMap::new(&tracers[frame], &scenes[frame.saturating_sub(1)], next)
        };
        let maps: Vec<VelocityMap> = (0..tracers.len()).map(around).collect();
        let before = maps.windows(2).map(|pair| matches(&pair[0], &pair[1], size)).collect();
        Ok(Self { size, reference, thresholds, before })
    }

    /// Steadiness of frames of displayed RGB.
    pub(super) fn judge(&self, frames: &[Vec<f32>]) -> Steadiness {
        let errors: Vec<Plane> = frames
            .iter()
            .zip(&self.reference)
            .map(|(light, reference)| luminance_of(light, self.size).combined(reference, |test, truth| test - truth))
            .collect();
        let of_frame = |(error, map): (&Plane, &ThresholdMap)| map.measured_visibility(error).quantile(MAIN_COVERAGE);
        let visibility = errors.iter().zip(&self.thresholds).map(of_frame).sum::<f64>() / errors.len() as f64;
        let mut energy = 0.0;
        for (index, before) in self.before.iter().enumerate() {
            let (earlier, now) = (&errors[index], &errors[index + 1]);
            let (width, height) = self.size;
            let change = Plane::from_fn(width, height, |x, y| {
                let pixel = y * width + x;
                before[pixel].map_or(0.0, |earlier_pixel| {
                    (now.values()[pixel] - earlier.values()[earlier_pixel]) * std::f32::consts::FRAC_1_SQRT_2
                })
            });
            energy += self.thresholds[index + 1].measured_visibility(&change).map(|v| v * v).mean();
        }
        Steadiness { visibility, flicker: (energy / self.before.len().max(1) as f64).sqrt() }
    }
}

/// Where each pixel of a frame was one frame earlier, if it was in sight.
fn matches(earlier: &VelocityMap, now: &VelocityMap, (width, height): (usize, usize)) -> Vec<Option<usize>> {
    let matching = |pixel: usize| {
        let center = Vec2::new((pixel % width) as f32 + 0.5, (pixel / width) as f32 + 0.5);
        let place = center + now.to_previous[pixel];
        let is_inside = place.x >= 0.0 && place.y >= 0.0 && place.x < width as f32 && place.y < height as f32;
        let there = is_inside.then(|| place.y as usize * width + place.x as usize)?;
        let missed = (now.to_previous[pixel] + earlier.to_next[there]).length();
        (missed <= MAX_MISSED_PX).then_some(there)
    };
    (0..width * height).map(matching).collect()
}

fn luminance_of(light: &[f32], (width, height): (usize, usize)) -> Plane {
    Plane::from_fn(width, height, |x, y| {
        let at = 3 * (y * width + x);
        luminance([light[at], light[at + 1], light[at + 2]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels in a row that move one to the right; what comes in at the left, and what was hidden, has no match.
    #[test]
    fn only_points_that_both_frames_see_are_matched() {
        let map = |to_next: [f32; 4], to_previous: [f32; 4]| VelocityMap {
            to_next: to_next.map(|x| Vec2::new(x, 0.0)).to_vec(),
            to_previous: to_previous.map(|x| Vec2::new(x, 0.0)).to_vec(),
        };
        let moving = map([1.0; 4], [-1.0; 4]);
        assert_eq!(matches(&moving, &moving, (4, 1)), [None, Some(0), Some(1), Some(2)]);
        // A still ground behind something that covered pixel 1 and went on to pixel 2.
        let (earlier, now) = (map([0.0, 1.0, 0.0, 0.0], [0.0; 4]), map([0.0; 4], [0.0, 0.0, -1.0, 0.0]));
        assert_eq!(matches(&earlier, &now, (4, 1)), [Some(0), None, Some(1), Some(3)]);
    }
}
