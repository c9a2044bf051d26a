//! Wavefront OBJ through `tobj`, which is strict about indices and loose about the rest: we clean the text before it
//! and check what comes out of it.
//!
//! OBJ has neither camera nor lights nor units: see the table in [`super`]. Faces without normals are flat unless they
//! are in a smoothing group ([`smoothing`]); colours of vertices are taken as sRGB, where every vertex has one.

mod clean;
mod libraries;
mod parse;
mod patterns;
mod smoothing;

use self::clean::{Cleaned, VertexColors, clean, hoist_libraries};
use self::libraries::{Libraries, UsedMaterials, report_unknown_materials};
use self::parse::parse;
use super::builder::{Builder, IfDark};
use super::error::{LoadError, Place};
use super::polygon::{self, Covering};
use super::{LoadOptions, files};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};
use glam::{Affine3A, Vec2, Vec3};
use std::cell::RefCell;
use std::path::Path;

/// Reads an OBJ file as a whole scene.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let mut builder = Builder::new(path, options);
    for (mesh, material) in read_into(&mut builder, path, Wanted::WithMaterials)? {
        let name = builder.meshes[mesh.0 as usize].name.clone();
        builder.instances.push(Instance { name, mesh, material, to_world: Affine3A::IDENTITY, motion: None });
    }
    builder.finish(path, IfDark::Studio, options)
}

/// What of an OBJ file is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// A mesh for each object, group and material, with its material.
    WithMaterials,
    /// The meshes, without opening the MTL files.
    Meshes,
    /// The meshes as Mitsuba reads them: objects, groups, materials and smoothing groups mean nothing. (Still a mesh
    /// for each pattern of faces.)
    Undivided,
}

/// Adds a file's meshes, each with its material.
pub(super) fn read_into(
    builder: &mut Builder,
    path: &Path,
    wanted: Wanted,
) -> Result<Vec<(MeshId, MaterialId)>, LoadError> {
    let with_materials = wanted == Wanted::WithMaterials;
    let Cleaned { mut text, colors, points_and_lines } = clean(&files::decode_loosely(path, files::read(path)?)?);
    if wanted == Wanted::Undivided {
        text = clean::undivided(&text);
    }
    let mut added_lines = 0;
    if let Some(smoothed) = smoothing::add_normals(&text) {
        (text, added_lines) = (smoothed.text, smoothed.added_lines);
    }
    added_lines += hoist_libraries(&mut text);
    let mut models = Vec::new();
    let libraries = RefCell::new(Libraries::default());
    for part in patterns::separate(&text) {
        models.extend(parse(path, &part, added_lines, with_materials.then_some(&libraries))?);
    }
    let libraries = libraries.into_inner();
    for note in libraries.notes() {
        builder.note(note);
    }
    if with_materials {
        report_unknown_materials(builder, path, &text, added_lines, &libraries.materials);
    }

    let not_finite = |model: &tobj::Model, bad: BadVertex| {
        let place = match line_of_vertex(&text, bad.position) {
            Some(line) => Place::line(path, line.saturating_sub(added_lines)),
            None => Place::file(path),
        };
        LoadError::invalid_at(place, format!("a vertex of \"{}\" is not finite: {}", model.name, bad.position))
    };
    let mut materials = UsedMaterials::new(&libraries);
    let mut placed = Vec::new();
    let mut sparse_faces = points_and_lines;
    let mut rough_fans = 0;
    for model in &models {
        let Converted { mesh, skipped, rough_fans: fans } =
            convert_mesh(model, path).map_err(|bad| not_finite(model, bad))?;
        sparse_faces += skipped;
        rough_fans += fans;
        if !mesh.triangles.is_empty() {
            let material = materials.of(model, builder);
            placed.push((builder.add_mesh(mesh), material));
        }
    }
    note_leftovers(builder, path, sparse_faces, colors);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    polygon::note_of_rough_fans(&name, rough_fans).into_iter().for_each(|note| builder.note(note));
    if placed.is_empty() {
        return Err(LoadError::invalid(path, "nothing to render: no face with three corners"));
    }
    Ok(placed)
}

/// Notes what a file holds and the scene does not.
fn note_leftovers(builder: &mut Builder, path: &Path, sparse_faces: usize, colors: VertexColors) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if sparse_faces > 0 {
        builder.note(format!("{name}: {sparse_faces} points and lines are not rendered."));
    }
    match colors {
        VertexColors::None => {}
        VertexColors::All => builder.note(format!("{name}: the colours of its vertices are taken as sRGB.")),
        VertexColors::Some => builder.note(format!("{name}: only some vertices have colours; none is used.")),
    }
}

/// A vertex that is not finite.
struct BadVertex {
    position: Vec3,
}

/// The first line that gives a vertex this position, which is not finite.
fn line_of_vertex(text: &str, position: Vec3) -> Option<usize> {
    let is_same =
        |(own, written): (f32, &str)| written.parse().is_ok_and(|written: f32| own.total_cmp(&written).is_eq());
    let is_it = |line: &str| {
        let words = line.strip_prefix("v ").map(str::split_whitespace);
        words.is_some_and(|words| position.to_array().into_iter().zip(words).all(is_same))
    };
    text.lines().position(is_it).map(|place| place + 1)
}

/// Our mesh of a model.
struct Converted {
    mesh: Mesh,
    /// Faces of fewer than three corners.
    skipped: usize,
    /// Faces that are [`Covering::RoughFan`].
    rough_fans: usize,
}

fn convert_mesh(model: &tobj::Model, path: &Path) -> Result<Converted, BadVertex> {
    let from = &model.mesh;
    let positions: Vec<Vec3> = from.positions.as_chunks::<3>().0.iter().copied().map(Vec3::from_array).collect();
    if let Some(&position) = positions.iter().find(|position| !position.is_finite()) {
        return Err(BadVertex { position });
    }
    // The same for all faces (`patterns`), so that there is one a position or none.
    let of_all = |values: &[f32], width: usize| values.len() == positions.len() * width;
    let normals = if of_all(&from.normals, 3) {
        from.normals.as_chunks::<3>().0.iter().copied().map(Vec3::from_array).collect()
    } else {
        Vec::new()
    };
    let uvs = if of_all(&from.texcoords, 2) {
        from.texcoords.as_chunks::<2>().0.iter().map(|&[u, v]| Vec2::new(u, 1.0 - v)).collect()
    } else {
        Vec::new()
    };
    let colors = if of_all(&from.vertex_color, 3) {
        let linear = |srgb: &f32| fechner_perception::eotf::srgb_to_linear(srgb.clamp(0.0, 1.0));
        from.vertex_color.as_chunks::<3>().0.iter().map(|rgb| Vec3::from_array(rgb.each_ref().map(linear))).collect()
    } else {
        Vec::new()
    };
    let mut triangles = Vec::new();
    let (mut skipped, mut rough_fans) = (0, 0);
    if from.face_arities.is_empty() {
        triangles.extend_from_slice(from.indices.as_chunks::<3>().0);
    } else {
        let mut rest = from.indices.as_slice();
        for &arity in &from.face_arities {
            let Some((face, behind)) = rest.split_at_checked(arity as usize) else {
                break;
            };
            rest = behind;
            if face.len() < 3 {
                skipped += 1;
            } else if face.iter().all(|&index| (index as usize) < positions.len()) {
                let covering = polygon::triangulate(&positions, face, &mut triangles);
                rough_fans += usize::from(covering == Covering::RoughFan);
            }
        }
    }
    triangles.retain(|triangle| triangle.iter().all(|&index| (index as usize) < positions.len()));
    let name = if model.name.is_empty() || model.name == "unnamed_object" {
        path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    } else {
        model.name.clone()
    };
    let mesh = Mesh { name, positions, normals, uvs, colors, triangles, ..Mesh::default() };
    Ok(Converted { mesh, skipped, rough_fans })
}
