//! Reads `<shape>`. What a shape is made of is left to `bsdfs`.

use super::super::error::LoadError;
use super::super::{obj, ply, shapes};
use super::Reader;
use super::element::Element;
use super::{primitives, serialized, transform};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Sphere};
use glam::{Affine3A, Vec2, Vec3};
use std::path::PathBuf;
use std::rc::Rc;

/// Where triangles and normals face.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Facing {
    AsMade,
    TurnedOver,
}

impl Facing {
    fn turned_over_if(self, turns: bool) -> Self {
        if turns == (self == Self::AsMade) { Self::TurnedOver } else { Self::AsMade }
    }
}

/// A mesh file as it is used.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    file: PathBuf,
    /// Number of the mesh in it.
    number: usize,
    /// Without normals of vertices.
    faces: bool,
    facing: Facing,
    /// Pictures upside down against what stands in the file.
    flip_v: bool,
    /// Placed by a transform that mirrors.
    mirrored: bool,
}

/// Texture coordinates of a triangle's corners where a mesh has none.
const BARYCENTRIC: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::Y];

impl Reader {
    /// Adds a shape.
    pub(super) fn shape(&mut self, shape: &Rc<Element>) -> Result<(), LoadError> {
        let kind = shape.kind();
        if matches!(kind.as_str(), "shapegroup" | "instance") {
            return self.group(shape, &kind);
        }
        let to_world = transform::of(shape, "toworld")?;
        let facing = Facing::AsMade.turned_over_if(shape.boolean_or("flipnormals", false)?);
        if kind == "sphere" {
            return self.sphere(shape, &to_world, facing);
        }
        let meshes = self.meshes(shape, &kind, facing, &to_world)?;
        let material = self.material_of(shape)?;
        self.note_unused(&format!("shape \"{kind}\""), shape);
        let Some(material) = material else { return Ok(()) };
        for id in meshes {
            let mesh = &mut self.builder.meshes[id.0 as usize];
            if mesh.uvs.is_empty() && self.builder.materials[material.0 as usize].reads_pictures() {
                shapes::give_each_triangle(mesh, BARYCENTRIC);
            }
            self.place(id, material, to_world)?;
        }
        Ok(())
    }

    fn place(&mut self, mesh: MeshId, material: MaterialId, to_world: Affine3A) -> Result<(), LoadError> {
        if let Some(parts) = &mut self.current_group {
            parts.push((mesh, material, to_world));
            self.builder.parts_of_groups += 1;
            return Ok(());
        }
        super::super::check_placed(&self.main, self.builder.placed() + 1)?;
        let name = self.builder.meshes[mesh.0 as usize].name.clone();
        self.builder.instances.push(Instance { name, mesh, material, to_world, motion: None });
        Ok(())
    }

    /// `shapegroup` defines, `instance` places.
    fn group(&mut self, shape: &Rc<Element>, kind: &str) -> Result<(), LoadError> {
        if self.current_group.is_some() {
            return Err(shape.unsupported("a group inside a group is not rendered"));
        }
        if kind == "shapegroup" { self.collect_group(shape) } else { self.place_group(shape) }
    }

    fn place_group(&mut self, instance: &Element) -> Result<(), LoadError> {
        let to_world = transform::of(instance, "toworld")?;
        let mut groups: Vec<Rc<Element>> = instance.tagged("shape").cloned().collect();
        for reference in instance.tagged("ref") {
            groups.push(self.resolve(reference)?);
        }
        if !self.since_2 {
            // Whatever else is in an instance, its group's materials are those that count.
            groups.retain(|group| group.kind() == "shapegroup");
        }
        if groups.is_empty() || groups.iter().any(|group| group.kind() != "shapegroup") {
            return Err(instance.error("an instance places a shapegroup and nothing else"));
        }
        self.note_unused("shape \"instance\"", instance);
        for group in groups {
            self.collect_group(&group)?;
            let parts = self.groups.get(&Rc::as_ptr(&group)).cloned().unwrap_or_default();
            for (mesh, material, inner) in parts {
                self.place(mesh, material, to_world * inner)?;
            }
        }
        Ok(())
    }

    /// Keeps the parts of a group, once.
    fn collect_group(&mut self, group: &Rc<Element>) -> Result<(), LoadError> {
        let key = Rc::as_ptr(group);
        if self.groups.contains_key(&key) {
            return Ok(());
        }
        self.current_group = Some(Vec::new());
        let inner: Vec<Rc<Element>> = group.tagged("shape").cloned().collect();
        self.note_unused("shape \"shapegroup\"", group);
        for shape in &inner {
            self.shape(shape)?;
        }
        let parts = self.current_group.take().unwrap_or_default();
        self.groups.insert(key, parts);
        Ok(())
    }

    fn meshes(
        &mut self,
        shape: &Element,
        kind: &str,
        facing: Facing,
        to_world: &Affine3A,
    ) -> Result<Vec<MeshId>, LoadError> {
        let mut mesh = match kind {
            "obj" | "ply" | "serialized" => return self.mesh_file(shape, kind, facing, to_world),
            "rectangle" => primitives::rectangle(),
            "cube" => primitives::cube(),
            "disk" => primitives::disk(),
            "cylinder" => {
                let from = shape.vector("p0")?.unwrap_or(Vec3::ZERO);
                let to = shape.vector("p1")?.unwrap_or(Vec3::Z);
                primitives::cylinder(from, to, positive(shape, "radius")?)
                    .ok_or_else(|| shape.error("p0 and p1 are the same point"))?
            }
            other => {
                let known = "obj, ply, serialized, rectangle, cube, sphere, disk, cylinder, shapegroup, instance are";
                return Err(shape.unsupported(format_args!("shapes of type \"{other}\" are not rendered; {known}")));
            }
        };
        turn(&mut mesh, facing);
        self.count(shape, &mesh)?;
        Ok(vec![self.builder.add_mesh(mesh)])
    }

    fn count(&mut self, shape: &Element, mesh: &Mesh) -> Result<(), LoadError> {
        self.made_vertices += mesh.positions.len();
        super::super::check_made_vertices(&shape.file, self.made_vertices)
    }

    /// Each file is read once for each way of using it.
    fn mesh_file(
        &mut self,
        shape: &Element,
        kind: &str,
        facing: Facing,
        to_world: &Affine3A,
    ) -> Result<Vec<MeshId>, LoadError> {
        let Some(name) = shape.string("filename")? else { return Err(shape.error("a mesh needs a filename")) };
        shape.ignore(&["maxsmoothangle", "srgb", "collapse"]);
        let key = MeshKey {
            file: self.file(shape, name)?,
            number: whole_number(shape, "shapeindex")?,
            faces: shape.boolean_or("facenormals", false)?,
            facing,
            flip_v: shape.boolean_or("fliptexcoords", kind == "obj")?,
            mirrored: mirrors(to_world),
        };
        if let Some(ids) = self.mesh_files.get(&key) {
            return Ok(ids.clone());
        }
        let referenced = |error: LoadError| error.referenced_from(shape.place());
        // Our readers of OBJ and PLY turn v over.
        let flip_v = key.flip_v != (kind != "serialized");
        let ids: Vec<MeshId> = match kind {
            "obj" => {
                let parts = obj::read_into(&mut self.builder, &key.file, obj::Wanted::Undivided).map_err(referenced)?;
                parts.into_iter().map(|(mesh, _)| mesh).collect()
            }
            "ply" => {
                let loaded = ply::read(&key.file).map_err(referenced)?;
                for note in loaded.notes {
                    self.builder.note(note);
                }
                vec![self.builder.add_mesh(loaded.mesh)]
            }
            _ => {
                let mesh = serialized::read(&key.file, key.number).map_err(referenced)?;
                vec![self.builder.add_mesh(mesh)]
            }
        };
        for id in &ids {
            let mesh = &mut self.builder.meshes[id.0 as usize];
            if key.faces {
                mesh.normals.clear();
            }
            // Without normals Mitsuba's front follows from where the corners end up in the world.
            let goes_by_corners = mesh.normals.is_empty();
            if goes_by_corners && !key.faces {
                smooth(mesh);
            }
            shapes::face_along_normals(mesh);
            turn(mesh, facing.turned_over_if(key.mirrored && goes_by_corners));
            if flip_v {
                primitives::flip_v(mesh);
            }
        }
        self.mesh_files.insert(key, ids.clone());
        Ok(ids)
    }

    fn sphere(&mut self, shape: &Element, to_world: &Affine3A, facing: Facing) -> Result<(), LoadError> {
        let center = shape.vector("center")?.unwrap_or(Vec3::ZERO);
        let radius = positive(shape, "radius")?;
        let material = self.material_of(shape)?;
        self.note_unused("shape \"sphere\"", shape);
        let Some(material) = material else { return Ok(()) };
        // Mitsuba turns mirrored spheres inside out; only light and volumes show it here.
        let facing = facing.turned_over_if(mirrors(to_world) && self.has_front(material));
        let placed = to_world.transform_point3(center);
        let scaled = shapes::similarity_scale(to_world).map(|scale| radius * scale);
        if scaled.is_none() {
            let place = shape.place();
            self.builder
                .note(format!("{place}: an ellipsoid, as its to_world says; Mitsuba warns and scales it by x alone."));
        }
        match scaled.filter(|radius| *radius > 0.0 && radius.is_finite() && placed.is_finite()) {
            Some(radius) if facing == Facing::AsMade && self.current_group.is_none() => {
                self.builder.spheres.push(Sphere {
                    name: "sphere".to_owned(),
                    center: placed,
                    radius,
                    axes: Sphere::axes_with_poles_on_z(to_world),
                    material,
                    motion: None,
                });
            }
            _ => {
                let mut mesh = shapes::sphere(Vec3::ZERO, radius);
                turn(&mut mesh, facing);
                self.count(shape, &mesh)?;
                let mesh = self.builder.add_mesh(mesh);
                let poles_on_z = Sphere::axes_with_poles_on_z(&Affine3A::IDENTITY);
                let place = Affine3A { matrix3: poles_on_z, translation: center.into() };
                self.place(mesh, material, *to_world * place)?;
            }
        }
        Ok(())
    }

    /// Whether it matters from which side a material is seen.
    fn has_front(&self, material: MaterialId) -> bool {
        let material = &self.builder.materials[material.0 as usize];
        material.emission.factor != Vec3::ZERO || material.surface.interior_absorption().is_some()
    }
}

fn positive(shape: &Element, name: &str) -> Result<f32, LoadError> {
    let value = shape.float_or(name, 1.0)?;
    if value > 0.0 { Ok(value) } else { Err(shape.error(format_args!("\"{name}\" must be above 0, not {value}"))) }
}

/// 0 where nothing is said.
fn whole_number(shape: &Element, name: &str) -> Result<usize, LoadError> {
    match shape.float_or(name, 0.0)? {
        number if number >= 0.0 && number.fract() == 0.0 => Ok(number as usize),
        other => Err(shape.error(format_args!("\"{name}\" must be a whole number from 0 on, not {other}"))),
    }
}

/// Whether a transform exchanges left and right.
fn mirrors(transform: &Affine3A) -> bool {
    transform.matrix3.determinant() < 0.0
}

fn turn(mesh: &mut Mesh, facing: Facing) {
    match facing {
        Facing::AsMade => {}
        Facing::TurnedOver => shapes::turn_over(mesh),
    }
}

/// Normals of vertices: the faces' around them, weighted by their angle (Thürmer and Wüthrich 1998).
fn smooth(mesh: &mut Mesh) {
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let corners = triangle.map(|index| mesh.positions[index as usize].as_dvec3());
        let face = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        for corner in 0..3 {
            let [here, next, last] = [corner, (corner + 1) % 3, (corner + 2) % 3].map(|i| corners[i]);
            let (a, b) = ((next - here).normalize_or_zero(), (last - here).normalize_or_zero());
            let angle = a.dot(b).clamp(-1.0, 1.0).acos();
            normals[triangle[corner] as usize] += (face * angle).as_vec3();
        }
    }
    mesh.normals = normals.into_iter().map(|normal| normal.normalize_or(Vec3::Y)).collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_normals_of_a_box_point_along_its_diagonals() {
        let mut mesh = Mesh {
            positions: (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect(),
            ..Mesh::default()
        };
        for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        smooth(&mut mesh);
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(normal.dot((position - 0.5).normalize()) > 0.9999, "{normal} at {position}");
        }
    }
}
