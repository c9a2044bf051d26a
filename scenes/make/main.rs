//! Writes the meshes, textures, skies and photometry under `scenes/`, and the scene files that are too long to write
//! by hand.
//!
//! `cargo run --release -p fechner-make-scenes` writes them all anew; they are committed, so nobody has to.
//! Everything is a pure function of the numbers in this program: running it twice gives the same files.

mod lathe;
mod many_lights;
mod mesh;
mod meshes;
mod noise;
mod photometry;
mod raster;
mod sky;
mod textures;

use std::path::{Path, PathBuf};

fn main() -> anyhow::Result<()> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = |name: &str| -> anyhow::Result<PathBuf> {
        let path = scenes.join(name);
        std::fs::create_dir_all(&path)?;
        Ok(path)
    };
    textures::write_all(&folder("textures")?)?;
    meshes::write_all(&folder("meshes")?)?;
    sky::write_all(&folder("skies")?)?;
    photometry::write_all(&folder("photometry")?)?;
    std::fs::write(scenes.join("many-lights.toml"), many_lights::scene())?;
    Ok(())
}
