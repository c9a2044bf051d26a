//! How much of each pixel lamps cover that the camera sees smaller, or thinner, than a pixel.
//!
//! The first samples of a pixel may all pass them by, and then nothing in the picture tells of them; but where lamps are is known.
//! Not for what is found without it: lamps that cover a pixel whole, of which the neighbours tell; but each triangle is judged by itself, so that
//! the rim of a large lamp of small triangles has these samples, too. Nor are lamps looked for that move, whose emission is a picture, or that
//! are seen by a moving camera, through a lens, by mirrors or through glass.

use super::camera::CameraRays;
use super::{Crop, PathTracer};
use crate::light::LampPart;
use crate::sampler::FilterDensity;
use glam::{DVec2, Vec2, Vec3};
use std::f64::consts::PI;

/// Strips are cut into slices no longer than this, in pixels.
const LONGEST_SLICE_PX: f64 = 0.5;
/// Triangles that are higher than this over their longest side, in pixels, are not looked for: they cover some pixels nearly whole.
const THICK_PX: f64 = 1.5;
/// Farther outside the film nothing shines into it, in pixels: strips are no higher, and pixel filters no wider.
const BORDER_PX: f64 = 3.5;
/// Pieces that are looked for. Of more, the rest of the lamps is left to chance: one costs a ray.
const MOST_PIECES: usize = 1 << 18;

/// A piece of a lamp as the camera sees it.
struct Piece {
    /// Its middle in the picture.
    place_px: Vec2,
    area_px2: f32,
    /// From where the camera's ray to it begins, scene units.
    distance: f32,
}

impl PathTracer {
    /// The share of each film pixel's samples, row-major, that meets lamps smaller than a pixel, in pixels that have at least half as much of
    /// such a lamp as any. None where there are no such lamps.
    pub fn share_of_small_lamps(&self) -> Option<Vec<f32>> {
        if self.camera.moves() || self.camera.has_lens() {
            return None;
        }
        let area = self.settings.film_area();
        let mut pieces = Pieces { camera: &self.camera, area, found: Vec::new() };
        self.lights.still_parts(&self.world).for_each(|part| pieces.add(part));
        let pixels = area.width as usize * area.height as usize;
        let mut shares =
            Shares { area, density: self.settings.filter.density(), of_pixels: vec![Share::default(); pixels] };
        pieces.found.iter().filter(|piece| !self.is_hidden(piece)).for_each(|piece| shares.add(piece));
        let shares: Vec<f32> =
            shares.of_pixels.iter().map(|share| if share.is_main { share.all } else { 0.0 }).collect();
        shares.iter().any(|&share| share > 0.0).then_some(shares)
    }

    /// Whether something stands before a piece.
    fn is_hidden(&self, piece: &Piece) -> bool {
        /// Short of the lamp itself.
        const AS_FAR_AS: f32 = 0.999_9;
        self.world.occluded(&self.camera.ray_through(piece.place_px), AS_FAR_AS * piece.distance)
    }
}

/// What is known of a pixel.
#[derive(Clone, Copy, Default)]
struct Share {
    /// Of its samples, what meets small lamps.
    all: f32,
    /// Whether it has much of one of them.
    is_main: bool,
}

/// Shares of the film's pixels.
struct Shares {
    area: Crop,
    density: FilterDensity,
    of_pixels: Vec<Share>,
}

impl Shares {
    /// Adds a piece to each pixel whose samples may meet it.
    fn add(&mut self, piece: &Piece) {
        /// Of the density in the pixel that has the piece, from which on another one has much of it, too.
        const MUCH: f32 = 0.5;
        let own = piece.place_px.floor();
        let density_at = |pixel: Vec2| self.density.at(piece.place_px - pixel - 0.5);
        let most = density_at(own);
        for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
            let pixel = own + Vec2::new(x as f32, y as f32);
            let density = density_at(pixel);
            let (column, row) = (pixel.x - self.area.x as f32, pixel.y - self.area.y as f32);
            let is_inside =
                (0.0..self.area.width as f32).contains(&column) && (0.0..self.area.height as f32).contains(&row);
            if is_inside {
                let share = &mut self.of_pixels[row as usize * self.area.width as usize + column as usize];
                share.all += piece.area_px2 * density;
                share.is_main |= density >= MUCH * most;
            }
        }
    }
}

/// Lamps cut into pieces.
struct Pieces<'a> {
    camera: &'a CameraRays,
    /// Outside of which nothing is looked for.
    area: Crop,
    found: Vec<Piece>,
}

impl Pieces<'_> {
    fn add(&mut self, part: LampPart) {
        match part {
            _ if self.found.len() >= MOST_PIECES => {}
            LampPart::Triangle { corners, front } => {
                let way = self.camera.way_to(corners.iter().sum::<Vec3>() / 3.0);
                if front.is_none_or(|front| front.dot(way) < 0.0) {
                    self.add_triangle(corners);
                }
            }
            LampPart::Sphere { center, radius } => self.found.extend(self.sphere(center, radius)),
        }
    }

    /// A sphere that is smaller than a pixel, as one piece.
    fn sphere(&self, center: Vec3, radius: f32) -> Option<Piece> {
        let place_px = self.camera.project(center)?;
        let to_side = radius * self.camera.way_to(center).try_normalize()?.any_orthonormal_vector();
        let radius_px = (self.camera.project(center + to_side)? - place_px).length();
        let origin = Vec3::from(self.camera.ray_through(place_px).origin);
        let area_px2 = PI as f32 * radius_px * radius_px;
        let distance = (center - origin).dot(Vec3::from(self.camera.ray_through(place_px).direction)) - radius;
        (2.0 * radius_px <= 1.0 && distance > 0.0).then_some(Piece { place_px, area_px2, distance })
    }

    /// Slices of a triangle across its longest side. Nothing of one that is thick, or not wholly before the camera.
    fn add_triangle(&mut self, corners: [Vec3; 3]) {
        let Some(places_px) = each(corners, |corner| self.camera.project(corner)) else { return };
        let Some(strip) = Strip::of(places_px.map(|place_px| place_px.as_dvec2())) else { return };
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a);
        for slice in strip.slices(self.area) {
            let ray = self.camera.ray_through(slice.place_px.as_vec2());
            let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
            let distance = (normal.dot(a - origin) / normal.dot(direction)) as f32;
            if distance.is_finite() && distance > 0.0 {
                let place_px = slice.place_px.as_vec2();
                self.found.push(Piece { place_px, area_px2: slice.area_px2 as f32, distance });
            }
        }
    }
}

/// A triangle in the picture, by its longest side.
struct Strip {
    start_px: DVec2,
    /// Unit vector along the longest side.
    along: DVec2,
    length_px: f64,
    /// From the longest side to the third corner.
    height_px: DVec2,
    /// Where along the side the third corner stands.
    peak_px: f64,
}

struct Slice {
    place_px: DVec2,
    area_px2: f64,
}

impl Strip {
    /// `None` of what is thick, or no triangle.
    fn of(corners_px: [DVec2; 3]) -> Option<Self> {
        let [a, b, c] = (0..3).map(|i| [0, 1, 2].map(|k| corners_px[(i + k) % 3])).max_by(|one, other| {
            let side = |corners: &[DVec2; 3]| corners[0].distance_squared(corners[1]);
            side(one).total_cmp(&side(other))
        })?;
        let (along, length_px) = (b - a).normalize_and_length();
        let peak_px = (c - a).dot(along).clamp(0.0, length_px);
        let height_px = c - (a + peak_px * along);
        let height = height_px.length();
        (length_px.is_finite() && height > 0.0 && height <= THICK_PX).then_some(Self {
            start_px: a,
            along,
            length_px,
            height_px,
            peak_px,
        })
    }

    /// Its slices near an area of the picture.
    fn slices(&self, area: Crop) -> impl Iterator<Item = Slice> {
        let count = (self.length_px / LONGEST_SLICE_PX).ceil().max(1.0);
        let step_px = self.length_px / count;
        let [from_px, to_px] = self.part_near(area);
        let (first, end) = ((from_px / step_px).floor(), (to_px / step_px).ceil().min(count));
        (0..(end - first).max(0.0) as u64).map(move |number| {
            let [from_px, to_px] = [0.0, 1.0].map(|more| (first + number as f64 + more) * step_px);
            let area_px2 = self.height_px.length() * (self.width_until(to_px) - self.width_until(from_px));
            let mean_width = area_px2 / (step_px * self.height_px.length());
            let on_side = self.start_px + 0.5 * (from_px + to_px) * self.along;
            Slice { place_px: on_side + 0.5 * mean_width * self.height_px, area_px2 }
        })
    }

    /// The integral of its width, in heights, from its beginning on.
    fn width_until(&self, px: f64) -> f64 {
        let Self { length_px, peak_px, .. } = *self;
        // The last slice may end a rounding beyond.
        let px = px.min(length_px);
        if px <= peak_px && peak_px > 0.0 {
            0.5 * px * px / peak_px
        } else {
            0.5 * (length_px - (length_px - px).powi(2) / (length_px - peak_px))
        }
    }

    /// From where to where along the longest side it may be seen in an area, in pixels.
    fn part_near(&self, area: Crop) -> [f64; 2] {
        let low = DVec2::new(f64::from(area.x), f64::from(area.y)) - BORDER_PX;
        let high = low + DVec2::new(f64::from(area.width), f64::from(area.height)) + 2.0 * BORDER_PX;
        let (mut from_px, mut to_px) = (0.0_f64, self.length_px);
        for axis in 0..2 {
            let (start, step) = (self.start_px[axis], self.along[axis]);
            if step.abs() > 1e-12 {
                let ends = [(low[axis] - start) / step, (high[axis] - start) / step];
                from_px = from_px.max(ends[0].min(ends[1]));
                to_px = to_px.min(ends[0].max(ends[1]));
            } else if !(low[axis]..high[axis]).contains(&start) {
                return [0.0, 0.0];
            }
        }
        [from_px, to_px.max(from_px)]
    }
}

/// All three, or none.
fn each<A: Copy, B: Copy>(of: [A; 3], value: impl Fn(A) -> Option<B>) -> Option<[B; 3]> {
    let [a, b, c] = of;
    Some([value(a)?, value(b)?, value(c)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: Crop = Crop { x: 0, y: 0, width: 64, height: 64 };

    /// Slices have the triangle's area and its centre of mass, whichever side is the longest.
    #[test]
    fn slices_make_up_the_triangle() {
        let corners = [[10.0, 20.0], [50.3, 24.0], [30.0, 23.0]].map(DVec2::from);
        for turn in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|i| corners[(i + turn) % 3]);
            let slices: Vec<Slice> = Strip::of([a, b, c]).expect("is thin").slices(FILM).collect();
            let area: f64 = slices.iter().map(|slice| slice.area_px2).sum();
            let centre = slices.iter().map(|slice| slice.area_px2 * slice.place_px).sum::<DVec2>() / area;
            assert!((area / (0.5 * (b - a).perp_dot(c - a).abs()) - 1.0).abs() < 1e-9, "{area}");
            assert!((centre - (a + b + c) / 3.0).length() < 0.01, "{centre}");
            assert!(slices.len() <= 82, "as many as it is long: {}", slices.len());
        }
    }

    /// Of one that goes on far beyond the film, or along a line that misses it, no more than what is near it.
    #[test]
    fn what_is_far_outside_is_not_cut() {
        let slices =
            |corners: [[f64; 2]; 3]| Strip::of(corners.map(DVec2::from)).map(|strip| strip.slices(FILM).count());
        assert!(slices([[-1e9, 30.0], [1e9, 30.0], [0.0, 30.1]]).is_some_and(|count| (128..=144).contains(&count)));
        assert_eq!(slices([[-1e9, 90.0], [1e9, 90.0], [0.0, 90.1]]), Some(0));
        assert_eq!(slices([[100.0, 0.0], [100.0, 50.0], [100.1, 20.0]]), Some(0));
        assert_eq!(slices([[0.0, 0.0], [30.0, 0.0], [15.0, 9.0]]), None, "is thick");
        assert_eq!(slices([[0.0, 0.0], [30.0, 0.0], [15.0, 0.0]]), None, "has no area");
        assert_eq!(slices([[f64::NAN, 0.0], [30.0, 0.0], [15.0, 1.0]]), None);
    }
}
