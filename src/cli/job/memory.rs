//! Whether a picture fits into memory.

use super::choices::Size;
use crate::cli::system_memory::available_bytes;
use anyhow::bail;

/// Refuses a size whose film and maps would not fit into memory.
pub(in crate::cli) fn check_memory(size: Size) -> anyhow::Result<()> {
    /// Peak memory was 508 bytes a pixel at 256×256, program included (`peak_memory_bytes` of --json); the rest is margin.
    const BYTES_PER_PIXEL: u64 = 700;
    /// Pixels are numbered by `u32`, and halves of them counted.
    const MOST_PIXELS: u64 = u32::MAX as u64 / 2;
    let Size { width, height } = size;
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MOST_PIXELS {
        bail!(
            "a picture of {width}x{height} has more than the {MOST_PIXELS} pixels that a film may have: choose a smaller --size"
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
