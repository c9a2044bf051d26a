//! Reads `--importance`: a picture whose values multiply the thresholds.

use super::picture::InputPicture;
use anyhow::{Result, bail};
use fechner::integrator::Crop;
use fechner_perception::Plane;
use std::path::Path;

/// Widths over heights that differ by less than this share are the same: a small map's size is rounded to pixels.
const SAME_SHAPE: f64 = 0.02;

/// The least value: counts are found down to a tenth of it, and no noise is asked to be so much less than what can be
/// seen.
const LEAST: f32 = 1e-11;

/// Reads a map for a picture of `size` pixels, of which `area` is rendered: luminance of an EXR or HDR file as it
/// stands, or a PNG's or JPEG's code values from 0 to 1. A map of another size and the same shape is interpolated
/// bilinearly.
pub(super) fn read(path: &Path, size: (usize, usize), area: Crop) -> Result<Plane> {
    let map = InputPicture::read_values(path)?;
    let (width, height) = (map.width(), map.height());
    if let Some(index) = map.values().iter().position(|value| !(value.is_finite() && *value >= LEAST)) {
        bail!(refusal(path, map.values()[index], (index % width, index / width)));
    }
    let stretch = (width * size.1) as f64 / (height * size.0) as f64;
    if (stretch - 1.0).abs() > SAME_SHAPE {
        bail!(
            "{}: the importance map has {width}x{height} pixels, another shape than the picture of {}x{}",
            path.display(),
            size.0,
            size.1
        );
    }
    let scale = (width as f64 / size.0 as f64, height as f64 / size.1 as f64);
    Ok(Plane::from_fn(area.width as usize, area.height as usize, |x, y| {
        let (x, y) = (x as f64 + f64::from(area.x) + 0.5, y as f64 + f64::from(area.y) + 0.5);
        bilinear(&map, x * scale.0 - 0.5, y * scale.1 - 0.5)
    }))
}

/// What to say of a value that thresholds cannot be multiplied by.
pub(super) fn refusal(path: &Path, value: f32, (x, y): (usize, usize)) -> String {
    let value = match value {
        value if value.is_nan() => "not a number".to_owned(),
        value if value != 0.0 && value.abs() < 1e-4 => format!("{value:e}"),
        value => value.to_string(),
    };
    format!(
        "{}: the importance map is {value} at ({x}, {y}); its values multiply thresholds and must be above 0, at least {LEAST:e}: 1 \
         changes nothing, 0.5 lets half the noise stand, 2 twice",
        path.display()
    )
}

/// The value at a place between the centres of pixels, which are whole numbers; beyond the outermost ones it stays.
fn bilinear(map: &Plane, x: f64, y: f64) -> f32 {
    let place = |at: f64, extent: usize| {
        let at = at.clamp(0.0, (extent - 1) as f64);
        let first = at.floor() as usize;
        (first, (first + 1).min(extent - 1), at - at.floor())
    };
    let (left, right, along) = place(x, map.width());
    let (top, bottom, down) = place(y, map.height());
    let row = |y: usize| f64::from(map.get(left, y)) * (1.0 - along) + f64::from(map.get(right, y)) * along;
    (row(top) * (1.0 - down) + row(bottom) * down) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope stays one between the centres of the map's pixels, and a map of the picture's size is taken as it is.
    #[test]
    fn maps_are_interpolated_between_the_centres_of_pixels() {
        let map = Plane::from_fn(4, 3, |x, y| (1 + x + 10 * y) as f32);
        assert_eq!(bilinear(&map, 2.0, 1.0), 13.0);
        assert_eq!(bilinear(&map, 1.25, 0.5), 7.25);
        assert_eq!(bilinear(&map, -0.3, -0.5), 1.0);
        assert_eq!(bilinear(&map, 9.0, 9.0), 24.0);
    }
}
