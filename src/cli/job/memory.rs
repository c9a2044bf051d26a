//! Whether a picture fits into memory.

use super::choices::Size;
use anyhow::bail;

/// Refuses a size whose film and maps would not fit into memory.
pub(in crate::cli) fn check_memory(size: Size) -> anyhow::Result<()> {
    /// Peak memory was 508 bytes a pixel at 256×256, program included (`peak_memory_bytes` of --json); the rest is margin.
    const BYTES_PER_PIXEL: u64 = 700;
    let needed = u64::from(size.width) * u64::from(size.height) * BYTES_PER_PIXEL;
    let available = available_memory_bytes().unwrap_or(8 << 30);
    if needed > available || u64::from(size.width) * u64::from(size.height) > u64::from(u32::MAX) / 2 {
        bail!(
            "a picture of {}x{} needs about {:.1} GiB of memory, and {:.1} GiB are free: choose a smaller --size",
            size.width,
            size.height,
            needed as f64 / f64::from(1 << 30),
            available as f64 / f64::from(1 << 30)
        );
    }
    Ok(())
}

/// Free memory as Linux states it; `None` elsewhere.
fn available_memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
