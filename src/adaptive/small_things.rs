//! Samples for pixels in which a lamp smaller than they is known to be, and the noise of known things that few samples
//! have met.
//!
//! Of a lamp that covers a thirtieth of a pixel the first sixteen samples find nothing in six pixels of ten, and
//! their halves agree that it is black. Where it is, and how much it covers, is known before the first sample, so the
//! count is no matter of luck.

use super::missed::FoundLight;
use super::settings::Limits;
use crate::film::Film;
use fechner_perception::Plane;
use fechner_perception::tone::Pixel;

/// Samples that should meet the lamp: so many pass by all of them in one pixel of 3000.
const MEETINGS: f64 = 8.0;
/// Fewer are not worth having.
const MIN_MEETINGS: f64 = 1.0;
/// A lamp that covers so much of a pixel is found by its first samples.
const FOUND_ANYWAY: f32 = 0.5;
/// A pixel gets no more samples than this, and none for a lamp that these would not meet once.
const MAX_SAMPLES: f64 = 4096.0;
/// What less of a pixel's samples meets is left to chance: most pixels never have so many. The pixel filter's tails
/// hold as little of the sun, and show white after its first meeting.
const MIN_SHARE: f32 = 1.0 / 65_536.0;
/// Share of the pilot's samples that this may take.
const MOST_OF_PILOT: f64 = 0.5;

/// Samples that each pixel should have to meet lamps that cover such shares of them, for as many meetings as half of a
/// pilot's samples and the budget of `mean_samples` a pixel allow. `None` where they do not allow any.
///
/// By the scene and the limits alone: a render that goes on asks for what it has.
pub(super) fn samples_to_meet(shares: &[f32], limits: &Limits) -> Option<Vec<u32>> {
    let pilot = f64::from(limits.pilot());
    let budget = limits.mean_samples.map_or(f64::INFINITY, |mean| f64::from(mean) - pilot);
    let affordable = budget.min(MOST_OF_PILOT * pilot) * shares.len() as f64;
    let mut meetings = MEETINGS;
    while meetings >= MIN_MEETINGS {
        let wanted: Vec<u32> = shares.iter().map(|&share| wanted(share, meetings).min(limits.max_samples)).collect();
        let cost: f64 = wanted.iter().map(|&samples| (f64::from(samples) - pilot).max(0.0)).sum();
        if cost <= affordable {
            return Some(wanted);
        }
        meetings *= 0.5;
    }
    None
}

/// Samples of a pixel of which the lamp covers such a share, for so many meetings.
fn wanted(share: f32, meetings: f64) -> u32 {
    let of_most = f64::from(share) * MAX_SAMPLES;
    let is_small = of_most >= MIN_MEETINGS && share < FOUND_ANYWAY;
    if is_small { (meetings / f64::from(share)).min(MAX_SAMPLES).ceil() as u32 } else { 0 }
}

/// How wrong each pixel is expected to be seen of which samples have met known things fewer than [`MEETINGS`] times:
/// the mean square, (cd/m²)² on the display, over how often chance lets so many samples meet them (Poisson's
/// distribution). Once they are met oftener, their own scatter tells. `None` where none are known.
///
/// Neighbours alone do not tell: of forty lamps far out of focus few neighbours have met one. Measured without: renders
/// asked for visibility 8 stop at 51 to 53 with 46 % of the light missing. `found`: what is found besides. `shown`:
/// what is displayed of a pixel's luminance, both cd/m².
pub(super) fn unmet_noise(
    film: &Film,
    found: &FoundLight,
    nits_per_unit: f64,
    shown: impl Fn(Pixel, f32) -> f32 + Sync,
) -> Option<Plane> {
    let things = film.known_things.as_ref()?;
    let width = film.width() as usize;
    Some(Plane::from_fn(width, film.height() as usize, |x, y| {
        let index = y * width + x;
        let Some(expected_meetings) = few_meetings(film, index) else { return 0.0 };
        let light = nits_per_unit * f64::from(things.light(index));
        let of_one_meeting = light / expected_meetings;
        let besides = (f64::from(found.mean_cd_m2.values()[index]) - light).max(0.0);
        let shown = |light: f64| f64::from(shown(Pixel { x, y }, (besides + light) as f32));
        let whole = shown(light);
        let square = |meetings: f64| (shown(meetings * of_one_meeting) - whole).powi(2);
        mean_of_poisson(expected_meetings, square) as f32
    }))
}

/// How often a pixel's samples are expected to have met its known things, where that is fewer than [`MEETINGS`] times;
/// `None` where it has none, or less than [`MIN_SHARE`].
pub(super) fn few_meetings(film: &Film, pixel: usize) -> Option<f64> {
    let share = film.known_things.as_ref()?.share(pixel);
    let expected = f64::from(share) * f64::from(film.samples(pixel));
    (share >= MIN_SHARE && expected < MEETINGS && expected > 0.0).then_some(expected)
}

/// The mean of what depends on a count that is `expected` on average, but for a hundred-thousandth of the cases.
fn mean_of_poisson(expected: f64, of_count: impl Fn(f64) -> f64) -> f64 {
    const LEFT_OUT: f64 = 1e-5;
    let (mut count, mut probability, mut left, mut mean) = (0.0, (-expected).exp(), 1.0, 0.0);
    while left > LEFT_OUT && probability > 0.0 {
        mean += probability * of_count(count);
        left -= probability;
        count += 1.0;
        probability *= expected / count;
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{BlockSum, KnownThings};
    use crate::integrator::{BlockWork, FirstHit, PathSample};
    use crate::sampler::Half;
    use glam::Vec3;

    /// Of a count that is 3 on average the variance is 3, too.
    #[test]
    fn counts_scatter_as_poissons() {
        for expected in [1e-3, 0.5, 3.0, 7.9] {
            let variance = mean_of_poisson(expected, |count| (count - expected).powi(2));
            assert!((variance / expected - 1.0).abs() < 0.01, "{variance} for {expected}");
        }
    }

    /// A lamp that half a per cent of samples meets brings 1 unit. Of sixteen samples, most meet it not at all: what is
    /// missing is all of it, and now and then there is too much. Of 2000, ten do, and their own scatter tells.
    #[test]
    fn what_few_samples_met_is_noise() {
        let noise = |samples: u32, shown: fn(f32) -> f32| {
            let mut film = Film::new(1, 1);
            let mut sum = BlockSum::default();
            let first_hit = FirstHit { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1, shines: false };
            (0..samples).for_each(|_| sum.add(&PathSample { radiance: Vec3::ZERO, first_hit, rays: 1 }));
            film.merge_block(BlockWork { samples, ..BlockWork::whole(0, Half::A, 0) }, &sum);
            let found = FoundLight::of_film(&film, 10.0);
            assert!(unmet_noise(&film, &found, 10.0, |_, light| light).is_none(), "no lamps are known");
            let mut lamps = KnownThings::new(1);
            lamps.add(0, 0.005, 200.0, true);
            film.known_things = Some(lamps);
            f64::from(unmet_noise(&film, &found, 10.0, |_, light| shown(light)).expect("known").get(0, 0))
        };
        // The variance of a count of 0.08 is 0.08, of which each is 125 cd/m².
        let of_sixteen = noise(16, |light| light);
        assert!((of_sixteen / (0.08 * 125.0 * 125.0) - 1.0).abs() < 0.01, "{of_sixteen}");
        // On a display whose white is 20 cd/m², too much shows no more than too little.
        let clipped = noise(16, |light| light.min(20.0));
        assert!((clipped / 100.0 - 1.0).abs() < 0.01, "{clipped}");
        assert_eq!(noise(2000, |light| light), 0.0);
    }

    /// Lamps that cover 3 % of a pixel, with more of them fewer meetings, then none.
    #[test]
    fn lamps_are_met_as_often_as_a_pilot_affords() {
        let of = |lamps: usize, mean_samples: Option<u32>| {
            let shares: Vec<f32> = (0..1000).map(|pixel| if pixel < lamps { 0.03 } else { 0.0 }).collect();
            samples_to_meet(&shares, &Limits { mean_samples, ..Limits::of_visibility(1.0) }).map(|wanted| wanted[0])
        };
        let found = [10, 40, 100, 300, 1000].map(|lamps| of(lamps, None));
        assert_eq!(found, [Some(267), Some(134), Some(67), Some(34), None]);
        assert_eq!([16, 17, 18, 24].map(|spp| of(10, Some(spp))), [None, Some(67), Some(134), Some(267)]);
    }

    /// Half of a pixel is found anyway; of what is less, down to what 4096 samples meet once, as many as allowed.
    #[test]
    fn tiny_lamps_are_met_as_often_as_a_pixel_may() {
        let samples = [0.0, 0.5, 0.1, 0.001, 3e-4, 2e-4, f32::NAN].map(|share| wanted(share, MEETINGS));
        assert_eq!(samples, [0, 0, 80, 4096, 4096, 0, 0]);
    }
}
