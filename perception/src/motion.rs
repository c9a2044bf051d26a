//! Motion: what moves over the picture, and what of it moves over the retina.
//!
//! The eye's pursuit is Daly's (1998), by attention as Yee, Pattanaik and Greenberg have it (2001). For error that
//! travels with things or is locked to the screen. Not for noise that is new in every frame, of which motion hides
//! nothing, but for what the eye's own movement smears ([`ThresholdMap::with_pursuit`]).

use crate::csf::pursued_noise::PursuedNoise;
use crate::csf::{DRIFT_DEG_S, Daly98, FASTEST_PURSUIT_DEG_S, FrameTiming, PURSUIT_GAIN};
use crate::display::Display;
use crate::eccentricity::{FlatDisplay, Gaze};
use crate::error::Error;
use crate::noise_gain::noise_gain;
use crate::plane::Plane;
use crate::table::UniformTable;
use crate::threshold::ThresholdMap;

/// How the error of a moving picture moves; each class is seen differently.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ErrorMotion {
    /// New noise in every frame: motion hides nothing of it.
    #[default]
    Fresh,
    /// Error that travels with the object (from reprojected or cached samples): seen through the retinal velocity.
    Travelling,
    /// Noise of one pattern in every frame, locked to the screen: as the eye follows the object, the pattern crosses
    /// the retina at the eye's own velocity; where the eye rests it is static noise.
    Locked,
}

/// Velocity of the eye, deg/s, when it looks at something that crosses the picture at `image_velocity_deg_s`:
/// min(0.82 s v + 0.15, 80) (Daly 1998), with attention s in 0..1 (Yee et al. 2001): what stands out is followed.
#[must_use]
pub fn eye_velocity_deg_s(image_velocity_deg_s: f64, attention: f64) -> f64 {
    let attention = if attention.is_nan() { 1.0 } else { attention.clamp(0.0, 1.0) };
    let followed = PURSUIT_GAIN * attention * image_speed_deg_s(image_velocity_deg_s) + DRIFT_DEG_S;
    followed.min(FASTEST_PURSUIT_DEG_S)
}

/// Speed of a velocity that may be anything: what is no number rests, which hides the least.
fn image_speed_deg_s(image_velocity_deg_s: f64) -> f64 {
    if image_velocity_deg_s.is_nan() { 0.0 } else { image_velocity_deg_s.abs().min(1e9) }
}

/// Speed over the retina, deg/s, at least the eye's drift of 0.15 deg/s: |v − v_eye|.
///
/// The floor is needed: at 0.833 deg/s the formula crosses zero and sensitivity would vanish.
#[must_use]
pub fn retinal_velocity_deg_s(image_velocity_deg_s: f64, attention: f64) -> f64 {
    let image = image_speed_deg_s(image_velocity_deg_s);
    (image - eye_velocity_deg_s(image, attention)).abs().max(DRIFT_DEG_S)
}

impl ErrorMotion {
    /// Velocity, deg/s, at which this error crosses the retina where the picture moves at `image_velocity_deg_s`.
    /// `None` for fresh noise, which motion does not change.
    #[must_use]
    pub fn retinal_velocity_deg_s(self, image_velocity_deg_s: f64, attention: f64) -> Option<f64> {
        match self {
            Self::Fresh => None,
            Self::Travelling => Some(retinal_velocity_deg_s(image_velocity_deg_s, attention)),
            Self::Locked => Some(eye_velocity_deg_s(image_velocity_deg_s, attention).max(DRIFT_DEG_S)),
        }
    }
}

/// Speed over the picture, deg/s, of motion in pixels a frame, on a flat display of these frames a second and pixels
/// a degree whose middle is that of the picture ([`FlatDisplay`]): a part of a picture counts as one of its own.
///
/// Each pixel takes the slowest speed of its 3×3 neighbourhood: at a silhouette the slower side's error is the one that
/// could be seen. Motion that is not finite counts as none.
///
/// # Errors
/// [`Error::SizeMismatch`] for planes of two sizes, [`Error::OutOfRange`] for an impossible display.
///
/// ```
/// use fechner_perception::{Display, Plane, motion::image_velocity_deg_s};
/// let (right, down) = (Plane::filled(8, 8, 12.0), Plane::filled(8, 8, 0.0));
/// // 12 pixels in a sixtieth of a second at 60 pixels a degree.
/// let speed = image_velocity_deg_s(&right, &down, &Display::default())?;
/// assert!((speed.get(4, 4) - 12.0).abs() < 1e-5);
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn image_velocity_deg_s(motion_x_px: &Plane, motion_y_px: &Plane, display: &Display) -> Result<Plane, Error> {
    display.check()?;
    motion_y_px.check_size("vertical motion", motion_x_px.width(), motion_x_px.height())?;
    let (width, height) = (motion_x_px.width(), motion_x_px.height());
    let flat = FlatDisplay::new(width, height, display.pixel_density());
    let speed = Plane::from_fn(width, height, |x, y| {
        let pixel = Gaze { x_px: x as f64 + 0.5, y_px: y as f64 + 0.5 };
        let motion_px = [motion_x_px.get(x, y), motion_y_px.get(x, y)].map(f64::from);
        let speed = (display.frames_per_second * flat.motion_deg(pixel, motion_px)) as f32;
        if speed.is_finite() { speed } else { 0.0 }
    });
    Ok(crate::filter::erode(&speed, 1))
}

/// What changes with a velocity, against its logarithm from the eye's drift on.
pub(crate) struct VelocityTable(UniformTable);

impl VelocityTable {
    /// Steps a factor of 2 in velocity.
    const STEPS_AN_OCTAVE: f32 = 8.0;

    fn new(at_deg_s: impl Fn(f64) -> f64) -> Self {
        let velocity_deg_s = |step: u32| DRIFT_DEG_S * (f64::from(step) / f64::from(Self::STEPS_AN_OCTAVE)).exp2();
        Self(UniformTable::new((0..=96).map(|step| at_deg_s(velocity_deg_s(step)) as f32)))
    }

    /// Threshold elevation by motion over the retina of one frequency.
    pub(crate) fn of_motion(freq_cpd: f64) -> Self {
        let rest = Daly98::default().ln_sensitivity(freq_cpd);
        Self::new(|retinal_velocity_deg_s| {
            let moving = Daly98 { retinal_velocity_deg_s }.ln_sensitivity(freq_cpd);
            (rest - moving).exp().clamp(0.1, 20.0)
        })
    }

    pub(crate) fn at(&self, velocity_deg_s: f32) -> f32 {
        self.0.at((velocity_deg_s / DRIFT_DEG_S as f32).max(1.0).log2() * Self::STEPS_AN_OCTAVE)
    }
}

impl ThresholdMap {
    /// Thresholds of noise that is new in every frame, for eyes that move at `eye_velocity_deg_s` at each place (see
    /// [`eye_velocity_deg_s`]; at most 80 deg/s counts): each frame is smeared over the retina while the display
    /// holds it.
    ///
    /// Only for thresholds of fresh noise ([`crate::csf::FreshNoise`] with the same timing), and only where eyes do
    /// move: a viewer who looks elsewhere sees the noise as at rest. Each band's threshold is raised by what is left
    /// of the energy at its centre under the middle one of the picture's adaptation levels. Colour is left as at
    /// rest, which sees more.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] and [`Error::BadPixel`] for velocities that do not fit, [`Error::OutOfRange`] for an
    /// impossible timing.
    pub fn with_pursuit(&self, eye_velocity_deg_s: &Plane, timing: FrameTiming) -> Result<Self, Error> {
        eye_velocity_deg_s.check_size("velocity", self.width(), self.height())?;
        eye_velocity_deg_s.check_non_negative("velocity")?;
        let middle_cd_m2 = self.middle_level().map_or(1.0, |level| f64::from(level.luminance_cd_m2));
        let noise = PursuedNoise::new(self.viewing.observer.csf_area_deg2, timing, middle_cd_m2)?;
        let mut followed = self.clone();
        for (band, elevation) in followed.elevations.iter_mut().enumerate() {
            let freq_cpd = self.bands.center_cpd(band);
            let table = VelocityTable::new(|velocity_deg_s| noise.energy_left(freq_cpd, velocity_deg_s));
            *elevation = elevation.change_by(eye_velocity_deg_s, |elevation, velocity| {
                elevation / table.at(velocity.min(FASTEST_PURSUIT_DEG_S as f32)).max(1e-6).sqrt()
            });
        }
        followed.noise_gain = noise_gain(&self.tables, &self.adaptation_cd_m2, &followed.elevations);
        Ok(followed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csf::FreshNoise;
    use crate::display::Viewing;
    use crate::threshold::{ThresholdInputs, threshold_map};

    #[test]
    fn pixels_a_frame_become_degrees_a_second() {
        for (pixels, fps, ppd, expected) in
            [(1.0, 30.0, 30.0, 1.0), (12.0, 30.0, 30.0, 12.0), (5.0, 60.0, 40.0, 7.5), (0.25, 24.0, 21.57, 0.278_164)]
        {
            let display = Display { pixels_per_degree: ppd, frames_per_second: fps, ..Display::default() };
            let (motion, none) = (Plane::filled(3, 3, pixels), Plane::filled(3, 3, 0.0));
            let speed = image_velocity_deg_s(&motion, &none, &display).unwrap();
            assert!((speed.get(1, 1) - expected).abs() < 1e-5);
            // Pixels twice as wide as high: there are twice as many to a degree downwards.
            let anamorphic = Display { pixel_aspect_ratio: 2.0, ..display };
            let down = image_velocity_deg_s(&none, &motion, &anamorphic).unwrap();
            assert!((2.0 * down.get(1, 1) - expected).abs() < 1e-5);
        }
        let (wide, narrow) = (Plane::filled(3, 3, 0.0), Plane::filled(2, 3, 0.0));
        assert!(image_velocity_deg_s(&wide, &narrow, &Display::default()).is_err());
    }

    /// By the angle between where something is seen half a frame before and after: of 3840 columns at 30 to a degree
    /// the border is 48° from the middle, where a pan is 0.44 of its speed and a tilt 0.67.
    #[test]
    fn borders_of_wide_displays_are_slower() {
        let display = Display { pixels_per_degree: 30.0, frames_per_second: 24.0, ..Display::default() };
        let (motion, none) = (Plane::filled(3840, 3, 4.0), Plane::filled(3840, 3, 0.0));
        let flat = FlatDisplay::new(3840, 3, display.pixel_density());
        for (right, down, [dx, dy], share) in [(&motion, &none, [2.0, 0.0], 0.445), (&none, &motion, [0.0, 2.0], 0.667)]
        {
            let speed = image_velocity_deg_s(right, down, &display).unwrap();
            assert!((speed.get(1920, 1) - 3.2).abs() < 1e-5);
            assert!((speed.get(1, 1) / 3.2 - share).abs() < 1e-3, "{}", speed.get(1, 1) / 3.2);
            // The slowest of the pixels around is the one at the border.
            let at = |sign: f64| Gaze { x_px: 0.5 + sign * dx, y_px: 1.5 + sign * dy };
            let seen = 24.0 * flat.angle_deg(at(-1.0), at(1.0));
            assert!((f64::from(speed.get(1, 1)) / seen - 1.0).abs() < 1e-4, "{} for {seen}", speed.get(1, 1));
        }
    }

    #[test]
    fn attention_decides_what_is_followed() {
        for (velocity, attention, expected) in [
            (1.0, 0.0, 0.85),
            (1.0, 0.5, 0.44),
            (1.0, 1.0, 0.15),
            (10.0, 0.25, 7.80),
            (10.0, 1.0, 1.65),
            (50.0, 0.5, 29.35),
            (120.0, 1.0, 40.0),
        ] {
            let found = retinal_velocity_deg_s(velocity, attention);
            assert!((found - expected).abs() < 1e-9, "{velocity} {attention}: {found}");
        }
        // What is no number rests, and is looked at.
        assert_eq!(retinal_velocity_deg_s(f64::NAN, 1.0), DRIFT_DEG_S);
        assert_eq!(retinal_velocity_deg_s(1.0, f64::NAN), retinal_velocity_deg_s(1.0, 1.0));
        assert_eq!(ErrorMotion::Locked.retinal_velocity_deg_s(f64::NAN, 1.0), Some(DRIFT_DEG_S));
    }

    #[test]
    fn the_three_kinds_of_error_move_differently() {
        assert_eq!(ErrorMotion::Fresh.retinal_velocity_deg_s(10.0, 1.0), None);
        assert!((ErrorMotion::Travelling.retinal_velocity_deg_s(10.0, 1.0).unwrap() - 1.65).abs() < 1e-9);
        assert!((ErrorMotion::Locked.retinal_velocity_deg_s(10.0, 1.0).unwrap() - 8.35).abs() < 1e-9);
        assert!((ErrorMotion::Locked.retinal_velocity_deg_s(0.0, 1.0).unwrap() - 0.15).abs() < 1e-9);
    }

    /// Noise at 24 frames a second that is at threshold for a resting eye may have so many times the variance for one
    /// that follows.
    #[test]
    fn pursuit_lets_fresh_noise_be_stronger() {
        let timing = FrameTiming { frames_per_second: 24.0, persistence: 1.0 };
        let csf = FreshNoise::new(1.0, timing).unwrap();
        let grey = Plane::filled(64, 64, 100.0);
        let inputs = ThresholdInputs::clean(&grey);
        let rest = threshold_map(&inputs, &Viewing::default(), &csf).unwrap();
        let gain = |velocity: f32, timing| {
            let followed = rest.with_pursuit(&Plane::filled(64, 64, velocity), timing).unwrap();
            f64::from(rest.noise_gain().get(32, 32) / followed.noise_gain().get(32, 32))
        };
        let gains = [0.15, 1.0, 2.0, 4.25, 8.35].map(|velocity| gain(velocity, timing));
        assert!((gains[0] - 1.0).abs() < 0.02 && gains.windows(2).all(|pair| pair[1] > pair[0]), "{gains:?}");
        assert!(gains[2] > 1.3 && gains[4] > 4.0, "{gains:?}");
        assert!((gain(500.0, timing) / gain(80.0, timing) - 1.0).abs() < 1e-6);
        let fast = FrameTiming { frames_per_second: 240.0, persistence: 1.0 };
        assert!(gain(2.0, fast) < 1.1);
        let bad = Plane::filled(64, 64, -1.0);
        assert!(rest.with_pursuit(&bad, timing).is_err());
        assert!(rest.with_pursuit(&Plane::filled(3, 64, 1.0), timing).is_err());
    }
}
