//! The scenes of a shot, read from a file at each time.

use super::AnimateArguments;
use fechner::animate::SceneSource;
use fechner::scene::Scene;
use fechner::scene::load::{LoadError, LoadOptions, load};

/// A scene file with what the command line puts into it.
pub(super) struct FileSource<'a> {
    arguments: &'a AnimateArguments,
}

impl<'a> FileSource<'a> {
    pub(super) fn new(arguments: &'a AnimateArguments) -> Self {
        Self { arguments }
    }
}

impl SceneSource for FileSource<'_> {
    fn at(&self, seconds: f64) -> Result<Scene, LoadError> {
        let AnimateArguments { scene: file, camera, staging, nits_per_unit, .. } = self.arguments;
        let options = LoadOptions {
            camera: camera.clone(),
            frame_time: seconds,
            environment_follows: staging.has_environment(),
            on_texture: None,
        };
        let mut scene = load(file, &options)?;
        staging
            .apply(&mut scene, *nits_per_unit)
            .map_err(|error| LoadError::Option { problem: format!("{error:#}") })?;
        Ok(scene)
    }
}
