//! The header: which elements the body holds, in which encoding. No number of the body is read.

use super::super::error::{LoadError, Place};
use std::path::Path;

/// Longest header that is looked through.
const LONGEST_HEADER: usize = 64 << 10;

/// How numbers of the body are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    /// Bytes in a binary body.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// A property; a list has the type of its count.
#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) list: Option<Kind>,
}

/// So many rows of properties under one name.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// The header, and where the body starts.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) body: usize,
}

/// Reads the header.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Header, LoadError> {
    if !bytes.starts_with(b"ply") {
        return Err(LoadError::invalid(path, "not a PLY file: its first word is not \"ply\""));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    let mut number = 0;
    loop {
        let rest = &bytes[at..];
        let length = rest.iter().take(LONGEST_HEADER).position(|&byte| byte == b'\n');
        let Some(length) = length.filter(|_| at < LONGEST_HEADER) else {
            return Err(LoadError::invalid(path, "the header has no \"end_header\""));
        };
        number += 1;
        at += length + 1;
        let line = String::from_utf8_lossy(&rest[..length]);
        let wrong = |problem: &str| LoadError::invalid_at(Place::line(path, number), problem);
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["format", name, ..] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(wrong("expected the format ascii, binary_little_endian or binary_big_endian")),
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| wrong("expected a number of elements"))?;
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", rest @ ..] => {
                let property = match rest {
                    ["list", count, kind, name] => Kind::from_name(count)
                        .zip(Kind::from_name(kind))
                        .map(|(count, kind)| Property { name: (*name).to_owned(), kind, list: Some(count) }),
                    [kind, name] => {
                        Kind::from_name(kind).map(|kind| Property { name: (*name).to_owned(), kind, list: None })
                    }
                    _ => None,
                };
                let property =
                    property.ok_or_else(|| wrong("expected \"property TYPE NAME\" or \"property list ...\""))?;
                elements.last_mut().ok_or_else(|| wrong("a property before any element"))?.properties.push(property);
            }
            ["end_header"] => break,
            ["ply"] | ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(wrong("not a line of a PLY header")),
        }
    }
    let encoding = encoding.ok_or_else(|| LoadError::invalid(path, "the header names no format"))?;
    Ok(Header { encoding, elements, body: at })
}
