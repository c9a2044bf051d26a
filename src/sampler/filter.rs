//! Pixel filters, importance sampled: each sample belongs to one pixel alone, so pixels stay independent and their noise
//! stays white, which is what the threshold model assumes. Filters with negative lobes cannot be sampled this way.

use glam::Vec2;

/// A pixel reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFilter {
    /// One pixel wide; what most references use.
    Box,
    /// Gaussian of σ 0.45 pixels, cut at 1.5 pixels (weight 0.4 % there): softer edges.
    Gaussian,
}

const GAUSSIAN_SIGMA_PX: f32 = 0.45;
const GAUSSIAN_RADIUS_PX: f32 = 1.5;

impl PixelFilter {
    /// Offset from the pixel's centre in pixels for two numbers in [0, 1).
    pub fn sample(self, u: f32, v: f32) -> Vec2 {
        match self {
            PixelFilter::Box => Vec2::new(u - 0.5, v - 0.5),
            PixelFilter::Gaussian => {
                // Radially truncated Gaussian by inversion: r² = −2σ² ln(1 − u·(1 − e^(−R²/2σ²))).
                let two_sigma_squared = 2.0 * GAUSSIAN_SIGMA_PX * GAUSSIAN_SIGMA_PX;
                let kept = 1.0 - (-GAUSSIAN_RADIUS_PX * GAUSSIAN_RADIUS_PX / two_sigma_squared).exp();
                let radius = (-two_sigma_squared * (1.0 - u * kept).ln()).sqrt();
                radius * Vec2::from_angle(std::f32::consts::TAU * v)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gaussian_has_its_variance_and_radius() {
        let n = 256;
        let mut sum = 0.0f64;
        for i in 0..n * n {
            let p = PixelFilter::Gaussian.sample(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
            assert!(p.length() <= GAUSSIAN_RADIUS_PX * 1.0001, "{p}");
            sum += f64::from(p.length_squared());
        }
        // E r² = 2σ² − R² e/(1 − e), e = exp(−R²/2σ²).
        let (s2, r2) = (f64::from(GAUSSIAN_SIGMA_PX).powi(2), f64::from(GAUSSIAN_RADIUS_PX).powi(2));
        let e = (-r2 / (2.0 * s2)).exp();
        let expected = 2.0 * s2 - r2 * e / (1.0 - e);
        assert!((sum / f64::from(n * n) / expected - 1.0).abs() < 2e-3, "{} {expected}", sum / f64::from(n * n));
    }
}
