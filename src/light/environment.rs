//! Light from infinitely far away, importance sampled by its picture, less what BSDF sampling finds as well.
//!
//! MIS compensation (Karlík, Šik, Vévoda, Skřivan and Křivánek, "MIS Compensation", 2019): the density follows what
//! exceeds the mean radiance. Directions of density 0 are left to the BSDF, whose samples then have full weight. A
//! constant environment is not sampled at all.

use super::LightSample;
use super::distribution::{ChosenCell, Distribution1d, PlaceSample};
use crate::scene::Environment;
use glam::Vec3;

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

struct DirectionSample {
    direction: Vec3,
    /// Per steradian.
    pdf: f32,
}

impl EnvironmentSampler {
    /// A sampler of an environment; `None` for one that is black.
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
        let DirectionSample { direction, pdf } = self.cells.as_ref()?.sample(&self.environment, u)?;
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            place: None,
            radiance: self.radiance(direction),
            pdf,
            is_delta: false,
        })
    }

    /// Probability per steradian that a direction is sampled.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        self.cells.as_ref().map_or(0.0, |cells| cells.pdf(&self.environment, direction))
    }
}

/// The largest channel of what is seen around each texel, row-major: look-ups are bilinear, so each texel's weight
/// covers its neighbours too.
fn texel_weights(environment: &Environment) -> Vec<f64> {
    let (width, height) = (i64::from(environment.width), i64::from(environment.height));
    let brightness = |x: i64, y: i64| f64::from(environment.texels[environment.texel_index(x, y)].max_element());
    let in_row = |x: i64, y: i64| brightness(x - 1, y) + 2.0 * brightness(x, y) + brightness(x + 1, y);
    let weight = |x: i64, y: i64| (in_row(x, y - 1) + 2.0 * in_row(x, y) + in_row(x, y + 1)) / 16.0;
    (0..width * height).map(|i| weight(i % width, i / width)).collect()
}

impl Cells {
    /// `None` where no texel exceeds the mean by more than 1 % of it.
    fn new(environment: &Environment) -> Option<Self> {
        let (width, height) = (environment.width as usize, environment.height);
        let weights = texel_weights(environment);
        let solid_angles: Vec<f64> = (0..height).map(|row| row_solid_angle(environment, row) / width as f64).collect();
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

    fn sample(&self, environment: &Environment, u: [f32; 2]) -> Option<DirectionSample> {
        let ChosenCell { index: row, probability } = self.rows.choose(u[1]);
        let within = ((u[1] - self.rows.cumulative_before(row)) / probability).clamp(0.0, 1.0);
        let PlaceSample { place: along, density } = self.columns[row].as_ref()?.sample(u[0]);
        let row = row as u32;
        let local = environment.parametrisation.direction_in_row(row, environment.height, along, within);
        let pdf = probability * density / row_solid_angle(environment, row) as f32;
        Some(DirectionSample { direction: environment.from_world.transpose() * local, pdf })
    }

    /// Probability per steradian of a direction.
    fn pdf(&self, environment: &Environment, direction: Vec3) -> f32 {
        let uv = environment.parametrisation.to_uv(environment.from_world * direction);
        let row = ((uv.y * environment.height as f32) as u32).min(environment.height - 1);
        let Some(columns) = &self.columns[row as usize] else { return 0.0 };
        let column = ((uv.x * environment.width as f32) as usize).min(environment.width as usize - 1);
        let density = columns.probability(column) * environment.width as f32;
        self.rows.probability(row as usize) * density / row_solid_angle(environment, row) as f32
    }
}

fn row_solid_angle(environment: &Environment, row: u32) -> f64 {
    environment.parametrisation.row_solid_angle(row, environment.height)
}
