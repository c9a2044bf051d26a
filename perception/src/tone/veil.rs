//! Glare: light that bright places scatter over the whole retina.

use serde::{Deserialize, Serialize};

use super::guide::Pixel;
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
    cell_px: usize,
    columns: usize,
    rows: usize,
    /// Already times the share, cd/m².
    cells_cd_m2: Vec<f32>,
    mean_cd_m2: f32,
}

impl Veil {
    /// The veil of a picture; `None` where its range is too small to make one.
    ///
    /// The picture's 1° cells (its foveal image) are weighted by Moon and Spencer's cos t / t² for the angle t between them,
    /// written as cos t / (2 (1 − cos t)).
    pub(super) fn of(luminance_cd_m2: &Plane, pixels_per_degree: f64) -> Option<Self> {
        let (width, height) = (luminance_cd_m2.width(), luminance_cd_m2.height());
        let mut cell_px = (pixels_per_degree.round() as usize).max(1);
        while width.div_ceil(cell_px) * height.div_ceil(cell_px) > MOST_CELLS {
            cell_px *= 2;
        }
        let (columns, rows) = (width.div_ceil(cell_px), height.div_ceil(cell_px));
        let foveal = cell_means(luminance_cd_m2, cell_px, columns, rows);
        let (least, greatest) = foveal.iter().fold((f64::INFINITY, 0.0), |(least, greatest): (f64, f64), &value| {
            (least.min(value.max(1e-4)), greatest.max(value))
        });
        if foveal.len() < 2 || (greatest / least).ln() < LEAST_RANGE {
            return None;
        }
        let cell_rad = (cell_px as f64 / pixels_per_degree).to_radians();
        let cells_cd_m2: Vec<f32> = (0..foveal.len()).map(|cell| veil_at(cell, &foveal, columns, cell_rad)).collect();
        let mean_cd_m2 = cells_cd_m2.iter().sum::<f32>() / cells_cd_m2.len() as f32;
        Some(Self { cell_px, columns, rows, cells_cd_m2, mean_cd_m2 })
    }

    /// Share of a pixel's own light that is left.
    pub(super) const fn own_share() -> f32 {
        (1.0 - SHARE) as f32
    }

    /// Light of the veil at a pixel, cd/m², between the cells' centres; its mean outside.
    pub(super) fn at(&self, pixel: Pixel) -> f32 {
        if pixel.x >= self.columns * self.cell_px || pixel.y >= self.rows * self.cell_px {
            return self.mean_cd_m2;
        }
        let place = |index: usize, count: usize| {
            let at = ((index as f32 + 0.5) / self.cell_px as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            (at as usize, (at as usize + 1).min(count - 1), at.fract())
        };
        let (left, right, x) = place(pixel.x, self.columns);
        let (top, bottom, y) = place(pixel.y, self.rows);
        let cell = |column: usize, row: usize| self.cells_cd_m2[row * self.columns + column];
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

fn cell_means(plane: &Plane, cell_px: usize, columns: usize, rows: usize) -> Vec<f64> {
    let mut means = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let (mut sum, mut count) = (0.0, 0.0);
            for y in row * cell_px..((row + 1) * cell_px).min(plane.height()) {
                for &value in &plane.row(y)[column * cell_px..((column + 1) * cell_px).min(plane.width())] {
                    if value.is_finite() {
                        sum += f64::from(value.max(0.0));
                        count += 1.0;
                    }
                }
            }
            means.push(if count > 0.0 { sum / count } else { 0.0 });
        }
    }
    means
}

fn veil_at(cell: usize, foveal: &[f64], columns: usize, cell_rad: f64) -> f32 {
    let (own_x, own_y) = ((cell % columns) as f64, (cell / columns) as f64);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (other, value) in foveal.iter().enumerate().filter(|(other, _)| *other != cell) {
        let (dx, dy) = ((other % columns) as f64 - own_x, (other / columns) as f64 - own_y);
        let cosine = (dx.hypot(dy) * cell_rad).cos();
        if cosine > 0.0 {
            let weight = cosine / (2.0 * (1.0 - cosine));
            sum += weight * value;
            weights += weight;
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
        let veil = Veil::of(&scene, 10.0).unwrap();
        let (near, far) = (veil.at(Pixel { x: 25, y: 5 }), veil.at(Pixel { x: 190, y: 90 }));
        assert!(near > 20.0 * far && far > 0.0, "{near} {far}");
        // What reaches the retina in all is what left the scene, but for the borders.
        let veiled = veil.over(&scene);
        assert!((veiled.mean() / scene.mean() - 1.0).abs() < 0.1, "{} {}", veiled.mean(), scene.mean());
        assert!(Veil::of(&Plane::filled(200, 100, 5.0), 10.0).is_none());
        assert!(Veil::of(&Plane::filled(0, 0, 5.0), 10.0).is_none());
    }
}
