//! Velocity of what mirrors and clear glass show.
//!
//! A camera ray is followed over mirrors and glass to what is seen there. In the other frame that point has moved, and
//! so may have the mirrors: the pixel is looked for whose ray, over the same things, leads to it. Not for rough
//! surfaces, whose image is a blur without a place: they keep their surface's motion.

use super::{Seen, Target, VelocityMap, place_in, ray_through, seen_along, seen_at, target_in};
use crate::geometry::Ray;
use crate::integrator::{CameraRays, PathTracer, SpecularPath, SpecularVertex};
use glam::{Vec2, Vec3, Vec3A};

/// Another moment of a shot.
struct Moment<'a> {
    tracer: &'a PathTracer,
    camera: CameraRays,
}

impl<'a> Moment<'a> {
    fn of(tracer: &'a PathTracer) -> Self {
        let settings = tracer.settings();
        let camera = CameraRays::new(&tracer.world().scene().camera, settings.width, settings.height);
        Self { tracer, camera }
    }
}

impl VelocityMap {
    /// Velocities as [`VelocityMap::new`] finds them, but where a pixel shows a perfectly smooth mirror or glass, of
    /// what is seen in it; where there is no such place in the other frame, or none that can be found, of the surface.
    pub fn of_images(tracer: &PathTracer, previous: &PathTracer, next: &PathTracer) -> Self {
        let area = tracer.settings().film_area();
        let [before, now, after] = [previous, tracer, next].map(Moment::of);
        Self::by_pixel(area, |center| {
            let surface = seen_at(now.tracer, &now.camera, center);
            let camera_ray = ray_through(&now.camera, center);
            let image = now.tracer.follow_specular(camera_ray).map(|path| Image::of(tracer, camera_ray, path));
            [&after, &before].map(|other| {
                let of_surface = place_in(other.tracer.world().scene(), &other.camera, &surface);
                let place = image.as_ref().and_then(|image| image.place_in(other, center, of_surface));
                place.or(of_surface)
            })
        })
    }
}

/// What a pixel shows over mirrors and glass.
struct Image {
    path: SpecularPath,
    /// At its end.
    seen: Seen,
    /// Where that is now; `None` where the scene does not say.
    target: Option<Target>,
    /// Where it seems to be: along the camera ray, as far as the path is long.
    virtual_place: Target,
}

impl Image {
    fn of(tracer: &PathTracer, camera_ray: Ray, path: SpecularPath) -> Self {
        let seen = seen_along(tracer, &path.last_ray, path.end);
        let virtual_place = if path.length.is_finite() {
            Target::Point((camera_ray.origin + camera_ray.direction * path.length).into())
        } else {
            Target::Direction(camera_ray.direction.into())
        };
        let target = target_in(tracer.world().scene(), &seen);
        Self { path, seen, target, virtual_place }
    }

    /// Where it would seem to be, if its surfaces were plane mirrors and panes at rest, once what is seen has come to
    /// `target`.
    fn moved_virtual_place(&self, target: Target) -> Target {
        let shown = |motion: Vec3| Vec3::from(self.path.unfolded * Vec3A::from(motion));
        match (self.virtual_place, self.target, target) {
            (Target::Point(place), Some(Target::Point(from)), Target::Point(to)) => {
                Target::Point(place + shown(to - from))
            }
            (Target::Direction(place), Some(Target::Direction(from)), Target::Direction(to)) => {
                Target::Direction(place + shown(to - from))
            }
            (place, ..) => place,
        }
    }

    /// Its place in the picture of another moment. It is looked for from where the virtual place would be, which is
    /// it for plane mirrors at rest, from where the surface has gone, and from where it was. Of a curved mirror's
    /// several images, one that lies much further away than these, or than a plane mirror's would have moved, is
    /// not the one that was seen.
    fn place_in(&self, other: &Moment, center: Vec2, of_surface: Option<Vec2>) -> Option<Vec2> {
        const NEAR_PX: f32 = 8.0;
        let target = target_in(other.tracer.world().scene(), &self.seen)?;
        let search = Search { other, vertices: &self.path.vertices, target };
        let virtual_place = self.moved_virtual_place(target).place(&other.camera);
        let at_rest = self.virtual_place.place(&other.camera);
        let starts = [virtual_place, of_surface, Some(center)];
        let nearest = starts
            .into_iter()
            .flatten()
            .filter_map(|place| search.aim(place))
            .min_by(|a, b| a.miss.length_squared().total_cmp(&b.miss.length_squared()))?;
        let place = search.solve(nearest)?;
        // What stands nearest may be where nothing has moved, though what is seen has.
        let own_motion_px = virtual_place.zip(at_rest).map_or(0.0, |(moved, rest)| moved.distance(rest));
        let most = NEAR_PX.max(2.0 * nearest.place_px.distance(center).max(own_motion_px));
        (place.distance(nearest.place_px) <= most).then_some(place)
    }
}

/// The search for the pixel whose ray leads to a target over the same mirrors and glass.
struct Search<'a> {
    other: &'a Moment<'a>,
    vertices: &'a [SpecularVertex],
    target: Target,
}

/// A place in the other picture.
#[derive(Clone, Copy)]
struct Aim {
    place_px: Vec2,
    /// [`Search::miss`].
    miss: Vec3A,
}

impl Search<'_> {
    fn aim(&self, place_px: Vec2) -> Option<Aim> {
        self.miss(place_px).map(|miss| Aim { place_px, miss })
    }

    /// By how much the last ray from a place misses the target, as a difference of unit directions; `None` where there
    /// is no such ray, or the target is behind it.
    fn miss(&self, place: Vec2) -> Option<Vec3A> {
        let last = self.other.tracer.follow_again(ray_through(&self.other.camera, place), self.vertices)?;
        let wanted = match self.target {
            Target::Point(position) => (Vec3A::from(position) - last.origin).normalize_or_zero(),
            Target::Direction(direction) => Vec3A::from(direction).normalize_or_zero(),
        };
        (wanted.dot(last.direction) > 0.0).then(|| last.direction - wanted)
    }

    /// Gauss and Newton's method with a derivative by differences at every step; `None` where it does not come to rest.
    fn solve(&self, mut aim: Aim) -> Option<Vec2> {
        const MAX_STEPS: usize = 12;
        const AT_REST_PX: f32 = 0.005;
        for _ in 0..MAX_STEPS {
            let step = self.step(aim)?;
            let next = self.shortened(aim, step)?;
            let moved = next.place_px.distance(aim.place_px);
            aim = next;
            if moved < AT_REST_PX && step.length() < 2.0 * AT_REST_PX {
                return Some(aim.place_px);
            }
        }
        None
    }

    /// To where the miss would be least, if it were linear.
    fn step(&self, aim: Aim) -> Option<Vec2> {
        let [by_x, by_y] = [Vec2::X, Vec2::Y].map(|axis| self.derivative(aim, axis));
        let (by_x, by_y) = (by_x?, by_y?);
        let (xx, xy, yy) = (by_x.dot(by_x), by_x.dot(by_y), by_y.dot(by_y));
        let determinant = xx * yy - xy * xy;
        // Where images fold, two of them meet and have no motion of their own.
        if determinant <= 1e-6 * (0.5 * (xx + yy)).powi(2) {
            return None;
        }
        let (x, y) = (by_x.dot(aim.miss), by_y.dot(aim.miss));
        Some(Vec2::new(xy * y - yy * x, xy * x - xx * y) / determinant)
    }

    /// Of the miss, a pixel along an axis, from whichever side has a ray.
    fn derivative(&self, aim: Aim, axis: Vec2) -> Option<Vec3A> {
        const STEP_PX: f32 = 0.25;
        let by = |step: f32| Some((self.miss(aim.place_px + step * axis)? - aim.miss) / step);
        [STEP_PX, -STEP_PX].into_iter().find_map(by)
    }

    /// The step, or the part of it after which the target is missed by less.
    fn shortened(&self, aim: Aim, step: Vec2) -> Option<Aim> {
        const MAX_HALVINGS: i32 = 5;
        // Where it is missed by rounding alone, no step makes it less.
        const ROUNDING: f32 = 1e-6;
        (0..=MAX_HALVINGS).find_map(|halving| {
            let next = self.aim(aim.place_px + step * 0.5_f32.powi(halving))?;
            (next.miss.length() <= aim.miss.length().max(ROUNDING)).then_some(next)
        })
    }
}

#[cfg(test)]
mod tests;
