//! Mitsuba's `.serialized` meshes: several zlib streams behind one another, their places listed at the end.

use super::super::error::LoadError;
use super::super::files;
use crate::scene::Mesh;
use glam::{Vec2, Vec3};
use std::path::Path;

/// First two bytes of every stream's header.
const MAGIC: u16 = 0x041C;

/// Flags of a mesh.
const HAS_NORMALS: u32 = 0x0001;
const HAS_TEXTURE_COORDINATES: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const DOUBLE_PRECISION: u32 = 0x2000;

/// Reads the mesh of this number.
pub(super) fn read(path: &Path, number: usize) -> Result<Mesh, LoadError> {
    let bytes = files::read(path)?;
    let invalid = |problem: &str| LoadError::invalid(path, problem);
    let cut = || invalid("the file is cut off");
    let half = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    if half(0) != Some(MAGIC) {
        return Err(invalid("not a serialized mesh: its first bytes are not 1C 04"));
    }
    let version = half(2).ok_or_else(cut)?;
    if version != 3 && version != 4 {
        return Err(LoadError::unsupported(
            path,
            format_args!("version {version} of serialized meshes; 3 and 4 are read"),
        ));
    }
    let count = bytes.len().checked_sub(4).and_then(|at| bytes.get(at..)).ok_or_else(cut)?;
    let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize;
    let width = if version == 4 { 8 } else { 4 };
    let table = count.checked_mul(width).and_then(|size| bytes.len().checked_sub(4 + size)).ok_or_else(cut)?;
    if number >= count {
        return Err(LoadError::invalid(path, format_args!("there is no mesh {number}: the file has {count}")));
    }
    let entry = &bytes[table + number * width..table + (number + 1) * width];
    let offset = entry.iter().rev().fold(0_u64, |offset, &byte| offset << 8 | u64::from(byte));
    let stream = usize::try_from(offset).ok().and_then(|at| bytes.get(at.checked_add(4)?..)).ok_or_else(cut)?;
    let damaged = format_args!("mesh {number} is not valid zlib");
    let unpacked = files::unpacked(flate2::read::ZlibDecoder::new(stream), path, damaged)?;
    parse(&unpacked, version)
        .ok_or_else(|| LoadError::invalid(path, format_args!("mesh {number} is cut off or damaged")))
}

/// `None` where the bytes do not suffice or an index is out of range.
fn parse(bytes: &[u8], version: u16) -> Option<Mesh> {
    let mut cursor = Cursor { bytes };
    let flags = cursor.take(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))?;
    let mut mesh = Mesh { name: "serialized".to_owned(), ..Mesh::default() };
    if version == 4 {
        let end = cursor.bytes.iter().position(|&byte| byte == 0)?;
        let name = cursor.take(end)?;
        mesh.name = String::from_utf8_lossy(name).chars().take(80).collect();
        cursor.take(1)?;
    }
    let (vertices, triangles) = (cursor.count()?, cursor.count()?);
    let precision = if flags & DOUBLE_PRECISION != 0 { Precision::Double } else { Precision::Single };
    mesh.positions =
        cursor.floats(vertices, 3, precision)?.as_chunks::<3>().0.iter().map(|&p| Vec3::from_array(p)).collect();
    if flags & HAS_NORMALS != 0 {
        mesh.normals =
            cursor.floats(vertices, 3, precision)?.as_chunks::<3>().0.iter().map(|&n| Vec3::from_array(n)).collect();
    }
    if flags & HAS_TEXTURE_COORDINATES != 0 {
        let coordinates = cursor.floats(vertices, 2, precision)?;
        mesh.uvs = coordinates.as_chunks::<2>().0.iter().map(|&uv| Vec2::from_array(uv)).collect();
    }
    if flags & HAS_COLORS != 0 {
        cursor.floats(vertices, 3, precision)?;
    }
    let indices = cursor.take(triangles.checked_mul(12)?)?;
    let word = |b: &[u8; 4]| u32::from_le_bytes(*b);
    mesh.triangles =
        indices.as_chunks::<4>().0.as_chunks::<3>().0.iter().map(|[a, b, c]| [word(a), word(b), word(c)]).collect();
    mesh.triangles.iter().flatten().all(|&index| (index as usize) < vertices).then_some(mesh)
}

/// Of a mesh's numbers.
#[derive(Clone, Copy, Debug)]
enum Precision {
    Single,
    Double,
}

struct Cursor<'a> {
    bytes: &'a [u8],
}

impl<'a> Cursor<'a> {
    fn take(&mut self, size: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(size)?;
        self.bytes = rest;
        Some(taken)
    }

    fn count(&mut self) -> Option<usize> {
        let bytes = self.take(8)?;
        usize::try_from(bytes.iter().rev().fold(0_u64, |count, &byte| count << 8 | u64::from(byte))).ok()
    }

    fn floats(&mut self, count: usize, each: usize, precision: Precision) -> Option<Vec<f32>> {
        let numbers = count.checked_mul(each)?;
        Some(match precision {
            Precision::Single => {
                let bytes = self.take(numbers.checked_mul(4)?)?;
                bytes.as_chunks::<4>().0.iter().map(|&four| f32::from_le_bytes(four)).collect()
            }
            Precision::Double => {
                let bytes = self.take(numbers.checked_mul(8)?)?;
                bytes.as_chunks::<8>().0.iter().map(|&eight| f64::from_le_bytes(eight) as f32).collect()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn file() -> Vec<u8> {
        let mut body = Vec::new();
        body.extend((HAS_TEXTURE_COORDINATES | 0x1000).to_le_bytes());
        body.extend(b"quad\0");
        body.extend(3_u64.to_le_bytes());
        body.extend(1_u64.to_le_bytes());
        for value in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0] {
            body.extend(value.to_le_bytes());
        }
        for index in [0_u32, 1, 2] {
            body.extend(index.to_le_bytes());
        }
        let mut bytes = vec![0x1c, 0x04, 4, 0];
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        packer.write_all(&body).unwrap();
        bytes.extend(packer.finish().unwrap());
        bytes.extend(0_u64.to_le_bytes());
        bytes.extend(1_u32.to_le_bytes());
        bytes
    }

    #[test]
    fn a_mesh_is_read_and_every_cut_survived() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.serialized");
        let bytes = file();
        std::fs::write(&path, &bytes).unwrap();
        let mesh = read(&path, 0).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((mesh.name.as_str(), mesh.triangles.as_slice()), ("quad", [[0, 1, 2]].as_slice()));
        assert_eq!(mesh.uvs[2], Vec2::Y);
        assert!(read(&path, 1).unwrap_err().to_string().contains("there is no mesh 1"));
        for length in 1..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert!(read(&path, 0).is_err());
        }
    }
}
