//! The camera in somebody's hand: movements, and where they bring it. It renders nothing.

use crate::scene::{Camera, CameraAxes, Projection};
use glam::{Quat, Vec3};
use serde::Deserialize;
use std::f32::consts::FRAC_PI_2;
use std::fmt::Write as _;

/// A movement of the camera about the point that it looks at.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub(super) enum Movement {
    /// Around the point, in radians.
    Orbit {
        /// To the right of what is seen.
        right: f32,
        /// Over it.
        up: f32,
    },
    /// With the point, in heights of what is shown.
    Pan {
        /// To the right.
        right: f32,
        /// Up.
        up: f32,
    },
    /// Towards the point: each step leaves nine tenths of the way.
    Dolly {
        /// Steps; below 0 away from it.
        steps: f32,
    },
    /// Field of view: each step leaves nine tenths of it.
    Zoom {
        /// Steps; below 0 to see more.
        steps: f32,
    },
    /// What is in focus: each step brings it a twentieth of its distance nearer.
    Refocus {
        /// Steps; below 0 away.
        steps: f32,
    },
    /// The lens: each step widens it by a quarter; a pinhole becomes a lens first.
    Aperture {
        /// Steps; below 0 narrower.
        steps: f32,
    },
}

impl Movement {
    /// This movement told in heights of a part of the picture; `height`: of the part, in heights of the whole.
    pub(super) fn in_part(self, height: f32) -> Self {
        match self {
            Self::Pan { right, up } => Self::Pan { right: right * height, up: up * height },
            other => other,
        }
    }
}

/// Width of the lens that a pinhole becomes, in distances of what it looks at.
const FIRST_APERTURE: f32 = 0.005;
/// Fields of view that zooming stays within, in degrees.
const FIELDS_OF_VIEW_DEG: [f32; 2] = [1.0, 150.0];
/// The same for parallel rays, in heights of what the scene's own camera sees.
const TIMES_HOME_HEIGHT: [f32; 2] = [1e-3, 1e3];
/// Steps that one movement may take.
const MAX_STEPS: f32 = 20.0;

/// A camera and the distance of the point about which it turns.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub(super) camera: Camera,
    pub(super) pivot_distance: f32,
    /// Whether that is what the scene has there, and not what was in focus.
    pub(super) knows_pivot: bool,
    /// Whether it is as the scene has it.
    pub(super) is_home: bool,
    /// How the scene's own camera projects.
    home_projection: Projection,
}

impl Held {
    /// Where the scene has put it; it turns about what is in focus until something better is known.
    pub(super) fn at_home(camera: &Camera) -> Self {
        Self {
            camera: camera.clone(),
            pivot_distance: camera.focus_distance,
            knows_pivot: false,
            is_home: true,
            home_projection: camera.projection,
        }
    }

    /// Moves it. A camera that moved while its shutter was open rests from here on.
    pub(super) fn moved(&mut self, movement: Movement) {
        let before = self.clone();
        self.camera.motion = None;
        self.is_home = false;
        match movement {
            Movement::Orbit { right, up } => self.orbit(right, up),
            Movement::Pan { right, up } => self.pan(right, up),
            Movement::Dolly { steps } => self.dolly(steps),
            Movement::Zoom { steps } => self.zoom(steps),
            Movement::Refocus { steps } => self.camera.focus_distance *= power(0.95, steps),
            Movement::Aperture { steps } => self.widen(steps),
        }
        let Camera { position, forward, focus_distance, .. } = &self.camera;
        let distances = [self.pivot_distance, *focus_distance];
        if !(position.is_finite() && forward.is_finite() && distances.iter().all(|distance| distance.is_normal())) {
            *self = before;
        }
    }

    /// Brings what is so far along the axis into focus.
    pub(super) fn focus_at(&mut self, distance: f32) {
        self.camera.focus_distance = distance;
        self.is_home = false;
    }

    /// Whether it sees from where this camera sees, and moves as it does, whatever is in focus.
    pub(super) fn stands_like(&self, camera: &Camera) -> bool {
        let Camera { aperture_radius, focus_distance, .. } = *camera;
        Camera { aperture_radius, focus_distance, ..self.camera.clone() } == *camera
    }

    fn orbit(&mut self, right: f32, up: f32) {
        /// How near to the pole the camera may come, in radians.
        const POLE: f32 = 0.02;
        let CameraAxes { forward, right: sideways, .. } = self.camera.axes();
        let pole = self.camera.up.normalize_or(Vec3::Y);
        let pivot = self.camera.position + forward * self.pivot_distance;
        // To the right of what is seen, which a mirror shows at the left.
        let right = if self.camera.mirrored { -right } else { right };
        let elevation = FRAC_PI_2 - (-forward).angle_between(pole);
        let up = (elevation + up).clamp(POLE - FRAC_PI_2, FRAC_PI_2 - POLE) - elevation;
        let turn =
            Quat::from_axis_angle(pole, right) * Quat::from_axis_angle(forward.cross(pole).normalize_or(sideways), -up);
        self.camera.forward = (turn * forward).normalize_or(forward);
        self.camera.position = pivot - self.camera.forward * self.pivot_distance;
    }

    fn pan(&mut self, right: f32, up: f32) {
        let CameraAxes { right: sideways, up: upwards, .. } = self.camera.axes();
        let height = match self.camera.projection {
            Projection::Perspective { vertical_fov_deg } => {
                2.0 * self.pivot_distance * (0.5 * vertical_fov_deg.to_radians()).tan()
            }
            Projection::Orthographic { height } => height,
        };
        let height = height * self.camera.screen_window.map_or(1.0, |window| 0.5 * (window.max.y - window.min.y));
        self.camera.position += (sideways * right + upwards * up) * height;
    }

    fn zoom(&mut self, steps: f32) {
        let factor = power(0.9, steps);
        match &mut self.camera.projection {
            Projection::Orthographic { height } => *height = bounded(*height * factor, self.home_projection),
            Projection::Perspective { vertical_fov_deg } => {
                let [least, most] = FIELDS_OF_VIEW_DEG;
                *vertical_fov_deg = (*vertical_fov_deg * factor).clamp(least, most);
            }
        }
    }

    fn widen(&mut self, steps: f32) {
        let first = FIRST_APERTURE * self.pivot_distance;
        let radius = if self.camera.aperture_radius > 0.0 {
            self.camera.aperture_radius * power(1.25, steps)
        } else if steps > 0.0 {
            first
        } else {
            0.0
        };
        // Narrower than a tenth of the first lens nothing looks unsharp.
        self.camera.aperture_radius = if radius < 0.1 * first { 0.0 } else { radius.min(self.pivot_distance) };
    }

    fn dolly(&mut self, steps: f32) {
        let factor = power(0.9, steps);
        if let Projection::Orthographic { height } = &mut self.camera.projection {
            *height = bounded(*height * factor, self.home_projection);
            return;
        }
        let CameraAxes { forward, .. } = self.camera.axes();
        let way = self.pivot_distance * (1.0 - factor);
        self.camera.position += forward * way;
        self.pivot_distance -= way;
        // What was in focus stays so, unless the camera went through it.
        let focus = self.camera.focus_distance - way;
        self.camera.focus_distance = if focus > 1e-3 * self.pivot_distance { focus } else { self.pivot_distance };
    }

    /// The camera as a scene file has it, with a shutter that stays open for so many seconds.
    pub(super) fn to_toml(&self, shutter_s: f64) -> String {
        let camera = &self.camera;
        let numbers = |v: Vec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        let mut text = format!(
            "[camera]\nposition = {}\nlook_at = {}\nup = {}\n",
            numbers(camera.position),
            numbers(camera.position + camera.forward * self.pivot_distance),
            numbers(camera.up)
        );
        let _ = match camera.projection {
            Projection::Perspective { vertical_fov_deg } => writeln!(text, "vertical_fov_deg = {vertical_fov_deg:?}"),
            Projection::Orthographic { height } => writeln!(text, "orthographic_height = {height:?}"),
        };
        if let Some(window) = camera.screen_window {
            let (min, max) = (window.min, window.max);
            let _ = writeln!(text, "screen_window = [{:?}, {:?}, {:?}, {:?}]", min.x, max.x, min.y, max.y);
        }
        if camera.mirrored {
            text.push_str("mirrored = true\n");
        }
        if camera.aperture_radius > 0.0 {
            let _ = writeln!(text, "aperture_radius = {:?}", camera.aperture_radius);
            let _ = writeln!(text, "focus_distance = {:?}", camera.focus_distance);
        }
        if shutter_s > 0.0 {
            let _ = writeln!(text, "shutter_s = {shutter_s:?}");
        }
        text
    }
}

/// A height that can be rendered: without bounds it becomes 0, or rays begin so far away that all memory is taken.
fn bounded(height: f32, home: Projection) -> f32 {
    match home {
        Projection::Orthographic { height: home } if home.is_finite() => {
            let [least, most] = TIMES_HOME_HEIGHT.map(|times| (times * home).clamp(f32::MIN_POSITIVE, f32::MAX));
            height.clamp(least, most)
        }
        Projection::Orthographic { .. } | Projection::Perspective { .. } => height,
    }
}

/// What so many steps multiply by; 1 for steps that are no number.
fn power(base: f32, steps: f32) -> f32 {
    base.powf(if steps.is_nan() { 0.0 } else { steps.clamp(-MAX_STEPS, MAX_STEPS) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held() -> Held {
        Held {
            camera: Camera::pinhole(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z, Vec3::Y, 90.0),
            pivot_distance: 5.0,
            knows_pivot: true,
            is_home: true,
            home_projection: Projection::Perspective { vertical_fov_deg: 90.0 },
        }
    }

    /// A mirrored camera shows the mirror image of what another shows, wherever both are moved, and its text says that
    /// it does.
    #[test]
    fn mirrored_cameras_move_as_they_show() {
        let mut plain = held();
        let mut mirrored = Held { camera: Camera { mirrored: true, ..plain.camera.clone() }, ..plain.clone() };
        for movement in [Movement::Orbit { right: 0.4, up: 0.2 }, Movement::Pan { right: 0.1, up: 0.1 }] {
            plain.moved(movement);
            mirrored.moved(movement);
        }
        let (a, b) = (plain.camera.position, mirrored.camera.position);
        // The picture's middle column is the plane x = 0 at first.
        assert!(b.distance(Vec3::new(-a.x, a.y, a.z)) < 1e-5, "{a} {b}");
        assert!(mirrored.to_toml(0.0).contains("\nmirrored = true\n") && !plain.to_toml(0.0).contains("mirrored"));
    }

    /// What moves in the scene blurs before a camera that was copied as it did before the one that it was copied from.
    #[test]
    fn the_shutter_is_written_down_where_it_is_open() {
        assert!(held().to_toml(0.0208).ends_with("\nshutter_s = 0.0208\n"));
        assert!(!held().to_toml(0.0).contains("shutter"));
    }

    /// Zooms and dollies without end stay at heights that can be rendered, and come back.
    #[test]
    fn parallel_rays_keep_a_height() {
        let projection = Projection::Orthographic { height: 2.0 };
        let home = Camera { projection, ..held().camera };
        let after = |movement: Movement| {
            let mut held = Held::at_home(&home);
            (0..100).for_each(|_| held.moved(movement));
            held.camera.projection
        };
        let height = |height: f32| Projection::Orthographic { height };
        for (near, far) in [
            (Movement::Zoom { steps: 20.0 }, Movement::Zoom { steps: -20.0 }),
            (Movement::Dolly { steps: 20.0 }, Movement::Dolly { steps: -20.0 }),
        ] {
            assert_eq!((after(near), after(far)), (height(2e-3), height(2e3)));
        }
    }

    #[test]
    fn an_orbit_keeps_the_point_and_stops_at_the_pole() {
        let mut held = held();
        held.moved(Movement::Orbit { right: FRAC_PI_2, up: 0.0 });
        assert!(held.camera.position.distance(Vec3::new(5.0, 0.0, 0.0)) < 1e-4, "{}", held.camera.position);
        held.moved(Movement::Orbit { right: 0.0, up: 0.5 });
        let height = held.camera.position.y;
        assert!((height - 5.0 * 0.5f32.sin()).abs() < 1e-3, "{height}");
        held.moved(Movement::Orbit { right: 0.3, up: 9.0 });
        let pivot = held.camera.position + held.camera.forward * held.pivot_distance;
        assert!(pivot.length() < 1e-4 && held.camera.position.y < 5.0 && held.camera.position.y > 4.99, "{pivot}");
    }

    #[test]
    fn lenses_zoom_focus_and_open() {
        let mut held = held();
        held.camera.focus_distance = 4.0;
        held.moved(Movement::Zoom { steps: 1.0 });
        assert_eq!(held.camera.projection, Projection::Perspective { vertical_fov_deg: 81.0 });
        held.moved(Movement::Zoom { steps: -1e9 });
        assert_eq!(held.camera.projection, Projection::Perspective { vertical_fov_deg: 150.0 });
        held.moved(Movement::Refocus { steps: 1.0 });
        assert!((held.camera.focus_distance - 3.8).abs() < 1e-5, "{}", held.camera.focus_distance);
        held.moved(Movement::Aperture { steps: -1.0 });
        assert_eq!(held.camera.aperture_radius, 0.0);
        held.moved(Movement::Aperture { steps: 1.0 });
        assert!((held.camera.aperture_radius - 0.025).abs() < 1e-6, "{}", held.camera.aperture_radius);
        held.moved(Movement::Aperture { steps: -20.0 });
        assert_eq!(held.camera.aperture_radius, 0.0, "a narrow lens becomes a pinhole again");
        held.moved(Movement::Refocus { steps: f32::NAN });
        assert!(held.camera.focus_distance.is_finite());
    }

    #[test]
    fn pans_and_dollies_are_of_the_right_size() {
        let mut held = held();
        held.moved(Movement::Pan { right: 0.1, up: 0.2 });
        assert!(held.camera.position.distance(Vec3::new(1.0, 2.0, 5.0)) < 1e-4, "{}", held.camera.position);
        held.moved(Movement::Dolly { steps: 1.0 });
        assert!(held.camera.position.distance(Vec3::new(1.0, 2.0, 4.5)) < 1e-4, "{}", held.camera.position);
        held.moved(Movement::Pan { right: f32::NAN, up: 0.0 });
        held.moved(Movement::Dolly { steps: f32::INFINITY });
        assert!(held.camera.position.is_finite() && held.pivot_distance > 0.0);
    }
}
