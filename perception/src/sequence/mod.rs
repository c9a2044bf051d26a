//! What can be seen of the difference of two moving pictures.
//!
//! After Myszkowski, Rokita, Tawara, "Perceptually-informed accelerated rendering of high quality walkthrough sequences",
//! 1999: a visible-differences predictor whose eye follows what moves. Theirs weighs still frames by Daly's spatiovelocity
//! function of a velocity map. Here frames are brought together along the eye's way over the picture, and what then changes
//! from frame to frame goes through castleCSF's temporal channels (Ashraf et al. 2024): noise that is new in every frame
//! is integrated, error that travels with an object is seen nearly as in a still, and what is locked to the screen under a
//! moving eye is blurred, all by one filter. Not for stills (see [`crate::difference`]; equal frames without end give the
//! same), nor for frames that somebody may pause.

mod gaze;

pub use gaze::FrameMotion;

use crate::adaptation::adapted;
use crate::colour::Channels;
use crate::csf::{CastleChromatic, CastleCsf, CastleTransient, ChromaticChannel, FrameResponses, FrameTiming, Weights};
use crate::difference::{Difference, HeldAtLowFrequencies, masked_by_both, mutual_visibility};
use crate::display::Viewing;
use crate::error::Error;
use crate::plane::Plane;
use crate::sensitivity::adaptation_levels;
use crate::threshold::{ThresholdInputs, ThresholdMap, chromatic_threshold_map, threshold_map};
use crate::visibility::ErrorFilters;
use gaze::{Place, Towards};
use rayon::prelude::*;

/// A frame of two sequences that show the same, and how it moves.
pub struct SequenceFrame {
    reference: Channels,
    test: Channels,
    motion: Option<FrameMotion>,
}

impl SequenceFrame {
    /// Takes displayed colours, linear Rec. 709 RGB in cd/m², row-major. Without motion the eye rests.
    ///
    /// # Errors
    /// [`Error::ValueCount`] unless both pictures have `width * height` pixels, [`Error::Empty`] without pixels,
    /// [`Error::BadPixel`] for negative luminance or values that are not finite, [`Error::SizeMismatch`] for motion of
    /// another size.
    pub fn new(
        reference_rgb_cd_m2: &[[f32; 3]],
        test_rgb_cd_m2: &[[f32; 3]],
        width: usize,
        height: usize,
        motion: Option<FrameMotion>,
    ) -> Result<Self, Error> {
        let reference = Channels::new(reference_rgb_cd_m2, width, height)?;
        let test = Channels::new(test_rgb_cd_m2, width, height)?;
        reference.achromatic.check_non_negative("reference picture")?;
        test.achromatic.check_non_negative("test picture")?;
        if let Some(motion) = &motion {
            for plane in motion.to_next.iter().chain(&motion.to_previous) {
                plane.check_size("motion", width, height)?;
            }
        }
        Ok(Self { reference, test, motion })
    }

    fn size(&self) -> (usize, usize) {
        (self.reference.achromatic.width(), self.reference.achromatic.height())
    }
}

/// An observer of moving pictures.
pub struct SequenceObserver {
    viewing: Viewing,
    responses: FrameResponses,
}

/// What the eye's channels hold of a frame and those around it, cd/m².
#[derive(Clone, Copy, Default)]
struct Seen {
    reference: [f32; 3],
    test: [f32; 3],
    /// Of the luminance difference, in the transient channel.
    transient: f32,
}

impl SequenceObserver {
    /// In front of a display that shows `viewing.display.frames_per_second` new frames a second, each lit for its
    /// `persistence`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible viewing.
    pub fn new(viewing: &Viewing) -> Result<Self, Error> {
        viewing.check()?;
        let display = &viewing.display;
        let timing = FrameTiming::nearest(display.frames_per_second, display.persistence);
        Ok(Self { viewing: viewing.clone(), responses: FrameResponses::new(timing)? })
    }

    /// How many frames before and after one have to do with it.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.responses.reach()
    }

    /// What is seen of the difference while frame `now` of these is shown. Frames that would stand before the first or
    /// after the last are like these.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] for frames of several sizes, [`Error::Empty`] unless there is a frame `now`.
    ///
    /// ```
    /// use fechner_perception::Viewing;
    /// use fechner_perception::sequence::{SequenceFrame, SequenceObserver};
    /// let grey = vec![[100.0; 3]; 64 * 64];
    /// let flicker = |frame: usize| vec![[if frame % 4 < 2 { 102.0 } else { 98.0 }; 3]; 64 * 64];
    /// let frames = (0..9).map(|frame| SequenceFrame::new(&grey, &flicker(frame), 64, 64, None));
    /// let frames = frames.collect::<Result<Vec<_>, _>>()?;
    /// let mut viewing = Viewing::default();
    /// viewing.display.frames_per_second = 24.0;
    /// let seen = SequenceObserver::new(&viewing)?.difference(&frames.iter().collect::<Vec<_>>(), 4)?;
    /// assert!(seen.is_visible()); // 2 % of flicker at 6 Hz
    /// # Ok::<(), fechner_perception::Error>(())
    /// ```
    pub fn difference(&self, frames: &[&SequenceFrame], now: usize) -> Result<Difference, Error> {
        let Some(shown) = frames.get(now) else { return Err(Error::Empty { what: "sequence" }) };
        let (width, height) = shown.size();
        for frame in frames {
            frame.reference.achromatic.check_size("frame", width, height)?;
        }
        let seen = self.through_time(frames, now);
        let plane = |of: &(dyn Fn(&Seen) -> f32 + Sync)| Plane::from_fn(width, height, |x, y| of(&seen[y * width + x]));
        let light = |of: fn(&Seen) -> f32| plane(&|seen| of(seen).max(0.0));
        let (reference, test) = (light(|seen| seen.reference[0]), light(|seen| seen.test[0]));
        let mut greatest =
            self.achromatic([&reference, &test], &plane(&|s| s.test[0] - s.reference[0]), &plane(&|s| s.transient))?;
        for (index, channel) in [(1, ChromaticChannel::RedGreen), (2, ChromaticChannel::YellowViolet)] {
            let csf = CastleChromatic::new(channel, self.viewing.observer.csf_area_deg2)?;
            let csf = HeldAtLowFrequencies { base: &csf };
            let (own, other) = (plane(&|seen| seen.reference[index]), plane(&|seen| seen.test[index]));
            let map = chromatic_threshold_map(&own, &reference, &self.viewing, &csf)?;
            let other_map = chromatic_threshold_map(&other, &test, &self.viewing, &csf)?;
            let visibility = mutual_visibility(map, &other_map, &own, &other);
            greatest.values_mut().iter_mut().zip(visibility.values()).for_each(|(v, other)| *v = v.max(*other));
        }
        Ok(Difference::of(greatest))
    }

    /// Sums frames along the eye's way through them.
    fn through_time(&self, frames: &[&SequenceFrame], now: usize) -> Vec<Seen> {
        let (width, height) = frames[now].size();
        let adaptation = adapted(&frames[now].reference.achromatic, &self.viewing);
        let last = frames.len() - 1;
        (0..width * height)
            .into_par_iter()
            .map(|pixel| {
                let mut seen = Seen::default();
                let adapted_to = adaptation.values()[pixel];
                self.add(&mut seen, frames[now], pixel, 0, adapted_to);
                for towards in [Towards::Earlier, Towards::Later] {
                    let mut place = Place::center_of(pixel % width, pixel / width);
                    let mut index = now;
                    for distance in 1..=self.reach() {
                        let next = match towards {
                            Towards::Earlier => index.saturating_sub(1),
                            Towards::Later => (index + 1).min(last),
                        };
                        // Beyond the ends the picture rests, and the eye with it.
                        if next != index {
                            place = place.followed(frames[index].motion.as_ref(), towards, &self.viewing.display);
                            index = next;
                        }
                        self.add(&mut seen, frames[index], place.pixel(width, height), distance, adapted_to);
                    }
                }
                seen
            })
            .collect()
    }

    fn add(&self, seen: &mut Seen, frame: &SequenceFrame, pixel: usize, distance: usize, adapted_to: f32) {
        let FrameResponses { sustained, red_green, yellow_violet, .. } = &self.responses;
        let weight = |weights: &Weights| weights[distance];
        let weights = [weight(sustained), weight(red_green), weight(yellow_violet)];
        let of = |channels: &Channels| {
            [&channels.achromatic, &channels.red_green, &channels.yellow_violet].map(|plane| plane.values()[pixel])
        };
        let (reference, test) = (of(&frame.reference), of(&frame.test));
        for channel in 0..3 {
            seen.reference[channel] += weights[channel] * reference[channel];
            seen.test[channel] += weights[channel] * test[channel];
        }
        seen.transient += self.responses.transient(distance, adapted_to) * (test[0] - reference[0]);
    }

    /// Visibility of a luminance difference whose sustained and transient parts are given; both channels add in amplitude.
    fn achromatic(&self, [reference, test]: [&Plane; 2], sustained: &Plane, transient: &Plane) -> Result<Plane, Error> {
        let area_deg2 = self.viewing.observer.csf_area_deg2;
        let csf = CastleCsf::new(area_deg2)?;
        let csf = HeldAtLowFrequencies { base: &csf };
        let map_of = |picture: &Plane| {
            threshold_map(
                &ThresholdInputs { display_luminance_cd_m2: picture, guide_variance: None },
                &self.viewing,
                &csf,
            )
        };
        let map = masked_by_both(map_of(reference)?, &map_of(test)?);
        let (least, greatest) = map.adaptation_cd_m2().range();
        let flicker = HeldAtLowFrequencies { base: &CastleTransient { area_deg2 } };
        let for_transient =
            ThresholdMap { levels: adaptation_levels(&self.viewing, &flicker, least, greatest), ..map.clone() };
        let (mut still, mut moving) = (ErrorFilters::amid_equals(&map), ErrorFilters::amid_equals(&for_transient));
        let (sustained, transient) = (still.spectrum(sustained), moving.spectrum(transient));
        let mut energy = still.nothing();
        for band in 0..map.band_count() {
            let (a, b) = (still.response(&sustained, band), moving.response(&transient, band));
            let both = a.enlarged_with(&b, |sustained, transient| (sustained + transient).powi(2));
            energy.values_mut().iter_mut().zip(both.values()).for_each(|(sum, more)| *sum += more);
        }
        Ok(still.visibility_of(&energy))
    }
}

#[cfg(test)]
mod tests;
