//! Rays of the camera: perspective or orthographic, through a thin lens, from where it is while the shutter is open.

mod at;

use crate::geometry::Ray;
use crate::scene::{Camera, CameraAxes, Motion, Projection, ScreenWindow};
pub(super) use at::CameraAt;
use glam::{Vec2, Vec3, Vec3A};
use std::f32::consts::FRAC_PI_4;

/// A camera made ready for one picture size.
#[derive(Clone, Debug)]
pub struct CameraRays {
    position: Vec3,
    forward: Vec3,
    /// World vector of one pixel to the right: on the plane at distance 1, or in the scene where rays are parallel.
    pixel_right: Vec3,
    /// World vector of one pixel down, likewise.
    pixel_down: Vec3,
    /// Place in the picture, in pixels, through which the axis goes.
    center: Vec2,
    lens_right: Vec3,
    lens_up: Vec3,
    focus_distance: f32,
    parallel: bool,
    motion: Option<Motion>,
}

/// What a camera ray depends on.
#[derive(Clone, Copy, Debug)]
pub struct CameraSample {
    /// Position in the picture in pixels; (0, 0) is the top left corner.
    pub position_px: Vec2,
    /// Two numbers in [0, 1) for the point on the lens.
    pub lens: [f32; 2],
    /// Share of the open shutter, in [0, 1).
    pub time: f32,
}

/// Radii of lenses and distances of focus beyond this count as this, in scene units: their squares would be no numbers,
/// and no ray would have a direction. The rays through a pixel are parallel to the last bit long before.
const FARTHEST: f32 = 1e15;

impl CameraRays {
    /// Camera rays for a picture of `width` × `height` pixels.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let CameraAxes { forward, right, up } = camera.axes();
        let (half_height, parallel) = match camera.projection {
            Projection::Perspective { vertical_fov_deg } => ((vertical_fov_deg.to_radians() * 0.5).tan(), false),
            Projection::Orthographic { height } => (0.5 * height, true),
        };
        let size_px = Vec2::new(width as f32, height as f32);
        let window = camera.screen_window.unwrap_or(ScreenWindow::centered(size_px.x / size_px.y));
        let pixel = (window.max - window.min) / size_px;
        Self {
            position: camera.position,
            forward,
            pixel_right: right * (pixel.x * half_height),
            pixel_down: -up * (pixel.y * half_height),
            center: Vec2::new(-window.min.x, window.max.y) / pixel,
            lens_right: right * camera.aperture_radius.min(FARTHEST),
            lens_up: up * camera.aperture_radius.min(FARTHEST),
            focus_distance: camera.focus_distance.min(FARTHEST),
            parallel,
            motion: camera.motion.clone(),
        }
    }

    /// The ray of a sample.
    pub fn ray(&self, sample: &CameraSample) -> Ray {
        let offset = sample.position_px - self.center;
        let sideways = offset.x * self.pixel_right + offset.y * self.pixel_down;
        let on_lens = if self.lens_right == Vec3::ZERO {
            Vec3::ZERO
        } else {
            let disc = concentric_disc(sample.lens);
            self.lens_right * disc.x + self.lens_up * disc.y
        };
        let (origin, way) = if self.parallel {
            (self.position + sideways + on_lens, self.forward * self.focus_distance - on_lens)
        } else {
            (self.position + on_lens, (self.forward + sideways) * self.focus_distance - on_lens)
        };
        let (origin, direction) = (Vec3A::from(origin), Vec3A::from(way).normalize());
        let Some(motion) = &self.motion else {
            return Ray { time: sample.time, ..Ray::new(origin, direction) };
        };
        let moved = motion.at(sample.time);
        let direction = moved.transform_vector3a(direction).normalize();
        Ray { time: sample.time, ..Ray::new(moved.transform_point3a(origin), direction) }
    }

    /// Whether rays begin at more than one place: of a picture that is seen without perspective.
    pub(super) fn is_parallel(&self) -> bool {
        self.parallel
    }

    /// Whether it moves while the shutter is open.
    pub(super) fn moves(&self) -> bool {
        self.motion.is_some()
    }

    /// Whether rays begin all over a lens.
    pub(super) fn has_lens(&self) -> bool {
        self.lens_right != Vec3::ZERO
    }

    /// The camera at a share of the open shutter, in [0, 1].
    pub(super) fn at(&self, time: f32) -> CameraAt<'_> {
        CameraAt::new(self, time)
    }

    /// Place in the picture, in pixels, of a world position seen from the middle of the lens as the shutter opens;
    /// `None` at and behind the lens.
    pub fn project(&self, position: Vec3) -> Option<Vec2> {
        self.at(0.0).project(position)
    }

    /// Place in the picture, in pixels, of what is infinitely far in a world direction; `None` beside and behind the
    /// lens, and where rays are parallel.
    pub fn project_direction(&self, direction: Vec3) -> Option<Vec2> {
        self.at(0.0).project_direction(direction)
    }
}

/// Square to disc with little distortion (Shirley and Chiu 1997).
fn concentric_disc([u, v]: [f32; 2]) -> Vec2 {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if x == 0.0 && y == 0.0 {
        return Vec2::ZERO;
    }
    let (radius, angle) =
        if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, 2.0 * FRAC_PI_4 - FRAC_PI_4 * (x / y)) };
    radius * Vec2::from_angle(angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    fn camera(aperture_radius: f32) -> Camera {
        Camera {
            aperture_radius,
            focus_distance: 4.0,
            ..Camera::pinhole(Vec3::new(1.0, 2.0, 3.0), Vec3::NEG_Z, Vec3::Y, 90.0)
        }
    }

    fn ray(rays: &CameraRays, x: f32, y: f32, lens: [f32; 2], time: f32) -> (Vec3, Vec3) {
        let ray = rays.ray(&CameraSample { position_px: Vec2::new(x, y), lens, time });
        (ray.origin.into(), ray.direction.into())
    }

    #[test]
    fn corners_and_centre() {
        let rays = CameraRays::new(&camera(0.0), 200, 100);
        let at = |x, y| ray(&rays, x, y, [0.3, 0.8], 0.0).1;
        assert!(at(100.0, 50.0).distance(Vec3::NEG_Z) < 1e-6);
        // 90° vertically: the top middle looks up at 45°.
        assert!(at(100.0, 0.0).distance(Vec3::new(0.0, 1.0, -1.0).normalize()) < 1e-6);
        assert!(at(200.0, 50.0).distance(Vec3::new(2.0, 0.0, -1.0).normalize()) < 1e-6);
        let mirrored = CameraRays::new(&Camera { mirrored: true, ..camera(0.0) }, 200, 100);
        let left = ray(&mirrored, 200.0, 50.0, [0.5; 2], 0.0).1;
        assert!(left.distance(Vec3::new(-2.0, 0.0, -1.0).normalize()) < 1e-6);
    }

    /// A distance whose square is no number, as old files have for "never", left all rays without a
    /// direction; so did such a lens.
    #[test]
    fn rays_have_directions_however_far_the_focus_is() {
        for (aperture_radius, focus_distance) in [(0.0, 1e30), (0.1, f32::MAX), (1e37, 4.0), (f32::MAX, f32::MAX)] {
            let projections = [camera(0.0).projection, Projection::Orthographic { height: 6.0 }];
            for projection in projections {
                let rays =
                    CameraRays::new(&Camera { projection, aperture_radius, focus_distance, ..camera(0.0) }, 200, 100);
                let direction = ray(&rays, 100.0, 50.0, [0.3, 0.8], 0.0).1;
                assert!((direction.length() - 1.0).abs() < 1e-5, "{aperture_radius} {focus_distance}: {direction}");
                let is_forward = aperture_radius > 1.0 || direction.distance(Vec3::NEG_Z) < 1e-5;
                assert!(is_forward, "{aperture_radius} {focus_distance}: {direction}");
            }
        }
    }

    #[test]
    fn parallel_rays_start_across_the_height() {
        let projection = Projection::Orthographic { height: 6.0 };
        let rays = CameraRays::new(&Camera { projection, ..camera(0.0) }, 200, 100);
        for (x, y, expected) in [(100.0, 50.0, Vec3::ZERO), (200.0, 0.0, Vec3::new(6.0, 3.0, 0.0))] {
            let (origin, direction) = ray(&rays, x, y, [0.5; 2], 0.0);
            assert!(origin.distance(Vec3::new(1.0, 2.0, 3.0) + expected) < 1e-5 && direction == Vec3::NEG_Z);
        }
    }

    /// What a ray meets is projected to where the ray came from, at rest and at any moment of a motion.
    #[test]
    fn projection_undoes_rays() {
        let parallel = Camera { projection: Projection::Orthographic { height: 2.0 }, ..camera(0.5) };
        let motion = Motion::between(
            Affine3A::from_rotation_y(0.3) * Affine3A::from_translation(Vec3::new(0.2, -1.0, 0.5)),
            Affine3A::from_translation(Vec3::X * 2.0),
        );
        let moving = Camera { motion: Some(motion), ..camera(0.5) };
        let mirrored = Camera { mirrored: true, ..camera(0.5) };
        for of in [camera(0.5), parallel, moving, mirrored] {
            let rays = CameraRays::new(&of, 200, 100);
            for (x, y) in [(100.0, 50.0), (3.5, 8.25), (180.0, 99.0)] {
                for time in [0.0, 0.4, 1.0] {
                    let (origin, direction) = ray(&rays, x, y, [0.5; 2], time);
                    for distance in [0.5, 30.0] {
                        let place = rays.at(time).project(origin + direction * distance).expect("before the lens");
                        assert!(place.distance(Vec2::new(x, y)) < 2e-3, "{x} {y}: {place}");
                    }
                }
                let direction = ray(&rays, x, y, [0.5; 2], 0.0).1;
                let place = rays.project_direction(direction);
                assert_eq!(place.is_none(), rays.is_parallel(), "{x} {y}");
                assert!(place.is_none_or(|place| place.distance(Vec2::new(x, y)) < 2e-3), "{x} {y}: {place:?}");
                assert_eq!(rays.project_direction(-direction), None);
            }
        }
    }

    /// Whichever point of the lens a ray comes through, what it meets is projected to where it came from, as far from
    /// the middle as the circle of confusion is wide for that point.
    #[test]
    fn projection_undoes_rays_through_the_lens() {
        let parallel = Camera { projection: Projection::Orthographic { height: 2.0 }, ..camera(0.5) };
        let window = ScreenWindow { min: Vec2::new(-1.0, -1.0), max: Vec2::new(1.0, 1.0) };
        let oblong = Camera { screen_window: Some(window), ..camera(0.5) };
        let motion = Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(Vec3::new(2.0, 0.5, 1.0)));
        let moving = Camera { motion: Some(motion), ..camera(0.5) };
        for of in [camera(0.5), parallel, oblong, moving] {
            let (rays, time) = (CameraRays::new(&of, 200, 100), 0.7);
            let at = rays.at(time);
            for lens in [[0.5, 0.5], [0.0, 0.5], [0.5, 1.0], [0.9, 0.2]] {
                let (origin, direction) = ray(&rays, 120.0, 30.0, lens, time);
                for distance in [2.0, 4.0, 30.0] {
                    let position = origin + distance * direction;
                    let place = at.project_through(lens, position).expect("before the lens");
                    assert!(place.distance(Vec2::new(120.0, 30.0)) < 2e-3, "{lens:?} {distance}: {place}");
                    let from_middle = place - at.project(position).expect("before the lens");
                    let expected = concentric_disc(lens).abs() * at.blur_px(position);
                    assert!(from_middle.abs().distance(expected) < 4e-3, "{lens:?} {distance}: {from_middle}");
                }
            }
        }
    }

    /// A window's edges are where they say, in half heights, y up.
    #[test]
    fn a_screen_window_is_what_the_film_covers() {
        let screen_window = Some(ScreenWindow { min: Vec2::new(-0.5, 0.25), max: Vec2::new(1.5, 1.25) });
        let rays = CameraRays::new(&Camera { screen_window, ..camera(0.0) }, 200, 100);
        for (x, y, expected) in [(0.0, 0.0, Vec2::new(-0.5, 1.25)), (200.0, 100.0, Vec2::new(1.5, 0.25))] {
            let direction = ray(&rays, x, y, [0.5; 2], 0.0).1;
            assert!(direction.distance(expected.extend(-1.0).normalize()) < 1e-6, "{x} {y}: {direction}");
        }
    }

    #[test]
    fn every_lens_point_sees_the_same_point_in_focus() {
        let parallel = Camera { projection: Projection::Orthographic { height: 2.0 }, ..camera(0.5) };
        for rays in [CameraRays::new(&camera(0.5), 100, 100), CameraRays::new(&parallel, 100, 100)] {
            let in_focus = |lens| {
                let (origin, direction) = ray(&rays, 20.0, 70.0, lens, 0.0);
                origin + direction * ((origin.z + 1.0) / -direction.z)
            };
            let center = in_focus([0.5, 0.5]);
            for lens in [[0.0, 0.0], [0.99, 0.1], [0.2, 0.7]] {
                assert!(in_focus(lens).distance(center) < 1e-5, "{lens:?}");
            }
        }
    }

    #[test]
    fn a_moving_camera_is_where_its_motion_says() {
        let motion = Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(Vec3::X * 2.0));
        let rays = CameraRays::new(&Camera { motion: Some(motion), ..camera(0.0) }, 100, 100);
        let (origin, direction) = ray(&rays, 50.0, 50.0, [0.5; 2], 0.25);
        assert!(origin.distance(Vec3::new(1.5, 2.0, 3.0)) < 1e-6 && direction.distance(Vec3::NEG_Z) < 1e-6);
    }
}
