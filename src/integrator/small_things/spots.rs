//! Cuts lamps and other things into spots that a camera sees at a moment. Which pixels they meet is left to `shares`.

use super::super::Crop;
use super::super::camera::CameraAt;
use super::strip::Strip;
use super::{Part, Shine};
use crate::geometry::Facet;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Strips are cut into slices no longer than this share of what is small where they are.
const SLICE: f32 = 0.5;
/// Triangles that are higher than this over their longest side, in pixels, or than what is small by blur and motion,
/// are not looked for: they cover some pixels nearly whole.
const THICK_PX: f32 = 1.5;
/// Farther outside the film nothing shines into it, in pixels, but for its blur and its motion: strips are no higher,
/// and pixel filters no wider.
const BORDER_PX: f32 = 3.5;
/// What is blurred no wider than this, in pixels, is seen as from the middle of the lens.
const MIN_BLUR_PX: f32 = 0.25;
/// Each point of the lens sees a spot at a place of its own; between these, its light is spread as far as this, over
/// the blur.
const SPREAD: f32 = 0.25;
/// What passes by in less than this share of the time that the shutter is open is small.
const BRIEF: f32 = 0.25;

/// A spot of something.
pub(super) struct Spot {
    pub(super) position: Vec3,
    /// Area of the spot in the picture, were it sharp, px².
    pub(super) area_px2: f32,
    /// How far before its position its surface may be, scene units.
    pub(super) radius: f32,
    /// Half axes of its circle of confusion.
    blur_px: Vec2,
    /// Half axes of what its light is spread over between the places at which points of the lens see it.
    pub(super) spread_px: Vec2,
    /// How far it would go in the picture while the shutter is open.
    pub(super) velocity_px: Vec2,
    /// What is smaller there, in pixels, is met by few samples of any pixel.
    pub(super) small_px: f32,
    pub(super) shine: Shine,
}

impl Spot {
    /// Whether points of the lens see it at different places.
    pub(super) fn is_blurred(&self) -> bool {
        self.blur_px.max_element() > MIN_BLUR_PX
    }
}

/// What is cut into spots.
pub(super) struct Spots<'a> {
    camera: CameraAt<'a>,
    /// The camera a little later.
    later: CameraAt<'a>,
    /// How much later, in shares of the open shutter.
    step: f32,
    /// Outside of which nothing is looked for.
    area: Crop,
    most: usize,
    pub(super) found: Vec<Spot>,
}

/// How what is around a place is seen.
#[derive(Clone, Copy)]
struct Around {
    blur_px: Vec2,
    velocity_px: Vec2,
}

impl Around {
    /// What is smaller, in pixels, is met by few samples of any pixel.
    fn small_px(&self) -> f32 {
        self.blur_px.min_element().max(BRIEF * self.velocity_px.length())
    }

    fn spot(self, position: Vec3, area_px2: f32, radius: f32, shine: Shine) -> Spot {
        let (Self { blur_px, velocity_px }, small_px) = (self, self.small_px());
        let spread_px = (SPREAD * blur_px).max(Vec2::splat((area_px2 / PI).sqrt()));
        Spot { position, area_px2, radius, blur_px, spread_px, velocity_px, small_px, shine }
    }
}

impl<'a> Spots<'a> {
    /// A list of no spots yet. `later`: the camera `step` later. `most`: how many there may be.
    pub(super) fn new(camera: CameraAt<'a>, later: CameraAt<'a>, step: f32, area: Crop, most: usize) -> Self {
        Self { camera, later, step, area, most, found: Vec::new() }
    }

    /// Adds what is small of a part. `later`: its middle, when the camera is there.
    pub(super) fn add(&mut self, Part { facet, front, shine }: &Part, later: Vec3) {
        if self.found.len() >= self.most {
            return;
        }
        let center = facet.center();
        let Some(around) = self.around(center, later) else { return };
        match *facet {
            Facet::Triangle(corners) => {
                if front.is_none_or(|front| front.dot(self.camera.way_to(center)) < 0.0) {
                    self.add_triangle(corners, around, *shine);
                }
            }
            Facet::Sphere { center, radius } => self.add_sphere(center, radius, around, *shine),
        }
    }

    /// How a part is seen whose middle goes from here to there; `None` where that is not before the camera.
    fn around(&self, center: Vec3, later: Vec3) -> Option<Around> {
        let way_px = self.later.project(later)? - self.camera.project(center)?;
        Some(Around { blur_px: self.camera.blur_px(center), velocity_px: way_px / self.step })
    }

    /// A sphere that is smaller than a pixel, or than what is small there, as spots of one size: what is before its
    /// middle may hide it in part.
    fn add_sphere(&mut self, center: Vec3, radius: f32, around: Around, shine: Shine) {
        /// Spots around the one in the middle.
        const AROUND: usize = 6;
        /// How far those are from it, over the radius.
        const AWAY: f32 = 0.72;
        let Some(axis) = self.camera.way_to(center).try_normalize() else { return };
        let (right, up) = axis.any_orthonormal_pair();
        let places_px = [center, center + radius * right].map(|position| self.camera.project(position));
        let [Some(place_px), Some(side_px)] = places_px else { return };
        let radius_px = (side_px - place_px).length();
        let is_small = 2.0 * radius_px <= around.small_px().max(1.0);
        if !is_small || !self.is_near(place_px, self.border_px(&around)) {
            return;
        }
        let area_px2 = PI * radius_px * radius_px / (AROUND + 1) as f32;
        let ring = (0..AROUND).map(|number| Vec2::from_angle(TAU * number as f32 / AROUND as f32) * (AWAY * radius));
        for aside in ring.chain([Vec2::ZERO]) {
            let position = center + aside.x * right + aside.y * up;
            self.found.push(around.spot(position, area_px2, radius, shine));
        }
    }

    /// How far outside the film something may be and yet shine into it.
    fn border_px(&self, around: &Around) -> Vec2 {
        around.blur_px + self.step * around.velocity_px.abs() + BORDER_PX
    }

    /// Whether a place is no farther outside the film than this.
    fn is_near(&self, place_px: Vec2, border_px: Vec2) -> bool {
        let low = Vec2::new(self.area.x as f32, self.area.y as f32);
        let high = low + Vec2::new(self.area.width as f32, self.area.height as f32);
        place_px.cmpge(low - border_px).all() && place_px.cmple(high + border_px).all()
    }

    /// A triangle that is smaller than what is small there, in slices across its longest side. Nothing of one that is
    /// thick, or not wholly before the camera.
    fn add_triangle(&mut self, corners: [Vec3; 3], around: Around, shine: Shine) {
        let Some(places_px) = each(corners, |corner| self.camera.project(corner)) else { return };
        let small_px = around.small_px();
        let places_px = places_px.map(|place_px| place_px.as_dvec2());
        let Some(strip) = Strip::of(places_px, f64::from(small_px.max(THICK_PX))) else { return };
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a);
        let (longest_px, border_px) = (SLICE * small_px.max(1.0), self.border_px(&around).max_element());
        let most = self.most - self.found.len();
        for slice in strip.slices(self.area, f64::from(longest_px), f64::from(border_px)).take(most) {
            let ray = self.camera.ray_through(slice.place_px.as_vec2());
            let (origin, direction) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
            let distance = normal.dot(a - origin) / normal.dot(direction);
            if distance.is_finite() && distance > 0.0 {
                let position = (origin + distance * direction).as_vec3();
                let here = Around { blur_px: self.camera.blur_px(position), ..around };
                self.found.push(here.spot(position, slice.area_px2 as f32, 0.0, shine));
            }
        }
    }
}

/// All three, or none.
fn each<A: Copy, B: Copy>(of: [A; 3], value: impl Fn(A) -> Option<B>) -> Option<[B; 3]> {
    let [a, b, c] = of;
    Some([value(a)?, value(b)?, value(c)?])
}
