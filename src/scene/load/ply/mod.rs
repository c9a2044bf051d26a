//! Stanford PLY meshes: ASCII and binary of both byte orders, plain or under gzip.
//!
//! Vertices (`x y z`, `nx ny nz`, `u v` or `s t` and their longer names), faces and `tristrips` (`vertex_indices`) are
//! read, everything else is skipped and named. Written by ourselves: a million triangles load in little more than
//! reading their bytes takes (benches/results/loading.md), and every count is checked against the bytes that are there
//! before memory is taken for it.

mod body;
mod header;
mod strips;

use super::error::LoadError;
use super::files;
use super::polygon::{self, Covering};
use crate::scene::Mesh;
use body::Values;
use glam::{Vec2, Vec3};
use header::{Element, Property};
use std::path::Path;

/// A mesh, and what of the file was not used.
pub(super) struct Loaded {
    pub(super) mesh: Mesh,
    pub(super) notes: Vec<String>,
}

/// Reads a file. Its v is taken to run up the image, as pbrt and Mitsuba have it; ours runs down.
pub(super) fn read(path: &Path) -> Result<Loaded, LoadError> {
    let bytes = files::read_unpacked(path)?;
    let header = header::parse(path, &bytes)?;
    let mut values = Values::new(path, &bytes, &header);
    let mut mesh =
        Mesh { name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), ..Mesh::default() };
    let mut notes = Vec::new();
    let mut unused: Vec<&str> = Vec::new();
    let mut polygons = Polygons::default();
    for element in &header.elements {
        values.check_count(element)?;
        match element.name.as_str() {
            "vertex" => unused.extend(read_vertices(&mut values, element, &mut mesh)?),
            "face" => unused.extend(read_faces(&mut values, element, &mut polygons)?),
            "tristrips" => unused.extend(strips::read(&mut values, element, &mut polygons)?),
            other => {
                unused.push(other);
                values.skip(element)?;
            }
        }
    }
    let Mesh { positions, triangles, .. } = &mut mesh;
    let vertices = positions.len();
    if let Some(index) = polygons.indices.iter().find(|&&index| index as usize >= vertices) {
        return Err(LoadError::invalid(path, format_args!("a face uses vertex {index}, but there are {vertices}")));
    }
    let rough_fans = polygons.triangulate(positions, triangles);
    if triangles.is_empty() {
        return Err(LoadError::invalid(path, "nothing to render: no face with three corners"));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    notes.extend(polygon::note_of_rough_fans(&name, rough_fans));
    if !unused.is_empty() {
        notes.push(format!("{name}: not used: {}.", unused.join(", ")));
    }
    Ok(Loaded { mesh, notes })
}

/// Faces as they stand in the file.
#[derive(Default)]
struct Polygons {
    /// Corners of each face.
    sizes: Vec<u32>,
    indices: Vec<u32>,
    /// Whether a face so far is no triangle.
    has_other_polygons: bool,
}

impl Polygons {
    /// Adds the triangles of all faces; how many of these are [`Covering::RoughFan`].
    fn triangulate(&self, positions: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> usize {
        if !self.has_other_polygons {
            triangles.extend_from_slice(self.indices.as_chunks::<3>().0);
            return 0;
        }
        let mut rough_fans = 0;
        let mut rest = self.indices.as_slice();
        for &size in &self.sizes {
            let Some((face, behind)) = rest.split_at_checked(size as usize) else { break };
            rest = behind;
            if size >= 3 {
                let covering = polygon::triangulate(positions, face, triangles);
                rough_fans += usize::from(covering == Covering::RoughFan);
            }
        }
        rough_fans
    }
}

/// Where a vertex property goes.
fn slot(name: &str) -> Option<usize> {
    Some(match name {
        "x" => 0,
        "y" => 1,
        "z" => 2,
        "nx" => 3,
        "ny" => 4,
        "nz" => 5,
        "u" | "s" | "texture_u" | "texture_s" => 6,
        "v" | "t" | "texture_v" | "texture_t" => 7,
        _ => return None,
    })
}

/// Fills positions, normals and coordinates; returns the names of what is not used.
fn read_vertices<'h>(values: &mut Values, element: &'h Element, mesh: &mut Mesh) -> Result<Vec<&'h str>, LoadError> {
    let mut unused = Vec::new();
    let mut slots = Vec::new();
    for property in &element.properties {
        let found = if property.list.is_none() { slot(&property.name) } else { None };
        if found.is_none() {
            unused.push(property.name.as_str());
        }
        slots.push(found);
    }
    let has = |places: std::ops::Range<usize>| places.clone().all(|place| slots.contains(&Some(place)));
    if !has(0..3) {
        return Err(values.error("its vertices have no x, y and z"));
    }
    let (has_normals, has_uvs) = (has(3..6), has(6..8));
    mesh.positions.reserve_exact(element.count);
    if has_normals {
        mesh.normals.reserve_exact(element.count);
    }
    if has_uvs {
        mesh.uvs.reserve_exact(element.count);
    }
    values.rows(element, &slots, |v: &[f32; 8]| {
        mesh.positions.push(Vec3::new(v[0], v[1], v[2]));
        if has_normals {
            mesh.normals.push(Vec3::new(v[3], v[4], v[5]));
        }
        if has_uvs {
            mesh.uvs.push(Vec2::new(v[6], 1.0 - v[7]));
        }
    })?;
    Ok(unused)
}

/// Whether a property of faces or strips lists their corners.
fn is_corners(property: &Property) -> bool {
    property.list.is_some() && ["vertex_indices", "vertex_index"].contains(&property.name.as_str())
}

/// The names of what is not used of faces or strips, which must have corners.
fn all_but_corners<'h>(values: &Values, element: &'h Element) -> Result<Vec<&'h str>, LoadError> {
    if !element.properties.iter().any(is_corners) {
        return Err(values.error(format_args!("its \"{}\" has no list \"vertex_indices\"", element.name)));
    }
    Ok(element.properties.iter().filter(|property| !is_corners(property)).map(|p| p.name.as_str()).collect())
}

fn read_faces<'h>(
    values: &mut Values,
    element: &'h Element,
    polygons: &mut Polygons,
) -> Result<Vec<&'h str>, LoadError> {
    let unused = all_but_corners(values, element)?;
    polygons.sizes.reserve_exact(element.count);
    polygons.indices.reserve_exact(element.count.saturating_mul(3).min(values.bytes_left()));
    for _ in 0..element.count {
        for property in &element.properties {
            let Some(count_kind) = property.list else {
                values.number(property.kind)?;
                continue;
            };
            if !is_corners(property) {
                values.skip_list(count_kind, property.kind)?;
                continue;
            }
            let size = values.list(count_kind, property.kind, &mut polygons.indices)?;
            polygons.has_other_polygons |= size != 3;
            polygons.sizes.push(size);
        }
    }
    Ok(unused)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat FORMAT 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty float u\nproperty float v\nproperty uchar red\n\
        element face 2\nproperty list uchar int vertex_indices\nend_header\n";

    fn load(bytes: &[u8]) -> Result<Loaded, LoadError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        std::fs::write(&path, bytes).unwrap();
        read(&path)
    }

    fn ascii() -> Vec<u8> {
        let body = "0 0 0 0 0 9\n1 0 0 1 0 9\n1 1 0 1 1 9\n0 1 0 0 1 9\n3 0 1 2\n3 0 2 3\n";
        (HEADER.replace("FORMAT", "ascii") + body).into_bytes()
    }

    fn binary(big: bool) -> Vec<u8> {
        let mut bytes =
            HEADER.replace("FORMAT", if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |value: [u8; 4]| {
            bytes.extend(if big { value.into_iter().rev().collect::<Vec<_>>() } else { value.to_vec() });
        };
        for [x, y] in [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            [x, y, 0.0, x, y].iter().for_each(|v| put(v.to_le_bytes()));
            put([9, 9, 9, 9]);
        }
        // The colour is one byte: take three of the four out again.
        let start = bytes.len() - 4 * 24;
        let vertices: Vec<u8> = bytes[start..].chunks(24).flat_map(|row| row[..21].to_vec()).collect();
        bytes.truncate(start);
        bytes.extend(vertices);
        for face in [[0_i32, 1, 2], [0, 2, 3]] {
            bytes.push(3);
            for index in face {
                bytes.extend(if big { index.to_be_bytes() } else { index.to_le_bytes() });
            }
        }
        bytes
    }

    #[test]
    fn all_encodings_give_the_same_mesh() {
        let text = load(&ascii()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(text.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(text.mesh.uvs[2], Vec2::new(1.0, 0.0));
        assert_eq!(text.notes, ["mesh.ply: not used: red."]);
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut packed, &ascii()).unwrap();
        for bytes in [binary(false), binary(true), packed.finish().unwrap()] {
            let other = load(&bytes).unwrap_or_else(|e| panic!("{e}")).mesh;
            assert_eq!((&other.positions, &other.triangles), (&text.mesh.positions, &text.mesh.triangles));
            assert_eq!(other.uvs, text.mesh.uvs);
        }
    }

    #[test]
    fn indices_below_0_are_told_as_they_stand() {
        let text = String::from_utf8(ascii()).unwrap().replace("3 0 2 3", "3 0 2 -1").into_bytes();
        let [little, big] = [false, true].map(|big| {
            let mut bytes = binary(big);
            let last = bytes.len() - 4;
            bytes[last..].fill(0xff);
            bytes
        });
        for bytes in [text, little, big] {
            let error = load(&bytes).map(|_| ()).expect_err("no index").to_string();
            assert!(error.contains("-1 is not a vertex index"), "{error}");
        }
    }

    #[test]
    fn strips_are_triangles() {
        let text = String::from_utf8(ascii())
            .unwrap()
            .replace("face 2", "tristrips 1")
            .replace("3 0 1 2\n3 0 2 3\n", "8 0 1 2 3 -1 3 1 0\n");
        let text = text.replace("list uchar int", "list int int");
        assert_eq!(
            load(text.as_bytes()).unwrap_or_else(|e| panic!("{e}")).mesh.triangles,
            [[0, 1, 2], [2, 1, 3], [3, 1, 0]]
        );
        let other = text
            .replace("int vertex_indices", "int vertex_index\nproperty uchar group")
            .replace("8 0 1 2 3 -1 3 1 0\n", "8 0 1 2 3 -1 3 1 0 7\n");
        let other = load(other.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(other.mesh.triangles.len(), 3);
        assert_eq!(other.notes, ["mesh.ply: not used: red, group."]);
    }

    #[test]
    fn every_cut_and_large_counts_end_in_one_line() {
        for bytes in [ascii(), binary(false)] {
            for length in 0..bytes.len() - 3 {
                if let Err(error) = load(&bytes[..length]) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
        let text = String::from_utf8(ascii()).unwrap();
        for (from, to) in [("vertex 4", "vertex 4000000000"), ("face 2", "face 9999999999"), ("3 0 2 3", "900 0 2 3")] {
            let error = load(text.replace(from, to).as_bytes()).err().expect(to).to_string();
            assert!(error.contains("mesh.ply"), "{error}");
        }
        let error = load(text.replace("3 0 2 3", "3 0 2 7").as_bytes()).err().unwrap().to_string();
        assert!(error.ends_with("a face uses vertex 7, but there are 4"), "{error}");
    }
}
