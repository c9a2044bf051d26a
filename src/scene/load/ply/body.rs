//! The body: numbers in text or bytes, never more of them than there are bytes for.

use super::super::error::{LoadError, Place};
use super::header::{Element, Encoding, Header, Kind};
use std::path::Path;

/// The numbers of a body, one after the other.
pub(super) struct Values<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

impl<'a> Values<'a> {
    /// The values of a file's body.
    pub(super) fn new(path: &'a Path, bytes: &'a [u8], header: &Header) -> Self {
        Self { path, bytes, at: header.body, encoding: header.encoding }
    }

    /// An error at the number that was read last, with its line where there are lines.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> LoadError {
        let ends = || self.bytes[..self.at].iter().filter(|&&byte| byte == b'\n').count();
        let line = (self.encoding == Encoding::Ascii).then(|| ends() + 1);
        LoadError::invalid_at(Place { file: self.path.to_owned(), line }, problem)
    }

    /// An error at the number that was read last, which is among indices and is none.
    pub(super) fn no_index(&self, number: impl std::fmt::Display) -> LoadError {
        self.error(format_args!("{number} is not a vertex index"))
    }

    pub(super) fn bytes_left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn cut(&self) -> LoadError {
        self.error("the file is cut off")
    }

    /// Refuses counts for which there cannot be enough bytes.
    pub(super) fn check_count(&self, element: &Element) -> Result<(), LoadError> {
        let least: usize = element
            .properties
            .iter()
            .map(|property| match (self.encoding, property.list) {
                (Encoding::Ascii, _) => 2,
                (_, Some(count)) => count.size(),
                (_, None) => property.kind.size(),
            })
            .sum();
        // The last number of a text needs no space behind it.
        if element.count.checked_mul(least).is_none_or(|needed| needed > self.bytes_left() + 1) {
            let left = self.bytes_left();
            let problem = format!("{} \"{}\" do not fit the {left} bytes that are left", element.count, element.name);
            return Err(self.error(problem));
        }
        Ok(())
    }

    /// The next number.
    pub(super) fn number(&mut self, kind: Kind) -> Result<f64, LoadError> {
        if self.encoding == Encoding::Ascii {
            return self.word_as_number();
        }
        let bytes = self.take(kind.size())?;
        Ok(decode(bytes, kind, self.encoding))
    }

    fn take(&mut self, size: usize) -> Result<&'a [u8], LoadError> {
        let taken = self.bytes.get(self.at..self.at + size).ok_or_else(|| self.cut())?;
        self.at += size;
        Ok(taken)
    }

    fn word(&mut self) -> Result<&'a [u8], LoadError> {
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or_else(|| self.cut())?;
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        Ok(&rest[start..start + length])
    }

    fn word_as_number(&mut self) -> Result<f64, LoadError> {
        let word = self.word()?;
        // Small whole numbers, which most are, without the way through text.
        if word.len() <= 9 && word.iter().all(u8::is_ascii_digit) {
            return Ok(f64::from(word.iter().fold(0_u32, |number, digit| number * 10 + u32::from(digit - b'0'))));
        }
        let text = std::str::from_utf8(word).unwrap_or("?");
        // f32 first rounding is what every other reader does; f64 keeps indices exact.
        text.parse().map_err(|_| self.error(format_args!("\"{text}\" is not a number")))
    }

    /// Rows whose numbers go to slots; the others are skipped.
    pub(super) fn rows(
        &mut self,
        element: &Element,
        slots: &[Option<usize>],
        mut row: impl FnMut(&[f32; 8]),
    ) -> Result<(), LoadError> {
        let mut values = [0.0_f32; 8];
        let has_list = element.properties.iter().any(|property| property.list.is_some());
        if self.encoding == Encoding::Ascii || has_list {
            for _ in 0..element.count {
                for (property, slot) in element.properties.iter().zip(slots) {
                    match (property.list, slot) {
                        (Some(count), _) => self.skip_list(count, property.kind)?,
                        (None, Some(slot)) => values[*slot] = self.number(property.kind)? as f32,
                        (None, None) => _ = self.number(property.kind)?,
                    }
                }
                row(&values);
            }
            return Ok(());
        }
        let stride: usize = element.properties.iter().map(|property| property.kind.size()).sum();
        let needed = element.count.checked_mul(stride).ok_or_else(|| self.cut())?;
        let mut fields = Vec::new();
        let mut offset = 0;
        for (property, slot) in element.properties.iter().zip(slots) {
            if let Some(slot) = slot {
                fields.push((offset, property.kind, *slot));
            }
            offset += property.kind.size();
        }
        let encoding = self.encoding;
        let floats = encoding == Encoding::LittleEndian && fields.iter().all(|field| field.1 == Kind::F32);
        for bytes in self.take(needed)?.chunks_exact(stride.max(1)) {
            for &(offset, kind, slot) in &fields {
                values[slot] = if floats {
                    f32::from_le_bytes([bytes[offset], bytes[offset + 1], bytes[offset + 2], bytes[offset + 3]])
                } else {
                    decode(&bytes[offset..], kind, encoding) as f32
                };
            }
            row(&values);
        }
        Ok(())
    }

    /// Appends a list of indices; returns its length.
    pub(super) fn list(&mut self, count: Kind, kind: Kind, indices: &mut Vec<u32>) -> Result<u32, LoadError> {
        let size = self.list_size(count, kind)?;
        if self.encoding != Encoding::Ascii && matches!(kind, Kind::I32 | Kind::U32) {
            let encoding = self.encoding;
            let bytes = self.take(size * 4)?;
            let first = indices.len();
            indices.extend(bytes.as_chunks::<4>().0.iter().map(|&four| match encoding {
                Encoding::BigEndian => u32::from_be_bytes(four),
                _ => u32::from_le_bytes(four),
            }));
            let mut signed = indices[first..].iter().map(|&index| index as i32);
            return match signed.find(|&index| kind == Kind::I32 && index < 0) {
                Some(index) => Err(self.no_index(index)),
                None => Ok(size as u32),
            };
        }
        for _ in 0..size {
            let index = self.number(kind)?;
            if index.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&index) {
                return Err(self.no_index(index));
            }
            indices.push(index as u32);
        }
        Ok(size as u32)
    }

    /// The length of the list that follows, for which there are bytes.
    pub(super) fn list_size(&mut self, count: Kind, kind: Kind) -> Result<usize, LoadError> {
        let size = self.number(count)?;
        let width = if self.encoding == Encoding::Ascii { 2 } else { kind.size() };
        let most = (self.bytes_left() + 1) / width;
        if size.fract() == 0.0 && (0.0..=most as f64).contains(&size) {
            return Ok(size as usize);
        }
        Err(self
            .error(format_args!("a list of {size} entries does not fit the {} bytes that are left", self.bytes_left())))
    }

    pub(super) fn skip_list(&mut self, count: Kind, kind: Kind) -> Result<(), LoadError> {
        let size = self.list_size(count, kind)?;
        if self.encoding != Encoding::Ascii {
            return self.take(size * kind.size()).map(|_| ());
        }
        for _ in 0..size {
            self.word()?;
        }
        Ok(())
    }

    /// Skips an element of no use.
    pub(super) fn skip(&mut self, element: &Element) -> Result<(), LoadError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        for _ in 0..element.count {
            for property in &element.properties {
                match property.list {
                    Some(count) => self.skip_list(count, property.kind)?,
                    None => _ = self.number(property.kind)?,
                }
            }
        }
        Ok(())
    }
}

/// A number from at least as many bytes as it has.
fn decode(bytes: &[u8], kind: Kind, encoding: Encoding) -> f64 {
    let mut eight = [0; 8];
    let size = kind.size();
    eight[..size].copy_from_slice(&bytes[..size]);
    if encoding == Encoding::BigEndian {
        eight[..size].reverse();
    }
    let [a, b, c, d, ..] = eight;
    match kind {
        Kind::I8 => f64::from(a as i8),
        Kind::U8 => f64::from(a),
        Kind::I16 => f64::from(i16::from_le_bytes([a, b])),
        Kind::U16 => f64::from(u16::from_le_bytes([a, b])),
        Kind::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
        Kind::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
        Kind::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
        Kind::F64 => f64::from_le_bytes(eight),
    }
}
