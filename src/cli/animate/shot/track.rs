//! What is known of all frames of a shot before any is rendered: their light, and what each needs.

use super::{Shot, named_folder};
use crate::cli::console::{Counter, duration_in_words};
use crate::cli::words::count;
use anyhow::{Context as _, Result};
use fechner::adaptive::settings::Sampling;
use fechner::animate::SceneSource as _;
use fechner::animate::budget::Needs;
use fechner::animate::track::Track;
use fechner::json_file;
use fechner::output;
use fechner_perception::tone::ToneOperator;
use std::ops::RangeInclusive;
use std::path::Path;
use std::time::Instant;

impl Shot<'_> {
    /// The track that lies beside the frames, if it is of this shot and the scenes of all `wanted` frames are still
    /// those that it was made from; else a new one.
    pub(in crate::cli) fn track(&self, wanted: RangeInclusive<u32>) -> Result<Track> {
        let file = self.track_file();
        let operator = self.operator()?;
        if let Some(track) = json_file::read::<Track>(&file) {
            if self.is_up_to_date(&track, operator.as_ref(), wanted)? {
                self.make_folder()?;
                return Ok(track);
            }
            say!("{}: of other settings or another scene, made anew", file.display());
        }
        self.check_ends()?;
        if named_folder(&self.file(self.settings.first)).is_none_or(Path::exists) {
            self.make_folder()?;
        }
        let frames = (self.settings.last - self.settings.first + 1) as usize;
        let started = Instant::now();
        let looking = Counter::new("looking at frames", frames);
        let mut track = Track::make(&self.source, &self.settings, operator.as_ref(), &|done| looking.count(done))?;
        if let (Some(mean_samples), Sampling::Adaptive) = (self.settings.limits.mean_samples, self.settings.sampling) {
            track.spread(&self.needs(&track)?, mean_samples, self.settings.limits.last_rung());
        }
        self.make_folder()?;
        let seconds = started.elapsed().as_secs_f64();
        say!("found the light of {} in {}", count(frames, "frame"), duration_in_words(seconds));
        output::remove_leftovers(&file);
        json_file::write_in_a_line(&file, &track)?;
        Ok(track)
    }

    /// Reads the scenes beyond both ends, which the first and the last frame alone need: else a shot would fail at its
    /// last frame, when all others are rendered.
    fn check_ends(&self) -> Result<()> {
        let [first, last] = [self.settings.first, self.settings.last].map(f64::from);
        for (beyond, end) in [(first - 1.0, "first"), (last + 1.0, "last")] {
            let scene = self.source.at(self.settings.seconds(beyond));
            scene.with_context(|| format!("the frame beyond the {end} one, by which its motion is told"))?;
        }
        Ok(())
    }

    fn is_up_to_date(&self, track: &Track, operator: &dyn ToneOperator, wanted: RangeInclusive<u32>) -> Result<bool> {
        for frame in wanted {
            if track.of_frame(&self.settings, operator, frame, &*self.scene(frame)?).is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// What each frame of the shot needs.
    pub(in crate::cli) fn needs(&self, track: &Track) -> Result<Needs> {
        self.operator()?;
        let operator = || self.operator().expect("there was one before");
        Ok(Needs::of(&self.source, &self.settings, &operator, track)?)
    }
}
