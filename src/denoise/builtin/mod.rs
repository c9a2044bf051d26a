//! Our own denoiser: what is alike is fitted, twice, by what the first surfaces say and by the pixels themselves.
//!
//! First, each pixel is fitted from the neighbours whose surroundings look like its own (non-local means, Buades, Coll
//! and Morel 2005, with the distance of Rousselle, Knaus and Zwicker 2012, which knows the noise): a plane through
//! albedo, normal and depth (first-order regression: Moon, Carr and Yoon 2014; Bitterli et al. 2016), so that textures
//! and edges survive, whatever light makes of them. Then the light that falls on the surfaces is fitted again, farther
//! out, by a plane through the place, by what the first pass left of the noise. Fireflies need no treatment of their
//! own: their variance says that they may as well be their neighbours.
//!
//! Not for a picture without surfaces: glass and mirrors are filtered by what the first surface says, and by what they
//! show.

mod fit;
mod lanes;
mod likeness;
mod planes;
mod taps;

use super::{NoisyPicture, SurfaceGuides};
use fechner_perception::Plane;
use fechner_perception::guide::divisor;
use fechner_perception::photometry::luminance;
use fit::{FEATURES, by_features, by_place};
use likeness::{Light, Likeness, Surfaces};
use planes::{Beyond, PaddedPlane};
use rayon::prelude::*;
use taps::Taps;

/// Values are cut here, in units of [`unit_of`], so that squares and sums stay finite.
const MOST: f32 = 1e9;
/// Share of its neighbours' variance that a pixel has at least: few samples may all be alike by chance.
const SHARED_VARIANCE: f32 = 0.5;
/// What is left of the noise after the first pass is alike from pixel to pixel: it counts as so many times its
/// variance.
const CORRELATION: f32 = 2.0;
/// What shines brighter than this, in units of [`unit_of`], is left as it came: its light has no noise but at its
/// edges, and what those are neither half would know if both were smoothed alike.
const BRIGHT_LAMP: f32 = 2.0;
/// Depth as a feature runs from 0 to this.
const DEPTH_RANGE: f32 = 10.0;

/// What guides the filter, once for all pictures.
#[derive(Clone, Debug)]
pub(super) struct Prepared {
    surfaces: Surfaces,
    features: [PaddedPlane; FEATURES],
    /// What light is of what is seen: see [`divisor`].
    divisors: Vec<[f32; 3]>,
}

impl Prepared {
    /// Guides made ready for the filter, of which there is at least a pixel.
    pub(super) fn of(guides: &SurfaceGuides) -> Self {
        Self {
            surfaces: Surfaces::of(guides),
            features: features(guides),
            divisors: guides.albedo.par_iter().map(|&albedo| divisor(albedo)).collect(),
        }
    }
}

/// The picture without its noise.
pub(super) fn denoise(picture: &NoisyPicture<'_>, prepared: &Prepared) -> Vec<[f32; 3]> {
    let guides = picture.guides.get();
    let count = guides.width * guides.height;
    if picture.rgb.len() != count || picture.variance.values().len() != count {
        return picture.rgb.to_vec();
    }
    let Prepared { surfaces, features, divisors } = prepared;
    let unit = unit_of(picture.rgb);
    let rgb: Vec<[f32; 3]> = picture.rgb.par_iter().map(|rgb| rgb.map(|value| usable(value / unit))).collect();
    let variance = picture.variance.map(|variance| usable(variance / (unit * unit)));

    let light = Light::of(guides, &illumination(&rgb, divisors), &of_light(&shared(&variance), divisors));
    let near = Likeness::<2> {
        taps: &Taps::around(97, 0.711),
        light: &light,
        surfaces,
        tolerance: 0.7,
        most_variance_ratio: 100.0,
    };
    let first = by_features(&channels(guides, &rgb), features, guides.samples, &near);

    let illuminated = illumination(&first.rgb, divisors);
    let left: Vec<f32> = first.variance.iter().map(|variance| CORRELATION * variance).collect();
    let light = Light::of(guides, &illuminated, &left);
    let far = Likeness::<1> {
        taps: &Taps::around(97, 2.234),
        light: &light,
        surfaces,
        tolerance: 1.0,
        most_variance_ratio: 25.0,
    };
    let second = by_place(&channels(guides, &illuminated), &far);
    let shown = |pixel: usize| {
        if guides.shines[pixel] && luminance(rgb[pixel]) > BRIGHT_LAMP {
            return picture.rgb[pixel];
        }
        std::array::from_fn(|c| unit * second[pixel][c] * divisors[pixel][c])
    };
    (0..count).into_par_iter().map(shown).collect()
}

/// The mean luminance of all but the brightest hundredth of the picture, in units of which it is filtered: no firefly
/// makes the rest vanish. The whole's where that is dark, and 1 where there is no light at all.
fn unit_of(rgb: &[[f32; 3]]) -> f32 {
    let mut bright: Vec<f32> = rgb.par_iter().map(|&rgb| luminance(rgb)).filter(|value| value.is_finite()).collect();
    let mean = |values: &[f32]| {
        let sum: f64 = values.iter().map(|&value| f64::from(value)).sum();
        (sum / values.len().max(1) as f64) as f32
    };
    let most = bright.len() - bright.len() / 100;
    if most < bright.len() {
        bright.select_nth_unstable_by(most, f32::total_cmp);
    }
    let units = [mean(&bright[..most]), mean(&bright)];
    units.into_iter().find(|&unit| unit > f32::MIN_POSITIVE && unit.is_finite()).unwrap_or(1.0)
}

/// Finite and not negative.
fn usable(value: f32) -> f32 {
    if value.is_finite() { value.clamp(0.0, MOST) } else { 0.0 }
}

/// Light that falls on each pixel's surface.
fn illumination(rgb: &[[f32; 3]], divisors: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let pixels = rgb.par_iter().zip(divisors);
    pixels.map(|(rgb, divisor)| std::array::from_fn(|c| rgb[c] / divisor[c])).collect()
}

/// Variance of the luminance of that light.
fn of_light(variance: &Plane, divisors: &[[f32; 3]]) -> Vec<f32> {
    let squared = |divisor: [f32; 3]| luminance(divisor) * luminance(divisor);
    let pixels = variance.values().par_iter().zip(divisors);
    pixels.map(|(variance, &divisor)| variance / squared(divisor)).collect()
}

/// Variance of which each pixel has at least a share of its neighbourhood's.
fn shared(variance: &Plane) -> Plane {
    let (width, height) = (variance.width(), variance.height());
    let tent = |before: f32, own: f32, after: f32| 0.25 * before + 0.5 * own + 0.25 * after;
    let rows = Plane::from_fn(width, height, |x, y| {
        tent(variance.get(x.saturating_sub(1), y), variance.get(x, y), variance.get((x + 1).min(width - 1), y))
    });
    Plane::from_fn(width, height, |x, y| {
        let around = tent(rows.get(x, y.saturating_sub(1)), rows.get(x, y), rows.get(x, (y + 1).min(height - 1)));
        variance.get(x, y).max(SHARED_VARIANCE * around)
    })
}

/// Each colour by itself.
fn channels(guides: &SurfaceGuides, rgb: &[[f32; 3]]) -> [PaddedPlane; 3] {
    std::array::from_fn(|c| PaddedPlane::new(guides.width, guides.height, Beyond::Edge, |i| rgb[i][c]))
}

/// What colours are fitted by: albedo, normal (shorter where a pixel sees several surfaces) and depth.
fn features(guides: &SurfaceGuides) -> [PaddedPlane; FEATURES] {
    let bounded = |value: f32| if value.is_finite() { value.clamp(-4.0, 4.0) } else { 0.0 };
    let farthest = guides.depth.iter().filter(|depth| depth.is_finite()).fold(0.0_f32, |most, &depth| most.max(depth));
    let scale = DEPTH_RANGE / farthest.max(f32::MIN_POSITIVE);
    std::array::from_fn(|feature| {
        PaddedPlane::new(guides.width, guides.height, Beyond::Edge, |i| match feature {
            0..3 => bounded(guides.albedo[i][feature]),
            3..6 => bounded(guides.normal[i][feature - 3]),
            _ if guides.depth[i].is_finite() => guides.depth[i].max(0.0) * scale,
            _ => DEPTH_RANGE,
        })
    })
}

#[cfg(test)]
mod tests;
