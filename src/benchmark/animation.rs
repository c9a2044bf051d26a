//! What motion hides: the frames of a shot by the rule for motion and by the rule for stills, both asked for one
//! visibility, the shot with as many samples as the first as its budget, and evenly sampled frames of the same judged
//! quality.
//!
//! Judged as a video by ColorVideoVDP, which no rule optimises, against frames of many samples by other seeds. Not for
//! stills.

use super::flicker::{FlickerJudge, Steadiness};
use super::metrics::video_jod;
use super::name::distinct_names;
use super::reached::Reached;
use super::reference::trace_up_to;
use super::{tone_operator, viewing};
use crate::adaptive::settings::{DENOISED_PILOT_SAMPLES_PER_PIXEL, Limits, LoopSettings};
use crate::adaptive::{Quiet, render};
use crate::animate::budget::Needs;
use crate::animate::track::Track;
use crate::animate::{SceneSource, ShotSettings};
use crate::denoise::{Denoiser, DenoiserKind, denoise_film};
use crate::film::Film;
use crate::integrator::{PathTracer, TraceSettings};
use crate::json_file;
use crate::sampler::hash_words;
use crate::scene::Scene;
use crate::scene::load::{LoadError, LoadOptions, load};
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What to run.
#[derive(Clone, Debug)]
pub struct AnimationSettings {
    /// Scenes that move.
    pub scenes: Vec<PathBuf>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Frames of each shot.
    pub frames: u32,
    /// Frame rates; the shot begins at the same second.
    pub rates: Vec<f64>,
    /// Visibility that both rules are asked for.
    pub visibility: f64,
    /// Samples a pixel of the reference.
    pub reference_spp: u32,
    /// Display preset.
    pub display: String,
    /// What every frame but the reference's is denoised with.
    pub denoiser: Option<DenoiserKind>,
}

/// One shot.
#[derive(Clone, Debug, Serialize)]
pub struct AnimationRow {
    /// Scene.
    pub scene: String,
    /// Frames a second.
    pub frames_per_second: f64,
    /// Mean samples a pixel by the rule for motion.
    pub motion_spp: f64,
    /// What they look like as a video.
    pub motion_jod: f64,
    /// Mean samples a pixel by the rule for stills.
    pub still_spp: f64,
    /// What they look like as a video.
    pub still_jod: f64,
    /// Samples a pixel with which evenly sampled frames look like those of the rule for motion.
    pub uniform_spp: Reached,
    /// Mean samples a pixel of the shot that has those of the rule for motion as its budget, and no visibility to stop
    /// at.
    pub budget_spp: f64,
    /// What its frames look like as a video.
    pub budget_jod: f64,
    /// Samples a pixel with which evenly sampled frames look like those.
    pub uniform_spp_of_budget: Reached,
    /// Visibility of the error in single frames by the rule for motion, at the 99th percentile.
    pub visibility: f64,
    /// Root mean square visibility of what changes from frame to frame by the rule for motion, what moves brought
    /// together.
    pub flicker: f64,
    /// [`Self::flicker`] of even sampling whose single frames are as visible; `None` where none that was tried is.
    pub uniform_flicker: Option<f64>,
}

/// All shots with one denoiser, or with none.
#[derive(Clone, Debug, Serialize)]
pub struct AnimationResults {
    /// What every frame but the references' is denoised with.
    pub denoiser: Option<String>,
    /// Rows, one a scene and rate.
    pub rows: Vec<AnimationRow>,
}

impl AnimationResults {
    /// Where they are written in a folder, which is made if need be.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn file(folder: &Path) -> Result<PathBuf> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        Ok(folder.join("animation.json"))
    }

    /// Writes results with several denoisers.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(results: &[Self], file: &Path) -> Result<()> {
        Ok(json_file::write(file, results)?)
    }
}

/// Seconds of scene time at which shots begin.
const START_S: f64 = 0.25;
/// Keeps the reference's seeds apart.
const REFERENCE_STREAM: u64 = 0x5245_4645;

struct Files<'a>(&'a Path);

impl SceneSource for Files<'_> {
    fn at(&self, seconds: f64) -> Result<Arc<Scene>, LoadError> {
        load(self.0, &LoadOptions { frame_time: seconds, ..LoadOptions::default() }).map(Arc::new)
    }
}

/// Displayed light of each frame, linear RGB in cd/m².
type Frames = Vec<Vec<f32>>;

/// How the frames of a shot are judged.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// For people who see each for as long as it lasts.
    ForMotion,
    /// For people who may pause at any.
    ForStills,
}

/// Frames of a shot.
struct Rendition {
    /// Mean samples a pixel.
    spp: f64,
    frames: Frames,
}

/// Runs every shot.
///
/// # Errors
/// Scenes that do not load.
pub fn animation(settings: &AnimationSettings, say: &dyn Fn(&str)) -> Result<Vec<AnimationRow>> {
    let mut rows = Vec::new();
    for (scene, name) in settings.scenes.iter().zip(distinct_names(&settings.scenes)?) {
        for &rate in &settings.rates {
            let row = Bench::new(settings, scene, name.clone(), rate)?.row()?;
            say(&format!("{} at {rate}: done", row.scene));
            rows.push(row);
        }
    }
    Ok(rows)
}

struct Bench<'a> {
    settings: &'a AnimationSettings,
    name: String,
    source: Files<'a>,
    /// As the scene begins: what the shot is shown by.
    first_scene: Arc<Scene>,
    shot: ShotSettings,
    track: Track,
    scenes: Vec<Arc<Scene>>,
}

impl<'a> Bench<'a> {
    fn new(settings: &'a AnimationSettings, path: &'a Path, name: String, rate: f64) -> Result<Self> {
        let source = Files(path);
        let first_scene = source.at(0.0)?;
        let viewing = viewing(&settings.display)?;
        let denoiser = settings.denoiser.map(Denoiser::open).transpose()?;
        let mut limits = Limits::of_visibility(settings.visibility);
        if denoiser.is_some() {
            limits.pilot_samples = DENOISED_PILOT_SAMPLES_PER_PIXEL;
        }
        let first = (START_S * rate).round() as u32;
        let trace = TraceSettings::new(settings.size.0, settings.size.1, 0);
        let shot = ShotSettings {
            first,
            last: first + settings.frames - 1,
            denoiser,
            ..ShotSettings::new(rate, trace, limits, viewing, first_scene.nits_per_unit)
        };
        let operator = tone_operator(&first_scene)?;
        let track = Track::make(&source, &shot, operator.as_ref(), &|_| {})?;
        let scenes = (shot.first..=shot.last).map(|frame| source.at(shot.seconds(f64::from(frame))));
        let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { settings, name, source, first_scene, shot, track, scenes })
    }

    fn row(&self) -> Result<AnimationRow> {
        let reference = self.reference();
        let jod = |frames: Frames| {
            let size = (self.settings.size.0 as usize, self.settings.size.1 as usize);
            let rate = self.shot.frames_per_second;
            video_jod(&self.shot.viewing.display, size, rate, [frames, reference.clone()])
        };
        let Rendition { spp: motion_spp, frames: motion } =
            self.adaptive(&self.variant(Rule::ForMotion, self.shot.limits), &self.track)?;
        let Rendition { spp: still_spp, frames: still } =
            self.adaptive(&self.variant(Rule::ForStills, self.shot.limits), &self.track)?;
        let Rendition { spp: budget_spp, frames: of_budget } = self.with_budget(motion_spp.round() as u32)?;
        let tracers: Vec<PathTracer> = (0..self.scenes.len()).map(|index| self.tracer(index, 0)).collect();
        let judge = FlickerJudge::new(&reference, &tracers, &self.scenes, &self.shot.viewing)?;
        let steady = judge.judge(&motion);
        let (motion_jod, still_jod, budget_jod) = (jod(motion)?, jod(still)?, jod(of_budget)?);
        let counts: Vec<u32> =
            (2..).map(|power| 1 << power).take_while(|n| 2 * n <= self.settings.reference_spp).collect();
        let (mut curve, mut steadiness) = (Vec::new(), Vec::new());
        for (&spp, frames) in counts.iter().zip(self.uniform(&counts)?) {
            steadiness.push(judge.judge(&frames));
            curve.push((f64::from(spp), jod(frames)?));
        }
        Ok(AnimationRow {
            scene: self.name.clone(),
            frames_per_second: self.shot.frames_per_second,
            motion_spp,
            motion_jod,
            still_spp,
            still_jod,
            uniform_spp: Reached::by(&curve, motion_jod),
            budget_spp,
            budget_jod,
            uniform_spp_of_budget: Reached::by(&curve, budget_jod),
            visibility: steady.visibility,
            flicker: steady.flicker,
            uniform_flicker: flicker_at(&steadiness, steady.visibility),
        })
    }

    /// The shot by one of the rules, within other limits.
    fn variant(&self, rule: Rule, limits: Limits) -> ShotSettings {
        ShotSettings {
            pausable: rule == Rule::ForStills,
            limits,
            viewing: self.shot.viewing.clone(),
            gaze: None,
            denoiser: self.shot.denoiser.clone(),
            ..self.shot
        }
    }

    /// The frames of a shot by the loop.
    fn adaptive(&self, shot: &ShotSettings, track: &Track) -> Result<Rendition> {
        let (mut samples, mut frames) = (0, Vec::new());
        for index in 0..self.scenes.len() {
            let operator = tone_operator(&self.scenes[index])?;
            let settings: LoopSettings = shot.frame_settings(operator, &track.frames[index]);
            let rendered = render(&self.tracer(index, 0), &settings, &Quiet)?;
            samples += rendered.film.total_samples();
            frames.push(self.displayed(index, rendered.judgement.picture()));
        }
        let pixels = f64::from(self.settings.size.0) * f64::from(self.settings.size.1);
        Ok(Rendition { spp: samples as f64 / pixels / frames.len() as f64, frames })
    }

    /// The frames of a budget for the whole shot, as `animate --spp` spends it.
    fn with_budget(&self, mean_samples: u32) -> Result<Rendition> {
        let limits = Limits { visibility: None, mean_samples: Some(mean_samples), ..self.shot.limits };
        let shot = self.variant(Rule::ForMotion, limits);
        let operator = || tone_operator(&self.first_scene).expect("the shot was shown by it");
        let mut track = Track::make(&self.source, &shot, operator().as_ref(), &|_| {})?;
        let needs = Needs::of(&self.source, &shot, &operator, &track)?;
        track.spread(&needs, mean_samples, limits.last_rung());
        self.adaptive(&shot, &track)
    }

    /// Frames of many samples by other seeds, never denoised.
    fn reference(&self) -> Frames {
        let frame = |index| {
            let mut film = Film::new(self.settings.size.0, self.settings.size.1);
            trace_up_to(&self.tracer(index, REFERENCE_STREAM), &mut film, self.settings.reference_spp);
            self.displayed(index, &film.estimate(self.shot.nits_per_unit).rgb_cd_m2)
        };
        (0..self.scenes.len()).map(frame).collect()
    }

    /// The frames with each of these counts, which increase, spread evenly.
    fn uniform(&self, counts: &[u32]) -> Result<Vec<Frames>> {
        let mut by_count = vec![Frames::new(); counts.len()];
        for index in 0..self.scenes.len() {
            let tracer = self.tracer(index, 0);
            let mut film = Film::new(self.settings.size.0, self.settings.size.1);
            for (frames, &count) in by_count.iter_mut().zip(counts) {
                trace_up_to(&tracer, &mut film, count);
                let picture = match &self.shot.denoiser {
                    Some(denoiser) => denoise_film(denoiser, &film, self.shot.nits_per_unit)?.rgb_cd_m2,
                    None => film.estimate(self.shot.nits_per_unit).rgb_cd_m2,
                };
                frames.push(self.displayed(index, &picture));
            }
        }
        Ok(by_count)
    }

    fn tracer(&self, index: usize, stream: u64) -> PathTracer {
        let seed = hash_words(stream, u64::from(self.shot.first) + index as u64);
        PathTracer::new(Arc::clone(&self.scenes[index]), TraceSettings { seed, ..self.shot.trace })
    }

    fn displayed(&self, index: usize, rgb_cd_m2: &[[f32; 3]]) -> Vec<f32> {
        let fitted = self.track.frames[index].fitted.clone().restore();
        let light: Vec<_> = rgb_cd_m2.iter().map(|&rgb| fitted.map_rgb(rgb)).collect();
        self.shot.viewing.display.rgb_cd_m2(&light).into_flattened()
    }
}

/// Flicker where the frames of a row of ever more samples have a visibility, straight between points in the logarithms.
fn flicker_at(steadiness: &[Steadiness], visibility: f64) -> Option<f64> {
    let pair =
        steadiness.windows(2).find(|pair| pair[0].visibility >= visibility && pair[1].visibility < visibility)?;
    let share = (visibility / pair[0].visibility).ln() / (pair[1].visibility / pair[0].visibility).ln();
    Some(pair[0].flicker * (pair[1].flicker / pair[0].flicker).powf(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flicker_is_read_at_a_visibility() {
        let steadiness =
            [(8.0, 4.0), (4.0, 2.0), (2.0, 1.0)].map(|(visibility, flicker)| Steadiness { visibility, flicker });
        assert!((flicker_at(&steadiness, 4.0).expect("reached") - 2.0).abs() < 1e-9);
        assert!((flicker_at(&steadiness, 32f64.sqrt()).expect("reached") - 8f64.sqrt()).abs() < 1e-9);
        assert_eq!(flicker_at(&steadiness, 1.0), None);
    }
}
