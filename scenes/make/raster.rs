//! Pictures in memory: colours as they are seen (sRGB code values in [0, 1]) or heights, and how they are written.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// A colour in sRGB code values, [0, 1].
pub(crate) type Color = [f32; 3];

/// A mixture of two colours.
pub(crate) fn mix_colors(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// A colour made brighter or darker.
pub(crate) fn scale_color(color: Color, factor: f32) -> Color {
    color.map(|c| c * factor)
}

/// A square of values over u and v in [0, 1), row 0 at the top.
pub(crate) struct Raster<T> {
    size: u32,
    values: Vec<T>,
}

impl<T> Raster<T> {
    /// Evaluates `value(u, v)` at the middle of each of `size`² pixels; v runs down.
    pub(crate) fn new(size: u32, value: impl Fn(f32, f32) -> T) -> Self {
        let middle = |i: u32| (i as f32 + 0.5) / size as f32;
        let values = (0..size * size).map(|i| value(middle(i % size), middle(i / size))).collect();
        Self { size, values }
    }
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn write_png(path: &Path, size: u32, bytes: &[u8], color: ExtendedColorType) -> anyhow::Result<()> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive)
        .write_image(bytes, size, size, color)?;
    Ok(())
}

impl Raster<Color> {
    /// Writes an 8-bit RGB picture.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        let bytes: Vec<u8> = self.values.iter().flat_map(|color| color.map(byte)).collect();
        write_png(path, self.size, &bytes, ExtendedColorType::Rgb8)
    }
}

impl Raster<f32> {
    /// Writes an 8-bit grey picture.
    pub(crate) fn write(&self, path: &Path) -> anyhow::Result<()> {
        let bytes: Vec<u8> = self.values.iter().map(|&value| byte(value)).collect();
        write_png(path, self.size, &bytes, ExtendedColorType::L8)
    }

    /// The tangent-space normals of these heights, green up as in glTF.
    /// A height of 1 over a whole side of the picture has slope `strength`.
    pub(crate) fn normals(&self, strength: f32) -> Raster<Color> {
        let n = self.size;
        let at = |x: u32, y: u32| self.values[((y % n) * n + x % n) as usize];
        let scale = strength * n as f32 * 0.5;
        let values = (0..n * n)
            .map(|i| {
                let (x, y) = (i % n, i / n);
                let slope_x = (at(x + 1, y) - at(x + n - 1, y)) * scale;
                let slope_up = (at(x, y + n - 1) - at(x, y + 1)) * scale;
                let length = (slope_x * slope_x + slope_up * slope_up + 1.0).sqrt();
                [-slope_x / length, -slope_up / length, 1.0 / length].map(|c| c * 0.5 + 0.5)
            })
            .collect();
        Raster { size: n, values }
    }
}
