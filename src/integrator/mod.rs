//! The path tracer: [`PathTracer::trace`] turns a [`SamplePlan`] into film.
//!
//! `path` holds the life of one sample, `path_packet` how several are followed at once, `camera` where they start,
//! `around_camera` in which volumes, `shading` what a surface point scatters like, `relief` how maps turn its normal,
//! `tables` what materials compute beforehand, `media` what a ray travels in, `light_probes` what light comes where,
//! `prune` which light is left to chance, `thin_sheets` what clear panes let through, `specular` what mirrors and
//! glass show, `small_things` what samples may pass by.

mod around_camera;
mod camera;
mod frames;
mod light_probes;
mod media;
mod path;
mod path_packet;
mod prune;
mod relief;
mod shading;
mod small_things;
mod specular;
mod tables;
mod thin_sheets;

pub use camera::{CameraRays, CameraSample};
pub use path::{FirstHit, PathSample};
pub use prune::Pruning;
pub use specular::{SpecularEvent, SpecularPath, SpecularVertex};

use crate::film::{BlockSum, Film};
use crate::geometry::World;
use crate::light::Lights;
use crate::sampler::{Half, PixelFilter, Sequence};
use crate::scene::{Camera, Scene};
use around_camera::AroundCamera;
use glam::{Vec2, Vec3};
use media::Media;
use prune::ThresholdTable;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tables::SurfaceTables;

/// What does not change during a render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Largest channel of a sample, scene units: brighter samples are scaled down to it, which darkens the picture
    /// where light is rare. `None` leaves the estimate unbiased.
    pub clamp: Option<f32>,
    /// How the samples of neighbouring pixels relate.
    pub sequence: Sequence,
    /// The part of the picture that is traced; `None` is all of it. Its samples are those of the whole picture.
    pub crop: Option<Crop>,
    /// Whether camera rays that meet nothing see nothing, so that the picture can be laid over another. Light from afar
    /// still falls on surfaces, and is seen in and through them.
    pub transparent: bool,
    /// Light too faint to be seen is left to chance. `None` traces all of it.
    pub prune: Option<Pruning>,
}

/// A rectangle of the picture in pixels, inside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Crop {
    /// How many it holds.
    pub(crate) fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

impl TraceSettings {
    /// The whole picture as it is traced by default.
    pub fn new(width: u32, height: u32, seed: u64) -> Self {
        Self {
            width,
            height,
            seed,
            max_depth: DEFAULT_MAX_DEPTH,
            filter: PixelFilter::default(),
            clamp: None,
            sequence: Sequence::PerPixel,
            crop: None,
            transparent: false,
            prune: None,
        }
    }

    /// The part of the picture that is traced, and that the film holds.
    pub fn film_area(&self) -> Crop {
        self.crop.unwrap_or(Crop { x: 0, y: 0, width: self.width, height: self.height })
    }

    /// A sample's radiance, or as much of it as [`Self::clamp`] allows.
    pub(crate) fn clamped(&self, radiance: Vec3) -> Vec3 {
        let Some(clamp) = self.clamp.filter(|_| !radiance.is_nan()) else { return radiance };
        // What is infinite has no ratios of channels: as bright as may be.
        let finite = radiance.min(Vec3::splat(f32::MAX));
        finite * (clamp / finite.max_element().max(clamp)).min(1.0)
    }
}

/// Scattering events that a path may have when nobody asks for fewer: with Russian roulette's survival of at most 0.98
/// after 8 bounces, one path in 5e8 gets there even in a closed white box.
pub const DEFAULT_MAX_DEPTH: u32 = 1_000;

/// One block of samples to be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockWork {
    /// Row-major index of the pixel on the film.
    pub pixel: u32,
    /// For which half.
    pub half: Half,
    /// Which doubling.
    pub level: u8,
    /// Index in the doubling of the first sample.
    pub first: u32,
    /// How many samples: all of the doubling's, or a part where a budget ends or a rule looks within it.
    pub samples: u32,
}

impl BlockWork {
    /// The whole block: the pilot has [`PILOT_SAMPLES_PER_HALF`], and each level doubles the total.
    pub fn whole(pixel: u32, half: Half, level: u8) -> Self {
        Self { pixel, half, level, first: 0, samples: 1 << log2_block(level) }
    }

    /// Whether it is a part of a doubling of a pixel of a film of so many.
    pub fn is_sound(&self, pixels: u32) -> bool {
        self.pixel < pixels
            && self.level <= HIGHEST_LEVEL
            && u64::from(self.first) + u64::from(self.samples) <= 1 << log2_block(self.level)
    }

    /// What is left of the doubling that a half is in after `taken` samples.
    pub fn rest(pixel: u32, half: Half, taken: u32) -> Self {
        let level = if taken < PILOT_SAMPLES_PER_HALF { 0 } else { 1 + (taken / PILOT_SAMPLES_PER_HALF).ilog2() as u8 };
        let whole = Self::whole(pixel, half, level);
        let first = if level == 0 { taken } else { taken - whole.samples };
        Self { first, samples: whole.samples - first, ..whole }
    }
}

/// Samples of the pilot in each half.
pub const PILOT_SAMPLES_PER_HALF: u32 = 8;

/// Samples of the pilot in both.
pub const PILOT_SAMPLES_PER_PIXEL: u32 = 2 * PILOT_SAMPLES_PER_HALF;

/// The last level of which a sample's number fits 32 bits: its block ends at 2³⁰ samples of the half.
const HIGHEST_LEVEL: u8 = 27;

/// log₂ of the samples of a level's whole block.
fn log2_block(level: u8) -> u8 {
    PILOT_SAMPLES_PER_HALF.ilog2() as u8 + level.saturating_sub(1)
}

/// What to trace next. Plain data: deciding it and doing it are two things.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SamplePlan {
    /// Blocks by pixel, half and level.
    pub blocks: Vec<BlockWork>,
}

impl SamplePlan {
    /// Samples of all blocks together.
    pub fn samples(&self) -> u64 {
        self.blocks.iter().map(|b| u64::from(b.samples)).sum()
    }

    /// Itself, unless there is nothing to trace.
    pub(crate) fn non_empty(self) -> Option<Self> {
        if self.blocks.is_empty() { None } else { Some(self) }
    }
}

/// A scene made ready for tracing.
pub struct PathTracer {
    world: World,
    lights: Lights,
    camera: CameraRays,
    /// Whether anything moves while the shutter is open.
    moves: bool,
    settings: TraceSettings,
    /// Whether any volume absorbs, so that paths must know what they are in.
    absorbs: bool,
    /// The volumes that camera rays begin in; none where none absorbs.
    around_camera: AroundCamera,
    /// Whether any material may be a clear sheet, through which shadow rays go on.
    has_sheets: bool,
    /// By material.
    surface_tables: Vec<SurfaceTables>,
    /// Where light is left to chance.
    thresholds: Option<ThresholdTable>,
}

impl PathTracer {
    /// Builds trees and light tables.
    pub fn new(scene: Arc<Scene>, settings: TraceSettings) -> Self {
        let camera = CameraRays::new(&scene.camera, settings.width, settings.height);
        let absorbs = scene.materials.iter().any(|material| {
            material.surface.interior_absorption().is_some_and(|absorption| absorption.max_element() > 0.0)
        });
        let has_sheets = thin_sheets::any_of(&scene.materials);
        let surface_tables = tables::of_materials(&scene.materials);
        let thresholds = settings.prune.map(ThresholdTable::new);
        let moves = scene.moves();
        let world = World::new(scene);
        let lights = Lights::new(&world);
        let around_camera = AroundCamera::Everywhere(Media::default());
        let mut tracer = Self {
            world,
            lights,
            camera,
            moves,
            settings,
            absorbs,
            around_camera,
            has_sheets,
            surface_tables,
            thresholds,
        };
        tracer.look_around();
        tracer.choose_lights_by_arrival();
        tracer
    }

    /// Asks what the camera is in.
    fn look_around(&mut self) {
        if self.absorbs {
            let size_px = Vec2::new(self.settings.width as f32, self.settings.height as f32);
            self.around_camera = AroundCamera::of(&self.world, &self.camera, size_px, self.moves);
        }
    }

    /// Looks from elsewhere at the same scene. The scene that it was made from keeps its own camera.
    pub fn set_camera(&mut self, camera: &Camera) {
        self.camera = CameraRays::new(camera, self.settings.width, self.settings.height);
        self.moves |= camera.motion.is_some();
        self.look_around();
        self.choose_lights_by_arrival();
    }

    /// The same by other settings, such as for a picture of another size.
    pub fn set_view(&mut self, camera: &Camera, settings: TraceSettings) {
        self.thresholds = settings.prune.map(ThresholdTable::new);
        self.settings = settings;
        self.set_camera(camera);
    }

    /// The settings it works by.
    pub fn settings(&self) -> &TraceSettings {
        &self.settings
    }

    /// The scene's geometry.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Takes the samples of a plan into the film, in parallel, with the same result for any number of threads.
    pub fn trace(&self, plan: &SamplePlan, film: &mut Film, progress: &(dyn Fn(u64) + Sync)) {
        self.trace_into(plan, self.settings.seed, &mut |work, sum| film.merge_block(work, sum), progress);
    }

    /// Takes the samples of the first blocks into the film, as many as make one batch, and says how many blocks that
    /// was: at least one, unless there is none. Batches leave the caller a moment to look around; the film does not
    /// depend on where they end.
    pub fn trace_batch(&self, blocks: &[BlockWork], film: &mut Film, progress: &(dyn Fn(u64) + Sync)) -> usize {
        self.batch_into(blocks, self.settings.seed, &mut |work, sum| film.merge_block(work, sum), progress)
    }

    /// As [`Self::trace_batch`], with the sums of the blocks behind one another in place of a film.
    pub fn sum_batch(&self, blocks: &[BlockWork], sums: &mut Vec<BlockSum>, progress: &(dyn Fn(u64) + Sync)) -> usize {
        self.batch_into(blocks, self.settings.seed, &mut |_, sum| sums.push(*sum), progress)
    }

    /// Hands the sums of a plan's blocks, sampled by `seed`, to `merge`: each block is summed by one thread, and blocks
    /// come in the plan's order.
    pub fn trace_into(
        &self,
        plan: &SamplePlan,
        seed: u64,
        merge: &mut dyn FnMut(BlockWork, &BlockSum),
        progress: &(dyn Fn(u64) + Sync),
    ) {
        let mut blocks = plan.blocks.as_slice();
        while !blocks.is_empty() {
            blocks = &blocks[self.batch_into(blocks, seed, merge, progress)..];
        }
    }

    /// Traces the first batch of `blocks`. Its bounds keep the memory of unmerged blocks and the time without a pause
    /// small (about a second), and yet leave every thread so many chunks that few idle at its end.
    fn batch_into(
        &self,
        blocks: &[BlockWork],
        seed: u64,
        merge: &mut dyn FnMut(BlockWork, &BlockSum),
        progress: &(dyn Fn(u64) + Sync),
    ) -> usize {
        const BLOCKS_PER_BATCH: usize = 1 << 16;
        const CHUNKS_PER_THREAD: usize = 64;
        const SAMPLES_PER_THREAD: u64 = 1 << 19;
        let threads = rayon::current_num_threads();
        let samples_per_chunk =
            samples_per_chunk(&blocks[..blocks.len().min(BLOCKS_PER_BATCH)], CHUNKS_PER_THREAD * threads);
        let mut chunks = Vec::new();
        let (mut start, mut in_chunk, mut in_batch) = (0, 0, 0);
        for (i, block) in blocks.iter().enumerate() {
            in_chunk += u64::from(block.samples);
            in_batch += u64::from(block.samples);
            let is_full = i + 1 == blocks.len().min(BLOCKS_PER_BATCH)
                || (in_batch >= SAMPLES_PER_THREAD * threads as u64 && chunks.len() + 1 >= CHUNKS_PER_THREAD * threads);
            if in_chunk >= samples_per_chunk || is_full {
                chunks.push(&blocks[start..=i]);
                (start, in_chunk) = (i + 1, 0);
            }
            if is_full {
                break;
            }
        }
        let sums: Vec<Vec<BlockSum>> = chunks
            .par_iter()
            .with_max_len(1)
            .map(|chunk| {
                let sums = self.sum_blocks(chunk, seed);
                progress(chunk.iter().map(|b| u64::from(b.samples)).sum());
                sums
            })
            .collect();
        for (block, sum) in blocks.iter().zip(sums.iter().flatten()) {
            merge(*block, sum);
        }
        start
    }
}

/// Samples after which a chunk of a batch is full: as many chunks as asked for where a batch is small, as a preview's
/// are.
fn samples_per_chunk(batch: &[BlockWork], chunks: usize) -> u64 {
    const LEAST: u64 = 64;
    const MOST: u64 = 2_048;
    let samples: u64 = batch.iter().map(|block| u64::from(block.samples)).sum();
    (samples / chunks.max(1) as u64).clamp(LEAST, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Half;

    /// A sample without end is as bright as the clamp lets it be; it was none at all, and the mean one of fewer
    /// samples.
    #[test]
    fn clamps_hold_what_is_infinite() {
        let settings = TraceSettings { clamp: Some(8.0), ..TraceSettings::new(1, 1, 0) };
        let close = |found: Vec3, expected: Vec3| assert!((found - expected).length() < 1e-5, "{found}");
        close(settings.clamped(Vec3::new(16.0, 4.0, 0.0)), Vec3::new(8.0, 2.0, 0.0));
        close(settings.clamped(Vec3::new(f32::INFINITY, 4.0, 0.0)), Vec3::new(8.0, 0.0, 0.0));
        close(settings.clamped(Vec3::splat(7.0)), Vec3::splat(7.0));
        assert!(settings.clamped(Vec3::new(f32::NAN, 1.0, 1.0)).is_nan());
    }

    /// Threads idle for half a chunk at the end of each batch.
    #[test]
    fn small_batches_have_small_chunks() {
        let batch =
            |blocks: u32| -> Vec<BlockWork> { (0..blocks).map(|pixel| BlockWork::whole(pixel, Half::A, 0)).collect() };
        let samples = u64::from(batch(1)[0].samples);
        assert_eq!(samples_per_chunk(&batch(8_192), 128), 64 * samples);
        assert_eq!([0, 8, 1 << 16].map(|blocks| samples_per_chunk(&batch(blocks), 128)), [64, 64, 2_048]);
    }
}
