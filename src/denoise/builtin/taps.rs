//! Which neighbours a pixel is averaged with. How much each of them counts is left to `likeness`.

use std::collections::BTreeSet;

/// The farthest neighbour, in pixels along an axis.
pub(super) const FARTHEST: usize = 16;

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

/// The neighbours that a pixel is averaged with: all of the nearest 24, and farther ones along a spiral of the golden
/// angle, which leaves no rows or rings. The pixel itself is among them.
pub(super) struct Taps(Vec<Tap>);

impl Taps {
    /// Taps around a pixel: so many, an odd number of at least 25, the k-th pair of the farther ones `spacing_px` · √k
    /// beyond the nearest; in order of rows. None is farther than [`FARTHEST`].
    pub(super) fn around(count: usize, spacing_px: f64) -> Self {
        const INNER: isize = 2;
        let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let mut taps: BTreeSet<Tap> =
            (-INNER..=INNER).flat_map(|dy| (-INNER..=INNER).map(move |dx| Tap { dy, dx })).collect();
        for pair in 0.. {
            let distance = INNER as f64 + spacing_px * (f64::from(pair) + 0.5).sqrt();
            if taps.len() >= count || distance > FARTHEST as f64 {
                break;
            }
            let angle = f64::from(pair) * golden_angle;
            let (dy, dx) = ((distance * angle.sin()).round() as isize, (distance * angle.cos()).round() as isize);
            taps.extend([Tap { dy, dx }, Tap { dy: -dy, dx: -dx }]);
        }
        Self(taps.into_iter().collect())
    }

    pub(super) fn all(&self) -> &[Tap] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those that the denoiser uses, with the reach that the documents say, and some that would go too far.
    #[test]
    fn neighbours_are_many_symmetric_and_near() {
        for (count, spacing_px, found, reach) in [(97, 0.711, 97, 6), (97, 2.234, 97, 15), (999, 9.0, 29, 10)] {
            let taps = Taps::around(count, spacing_px);
            let all = taps.all();
            assert_eq!(all.len(), found);
            assert!(all.contains(&Tap { dy: 0, dx: 0 }));
            assert!(all.iter().all(|tap| all.contains(&Tap { dy: -tap.dy, dx: -tap.dx })));
            let farthest = all.iter().map(|tap| tap.dy.unsigned_abs().max(tap.dx.unsigned_abs())).max();
            assert_eq!(farthest, Some(reach));
        }
    }
}
