//! Maps beside a picture: where its samples went, and what can still be seen of its noise.

use anyhow::{Result, bail};
use fechner::adaptive::Rendered;
use fechner::output::false_colour::{self, Colours};
use fechner::output::{self, PictureFormat};
use fechner_perception::Plane;
use std::path::{Path, PathBuf};

/// One map that is asked for.
#[derive(Clone, Debug)]
pub(super) struct MapTarget {
    layer: MapLayer,
    file: PathBuf,
}

/// Tells whether a map can be written, before what it shows is made: it is a picture to look at.
pub(super) fn check_map(path: &Path) -> Result<()> {
    if output::check_target(path)? != PictureFormat::Png {
        bail!("{}: --map writes a picture to look at; end the name in .png", path.display());
    }
    Ok(())
}

/// What a map can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MapLayer {
    Samples,
    Threshold,
    Visibility,
}

impl MapLayer {
    const ALL: [(&str, Self); 3] =
        [("samples", Self::Samples), ("threshold", Self::Threshold), ("visibility", Self::Visibility)];
}

impl MapTarget {
    /// Reads `LAYER=FILE`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            let names = MapLayer::ALL.map(|(name, _)| name).join(", ");
            format!("\"{text}\" is not a map; expected LAYER=FILE.png, with a layer among {names}")
        };
        let (layer, file) = text.split_once('=').ok_or_else(wrong)?;
        let &(_, layer) = MapLayer::ALL.iter().find(|(name, _)| *name == layer).ok_or_else(wrong)?;
        Ok(Self { layer, file: PathBuf::from(file) })
    }

    /// The file to write.
    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    /// Writes it, and says what its colours mean.
    pub(super) fn write(&self, rendered: &Rendered, target: f64) -> Result<String> {
        let film = &rendered.film;
        let colours = self.colours(rendered, target);
        output::write_codes_png(&self.file, film.width(), film.height(), &colours.rgb8)?;
        Ok(format!("{}: {}", self.file.display(), colours.legend))
    }

    fn colours(&self, rendered: &Rendered, target: f64) -> Colours {
        let Rendered { film, judgement, .. } = rendered;
        let width = film.width() as usize;
        match self.layer {
            MapLayer::Samples => {
                let samples = |x, y| film.samples(y * width + x) as f32;
                let counts = Plane::from_fn(width, film.height() as usize, samples);
                false_colour::logarithmic(&counts, "samples")
            }
            MapLayer::Threshold => false_colour::logarithmic(&judgement.allowed_standard_error_cd_m2(), "cd/m²"),
            MapLayer::Visibility => false_colour::visibility(&judgement.predicted, target),
        }
    }
}
