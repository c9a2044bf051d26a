//! Small pictures in a frame of their own mirror images.
//!
//! Open Image Denoise lays black around a picture, which its filter spreads inwards: of a lone pixel half of the light
//! is lost. Not for larger ones, whose middle that does not reach.

use super::library::Size;
use std::borrow::Cow;

/// Pixels of a side from which on it has no frame.
const MIN_SIDE: usize = 16;

/// Pixels that a shorter side is brought to: 24, since by 16 light is still up to 3.6 % off, and 32 are no better
/// (`benches/results/denoising.md`).
const FRAMED_SIDE: usize = 24;

/// A picture's place in the larger one that is denoised in its stead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    picture: Size,
    framed: Size,
}

impl Frame {
    /// The frame around a picture: none to be seen where that is large enough, or has no pixels.
    pub(super) fn around(picture: Size) -> Self {
        let Size { width, height } = picture;
        let framed_side = |side: usize| if side < MIN_SIDE { FRAMED_SIDE } else { side };
        let framed = match width.min(height) {
            0 => picture,
            _ => Size { width: framed_side(width), height: framed_side(height) },
        };
        Self { picture, framed }
    }

    /// Size of picture and frame together, in pixels.
    pub(super) fn size(self) -> Size {
        self.framed
    }

    /// Row-major values of the picture with the frame around them. Those that are not the picture's in number stay as
    /// they are, for the library's caller to refuse.
    pub(super) fn put_around(self, values: &[[f32; 3]]) -> Cow<'_, [[f32; 3]]> {
        if !self.is_seen() || values.len() != self.picture.width * self.picture.height {
            return Cow::Borrowed(values);
        }
        let columns = source_of(self.picture.width, self.framed.width);
        let rows = source_of(self.picture.height, self.framed.height);
        let row = |y: usize| columns.iter().map(move |x| values[y * self.picture.width + x]);
        Cow::Owned(rows.iter().flat_map(|&y| row(y)).collect())
    }

    /// The picture without its frame.
    pub(super) fn cut_off(self, values: Vec<[f32; 3]>) -> Vec<[f32; 3]> {
        if !self.is_seen() {
            return values;
        }
        let Size { width, height } = self.picture;
        let (left, top) = (margin(width, self.framed.width), margin(height, self.framed.height));
        let rows = values.chunks(self.framed.width).skip(top).take(height);
        rows.flat_map(|row| &row[left..left + width]).copied().collect()
    }

    fn is_seen(self) -> bool {
        self.framed != self.picture
    }
}

/// Pixels before the first of the picture's.
fn margin(side: usize, framed: usize) -> usize {
    (framed - side) / 2
}

/// Which of the picture's pixels each of the framed one's repeats, along one axis: to and fro, the outermost twice.
fn source_of(side: usize, framed: usize) -> Vec<usize> {
    let there_and_back = 2 * side;
    // What stands at the first pixel of the frame, that of the picture being a whole number of ways there and back
    // further on.
    let first = there_and_back - margin(side, framed) % there_and_back;
    let source = |place: usize| {
        let way = (first + place) % there_and_back;
        if way < side { way } else { there_and_back - 1 - way }
    };
    (0..framed).map(source).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(size: Size) -> Vec<[f32; 3]> {
        (0..size.width * size.height).map(|pixel| [pixel as f32; 3]).collect()
    }

    #[test]
    fn a_picture_comes_out_of_its_frame_as_it_was() {
        for (width, height) in [(1, 1), (2, 3), (1, 40), (40, 7), (15, 16), (16, 16), (64, 30), (0, 5), (5, 0)] {
            let size = Size { width, height };
            let (frame, picture) = (Frame::around(size), numbered(size));
            let framed = frame.put_around(&picture);
            assert_eq!(framed.len(), frame.size().width * frame.size().height, "{size:?}");
            assert_eq!(frame.cut_off(framed.into_owned()), picture, "{size:?}");
        }
    }

    #[test]
    fn the_frame_mirrors_the_picture() {
        assert_eq!(source_of(3, 10), [2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(source_of(1, 4), [0; 4]);
        assert_eq!(source_of(5, 5), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn what_is_large_enough_has_no_frame() {
        let size = Size { width: MIN_SIDE, height: 100 };
        assert!(matches!(Frame::around(size).put_around(&numbered(size)), Cow::Borrowed(_)));
    }
}
