//! Refuses a picture that does not fit into memory. What a scene takes is not counted.

use super::choices::Size;
use crate::cli::system_memory::available_bytes;
use anyhow::bail;
use fechner::film::Film;

/// Refuses a size whose film and maps would not fit into memory.
pub(in crate::cli) fn check_memory(size: Size) -> anyhow::Result<()> {
    /// Bytes of memory that a pixel is taken to need: 508 at 256×256, program included, by `peak_memory_bytes` of
    /// --json; the rest is margin.
    const BYTES_PER_PIXEL: u64 = 700;
    let Size { width, height } = size;
    let pixels = u64::from(width) * u64::from(height);
    if pixels > u64::from(Film::MAX_PIXELS) {
        bail!(
            "a picture of {width}x{height} has more than the {} pixels that a film may have: choose a smaller --size",
            Film::MAX_PIXELS
        );
    }
    let needed = pixels * BYTES_PER_PIXEL;
    let available = available_bytes().unwrap_or(8 << 30);
    if needed > available {
        bail!(
            "a picture of {width}x{height} needs about {:.1} GiB of memory, and {:.1} GiB are free: choose a smaller --size",
            needed as f64 / f64::from(1 << 30),
            available as f64 / f64::from(1 << 30)
        );
    }
    Ok(())
}
