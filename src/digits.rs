//! Numbers as people read them, in legends, plots and tables.

/// Sizes that are written without a power of ten.
const READABLE: std::ops::Range<f64> = 1e-4..1e7;

/// So many significant digits, all of them before the point, without a tail of zeros: of three "1024", "12.3",
/// "0.0012". With a power of ten below 1e-4 and from 1e7 on.
pub fn significant(value: f64, digits: usize) -> String {
    let after_the_first = digits.saturating_sub(1);
    if value == 0.0 {
        "0".to_owned()
    } else if READABLE.contains(&value.abs()) {
        let after_the_point = (after_the_first as f64 - value.abs().log10().floor()).max(0.0) as usize;
        without_zeros(&format!("{value:.after_the_point$}")).to_owned()
    } else if value.is_finite() {
        let text = format!("{value:.after_the_first$e}");
        let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{power}", without_zeros(mantissa))
    } else {
        value.to_string()
    }
}

fn without_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_count_are_kept_and_zeros_are_not() {
        for (value, digits, text) in [
            (0.0, 3, "0"),
            (1.0, 6, "1"),
            (1024.0, 3, "1024"),
            (1200.0, 3, "1200"),
            (12.34, 3, "12.3"),
            (99.96, 3, "100"),
            (0.1234, 3, "0.123"),
            (0.0012, 3, "0.0012"),
            (-0.5, 3, "-0.5"),
            (1e9, 6, "1e9"),
            (1.234e-7, 3, "1.23e-7"),
            (1234.5678, 6, "1234.57"),
            (f64::INFINITY, 3, "inf"),
        ] {
            assert_eq!(significant(value, digits), text);
        }
    }
}
