//! The path tracer: [`PathTracer::trace`] turns a [`SamplePlan`] into film.
//!
//! `path` holds the life of one sample, `camera` where it starts, `shading` what a surface point scatters like,
//! `tables` what materials compute beforehand,
//! `media` what a ray travels in.

mod camera;
mod media;
mod path;
mod shading;
mod tables;

pub use camera::CameraRays;
pub use path::{FirstHit, PathSample};

use crate::film::{BlockSum, Film};
use crate::geometry::World;
use crate::light::Lights;
use crate::sampler::{BlockKey, Half, PixelFilter, Purpose};
use crate::scene::Scene;
use glam::Vec2;
use rayon::prelude::*;
use std::sync::Arc;
use tables::SurfaceTables;

/// What does not change during a render.
#[derive(Clone, Copy, Debug)]
pub struct TraceSettings {
    /// Width of the full picture in pixels.
    pub width: u32,
    /// Height of the full picture in pixels.
    pub height: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// Most scattering events a path may have; Russian roulette ends nearly all long before.
    pub max_depth: u32,
    /// Reconstruction filter.
    pub filter: PixelFilter,
}

/// Scattering events that a path may have when nobody asks for fewer: with Russian roulette's survival of at most 0.98
/// after 8 bounces, one path in 5e8 gets there even in a closed white box.
pub const DEFAULT_MAX_DEPTH: u32 = 1_000;

/// One block of samples to be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockWork {
    /// Row-major index of the pixel.
    pub pixel: u32,
    /// For which half.
    pub half: Half,
    /// Which doubling.
    pub level: u8,
    /// How many of the block's samples: all of them, or the first few where a budget ends within the block.
    pub samples: u32,
}

impl BlockWork {
    /// The whole block: the pilot has [`PILOT_SAMPLES`], and each level doubles the total.
    pub fn whole(pixel: u32, half: Half, level: u8) -> Self {
        Self { pixel, half, level, samples: PILOT_SAMPLES << u32::from(level.saturating_sub(1)) }
    }
}

/// Samples of the pilot in each half.
pub const PILOT_SAMPLES: u32 = 8;

/// Samples that a half has after a level.
pub fn samples_through(level: u8) -> u64 {
    u64::from(PILOT_SAMPLES) << level
}

/// What to trace next. Plain data: deciding it and doing it are two things.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SamplePlan {
    /// Blocks by pixel, half and level.
    pub blocks: Vec<BlockWork>,
}

impl SamplePlan {
    /// Samples of all blocks together.
    pub fn samples(&self) -> u64 {
        self.blocks.iter().map(|b| u64::from(b.samples)).sum()
    }
}

/// A scene made ready for tracing.
pub struct PathTracer {
    world: World,
    lights: Lights,
    camera: CameraRays,
    settings: TraceSettings,
    /// Whether any volume absorbs, so that paths must know what they are in.
    absorbs: bool,
    /// By material.
    surface_tables: Vec<SurfaceTables>,
}

impl PathTracer {
    /// Builds trees and light tables.
    pub fn new(scene: Arc<Scene>, settings: TraceSettings) -> Self {
        let camera = CameraRays::new(&scene.camera, settings.width, settings.height);
        let absorbs = scene.materials.iter().any(|material| {
            material.surface.interior_absorption().is_some_and(|absorption| absorption.max_element() > 0.0)
        });
        let surface_tables = tables::of_materials(&scene.materials);
        let world = World::new(scene);
        let lights = Lights::new(&world);
        Self { world, lights, camera, settings, absorbs, surface_tables }
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &TraceSettings {
        &self.settings
    }

    /// The scene's geometry.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Takes the samples of a plan into the film, in parallel, with the same result for any number of threads: each
    /// block is summed by one thread, and blocks are merged in the plan's order.
    pub fn trace(&self, plan: &SamplePlan, film: &mut Film, progress: &(dyn Fn(u64) + Sync)) {
        // Batches bound the memory of unmerged blocks; chunks of near equal work keep both ends of a batch busy.
        const BLOCKS_PER_BATCH: usize = 1 << 16;
        const SAMPLES_PER_CHUNK: u64 = 2_048;
        for batch in plan.blocks.chunks(BLOCKS_PER_BATCH) {
            let mut chunks = Vec::new();
            let (mut start, mut samples) = (0, 0);
            for (i, block) in batch.iter().enumerate() {
                samples += u64::from(block.samples);
                if samples >= SAMPLES_PER_CHUNK || i + 1 == batch.len() {
                    chunks.push(&batch[start..=i]);
                    (start, samples) = (i + 1, 0);
                }
            }
            let sums: Vec<Vec<BlockSum>> = chunks
                .par_iter()
                .with_max_len(1)
                .map(|chunk| {
                    let sums = chunk.iter().map(|&block| self.trace_block(block)).collect();
                    progress(chunk.iter().map(|b| u64::from(b.samples)).sum());
                    sums
                })
                .collect();
            for (block, sum) in batch.iter().zip(sums.iter().flatten()) {
                film.merge_block(*block, sum);
            }
        }
    }

    /// Sums one block of one pixel.
    fn trace_block(&self, block: BlockWork) -> BlockSum {
        let key = BlockKey { seed: self.settings.seed, pixel: block.pixel, half: block.half, level: block.level };
        let pixel = Vec2::new(
            (block.pixel % self.settings.width) as f32 + 0.5,
            (block.pixel / self.settings.width) as f32 + 0.5,
        );
        let mut sum = BlockSum::default();
        for sample in key.samples(block.samples) {
            let [x, y, lens_u, lens_v] = sample.draw(Purpose::Camera);
            let ray = self.camera.ray(pixel + self.settings.filter.sample(x, y), [lens_u, lens_v]);
            sum.add(&self.trace_path(ray, sample));
        }
        sum
    }
}
