//! Glare: light that bright places scatter over the whole retina.

use serde::{Deserialize, Serialize};

use super::field::FrozenPlane;
use super::guide::Pixel;
use crate::display::PixelDensity;
use crate::plane::Plane;

/// Share of what a place on the retina gets that comes from elsewhere in view (`pcond` of Radiance; Ward Larson,
/// Rushmeier and Piatko 1997).
const SHARE: f64 = 0.08;
/// Least range of the picture, in natural logarithms, from which a veil is worth making (`pcond`).
const LEAST_RANGE: f64 = 4.5;
/// More cells than this would make the sum over all pairs slow; they then grow beyond 1°.
const MOST_CELLS: usize = 2500;

/// A smooth veil of achromatic light over a picture, frozen.
///
/// It mixes pixels only over degrees, so a pixel's noise passes it as (1 − 0.08) of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Veil {
    cell: CellSize,
    /// Of each cell, already times the share.
    cells_cd_m2: FrozenPlane,
    mean_cd_m2: f32,
}

/// Size of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct CellSize {
    width_px: usize,
    height_px: usize,
}

impl CellSize {
    /// One degree, or as many as it takes to cut a picture into no more than [`MOST_CELLS`].
    fn of(width: usize, height: usize, density: PixelDensity) -> Self {
        let pixels = |pixels_per_degree: f64| (pixels_per_degree.round() as usize).max(1);
        let mut cell = Self { width_px: pixels(density.horizontal), height_px: pixels(density.vertical) };
        while width.div_ceil(cell.width_px) * height.div_ceil(cell.height_px) > MOST_CELLS {
            cell = Self { width_px: 2 * cell.width_px, height_px: 2 * cell.height_px };
        }
        cell
    }
}

impl Veil {
    /// The veil of a picture; `None` where its range is too small to make one.
    ///
    /// The picture's 1° cells (its foveal image) are weighted by Moon and Spencer's cos t / t² for the angle t between them,
    /// written as cos t / (2 (1 − cos t)).
    pub(super) fn of(luminance_cd_m2: &Plane, density: PixelDensity) -> Option<Self> {
        let (width, height) = (luminance_cd_m2.width(), luminance_cd_m2.height());
        let cell = CellSize::of(width, height, density);
        let (columns, rows) = (width.div_ceil(cell.width_px), height.div_ceil(cell.height_px));
        let foveal = Plane::from_fn(columns, rows, |column, row| mean_of_cell(luminance_cd_m2, cell, column, row));
        let (least, greatest) =
            foveal.values().iter().fold((f64::INFINITY, 0.0), |(least, greatest): (f64, f64), &value| {
                (least.min(f64::from(value).max(1e-4)), greatest.max(f64::from(value)))
            });
        if foveal.values().len() < 2 || (greatest / least).ln() < LEAST_RANGE {
            return None;
        }
        let cell_rad = CellAngle {
            width: (cell.width_px as f64 / density.horizontal).to_radians(),
            height: (cell.height_px as f64 / density.vertical).to_radians(),
        };
        let cells_cd_m2 = Plane::from_fn(columns, rows, |column, row| veil_at(&foveal, cell_rad, column, row));
        let mean_cd_m2 = cells_cd_m2.values().iter().sum::<f32>() / cells_cd_m2.values().len() as f32;
        Some(Self { cell, cells_cd_m2: FrozenPlane::of(cells_cd_m2), mean_cd_m2 })
    }

    /// Share of a pixel's own light that is left.
    pub(super) const fn own_share() -> f32 {
        (1.0 - SHARE) as f32
    }

    /// Light of the veil at a pixel, cd/m², between the cells' centres; its mean outside.
    pub(super) fn at(&self, pixel: Pixel) -> f32 {
        let CellSize { width_px, height_px } = self.cell;
        let (columns, rows) = (self.cells_cd_m2.width(), self.cells_cd_m2.height());
        if pixel.x >= columns.saturating_mul(width_px) || pixel.y >= rows.saturating_mul(height_px) {
            return self.mean_cd_m2;
        }
        let place = |index: usize, cell_px: usize, count: usize| {
            let at = ((index as f32 + 0.5) / cell_px as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            (at as usize, (at as usize + 1).min(count - 1), at.fract())
        };
        let (left, right, x) = place(pixel.x, width_px, columns);
        let (top, bottom, y) = place(pixel.y, height_px, rows);
        let cell = |x, y| self.cells_cd_m2.at(Pixel { x, y }).map_or(self.mean_cd_m2, |light| light as f32);
        let line = |row| cell(left, row) * (1.0 - x) + cell(right, row) * x;
        line(top) * (1.0 - y) + line(bottom) * y
    }

    /// The picture as it falls on the retina.
    pub(super) fn over(&self, luminance_cd_m2: &Plane) -> Plane {
        Plane::from_fn(luminance_cd_m2.width(), luminance_cd_m2.height(), |x, y| {
            Self::own_share() * luminance_cd_m2.get(x, y) + self.at(Pixel { x, y })
        })
    }
}

fn mean_of_cell(plane: &Plane, cell: CellSize, column: usize, row: usize) -> f32 {
    let span = |index: usize, cell_px: usize, len: usize| index * cell_px..((index + 1) * cell_px).min(len);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in span(row, cell.height_px, plane.height()) {
        for &value in &plane.row(y)[span(column, cell.width_px, plane.width())] {
            if value.is_finite() {
                sum += f64::from(value.max(0.0));
                count += 1.0;
            }
        }
    }
    if count > 0.0 { (sum / count) as f32 } else { 0.0 }
}

/// What a cell covers of the view, in radians.
#[derive(Clone, Copy)]
struct CellAngle {
    width: f64,
    height: f64,
}

fn veil_at(foveal: &Plane, cell_rad: CellAngle, own_column: usize, own_row: usize) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for row in 0..foveal.height() {
        for (column, &value) in foveal.row(row).iter().enumerate() {
            let dx = (column as f64 - own_column as f64) * cell_rad.width;
            let dy = (row as f64 - own_row as f64) * cell_rad.height;
            let cosine = dx.hypot(dy).cos();
            let is_other = (column, row) != (own_column, own_row);
            if is_other && cosine > 0.0 {
                let weight = cosine / (2.0 * (1.0 - cosine));
                sum += weight * f64::from(value);
                weights += weight;
            }
        }
    }
    if weights > 0.0 { (SHARE * sum / weights) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_veils_its_neighbours_more_than_the_far_side() {
        let scene = Plane::from_fn(200, 100, |x, y| if x < 10 && y < 10 { 1e5 } else { 1.0 });
        let veil = Veil::of(&scene, PixelDensity::square(10.0)).unwrap();
        let (near, far) = (veil.at(Pixel { x: 25, y: 5 }), veil.at(Pixel { x: 190, y: 90 }));
        assert!(near > 20.0 * far && far > 0.0, "{near} {far}");
        // What reaches the retina in all is what left the scene, but for the borders.
        let veiled = veil.over(&scene);
        assert!((veiled.mean() / scene.mean() - 1.0).abs() < 0.1, "{} {}", veiled.mean(), scene.mean());
        assert!(Veil::of(&Plane::filled(200, 100, 5.0), PixelDensity::square(10.0)).is_none());
        assert!(Veil::of(&Plane::filled(0, 0, 5.0), PixelDensity::square(10.0)).is_none());
    }
    #[test]
    fn a_picture_squeezed_for_oblong_pixels_has_the_same_veil() {
        let lamp = |x: usize, y: usize| if x < 20 && y < 20 { 1e5 } else { 1.0 };
        let square = Veil::of(&Plane::from_fn(200, 100, lamp), PixelDensity::square(10.0)).unwrap();
        let squeezed = Plane::from_fn(100, 100, |x, y| lamp(2 * x, y));
        let oblong = Veil::of(&squeezed, PixelDensity { horizontal: 5.0, vertical: 10.0 }).unwrap();
        for (x, y) in [(15, 40), (40, 10), (90, 90)] {
            let (wide, narrow) = (square.at(Pixel { x: 2 * x, y }), oblong.at(Pixel { x, y }));
            assert!((narrow / wide - 1.0).abs() < 0.02, "{x} {y}: {narrow} {wide}");
        }
    }
}
