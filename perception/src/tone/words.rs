//! Numbers for people.

use std::fmt;

/// A quantity of any size as it is shown: with four decimals where these say something of it, else by a power of ten.
pub(super) struct Shown(pub(super) f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = self;
        if *value == 0.0 || (1e-3..1e7).contains(&value.abs()) {
            write!(f, "{value:.4}")
        } else {
            write!(f, "{value:.3e}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_shown_as_0_that_is_not() {
        for (value, shown) in [
            (0.0, "0.0000"),
            (277.8, "277.8000"),
            (-0.25, "-0.2500"),
            (1e-3, "0.0010"),
            (9.96e-4, "9.960e-4"),
            (1e-30, "1.000e-30"),
            (2.5e7, "2.500e7"),
        ] {
            assert_eq!(Shown(value).to_string(), shown);
        }
    }
}
