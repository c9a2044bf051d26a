//! Samples at which a curve has a quality, as far as its points tell. Beyond them it gives a bound, never a guess.

use serde::Serialize;
use std::fmt;

/// Mean samples a pixel at which a curve has a quality. JSON is `{"about": 41.2}`, `{"at_most": 32.0}` or
/// `{"more_than": 256.0}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reached {
    /// Between two points, or at one.
    About(f64),
    /// The curve's first point is better already: with how few it would do, nobody tried.
    AtMost(f64),
    /// The curve's last point is not good enough.
    MoreThan(f64),
}

impl Reached {
    /// Where a curve of (samples, quality) first reaches a quality, straight between points in the logarithm of
    /// samples.
    pub(super) fn by(curve: &[(f64, f64)], quality: f64) -> Self {
        let Some(index) = curve.iter().position(|point| point.1 >= quality) else {
            return Self::MoreThan(curve.last().map_or(0.0, |point| point.0));
        };
        let (samples, found) = curve[index];
        match index.checked_sub(1).map(|before| curve[before]) {
            None if found > quality => Self::AtMost(samples),
            None => Self::About(samples),
            Some((from, before)) => {
                let share = (quality - before) / (found - before);
                Self::About((from.ln() + share * (samples / from).ln()).exp())
            }
        }
    }

    /// The samples, where they are more than a bound. Only such ones have ratios.
    pub fn known(self) -> Option<f64> {
        match self {
            Self::About(samples) => Some(samples),
            Self::AtMost(_) | Self::MoreThan(_) => None,
        }
    }
}

/// "41.2", "≤ 32.0" or "> 256.0".
impl fmt::Display for Reached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sign, samples) = match self {
            Self::About(samples) => ("", samples),
            Self::AtMost(samples) => ("≤ ", samples),
            Self::MoreThan(samples) => ("> ", samples),
        };
        write!(f, "{sign}{samples:.*}", f.precision().unwrap_or(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_read_between_their_points() {
        let curve = [(4.0, 7.0), (8.0, 8.0), (16.0, 9.0)];
        let found = Reached::by(&curve, 8.5).known().expect("reached");
        assert!((found - 128f64.sqrt()).abs() < 1e-9);
        assert_eq!(Reached::by(&curve, 7.0), Reached::About(4.0));
        assert_eq!(Reached::by(&curve, 8.0).to_string(), "8.0");
    }

    /// A rule whose first render is better than what is asked for may need a tenth of it: that is no measurement.
    #[test]
    fn what_is_beyond_a_curves_ends_is_a_bound() {
        let curve = [(32.0, 9.85), (64.0, 9.95)];
        let (few, many) = (Reached::by(&curve, 9.8), Reached::by(&curve, 9.99));
        assert_eq!((few, few.known(), format!("{few:.0}").as_str()), (Reached::AtMost(32.0), None, "≤ 32"));
        assert_eq!((many, many.known(), format!("{many:.0}").as_str()), (Reached::MoreThan(64.0), None, "> 64"));
        assert_eq!(Reached::by(&[], 1.0), Reached::MoreThan(0.0));
        assert_eq!(serde_json::to_string(&few).expect("JSON"), r#"{"at_most":32.0}"#);
    }
}
