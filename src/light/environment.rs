//! Light from infinitely far away, importance sampled by the luminance of a lat-long picture.

use super::LightSample;
use super::distribution::Distribution1d;
use crate::scene::Environment;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

#[derive(Debug)]
pub(super) struct EnvironmentSampler {
    environment: Environment,
    rows: Distribution1d,
    columns: Vec<Option<Distribution1d>>,
}

impl EnvironmentSampler {
    /// `None` for one that is black.
    pub(super) fn new(environment: &Environment) -> Option<Self> {
        let (width, height) = (environment.width as usize, environment.height as usize);
        let brightness = |x: usize, y: usize| f64::from(environment.texels[y * width + x].max_element());
        // Look-ups are bilinear, so each cell's weight covers its neighbours too: no radiance has probability 0.
        let weight = |x: usize, y: usize| {
            let mut sum = 0.0;
            for (ny, wy) in [(y.saturating_sub(1), 1.0), (y, 2.0), ((y + 1).min(height - 1), 1.0)] {
                for (nx, wx) in [((x + width - 1) % width, 1.0), (x, 2.0), ((x + 1) % width, 1.0)] {
                    sum += wx * wy * brightness(nx, ny);
                }
            }
            sum
        };
        let mut row_weights = Vec::with_capacity(height);
        let mut columns = Vec::with_capacity(height);
        for y in 0..height {
            let weights: Vec<f64> = (0..width).map(|x| weight(x, y)).collect();
            // Solid angle of the row's cells.
            let (top, bottom) = (PI * y as f32 / height as f32, PI * (y + 1) as f32 / height as f32);
            row_weights.push(weights.iter().sum::<f64>() * f64::from(top.cos() - bottom.cos()));
            columns.push(Distribution1d::new(&weights));
        }
        let rows = Distribution1d::new(&row_weights)?;
        (environment.scale > 0.0).then(|| Self { environment: environment.clone(), rows, columns })
    }

    /// Radiance from a world direction.
    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        let e = &self.environment;
        let uv = to_uv(e.from_world * direction);
        let (width, height) = (e.width as usize, e.height as usize);
        let (x, y) = (uv.x * width as f32 - 0.5, uv.y * height as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |offset: i64| (x.floor() as i64 + offset).rem_euclid(width as i64) as usize;
        let row = |offset: i64| (y.floor() as i64 + offset).clamp(0, height as i64 - 1) as usize;
        let texel = |dx, dy| e.texels[row(dy) * width + column(dx)];
        let top = texel(0, 0).lerp(texel(1, 0), fx);
        let bottom = texel(0, 1).lerp(texel(1, 1), fx);
        top.lerp(bottom, fy) * e.scale
    }

    pub(super) fn sample(&self, u: [f32; 2]) -> Option<LightSample> {
        // Rows are chosen by solid angle and sampled uniformly in it within the row.
        let (row, probability) = self.rows.sample_discrete(u[1]);
        let height = self.environment.height as f32;
        let before: f32 = self.rows.cumulative_before(row);
        let within = ((u[1] - before) / probability).clamp(0.0, 1.0);
        let (cos_top, cos_bottom) = row_cosines(row, height);
        let cos_theta = (cos_top + (cos_bottom - cos_top) * within).clamp(-1.0, 1.0);
        let (s, density) = self.columns[row].as_ref()?.sample_continuous(u[0]);
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin_phi, cos_phi) = ((s - 0.5) * TAU).sin_cos();
        let local = Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi);
        let direction = self.environment.from_world.transpose() * local;
        let pdf = probability * density / (TAU * (cos_top - cos_bottom));
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            place: None,
            radiance: self.radiance(direction),
            pdf,
            is_delta: false,
        })
    }

    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let uv = to_uv(self.environment.from_world * direction);
        let height = self.environment.height as usize;
        let row = ((uv.y * height as f32) as usize).min(height - 1);
        let Some(columns) = &self.columns[row] else { return 0.0 };
        let width = self.environment.width as usize;
        let column = ((uv.x * width as f32) as usize).min(width - 1);
        let (cos_top, cos_bottom) = row_cosines(row, height as f32);
        self.rows.probability(row) * columns.probability(column) * width as f32 / (TAU * (cos_top - cos_bottom))
    }
}

fn row_cosines(row: usize, height: f32) -> (f32, f32) {
    ((PI * row as f32 / height).cos(), (PI * (row + 1) as f32 / height).cos())
}

/// Picture coordinates of a direction: v = 0 is +y, u = 0.5 is −z, u grows towards +x.
fn to_uv(direction: Vec3) -> Vec2 {
    Vec2::new(0.5 + direction.x.atan2(-direction.z) / TAU, direction.y.clamp(-1.0, 1.0).acos() / PI)
}
