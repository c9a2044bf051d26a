//! Places that paths get to, and what light comes there: asked before any sample is taken, so that samples choose lights by it.

use super::shading::Components;
use super::sheets::MOST_SHEETS;
use super::{CameraSample, PathTracer};
use crate::geometry::{Ray, SurfacePoint};
use crate::light::{LightSample, Lookout};
use crate::sampler::{BlockKey, Half, Pixel, Purpose, Sample, Sequence};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Scouts along each side of the picture.
const SCOUTS: u32 = 32;
/// Surfaces that a scout goes to at most.
const BOUNCES: u32 = 4;

/// A surface that scatters light which is sampled.
struct Place {
    point: SurfacePoint,
    lookout: Lookout,
}

impl PathTracer {
    /// Finds out what light comes to where the camera's paths get to, if that may help.
    pub(super) fn choose_lights_by_arrival(&mut self) {
        if !self.lights.have_a_choice() {
            return;
        }
        let places: Vec<Place> =
            (0..SCOUTS * SCOUTS).into_par_iter().flat_map_iter(|scout| self.places_of(scout)).collect();
        let lookouts: Vec<Lookout> = places.iter().map(|place| place.lookout).collect();
        let arrival = |number: usize, sample: &LightSample| self.arrival(&places[number], sample);
        let outlooks = self.lights.outlooks(&self.world, &lookouts, &arrival);
        self.lights.set_outlooks(outlooks);
    }

    /// Surfaces that one scout comes to. It walks like a path, whatever light it would carry.
    fn places_of(&self, scout: u32) -> Vec<Place> {
        let cell = Pixel { x: scout % SCOUTS, y: scout / SCOUTS };
        let key =
            BlockKey { seed: 0, pixel: cell, half: Half::A, level: 0, log2_samples: 0, sequence: Sequence::PerPixel };
        let sample = key.sample(0);
        let [x, y, lens_u, lens_v] = sample.draw(Purpose::Camera);
        let size_px = Vec2::new(self.settings.width as f32, self.settings.height as f32);
        let mut ray = self.camera.ray(&CameraSample {
            position_px: (Vec2::new(cell.x as f32 + x, cell.y as f32 + y)) / SCOUTS as f32 * size_px,
            lens: [lens_u, lens_v],
            time: if self.moves { sample.draw(Purpose::Time)[0] } else { 0.0 },
        });
        let mut places = Vec::new();
        for bounce in 0..BOUNCES.min(self.settings.max_depth) {
            let Some(on) = self.go_on(&ray, sample, bounce, &mut places) else { break };
            ray = on;
        }
        places
    }

    /// Where a scout goes from what its ray meets, which is noted down if it scatters light.
    fn go_on(&self, ray: &Ray, sample: Sample, bounce: u32, places: &mut Vec<Place>) -> Option<Ray> {
        let hit = self.world.closest(ray)?;
        let point = self.world.surface(ray, &hit);
        let wo = -Vec3::from(ray.direction);
        let components = Components::new();
        let frames = self.frames(&point, wo, ray.time);
        let bsdf = self.bsdf(&point, &frames, &components);
        let shading = self.shading(&bsdf, &point, &frames);
        let [u, v, lobe, _] = sample.draw(Purpose::Scatter { bounce });
        let scattered = bsdf.sample(shading.frame.to_local(wo), [u, v, lobe]);
        let wi = scattered.map(|scattered| shading.frame.to_world_direction(scattered.wi));
        let on = wi.filter(|wi| shading.sides_agree(wo, *wi)).map(|wi| Ray {
            origin: point.spawn(wi),
            direction: wi.into(),
            ..*ray
        });
        if bsdf.has_smooth_lobe() {
            let lookout = Lookout { receiver: shading.receiver(&point, wo), time: ray.time };
            places.push(Place { point, lookout });
        }
        on
    }

    /// Share of a light's sample that gets to a place.
    fn arrival(&self, place: &Place, sample: &LightSample) -> f32 {
        let (ray, distance) = self.shadow_ray(&place.point, sample, place.lookout.time);
        if self.has_sheets {
            return self.through_sheets(&ray, distance, MOST_SHEETS).0.max_element().min(1.0);
        }
        if distance > 0.0 && self.world.occluded(&ray, distance) { 0.0 } else { 1.0 }
    }
}
