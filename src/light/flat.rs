//! Triangles and parallelograms that emit: sampled by solid angle where they look large, else by area.

use super::solid_angle::{LEAST, SphericalRectangle, SphericalTriangle};
use super::{LightPlace, LightSample};
use crate::scene::{Alpha, Scene};
use glam::{DVec3, Vec2, Vec3};

/// A flat emitter.
#[derive(Clone, Debug)]
pub(super) struct FlatEmitter {
    object: u32,
    /// Of a parallelogram, the first of its two triangles.
    triangle: u32,
    outline: Outline,
    corner: Vec3,
    edge_1: Vec3,
    edge_2: Vec3,
    /// Sum of the edges' lengths: no point is farther than this from the corner.
    reach: f32,
    /// Unit normal of the front.
    pub(super) normal: Vec3,
    pub(super) area: f32,
    pub(super) both_sides: bool,
}

/// What the two edges span.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outline {
    Triangle,
    Parallelogram,
    /// A parallelogram whose edges are at a right angle.
    Rectangle(Edges),
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

/// A point of the emitter: shares of the two edges.
type Shares = [f32; 2];

impl FlatEmitter {
    /// A triangle with these world corners; `mirrored` if its front is where the winding is clockwise.
    pub(super) fn triangle(object: u32, triangle: u32, corners: [Vec3; 3], mirrored: bool, both_sides: bool) -> Self {
        let (edge_1, edge_2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let scaled_normal = edge_1.cross(edge_2);
        Self {
            object,
            triangle,
            outline: Outline::Triangle,
            corner: corners[0],
            edge_1,
            edge_2,
            reach: edge_1.length() + edge_2.length(),
            normal: scaled_normal.normalize_or(Vec3::Y) * if mirrored { -1.0 } else { 1.0 },
            area: 0.5 * scaled_normal.length(),
            both_sides,
        }
    }

    /// Both triangles as one, if they are the halves a, b, c and a, c, d of a parallelogram that emits evenly.
    pub(super) fn merged(&self, next: &Self, scene: &Scene) -> Option<Self> {
        let tolerance = 1e-5 * (self.edge_1.abs() + self.edge_2.abs()).max_element();
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= tolerance;
        let third = self.corner + self.edge_2;
        let is_one = near(self.corner, next.corner)
            && near(third, next.corner + next.edge_1)
            && near(self.edge_2 - self.edge_1, next.edge_2)
            && self.both_sides == next.both_sides
            && self.normal.dot(next.normal) > 0.999_99;
        let material = &scene.materials[scene.instances[self.object as usize].material.0 as usize];
        if !is_one || material.emission.texture.is_some() || material.alpha != Alpha::Opaque {
            return None;
        }
        let (edge_1, edge_2) = (self.edge_1, next.edge_2);
        let cosine = edge_1.normalize_or_zero().dot(edge_2.normalize_or_zero());
        let outline = match cosine.abs() < 1e-5 {
            true => Outline::Rectangle(Edges::new([edge_1, edge_2])),
            false => Outline::Parallelogram,
        };
        let reach = edge_1.length() + edge_2.length();
        Some(Self { outline, edge_2, reach, area: self.area + next.area, ..self.clone() })
    }

    /// Corners of its outline, for bounds.
    pub(super) fn corners(&self) -> impl Iterator<Item = Vec3> {
        let last = match self.outline {
            Outline::Triangle => None,
            _ => Some(self.corner + self.edge_1 + self.edge_2),
        };
        [self.corner, self.corner + self.edge_1, self.corner + self.edge_2].into_iter().chain(last)
    }

    /// A direction from `from` to the emitter.
    pub(super) fn sample(&self, scene: &Scene, from: Vec3, u: [f32; 2]) -> Option<LightSample> {
        if self.area == 0.0 {
            return None;
        }
        let view = self.view(from);
        let shares = view.sample(self, u)?;
        let position = self.corner + shares[0] * self.edge_1 + shares[1] * self.edge_2;
        let to_light = position - from;
        let distance = to_light.length();
        let direction = to_light / distance;
        let facing = -direction.dot(self.normal);
        if distance == 0.0 || (facing <= 0.0 && !self.both_sides) {
            return None;
        }
        Some(LightSample {
            direction,
            place: Some(LightPlace { position, normal: self.normal * facing.signum() }),
            radiance: self.radiance(scene, shares),
            pdf: view.pdf(self, direction, distance),
            is_delta: false,
        })
        .filter(|s| s.pdf > 0.0 && s.pdf.is_finite())
    }

    /// Density per steradian of a direction that reaches the emitter at this distance.
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3, distance: f32) -> f32 {
        self.view(from).pdf(self, direction, distance)
    }

    fn radiance(&self, scene: &Scene, [s1, s2]: Shares) -> Vec3 {
        let instance = &scene.instances[self.object as usize];
        let material = &scene.materials[instance.material.0 as usize];
        // Only triangles are textured: parallelograms are merged where nothing depends on the place.
        let mesh = &scene.meshes[instance.mesh.0 as usize];
        let uv = if mesh.uvs.is_empty() || self.outline != Outline::Triangle {
            Vec2::ZERO
        } else {
            let [a, b, c] = mesh.triangles[self.triangle as usize].map(|i| mesh.uvs[i as usize]);
            a * (1.0 - s1 - s2) + b * s1 + c * s2
        };
        material.emission.evaluate(&scene.textures, uv) * material.alpha.coverage(&scene.textures, uv)
    }

    fn view(&self, from: Vec3) -> View {
        let corner = (self.corner - from).as_dvec3();
        // What looks small from its size and distance needs no closer look: A/d² bounds the solid angle only where the
        // emitter is not much nearer than its centre, so the nearest it can be is taken.
        let nearest = corner.length() - f64::from(self.reach);
        if nearest > 0.0 && f64::from(self.area) < LEAST * nearest * nearest {
            return View::Small;
        }
        match self.outline {
            Outline::Triangle => {
                let others = [self.edge_1, self.edge_2].map(|edge| corner + edge.as_dvec3());
                let triangle = SphericalTriangle::new([corner, others[0], others[1]]);
                if triangle.solid_angle > LEAST { View::Triangle(triangle) } else { View::Small }
            }
            Outline::Rectangle(edges) => {
                let rectangle = SphericalRectangle::new(corner, edges.axes, edges.lengths);
                if rectangle.solid_angle > LEAST { View::Rectangle(rectangle) } else { View::Small }
            }
            Outline::Parallelogram => View::Small,
        }
    }
}

/// How an emitter is sampled from one point.
enum View {
    /// By area.
    Small,
    Triangle(SphericalTriangle),
    Rectangle(SphericalRectangle),
}

impl View {
    fn sample(&self, emitter: &FlatEmitter, u: [f32; 2]) -> Option<Shares> {
        match self {
            View::Small if emitter.outline == Outline::Triangle => Some(uniform_barycentrics(u)),
            View::Small => Some(u),
            View::Rectangle(rectangle) => {
                let Outline::Rectangle(edges) = emitter.outline else { return None };
                let [along_1, along_2] = rectangle.sample(u);
                Some([(along_1 / edges.lengths[0]) as f32, (along_2 / edges.lengths[1]) as f32])
            }
            View::Triangle(triangle) => triangle.shares(triangle.sample(u)?),
        }
    }

    fn pdf(&self, emitter: &FlatEmitter, direction: Vec3, distance: f32) -> f32 {
        match self {
            // Area density turned to solid angle.
            View::Small => distance * distance / (direction.dot(emitter.normal).abs() * emitter.area),
            View::Triangle(triangle) => (1.0 / triangle.solid_angle) as f32,
            View::Rectangle(rectangle) => (1.0 / rectangle.solid_angle) as f32,
        }
    }
}

/// Square to triangle without folding, so that stratification survives (Heitz, "A Low-Distortion Map Between Triangle and
/// Square", 2019).
fn uniform_barycentrics([u, v]: [f32; 2]) -> Shares {
    if v > u {
        let x = 0.5 * u;
        [x, v - x]
    } else {
        let y = 0.5 * v;
        [u - y, y]
    }
}
