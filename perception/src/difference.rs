//! A visible-differences predictor: can one picture be told from another?
//!
//! After Daly 1993, for two stills that lie pixel on pixel: a shift by a pixel is a difference as any other. Not for
//! moving pictures ([`crate::sequence`]), and not for how good a picture is: it says whether a difference is seen, and
//! its scale is thresholds.

use crate::colour::Channels;
use crate::csf::{CastleChromatic, ChromaticChannel, ContrastSensitivity};
use crate::display::Viewing;
use crate::error::Error;
use crate::plane::Plane;
use crate::psychometric::detection_probability;
use crate::threshold::{ThresholdInputs, ThresholdMap, chromatic_threshold_map, threshold_map};

/// What an observer sees of the difference of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Visibility v of the difference at each pixel, in threshold units.
    pub visibility: Plane,
    /// Greatest v over the picture: the one figure. Above 1 the pictures are told apart somewhere.
    pub worst_visibility: f64,
    /// Share of the pixels with v above 1.
    pub visible_fraction: f64,
}

impl Difference {
    pub(crate) fn of(visibility: Plane) -> Self {
        Self {
            worst_visibility: f64::from(visibility.max()),
            visible_fraction: visibility.share_above(1.0),
            visibility,
        }
    }

    /// At each pixel the more visible of this difference and another one of the same pictures, shown otherwise.
    ///
    /// # Panics
    /// Unless the other one has as many columns and rows.
    #[must_use]
    pub fn or_worse(&self, other: &Self) -> Self {
        Self::of(self.visibility.combined(&other.visibility, f32::max))
    }

    /// Probability of seeing the difference in the 1° patch around each pixel: 1 − exp(−v^3.5).
    #[must_use]
    pub fn detection(&self) -> Plane {
        self.visibility.map(|v| detection_probability(f64::from(v)) as f32)
    }

    /// Whether the difference reaches threshold anywhere.
    #[must_use]
    pub fn is_visible(&self) -> bool {
        self.worst_visibility > 1.0
    }
}

/// Predicts what can be seen of the difference between two pictures' displayed luminances (cd/m²).
///
/// After Daly, "The visible differences predictor", 1993: amplitude nonlinearity by local adaptation, the contrast
/// sensitivity function (`csf`, any of [`crate::csf`]), masking by band. Changed: isotropic octave bands instead of
/// the cortex transform, bands added by energy and pooled over 1° instead of probability summation (so that its
/// figure is the visibility that the rest of this crate uses), and sensitivity below 0.5 cpd held at its value there,
/// so that a picture that is brighter as a whole counts. Masking is mutual, the lesser of what the two pictures mask:
/// detail that only one of them has does not hide its own absence from the other. The eye adapts to the reference, so
/// the two are not to be exchanged where one is much brighter.
///
/// Beyond the border nothing differs: an error there is as visible as if both pictures went on alike. A difference
/// that changes slowly (over 1° and more) has no edge at the border, since what is seen around a picture is no equal
/// one.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::Empty`], [`Error::BadPixel`] for pictures that cannot be compared,
/// [`Error::OutOfRange`] for an impossible viewing.
///
/// ```
/// use fechner_perception::{CastleCsf, Plane, Viewing};
/// use fechner_perception::difference::difference;
/// let reference = Plane::filled(64, 64, 100.0);
/// let mut test = reference.clone();
/// test.values_mut()[64 * 32 + 32] = 200.0; // twice as bright
/// test.values_mut()[64 * 32 + 33] = 200.0;
/// let seen = difference(&reference, &test, &Viewing::default(), &CastleCsf::default())?;
/// assert!(seen.is_visible());
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn difference(
    reference_cd_m2: &Plane,
    test_cd_m2: &Plane,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<Difference, Error> {
    test_cd_m2.check_size("test picture", reference_cd_m2.width(), reference_cd_m2.height())?;
    reference_cd_m2.check_non_negative("reference picture")?;
    test_cd_m2.check_non_negative("test picture")?;
    let csf = HeldAtLowFrequencies { base: csf };
    let map_of = |picture| threshold_map(&ThresholdInputs::clean(picture), viewing, &csf);
    let seen = mutual_visibility(map_of(reference_cd_m2)?, &map_of(test_cd_m2)?, reference_cd_m2, test_cd_m2);
    Ok(Difference::of(seen))
}

/// [`difference`] for pictures in colour (linear Rec. 709 RGB on the display, cd/m², row-major): at each pixel the
/// most visible of the achromatic channel, through `csf`, and castleCSF's red–green and yellow–violet.
///
/// # Errors
/// [`Error::ValueCount`] unless both pictures have `width * height` pixels; else as [`difference`].
///
/// ```
/// use fechner_perception::{CastleCsf, Viewing};
/// use fechner_perception::difference::colour_difference;
/// let grey = vec![[100.0; 3]; 64 * 64];
/// // Redder, with less green and the same luminance.
/// let tinted = vec![[120.0, 100.0 - 20.0 * 0.2126 / 0.7152, 100.0]; 64 * 64];
/// let seen = colour_difference(&grey, &tinted, 64, 64, &Viewing::default(), &CastleCsf::default())?;
/// assert!(seen.is_visible());
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn colour_difference(
    reference_rgb_cd_m2: &[[f32; 3]],
    test_rgb_cd_m2: &[[f32; 3]],
    width: usize,
    height: usize,
    viewing: &Viewing,
    csf: &dyn ContrastSensitivity,
) -> Result<Difference, Error> {
    let [reference, test] = [reference_rgb_cd_m2, test_rgb_cd_m2].map(|rgb| Channels::new(rgb, width, height));
    let (reference, test) = (reference?, test?);
    let mut greatest = difference(&reference.achromatic, &test.achromatic, viewing, csf)?.visibility;
    for (channel, own, other) in [
        (ChromaticChannel::RedGreen, &reference.red_green, &test.red_green),
        (ChromaticChannel::YellowViolet, &reference.yellow_violet, &test.yellow_violet),
    ] {
        let csf = CastleChromatic::new(channel, viewing.observer.csf_area_deg2)?;
        let csf = HeldAtLowFrequencies { base: &csf };
        let map = chromatic_threshold_map(own, &reference.achromatic, viewing, &csf)?;
        let test_map = chromatic_threshold_map(other, &test.achromatic, viewing, &csf)?;
        let seen = mutual_visibility(map, &test_map, own, other);
        greatest.values_mut().iter_mut().zip(seen.values()).for_each(|(v, other)| *v = v.max(*other));
    }
    Ok(Difference::of(greatest))
}

/// Visibility of the difference between two signals, masked by what both of them mask.
pub(crate) fn mutual_visibility(map: ThresholdMap, test_map: &ThresholdMap, reference: &Plane, test: &Plane) -> Plane {
    masked_by_both(map, test_map).visibility_amid_equals(&test.combined(reference, |test, reference| test - reference))
}

/// A map whose masks are the lesser of its own and another's.
pub(crate) fn masked_by_both(mut map: ThresholdMap, other: &ThresholdMap) -> ThresholdMap {
    for (elevation, other_elevation) in map.elevations.iter_mut().zip(&other.elevations) {
        elevation.combine(other_elevation, |own, other, _, _| own.min(other));
    }
    map
}

/// Sensitivity below 0.5 cpd as at 0.5 cpd, 0 included.
pub(crate) struct HeldAtLowFrequencies<'a> {
    pub(crate) base: &'a dyn ContrastSensitivity,
}

impl ContrastSensitivity for HeldAtLowFrequencies<'_> {
    fn name(&self) -> &'static str {
        self.base.name()
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        self.base.sensitivity(freq_cpd.max(0.5), luminance_cd_m2)
    }

    fn transfer(&self, freq_cpd: f64) -> f64 {
        self.base.transfer(freq_cpd.max(0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::test_noise::{normal, red_for_green};

    fn compare(reference: &Plane, test: &Plane) -> Difference {
        difference(reference, test, &Viewing::default(), &CastleCsf::default()).unwrap()
    }

    fn noisy(reference: &Plane, relative: f32) -> Plane {
        let mut state = 3;
        let mut test = reference.clone();
        test.values_mut().iter_mut().for_each(|value| *value *= 1.0 + relative * normal(&mut state).clamp(-3.0, 3.0));
        test
    }

    #[test]
    fn equal_pictures_are_equal() {
        let picture = Plane::from_fn(50, 40, |x, y| (x * y) as f32);
        let found = compare(&picture, &picture);
        assert_eq!((found.worst_visibility, found.visible_fraction), (0.0, 0.0));
        assert!(!found.is_visible());
    }

    #[test]
    fn more_noise_is_more_visible() {
        let grey = Plane::filled(96, 96, 100.0);
        let levels = [0.001, 0.005, 0.02, 0.08].map(|noise| compare(&grey, &noisy(&grey, noise)).worst_visibility);
        assert!(levels.windows(2).all(|pair| pair[0] < pair[1]), "{levels:?}");
        assert!(levels[0] < 1.0 && levels[3] > 1.0);
    }

    #[test]
    fn a_picture_brighter_as_a_whole_is_seen() {
        let grey = Plane::filled(64, 64, 100.0);
        assert!(compare(&grey, &grey.map(|value| value * 1.1)).is_visible());
        assert!(!compare(&grey, &grey.map(|value| value * 1.002)).is_visible());
    }

    const GREY_CD_M2: f32 = 50.0;

    /// Squares of `side` pixels, half brighter, on grey of 128 × 128: in the middle, at an edge and in a corner.
    fn squares(side: usize) -> [(usize, usize); 3] {
        [(64 - side / 2, 64 - side / 2), (0, 64 - side / 2), (128 - side, 128 - side)]
    }

    /// Grey of 128 × 128 with so much equal grey around it, and a square that is half brighter.
    fn with_square(border: usize, side: usize, (left, top): (usize, usize)) -> Plane {
        let within = |at: usize, first: usize| (border + first..border + first + side).contains(&at);
        Plane::from_fn(128 + 2 * border, 128 + 2 * border, |x, y| {
            if within(x, left) && within(y, top) { 1.5 * GREY_CD_M2 } else { GREY_CD_M2 }
        })
    }

    /// Nothing differs beyond a border, so an error there is as visible as with an equal border around both pictures,
    /// at every pixel.
    #[test]
    fn an_error_at_the_border_is_as_visible_as_with_an_equal_surround() {
        let wide = 128;
        let seen = |border: usize, side, place| {
            let test = with_square(border, side, place);
            compare(&Plane::filled(test.width(), test.height(), GREY_CD_M2), &test).visibility
        };
        for side in [1, 3, 9] {
            for place in squares(side) {
                let (found, expected) = (seen(0, side, place), seen(wide, side, place));
                let worst = expected.range().1;
                for (x, y) in (0..128).flat_map(|x| (0..128).map(move |y| (x, y))) {
                    let (found, expected) = (found.get(x, y), expected.get(x + wide, y + wide));
                    assert!(
                        (found - expected).abs() < 0.02 * worst,
                        "square of {side} at {place:?}: {found} at ({x}, {y}), not {expected} (worst {worst})"
                    );
                }
            }
        }
    }

    /// What a picture's border is seen against is no part of the comparison: one that is brighter as a whole, or
    /// towards a side, must not have an edge there.
    #[test]
    fn a_picture_brighter_as_a_whole_has_no_edge_at_its_border() {
        let grey = Plane::filled(180, 180, GREY_CD_M2);
        let seen = compare(&grey, &grey.map(|value| 1.02 * value)).visibility;
        let (least, most) = seen.range();
        assert!(most / least - 1.0 < 1e-3, "{least} to {most}");
        // 2 % at one side, 0 at the other: 0.7 % a degree.
        let slope = compare(&grey, &Plane::from_fn(180, 180, |x, _| GREY_CD_M2 * (1.0 + 0.02 * x as f32 / 180.0)));
        assert!(slope.worst_visibility < 1.02 * f64::from(most), "{} {most}", slope.worst_visibility);
    }

    #[test]
    fn lost_texture_is_not_hidden_by_itself() {
        let texture =
            Plane::from_fn(128, 128, |x, y| 100.0 * (1.0 + 0.3 * (x as f32 * 0.42).cos() * (y as f32 * 0.42).cos()));
        let flat = Plane::filled(128, 128, 100.0);
        let lost = compare(&texture, &flat).worst_visibility;
        assert!((lost / compare(&flat, &texture).worst_visibility - 1.0).abs() < 0.05);
        assert!(lost > 5.0, "{lost}");
        // While noise on the texture is hidden by it, where the same noise on grey is not.
        let on_texture = compare(&texture, &noisy(&texture, 0.03)).visibility.get(64, 64);
        let on_grey = compare(&flat, &noisy(&flat, 0.03)).visibility.get(64, 64);
        assert!(on_texture < 0.95 * on_grey, "{on_texture} {on_grey}");
    }

    #[test]
    fn a_tint_of_equal_luminance_is_seen_and_grey_differs_as_without_colour() {
        let grey = vec![[100.0; 3]; 64 * 64];
        let of = |test: &[[f32; 3]]| {
            colour_difference(&grey, test, 64, 64, &Viewing::default(), &CastleCsf::default()).unwrap()
        };
        let tinted = |red: f32| vec![red_for_green(red).map(|tint| 100.0 + tint); 64 * 64];
        assert!(of(&tinted(15.0)).is_visible());
        assert!(!of(&tinted(0.1)).is_visible());
        let brighter = of(&vec![[104.0; 3]; 64 * 64]).worst_visibility;
        let alone = compare(&Plane::filled(64, 64, 100.0), &Plane::filled(64, 64, 104.0)).worst_visibility;
        assert!((brighter / alone - 1.0).abs() < 1e-3, "{brighter} {alone}");
        assert!(colour_difference(&grey, &grey[1..], 64, 64, &Viewing::default(), &CastleCsf::default()).is_err());
    }

    #[test]
    fn pictures_of_two_sizes_are_an_error() {
        let (a, b) = (Plane::filled(4, 4, 1.0), Plane::filled(4, 5, 1.0));
        assert!(difference(&a, &b, &Viewing::default(), &CastleCsf::default()).is_err());
    }
}
