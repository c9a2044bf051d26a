//! Velocity maps: where the surface point that a pixel shows was one frame ago, and where it will be.
//!
//! Exact: the point keeps its place on its triangle or sphere, and the other frames' scenes and cameras say where that
//! is, whatever moved it (camera, object, skin, morph). Backgrounds turn with the camera and with their own pictures.
//! Surfaces that blend are there where they cover half or more. Mirrors and glass have the motion of their own surface,
//! or, by [`VelocityMap::of_images`], that of what they show.

mod image;

use crate::geometry::{Coverage, Hit, Ray};
use crate::integrator::{CameraRays, CameraSample, Crop, PathTracer};
use crate::scene::{Camera, Scene, SpherePlace};
use glam::{Mat3, Vec2, Vec3, Vec3A};
use rayon::prelude::*;

/// Motion of what each pixel's centre shows when the shutter opens, in pixels, x to the right and y down; row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityMap {
    /// Motion from this frame to the next one, px: where a thing will be, less where it is.
    pub to_next: Vec<Vec2>,
    /// Where it was one frame ago, less where it is.
    pub to_previous: Vec<Vec2>,
}

/// Whose motion a map tells where a pixel shows a perfectly smooth mirror or glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VelocityOf {
    /// The mirror's and the glass's own.
    #[default]
    Surface,
    /// Motion of what is seen in the surface.
    Image,
}

/// What a camera ray meets, by what moves with it.
enum Seen {
    Triangle(Hit),
    /// Number of the sphere, and the normal at the point: along the sphere's own axes where its turning can
    /// be seen, else in the world.
    Sphere(usize, Normal),
    /// Nothing but the surroundings, in this direction of their own picture.
    Background(Vec3),
}

/// A unit normal of a sphere.
enum Normal {
    /// Fixed to the sphere.
    Own(Vec3A),
    /// Of a sphere that looks the same however it is turned.
    World(Vec3A),
}

impl VelocityMap {
    /// Velocities for the film of a tracer, and the same scene one frame earlier and later: equal objects, meshes of
    /// equal triangles. What an object of another number or triangle would be has no motion.
    pub fn new(tracer: &PathTracer, previous: &Scene, next: &Scene) -> Self {
        let cameras = [&previous.camera, &tracer.world().scene().camera, &next.camera];
        Self::seen_by(cameras, tracer, previous, next)
    }

    /// Velocities as [`Self::new`] finds them, by other cameras than the scenes' own: one frame earlier, now, one frame
    /// later.
    pub fn seen_by(cameras: [&Camera; 3], tracer: &PathTracer, previous: &Scene, next: &Scene) -> Self {
        let settings = tracer.settings();
        let area = settings.film_area();
        let [before, now, after] = cameras.map(|camera| CameraRays::new(camera, settings.width, settings.height));
        Self::by_pixel(area, |center| {
            let seen = seen_at(tracer, &now, center);
            [(next, &after), (previous, &before)].map(|(scene, camera)| place_in(scene, camera, &seen))
        })
    }

    /// From where what each pixel shows at its centre is in the next frame and in the one before; without a place it
    /// has no motion.
    fn by_pixel(area: Crop, places: impl Fn(Vec2) -> [Option<Vec2>; 2] + Sync) -> Self {
        let motions: Vec<[Vec2; 2]> = (0..area.width * area.height)
            .into_par_iter()
            .map(|pixel| {
                let corner = Vec2::new((area.x + pixel % area.width) as f32, (area.y + pixel / area.width) as f32);
                let center = corner + 0.5;
                places(center).map(|place| place.map_or(Vec2::ZERO, |place| place - center))
            })
            .collect();
        Self {
            to_next: motions.iter().map(|motion| motion[0]).collect(),
            to_previous: motions.iter().map(|motion| motion[1]).collect(),
        }
    }
}

/// Where something is at another moment: in the scene, or in a direction infinitely far away.
#[derive(Clone, Copy)]
enum Target {
    Point(Vec3),
    Direction(Vec3),
}

impl Target {
    /// Its place in the picture; `None` where that camera cannot see it.
    fn place(self, camera: &CameraRays) -> Option<Vec2> {
        match self {
            Self::Point(position) => camera.project(position),
            Self::Direction(direction) => camera.project_direction(direction),
        }
    }
}

/// As the shutter opens, through the middle of the lens: what is out of focus moves as its centre does.
fn ray_through(camera: &CameraRays, position_px: Vec2) -> Ray {
    let ray = camera.ray(&CameraSample { position_px, lens: [0.5, 0.5], time: 0.0 });
    Ray { coverage: Coverage::ByHalf, ..ray }
}

fn seen_at(tracer: &PathTracer, camera: &CameraRays, position_px: Vec2) -> Seen {
    let ray = ray_through(camera, position_px);
    seen_along(tracer, &ray, tracer.world().closest(&ray))
}

/// What a ray has met.
fn seen_along(tracer: &PathTracer, ray: &Ray, hit: Option<Hit>) -> Seen {
    let scene = tracer.world().scene();
    let Some(hit) = hit else { return Seen::Background(to_surroundings(scene) * Vec3::from(ray.direction)) };
    let Some(number) = (hit.object as usize).checked_sub(scene.instances.len()) else { return Seen::Triangle(hit) };
    let sphere = &scene.spheres[number];
    let normal = Vec3A::from(tracer.world().surface(ray, &hit).geometric_normal);
    let turns_visibly = scene.materials[sphere.material.0 as usize].has_places();
    let axes = sphere.place_at(0.0).axes;
    Seen::Sphere(number, if turns_visibly { Normal::Own(axes.transpose() * normal) } else { Normal::World(normal) })
}

/// Where what was seen is in the picture of another moment; `None` where that camera cannot see its place.
fn place_in(scene: &Scene, camera: &CameraRays, seen: &Seen) -> Option<Vec2> {
    target_in(scene, seen)?.place(camera)
}

/// Where what was seen is in the scene of another moment; `None` where there is no such thing.
fn target_in(scene: &Scene, seen: &Seen) -> Option<Target> {
    match seen {
        Seen::Background(own) => Some(Target::Direction(to_surroundings(scene).transpose() * *own)),
        Seen::Triangle(hit) => point_of_triangle(scene, hit).map(Target::Point),
        Seen::Sphere(number, normal) => {
            let SpherePlace { center, radius, axes } = scene.spheres.get(*number)?.place_at(0.0);
            let normal = match normal {
                Normal::Own(own) => axes * *own,
                Normal::World(normal) => *normal,
            };
            Some(Target::Point((center + radius * normal).into()))
        }
    }
}

/// The world's directions to those of the picture around it, which a file can turn in time.
fn to_surroundings(scene: &Scene) -> Mat3 {
    scene.environment.as_ref().map_or(Mat3::IDENTITY, |environment| environment.from_world)
}

fn point_of_triangle(scene: &Scene, hit: &Hit) -> Option<Vec3> {
    let instance = scene.instances.get(hit.object as usize)?;
    let mesh = scene.meshes.get(instance.mesh.0 as usize)?;
    let [a, b, c] = mesh.triangles.get(hit.triangle as usize)?.map(|i| mesh.positions.get(i as usize));
    let local = *a? * (1.0 - hit.b1 - hit.b2) + *b? * hit.b1 + *c? * hit.b2;
    Some(instance.transform_at(0.0).transform_point3(local))
}

#[cfg(test)]
mod tests;
