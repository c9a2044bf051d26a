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
                let cosine = |row: f32| (PI * row / height).cos();
                let (top, bottom) = (cosine(row as f32), cosine(row as f32 + 1.0));
                let cos_theta = (top + (bottom - top) * within).clamp(-1.0, 1.0);
                let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
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
