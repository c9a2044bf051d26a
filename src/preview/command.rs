//! What viewers and the preview say to each other, as JSON. What is done about it is left to `session`.

use super::layer::Layer;
use super::orbit::Movement;
use crate::output::PictureFormat;
use serde::{Deserialize, Serialize};

/// What a viewer asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case")]
pub(super) enum Command {
    /// Show another layer, to this viewer.
    Layer {
        /// Which.
        layer: Layer,
    },
    /// Show this layer beside the other, to this viewer; none shows the other alone.
    Beside {
        /// Which.
        layer: Option<Layer>,
    },
    /// Say what is at a pixel, to this viewer.
    Inspect {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// Rest between two batches.
    Pause,
    /// Go on, also after a stop.
    Resume,
    /// End with the picture so far.
    Stop,
    /// Throw all samples away.
    Restart,
    /// Write the picture into the working folder.
    Save {
        /// Format of the picture's file.
        format: PictureFormat,
    },
    /// Exposure correction in stops; none is the scene's.
    Exposure {
        /// Stops.
        stops: Option<f64>,
    },
    /// Another tone operator.
    Operator {
        /// Its name.
        name: String,
    },
    /// Another display, by its preset's name.
    Display {
        /// Its name.
        name: String,
    },
    /// Another distance from the display.
    Distance {
        /// Distance of the eyes, in distances that the display is made for.
        factor: f64,
    },
    /// Another visibility to stop at.
    Visibility {
        /// Visibility; 0 for as long as other limits let it.
        target: f64,
    },
    /// Move the camera.
    Camera {
        /// How.
        #[serde(flatten)]
        movement: Movement,
    },
    /// Bring what a pixel shows into focus.
    Focus {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// Somebody looks at a place of the picture, in pixels; nowhere in particular without one.
    Gaze {
        /// Column and row.
        at: Option<[f64; 2]>,
    },
    /// The camera of the scene.
    CameraHome,
    /// Frames are missing that somebody looks at. Not from viewers.
    #[serde(skip)]
    Redraw,
    /// The scene file has changed. Not from viewers.
    #[serde(skip)]
    Reload,
}

impl Command {
    /// Whether it makes work on the picture useless: a look at it need not be finished.
    pub(super) fn throws_the_picture_away(&self) -> bool {
        matches!(self, Self::Camera { .. } | Self::CameraHome | Self::Restart)
    }

    /// Whether it wants the picture that is there when it comes.
    pub(super) fn keeps_the_picture(&self) -> bool {
        matches!(self, Self::Save { .. })
    }

    /// Whether it makes an earlier one useless that nobody has obeyed yet: a slider says where it stands.
    pub(super) fn replaces(&self, earlier: &Self) -> bool {
        let is_setting = matches!(
            self,
            Self::Exposure { .. }
                | Self::Operator { .. }
                | Self::Display { .. }
                | Self::Distance { .. }
                | Self::Visibility { .. }
        );
        is_setting && std::mem::discriminant(self) == std::mem::discriminant(earlier)
    }

    /// Whether it leaves a camera in motion as it is: what else is asked for is asked of the picture at rest.
    pub(super) fn suits_motion(&self) -> bool {
        matches!(
            self,
            Self::Camera { .. }
                | Self::CameraHome
                | Self::Redraw
                | Self::Layer { .. }
                | Self::Beside { .. }
                | Self::Inspect { .. }
        )
    }
}

/// What the preview does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Phase {
    /// Few pixels for each place of a camera that moves.
    Moving,
    /// The loop.
    Rendering,
    /// Nothing, until somebody says to go on.
    Paused,
    /// The loop ended, or somebody ended it.
    Stopped,
}

/// The figures that a page shows beside the picture.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Status {
    pub(super) kind: &'static str,
    pub(super) scene: String,
    pub(super) phase: Phase,
    /// Why it stopped.
    pub(super) reason: Option<&'static str>,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) total_samples: u64,
    pub(super) mean_samples: f64,
    pub(super) samples_a_second: f64,
    pub(super) seconds: f64,
    /// Seconds to the first look, later to the rung.
    pub(super) seconds_left: Option<f64>,
    /// Samples of every pixel before the first look; not told.
    #[serde(skip)]
    pub(super) pilot_samples: u32,
    /// Share of pixels above the target at the last look.
    pub(super) visible_share: Option<f64>,
    pub(super) target: f64,
    /// Visibility that is being worked towards.
    pub(super) rung: Option<f64>,
    pub(super) exposure: Option<f64>,
    pub(super) operator: String,
    pub(super) operators: &'static [&'static str],
    pub(super) display: String,
    pub(super) displays: Vec<String>,
    /// Distance of the eyes, in distances that the display is made for.
    pub(super) distance: f64,
    pub(super) pixels_per_degree: f64,
    pub(super) camera: String,
    /// What went wrong and has not gone right since, a line each.
    pub(super) error: Option<String>,
    /// What was done last.
    pub(super) note: Option<String>,
    /// Whether the pointer stands for the gaze.
    pub(super) is_foveated: bool,
    /// Whether viewers may ask for more than a stop.
    pub(super) is_driven: bool,
}

/// What is at a pixel.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Inspected {
    pub(super) kind: &'static str,
    pub(super) x: usize,
    pub(super) y: usize,
    /// Linear RGB in scene units.
    pub(super) rgb: [f32; 3],
    pub(super) luminance_cd_m2: f32,
    pub(super) samples: u32,
    /// Standard error on the display that is at visibility 1, from the last look.
    pub(super) threshold_cd_m2: Option<f32>,
    pub(super) visibility: Option<f32>,
}
