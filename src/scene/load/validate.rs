//! The promises that every loader keeps towards the renderer, made true in one place.
//!
//! Indices in range, positions finite, normals unit or absent, texture coordinates finite, transforms invertible, names
//! of materials and textures known, at least one thing to render.

use super::builder::Builder;
use super::error::LoadError;
use super::shapes;
use crate::scene::{Alpha, Instance, Mesh, MeshId, Scene, Surface};
use glam::{Affine3A, Vec2, Vec3};
use std::path::Path;

/// Mends what can be mended with a note; what cannot is an error.
pub(super) fn repair(builder: &mut Builder, path: &Path) -> Result<(), LoadError> {
    for index in 0..builder.meshes.len() {
        let mesh = &mut builder.meshes[index];
        let vertices = mesh.positions.len();
        if let Some(triangle) = mesh.triangles.iter().flatten().find(|&&vertex| vertex as usize >= vertices) {
            let problem = format!("\"{}\" has {vertices} vertices, but a triangle uses number {triangle}", mesh.name);
            return Err(LoadError::invalid(path, problem));
        }
        if let Some(vertex) = repair_unused_positions(mesh) {
            let problem = format!("vertex {vertex} of \"{}\" is not finite: {}", mesh.name, mesh.positions[vertex]);
            return Err(LoadError::invalid(path, problem));
        }
        // Triangles of a mesh that deforms have an area at other times: there their numbers are to be the same.
        let degenerate = if builder.deforming.contains(&MeshId(index as u32)) { 0 } else { drop_degenerate(mesh) };
        let changed_normals = repair_attributes(mesh);
        let name = mesh.name.clone();
        if degenerate > 0 {
            let rest = mesh.triangles.len();
            builder.note(format!("\"{name}\": {degenerate} triangles without area left out, {rest} remain."));
        }
        if changed_normals {
            builder
                .note(format!("\"{name}\": some normals had no length or were not finite; the faces' own are used."));
        }
    }
    hide_unseen(builder);
    let is_empty = builder.spheres.is_empty() && !builder.instances.iter().any(|i| has_triangles(builder, i));
    // What is hidden now is there at other times.
    if is_empty && builder.at_another_time.is_some() && !builder.instances.is_empty() {
        return Ok(());
    }
    if is_empty {
        let why = reasons(&builder.notes);
        return Err(LoadError::invalid(path, format_args!("nothing to render: no triangle and no sphere{why}")));
    }
    check_extent(builder, path)
}

/// The first notes of a scene in which nothing is left, in brackets.
fn reasons(notes: &[String]) -> String {
    const MOST: usize = 3;
    if notes.is_empty() {
        return String::new();
    }
    let mut told: Vec<String> = notes.iter().take(MOST).map(|note| note.trim_end_matches('.').to_owned()).collect();
    if notes.len() > MOST {
        told.push(format!("and {} more", notes.len() - MOST));
    }
    format!(" ({})", told.join("; "))
}

fn has_triangles(builder: &Builder, instance: &Instance) -> bool {
    !builder.meshes[instance.mesh.0 as usize].triangles.is_empty()
}

/// Takes out of the scene what no ray can meet. What a transform flattens keeps its place, with a mesh of nothing: at
/// other times it may be there (glTF's way to hide a thing is a scale of 0), and whatever comes after it is to have one
/// number all through a shot.
fn hide_unseen(builder: &mut Builder) {
    let mut notes = Vec::new();
    let meshes = &builder.meshes;
    builder.instances.retain(|instance| {
        let has_triangles = !meshes[instance.mesh.0 as usize].triangles.is_empty();
        if !has_triangles {
            notes.push(format!("\"{}\" has no triangles and is left out.", instance.name));
        }
        has_triangles
    });
    let nothing = MeshId(builder.meshes.len() as u32);
    for instance in builder.instances.iter_mut().filter(|instance| !is_invertible(&instance.to_world)) {
        notes.push(format!("\"{}\" is left out: its transform flattens it or is not finite.", instance.name));
        *instance = Instance { mesh: nothing, to_world: Affine3A::IDENTITY, motion: None, ..instance.clone() };
    }
    if builder.instances.iter().any(|instance| instance.mesh == nothing) {
        builder.add_mesh(Mesh { name: "nothing".to_owned(), ..Mesh::default() });
    }
    for note in notes {
        builder.note(note);
    }
}

/// Makes positions finite that no triangle uses; returns the first one that is not and is used.
fn repair_unused_positions(mesh: &mut Mesh) -> Option<usize> {
    if mesh.positions.iter().all(|position| position.is_finite()) {
        return None;
    }
    let bad = |vertex: &u32| !mesh.positions[*vertex as usize].is_finite();
    if let Some(first) = mesh.triangles.iter().flatten().copied().filter(bad).min() {
        return Some(first as usize);
    }
    let used = mesh.triangles.first().map_or(Vec3::ZERO, |triangle| mesh.positions[triangle[0] as usize]);
    mesh.positions.iter_mut().filter(|position| !position.is_finite()).for_each(|position| *position = used);
    None
}

/// World coordinates whose squares still fit a float: everything downstream multiplies lengths.
fn check_extent(builder: &Builder, path: &Path) -> Result<(), LoadError> {
    const LARGEST: f32 = 1e15;
    let bounds = super::default_view::bounds(&builder.meshes, &builder.instances, &builder.spheres);
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    // Written so that NaN fails too.
    if largest <= LARGEST {
        return Ok(());
    }
    Err(LoadError::invalid(path, format_args!("coordinates reach {largest:e}; at most {LARGEST:e} can be rendered")))
}

/// Removes triangles whose corners coincide or lie on a line; returns how many.
fn drop_degenerate(mesh: &mut Mesh) -> usize {
    let before = mesh.triangles.len();
    let Mesh { positions, triangles, .. } = mesh;
    triangles.retain(|triangle| shapes::has_area(positions, triangle));
    before - triangles.len()
}

/// Unit normals, finite coordinates, tangents that fit; returns whether normals had to be replaced.
fn repair_attributes(mesh: &mut Mesh) -> bool {
    let vertices = mesh.positions.len();
    if mesh.normals.len() != vertices {
        mesh.normals.clear();
    }
    if mesh.uvs.len() != vertices {
        mesh.uvs.clear();
    }
    if mesh.colors.len() != vertices {
        mesh.colors.clear();
    }
    for color in &mut mesh.colors {
        *color = if color.is_finite() { color.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ONE };
    }
    for uv in &mut mesh.uvs {
        if !uv.is_finite() {
            *uv = Vec2::ZERO;
        }
    }
    let good_tangent = |tangent: &glam::Vec4| tangent.is_finite() && tangent.truncate().length_squared() > 1e-12;
    if mesh.tangents.len() != vertices || !mesh.tangents.iter().all(good_tangent) {
        mesh.tangents.clear();
    }
    let mut bad = Vec::new();
    for (index, normal) in mesh.normals.iter_mut().enumerate() {
        match normal.try_normalize() {
            Some(unit) => *normal = unit,
            None => bad.push(index),
        }
    }
    if bad.is_empty() {
        return false;
    }
    let mut of_faces = vec![Vec3::ZERO; vertices];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize].as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        triangle.iter().for_each(|&index| of_faces[index as usize] += normal);
    }
    let used: std::collections::HashSet<u32> = mesh.triangles.iter().flatten().copied().collect();
    let mut reported = false;
    for index in bad {
        mesh.normals[index] = of_faces[index].try_normalize().unwrap_or(Vec3::Y);
        reported |= used.contains(&(index as u32));
    }
    reported
}

/// Whether the transform is finite and can be undone.
fn is_invertible(transform: &Affine3A) -> bool {
    if !transform.is_finite() {
        return false;
    }
    let inverse = transform.inverse();
    transform.matrix3.determinant() != 0.0 && inverse.is_finite() && inverse.matrix3.determinant() != 0.0
}

/// Proves what `repair` and the loaders promised; a failure here is a loader's mistake and is still no panic.
pub(super) fn check(scene: &Scene, path: &Path) -> Result<(), LoadError> {
    let broken = |what: &str| Err(LoadError::invalid(path, format_args!("{what} is out of range")));
    let in_range = |index: u32, len: usize| (index as usize) < len;
    for instance in &scene.instances {
        if !in_range(instance.mesh.0, scene.meshes.len()) || !in_range(instance.material.0, scene.materials.len()) {
            return broken("a mesh or material");
        }
    }
    if scene.spheres.iter().any(|sphere| !in_range(sphere.material.0, scene.materials.len())) {
        return broken("a sphere's material");
    }
    for material in &scene.materials {
        let components = material.surface.components();
        if components > Surface::MAX_COMPONENTS {
            let most = Surface::MAX_COMPONENTS;
            let problem =
                format!("material \"{}\" mixes {components} models; at most {most} are possible", material.name);
            return Err(LoadError::invalid(path, problem));
        }
        if textures_of(&material.surface)
            .into_iter()
            .chain([material.emission.texture.map(|lookup| lookup.texture.0)])
            .chain(material.reliefs().map(|relief| relief.texture().map(|lookup| lookup.texture.0)))
            .chain([material.stretch.and_then(|stretch| stretch.map.map(|lookup| lookup.texture.0))])
            .chain([match material.alpha {
                Alpha::Opaque | Alpha::Unseen => None,
                Alpha::Mask { value, .. } | Alpha::Blend { value } => value.texture.map(|(lookup, _)| lookup.texture.0),
            }])
            .flatten()
            .any(|texture| !in_range(texture, scene.textures.len()))
        {
            return broken("a material's texture");
        }
    }
    Ok(())
}

fn textures_of(surface: &Surface) -> Vec<Option<u32>> {
    let colors = surface.colors().into_iter().map(|input| input.texture.map(|lookup| lookup.texture.0));
    let scalars = surface.scalars().into_iter().map(|input| input.texture.map(|(lookup, _)| lookup.texture.0));
    colors.chain(scalars).collect()
}
