//! What a ray travels in: the volumes that a path has entered and not yet left, and what they absorb (Beer–Lambert).
//!
//! A boundary pushes its inside when the path enters it from the front and takes it away again when the path leaves. A
//! volume is known by its material, so that its boundary may be made of several objects; the innermost one absorbs.
//! Thin sheets have no inside. What the camera is in is asked by rays from it out of the scene. A path that meets a
//! boundary from behind without having entered it came in through a face that belongs to another volume: the way to
//! that boundary is inside it.
//!
//! Not for volumes that touch: a ray that crosses one of two faces in the same place is past the other. They must be a
//! little apart or overlap, as of glass and what is in it.
//!
//! Source: A. Beer (1852); nesting as in C. Schmidt & B. Budge, *Simple nested dielectrics in ray traced images*
//! (2002), without priorities, since our boundaries carry the index of both sides.

use crate::geometry::{Ray, World};
use crate::scene::{MaterialId, Surface};
use glam::{Vec3, Vec3A};
use smallvec::SmallVec;

/// Volumes inside one another that are told apart; beyond it the innermost ones are forgotten.
const DEEPEST: usize = 8;

/// As many of something as volumes are told apart, without an allocation: cameras in volumes may ask at every ray.
type Nested<T> = SmallVec<[T; DEEPEST]>;

/// The inside of a boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Medium {
    material: MaterialId,
    /// Per scene unit and channel.
    absorption: Vec3,
}

impl Medium {
    /// What lies behind a surface of such a material, if it bounds a volume.
    pub(super) fn behind(material: MaterialId, surface: &Surface) -> Option<Self> {
        surface.interior_absorption().map(|absorption| Self { material, absorption })
    }

    /// Its boundary, crossed from its front.
    fn entered(self) -> Crossed {
        Crossed { medium: self, crossing: Crossing::In }
    }

    /// Share of light that is left after a distance, which may be infinite.
    fn transmittance(&self, distance: f32) -> Vec3 {
        // 0 · ∞ is no number: what does not absorb lets everything through.
        let left = |absorption: f32| if absorption > 0.0 { (-absorption * distance).exp() } else { 1.0 };
        Vec3::new(left(self.absorption.x), left(self.absorption.y), left(self.absorption.z))
    }
}

/// The volumes that a path is in, outermost first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Media {
    entered: [Option<Medium>; DEEPEST],
    count: usize,
}

/// Which way a path crosses a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crossing {
    /// The path enters, from the boundary's front.
    In,
    /// The path leaves, from the boundary's back.
    Out,
}

/// A boundary that a path crosses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossed {
    /// Behind it.
    pub(super) medium: Medium,
    pub(super) crossing: Crossing,
}

impl Media {
    /// Crosses the boundary of a volume.
    pub(super) fn cross(&mut self, Crossed { medium, crossing }: Crossed) {
        match crossing {
            Crossing::In if self.count < DEEPEST => {
                self.entered[self.count] = Some(medium);
                self.count += 1;
            }
            Crossing::In => {}
            Crossing::Out => {
                let is_it = |entered: &Option<Medium>| entered.is_some_and(|it| it.material == medium.material);
                if let Some(place) = self.entered[..self.count].iter().rposition(is_it) {
                    self.entered.copy_within(place + 1..self.count, place);
                    self.count -= 1;
                }
            }
        }
    }

    /// The volumes around the beginning of a camera ray at its time: those whose boundaries a ray leaves without having
    /// entered them, as most of seven rays say. One alone may pass where two volumes touch, or the back of a sheet, and
    /// took such a picture for one from inside.
    pub(super) fn around(world: &World, ray: Ray) -> Self {
        // In no plane that people build by.
        const OTHERS: [[f32; 3]; 6] = [
            [0.31, 0.83, 0.46],
            [-0.87, 0.29, 0.39],
            [0.42, -0.37, -0.83],
            [-0.27, -0.79, 0.55],
            [0.79, 0.33, -0.52],
            [-0.51, 0.44, -0.74],
        ];
        let others = OTHERS.map(|direction| Vec3A::from(direction).normalize());
        let said: SmallVec<[Nested<Medium>; 7]> = std::iter::once(ray.direction)
            .chain(others)
            .map(|direction| Self::left_by(world, Ray { direction, ..ray }))
            .collect();
        let agreeing = |media: &Nested<Medium>| said.iter().filter(|other| *other == media).count();
        // Of equals the ray that was given stands.
        let most = said.iter().rev().max_by_key(|media| agreeing(media));
        let mut media = Self::default();
        most.into_iter().flatten().for_each(|medium| media.cross(medium.entered()));
        media
    }

    /// The volumes that a ray leaves without having entered them, outermost first.
    fn left_by(world: &World, mut ray: Ray) -> Nested<Medium> {
        // More than that are no boundaries of volumes.
        const MAX_CROSSED: usize = 10_000;
        let (mut entered, mut around) = (Nested::new(), Nested::new());
        for _ in 0..MAX_CROSSED {
            let Some(hit) = world.closest(&ray) else { break };
            let point = world.surface(&ray, &hit);
            let material = world.material_of(hit.object);
            let direction = Vec3::from(ray.direction);
            if let Some(medium) = Medium::behind(material, &world.material(hit.object).surface) {
                if direction.dot(point.geometric_normal) < 0.0 {
                    entered.push(material);
                } else if let Some(place) = entered.iter().rposition(|own| *own == material) {
                    entered.remove(place);
                } else {
                    around.push(medium);
                }
            }
            ray.origin = point.spawn(direction);
        }
        around.reverse();
        around
    }

    fn innermost(&self) -> Option<Medium> {
        self.count.checked_sub(1).and_then(|last| self.entered[last])
    }

    /// Share of light that is left along a free way of such a length.
    pub(super) fn transmittance(&self, distance: f32) -> Vec3 {
        self.innermost().map_or(Vec3::ONE, |medium| medium.transmittance(distance))
    }

    /// Share of light that is left along a free way of such a length that ends at the back of the boundary of `medium`.
    pub(super) fn transmittance_to_back_of(&self, medium: Medium, distance: f32) -> Vec3 {
        let entered = self.entered[..self.count].iter().flatten().any(|entered| entered.material == medium.material);
        if entered { self.transmittance(distance) } else { medium.transmittance(distance) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::{LoadOptions, load};

    fn medium(material: u32, absorption: f32) -> Medium {
        Medium { material: MaterialId(material), absorption: Vec3::splat(absorption) }
    }

    fn left(medium: Medium) -> Crossed {
        Crossed { medium, crossing: Crossing::Out }
    }

    #[test]
    fn the_innermost_volume_absorbs() {
        let (glass, wine) = (medium(0, 1.0), medium(1, 3.0));
        let mut media = Media::default();
        assert_eq!(media.transmittance(f32::INFINITY), Vec3::ONE);
        media.cross(glass.entered());
        media.cross(wine.entered());
        assert_eq!(media.transmittance(1.0), Vec3::splat((-3.0f32).exp()));
        // Out of the outer one first, as where two volumes overlap.
        media.cross(left(glass));
        assert_eq!(media.transmittance(1.0), Vec3::splat((-3.0f32).exp()));
        media.cross(left(wine));
        assert_eq!(media.transmittance(1.0), Vec3::ONE);
    }

    #[test]
    fn a_path_that_began_inside_knows_it_at_the_back_of_the_boundary() {
        let water = medium(4, 2.0);
        let mut media = Media::default();
        assert_eq!(media.transmittance_to_back_of(water, 0.5), Vec3::splat((-1.0f32).exp()));
        media.cross(left(water));
        assert_eq!(media.transmittance(0.5), Vec3::ONE);
    }

    /// Two absorbing boxes that touch: a ray through the face between them meets one of two boundaries, and seven know
    /// better.
    #[test]
    fn a_camera_before_touching_volumes_is_in_none() {
        let scene = |boxes: &str| {
            let text = format!(
                "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nvertical_fov_deg = 60\n[environment]\nradiance = [1, 1, 1]\n\
                 [materials.m]\ntype = \"dielectric\"\nior = 1.0\nabsorption = [0.5, 0.5, 0.5]\n\
                 [materials.n]\ntype = \"dielectric\"\nior = 1.0\nabsorption = [1, 1, 1]\n{boxes}"
            );
            let folder = tempfile::tempdir().expect("a folder");
            let file = folder.path().join("s.toml");
            std::fs::write(&file, text).expect("written");
            World::new(std::sync::Arc::new(load(&file, &LoadOptions::default()).expect("a scene")))
        };
        let touching = "[[objects]]\nbox = { min = [-1, -1, 0], max = [1, 1, 1] }\nmaterial = \"m\"\n\
                        [[objects]]\nbox = { min = [-1, -1, -1], max = [1, 1, 0] }\nmaterial = \"n\"\n";
        let ray = Ray::new(Vec3A::new(0.01, 0.02, 5.0), Vec3A::NEG_Z);
        assert_eq!(Media::around(&scene(touching), ray).count, 0);
        let inside = "[[objects]]\nbox = { min = [-9, -9, -9], max = [9, 9, 9] }\nmaterial = \"n\"\n";
        let world = scene(&[touching, inside].concat());
        let around = Media::around(&world, ray);
        assert_eq!((around.count, around.innermost().map(|medium| medium.absorption)), (1, Some(Vec3::ONE)));
    }

    #[test]
    fn more_volumes_than_are_told_apart_do_no_harm() {
        let mut media = Media::default();
        for number in 0..20 {
            media.cross(medium(number, 1.0).entered());
        }
        for number in 0..20 {
            media.cross(left(medium(number, 1.0)));
        }
        assert_eq!(media.count, 0);
    }
}
