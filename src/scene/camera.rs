//! The camera: where it is, how it projects, its lens and its motion.

use super::Motion;
use glam::{Vec2, Vec3};
use std::ops::RangeInclusive;

/// A camera that looks along `forward` with `up` towards the top of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens, world space.
    pub position: Vec3,
    /// Unit viewing direction.
    pub forward: Vec3,
    /// Up vector, need not be perpendicular to `forward`, not parallel to it.
    pub up: Vec3,
    /// How directions or positions become places in the picture.
    pub projection: Projection,
    /// The part of the image plane that the film covers; `None`: the middle, pixels square.
    pub screen_window: Option<ScreenWindow>,
    /// Whether left and right are exchanged, as by a camera transform that mirrors (pbrt's `Scale -1 1 1`).
    pub mirrored: bool,
    /// Radius of the lens in scene units; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance of the plane in focus along `forward`, scene units, above 0.
    pub focus_distance: f32,
    /// Moves the whole camera (rotation and translation) while the shutter is open; `None` where it rests.
    pub motion: Option<Motion>,
}

/// Parallel or central projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Central.
    Perspective {
        /// Full vertical field of view in degrees, in (0, 180); loaders keep to [`Camera::FOV_DEG`].
        vertical_fov_deg: f32,
    },
    /// Parallel.
    Orthographic {
        /// Full height of what is seen, scene units, above 0.
        height: f32,
    },
}

/// A rectangle on the image plane, y up. The unit is half the picture's height: without a window the film of aspect a
/// covers [−a, a] × [−1, 1]. A film of another aspect than its window's has pixels that are not square (as in pbrt).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenWindow {
    /// Left and bottom edges.
    pub min: Vec2,
    /// Right and top edges, above `min` in both.
    pub max: Vec2,
}

/// Unit directions of a camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraAxes {
    /// Direction into the picture.
    pub forward: Vec3,
    /// Along its rows, from left to right.
    pub right: Vec3,
    /// Along its columns, from below to above.
    pub up: Vec3,
}

/// Direction to the right of who looks along `forward`; any right where `up` is parallel to it.
pub(crate) fn right_of(forward: Vec3, up: Vec3) -> Vec3 {
    forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector())
}

impl Camera {
    /// Full fields of view in degrees that a file or a command may ask for.
    pub const FOV_DEG: RangeInclusive<f64> = 0.001..=179.0;

    /// Full vertical field of view, degrees, of cameras that nothing is said of.
    pub const USUAL_FOV_DEG: f32 = 40.0;

    /// Whether two unit vectors are far enough from parallel to say how a picture lies.
    pub fn axes_span(forward: Vec3, up: Vec3) -> bool {
        forward.cross(up).length() >= 1e-5
    }

    /// Where it looks and how the picture lies; any right and up where `up` is parallel to `forward`.
    pub fn axes(&self) -> CameraAxes {
        let forward = self.forward.normalize_or(Vec3::NEG_Z);
        let right = right_of(forward, self.up);
        let up = right.cross(forward);
        CameraAxes { forward, right: if self.mirrored { -right } else { right }, up }
    }

    /// A pinhole of central projection at rest, focused (should it get a lens) at distance 1.
    pub fn pinhole(position: Vec3, forward: Vec3, up: Vec3, vertical_fov_deg: f32) -> Self {
        Self::placed(position, forward, up, Projection::Perspective { vertical_fov_deg })
    }

    /// A pinhole at rest, focused as [`Self::pinhole`].
    pub fn placed(position: Vec3, forward: Vec3, up: Vec3, projection: Projection) -> Self {
        Self {
            position,
            forward,
            up,
            projection,
            screen_window: None,
            mirrored: false,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            motion: None,
        }
    }

    /// This camera with a view so many times as high, but never lower than it is.
    pub fn heightened(self, times: f32) -> Self {
        let times = times.max(1.0);
        let projection = match self.projection {
            _ if times == 1.0 => self.projection,
            Projection::Orthographic { height } => Projection::Orthographic { height: height * times },
            Projection::Perspective { vertical_fov_deg } => {
                let half_height = (0.5 * vertical_fov_deg.to_radians()).tan() * times;
                Projection::Perspective { vertical_fov_deg: 2.0 * half_height.atan().to_degrees() }
            }
        };
        Self { projection, ..self }
    }
}

impl ScreenWindow {
    /// What a film of this aspect (width / height) covers when no window is given.
    pub fn centered(aspect: f32) -> Self {
        Self { min: Vec2::new(-aspect, -1.0), max: Vec2::new(aspect, 1.0) }
    }
}
