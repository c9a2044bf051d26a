//! A contact sheet: the frames of a shot, small, in one picture. Of long shots only some frames are on it.

use anyhow::Result;
use fechner::output::write_png;
use fechner_perception::display::Eotf;
use std::path::Path;

/// Most frames on a sheet; of longer shots as many, evenly spread, with the first and the last.
const MAX_FRAMES: usize = 48;
/// About how wide a sheet is, pixels.
const SHEET_WIDTH: usize = 1600;
/// Pixels between frames.
const GAP: usize = 4;

/// Numbers, from 0, of the frames that stand on the sheet of a shot of `count`.
pub(super) fn on_sheet(count: usize) -> impl Iterator<Item = usize> {
    let shown = count.min(MAX_FRAMES);
    (0..shown).map(move |place| if shown > 1 { place * (count - 1) / (shown - 1) } else { 0 })
}

/// A sheet that is filled frame by frame, in linear light.
pub(super) struct ContactSheet {
    frame_size: (usize, usize),
    tile_size: (usize, usize),
    columns: usize,
    width: usize,
    pixels: Vec<[f32; 3]>,
    filled: usize,
}

impl ContactSheet {
    /// A sheet for so many frames of a size in pixels; as many columns as rows.
    pub(super) fn new(count: usize, (frame_width, frame_height): (usize, usize)) -> Self {
        let columns = (1..).find(|columns| columns * columns >= count).unwrap_or(1);
        let tile_width = (SHEET_WIDTH / columns).min(frame_width).max(1);
        let tile_height = (tile_width * frame_height / frame_width).max(1);
        let rows = count.div_ceil(columns);
        let (width, height) = (columns * (tile_width + GAP) + GAP, rows * (tile_height + GAP) + GAP);
        Self {
            frame_size: (frame_width, frame_height),
            tile_size: (tile_width, tile_height),
            columns,
            width,
            pixels: vec![[0.02; 3]; width * height],
            filled: 0,
        }
    }

    /// Puts the next frame in its place: sRGB bytes, averaged in linear light.
    pub(super) fn add(&mut self, rgb8: &[u8]) {
        let linear: Vec<f32> = (0..=255).map(|code| Eotf::Srgb.decode(f64::from(code) / 255.0, 1.0) as f32).collect();
        let ((width, height), (tile_width, tile_height)) = (self.frame_size, self.tile_size);
        let (column, row) = (self.filled % self.columns, self.filled / self.columns);
        self.filled += 1;
        let corner = (GAP + row * (tile_height + GAP)) * self.width + GAP + column * (tile_width + GAP);
        let covered = |place: usize, tile: usize, frame: usize| {
            let first = place * frame / tile;
            first..((place + 1) * frame / tile).max(first + 1)
        };
        for y in 0..tile_height {
            for x in 0..tile_width {
                let mut sum = [0.0f32; 3];
                let mut count = 0.0;
                for source_y in covered(y, tile_height, height) {
                    for source_x in covered(x, tile_width, width) {
                        let at = 3 * (source_y * width + source_x);
                        for (sum, &code) in sum.iter_mut().zip(&rgb8[at..at + 3]) {
                            *sum += linear[usize::from(code)];
                        }
                        count += 1.0;
                    }
                }
                self.pixels[corner + y * self.width + x] = sum.map(|sum| sum / count);
            }
        }
    }

    /// Writes it as a PNG.
    pub(super) fn write(&self, path: &Path) -> Result<()> {
        write_png(path, self.width as u32, (self.pixels.len() / self.width) as u32, &self.pixels)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_shots_are_spread() {
        assert_eq!(on_sheet(3).collect::<Vec<_>>(), [0, 1, 2]);
        let spread: Vec<usize> = on_sheet(1000).collect();
        assert!(spread.len() == MAX_FRAMES && spread[0] == 0 && spread[MAX_FRAMES - 1] == 999);
        assert_eq!(on_sheet(1).collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn frames_stand_in_their_places() {
        let mut sheet = ContactSheet::new(3, (2, 1));
        sheet.add(&[255, 0, 0, 255, 0, 0]);
        sheet.add(&[0; 6]);
        sheet.add(&[0, 0, 255, 0, 0, 0]);
        let width = 2 * (2 + GAP) + GAP;
        assert_eq!((sheet.width, sheet.pixels.len()), (width, width * (2 * (1 + GAP) + GAP)));
        let at = |x: usize, y: usize| sheet.pixels[y * width + x];
        assert_eq!(at(GAP, GAP), [1.0, 0.0, 0.0]);
        assert_eq!(at(GAP + 2 + GAP, GAP), [0.0; 3]);
        assert_eq!(at(GAP, GAP + 1 + GAP), [0.0, 0.0, 1.0]);
        assert_eq!(at(0, 0), [0.02; 3]);
    }
}
