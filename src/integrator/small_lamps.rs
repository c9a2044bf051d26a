//! How much of each pixel lamps cover that the camera sees smaller, or thinner, than a pixel, or smaller than its lens blurs them.
//!
//! The first samples of a pixel may all pass them by, and then nothing in the picture tells of them; but where lamps are is known.
//! Not for what is found without it: lamps that cover a pixel whole, of which the neighbours tell; but each triangle is judged by itself, so that
//! the rim of a large lamp of small triangles has these samples, too. Nor are lamps looked for that move, whose emission is a picture, or that
//! are seen by a moving camera, by mirrors or through glass.

mod strip;

use super::camera::{CameraRays, CameraSample};
use super::{Crop, PathTracer};
use crate::film::{KnownLamps, opponent};
use crate::light::{LampPart, LampShape};
use crate::sampler::FilterDensity;
use glam::{Vec2, Vec3};
use std::f64::consts::PI;
use strip::Strip;

/// Strips are cut into slices no longer than this, in pixels, or than half of their blur.
const LONGEST_SLICE_PX: f64 = 0.5;
/// Triangles that are higher than this over their longest side, in pixels, and than their blur, are not looked for: they cover some pixels
/// nearly whole.
const THICK_PX: f64 = 1.5;
/// Farther outside the film nothing shines into it, in pixels, but for its blur: strips are no higher, and pixel filters no wider.
const BORDER_PX: f64 = 3.5;
/// Spots that are looked for, and rays that look for them: each from fewer points of the lens where there are many. The rest of the lamps is
/// left to chance.
const MOST_RAYS: usize = 1 << 18;
/// Pixels that spots are spread over, one after the other, some 0.2 s. The rest of the lamps is left to chance.
const MOST_PIXELS: f64 = (1 << 26) as f64;
/// What is blurred no wider than this, in pixels, is seen as from the middle of the lens.
const LEAST_BLUR_PX: f32 = 0.25;
/// Points of the lens, squared, from which each spot is looked for that is blurred, where there are rays enough.
const LENS_POINTS_A_SIDE: usize = 8;
const LENS_POINTS: usize = LENS_POINTS_A_SIDE * LENS_POINTS_A_SIDE;
/// Each of these sees a spot at a place of its own; between these, its light is spread as far as this, over the blur.
const SPREAD: f32 = 0.25;

/// A spot of a lamp.
struct Spot {
    position: Vec3,
    /// In the picture, were it sharp.
    area_px2: f32,
    /// How far before its position its surface may be, scene units.
    radius: f32,
    /// Half axes of its circle of confusion.
    blur_px: Vec2,
    /// Luminance of what it emits, scene units.
    luminance: f32,
}

impl PathTracer {
    /// What is known of lamps smaller than a pixel, or than their blur, before the first sample. None where there are no such lamps.
    pub fn known_lamps(&self) -> Option<KnownLamps> {
        if self.camera.moves() {
            return None;
        }
        let area = self.settings.film_area();
        let mut spots = Spots { camera: &self.camera, area, found: Vec::new() };
        self.lights.still_parts(&self.world).for_each(|part| spots.add(&part));
        let points_of_each = (MOST_RAYS / spots.found.len().max(1)).clamp(1, LENS_POINTS);
        let mut shares = Shares {
            area,
            density: self.settings.filter.density(),
            lamps: KnownLamps::new(area.width as usize * area.height as usize),
        };
        let mut pixels_left = MOST_PIXELS;
        for (number, spot) in spots.found.iter().enumerate() {
            let lens = lens_points(spot.blur_px, number * points_of_each, points_of_each);
            pixels_left -= lens.len() as f64 * shares.pixels_of(SPREAD * spot.blur_px);
            if pixels_left < 0.0 {
                break;
            }
            let area_px2 = spot.area_px2 / lens.len() as f32;
            for place_px in lens.into_iter().filter_map(|lens| self.seen_at(spot, lens)) {
                shares.add(&Piece { place_px, area_px2, spread_px: SPREAD * spot.blur_px, luminance: spot.luminance });
            }
        }
        Some(shares.lamps).filter(KnownLamps::has_any)
    }

    /// Where in the picture a point of the lens sees a spot, in pixels; `None` where something stands before it.
    fn seen_at(&self, spot: &Spot, lens: [f32; 2]) -> Option<Vec2> {
        /// Short of the lamp itself.
        const AS_FAR_AS: f32 = 0.999_9;
        let position_px = self.camera.project_through(lens, spot.position)?;
        let ray = self.camera.ray(&CameraSample { position_px, lens, time: 0.0 });
        let distance = (spot.position - Vec3::from(ray.origin)).dot(Vec3::from(ray.direction)) - spot.radius;
        (distance > 0.0 && !self.world.occluded(&ray, AS_FAR_AS * distance)).then_some(position_px)
    }
}

/// So many points of the lens, by their [`CameraSample::lens`], from which what is blurred so far is looked for; others for another `first`.
fn lens_points(blur_px: Vec2, first: usize, count: usize) -> Vec<[f32; 2]> {
    /// From one to the next: has no divisor in common with their number, and goes to and fro over the lens.
    const STRIDE: usize = 27;
    if !is_blurred(blur_px) {
        return vec![[0.5; 2]];
    }
    let at = |index: usize| (index as f32 + 0.5) / LENS_POINTS_A_SIDE as f32;
    let of = |index: usize| [at(index % LENS_POINTS_A_SIDE), at(index / LENS_POINTS_A_SIDE)];
    (first..first + count).map(|index| of(index * STRIDE % LENS_POINTS)).collect()
}

fn is_blurred(blur_px: Vec2) -> bool {
    blur_px.max_element() > LEAST_BLUR_PX
}

/// A spot as a point of the lens sees it.
struct Piece {
    place_px: Vec2,
    area_px2: f32,
    /// Half axes of the ellipse that its light is spread over, where they are at least a pixel.
    spread_px: Vec2,
    luminance: f32,
}

/// Whether what is spread so far is spread over pixels.
fn is_spread(spread_px: Vec2) -> bool {
    spread_px.min_element() >= 1.0
}

fn ellipse_px2(half_axes_px: Vec2) -> f64 {
    PI * f64::from(half_axes_px.x) * f64::from(half_axes_px.y)
}

/// Shares of the film's pixels.
struct Shares {
    area: Crop,
    density: FilterDensity,
    lamps: KnownLamps,
}

impl Shares {
    /// Adds a piece to each pixel whose samples may meet it.
    fn add(&mut self, piece: &Piece) {
        if is_spread(piece.spread_px) { self.add_spread(piece) } else { self.add_sharp(piece) }
    }

    /// How many pixels a piece is added to, about, that is spread so far.
    fn pixels_of(&self, spread_px: Vec2) -> f64 {
        let film = f64::from(self.area.width) * f64::from(self.area.height);
        if is_spread(spread_px) { ellipse_px2(spread_px).min(film) } else { 9.0 }
    }

    fn add_sharp(&mut self, piece: &Piece) {
        /// Of the density in the pixel that has the piece, from which on another one has much of it, too.
        const MUCH: f32 = 0.5;
        let own = piece.place_px.floor();
        let filter = self.density;
        let density_at = |pixel: Vec2| filter.at(piece.place_px - pixel - 0.5);
        let most = density_at(own);
        for (x, y) in (-1..=1).flat_map(|y| (-1..=1).map(move |x| (x, y))) {
            let pixel = own + Vec2::new(x as f32, y as f32);
            let density = density_at(pixel);
            self.add_share(pixel, piece.area_px2 * density, piece.luminance, density >= MUCH * most);
        }
    }

    /// Evenly over the pixels of the film whose middle is in an ellipse.
    fn add_spread(&mut self, piece: &Piece) {
        let Piece { place_px, spread_px, .. } = *piece;
        let film_from = Vec2::new(self.area.x as f32, self.area.y as f32);
        let film_to = film_from + Vec2::new(self.area.width as f32, self.area.height as f32);
        let low = (place_px - spread_px).floor().max(film_from);
        let [columns, rows] = ((place_px + spread_px).min(film_to) - low).ceil().to_array().map(|count| count as u32);
        let all = (0..rows).flat_map(|y| (0..columns).map(move |x| low + Vec2::new(x as f32, y as f32)));
        let is_in = |pixel: &Vec2| ((*pixel + 0.5 - place_px) / spread_px).length_squared() <= 1.0;
        let share = (f64::from(piece.area_px2) / ellipse_px2(spread_px)) as f32;
        all.filter(is_in).for_each(|pixel| self.add_share(pixel, share, piece.luminance, true));
    }

    fn add_share(&mut self, pixel: Vec2, share: f32, luminance: f32, is_main: bool) {
        let (column, row) = (pixel.x - self.area.x as f32, pixel.y - self.area.y as f32);
        let is_inside =
            (0.0..self.area.width as f32).contains(&column) && (0.0..self.area.height as f32).contains(&row);
        if is_inside {
            self.lamps.add(row as usize * self.area.width as usize + column as usize, share, luminance, is_main);
        }
    }
}

/// Lamps cut into spots.
struct Spots<'a> {
    camera: &'a CameraRays,
    /// Outside of which nothing is looked for.
    area: Crop,
    found: Vec<Spot>,
}

impl Spots<'_> {
    fn add(&mut self, part: &LampPart) {
        if self.found.len() >= MOST_RAYS {
            return;
        }
        let [luminance, ..] = opponent(part.radiance.as_dvec3().to_array()).map(|value| value as f32);
        match part.shape {
            LampShape::Triangle { corners, front } => {
                let way = self.camera.way_to(corners.iter().sum::<Vec3>() / 3.0);
                if front.is_none_or(|front| front.dot(way) < 0.0) {
                    self.add_triangle(corners, luminance);
                }
            }
            LampShape::Sphere { center, radius } => {
                self.found.extend(self.sphere(center, radius, luminance));
            }
        }
    }

    /// A sphere that is smaller than a pixel, or than its blur.
    fn sphere(&self, center: Vec3, radius: f32, luminance: f32) -> Option<Spot> {
        let place_px = self.camera.project(center)?;
        let to_side = radius * self.camera.way_to(center).try_normalize()?.any_orthonormal_vector();
        let radius_px = (self.camera.project(center + to_side)? - place_px).length();
        let area_px2 = PI as f32 * radius_px * radius_px;
        let blur_px = self.camera.blur_px(center);
        let is_small = 2.0 * radius_px <= blur_px.min_element().max(1.0);
        (is_small && self.is_near(place_px, blur_px)).then_some(Spot {
            position: center,
            area_px2,
            radius,
            blur_px,
            luminance,
        })
    }

    /// Whether what is blurred so far may shine into the film.
    fn is_near(&self, place_px: Vec2, blur_px: Vec2) -> bool {
        let low = Vec2::new(self.area.x as f32, self.area.y as f32);
        let high = low + Vec2::new(self.area.width as f32, self.area.height as f32);
        let border_px = blur_px + BORDER_PX as f32;
        place_px.cmpge(low - border_px).all() && place_px.cmple(high + border_px).all()
    }

    /// A triangle that is smaller than its blur, or slices of one across its longest side. Nothing of one that is thick, or not wholly before
    /// the camera.
    fn add_triangle(&mut self, corners: [Vec3; 3], luminance: f32) {
        let Some(places_px) = each(corners, |corner| self.camera.project(corner)) else { return };
        let blur_px = self.camera.blur_px(corners.iter().sum::<Vec3>() / 3.0);
        let blur = f64::from(blur_px.min_element());
        let Some(strip) = Strip::of(places_px.map(|place_px| place_px.as_dvec2()), blur.max(THICK_PX)) else { return };
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a);
        let border_px = BORDER_PX + f64::from(blur_px.max_element());
        let most = MOST_RAYS - self.found.len();
        for slice in strip.slices(self.area, LONGEST_SLICE_PX.max(0.5 * blur), border_px).take(most) {
            let ray = self.camera.ray_through(slice.place_px.as_vec2());
            let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
            let distance = normal.dot(a - origin) / normal.dot(direction);
            if distance.is_finite() && distance > 0.0 {
                let position = (origin + distance * direction).as_vec3();
                let (area_px2, blur_px) = (slice.area_px2 as f32, self.camera.blur_px(position));
                self.found.push(Spot { position, area_px2, radius: 0.0, blur_px, luminance });
            }
        }
    }
}

/// All three, or none.
fn each<A: Copy, B: Copy>(of: [A; 3], value: impl Fn(A) -> Option<B>) -> Option<[B; 3]> {
    let [a, b, c] = of;
    Some([value(a)?, value(b)?, value(c)?])
}
