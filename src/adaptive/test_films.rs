//! Films of known noise, for tests.

use super::plan::pilot_plan;
use super::settings::LoopSettings;
use crate::film::{BlockSum, Film};
use crate::integrator::{FirstHit, PathSample};
use crate::sampler::{hash_words, unit_of_hash};
use fechner_perception::display::{Display, Viewing};
use fechner_perception::tone::operator;
use glam::Vec3;

/// An absolute operator on a desktop display.
pub(super) fn settings() -> LoopSettings {
    let viewing = Viewing::of(Display::preset("desktop").expect("a preset"));
    LoopSettings::new(viewing, 100.0, operator("absolute", None).expect("an operator"))
}

/// A pilot at 64×64 of `color(pixel, random in −1..1)`.
pub(super) fn film_of(color: impl Fn(u32, f32) -> Vec3) -> Film {
    film_of_lamps(color, |_| false)
}

/// The same of pixels of which some shine.
pub(super) fn film_of_lamps(color: impl Fn(u32, f32) -> Vec3, shines: impl Fn(u32) -> bool) -> Film {
    let mut film = Film::new(64, 64);
    for block in pilot_plan(&film, 16).blocks {
        let mut sum = BlockSum::default();
        let shines = shines(block.pixel);
        let first_hit = FirstHit { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1, shines };
        for index in block.first..block.first + block.samples {
            let key = u64::from(block.pixel) << 8 | u64::from(index);
            let random = 2.0 * unit_of_hash(hash_words(key, block.half.index() as u64)) - 1.0;
            sum.add(&PathSample { radiance: color(block.pixel, random), first_hit, rays: 1 });
        }
        film.merge_block(block, &sum);
    }
    film
}
