//! The film's denoised picture as it will be seen, and what the perception crate says of its noise and of its bias.

use super::judge::{JudgeError, half_luminance};
use super::missed::{Darkness, EdgeProfile, FoundLight, LampEdges};
use super::settings::LoopSettings;
use crate::denoise::{DenoisedFilm, Denoiser, denoise_film, leave_the_void_dark};
use crate::film::{Estimate, Film, opponent};
use crate::sampler::Half;
use fechner_perception::Plane;
use fechner_perception::csf::ChromaticChannel;
use fechner_perception::denoised::{
    ChromaticPicture, DenoisedDifferences, DenoisedError, chromatic_error, step_towards_raw,
};
use fechner_perception::photometry::luminance;
use fechner_perception::seen;
use fechner_perception::threshold::ThresholdMap;
use fechner_perception::tone::FittedTone;
use rayon::prelude::*;
use std::time::Instant;

/// A denoised picture, judged.
#[derive(Debug)]
pub struct DenoisedPicture {
    /// Linear RGB in cd/m²: denoised, and moved towards the raw mean where that is proven better.
    pub rgb_cd_m2: Vec<[f32; 3]>,
    /// Luminance of the denoised picture, cd/m².
    pub luminance_cd_m2: Plane,
    /// Half the difference of the denoised halves' luminance as displayed, cd/m².
    pub half_difference: Plane,
    /// What can be seen of its error, without importance.
    pub error: DenoisedError,
    /// What can be seen of the error of luminance in a shot, if all of it were new in every frame, without importance.
    pub error_as_noise: Option<DenoisedError>,
}

/// The thresholds by which the error of a denoised picture is judged.
#[derive(Clone, Copy)]
pub(super) struct DenoisedThresholds<'a> {
    /// What is left of the noise.
    pub(super) of_noise: &'a ThresholdMap,
    /// What the denoiser makes of the picture, frame after frame: as the noise where `None`.
    pub(super) of_still: Option<&'a ThresholdMap>,
}

impl DenoisedThresholds<'_> {
    /// [`DenoisedPicture::error`] and [`DenoisedPicture::error_as_noise`].
    fn errors(self, differences: &DenoisedDifferences<'_>) -> (DenoisedError, Option<DenoisedError>) {
        let mut as_noise = self.of_noise.denoised_error(differences);
        let Some(of_still) = self.of_still else { return (as_noise, None) };
        // A plane a band, of which the audit has no use.
        let raw_shares = std::mem::take(&mut as_noise.raw_shares);
        let error = as_noise.clone().with_bias_of(&of_still.denoised_error(differences));
        (DenoisedError { raw_shares, ..error }, Some(as_noise))
    }
}

/// The film's picture and halves, denoised, and how long it took.
pub(super) struct TimedDenoising {
    pub(super) film: DenoisedFilm,
    pub(super) luminance: Plane,
    pub(super) seconds: f64,
}

impl TimedDenoising {
    pub(super) fn of(denoiser: &Denoiser, film: &Film, nits_per_unit: f64) -> Result<Self, JudgeError> {
        let started = Instant::now();
        let denoised = denoise_film(denoiser, film, nits_per_unit)?;
        let luminance = luminance_plane(&denoised.rgb_cd_m2, film.width() as usize);
        Ok(Self { film: denoised, luminance, seconds: started.elapsed().as_secs_f64() })
    }

    /// Looks at it. `estimate` is the raw mean.
    pub(super) fn judged(
        self,
        film: &Film,
        settings: &LoopSettings,
        tone: &dyn FittedTone,
        thresholds: DenoisedThresholds<'_>,
        estimate: &Estimate,
    ) -> Result<DenoisedPicture, JudgeError> {
        let width = film.width() as usize;
        let display = &settings.viewing.display;
        let [a, b] = self.film.halves_rgb_cd_m2.each_ref().map(|half| luminance_plane(half, width));
        let [raw_a, raw_b] = Half::BOTH.map(|half| half_luminance(film, half, settings.nits_per_unit));
        let half_difference = a.half_difference(&b);
        let displayed = seen::display_half_difference(tone, display, &self.luminance, &half_difference);
        // Through the operator itself the raw noise would be bent and bear false witness.
        let slope = seen::display_slope(tone, display, &self.luminance);
        let shown = |scene: &Plane| scene.combined(&slope, |scene, slope| scene * slope);
        let residual = self.luminance.combined(&estimate.luminance_cd_m2, |denoised, raw| denoised - raw);
        let raw_half_difference = raw_a.half_difference(&raw_b);
        let residual_half_difference = half_difference.combined(&raw_half_difference, |denoised, raw| denoised - raw);
        if !film.has_both_halves() {
            // The halves are one picture: they would bear witness that it has no noise.
            let (error, rgb_cd_m2) = (DenoisedError::unknown(width, slope.height()), self.film.rgb_cd_m2);
            return Ok(DenoisedPicture {
                rgb_cd_m2,
                luminance_cd_m2: self.luminance,
                half_difference: displayed,
                error,
                error_as_noise: None,
            });
        }
        let (error, error_as_noise) = thresholds.errors(&DenoisedDifferences {
            half_difference: &displayed,
            residual: &shown(&residual),
            residual_half_difference: &shown(&residual_half_difference),
        });
        let chromatic = self.chromatic_errors(film, settings, tone, estimate)?;
        let DenoisedFilm { rgb_cd_m2, lamps_from_cd_m2, .. } = self.film;
        let mut rgb_cd_m2 = blended_rgb(thresholds.of_noise, &error, rgb_cd_m2, &estimate.rgb_cd_m2, &slope);
        leave_the_void_dark(film, &mut rgb_cd_m2);
        let luminance_cd_m2 = luminance_plane(&rgb_cd_m2, width);
        let error = chromatic.iter().fold(error, DenoisedError::with_channel);
        let error = match EdgeProfile::of(settings.filter) {
            Some(profile) => {
                let found = FoundLight::of_film(film, settings.nits_per_unit);
                let missed = LampEdges { profile, film, found: &found, lamps_from_cd_m2 }.missed();
                let dark = Darkness::of(&missed, |pixel, light| {
                    let whole = found.mean_cd_m2.get(pixel.x, pixel.y) + light;
                    // A denoiser may have guessed some of it.
                    let whole = whole.max(luminance_cd_m2.get(pixel.x, pixel.y));
                    seen::display_luminance_at(tone, display, pixel, whole)
                });
                error.with_missed_light(&thresholds.of_noise.measured_visibility(&dark.mean))
            }
            None => error,
        };
        Ok(DenoisedPicture { rgb_cd_m2, luminance_cd_m2, half_difference: displayed, error, error_as_noise })
    }

    /// What can be seen of the error in both chromatic channels; nothing by a model of luminance alone.
    fn chromatic_errors(
        &self,
        film: &Film,
        settings: &LoopSettings,
        tone: &dyn FittedTone,
        estimate: &Estimate,
    ) -> Result<Vec<DenoisedError>, JudgeError> {
        if settings.model.is_some() {
            return Ok(Vec::new());
        }
        let display = &settings.viewing.display;
        let displayed = seen::display_luminance(tone, display, &self.luminance);
        let slope = seen::display_chromatic_slope(tone, display, &self.luminance);
        let width = film.width() as usize;
        let half_of = |[a, b]: [Plane; 2]| a.half_difference(&b);
        let of_channel = |(c, channel)| {
            let shown = |signal: &(dyn Fn(usize) -> f64 + Sync)| {
                Plane::from_fn(width, slope.height(), |x, y| (signal(y * width + x) as f32) * slope.get(x, y))
            };
            let of_rgb = |rgb: &[[f32; 3]]| shown(&|pixel| opponent(rgb[pixel].map(f64::from))[c]);
            let of_raw_half = |half: Half| {
                shown(&|pixel| settings.nits_per_unit * opponent(film.halves(pixel).half_or_other(half).mean)[c])
            };
            let picture = of_rgb(&self.film.rgb_cd_m2);
            let half_difference = half_of(self.film.halves_rgb_cd_m2.each_ref().map(|half| of_rgb(half)));
            let raw_half_difference = half_of(Half::BOTH.map(of_raw_half));
            let less_raw = |denoised: &Plane, raw: &Plane| denoised.combined(raw, |denoised, raw| denoised - raw);
            let differences = DenoisedDifferences {
                half_difference: &half_difference,
                residual: &less_raw(&picture, &of_rgb(&estimate.rgb_cd_m2)),
                residual_half_difference: &less_raw(&half_difference, &raw_half_difference),
            };
            let picture = ChromaticPicture { signal: &picture, luminance_cd_m2: &displayed, differences };
            Ok(chromatic_error(channel, &picture, &settings.viewing, settings.frames)?)
        };
        [(1, ChromaticChannel::RedGreen), (2, ChromaticChannel::YellowViolet)].into_par_iter().map(of_channel).collect()
    }
}

/// The denoised picture, moved towards the raw one where that is proven better, as far as the display shows a
/// difference: `slope` is that of the displayed over the scene's light around the denoised picture.
fn blended_rgb(
    thresholds: &ThresholdMap,
    error: &DenoisedError,
    denoised: Vec<[f32; 3]>,
    raw: &[[f32; 3]],
    slope: &Plane,
) -> Vec<[f32; 3]> {
    let (width, height) = (thresholds.width(), thresholds.height());
    let mut picture = denoised;
    for c in 0..3 {
        let residual = Plane::from_fn(width, height, |x, y| {
            let pixel = y * width + x;
            slope.get(x, y) * (picture[pixel][c] - raw[pixel][c])
        });
        let Some(step) = step_towards_raw(thresholds, error, &residual) else { break };
        let raw = Plane::from_fn(width, height, |x, y| raw[y * width + x][c]);
        let moved = Plane::from_fn(width, height, |x, y| {
            let (denoised, slope) = (picture[y * width + x][c], slope.get(x, y));
            if slope > 0.0 {
                let (least, most) = raw_range(&raw, x, y);
                (denoised + step.get(x, y) / slope).clamp(least.min(denoised), most.max(denoised))
            } else {
                denoised
            }
        });
        picture.iter_mut().zip(moved.values()).for_each(|(rgb, &value)| rgb[c] = value);
    }
    picture
}

/// The least and the most that a raw channel has at a pixel and the eight around it: bands that are moved by different
/// shares may overshoot, and no further than to what paths have found.
fn raw_range(raw: &Plane, x: usize, y: usize) -> (f32, f32) {
    let (columns, rows) = (x.saturating_sub(1)..raw.width().min(x + 2), y.saturating_sub(1)..raw.height().min(y + 2));
    let around = rows.flat_map(|y| columns.clone().map(move |x| raw.get(x, y)));
    around.fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
}

fn luminance_plane(rgb: &[[f32; 3]], width: usize) -> Plane {
    Plane::from_fn(width, rgb.len() / width.max(1), |x, y| luminance(rgb[y * width + x]).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner_perception::csf::CastleCsf;
    use fechner_perception::display::{Display, Viewing};
    use fechner_perception::threshold::{ThresholdInputs, threshold_map};

    const SIDE: usize = 64;
    const WALL_CD_M2: f32 = 50.0;
    /// A lamp that is 2000 times as bright as the display's white, four pixels wide.
    const LAMP_CD_M2: f32 = 4e5;

    fn lamp_covers(x: usize) -> bool {
        (30..34).contains(&x)
    }

    /// A denoiser has lost half of the lamp, and no band but the finest is worth moving back: what it lost stays the
    /// lamp's.
    #[test]
    fn a_lamp_does_not_ring_when_its_picture_moves_towards_the_raw_mean() {
        let viewing = Viewing::of(Display::preset("strict").unwrap());
        let white = viewing.display.white_cd_m2 as f32;
        let shown = Plane::from_fn(SIDE, SIDE, |x, _| if lamp_covers(x) { white } else { WALL_CD_M2 });
        let inputs = ThresholdInputs::clean(&shown);
        let thresholds = threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap();
        let picture = |lamp: f32| -> Vec<[f32; 3]> {
            (0..SIDE * SIDE).map(|pixel| [if lamp_covers(pixel % SIDE) { lamp } else { WALL_CD_M2 }; 3]).collect()
        };
        let slope = Plane::from_fn(SIDE, SIDE, |x, _| if lamp_covers(x) { 0.0 } else { 1.0 });
        let mut error = DenoisedError::unknown(SIDE, SIDE);
        let bands = 5;
        error.raw_shares = (0..bands).map(|band| Plane::filled(SIDE, SIDE, f32::from(band + 1 == bands))).collect();
        let (denoised, raw) = (picture(0.5 * LAMP_CD_M2), picture(LAMP_CD_M2));
        let moved = blended_rgb(&thresholds, &error, denoised.clone(), &raw, &slope);
        assert_eq!(moved, denoised, "the wall was right, and of the lamp no more is seen than white");
    }

    /// Shares of single bands overshoot beside an edge: no further than to what the raw mean has there.
    #[test]
    fn what_moves_towards_the_raw_mean_stays_within_it() {
        let viewing = Viewing::of(Display::preset("strict").unwrap());
        let grey = Plane::filled(SIDE, SIDE, WALL_CD_M2);
        let inputs = ThresholdInputs::clean(&grey);
        let thresholds = threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap();
        let mut error = DenoisedError::unknown(SIDE, SIDE);
        error.raw_shares = (0..5).map(|band| Plane::filled(SIDE, SIDE, if band < 3 { 0.0 } else { 1.0 })).collect();
        let raw: Vec<[f32; 3]> =
            (0..SIDE * SIDE).map(|pixel| [if pixel % SIDE < 32 { 10.0 } else { 100.0 }; 3]).collect();
        let denoised = vec![[55.0; 3]; SIDE * SIDE];
        let moved = blended_rgb(&thresholds, &error, denoised, &raw, &Plane::filled(SIDE, SIDE, 1.0));
        assert!(moved.iter().flatten().all(|value| (10.0..=100.0).contains(value)));
        let edge = SIDE / 2 * SIDE + 32;
        assert!(moved[edge - 1][0] < 30.0 && moved[edge][0] > 80.0, "{} {}", moved[edge - 1][0], moved[edge][0]);
    }
}
