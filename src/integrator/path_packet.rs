//! A packet of paths, followed abreast: one stage of all of them before the next stage of any.
//!
//! Corners and texels of what a path hits are in no cache where a scene is large. So each stage asks for what the next
//! one reads, and the memory answers while the other paths' part of the stage is done. Which paths go abreast changes
//! no byte of any, and a block is summed in the order of its samples.

use super::path::{BounceNumbers, PathState};
use super::{BlockWork, CameraSample, PathTracer, log2_block};
use crate::film::BlockSum;
use crate::geometry::{Hit, SurfacePoint, prefetch};
use crate::sampler::{BlockKey, Pixel, Purpose, Sample};
use glam::Vec2;
use smallvec::SmallVec;

/// Paths abreast: the cave of `benches/paths.rs` has 0.307 M samples a second with 16, 0.309 with 32 and 64, 0.306 with
/// the 8 of one block at a time.
const PATHS: usize = 16;

/// Samples of the paths of a packet.
type Samples = SmallVec<[Sample; PATHS]>;

/// A sample whose path is to be followed, and where its light goes.
#[derive(Clone, Copy)]
struct Start {
    pixel: Pixel,
    sample: Sample,
    /// Number of the block's sum.
    sum: usize,
}

/// Samples that wait for their paths, and the places where these are followed.
struct PathPacket {
    starts: Vec<Start>,
    paths: Vec<PathState>,
    filter_weights: Vec<f32>,
}

impl PathTracer {
    /// Sums of blocks of samples.
    pub(super) fn sum_blocks(&self, blocks: &[BlockWork], seed: u64) -> Vec<BlockSum> {
        let mut sums = vec![BlockSum::default(); blocks.len()];
        let mut packet = PathPacket {
            starts: Vec::with_capacity(PATHS),
            paths: Vec::with_capacity(PATHS),
            filter_weights: Vec::with_capacity(PATHS),
        };
        for (sum, block) in blocks.iter().enumerate() {
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
                packet.starts.push(Start { pixel, sample, sum });
                if packet.starts.len() == PATHS {
                    self.finish(&mut packet, &mut sums);
                }
            }
        }
        self.finish(&mut packet, &mut sums);
        sums
    }

    /// Follows the paths of the packet to their ends, adds what they found to the sums, and leaves the packet empty.
    fn finish(&self, packet: &mut PathPacket, sums: &mut [BlockSum]) {
        self.start(packet);
        self.follow_packet(&mut packet.paths);
        for ((path, start), filter_weight) in packet.paths.iter().zip(&packet.starts).zip(&packet.filter_weights) {
            let mut found = path.found();
            found.radiance = filter_weight * self.settings.clamped(found.radiance);
            sums[start.sum].add(&found);
        }
        packet.starts.clear();
        packet.paths.clear();
        packet.filter_weights.clear();
    }

    /// Makes the paths of the packet's samples, at the lens.
    fn start(&self, packet: &mut PathPacket) {
        let samples: Samples = packet.starts.iter().map(|start| start.sample).collect();
        let mut numbers = [[0.0; 4]; PATHS];
        Sample::draw_each(&samples, Purpose::Camera, &mut numbers);
        for (Start { pixel, sample, .. }, [x, y, lens_u, lens_v]) in packet.starts.iter().zip(numbers) {
            let filtered = self.settings.filter.sample(x, y);
            let ray = self.camera.ray(&CameraSample {
                position_px: Vec2::new(pixel.x as f32, pixel.y as f32) + 0.5 + filtered.offset,
                lens: [lens_u, lens_v],
                time: if self.moves { sample.draw(Purpose::Time)[0] } else { 0.0 },
            });
            packet.paths.push(PathState::new(ray, *sample, self.around_camera.at(&self.world, &ray)));
            packet.filter_weights.push(filtered.weight);
        }
    }

    /// Follows paths, at most [`PATHS`], to their ends.
    pub(super) fn follow_packet(&self, paths: &mut [PathState]) {
        let mut alive: SmallVec<[usize; PATHS]> = (0..paths.len()).collect();
        // Apart from the paths: what a stage hands to the next is read where it was written.
        let mut hits: [Option<Hit>; PATHS] = [None; PATHS];
        let mut points: [Option<SurfacePoint>; PATHS] = [const { None }; PATHS];
        for bounce in 0.. {
            for &i in &alive {
                paths[i].rays += 1;
                hits[i] = self.world.closest(&paths[i].ray);
            }
            alive.retain(|&mut i| {
                if hits[i].is_none() {
                    self.leave(&mut paths[i], bounce);
                }
                hits[i].is_some()
            });
            for hit in alive.iter().filter_map(|&i| hits[i].as_ref()) {
                self.world.prefetch_indices(hit);
            }
            for hit in alive.iter().filter_map(|&i| hits[i].as_ref()) {
                self.world.prefetch_corners(hit);
            }
            for &i in &alive {
                points[i] = hits[i].as_ref().map(|hit| self.world.surface(&paths[i].ray, hit));
            }
            for point in alive.iter().filter_map(|&i| points[i].as_ref()) {
                self.prefetch_base_color(point);
            }
            let samples: Samples = alive.iter().map(|&i| paths[i].sample).collect();
            let (mut light, mut scatter) = ([[0.0; 4]; PATHS], [[0.0; 4]; PATHS]);
            Sample::draw_each(&samples, Purpose::Light { bounce }, &mut light);
            Sample::draw_each(&samples, Purpose::Scatter { bounce }, &mut scatter);
            let mut left = SmallVec::new();
            for (number, &i) in alive.iter().enumerate() {
                let (Some(hit), Some(point)) = (&hits[i], &points[i]) else { continue };
                let numbers = BounceNumbers { light: light[number], scatter: scatter[number] };
                if self.shade(&mut paths[i], hit, point, bounce, &numbers) {
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
        let material = self.world.material(point.object);
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
