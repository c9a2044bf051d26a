//! Our own denoiser: the perception crate's guide filter, prepared for being looked at.
//!
//! The guide may keep a speckle; a picture may not. So the filter gets unit normals (a pixel that two walls share has a shorter
//! mean, which the filter would take for an edge to everything), variance that neighbours share (of a few samples a
//! pixel's own says little), and light that was clipped to what its neighbourhood holds. Not for a picture without
//! surfaces: glass and mirrors are filtered by what the first surface says.

use super::{NoisyPicture, SurfaceGuides};
use fechner_perception::Plane;
use fechner_perception::guide::{GuideInputs, denoise as filter};
use fechner_perception::photometry::luminance;
use rayon::prelude::*;

/// Pixels to each side that a pixel is compared with.
const RADIUS: usize = 2;
/// Brighter neighbours that a pixel needs to be believed: a firefly has none, the edge of a lamp has many.
const WITNESSES: usize = 3;
/// What of a neighbour's variance counts, over the median of the neighbourhood.
const MOST_OVER_MEDIAN: f32 = 16.0;
/// How far a pixel may outshine the last of them, in standard errors of its neighbourhood.
const STANDARD_ERRORS: f32 = 1.0;

/// Guides with unit normals.
pub(super) fn prepare(mut guides: SurfaceGuides) -> SurfaceGuides {
    guides.normal.par_iter_mut().for_each(|normal| *normal = unit(*normal));
    guides
}

/// The picture without its noise.
pub(super) fn denoise(picture: &NoisyPicture<'_>) -> Vec<[f32; 3]> {
    let guides = picture.guides.get();
    let variance = smoothed(picture.variance);
    let rgb = without_fireflies(picture, &variance);
    filter(&GuideInputs {
        rgb: &rgb,
        variance: &variance,
        albedo: &guides.albedo,
        normal: &guides.normal,
        depth: &guides.depth,
        width: guides.width,
        height: guides.height,
    })
}

fn unit(normal: [f32; 3]) -> [f32; 3] {
    let length = normal.iter().map(|part| part * part).sum::<f32>().sqrt();
    if length > 1e-3 && length.is_finite() { normal.map(|part| part / length) } else { [0.0; 3] }
}

/// Mean of the window around each pixel; values above 16 times its median count as that, so that a firefly's variance does not
/// blur its neighbours.
fn smoothed(variance: &Plane) -> Plane {
    by_window(variance, |window| {
        let (_, &mut median, _) = window.select_nth_unstable_by(window.len() / 2, f32::total_cmp);
        window.iter().map(|&value| value.min(MOST_OVER_MEDIAN * median)).sum::<f32>() / window.len() as f32
    })
}

/// The picture with pixels brought down to the [`WITNESSES`]-th brightest of their neighbourhood and a little more.
fn without_fireflies(picture: &NoisyPicture<'_>, variance: &Plane) -> Vec<[f32; 3]> {
    let (width, height) = (variance.width(), variance.height());
    let bright = Plane::from_fn(width, height, |x, y| luminance(picture.rgb[y * width + x]));
    let limit = by_window(&bright, |window| {
        let place = window.len().saturating_sub(1 + WITNESSES);
        *window.select_nth_unstable_by(place, f32::total_cmp).1
    });
    let pixels = picture.rgb.par_iter().zip(limit.values()).zip(variance.values());
    pixels
        .map(|((&rgb, &limit), &variance)| {
            let (own, most) = (luminance(rgb), limit + STANDARD_ERRORS * variance.max(0.0).sqrt());
            if own > most { rgb.map(|value| value * most / own) } else { rgb }
        })
        .collect()
}

/// `of` the values around each pixel, itself included.
fn by_window(plane: &Plane, of: impl Fn(&mut [f32]) -> f32 + Sync) -> Plane {
    let (width, height) = (plane.width(), plane.height());
    let mut result = Plane::filled(width, height, 0.0);
    result.values_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        let mut window = Vec::with_capacity((2 * RADIUS + 1) * (2 * RADIUS + 1));
        for (x, value) in row.iter_mut().enumerate() {
            window.clear();
            for v in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height) {
                for u in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width) {
                    window.push(plane.get(u, v));
                }
            }
            *value = of(&mut window);
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::Denoiser;
    use crate::sampler::hash_words;

    const SIDE: usize = 48;

    fn random(x: usize, y: usize) -> f32 {
        (hash_words(x as u64, y as u64) >> 40) as f32 / 8_388_608.0 - 1.0
    }

    /// Two walls that meet at a column of pixels which see both, under noise of 20 %.
    fn corner(change: impl Fn(usize, usize, f32) -> f32) -> Vec<[f32; 3]> {
        let pixels = || (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE));
        let rgb: Vec<[f32; 3]> = pixels().map(|(x, y)| [change(x, y, 100.0 + 34.0 * random(x, y)); 3]).collect();
        let normal: Vec<[f32; 3]> = pixels()
            .map(|(x, _)| match x.cmp(&24) {
                std::cmp::Ordering::Less => [1.0, 0.0, 0.0],
                std::cmp::Ordering::Equal => [0.5, 0.5, 0.0],
                std::cmp::Ordering::Greater => [0.0, 1.0, 0.0],
            })
            .collect();
        let albedo = vec![[0.5; 3]; SIDE * SIDE];
        let guides =
            SurfaceGuides { width: SIDE, height: SIDE, albedo, normal, depth: vec![1.0; SIDE * SIDE], samples: 16.0 };
        let guides = Denoiser::Builtin.prepare(guides).expect("cannot fail");
        denoise(&NoisyPicture { rgb: &rgb, variance: &Plane::filled(SIDE, SIDE, 400.0), guides: &guides })
    }

    #[test]
    fn pixels_on_an_edge_are_denoised_along_it() {
        let denoised = corner(|_, _, value| value);
        let column: Vec<f32> = (4..SIDE - 4).map(|y| denoised[y * SIDE + 24][0]).collect();
        let mean = column.iter().sum::<f32>() / column.len() as f32;
        let deviation = (column.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / column.len() as f32).sqrt();
        assert!(deviation < 8.0, "{deviation} of 20");
    }

    #[test]
    fn fireflies_side_by_side_leave_no_trace() {
        let denoised = corner(|x, y, value| if (x, y) == (10, 10) || (x, y) == (11, 10) { 1e5 } else { value });
        assert!((denoised[10 * SIDE + 10][0] - 100.0).abs() < 40.0, "{:?}", denoised[10 * SIDE + 10]);
    }

    /// Equal bytes on any number of threads.
    #[test]
    fn threads_change_nothing() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| corner(|_, _, value| value))
        };
        assert_eq!(on(1), on(3));
    }
}
