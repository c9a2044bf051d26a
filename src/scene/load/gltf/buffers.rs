//! Containers and bytes of glTF: GLB chunks, buffers from files and `data:` URIs, accessors. Every range is checked
//! here; the `gltf` crate's own readers trust the file and panic on damaged ones.

use super::super::error::LoadError;
use super::super::files;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::accessor::DataType;
use std::path::{Path, PathBuf};

/// Most elements that one accessor may claim: zero-filled ones have no bytes in the file that would bound them.
const MAX_ELEMENTS: usize = 100_000_000;

/// With or without "=" at its end: writers differ.
const LENIENT_BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The JSON part and the binary part of a GLB file.
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
}

/// Splits a GLB file; anything else is taken for JSON.
pub(super) fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<Container<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Container { json: bytes, binary: None });
    }
    let word = |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let cut = || LoadError::invalid(path, "the GLB file is cut off");
    let version = word(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(LoadError::unsupported(path, format_args!("GLB version {version}; version 2 is read")));
    }
    let mut container = Container { json: &[], binary: None };
    // What follows the length that the file states is not of the format.
    let stated = word(8).map_or(bytes.len(), |length| length as usize);
    let bytes = if stated >= 12 { &bytes[..stated.min(bytes.len())] } else { bytes };
    let mut at = 12;
    while at < bytes.len() {
        let (length, kind) = (word(at).ok_or_else(cut)? as usize, word(at + 4).ok_or_else(cut)?);
        let chunk = bytes.get(at + 8..).and_then(|rest| rest.get(..length)).ok_or_else(cut)?;
        match kind {
            0x4E4F_534A if container.json.is_empty() => container.json = chunk,
            0x004E_4942 if container.binary.is_none() => container.binary = Some(chunk),
            _ => {}
        }
        at += 8 + length.next_multiple_of(4);
    }
    if container.json.is_empty() {
        Err(LoadError::invalid(path, "the GLB file has no JSON chunk"))
    } else {
        Ok(container)
    }
}

/// What a URI names.
pub(super) enum Uri {
    File(PathBuf),
    Data(Vec<u8>),
}

/// A relative path (percent-encoded), the `file:` URI of an absolute one, or base64 data.
pub(super) fn resolve(path: &Path, uri: &str) -> Result<Uri, LoadError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
        let encoded = encoded.ok_or_else(|| LoadError::invalid(path, "a data: URI that is not base64"))?;
        let bytes = LENIENT_BASE64.decode(encoded.trim());
        return bytes.map(Uri::Data).map_err(|error| LoadError::invalid(path, format_args!("a data: URI: {error}")));
    }
    // `file:///tmp/a.png`, with the host's name, or `file:/tmp/a.png` (RFC 8089).
    let with_host = uri.strip_prefix("file://").map(|rest| rest.strip_prefix("localhost").unwrap_or(rest));
    let absolute = with_host.or(uri.strip_prefix("file:"));
    let local = absolute.filter(|absolute| absolute.starts_with('/')).unwrap_or(uri);
    if local.contains("://") {
        return Err(LoadError::unsupported(path, format_args!("\"{uri}\": only local files are read")));
    }
    let mut decoded = Vec::new();
    let mut rest = local.as_bytes();
    while let Some((&byte, behind)) = rest.split_first() {
        let hex = |digit: Option<&u8>| digit.and_then(|&digit| char::from(digit).to_digit(16));
        match (byte, hex(behind.first()), hex(behind.get(1))) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((high * 16 + low) as u8);
                rest = &behind[2..];
            }
            _ => {
                decoded.push(byte);
                rest = behind;
            }
        }
    }
    let name = String::from_utf8_lossy(&decoded).into_owned();
    Ok(Uri::File(path.parent().unwrap_or(Path::new("")).join(name)))
}

/// All buffers of a document.
pub(super) struct Buffers {
    path: PathBuf,
    bytes: Vec<Vec<u8>>,
}

impl Buffers {
    pub(super) fn read(path: &Path, document: &gltf::Document, binary: Option<&[u8]>) -> Result<Self, LoadError> {
        let mut all = Vec::new();
        for (index, buffer) in document.as_json().buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                None if index == 0 => binary.unwrap_or_default().to_vec(),
                None => Vec::new(),
                Some(uri) => match resolve(path, uri)? {
                    Uri::Data(bytes) => bytes,
                    Uri::File(file) => {
                        files::read(&file).map_err(|error| error.referenced_from(super::super::Place::file(path)))?
                    }
                },
            };
            let promised = buffer.byte_length.0;
            if (bytes.len() as u64) < promised {
                let problem = format!("buffer {index} has {} bytes, {promised} are promised", bytes.len());
                return Err(LoadError::invalid(path, problem));
            }
            all.push(bytes);
        }
        Ok(Self { path: path.to_owned(), bytes: all })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: &gltf::buffer::View) -> Result<&[u8], LoadError> {
        let buffer = self.bytes.get(view.buffer().index()).map(Vec::as_slice).unwrap_or_default();
        buffer.get(view.offset()..).and_then(|rest| rest.get(..view.length())).ok_or_else(|| {
            let (offset, length) = (view.offset(), view.length());
            let problem =
                format!("buffer view {} needs bytes {offset} + {length} of a buffer of {}", view.index(), buffer.len());
            LoadError::invalid(&self.path, problem)
        })
    }

    /// The accessor's elements as floats, `N` a piece; integers are scaled if the file says "normalized".
    pub(super) fn floats<const N: usize>(&self, accessor: &gltf::Accessor) -> Result<Vec<[f32; N]>, LoadError> {
        let kind = accessor.data_type();
        let scaled = accessor.normalized();
        let decode = |bytes: &[u8]| match (kind, scaled) {
            (DataType::F32, _) => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            (DataType::U8, false) => f32::from(bytes[0]),
            (DataType::U8, true) => f32::from(bytes[0]) / 255.0,
            (DataType::I8, false) => f32::from(bytes[0] as i8),
            (DataType::I8, true) => (f32::from(bytes[0] as i8) / 127.0).max(-1.0),
            (DataType::U16, false) => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            (DataType::U16, true) => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65535.0,
            (DataType::I16, false) => f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            (DataType::I16, true) => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])) / 32767.0).max(-1.0),
            (DataType::U32, _) => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as f32,
        };
        self.elements(accessor, decode)
    }

    /// Elements, as [`Self::floats`] reads them, of an attribute of a mesh, which has one element for each
    /// vertex (glTF 2.0, 3.7.2.1).
    pub(super) fn of_vertices<const N: usize>(
        &self,
        accessor: &gltf::Accessor,
        attribute: &str,
        mesh: &str,
        vertices: usize,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        let found = accessor.count();
        if found != vertices {
            let problem =
                format!("{attribute} of \"{mesh}\" has {found} elements, but the mesh has {vertices} vertices");
            return Err(self.wrong(accessor, problem));
        }
        self.floats(accessor)
    }

    /// The file that they are of.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// An error about the file.
    pub(super) fn wrong_file(&self, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid(&self.path, problem)
    }

    /// An error about a mesh.
    pub(super) fn wrong_mesh(&self, mesh: &str, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid(&self.path, format_args!("\"{mesh}\": {problem}"))
    }

    /// The accessor's elements as indices.
    pub(super) fn indices(&self, accessor: &gltf::Accessor) -> Result<Vec<u32>, LoadError> {
        let kind = accessor.data_type();
        if !matches!(kind, DataType::U8 | DataType::U16 | DataType::U32) {
            return Err(self.wrong(accessor, "indices must be unsigned integers"));
        }
        let decode = |bytes: &[u8]| match kind {
            DataType::U8 => u32::from(bytes[0]),
            DataType::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        };
        Ok(self.elements::<1, u32>(accessor, decode)?.into_iter().map(|[index]| index).collect())
    }

    fn wrong(&self, accessor: &gltf::Accessor, problem: impl std::fmt::Display) -> LoadError {
        LoadError::invalid(&self.path, format_args!("accessor {}: {problem}", accessor.index()))
    }

    fn elements<const N: usize, T: Copy + Default>(
        &self,
        accessor: &gltf::Accessor,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, LoadError> {
        if accessor.dimensions().multiplicity() != N {
            return Err(self.wrong(accessor, format_args!("expected elements of {N} numbers")));
        }
        let count = accessor.count();
        if count > MAX_ELEMENTS {
            return Err(self.wrong(accessor, format_args!("{count} elements, at most {MAX_ELEMENTS} are read")));
        }
        let width = accessor.data_type().size();
        let element = |bytes: &[u8]| std::array::from_fn(|place| decode(&bytes[place * width..(place + 1) * width]));
        let size = width * N;
        let mut elements: Vec<[T; N]> = match accessor.view() {
            None => vec![[T::default(); N]; count],
            Some(view) => {
                let bytes = self.view(&view)?;
                let stride = view.stride().unwrap_or(size).max(size);
                let start = accessor.offset();
                let end = count
                    .checked_sub(1)
                    .map_or(Some(start), |last| last.checked_mul(stride)?.checked_add(start)?.checked_add(size));
                if end.is_none_or(|end| end > bytes.len()) {
                    let problem = format!("{count} elements do not fit its buffer view of {} bytes", bytes.len());
                    return Err(self.wrong(accessor, problem));
                }
                (0..count).map(|index| element(&bytes[start + index * stride..])).collect()
            }
        };
        if let Some(sparse) = accessor.sparse() {
            let width_of_index = sparse.indices().index_type().size();
            let from = sparse.indices();
            let indices = self.view(&from.view())?.get(from.offset()..).unwrap_or_default();
            let values = self.view(&sparse.values().view())?.get(sparse.values().offset()..).unwrap_or_default();
            let count = sparse.count();
            let fits = |bytes: &[u8], size: usize| count.checked_mul(size).is_some_and(|needed| needed <= bytes.len());
            if !fits(indices, width_of_index) || !fits(values, size) {
                return Err(self.wrong(accessor, "its sparse part does not fit its buffer views"));
            }
            for (place, value) in indices.chunks_exact(width_of_index).zip(values.chunks_exact(size)).take(count) {
                let place = place.iter().rev().fold(0, |index, &byte| index << 8 | usize::from(byte));
                let slot = elements.get_mut(place);
                *slot.ok_or_else(|| self.wrong(accessor, format_args!("sparse index {place} is out of range")))? =
                    element(value);
            }
        }
        Ok(elements)
    }
}
