//! `Shape`: meshes, PLY files, spheres, disks, cylinders, bilinear patches.
//!
//! The front of a surface, from which one-sided lights shine and glass is told from air, is where pbrt has it: on the
//! side of the shading normals where there are any, else by the winding, and turned over by `ReverseOrientation`; that
//! of a sphere, disk or cylinder by a transform that mirrors too.

use super::super::error::LoadError;
use super::super::{ply, shapes};
use super::Reader;
use super::parameters::Parameters;
use super::state::{Carried, State, Transforms};
use crate::scene::{Instance, Mesh, MeshId, Sphere};
use glam::{Affine3A, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Steps around a full turn and along the other parameter of a curved surface.
const AROUND: u32 = 128;
const ALONG: u32 = 64;

/// pbrt's texture coordinates (0, 0), (1, 0), (1, 1) of triangles that have none, as our v runs.
const UVS_OF_TRIANGLE: [Vec2; 3] = [Vec2::Y, Vec2::ONE, Vec2::X];

/// A shape in its own coordinates.
enum Shape {
    Mesh(Mesh),
    File(MeshId),
    Sphere(f32),
}

/// A sphere in the world.
struct Ball {
    radius: f32,
    placed: Affine3A,
}

impl Reader<'_> {
    /// Adds a shape to the scene, or to the object that is being defined.
    pub(super) fn shape(&mut self, kind: &str, parameters: &Parameters) -> Result<(), LoadError> {
        let State { inside_medium, outside_medium, .. } = &self.state;
        if self.is_turned_over(kind) && inside_medium.is_none() && outside_medium.is_some() {
            let place = parameters.place();
            self.builder.note(format!("{place}: the medium outside of a reversed shape is not rendered."));
        }
        match self.read_shape(kind, parameters)? {
            Shape::Mesh(mesh) => self.add_made(kind, mesh, parameters),
            Shape::File(mesh) => self.place_mesh(kind, mesh, parameters),
            Shape::Sphere(radius) => match self.ball(radius) {
                Some(ball) => self.add_ball(&ball, parameters),
                None => self.add_made(kind, whole_sphere(radius), parameters),
            },
        }
    }

    fn read_shape(&mut self, kind: &str, parameters: &Parameters) -> Result<Shape, LoadError> {
        Ok(match kind {
            "trianglemesh" => Shape::Mesh(triangle_mesh(parameters, "indices")?),
            "loopsubdiv" => {
                let note = format!("{}: \"loopsubdiv\" is rendered as its control mesh.", parameters.place());
                self.builder.note(note);
                parameters.integer("levels")?;
                parameters.string("scheme")?;
                Shape::Mesh(triangle_mesh(parameters, "indices")?)
            }
            "bilinearmesh" => Shape::Mesh(bilinear_mesh(parameters)?),
            "plymesh" => Shape::File(self.ply_mesh(parameters)?),
            "sphere" => sphere(parameters)?,
            "disk" => Shape::Mesh(disk(parameters)?),
            "cylinder" => Shape::Mesh(cylinder(parameters)?),
            "curve" => return Err(parameters.unsupported("shapes of type \"curve\" (hair, fur) are not rendered")),
            other => {
                let known = "trianglemesh, plymesh, sphere, disk, cylinder, bilinearmesh, loopsubdiv are read";
                return Err(parameters.error(format_args!("unknown shape \"{other}\"; {known}")));
            }
        })
    }

    /// A sphere that stays analytic: its transforms leave it one at all times and nothing asks for pbrt's own
    /// coordinates.
    fn ball(&self, radius: f32) -> Option<Ball> {
        let transforms = &self.state.transforms;
        let placed = self.here(transforms);
        let radius = radius * shapes::similarity_scale(&placed)?;
        let stays_one = transforms.leave_spheres() && radius > 0.0 && radius.is_finite();
        let is_as_made = !self.is_turned_over("sphere") || !self.shows_its_front();
        let is_plain = is_as_made && self.current_object.is_none() && !self.uses_textures();
        (stays_one && is_plain && placed.translation.is_finite()).then_some(Ball { radius, placed })
    }

    fn add_ball(&mut self, ball: &Ball, parameters: &Parameters) -> Result<(), LoadError> {
        let &Ball { radius, placed } = ball;
        let area = 4.0 * f64::from(PI) * f64::from(radius) * f64::from(radius);
        let Some(material) = self.current_material(parameters, area)? else { return Ok(()) };
        self.note_unread("sphere", parameters);
        let motion = self.motion(&self.state.transforms).map(|motion| motion.since_open());
        self.builder.spheres.push(Sphere {
            name: "sphere".to_owned(),
            center: placed.translation.into(),
            radius,
            axes: Sphere::axes_with_poles_on_z(&placed),
            material,
            motion,
        });
        Ok(())
    }

    /// Whether the front of a shape is on its other side. The normal of a sphere, disk or cylinder pbrt flips
    /// before it carries it out (`InteractionFromIntersection`), where the transform mirrors; that of a shape that
    /// moves is carried out later.
    fn is_turned_over(&self, kind: &str) -> bool {
        let transforms = &self.state.transforms;
        let is_mirrored = || !transforms.moves() && transforms.at(0.0).matrix3.determinant() < 0.0;
        self.state.reverse_orientation != (matches!(kind, "sphere" | "disk" | "cylinder") && is_mirrored())
    }

    /// Whether the two sides of a surface may look different.
    fn shows_its_front(&self) -> bool {
        let material_does = self.state.material.as_ref().is_some_and(|definition| {
            matches!(definition.kind.as_str(), "dielectric" | "mix")
                || definition.parameters.find(&["string"], "normalmap").is_some()
        });
        material_does || self.state.area_light.is_some()
    }

    fn add_made(&mut self, kind: &str, mut mesh: Mesh, parameters: &Parameters) -> Result<(), LoadError> {
        kind.clone_into(&mut mesh.name);
        orient(&mut mesh, self.is_turned_over(kind));
        if kind != "trianglemesh" {
            self.made_vertices += mesh.positions.len();
            super::super::check_made_vertices(&self.main, self.made_vertices)?;
        }
        let mesh = self.builder.add_mesh(mesh);
        self.place_mesh(kind, mesh, parameters)
    }

    fn place_mesh(&mut self, kind: &str, mesh: MeshId, parameters: &Parameters) -> Result<(), LoadError> {
        let transforms = self.state.transforms;
        let to_world = self.here(&transforms);
        let area = shapes::area(&self.builder.meshes[mesh.0 as usize], &to_world);
        let Some(material) = self.current_material(parameters, area)? else { return Ok(()) };
        let shared = &mut self.builder.meshes[mesh.0 as usize];
        if shared.uvs.is_empty() && self.builder.materials[material.0 as usize].reads_pictures() {
            shapes::give_each_triangle(shared, UVS_OF_TRIANGLE);
        }
        let name = shared.name.clone();
        self.note_unread(&format!("shape \"{kind}\""), parameters);
        match &self.current_object {
            Some(object) => {
                let parts = self.objects.entry(object.clone()).or_default();
                parts.push(super::Part { name, mesh, material, transforms });
                self.builder.parts_of_groups += 1;
            }
            None => {
                let motion = self.motion(&transforms);
                self.builder.instances.push(Instance { name, mesh, material, to_world, motion });
            }
        }
        Ok(())
    }

    /// Whether the current material reads texture coordinates.
    fn uses_textures(&self) -> bool {
        let of = |parameters: &Parameters| parameters.has_textures();
        self.state.material.as_ref().is_some_and(|definition| of(&definition.parameters) || definition.kind == "mix")
            || self.state.area_light.as_ref().is_some_and(|light| of(light))
    }

    /// Each file is read once for each orientation.
    fn ply_mesh(&mut self, parameters: &Parameters) -> Result<MeshId, LoadError> {
        let Some(file) = parameters.string("filename")? else {
            return Err(parameters.error("a plymesh needs a \"string filename\""));
        };
        let key = (self.file(file), self.state.reverse_orientation);
        for (kind, name) in [("float", "edgelength"), ("texture", "displacement")] {
            if parameters.find(&[kind], name).is_some() {
                self.builder.note(format!("{}: displacement is not rendered.", parameters.place()));
            }
        }
        if let Some(id) = self.ply_files.get(&key) {
            return Ok(*id);
        }
        let mut loaded = ply::read(&key.0).map_err(|error| error.referenced_from(parameters.place()))?;
        orient(&mut loaded.mesh, key.1);
        for note in loaded.notes {
            self.builder.note(note);
        }
        let id = self.builder.add_mesh(loaded.mesh);
        self.ply_files.insert(key, id);
        Ok(id)
    }
}

fn sphere(parameters: &Parameters) -> Result<Shape, LoadError> {
    let radius = radius(parameters)?;
    let low = parameters.float_or("zmin", -radius)?;
    let high = parameters.float_or("zmax", radius)?;
    let turn = full_turn(parameters)?;
    if low <= -radius && high >= radius && turn >= TAU {
        return Ok(Shape::Sphere(radius));
    }
    let angle = |z: f32| (z / radius).clamp(-1.0, 1.0).acos();
    let (first, last) = (angle(low.min(high)), angle(low.max(high)));
    Ok(Shape::Mesh(grid(|u, v| {
        let (sin_phi, cos_phi) = (turn * u).sin_cos();
        let (sin_theta, cos_theta) = (first + (last - first) * v).sin_cos();
        let normal = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        (radius * normal, normal)
    })))
}

fn radius(parameters: &Parameters) -> Result<f32, LoadError> {
    let radius = parameters.float_or("radius", 1.0)?;
    if radius > 0.0 {
        Ok(radius)
    } else {
        Err(parameters.error(format_args!("\"radius\" must be above 0, not {radius}")))
    }
}

fn full_turn(parameters: &Parameters) -> Result<f32, LoadError> {
    Ok(parameters.float_or("phimax", 360.0)?.clamp(0.0, 360.0).to_radians())
}

/// A surface over (u, v) in [0, 1]² from its points and normals; v runs up in pbrt's coordinates. Where a row is one
/// point, as at a pole, half of its triangles are not there.
fn grid(surface: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=ALONG {
        for column in 0..=AROUND {
            let (u, v) = (column as f32 / AROUND as f32, row as f32 / ALONG as f32);
            let (position, normal) = surface(u, v);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(u, 1.0 - v));
        }
    }
    let triangles = shapes::grid_triangles(0, [AROUND, ALONG]);
    mesh.triangles.extend(triangles.filter(|triangle| shapes::has_area(&mesh.positions, triangle)));
    mesh
}

fn whole_sphere(radius: f32) -> Mesh {
    grid(|u, v| {
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        let (sin_theta, cos_theta) = (PI * (1.0 - v)).sin_cos();
        let normal = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
        (radius * normal, normal)
    })
}

/// A disk faces +z; a whole one is a fan.
fn disk(parameters: &Parameters) -> Result<Mesh, LoadError> {
    let radius = radius(parameters)?;
    let height = parameters.float_or("height", 0.0)?;
    let inner = parameters.float_or("innerradius", 0.0)?.clamp(0.0, radius);
    let turn = full_turn(parameters)?;
    if inner == 0.0 && turn >= TAU {
        // pbrt's v is 0 at the rim.
        let mut mesh = shapes::polar_disk(radius, |way, turn| Vec2::new(turn, way));
        mesh.positions.iter_mut().for_each(|position| position.z = height);
        return Ok(mesh);
    }
    Ok(grid(|u, v| {
        let (sin, cos) = (turn * u).sin_cos();
        let r = radius + (inner - radius) * v;
        (Vec3::new(r * cos, r * sin, height), Vec3::Z)
    }))
}

fn cylinder(parameters: &Parameters) -> Result<Mesh, LoadError> {
    let radius = radius(parameters)?;
    let (low, high) = (parameters.float_or("zmin", -1.0)?, parameters.float_or("zmax", 1.0)?);
    let turn = full_turn(parameters)?;
    Ok(grid(|u, v| {
        let (sin, cos) = (turn * u).sin_cos();
        (Vec3::new(radius * cos, radius * sin, low + (high - low) * v), Vec3::new(cos, sin, 0.0))
    }))
}

/// Positions, normals and coordinates that all meshes have.
fn vertices(parameters: &Parameters) -> Result<Mesh, LoadError> {
    let Some(positions) = parameters.vec3s(&["point3", "point"], "P")? else {
        return Err(parameters.error("the mesh has no \"point3 P\""));
    };
    let normals = parameters.vec3s(&["normal3", "normal"], "N")?.unwrap_or_default();
    let mut uvs = parameters.vec2s("uv")?.unwrap_or_default();
    uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
    for (name, count) in [("N", normals.len()), ("uv", uvs.len())] {
        if count != 0 && count != positions.len() {
            let problem = format!("\"{name}\" has {count} entries for {} positions", positions.len());
            return Err(parameters.error(problem));
        }
    }
    parameters.find(&["vector3", "vector"], "S");
    parameters.find(&["integer"], "faceIndices");
    Ok(Mesh { positions, normals, uvs, ..Mesh::default() })
}

fn indices<const N: usize>(parameters: &Parameters, name: &str, vertices: usize) -> Result<Vec<[u32; N]>, LoadError> {
    let Some(numbers) = parameters.numbers(&["integer"], name)? else {
        // The list may be left out where there is just one face.
        return if vertices == N {
            Ok(vec![std::array::from_fn(|corner| corner as u32)])
        } else {
            Err(parameters.error(format_args!("the mesh has no \"integer {name}\"")))
        };
    };
    let (faces, rest) = numbers.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(parameters.error(format_args!("\"{name}\": {} numbers are not faces of {N}", numbers.len())));
    }
    if let Some(bad) = numbers.iter().find(|&&index| index.fract() != 0.0 || index < 0.0 || index >= vertices as f64) {
        return Err(parameters.error(format_args!("\"{name}\" holds {bad}, but there are {vertices} positions")));
    }
    Ok(faces.iter().map(|face| face.map(|index| index as u32)).collect())
}

fn triangle_mesh(parameters: &Parameters, name: &str) -> Result<Mesh, LoadError> {
    let mut mesh = vertices(parameters)?;
    mesh.triangles = indices(parameters, name, mesh.positions.len())?;
    Ok(mesh)
}

/// Patches as grids of 8 × 8: exact where they are flat.
fn bilinear_mesh(parameters: &Parameters) -> Result<Mesh, LoadError> {
    const STEPS: u32 = 8;
    const MAX_PATCHES: usize = 1 << 17;
    let from = vertices(parameters)?;
    let patches: Vec<[u32; 4]> = indices(parameters, "indices", from.positions.len())?;
    if patches.len() > MAX_PATCHES {
        return Err(parameters.error(format_args!("more than {MAX_PATCHES} bilinear patches")));
    }
    let mut mesh = Mesh::default();
    for patch in &patches {
        let patch = patch.map(|corner| corner as usize);
        let base = mesh.positions.len() as u32;
        for row in 0..=STEPS {
            for column in 0..=STEPS {
                let (u, v) = (column as f32 / STEPS as f32, row as f32 / STEPS as f32);
                // The corners' order is (0,0), (1,0), (0,1), (1,1).
                let blend = |values: &[Vec3]| {
                    let [a, b, c, d] = patch.map(|corner| values[corner]);
                    a.lerp(b, u).lerp(c.lerp(d, u), v)
                };
                mesh.positions.push(blend(&from.positions));
                if !from.normals.is_empty() {
                    mesh.normals.push(blend(&from.normals));
                }
                mesh.uvs.push(if from.uvs.is_empty() {
                    Vec2::new(u, 1.0 - v)
                } else {
                    let [a, b, c, d] = patch.map(|corner| from.uvs[corner]);
                    a.lerp(b, u).lerp(c.lerp(d, u), v)
                });
            }
        }
        mesh.triangles.extend(shapes::grid_triangles(base, [STEPS, STEPS]));
    }
    Ok(mesh)
}

/// Winds every triangle so that its front is pbrt's.
fn orient(mesh: &mut Mesh, reverse: bool) {
    shapes::face_along_normals(mesh);
    if reverse {
        shapes::turn_over(mesh);
    }
}

/// An instance of a part of an object.
pub(super) fn place_part(reader: &Reader, part: &super::Part, instance: &Transforms) -> Instance {
    let (to_world, motion) = reader.carried(&Carried { instance: *instance, part: part.transforms });
    Instance { name: part.name.clone(), mesh: part.mesh, material: part.material, to_world, motion }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outward_share(mesh: &Mesh) -> f32 {
        let outward = mesh.triangles.iter().filter(|triangle| {
            let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
            (b - a).cross(c - a).dot(a + b + c) >= 0.0
        });
        outward.count() as f32 / mesh.triangles.len() as f32
    }

    #[test]
    fn spheres_face_outwards_and_reversed_ones_inwards() {
        let mut mesh = whole_sphere(2.0);
        orient(&mut mesh, false);
        assert_eq!(outward_share(&mesh), 1.0);
        let area = shapes::area(&mesh, &Affine3A::IDENTITY);
        assert!((area / (16.0 * f64::from(PI)) - 1.0).abs() < 2e-3, "{area}");
        orient(&mut mesh, true);
        assert_eq!(outward_share(&mesh), 0.0);
    }
}
