//! Cuts long and thin triangles in the picture across. Those that are higher than the caller allows are left out.

use super::super::Crop;
use glam::DVec2;

/// A triangle in the picture, by its longest side.
pub(super) struct Strip {
    start_px: DVec2,
    /// Unit vector along the longest side.
    along: DVec2,
    length_px: f64,
    /// From the longest side to the third corner.
    height_px: DVec2,
    /// Where along the side the third corner stands.
    peak_px: f64,
}

/// A piece of it.
pub(super) struct Slice {
    /// Middle of the slice in the picture, px.
    pub(super) place_px: DVec2,
    pub(super) area_px2: f64,
}

impl Strip {
    /// The strip of a triangle in the picture; `None` of what is higher than so many pixels, or no triangle.
    pub(super) fn of(corners_px: [DVec2; 3], highest_px: f64) -> Option<Self> {
        let [a, b, c] = (0..3).map(|i| [0, 1, 2].map(|k| corners_px[(i + k) % 3])).max_by(|one, other| {
            let side = |corners: &[DVec2; 3]| corners[0].distance_squared(corners[1]);
            side(one).total_cmp(&side(other))
        })?;
        let (along, length_px) = (b - a).normalize_and_length();
        let peak_px = (c - a).dot(along).clamp(0.0, length_px);
        let height_px = c - (a + peak_px * along);
        let height = height_px.length();
        (length_px.is_finite() && height > 0.0 && height <= highest_px).then_some(Self {
            start_px: a,
            along,
            length_px,
            height_px,
            peak_px,
        })
    }

    /// Slices of the strip, no longer than so many pixels, that are no farther from an area of the picture than
    /// `border_px`.
    pub(super) fn slices(&self, area: Crop, longest_px: f64, border_px: f64) -> impl Iterator<Item = Slice> {
        let count = (self.length_px / longest_px).ceil().max(1.0);
        let step_px = self.length_px / count;
        let [from_px, to_px] = self.part_near(area, border_px);
        let (first, end) = ((from_px / step_px).floor(), (to_px / step_px).ceil().min(count));
        (0..(end - first).max(0.0) as u64).map(move |number| {
            let [from_px, to_px] = [0.0, 1.0].map(|more| (first + number as f64 + more) * step_px);
            let area_px2 = self.height_px.length() * (self.width_until(to_px) - self.width_until(from_px));
            let mean_width = area_px2 / (step_px * self.height_px.length());
            let on_side = self.start_px + 0.5 * (from_px + to_px) * self.along;
            Slice { place_px: on_side + 0.5 * mean_width * self.height_px, area_px2 }
        })
    }

    /// The integral of its width, in heights, from its beginning on.
    fn width_until(&self, px: f64) -> f64 {
        let Self { length_px, peak_px, .. } = *self;
        // The last slice may end a rounding beyond.
        let px = px.min(length_px);
        if px <= peak_px && peak_px > 0.0 {
            0.5 * px * px / peak_px
        } else {
            0.5 * (length_px - (length_px - px).powi(2) / (length_px - peak_px))
        }
    }

    /// From where to where along the longest side it may be seen in an area, in pixels.
    fn part_near(&self, area: Crop, border_px: f64) -> [f64; 2] {
        let low = DVec2::new(f64::from(area.x), f64::from(area.y)) - border_px;
        let high = low + DVec2::new(f64::from(area.width), f64::from(area.height)) + 2.0 * border_px;
        let (mut from_px, mut to_px) = (0.0_f64, self.length_px);
        for axis in 0..2 {
            let (start, step) = (self.start_px[axis], self.along[axis]);
            if step.abs() > 1e-12 {
                let ends = [(low[axis] - start) / step, (high[axis] - start) / step];
                from_px = from_px.max(ends[0].min(ends[1]));
                to_px = to_px.min(ends[0].max(ends[1]));
            } else if !(low[axis]..high[axis]).contains(&start) {
                return [0.0, 0.0];
            }
        }
        [from_px, to_px.max(from_px)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: Crop = Crop { x: 0, y: 0, width: 64, height: 64 };

    /// Slices have the triangle's area and its centre of mass, whichever side is the longest.
    #[test]
    fn slices_make_up_the_triangle() {
        let corners = [[10.0, 20.0], [50.3, 24.0], [30.0, 23.0]].map(DVec2::from);
        for turn in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|i| corners[(i + turn) % 3]);
            let slices: Vec<Slice> = Strip::of([a, b, c], 1.5).expect("is thin").slices(FILM, 0.5, 3.5).collect();
            let area: f64 = slices.iter().map(|slice| slice.area_px2).sum();
            let centre = slices.iter().map(|slice| slice.area_px2 * slice.place_px).sum::<DVec2>() / area;
            assert!((area / (0.5 * (b - a).perp_dot(c - a).abs()) - 1.0).abs() < 1e-9, "{area}");
            assert!((centre - (a + b + c) / 3.0).length() < 0.01, "{centre}");
            assert!(slices.len() <= 82, "as many as it is long: {}", slices.len());
        }
    }

    /// Of one that goes on far beyond the film, or along a line that misses it, no more than what is near it.
    #[test]
    fn what_is_far_outside_is_not_cut() {
        let slices = |corners: [[f64; 2]; 3]| {
            Strip::of(corners.map(DVec2::from), 1.5).map(|strip| strip.slices(FILM, 0.5, 3.5).count())
        };
        assert!(slices([[-1e9, 30.0], [1e9, 30.0], [0.0, 30.1]]).is_some_and(|count| (128..=144).contains(&count)));
        assert_eq!(slices([[-1e9, 90.0], [1e9, 90.0], [0.0, 90.1]]), Some(0));
        assert_eq!(slices([[100.0, 0.0], [100.0, 50.0], [100.1, 20.0]]), Some(0));
        assert_eq!(slices([[0.0, 0.0], [30.0, 0.0], [15.0, 9.0]]), None, "is thick");
        assert_eq!(slices([[0.0, 0.0], [30.0, 0.0], [15.0, 0.0]]), None, "has no area");
        assert_eq!(slices([[f64::NAN, 0.0], [30.0, 0.0], [15.0, 1.0]]), None);
    }
}
