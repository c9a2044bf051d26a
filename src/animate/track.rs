//! The luminance track of a shot: how light the view is in every frame, and how the tone operator is set for it.
//!
//! Made before the frames, from small pilots of one fixed seed. Operators whose eyes adapt go through the shot in time;
//! all others are fitted once, to frames from all over it, so that exposure stands still while frames and noise change.

use super::budget::Needs;
use super::{SceneSource, ShotSettings};
use crate::adaptive::glimpse::glimpse;
use crate::checkpoint::PROGRAM;
use crate::denoise::Denoiser;
use crate::scene::Scene;
use crate::scene::hash::{ContentHash, content_hash};
use crate::scene::load::LoadError;
use fechner_perception::tone::{AdaptationState, Goal, SavedTone, SceneLight, ToneOperator};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Frames, spread over the shot, that one fit for all looks at.
const FITTED_FRAMES: usize = 16;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackFrame {
    /// Its number.
    pub frame: u32,
    /// The scene that it was made from.
    pub scene: ContentHash,
    /// Mean luminance of the view as the operator takes it, cd/m².
    pub goal: Goal,
    /// What the eye is adapted to, for operators that ask.
    pub eye: Option<AdaptationState>,
    /// The tone operator as set for this frame.
    pub fitted: SavedTone,
    /// Its share of the shot's budget, samples a pixel, where there is one.
    pub mean_samples: Option<u32>,
}

/// All frames of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// What besides the scenes it depends on, in words.
    pub made_for: String,
    /// In order.
    pub frames: Vec<TrackFrame>,
}

impl Track {
    /// Looks at every frame of a shot; `say` is told how many are done.
    ///
    /// # Errors
    /// For scenes that cannot be read.
    pub fn make(
        source: &dyn SceneSource,
        shot: &ShotSettings,
        operator: &dyn ToneOperator,
        say: &dyn Fn(usize),
    ) -> Result<Self, LoadError> {
        let mut looks = Vec::new();
        for frame in shot.first..=shot.last {
            let scene = source.at(shot.seconds(f64::from(frame)))?;
            let hash = content_hash(&scene);
            looks.push((hash, Look::at(scene, shot, operator)));
            say(looks.len());
        }
        let goals: Vec<Goal> = looks.iter().map(|(_, look)| look.goal(shot, operator)).collect();
        let fits: Vec<(Option<AdaptationState>, SavedTone)> = if operator.sees_adaptation() {
            let eyes = eyes(shot, operator, &goals);
            let fit = |look: &Look, eye: AdaptationState| {
                operator.fit(&enlarged(&[look], shot).guide(), &shot.viewing, Some(&eye)).save()
            };
            looks.iter().zip(eyes).map(|((_, look), eye)| (Some(eye), fit(look, eye))).collect()
        } else {
            let all = enlarged(&looks.iter().map(|(_, look)| look).collect::<Vec<_>>(), shot);
            let fitted = operator.fit(&all.guide(), &shot.viewing, None).save();
            looks.iter().map(|_| (None, fitted.clone())).collect()
        };
        let frames = (shot.first..=shot.last)
            .zip(looks.iter().zip(goals).zip(fits))
            .map(|(frame, (((scene, _), goal), (eye, fitted)))| TrackFrame {
                frame,
                scene: *scene,
                goal,
                eye,
                fitted,
                mean_samples: None,
            })
            .collect();
        Ok(Self { made_for: made_for(shot, operator), frames })
    }

    /// Gives each frame its share of a budget of so many samples a pixel on average.
    pub fn spread(&mut self, needs: &Needs, mean_samples: u32) {
        for (frame, share) in self.frames.iter_mut().zip(needs.shares(mean_samples)) {
            frame.mean_samples = Some(share);
        }
    }

    /// The frame's part, if the track is of this shot and the frame's scene is still the same.
    pub fn of_frame(
        &self,
        shot: &ShotSettings,
        operator: &dyn ToneOperator,
        frame: u32,
        scene: &Scene,
    ) -> Option<&TrackFrame> {
        let found = self.frames.iter().find(|of_track| of_track.frame == frame)?;
        (self.made_for == made_for(shot, operator) && found.scene == content_hash(scene)).then_some(found)
    }
}

fn made_for(shot: &ShotSettings, operator: &dyn ToneOperator) -> String {
    format!(
        "{}, frames {} to {} at {} a second, {}x{}, seed {}, {} cd/m² a unit, {} ({operator:?}), eye {:?}, \
         budget {:?}, {:?}, {:?}",
        PROGRAM,
        shot.first,
        shot.last,
        shot.frames_per_second,
        shot.trace.width,
        shot.trace.height,
        shot.trace.seed,
        shot.nits_per_unit,
        operator.name(),
        shot.adapted_to_cd_m2,
        shot.limits.mean_samples,
        // Whether frames may be paused, where they are looked at and what denoises them decides what they need of a budget.
        shot.limits.mean_samples.map(|_| {
            let denoiser = shot.denoiser.as_ref().map(Denoiser::name);
            (shot.sampling, shot.pausable, shot.limits, gaze_hash(shot), denoiser)
        }),
        shot.viewing,
    )
}

fn gaze_hash(shot: &ShotSettings) -> Option<ContentHash> {
    shot.gaze.as_ref().map(|gaze| ContentHash::of_bytes(format!("{gaze:?}").as_bytes()))
}

/// The eye in every frame.
fn eyes(shot: &ShotSettings, operator: &dyn ToneOperator, goals: &[Goal]) -> Vec<AdaptationState> {
    let kinetics = operator.kinetics();
    let mut state = match shot.adapted_to_cd_m2 {
        Some(cd_m2) => AdaptationState::adapted_to(Goal::both(cd_m2), &kinetics).looking_at(goals[0]),
        None => AdaptationState::adapted_to(goals[0], &kinetics),
    };
    let mut states = vec![state];
    for goal in &goals[1..] {
        state = state.after(*goal, 1.0 / shot.frames_per_second, &kinetics);
        states.push(state);
    }
    states
}

/// A small, denoised picture of a frame.
struct Look {
    light: SceneLight,
}

impl Look {
    fn at(scene: Arc<Scene>, shot: &ShotSettings, operator: &dyn ToneOperator) -> Self {
        // The same seed in every frame: what noise is left changes with the scene, not with the frame's number.
        Self { light: glimpse(scene, &shot.trace, shot.nits_per_unit, Some(operator)) }
    }

    fn goal(&self, shot: &ShotSettings, operator: &dyn ToneOperator) -> Goal {
        let scale = self.light.luminance_cd_m2().width() as f64 / f64::from(shot.trace.width);
        operator.goal(&self.light.guide(), shot.viewing.display.pixel_density().times(scale))
    }
}

/// Some of the looks, one below the other, at the frames' own size, as operators that count degrees need it.
fn enlarged(looks: &[&Look], shot: &ShotSettings) -> SceneLight {
    let count = looks.len().min(FITTED_FRAMES);
    let some: Vec<&SceneLight> = (0..count).map(|index| &looks[index * looks.len() / count].light).collect();
    SceneLight::stacked(&some, shot.trace.width as usize, shot.trace.height as usize)
}
