//! Reading scenes: one file a format, all ending in the same [`Scene`].
//!
//! # What each format lacks, and what is assumed
//!
//! | format | lacks | assumed |
//! | --- | --- | --- |
//! | our TOML | nothing; a scene without any light is an error | without `[camera]`: a three-quarter view of everything |
//! | OBJ + MTL | camera, lights, units of `Ke` and of length | framed view, studio sky, `Ke` 1 is 1 unit of radiance |
//! | PLY | everything but the mesh | the same, in grey |
//! | pbrt-v4 | units of radiance, unless its lights are photometric | RGB 1 is 100 cd/m² |
//! | Mitsuba XML | units of radiance | RGB 1 is 100 cd/m² |
//! | glTF 2.0, GLB | environment light; often camera and lights | the same; units are cd/m², cd, lx as specified |
//!
//! What was assumed or left out is said in [`Scene::notes`].
//!
//! # What a loaded scene promises
//!
//! Indices are in range, positions finite and below 1e15, normals unit or absent, texture coordinates finite, instance
//! transforms invertible, ids of meshes, materials and textures valid, and there is something to render. Damaged,
//! hostile or oversized files end in a [`LoadError`] of one line; none panics or takes memory out of proportion.

mod adjust;
mod builder;
mod bump;
mod default_view;
pub mod environment;
mod error;
mod files;
mod framing;
mod gltf;
mod ies;
mod lines;
pub mod metals;
mod mitsuba;
mod mtl;
mod notes;
mod obj;
mod pbrt;
mod ply;
mod polygon;
pub mod shapes;
pub mod sky;
mod spectrum;
mod tangents;
#[cfg(test)]
mod tests;
mod texture;
mod texture_memory;
mod toml;
mod validate;

pub use builder::NO_CAMERA;
pub use default_view::{Bounds, bounds, framed};
pub use error::{LoadError, Place};
pub use files::{count_as_read, files_read, was_read};
pub use toml::side::side_file;

use crate::scene::{FilmDefaults, Instance, ScalarInput, Scene};
use std::path::Path;

/// What the caller chooses about loading.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Camera's name, for files that hold several; else the first.
    pub camera: Option<String>,
    /// Time in seconds at which keyframes are evaluated.
    pub frame_time: f64,
    /// Seconds for which the shutter stays open from then on where the file's format cannot say (a side file's camera
    /// can).
    pub shutter_s: f64,
    /// Seconds of a frame, where the scene is one of a shot: a shutter that stays open for longer is noted.
    pub frame_s: Option<f64>,
    /// The caller will set [`Scene::environment`] itself: no light in the file is then neither an error nor replaced.
    pub environment_follows: bool,
    /// Told after each decoded picture how many are done, and of how many; from several threads.
    pub on_texture: Option<fn(done: usize, total: usize)>,
    /// Most bytes that decoded textures may take together: beyond it the largest are halved. Surroundings do not count.
    pub texture_memory: Option<u64>,
    /// Luminance in cd/m² of RGB (1, 1, 1) in place of the file's. What files give in cd/m², lm and lx stays as bright
    /// as it is, but for the photometric amounts of pbrt's files, which scale with all their other light.
    pub nits_per_unit: Option<f64>,
    /// Size of the picture, in place of the file's, for which default views are framed.
    pub film: Option<FilmDefaults>,
}

/// When the shutter is open, in seconds of a file's keyframes.
#[derive(Clone, Copy, Debug)]
struct Shutter {
    opens: f64,
    /// 0 for a picture of one moment.
    stays_open: f64,
}

/// Bytes of so many megabytes.
pub fn megabytes(count: u32) -> u64 {
    1_000_000 * u64::from(count)
}

/// The formats that are read, for messages.
const FORMATS: &str = ".toml, .obj, .ply, .gltf, .glb, .pbrt and .xml (Mitsuba) are read";

/// Reads a scene; the format is told by the file's name. A file `NAME.fechner.toml` beside `NAME.gltf` (or any other
/// foreign scene) adds display, units, lights, camera and keyframes to it.
///
/// # Errors
/// Where the scene or a file that it names cannot be read, or says what cannot be rendered.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    if !options.frame_time.is_finite() {
        return Err(LoadError::Option { problem: format!("frame time must be finite, not {}", options.frame_time) });
    }
    load_at_time(path, options).map_err(|fault| {
        // Files are right or wrong as a whole more often than at a time, and are quickly read where they are wrong.
        let at_start = LoadOptions { frame_time: 0.0, ..options.clone() };
        match options.frame_time != 0.0 && load_at_time(path, &at_start).is_ok() {
            true => LoadError::AtTime { seconds: options.frame_time, fault: Box::new(fault) },
            false => fault,
        }
    })
}

fn load_at_time(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let is_foreign = path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("toml"));
    let side = if is_foreign { toml::side::of(path)? } else { None };
    let Some(side) = side else { return load_alone(path, options) };
    let options = &toml::side::before(&side, options)?;
    let mut scene = load_alone(path, options)?;
    toml::side::apply(&side, options, &mut scene)?;
    Ok(scene)
}

fn load_alone(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => toml::load(path, options),
        Some("obj") => obj::load(path, options),
        Some("gltf" | "glb") => gltf::load(path, options),
        Some("pbrt") => pbrt::load(path, options),
        Some("xml") => mitsuba::load(path, options),
        // geometry.pbrt.gz and scene.xml.gz
        Some("gz") if stem_ends_with(path, "pbrt") => pbrt::load(path, options),
        Some("gz") if stem_ends_with(path, "xml") => mitsuba::load(path, options),
        Some("ply") => load_ply(path, options),
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

/// Refuses files that make many meshes out of few words: thirty bytes can ask for a sphere of ten thousand vertices.
fn check_made_vertices(path: &Path, vertices: usize) -> Result<(), LoadError> {
    const MAX_VERTICES: usize = 40_000_000;
    if vertices <= MAX_VERTICES {
        return Ok(());
    }
    Err(LoadError::too_large(
        path,
        format_args!("its spheres, disks and the like need more than {MAX_VERTICES} vertices"),
    ))
}

/// Refuses files that place things without end: few words can place a large group often, and include a file that
/// includes others.
fn check_placed(path: &Path, things: usize) -> Result<(), LoadError> {
    const MAX_THINGS: usize = 4_000_000;
    if things <= MAX_THINGS {
        return Ok(());
    }
    Err(LoadError::too_large(path, format_args!("more than {MAX_THINGS} placed meshes, spheres and lights")))
}

fn stem_ends_with(path: &Path, extension: &str) -> bool {
    Path::new(path.file_stem().unwrap_or_default())
        .extension()
        .is_some_and(|inner| inner.eq_ignore_ascii_case(extension))
}

/// A mesh alone, in grey.
fn load_ply(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let mut builder = builder::Builder::new(path, options);
    let loaded = ply::read(path)?;
    loaded.notes.into_iter().for_each(|note| builder.note(note));
    let material = mtl::default_material(&mut builder);
    let name = loaded.mesh.name.clone();
    let mesh = builder.add_mesh(loaded.mesh);
    builder.instances.push(Instance { name, mesh, material, to_world: glam::Affine3A::IDENTITY, motion: None });
    builder.finish(path, builder::IfDark::Studio, options)
}

/// Luminance of linear Rec.709 RGB relative to RGB (1, 1, 1).
fn luminance(color: glam::Vec3) -> f32 {
    fechner_perception::photometry::luminance(color.to_array())
}

/// A number that ends at 0 and 1. A picture times its factor ends there once both are multiplied, so that its factor
/// may be any.
fn share(input: ScalarInput) -> ScalarInput {
    let most = if input.texture.is_some() { f32::MAX } else { 1.0 };
    ScalarInput { factor: input.factor.clamp(0.0, most), ..input }
}

/// Linear Rec.709 RGB without negative channels: a colour outside it is mixed with the grey of its own luminance. What
/// is not finite is left to those who refuse it.
fn within_rec709(color: glam::Vec3) -> glam::Vec3 {
    if color.is_finite() { fechner_perception::tone::gamut::light(color.to_array()).into() } else { color }
}
