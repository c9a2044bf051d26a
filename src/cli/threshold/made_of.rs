//! Whether a picture is made of the halves that tell its noise.

use crate::cli::picture::InputPicture;

/// What a guide has of the halves.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum MadeOf {
    /// It is the mean of their values in every pixel.
    TheirMean,
    /// One of them, or a mean with other weights: its noise depends on how noisy each of them is, which two pictures do not tell. A reference
    /// beside a render was taken to be as noisy as that, and noise to be 1.6 times as visible as it is.
    OneMoreThanTheOther,
    /// Neither, as far as is known.
    Else,
}

impl MadeOf {
    /// By values in every pixel, as near as files round.
    pub(super) fn of(guide: &InputPicture, [a, b]: &[InputPicture; 2]) -> Self {
        /// Of halves, with 11 bits: the guide's own rounding, and that of what it is made of.
        const ROUNDING: f64 = 1.0 / 1024.0;
        /// Of the halves' squared difference, which a mean's rounding is far below, and a clean picture's distance from their means is not:
        /// 0.25.
        const LEFT: f64 = 0.04;
        if !(guide.has_values_like(a) && guide.has_values_like(b)) {
            return Self::Else;
        }
        // What files hold between black and white has 8 bits, perhaps.
        let step = if guide.holds_codes() { 1.0 / 255.0 } else { 1e-6 };
        let values = || {
            let [guide, a, b] =
                [guide, a, b].map(|picture| picture.codes().as_flattened().iter().map(|&v| f64::from(v)));
            guide.zip(a.zip(b))
        };
        let (along, squared) = values().fold((0.0, 0.0), |(along, squared), (guide, (a, b))| {
            (along + (guide - b) * (a - b), squared + (a - b).powi(2))
        });
        let share = along / squared;
        let residual = |(guide, (a, b)): (f64, (f64, f64))| guide - (share * a + (1.0 - share) * b);
        let rounds =
            |value @ (_, (a, b)): (f64, (f64, f64))| residual(value).abs() <= ROUNDING * (a.abs() + b.abs()) + step;
        // Where halves hardly differ, any clean picture is a mean of them to within rounding.
        let residuals: f64 = values().map(|value| residual(value).powi(2)).sum();
        let is_mean = residuals <= LEFT * squared && values().all(rounds);
        match share {
            0.49..=0.51 if is_mean => Self::TheirMean,
            -0.01..=1.01 if is_mean => Self::OneMoreThanTheOther,
            _ => Self::Else,
        }
    }

    pub(super) fn told(self) -> Option<&'static str> {
        match self {
            Self::TheirMean => {
                Some("it is the mean of the halves: what noise it has by them is not taken for detail that hides noise")
            }
            Self::OneMoreThanTheOther => Some(
                "it is one of the halves, or has more of one: how noisy it is cannot be told, and what noise it has counts as detail that \
                 hides noise; their mean, or a picture without noise, is better",
            ),
            Self::Else => None,
        }
    }
}
