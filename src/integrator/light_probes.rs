//! Places that paths get to, and what light comes there: asked before any sample is taken, so that samples choose
//! lights by it.

use super::shading::Components;
use super::thin_sheets::MAX_SHEETS;
use super::{CameraSample, PathTracer};
use crate::geometry::{Ray, SurfacePoint};
use crate::light::{LightProbe, LightSample};
use crate::sampler::{BlockKey, Pixel, Purpose, Sample};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Scouts along each side of the picture.
const SCOUTS: u32 = 32;
/// Seed of the scouts' numbers, which are no picture's samples.
const SCOUTS_STREAM: u64 = 0x0053_434F_5554;
/// Surfaces that a scout goes to at most.
const BOUNCES: u32 = 4;

/// A surface that scatters light which is sampled.
struct Place {
    point: SurfacePoint,
    probe: LightProbe,
}

impl PathTracer {
    /// Finds out what light comes to where the camera's paths get to, if that may help.
    pub(super) fn choose_lights_by_arrival(&mut self) {
        if !self.lights.have_a_choice() {
            return;
        }
        let places: Vec<Place> =
            (0..SCOUTS * SCOUTS).into_par_iter().flat_map_iter(|scout| self.places_of(scout)).collect();
        let probes: Vec<LightProbe> = places.iter().map(|place| place.probe).collect();
        let arrival = |number: usize, sample: &LightSample| self.arrival(&places[number], sample);
        let kinds_by_place = self.lights.kinds_by_place(&self.world, &probes, &arrival);
        self.lights.set_kinds_by_place(kinds_by_place);
    }

    /// Surfaces that one scout comes to. It walks like a path, whatever light it would carry.
    fn places_of(&self, scout: u32) -> Vec<Place> {
        let cell = Pixel { x: scout % SCOUTS, y: scout / SCOUTS };
        let sample = BlockKey::of_probe(SCOUTS_STREAM, cell).sample(0);
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
            let probe = LightProbe { receiver: shading.receiver(&point, wo), time: ray.time };
            places.push(Place { point, probe });
        }
        on
    }

    /// Share of a light's sample that gets to a place.
    fn arrival(&self, place: &Place, sample: &LightSample) -> f32 {
        let shadow_ray = self.shadow_ray(&place.point, sample, place.probe.time);
        if self.has_sheets {
            return self.through_sheets(&shadow_ray, MAX_SHEETS).share.max_element().min(1.0);
        }
        if self.is_hidden(&shadow_ray) { 0.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::TraceSettings;
    use crate::sampler::{hash_words, unit_of_hash};
    use crate::scene::Light;
    use crate::scene::load::{LoadOptions, load};
    use std::path::Path;
    use std::sync::Arc;

    fn sunlit_room() -> PathTracer {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sunlit-room.toml");
        let scene = load(&file, &LoadOptions::default()).expect("our own scene");
        PathTracer::new(Arc::new(scene), TraceSettings::new(32, 24, 1))
    }

    /// How often a place asks for the sun.
    fn share_of_sun(tracer: &PathTracer, place: &Place, to_sun: Vec3) -> f64 {
        let asks = |index: u64| {
            let u = [0, 1, 2].map(|dimension| unit_of_hash(hash_words(index, dimension)));
            let sample = tracer.lights.sample(&tracer.world, &place.probe.receiver, 0.0, u);
            sample.is_some_and(|sample| sample.direction.dot(to_sun) > 0.999)
        };
        (0..256).filter(|&index| asks(index)).count() as f64 / 256.0
    }

    /// Through the panes the sun falls on a few places of a room: there it is asked for, elsewhere the sky.
    #[test]
    fn the_sun_is_asked_for_where_it_falls() {
        let tracer = sunlit_room();
        let suns = tracer.world.scene().lights.iter().find_map(|light| match light {
            Light::Directional { direction, .. } => Some(-*direction),
            _ => None,
        });
        let to_sun = suns.expect("a sun").normalize();
        let sun = LightSample { direction: to_sun, place: None, radiance: Vec3::ONE, pdf: 1.0, is_delta: true };
        let (mut lit, mut dark) = (Vec::new(), Vec::new());
        for place in (0..SCOUTS * SCOUTS).flat_map(|scout| tracer.places_of(scout)) {
            let faces = place.probe.receiver.normal.dot(to_sun) > 0.1;
            let list = if faces && tracer.arrival(&place, &sun) > 0.0 { &mut lit } else { &mut dark };
            list.push(share_of_sun(&tracer, &place, to_sun));
        }
        let mean = |shares: &[f64]| shares.iter().sum::<f64>() / shares.len() as f64;
        assert!(lit.len() > 50 && dark.len() > 1000, "{} and {} places", lit.len(), dark.len());
        // 0.79 and 0.40, since groups at its edge have both; without shadows 0.48 and 0.45.
        assert!(mean(&lit) > mean(&dark) + 0.2, "{} where it falls, {} elsewhere", mean(&lit), mean(&dark));
    }

    #[test]
    fn looking_twice_finds_the_same() {
        let (once, mut twice) = (sunlit_room(), sunlit_room());
        twice.choose_lights_by_arrival();
        let place = &once.places_of(500)[0];
        for direction in [Vec3::Y, Vec3::X, Vec3::new(0.6, 0.5, 0.1).normalize()] {
            let pdfs = [&once, &twice]
                .map(|tracer| tracer.lights.from_afar(&place.probe.receiver, direction).map(|light| light.pdf));
            assert_eq!(pdfs[0], pdfs[1]);
        }
    }
}
