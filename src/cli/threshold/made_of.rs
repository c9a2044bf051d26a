//! Finds whether a picture is made of the halves that tell its noise.

use crate::cli::picture::InputPicture;

/// What a guide has of the halves.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum MadeOf {
    /// The guide is the halves' mean, in most of its values.
    TheirMean,
    /// The guide is one of the halves, or a mean with other weights: its noise depends on how noisy each of them is,
    /// which two pictures do not tell. It is told apart since a reference beside a render would else be taken to be as
    /// noisy as that, and noise to be 1.6 times as visible as it is.
    OneMoreThanTheOther,
    /// Neither, as far as is known.
    Else,
}

impl MadeOf {
    /// What a guide is made of, by where its values lie between the halves', in most pixels: some may have been changed
    /// since, or not be finite in one of them, and files with loss change all of them a little.
    pub(super) fn of(guide: &InputPicture, [a, b]: &[InputPicture; 2]) -> Self {
        /// What half floats hold above 0, in a file's unit.
        const SMALLEST_HALF: f64 = 6e-8;
        if !(guide.has_values_like(a) && guide.has_values_like(b)) {
            return Self::Else;
        }
        // What files hold between black and white has 8 bits, perhaps.
        let step = if guide.holds_codes() { 2.0 / 255.0 } else { SMALLEST_HALF * guide.light_of_one_cd_m2() };
        let [guide, a, b] =
            [guide, a, b].map(|picture| picture.light_cd_m2().unwrap_or_else(|| picture.stored_rgb().to_vec()));
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

/// How much of the one half, and not of the other, the guide's values have: 0 to 1 of a mean, anything of a picture
/// that is none.
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

    /// The mean of those about the median, if four values of five are about as near to that as files with loss leave
    /// them. Of a clean picture between two halves as noisy as each other three of ten are: 2/π · atan ½. Codes five
    /// apart have a mean of two fifths, or three.
    fn common(&self) -> Option<f64> {
        const NEAR: usize = 25;
        const MIN_SHARE: f64 = 0.8;
        /// Fewer leave the mean of fifths to chance.
        const MIN_COUNT: usize = 256;
        if self.count < MIN_COUNT {
            return None;
        }
        let before = |bin: usize| self.bins[..bin].iter().sum::<usize>();
        let inside = before(Self::BINS);
        let median = (0..Self::BINS).find(|&bin| 2 * before(bin + 1) >= inside.max(1))?;
        let about = median.saturating_sub(NEAR)..(median + NEAR + 1).min(Self::BINS);
        let near: usize = self.bins[about.clone()].iter().sum();
        let sum: f64 = about.map(|bin| self.bins[bin] as f64 * (bin as f64 + 0.5)).sum();
        let is_common = near as f64 >= MIN_SHARE * self.count as f64;
        is_common.then_some(Self::LEAST + sum / near as f64 / Self::A_UNIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODE: f64 = 1.0 / 255.0;

    /// About normal, of a standard deviation of 1.
    fn normal(state: &mut u64) -> f64 {
        let mut uniform = || {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (*state >> 32) as f64 / f64::from(u32::MAX)
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// Of a guide that is made of two halves of such noise about a light of 0.5, as files of such a step hold it.
    fn common(guide: impl Fn(f64, f64) -> f64, deviations: [f64; 2], step: f64) -> Option<f64> {
        let held = |value: f64| if step > 0.0 { (value / step).round() * step } else { value };
        let mut state = 1;
        let values = (0..4096).map(|_| {
            let [a, b] = deviations.map(|deviation| held(0.5 + deviation * normal(&mut state)));
            (held(guide(a, b)), (a, b))
        });
        Shares::of(values, 2.0 * step).common()
    }

    #[test]
    fn a_mean_is_known_and_a_clean_picture_is_none() {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let is_half = |share: Option<f64>| share.is_some_and(|share| (0.48..=0.52).contains(&share));
        assert!(is_half(common(mean, [0.1, 0.1], 0.0)) && is_half(common(mean, [0.05, 0.05], CODE)));
        assert!(common(|a, b| 0.7 * a + 0.3 * b, [0.1, 0.1], 0.0).is_some_and(|share| (0.69..0.71).contains(&share)));
        for deviations in [[0.1, 0.1], [0.1, 0.02], [0.05, 0.01]] {
            assert_eq!(common(|_, _| 0.5, deviations, 0.0), None, "{deviations:?}");
        }
        // Quiet codes say of a mean that it is one, or nothing.
        for deviation in [0.2, 0.5, 1.0, 1.5, 2.0].map(|codes| codes * CODE) {
            let found = common(mean, [deviation; 2], CODE);
            assert!(found.is_none() || is_half(found), "{deviation}: {found:?}");
        }
        assert_eq!(common(mean, [0.0, 0.0], 0.0), None, "halves that are alike say nothing");
    }
}
