//! The life of one sample: from the lens to the end of its path.
//!
//! Unbiased path tracing with next-event estimation, multiple importance sampling by the power heuristic (Veach 1997)
//! and Russian roulette.

use super::PathTracer;
use super::media::Media;
use super::shading::{Components, Shading};
use super::thin_sheets::{MAX_SHEETS, Passed};
use crate::geometry::{Hit, Ray, SurfacePoint, offset};
use crate::light::{LightFromAfar, LightReceiver, LightSample, emitted};
use crate::sampler::Sample;
use fechner_perception::photometry::luminance;
use glam::{Vec3, Vec3A};

/// What the first surface looks like: features for the perception model and for denoisers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Directional albedo in [0, 1]; 1 where the surface emits.
    pub albedo: Vec3,
    /// Shading normal in world space; zero where nothing is hit.
    pub normal: Vec3,
    /// Distance from the camera in scene units; 0 where nothing is hit.
    pub depth: f32,
    /// Object number + 1; 0 where nothing is hit.
    pub object_id: u32,
    /// Whether it sends light to the camera by itself; the environment where nothing is hit.
    pub shines: bool,
}

impl FirstHit {
    /// No surface.
    pub const NOTHING: Self = Self { albedo: Vec3::ONE, normal: Vec3::ZERO, depth: 0.0, object_id: 0, shines: false };

    /// A white wall that faces the camera, for films that tests make up.
    #[cfg(test)]
    pub(crate) const WALL: Self = Self { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1, shines: false };
}

/// What a sample found.
#[derive(Clone, Copy, Debug)]
pub struct PathSample {
    /// Radiance in scene units.
    pub radiance: Vec3,
    /// The first surface.
    pub first_hit: FirstHit,
    /// Rays traced: camera, bounce and shadow.
    pub rays: u32,
}

#[cfg(test)]
impl PathSample {
    /// One that met [`FirstHit::WALL`].
    pub(crate) fn of_wall(radiance: Vec3) -> Self {
        Self { radiance, first_hit: FirstHit::WALL, rays: 1 }
    }
}

/// Where a path is.
pub(super) struct PathState {
    pub(super) ray: Ray,
    /// Numbers that the path draws.
    pub(super) sample: Sample,
    /// Where the ray's direction was scattered: the last surface but for clear sheets.
    from: LightReceiver,
    /// What lies between there and the ray's origin.
    behind: Behind,
    throughput: Vec3,
    radiance: Vec3,
    /// Solid-angle density with which the ray's direction was scattered; `None` if light sampling could not have found
    /// the same direction (camera rays and delta lobes).
    scatter_pdf: Option<f32>,
    /// What radiance gains on the way back out of the media it has entered: n² of the medium over that at the camera.
    /// Roulette looks at throughput times this, else it would kill most of what is inside glass (throughput 1/n²) and
    /// multiply the rest.
    radiance_gain_on_exit: f32,
    /// The volumes that the ray is in; empty in scenes where none absorbs.
    media: Media,
    pub(super) rays: u32,
    first_hit: FirstHit,
    /// Light that arrives there unless something hides it.
    direct: Option<DirectLight>,
}

/// What a path has gone straight through since its direction was scattered.
#[derive(Clone, Copy, Debug, Default)]
struct Behind {
    /// Scene units.
    distance: f32,
    sheets: u32,
}

/// What a path draws at a bounce.
pub(super) struct BounceNumbers {
    /// Point on a light (x, y), which light (z) and survival of what it gives (w).
    pub(super) light: [f32; 4],
    /// Direction (x, y), lobe (z) and survival (w).
    pub(super) scatter: [f32; 4],
}

/// A ray from a surface to a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadowRay {
    pub(super) ray: Ray,
    /// Distance up to the light, in scene units; may be infinite, and is 0 where there is no way between the two.
    pub(super) distance: f32,
}

/// Light that a path gains if nothing is in between.
struct DirectLight {
    shadow_ray: ShadowRay,
    /// How many clear sheets it may pass.
    most_sheets: u32,
    /// By the path's throughput.
    radiance: Vec3,
}

impl PathState {
    /// A path that begins at the lens.
    pub(super) fn new(camera_ray: Ray, sample: Sample, media: Media) -> Self {
        Self {
            ray: camera_ray,
            sample,
            from: LightReceiver { position: camera_ray.origin.into(), normal: Vec3::ZERO },
            behind: Behind::default(),
            throughput: Vec3::ONE,
            radiance: Vec3::ZERO,
            scatter_pdf: None,
            radiance_gain_on_exit: 1.0,
            media,
            rays: 0,
            first_hit: FirstHit::NOTHING,
            direct: None,
        }
    }

    /// What it has found so far.
    pub(super) fn found(&self) -> PathSample {
        PathSample { radiance: self.radiance, first_hit: self.first_hit, rays: self.rays }
    }
}

impl PathTracer {
    /// Follows one path.
    pub fn trace_path(&self, camera_ray: Ray, sample: Sample) -> PathSample {
        let mut path = [PathState::new(camera_ray, sample, self.around_camera.at(&self.world, &camera_ray))];
        self.follow_packet(&mut path);
        path[0].found()
    }

    /// Radiance of the lamp or the sky that a camera ray leads straight to, without what is absorbed on the way.
    pub(super) fn light_straight_along(&self, camera_ray: Ray, sample: Sample) -> Vec3 {
        let mut path = PathState::new(camera_ray, sample, Media::default());
        match self.world.closest(&camera_ray) {
            None => self.leave(&mut path, 0),
            Some(hit) => {
                let point = self.world.surface(&camera_ray, &hit);
                self.add_emission(&mut path, &hit, &point);
            }
        }
        path.radiance
    }

    /// Gathers the light of the environment, where the path's ray has hit nothing and the path ends.
    pub(super) fn leave(&self, path: &mut PathState, bounce: u32) {
        if bounce > 0 || !self.settings.transparent {
            self.add_environment(path);
        }
        if bounce == 0 {
            path.first_hit.shines = path.radiance != Vec3::ZERO;
        }
    }

    /// Gathers the light of the surface that the path's ray has hit and chooses the next ray; false where the path
    /// ends.
    #[inline(always)]
    pub(super) fn shade(
        &self,
        path: &mut PathState,
        hit: &Hit,
        point: &SurfacePoint,
        bounce: u32,
        numbers: &BounceNumbers,
    ) -> bool {
        // What the surface is made of here.
        let wo = -Vec3::from(path.ray.direction);
        let components = Components::new();
        let frames = self.frames(point, wo, path.ray.time);
        let bsdf = self.bsdf(point, &frames, &components);
        let shading = self.shading(&bsdf, point, &frames);
        // Absorption since the last surface.
        path.throughput *= match shading.medium {
            Some(medium) if wo.dot(point.geometric_normal) < 0.0 => {
                path.media.transmittance_to_back_of(medium, hit.distance)
            }
            _ => path.media.transmittance(hit.distance),
        };
        // Emission, weighed by multiple importance sampling.
        let emitted = self.add_emission(path, hit, point);
        // What the first surface is like.
        if bounce == 0 {
            let albedo = shading.bsdf.albedo(shading.frame.to_local(wo)).clamp(Vec3::ZERO, Vec3::ONE);
            path.first_hit = FirstHit {
                albedo: if emitted { Vec3::ONE } else { albedo },
                normal: shading.normal,
                depth: hit.distance,
                object_id: hit.object + 1,
                shines: emitted,
            };
        }
        // The last surface of a path that is as deep as it may be.
        if bounce >= self.settings.max_depth {
            return false;
        }
        // Next-event estimation.
        if shading.bsdf.has_smooth_lobe() {
            self.sample_light(path, point, &shading, wo, bounce, numbers.light);
        }
        // Scattering and roulette.
        let [u0, u1, lobe, roulette] = numbers.scatter;
        scatter(path, hit, point, &shading, wo, [u0, u1, lobe]) && survives(path, bounce, roulette)
    }

    /// Adds the light that was waiting for its shadow ray.
    #[inline]
    pub(super) fn add_direct_light(&self, path: &mut PathState) {
        let Some(light) = path.direct.take() else { return };
        if light.most_sheets > 0 {
            let Passed { share, rays } = self.through_sheets(&light.shadow_ray, light.most_sheets);
            path.radiance += share * light.radiance;
            path.rays += rays;
            return;
        }
        path.rays += 1;
        if !self.is_hidden(&light.shadow_ray) {
            path.radiance += light.radiance;
        }
    }

    /// Whether anything is before a light.
    #[inline]
    pub(super) fn is_hidden(&self, ShadowRay { ray, distance }: &ShadowRay) -> bool {
        *distance > 0.0 && self.world.occluded(ray, *distance)
    }

    /// Radiance of the environment along a ray that hit nothing.
    fn add_environment(&self, path: &mut PathState) {
        let weighed =
            self.lights.from_afar(&path.from, path.ray.direction.into()).map(|LightFromAfar { radiance, pdf }| {
                radiance * path.scatter_pdf.map_or(1.0, |scatter_pdf| power_heuristic(scatter_pdf, pdf))
            });
        let radiance: Vec3 = weighed.into_iter().sum();
        if radiance != Vec3::ZERO {
            path.radiance += path.throughput * path.media.transmittance(f32::INFINITY) * radiance;
        }
    }

    /// Radiance emitted by the surface that was hit; whether there was any.
    fn add_emission(&self, path: &mut PathState, hit: &Hit, point: &SurfacePoint) -> bool {
        let scene = self.world.scene();
        let material = self.world.material(hit.object);
        let cosine = -Vec3::from(path.ray.direction).dot(point.geometric_normal);
        if material.emission.factor == Vec3::ZERO || !(cosine > 0.0 || material.emits_both_sides) {
            return false;
        }
        let radiance = emitted(material, &scene.textures, point.uv, cosine.abs());
        let weight = path.scatter_pdf.map_or(1.0, |pdf| {
            let distance = path.behind.distance + hit.distance;
            power_heuristic(pdf, self.lights.pdf_of_hit(&self.world, &path.from, &path.ray, hit, distance))
        });
        path.radiance += path.throughput * radiance * weight;
        radiance != Vec3::ZERO
    }

    /// Next-event estimation: light that arrives straight from a sampled light unless something hides it. It is made in
    /// its place: to hand it back takes 3 % of the Cornell box's time.
    fn sample_light(
        &self,
        path: &mut PathState,
        point: &SurfacePoint,
        shading: &Shading,
        wo: Vec3,
        bounce: u32,
        u: [f32; 4],
    ) {
        // A place on a light.
        let [u0, u1, choice, roulette] = u;
        let receiver = shading.receiver(point, wo);
        let Some(light) = self.lights.sample(&self.world, &receiver, path.ray.time, [u0, u1, choice]) else {
            return;
        };
        // What the surface scatters of its light.
        let wi = light.direction;
        if !shading.sides_agree(wo, wi) {
            return;
        }
        let scattered = shading.bsdf.evaluate(shading.frame.to_local(wo), shading.frame.to_local(wi));
        if scattered.value == Vec3::ZERO {
            return;
        }
        // Its weight against scattering, which may find the same light.
        let scatter_pdf = if light.is_delta { 0.0 } else { scattered.pdf };
        let weight = power_heuristic_over_own(light.pdf, scatter_pdf);
        let unshadowed = path.throughput * scattered.value * light.radiance * weight;
        // Roulette by how much it would add to what the path has found.
        let survival = self.thresholds.as_ref().map_or(1.0, |thresholds| {
            let of = |rgb: Vec3| luminance(rgb.to_array());
            thresholds.survival(of(unshadowed * path.radiance_gain_on_exit), of(path.radiance))
        });
        if survival < 1.0 && roulette >= survival {
            return;
        }
        // Absorption on the way to the light.
        let distance = light.place.map_or(f32::INFINITY, |place| place.position.distance(point.position));
        let left = match shading.crossed_medium(wo, wi) {
            None => path.media.transmittance(distance),
            Some(crossed) => {
                let mut media = path.media;
                media.cross(crossed);
                media.transmittance(distance)
            }
        };
        // The shadow ray that it waits for.
        let shadow_ray = self.shadow_ray(point, &light, path.ray.time);
        let most_sheets = if self.has_sheets { MAX_SHEETS.min(self.settings.max_depth - bounce - 1) } else { 0 };
        path.direct = Some(DirectLight { shadow_ray, most_sheets, radiance: unshadowed * left / survival });
    }

    /// The ray from a point to a light. Both ends are lifted off their surfaces.
    pub(super) fn shadow_ray(&self, point: &SurfacePoint, light: &LightSample, time: f32) -> ShadowRay {
        let origin = point.spawn(light.direction);
        let along = |direction: Vec3A| Ray { time, ..Ray::new(origin, direction) };
        let Some(place) = light.place else {
            return ShadowRay { ray: along(light.direction.into()), distance: f32::INFINITY };
        };
        let position = Vec3A::from(place.position);
        let offset = place.offset.max(offset::of_way(origin, position - origin));
        let way = position + Vec3A::from(place.normal) * offset - origin;
        if way.dot(light.direction.into()) <= 0.0 {
            return ShadowRay { ray: along(light.direction.into()), distance: 0.0 };
        }
        let distance = way.length();
        ShadowRay { ray: along(way / distance), distance }
    }
}

/// Chooses the next direction; false where the path ends.
#[inline(always)]
fn scatter(path: &mut PathState, hit: &Hit, point: &SurfacePoint, shading: &Shading, wo: Vec3, u: [f32; 3]) -> bool {
    let Some(scattered) = shading.bsdf.sample(shading.frame.to_local(wo), u) else {
        return false;
    };
    // As shadow rays see it: a lobe that they do not know keeps all of its light.
    if scattered.goes_straight_on() && shading.straight_through(wo) != Vec3::ZERO {
        return pass_sheet(path, hit, point, scattered.weight);
    }
    let wi = shading.frame.to_world_direction(scattered.wi);
    if !shading.sides_agree(wo, wi) {
        return false;
    }
    path.throughput *= scattered.weight;
    if let Some(index) = scattered.crossed_index {
        path.radiance_gain_on_exit *= index * index;
    }
    // Whatever the lobe: what a mix lets through diffusely comes into the volume behind it like what it refracts, and a
    // light sample cannot tell the two apart.
    if let Some(crossed) = shading.crossed_medium(wo, wi) {
        path.media.cross(crossed);
    }
    path.scatter_pdf = (!scattered.lobe.is_delta()).then_some(scattered.pdf);
    path.from = shading.receiver(point, wo);
    path.behind = Behind::default();
    path.ray = Ray { origin: point.spawn(wi), direction: wi.into(), ..path.ray };
    path.throughput.max_element() > 0.0 && path.throughput.is_finite()
}

/// Goes on behind a clear sheet. A lamp that is met there is weighed as seen from where the direction was scattered,
/// since a shadow ray from there might have found it as well: see [`super::thin_sheets`].
fn pass_sheet(path: &mut PathState, hit: &Hit, point: &SurfacePoint, share: Vec3) -> bool {
    path.throughput *= share;
    path.behind.distance += hit.distance;
    path.behind.sheets += 1;
    if path.behind.sheets > MAX_SHEETS {
        path.scatter_pdf = None;
    }
    path.ray = Ray { origin: point.spawn(path.ray.direction.into()), ..path.ray };
    path.throughput.max_element() > 0.0 && path.throughput.is_finite()
}

/// Russian roulette by throughput from the fourth bounce on.
fn survives(path: &mut PathState, bounce: u32, u: f32) -> bool {
    const FIRST_BOUNCE: u32 = 3;
    /// No path goes on for ever, even where nothing absorbs: [`super::DEFAULT_MAX_DEPTH`] counts on both.
    const ALWAYS_MORTAL_FROM: u32 = 8;
    const MAX_SURVIVAL: f32 = 0.98;
    if bounce < FIRST_BOUNCE {
        return true;
    }
    let most = if bounce < ALWAYS_MORTAL_FROM { 1.0 } else { MAX_SURVIVAL };
    let survival = (path.throughput.max_element() * path.radiance_gain_on_exit).min(most);
    if u >= survival {
        return false;
    }
    path.throughput /= survival;
    true
}

/// Weight of a technique with density `own` against one with density `other` (Veach 1997, β = 2).
fn power_heuristic(own: f32, other: f32) -> f32 {
    if own.is_infinite() {
        return 1.0;
    }
    let ratio = other / own;
    if ratio.is_nan() { 0.0 } else { 1.0 / (1.0 + ratio * ratio) }
}

/// The weight over the technique's own density, in one division less.
fn power_heuristic_over_own(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    if ratio.is_nan() { 0.0 } else { 1.0 / (own * (1.0 + ratio * ratio)) }
}
