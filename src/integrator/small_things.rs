//! How much of each pixel's samples meets things that the camera sees smaller, or thinner, than a pixel,
//! smaller than its lens blurs them, or passing by while the shutter is open: lamps, and what others light
//! where it is unlike all around it.
//!
//! The first samples of a pixel may all pass them by, and then nothing in the picture tells of them; but where things
//! are is known. Not for what is found without it: things that cover a pixel whole, of which the neighbours tell; but
//! each triangle of a lamp is judged by itself, so that the rim of a large lamp of small triangles has these samples,
//! too. Nor is anything looked for by mirrors or through glass.

mod border;
mod lit;
mod luminances;
mod shares;
mod spots;
mod strip;

use super::PathTracer;
use super::camera::CameraAt;
use crate::film::{KnownThings, opponent};
use crate::geometry::Facet;
use crate::light::LampPart;
use glam::{Vec2, Vec3};
use lit::BrightSpot;
use shares::{Piece, Shares};
use spots::{Spot, Spots};

/// Spots that are looked for, and rays that look for them: each from fewer points of the lens where there are many.
/// The rest is left to chance.
const MAX_RAYS: usize = 1 << 18;
/// Pixels that spots are spread over, one after the other, some 0.2 s. The rest is left to chance.
const MAX_PIXELS: f64 = (1 << 26) as f64;
/// Points of the lens, squared, from which each spot is looked for that is blurred, where there are rays enough.
const LENS_POINTS_PER_SIDE: usize = 8;
const LENS_POINTS: usize = LENS_POINTS_PER_SIDE * LENS_POINTS_PER_SIDE;
/// Moments at which what moves is looked for, where there are rays enough; in between it is taken to go straight.
const MAX_MOMENTS: usize = 64;
/// Points of the lens of each of them, others from one to the next.
const LENS_POINTS_OF_A_MOMENT: usize = 4;
/// With fewer it is left to chance.
const MIN_MOMENTS: usize = 8;
/// Spots of lit things over the triangles and spheres that are looked at, at most.
const SPOTS_PER_FACET: usize = 4;

/// What is looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Lamps,
    /// What is lit by others, or shines by a picture.
    Lit,
}

/// When it is looked for.
struct Moment {
    which: Which,
    /// Share of the open shutter.
    time: f32,
    /// One of so many.
    of: usize,
    number: usize,
}

/// Which of it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Which {
    /// What the camera sees in one place all the while.
    Resting,
    Moving,
}

/// A piece of something.
struct Part {
    facet: Facet,
    /// Unit normal of the side that is seen; `None` where all are.
    front: Option<Vec3>,
    shine: Shine,
}

/// How bright something is.
#[derive(Clone, Copy)]
enum Shine {
    /// A luminance that is the same all over, scene units.
    Known(f32),
    /// As bright as this object is there.
    Of(u32),
}

impl PathTracer {
    /// What is known of such things before the first sample. `None` where there are none.
    pub fn known_things(&self) -> Option<KnownThings> {
        let mut shares = Shares::new(self.settings.film_area(), self.settings.filter.density());
        for kind in [Kind::Lamps, Kind::Lit] {
            self.look_for(kind, &mut shares);
        }
        self.look_beyond_border(&mut shares);
        Some(shares.things).filter(KnownThings::has_any)
    }

    fn look_for(&self, kind: Kind, shares: &mut Shares) {
        let (mut pixels_left, mut rays_left) = (MAX_PIXELS, MAX_RAYS);
        for moment in self.moments(kind) {
            let camera = self.camera.at(moment.time);
            let spots = self.bright_spots(&camera, self.spots_at(kind, &moment), &moment);
            let most = if moment.which == Which::Moving { LENS_POINTS_OF_A_MOMENT } else { LENS_POINTS };
            let points_of_each = (MAX_RAYS / moment.of / spots.len().max(1)).clamp(1, most);
            for (number, BrightSpot { spot, luminance }) in spots.iter().enumerate() {
                let lens = lens_points(spot, (moment.number + number) * points_of_each, points_of_each);
                let way_px = spot.velocity_px / moment.of as f32;
                pixels_left -= lens.len() as f64 * shares.pixels_of(spot.spread_px, way_px);
                if pixels_left < 0.0 || rays_left < lens.len() {
                    break;
                }
                rays_left -= lens.len();
                let area_px2 = spot.area_px2 / (lens.len() * moment.of) as f32;
                for place_px in lens.into_iter().filter_map(|lens| self.seen_at(&camera, spot, lens)) {
                    let spread_px = spot.spread_px;
                    shares.add(&Piece {
                        place_px,
                        way_px,
                        area_px2,
                        spread_px,
                        luminance: *luminance,
                        is_urgent: kind == Kind::Lamps,
                    });
                }
            }
        }
    }

    /// What rests is looked for as the shutter opens, what moves at equal steps until it closes.
    fn moments(&self, kind: Kind) -> impl Iterator<Item = Moment> {
        let resting = Moment { which: Which::Resting, time: 0.0, of: 1, number: 0 };
        let moving = |of: usize| {
            let at = move |number: usize| (number as f32 + 0.5) / of as f32;
            (0..of).map(move |number| Moment { which: Which::Moving, time: at(number), of, number })
        };
        let parts = self.parts_at(kind, Which::Moving, 0.0).count();
        let spots = if parts == 0 { 0 } else { moving(1).map(|moment| self.spots_at(kind, &moment).len()).sum() };
        let afforded = self.most_parts(kind).checked_div(parts.max(spots)).unwrap_or(0).min(MAX_MOMENTS);
        std::iter::once(resting).chain(moving(if afforded < MIN_MOMENTS { 0 } else { afforded }))
    }

    /// What is to be looked for at a moment.
    fn spots_at(&self, kind: Kind, moment: &Moment) -> Vec<Spot> {
        // Where things go is told by where they are half a step later, which is before the shutter closes.
        let step = 0.5 / moment.of as f32;
        let [camera, camera_later] = [moment.time, moment.time + step].map(|time| self.camera.at(time));
        let most = match kind {
            Kind::Lamps => MAX_RAYS,
            Kind::Lit => SPOTS_PER_FACET * self.most_parts(kind),
        };
        let mut spots = Spots::new(camera, camera_later, step, self.settings.film_area(), most);
        let [now, later] = [moment.time, moment.time + step].map(|time| self.parts_at(kind, moment.which, time));
        now.zip(later).for_each(|(part, later)| spots.add(&part, later.facet.center()));
        spots.found
    }

    /// All pieces of such things, in one order at any time.
    fn parts_at(&self, kind: Kind, which: Which, time: f32) -> Box<dyn Iterator<Item = Part> + '_> {
        let is_asked =
            move |moves: bool| which == if moves || self.camera.moves() { Which::Moving } else { Which::Resting };
        match kind {
            Kind::Lamps => {
                let afar = (!self.settings.transparent).then(|| self.lights.parts_afar());
                let all = self.lights.parts_at(&self.world, time).chain(afar.into_iter().flatten());
                Box::new(all.filter(move |part| is_asked(part.moves)).map(|part| self.part_of_lamp(&part)))
            }
            Kind::Lit => {
                let moments = if which == Which::Moving { MIN_MOMENTS } else { 1 };
                Box::new(lit::parts_at(&self.world, self.most_parts(kind) / moments, time, is_asked))
            }
        }
    }

    /// How many are looked at, at all moments together.
    fn most_parts(&self, kind: Kind) -> usize {
        match kind {
            Kind::Lamps => MAX_RAYS,
            Kind::Lit => lit::most_facets(self.settings.film_area().pixels()),
        }
    }

    fn part_of_lamp(&self, LampPart { facet, front, radiance, .. }: &LampPart) -> Part {
        Part { facet: *facet, front: *front, shine: Shine::Known(self.luminance_of(*radiance)) }
    }

    /// Scene units, clamped as samples are.
    fn luminance_of(&self, radiance: Vec3) -> f32 {
        let [luminance, ..] = opponent(self.settings.clamped(radiance).as_dvec3().to_array());
        luminance as f32
    }

    /// Where in the picture a point of the lens sees a spot, in pixels; `None` where something stands before it.
    fn seen_at(&self, camera: &CameraAt<'_>, spot: &Spot, lens: [f32; 2]) -> Option<Vec2> {
        /// Short of the thing itself.
        const AS_FAR_AS: f32 = 0.999_9;
        let position_px = camera.project_through(lens, spot.position)?;
        let ray = camera.ray(position_px, lens);
        let distance = (spot.position - Vec3::from(ray.origin)).dot(Vec3::from(ray.direction)) - spot.radius;
        (distance > 0.0 && !self.world.occluded(&ray, AS_FAR_AS * distance)).then_some(position_px)
    }
}

/// So many points of the lens, by their [`CameraSample::lens`], from which a spot is looked for; others for another
/// `first`.
///
/// [`CameraSample::lens`]: super::camera::CameraSample::lens
fn lens_points(spot: &Spot, first: usize, count: usize) -> Vec<[f32; 2]> {
    /// From one to the next: has no divisor in common with their number, and goes to and fro over the lens.
    const STRIDE: usize = 27;
    if !spot.is_blurred() {
        return vec![[0.5; 2]];
    }
    let at = |index: usize| (index as f32 + 0.5) / LENS_POINTS_PER_SIDE as f32;
    let of = |index: usize| [at(index % LENS_POINTS_PER_SIDE), at(index / LENS_POINTS_PER_SIDE)];
    (first..first + count).map(|index| of(index * STRIDE % LENS_POINTS)).collect()
}
