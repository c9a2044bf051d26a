//! Whole pictures through a fitted operator.

use rayon::prelude::*;

use super::{FittedTone, Pixel};

/// Linear display RGB in 0..1 for a picture in scene cd/m², row by row, `width` pixels wide: the operator's loss of
/// acuity first, then its colours, rows in parallel.
#[must_use]
pub fn map_picture(fitted: &dyn FittedTone, width: usize, rgb_cd_m2: &[[f32; 3]]) -> Vec<[f32; 3]> {
    match fitted.acuity() {
        Some(acuity) => map_pixels(fitted, width, &acuity.blur(width.max(1), rgb_cd_m2)),
        None => map_pixels(fitted, width, rgb_cd_m2),
    }
}

/// Linear display RGB in 0..1 for a picture in scene cd/m², row by row, `width` pixels wide, each pixel for itself:
/// [`map_picture`] without the loss of acuity, for noise that is judged behind it
/// ([`BehindAcuity`](super::acuity::BehindAcuity)).
#[must_use]
pub fn map_pixels(fitted: &dyn FittedTone, width: usize, rgb_cd_m2: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let width = width.max(1);
    let mut shown = vec![[0.0; 3]; rgb_cd_m2.len()];
    shown.par_chunks_mut(width).zip(rgb_cd_m2.par_chunks(width)).enumerate().for_each(|(y, (shown, scene))| {
        for (x, (shown, scene)) in shown.iter_mut().zip(scene).enumerate() {
            *shown = fitted.map_rgb_at(Pixel { x, y }, *scene);
        }
    });
    shown
}
