//! Points of a parallelogram with a density that is bilinear between its corners.
//!
//! Where an emitter is a few times farther away than it is wide, what its points give to a receiver is nearly that:
//! sampling by it leaves less variance than the uniform solid angle, which knows nothing of the receiver's cosine, and
//! takes no trigonometric function. Not for emitters that are near: between the corners anything may happen.

use super::lanes::FourVectors;
use glam::{Vec3, Vec4};

/// Density over the unit square of shares of two edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct BilinearDensity {
    /// At (0, 0), (1, 0), (0, 1) and (1, 1), of no particular scale; above 0.
    corners: Vec4,
}

/// Corners of the parallelogram that two edges span, at their shares (0, 0), (1, 0), (0, 1) and (1, 1).
pub(super) fn parallelogram_corners(corner: Vec3, edge_1: Vec3, edge_2: Vec3) -> FourVectors {
    FourVectors::new([corner, corner + edge_1, corner + edge_2, corner + edge_1 + edge_2])
}

impl BilinearDensity {
    /// A density in proportion to what an even emitter gives to a receiver of unit normal `normal` (zero if it receives
    /// from all sides): cos θ at the receiver over the fourth power of the distance, since the cosine at the emitter is
    /// its plane's distance over the point's. `corners` are as seen from the receiver.
    #[inline]
    pub(super) fn of_irradiance(corners: &FourVectors, normal: Vec3) -> Self {
        let squared = corners.dot_each(corners).max(Vec4::splat(f32::MIN_POSITIVE));
        let given = if normal == Vec3::ZERO {
            1.0 / (squared * squared.sqrt())
        } else {
            corners.dot(normal).max(Vec4::ZERO) / (squared * squared)
        };
        let most = given.max_element();
        if !(most > 0.0 && most.is_finite()) {
            return Self { corners: Vec4::ONE };
        }
        // What lies below the horizon at a corner may be above it beside the corner: no density falls far below the
        // largest.
        const MIN_SHARE: f32 = 0.1;
        Self { corners: (given / most).max(Vec4::splat(MIN_SHARE)) }
    }

    /// Shares of the edges, for uniform numbers in [0, 1).
    pub(super) fn sample(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let [low_left, low_right, high_left, high_right] = self.corners.to_array();
        let y = sample_linear(v, low_left + low_right, high_left + high_right);
        let x = sample_linear(u, lerp(y, low_left, high_left), lerp(y, low_right, high_right));
        [x, y]
    }

    /// Density at shares of the edges; its mean over the square is 1.
    pub(super) fn at(&self, [x, y]: [f32; 2]) -> f32 {
        let [low_left, low_right, high_left, high_right] = self.corners.to_array();
        let here = lerp(y, lerp(x, low_left, low_right), lerp(x, high_left, high_right));
        4.0 * here / (low_left + low_right + high_left + high_right)
    }
}

fn lerp(t: f32, a: f32, b: f32) -> f32 {
    a + t * (b - a)
}

/// The place in [0, 1] below which a share `u` lies of a density that goes from `a` to `b`, both above 0.
fn sample_linear(u: f32, a: f32, b: f32) -> f32 {
    // The root of b·x²/2 + a·(x − x²/2) = u·(a + b)/2 in the form that does not cancel.
    (u * (a + b) / (a + lerp(u, a * a, b * b).sqrt())).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distribution function at what was sampled is the uniform number that it was sampled for.
    #[test]
    fn samples_invert_the_distribution() {
        for (a, b) in [(1.0_f32, 1.0_f32), (0.1, 1.0), (1.0, 0.1), (3.0, 2.0)] {
            for i in 0..=16 {
                let u = i as f32 / 16.0;
                let x = sample_linear(u, a, b);
                let below = (a * x + 0.5 * (b - a) * x * x) / (0.5 * (a + b));
                assert!((0.0..=1.0).contains(&x) && (below - u).abs() < 1e-6, "{a} {b} {u}: {x}, {below}");
            }
        }
    }

    #[test]
    fn the_density_is_normalised_and_never_vanishes() {
        let corners = parallelogram_corners(Vec3::new(2.0, 3.0, 1.5), 2.0 * Vec3::X, 2.0 * Vec3::Z);
        let square = corners.seen_from(Vec3::ONE);
        for normal in [Vec3::Y, Vec3::X, -Vec3::Y, Vec3::ZERO, Vec3::new(-0.6, 0.8, 0.0)] {
            let density = BilinearDensity::of_irradiance(&square, normal);
            let n = 64;
            let place = |i: usize| (i as f32 + 0.5) / n as f32;
            let sum: f32 = (0..n * n).map(|i| density.at([place(i % n), place(i / n)])).sum();
            assert!((sum / (n * n) as f32 - 1.0).abs() < 1e-4, "{normal}: {sum}");
            assert!(density.at([0.0, 0.0]).min(density.at([1.0, 1.0])) > 0.0);
        }
    }
}
