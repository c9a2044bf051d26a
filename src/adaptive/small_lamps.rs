//! Samples for pixels in which a lamp smaller than they is known to be.
//!
//! Of a lamp that covers a thirtieth of a pixel the first sixteen samples find nothing in six pixels of ten, and their halves agree that it is black.
//! Where it is, and how much it covers, is known before the first sample, so the count is no matter of luck.

/// Samples that should meet the lamp: so many pass by all of them in one pixel of 3000.
const MEETINGS: f64 = 8.0;
/// Fewer are not worth having.
const FEWEST_MEETINGS: f64 = 1.0;
/// A lamp that covers so much of a pixel is found by its first samples.
const FOUND_ANYWAY: f32 = 0.5;
/// Samples of a pixel beyond which a lamp is left to chance.
const MOST_SAMPLES: f64 = 4096.0;
/// Of the pilot's samples, what this may take.
const MOST_OF_PILOT: f64 = 0.5;

/// Samples that each pixel should have to meet lamps that cover such shares of them, for as many meetings as half of a pilot's samples allow.
/// `None` where they do not allow any.
///
/// By the scene alone: a render that goes on asks for what it has.
pub(super) fn samples_to_meet(shares: &[f32], pilot_samples: u32) -> Option<Vec<u32>> {
    let affordable = MOST_OF_PILOT * f64::from(pilot_samples) * shares.len() as f64;
    let mut meetings = MEETINGS;
    while meetings >= FEWEST_MEETINGS {
        let wanted: Vec<u32> = shares.iter().map(|&share| wanted(share, meetings)).collect();
        let cost: f64 = wanted.iter().map(|&samples| f64::from(samples.saturating_sub(pilot_samples))).sum();
        if cost <= affordable {
            return Some(wanted);
        }
        meetings *= 0.5;
    }
    None
}

/// Samples of a pixel of which the lamp covers such a share, for so many meetings.
fn wanted(share: f32, meetings: f64) -> u32 {
    let is_small = share > 0.0 && share < FOUND_ANYWAY;
    let samples = meetings / f64::from(share);
    if is_small && samples <= MOST_SAMPLES { samples.ceil() as u32 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lamps that cover 3 %, half or nothing of a pixel, and next to nothing; with more of them fewer meetings, then none.
    #[test]
    fn lamps_are_met_as_often_as_a_pilot_affords() {
        let of = |lamps: usize| {
            let shares: Vec<f32> = (0..1000).map(|pixel| if pixel < lamps { 0.03 } else { 0.0 }).collect();
            samples_to_meet(&shares, 16).map(|wanted| wanted[0])
        };
        assert_eq!([of(10), of(40), of(100), of(300), of(1000)], [Some(267), Some(134), Some(67), Some(34), None]);
        assert_eq!(samples_to_meet(&[0.0, 0.5, 0.9, 1e-4, f32::NAN], 16), Some(vec![0; 5]));
    }
}
