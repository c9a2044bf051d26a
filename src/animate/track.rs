//! The luminance track of a shot: how light the view is in every frame, and how the tone operator is set for it.
//!
//! Made before the frames, from small pictures of one fixed seed, with as many samples as it takes until they are
//! steady. Operators whose eyes adapt go through the shot in time; all others are fitted once, to frames from all over
//! it, so that exposure stands still while frames and noise change, and look at no more of them.

use super::budget::Needs;
use super::{SceneSource, ShotSettings, spread_over};
use crate::adaptive::glimpse::{coarse_glimpse_for, steady_glimpse_for};
use crate::checkpoint::PROGRAM;
use crate::denoise::Denoiser;
use crate::integrator::TraceSettings;
use crate::scene::Scene;
use crate::scene::hash::{ContentHash, content_hash};
use crate::scene::load::LoadError;
use fechner_perception::tone::{AdaptationState, Goal, SavedTone, SceneLight, ToneOperator};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Change of what an eye adapts to, by a doubling of the last samples, from which on noise takes more of it than few
/// pixels would add: on our other scenes it is below 0.025, and a coarse glimpse adapts eyes to 1 to 5 % more light,
/// 18 % on `scenes/many-lights.toml`.
const UNSETTLED: f32 = 0.05;

/// One frame of the track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackFrame {
    /// Number of the frame.
    pub frame: u32,
    /// The scene that it was made from.
    pub scene: ContentHash,
    /// Mean luminance of the view as the operator takes it, cd/m², where the frame was looked at.
    pub goal: Option<Goal>,
    /// What the eye is adapted to, for operators that ask.
    pub eye: Option<AdaptationState>,
    /// The tone operator as set for this frame.
    pub fitted: SavedTone,
    /// Share of the frame in the shot's budget, samples a pixel, where there is one.
    pub mean_samples: Option<u32>,
}

/// All frames of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// What besides the scenes it depends on, in words.
    pub made_for: String,
    /// The frames in order.
    pub frames: Vec<TrackFrame>,
}

impl Track {
    /// Looks at the frames of a shot that the operator needs; `say` is told how many frames are done, from 1
    /// on again in a second round.
    ///
    /// # Errors
    /// For scenes that cannot be read.
    pub fn make(
        source: &dyn SceneSource,
        shot: &ShotSettings,
        operator: &dyn ToneOperator,
        say: &dyn Fn(usize),
    ) -> Result<Self, LoadError> {
        let count = (shot.last - shot.first) as usize + 1;
        let mut hashes = Vec::new();
        let mut looks = Vec::new();
        for (index, frame) in (shot.first..=shot.last).enumerate() {
            let scene = source.at(shot.seconds(f64::from(frame)))?;
            hashes.push(content_hash(&scene));
            let is_looked_at = operator.sees_adaptation() || is_fitted_to(index, count);
            looks.push(is_looked_at.then(|| Look::at(scene, shot, operator)));
            say(hashes.len());
        }
        let fits = if operator.sees_adaptation() {
            fits_of_adapting_eyes(source, shot, operator, looks.into_iter().flatten().collect(), say)?
        } else {
            one_fit_for_all(shot, operator, looks)
        };
        let frames = (shot.first..=shot.last)
            .zip(hashes.into_iter().zip(fits))
            .map(|(frame, (scene, FrameFit { goal, eye, fitted }))| TrackFrame {
                frame,
                scene,
                goal,
                eye,
                fitted,
                mean_samples: None,
            })
            .collect();
        Ok(Self { made_for: made_for(shot, operator), frames })
    }

    /// Gives each frame its share of a budget of so many samples a pixel on average, on the way to the visibility
    /// `asked`.
    pub fn spread(&mut self, needs: &Needs, mean_samples: u32, asked: f64) {
        for (frame, share) in self.frames.iter_mut().zip(needs.shares(mean_samples, asked)) {
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
        "{}, steady looks, frames {} to {} at {} a second, {:?}, {} cd/m² a unit, {} ({operator:?}), eye {:?}, budget {:?}, \
         {:?}, {:?}",
        PROGRAM,
        shot.first,
        shot.last,
        shot.frames_per_second,
        // Looks are at the whole, whatever part of it the frames are.
        TraceSettings { crop: None, ..shot.trace },
        shot.nits_per_unit,
        operator.name(),
        shot.adapted_to_cd_m2,
        shot.limits.mean_samples,
        // Whether frames may be paused, where they are looked at and what denoises them decides what they need of a
        // budget.
        shot.limits.mean_samples.map(|_| {
            let denoiser = shot.denoiser.as_ref().map(Denoiser::name);
            ("pilots where light changes", shot.sampling, shot.pausable, shot.limits, gaze_hash(shot), denoiser)
        }),
        shot.viewing,
    )
}

fn gaze_hash(shot: &ShotSettings) -> Option<ContentHash> {
    shot.gaze.as_ref().map(|gaze| ContentHash::of_bytes(format!("{gaze:?}").as_bytes()))
}

/// How the operator is set for a frame.
struct FrameFit {
    goal: Option<Goal>,
    eye: Option<AdaptationState>,
    fitted: SavedTone,
}

/// Fits the operator once for all frames, to those that were looked at.
fn one_fit_for_all(shot: &ShotSettings, operator: &dyn ToneOperator, looks: Vec<Option<Look>>) -> Vec<FrameFit> {
    let goals: Vec<Option<Goal>> = looks.iter().map(|look| look.as_ref().map(|look| look.goal)).collect();
    let looks: Vec<Look> = looks.into_iter().flatten().collect();
    let fitted = operator.fit(&enlarged(&looks, shot).guide(), &shot.viewing, None).save();
    goals.into_iter().map(|goal| FrameFit { goal, eye: None, fitted: fitted.clone() }).collect()
}

/// Frame by frame, by looks at all of them.
fn fits_of_adapting_eyes(
    source: &dyn SceneSource,
    shot: &ShotSettings,
    operator: &dyn ToneOperator,
    mut looks: Vec<Look>,
    say: &dyn Fn(usize),
) -> Result<Vec<FrameFit>, LoadError> {
    // In all frames or none: light would jump where the way of looking changed.
    if looks.iter().any(|look| !look.is_settled) {
        for (index, (frame, look)) in (shot.first..=shot.last).zip(&mut looks).enumerate() {
            look.goal = coarse_goal(source.at(shot.seconds(f64::from(frame)))?, shot, operator);
            say(index + 1);
        }
    }
    let eyes = eyes(shot, operator, &looks.iter().map(|look| look.goal).collect::<Vec<Goal>>());
    let fit = |(look, eye): (&Look, AdaptationState)| {
        let light = enlarged(std::slice::from_ref(look), shot);
        let fitted = operator.fit(&light.guide(), &shot.viewing, Some(&eye)).save();
        FrameFit { goal: Some(look.goal), eye: Some(eye), fitted }
    };
    Ok(looks.iter().zip(eyes).map(fit).collect())
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

/// Whether one fit for all looks at a frame, by its place among all.
fn is_fitted_to(index: usize, frames: usize) -> bool {
    spread_over(frames).any(|place| place == index)
}

/// A small, denoised picture of a frame.
struct Look {
    light: SceneLight,
    goal: Goal,
    /// Whether more samples would leave the goal of an eye that adapts about where it is.
    is_settled: bool,
}

impl Look {
    fn at(scene: Arc<Scene>, shot: &ShotSettings, operator: &dyn ToneOperator) -> Self {
        let adapted_to = |light: &SceneLight| match operator.sees_adaptation() {
            true => receptors(goal_of(light, shot, operator)),
            false => Vec::new(),
        };
        // The same seed in every frame: what noise is left changes with the scene, not with the frame's number.
        let (light, change) = steady_glimpse_for(operator, scene, &shot.trace, shot.nits_per_unit, &adapted_to);
        Self { goal: goal_of(&light, shot, operator), light, is_settled: change <= UNSETTLED }
    }
}

/// The goal by few pixels and many samples.
fn coarse_goal(scene: Arc<Scene>, shot: &ShotSettings, operator: &dyn ToneOperator) -> Goal {
    let adapted_to = |light: &SceneLight| receptors(goal_of(light, shot, operator));
    let light = coarse_glimpse_for(operator, scene, &shot.trace, shot.nits_per_unit, &adapted_to);
    goal_of(&light, shot, operator)
}

/// What eyes that look at a small picture of a frame adapt to.
pub(super) fn goal_of(light: &SceneLight, shot: &ShotSettings, operator: &dyn ToneOperator) -> Goal {
    let scale = light.luminance_cd_m2().width() as f64 / f64::from(shot.trace.width);
    operator.goal(&light.guide_for(operator), shot.viewing.display.pixel_density().times(scale))
}

fn receptors(goal: Goal) -> Vec<f32> {
    vec![goal.cones_cd_m2 as f32, goal.rods_cd_m2 as f32]
}

/// Looks, one below the other, at the frames' own size, as operators that count degrees need it.
fn enlarged(looks: &[Look], shot: &ShotSettings) -> SceneLight {
    let lights: Vec<&SceneLight> = looks.iter().map(|look| &look.light).collect();
    SceneLight::stacked(&lights, shot.trace.width as usize, shot.trace.height as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::settings::Limits;
    use crate::integrator::Crop;
    use crate::scene::load::{LoadOptions, load};
    use fechner_perception::display::Viewing;
    use fechner_perception::tone::{ToneSettings, operator_with};
    use std::path::PathBuf;

    struct Ours(PathBuf);

    impl SceneSource for Ours {
        fn at(&self, time_s: f64) -> Result<Arc<Scene>, LoadError> {
            Ok(Arc::new(load(&self.0, &LoadOptions { frame_time: time_s, ..LoadOptions::default() })?))
        }
    }

    fn shot_of_a_frame((width, height): (u32, u32)) -> ShotSettings {
        let trace = TraceSettings::new(width, height, 0);
        ShotSettings::new(24.0, trace, Limits::of_visibility(1.0), Viewing::default(), 1.0)
    }

    /// Looks are traced as frames are: a track of other light would be another one. A part has the track of the whole.
    #[test]
    fn a_track_is_of_one_way_to_trace() {
        let operator = operator_with("constant", &ToneSettings::default()).expect("an operator");
        let shot = shot_of_a_frame((64, 48));
        let traced_by = |change: fn(&mut TraceSettings)| {
            let mut trace = shot.trace;
            change(&mut trace);
            made_for(&ShotSettings { trace, ..shot_of_a_frame((64, 48)) }, operator.as_ref())
        };
        let own = traced_by(|_| {});
        let changes: [fn(&mut TraceSettings); 4] = [
            |trace| trace.seed = 7,
            |trace| trace.max_depth = 2,
            |trace| trace.clamp = Some(1.0),
            |trace| trace.transparent = true,
        ];
        assert!(changes.into_iter().all(|change| traced_by(change) != own));
        assert_eq!(traced_by(|trace| trace.crop = Some(Crop { x: 0, y: 0, width: 8, height: 8 })), own);
    }

    /// The first frame of one of our scenes.
    fn first_frame(name: &str, operator: &str, (width, height): (u32, u32)) -> TrackFrame {
        let source = Ours(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name));
        let nits_per_unit = source.at(0.0).expect("our own scene").nits_per_unit;
        let shot = ShotSettings { nits_per_unit, ..shot_of_a_frame((width, height)) };
        let operator = operator_with(operator, &ToneSettings::default()).expect("an operator");
        let track = Track::make(&source, &shot, operator.as_ref(), &|_| {}).expect("our own scene");
        track.frames.into_iter().next().expect("a frame")
    }

    /// `render --sampling uniform --spp 256` has its white at 395.5 cd/m²; of six seeds a track's is at 393 to 425.
    /// Regression: by a pilot of 8 samples it was at 140.
    #[test]
    fn a_shot_is_exposed_as_its_frames_are() {
        let fitted = first_frame("many-lights.toml", "constant", (128, 96)).fitted.restore();
        // The scene asks for 1.4 stops less.
        let white_cd_m2 = 100.0 * 1.4_f32.exp2() / fitted.relative_luminance(100.0);
        assert!((white_cd_m2 / 395.5 - 1.0).abs() < 0.12, "white at {white_cd_m2} cd/m²");
    }

    /// What lights the theatre few samples find: `render --sampling uniform --spp 512` adapts eyes to 0.0059 cd/m².
    /// Regression: by 8 samples it was 0.0012; of six seeds by 64 it is 0.0026 to 0.0028.
    #[test]
    fn eyes_adapt_to_a_dark_view_as_in_its_frames() {
        let goal = first_frame("theatre-door.toml", "pattanaik00", (128, 72)).goal.expect("was looked at");
        assert!((goal.cones_cd_m2 / 0.0059 - 1.0).abs() < 0.15, "{goal:?}");
    }

    #[test]
    fn one_fit_looks_at_frames_from_all_over_the_shot() {
        let fitted = |frames| (0..frames).filter(|&index| is_fitted_to(index, frames)).collect::<Vec<_>>();
        assert_eq!(fitted(3), [0, 1, 2]);
        assert_eq!(fitted(32), (0..16).map(|place| 2 * place).collect::<Vec<_>>());
        assert_eq!(fitted(17).len(), 16);
    }
}
