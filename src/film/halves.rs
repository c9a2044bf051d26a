//! What the halves of a pixel say together: the one place that knows what holds where one of them is empty.

use super::{CHANNELS, HalfPixel, opponent};
use crate::sampler::Half;

/// The halves of a pixel that have samples, of which its picture is the plain mean.
#[derive(Clone, Copy, Debug)]
pub enum Halves<'a> {
    /// Both have.
    Both([&'a HalfPixel; 2]),
    /// One has, as in a render of one sample or one that was interrupted in its first pass: it is the
    /// picture. Empty where neither has.
    Only(&'a HalfPixel),
}

/// Variance of a pixel's mean over that of one sample: (1/n_A + 1/n_B) / 4, or 1/n where one half has all samples.
pub fn share_of_mean(samples: [u32; 2]) -> f64 {
    match samples {
        [only, 0] | [0, only] => 1.0 / f64::from(only.max(1)),
        both => variance_of_mean_of_both([1.0; 2], both),
    }
}

/// The mean is the plain average of the halves'.
fn variance_of_mean_of_both(of_sample: [f64; 2], samples: [u32; 2]) -> f64 {
    let of_half = |half: usize| of_sample[half] / f64::from(samples[half]);
    0.25 * (of_half(0) + of_half(1))
}

impl HalfPixel {
    /// Luminance of the mean, scene units.
    pub fn luminance(&self) -> f64 {
        opponent(self.mean)[0]
    }
}

impl<'a> Halves<'a> {
    /// The halves A and B of a pixel.
    pub fn of([a, b]: [&'a HalfPixel; 2]) -> Self {
        match [a.samples, b.samples] {
            [_, 0] => Self::Only(a),
            [0, _] => Self::Only(b),
            _ => Self::Both([a, b]),
        }
    }

    /// One half, or the other where it is empty.
    pub fn half_or_other(self, half: Half) -> &'a HalfPixel {
        match self {
            Self::Both(both) => both[half.index()],
            Self::Only(only) => only,
        }
    }

    /// The mean of what each half says.
    pub fn mean(self, of: impl Fn(&HalfPixel) -> f64) -> f64 {
        match self {
            Self::Both([a, b]) => 0.5 * (of(a) + of(b)),
            Self::Only(only) => of(only),
        }
    }

    /// Half of what they differ by; 0 where there is nothing to differ from.
    pub fn half_difference(self, of: impl Fn(&HalfPixel) -> f64) -> f64 {
        match self {
            Self::Both([a, b]) => 0.5 * (of(a) - of(b)),
            Self::Only(_) => 0.0,
        }
    }

    /// Unbiased variance of one sample in an opponent channel, the mean of the halves'. 0 of a single sample.
    pub fn sample_variance(self, channel: usize) -> f64 {
        match self {
            Self::Both(both) => {
                let [a, b] = variances_of_both(both, channel);
                0.5 * (a + b)
            }
            Self::Only(only) => only.sample_variance(channel),
        }
    }

    /// [`Self::sample_variance`] of each channel.
    pub fn sample_variances(self) -> [f64; CHANNELS] {
        std::array::from_fn(|channel| self.sample_variance(channel))
    }

    /// Variance of the mean in an opponent channel by the samples' own scatter: (s_A²/n_A + s_B²/n_B) / 4, or s²/n
    /// where one half has all samples. 0 of a single sample.
    pub fn variance_of_mean(self, channel: usize) -> f64 {
        match self {
            Self::Both(both) => {
                variance_of_mean_of_both(variances_of_both(both, channel), both.map(|half| half.samples))
            }
            Self::Only(only) => only.sample_variance(channel) / f64::from(only.samples.max(1)),
        }
    }
}

/// Unbiased variance of one sample, as each half has it. A half of one sample takes the other's; where both have one,
/// what they differ by tells, and both have that.
fn variances_of_both([a, b]: [&HalfPixel; 2], channel: usize) -> [f64; 2] {
    match (a.samples, b.samples) {
        (1, 1) => [0.5 * (opponent(a.mean)[channel] - opponent(b.mean)[channel]).powi(2); 2],
        (1, _) => [b.sample_variance(channel); 2],
        (_, 1) => [a.sample_variance(channel); 2],
        _ => [a.sample_variance(channel), b.sample_variance(channel)],
    }
}
