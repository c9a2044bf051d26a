//! Light right beyond the film's border, into which the pixel filter of the outermost pixels reaches.
//!
//! No pixel of the film is covered by it, so that nothing in the picture tells of what few samples meet: of a ball of
//! light half a pixel beyond, six renders in eight find nothing and stop at 16 samples, 77 times above threshold. Only
//! lamps and the sky are looked for, that cameras see straight; what they are compared with may be lit.

use super::luminances::{Luminances, MIN_CONTRAST};
use super::shares::{Piece, Shares};
use crate::integrator::{Crop, PathTracer};
use crate::sampler::{BlockKey, Pixel, Purpose};
use glam::Vec2;
use rayon::prelude::*;

/// How far beyond the border pixel filters reach, in pixels.
const REACH_PX: f32 = 1.0;
/// Steps of a pixel across the border, and along it. In half a pixel across, a filter's tail falls to a tenth.
const ACROSS: u32 = 4;
const ALONG: u32 = 2;
/// Paths that ask how bright it is where light is seen straight, beyond and inside.
const PATHS: u32 = 4;
/// Makes the random numbers differ from those of pictures, whatever their seed.
const STREAM: u64 = 0x626f_7264_6572_0001;

/// A place beyond the border.
struct Beyond {
    place_px: Vec2,
    /// The middle of the film's pixel that is closest.
    inside_px: Vec2,
}

impl PathTracer {
    /// Adds what differs from the border's own light, to pixels that have a filter which reaches there.
    pub(super) fn look_beyond_border(&self, shares: &mut Shares) {
        if self.settings.filter.smooth_radius_px().is_none() {
            return;
        }
        let places = places_beyond(self.settings.film_area());
        let differences: Vec<f32> =
            places.par_iter().enumerate().map(|(number, beyond)| self.difference_beyond(beyond, number)).collect();
        for (Beyond { place_px, .. }, luminance) in places.into_iter().zip(differences) {
            if luminance > 0.0 {
                shares.add(&Piece {
                    place_px,
                    way_px: Vec2::ZERO,
                    area_px2: REACH_PX / (ACROSS * ALONG) as f32,
                    spread_px: Vec2::ZERO,
                    luminance,
                    is_urgent: false,
                });
            }
        }
    }

    /// By how much the luminance beyond differs from that inside, scene units; 0 where that is little, or no light is
    /// seen straight. From points of the lens, and at moments, that change from one number to the next.
    fn difference_beyond(&self, Beyond { place_px, inside_px }: &Beyond, number: usize) -> f32 {
        let key = BlockKey::of_probe(STREAM, Pixel { x: number as u32, y: 0 });
        let ray_of = |place_px: Vec2, index: u32| {
            let sample = key.sample(index);
            let [.., lens_u, lens_v] = sample.draw(Purpose::Camera);
            let time = if self.moves { sample.draw(Purpose::Time)[0] } else { 0.0 };
            self.camera.at(time).ray(place_px, [lens_u, lens_v])
        };
        let straight =
            |place_px: Vec2| self.luminance_of(self.light_straight_along(ray_of(place_px, 0), key.sample(0)));
        let [there, inside] = [straight(*place_px), straight(*inside_px)];
        if (there - inside).abs() <= MIN_CONTRAST * inside {
            return 0.0;
        }
        // What has no light of its own may be as bright.
        let seen = |index: u32, place_px: Vec2| {
            self.luminance_of(self.trace_path(ray_of(place_px, index), key.sample(index)).radiance)
        };
        let there: Luminances = (0..PATHS).map(|index| seen(index, *place_px)).collect();
        there.difference(&(PATHS..2 * PATHS).map(|index| seen(index, *inside_px)).collect())
    }
}

/// Places around the film.
fn places_beyond(area: Crop) -> Vec<Beyond> {
    let low = Vec2::new(area.x as f32, area.y as f32);
    let high = low + Vec2::new(area.width as f32, area.height as f32);
    let across = || (0..ACROSS).map(|step| (step as f32 + 0.5) / ACROSS as f32 * REACH_PX);
    let along = |from: f32, to: f32| {
        let steps = (to - from) * ALONG as f32;
        (0..steps as u32).map(move |step| from + (step as f32 + 0.5) / ALONG as f32)
    };
    let mut places = Vec::new();
    for away in across() {
        // Corners belong to the top and the bottom.
        let level = along(low.x - REACH_PX, high.x + REACH_PX);
        places.extend(level.flat_map(|x| [Vec2::new(x, low.y - away), Vec2::new(x, high.y + away)]));
        places.extend(along(low.y, high.y).flat_map(|y| [Vec2::new(low.x - away, y), Vec2::new(high.x + away, y)]));
    }
    let beyond = |place_px: Vec2| Beyond { place_px, inside_px: place_px.clamp(low, high - 1.0).floor() + 0.5 };
    places.into_iter().map(beyond).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All around a film, each part of the frame once, beside the pixel that is closest.
    #[test]
    fn places_surround_the_film() {
        let places = places_beyond(Crop { x: 10, y: 20, width: 3, height: 2 });
        // A frame of 5 x 4 pixels around 3 x 2.
        assert_eq!(places.len() as u32, (5 * 4 - 3 * 2) * ACROSS * ALONG);
        for Beyond { place_px, inside_px } in places {
            let is_outside = !(10.0..13.0).contains(&place_px.x) || !(20.0..22.0).contains(&place_px.y);
            assert!(is_outside && (9.0..14.0).contains(&place_px.x) && (19.0..23.0).contains(&place_px.y));
            assert!((10.0..13.0).contains(&inside_px.x) && (20.0..22.0).contains(&inside_px.y), "{inside_px}");
            assert!((place_px - inside_px).abs().max_element() < 1.5, "{place_px} beside {inside_px}");
        }
    }
}
