//! Small windows, tap by tap along whole rows, so that the loops run on vector registers. For windows of more than a few
//! samples [`crate::filter`] costs less.

use crate::filter::{self, reflect};
use crate::plane::Plane;

/// Beyond this variance, in samples, the box filters of [`filter::gaussian_blur_xy`] take over.
const MOST_VARIANCE: f64 = 3.0;
/// Beyond this radius, in samples, the running minima of [`filter::erode_xy`] take over.
const MOST_RADIUS: usize = 8;

/// `plane` through a window of the given variances along x and y, in squared samples, mirrored at the borders.
pub(crate) fn smoothed(plane: &Plane, variance_x: f64, variance_y: f64) -> Plane {
    if variance_x.max(variance_y) > MOST_VARIANCE {
        return filter::gaussian_blur_xy(plane, variance_x.max(0.0).sqrt(), variance_y.max(0.0).sqrt());
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

/// The smallest value within a rectangle of these half-widths around each sample.
pub(crate) fn eroded(plane: &Plane, radius_x: usize, radius_y: usize) -> Plane {
    if radius_x.max(radius_y) > MOST_RADIUS {
        return filter::erode_xy(plane, radius_x, radius_y);
    }
    over_rows(plane, radius_x, radius_y, |rows, extended, result| {
        let width = result.len();
        extended[radius_x..radius_x + width].fill(f32::INFINITY);
        for row in rows {
            lower(&mut extended[radius_x..radius_x + width], row);
        }
        mirror(extended, radius_x, width);
        result.copy_from_slice(&extended[..width]);
        for tap in 1..=2 * radius_x {
            lower(result, &extended[tap..tap + width]);
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
    for index in (0..padding).chain(padding + width..2 * padding + width) {
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
    fn small_and_large_windows_agree() {
        let plane = Plane::from_fn(41, 27, |x, y| ((x * 31 + y * 17) % 101) as f32);
        for (radius_x, radius_y) in [(0, 0), (1, 3), (8, 2)] {
            assert_eq!(eroded(&plane, radius_x, radius_y), filter::erode_xy(&plane, radius_x, radius_y));
        }
        let (taps, boxes) =
            (smoothed(&plane, 2.0, 2.5), filter::gaussian_blur_xy(&plane, 2.0_f64.sqrt(), 2.5_f64.sqrt()));
        for (a, b) in taps.values().iter().zip(boxes.values()) {
            assert!((a - b).abs() < 1.5, "{a} {b}");
        }
    }
}
