//! Triangles and parallelograms that emit. Triangles, and rectangles that may look larger than 1 sr, are sampled by
//! solid angle; smaller rectangles and oblique parallelograms by area and what their corners give; specks of all three,
//! and oblique parallelograms that may look larger, evenly by area.

use super::bilinear::{BilinearDensity, parallelogram_corners};
use super::emission::{emitted, even_radiance};
use super::lanes::FourVectors;
use super::solid_angle::{LEAST, SphericalRectangle, SphericalTriangle};
use super::{LightPlace, LightReceiver, LightSample};
use crate::geometry::{Face, offset};
use crate::scene::{Alpha, Material, Scene};
use glam::{Affine3A, DVec3, Vec2, Vec3, Vec3A};

/// A flat emitter.
#[derive(Clone, Debug)]
pub(super) struct FlatEmitter {
    pub(super) object: u32,
    /// Of a parallelogram, the first of its two triangles.
    triangle: u32,
    outline: Outline,
    corner: Vec3,
    edge_1: Vec3,
    edge_2: Vec3,
    /// Middle of the outline.
    center: Vec3,
    /// Square of the distance of the centre beyond which it looks smaller than [`LEAST`].
    speck_beyond_squared: f32,
    /// Likewise smaller than [`MAX_BILINEAR`].
    bilinear_beyond_squared: f32,
    /// Unit normal of the front.
    pub(super) normal: Vec3,
    pub(super) area: f32,
    /// How far before it a shadow ray ends: beyond the rounding of places on it.
    offset: f32,
    pub(super) both_sides: bool,
    /// No ray meets it.
    is_unseen: bool,
    /// What it emits where that is the same everywhere; `None` where a picture says.
    even_radiance: Option<Vec3>,
}

/// Bound of the solid angle in steradian below which a parallelogram is sampled by its corners.
const MAX_BILINEAR: f32 = 1.0;

/// Corners that lie this near to each other, as a share of the triangle's size, are one; edges whose cosine is
/// below it are at a right angle.
const ROUNDING: f32 = 1e-5;
/// Least cosine between the normals of two triangles in one plane.
const COPLANAR: f32 = 0.999_99;

/// What the two edges span.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outline {
    Triangle,
    Parallelogram(FourVectors),
    /// A parallelogram whose edges are at a right angle.
    Rectangle(FourVectors, Edges),
}

/// Two edges at a right angle: unit directions and lengths, in f64 for [`SphericalRectangle`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Edges {
    axes: [DVec3; 2],
    lengths: [f64; 2],
}

impl Edges {
    fn new(edges: [Vec3; 2]) -> Self {
        let edges = edges.map(|edge| edge.as_dvec3());
        Self { axes: edges.map(DVec3::normalize_or_zero), lengths: edges.map(DVec3::length) }
    }
}

/// How the corners of a triangle run, seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Winding {
    CounterClockwise,
    Clockwise,
}

impl Winding {
    /// Winding of a mesh's triangles where a transform has put them, which may mirror.
    pub(super) fn after(to_world: &Affine3A) -> Self {
        if to_world.matrix3.determinant() < 0.0 { Self::Clockwise } else { Self::CounterClockwise }
    }
}

/// A point of the emitter: shares of the two edges.
type Shares = [f32; 2];

impl FlatEmitter {
    /// A triangle with these world corners, put there by a transform with this translation.
    pub(super) fn triangle(
        object: u32,
        triangle: u32,
        corners: [Vec3; 3],
        translation: Vec3A,
        winding: Winding,
        material: &Material,
    ) -> Self {
        let (edge_1, edge_2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let Face { normal, area } =
            Face::spanned_by([edge_1.into(), edge_2.into()]).unwrap_or(Face { normal: Vec3::Y, area: 0.0 });
        let from_center = [2.0 * edge_1 - edge_2, 2.0 * edge_2 - edge_1, edge_1 + edge_2];
        let radius = from_center.map(Vec3::length).into_iter().fold(0.0, f32::max) / 3.0;
        Self {
            object,
            triangle,
            outline: Outline::Triangle,
            corner: corners[0],
            edge_1,
            edge_2,
            center: corners[0] + (edge_1 + edge_2) / 3.0,
            speck_beyond_squared: squared_distance_at(LEAST as f32, area, radius),
            bilinear_beyond_squared: squared_distance_at(MAX_BILINEAR, area, radius),
            normal: match winding {
                Winding::CounterClockwise => normal,
                Winding::Clockwise => -normal,
            },
            area,
            offset: offset::of_triangle(corners[0].into(), [edge_1.into(), edge_2.into()], translation),
            both_sides: material.emits_both_sides,
            is_unseen: material.alpha == Alpha::Unseen,
            even_radiance: None,
        }
    }

    /// Merges two triangles into one emitter, if they are the halves a, b, c and a, c, d of a parallelogram that emits
    /// evenly.
    pub(super) fn merged(&self, next: &Self, scene: &Scene) -> Option<Self> {
        let tolerance = ROUNDING * (self.edge_1.abs() + self.edge_2.abs()).max_element();
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= tolerance;
        let third = self.corner + self.edge_2;
        let is_one = near(self.corner, next.corner)
            && near(third, next.corner + next.edge_1)
            && near(self.edge_2 - self.edge_1, next.edge_2)
            && self.both_sides == next.both_sides
            && self.normal.dot(next.normal) > COPLANAR;
        let material = &scene.materials[scene.instances[self.object as usize].material.0 as usize];
        if !is_one {
            return None;
        }
        let even_radiance = Some(even_radiance(material)?);
        let (edge_1, edge_2) = (self.edge_1, next.edge_2);
        let cosine = edge_1.normalize_or_zero().dot(edge_2.normalize_or_zero());
        let corners = parallelogram_corners(self.corner, edge_1, edge_2);
        let outline = match cosine.abs() < ROUNDING {
            true => Outline::Rectangle(corners, Edges::new([edge_1, edge_2])),
            false => Outline::Parallelogram(corners),
        };
        let center = self.corner + 0.5 * (edge_1 + edge_2);
        let radius = 0.5 * (edge_1 + edge_2).length().max((edge_1 - edge_2).length());
        let area = self.area + next.area;
        Some(Self {
            outline,
            edge_2,
            center,
            speck_beyond_squared: squared_distance_at(LEAST as f32, area, radius),
            bilinear_beyond_squared: squared_distance_at(MAX_BILINEAR, area, radius),
            area,
            offset: self.offset.max(next.offset),
            even_radiance,
            ..self.clone()
        })
    }

    /// Corners of the emitter, for bounds: some come twice.
    pub(super) fn corners(&self) -> impl Iterator<Item = Vec3> {
        self.triangles().into_iter().flatten().flatten()
    }

    /// What it is made of.
    pub(super) fn triangles(&self) -> [Option<[Vec3; 3]>; 2] {
        let [a, b, c] = [self.corner, self.corner + self.edge_1, self.corner + self.edge_2];
        match self.outline {
            Outline::Triangle => [Some([a, b, c]), None],
            _ => [Some([a, b, c]), Some([b, b + self.edge_2, c])],
        }
    }

    /// A direction from a receiver to the emitter.
    pub(super) fn sample(&self, scene: &Scene, receiver: &LightReceiver, u: [f32; 2]) -> Option<LightSample> {
        if self.area == 0.0 || self.is_level_with(receiver) {
            return None;
        }
        let from = receiver.position;
        let view = self.view(receiver);
        let shares = view.sample(self, u)?;
        let position = self.corner + shares[0] * self.edge_1 + shares[1] * self.edge_2;
        let to_light = position - from;
        let distance = to_light.length();
        let direction = to_light / distance;
        let facing = -direction.dot(self.normal);
        if distance == 0.0 || (facing <= 0.0 && !self.both_sides) {
            return None;
        }
        let pdf = view.pdf(self, direction, distance, || shares);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            place: Some(LightPlace { position, normal: self.normal * facing.signum(), offset: self.offset }),
            radiance: self.even_radiance.unwrap_or_else(|| self.radiance(scene, shares, facing.abs())),
            pdf,
            is_delta: self.is_unseen,
        })
    }

    /// Density per steradian of a direction that reaches the emitter at this distance.
    pub(super) fn pdf(&self, receiver: &LightReceiver, direction: Vec3, distance: f32) -> f32 {
        if self.is_level_with(receiver) {
            return 0.0;
        }
        let shares = || self.shares_of(receiver.position + distance * direction);
        self.view(receiver).pdf(self, direction, distance, shares)
    }

    /// The shares of the edges at which a point of a parallelogram lies.
    fn shares_of(&self, position: Vec3) -> Shares {
        let way = position - self.corner;
        let (across_1, across_2) = (self.normal.cross(self.edge_2), self.normal.cross(self.edge_1));
        let share = |across: Vec3, edge: Vec3| (way.dot(across) / edge.dot(across)).clamp(0.0, 1.0);
        [share(across_1, self.edge_1), share(across_2, self.edge_2)]
    }

    /// What a triangle emits at a place at this cosine to its normal.
    fn radiance(&self, scene: &Scene, [s1, s2]: Shares, cosine: f32) -> Vec3 {
        let instance = &scene.instances[self.object as usize];
        let material = &scene.materials[instance.material.0 as usize];
        let mesh = &scene.meshes[instance.mesh.0 as usize];
        let uv = if mesh.uvs.is_empty() {
            Vec2::ZERO
        } else {
            let [a, b, c] = mesh.triangles[self.triangle as usize].map(|i| mesh.uvs[i as usize]);
            a * (1.0 - s1 - s2) + b * s1 + c * s2
        };
        emitted(material, &scene.textures, uv, cosine) * material.alpha.coverage(&scene.textures, uv)
    }

    /// Whether a receiver is in the emitter's own plane as far as rounding can tell: what such a one sees of it is up
    /// to what rays meet. A place on the emitter itself may be a hair before it, and would see 2π sr of it.
    fn is_level_with(&self, receiver: &LightReceiver) -> bool {
        (self.corner - receiver.position).dot(self.normal).abs() <= self.offset
    }

    fn view(&self, receiver: &LightReceiver) -> View {
        // What looks small from its size and distance needs no closer look.
        let squared_distance = self.center.distance_squared(receiver.position);
        if squared_distance > self.speck_beyond_squared {
            return View::Even;
        }
        let is_near = squared_distance <= self.bilinear_beyond_squared;
        match &self.outline {
            Outline::Triangle => {
                let corner = self.corner - receiver.position;
                let others = [self.edge_1, self.edge_2].map(|edge| (corner + edge).as_dvec3());
                let triangle = SphericalTriangle::new([corner.as_dvec3(), others[0], others[1]]);
                if triangle.solid_angle > LEAST { View::Triangle(triangle) } else { View::Even }
            }
            Outline::Rectangle(_, edges) if is_near => {
                let corner = self.corner - receiver.position;
                let rectangle = SphericalRectangle::new(corner.as_dvec3(), edges.axes, edges.lengths);
                if rectangle.solid_angle > LEAST { View::Rectangle(rectangle) } else { View::Even }
            }
            Outline::Parallelogram(_) if is_near => View::Even,
            Outline::Rectangle(corners, _) | Outline::Parallelogram(corners) => {
                View::Bilinear(BilinearDensity::of_irradiance(&corners.seen_from(receiver.position), receiver.normal))
            }
        }
    }
}

/// Square of the distance from which an emitter of this area, none of which is farther than `radius` from its centre,
/// looks smaller than a solid angle: A/d² bounds that only where the emitter is not much nearer than its centre, so the
/// nearest it can be is taken.
fn squared_distance_at(solid_angle: f32, area: f32, radius: f32) -> f32 {
    (radius + (area / solid_angle).sqrt()).powi(2)
}

/// How an emitter is sampled from one point.
enum View {
    /// By area, evenly.
    Even,
    /// By area, as much as the corners give.
    Bilinear(BilinearDensity),
    Triangle(SphericalTriangle),
    Rectangle(SphericalRectangle),
}

impl View {
    fn sample(&self, emitter: &FlatEmitter, u: [f32; 2]) -> Option<Shares> {
        match self {
            View::Even if emitter.outline == Outline::Triangle => Some(uniform_barycentrics(u)),
            View::Even => Some(u),
            View::Bilinear(density) => Some(density.sample(u)),
            View::Rectangle(rectangle) => {
                let Outline::Rectangle(_, edges) = &emitter.outline else { return None };
                let [along_1, along_2] = rectangle.sample(u);
                Some([(along_1 / edges.lengths[0]) as f32, (along_2 / edges.lengths[1]) as f32])
            }
            View::Triangle(triangle) => triangle.shares(triangle.sample(u)?),
        }
    }

    fn pdf(&self, emitter: &FlatEmitter, direction: Vec3, distance: f32, shares: impl Fn() -> Shares) -> f32 {
        // Area density turned to solid angle.
        let even = || distance * distance / (direction.dot(emitter.normal).abs() * emitter.area);
        match self {
            View::Even => even(),
            View::Bilinear(density) => even() * density.at(shares()),
            View::Triangle(triangle) => (1.0 / triangle.solid_angle) as f32,
            View::Rectangle(rectangle) => (1.0 / rectangle.solid_angle) as f32,
        }
    }
}

/// Square to triangle without folding, so that stratification survives (Heitz, "A Low-Distortion Map Between
/// Triangle and Square", 2019).
fn uniform_barycentrics([u, v]: [f32; 2]) -> Shares {
    if v > u {
        let x = 0.5 * u;
        [x, v - x]
    } else {
        let y = 0.5 * v;
        [u - y, y]
    }
}
