//! What the report shows of a render: the picture, its counts, and what can truly be seen of its error. How they stand
//! on a page is left to `report`.

use super::Subject;
use crate::film::Film;
use crate::output::false_colour::heat;
use crate::output::write_png;
use anyhow::Result;
use fechner_perception::{Eotf, Plane};
use std::path::{Path, PathBuf};

/// A kind of picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kind {
    ending: &'static str,
    pub(crate) title: &'static str,
    /// What the colours of a map mean, from the least to the greatest, evenly spaced; none of a picture as displayed.
    pub(crate) scale: &'static [&'static str],
}

const KINDS: [Kind; 3] = [
    Kind { ending: "picture", title: "as displayed", scale: &[] },
    Kind { ending: "samples", title: "samples a pixel", scale: &["≤ 16", "64", "256", "1024", "4096", "≥ 16384"] },
    Kind { ending: "visible", title: "true v / v*", scale: &["0", "0.5", "1", "1.5", "≥ 2"] },
];

/// A picture of the report.
#[derive(Clone, Debug)]
pub(crate) struct ShownPicture {
    pub(crate) kind: Kind,
    pub(crate) png: Vec<u8>,
}

/// Writes a render's pictures beside its record.
pub(crate) fn write_pictures(
    record: &Path,
    subject: &Subject,
    film: &Film,
    picture: &[[f32; 3]],
    squared_visibility: &Plane,
) -> Result<()> {
    let (width, height) = subject.size;
    let counts = (0..picture.len()).map(|i| (f64::from(film.samples(i).max(16)) / 16.0).log2() / 10.0);
    let counts: Vec<[f32; 3]> = counts.map(heat_light).collect();
    let visible: Vec<[f32; 3]> = squared_visibility
        .values()
        .iter()
        .map(|v| heat_light(f64::from(v.sqrt()) / subject.visibility / 2.0))
        .collect();
    for (kind, rgb) in KINDS.iter().zip([picture, &counts, &visible]) {
        write_png(&file(record, kind.ending), width, height, rgb)?;
    }
    Ok(())
}

/// Whether all pictures are beside a record, with something in them.
pub(super) fn are_there(record: &Path) -> bool {
    let is_there =
        |kind: &Kind| file(record, kind.ending).metadata().is_ok_and(|file| file.is_file() && file.len() > 0);
    KINDS.iter().all(is_there)
}

/// The pictures beside a record; empty if they are not there.
pub(super) fn read_pictures(record: &Path) -> Vec<ShownPicture> {
    let read = |&kind: &Kind| Some(ShownPicture { kind, png: std::fs::read(file(record, kind.ending)).ok()? });
    KINDS.iter().filter_map(read).collect()
}

fn file(record: &Path, ending: &str) -> PathBuf {
    record.with_extension(format!("{ending}.png"))
}

/// The colour map's codes of sRGB, 0..1, at so many even steps from its least to its greatest.
pub(super) fn heat_codes(steps: usize) -> impl Iterator<Item = [f32; 3]> {
    (0..=steps).map(move |step| heat(step as f64 / steps.max(1) as f64))
}

/// Linear light of a share of 0..1 in the colour map.
fn heat_light(share: f64) -> [f32; 3] {
    heat(share).map(|code| Eotf::Srgb.decode(f64::from(code), 1.0) as f32)
}
