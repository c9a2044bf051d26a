//! A small, denoised picture of all that a camera sees: how light the view is, before any of it is rendered.
//!
//! For tone operators that must be fitted to more than the picture at hand: to a shot of which it is a frame, to the
//! whole of which it is a part. Not for output, nor for thresholds.

use super::judge::guide_rgb;
use super::plan::{pilot_plan, uniform_plan};
use crate::film::Film;
use crate::integrator::{PathTracer, TraceSettings};
use crate::scene::{Camera, Scene};
use fechner_perception::photometry::luminance;
use fechner_perception::tone::{SceneLight, ToneOperator};
use std::sync::Arc;

/// Longest side of a glimpse in pixels. In smaller ones lamps touch too large a share of the pixels: at 64 those of
/// `scenes/many-lights.toml` touch more than one in twenty, which is where the operator `constant` has its white.
/// Measured for a picture of 512×384 whose white is at 137 cd/m²: 911 at 64, 145 here.
const LONGEST_SIDE: u32 = 256;
/// Samples of a glimpse, about.
const SAMPLES: u32 = 1 << 17;
/// Most samples of one that goes on until it is steady: 2.5 s of a box on two cores.
const MAX_SAMPLES: u64 = 1 << 20;
/// Longest side in pixels of a coarse glimpse, and its most samples: with 512 a pixel of a picture of 64×36 eyes in
/// `scenes/theatre-door.toml` adapt as with 512 a pixel of one of 128×72, to 3 %.
const COARSE_SIDE: u32 = 64;
const MAX_COARSE_SAMPLES: u64 = 1 << 21;
/// A brief glimpse's side is at most this share of the picture's: it takes a sample for each of the picture's pixels.
const SIDES_OF_A_BRIEF_GLIMPSE: u32 = 4;
/// Change of light by a doubling of the samples below which it is.
const STEADY: f32 = 0.01;

/// Looks at all of the picture, whatever part of it the settings ask for, with as many samples as it takes until twice
/// as many change little: noise spreads light, and with 8 samples `scenes/many-lights.toml` at 128×96 has its white at
/// 140 cd/m², with 32 and 128 at 409 and 391. A pure function of scene and settings.
pub fn steady_glimpse(scene: Arc<Scene>, trace: &TraceSettings, nits_per_unit: f64) -> SceneLight {
    steady_light(&PathTracer::new(scene, small(trace)), nits_per_unit)
}

/// A steady glimpse of what one operator asks for, until what it makes of it is steady as well, and by what share that
/// changed when the samples were doubled last.
pub fn steady_glimpse_for(
    operator: &dyn ToneOperator,
    scene: Arc<Scene>,
    trace: &TraceSettings,
    nits_per_unit: f64,
    made_of_it: &dyn Fn(&SceneLight) -> Vec<f32>,
) -> (SceneLight, f32) {
    let tracer = PathTracer::new(scene, small(trace));
    steady_light_for(operator, &tracer, nits_per_unit, MAX_SAMPLES, made_of_it)
}

/// A steady glimpse as [`steady_glimpse_for`] takes it, with fewer pixels and up to thirty times as many samples in
/// each, for views that are lit by what few samples find: most pixels of a glimpse have none of it then, and their
/// geometric mean is that of another scene.
pub fn coarse_glimpse_for(
    operator: &dyn ToneOperator,
    scene: Arc<Scene>,
    trace: &TraceSettings,
    nits_per_unit: f64,
    made_of_it: &dyn Fn(&SceneLight) -> Vec<f32>,
) -> SceneLight {
    let tracer = PathTracer::new(scene, no_longer_than(COARSE_SIDE, trace));
    steady_light_for(operator, &tracer, nits_per_unit, MAX_COARSE_SAMPLES, made_of_it).0
}

/// What one operator asks for as a few pixels see it, however noisy: for telling which of many views are lighter.
pub fn brief_glimpse_for(
    operator: &dyn ToneOperator,
    scene: Arc<Scene>,
    trace: &TraceSettings,
    nits_per_unit: f64,
) -> SceneLight {
    let longest_side = (trace.width.max(trace.height) / SIDES_OF_A_BRIEF_GLIMPSE).clamp(1, COARSE_SIDE);
    let tracer = PathTracer::new(scene, no_longer_than(longest_side, trace));
    Seen::of(&pilot(&tracer), &tracer, nits_per_unit).light_for(operator, tracer.settings().width)
}

/// A steady glimpse from where a camera is now, by a tracer that is there and works by the same settings again in the
/// end.
pub fn steady_glimpse_from(
    camera: &Camera,
    tracer: &mut PathTracer,
    trace: &TraceSettings,
    nits_per_unit: f64,
) -> SceneLight {
    let before = *tracer.settings();
    tracer.set_view(camera, small(trace));
    let light = steady_light(tracer, nits_per_unit);
    tracer.set_view(camera, before);
    light
}

/// Settings of a small picture of the whole.
fn small(trace: &TraceSettings) -> TraceSettings {
    no_longer_than(LONGEST_SIDE, trace)
}

fn no_longer_than(side: u32, trace: &TraceSettings) -> TraceSettings {
    let (width, height) = glimpse_size(side, trace.width, trace.height);
    TraceSettings { width, height, crop: None, ..*trace }
}

/// A film with a glimpse's samples.
fn pilot(tracer: &PathTracer) -> Film {
    let TraceSettings { width, height, .. } = *tracer.settings();
    let mut film = Film::new(width, height);
    tracer.trace(&pilot_plan(&film, samples_per_pixel(width, height)), &mut film, &|_| {});
    film
}

fn steady_light(tracer: &PathTracer, nits_per_unit: f64) -> SceneLight {
    let Seen { rgb_cd_m2, alpha } = Steady::of(tracer, nits_per_unit, MAX_SAMPLES, &|_| Vec::new()).seen;
    where_covered(SceneLight::with_rods(tracer.settings().width as usize, &rgb_cd_m2), alpha.as_deref())
}

fn where_covered(light: SceneLight, alpha: Option<&[f32]>) -> SceneLight {
    match alpha {
        Some(alpha) => light.where_covered(alpha),
        None => light,
    }
}

fn steady_light_for(
    operator: &dyn ToneOperator,
    tracer: &PathTracer,
    nits_per_unit: f64,
    most_samples: u64,
    made_of_it: &dyn Fn(&SceneLight) -> Vec<f32>,
) -> (SceneLight, f32) {
    let width = tracer.settings().width;
    let made_of_it = |seen: &Seen| made_of_it(&seen.light_for(operator, width));
    let steady = Steady::of(tracer, nits_per_unit, most_samples, &made_of_it);
    (steady.seen.light_for(operator, width), steady.last_change)
}

/// What a glimpse sees.
struct Seen {
    /// Linear RGB in cd/m² of all pixels.
    rgb_cd_m2: Vec<[f32; 3]>,
    /// How much of each pixel is covered, where what surrounds the scene is left out.
    alpha: Option<Vec<f32>>,
}

impl Seen {
    fn of(film: &Film, tracer: &PathTracer, nits_per_unit: f64) -> Self {
        let estimate = film.estimate(nits_per_unit);
        if tracer.settings().transparent {
            // Denoised, light leaks over silhouettes: of a chess pawn at 64×64, whose white by `ward94` is at 12333
            // cd/m², it comes out at 10304, by the means at 12197.
            return Self { rgb_cd_m2: estimate.rgb_cd_m2, alpha: Some(film.coverage()) };
        }
        Self { rgb_cd_m2: guide_rgb(film, &estimate), alpha: None }
    }

    /// What an operator asks for of a picture of this width.
    fn light_for(&self, operator: &dyn ToneOperator, width: u32) -> SceneLight {
        where_covered(SceneLight::of(operator, width as usize, &self.rgb_cd_m2), self.alpha.as_deref())
    }
}

/// A picture that hardly changes, unless it has as many samples as it may.
struct Steady {
    seen: Seen,
    /// By what share what is made of it changed last, at the most.
    last_change: f32,
}

impl Steady {
    /// Once its [`levels`] and what else is made of it change little.
    fn of(tracer: &PathTracer, nits_per_unit: f64, most_samples: u64, made_of_it: &dyn Fn(&Seen) -> Vec<f32>) -> Self {
        let mut film = pilot(tracer);
        let mut steady = Self { seen: Seen::of(&film, tracer, nits_per_unit), last_change: f32::INFINITY };
        let mut before = (levels(&steady.seen.rgb_cd_m2), made_of_it(&steady.seen));
        while 2 * film.total_samples() <= most_samples {
            let pixels = film.pixel_count() as u64;
            let twice = uniform_plan(&film, (2 * film.total_samples() / pixels) as u32);
            tracer.trace(&twice, &mut film, &|_| {});
            steady.seen = Seen::of(&film, tracer, nits_per_unit);
            let now = (levels(&steady.seen.rgb_cd_m2), made_of_it(&steady.seen));
            steady.last_change = largest_change(&before.1, &now.1);
            if largest_change(&before.0, &now.0).max(steady.last_change) <= STEADY {
                break;
            }
            before = now;
        }
        steady
    }
}

/// The largest share by which a value changed; none did where all are 0.
fn largest_change(before: &[f32], now: &[f32]) -> f32 {
    let change = |(before, now): (&f32, &f32)| if before == now { 0.0 } else { ((now - before) / now).abs() };
    before.iter().zip(now).map(change).fold(0.0, f32::max)
}

/// Luminance that half, a twentieth and a hundredth of the picture exceed: what operators are mostly fitted to.
fn levels(rgb_cd_m2: &[[f32; 3]]) -> [f32; 3] {
    let mut luminances: Vec<f32> = rgb_cd_m2.iter().map(|&rgb| luminance(rgb)).collect();
    luminances.sort_unstable_by(f32::total_cmp);
    let exceeded_by = |share: usize| luminances.get(luminances.len() - luminances.len() / share).or(luminances.last());
    [2, 20, 100].map(|share| exceeded_by(share).copied().unwrap_or(0.0))
}

/// A power of two from 4 to 16.
fn samples_per_pixel(width: u32, height: u32) -> u32 {
    let afforded = u64::from(SAMPLES) / (u64::from(width) * u64::from(height)).max(1);
    1 << afforded.clamp(4, 16).ilog2()
}

fn glimpse_size(longest_side: u32, width: u32, height: u32) -> (u32, u32) {
    let longest = width.max(height);
    let scaled = |side: u32| {
        if longest <= longest_side {
            side
        } else {
            (u64::from(side) * u64::from(longest_side) / u64::from(longest)).max(1) as u32
        }
    };
    (scaled(width), scaled(height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::{LoadOptions, load};
    use fechner_perception::tone::{ToneSettings, operator_with};
    use std::path::Path;

    /// Where few samples spread lamps over the picture, a glimpse goes on until it has the light of a render.
    /// Regression: with a pilot's samples white was at a third of the render's.
    #[test]
    fn a_steady_glimpse_has_the_light_of_the_whole() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/many-lights.toml");
        let scene = Arc::new(load(&file, &LoadOptions::default()).expect("our own scene"));
        let trace = TraceSettings::new(128, 96, 0);
        let tracer = PathTracer::new(Arc::clone(&scene), trace);
        let mut film = Film::new(128, 96);
        while film.total_samples() < 128 * 128 * 96 {
            let samples = (2 * film.total_samples() / (128 * 96)).max(16) as u32;
            let plan = if film.total_samples() == 0 { pilot_plan(&film, 16) } else { uniform_plan(&film, samples) };
            tracer.trace(&plan, &mut film, &|_| {});
        }
        let of_film = |film: &Film| levels(&guide_rgb(film, &film.estimate(scene.nits_per_unit)))[1];
        let (right, few) = (of_film(&film), of_film(&pilot(&tracer)));
        let steady = Steady::of(&tracer, scene.nits_per_unit, MAX_SAMPLES, &|_| Vec::new());
        let steady = levels(&steady.seen.rgb_cd_m2)[1];
        // Of six seeds with the 64 samples that it ends with white scatters by 2.6 %: three deviations from one
        // with 128.
        assert!((steady / right - 1.0).abs() < 0.1, "{steady} cd/m² at a twentieth, in the whole {right}");
        assert!(few < 0.5 * right, "{few} cd/m² by a pilot: the scene shows nothing");
    }

    /// By one operator, of the whole picture, and of a transparent one where it is covered.
    #[test]
    fn a_brief_glimpse_tells_how_light_a_view_is() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
        let scene = Arc::new(load(&file, &LoadOptions::default()).expect("our own scene"));
        let operator = operator_with("constant", &ToneSettings::default()).expect("an operator");
        for transparent in [false, true] {
            let trace = TraceSettings { transparent, ..TraceSettings::new(96, 96, 0) };
            let ln_mean = |light: &SceneLight| {
                let lit = light.luminance_cd_m2().values().iter().filter(|&&cd_m2| cd_m2 > 0.0);
                lit.clone().map(|&cd_m2| f64::from(cd_m2).ln()).sum::<f64>() / lit.count() as f64
            };
            let brief = brief_glimpse_for(operator.as_ref(), Arc::clone(&scene), &trace, scene.nits_per_unit);
            let steady =
                steady_glimpse_for(operator.as_ref(), Arc::clone(&scene), &trace, scene.nits_per_unit, &|_| Vec::new());
            let ratio = (ln_mean(&brief) - ln_mean(&steady.0)).exp();
            println!("transparent {transparent}: {ratio}");
            assert_eq!(brief.luminance_cd_m2().width(), 24);
            assert!((ratio - 1.0).abs() < 0.1, "transparent {transparent}: {ratio} times as light");
        }
    }

    #[test]
    fn glimpses_keep_the_shape() {
        assert_eq!(glimpse_size(LONGEST_SIDE, 1920, 1080), (256, 144));
        assert_eq!(glimpse_size(COARSE_SIDE, 480, 270), (64, 36));
        assert_eq!(glimpse_size(LONGEST_SIDE, 32, 18), (32, 18));
        assert_eq!(glimpse_size(LONGEST_SIDE, 4000, 2), (256, 1));
        assert_eq!([(256, 256), (256, 144), (128, 96), (64, 36)].map(|(w, h)| samples_per_pixel(w, h)), [4, 4, 8, 16]);
    }
}
