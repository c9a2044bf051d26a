//! Where one looks, and how sensitivity falls away from there.
//!
//! castleCSF (Ashraf et al. 2024, see [`crate::csf::CastleCsf`]): S falls by 10^−((e₀ + e₁ ρ) ε) for ρ cycles a
//! degree at an eccentricity of ε degrees, with constants for the temporal and the nasal half of an eye's visual
//! field. What is in one eye's nasal half is in the other's temporal half, so the better of both counts; above and
//! below the gaze, where both eyes have the temporal constants, that is to the safe side.
//!
//! For a gaze that is known, as by an eye tracker or a pointer that stands for one. Not for pictures that are kept:
//! who looks at them may look anywhere.

use crate::bands::{RINGS, for_each_ring};
use crate::csf::ChromaticChannel;
use crate::display::PixelDensity;
use crate::noise_gain::noise_gain;
use crate::plane::Plane;
use crate::sensitivity::AdaptationLevel;
use crate::table::UniformTable;
use crate::threshold::ThresholdMap;
use serde::{Deserialize, Serialize};

/// A place in the picture that is looked at, pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gaze {
    /// Pixels from the picture's left edge.
    pub x_px: f64,
    /// Pixels from the picture's upper edge.
    pub y_px: f64,
}

impl Gaze {
    /// Whether it is at a place in a picture of this size, or at its edge.
    #[must_use]
    pub fn is_within(&self, width: u32, height: u32) -> bool {
        (0.0..=f64::from(width)).contains(&self.x_px) && (0.0..=f64::from(height)).contains(&self.y_px)
    }
}

/// The eye's three channels, of which each loses sensitivity away from the gaze by a law of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The channel of luminance.
    Achromatic,
    /// One of the two opponent channels, L − M or S − (L + M).
    Chromatic(ChromaticChannel),
}

/// Around a gaze that is not known better, degrees: within, nothing is taken to be less visible.
pub const GAZE_MARGIN_DEG: f64 = 1.0;
/// Eccentricities beyond are taken as this, degrees: about where castleCSF's data end.
const FARTHEST_DEG: f64 = 60.0;
/// Steps a degree of tables.
const STEPS_PER_DEGREE: f64 = 4.0;

/// e₀ in 1/deg and e₁ in 1/(deg cpd), decades of sensitivity.
struct Decline {
    e0: f64,
    e1: f64,
}

/// Temporal, then nasal.
const fn declines(channel: Channel) -> [Decline; 2] {
    match channel {
        Channel::Achromatic => {
            [Decline { e0: 0.023_985_3, e1: 0.018_903_8 }, Decline { e0: 0.040_066_2, e1: 0.008_136_19 }]
        }
        Channel::Chromatic(ChromaticChannel::RedGreen) => {
            [Decline { e0: 0.059_140_2, e1: 2.049_86e-69 }, Decline { e0: 2.896_15e-5, e1: 0.181_08 }]
        }
        Channel::Chromatic(ChromaticChannel::YellowViolet) => {
            [Decline { e0: 0.003_568_65, e1: 0.008_066_31 }, Decline { e0: 5.858_04e-141, e1: 0.011_066_2 }]
        }
    }
}

/// Share of the foveal sensitivity that is left at an eccentricity, 0 to 1, for gratings of `freq_cpd`, seen by both
/// eyes.
///
/// ```
/// use fechner_perception::eccentricity::{Channel, sensitivity_left};
/// // Ten degrees from the gaze, a grating of 4 cycles a degree needs five times the contrast.
/// let left = sensitivity_left(Channel::Achromatic, 4.0, 10.0);
/// assert!((left - 0.187_9).abs() < 1e-4, "{left}");
/// ```
#[must_use]
pub fn sensitivity_left(channel: Channel, freq_cpd: f64, eccentricity_deg: f64) -> f64 {
    let eccentricity = eccentricity_deg.abs().min(FARTHEST_DEG);
    let decades = declines(channel).map(|Decline { e0, e1 }| (e0 + e1 * freq_cpd.max(0.0)) * eccentricity);
    10.0_f64.powf(-decades[0].min(decades[1]))
}

/// Angle in degrees between the gaze and each pixel of a flat display whose middle is straight ahead, less
/// [`GAZE_MARGIN_DEG`].
#[must_use]
pub fn eccentricity_deg(width: usize, height: usize, gaze: Gaze, density: PixelDensity) -> Plane {
    let display = FlatDisplay::new(width, height, density);
    Plane::from_fn(width, height, |x, y| {
        let pixel = Gaze { x_px: x as f64 + 0.5, y_px: y as f64 + 0.5 };
        (display.angle_deg(gaze, pixel) - GAZE_MARGIN_DEG).max(0.0) as f32
    })
}

/// A picture on a flat display whose middle is straight ahead of the eye: towards its borders a degree holds more
/// pixels.
#[derive(Clone, Copy, Debug)]
pub struct FlatDisplay {
    middle_px: [f64; 2],
    /// Pixels as far as the display is away.
    distance_px: [f64; 2],
}

impl FlatDisplay {
    /// A picture of so many pixels, of `density` in its middle.
    #[must_use]
    pub fn new(width: usize, height: usize, density: PixelDensity) -> Self {
        Self {
            middle_px: [0.5 * width as f64, 0.5 * height as f64],
            distance_px: [density.horizontal, density.vertical].map(f64::to_degrees),
        }
    }

    /// A place in units of the distance from the eye.
    fn place(&self, at: Gaze) -> [f64; 2] {
        [(at.x_px - self.middle_px[0]) / self.distance_px[0], (at.y_px - self.middle_px[1]) / self.distance_px[1]]
    }

    /// Angle between two places, degrees.
    #[must_use]
    pub fn angle_deg(&self, from: Gaze, to: Gaze) -> f64 {
        let (from, to) = (self.place(from), self.place(to));
        let cross = [from[1] - to[1], to[0] - from[0], from[0] * to[1] - from[1] * to[0]];
        let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
        let cosine = from[0] * to[0] + from[1] * to[1] + 1.0;
        sine.atan2(cosine).to_degrees()
    }

    /// Degrees of a small motion of so many pixels at a place: φ from straight ahead cos² φ of what it would be there
    /// where it leads outwards, cos φ of it where it leads around.
    #[must_use]
    pub fn motion_deg(&self, at: Gaze, motion_px: [f64; 2]) -> f64 {
        let at = self.place(at);
        let motion = [motion_px[0] / self.distance_px[0], motion_px[1] / self.distance_px[1]];
        let around = at[0] * motion[1] - at[1] * motion[0];
        let across = motion[0].hypot(motion[1]).hypot(around);
        (across / (1.0 + at[0] * at[0] + at[1] * at[1])).to_degrees()
    }
}

/// What is left of the energy of noise against eccentricity.
struct EnergyTable(UniformTable);

impl EnergyTable {
    /// The table for noise of which `energy_at(freq_cpd)` of its visible energy lies at each frequency of the pixel
    /// grid.
    fn new(channel: Channel, density: PixelDensity, energy_at: impl Fn(f64) -> f64) -> Self {
        let mut rings = Vec::with_capacity(RINGS);
        for_each_ring(density, RINGS, |freq_cpd, weight| rings.push((freq_cpd, weight * energy_at(freq_cpd))));
        let whole: f64 = rings.iter().map(|(_, energy)| energy).sum();
        let left = |eccentricity: f64| {
            let at = |&(freq, energy): &(f64, f64)| energy * sensitivity_left(channel, freq, eccentricity).powi(2);
            if whole > 0.0 { rings.iter().map(at).sum::<f64>() / whole } else { 1.0 }
        };
        let steps = (FARTHEST_DEG * STEPS_PER_DEGREE) as u32;
        Self(UniformTable::new((0..=steps).map(|step| left(f64::from(step) / STEPS_PER_DEGREE) as f32)))
    }

    fn at(&self, eccentricity_deg: f32) -> f32 {
        self.0.at(eccentricity_deg * STEPS_PER_DEGREE as f32)
    }
}

impl ThresholdMap {
    /// Thresholds of this picture for eyes that look at `gazes`, of which the nearest counts at every pixel; without
    /// any, nothing changes.
    ///
    /// Each band's threshold is raised by the root of what is left of the energy that white noise has in it, at the
    /// middle one of the picture's adaptation levels: the fall within a band is steep, and its centre alone would
    /// promise too much.
    #[must_use]
    pub fn with_gazes(&self, gazes: &[Gaze]) -> Self {
        let density = self.viewing.display.pixel_density();
        let of_gaze = |gaze: &Gaze| eccentricity_deg(self.width(), self.height(), *gaze, density);
        let Some(eccentricity) = gazes.iter().map(of_gaze).reduce(|a, b| a.combined(&b, f32::min)) else {
            return self.clone();
        };
        let mut turned = self.clone();
        for (band, elevation) in turned.elevations.iter_mut().enumerate() {
            let visible = |freq: f64| {
                let sensitivity = self.middle_level().map_or(1.0, |level| f64::from(level.sensitivity.at(freq as f32)));
                (self.bands.gain(band, freq) * sensitivity).powi(2)
            };
            let table = EnergyTable::new(Channel::Achromatic, density, visible);
            *elevation = elevation.change_by(&eccentricity, |elevation, at| elevation / table.at(at).sqrt());
        }
        turned.noise_gain = noise_gain(&self.tables, &self.adaptation_cd_m2, &turned.elevations);
        turned.eccentricity_deg = Some(eccentricity);
        turned
    }

    pub(crate) fn middle_level(&self) -> Option<&AdaptationLevel> {
        self.levels.get(self.levels.len() / 2)
    }

    /// A chromatic channel's noise gain for the eye that these thresholds are of; `sensitivity_at` is the channel's
    /// own.
    pub(crate) fn seen_from_gaze(
        &self,
        gain: Plane,
        channel: ChromaticChannel,
        sensitivity_at: impl Fn(f64) -> f64,
    ) -> Plane {
        let Some(eccentricity) = &self.eccentricity_deg else { return gain };
        let density = self.viewing.display.pixel_density();
        let table = EnergyTable::new(Channel::Chromatic(channel), density, |freq| sensitivity_at(freq).powi(2));
        gain.combined(eccentricity, |gain, at| gain * table.at(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::CastleCsf;
    use crate::display::{Display, Viewing};
    use crate::test_noise::normal;
    use crate::threshold::{ThresholdInputs, threshold_map};

    /// 10^−((e₀ + e₁ ρ) ε) of the better half field, by the published constants (gfxdisp/castleCSF, `get_default_par`).
    #[test]
    fn golden_values() {
        let rg = Channel::Chromatic(ChromaticChannel::RedGreen);
        let yv = Channel::Chromatic(ChromaticChannel::YellowViolet);
        for (channel, freq, eccentricity, expected) in [
            (Channel::Achromatic, 4.0, 0.0, 1.0),
            (Channel::Achromatic, 0.5, 5.0, 0.680477861),
            (Channel::Achromatic, 2.0, 10.0, 0.273283996),
            (Channel::Achromatic, 8.0, 20.0, 0.00788652347),
            (rg, 0.5, 5.0, 0.506173029),
            (rg, 2.0, 10.0, 0.256211135),
            (rg, 8.0, 20.0, 0.0656441456),
            (yv, 0.5, 5.0, 0.938284409),
            (yv, 2.0, 10.0, 0.635312353),
            (yv, 8.0, 20.0, 0.0434527633),
        ] {
            let found = sensitivity_left(channel, freq, eccentricity);
            assert!((found / expected - 1.0_f64).abs() < 1e-6, "{channel:?} {freq} {eccentricity}: {found}");
        }
    }

    /// Straight ahead a degree is a degree; far off a flat display is seen at a slant, and has less of it.
    #[test]
    fn angles_are_those_of_a_flat_display() {
        let density = Display { pixels_per_degree: 20.0, ..Display::default() }.pixel_density();
        let plane = eccentricity_deg(2001, 3, Gaze { x_px: 1000.5, y_px: 1.5 }, density);
        assert_eq!(plane.get(1000, 1), 0.0);
        assert!((f64::from(plane.get(1100, 1)) + GAZE_MARGIN_DEG - 5.0).abs() < 0.02, "{}", plane.get(1100, 1));
        let slanted = (1000.0 / 20.0_f64.to_degrees()).atan().to_degrees();
        assert!((f64::from(plane.get(2000, 1)) + GAZE_MARGIN_DEG - slanted).abs() < 1e-3);
    }

    /// At the gaze nothing changes; away from it white noise may be as strong as the formula says of the frequencies
    /// that carry it, and the measured error says the same as the prediction.
    #[test]
    fn thresholds_rise_away_from_the_gaze() {
        let viewing =
            Viewing { display: Display { pixels_per_degree: 20.0, ..Display::default() }, ..Viewing::default() };
        let grey = Plane::filled(512, 256, 50.0);
        let inputs = ThresholdInputs::clean(&grey);
        let map = threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap();
        let turned = map.with_gazes(&[Gaze { x_px: 40.0, y_px: 128.0 }]);
        assert_eq!(map.with_gazes(&[]).noise_gain(), map.noise_gain());
        let [left, right] = [40.0, 480.0].map(|x_px| Gaze { x_px, y_px: 128.0 });
        let both = map.with_gazes(&[left, right]);
        let nearest = turned.noise_gain().combined(map.with_gazes(&[right]).noise_gain(), f32::max);
        assert!(both.noise_gain().values().iter().zip(nearest.values()).all(|(a, b)| (a / b - 1.0).abs() < 1e-3));
        let ratio = |x: usize| {
            turned.allowed_standard_error_cd_m2(1.0).get(x, 128) / map.allowed_standard_error_cd_m2(1.0).get(x, 128)
        };
        assert!((ratio(40) - 1.0).abs() < 1e-3, "{}", ratio(40));
        // Twenty degrees away, between what is left at 1 and at 6 cycles a degree.
        let eccentricity = f64::from(
            eccentricity_deg(512, 256, Gaze { x_px: 40.0, y_px: 128.0 }, viewing.display.pixel_density()).get(440, 128),
        );
        let [little, much] =
            [1.0, 6.0].map(|freq| 1.0 / sensitivity_left(Channel::Achromatic, freq, eccentricity) as f32);
        assert!((little..much).contains(&ratio(440)), "{} not within {little} and {much}", ratio(440));

        let predicted = turned.predicted_visibility(&Plane::filled(512, 256, 4.0));
        let mut measured = Plane::filled(512, 256, 0.0);
        let mut state = 3;
        for _ in 0..8 {
            let noise =
                Plane::from_values(512, 256, (0..512 * 256).map(|_| 2.0 * normal(&mut state)).collect()).unwrap();
            measured = measured.combined(&turned.measured_visibility(&noise), |sum, v| sum + v * v / 8.0);
        }
        for x in [40, 240, 440] {
            let found = measured.get(x, 128).sqrt() / predicted.get(x, 128);
            assert!((found - 1.0).abs() < 0.15, "column {x}: measured/predicted {found}");
        }
    }

    /// Colour fades less than luminance in yellow and violet, and the gains say so.
    #[test]
    fn colour_fades_by_its_own_law() {
        let grey = Plane::filled(256, 64, 50.0);
        let inputs = ThresholdInputs::clean(&grey);
        let viewing =
            Viewing { display: Display { pixels_per_degree: 10.0, ..Display::default() }, ..Viewing::default() };
        let map = threshold_map(&inputs, &viewing, &CastleCsf::default()).unwrap();
        let turned = map.with_gazes(&[Gaze { x_px: 10.0, y_px: 32.0 }]);
        let left = |before: &Plane, after: &Plane| after.get(230, 32) / before.get(230, 32);
        let (before, after) = (map.chromatic_gains().unwrap(), turned.chromatic_gains().unwrap());
        let luminance = left(map.noise_gain(), turned.noise_gain());
        let yellow = left(&before.yellow_violet, &after.yellow_violet);
        assert!(luminance < yellow && yellow < 1.0, "{luminance} {yellow}");
        assert!((left(&before.red_green, &after.red_green)) < 1.0);
    }
}
