//! Who is shown what viewers see, inside the same program: other viewers' protocols, and measurements.

use super::screen::Looked;
use crate::film::Film;

/// A spectator, who is shown each frame on the render's own thread, and so must be quick.
pub trait Spectator: Send {
    /// A frame.
    fn shown(&mut self, shown: &Shown<'_>);
}

/// A frame and what it was made from.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Samples; while the camera moves, of fewer pixels than the picture has.
    pub film: &'a Film,
    /// The picture, linear RGB in cd/m², of the film's size: where a pixel has no samples, another's;
    /// denoised where asked for.
    pub rgb_cd_m2: &'a [[f32; 3]],
    /// Pixels of the picture to each of the film's, each way.
    pub step: u32,
    /// What the last look saw, once there was one.
    pub looked: Option<&'a Looked>,
    /// Luminance in cd/m² of RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// Whether it will change.
    pub stage: Stage,
}

/// Whether a picture will change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Samples go into it.
    UnderWay,
    /// Not unless somebody asks for it.
    AtRest,
}
