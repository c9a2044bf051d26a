//! Films of known noise, for tests.

use super::settings::LoopSettings;
use crate::film::{Film, film_of_samples};
use crate::integrator::{FirstHit, PILOT_SAMPLES_PER_HALF, PathSample, TraceSettings};
use crate::sampler::{Half, hash_words, unit_of_hash};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone::operator;
use glam::Vec3;

/// Pixels along a film's edge.
const SIDE: u32 = 64;

/// An absolute operator on a desktop display.
pub(super) fn settings() -> LoopSettings {
    let viewing = Viewing::of(Display::preset("desktop").expect("a preset"));
    LoopSettings::new(
        &TraceSettings::new(SIDE, SIDE, 1),
        viewing,
        100.0,
        operator("absolute", None).expect("an operator"),
    )
}

/// A pilot, square, of `color(pixel, random in −1..1)`.
pub(super) fn film_of(color: impl Fn(u32, f32) -> Vec3) -> Film {
    film_of_lamps(color, |_| false)
}

/// A pilot, square, of `color(pixel, random in −1..1)`, of whose pixels some shine.
pub(super) fn film_of_lamps(color: impl Fn(u32, f32) -> Vec3, shines: impl Fn(u32) -> bool) -> Film {
    film_of_halves([PILOT_SAMPLES_PER_HALF; 2], shines, |pixel, _, random| color(pixel, random))
}

/// A square film of so many samples of each half of every pixel, some of which shine, of
/// `color(pixel, half, random in −1..1)`.
pub(super) fn film_of_halves(
    samples: [u32; 2],
    shines: impl Fn(u32) -> bool,
    color: impl Fn(u32, Half, f32) -> Vec3,
) -> Film {
    film_of_samples([SIDE, SIDE], samples, |pixel, half, index| {
        let key = u64::from(pixel) << 8 | u64::from(index);
        let random = 2.0 * unit_of_hash(hash_words(key, half.index() as u64)) - 1.0;
        let first_hit = FirstHit { shines: shines(pixel), ..FirstHit::WALL };
        PathSample { radiance: color(pixel, half, random), first_hit, rays: 1 }
    })
}
