//! What a file's camera shows in a picture of another aspect than the file's.

use crate::scene::{Camera, FilmDefaults, ScreenWindow};
use glam::Vec2;

/// Widest and highest picture that a file may ask for.
pub(super) const LONGEST_SIDE: u32 = 32_768;

/// How a camera's view follows the picture's aspect, which is width over height throughout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Framing {
    /// Not beyond what every camera does: without a window its height stays, a window is stretched.
    Fixed,
    /// As the file states: a film of no other aspect takes it, and a narrower one shows more above and below, so that
    /// nothing at its sides is lost.
    Stated(f32),
    /// Its window was made for a picture of aspect `film` that is a part of one of aspect `whole`. The axis of the
    /// whole keeps what it spans, and the window changes with it about the principal point.
    Spanning { axis: FilmAxis, film: f32, whole: f32 },
}

/// What of a film a field of view is given for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FilmAxis {
    X,
    Y,
    Smaller,
    Larger,
    Diagonal,
}

impl FilmAxis {
    /// Length of the axis in heights of a film of this aspect.
    pub(super) fn length(self, aspect: f32) -> f32 {
        match self {
            Self::X => aspect,
            Self::Y => 1.0,
            Self::Smaller => aspect.min(1.0),
            Self::Larger => aspect.max(1.0),
            Self::Diagonal => aspect.hypot(1.0),
        }
    }

    /// Half of what a film of this aspect spans on the image plane where the axis spans [−1, 1].
    pub(super) fn half_size(self, aspect: f32) -> Vec2 {
        Vec2::new(aspect, 1.0) / self.length(aspect)
    }
}

impl Framing {
    /// The aspect that the picture has unless somebody asks for another one.
    pub(super) fn stated(self) -> Option<f32> {
        match self {
            Self::Stated(aspect) => Some(aspect),
            _ => None,
        }
    }

    /// The camera for a picture of this size.
    pub(super) fn fit(self, camera: Camera, FilmDefaults { width, height }: FilmDefaults) -> Camera {
        let aspect = width as f32 / height as f32;
        match self {
            Self::Fixed => camera,
            Self::Stated(stated) => camera.heightened(stated / aspect),
            Self::Spanning { axis, film, whole } => {
                stretched(camera, film, axis.half_size(whole * aspect / film) / axis.half_size(whole))
            }
        }
    }
}

/// The window, else the one that a film of this aspect has, times so much about the principal point.
fn stretched(camera: Camera, film: f32, times: Vec2) -> Camera {
    if (times - 1.0).abs().max_element() < 1e-6 {
        return camera;
    }
    let ScreenWindow { min, max } = camera.screen_window.unwrap_or(ScreenWindow::centered(film));
    Camera { screen_window: Some(ScreenWindow { min: min * times, max: max * times }), ..camera }
}
