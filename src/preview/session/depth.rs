//! How far away is what the picture shows: what the camera turns about, and what it focuses on.

use super::Session;
use crate::film::Film;
use crate::integrator::{CameraRays, CameraSample, Crop};
use crate::preview::command::Phase;
use crate::scene::Camera;
use glam::Vec2;

/// Pixels that are asked for a middle distance: more say the same.
const ASKED_PIXELS: usize = 1 << 12;

impl Session<'_> {
    /// The camera turns about what stands in the middle of the picture, else about what stands as far away as half of
    /// all that is seen, else about as far as the scene's middle; and about the same as long as it moves. What is in
    /// focus says nothing: formats give pinholes a focus a million units away.
    pub(super) fn find_pivot(&mut self) {
        let is_in_motion = self.phase == Phase::Moving && self.hand.was_ever_moved();
        if is_in_motion && self.hand.held.knows_pivot {
            return;
        }
        let Crop { width, height, .. } = self.job.trace.film_area();
        let in_middle = self.depth_at(width as usize / 2, height as usize / 2);
        let found = in_middle.or_else(|| self.median_depth()).or_else(|| self.depth_of_scene());
        if let Some(depth) = found {
            (self.hand.held.pivot_distance, self.hand.held.knows_pivot) = (depth, true);
        }
    }

    /// Distance of what a pixel shows along the camera's axis, as focus and pivot count it, from whichever film has it;
    /// none where nothing is or the picture is of another camera.
    fn depth_at(&self, x: usize, y: usize) -> Option<f32> {
        let in_film = |(film, step): (&Film, usize)| {
            let (column, row, width) = (x / step, y / step, film.width() as usize);
            let pixel = row.checked_mul(width)?.checked_add(column).filter(|_| column < width)?;
            film.features().get(pixel).map(|guide| guide.depth).filter(|depth| depth.is_normal())
        };
        self.films().find_map(in_film).map(|depth| depth * self.cosine_at(x, y))
    }

    /// The middle one of such distances, over all pixels that show something.
    fn median_depth(&self) -> Option<f32> {
        let in_film = |(film, step): (&Film, usize)| {
            let (width, guides) = (film.width() as usize, film.features());
            let asked = (0..guides.len()).step_by(guides.len() / ASKED_PIXELS + 1);
            let seen = asked.filter(|&pixel| guides[pixel].depth.is_normal());
            let along_axis = |pixel: usize| {
                let middle = |index: usize| index * step + step / 2;
                guides[pixel].depth * self.cosine_at(middle(pixel % width), middle(pixel / width))
            };
            let mut depths: Vec<f32> = seen.map(along_axis).filter(|depth| depth.is_normal()).collect();
            let middle = depths.len() / 2;
            (!depths.is_empty()).then(|| *depths.select_nth_unstable_by(middle, f32::total_cmp).1)
        };
        self.films().find_map(in_film)
    }

    /// Films of what the camera sees, and pixels of the picture to each of theirs; none while the camera is another
    /// than theirs.
    fn films(&self) -> impl Iterator<Item = (&Film, usize)> {
        let glimpse = self.glimpse.as_ref().map(|glimpse| (&glimpse.film, glimpse.step as usize));
        std::iter::once((&self.state.film, 1)).chain(glimpse).filter(|_| !self.hand.has_moved())
    }

    /// Distance of the scene's middle, along the axis where that is before the camera; none from within it.
    fn depth_of_scene(&self) -> Option<f32> {
        let center = self.tracer.world().bounding_sphere().center;
        let way = center - self.hand.held.camera.position;
        let along_axis = way.dot(self.hand.held.camera.axes().forward);
        let distance = if along_axis > 0.0 { along_axis } else { way.length() };
        Some(distance).filter(|distance| distance.is_normal())
    }

    /// Cosine of the angle between the ray through a pixel's middle and the camera's axis.
    fn cosine_at(&self, x: usize, y: usize) -> f32 {
        let settings = self.tracer.settings();
        let (left, top) = (settings.film_area().x, settings.film_area().y);
        let pinhole = Camera { aperture_radius: 0.0, motion: None, ..self.hand.held.camera.clone() };
        let position_px = Vec2::new((left as usize + x) as f32 + 0.5, (top as usize + y) as f32 + 0.5);
        let sample = CameraSample { position_px, lens: [0.5; 2], time: 0.0 };
        let ray = CameraRays::new(&pinhole, settings.width, settings.height).ray(&sample);
        ray.direction.dot(pinhole.axes().forward.into())
    }

    pub(super) fn focus_on(&mut self, x: usize, y: usize) {
        match self.depth_at(x, y) {
            None => self.note = Some("nothing to focus on there".to_owned()),
            Some(depth) => {
                self.hand.held.focus_at(depth);
                if self.hand.held.camera.aperture_radius > 0.0 {
                    self.hand.moved();
                } else {
                    self.note = Some("in focus, but the lens has no width: A widens it".to_owned());
                }
            }
        }
    }
}
