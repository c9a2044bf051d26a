//! Eight pixels at once, in arrays and loops that are compiled for wide vectors where they are inlined.

/// How many numbers are worked on at once.
pub(super) const LANES: usize = 8;

/// A value for each of the pixels that are worked on at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lanes(pub(super) [f32; LANES]);

impl Lanes {
    pub(super) const ZERO: Self = Self([0.0; LANES]);
    pub(super) const ONE: Self = Self([1.0; LANES]);

    /// Numbers of a row, from a column on.
    #[inline(always)]
    pub(super) fn of<const WIDTH: usize>(row: &[f32; WIDTH], column: usize) -> Self {
        let mut found = Self::ZERO;
        found.0.copy_from_slice(&row[column..column + LANES]);
        found
    }

    #[inline(always)]
    pub(super) fn add(&mut self, other: Self) {
        for i in 0..LANES {
            self.0[i] += other.0[i];
        }
    }

    #[inline(always)]
    pub(super) fn add_product(&mut self, a: Self, b: Self) {
        for i in 0..LANES {
            self.0[i] += a.0[i] * b.0[i];
        }
    }

    #[inline(always)]
    pub(super) fn subtract_product(&mut self, a: Self, b: Self) {
        for i in 0..LANES {
            self.0[i] -= a.0[i] * b.0[i];
        }
    }

    #[inline(always)]
    pub(super) fn times(mut self, other: Self) -> Self {
        for i in 0..LANES {
            self.0[i] *= other.0[i];
        }
        self
    }

    #[inline(always)]
    pub(super) fn less(mut self, other: Self) -> Self {
        for i in 0..LANES {
            self.0[i] -= other.0[i];
        }
        self
    }

    #[inline(always)]
    pub(super) fn over(mut self, other: Self) -> Self {
        for i in 0..LANES {
            self.0[i] /= other.0[i];
        }
        self
    }

    /// These numbers, each raised to at least this.
    #[inline(always)]
    pub(super) fn at_least(mut self, least: f32) -> Self {
        for i in 0..LANES {
            self.0[i] = self.0[i].max(least);
        }
        self
    }

    #[inline(always)]
    pub(super) fn any_is_at_least(self, least: f32) -> bool {
        let mut is_any = false;
        for i in 0..LANES {
            is_any |= self.0[i] >= least;
        }
        is_any
    }
}
