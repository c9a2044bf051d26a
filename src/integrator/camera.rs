//! Rays of a thin-lens camera.

use crate::geometry::Ray;
use crate::scene::Camera;
use glam::{Vec2, Vec3, Vec3A};
use std::f32::consts::FRAC_PI_4;

/// A camera made ready for one picture size.
#[derive(Clone, Debug)]
pub struct CameraRays {
    position: Vec3,
    forward: Vec3,
    /// World vector of one pixel to the right, on the plane at distance 1.
    pixel_right: Vec3,
    /// World vector of one pixel down, on the plane at distance 1.
    pixel_down: Vec3,
    center: Vec2,
    lens_right: Vec3,
    lens_up: Vec3,
    focus_distance: f32,
}

impl CameraRays {
    /// For a picture of `width` × `height` square pixels.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let forward = camera.forward.normalize_or(Vec3::NEG_Z);
        let right = forward.cross(camera.up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let up = right.cross(forward);
        let pixel = 2.0 * (camera.vertical_fov_deg.to_radians() * 0.5).tan() / height as f32;
        Self {
            position: camera.position,
            forward,
            pixel_right: right * pixel,
            pixel_down: -up * pixel,
            center: Vec2::new(width as f32, height as f32) * 0.5,
            lens_right: right * camera.aperture_radius,
            lens_up: up * camera.aperture_radius,
            focus_distance: camera.focus_distance,
        }
    }

    /// The ray through a position of the picture in pixels (0, 0 is the top left corner) and a point of the lens.
    pub fn ray(&self, position_px: Vec2, lens: [f32; 2]) -> Ray {
        let offset = position_px - self.center;
        let through = self.forward + offset.x * self.pixel_right + offset.y * self.pixel_down;
        let disc = concentric_disc(lens);
        let on_lens = self.lens_right * disc.x + self.lens_up * disc.y;
        let direction = (through * self.focus_distance - on_lens).normalize();
        Ray { origin: Vec3A::from(self.position + on_lens), direction: direction.into() }
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

    fn camera(aperture_radius: f32) -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            forward: Vec3::NEG_Z,
            up: Vec3::Y,
            vertical_fov_deg: 90.0,
            aperture_radius,
            focus_distance: 4.0,
        }
    }

    #[test]
    fn corners_and_centre() {
        let rays = CameraRays::new(&camera(0.0), 200, 100);
        let at = |x, y| Vec3::from(rays.ray(Vec2::new(x, y), [0.3, 0.8]).direction);
        assert!(at(100.0, 50.0).distance(Vec3::NEG_Z) < 1e-6);
        // 90° vertically: the top middle looks up at 45°.
        assert!(at(100.0, 0.0).distance(Vec3::new(0.0, 1.0, -1.0).normalize()) < 1e-6);
        assert!(at(200.0, 50.0).distance(Vec3::new(2.0, 0.0, -1.0).normalize()) < 1e-6);
    }

    #[test]
    fn every_lens_point_sees_the_same_point_in_focus() {
        let rays = CameraRays::new(&camera(0.5), 100, 100);
        let in_focus = |lens| {
            let ray = rays.ray(Vec2::new(20.0, 70.0), lens);
            Vec3::from(ray.origin + ray.direction * ((ray.origin.z + 1.0) / -ray.direction.z))
        };
        let center = in_focus([0.5, 0.5]);
        for lens in [[0.0, 0.0], [0.99, 0.1], [0.2, 0.7]] {
            assert!(in_focus(lens).distance(center) < 1e-5, "{lens:?}");
        }
    }
}
