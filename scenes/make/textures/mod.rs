//! Textures, one file a material. All tile.

mod fabric;
mod masonry;
mod ornament;
mod stone;
mod wood;

use std::path::Path;

/// Writes every texture.
pub(crate) fn write_all(folder: &Path) -> anyhow::Result<()> {
    wood::write(folder)?;
    stone::write(folder)?;
    fabric::write(folder)?;
    masonry::write(folder)?;
    ornament::write(folder)
}
