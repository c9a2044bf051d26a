//! Where in the picture things are seen, at one moment while the shutter is open.

use super::{CameraRays, CameraSample, concentric_disc};
use crate::geometry::Ray;
use glam::{Affine3A, Vec2, Vec3};

/// A camera at one moment.
pub(in crate::integrator) struct CameraAt<'a> {
    camera: &'a CameraRays,
    /// Share of the open shutter.
    time: f32,
    /// To where the camera would see the same if it had not moved; `None` where it does not move.
    to_rest: Option<Affine3A>,
}

impl<'a> CameraAt<'a> {
    pub(super) fn new(camera: &'a CameraRays, time: f32) -> Self {
        Self { camera, time, to_rest: camera.motion.as_ref().map(|motion| motion.at(time).inverse()) }
    }

    /// The ray through a place in the picture, in pixels, and a point of the lens, by its [`CameraSample::lens`].
    pub(in crate::integrator) fn ray(&self, position_px: Vec2, lens: [f32; 2]) -> Ray {
        self.camera.ray(&CameraSample { position_px, lens, time: self.time })
    }

    /// The ray through a place in the picture, in pixels, and the middle of the lens.
    pub(in crate::integrator) fn ray_through(&self, position_px: Vec2) -> Ray {
        self.ray(position_px, [0.5; 2])
    }

    /// The way to a world position from where the rays begin that pass it; of any length.
    pub(in crate::integrator) fn way_to(&self, position: Vec3) -> Vec3 {
        let ray = self.project(position).map(|position_px| self.ray_through(position_px));
        ray.map_or(Vec3::ZERO, |ray| position - Vec3::from(ray.origin))
    }

    /// Place in the picture, in pixels, of a world position seen from the middle of the lens; `None` at and behind the
    /// lens.
    pub(in crate::integrator) fn project(&self, position: Vec3) -> Option<Vec2> {
        self.project_resting(self.resting(position))
    }

    /// Place in the picture, in pixels, of what is infinitely far in a world direction; `None` beside and behind the
    /// lens, and where rays are parallel.
    pub(super) fn project_direction(&self, direction: Vec3) -> Option<Vec2> {
        let direction = self.to_rest.map_or(direction, |to_rest| to_rest.transform_vector3(direction));
        if self.camera.parallel { None } else { self.project_way(direction) }
    }

    /// Place in the picture, in pixels, at which a point of the lens, by its [`CameraSample::lens`], sees a world
    /// position; `None` at and behind the lens.
    pub(in crate::integrator) fn project_through(&self, lens: [f32; 2], position: Vec3) -> Option<Vec2> {
        let position = self.resting(position);
        let middle = self.project_resting(position)?;
        let disc = concentric_disc(lens);
        let on_lens = self.camera.lens_right * disc.x + self.camera.lens_up * disc.y;
        Some(middle + self.to_pixels(-self.spread(self.depth_of(position)) * on_lens) - self.camera.center)
    }

    /// How far to the side and up, in pixels, the rays are spread through which the lens sees a world position: the
    /// half axes of its circle of confusion.
    pub(in crate::integrator) fn blur_px(&self, position: Vec3) -> Vec2 {
        let spread = self.spread(self.depth_of(self.resting(position))).abs();
        let along = |lens: Vec3, pixel: Vec3| spread * lens.length() / pixel.length();
        Vec2::new(
            along(self.camera.lens_right, self.camera.pixel_right),
            along(self.camera.lens_up, self.camera.pixel_down),
        )
    }

    fn resting(&self, position: Vec3) -> Vec3 {
        self.to_rest.map_or(position, |to_rest| to_rest.transform_point3(position))
    }

    fn project_resting(&self, position: Vec3) -> Option<Vec2> {
        let way = position - self.camera.position;
        if self.camera.parallel { Some(self.to_pixels(way)) } else { self.project_way(way) }
    }

    fn depth_of(&self, position: Vec3) -> f32 {
        (position - self.camera.position).dot(self.camera.forward)
    }

    /// What the rays through a point at this depth are spread by, on the plane that [`CameraRays::pixel_right`] is on,
    /// over their spread on the lens.
    fn spread(&self, depth: f32) -> f32 {
        let focus_distance = self.camera.focus_distance;
        if self.camera.parallel { 1.0 - depth / focus_distance } else { 1.0 / depth - 1.0 / focus_distance }
    }

    fn project_way(&self, way: Vec3) -> Option<Vec2> {
        let depth = way.dot(self.camera.forward);
        (depth > 1e-6 * way.length()).then(|| self.to_pixels(way / depth))
    }

    /// Pixels of a vector from the axis on the plane at distance 1, or in the scene where rays are parallel.
    fn to_pixels(&self, sideways: Vec3) -> Vec2 {
        let along = |pixel: Vec3| sideways.dot(pixel) / pixel.length_squared();
        self.camera.center + Vec2::new(along(self.camera.pixel_right), along(self.camera.pixel_down))
    }
}
