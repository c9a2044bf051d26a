//! Numbers of arguments, refused in words that say what would be right.

use fechner::scene::{MAX_EXPOSURE_STOPS, NITS_PER_UNIT};
use std::ops::RangeInclusive;
use std::time::Duration;

/// A whole number of a range, for `value_parser`.
pub(super) fn whole(
    range: RangeInclusive<u32>,
) -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let (least, most) = (*range.start(), *range.end());
        number.ok_or_else(|| format!("\"{text}\" is not a whole number from {least} to {most}"))
    }
}

/// A seed: any whole number of 64 bits.
pub(super) fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("\"{text}\" is not a whole number from 0 to {}", u64::MAX))
}

/// A time above 0 s, of thirty years at most: more is as good as no limit, and clocks must be able to add it.
pub(super) fn parse_seconds(text: &str) -> Result<Duration, String> {
    const MAX_SECONDS: f64 = 1e9;
    parse_positive(text).map(|seconds| Duration::from_secs_f64(seconds.min(MAX_SECONDS)))
}

/// A number above 0.
pub(super) fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("\"{text}\" is not a number above 0")),
    }
}

/// A probability in per cent that is more than chance and less than certainty.
pub(super) fn parse_confidence(text: &str) -> Result<f64, String> {
    let (least, most) = (50.0, 99.99);
    let number = text.parse().ok().filter(|value| (least..=most).contains(value));
    number.ok_or_else(|| format!("\"{text}\" is not a confidence from {least} to {most} per cent"))
}

/// The most that a sample may have in scene units: above 0 as the tracer has it, in f32.
pub(super) fn parse_radiance(text: &str) -> Result<f32, String> {
    let least = f32::from_bits(1);
    let number = text.parse::<f64>().ok().map(|value| value as f32).filter(|value| *value > 0.0 && value.is_finite());
    number.ok_or_else(|| format!("\"{text}\" is not a radiance from {least:e} to {:e} scene units", f32::MAX))
}

/// A luminance of RGB (1, 1, 1) that pictures can have.
pub(super) fn parse_unit(text: &str) -> Result<f64, String> {
    let (least, most) = (NITS_PER_UNIT.start(), NITS_PER_UNIT.end());
    let number = text.parse().ok().filter(|value| NITS_PER_UNIT.contains(value));
    number.ok_or_else(|| format!("\"{text}\" is not a luminance from {least:e} to {most:e} cd/m²"))
}

/// Any number.
pub(super) fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| format!("\"{text}\" is not a number"))
}

/// A number of stops that operators know.
pub(super) fn parse_stops(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(stops) if stops.abs() <= MAX_EXPOSURE_STOPS => Ok(stops),
        _ => Err(format!("\"{text}\" is not a number of stops from -{MAX_EXPOSURE_STOPS} to {MAX_EXPOSURE_STOPS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_what_clocks_can_count() {
        assert_eq!(parse_seconds("0.5"), Ok(Duration::from_millis(500)));
        for endless in ["1e20", "1e308"] {
            assert_eq!(parse_seconds(endless), Ok(Duration::from_secs(1_000_000_000)), "{endless}");
        }
        for refused in ["0", "-1", "inf", "nan", "a minute"] {
            assert!(parse_seconds(refused).is_err(), "{refused}");
        }
    }

    #[test]
    fn stops_and_units_are_numbers_that_films_can_keep() {
        assert_eq!((parse_stops("-2.5"), parse_finite("-1")), (Ok(-2.5), Ok(-1.0)));
        for refused in ["nan", "inf", "-inf", "101", "much"] {
            assert!(parse_stops(refused).is_err(), "{refused}");
        }
        assert_eq!((parse_unit("1e-6"), parse_unit("179")), (Ok(1e-6), Ok(179.0)));
        for refused in ["0", "-1", "1e-7", "1e10", "1e300", "inf", "nan"] {
            assert!(parse_unit(refused).is_err(), "{refused}");
        }
        assert!(parse_finite("nan").is_err() && parse_finite("inf").is_err());
    }

    #[test]
    fn a_radiance_is_above_nothing_in_f32() {
        assert_eq!((parse_radiance("3"), parse_radiance("1e-40")), (Ok(3.0), Ok(1e-40)));
        for refused in ["0", "-1", "1e-50", "1e39", "inf", "nan", "bright"] {
            let told = parse_radiance(refused).expect_err(refused);
            assert_eq!(told, format!("\"{refused}\" is not a radiance from 1e-45 to 3.4028235e38 scene units"));
        }
    }

    #[test]
    fn what_is_no_such_number_is_told() {
        let samples = whole(1..=u32::MAX);
        assert_eq!((samples("1"), whole(1..=1023)("1023")), (Ok(1), Ok(1023)));
        for refused in ["0", "-3", "0.5", "8,5", "many", "4294967296"] {
            let told = samples(refused).expect_err(refused);
            assert_eq!(told, format!("\"{refused}\" is not a whole number from 1 to 4294967295"));
        }
        assert_eq!(whole(1..=1023)("1024").expect_err("above"), "\"1024\" is not a whole number from 1 to 1023");
        assert_eq!((parse_seed("7"), parse_seed("-1").is_err()), (Ok(7), true));
    }
}
