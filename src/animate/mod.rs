//! Shots: frames of a scene that moves, each rendered until what is left cannot be seen in motion.
//!
//! A frame is a pure function of the scene, its number and the shot's settings, so frames can be made in any order and
//! on any machine. What they share is the [`track`]: how light the view is over the shot, by which the tone operator is
//! fitted once (or, for operators with eyes that adapt, frame by frame), so that exposure does not flicker with the
//! noise. It is made from small pictures of fixed seed, and made again to the same bytes wherever it is missing.
//!
//! A [`budget`] of samples for the whole shot is spread by the track as well.
//!
//! Each frame's noise is its own. That is what the threshold model is told ([`FrameTiming`]): the eye integrates over
//! frames, and noise that is gone in the next frame may be stronger than in a still, unless somebody pauses.
//!
//! Not for stills: see [`crate::adaptive`].

pub mod budget;
pub mod eye;
pub mod gaze;
pub mod name;
mod pilots;
pub mod track;
pub mod velocity;
pub mod video;

use crate::adaptive::judge::JudgeError;
use crate::adaptive::settings::{Limits, LoopSettings, Sampling};
use crate::adaptive::{Monitor, Rendered, render};
use crate::denoise::Denoiser;
use crate::integrator::{PathTracer, TraceSettings};
use crate::sampler::hash_words;
use crate::scene::Scene;
use crate::scene::load::LoadError;
use eye::Eye;
use fechner_perception::csf::FrameTiming;
use fechner_perception::display::Viewing;
use fechner_perception::tone::ToneOperator;
use gaze::GazeTrack;
use std::sync::Arc;
use track::TrackFrame;
use velocity::{VelocityMap, VelocityOf};

/// Frames a second where nobody says how many: the cinema's.
pub const USUAL_FRAMES_PER_SECOND: f64 = 24.0;

/// Frames, spread over a shot, that one fit for all looks at: a look takes up to 2^20 samples.
const FITTED_FRAMES: usize = 16;

/// Places, among so many frames, of those that one fit for all looks at.
pub fn spread_over(frames: usize) -> impl Iterator<Item = usize> {
    let count = frames.min(FITTED_FRAMES);
    (0..count).map(move |place| place * frames / count)
}

/// Where the scenes of a shot come from.
pub trait SceneSource {
    /// The scene as it is at a time in seconds.
    ///
    /// # Errors
    /// For files that cannot be read.
    fn at(&self, seconds: f64) -> Result<Arc<Scene>, LoadError>;
}

/// What the frames of a shot share.
pub struct ShotSettings {
    /// First frame, at `first / frames_per_second` seconds.
    pub first: u32,
    /// Last frame.
    pub last: u32,
    /// Frames a second of scene time and of the display.
    pub frames_per_second: f64,
    /// Whether people may stop at a frame and look at it as at a still.
    pub pausable: bool,
    /// How every frame is traced; each has a seed of its own, made from this one.
    pub trace: TraceSettings,
    /// How samples are spread.
    pub sampling: Sampling,
    /// When a frame is done; `mean_samples` is a budget for each of them on average.
    pub limits: Limits,
    /// Display and observer.
    pub viewing: Viewing,
    /// Luminance in cd/m² of RGB (1, 1, 1).
    pub nits_per_unit: f64,
    /// What the eye is adapted to before the first frame, cd/m², for operators that ask; `None`: to the first frame.
    pub adapted_to_cd_m2: Option<f64>,
    /// Where the shot is looked at; `None`: anywhere.
    pub gaze: Option<GazeTrack>,
    /// What eyes do there. Shares of a budget for the whole shot are found for eyes at rest.
    pub eye: Eye,
    /// What makes each frame out of its mean; `None` leaves them raw.
    pub denoiser: Option<Denoiser>,
    /// Whose motion velocity maps tell in mirrors and glass.
    pub velocity_of: VelocityOf,
}

impl ShotSettings {
    /// Settings of frame 0 alone, spread adaptively, raw, for eyes that rest anywhere and are not told to pause.
    /// `trace` has the seed that frames' own are made from, `nits_per_unit` is the luminance in cd/m² of RGB (1, 1, 1).
    pub fn new(
        frames_per_second: f64,
        trace: TraceSettings,
        limits: Limits,
        viewing: Viewing,
        nits_per_unit: f64,
    ) -> Self {
        Self {
            first: 0,
            last: 0,
            frames_per_second,
            pausable: false,
            trace,
            sampling: Sampling::Adaptive,
            limits,
            viewing,
            nits_per_unit,
            adapted_to_cd_m2: None,
            gaze: None,
            eye: Eye::Rests,
            denoiser: None,
            velocity_of: VelocityOf::Surface,
        }
    }

    /// Time of a frame in seconds.
    pub fn seconds(&self, frame: f64) -> f64 {
        frame / self.frames_per_second
    }

    /// The loop's settings for one frame of the shot.
    pub fn frame_settings(&self, operator: Box<dyn ToneOperator>, track: &TrackFrame) -> LoopSettings {
        let timing = FrameTiming::nearest(self.frames_per_second, self.viewing.display.persistence);
        let gazes = self.gaze.as_ref().map(|gaze| gaze.of_frame(track.frame).to_vec());
        LoopSettings {
            sampling: self.sampling,
            gazes: gazes.unwrap_or_default(),
            limits: Limits { mean_samples: track.mean_samples.or(self.limits.mean_samples), ..self.limits },
            denoiser: self.denoiser.clone(),
            fitted: Some(track.fitted.clone()),
            frames: if self.pausable { None } else { Some(timing) },
            ..LoopSettings::new(&self.trace, self.viewing.clone(), self.nits_per_unit, operator)
        }
    }

    /// How a frame is traced: with a seed of its own.
    pub fn trace_settings(&self, frame: u32) -> TraceSettings {
        TraceSettings { seed: hash_words(self.trace.seed, u64::from(frame)), ..self.trace }
    }
}

/// One finished frame.
#[derive(Debug)]
pub struct RenderedFrame {
    /// Samples of the frame and the last look at them.
    pub rendered: Rendered,
    /// How what it shows moves to and from its neighbours.
    pub velocity: VelocityMap,
}

/// The scenes that a frame depends on.
pub struct FrameScenes {
    /// One frame earlier.
    pub previous: Arc<Scene>,
    /// The scene at the frame's time.
    pub now: Arc<Scene>,
    /// One frame later.
    pub next: Arc<Scene>,
}

impl FrameScenes {
    /// Loads all three.
    ///
    /// # Errors
    /// For files that cannot be read.
    pub fn load(source: &dyn SceneSource, shot: &ShotSettings, frame: u32) -> Result<Self, LoadError> {
        let at = |offset: f64| source.at(shot.seconds(f64::from(frame) + offset));
        Ok(Self { previous: at(-1.0)?, now: at(0.0)?, next: at(1.0)? })
    }

    /// How what a tracer of the frame's scene sees moves to and from its neighbours.
    pub fn velocity(&self, tracer: &PathTracer, of: VelocityOf) -> VelocityMap {
        match of {
            VelocityOf::Image if tracer.has_specular_surfaces() => {
                let [previous, next] =
                    [&self.previous, &self.next].map(|scene| PathTracer::new(Arc::clone(scene), *tracer.settings()));
                VelocityMap::of_images(tracer, &previous, &next)
            }
            VelocityOf::Image | VelocityOf::Surface => VelocityMap::new(tracer, &self.previous, &self.next),
        }
    }
}

/// Renders one frame; `settings` are told how the eye moves in it.
///
/// # Errors
/// If the denoiser fails, or the perception model refuses the picture, which would be a defect of ours.
pub fn render_frame(
    scenes: &FrameScenes,
    shot: &ShotSettings,
    settings: &mut LoopSettings,
    frame: u32,
    monitor: &dyn Monitor,
) -> Result<RenderedFrame, JudgeError> {
    let tracer = PathTracer::new(Arc::clone(&scenes.now), shot.trace_settings(frame));
    let velocity = scenes.velocity(&tracer, shot.velocity_of);
    settings.pursuit = shot.pursuit(frame, &velocity)?;
    let rendered = render(&tracer, settings, monitor)?;
    Ok(RenderedFrame { rendered, velocity })
}
