//! A sheet of small pictures, one for each tone operator, with its name below.

use super::SceneFrame;
use fechner_perception::Viewing;
use fechner_perception::tone::{self, ToneSettings};
use font8x8::UnicodeFonts as _;

/// Linear display RGB, row by row.
pub(super) struct Sheet {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<[f32; 3]>,
}

const COLUMNS: usize = 4;
/// Longest side of a small picture.
const LONGEST_PX: usize = 400;
const GAP_PX: usize = 8;
const GLYPH_PX: usize = 8;
/// A label: glyphs twice as large as they are, and air.
const LABEL_PX: usize = 2 * GLYPH_PX + 8;
const BACKGROUND: [f32; 3] = [0.02; 3];
const INK: [f32; 3] = [0.6; 3];

/// The picture through every operator, each fitted to it at full size.
pub(super) fn of_all_operators(frame: &SceneFrame, viewing: &Viewing, settings: &ToneSettings) -> Sheet {
    let names = tone::operator_names();
    let step = frame.width.max(frame.height()).div_ceil(LONGEST_PX).max(1);
    let (width, height) = (frame.width.div_ceil(step), frame.height().div_ceil(step));
    // A long name must fit below a narrow picture.
    let longest = names.iter().map(|name| name.len()).max().unwrap_or(0);
    let cell = (width.max(longest * 2 * GLYPH_PX) + GAP_PX, height + LABEL_PX + GAP_PX);
    let mut sheet = Sheet::empty(COLUMNS * cell.0 + GAP_PX, names.len().div_ceil(COLUMNS) * cell.1 + GAP_PX);
    for (index, name) in names.iter().enumerate() {
        let Some(operator) = tone::operator_with(name, settings) else { continue };
        let fitted = operator.fit(&frame.guide_for(operator.as_ref()), viewing, None);
        let small = reduced(&frame.shown(fitted.as_ref()), frame.width, step);
        let (left, top) = (GAP_PX + index % COLUMNS * cell.0, GAP_PX + index / COLUMNS * cell.1);
        sheet.paste(&small, width, left, top);
        sheet.write(name, left, top + height + 4);
    }
    sheet
}

/// Means of squares of `step` × `step` pixels.
fn reduced(rgb: &[[f32; 3]], width: usize, step: usize) -> Vec<[f32; 3]> {
    let height = rgb.len() / width.max(1);
    let mut small = Vec::with_capacity(width.div_ceil(step) * height.div_ceil(step));
    for top in (0..height).step_by(step) {
        for left in (0..width).step_by(step) {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for y in top..(top + step).min(height) {
                for pixel in &rgb[y * width + left..y * width + (left + step).min(width)] {
                    for (sum, channel) in sum.iter_mut().zip(pixel) {
                        *sum += channel;
                    }
                    count += 1.0;
                }
            }
            small.push(sum.map(|sum| sum / count));
        }
    }
    small
}

impl Sheet {
    fn empty(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![BACKGROUND; width * height] }
    }

    fn paste(&mut self, rgb: &[[f32; 3]], width: usize, left: usize, top: usize) {
        for (y, row) in rgb.chunks(width).enumerate() {
            let at = (top + y) * self.width + left;
            self.rgb[at..at + row.len()].copy_from_slice(row);
        }
    }

    fn write(&mut self, text: &str, left: usize, top: usize) {
        for (index, letter) in text.chars().enumerate() {
            let glyph = font8x8::BASIC_FONTS.get(letter).unwrap_or_default();
            for (y, line) in glyph.iter().enumerate() {
                for x in (0..GLYPH_PX).filter(|x| line >> x & 1 == 1) {
                    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        let (px, py) = (left + 2 * (index * GLYPH_PX + x) + dx, top + 2 * y + dy);
                        if px < self.width && py < self.height {
                            self.rgb[py * self.width + px] = INK;
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_keep_the_mean_and_take_the_rest_at_the_borders() {
        let rgb: Vec<[f32; 3]> = (0..15).map(|i| [i as f32; 3]).collect();
        let small = reduced(&rgb, 5, 2);
        assert_eq!(small.iter().map(|pixel| pixel[0]).collect::<Vec<_>>(), [3.0, 5.0, 6.5, 10.5, 12.5, 14.0]);
    }

    #[test]
    fn every_letter_of_a_name_has_ink() {
        for name in tone::operator_names() {
            for letter in name.chars() {
                let mut sheet = Sheet::empty(20, 20);
                sheet.write(&letter.to_string(), 2, 2);
                assert!(sheet.rgb.contains(&INK), "{letter}");
            }
        }
    }
}
