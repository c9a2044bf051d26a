//! A small, denoised picture of all that a camera sees: how light the view is, before any of it is rendered.
//!
//! For tone operators that must be fitted to more than the picture at hand: to a shot of which it is a frame, to the whole of
//! which it is a part. Not for output, nor for thresholds.

use super::judge::guide_rgb;
use super::plan::pilot_plan;
use crate::film::Film;
use crate::integrator::{PathTracer, TraceSettings};
use crate::scene::{Camera, Scene};
use fechner_perception::tone::{SceneLight, ToneOperator};
use std::sync::Arc;

/// Longest side of a glimpse in pixels: at 64 the lamps of `scenes/many-lights.toml` touched more than one pixel in twenty, which is where the
/// operator `constant` has its white, and that was at 911 cd/m² for a picture of 512×384 that has it at 137; here it is at 145.
const LONGEST_SIDE: u32 = 256;
/// Samples of a glimpse, about.
const SAMPLES: u32 = 1 << 17;

/// Looks at all of the picture, whatever part of it the settings ask for: a pure function of scene and settings. Light is what
/// `operator` asks for; without one, what any may ask for.
pub fn glimpse(
    scene: Arc<Scene>,
    trace: &TraceSettings,
    nits_per_unit: f64,
    operator: Option<&dyn ToneOperator>,
) -> SceneLight {
    light_seen_by(&PathTracer::new(scene, small(trace)), nits_per_unit, operator)
}

/// The same from where a camera is now, by a tracer that is there and works by the same settings again in the end.
pub fn glimpse_from(
    camera: &Camera,
    tracer: &mut PathTracer,
    trace: &TraceSettings,
    nits_per_unit: f64,
    operator: Option<&dyn ToneOperator>,
) -> SceneLight {
    let before = *tracer.settings();
    tracer.set_view(camera, small(trace));
    let light = light_seen_by(tracer, nits_per_unit, operator);
    tracer.set_view(camera, before);
    light
}

/// Settings of a small picture of the whole.
fn small(trace: &TraceSettings) -> TraceSettings {
    let (width, height) = glimpse_size(trace.width, trace.height);
    TraceSettings { width, height, crop: None, ..*trace }
}

fn light_seen_by(tracer: &PathTracer, nits_per_unit: f64, operator: Option<&dyn ToneOperator>) -> SceneLight {
    let TraceSettings { width, height, .. } = *tracer.settings();
    let mut film = Film::new(width, height);
    tracer.trace(&pilot_plan(&film, samples_per_pixel(width, height)), &mut film, &|_| {});
    let rgb_cd_m2 = guide_rgb(&film, &film.estimate(nits_per_unit));
    match operator {
        Some(operator) => SceneLight::of(operator, width as usize, &rgb_cd_m2),
        None => SceneLight::with_rods(width as usize, &rgb_cd_m2),
    }
}

/// A power of two from 4 to 16.
fn samples_per_pixel(width: u32, height: u32) -> u32 {
    let afforded = u64::from(SAMPLES) / (u64::from(width) * u64::from(height)).max(1);
    1 << afforded.clamp(4, 16).ilog2()
}

fn glimpse_size(width: u32, height: u32) -> (u32, u32) {
    let longest = width.max(height);
    let scaled = |side: u32| {
        if longest <= LONGEST_SIDE {
            side
        } else {
            (u64::from(side) * u64::from(LONGEST_SIDE) / u64::from(longest)).max(1) as u32
        }
    };
    (scaled(width), scaled(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glimpses_keep_the_shape() {
        assert_eq!(glimpse_size(1920, 1080), (256, 144));
        assert_eq!(glimpse_size(32, 18), (32, 18));
        assert_eq!(glimpse_size(4000, 2), (256, 1));
        assert_eq!([(256, 256), (256, 144), (128, 96), (64, 36)].map(|(w, h)| samples_per_pixel(w, h)), [4, 4, 8, 16]);
    }
}
