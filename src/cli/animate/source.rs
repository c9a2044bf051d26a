//! The scenes of a shot, read from a file at each time. The last three are kept, since a frame shares its
//! neighbours with the next.

use super::AnimateArguments;
use fechner::animate::SceneSource;
use fechner::poison::Unpoisoned as _;
use fechner::scene::Scene;
use fechner::scene::load::{LoadError, LoadOptions, load};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Scenes that are kept: a frame and both its neighbours, of which the next frame needs two.
const KEPT: usize = 3;

/// A scene file with what the command line puts into it.
pub(super) struct FileSource<'a> {
    arguments: &'a AnimateArguments,
    /// The last scenes that were read and their times, oldest first.
    kept: Mutex<VecDeque<(f64, Arc<Scene>)>>,
}

impl<'a> FileSource<'a> {
    pub(super) fn new(arguments: &'a AnimateArguments) -> Self {
        Self { arguments, kept: Mutex::default() }
    }

    fn read(&self, seconds: f64) -> Result<Scene, LoadError> {
        let AnimateArguments { scene: file, staging, nits_per_unit, size, .. } = self.arguments;
        let options = staging.load_options(seconds, *nits_per_unit, *size);
        let mut scene = load(file, &LoadOptions { frame_s: Some(self.arguments.fps.recip()), ..options })?;
        staging.apply(&mut scene).map_err(|error| LoadError::Option { problem: format!("{error:#}") })?;
        Ok(scene)
    }
}

impl SceneSource for FileSource<'_> {
    fn at(&self, seconds: f64) -> Result<Arc<Scene>, LoadError> {
        let kept = || self.kept.lock().unpoisoned();
        if let Some((_, scene)) = kept().iter().find(|(time, _)| *time == seconds) {
            return Ok(Arc::clone(scene));
        }
        let scene = Arc::new(self.read(seconds)?);
        let mut kept = kept();
        while kept.len() >= KEPT {
            kept.pop_front();
        }
        kept.push_back((seconds, Arc::clone(&scene)));
        Ok(scene)
    }
}
