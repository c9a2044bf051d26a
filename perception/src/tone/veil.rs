//! Glare: light that bright places scatter over the whole retina.
//!
//! As `pcond` has it after Ward Larson, Rushmeier and Piatko 1997, for what is shown of glare. Not for thresholds,
//! whose glare is [`crate::glare`], nor for detail within a cell of 1°.

use serde::{Deserialize, Serialize};

use super::field::FrozenPlane;
use super::guide::Pixel;
use crate::display::PixelDensity;
use crate::plane::Plane;
use crate::table::Between;

/// Share of what a place on the retina gets that comes from elsewhere in view (`pcond` of Radiance; Ward Larson,
/// Rushmeier and Piatko 1997).
const SHARE: f64 = 0.08;
/// Least range of the picture, in natural logarithms, from which a veil is worth making (`pcond`).
const MIN_RANGE: f64 = 4.5;
/// More cells than this would make the sum over all pairs slow; they then grow beyond 1°.
const MAX_CELLS: usize = 2500;

/// A smooth veil of achromatic light over a picture, frozen.
///
/// It mixes pixels only over degrees, so a pixel's noise passes it as (1 − 0.08) of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Veil {
    cell: CellSize,
    /// Veil in the middle of each cell, cd/m², already times the share.
    cells_cd_m2: FrozenPlane,
    mean_cd_m2: f32,
}

/// Size of a cell: all of a picture have one, which need not be whole pixels, since a last column of what the others
/// leave would weigh as much as they do. Measured with such a column, 130 pixels wide: a lamp of 5 pixels at the right
/// border lights what is 20 pixels away 2.5 times as much as one at the left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct CellSize {
    width_px: f64,
    height_px: f64,
}

/// Columns and rows of cells.
#[derive(Clone, Copy, Debug)]
struct CellCount {
    columns: usize,
    rows: usize,
}

impl CellCount {
    /// As many as it takes for cells of at most one degree, or of as many as keep a picture below [`MAX_CELLS`].
    fn of(width: usize, height: usize, density: PixelDensity) -> Self {
        let pixels = |pixels_per_degree: f64| (pixels_per_degree.round() as usize).max(1);
        let (mut width_px, mut height_px) = (pixels(density.horizontal), pixels(density.vertical));
        while width.div_ceil(width_px) * height.div_ceil(height_px) > MAX_CELLS {
            (width_px, height_px) = (2 * width_px, 2 * height_px);
        }
        Self { columns: width.div_ceil(width_px), rows: height.div_ceil(height_px) }
    }
}

impl Veil {
    /// The veil of a picture; `None` where its range is too small to make one.
    ///
    /// The picture's 1° cells (its foveal image) are weighted by Moon and Spencer's cos t / t² for the angle t
    /// between them, written as cos t / (2 (1 − cos t)).
    pub(super) fn of(luminance_cd_m2: &Plane, density: PixelDensity) -> Option<Self> {
        let (width, height) = (luminance_cd_m2.width(), luminance_cd_m2.height());
        let CellCount { columns, rows } = CellCount::of(width, height, density);
        let cell = CellSize { width_px: width as f64 / columns as f64, height_px: height as f64 / rows as f64 };
        let foveal = Plane::from_fn(columns, rows, |column, row| mean_of_cell(luminance_cd_m2, cell, column, row));
        let (least, greatest) =
            foveal.values().iter().fold((f64::INFINITY, 0.0), |(least, greatest): (f64, f64), &value| {
                (least.min(f64::from(value).max(1e-4)), greatest.max(f64::from(value)))
            });
        if foveal.values().len() < 2 || (greatest / least).ln() < MIN_RANGE {
            return None;
        }
        let cell_rad = CellAngle {
            width: (cell.width_px / density.horizontal).to_radians(),
            height: (cell.height_px / density.vertical).to_radians(),
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
        let is_inside = |index: usize, cell_px: f64, count: usize| index as f64 + 0.5 < count as f64 * cell_px;
        if !is_inside(pixel.x, width_px, columns) || !is_inside(pixel.y, height_px, rows) {
            return self.mean_cd_m2;
        }
        let place = |index: usize, cell_px: f64, count: usize| Between::of((index as f64 + 0.5) / cell_px - 0.5, count);
        place(pixel.x, width_px, columns).bilinear(place(pixel.y, height_px, rows), |x, y| {
            self.cells_cd_m2.at(Pixel { x, y }).map_or(self.mean_cd_m2, |light| light as f32)
        })
    }

    /// The picture as it falls on the retina.
    pub(super) fn over(&self, luminance_cd_m2: &Plane) -> Plane {
        Plane::from_fn(luminance_cd_m2.width(), luminance_cd_m2.height(), |x, y| {
            Self::own_share() * luminance_cd_m2.get(x, y) + self.at(Pixel { x, y })
        })
    }
}

/// Pixels count by how much of them lies in the cell.
fn mean_of_cell(plane: &Plane, cell: CellSize, column: usize, row: usize) -> f32 {
    let shares = |index: usize, cell_px: f64, len: usize| {
        let (from, to) = (index as f64 * cell_px, (index + 1) as f64 * cell_px);
        (from as usize..(to.ceil() as usize).min(len))
            .map(move |pixel| (pixel, to.min((pixel + 1) as f64) - from.max(pixel as f64)))
    };
    let (mut sum, mut weights) = (0.0, 0.0);
    for (y, share_y) in shares(row, cell.height_px, plane.height()) {
        for (x, share_x) in shares(column, cell.width_px, plane.width()) {
            let value = plane.get(x, y);
            if value.is_finite() {
                sum += share_x * share_y * f64::from(value.max(0.0));
                weights += share_x * share_y;
            }
        }
    }
    if weights > 0.0 { (sum / weights) as f32 } else { 0.0 }
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

    /// Whatever is left over when a picture is cut into degrees: a lamp veils as much at its right and lower borders
    /// as at the left and upper ones.
    #[test]
    fn a_mirrored_picture_has_the_mirrored_veil() {
        const WIDTH: usize = 130;
        const HEIGHT: usize = 77;
        let lamp = |x: usize, y: usize| if x < 5 && y < 30 { 1e5 } else { 1.0 };
        let of = |scene| Veil::of(&scene, PixelDensity::square(60.0)).unwrap();
        let veil = of(Plane::from_fn(WIDTH, HEIGHT, lamp));
        let across = of(Plane::from_fn(WIDTH, HEIGHT, |x, y| lamp(WIDTH - 1 - x, y)));
        let down = of(Plane::from_fn(WIDTH, HEIGHT, |x, y| lamp(x, HEIGHT - 1 - y)));
        for (x, y) in [(2, 2), (40, 10), (65, 38), (127, 74), (129, 0)] {
            let here = veil.at(Pixel { x, y });
            for there in [across.at(Pixel { x: WIDTH - 1 - x, y }), down.at(Pixel { x, y: HEIGHT - 1 - y })] {
                assert!((there / here - 1.0).abs() < 1e-4, "({x}, {y}): {here}, mirrored {there}");
            }
        }
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
