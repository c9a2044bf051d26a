//! Fine detail that an eye in dim light does not resolve, taken out of the picture for one in front of a bright
//! display.
//!
//! By Shlaer's data in Ward Larson, Rushmeier and Piatko's fit (1997), for one adaptation luminance. Not for views
//! whose parts are adapted to by themselves: the blur is one for all.

use serde::{Deserialize, Serialize};

use crate::csf::{CastleCsf, ContrastSensitivity};
use crate::display::{PixelDensity, Viewing};
use crate::filter::sampled_gaussian_blur_xy;
use crate::plane::Plane;
use crate::tvi::acuity_cpd;

/// Loss of acuity of an eye in dim light: a Gaussian over the picture.
///
/// At the highest frequency r that the scene's eye resolves ([`acuity_cpd`], Shlaer's data) it lets through just the
/// contrast that the display's eye detects there, 1/S(r) of castleCSF: what the one cannot see, the other cannot
/// either.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcuityFilter {
    /// Standard deviation of the Gaussian, degrees.
    pub sigma_deg: f64,
    /// Pixels a degree of the display that the picture is shown on.
    pub pixel_density: PixelDensity,
}

impl AcuityFilter {
    /// The filter for an eye adapted to `adaptation_cd_m2`; `None` where it resolves all that the display shows.
    #[must_use]
    pub fn for_adaptation(adaptation_cd_m2: f64, viewing: &Viewing) -> Option<Self> {
        let pixel_density = viewing.display.pixel_density();
        let limit_cpd = acuity_cpd(adaptation_cd_m2);
        if limit_cpd >= pixel_density.finest() / 2.0 || limit_cpd <= 0.0 {
            return None;
        }
        let display_adaptation_cd_m2 = viewing.display.white_cd_m2 / 2.0;
        let threshold = CastleCsf::default().sensitivity(limit_cpd, display_adaptation_cd_m2).recip();
        if threshold >= 1.0 {
            return None;
        }
        let sigma_deg = (-threshold.ln() / 2.0).sqrt() / (std::f64::consts::PI * limit_cpd);
        Some(Self { sigma_deg, pixel_density })
    }

    /// Share of a grating's amplitude that is left at `freq_cpd` cycles a degree. White noise of a renderer passes
    /// the same filter: multiply a band's noise gain by it.
    #[must_use]
    pub fn transfer(&self, freq_cpd: f64) -> f64 {
        let phase = std::f64::consts::TAU * self.sigma_deg * freq_cpd;
        (-0.5 * phase * phase).exp()
    }

    /// A plane of one channel, in any unit, through the filter.
    #[must_use]
    pub fn blur_plane(&self, plane: &Plane) -> Plane {
        sampled_gaussian_blur_xy(plane, self.pixel_density.pixels(self.sigma_deg))
    }

    /// A picture `width` pixels wide through the filter; pixels that are not finite count as black.
    #[must_use]
    pub fn blur(&self, width: usize, rgb: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let width = width.max(1);
        let height = rgb.len() / width;
        let [r, g, b] = [0, 1, 2].map(|channel| {
            self.blur_plane(&Plane::from_fn(width, height, |x, y| {
                let value = rgb[y * width + x][channel];
                if value.is_finite() { value } else { 0.0 }
            }))
        });
        let channels = r.values().iter().zip(g.values()).zip(b.values());
        channels.map(|((&r, &g), &b)| [r, g, b]).collect()
    }
}

/// A contrast sensitivity function behind a loss of acuity: how scene noise is seen that the operator blurs.
/// Thresholds built with it hold for the noise as it is rendered, and of the picture as it is rendered: what masks is
/// blurred, too.
pub struct BehindAcuity<C> {
    /// Contrast sensitivity function of the eye in front of the display.
    pub csf: C,
    /// Loss of acuity that the operator simulates; `None` where it takes nothing away.
    pub acuity: Option<AcuityFilter>,
}

impl<C: ContrastSensitivity> ContrastSensitivity for BehindAcuity<C> {
    fn name(&self) -> &'static str {
        self.csf.name()
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        self.acuity.map_or(1.0, |acuity| acuity.transfer(freq_cpd)) * self.csf.sensitivity(freq_cpd, luminance_cd_m2)
    }

    fn transfer(&self, freq_cpd: f64) -> f64 {
        self.acuity.map_or(1.0, |acuity| acuity.transfer(freq_cpd)) * self.csf.transfer(freq_cpd)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::Display;

    #[test]
    fn what_the_scene_hides_is_at_threshold_on_the_display() {
        let viewing = Viewing::default();
        for adaptation in [0.001, 0.01, 0.1] {
            let filter = AcuityFilter::for_adaptation(adaptation, &viewing).unwrap();
            let limit = acuity_cpd(adaptation);
            let shown = filter.transfer(limit) * CastleCsf::default().sensitivity(limit, 100.0);
            assert!((shown - 1.0).abs() < 1e-9, "{adaptation}: {shown}");
        }
        assert!(AcuityFilter::for_adaptation(100.0, &viewing).is_none());
        let coarse = Viewing::of(Display { pixels_per_degree: 5.0, ..Display::default() });
        assert!(AcuityFilter::for_adaptation(0.1, &coarse).is_none());
    }

    #[test]
    fn the_blur_has_the_transfer_it_says() {
        let filter = AcuityFilter { sigma_deg: 0.05, pixel_density: PixelDensity::square(64.0) };
        let grating = Plane::from_fn(256, 8, |x, _| 1.0 + (std::f32::consts::TAU * x as f32 / 32.0).cos());
        let blurred = filter.blur_plane(&grating);
        let amplitude =
            f64::from(blurred.values()[4 * 256 + 64..4 * 256 + 192].iter().copied().fold(0.0, f32::max)) - 1.0;
        // 32 pixels a period are 2 cycles a degree.
        assert!((amplitude / filter.transfer(2.0) - 1.0).abs() < 0.02, "{amplitude} {}", filter.transfer(2.0));
    }

    /// A night of 0.02 cd/m², whose limit is 6.1 cpd: up to it the blur is the Gaussian, on displays of any density.
    #[test]
    fn the_blur_is_a_gaussian_up_to_the_limit() {
        for pixels_per_degree in [60.0, 96.0, 240.0] {
            let viewing = Viewing::of(Display { pixels_per_degree, ..Display::default() });
            let filter = AcuityFilter::for_adaptation(0.02, &viewing).unwrap();
            // Two degrees, mirrored: every whole number of cycles goes on beyond the border.
            let width = (2.0 * pixels_per_degree) as usize;
            for freq_cpd in [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
                let cycles = |x: usize| freq_cpd * (x as f64 + 0.5) / pixels_per_degree;
                let wave = |x: usize| (std::f64::consts::TAU * cycles(x)).cos();
                let grating = Plane::from_fn(width, 8, |x, _| 1.0 + wave(x) as f32);
                let blurred = filter.blur_plane(&grating);
                let left = (0..width).map(|x| 2.0 * f64::from(blurred.get(x, 4)) * wave(x)).sum::<f64>() / width as f64;
                let expected = filter.transfer(freq_cpd);
                assert!(
                    (left - expected).abs() < 2e-4 + 2e-3 * expected,
                    "{pixels_per_degree} pixels a degree, {freq_cpd} cpd: {left}, not {expected}"
                );
                assert!((blurred.mean() - 1.0).abs() < 1e-5);
            }
        }
    }

    /// Noise behind the loss of acuity, on texture as it is rendered, is as visible as both through the filter to the
    /// eye itself.
    #[test]
    fn masks_are_blurred_as_they_are_shown() {
        use crate::threshold::{ThresholdInputs, threshold_map};
        let viewing = Viewing::default();
        let filter = AcuityFilter::for_adaptation(0.02, &viewing).unwrap();
        for freq_cpd in [2.0, 3.0, 4.0, 5.0] {
            let wave = |at: usize| (std::f64::consts::TAU * freq_cpd * (at as f64 + 0.5) / 60.0).cos() as f32;
            let noise = Plane::from_fn(240, 240, |_, y| wave(y));
            for contrast in [0.05, 0.2, 0.8] {
                let texture = Plane::from_fn(240, 240, |x, _| 20.0 * (1.0 + contrast * wave(x)));
                let seen = |texture: &Plane, noise: &Plane, acuity| {
                    let csf = BehindAcuity { csf: CastleCsf::default(), acuity };
                    let map = threshold_map(&ThresholdInputs::clean(texture), &viewing, &csf).unwrap();
                    f64::from(map.measured_visibility(noise).get(120, 120))
                };
                let rendered = seen(&texture, &noise, Some(filter));
                let shown = seen(&filter.blur_plane(&texture), &filter.blur_plane(&noise), None);
                assert!((rendered / shown - 1.0).abs() < 0.02, "{freq_cpd} cpd, {contrast}: {rendered}, not {shown}");
            }
        }
    }

    #[test]
    fn the_blur_is_round_to_the_eye_where_pixels_are_oblong() {
        // A dot on a display whose pixels are twice as wide as high.
        let pixel_density = PixelDensity { horizontal: 40.0, vertical: 80.0 };
        let filter = AcuityFilter { sigma_deg: 0.05, pixel_density };
        let dot = Plane::from_fn(41, 81, |x, y| if (x, y) == (20, 40) { 1.0 } else { 0.0 });
        let blurred = filter.blur_plane(&dot);
        for pixels in 1..4 {
            let (beside, below) = (blurred.get(20 + pixels, 40), blurred.get(20, 40 + 2 * pixels));
            assert!((beside / below - 1.0).abs() < 0.03, "{pixels}: {beside} {below}");
        }
    }
}
