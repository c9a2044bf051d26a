//! From film to encoded frames of the layers that somebody looks at. Where they are sent is left to `shared`.

use super::composed::Composed;
use super::frame::{Encoding, Frame};
use super::layer::{self, Layer};
use super::shared::Shared;
use super::spectator::{Shown, Spectator, Stage};
use crate::adaptive::judge::Judgement;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::statistics::picture_variance;
use crate::film::Film;
use crate::output::encode_srgb8;
use crate::output::false_colour::{self, Colours};
use crate::poison::Unpoisoned as _;
use fechner_perception::Plane;
use fechner_perception::tone::{FittedTone, SavedTone, SceneLight, map_picture};
use glam::Vec2;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Bounds of [`best_interval`]: a batch is about as long as the least, and a picture that changes less often seems to
/// be done.
const BEST_INTERVALS: [Duration; 2] = [Duration::from_millis(25), Duration::from_millis(500)];
/// Time after a start from which on intervals follow age and cost alone.
const LIVELY: Duration = Duration::from_secs(2);
/// Costs of a frame between two later on: a fortieth of the time.
const COSTS_BETWEEN_FRAMES: u32 = 39;
/// Time between frames at most, where they are large or the machine is busy.
const LONGEST_INTERVAL: Duration = Duration::from_secs(2);

/// What the last look at the film saw.
#[derive(Debug)]
pub struct Looked {
    /// Standard error on the display, cd/m², that is at visibility 1.
    pub threshold: Plane,
    /// Visibility of the remaining noise.
    pub visibility: Plane,
    /// The picture, where it is denoised: linear RGB in cd/m².
    pub denoised: Option<Arc<Vec<[f32; 3]>>>,
}

impl Looked {
    /// The maps of a look.
    pub fn of(judgement: &Judgement) -> Self {
        Self {
            threshold: judgement.allowed_standard_error_cd_m2(),
            visibility: judgement.predicted.clone(),
            denoised: judgement.denoised.as_ref().map(|denoised| Arc::new(denoised.rgb_cd_m2.clone())),
        }
    }
}

/// The picture as it was last shown, for who asks about a pixel.
pub(super) struct Snapshot {
    pub(super) width: usize,
    /// Pixels of the picture to each of these, each way.
    pub(super) step: usize,
    pub(super) nits_per_unit: f64,
    pub(super) composed: Composed,
    pub(super) looked: Option<Arc<Looked>>,
}

/// A film to be shown.
#[derive(Clone, Copy)]
pub(super) struct Scenery<'a> {
    pub(super) film: &'a Film,
    /// The operator's fit at the last look.
    pub(super) tone: Option<&'a SavedTone>,
    pub(super) settings: &'a LoopSettings,
    /// Whether the film is on its way or at rest; at rest frames are exact.
    pub(super) stage: Stage,
    /// Pixels of the picture to each of the film's, each way.
    pub(super) step: u32,
}

/// What is known of motion in the picture.
pub(super) enum Motion {
    /// Nothing, and why.
    Unknown(&'static str),
    /// Motion to the next frame.
    Known {
        /// Motion in pixels, row-major.
        to_next_px: Vec<Vec2>,
        /// How long a frame is.
        frames_per_second: f64,
    },
}

/// When was shown what, and what it took.
pub(super) struct Screen {
    started: Instant,
    shown: Option<Instant>,
    cost: Duration,
    pub(super) looked: Option<Arc<Looked>>,
    /// What other eyes saw in the last look, until the next.
    looked_before: Option<Arc<Looked>>,
    pub(super) motion: Motion,
    /// Samples of the film that was shown last.
    pub(super) total_samples: u64,
    /// Until the first look.
    provisional: Option<ProvisionalTone>,
    encoding: Arc<Encoding>,
    spectators: Spectators,
}

/// Who is shown each frame beside browsers. They outlive a picture that a defect ends.
pub(super) type Spectators = Arc<Mutex<Vec<Box<dyn Spectator>>>>;

/// The operator on a picture that was not looked at yet.
struct ProvisionalTone {
    fitted: Box<dyn FittedTone>,
    /// Pixels and samples of that picture.
    pixels: usize,
    samples: u64,
}

impl ProvisionalTone {
    /// Whether it still suits a picture of so many pixels and samples. A fit sorts the whole picture, and
    /// changes little while samples do.
    fn holds(&self, pixels: usize, samples: u64) -> bool {
        pixels == self.pixels && (self.samples..2 * self.samples).contains(&samples)
    }
}

impl Screen {
    pub(super) fn new(spectators: Spectators) -> Self {
        let motion = Motion::Unknown("not known to a running render");
        Self {
            started: Instant::now(),
            shown: None,
            cost: Duration::ZERO,
            looked: None,
            looked_before: None,
            motion,
            total_samples: 0,
            provisional: None,
            encoding: Arc::default(),
            spectators,
        }
    }

    /// A new picture begins: no look was taken and the next frame is due.
    pub(super) fn begin(&mut self) {
        let (encoding, spectators) = (Arc::clone(&self.encoding), Arc::clone(&self.spectators));
        *self = Self { cost: self.cost, encoding, ..Self::new(spectators) };
    }

    /// What was seen holds no more: another place.
    pub(super) fn forget_look(&mut self) {
        self.looked = None;
        self.looked_before = None;
        self.provisional = None;
    }

    /// Forgets what other eyes saw: these see other things in the same light. A denoised picture stays, and nothing
    /// else.
    pub(super) fn forget_eyes(&mut self) {
        let looked = self.looked.take().or_else(|| self.looked_before.take());
        self.forget_look();
        self.looked_before = looked;
    }

    /// Time between two frames now; `None` where nobody looks.
    pub(super) fn between_frames(&self, shared: &Shared) -> Option<Duration> {
        let is_watched = !self.spectators.lock().unpoisoned().is_empty() || shared.has_viewers();
        is_watched.then(|| interval(self.started.elapsed(), self.cost + self.encoding.cost()))
    }

    /// Whether a frame is due, so long after the one before, which must be encoded.
    pub(super) fn is_due(&self, between_frames: Option<Duration>) -> bool {
        let is_time = |interval| self.shown.is_none_or(|shown| shown.elapsed() >= interval);
        between_frames.is_some_and(is_time) && !self.encoding.is_under_way()
    }

    /// Shows a film to all viewers, and remembers what that took.
    pub(super) fn show(&mut self, scenery: Scenery<'_>, shared: &Arc<Shared>) {
        let begun = Instant::now();
        self.publish(scenery, shared);
        self.shown = Some(Instant::now());
        self.cost = begun.elapsed();
    }

    /// Shows a film to all viewers.
    pub(super) fn publish(&mut self, scenery: Scenery<'_>, shared: &Arc<Shared>) {
        if scenery.film.pixel_count() == 0 {
            return;
        }
        let nits_per_unit = scenery.settings.nits_per_unit;
        // Denoised pictures are made by looks; between two the last one stays.
        let looked = self.looked.as_ref().or(self.looked_before.as_ref());
        let composed = match looked.and_then(|looked| looked.denoised.as_ref()) {
            Some(rgb_cd_m2) => Composed::of_denoised(rgb_cd_m2, scenery.film),
            None => Composed::of_film(scenery.film, nits_per_unit, scenery.stage),
        };
        let rgb_cd_m2 = composed.rgb_cd_m2.as_slice();
        self.total_samples = composed.samples.iter().map(|&samples| u64::from(samples)).sum();
        let (width, height, stage) = (scenery.film.width(), scenery.film.height(), scenery.stage);
        let watched = Layer::ALL.into_iter().filter(|&layer| shared.is_watched(layer));
        let frames = watched
            .map(|layer| Frame { layer, colours: self.colours(layer, scenery, rgb_cd_m2), width, height, stage })
            .collect();
        self.encoding.publish(frames, shared);
        let shown = Shown {
            film: scenery.film,
            rgb_cd_m2,
            step: scenery.step,
            looked: self.looked.as_deref(),
            nits_per_unit,
            stage,
        };
        self.spectators.lock().unpoisoned().iter_mut().for_each(|spectator| spectator.shown(&shown));
        shared.publish_snapshot(Snapshot {
            width: scenery.film.width() as usize,
            step: scenery.step as usize,
            nits_per_unit,
            composed,
            looked: self.looked.clone(),
        });
    }

    /// The picture as the operator shows it: as fitted at the last look, or else to the picture itself.
    fn picture(&mut self, scenery: Scenery<'_>, rgb_cd_m2: &[[f32; 3]]) -> Colours {
        let looked = scenery.tone.map(|tone| tone.clone().restore());
        if looked.is_some() {
            self.provisional = None;
        }
        let tone = looked.as_deref().unwrap_or_else(|| self.provisional_tone(scenery, rgb_cd_m2));
        let shown = map_picture(tone, scenery.film.width() as usize, rgb_cd_m2);
        Colours { rgb8: encode_srgb8(scenery.film.width(), &shown), legend: tone.describe() }
    }

    fn provisional_tone(&mut self, scenery: Scenery<'_>, rgb_cd_m2: &[[f32; 3]]) -> &dyn FittedTone {
        let Scenery { film, settings, stage, step, .. } = scenery;
        let (pixels, samples) = (film.pixel_count(), self.total_samples);
        // What rests is shown by a fit of its own.
        let holds = |tone: &ProvisionalTone| stage == Stage::UnderWay && tone.holds(pixels, samples);
        self.provisional = self.provisional.take().filter(holds);
        let tone = self.provisional.get_or_insert_with(|| ProvisionalTone {
            fitted: fit(settings, step, film.width() as usize, rgb_cd_m2),
            pixels,
            samples,
        });
        tone.fitted.as_ref()
    }

    fn colours(&mut self, layer: Layer, scenery: Scenery<'_>, rgb_cd_m2: &[[f32; 3]]) -> Colours {
        let Scenery { film, settings, .. } = scenery;
        let (width, height) = (film.width() as usize, film.height() as usize);
        match (layer, &self.looked) {
            (Layer::Picture, _) => self.picture(scenery, rgb_cd_m2),
            (Layer::Samples, _) => {
                let counts = Plane::from_fn(width, height, |x, y| film.samples(y * width + x) as f32);
                false_colour::logarithmic(&counts, "samples")
            }
            (Layer::Threshold, Some(looked)) => false_colour::logarithmic(&looked.threshold, "cd/m²"),
            (Layer::Visibility, Some(looked)) => {
                false_colour::visibility(&looked.visibility, settings.limits.visibility_or_threshold())
            }
            (Layer::Threshold | Layer::Visibility, None) => layer::nothing_yet(film),
            (Layer::Variance, _) => {
                false_colour::logarithmic(&picture_variance(film, settings.nits_per_unit), "(cd/m²)², of the scene")
            }
            (Layer::HalfDifference, _) => {
                false_colour::signed(&film.estimate(settings.nits_per_unit).half_difference, "cd/m², of the scene")
            }
            (Layer::Albedo, _) => layer::albedo(film),
            (Layer::Normal, _) => layer::normal(film),
            (Layer::Depth, _) => layer::depth(film),
            (Layer::Velocity, _) => match &self.motion {
                Motion::Known { to_next_px, frames_per_second } if to_next_px.len() == film.pixel_count() => {
                    layer::velocity(to_next_px, *frames_per_second)
                }
                Motion::Known { .. } => layer::unknown(film, "known when the camera rests"),
                Motion::Unknown(why) => layer::unknown(film, why),
            },
        }
    }
}

/// Time between two frames of a picture that was begun so long ago, where the last one took `cost`.
fn interval(since_start: Duration, cost: Duration) -> Duration {
    let [first, last] = BEST_INTERVALS;
    let best = best_interval(since_start, cost).clamp(first, last);
    if since_start < LIVELY { best } else { best.max(cost.saturating_mul(COSTS_BETWEEN_FRAMES).min(LONGEST_INTERVAL)) }
}

/// √(2 cost time): where what is on the screen is nearest to what might be there. It lacks, of its time, cost /
/// interval for frames and half an interval / time for its age.
fn best_interval(since_start: Duration, cost: Duration) -> Duration {
    Duration::from_secs_f64((2.0 * cost.as_secs_f64() * since_start.as_secs_f64()).sqrt())
}

/// The operator on a picture that was not looked at yet, of pixels `step` times as large as the display's; a
/// part is shown as its whole.
fn fit(settings: &LoopSettings, step: u32, width: usize, rgb_cd_m2: &[[f32; 3]]) -> Box<dyn FittedTone> {
    if let Some(whole) = settings.fitted.clone().filter(|_| step == 1) {
        return whole.restore();
    }
    let light = SceneLight::of(settings.operator.as_ref(), width, rgb_cd_m2);
    let mut viewing = settings.viewing.clone();
    viewing.display.pixels_per_degree /= f64::from(step);
    settings.operator.fit(&light.guide(), &viewing, None)
}

#[cfg(test)]
mod tests {
    use super::super::shared::Seat;
    use super::*;
    use crate::film::BlockSum;
    use crate::integrator::{BlockWork, PathSample, TraceSettings};
    use crate::sampler::Half;
    use glam::Vec3;

    /// Adds a block of samples of one grey.
    fn add(film: &mut Film, work: BlockWork, grey: f32) {
        let mut sum = BlockSum::default();
        let sample = PathSample::of_wall(Vec3::splat(grey));
        (0..work.samples).for_each(|_| sum.add(&sample));
        film.merge_block(work, &sum);
    }

    fn settings_with(operator: &str) -> LoopSettings {
        let operator = fechner_perception::tone::operator(operator, None).expect("an operator");
        LoopSettings::new(&TraceSettings::new(1, 1, 1), fechner_perception::Viewing::default(), 100.0, operator)
    }

    /// What is fresh is shown sooner than what changes little, and dear frames seldom.
    #[test]
    fn frames_follow_the_picture_and_their_price() {
        let between = |since_start_ms: u64, cost_ms: u64| {
            interval(Duration::from_millis(since_start_ms), Duration::from_millis(cost_ms)).as_millis()
        };
        assert_eq!([0, 800, 5000, 200_000].map(|since_start| between(since_start, 1)), [25, 40, 100, 500]);
        assert_eq!([200, 1800, 9000, 20_000].map(|since_start| between(since_start, 10)), [63, 189, 424, 500]);
        assert_eq!([100, 1900, 9000].map(|since_start| between(since_start, 40)), [89, 389, 1560]);
        assert_eq!([100, 1900, 9000].map(|since_start| between(since_start, 1000)), [447, 500, 2000]);
    }

    /// Until somebody takes a seat.
    #[test]
    fn nobody_is_shown_no_frame() {
        let (screen, shared) = (Screen::new(Arc::default()), Arc::new(Shared::new()));
        let is_due = || screen.is_due(screen.between_frames(&shared));
        assert!(!is_due());
        let seat = Seat::take(&shared, Layer::Depth);
        assert!(is_due());
        drop(seat);
        assert!(!is_due());
    }

    /// Fitted anew where samples have doubled, or the picture is another.
    #[test]
    fn a_provisional_tone_holds_while_little_changes() {
        let fitted = fit(&settings_with("constant"), 1, 2, &[[1.0; 3]; 4]);
        let tone = ProvisionalTone { fitted, pixels: 4, samples: 100 };
        assert_eq!([99, 100, 199, 200].map(|samples| tone.holds(4, samples)), [false, true, true, false]);
        assert!(!tone.holds(5, 100));
    }

    /// A change of operator shows after [`Screen::forget_look`], and at rest whatever was fitted before.
    #[test]
    fn no_fit_outlives_what_it_was_made_for() {
        let mut film = Film::new(2, 1);
        [0, 1].into_iter().for_each(|pixel| add(&mut film, BlockWork::whole(pixel, Half::A, 0), 1.0));
        let (before, after) = (settings_with("constant"), settings_with("reinhard02"));
        let mut screen = Screen::new(Arc::default());
        screen.total_samples = film.total_samples();
        let legend = |screen: &mut Screen, settings: &LoopSettings, stage: Stage| {
            let scenery = Scenery { film: &film, tone: None, settings, stage, step: 1 };
            screen.picture(scenery, &[[100.0; 3]; 2]).legend
        };
        let first = legend(&mut screen, &before, Stage::UnderWay);
        assert_eq!(legend(&mut screen, &after, Stage::UnderWay), first, "the fit is kept");
        let at_rest = legend(&mut screen, &after, Stage::AtRest);
        assert_ne!(at_rest, first);
        screen.forget_look();
        assert_eq!(legend(&mut screen, &before, Stage::UnderWay), first);
        screen.forget_look();
        assert_eq!(legend(&mut screen, &after, Stage::UnderWay), at_rest);
    }

    /// Other eyes are shown the denoised picture too before they have looked, and another place is not.
    #[test]
    fn other_eyes_see_the_same_light() {
        let mut film = Film::new(2, 1);
        [0, 1].into_iter().for_each(|pixel| add(&mut film, BlockWork::whole(pixel, Half::A, 0), 1.0));
        let settings = settings_with("constant");
        let plane = || Plane::from_fn(2, 1, |_, _| 1.0);
        let looked = Looked { threshold: plane(), visibility: plane(), denoised: Some(Arc::new(vec![[7.0; 3]; 2])) };
        let shared = Arc::new(Shared::new());
        let mut screen = Screen::new(Arc::default());
        screen.looked = Some(Arc::new(looked));
        let shown = |screen: &mut Screen| {
            let scenery = Scenery { film: &film, tone: None, settings: &settings, stage: Stage::AtRest, step: 1 };
            screen.publish(scenery, &shared);
            let snapshot = shared.snapshot().expect("something shown");
            (snapshot.composed.rgb_cd_m2[0], snapshot.looked.is_some())
        };
        assert_eq!(shown(&mut screen), ([7.0; 3], true));
        screen.forget_eyes();
        screen.forget_eyes();
        assert_eq!(shown(&mut screen), ([7.0; 3], false));
        screen.forget_look();
        assert_eq!(shown(&mut screen), ([100.0; 3], false));
    }
}
