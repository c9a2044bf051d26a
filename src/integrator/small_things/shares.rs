//! Adds up what pieces of small things bring to the film's pixels.

use super::super::Crop;
use crate::film::KnownThings;
use crate::sampler::FilterDensity;
use glam::Vec2;
use std::f64::consts::PI;

/// A piece of something, as a point of the lens sees it at a moment.
pub(super) struct Piece {
    /// Middle of the piece in the picture, px.
    pub(super) place_px: Vec2,
    /// How far it goes meanwhile, half of it before it is there.
    pub(super) way_px: Vec2,
    pub(super) area_px2: f32,
    /// Half axes of the ellipse that its light is spread over, where they are at least a pixel.
    pub(super) spread_px: Vec2,
    /// Luminance of the piece, or by how much it is unlike what is around it; scene units.
    pub(super) luminance: f32,
    /// Whether its pixels are to have samples for it whatever it looks like.
    pub(super) is_urgent: bool,
}

/// Shares of the film's pixels.
pub(super) struct Shares {
    area: Crop,
    density: FilterDensity,
    pub(super) things: KnownThings,
}

impl Shares {
    /// Shares of no pieces yet.
    pub(super) fn new(area: Crop, density: FilterDensity) -> Self {
        Self { area, density, things: KnownThings::new(area.pixels()) }
    }

    /// Adds a piece to each pixel whose samples may meet it, at steps of its way that are no longer than a pixel.
    pub(super) fn add(&mut self, piece: &Piece) {
        let steps = self.steps(piece.spread_px, piece.way_px);
        for step in 0..steps {
            let along = (step as f32 + 0.5) / steps as f32 - 0.5;
            let part = Piece {
                place_px: piece.place_px + along * piece.way_px,
                area_px2: piece.area_px2 / steps as f32,
                ..*piece
            };
            if is_spread(piece.spread_px) { self.add_spread(&part) } else { self.add_sharp(&part) }
        }
    }

    /// How many pixels a piece is added to, about, that is spread so far and goes so far.
    pub(super) fn pixels_of(&self, spread_px: Vec2, way_px: Vec2) -> f64 {
        let film = f64::from(self.area.width) * f64::from(self.area.height);
        let of_each = if is_spread(spread_px) { ellipse_px2(spread_px).min(film) } else { 9.0 };
        of_each * f64::from(self.steps(spread_px, way_px))
    }

    /// At how many places on its way a piece is added: no farther apart than a pixel, or than half of what it is spread
    /// over; on a way that is longer than the film, fewer.
    fn steps(&self, spread_px: Vec2, way_px: Vec2) -> u32 {
        let longest_px = if is_spread(spread_px) { spread_px.min_element() } else { 1.0 };
        let most = 2 * (self.area.width + self.area.height);
        (way_px.length() / longest_px).ceil().clamp(1.0, most as f32) as u32
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
            self.add_share(pixel, piece.area_px2 * density, piece.luminance, piece.is_urgent && density >= MUCH * most);
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
        all.filter(is_in).for_each(|pixel| self.add_share(pixel, share, piece.luminance, piece.is_urgent));
    }

    fn add_share(&mut self, pixel: Vec2, share: f32, luminance: f32, is_urgent: bool) {
        let (column, row) = (pixel.x - self.area.x as f32, pixel.y - self.area.y as f32);
        let is_inside =
            (0.0..self.area.width as f32).contains(&column) && (0.0..self.area.height as f32).contains(&row);
        if is_inside {
            self.things.add(row as usize * self.area.width as usize + column as usize, share, luminance, is_urgent);
        }
    }
}

/// Whether what is spread so far is spread over pixels.
fn is_spread(spread_px: Vec2) -> bool {
    spread_px.min_element() >= 1.0
}

fn ellipse_px2(half_axes_px: Vec2) -> f64 {
    PI * f64::from(half_axes_px.x) * f64::from(half_axes_px.y)
}
