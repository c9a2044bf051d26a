//! Contrast sensitivity functions: how little contrast a grating may have and still be seen.
//!
//! S = 1 / (contrast amplitude at threshold), contrast = amplitude / mean luminance. The threshold *amplitude* of a
//! grating of ρ cycles per degree on L cd/m² is therefore L / S(ρ, L) cd/m².
//!
//! All are of gratings, static, achromatic and seen foveally unless they say otherwise: not of spots, edges or text.
//! Each module says what its function ignores.

mod barten89;
mod barten99;
mod castle;
mod castle_chromatic;
mod castle_temporal;
mod daly93;
mod daly98;
mod frame_response;
mod fresh_noise;
mod hdrvdp2;
mod laird06;
mod mannos_sakrison;
mod moving;
pub(crate) mod pursued_noise;
mod stela;

pub use barten89::Barten89;
pub use barten99::Barten99;
pub use castle::CastleCsf;
pub use castle_chromatic::{CastleChromatic, ChromaticChannel};
pub use castle_temporal::CastleTemporal;
pub use daly93::Daly93;
pub use daly98::{DRIFT_DEG_S, Daly98, FASTEST_PURSUIT_DEG_S, PURSUIT_GAIN};
pub(crate) use frame_response::{CastleTransient, FrameResponses, Level, Look};
pub use fresh_noise::FreshNoise;
pub use hdrvdp2::HdrVdp2;
pub use laird06::Laird06;
pub use mannos_sakrison::MannosSakrison;
pub use moving::Moving;
pub use stela::StelaCsf;

use crate::display::Viewing;
use crate::error::{Error, check_range};
use crate::names::{NamedTable, find, names_of};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A contrast sensitivity function for static, achromatic gratings seen foveally.
pub trait ContrastSensitivity: Send + Sync {
    /// The function's name on the command line.
    fn name(&self) -> &'static str;

    /// Sensitivity (1 / threshold contrast) at `freq_cpd` cycles per degree on a mean luminance of `luminance_cd_m2`.
    ///
    /// Finite and not negative for every finite frequency ≥ 0 and luminance ≥ 0; a luminance outside the model's
    /// domain is moved to its edge.
    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64;

    /// Share of a grating's amplitude that gets to the eye, where something before it takes detail away, as an
    /// operator's loss of acuity does; it is in [`sensitivity`](Self::sensitivity) already.
    fn transfer(&self, _freq_cpd: f64) -> f64 {
        1.0
    }

    /// Sensitivity of the eye to the share of a grating that gets there: [`sensitivity`](Self::sensitivity) over
    /// [`transfer`](Self::transfer).
    fn sensitivity_behind(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        // What gets through by less than that is as good as lost.
        self.sensitivity(freq_cpd, luminance_cd_m2) / self.transfer(freq_cpd).max(1e-100)
    }
}

/// Far above what any function sees; products of higher frequencies would not stay finite, as logarithms of no
/// sensitivity must.
const HIGHEST_CPD: f64 = 1e9;

impl ContrastSensitivity for Box<dyn ContrastSensitivity> {
    fn name(&self) -> &'static str {
        (**self).name()
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        (**self).sensitivity(freq_cpd, luminance_cd_m2)
    }

    fn transfer(&self, freq_cpd: f64) -> f64 {
        (**self).transfer(freq_cpd)
    }
}

/// How the frames of a moving picture follow each other on a display.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTiming {
    /// New pictures a second, 1 to 1000.
    pub frames_per_second: f64,
    /// Share of its time for which a frame is lit, 0.001 to 1, at equal mean luminance: 1 for displays that hold.
    pub persistence: f64,
}

impl FrameTiming {
    /// The timing nearest to these that responses are defined for: shorter flashes and faster displays look no
    /// otherwise.
    #[must_use]
    pub fn nearest(frames_per_second: f64, persistence: f64) -> Self {
        Self { frames_per_second: frames_per_second.clamp(1.0, 1e3), persistence: persistence.clamp(1e-3, 1.0) }
    }

    /// What holding a frame for its share of the time leaves of the amplitude of a flicker: sinc(f T p), sinc(x) =
    /// sin πx / πx.
    fn held(self, flicker_hz: f64) -> f64 {
        let phase = PI * flicker_hz * (1.0 / self.frames_per_second) * self.persistence;
        if phase.abs() < 1e-9 { 1.0 } else { phase.sin() / phase }
    }

    fn check(self) -> Result<(), Error> {
        check_range("frames_per_second", self.frames_per_second, 1.0, 1e3, "between 1 and 1000")?;
        check_range("persistence", self.persistence, 1e-3, 1.0, "between 0.001 and 1")
    }
}

/// Rejects an area of a grating that no contrast sensitivity function is asked for.
pub(crate) fn check_area_deg2(what: &'static str, area_deg2: f64) -> Result<(), Error> {
    check_range(what, area_deg2, 1e-3, 1e4, "between 0.001 and 10000 deg²")
}

/// The name of the function that everything uses unless told otherwise.
pub const DEFAULT: &str = "castle";

/// What the table of functions makes.
type Made = Box<dyn ContrastSensitivity>;

/// How a function is made.
enum Constructor {
    /// Without asking for whom.
    Plain(fn() -> Made),
    /// For gratings of an area, deg², and for the display's distance where it depends on that.
    OfArea(fn(area_deg2: f64, &Viewing) -> Result<Made, Error>),
}

/// All functions, in the order in which they are listed.
const FUNCTIONS: NamedTable<Constructor, 9> = [
    (DEFAULT, Constructor::OfArea(|area_deg2, _| Ok(Box::new(CastleCsf::new(area_deg2)?)))),
    ("stela", Constructor::OfArea(|area_deg2, _| Ok(Box::new(StelaCsf { area_deg2 })))),
    ("barten99", Constructor::OfArea(|area_deg2, _| Ok(Box::new(Barten99 { field_deg: area_deg2.sqrt() })))),
    ("barten89", Constructor::Plain(|| Box::new(Barten89))),
    (
        "daly93",
        Constructor::OfArea(|area_deg2, viewing| {
            let distance_m = viewing.display.distance_m.unwrap_or(Daly93::default().distance_m);
            Ok(Box::new(Daly93 { area_deg2, distance_m, ..Daly93::default() }))
        }),
    ),
    ("daly98", Constructor::Plain(|| Box::new(Daly98::default()))),
    ("laird06", Constructor::Plain(|| Box::new(Laird06::default()))),
    ("hdrvdp2", Constructor::Plain(|| Box::new(HdrVdp2::default()))),
    ("mannos-sakrison", Constructor::Plain(|| Box::new(MannosSakrison::default()))),
];

const NAMES: [&str; FUNCTIONS.len()] = names_of(&FUNCTIONS);

/// The names that [`by_name`] knows; the first is [`DEFAULT`].
#[must_use]
pub fn names() -> &'static [&'static str] {
    &NAMES
}

/// Whether the function of that name depends on the area of the grating.
#[must_use]
pub fn knows_area(name: &str) -> bool {
    matches!(find(&FUNCTIONS, name), Some(Constructor::OfArea(_)))
}

/// The function of that name, for the observer's area and the display's distance where it depends on them.
///
/// # Errors
/// [`Error::UnknownName`], or [`Error::OutOfRange`] for an impossible viewing.
///
/// ```
/// use fechner_perception::{Viewing, csf};
/// let csf = csf::by_name("barten99", &Viewing::default())?;
/// assert!((csf.sensitivity(8.0, 100.0) - 235.0).abs() < 0.1);
/// # Ok::<(), fechner_perception::Error>(())
/// ```
pub fn by_name(name: &str, viewing: &Viewing) -> Result<Box<dyn ContrastSensitivity>, Error> {
    viewing.check()?;
    match find(&FUNCTIONS, name) {
        Some(Constructor::Plain(make)) => Ok(make()),
        Some(Constructor::OfArea(make)) => make(viewing.observer.csf_area_deg2, viewing),
        None => Err(Error::unknown_name("contrast sensitivity function", name, names())),
    }
}

/// Greatest sensitivity over 0.05 to 60 cpd at one luminance.
///
/// ```
/// use fechner_perception::csf::{CastleCsf, peak_sensitivity};
/// assert!((peak_sensitivity(&CastleCsf::default(), 100.0) - 134.3).abs() < 0.1);
/// ```
#[must_use]
pub fn peak_sensitivity(csf: &dyn ContrastSensitivity, luminance_cd_m2: f64) -> f64 {
    // Every function here has one hump over log frequency: a coarse scan, then thirds.
    let at = |log_freq: f64| csf.sensitivity(log_freq.exp(), luminance_cd_m2);
    let (first, last) = (0.05_f64.ln(), 60.0_f64.ln());
    let step = (last - first) / 64.0;
    let best = (0..=64)
        .map(|index| first + f64::from(index) * step)
        .fold(first, |best, log_freq| if at(log_freq) > at(best) { log_freq } else { best });
    let (mut low, mut high) = ((best - step).max(first), (best + step).min(last));
    for _ in 0..60 {
        let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(left) < at(right) {
            low = left;
        } else {
            high = right;
        }
    }
    at(0.5 * (low + high)).max(at(best))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: four functions were NaN where products overflowed.
    #[test]
    fn every_frequency_has_a_sensitivity() {
        for name in names() {
            let csf = by_name(name, &Viewing::default()).unwrap();
            for freq_cpd in [0.0, f64::MIN_POSITIVE, 1e10, 1e155, f64::MAX] {
                for luminance in [0.0, 1e-4, 100.0, f64::MAX] {
                    let found = csf.sensitivity(freq_cpd, luminance);
                    assert!(found.is_finite() && found >= 0.0, "{name}: {found} at {freq_cpd} cpd, {luminance} cd/m²");
                }
            }
        }
        assert!(Daly98::default().ln_sensitivity(f64::MAX).is_finite());
    }

    #[test]
    fn functions_know_whether_they_ask_the_area() {
        for name in names() {
            let of_area = |csf_area_deg2| {
                let mut viewing = Viewing::default();
                viewing.observer.csf_area_deg2 = csf_area_deg2;
                by_name(name, &viewing).unwrap().sensitivity(2.0, 100.0)
            };
            assert_eq!(of_area(1.0) != of_area(7.0), knows_area(name), "{name}");
            assert_eq!(by_name(name, &Viewing::default()).unwrap().name(), *name);
        }
    }

    /// Frequencies beyond 0.05 to 60 cpd do not count, where the greatest sensitivity is at an end. Regression: the
    /// search went on to 0.0448 and 67 cpd.
    #[test]
    fn peaks_are_looked_for_where_it_is_said() {
        struct Slope(f64);
        impl ContrastSensitivity for Slope {
            fn name(&self) -> &'static str {
                "slope"
            }
            fn sensitivity(&self, freq_cpd: f64, _luminance_cd_m2: f64) -> f64 {
                freq_cpd.powf(self.0)
            }
        }
        for (exponent, expected) in [(-1.0, 20.0), (1.0, 60.0)] {
            let found = peak_sensitivity(&Slope(exponent), 100.0);
            assert!((found / expected - 1.0).abs() < 1e-9, "{exponent}: {found}");
        }
    }
}
