//! How much of each pixel lamps cover that the camera sees smaller, or thinner, than a pixel.
//!
//! The first samples of a pixel may all pass them by, and then nothing in the picture tells of them; but where lamps are is known.
//! Not for what is found without it: lamps that cover a pixel whole, of which the neighbours tell. Nor are lamps looked for that move, or that
//! are seen by a moving camera, through a lens, by mirrors or through glass.

use super::camera::CameraRays;
use super::{Crop, PathTracer};
use crate::light::LampPart;
use glam::{Vec2, Vec3, Vec3A};
use std::f32::consts::PI;

/// Pieces of lamps are cut until they are no longer than this, in pixels.
const LONGEST_PIECE_PX: f32 = 0.5;
/// Triangles that are higher than this over their longest side, in pixels, cover pixels whole.
const THICK_PX: f32 = 1.5;
/// Pieces beyond which nothing is looked for: lamps of so many are large, or none of them matters.
const MOST_PIECES: usize = 1 << 16;

/// A piece of a lamp as the camera sees it.
struct Piece {
    /// On the side of the camera.
    middle: Vec3,
    place_px: Vec2,
    area_px2: f32,
}

impl PathTracer {
    /// The share of each film pixel's samples, row-major, that meets lamps smaller than a pixel whose middle lies in it. None where there
    /// are no such lamps.
    pub fn share_of_small_lamps(&self) -> Option<Vec<f32>> {
        if self.camera.moves() || self.camera.has_lens() {
            return None;
        }
        let area = self.settings.film_area();
        let mut pieces = Pieces { camera: &self.camera, area, found: Vec::new() };
        for part in self.lights.still_parts() {
            pieces.add(part);
            if pieces.are_too_many() {
                return None;
            }
        }
        let density = self.settings.filter.density();
        let mut shares = vec![0.0; area.width as usize * area.height as usize];
        for piece in pieces.found {
            let pixel = piece.place_px.floor();
            let (x, y) = (pixel.x - area.x as f32, pixel.y - area.y as f32);
            let is_inside = (0.0..area.width as f32).contains(&x) && (0.0..area.height as f32).contains(&y);
            if is_inside && !self.is_hidden(&piece) {
                let offset_px = piece.place_px - pixel - 0.5;
                shares[y as usize * area.width as usize + x as usize] += piece.area_px2 * density.at(offset_px);
            }
        }
        shares.iter().any(|&share| share > 0.0).then_some(shares)
    }

    /// Whether something stands before a piece.
    fn is_hidden(&self, piece: &Piece) -> bool {
        /// Short of the lamp itself.
        const AS_FAR_AS: f32 = 0.999_9;
        let ray = self.camera.ray_through(piece.place_px);
        let distance = (Vec3A::from(piece.middle) - ray.origin).length();
        self.world.occluded(&ray, AS_FAR_AS * distance)
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
            LampPart::Triangle { corners, front } => {
                let way = self.camera.way_to(middle_of(corners));
                if front.is_none_or(|front| front.dot(way) < 0.0) {
                    self.add_triangle(corners);
                }
            }
            LampPart::Sphere { center, radius } => self.found.extend(sphere(self.camera, center, radius)),
        }
    }

    fn are_too_many(&self) -> bool {
        self.found.len() > MOST_PIECES
    }

    /// Halves a triangle's longest side until none is long. Nothing of one that is thick, or not wholly before the camera.
    fn add_triangle(&mut self, corners: [Vec3; 3]) {
        let Some(places) = each(corners, |corner| self.camera.project(corner)) else { return };
        let side = |i: usize| places[(i + 1) % 3] - places[i];
        let longer = |&a: &usize, &b: &usize| side(a).length_squared().total_cmp(&side(b).length_squared());
        let longest = (0..3).max_by(longer).unwrap_or(0);
        let (length_px, area_px2) = (side(longest).length(), 0.5 * side(0).perp_dot(side(1)).abs());
        let is_thick = 2.0 * area_px2 > THICK_PX * length_px;
        if !length_px.is_finite() || is_thick || self.is_outside(places) || self.are_too_many() {
            return;
        }
        if length_px <= LONGEST_PIECE_PX {
            let place_px = places.iter().sum::<Vec2>() / 3.0;
            self.found.push(Piece { middle: middle_of(corners), place_px, area_px2 });
            return;
        }
        let [a, b, c] = [0, 1, 2].map(|i| corners[(longest + i) % 3]);
        let between = 0.5 * (a + b);
        // As near as numbers can be, a side has no middle.
        if between != a && between != b {
            self.add_triangle([a, between, c]);
            self.add_triangle([between, b, c]);
        }
    }

    fn is_outside(&self, places_px: [Vec2; 3]) -> bool {
        let first = Vec2::new(self.area.x as f32, self.area.y as f32);
        let end = first + Vec2::new(self.area.width as f32, self.area.height as f32);
        let [a, b, c] = places_px;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        low.cmpgt(end).any() || high.cmplt(first).any()
    }
}

fn middle_of(corners: [Vec3; 3]) -> Vec3 {
    corners.iter().sum::<Vec3>() / 3.0
}

/// A sphere that is smaller than a pixel, as one piece.
fn sphere(camera: &CameraRays, center: Vec3, radius: f32) -> Option<Piece> {
    let place_px = camera.project(center)?;
    let away = camera.way_to(center).try_normalize()?;
    let radius_px = (camera.project(center + radius * away.any_orthonormal_vector())? - place_px).length();
    let piece = Piece { middle: center - radius * away, place_px, area_px2: PI * radius_px * radius_px };
    (2.0 * radius_px <= 1.0).then_some(piece)
}

/// All three, or none.
fn each<A: Copy, B: Copy>(of: [A; 3], value: impl Fn(A) -> Option<B>) -> Option<[B; 3]> {
    let [a, b, c] = of;
    Some([value(a)?, value(b)?, value(c)?])
}
