//! Wavefront OBJ through `tobj`, which is strict about indices and loose about the rest: we clean the text before it and
//! check what comes out of it.
//!
//! OBJ has neither camera nor lights nor units: see the table in [`super`]. Faces without normals are flat unless they are
//! in a smoothing group ([`smoothing`]); colours of vertices are taken as sRGB, where every vertex has one.

mod clean;
mod patterns;
mod smoothing;

use self::clean::{Cleaned, VertexColors, clean, hoist_libraries};
use super::builder::{Builder, IfDark};
use super::error::{LoadError, Place, nearest};
use super::{LoadOptions, files, mtl, polygon};
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};
use glam::{Affine3A, Vec2, Vec3};
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::io::{BufRead, Read};
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
    /// The same without opening its MTL files.
    Meshes,
    /// As Mitsuba reads it: objects, groups, materials and smoothing groups mean nothing. (Still a mesh for each pattern of faces.)
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
    let mut materials = UsedMaterials { written: &libraries.materials, converted: HashMap::new() };
    let mut placed = Vec::new();
    let mut sparse_faces = points_and_lines;
    for model in &models {
        let (mesh, skipped) = convert_mesh(model, path).map_err(|bad| not_finite(model, bad))?;
        sparse_faces += skipped;
        if !mesh.triangles.is_empty() {
            let material = materials.of(model, builder);
            placed.push((builder.add_mesh(mesh), material));
        }
    }
    note_leftovers(builder, path, sparse_faces, colors);
    if placed.is_empty() {
        return Err(LoadError::invalid(path, "nothing to render: no face with three corners"));
    }
    Ok(placed)
}

/// Materials are converted when a face uses them: libraries are often shared by many files.
struct UsedMaterials<'a> {
    written: &'a [mtl::Written],
    converted: HashMap<Option<usize>, MaterialId>,
}

impl UsedMaterials<'_> {
    fn of(&mut self, model: &tobj::Model, builder: &mut Builder) -> MaterialId {
        let wanted = model.mesh.material_id.filter(|&id| id < self.written.len());
        *self.converted.entry(wanted).or_insert_with(|| match wanted {
            Some(index) => {
                let material = self.written[index].convert(builder);
                builder.add_material(material)
            }
            None => mtl::default_material(builder),
        })
    }
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

/// The objects of a text; the materials that it names are added to the libraries, if there are any.
fn parse(
    path: &Path,
    text: &str,
    added_lines: usize,
    libraries: Option<&RefCell<Libraries>>,
) -> Result<Vec<tobj::Model>, LoadError> {
    let mut reader = CountingReader { rest: text.as_bytes(), lines: 0 };
    let options = tobj::LoadOptions { single_index: true, triangulate: false, ..tobj::LoadOptions::default() };
    let statements = Cell::new(0);
    let parsed = tobj::load_obj_buf(&mut reader, &options, |named| {
        let Some(libraries) = libraries else { return Ok(Default::default()) };
        libraries.borrow_mut().of_statement(statements.replace(statements.get() + 1), path, &named.to_string_lossy())
    });
    let line = reader.lines.saturating_sub(added_lines);
    let (models, _) = parsed.map_err(|error| explain(error, text, path, line, added_lines))?;
    match libraries.and_then(|libraries| libraries.borrow_mut().error.take()) {
        Some(error) => Err(error),
        None => Ok(models),
    }
}

/// The MTL files that an OBJ file names.
#[derive(Default)]
struct Libraries {
    materials: Vec<mtl::Written>,
    /// How many materials there are after each of the `mtllib` statements that were read.
    ends: Vec<usize>,
    notes: Vec<String>,
    /// Those that are not there, as they are named.
    missing: Vec<String>,
    error: Option<LoadError>,
}

impl Libraries {
    /// What is to be said of them. Where others are there, materials that none of them has are named one by one.
    fn notes(&self) -> impl Iterator<Item = String> {
        let instead = if self.materials.is_empty() { ": a plain grey stands in" } else { "" };
        let missing = self.missing.iter().map(move |name| format!("Material file \"{name}\" not found{instead}."));
        missing.chain(self.notes.iter().cloned())
    }

    /// `mtllib` names one file that may hold spaces, or several files apart by spaces.
    fn open(&mut self, obj: &Path, named: &str) {
        let folder = obj.parent().unwrap_or(Path::new(""));
        // A backslash before a space keeps it in the name; any other one is a separator of folders.
        const KEPT_SPACE: &str = "\u{0}";
        let kept = named.trim().trim_matches('"').replace("\\ ", KEPT_SPACE).replace('\\', "/");
        let name = |text: &str| text.replace(KEPT_SPACE, " ");
        let whole = name(&kept);
        let single = mtl::find_file(folder, &whole);
        let found: Vec<_> = if single.is_file() {
            vec![single]
        } else {
            kept.split_whitespace().map(|word| mtl::find_file(folder, &name(word))).filter(|f| f.is_file()).collect()
        };
        if found.is_empty() {
            self.missing.push(whole);
        }
        for file in found {
            match mtl::read(&file, &mut self.notes) {
                Ok(materials) => self.materials.extend(materials),
                Err(error) => self.error = Some(error),
            }
        }
    }

    /// What `tobj` wants to know of the materials of an `mtllib` statement: their names. It counts on from what it has. Its files are
    /// read when the first part of the text names them.
    fn of_statement(&mut self, number: usize, obj: &Path, named: &str) -> tobj::MTLLoadResult {
        if number == self.ends.len() {
            self.open(obj, named);
            self.ends.push(self.materials.len());
        }
        let first = if number == 0 { 0 } else { self.ends[number - 1] };
        let new = &self.materials[first..self.ends[number]];
        let places = new.iter().enumerate().map(|(place, material)| (material.name.clone(), place)).collect();
        Ok((vec![tobj::Material::default(); new.len()], places))
    }
}

/// Hands out text and counts the lines, because `tobj`'s errors have none.
struct CountingReader<'a> {
    rest: &'a [u8],
    lines: usize,
}

impl Read for CountingReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&self.rest[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for CountingReader<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.rest)
    }

    fn consume(&mut self, count: usize) {
        self.lines += self.rest[..count].iter().filter(|&&byte| byte == b'\n').count();
        self.rest = &self.rest[count..];
    }
}

/// Our error for one of `tobj`'s; `line` is the last line that it has read.
fn explain(error: tobj::LoadError, text: &str, path: &Path, line: usize, added_lines: usize) -> LoadError {
    use tobj::LoadError as Cause;
    let find_bad_index =
        |text: &str| find_bad_index(text).map(|(line, problem)| (line.saturating_sub(added_lines), problem));
    let (line, problem) = match error {
        Cause::FaceVertexOutOfBounds | Cause::FaceTexCoordOutOfBounds | Cause::FaceNormalOutOfBounds => {
            // These are only noticed when the object ends: find the face.
            match find_bad_index(text) {
                Some((line, problem)) => (line, problem),
                None => (line, error.to_string()),
            }
        }
        Cause::PositionParseError => (line, "expected \"v x y z\" with three numbers".to_owned()),
        Cause::NormalParseError => (line, "expected \"vn x y z\" with three numbers".to_owned()),
        Cause::TexcoordParseError => (line, "expected \"vt u v\" with two numbers".to_owned()),
        Cause::FaceParseError => match find_bad_index(text) {
            Some((line, problem)) => (line, problem),
            None => (line, "expected a face as \"f v/vt/vn ...\", indices counted from 1".to_owned()),
        },
        Cause::InvalidPolygon => (line, "expected a face with at least three corners".to_owned()),
        other => (line, other.to_string()),
    };
    LoadError::invalid_at(Place::line(path, line.max(1)), problem)
}

/// The first face whose index names nothing, and how.
fn find_bad_index(text: &str) -> Option<(usize, String)> {
    let kind_of = |line: &str| match line.split_whitespace().next() {
        Some("v") => Some(0),
        Some("vt") => Some(1),
        Some("vn") => Some(2),
        _ => None,
    };
    let mut totals = [0_i64; 3];
    text.lines().filter_map(kind_of).for_each(|kind| totals[kind] += 1);
    let mut so_far = [0_i64; 3];
    for (number, line) in text.lines().enumerate() {
        if let Some(kind) = kind_of(line) {
            so_far[kind] += 1;
        }
        let Some(corners) = line.strip_prefix("f ") else {
            continue;
        };
        for corner in corners.split_whitespace() {
            for (kind, index) in corner.split('/').enumerate().take(3).filter(|(_, index)| !index.is_empty()) {
                let what = ["vertices", "texture coordinates", "normals"][kind];
                let Ok(value) = index.parse::<i64>() else {
                    return Some((number + 1, format!("\"{corner}\" is not a corner like v/vt/vn")));
                };
                if value == 0 || value > totals[kind] || value < -so_far[kind] {
                    return Some((number + 1, format!("face index {value}, but the file has {} {what}", totals[kind])));
                }
            }
        }
    }
    None
}

/// Notes `usemtl` names that no library has, with the nearest that one has.
fn report_unknown_materials(
    builder: &mut Builder,
    path: &Path,
    text: &str,
    added_lines: usize,
    known: &[mtl::Written],
) {
    if known.is_empty() {
        return;
    }
    // What a file of thousands needs to be told is that its library is another one's.
    const MOST_NAMED: usize = 10;
    let names = || known.iter().map(|material| material.name.as_str());
    let is_known: HashSet<&str> = names().collect();
    let (mut named, mut others) = (Vec::new(), HashSet::new());
    for (number, line) in text.lines().skip(added_lines).enumerate() {
        let Some(name) = line.strip_prefix("usemtl ").map(str::trim) else {
            continue;
        };
        if is_known.contains(name) {
            continue;
        }
        if named.len() < MOST_NAMED && !named.contains(&name) {
            named.push(name);
        }
        if named.contains(&name) {
            let place = Place::line(path, number + 1);
            let guess = nearest(name, names()).map(|guess| format!(" (nearest: \"{guess}\")")).unwrap_or_default();
            builder.note(format!("{place}: unknown material \"{name}\"{guess}: a plain grey stands in."));
        } else {
            others.insert(name);
        }
    }
    if !others.is_empty() {
        builder.note(format!("{}: {} more unknown materials: a plain grey stands in.", path.display(), others.len()));
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

/// Our mesh, and how many faces of fewer than three corners were skipped.
fn convert_mesh(model: &tobj::Model, path: &Path) -> Result<(Mesh, usize), BadVertex> {
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
    let mut skipped = 0;
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
                polygon::triangulate(&positions, face, &mut triangles);
            }
        }
    }
    triangles.retain(|triangle| triangle.iter().all(|&index| (index as usize) < positions.len()));
    let name = if model.name.is_empty() || model.name == "unnamed_object" {
        path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    } else {
        model.name.clone()
    };
    Ok((Mesh { name, positions, normals, uvs, colors, triangles, ..Mesh::default() }, skipped))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_index_is_found_with_its_line() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 7\n";
        assert_eq!(find_bad_index(text), Some((5, "face index 7, but the file has 3 vertices".to_owned())));
        assert_eq!(find_bad_index("v 0 0 0\nf -1 -1 -2\n").unwrap().0, 2);
        assert_eq!(find_bad_index("v 0 0 0\nf 1 1 0\n").unwrap().0, 2);
    }
}
