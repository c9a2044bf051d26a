//! What can be seen of the difference of two moving pictures.
//!
//! After Myszkowski, Rokita, Tawara, "Perceptually-informed accelerated rendering of high quality walkthrough
//! sequences", 1999: a visible-differences predictor whose eye follows what moves. Theirs weighs still frames by
//! Daly's spatiovelocity function of a velocity map. Here frames are brought together along the eye's way over the
//! picture, and what then changes from frame to frame goes through castleCSF's temporal channels (Ashraf et al.
//! 2024): noise that is new in every frame is integrated, error that travels with an object is seen nearly as in a
//! still, and what is locked to the screen under a moving eye is blurred, all by one filter. A frame is looked at
//! several times while it is shown, and counts as at the worst of them. Not for stills (see [`crate::difference`];
//! equal frames without end give the same), nor for frames that somebody may pause.

mod gaze;

pub use gaze::FrameMotion;

use crate::adaptation::adapted;
use crate::colour::Channels;
use crate::csf::{
    CastleChromatic, CastleCsf, CastleTransient, ChromaticChannel, FrameResponses, FrameTiming, Level, Look,
};
use crate::difference::{Difference, HeldAtLowFrequencies, masked_by_both};
use crate::display::Viewing;
use crate::error::Error;
use crate::error_filters::ErrorFilters;
use crate::plane::Plane;
use crate::sensitivity::adaptation_levels;
use crate::threshold::{ThresholdInputs, ThresholdMap, chromatic_threshold_map, threshold_map};
use gaze::{Place, Smears, Towards};
use rayon::prelude::*;

/// Looks that are taken together, for which pictures are held in memory.
const LOOKS_AT_ONCE: usize = 5;
/// Of so many looks one is at colours, which are seen to flicker half as fast: it saves a quarter of the time.
const LOOKS_PER_COLOUR: usize = 2;
/// Frames with fewer looks than this are looked at for colours in all of them, as which of them is the right one
/// depends on where the light changes.
const FEW_LOOKS: usize = 5;

/// A frame of two sequences that show the same, and how it moves.
pub struct SequenceFrame {
    reference: Channels,
    test: Channels,
    motion: Option<FrameMotion>,
}

impl SequenceFrame {
    /// A frame of displayed colours, linear Rec. 709 RGB in cd/m², row-major. Without motion the eye rests.
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

/// What the sustained channels hold of both pictures, cd/m²: luminance, red–green, yellow–violet.
#[derive(Clone, Copy, Default)]
struct Light {
    reference: [f32; 3],
    test: [f32; 3],
    /// Luminance of the reference that any channel holds at any look.
    around: f32,
}

/// What the eye's channels hold of the difference at one moment, cd/m².
#[derive(Clone, Copy, Default)]
struct Seen {
    sustained: [f32; 3],
    /// Difference of luminance in the transient channel.
    transient: f32,
}

/// What both pictures do to thresholds while a frame is shown.
struct Thresholds {
    achromatic: ThresholdMap,
    transient: ThresholdMap,
    red_green: ThresholdMap,
    yellow_violet: ThresholdMap,
}

/// The eye's filters under these thresholds.
struct Filters<'a> {
    sustained: ErrorFilters<'a>,
    transient: ErrorFilters<'a>,
    red_green: ErrorFilters<'a>,
    yellow_violet: ErrorFilters<'a>,
}

impl SequenceObserver {
    /// An observer in front of a display that shows `viewing.display.frames_per_second` new frames a second, each lit
    /// for its `persistence`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an impossible viewing.
    pub fn new(viewing: &Viewing) -> Result<Self, Error> {
        viewing.check()?;
        let display = &viewing.display;
        let timing = FrameTiming::nearest(display.frames_per_second, display.persistence);
        Ok(Self { viewing: viewing.clone(), responses: FrameResponses::new(timing)? })
    }

    /// How many frames before a frame, and as many after it, have a part in how it is seen.
    #[must_use]
    pub fn reach(&self) -> usize {
        self.responses.reach()
    }

    /// A frame between others as it falls on the retina: an eye that follows smears it while it is held. Without
    /// motion nothing is smeared.
    #[must_use]
    pub fn held(&self, frame: SequenceFrame) -> SequenceFrame {
        let Some(motion) = &frame.motion else { return frame };
        let smears = Smears::of(motion, &self.viewing.display);
        let held = |channels: &Channels| Channels {
            achromatic: smears.over(&channels.achromatic),
            red_green: smears.over(&channels.red_green),
            yellow_violet: smears.over(&channels.yellow_violet),
        };
        SequenceFrame { reference: held(&frame.reference), test: held(&frame.test), ..frame }
    }

    /// What is seen of the difference while frame `now` of these is shown, at the worst moment for each pixel. Frames
    /// within [`Self::reach`] that would stand before the first or after the last are expected to be as those within
    /// it are in the mean, where the eye's way leads over them: what stands still is seen as in a still, and noise as
    /// amid other frames.
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
        let adaptation = adapted(&shown.reference.achromatic, &self.viewing);
        let responses = self.responses.within(now, frames.len() - 1 - now);
        let thresholds = self.thresholds(&self.light(&responses, frames, now), width, height)?;
        let mut filters = Filters::new(&thresholds);
        let mut greatest = Plane::filled(width, height, 0.0);
        let count = responses.looks.len();
        for (chunk, looks) in responses.looks.chunks(LOOKS_AT_ONCE).enumerate() {
            for (look, seen) in self.seen(frames, now, looks, &adaptation).iter().enumerate() {
                filters.add_achromatic(&mut greatest, seen);
                if is_at_colours(chunk * LOOKS_AT_ONCE + look, count) {
                    filters.add_chromatic(&mut greatest, seen);
                }
            }
        }
        Ok(Difference::of(greatest))
    }

    /// Calls `visit` with each frame that reaches the one that is shown, by its number among the weights, and the
    /// pixel of it that is where the eye sees `pixel` of that one.
    fn along_the_eyes_way<'f>(
        &self,
        frames: &[&'f SequenceFrame],
        now: usize,
        pixel: usize,
        mut visit: impl FnMut(usize, &'f SequenceFrame, usize),
    ) {
        let (width, height) = frames[now].size();
        let reach = self.reach();
        visit(reach, frames[now], pixel);
        for (towards, count) in [(Towards::Earlier, now), (Towards::Later, frames.len() - 1 - now)] {
            let mut place = Place::center_of(pixel % width, pixel / width);
            let mut index = now;
            for distance in 1..=count.min(reach) {
                place = place.followed(frames[index].motion.as_ref(), towards, &self.viewing.display);
                let weight = match towards {
                    Towards::Earlier => reach - distance,
                    Towards::Later => reach + distance,
                };
                index = now + weight - reach;
                visit(weight, frames[index], place.pixel(width, height));
            }
        }
    }

    /// The light that a frame is seen by.
    fn light(&self, responses: &FrameResponses, frames: &[&SequenceFrame], now: usize) -> Vec<Light> {
        let (width, height) = frames[now].size();
        let of = |pixel: usize| {
            let mut light = Light::default();
            self.along_the_eyes_way(frames, now, pixel, |weight, frame, pixel| {
                let (reference, test) = (at(&frame.reference, pixel), at(&frame.test, pixel));
                for (channel, weights) in responses.middle.iter().enumerate() {
                    light.reference[channel] += weights[weight] * reference[channel];
                    light.test[channel] += weights[weight] * test[channel];
                }
                light.around += responses.most[weight] * reference[0];
            });
            light
        };
        (0..width * height).into_par_iter().map(of).collect()
    }

    /// What is held of the difference at some moments, each as planes.
    fn seen(&self, frames: &[&SequenceFrame], now: usize, looks: &[Look], adaptation: &Plane) -> Vec<SeenPlanes> {
        let (width, height) = frames[now].size();
        let of = |pixel: usize| {
            let mut seen = [Seen::default(); LOOKS_AT_ONCE];
            let level = Level::of(adaptation.values()[pixel]);
            self.along_the_eyes_way(frames, now, pixel, |weight, frame, pixel| {
                let (reference, test) = (at(&frame.reference, pixel), at(&frame.test, pixel));
                let difference = [0, 1, 2].map(|channel| test[channel] - reference[channel]);
                for (seen, look) in seen.iter_mut().zip(looks) {
                    for (channel, weights) in look.sustained.iter().enumerate() {
                        seen.sustained[channel] += weights[weight] * difference[channel];
                    }
                    seen.transient += look.transient(weight, level) * difference[0];
                }
            });
            seen
        };
        let seen: Vec<[Seen; LOOKS_AT_ONCE]> = (0..width * height).into_par_iter().map(of).collect();
        let plane = |look: usize, of: &(dyn Fn(&Seen) -> f32 + Sync)| {
            Plane::from_fn(width, height, |x, y| of(&seen[y * width + x][look]))
        };
        let planes = |look: usize| SeenPlanes {
            sustained: [0, 1, 2].map(|channel| plane(look, &|seen: &Seen| seen.sustained[channel])),
            transient: plane(look, &|seen: &Seen| seen.transient),
        };
        (0..looks.len()).map(planes).collect()
    }

    /// Thresholds between two pictures, with the masks that both of them have.
    fn thresholds(&self, light: &[Light], width: usize, height: usize) -> Result<Thresholds, Error> {
        let plane =
            |of: &(dyn Fn(&Light) -> f32 + Sync)| Plane::from_fn(width, height, |x, y| of(&light[y * width + x]));
        let reference = plane(&|light| light.reference[0].max(0.0));
        let test = plane(&|light| light.test[0].max(0.0));
        let area_deg2 = self.viewing.observer.csf_area_deg2;
        let csf = CastleCsf::new(area_deg2)?;
        let csf = HeldAtLowFrequencies { base: &csf };
        let map_of = |picture: &Plane| {
            let inputs = ThresholdInputs::clean(picture);
            threshold_map(&inputs, &self.viewing, &csf)
        };
        let achromatic = masked_by_both(map_of(&reference)?, &map_of(&test)?);
        // Flicker is judged under the brightest light that any channel holds: the transient channel of an eye adapted
        // to a dark shot holds as much of a bright one 0.2 s away as of the frame that is shown, and that is not seen
        // against the dark alone. Measured against the dark alone on an error of 2 % on 950 cd/m²: visibility 3.5 in
        // equal dark frames before the cut, 0.9 in its own.
        let brightest = plane(&|light| light.reference[0].max(light.around));
        let adaptation_cd_m2 = adapted(&brightest, &self.viewing);
        let (least, greatest) = adaptation_cd_m2.range();
        let flicker = HeldAtLowFrequencies { base: &CastleTransient { area_deg2 } };
        let levels = adaptation_levels(&self.viewing, &flicker, least, greatest);
        let chromatic = |index: usize, channel: ChromaticChannel| {
            let csf = CastleChromatic::new(channel, area_deg2)?;
            let csf = HeldAtLowFrequencies { base: &csf };
            let map_of = |own: &Plane, luminance: &Plane| chromatic_threshold_map(own, luminance, &self.viewing, &csf);
            let map = map_of(&plane(&|light| light.reference[index]), &reference)?;
            Ok(masked_by_both(map, &map_of(&plane(&|light| light.test[index]), &test)?))
        };
        Ok(Thresholds {
            transient: ThresholdMap { levels, adaptation_cd_m2, ..achromatic.clone() },
            red_green: chromatic(1, ChromaticChannel::RedGreen)?,
            yellow_violet: chromatic(2, ChromaticChannel::YellowViolet)?,
            achromatic,
        })
    }
}

/// [`Seen`] of all pixels.
struct SeenPlanes {
    sustained: [Plane; 3],
    transient: Plane,
}

impl<'a> Filters<'a> {
    fn new(thresholds: &'a Thresholds) -> Self {
        Self {
            sustained: ErrorFilters::amid_equals(&thresholds.achromatic),
            transient: ErrorFilters::amid_equals(&thresholds.transient),
            red_green: ErrorFilters::amid_equals(&thresholds.red_green),
            yellow_violet: ErrorFilters::amid_equals(&thresholds.yellow_violet),
        }
    }

    /// Raises a visibility to that of luminance at one moment where it is greater.
    fn add_achromatic(&mut self, greatest: &mut Plane, seen: &SeenPlanes) {
        let visibility = self.achromatic(&seen.sustained[0], &seen.transient);
        raise(greatest, &visibility);
    }

    /// Raises a visibility to that of colours at one moment where it is greater.
    fn add_chromatic(&mut self, greatest: &mut Plane, seen: &SeenPlanes) {
        let [_, red_green, yellow_violet] = &seen.sustained;
        raise(greatest, &self.red_green.visibility(red_green));
        raise(greatest, &self.yellow_violet.visibility(yellow_violet));
    }

    /// Visibility of a luminance difference whose sustained and transient parts are given; both channels add in
    /// amplitude.
    fn achromatic(&mut self, sustained: &Plane, transient: &Plane) -> Plane {
        let (sustained, transient) = (self.sustained.spectrum(sustained), self.transient.spectrum(transient));
        let mut energy = self.sustained.nothing();
        for band in 0..self.sustained.band_count() {
            let (a, b) = (self.sustained.response(&sustained, band), self.transient.response(&transient, band));
            let both = a.enlarged_with(&b, |sustained, transient| (sustained + transient).powi(2));
            energy.values_mut().iter_mut().zip(both.values()).for_each(|(sum, more)| *sum += more);
        }
        self.sustained.visibility_of(&energy)
    }
}

/// Whether a look, of so many a frame, is at colours: the outermost ones are, and the others in turn from them to the
/// middle, so that a frame before a change and one after it are seen alike.
fn is_at_colours(look: usize, count: usize) -> bool {
    count < FEW_LOOKS || look.min(count - 1 - look).is_multiple_of(LOOKS_PER_COLOUR)
}

fn raise(greatest: &mut Plane, other: &Plane) {
    greatest.values_mut().iter_mut().zip(other.values()).for_each(|(v, other)| *v = v.max(*other));
}

/// A pixel's luminance, red–green and yellow–violet.
fn at(channels: &Channels, pixel: usize) -> [f32; 3] {
    [&channels.achromatic, &channels.red_green, &channels.yellow_violet].map(|plane| plane.values()[pixel])
}

#[cfg(test)]
mod tests;
