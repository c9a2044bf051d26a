//! The contrast sensitivity of Daly's visible differences predictor, 1993.
//!
//! For comparison with that predictor: static gratings in the fovea, by area, distance and orientation. Not for motion
//! or colour, and not at the lowest frequencies, where its area term takes sensitivity to 0.

use super::ContrastSensitivity;

/// Daly, "The visible differences predictor: an algorithm for the assessment of image fidelity", 1993.
///
/// With the original constants (P = 250, ε = 0.9, ob = 0.78), fovea, orientation in radians, and an image area i² of
/// 1 deg² unless set: the code in circulation that goes with castleCSF has refitted constants and passes degrees to
/// the cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Daly93 {
    /// Area of the image, i² in the formula, deg².
    pub area_deg2: f64,
    /// Viewing distance, m.
    pub distance_m: f64,
    /// Orientation of the grating, radians: 0 is horizontal or vertical.
    pub orientation_rad: f64,
}

impl Default for Daly93 {
    /// 1 deg² at half a metre, along an axis.
    fn default() -> Self {
        Self { area_deg2: 1.0, distance_m: 0.5, orientation_rad: 0.0 }
    }
}

impl ContrastSensitivity for Daly93 {
    fn name(&self) -> &'static str {
        "daly93"
    }

    fn sensitivity(&self, freq_cpd: f64, luminance_cd_m2: f64) -> f64 {
        const PEAK: f64 = 250.0;
        const OBLIQUE: f64 = 0.78;
        if freq_cpd <= 0.0 {
            return 0.0;
        }
        let luminance = luminance_cd_m2.clamp(1e-4, 1e6);
        let area = self.area_deg2.clamp(1e-6, 1e9);
        let near = 0.856 * self.distance_m.clamp(1e-3, 1e6).powf(0.14);
        let oblique = 0.5 * (1.0 - OBLIQUE) * (4.0 * self.orientation_rad).cos() + 0.5 * (1.0 + OBLIQUE);
        let stretched = freq_cpd / (near * oblique);
        PEAK * base(freq_cpd, luminance, area).min(base(stretched, luminance, area))
    }
}

fn base(freq_cpd: f64, luminance_cd_m2: f64, area_deg2: f64) -> f64 {
    const EPSILON: f64 = 0.9;
    let a = 0.801 * (1.0 + 0.7 / luminance_cd_m2).powf(-0.2);
    let b = 0.3 * (1.0 + 100.0 / luminance_cd_m2).powf(0.15);
    let size = ((3.23 * (freq_cpd * freq_cpd * area_deg2).powf(-0.3)).powi(5) + 1.0).powf(-0.2);
    let decay = b * EPSILON * freq_cpd;
    // exp(−d) √(1 + 0.06 exp(d)) without the overflow of exp(d).
    size * a * EPSILON * freq_cpd * ((-2.0 * decay).exp() + 0.06 * (-decay).exp()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oblique_gratings_are_harder_to_see() {
        let along = Daly93::default();
        let oblique = Daly93 { orientation_rad: std::f64::consts::FRAC_PI_4, ..along };
        assert!((along.sensitivity(8.0, 100.0) - 121.9).abs() < 0.1);
        assert!((oblique.sensitivity(8.0, 100.0) - 89.9).abs() < 0.1);
    }
}
