//! What blocks of DWAA and DWAB claim to unpack to, checked before they are unpacked.
//!
//! The `exr` crate takes the memory that such a block asks for in its first words, whatever that is, and a system that
//! has not so much ends the program.

use super::ExrReadError;
use super::checks::guarded;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::compression::Compression;
use ::exr::meta::header::Header;
use ::exr::prelude::Vec2;
use std::io::Cursor;
use std::path::Path;

/// Counts at the start of a block: its version, nine sizes and numbers, and how it is coded.
const COUNTS: usize = 11;
/// Where those stand that say how much is unpacked: bytes of what is not transformed, of runs before and
/// after, coefficients and means.
pub(super) const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

/// Refuses a file one of whose blocks claims more than the pixels that it stands for.
pub(super) fn check(path: &Path, file: &[u8], headers: &[Header]) -> Result<(), ExrReadError> {
    if !headers.iter().any(is_dwa) {
        return Ok(());
    }
    guarded(path, || {
        let chunks = ::exr::block::read(Cursor::new(file), false)?.filter_chunks(false, |_, _, _| true)?;
        for chunk in chunks {
            check_chunk(&chunk?, headers)?;
        }
        Ok(())
    })
}

fn is_dwa(header: &Header) -> bool {
    matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_))
}

fn check_chunk(chunk: &Chunk, headers: &[Header]) -> ::exr::error::Result<()> {
    let Some(header) = headers.get(chunk.layer_index).filter(|header| is_dwa(header)) else { return Ok(()) };
    let bytes = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let place = header.get_block_data_indices(&chunk.compressed_block)?;
    let Vec2(width, height) = header.get_absolute_block_pixel_coordinates(place)?.size;
    // Blocks that grew are stored as they were.
    if bytes.len() == width * height * header.channels.bytes_per_pixel {
        return Ok(());
    }
    // Eight bytes a value of whole squares of eight by eight pixels, and as much as nobody misses.
    let most = 8 * (width + 8) * (height + 8) * header.channels.list.len() + (1 << 16);
    let count =
        |at: usize| bytes.get(8 * at..8 * at + 8).and_then(|word| Some(u64::from_le_bytes(word.try_into().ok()?)));
    if bytes.len() >= 8 * COUNTS && UNPACKED.iter().any(|at| count(*at).is_some_and(|count| count > most as u64)) {
        return Err(::exr::error::Error::Invalid("a block claims more than its pixels".into()));
    }
    Ok(())
}
