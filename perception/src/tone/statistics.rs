//! What operators want to know of a picture as a whole.

use rayon::prelude::*;

use crate::plane::Plane;

/// The floor of human vision, cd/m².
pub(super) const FLOOR_CD_M2: f32 = 1e-4;
/// Share of the brightest pixel at and below which a pixel says nothing to an operator that knows only ratios: leaked
/// light and rounding, not darkness.
const FAINTEST_SHARE: f32 = 1e-10;
/// Pixels summed by one thread at a time. Sums are added in the picture's order, whatever the number of threads.
const CHUNK: usize = 1 << 14;

/// Share of what may be exposed for that a camera's darkness is measured by the brightest of: the rest may be lamps.
const ORDINARY: f64 = 0.95;
/// Share of that light at and below which a pixel says nothing about exposure: 20 stops, more than a camera records.
const DARKEST_SHARE: f32 = 1e-6;
/// Share of the picture's pixels that are too few to make all others darkness: fireflies, the disc of the sun. More
/// of them, 20 stops above everything else, hold 99.9 % of the light and are what there is to see.
const TOO_FEW: f64 = 1e-3;
/// Pixels of a small picture that are too few in any case: a firefly, or a pair with its neighbours.
const TOO_FEW_PIXELS: usize = 4;

/// What an eye makes of a pixel: less than the floor of vision is as dark as the floor. `None` for what is no light.
pub(super) fn as_eyes_see(value: f32) -> Option<f32> {
    value.is_finite().then(|| value.max(FLOOR_CD_M2))
}

/// Geometric mean, cd/m², of what eyes see in all pixels; `None` for a picture without pixels.
pub(super) fn log_average_to_eyes(luminance_cd_m2: &Plane) -> Option<f64> {
    log_average(luminance_cd_m2, as_eyes_see)
}

/// Light for what blurs a picture: where nothing is (NaN) the geometric mean of the rest, which the view as a whole
/// is adapted to; infinite light is none.
pub(super) fn filled(plane: &Plane) -> Plane {
    let has_holes = plane.values().iter().any(|value| value.is_nan());
    let average = if has_holes { log_average_to_eyes(plane) } else { None }.unwrap_or(0.0) as f32;
    plane.map(|value| match value {
        value if value.is_finite() => value.max(0.0),
        value if value.is_nan() => average,
        _ => 0.0,
    })
}

/// [`log_average_to_eyes`] with a weight for each pixel, `weight_at(x, y)`.
pub(super) fn weighted_log_average_to_eyes(
    plane: &Plane,
    weight_at: impl Fn(usize, usize) -> f64 + Sync,
) -> Option<f64> {
    let sums: Vec<LogSum> = (0..plane.height())
        .into_par_iter()
        .map(|y| {
            let row = plane.row(y).iter().enumerate();
            row.fold(LogSum::default(), |sum, (x, &value)| sum.with(as_eyes_see(value), weight_at(x, y)))
        })
        .collect();
    LogSum::mean(&sums)
}

/// Geometric mean of the pixels that are lit, whatever the unit; `None` for a black picture. Pixels too few to count
/// ([`TOO_FEW`]) make no others darkness: beside a single one of 1e12 all the rest would be.
pub(super) fn log_average_of_lit(luminance: &Plane) -> Option<f64> {
    let sorted = sorted_lit(luminance);
    let brightest = enough_of_the_brightest(&sorted, luminance.values().len()).last();
    let faintest = brightest.map_or(0.0, |brightest| FAINTEST_SHARE * brightest);
    log_average(luminance, |value| (value.is_finite() && value > faintest).then_some(value))
}

/// What is finite and not black, in rising order.
fn sorted_lit(luminance: &Plane) -> Vec<f32> {
    let mut sorted: Vec<f32> =
        luminance.values().iter().copied().filter(|&value| value.is_finite() && value > 0.0).collect();
    sorted.par_sort_unstable_by(f32::total_cmp);
    sorted
}

fn log_average(plane: &Plane, counted: impl Fn(f32) -> Option<f32> + Sync) -> Option<f64> {
    let sums: Vec<LogSum> = plane
        .values()
        .par_chunks(CHUNK)
        .map(|values| values.iter().fold(LogSum::default(), |sum, &value| sum.with(counted(value), 1.0)))
        .collect();
    LogSum::mean(&sums)
}

#[derive(Clone, Copy, Default)]
struct LogSum {
    log: f64,
    weight: f64,
}

impl LogSum {
    fn with(self, value: Option<f32>, weight: f64) -> Self {
        match value {
            Some(value) => Self { log: self.log + weight * f64::from(value).ln(), weight: self.weight + weight },
            None => self,
        }
    }

    fn mean(sums: &[Self]) -> Option<f64> {
        let (log, weight) = sums.iter().fold((0.0, 0.0), |(log, weight), sum| (log + sum.log, weight + sum.weight));
        (weight > 0.0).then(|| (log / weight).exp())
    }
}

/// Scene luminances that say something about exposure, in rising order. Blacks do not (an empty background is no
/// reason to expose longer), and neither do values that are not finite. How dark a black is is a ratio, as a camera
/// knows no unit: a picture and the same one a thousand times darker are exposed to the same.
#[derive(Clone, Debug)]
pub(super) struct SceneStatistics {
    sorted_cd_m2: Vec<f32>,
}

impl SceneStatistics {
    pub(super) fn of(luminance_cd_m2: &Plane) -> Self {
        let mut sorted_cd_m2 = sorted_lit(luminance_cd_m2);
        let floor_cd_m2 = floor_cd_m2(&sorted_cd_m2, luminance_cd_m2.values().len());
        sorted_cd_m2.drain(..count_up_to(&sorted_cd_m2, floor_cd_m2));
        Self { sorted_cd_m2 }
    }

    /// The value below which the share `fraction` of the pixels lies; `None` for a black picture.
    pub(super) fn quantile(&self, fraction: f64) -> Option<f64> {
        quantile(&self.sorted_cd_m2, fraction).map(f64::from)
    }

    /// Geometric mean of the pixels between two quantiles; `None` for a black picture.
    pub(super) fn log_average(&self, from: f64, to: f64) -> Option<f64> {
        let count = self.sorted_cd_m2.len();
        let first = (from * count as f64).floor() as usize;
        let end = ((to * count as f64).ceil() as usize).clamp(first, count);
        let kept = self.sorted_cd_m2.get(first..end).filter(|kept| !kept.is_empty())?;
        Some((kept.iter().map(|&value| f64::from(value).ln()).sum::<f64>() / kept.len() as f64).exp())
    }
}

/// At and below which a pixel of a picture of `pixel_count`, whose lit ones are `sorted_cd_m2`, is darkness; 0 where
/// all that is lit counts.
///
/// What may be exposed for lies within 20 stops of the brightest pixel, and where that is [`TOO_FEW`] pixels, of the
/// brightest below them. A quantile of all that is lit would not do: it is leaked light itself wherever a leaking
/// background is most of the picture. Measured with such a quantile, pixels of 20 to 100 cd/m² before a background of
/// 1e-6: where they are 4.8 % of the picture they are exposed 4e7 times as long as where they are 5.3 %.
fn floor_cd_m2(sorted_cd_m2: &[f32], pixel_count: usize) -> f32 {
    DARKEST_SHARE * quantile(enough_of_the_brightest(sorted_cd_m2, pixel_count), ORDINARY).unwrap_or(0.0)
}

/// Of the lit pixels of a picture of `pixel_count`, in rising order, those within 20 stops of the brightest one, or
/// where these are [`TOO_FEW`], of the brightest below them; empty where all are too few.
fn enough_of_the_brightest(sorted: &[f32], pixel_count: usize) -> &[f32] {
    let too_few = TOO_FEW_PIXELS.max((TOO_FEW * pixel_count as f64) as usize);
    let mut left = sorted;
    while let Some(brightest) = left.last() {
        let (below, within) = left.split_at(count_up_to(left, DARKEST_SHARE * brightest));
        if within.len() > too_few {
            return within;
        }
        left = below;
    }
    &[]
}

/// How many values, in rising order, are at most `limit`.
fn count_up_to(sorted: &[f32], limit: f32) -> usize {
    sorted.partition_point(|&value| value <= limit)
}

/// Of values in rising order the one below which the share `fraction` of them lies.
fn quantile(sorted: &[f32], fraction: f64) -> Option<f32> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((fraction.clamp(0.0, 1.0) * last as f64).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blacks_and_fireflies_do_not_move_the_trimmed_average() {
        let mut plane = Plane::filled(100, 10, 3.0);
        plane.values_mut()[..10].fill(2e6);
        plane.values_mut()[10..500].fill(0.0);
        plane.values_mut()[500] = f32::NAN;
        let statistics = SceneStatistics::of(&plane);
        assert!((statistics.log_average(0.03, 0.97).unwrap() - 3.0).abs() < 1e-9);
        assert_eq!(statistics.quantile(0.5), Some(3.0));
        assert!(SceneStatistics::of(&Plane::filled(4, 4, 0.0)).quantile(0.5).is_none());
        assert!(log_average_of_lit(&Plane::filled(4, 4, 0.0)).is_none());
    }

    /// Leaked light of a background is left out, whatever a few fireflies do.
    #[test]
    fn what_is_left_out_is_a_ratio() {
        let scene = |scale: f32| {
            SceneStatistics::of(&Plane::from_fn(100, 10, |x, y| {
                scale
                    * if x < 40 {
                        1e-7
                    } else if x == 99 && y < 3 {
                        1e12
                    } else {
                        1.0 + y as f32
                    }
            }))
        };
        let of = |scale: f32| scene(scale).log_average(0.03, 0.97).unwrap() / f64::from(scale);
        assert!((of(1.0) - 4.53).abs() < 0.2, "{}", of(1.0));
        for scale in [1e-12, 1e-5, 1e-3, 1e6] {
            assert!((of(scale) / of(1.0) - 1.0).abs() < 1e-5, "{scale}: {}", of(scale));
        }
    }

    /// Eyes are in the dark where nothing can be seen; a background that crosses the floor of vision changes nothing
    /// at once.
    #[test]
    fn darkness_counts_to_eyes() {
        let adapted = |background: f32| {
            log_average_to_eyes(&Plane::from_fn(100, 1, |x, _| if x == 0 { 100.0 } else { background })).unwrap()
        };
        let expected = (0.01 * 100_f64.ln() + 0.99 * 1e-4_f64.ln()).exp();
        for background in [0.0, 0.9e-4, 1.000_1e-4] {
            assert!((adapted(background) / expected - 1.0).abs() < 1e-3, "{background}: {}", adapted(background));
        }
        assert!(log_average_to_eyes(&Plane::filled(2, 2, f32::NAN)).is_none());
    }

    #[test]
    fn weights_choose_what_is_averaged() {
        let plane = Plane::from_fn(20, 4, |x, _| if x < 10 { 1.0 } else { 100.0 });
        assert!((log_average_to_eyes(&plane).unwrap() - 10.0).abs() < 1e-6);
        let right = weighted_log_average_to_eyes(&plane, |x, _| f64::from(u8::from(x >= 10)));
        assert!((right.unwrap() - 100.0).abs() < 1e-4);
    }
}
