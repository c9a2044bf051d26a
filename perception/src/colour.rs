//! Visibility of colour errors: over the achromatic, red–green and yellow–violet channels the largest counts.
//!
//! Through castleCSF's achromatic and chromatic mechanisms (Ashraf et al. 2024). Each channel is masked by its own
//! contrast alone, and visibilities of channels do not add. Not for thresholds of fine red–green patterns: the
//! function's fall there is an extrapolation beyond its data, by which fine red–green noise counts for more than it
//! should.

use crate::csf::{CastleChromatic, CastleCsf, ChromaticChannel, ContrastSensitivity, FrameTiming};
use crate::display::Viewing;
use crate::error::{Error, check_range};
use crate::model::finite_error;
use crate::noise_gain::noise_gain;
use crate::opponent::{Opponent, opponent};
use crate::plane::Plane;
use crate::sensitivity::{LuminanceSpan, SensitivityTables};
use crate::threshold::{
    GuideNoise, ThresholdInputs, ThresholdMap, chromatic_threshold_map, noisy_chromatic_threshold_map, threshold_map,
};
use crate::tone::acuity::{AcuityFilter, BehindAcuity};

/// Thresholds of one picture in each of the eye's three channels.
#[derive(Clone, Debug)]
pub struct ColourThresholds {
    /// Thresholds of errors of luminance.
    pub achromatic: ThresholdMap,
    /// Thresholds of errors of the red–green signal, L − M.
    pub red_green: ThresholdMap,
    /// Thresholds of errors of the yellow–violet signal, S − (L + M).
    pub yellow_violet: ThresholdMap,
}

/// Finds the thresholds of a displayed picture (linear Rec. 709 RGB in cd/m², row-major, denoised) for errors of any
/// colour, with castleCSF for the observer's area.
///
/// # Errors
/// [`Error::ValueCount`] unless there are `width * height` pixels; else as [`threshold_map`].
///
/// ```
/// use fechner_perception::Viewing;
/// use fechner_perception::colour::colour_thresholds;
/// let grey = vec![[80.0; 3]; 64 * 64];
/// let thresholds = colour_thresholds(&grey, 64, 64, &Viewing::default())?;
/// let error = vec![[0.5; 3]; 64 * 64];
/// assert!(thresholds.measured_visibility(&error)?.get(32, 32).is_finite());
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn colour_thresholds(
    display_rgb_cd_m2: &[[f32; 3]],
    width: usize,
    height: usize,
    viewing: &Viewing,
) -> Result<ColourThresholds, Error> {
    viewing.check()?;
    let picture = Channels::new(display_rgb_cd_m2, width, height)?;
    let area_deg2 = viewing.observer.csf_area_deg2;
    let luminance = picture.achromatic.map(|value| if value < 0.0 { 0.0 } else { value });
    let chromatic = |signal: &Plane, channel: ChromaticChannel| {
        chromatic_threshold_map(signal, &luminance, viewing, &CastleChromatic::new(channel, area_deg2)?)
    };
    Ok(ColourThresholds {
        achromatic: threshold_map(&ThresholdInputs::clean(&luminance), viewing, &CastleCsf::new(area_deg2)?)?,
        red_green: chromatic(&picture.red_green, ChromaticChannel::RedGreen)?,
        yellow_violet: chromatic(&picture.yellow_violet, ChromaticChannel::YellowViolet)?,
    })
}

/// Visibility at each pixel of the colour alone of the error that two halves of a picture show, half their difference
/// in linear Rec. 709 RGB on the display, cd/m²: the greater of castleCSF's red–green and yellow–violet, for the
/// observer's area. `acuity` is what an operator takes away of the picture, and of this error with it. For error at
/// rest: no motion hides it.
///
/// `noise_of_picture` is the variance of the noise that the picture itself has, over that of this error: 0 of a
/// picture without noise, 1 of the mean of the two halves. Such noise hides none of the error.
///
/// # Errors
/// [`Error::ValueCount`] unless picture and error have `width * height` pixels; [`Error::OutOfRange`] for a variance
/// that is negative; else as [`chromatic_threshold_map`].
pub fn chromatic_visibility(
    display_rgb_cd_m2: &[[f32; 3]],
    half_difference_rgb: &[[f32; 3]],
    (width, height): (usize, usize),
    noise_of_picture: f32,
    viewing: &Viewing,
    acuity: Option<AcuityFilter>,
) -> Result<Plane, Error> {
    viewing.check()?;
    check_range("noise_of_picture", f64::from(noise_of_picture), 0.0, 1e6, "between 0 and 1e6")?;
    let picture = Channels::new(display_rgb_cd_m2, width, height)?;
    let error = Channels::new(half_difference_rgb, width, height)?;
    let luminance = picture.achromatic.map(|value| if value < 0.0 { 0.0 } else { value });
    let seen = |signal: &Plane, error: &Plane, channel: ChromaticChannel| {
        let csf = BehindAcuity { csf: CastleChromatic::new(channel, viewing.observer.csf_area_deg2)?, acuity };
        let variance = error.map(|error| noise_of_picture * finite_error(error).powi(2));
        let noise = if noise_of_picture > 0.0 { GuideNoise::White(&variance) } else { GuideNoise::Clean };
        Ok::<_, Error>(
            noisy_chromatic_threshold_map(signal, &luminance, noise, viewing, &csf)?.measured_visibility(error),
        )
    };
    let red_green = seen(&picture.red_green, &error.red_green, ChromaticChannel::RedGreen)?;
    let yellow_violet = seen(&picture.yellow_violet, &error.yellow_violet, ChromaticChannel::YellowViolet)?;
    Ok(red_green.combined(&yellow_violet, f32::max))
}

impl ColourThresholds {
    /// Visibility at each pixel of the error that two halves of a picture show, half their difference in linear Rec.
    /// 709 RGB on the display, cd/m²: the greatest over the three channels (see
    /// [`ThresholdMap::measured_visibility`]).
    ///
    /// # Errors
    /// [`Error::ValueCount`] for an error of another size.
    pub fn measured_visibility(&self, half_difference_rgb: &[[f32; 3]]) -> Result<Plane, Error> {
        let error = Channels::new(half_difference_rgb, self.achromatic.width(), self.achromatic.height())?;
        let mut greatest = self.achromatic.measured_visibility(&error.achromatic);
        for other in [
            self.red_green.measured_visibility(&error.red_green),
            self.yellow_violet.measured_visibility(&error.yellow_violet),
        ] {
            greatest.values_mut().iter_mut().zip(other.values()).for_each(|(v, other)| *v = v.max(*other));
        }
        Ok(greatest)
    }
}

impl ThresholdMap {
    /// N(x) in 1/(cd/m²)² of a chromatic channel: white pixel noise of variance σ² in that opponent signal has
    /// visibility v with v² = 2 N σ². Under the adaptation of this map, without masking (an upper bound that needs no
    /// transform).
    ///
    /// # Errors
    /// As [`CastleChromatic::new`].
    pub fn chromatic_noise_gain(&self, channel: ChromaticChannel) -> Result<Plane, Error> {
        let csf = CastleChromatic::new(channel, self.viewing.observer.csf_area_deg2)?;
        let span = LuminanceSpan::of([&self.adaptation_cd_m2]);
        let tables = SensitivityTables::new(&self.bands, &self.viewing, &csf, span);
        let gain = noise_gain(&tables, &self.adaptation_cd_m2, &[]);
        let grey_cd_m2 = self.viewing.display.grey_cd_m2();
        Ok(self.seen_from_gaze(gain, channel, |freq_cpd| csf.sensitivity(freq_cpd, grey_cd_m2)))
    }

    /// Noise gains N(x) of both chromatic channels, 1/(cd/m²)²: [`Self::chromatic_noise_gain`] of each.
    ///
    /// # Errors
    /// As [`CastleChromatic::new`].
    pub fn chromatic_gains(&self) -> Result<ChromaticGains, Error> {
        let (red_green, yellow_violet) = rayon::join(
            || self.chromatic_noise_gain(ChromaticChannel::RedGreen),
            || self.chromatic_noise_gain(ChromaticChannel::YellowViolet),
        );
        Ok(ChromaticGains { red_green: red_green?, yellow_violet: yellow_violet? })
    }

    /// Noise gains N(x) of both chromatic channels, 1/(cd/m²)², for noise that is new in every frame.
    ///
    /// # Errors
    /// As [`CastleChromatic::new`], and for an impossible timing.
    pub fn chromatic_gains_of_fresh_noise(&self, timing: FrameTiming) -> Result<ChromaticGains, Error> {
        let still = self.chromatic_gains()?;
        let red_green = timing.chromatic_energy(ChromaticChannel::RedGreen)? as f32;
        let yellow_violet = timing.chromatic_energy(ChromaticChannel::YellowViolet)? as f32;
        Ok(ChromaticGains {
            red_green: still.red_green.map(|gain| gain * red_green),
            yellow_violet: still.yellow_violet.map(|gain| gain * yellow_violet),
        })
    }

    /// The luminance variance that would be as visible as the most visible of three channels' noise: max over
    /// channels of `N_c` `σ_c²`, over N. Planes in (cd/m²)² on the display, in the order of [`Opponent`]; infinite
    /// everywhere for planes of other sizes than this map's.
    #[must_use]
    pub fn luminance_equivalent_variance(&self, gains: &ChromaticGains, variances: [&Plane; 3]) -> Plane {
        let [achromatic, red_green, yellow_violet] = variances;
        let planes = [achromatic, red_green, yellow_violet, &gains.red_green, &gains.yellow_violet];
        if planes.iter().any(|plane| !plane.same_size(&self.noise_gain)) {
            return Plane::filled(self.width(), self.height(), f32::INFINITY);
        }
        Plane::from_fn(self.width(), self.height(), |x, y| {
            let chromatic = (gains.red_green.get(x, y) * red_green.get(x, y))
                .max(gains.yellow_violet.get(x, y) * yellow_violet.get(x, y));
            let gain = self.noise_gain.get(x, y);
            let equivalent = if gain > 0.0 { chromatic / gain } else { 0.0 };
            achromatic.get(x, y).max(equivalent)
        })
    }
}

/// N(x) of the chromatic channels, 1/(cd/m²)²: see [`ThresholdMap::chromatic_noise_gain`].
#[derive(Clone, Debug)]
pub struct ChromaticGains {
    /// N(x) of the red–green signal, L − M.
    pub red_green: Plane,
    /// N(x) of the yellow–violet signal, S − (L + M).
    pub yellow_violet: Plane,
}

/// A picture's opponent signals, cd/m².
pub(crate) struct Channels {
    pub(crate) achromatic: Plane,
    pub(crate) red_green: Plane,
    pub(crate) yellow_violet: Plane,
}

impl Channels {
    pub(crate) fn new(rgb_cd_m2: &[[f32; 3]], width: usize, height: usize) -> Result<Self, Error> {
        if width.checked_mul(height) != Some(rgb_cd_m2.len()) {
            return Err(Error::ValueCount { width, height, found: rgb_cd_m2.len() });
        }
        let plane = |signal: fn(Opponent) -> f32| {
            Plane::from_fn(width, height, |x, y| signal(opponent(rgb_cd_m2[y * width + x])))
        };
        Ok(Self {
            achromatic: plane(|colour| colour.achromatic),
            red_green: plane(|colour| colour.red_green),
            yellow_violet: plane(|colour| colour.yellow_violet),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_noise::{normal, red_for_green};

    const SIDE: usize = 128;

    fn noise(of: impl Fn(f32) -> [f32; 3]) -> Vec<[f32; 3]> {
        let mut state = 11;
        (0..SIDE * SIDE).map(|_| of(normal(&mut state))).collect()
    }

    #[test]
    fn noise_of_constant_luminance_is_seen() {
        let grey = vec![[100.0; 3]; SIDE * SIDE];
        let thresholds = colour_thresholds(&grey, SIDE, SIDE, &Viewing::default()).unwrap();
        let error = noise(|value| red_for_green(40.0 * value));
        let luminance = Plane::from_fn(SIDE, SIDE, |x, y| opponent(error[y * SIDE + x]).achromatic);
        let missed = thresholds.achromatic.measured_visibility(&luminance).get(64, 64);
        let seen = thresholds.measured_visibility(&error).unwrap().get(64, 64);
        assert!(missed < 1e-3 && seen > 1.0, "luminance {missed}, all channels {seen}");
        let of_colour = |acuity| {
            let found = chromatic_visibility(&grey, &error, (SIDE, SIDE), 0.0, &Viewing::default(), acuity);
            found.unwrap().get(64, 64)
        };
        assert_eq!(of_colour(None), seen);
        // What is blurred away is not seen.
        let night = AcuityFilter::for_adaptation(0.01, &Viewing::default());
        assert!(night.is_some() && of_colour(night) < 0.9 * seen, "{} of {seen}", of_colour(night));
    }

    /// A picture that is the mean of two noisy halves. Regression: its own noise masked most of the noise that it is
    /// judged by.
    #[test]
    fn noise_of_colour_does_not_hide_itself() {
        let error = noise(|value| red_for_green(40.0 * value));
        let mut state = 5;
        let grey = vec![[100.0; 3]; SIDE * SIDE];
        let noisy: Vec<[f32; 3]> =
            (0..SIDE * SIDE).map(|_| red_for_green(40.0 * normal(&mut state)).map(|light| 100.0 + light)).collect();
        let seen = |picture: &[[f32; 3]], noise_of_picture| {
            let viewing = Viewing::default();
            chromatic_visibility(picture, &error, (SIDE, SIDE), noise_of_picture, &viewing, None).unwrap().mean()
        };
        let (clean, hidden, known) = (seen(&grey, 0.0), seen(&noisy, 0.0), seen(&noisy, 1.0));
        assert!(hidden < 0.8 * clean && (known / clean - 1.0).abs() < 0.08, "{clean}, {hidden}, {known}");
    }

    #[test]
    fn grey_noise_is_as_visible_as_its_luminance() {
        let grey = vec![[100.0; 3]; SIDE * SIDE];
        let thresholds = colour_thresholds(&grey, SIDE, SIDE, &Viewing::default()).unwrap();
        let error = noise(|value| [3.0 * value; 3]);
        let luminance = Plane::from_fn(SIDE, SIDE, |x, y| opponent(error[y * SIDE + x]).achromatic);
        let alone = thresholds.achromatic.measured_visibility(&luminance).get(64, 64);
        let all = thresholds.measured_visibility(&error).unwrap().get(64, 64);
        assert!((all / alone - 1.0).abs() < 1e-5, "{all} {alone}");
        assert!(thresholds.measured_visibility(&error[1..]).is_err());
    }
}
