//! Whole numbers of arguments, refused in words that say what would be right.

use std::ops::RangeInclusive;

/// A whole number of a range, for `value_parser`.
pub(super) fn whole(
    range: RangeInclusive<u32>,
) -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| match (*range.start(), *range.end()) {
            (least, u32::MAX) => format!("\"{text}\" is not a whole number from {least} on"),
            (least, most) => format!("\"{text}\" is not a whole number from {least} to {most}"),
        })
    }
}

/// A seed: any whole number of 64 bits.
pub(super) fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("\"{text}\" is not a whole number from 0 to {}", u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_such_number_is_told() {
        let samples = whole(1..=u32::MAX);
        assert_eq!((samples("1"), whole(1..=1023)("1023")), (Ok(1), Ok(1023)));
        for refused in ["0", "-3", "0.5", "8,5", "many", "4294967296"] {
            let told = samples(refused).expect_err(refused);
            assert_eq!(told, format!("\"{refused}\" is not a whole number from 1 on"));
        }
        assert_eq!(whole(1..=1023)("1024").expect_err("above"), "\"1024\" is not a whole number from 1 to 1023");
        assert_eq!((parse_seed("7"), parse_seed("-1").is_err()), (Ok(7), true));
    }
}
