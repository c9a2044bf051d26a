//! What a header claims, held against the file's length and a limit on memory. No pixel is looked at.

use super::wanted::Wanted;
use super::{ExrReadError, MEMORY_LIMIT_BYTES, layout};
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::Vec2;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Reads the headers of all parts and refuses those of which no channel could be read within [`MEMORY_LIMIT_BYTES`].
pub(super) fn read_headers(path: &Path, file: &[u8]) -> Result<Vec<Header>, ExrReadError> {
    let damaged = |problem: String| ExrReadError::Damaged { path: path.to_owned(), problem };
    let unsupported = |feature: &str| ExrReadError::Unsupported { path: path.to_owned(), feature: feature.to_owned() };

    if file.is_empty() {
        return Err(damaged("it is empty".to_owned()));
    }
    let headers = guarded(path, || MetaData::read_from_buffered(Cursor::new(file), false))?.headers;
    if headers.is_empty() {
        return Err(damaged("it has no part".to_owned()));
    }

    let mut chunks: u64 = 0;
    check_memory_of(path, std::slice::from_ref(layout(&headers)), |_| 1)?;
    for header in &headers {
        if header.deep {
            return Err(unsupported("deep pixels are not read; flatten the picture first"));
        }
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return Err(unsupported("subsampled channels are not read; write the picture as RGB"));
        }
        let Vec2(width, height) = header.layer_size;
        if width == 0 || height == 0 {
            return Err(damaged("it has no pixels".to_owned()));
        }
        let channels = header.channels.list.len() as u64;
        // A single block is unpacked at once, and tiles may be larger than the picture.
        if let BlockDescription::Tiles(tiles) = header.blocks {
            let tile_pixels = (tiles.tile_size.0 as u64).saturating_mul(tiles.tile_size.1 as u64);
            if tile_pixels.saturating_mul(channels * 4) > MEMORY_LIMIT_BYTES / 4 {
                return Err(damaged(format!("tiles of {}×{} pixels", tiles.tile_size.0, tiles.tile_size.1)));
            }
        }
        chunks = chunks.saturating_add(header.chunk_count as u64);
    }
    // Each chunk takes 8 bytes in the table of offsets, and a place and a length of 4 bytes each where it stands.
    if chunks.saturating_mul(16) > file.len() as u64 {
        return Err(damaged(format!("it is too short for the {chunks} blocks that its header tells of")));
    }
    Ok(headers.into_vec())
}

/// Refuses channels that would take more than [`MEMORY_LIMIT_BYTES`].
pub(super) fn check_memory(path: &Path, headers: &[Header], wanted: &Wanted) -> Result<(), ExrReadError> {
    check_memory_of(path, headers, |header| wanted.channels_of(header))
}

fn check_memory_of(path: &Path, headers: &[Header], channels_of: impl Fn(&Header) -> u64) -> Result<(), ExrReadError> {
    let area = |header: &Header| (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
    let laid_out = area(layout(headers));
    let of_part = |header: &Header| area(header).max(laid_out).saturating_mul(channels_of(header).saturating_mul(4));
    let bytes = headers.iter().map(of_part).fold(0_u64, u64::saturating_add);
    if bytes > MEMORY_LIMIT_BYTES {
        return Err(ExrReadError::TooLarge {
            path: path.to_owned(),
            width: layout(headers).layer_size.0 as u64,
            height: layout(headers).layer_size.1 as u64,
            channels: headers.iter().map(channels_of).sum(),
            bytes,
        });
    }
    Ok(())
}

/// Runs the library, and turns its errors, and panics on damaged data, into ours.
pub(super) fn guarded<T>(path: &Path, run: impl FnOnce() -> ::exr::error::Result<T>) -> Result<T, ExrReadError> {
    use ::exr::error::Error;
    let path = path.to_owned();
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(Error::Io(error))) => Err(ExrReadError::Io { path, error }),
        Ok(Err(Error::NotSupported(what))) => Err(ExrReadError::Unsupported {
            path,
            feature: format!("{what} is not read; convert the file to ZIP first"),
        }),
        Ok(Err(Error::Invalid(problem))) => Err(ExrReadError::Damaged { path, problem: problem.into_owned() }),
        Ok(Err(Error::Aborted)) => Err(ExrReadError::Damaged { path, problem: "reading ended early".to_owned() }),
        Err(_) => Err(ExrReadError::Damaged { path, problem: "its blocks contradict its header".to_owned() }),
    }
}
