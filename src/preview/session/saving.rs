//! Writes pictures that a viewer asks for where fechner was started.

use super::Session;
use super::problems::Cause;
use crate::adaptive::{LastLook, Rendered, StopReason};
use crate::output::PictureFormat;
use crate::preview::command::Phase;
use std::path::PathBuf;

impl Session<'_> {
    /// Writes the picture so far under a name that is free.
    pub(super) fn save(&mut self, format: PictureFormat) {
        if self.state.film.total_samples() == 0 {
            self.problems.meet(Cause::Save, "not saved: the picture has no samples yet".to_owned());
            return;
        }
        let was_looked_at = self.rest_look.last.is_some();
        let Some(LastLook { judgement, stop_reason }) = self.rest_look.last.take().or_else(|| self.look_to_save())
        else {
            self.problems.meet(Cause::Save, "not saved: the picture cannot be looked at".to_owned());
            return;
        };
        let path = self.free_name(format);
        let rendered = Rendered::new(self.state.clone(), judgement, stop_reason);
        match self.host.save(&path, &rendered, &self.settings) {
            Ok(()) => {
                self.problems.solve(Cause::Save);
                self.note = Some(format!("saved {}", path.display()));
            }
            Err(problem) => self.problems.meet(Cause::Save, problem),
        }
        let Rendered { judgement, stop_reason, .. } = rendered;
        if was_looked_at {
            self.rest_look.last = Some(LastLook { judgement, stop_reason });
        } else if matches!(self.phase, Phase::Paused | Phase::Stopped) {
            self.looked_at_rest(judgement);
        }
    }

    /// Looks at the film whoever wants another picture meanwhile: what is to be kept is kept first.
    fn look_to_save(&mut self) -> Option<LastLook> {
        let is_cancelled = self.settings.is_cancelled.take();
        let judgement = self.look();
        self.settings.is_cancelled = is_cancelled;
        let judgement = judgement?;
        let stop_reason = self.reason_to_rest(&judgement).unwrap_or(StopReason::Interrupted);
        Some(LastLook { judgement, stop_reason })
    }

    /// The scene file's name and the first free number, in the working folder.
    fn free_name(&self, format: PictureFormat) -> PathBuf {
        let stem = self.host.scene_file().file_stem().map_or_else(|| "view".into(), |stem| stem.to_string_lossy());
        let ending = format.ending();
        let name = |number: u32| PathBuf::from(format!("{stem}-{number}.{ending}"));
        // A link that leads nowhere is somebody's name, too.
        (1..).map(name).find(|path| path.symlink_metadata().is_err()).unwrap_or_else(|| name(0))
    }
}
