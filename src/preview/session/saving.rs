//! Pictures that a viewer asks for, written where fechner was started.

use super::Session;
use super::problems::Cause;
use crate::adaptive::judge::Judgement;
use crate::adaptive::{LastLook, Rendered, StopReason};
use crate::preview::command::SavedFormat;
use std::path::PathBuf;

impl Session<'_> {
    /// Writes the picture so far under a name that is free.
    pub(super) fn save(&mut self, format: SavedFormat) {
        if self.state.film.total_samples() == 0 {
            self.problems.meet(Cause::Save, "not saved: the picture has no samples yet".to_owned());
            return;
        }
        let was_stopped = self.last_look.is_some();
        let last_look = match self.last_look.take() {
            Some(last_look) => last_look,
            None => {
                let Some(judgement) = self.look_to_the_end() else {
                    self.problems.meet(Cause::Save, "not saved: the picture cannot be looked at".to_owned());
                    return;
                };
                LastLook { judgement, stop_reason: StopReason::Interrupted }
            }
        };
        let path = self.free_name(format);
        let rendered = Rendered::new(self.state.clone(), last_look.judgement, last_look.stop_reason);
        match self.host.save(&path, &rendered, &self.settings) {
            Ok(()) => {
                self.problems.solve(Cause::Save);
                self.note = Some(format!("saved {}", path.display()));
            }
            Err(problem) => self.problems.meet(Cause::Save, problem),
        }
        if was_stopped {
            self.last_look = Some(LastLook { judgement: rendered.judgement, stop_reason: rendered.stop_reason });
        }
    }

    /// Looks at the film whoever wants another picture meanwhile: what is to be kept is kept first.
    fn look_to_the_end(&mut self) -> Option<Judgement> {
        let is_outdated = self.settings.is_outdated.take();
        let judgement = self.look();
        self.settings.is_outdated = is_outdated;
        judgement
    }

    /// The scene file's name and the first free number, in the working folder.
    fn free_name(&self, format: SavedFormat) -> PathBuf {
        let stem = self.host.scene_file().file_stem().map_or_else(|| "view".into(), |stem| stem.to_string_lossy());
        let ending = match format {
            SavedFormat::Png => "png",
            SavedFormat::Exr => "exr",
        };
        let name = |number: u32| PathBuf::from(format!("{stem}-{number}.{ending}"));
        // A link that leads nowhere is somebody's name, too.
        (1..).map(name).find(|path| path.symlink_metadata().is_err()).unwrap_or_else(|| name(0))
    }
}
