//! Rectangles of pixels, and pictures put from one into another. What the pixels mean is not known here.

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Top left pixel of the rectangle, x to the right and y down.
    pub origin: (i32, i32),
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl Window {
    /// Whether a pixel lies in both.
    pub(super) fn meets(&self, other: &Self) -> bool {
        let overlap = |a: i32, a_size: u32, b: i32, b_size: u32| {
            i64::from(a) < i64::from(b) + i64::from(b_size) && i64::from(b) < i64::from(a) + i64::from(a_size)
        };
        overlap(self.origin.0, self.width, other.origin.0, other.width)
            && overlap(self.origin.1, self.height, other.origin.1, other.height)
    }

    /// What another window shows of a picture that covers this one, row-major; `outside` where this one has nothing.
    pub(super) fn put_into<T: Copy>(&self, other: &Self, values: Vec<T>, outside: T) -> Vec<T> {
        if self == other {
            return values;
        }
        let offset = |pixel: u32, other: i32, own: i32, size: u32| {
            let at = usize::try_from(i64::from(pixel) + i64::from(other) - i64::from(own)).ok();
            at.filter(|at| *at < size as usize)
        };
        let mut shown = Vec::with_capacity(other.width as usize * other.height as usize);
        for y in 0..other.height {
            let row = offset(y, other.origin.1, self.origin.1, self.height);
            for x in 0..other.width {
                let column = offset(x, other.origin.0, self.origin.0, self.width);
                shown.push(match (row, column) {
                    (Some(row), Some(column)) => values[row * self.width as usize + column],
                    _ => outside,
                });
            }
        }
        shown
    }
}
