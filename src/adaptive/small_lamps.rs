//! Samples for pixels in which a lamp smaller than they is known to be.
//!
//! Of a lamp that covers a thirtieth of a pixel the first sixteen samples find nothing in six pixels of ten, and their halves agree that it is black.
//! Where it is, and how much it covers, is known before the first sample, so the count is no matter of luck.

use super::plan::plan_up_to;
use crate::film::Film;
use crate::integrator::SamplePlan;

/// Samples that should meet the lamp: so many pass by all of them in one pixel of 3000.
const MEETINGS: f64 = 8.0;
/// Fewer are not worth having.
const FEWEST_MEETINGS: f64 = 1.0;
/// A lamp that covers so much of a pixel is found by its first samples.
const FOUND_ANYWAY: f32 = 0.5;
/// Samples of a pixel beyond which a lamp is left to chance.
const MOST_SAMPLES: f64 = 4096.0;
/// Part of the film's samples that this may take.
const MOST_PART: u64 = 2;

/// What the film lacks to meet lamps that cover such shares of its pixels. Empty where that is more than half of what it has, or than is
/// left, even for few meetings.
pub(super) fn plan_to_meet(film: &Film, shares: &[f32], max_samples: u32, left: u64) -> SamplePlan {
    let affordable = left.min(film.total_samples() / MOST_PART);
    let mut meetings = MEETINGS;
    while meetings >= FEWEST_MEETINGS {
        let plan = plan_up_to(film, |pixel| wanted(shares[pixel], meetings).min(max_samples));
        if plan.samples() <= affordable {
            return plan;
        }
        meetings *= 0.5;
    }
    SamplePlan::default()
}

/// Samples of a pixel of which the lamp covers such a share, for so many meetings.
fn wanted(share: f32, meetings: f64) -> u32 {
    let is_small = share > 0.0 && share < FOUND_ANYWAY;
    let samples = meetings / f64::from(share);
    if is_small && samples <= MOST_SAMPLES { samples.ceil() as u32 } else { 0 }
}
