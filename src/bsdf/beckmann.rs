//! What the Beckmann distribution needs beside its density: masking, and normals visible from a direction.
//!
//! Everything here is for slopes of width 1; [`super::microfacets`] stretches directions accordingly.
//!
//! Sources: B. Smith (1967) for Λ, here in closed form and not by the usual rational fit, whose error of
//! 0.35 % would show in tests of the pdf; E. Heitz & E. d'Eon, *Importance sampling microfacet-based BSDFs
//! using the distribution of visible normals* (2014), for the decomposition into two slopes; M. Giles,
//! *Approximating the erfinv function* (2010).

use glam::Vec3;
use libm::{erf, erff};
use std::f32::consts::PI;

/// cos θ·(1 + 2Λ) where `slope` is sin θ times the width of the slopes and `cos` is cos θ.
pub(super) fn stretch(slope: f32, cos: f32) -> f32 {
    let cotangent = cos / slope.max(f32::MIN_POSITIVE);
    // erf is 1 and the exponential 0 to the last bit.
    if cotangent > 4.0 {
        return cos;
    }
    cos * erff(cotangent) + slope * (-cotangent * cotangent).exp() / PI.sqrt()
}

/// A normal (not of unit length, z = 1) visible from `view`, a unit direction of the upper half.
pub(super) fn visible_normal(view: Vec3, u: [f32; 2]) -> Vec3 {
    let sin = view.x.hypot(view.y);
    // The azimuth in which the viewer is; any will do from straight above.
    let (cos_phi, sin_phi) = if sin > 0.0 { (view.x / sin, view.y / sin) } else { (1.0, 0.0) };
    let towards = slope_towards_viewer(f64::from(sin), f64::from(view.z), f64::from(u[0]));
    let across = inverse_erf(2.0 * u[1] - 1.0);
    Vec3::new(cos_phi * towards - sin_phi * across, sin_phi * towards + cos_phi * across, 1.0)
}

/// Solves ∫ (cos θ + s sin θ)⁺ exp(−s²) ds = u·(whole) for the upper limit, s being how far the normal leans towards
/// the viewer.
///
/// The integral's closed form is increasing, so Newton's method held in a shrinking bracket always ends; in f64,
/// because f32 leaves too few bits of the tail at grazing angles.
fn slope_towards_viewer(sin: f64, cos: f64, u: f64) -> f32 {
    const TAIL: f64 = 6.0;
    const ROOT_PI: f64 = 1.772_453_850_905_516;
    // In q = −s the integral up to q is cos (1 + erf q)/2 + sin exp(−q²)/(2√π), for q at most cot θ.
    let integral = |q: f64| 0.5 * (cos * (1.0 + erf(q)) + sin * (-q * q).exp() / ROOT_PI);
    let most = if sin * TAIL > cos { cos / sin } else { TAIL };
    let wanted = (1.0 - u) * integral(most);
    let (mut low, mut high) = (-TAIL, most);
    // The median of the half-way case is near; a few steps are enough from anywhere.
    let mut q = f64::from(inverse_erf((1.0 - 2.0 * u) as f32)).clamp(low, high) - 0.3 * sin;
    for _ in 0..60 {
        if !(q > low && q < high) {
            q = 0.5 * (low + high);
        }
        let error = integral(q) - wanted;
        if error > 0.0 {
            high = q;
        } else {
            low = q;
        }
        let slope = (-q * q).exp() * (cos - sin * q) / ROOT_PI;
        let step = error / slope;
        q -= step;
        if step.abs() < 1e-7 || high - low < 1e-7 {
            break;
        }
    }
    -q.clamp(low, high) as f32
}

/// Inverse of the error function on (−1, 1), to single precision; ±3.8 at the ends.
fn inverse_erf(x: f32) -> f32 {
    const CENTRE: [f32; 9] = [
        2.810_226_4e-8,
        3.432_739_4e-7,
        -3.523_387_7e-6,
        -4.391_506_5e-6,
        2.185_808_7e-4,
        -1.253_725e-3,
        -4.177_681_6e-3,
        0.246_640_73,
        1.501_409_4,
    ];
    const TAILS: [f32; 9] = [
        -2.002_142_6e-4,
        1.009_505_6e-4,
        1.349_343_2e-3,
        -3.673_428_4e-3,
        5.739_507_7e-3,
        -7.622_461_3e-3,
        9.438_870_5e-3,
        1.001_674,
        2.832_976_8,
    ];
    const END: f32 = 1.0 - f32::EPSILON;
    let x = x.clamp(-END, END);
    let w = -((1.0 - x) * (1.0 + x)).ln();
    let (coefficients, w) = if w < 5.0 { (CENTRE, w - 2.5) } else { (TAILS, w.sqrt() - 3.0) };
    x * coefficients.iter().fold(0.0, |sum, coefficient| sum * w + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_error_function_inverts() {
        for x in [-0.999_9f32, -0.7, -1e-4, 0.0, 0.3, 0.99] {
            assert!((erff(inverse_erf(x)) - x).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn slopes_solve_their_equation() {
        for sin in [0.0f64, 1e-6, 0.3, 0.9, 0.999_999, 1.0] {
            let cos = (1.0 - sin * sin).sqrt();
            let integral = |q: f64| cos * (1.0 + erf(q)) + sin * (-q * q).exp() / std::f64::consts::PI.sqrt();
            let whole = integral(if sin > 0.0 { (cos / sin).min(6.0) } else { 6.0 });
            for u in [0.0, 1e-4, 0.2, 0.5, 0.9, 0.999_9] {
                let q = -f64::from(slope_towards_viewer(sin, cos, u));
                let got = 1.0 - integral(q) / whole;
                assert!((got - u).abs() < 1e-6, "sin {sin} u {u}: {got}");
            }
        }
    }
}
