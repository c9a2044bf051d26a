//! Reading scenes: one file a format, all ending in the same [`Scene`].
//!
//! # What each format lacks, and what is assumed
//!
//! | format | lacks | assumed |
//! | --- | --- | --- |
//! | our TOML | nothing; a scene without any light is an error | without `[camera]`: a three-quarter view of everything |
//! | OBJ + MTL | camera, lights, units of `Ke` and of length | framed view, studio sky, `Ke` 1 is 1 unit of radiance |
//! | glTF 2.0, GLB | environment light; often camera and lights | the same; units are cd/m², cd, lx as specified |
//!
//! What was assumed or left out is said in [`Scene::notes`].
//!
//! # What a loaded scene promises
//!
//! Indices are in range, positions finite and below 1e15, normals unit or absent, texture coordinates finite, instance
//! transforms invertible, ids of meshes, materials and textures valid, and there is something to render. Damaged,
//! hostile or oversized files end in a [`LoadError`] of one line; none panics or takes memory out of proportion.

mod builder;
mod default_view;
pub mod environment;
mod error;
mod files;
mod gltf;
pub mod metals;
mod mtl;
mod obj;
mod ply;
mod polygon;
pub mod shapes;
pub mod sky;
mod spectrum;
#[path = "texture.rs"]
mod texture;
mod toml;
mod validate;

pub use default_view::{Bounds, bounds, framed};
pub use error::{LoadError, Place};

use crate::scene::Scene;
use std::path::Path;

/// What the caller chooses about loading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Camera's name, for files that hold several; else the first.
    pub camera: Option<String>,
    /// Time in seconds at which keyframes are evaluated.
    pub frame_time: f64,
    /// The caller will set [`Scene::environment`] itself: no light in the file is then neither an error nor replaced.
    pub environment_follows: bool,
}

/// The formats that are read, for messages.
const FORMATS: &str = ".toml, .obj, .gltf and .glb are read";

/// Reads a scene; the format is told by the file's name.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    if !options.frame_time.is_finite() {
        return Err(LoadError::Option { problem: format!("frame time must be finite, not {}", options.frame_time) });
    }
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => toml::load(path, options),
        Some("obj") => obj::load(path, options),
        Some("gltf" | "glb") => gltf::load(path, options),
        _ => {
            // A wrong path is the likelier slip: say that first.
            let metadata = std::fs::metadata(path).map_err(|error| LoadError::unreadable(path, &error))?;
            if metadata.is_dir() {
                let problem = "is a directory, not a scene file".to_owned();
                return Err(LoadError::Unreadable { file: path.to_owned(), problem });
            }
            let kind = extension.map_or("without extension".to_owned(), |extension| format!(".{extension}"));
            Err(LoadError::unsupported(path, format_args!("not a scene format that is read ({kind}): {FORMATS}")))
        }
    }
}

/// Luminance of linear Rec.709 RGB relative to RGB (1, 1, 1).
fn luminance(color: glam::Vec3) -> f32 {
    color.dot(glam::Vec3::new(0.2126, 0.7152, 0.0722))
}
