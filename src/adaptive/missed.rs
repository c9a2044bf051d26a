//! Edges of lamps that no sample has found.
//!
//! A pixel of which a bright lamp covers two per cent is white in truth, and dark in both halves until one sample in
//! fifty meets the lamp: neither the halves' difference nor the raw mean tells of it. Its neighbour does, of which the
//! lamp covers more. How coverage falls from a pixel to the next across an edge is known: it is the pixel filter's own
//! shape. Of a lamp thinner than a pixel nothing tells which way it goes on: any neighbour may have as much of it.

use crate::film::{Film, HalfPixel, Halves};
use crate::sampler::{Half, PixelFilter};
use fechner_perception::Plane;
use fechner_perception::tone::Pixel;

/// Pixels to each side in which a lamp's full light is looked for.
const RADIUS: usize = 3;

/// How much of a pixel lies beyond a straight edge, by the edge's distance, for a pixel filter.
pub(super) struct EdgeProfile {
    radius_px: f32,
    /// Coverage where the edge is at −radius, …, +radius: falls from 1 to 0.
    coverage: Vec<f32>,
}

impl EdgeProfile {
    const CELLS: usize = 256;

    /// Coverage across an edge under a pixel filter; `None` for one that tells of no neighbour, as the box, or has
    /// negative lobes.
    pub(super) fn of(filter: PixelFilter) -> Option<Self> {
        let radius_px = filter.smooth_radius_px()?;
        let at = |cell: usize| radius_px * (2.0 * (cell as f32 + 0.5) / Self::CELLS as f32 - 1.0);
        let heights: Vec<f32> = (0..Self::CELLS).map(|cell| filter.height(at(cell))).collect();
        let all: f32 = heights.iter().sum();
        let mut left = all;
        let mut coverage = vec![1.0];
        coverage.extend(heights.iter().map(|height| {
            left -= height;
            (left / all).max(0.0)
        }));
        Some(Self { radius_px, coverage })
    }

    /// Coverage of a pixel that is `step_px` farther out than one of this coverage.
    pub(super) fn farther_out(&self, coverage: f32, step_px: f32) -> f32 {
        let cell = self.coverage.partition_point(|&value| value > coverage);
        let cells_a_px = Self::CELLS as f32 / (2.0 * self.radius_px);
        let farther = cell as f32 + step_px * cells_a_px;
        self.coverage.get(farther.round() as usize).copied().unwrap_or(0.0)
    }
}

/// What the samples of each pixel have found, cd/m².
pub(super) struct FoundLight {
    /// Mean luminance of the samples, cd/m².
    pub(super) mean_cd_m2: Plane,
    /// Luminance, cd/m², of a lamp before black which some of the samples have met: the mean square over the mean. Of a
    /// pixel that it covers by a twentieth, the mean is a twentieth of this.
    lamp_cd_m2: Plane,
}

impl FoundLight {
    /// What the samples of a film have found, both halves together.
    pub(super) fn of_film(film: &Film, nits_per_unit: f64) -> Self {
        Self::of(film, nits_per_unit, |pixel| film.halves(pixel))
    }

    /// What the samples of a half have found; of the other one where it has none.
    pub(super) fn of_half(film: &Film, half: Half, nits_per_unit: f64) -> Self {
        Self::of(film, nits_per_unit, |pixel| Halves::Only(film.halves(pixel).half_or_other(half)))
    }

    fn of<'a>(film: &Film, nits_per_unit: f64, halves: impl Fn(usize) -> Halves<'a> + Sync) -> Self {
        let width = film.width() as usize;
        let plane = |value: &(dyn Fn(Halves<'a>) -> f64 + Sync)| {
            Plane::from_fn(width, film.height() as usize, |x, y| (nits_per_unit * value(halves(y * width + x))) as f32)
        };
        let mean = |halves: Halves<'a>| halves.mean(HalfPixel::luminance);
        let lamp = |halves: Halves<'a>| {
            let mean = mean(halves);
            if mean > 0.0 { halves.mean(mean_square_luminance) / mean } else { 0.0 }
        };
        Self { mean_cd_m2: plane(&mean), lamp_cd_m2: plane(&lamp) }
    }
}

fn mean_square_luminance(half: &HalfPixel) -> f64 {
    half.luminance().powi(2) + f64::from(half.m2[0]) / f64::from(half.samples.max(1))
}

/// Where lamps' edges are looked for.
pub(super) struct LampEdges<'a> {
    pub(super) profile: EdgeProfile,
    pub(super) film: &'a Film,
    /// What the film, or one of its halves, has found.
    pub(super) found: &'a FoundLight,
    /// What shines counts as a lamp from this luminance on.
    pub(super) lamps_from_cd_m2: f32,
}

impl LampEdges<'_> {
    /// Luminance of lamps, cd/m², that is expected in each pixel beyond what its samples have found.
    pub(super) fn missed(&self) -> Plane {
        self.missed_where(|pixel| !self.film.features()[pixel].object.shines())
    }

    /// Luminance of lamps, cd/m², that is expected in each pixel beside what its samples have found, whether they have
    /// met the lamp or not. Counts that go by [`Self::missed`] would end where a rim was lucky, and make rims bright by
    /// 0.2 % of the whole picture's light.
    pub(super) fn expected(&self) -> Plane {
        self.missed_where(|_| true)
    }

    fn missed_where(&self, may_have_missed: impl Fn(usize) -> bool) -> Plane {
        let FoundLight { mean_cd_m2, lamp_cd_m2 } = self.found;
        let (width, height) = (mean_cd_m2.width(), mean_cd_m2.height());
        let around = |(x, y): (usize, usize), radius: usize| {
            let columns = x.saturating_sub(radius)..width.min(x + radius + 1);
            let rows = y.saturating_sub(radius)..height.min(y + radius + 1);
            rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
        };
        let light = |(x, y): (usize, usize)| mean_cd_m2.get(x, y);
        let shines = |(x, y): (usize, usize)| self.film.features()[y * width + x].object.shines();
        let is_lamp = |at: (usize, usize)| shines(at) && light(at) > self.lamps_from_cd_m2;
        let mut missed = Plane::filled(width, height, 0.0);
        for lamp in (0..width * height).map(|pixel| (pixel % width, pixel / width)).filter(|&at| is_lamp(at)) {
            // Far from any rim what shines is known as all else is: a picture, a screen or a sky has brighter places,
            // too.
            if around(lamp, RADIUS).all(shines) {
                continue;
            }
            let lamps = || around(lamp, RADIUS).filter(|&at| is_lamp(at));
            let full = lamps().map(|(x, y)| lamp_cd_m2.get(x, y)).fold(0.0, f32::max);
            // By each one's own light: a dim lamp's rim beside a bright lamp is a rim.
            let is_thin = lamps().all(|at| light(at) < 0.5 * lamp_cd_m2.get(at.0, at.1));
            for (x, y) in around(lamp, 1) {
                let pixel = y * width + x;
                if !may_have_missed(pixel) {
                    continue;
                }
                let (own, samples) = (light((x, y)), self.film.samples(pixel) as f32);
                let coverage = light(lamp) / full;
                let step_px = ((x.abs_diff(lamp.0) + y.abs_diff(lamp.1)) as f32).sqrt();
                let coverage = if is_thin { coverage } else { self.profile.farther_out(coverage, step_px) };
                // In the place of the pixel's own light; of a coverage that scatters about this by as much, after so
                // many samples without a hit.
                let expected = (full - own).max(0.0) * coverage / (1.0 + samples * coverage);
                missed.values_mut()[pixel] = expected.max(missed.get(x, y));
            }
        }
        missed
    }
}

/// How much brighter a picture is expected to be seen with light that may be missing, where that scatters
/// exponentially about its mean.
pub(super) struct Darkness {
    /// Mean of how much brighter, display cd/m².
    pub(super) mean: Plane,
    /// Mean square of how much brighter, (cd/m²)² on the display.
    pub(super) mean_square: Plane,
}

impl Darkness {
    /// How much brighter a picture with this missing light, cd/m², is expected to be seen. `shown`: what is displayed
    /// of a pixel with so much more light, cd/m².
    pub(super) fn of(missed: &Plane, shown: impl Fn(Pixel, f32) -> f32) -> Self {
        /// Means of the fifths of an exponential variable of mean 1.
        const FIFTHS: [f32; 5] = [0.107, 0.360, 0.700, 1.223, 2.610];
        let none = missed.map(|_| 0.0);
        let mut darkness = Self { mean: none.clone(), mean_square: none };
        for (index, &light) in missed.values().iter().enumerate().filter(|&(_, &light)| light > 0.0) {
            let pixel = Pixel { x: index % missed.width(), y: index / missed.width() };
            let without = shown(pixel, 0.0);
            for times in FIFTHS {
                let brighter = shown(pixel, times * light) - without;
                let share = 1.0 / FIFTHS.len() as f32;
                darkness.mean.values_mut()[index] += share * brighter;
                darkness.mean_square.values_mut()[index] += share * brighter * brighter;
            }
        }
        darkness
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::plan::pilot_plan;
    use crate::film::BlockSum;
    use crate::integrator::{FirstHit, PathSample};
    use glam::Vec3;

    /// A pilot of columns that shine as told.
    fn film_of_columns(side: u32, radiance: impl Fn(u32) -> f32) -> Film {
        film_of(side, |Pixel { x, .. }, _| radiance(x as u32))
    }

    /// A pilot whose samples, of an index in their half, are as told.
    fn film_of(side: u32, radiance: impl Fn(Pixel, u32) -> f32) -> Film {
        let mut film = Film::new(side, side);
        for block in pilot_plan(&film, 16).blocks {
            let pixel = Pixel { x: (block.pixel % side) as usize, y: (block.pixel / side) as usize };
            let mut sum = BlockSum::default();
            for index in block.first..block.first + block.samples {
                let value = radiance(pixel, index);
                let first_hit =
                    FirstHit { albedo: Vec3::ONE, normal: Vec3::Z, depth: 1.0, object_id: 1, shines: value > 0.0 };
                sum.add(&PathSample { radiance: Vec3::splat(value), first_hit, rays: 1 });
            }
            film.merge_block(block, &sum);
        }
        film
    }

    /// The Gaussian of σ 0.45 pixels, cut at 1.5: across a straight edge coverage goes 0.5, 0.013, 0.
    #[test]
    fn coverage_falls_by_the_filters_shape() {
        let profile = EdgeProfile::of(PixelFilter::Gaussian).expect("is smooth");
        assert!((profile.farther_out(0.5, 0.0) - 0.5).abs() < 0.02);
        assert!((profile.farther_out(0.5, 1.0) - 0.013).abs() < 0.002, "{}", profile.farther_out(0.5, 1.0));
        assert_eq!(profile.farther_out(0.5, 2.0), 0.0);
        assert!((profile.farther_out(1.0, 1.5) - 0.5).abs() < 0.02, "{}", profile.farther_out(1.0, 1.5));
        assert!(
            EdgeProfile::of(PixelFilter::Box).is_none(),
            "beside a pixel that is half covered lies one that is not"
        );
    }

    /// Of a lamp whose edge covers half of a column, the column beside it has what the filter says, less for samples
    /// without a hit, and the one after that nothing.
    #[test]
    fn light_is_missed_beside_lamps_alone() {
        const SIDE: usize = 8;
        let film = film_of_columns(SIDE as u32, |x| {
            if x < 3 {
                1e4
            } else if x == 3 {
                5e3
            } else {
                0.0
            }
        });
        let found = FoundLight::of_film(&film, 1.0);
        let edges = |lamps_from_cd_m2| LampEdges {
            profile: EdgeProfile::of(PixelFilter::Gaussian).expect("is smooth"),
            film: &film,
            found: &found,
            lamps_from_cd_m2,
        };
        let missed = edges(100.0).missed();
        assert_eq!(edges(100.0).expected().get(4, 4), missed.get(4, 4));
        assert!(edges(100.0).expected().get(3, 4) > 0.0, "where samples have met the lamp, too");
        let samples = film.samples(0) as f32;
        let expected = 1e4 * 0.013 / (1.0 + 0.013 * samples);
        for y in 0..SIDE {
            assert!((missed.get(4, y) / expected - 1.0).abs() < 0.2, "{} for {expected}", missed.get(4, y));
            assert!((0..SIDE).filter(|&x| x != 4).all(|x| missed.get(x, y) == 0.0));
        }
        assert!(edges(1e6).missed().values().iter().all(|&light| light == 0.0));
    }

    /// A tube that covers an eighth of its pixels is met by one sample of each half in the upper rows, and by none
    /// below: the first of these may have as much of it, and so may pixels to the side, but none farther away.
    #[test]
    fn thin_lamps_may_go_on_either_way() {
        const SIDE: usize = 8;
        let film = film_of(SIDE as u32, |Pixel { x, y }, index| if x == 3 && y < 4 && index == 5 { 1e4 } else { 0.0 });
        let of_one_in_eight = FoundLight::of_half(&film, Half::B, 1.0);
        assert!((of_one_in_eight.mean_cd_m2.get(3, 0) / (1e4 / 8.0) - 1.0).abs() < 1e-4);
        assert!(
            (of_one_in_eight.lamp_cd_m2.get(3, 0) / 1e4 - 1.0).abs() < 1e-4,
            "{}",
            of_one_in_eight.lamp_cd_m2.get(3, 0)
        );
        let found = FoundLight::of_film(&film, 1.0);
        let profile = EdgeProfile::of(PixelFilter::Gaussian).expect("is smooth");
        let missed = LampEdges { profile, film: &film, found: &found, lamps_from_cd_m2: 0.0 }.missed();
        let coverage = 1.0 / 8.0;
        let expected = 1e4 * coverage / (1.0 + 16.0 * coverage);
        for (x, y) in [(3, 4), (4, 2), (2, 4)] {
            assert!((missed.get(x, y) / expected - 1.0).abs() < 1e-3, "{x}, {y}: {} for {expected}", missed.get(x, y));
        }
        assert_eq!(
            [missed.get(3, 5), missed.get(5, 2), missed.get(3, 2)],
            [0.0; 3],
            "what has met the lamp has missed none"
        );
    }

    /// A picture that shines from edge to edge has no rim, however uneven it is.
    #[test]
    fn a_screen_has_no_rim() {
        let film = film_of_columns(8, |x| 1.0 + 100.0 * (x % 2) as f32);
        let found = FoundLight::of_film(&film, 1.0);
        let profile = EdgeProfile::of(PixelFilter::Gaussian).expect("is smooth");
        let edges = LampEdges { profile, film: &film, found: &found, lamps_from_cd_m2: 0.0 };
        assert!(edges.expected().values().iter().all(|&light| light == 0.0));
    }

    /// Far below white as much is seen as is missing; far above it, white.
    #[test]
    fn no_more_than_white_is_missing() {
        let missed = Plane::from_fn(3, 1, |x, _| [0.0, 1.0, 1e6][x]);
        let dark = Darkness::of(&missed, |_, light| (50.0 + light).min(200.0));
        assert_eq!(dark.mean.get(0, 0), 0.0);
        assert!((dark.mean.get(1, 0) - 1.0).abs() < 0.01, "{}", dark.mean.get(1, 0));
        // An exponential variable's is 2; fifths have nine tenths of that.
        assert!((dark.mean_square.get(1, 0) - 1.79).abs() < 0.03, "{}", dark.mean_square.get(1, 0));
        assert!((dark.mean.get(2, 0) - 150.0).abs() < 0.01, "{}", dark.mean.get(2, 0));
    }
}
