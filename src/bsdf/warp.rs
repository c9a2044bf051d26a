//! Directions from uniform numbers.
//!
//! Source: Malley's method, as in Pharr, Jakob & Humphreys, *Physically Based Rendering* (2023), section A.5.3.

use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};

/// Sine and cosine of `turns`·2π, for turns in [0, 1]; within 3e-7. By polynomials: the system's functions take three
/// times as long and round differently from machine to machine.
pub(crate) fn sin_cos_of_turns(turns: f32) -> (f32, f32) {
    // Halves go up; `round` is a call on machines without SSE4.1.
    let quarter = (4.0 * turns + 0.5) as u32;
    let x = (4.0 * turns - quarter as f32) * FRAC_PI_2; // in [−π/4, π/4]
    let x2 = x * x;
    // Taylor's series: the next terms are below 2e-9 and 3e-8 at π/4.
    let sin = x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0)))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    // Without a branch, which would be guessed wrong three times of four.
    let (own, other) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let turned = |value: f32, quarters: u32| f32::from_bits(value.to_bits() ^ (quarters & 2) << 30);
    (turned(own, quarter), turned(other, quarter + 1))
}

/// A direction of the upper hemisphere with pdf cos θ / π, from `u` in [0, 1)².
pub(crate) fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let (sin, cos) = sin_cos_of_turns(u[0]);
    let radius = u[1].sqrt();
    // u below 1 keeps z above 0, so that no sample lies in the surface.
    Vec3::new(radius * cos, radius * sin, (1.0 - u[1]).max(f32::MIN_POSITIVE).sqrt())
}

/// Pdf per steradian of [`cosine_hemisphere`]; 0 below the surface.
pub(crate) fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Directions of the upper hemisphere that crowd towards the horizon, with pdf cos θ / (π ln(1 + 1/c²)(cos²θ + c²)).
///
/// The light that single scattering loses has this shape: it leaves within about α of the horizon when the surface is
/// nearly smooth, where cosine-distributed directions would carry weights of up to 1/α².
#[derive(Clone, Copy, Debug)]
pub(crate) struct GrazingHemisphere {
    /// c².
    spread2: f32,
    /// ln(1 + 1/c²).
    log: f32,
}

impl GrazingHemisphere {
    /// The warp for a microfacet surface of slope width `alpha` in (0, 1].
    pub(crate) fn new(alpha: f32) -> Self {
        // c = α for smooth surfaces; at α = 1 large, and the distribution all but cosine.
        let spread2 = alpha * alpha / (1.02 - alpha);
        Self { spread2, log: (1.0 / spread2).ln_1p() }
    }

    /// A direction from `u` in [0, 1)².
    pub(crate) fn sample(&self, u: [f32; 2]) -> Vec3 {
        let cos2 = (self.spread2 * (self.log * u[1]).exp_m1()).clamp(f32::MIN_POSITIVE, 1.0);
        let (sin, cos) = sin_cos_of_turns(u[0]);
        let radius = (1.0 - cos2).sqrt();
        Vec3::new(radius * cos, radius * sin, cos2.sqrt())
    }

    /// Pdf per steradian; 0 below the surface.
    pub(crate) fn pdf(&self, cos_theta: f32) -> f32 {
        if cos_theta > 0.0 { cos_theta * FRAC_1_PI / (self.log * (cos_theta * cos_theta + self.spread2)) } else { 0.0 }
    }
}

/// A choice of two by a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice {
    /// Whether the one whose probability was told is taken.
    pub(crate) is_taken: bool,
    /// What is left of the number, stretched over [0, 1) again.
    pub(crate) rest: f32,
}

/// Takes a choice with probability `probability` by `u`.
pub(crate) fn choose(u: f32, probability: f32) -> Choice {
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
    if u < probability {
        Choice { is_taken: true, rest: (u / probability).min(BELOW_ONE) }
    } else {
        // With a probability of 1 and u < 1 this branch is never reached; max() only guards against rounding.
        let left = (1.0 - probability).max(f32::MIN_POSITIVE);
        Choice { is_taken: false, rest: ((u - probability) / left).min(BELOW_ONE) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_sine_and_cosine() {
        for i in 0..=10_000 {
            let turns = i as f32 / 10_000.0;
            let (sin, cos) = sin_cos_of_turns(turns);
            let (exact_sin, exact_cos) = (std::f64::consts::TAU * f64::from(turns)).sin_cos();
            let error = (f64::from(sin) - exact_sin).abs().max((f64::from(cos) - exact_cos).abs());
            assert!(error < 3e-7, "{turns}: {sin}, {cos}");
        }
    }
}
