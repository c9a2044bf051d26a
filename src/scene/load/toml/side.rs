//! The side file: `scene.fechner.toml` beside a scene of another format adds what that format lacks.
//!
//! It may hold `nits_per_unit`, `[film]`, `[view]`, `[camera]` (with keyframes), `[environment]` and `[[lights]]`, all
//! as in our own format. Camera and environment take the place of the scene's, lights are added to them; a camera of
//! which only `shutter_s` is given leaves the scene's own in place and blurs what moves in glTF.

use super::fields::{Fields, Source, Value};
use super::{animated, camera, light, read_film, read_unit, read_view, surroundings};
use crate::read_file;
use crate::scene::load::error::LoadError;
use crate::scene::load::{LoadOptions, NO_CAMERA, Shutter, files};
use crate::scene::{Scene, ViewingDefaults};
use std::path::{Path, PathBuf};

const KNOWN: [&str; 6] = ["nits_per_unit", "film", "view", "camera", "environment", "lights"];

/// The side file of a scene, if there is one with something in it. What has its name and is no file is refused: a link
/// that leads nowhere was meant to bring lights and a camera.
pub(in crate::scene::load) fn of(scene: &Path) -> Result<Option<PathBuf>, LoadError> {
    let beside = side_file(scene);
    if std::fs::symlink_metadata(&beside).is_err() {
        return Ok(None);
    }
    let file = read_file::check(&beside).map_err(|error| LoadError::unreadable(&beside, &error))?;
    Ok((file.len() > 0).then_some(beside))
}

/// Where the side file of a scene is, or would be.
pub fn side_file(scene: &Path) -> PathBuf {
    scene.with_extension("fechner.toml")
}

/// The options with what the side file says of how its scene is read: its unit and size where the caller names none,
/// whether light follows, and for how many seconds its camera keeps the shutter open.
pub(in crate::scene::load) fn before(path: &Path, options: &LoadOptions) -> Result<LoadOptions, LoadError> {
    with_root(path, 0.0, |root| {
        let film = root.get("film").map(|film| read_film(&film)).transpose()?;
        let shutter_s = match root.get("camera") {
            None => None,
            Some(camera) => camera.entries()?.get_some("shutter_s", |seconds| seconds.non_negative())?,
        };
        let brings_light = root.get("environment").is_some() || root.get("lights").is_some();
        Ok(LoadOptions {
            environment_follows: options.environment_follows || brings_light,
            shutter_s: shutter_s.unwrap_or(options.shutter_s),
            nits_per_unit: options.nits_per_unit.or(root.get_some("nits_per_unit", read_unit)?),
            film: options.film.or(film),
            ..options.clone()
        })
    })
}

/// Adds everything to the scene, which was read with the options of [`before`]. The scene's own camera stays where the
/// caller has asked for one by name.
pub(in crate::scene::load) fn apply(path: &Path, options: &LoadOptions, scene: &mut Scene) -> Result<(), LoadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    with_root(path, options.frame_time, |root| {
        if let Some(film) = root.get("film") {
            scene.film = read_film(&film)?;
        }
        if let Some(view) = root.get("view") {
            let ViewingDefaults { display, visibility, operator, exposure_stops } = read_view(&view, folder)?;
            let old = std::mem::take(&mut scene.viewing);
            scene.viewing = ViewingDefaults {
                display: display.or(old.display),
                visibility: visibility.or(old.visibility),
                operator: operator.or(old.operator),
                exposure_stops: exposure_stops.or(old.exposure_stops),
            };
        }
        // A shutter alone is one for the scene's own camera.
        let brings_camera = match root.get("camera") {
            None => false,
            Some(value) => value.entries()?.all().iter().any(|(key, _)| *key != "shutter_s"),
        };
        if let Some(value) = root.get("camera").filter(|_| brings_camera)
            && options.camera.is_none()
        {
            let stays_open = value.entries()?.get_or("shutter_s", 0.0, Value::non_negative)?;
            scene.camera = camera::read(&value, Shutter { opens: options.frame_time, stays_open })?;
            if stays_open > 0.0 {
                scene.shutter_s = stays_open;
            }
        }
        if let Some(value) = root.get("environment") {
            let surroundings = surroundings::read(&value, folder, scene.nits_per_unit, &mut scene.notes)?;
            scene.surround(surroundings.environment, surroundings.sun);
        }
        if let Some(list) = root.get("lights") {
            let mut reader = light::Reader::new(folder, scene.nits_per_unit);
            for value in list.array()? {
                scene.lights.push(reader.read(&value)?);
            }
            scene.notes.append(&mut reader.notes);
        }
        // What was assumed is no longer true.
        if brings_camera {
            scene.notes.retain(|note| note != NO_CAMERA);
        }
        Ok(())
    })
}

/// `seconds` is the time for keyframes of lights.
fn with_root<T>(path: &Path, seconds: f64, read: impl FnOnce(&Fields) -> Result<T, LoadError>) -> Result<T, LoadError> {
    let text = files::read_text(path)?;
    let source = Source::new(path, &text);
    let snapshots = animated::snapshots(&source, seconds)?;
    let document = animated::parse(&source, &snapshots)?;
    let root = Fields::root(&source, document.get_ref(), &KNOWN)?;
    read(&root)
}
