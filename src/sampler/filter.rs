//! Pixel filters, importance sampled: each sample belongs to one pixel alone, so pixels stay independent and their
//! noise stays white, which is what the threshold model assumes.
//!
//! A filter with negative lobes is sampled by its absolute value, and its samples carry a sign. Their scatter is then
//! that of the signs, too, which no perception model should judge: adaptive sampling refuses such filters.

use glam::Vec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// A pixel reconstruction filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum PixelFilter {
    /// One pixel wide; what most references use.
    Box,
    /// Gaussian of σ 0.45 pixels, cut at 1.5 pixels (weight 0.4 % there): softer edges.
    #[default]
    Gaussian,
    /// The four-term window of Blackman and Harris, 3 pixels wide and separable (Harris 1978): sharper than the
    /// Gaussian, without its cut.
    BlackmanHarris,
    /// The cubic with B = C = 1/3, 4 pixels wide and separable (Mitchell and Netravali 1988): sharpest, with negative
    /// lobes.
    Mitchell,
}

/// Where in the picture a sample looks, and what it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// Place that is looked at, from the pixel's centre, in pixels.
    pub offset: Vec2,
    /// Multiplies the sample's radiance; its mean is 1.
    pub weight: f32,
}

/// Where the samples of a filter fall that is nowhere negative.
#[derive(Clone, Copy, Debug)]
pub struct FilterDensity {
    filter: PixelFilter,
    /// The integral of its height along an axis.
    height_px: f32,
}

impl FilterDensity {
    /// The share of samples in a square pixel, if it were everywhere as at this offset from the pixel's centre.
    pub fn at(&self, offset_px: Vec2) -> f32 {
        let along = |offset_px: f32| self.filter.height(offset_px) / self.height_px;
        along(offset_px.x) * along(offset_px.y)
    }
}

/// Widest radius of any filter, pixels.
const WIDEST_RADIUS_PX: f32 = 2.0;
const GAUSSIAN_SIGMA_PX: f32 = 0.45;
const GAUSSIAN_RADIUS_PX: f32 = 1.5;

static BLACKMAN_HARRIS: LazyLock<Profile> = LazyLock::new(|| Profile::new(1.5, blackman_harris));
static MITCHELL: LazyLock<Profile> = LazyLock::new(|| Profile::new(WIDEST_RADIUS_PX, mitchell));

impl PixelFilter {
    /// Name of the filter, for people.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Box => "box",
            Self::Gaussian => "gaussian",
            Self::BlackmanHarris => "blackman harris",
            Self::Mitchell => "mitchell",
        }
    }

    /// Whether it has negative lobes.
    pub fn is_signed(self) -> bool {
        self == Self::Mitchell
    }

    /// How far from a pixel's centre it still takes light, in pixels, where it is smooth and nowhere negative.
    pub fn smooth_radius_px(self) -> Option<f32> {
        match self {
            PixelFilter::Gaussian => Some(GAUSSIAN_RADIUS_PX),
            PixelFilter::BlackmanHarris => Some(BLACKMAN_HARRIS.radius_px),
            PixelFilter::Box | PixelFilter::Mitchell => None,
        }
    }

    /// Height of the filter along an axis, of any scale, 0 beyond its radius.
    pub fn height(self, offset_px: f32) -> f32 {
        let within = |radius_px: f32, height: f32| if offset_px.abs() < radius_px { height } else { 0.0 };
        match self {
            // What is right between two pixels is in one of them.
            PixelFilter::Box => {
                if (-0.5..0.5).contains(&offset_px) {
                    1.0
                } else {
                    0.0
                }
            }
            PixelFilter::Gaussian => within(GAUSSIAN_RADIUS_PX, (-0.5 * (offset_px / GAUSSIAN_SIGMA_PX).powi(2)).exp()),
            PixelFilter::BlackmanHarris => within(
                BLACKMAN_HARRIS.radius_px,
                blackman_harris(f64::from(offset_px / BLACKMAN_HARRIS.radius_px)) as f32,
            ),
            PixelFilter::Mitchell => {
                within(MITCHELL.radius_px, mitchell(f64::from(offset_px / MITCHELL.radius_px)) as f32)
            }
        }
    }

    /// Where its samples fall.
    pub fn density(self) -> FilterDensity {
        const CELLS: usize = 1024;
        const CELL_PX: f32 = 2.0 * WIDEST_RADIUS_PX / CELLS as f32;
        let height = |cell: usize| self.height((cell as f32 + 0.5) * CELL_PX - WIDEST_RADIUS_PX);
        FilterDensity { filter: self, height_px: CELL_PX * (0..CELLS).map(height).sum::<f32>() }
    }

    /// The sample for two numbers in [0, 1).
    pub fn sample(self, u: f32, v: f32) -> FilterSample {
        match self {
            PixelFilter::Box => FilterSample { offset: Vec2::new(u - 0.5, v - 0.5), weight: 1.0 },
            PixelFilter::Gaussian => FilterSample { offset: gaussian(u, v), weight: 1.0 },
            PixelFilter::BlackmanHarris => BLACKMAN_HARRIS.sample(u, v),
            PixelFilter::Mitchell => MITCHELL.sample(u, v),
        }
    }
}

/// Radially truncated Gaussian by inversion: r² = −2σ² ln(1 − u·(1 − e^(−R²/2σ²))).
fn gaussian(u: f32, v: f32) -> Vec2 {
    let two_sigma_squared = 2.0 * GAUSSIAN_SIGMA_PX * GAUSSIAN_SIGMA_PX;
    let kept = 1.0 - (-GAUSSIAN_RADIUS_PX * GAUSSIAN_RADIUS_PX / two_sigma_squared).exp();
    let radius = (-two_sigma_squared * (1.0 - u * kept).ln()).sqrt();
    radius * Vec2::from_angle(std::f32::consts::TAU * v)
}

/// `x` in [−1, 1] of the half width.
fn blackman_harris(x: f64) -> f64 {
    0.358_75 + 0.488_29 * (PI * x).cos() + 0.141_28 * (2.0 * PI * x).cos() + 0.011_68 * (3.0 * PI * x).cos()
}

/// `x` in [−1, 1] of the half width of 2 pixels.
fn mitchell(x: f64) -> f64 {
    let x = 2.0 * x.abs();
    let (b, c) = (1.0 / 3.0, 1.0 / 3.0);
    let value = if x < 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
    } else {
        (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x + (8.0 * b + 24.0 * c)
    };
    value / 6.0
}

/// One axis of a separable filter as a staircase: cells of equal width, sampled in proportion to their mean height.
struct Profile {
    radius_px: f32,
    /// `cumulative[i]` is the probability of the cells before i.
    cumulative: Vec<f32>,
    /// Sign of a cell's height times ∫|f| / ∫f.
    weight: Vec<f32>,
}

/// A sample along one axis.
struct AxisSample {
    offset_px: f32,
    weight: f32,
}

impl Profile {
    /// Cells of 1/512 of the width: no picture shows them.
    const CELLS: usize = 512;

    fn new(radius_px: f32, height: impl Fn(f64) -> f64) -> Self {
        let heights: Vec<f64> =
            (0..Self::CELLS).map(|i| height(2.0 * (i as f64 + 0.5) / Self::CELLS as f64 - 1.0)).collect();
        let absolute: f64 = heights.iter().map(|h| h.abs()).sum();
        let signed: f64 = heights.iter().sum();
        let mut running = 0.0;
        let mut cumulative = vec![0.0];
        cumulative.extend(heights.iter().map(|h| {
            running += h.abs() / absolute;
            running as f32
        }));
        let weight = heights.iter().map(|h| (absolute / signed).copysign(*h) as f32).collect();
        Self { radius_px, cumulative, weight }
    }

    fn sample(&self, u: f32, v: f32) -> FilterSample {
        let [x, y] = [u, v].map(|u| self.axis(u));
        FilterSample { offset: Vec2::new(x.offset_px, y.offset_px), weight: x.weight * y.weight }
    }

    fn axis(&self, u: f32) -> AxisSample {
        let cell = self.cumulative.partition_point(|&c| c <= u).clamp(1, Self::CELLS) - 1;
        let span = self.cumulative[cell + 1] - self.cumulative[cell];
        let within = if span > 0.0 { ((u - self.cumulative[cell]) / span).clamp(0.0, 1.0) } else { 0.5 };
        let place = 2.0 * (cell as f32 + within) / Self::CELLS as f32 - 1.0;
        AxisSample { offset_px: self.radius_px * place, weight: self.weight[cell] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: u32 = 512;

    fn grid(filter: PixelFilter) -> impl Iterator<Item = FilterSample> {
        (0..N * N).map(move |i| filter.sample(((i % N) as f32 + 0.5) / N as f32, ((i / N) as f32 + 0.5) / N as f32))
    }

    #[test]
    fn the_gaussian_has_its_variance_and_radius() {
        let mut sum = 0.0f64;
        for sample in grid(PixelFilter::Gaussian) {
            assert!(sample.offset.length() <= GAUSSIAN_RADIUS_PX * 1.0001, "{sample:?}");
            sum += f64::from(sample.offset.length_squared());
        }
        // E r² = 2σ² − R² e/(1 − e), e = exp(−R²/2σ²).
        let (s2, r2) = (f64::from(GAUSSIAN_SIGMA_PX).powi(2), f64::from(GAUSSIAN_RADIUS_PX).powi(2));
        let e = (-r2 / (2.0 * s2)).exp();
        let expected = 2.0 * s2 - r2 * e / (1.0 - e);
        let seen = sum / f64::from(N * N);
        assert!((seen / expected - 1.0).abs() < 2e-3, "{seen} {expected}");
    }

    /// Weighted samples integrate functions as the filter itself does: 1, x² and cos 3x, against quadrature.
    #[test]
    fn separable_filters_integrate_as_they_should() {
        type Function = fn(f64) -> f64;
        let cases: [(PixelFilter, &Profile, Function); 2] = [
            (PixelFilter::BlackmanHarris, &BLACKMAN_HARRIS, blackman_harris),
            (PixelFilter::Mitchell, &MITCHELL, mitchell),
        ];
        const STEPS: u32 = 1 << 17;
        let share = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        for (filter, profile, height) in cases {
            let functions: [Function; 3] = [|_| 1.0, |x| x * x, |x| (3.0 * x).cos()];
            for function in functions {
                let at = |i: u32| 2.0 * share(i) - 1.0;
                let total: f64 = (0..STEPS).map(|i| height(at(i))).sum();
                let weighted = |i: u32| height(at(i)) * function(f64::from(profile.radius_px) * at(i));
                let expected: f64 = (0..STEPS).map(weighted).sum::<f64>() / total;
                let seen = (0..STEPS)
                    .map(|i| profile.axis(share(i) as f32))
                    .map(|sample| f64::from(sample.weight) * function(f64::from(sample.offset_px)))
                    .sum::<f64>()
                    / f64::from(STEPS);
                assert!((seen - expected).abs() < 1e-3, "{filter:?}: {seen} {expected}");
            }
            assert_eq!(filter.is_signed(), grid(filter).any(|s| s.weight < 0.0));
        }
    }
}
