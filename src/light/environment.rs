//! Light from infinitely far away, importance sampled by its picture, less what BSDF sampling finds as well.
//!
//! MIS compensation (Karlík, Šik, Vévoda, Skřivan and Křivánek, "MIS Compensation", 2019): the density follows what
//! exceeds the mean radiance. Directions of density 0 are left to the BSDF, whose samples then have full weight. A
//! constant environment is not sampled at all.

use super::LightSample;
use super::distribution::Distribution1d;
use crate::scene::{Environment, Parametrisation};
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

#[derive(Debug)]
pub(super) struct EnvironmentSampler {
    environment: Environment,
    /// `None` where the BSDF finds everything as well.
    cells: Option<Cells>,
}

/// Distribution over the picture's texels.
#[derive(Debug)]
struct Cells {
    rows: Distribution1d,
    columns: Vec<Option<Distribution1d>>,
}

impl EnvironmentSampler {
    /// `None` for one that is black.
    pub(super) fn new(environment: &Environment) -> Option<Self> {
        let lit = environment.scale > 0.0 && environment.texels.iter().any(|texel| texel.max_element() > 0.0);
        lit.then(|| Self { environment: environment.clone(), cells: Cells::new(environment) })
    }

    /// Radiance from a world direction.
    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.radiance(direction)
    }

    /// Whether there is anything to sample.
    pub(super) fn is_sampled(&self) -> bool {
        self.cells.is_some()
    }

    pub(super) fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        let cells = self.cells.as_ref()?;
        let (row, probability) = cells.rows.sample_discrete(u[1]);
        let within = ((u[1] - cells.rows.cumulative_before(row)) / probability).clamp(0.0, 1.0);
        let (s, density) = cells.columns[row].as_ref()?.sample_continuous(u[0]);
        let local = self.in_row(row, s, within);
        let direction = self.environment.from_world.transpose() * local;
        let pdf = probability * density / self.environment.row_solid_angle(row as u32) as f32;
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            place: None,
            radiance: self.radiance(direction),
            pdf,
            is_delta: false,
        })
    }

    /// A direction in a row of texels, uniform in solid angle for `s` along the row and `within` across it.
    fn in_row(&self, row: usize, s: f32, within: f32) -> Vec3 {
        let height = self.environment.height as f32;
        match self.environment.parametrisation {
            Parametrisation::EqualArea => {
                self.environment.parametrisation.to_direction(Vec2::new(s, (row as f32 + within) / height))
            }
            Parametrisation::LatLong => {
                // 1 − cos of the angle from the nearer pole, which keeps its digits there.
                let (pole, to_top, to_bottom) = match row as f32 {
                    row if 2.0 * row < height => (1.0, row, row + 1.0),
                    row => (-1.0, height - row, height - row - 1.0),
                };
                let versine = |rows: f32| 2.0 * (0.5 * PI * rows / height).sin().powi(2);
                let (top, bottom) = (versine(to_top), versine(to_bottom));
                let versine = top + (bottom - top) * within;
                let (sin_theta, cos_theta) = ((versine * (2.0 - versine)).max(0.0).sqrt(), pole * (1.0 - versine));
                let (sin_phi, cos_phi) = ((s - 0.5) * TAU).sin_cos();
                Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
            }
        }
    }

    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let Some(cells) = &self.cells else { return 0.0 };
        let e = &self.environment;
        let uv = e.parametrisation.to_uv(e.from_world * direction);
        let row = ((uv.y * e.height as f32) as usize).min(e.height as usize - 1);
        let Some(columns) = &cells.columns[row] else { return 0.0 };
        let column = ((uv.x * e.width as f32) as usize).min(e.width as usize - 1);
        let density = columns.probability(column) * e.width as f32;
        cells.rows.probability(row) * density / e.row_solid_angle(row as u32) as f32
    }
}

impl Cells {
    /// `None` where no texel exceeds the mean by more than 1 % of it.
    fn new(environment: &Environment) -> Option<Self> {
        let (width, height) = (environment.width as usize, environment.height as usize);
        // Look-ups are bilinear, so each cell's weight covers its neighbours too.
        let brightness = |x: i64, y: i64| f64::from(environment.texels[environment.texel_index(x, y)].max_element());
        let weight = |x: usize, y: usize| {
            let (x, y) = (x as i64, y as i64);
            let row = |y: i64| brightness(x - 1, y) + 2.0 * brightness(x, y) + brightness(x + 1, y);
            (row(y - 1) + 2.0 * row(y) + row(y + 1)) / 16.0
        };
        let weights: Vec<f64> = (0..width * height).map(|i| weight(i % width, i / width)).collect();
        let solid_angles: Vec<f64> =
            (0..height).map(|row| environment.row_solid_angle(row as u32) / width as f64).collect();
        let mean = weights.iter().enumerate().map(|(i, w)| w * solid_angles[i / width]).sum::<f64>()
            / (2.0 * std::f64::consts::TAU);
        let excess: Vec<f64> = weights.iter().map(|w| if *w > 1.01 * mean { w - mean } else { 0.0 }).collect();
        let row_weights: Vec<f64> = excess
            .chunks_exact(width)
            .zip(&solid_angles)
            .map(|(row, solid_angle)| row.iter().sum::<f64>() * solid_angle)
            .collect();
        Some(Self {
            rows: Distribution1d::new(&row_weights)?,
            columns: excess.chunks_exact(width).map(Distribution1d::new).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where rows are narrow, too, at the poles of a picture of 4096×2048: what is drawn from a row is found in it, evenly.
    #[test]
    fn samples_of_a_row_lie_in_it() {
        let height = 2048;
        let black =
            Environment { texels: Environment::constant(Vec3::ZERO).texels, ..Environment::constant(Vec3::ONE) };
        let environment = Environment { width: 1, height, ..black };
        let sampler = EnvironmentSampler { environment, cells: None };
        for row in [0, 1, 2, 700, 1023, 1024, 2045, 2046, 2047] {
            let solid_angle = sampler.environment.row_solid_angle(row);
            for step in 0..64 {
                let within = (step as f32 + 0.5) / 64.0;
                let direction = sampler.in_row(row as usize, 0.3, within);
                assert!((direction.length() - 1.0).abs() < 1e-6);
                let v = sampler.environment.parametrisation.to_uv(direction).y * height as f32;
                assert_eq!(v as u32, row, "{v} of row {row}");
                // The solid angle of the part of the row that lies above.
                let angle = |rows: f64| (std::f64::consts::PI * rows / f64::from(height)).cos();
                let above = 2.0 * std::f64::consts::PI * (angle(f64::from(row)) - angle(f64::from(v)));
                assert!((above / solid_angle - f64::from(within)).abs() < 2e-3, "{above} of {solid_angle} at {within}");
            }
        }
    }
}
