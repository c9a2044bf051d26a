//! Paths followed abreast: one stage of several paths before the next stage of any.
//!
//! Corners and texels of what a path hits are in no cache where a scene is large. So each stage asks for what the next one reads,
//! and the memory answers while the other paths' part of the stage is done. Which paths go abreast changes no byte of any, and
//! a block is summed in the order of its samples.

use super::path::PathState;
use super::{BlockWork, CameraSample, PathTracer, log2_block};
use crate::film::BlockSum;
use crate::geometry::{SurfacePoint, prefetch};
use crate::sampler::{BlockKey, Pixel, Purpose, Sample};
use glam::Vec2;
use smallvec::SmallVec;

/// Paths abreast: the cave of `benches/paths.rs` has 0.307 M samples a second with 16, 0.309 with 32 and 64, 0.306 with the 8
/// of one block at a time.
const ABREAST: usize = 16;

/// Where a path's light goes.
#[derive(Clone, Copy)]
struct Destination {
    /// Number of the block's sum.
    sum: usize,
    filter_weight: f32,
}

/// Paths that wait to be followed, and their destinations.
struct Row {
    paths: Vec<PathState>,
    destinations: Vec<Destination>,
}

impl PathTracer {
    /// Sums of blocks of samples.
    pub(super) fn sum_blocks(&self, blocks: &[BlockWork], seed: u64) -> Vec<BlockSum> {
        let mut sums = vec![BlockSum::default(); blocks.len()];
        let mut row = Row { paths: Vec::with_capacity(ABREAST), destinations: Vec::with_capacity(ABREAST) };
        for (number, block) in blocks.iter().enumerate() {
            let area = self.settings.film_area();
            let pixel = Pixel { x: area.x + block.pixel % area.width, y: area.y + block.pixel / area.width };
            let key = BlockKey {
                seed,
                pixel,
                half: block.half,
                level: block.level,
                log2_samples: log2_block(block.level),
                sequence: self.settings.sequence,
            };
            for sample in key.samples(block.first + block.samples).skip(block.first as usize) {
                self.start(pixel, sample, number, &mut row);
                if row.paths.len() == ABREAST {
                    self.finish(&mut row, &mut sums);
                }
            }
        }
        self.finish(&mut row, &mut sums);
        sums
    }

    /// Puts a sample's path in the row.
    fn start(&self, pixel: Pixel, sample: Sample, sum: usize, row: &mut Row) {
        let [x, y, lens_u, lens_v] = sample.draw(Purpose::Camera);
        let filtered = self.settings.filter.sample(x, y);
        let ray = self.camera.ray(&CameraSample {
            position_px: Vec2::new(pixel.x as f32, pixel.y as f32) + 0.5 + filtered.offset,
            lens: [lens_u, lens_v],
            time: if self.moves { sample.draw(Purpose::Time)[0] } else { 0.0 },
        });
        row.paths.push(PathState::new(ray, sample));
        row.destinations.push(Destination { sum, filter_weight: filtered.weight });
    }

    /// Follows the paths of the row to their ends, adds what they found to the sums, and leaves the row empty.
    fn finish(&self, row: &mut Row, sums: &mut [BlockSum]) {
        self.follow_abreast(&mut row.paths);
        for (path, destination) in row.paths.iter().zip(&row.destinations) {
            let mut found = path.found();
            if let Some(clamp) = self.settings.clamp {
                found.radiance *= (clamp / found.radiance.max_element().max(clamp)).min(1.0);
            }
            found.radiance *= destination.filter_weight;
            sums[destination.sum].add(&found);
        }
        row.paths.clear();
        row.destinations.clear();
    }

    /// Follows paths to their ends.
    pub(super) fn follow_abreast(&self, paths: &mut [PathState]) {
        let mut alive: SmallVec<[usize; ABREAST]> = (0..paths.len()).collect();
        for bounce in 0.. {
            for &i in &alive {
                let path = &mut paths[i];
                path.rays += 1;
                path.hit = self.world.closest(&path.ray);
            }
            for &i in &alive {
                if let Some(hit) = &paths[i].hit {
                    self.world.prefetch_indices(hit);
                }
            }
            for &i in &alive {
                if let Some(hit) = &paths[i].hit {
                    self.world.prefetch_corners(hit);
                }
            }
            for &i in &alive {
                let path = &mut paths[i];
                path.point = path.hit.as_ref().map(|hit| self.world.surface(&path.ray, hit));
            }
            for &i in &alive {
                if let Some(point) = &paths[i].point {
                    self.prefetch_base_color(point);
                }
            }
            let mut left = SmallVec::new();
            for &i in &alive {
                if self.shade(&mut paths[i], bounce) {
                    left.push(i);
                }
            }
            for &i in &alive {
                self.add_direct_light(&mut paths[i]);
            }
            if left.is_empty() {
                break;
            }
            alive = left;
        }
    }

    /// Asks for the texels of the colour that most materials read first.
    #[inline]
    fn prefetch_base_color(&self, point: &SurfacePoint) {
        let scene = self.world.scene();
        if scene.textures.is_empty() {
            return;
        }
        let material = &scene.materials[self.world.material_of(point.object).0 as usize];
        let lookup = material.surface.base_color().and_then(|color| color.texture.as_ref());
        let texels = lookup.and_then(|l| scene.textures[l.texture.0 as usize].stored_at(l.transform(point.uv)));
        texels.into_iter().flatten().for_each(prefetch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::TraceSettings;
    use crate::sampler::Half;
    use crate::scene::load::{LoadOptions, load};
    use std::path::Path;
    use std::sync::Arc;

    /// Blocks that share rows, are cut by their ends or fill several have the sums that each has alone.
    #[test]
    fn the_company_of_a_path_changes_nothing() {
        for name in ["textured-room", "glass-caustic"] {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
            let scene = load(&file, &LoadOptions::default()).expect("our own scene");
            let tracer = PathTracer::new(Arc::new(scene), TraceSettings::new(16, 9, 5));
            let part = |pixel, half, first, samples| BlockWork { pixel, half, level: 2, first, samples };
            let blocks = [
                BlockWork::whole(3, Half::A, 0),
                part(70, Half::A, 1, 2),
                BlockWork::whole(71, Half::B, 3),
                part(71, Half::A, 5, 9),
                BlockWork::whole(140, Half::B, 0),
            ];
            let alone: Vec<BlockSum> = blocks.iter().flat_map(|&block| tracer.sum_blocks(&[block], 5)).collect();
            assert_eq!(tracer.sum_blocks(&blocks, 5), alone, "{name}");
            assert_ne!(alone[0], alone[4], "{name}: the sums say nothing");
        }
    }
}
