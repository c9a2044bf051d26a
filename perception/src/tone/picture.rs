//! Whole pictures through a fitted operator.

use rayon::prelude::*;

use super::{FittedTone, Pixel};

/// Linear display RGB in 0..1 for a picture in scene cd/m², row by row, `width` pixels wide: the operator's loss of acuity
/// first, then its colours, rows in parallel.
#[must_use]
pub fn map_picture(fitted: &dyn FittedTone, width: usize, rgb_cd_m2: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let width = width.max(1);
    let blurred = fitted.acuity().map(|acuity| acuity.blur(width, rgb_cd_m2));
    let source = blurred.as_deref().unwrap_or(rgb_cd_m2);
    let mut shown = vec![[0.0; 3]; source.len()];
    shown.par_chunks_mut(width).zip(source.par_chunks(width)).enumerate().for_each(|(y, (shown, scene))| {
        for (x, (shown, scene)) in shown.iter_mut().zip(scene).enumerate() {
            *shown = fitted.map_rgb_at(Pixel { x, y }, *scene);
        }
    });
    shown
}
