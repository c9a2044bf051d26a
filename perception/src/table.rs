//! Functions tabulated at equal steps, with straight lines between the entries.

/// A table against a position that counts entries: 1.25 is a quarter of the way from the second one to the third.
/// Beyond its ends it is flat.
#[derive(Clone, Debug)]
pub(crate) struct UniformTable(Vec<f32>);

impl UniformTable {
    /// Takes at least two entries.
    pub(crate) fn new(entries: impl IntoIterator<Item = f32>) -> Self {
        Self(entries.into_iter().collect())
    }

    /// As [`Between`] has it, in `f32`: every pixel of every map looks up here.
    pub(crate) fn at(&self, position: f32) -> f32 {
        let position = position.max(0.0);
        let below = (position as usize).min(self.0.len() - 2);
        let share = (position - below as f32).min(1.0);
        self.0[below] + share * (self.0[below + 1] - self.0[below])
    }

    /// The product with a table of as many entries.
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self::new(self.0.iter().zip(&other.0).map(|(a, b)| a * b))
    }
}

/// Where a position lies between the entries of any table, or the middles of cells, that are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Between {
    pub(crate) below: usize,
    /// The next one, or the same of a single one.
    pub(crate) above: usize,
    /// How far it is on the way to `above`, 0 to 1.
    pub(crate) share: f64,
}

impl Between {
    /// Positions beyond the ends, and NaN, are moved to an end.
    pub(crate) fn of(position: f64, entries: usize) -> Self {
        let last = entries.saturating_sub(1);
        let position = position.max(0.0).min(last as f64);
        let below = (position as usize).min(last.saturating_sub(1));
        Self { below, above: (below + 1).min(last), share: position - below as f64 }
    }

    /// The value there, where the entry below has `low` and the one above `high`.
    pub(crate) fn value(self, low: f64, high: f64) -> f64 {
        low + self.share * (high - low)
    }

    /// The value at this column and at `row`, where `value_at(column, row)` is known at whole ones.
    pub(crate) fn bilinear(self, row: Self, value_at: impl Fn(usize, usize) -> f32) -> f32 {
        let (across, down) = (self.share as f32, row.share as f32);
        let line = |row| value_at(self.below, row) * (1.0 - across) + value_at(self.above, row) * across;
        line(row.below) * (1.0 - down) + line(row.above) * down
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_straight_between_entries_and_flat_beyond() {
        let entries = [1.0, 3.0, -1.0];
        let table = UniformTable::new(entries);
        for (position, expected) in
            [(-7.0, 1.0), (0.0, 1.0), (0.25, 1.5), (1.0, 3.0), (1.75, 0.0), (2.0, -1.0), (1e30, -1.0), (f32::NAN, 1.0)]
        {
            assert_eq!(table.at(position), expected, "{position}");
            let between = Between::of(f64::from(position), entries.len());
            let [low, high] = [between.below, between.above].map(|entry| f64::from(entries[entry]));
            assert_eq!(between.value(low, high), f64::from(expected), "{position}");
        }
        for count in [0, 1] {
            assert_eq!(Between::of(0.7, count), Between { below: 0, above: 0, share: 0.0 });
        }
    }
}
