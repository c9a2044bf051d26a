//! Scan-line files whose channels have different resolutions, as luminance-chroma pictures have.
//!
//! The `exr` crate refuses them, though its decompression knows them. So its header reader is shown a copy whose
//! channels all have full resolution, and the blocks are found and unpacked one by one here.

use super::checks::{check_memory, guarded, read_headers};
use super::wanted::Wanted;
use super::{ExrImage, ExrReadError, SampleType, image_without_channels};
use ::exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType as FileType};
use ::exr::meta::header::Header;
use ::exr::prelude::{Vec2, f16};
use std::path::Path;

/// Where a channel's sampling stands in the file, and what it is.
struct Sampling {
    at: usize,
    x: i32,
    y: i32,
}

/// The attributes of a header of one part.
struct HeaderScan {
    samplings: Vec<Sampling>,
    /// Where the table of offsets begins.
    end: usize,
}

/// Walks over the header; `None` where it is not what it should be, which the library will then say better.
fn scan(file: &[u8]) -> Option<HeaderScan> {
    const SEVERAL_PARTS: u8 = 0x10;
    if file.get(5)? & SEVERAL_PARTS != 0 {
        return None;
    }
    let text_end = |from: usize| file.get(from..)?.iter().position(|byte| *byte == 0).map(|length| from + length);
    let mut samplings = Vec::new();
    let mut at = 8;
    loop {
        let name_end = text_end(at)?;
        if name_end == at {
            return Some(HeaderScan { samplings, end: at + 1 });
        }
        let kind_end = text_end(name_end + 1)?;
        let size = usize::try_from(integer(file, kind_end + 1)?).ok()?;
        let value = kind_end + 5;
        if &file[name_end + 1..kind_end] == b"chlist" {
            let mut channel = value;
            while text_end(channel)? != channel {
                let end = text_end(channel)?;
                samplings.push(Sampling { at: end + 9, x: integer(file, end + 9)?, y: integer(file, end + 13)? });
                channel = end + 17;
            }
        }
        at = value.checked_add(size)?;
    }
}

fn integer(file: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(file.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

/// The picture of a file with channels of different resolutions, all brought to full resolution by linear
/// interpolation; `None` for other files.
pub(super) fn read(path: &Path, file: &[u8]) -> Result<Option<ExrImage>, ExrReadError> {
    let Some(found) = scan(file).filter(|found| found.samplings.iter().any(|s| (s.x, s.y) != (1, 1))) else {
        return Ok(None);
    };
    let mut plain = file.to_vec();
    for sampling in &found.samplings {
        let one = 1_i32.to_le_bytes();
        plain[sampling.at..sampling.at + 4].copy_from_slice(&one);
        plain[sampling.at + 4..sampling.at + 8].copy_from_slice(&one);
    }
    let mut headers = read_headers(path, &plain)?;
    check_memory(path, &headers, &Wanted::of(&headers, |all| all.to_vec()))?;
    let header = &mut headers[0];
    let unsupported = |feature: &str| ExrReadError::Unsupported { path: path.to_owned(), feature: feature.to_owned() };
    let Vec2(left, top) = header.own_attributes.layer_position;
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    for (channel, sampling) in header.channels.list.iter_mut().zip(&found.samplings) {
        if !(1..=64).contains(&sampling.x) || !(1..=64).contains(&sampling.y) {
            return Err(unsupported("a channel's sampling is not between 1 and 64; write the picture as RGB"));
        }
        if left % sampling.x != 0 || top % sampling.y != 0 || width % sampling.x as usize != 0 {
            return Err(unsupported("subsampled channels do not divide the width; write the picture as RGB"));
        }
        channel.sampling = Vec2(sampling.x as usize, sampling.y as usize);
    }
    let mut image = image_without_channels(header);
    let mut reader = Blocks { path, file, header: &*header, channels: Vec::new(), lines: 0 };
    reader.channels = header.channels.list.iter().map(|channel| Plane::empty(channel, width, height)).collect();
    reader.read(found.end)?;
    image.height = reader.lines as u32;
    image.lines_left_out = (height - reader.lines) as u32;
    if reader.lines == 0 {
        return Err(unsupported("blocks whose lines the subsampling does not divide are not read; write it as RGB"));
    }
    for (channel, plane) in header.channels.list.iter().zip(reader.channels) {
        image.types.push(plane.kind);
        image.channels.push((channel.name.to_string(), plane.enlarged(width, reader.lines)));
    }
    Ok(Some(image))
}

/// A channel at its own resolution.
struct Plane {
    kind: SampleType,
    step_x: usize,
    step_y: usize,
    width: usize,
    values: Vec<f32>,
}

impl Plane {
    fn empty(channel: &ChannelDescription, width: usize, height: usize) -> Self {
        let Vec2(step_x, step_y) = channel.sampling;
        let kind = match channel.sample_type {
            FileType::F16 => SampleType::Half,
            FileType::F32 => SampleType::Float,
            FileType::U32 => SampleType::Uint,
        };
        let (width, height) = (width / step_x, height.div_ceil(step_y));
        Self { kind, step_x, step_y, width, values: vec![0.0; width * height] }
    }

    fn bytes_per_line(&self) -> usize {
        self.width * if self.kind == SampleType::Half { 2 } else { 4 }
    }

    fn set_line(&mut self, line: usize, bytes: &[u8]) {
        let row = line / self.step_y * self.width;
        let Some(values) = self.values.get_mut(row..row + self.width) else { return };
        let size = if self.kind == SampleType::Half { 2 } else { 4 };
        for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(size)) {
            *value = match (self.kind, bytes) {
                (SampleType::Half, [a, b]) => f16::from_le_bytes([*a, *b]).to_f32(),
                (SampleType::Float, [a, b, c, d]) => f32::from_le_bytes([*a, *b, *c, *d]),
                (_, [a, b, c, d]) => u32::from_le_bytes([*a, *b, *c, *d]) as f32,
                _ => 0.0,
            };
        }
    }

    /// Full resolution: a sample stands at the first pixel of its cell, between samples it is linear.
    fn enlarged(&self, width: usize, height: usize) -> Vec<f32> {
        if (self.step_x, self.step_y) == (1, 1) {
            return self.values[..width * height].to_vec();
        }
        let rows = height.div_ceil(self.step_y);
        let mut result = Vec::with_capacity(width * height);
        for y in 0..height {
            let (top, share_y) = (y / self.step_y, (y % self.step_y) as f32 / self.step_y as f32);
            let bottom = (top + 1).min(rows - 1);
            for x in 0..width {
                let (left, share_x) = (x / self.step_x, (x % self.step_x) as f32 / self.step_x as f32);
                let right = (left + 1).min(self.width - 1);
                let at = |column: usize, row: usize| self.values[row * self.width + column];
                let line = |row| at(left, row) * (1.0 - share_x) + at(right, row) * share_x;
                result.push(if share_y == 0.0 {
                    line(top)
                } else {
                    line(top) * (1.0 - share_y) + line(bottom) * share_y
                });
            }
        }
        result
    }
}

struct Blocks<'a> {
    path: &'a Path,
    file: &'a [u8],
    header: &'a Header,
    channels: Vec<Plane>,
    /// Complete lines from the top.
    lines: usize,
}

impl Blocks<'_> {
    fn damaged(&self, problem: &str) -> ExrReadError {
        ExrReadError::Damaged { path: self.path.to_owned(), problem: problem.to_owned() }
    }

    fn read(&mut self, table: usize) -> Result<(), ExrReadError> {
        let lines_per_block = self.header.compression.scan_lines_per_block();
        let height = self.header.layer_size.1;
        for block in 0..height.div_ceil(lines_per_block) {
            let entry = table + 8 * block;
            let offset =
                self.file.get(entry..entry + 8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes);
            let offset = offset.and_then(|offset| usize::try_from(offset).ok()).unwrap_or(usize::MAX);
            let header = offset.checked_add(4).and_then(|at| integer(self.file, offset).zip(integer(self.file, at)));
            let (y, size) = header.ok_or_else(|| self.damaged("a block is not in the file"))?;
            let first = i64::from(y) - i64::from(self.header.own_attributes.layer_position.1);
            if first != (block * lines_per_block) as i64 {
                return Err(self.damaged("a block is not where the table of offsets has it"));
            }
            let size = usize::try_from(size).unwrap_or(usize::MAX);
            let data = offset.checked_add(8).and_then(|from| self.file.get(from..from.checked_add(size)?));
            let data = data.ok_or_else(|| self.damaged("a block is longer than the file"))?;
            let count = lines_per_block.min(height - first as usize);
            if !self.block(first as usize, count, data)? {
                return Ok(());
            }
            self.lines = first as usize + count;
        }
        Ok(())
    }

    /// Unpacks one block of `count` lines; `false` where the library cannot, which is the last block of some pictures.
    fn block(&mut self, first: usize, count: usize, data: &[u8]) -> Result<bool, ExrReadError> {
        let lines = |plane: &Plane| (first..first + count).filter(|line| line % plane.step_y == 0).count();
        let bytes: usize = self.channels.iter().map(|plane| lines(plane) * plane.bytes_per_line()).sum();
        let area = self.header.layer_size.0 * count;
        let unpacked = if data.len() == bytes {
            data.to_vec()
        } else {
            // The library takes the bytes of a block for a whole number a pixel, and lines for a multiple of the
            // sampling.
            let whole = count == 1 || self.channels.iter().all(|plane| count.is_multiple_of(plane.step_y));
            if !bytes.is_multiple_of(area) || !whole {
                return Ok(false);
            }
            let mut header = self.header.clone();
            header.channels.bytes_per_pixel = bytes / area;
            let Vec2(x, y) = header.own_attributes.layer_position;
            let section = IntegerBounds { position: Vec2(x, y + first as i32), size: Vec2(header.layer_size.0, count) };
            let compression = header.compression;
            guarded(self.path, || compression.decompress_image_section_from_le(&header, data.to_vec(), section, false))?
        };
        let mut rest = unpacked.as_slice();
        for line in first..first + count {
            for plane in self.channels.iter_mut().filter(|plane| line % plane.step_y == 0) {
                let (values, after) = rest.split_at(plane.bytes_per_line().min(rest.len()));
                plane.set_line(line, values);
                rest = after;
            }
        }
        Ok(true)
    }
}
