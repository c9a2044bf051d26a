//! Small windows, tap by tap along whole rows, so that the loops run on vector registers. For windows of more than a
//! few samples [`crate::filter`] costs less.

use crate::filter::{self, reflect};
use crate::plane::Plane;

/// Beyond this variance, in samples, the box filters of [`filter::gaussian_blur_xy`] take over.
const MAX_VARIANCE: f64 = 3.0;

/// `plane` through a window of the given variances along x and y, in squared samples, mirrored at the borders.
pub(crate) fn smoothed(plane: &Plane, variance_x: f64, variance_y: f64) -> Plane {
    if variance_x.max(variance_y) > MAX_VARIANCE {
        return filter::gaussian_blur_xy(plane, [variance_x, variance_y].map(|variance| variance.max(0.0).sqrt()));
    }
    let (across, down) = (kernel(variance_x), kernel(variance_y));
    over_rows(plane, across.len() / 2, down.len() / 2, |rows, extended, result| {
        let padding = across.len() / 2;
        let width = result.len();
        extended[padding..padding + width].fill(0.0);
        for (weight, row) in down.iter().zip(rows) {
            add_scaled(&mut extended[padding..padding + width], row, *weight);
        }
        mirror(extended, padding, width);
        result.fill(0.0);
        for (tap, weight) in across.iter().enumerate() {
            add_scaled(result, &extended[tap..tap + width], *weight);
        }
    })
}

/// The smallest value of the samples whose middles lie within an ellipse around each sample, whose half-axes are
/// these radii and half a sample: of a radius along an axis so many samples to each side, rounded. Round, so that a
/// picture that is turned has a turned result.
///
/// A column of the ellipse holds the rows of the one farther out, so that minima over rows are handed inwards from
/// column to column.
pub(crate) fn eroded(plane: &Plane, radius_x: f64, radius_y: f64) -> Plane {
    // Twice a mirrored picture shows nothing new.
    let half_axis = |radius: f64, len: usize| radius.clamp(0.0, 2.0 * len as f64) + 0.5;
    let (half_x, half_y) = (half_axis(radius_x, plane.width()), half_axis(radius_y, plane.height()));
    let rows_beside =
        |column: usize| (half_y * (1.0 - (column as f64 / half_x).powi(2)).max(0.0).sqrt()).floor() as usize;
    let reach_x = half_x.floor() as usize;
    let heights: Vec<usize> = (0..=reach_x).map(rows_beside).collect();
    let reach_y = heights[0];
    over_rows(plane, reach_x, reach_y, |rows, extended, result| {
        let width = result.len();
        extended[reach_x..reach_x + width].copy_from_slice(rows[reach_y]);
        result.copy_from_slice(rows[reach_y]);
        let mut taken = 0;
        for column in (0..=reach_x).rev() {
            let least = &mut extended[reach_x..reach_x + width];
            for row in taken + 1..=heights[column] {
                lower(least, rows[reach_y - row]);
                lower(least, rows[reach_y + row]);
            }
            taken = heights[column];
            mirror_by(extended, reach_x, width, column);
            lower(result, &extended[reach_x - column..reach_x - column + width]);
            lower(result, &extended[reach_x + column..reach_x + column + width]);
        }
    })
}

/// Taps whose variance is exactly `variance`: small symmetric three-tap windows, one after the other.
fn kernel(variance: f64) -> Vec<f32> {
    let passes = (variance / 0.5).ceil().max(0.0) as usize;
    let side = if passes == 0 { 0.0 } else { variance / (2.0 * passes as f64) };
    let mut taps = vec![1.0];
    for _ in 0..passes {
        let mut wider = vec![0.0; taps.len() + 2];
        for (index, tap) in taps.iter().enumerate() {
            wider[index] += side * tap;
            wider[index + 1] += (1.0 - 2.0 * side) * tap;
            wider[index + 2] += side * tap;
        }
        taps = wider;
    }
    taps.into_iter().map(|tap| tap as f32).collect()
}

/// Calls `work(the rows around y, a buffer of width + 2 reach_x, row y of the result)` for every row.
fn over_rows(
    plane: &Plane,
    reach_x: usize,
    reach_y: usize,
    work: impl Fn(&[&[f32]], &mut [f32], &mut [f32]) + Sync,
) -> Plane {
    let (width, height) = (plane.width(), plane.height());
    let mut result = Plane::filled(width, height, 0.0);
    result.for_each_row_mut(|y, row| {
        let rows: Vec<&[f32]> = (0..=2 * reach_y)
            .map(|tap| plane.row(reflect(y as isize + tap as isize - reach_y as isize, height)))
            .collect();
        work(&rows, &mut vec![0.0; width + 2 * reach_x], row);
    });
    result
}

/// Fills `padding` samples on each side of the `width` in the middle with their mirror image.
fn mirror(extended: &mut [f32], padding: usize, width: usize) {
    mirror_by(extended, padding, width, padding);
}

/// Fills the `reach` samples next to the middle on each side with their mirror image.
fn mirror_by(extended: &mut [f32], padding: usize, width: usize, reach: usize) {
    for index in (padding - reach..padding).chain(padding + width..padding + width + reach) {
        extended[index] = extended[padding + reflect(index as isize - padding as isize, width)];
    }
}

fn add_scaled(sums: &mut [f32], values: &[f32], weight: f32) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
}

fn lower(least: &mut [f32], values: &[f32]) {
    least.iter_mut().zip(values).for_each(|(least, value)| *least = least.min(*value));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_have_the_variance_they_are_asked_for() {
        for variance in [0.0, 0.3, 0.5, 1.6, 2.9] {
            let taps = kernel(variance);
            let center = (taps.len() / 2) as f64;
            let moment = |power: i32| -> f64 {
                taps.iter().enumerate().map(|(at, tap)| f64::from(*tap) * (at as f64 - center).powi(power)).sum()
            };
            assert!((moment(0) - 1.0).abs() < 1e-6 && (moment(2) - variance).abs() < 1e-5, "{variance}: {taps:?}");
            assert!(taps.iter().all(|tap| *tap > 0.0));
        }
    }

    #[test]
    fn erosion_is_the_minimum_of_the_ellipse() {
        let plane = Plane::from_fn(41, 27, |x, y| ((x * 31 + y * 17) % 101) as f32);
        for (radius_x, radius_y) in [(0.0_f64, 0.0_f64), (0.4, 0.6), (1.0, 3.2), (8.0, 2.5), (5.3, 5.3), (60.0, 1.0)] {
            let result = eroded(&plane, radius_x, radius_y);
            let is_within = |dx: isize, dy: isize| {
                let along = |way: isize, radius: f64| (way as f64 / (radius + 0.5)).powi(2);
                along(dx, radius_x) + along(dy, radius_y) <= 1.0
            };
            let at = |x: isize, y: isize| plane.get(filter::reflect(x, 41), filter::reflect(y, 27));
            for (x, y) in (0..41).flat_map(|x| (0..27).map(move |y| (x, y))) {
                let offsets = (-61..=61).flat_map(|dx| (-9..=9).map(move |dy| (dx, dy)));
                let within = offsets.filter(|&(dx, dy)| is_within(dx, dy));
                let least = within.map(|(dx, dy)| at(x + dx, y + dy)).fold(f32::INFINITY, f32::min);
                assert_eq!(result.get(x as usize, y as usize), least, "({x}, {y}) of {radius_x}, {radius_y}");
            }
        }
    }

    #[test]
    fn small_and_large_windows_agree() {
        let plane = Plane::from_fn(41, 27, |x, y| ((x * 31 + y * 17) % 101) as f32);
        let (taps, boxes) =
            (smoothed(&plane, 2.0, 2.5), filter::gaussian_blur_xy(&plane, [2.0_f64.sqrt(), 2.5_f64.sqrt()]));
        for (a, b) in taps.values().iter().zip(boxes.values()) {
            assert!((a - b).abs() < 1.5, "{a} {b}");
        }
    }
}
