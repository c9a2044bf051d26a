//! Which neighbours a pixel is averaged with.

use std::collections::BTreeSet;

/// The farthest neighbour, in pixels along an axis.
pub(super) const FARTHEST: usize = 24;

/// Where a neighbour is, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tap {
    pub(super) dy: isize,
    pub(super) dx: isize,
}

impl Tap {
    /// How far it is.
    #[inline(always)]
    pub(super) fn distance(self) -> f32 {
        ((self.dx * self.dx + self.dy * self.dy) as f32).sqrt()
    }
}

/// All of the nearest 24 neighbours, and farther ones along a spiral of the golden angle, which leaves no rows or rings. The pixel
/// itself is among them.
pub(super) struct Taps {
    radius: usize,
    all: Vec<Tap>,
}

impl Taps {
    /// About `count` within `radius`, at most [`FARTHEST`]; in order of rows, and with each its opposite.
    pub(super) fn around(count: usize, radius: usize) -> Self {
        const INNER: isize = 2;
        let radius = radius.min(FARTHEST);
        let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let reach = radius as f64 - INNER as f64;
        let mut taps: BTreeSet<Tap> =
            (-INNER..=INNER).flat_map(|dy| (-INNER..=INNER).map(move |dx| Tap { dy, dx })).collect();
        for step in 0..count {
            if taps.len() >= count {
                break;
            }
            let distance = INNER as f64 + reach * ((step as f64 + 0.5) / count as f64).sqrt();
            let angle = step as f64 * golden_angle;
            let (dy, dx) = ((distance * angle.sin()).round() as isize, (distance * angle.cos()).round() as isize);
            taps.extend([Tap { dy, dx }, Tap { dy: -dy, dx: -dx }]);
        }
        Self { radius, all: taps.into_iter().collect() }
    }

    pub(super) fn all(&self) -> &[Tap] {
        &self.all
    }

    /// How far the farthest may be.
    pub(super) fn radius(&self) -> usize {
        self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_many_symmetric_and_near() {
        for (count, radius) in [(97, 9), (97, 24), (10, 3)] {
            let taps = Taps::around(count, radius);
            let all = taps.all();
            assert!(all.len() >= count.min(24) && all.len() <= count.max(25) + 1, "{} of {count}", all.len());
            assert!(all.contains(&Tap { dy: 0, dx: 0 }));
            assert!(all.iter().all(|tap| all.contains(&Tap { dy: -tap.dy, dx: -tap.dx })));
            assert!(all.iter().all(|tap| tap.distance() <= radius as f32 + 1.0));
        }
    }
}
