//! Finds corners of a polygon in the plane by where they are.

use glam::DVec2;

/// Square cells over a polygon's bounds, about as many as it has corners.
pub(super) struct CornerGrid {
    origin: DVec2,
    /// Zero along an axis in which the polygon has no extent.
    cells_per_unit: DVec2,
    /// Cells along each axis.
    side: usize,
    /// Numbers of the corners in each cell, row by row.
    cells: Vec<Vec<usize>>,
}

impl CornerGrid {
    pub(super) fn of(flat: &[DVec2]) -> Self {
        let bounds = |combine: fn(DVec2, DVec2) -> DVec2| flat.iter().copied().reduce(combine).unwrap_or_default();
        let (origin, most) = (bounds(DVec2::min), bounds(DVec2::max));
        let side = flat.len().isqrt().max(1);
        let per_unit = |extent: f64| if extent > 0.0 { side as f64 / extent } else { 0.0 };
        let extent = most - origin;
        let cells_per_unit = DVec2::new(per_unit(extent.x), per_unit(extent.y));
        let mut grid = Self { origin, cells_per_unit, side, cells: vec![Vec::new(); side * side] };
        for (corner, &place) in flat.iter().enumerate() {
            let cell = grid.cell(place);
            grid.cells[cell].push(corner);
        }
        grid
    }

    pub(super) fn remove(&mut self, corner: usize, place: DVec2) {
        let cell = self.cell(place);
        self.cells[cell].retain(|&other| other != corner);
    }

    /// A corner for which `is_wanted` holds, of those in cells that a triangle touches and those beside them.
    pub(super) fn find_near(&self, triangle: &[DVec2; 3], is_wanted: impl Fn(usize) -> bool) -> Option<usize> {
        let corners = triangle.map(|corner| self.in_cells(corner));
        let heights = corners.map(|corner| self.clamped(corner.y));
        let lowest_row = heights.into_iter().min()?;
        let highest_row = heights.into_iter().max()?;
        (lowest_row..=highest_row).find_map(|row| {
            let [low, high] = reach(&corners, row as f64);
            // A cell more on either side, so that no rounding of the edges leaves out what lies on them.
            let columns = self.clamped(low - 1.0)..=self.clamped(high + 1.0);
            let in_row = &self.cells[row * self.side..][columns];
            in_row.iter().flatten().copied().find(|&corner| is_wanted(corner))
        })
    }

    fn in_cells(&self, place: DVec2) -> DVec2 {
        (place - self.origin) * self.cells_per_unit
    }

    fn clamped(&self, along_axis: f64) -> usize {
        // The cast takes what lies below to 0.
        (along_axis as usize).min(self.side - 1)
    }

    fn cell(&self, place: DVec2) -> usize {
        let place = self.in_cells(place);
        self.clamped(place.y) * self.side + self.clamped(place.x)
    }
}

/// The least and the greatest x of a triangle's edges between `row` and `row + 1`; of the whole triangle
/// where rounding finds none.
fn reach(corners: &[DVec2; 3], row: f64) -> [f64; 2] {
    let [a, b, c] = *corners;
    let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
    let mut take = |x: f64| reach = [reach[0].min(x), reach[1].max(x)];
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let rise = to.y - from.y;
        if from.y.max(to.y) < row || from.y.min(to.y) > row + 1.0 {
            continue;
        }
        for height in [row, row + 1.0] {
            let share = (height - from.y) / rise;
            // A level edge is taken whole.
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { f64::from(height > row) };
            take(from.x + share * (to.x - from.x));
        }
    }
    if reach[0] > reach[1] { [a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)] } else { reach }
}
