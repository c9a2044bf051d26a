//! The graphics state: transforms and their stack, current material, light and medium.

use super::super::shapes;
use super::parameters::{Parameter, Parameters};
use crate::scene::Pose;
use glam::{Affine3A, DMat4, DVec3};
use std::collections::HashMap;
use std::rc::Rc;

/// Deepest nesting of attributes.
pub(super) const DEEPEST_STACK: usize = 10_000;

/// The transform at the start and at the end of `TransformTimes`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transforms(pub(super) [DMat4; 2]);

impl Transforms {
    pub(super) const IDENTITY: Self = Self([DMat4::IDENTITY; 2]);

    pub(super) fn moves(&self) -> bool {
        self.0[0] != self.0[1]
    }

    pub(super) fn inverse(&self) -> Self {
        Self(self.0.map(|matrix| matrix.inverse()))
    }

    pub(super) fn then(&self, inner: &Self) -> Self {
        Self([self.0[0] * inner.0[0], self.0[1] * inner.0[1]])
    }

    /// Whether spheres stay spheres all the way: at both ends and once between, as for keyframes of our own format.
    pub(super) fn leave_spheres(&self) -> bool {
        [0.0, 0.3, 1.0].into_iter().all(|share| shapes::similarity_scale(&self.at(share)).is_some())
    }

    /// The transform at a share of the way from start to end.
    pub(super) fn at(&self, share: f32) -> Affine3A {
        let [start, end] = self.0.map(|matrix| Affine3A::from_mat4(matrix.as_mat4()));
        match share {
            _ if !self.moves() || share <= 0.0 => start,
            _ if share >= 1.0 => end,
            _ => Pose::decompose(start).interpolate(Pose::decompose(end), share).to_affine(),
        }
    }
}

/// A part of an object and the instance that carries it. pbrt interpolates the transforms of each apart.
pub(super) struct Carried {
    pub(super) instance: Transforms,
    pub(super) part: Transforms,
}

/// How a carried part goes.
pub(super) enum Path {
    /// A path as with one pair of transforms.
    Whole(Transforms),
    /// A path at rest in what moves.
    After { inner: Affine3A, outer: Transforms },
    /// A path that is neither that of its own poses nor that of its instance's.
    Apart,
}

impl Carried {
    pub(super) fn at(&self, share: f32) -> Affine3A {
        self.instance.at(share) * self.part.at(share)
    }

    pub(super) fn path(&self) -> Path {
        let whole = Path::Whole(self.instance.then(&self.part));
        match (self.instance.moves(), self.part.moves()) {
            (false, false) => whole,
            (true, false) => Path::After { inner: self.part.at(0.0), outer: self.instance },
            // What leaves angles as they are leaves poses what they are.
            (false, true) if shapes::similarity_scale(&self.instance.at(0.0)).is_some() => whole,
            _ => Path::Apart,
        }
    }
}

/// What a saved state was opened by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opening {
    Attribute,
    Object,
}

impl Opening {
    pub(super) fn begin(self) -> &'static str {
        match self {
            Self::Attribute => "AttributeBegin",
            Self::Object => "ObjectBegin",
        }
    }
}

/// What a directive works in.
#[derive(Clone)]
pub(super) struct State {
    pub(super) transforms: Transforms,
    pub(super) active: [bool; 2],
    pub(super) reverse_orientation: bool,
    pub(super) material: Option<Rc<super::materials::Definition>>,
    pub(super) area_light: Option<Rc<Parameters>>,
    pub(super) inside_medium: Option<String>,
    pub(super) outside_medium: Option<String>,
    /// Defaults of `Attribute`, by what they are for.
    pub(super) attributes: HashMap<String, Vec<Parameter>>,
}

impl State {
    pub(super) fn new() -> Self {
        Self {
            transforms: Transforms::IDENTITY,
            active: [true; 2],
            reverse_orientation: false,
            material: None,
            area_light: None,
            inside_medium: None,
            outside_medium: None,
            attributes: HashMap::new(),
        }
    }

    /// Sets the active transforms.
    pub(super) fn change(&mut self, new: impl Fn(DMat4) -> DMat4) {
        for (matrix, active) in self.transforms.0.iter_mut().zip(self.active) {
            if active {
                *matrix = new(*matrix);
            }
        }
    }
}

/// Transform of `LookAt`: world to camera, left-handed, z ahead. `None` if the vectors span no frame.
pub(super) fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let ahead = (target - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(ahead).try_normalize()?;
    let up = ahead.cross(right);
    let camera_to_world = DMat4::from_cols(right.extend(0.0), up.extend(0.0), ahead.extend(0.0), eye.extend(1.0));
    Some(camera_to_world.inverse())
}
