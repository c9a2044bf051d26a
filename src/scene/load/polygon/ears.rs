//! Ear clipping: of the corners that can be cut off, the one of the lowest number goes first.
//!
//! A corner that cannot be is looked at again only once what hinders it has gone, which is either a neighbour or a
//! corner inside its triangle; the latter are looked up in a grid. The time still grows nearly with the square: of a
//! letter C by 3.6 for twice its corners.

use super::corner_grid::CornerGrid;
use super::turn;
use glam::DVec2;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Triangles of a polygon of three corners or more in the plane, counter-clockwise, by numbers of corners.
pub(super) fn clip(flat: &[DVec2]) -> Vec<[usize; 3]> {
    let mut rest = Rest::of(flat);
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    while rest.count > 3 {
        // A polygon that crosses itself may have no ear: any corner ends the search.
        let ear = rest.next_ear().unwrap_or_else(|| rest.first());
        triangles.push(rest.triangle(ear));
        rest.cut(ear);
    }
    let first = rest.first();
    let second = rest.after[first];
    triangles.push([first, second, rest.after[second]]);
    triangles
}

/// What can be said of a corner as things are.
enum Verdict {
    Ear,
    /// It does not turn left.
    Inward,
    /// This other corner lies in its triangle.
    BlockedBy(usize),
}

/// What of a polygon has not been cut off.
struct Rest<'a> {
    flat: &'a [DVec2],
    count: usize,
    before: Vec<usize>,
    after: Vec<usize>,
    has_gone: Vec<bool>,
    /// None below it is left.
    lowest: usize,
    grid: CornerGrid,
    /// To be looked at, lowest first; each stands in it once.
    queue: BinaryHeap<Reverse<usize>>,
    is_queued: Vec<bool>,
    /// Which corners were last found to be blocked by each.
    blocks: Vec<Vec<usize>>,
}

impl<'a> Rest<'a> {
    fn of(flat: &'a [DVec2]) -> Self {
        let count = flat.len();
        Self {
            flat,
            count,
            before: (0..count).map(|corner| (corner + count - 1) % count).collect(),
            after: (0..count).map(|corner| (corner + 1) % count).collect(),
            has_gone: vec![false; count],
            lowest: 0,
            grid: CornerGrid::of(flat),
            queue: (0..count).map(Reverse).collect(),
            is_queued: vec![true; count],
            blocks: vec![Vec::new(); count],
        }
    }

    fn triangle(&self, corner: usize) -> [usize; 3] {
        [self.before[corner], corner, self.after[corner]]
    }

    /// The lowest number that is left.
    fn first(&mut self) -> usize {
        while self.has_gone[self.lowest] {
            self.lowest += 1;
        }
        self.lowest
    }

    fn next_ear(&mut self) -> Option<usize> {
        while let Some(Reverse(corner)) = self.queue.pop() {
            self.is_queued[corner] = false;
            if self.has_gone[corner] {
                continue;
            }
            match self.verdict(corner) {
                Verdict::Ear => return Some(corner),
                Verdict::Inward => {}
                Verdict::BlockedBy(other) => self.blocks[other].push(corner),
            }
        }
        None
    }

    /// A corner can be cut off if it turns left and no other corner lies inside its triangle.
    fn verdict(&self, corner: usize) -> Verdict {
        let triangle @ [a, b, c] = self.triangle(corner).map(|corner| self.flat[corner]);
        if turn(a, b, c) <= 0.0 {
            return Verdict::Inward;
        }
        let blocks = |other: usize| {
            let p = self.flat[other];
            let is_inside = turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            is_inside && p != a && p != b && p != c
        };
        self.grid.find_near(&triangle, blocks).map_or(Verdict::Ear, Verdict::BlockedBy)
    }

    fn cut(&mut self, corner: usize) {
        let [before, _, after] = self.triangle(corner);
        self.after[before] = after;
        self.before[after] = before;
        self.has_gone[corner] = true;
        self.count -= 1;
        self.grid.remove(corner, self.flat[corner]);
        for changed in std::mem::take(&mut self.blocks[corner]).into_iter().chain([before, after]) {
            if !std::mem::replace(&mut self.is_queued[changed], true) {
                self.queue.push(Reverse(changed));
            }
        }
    }
}
