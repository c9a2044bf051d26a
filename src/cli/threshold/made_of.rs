//! Whether a picture is made of the halves that tell its noise.

use crate::cli::picture::InputPicture;

/// What half floats hold above 0, in a file's unit.
const SMALLEST_HALF: f64 = 6e-8;

/// What a guide has of the halves.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum MadeOf {
    /// It is their mean, in most of its values.
    TheirMean,
    /// One of them, or a mean with other weights: its noise depends on how noisy each of them is, which two pictures do not tell. A reference
    /// beside a render was taken to be as noisy as that, and noise to be 1.6 times as visible as it is.
    OneMoreThanTheOther,
    /// Neither, as far as is known.
    Else,
}

impl MadeOf {
    /// By where the guide's values lie between the halves', in most pixels: some may have been changed since, or not be finite in one of
    /// them, and files with loss change all of them a little.
    pub(super) fn of(guide: &InputPicture, [a, b]: &[InputPicture; 2]) -> Self {
        if !(guide.has_values_like(a) && guide.has_values_like(b)) {
            return Self::Else;
        }
        // What files hold between black and white has 8 bits, perhaps.
        let step = if guide.holds_codes() { 2.0 / 255.0 } else { SMALLEST_HALF * guide.light_of_one_cd_m2() };
        let [guide, a, b] =
            [guide, a, b].map(|picture| picture.light_cd_m2().unwrap_or_else(|| picture.codes().to_vec()));
        let values = [&guide, &a, &b].map(|picture| picture.as_flattened().iter().map(|&value| f64::from(value)));
        let [guide, a, b] = values;
        let shares = Shares::of(guide.zip(a.zip(b)), step);
        match shares.common() {
            Some(0.48..=0.52) => Self::TheirMean,
            Some(-0.02..=1.02) => Self::OneMoreThanTheOther,
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

/// How much of the one half, and not of the other, the guide's values have: 0 to 1 of a mean, anything of a picture that is none.
struct Shares {
    /// Counts of shares from −0.5 to 1.5.
    bins: [usize; Self::BINS],
    /// With those beyond.
    count: usize,
}

impl Shares {
    const LEAST: f64 = -0.5;
    const BINS: usize = 200;
    const A_UNIT: f64 = 100.0;

    /// `values`: of the guide and both halves. `step`: that files hold values by, beside what they round of them.
    fn of(values: impl Iterator<Item = (f64, (f64, f64))>, step: f64) -> Self {
        /// Of halves, with 11 bits: the guide's own rounding, and that of what it is made of.
        const ROUNDING: f64 = 1.0 / 1024.0;
        let mut shares = Self { bins: [0; Self::BINS], count: 0 };
        for (guide, (a, b)) in values {
            // Where halves hardly differ, any clean picture is a mean of them to within rounding.
            if (a - b).abs() > 2.0 * (ROUNDING * (a.abs() + b.abs()) + step) {
                shares.count += 1;
                let bin = ((guide - b) / (a - b) - Self::LEAST) * Self::A_UNIT;
                if (0.0..Self::BINS as f64).contains(&bin) {
                    shares.bins[bin as usize] += 1;
                }
            }
        }
        shares
    }

    /// The median, if four values of five are about as near to it as files with loss leave them. Of a clean picture between two halves as noisy as
    /// each other three of ten are: 2/π · atan ½.
    fn common(&self) -> Option<f64> {
        const NEAR: usize = 25;
        const LEAST_SHARE: f64 = 0.8;
        let before = |bin: usize| self.bins[..bin].iter().sum::<usize>();
        let inside = before(Self::BINS);
        let median = (0..Self::BINS).find(|&bin| 2 * before(bin + 1) >= inside.max(1))?;
        let near = before((median + NEAR + 1).min(Self::BINS)) - before(median.saturating_sub(NEAR));
        let is_common = near as f64 >= LEAST_SHARE * self.count as f64;
        is_common.then_some(Self::LEAST + (median as f64 + 0.5) / Self::A_UNIT)
    }
}
