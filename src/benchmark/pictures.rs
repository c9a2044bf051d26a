//! What the report shows of a render: the picture, its counts, and what can truly be seen of its error.

use super::Subject;
use crate::film::Film;
use crate::output::write_png;
use anyhow::Result;
use fechner_perception::{Eotf, Plane};
use std::path::{Path, PathBuf};

/// File endings and titles.
const KINDS: [(&str, &str); 3] = [
    ("picture", "as displayed"),
    ("samples", "samples a pixel (log scale, 16 to 16384)"),
    ("visible", "true v / v*, 0 to 2"),
];

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
    let counts: Vec<[f32; 3]> = counts.map(|share| heat(share as f32)).collect();
    let target = subject.visibility as f32;
    let visible: Vec<[f32; 3]> = squared_visibility.values().iter().map(|v| heat(v.sqrt() / target / 2.0)).collect();
    for ((ending, _), rgb) in KINDS.iter().zip([picture, &counts, &visible]) {
        write_png(&file(record, ending), width, height, rgb)?;
    }
    Ok(())
}

/// Titles and bytes of the pictures beside a record; empty if they are not there.
pub(crate) fn read_pictures(record: &Path) -> Vec<(String, Vec<u8>)> {
    let read = |(ending, title): &(&str, &str)| Some(((*title).to_owned(), std::fs::read(file(record, ending)).ok()?));
    KINDS.iter().filter_map(read).collect()
}

fn file(record: &Path, ending: &str) -> PathBuf {
    record.with_extension(format!("{ending}.png"))
}

/// Linear light of a share of 0..1 in the colour map of FLIP.
fn heat(share: f32) -> [f32; 3] {
    let index = (share.clamp(0.0, 1.0) * 255.0) as usize;
    flip_rs::MAGMA[index].map(|code| Eotf::Srgb.decode(f64::from(code), 1.0) as f32)
}
