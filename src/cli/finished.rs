//! A render that came to its end, and the files that it is written to: each is tried, whatever became of the others.

use super::picture::{LIGHT_RAISES_ALPHA, note};
use super::report::Report;
use super::words::in_a_line;
use anyhow::bail;
use fechner::adaptive::Rendered;
use fechner::adaptive::settings::LoopSettings;
use fechner::json_file;
use fechner::output::rendered::Background;
use fechner::output::{self, PartOf, PictureFormat};
use serde::Serialize;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A render that came to its end, by which settings, and what is said of it.
#[derive(Clone, Copy)]
pub(super) struct Finished<'a> {
    pub(super) rendered: &'a Rendered,
    pub(super) settings: &'a LoopSettings,
    pub(super) report: &'a Report,
}

/// Where a render's picture is to be, and as what.
#[derive(Clone, Copy)]
pub(super) struct PictureTarget<'a> {
    pub(super) path: &'a Path,
    pub(super) format: PictureFormat,
    pub(super) background: Background,
    /// Where it lies in a whole, which a PNG does not say.
    pub(super) part_of: Option<PartOf>,
}

impl PictureTarget<'_> {
    /// Writes the picture.
    pub(super) fn write(&self, finished: Finished) -> anyhow::Result<()> {
        let Finished { rendered, settings, report } = finished;
        let Self { path, format, background, part_of } = *self;
        match format {
            PictureFormat::Png => {
                if output::rendered::write_display_png(path, rendered, &settings.viewing.display, background)? {
                    note(path, LIGHT_RAISES_ALPHA);
                }
            }
            PictureFormat::Exr => {
                let attributes = report.attributes();
                output::rendered::write_layers_exr(path, rendered, settings, background, &attributes, part_of)?;
            }
        }
        Ok(())
    }

    /// Writes the picture, or somewhere else where that fails, which the error says: its samples took long.
    pub(super) fn write_here_or_elsewhere(&self, finished: Finished) -> anyhow::Result<()> {
        let write = |path: &Path| PictureTarget { path, ..*self }.write(finished);
        write(self.path).map_err(|error| kept_elsewhere(self.path, write, error))
    }
}

/// Writes a picture that cannot be where it should into a new folder among temporary files, and says so. Others may
/// write there too, and must not know the folder's name beforehand.
fn kept_elsewhere(path: &Path, write: impl Fn(&Path) -> anyhow::Result<()>, error: anyhow::Error) -> anyhow::Error {
    // Names may be longer where it should be than among temporary files.
    let name = output::shortened_name(path.file_name().unwrap_or(OsStr::new("picture")));
    let keep = || -> anyhow::Result<PathBuf> {
        let folder = tempfile::Builder::new().prefix("fechner-").tempdir()?;
        write(&folder.path().join(&name))?;
        Ok(folder.keep().join(&name))
    };
    match keep() {
        Ok(elsewhere) => error.context(format!("the picture is in {}", elsewhere.display())),
        Err(_) => error,
    }
}

/// Writes figures, where somebody wants them.
pub(super) fn write_figures(path: Option<&Path>, figures: &impl Serialize) -> anyhow::Result<()> {
    path.map_or(Ok(()), |path| Ok(json_file::write(path, figures)?))
}

/// All that could not be written, in one error.
pub(super) fn all_written(files: impl IntoIterator<Item = anyhow::Result<()>>) -> anyhow::Result<()> {
    let failures: Vec<String> = files.into_iter().filter_map(Result::err).map(|error| in_a_line(&error)).collect();
    if failures.is_empty() { Ok(()) } else { bail!(failures.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    /// Regression: a name that was too long for its folder was too long for the other as well, and the picture was
    /// lost.
    #[test]
    fn a_picture_of_a_long_name_is_kept_elsewhere() {
        let long = PathBuf::from(format!("{}.exr", "w".repeat(252)));
        let write = |path: &Path| Ok(std::fs::write(path, "light")?);
        let said = kept_elsewhere(&long, write, anyhow!("no room")).to_string();
        let kept = Path::new(said.strip_prefix("the picture is in ").expect("where it is"));
        assert_eq!(std::fs::read_to_string(kept).expect("written"), "light");
        std::fs::remove_dir_all(kept.parent().expect("a folder")).expect("removed");
    }
}
