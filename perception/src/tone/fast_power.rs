//! Powers by tables: what a tone operator needs at every pixel, several times faster than `powf` and the same on
//! every machine.
//!
//! A number is 2^e m with m in 1..2. Powers of both are looked up, m's between 512 places by a straight line.
//! Relative error below 3e-7 for exponents from 0 to 1.5, far below the hundredth that an eye can tell; not for
//! statistics or thresholds, which need the derivative too.

use std::sync::LazyLock;

/// Places of the mantissa's tables, a power of two.
const PLACES: usize = 512;
const MANTISSA_BITS: u32 = f32::MANTISSA_DIGITS - 1;
const REST_BITS: u32 = MANTISSA_BITS - PLACES.trailing_zeros();

/// A positive number taken apart.
struct Parts {
    biased_exponent: u8,
    place: usize,
    /// Way to the next place, 0 to 1.
    rest: f32,
}

/// `None` for what is not positive, normal and finite.
#[inline]
fn parts(x: f32) -> Option<Parts> {
    let bits = x.to_bits();
    let biased_exponent = bits >> MANTISSA_BITS;
    let rest = bits & ((1 << REST_BITS) - 1);
    // A sign counts as an exponent above all.
    (1..255).contains(&biased_exponent).then(|| Parts {
        biased_exponent: biased_exponent as u8,
        place: (bits >> REST_BITS) as usize & (PLACES - 1),
        rest: rest as f32 * (1.0 / (1 << REST_BITS) as f32),
    })
}

/// x to a fixed power.
pub(super) struct FixedPower {
    exponent: f64,
    octaves: [f64; 256],
    mantissas: [f64; PLACES + 1],
}

impl FixedPower {
    pub(super) fn new(exponent: f64) -> Self {
        let mantissa = |place: usize| (1.0 + place as f64 / PLACES as f64).powf(exponent);
        Self {
            exponent,
            octaves: std::array::from_fn(|biased| (exponent * (biased as f64 - 127.0)).exp2()),
            mantissas: std::array::from_fn(mantissa),
        }
    }

    /// x^exponent for x ≥ 0.
    #[inline]
    pub(super) fn raise(&self, x: f32) -> f64 {
        let Some(Parts { biased_exponent, place, rest }) = parts(x) else { return f64::from(x).powf(self.exponent) };
        let (low, high) = (self.mantissas[place], self.mantissas[place + 1]);
        self.octaves[usize::from(biased_exponent)] * (low + f64::from(rest) * (high - low))
    }
}

/// Logarithms of the mantissa and powers of two of a fraction.
struct Logarithms {
    log2: [f32; PLACES + 1],
    exp2: [f32; PLACES + 1],
}

static LOGARITHMS: LazyLock<Logarithms> = LazyLock::new(|| {
    let share = |place: usize| place as f64 / PLACES as f64;
    Logarithms {
        log2: std::array::from_fn(|place| (1.0 + share(place)).log2() as f32),
        exp2: std::array::from_fn(|place| share(place).exp2() as f32),
    }
});

/// Each x^exponent for x ≥ 0 and a finite exponent ≥ 0. Absolute error of the logarithm below 1e-6, so that a ratio
/// of 1000 to the power of 1 is off by less than 1e-5.
#[inline]
pub(super) fn powers(bases: [f32; 3], exponent: f32) -> [f32; 3] {
    let tables = &*LOGARITHMS;
    bases.map(|base| {
        let Some(Parts { biased_exponent, place, rest }) = parts(base) else { return base.powf(exponent) };
        let mantissa = tables.log2[place] + rest * (tables.log2[place + 1] - tables.log2[place]);
        let log = exponent * (f32::from(biased_exponent) - 127.0 + mantissa);
        let whole = log.floor();
        if !(-126.0..127.0).contains(&whole) {
            return base.powf(exponent);
        }
        let at = (log - whole) * PLACES as f32;
        let place = (at as usize).min(PLACES - 1);
        let share = at - place as f32;
        let scale = f32::from_bits(((whole as i32 + 127) as u32) << MANTISSA_BITS);
        scale * (tables.exp2[place] + share * (tables.exp2[place + 1] - tables.exp2[place]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers() -> impl Iterator<Item = f32> {
        (0..40_000).map(|i| 10.0_f32.powf(-12.0 + 24.0 * i as f32 / 40_000.0))
    }

    #[test]
    fn powers_are_those_of_the_library() {
        for exponent in [0.73, 1.0 / 0.73, 0.4, 1.0] {
            let power = FixedPower::new(exponent);
            let mut before = 0.0;
            for x in numbers() {
                let (found, right) = (power.raise(x), f64::from(x).powf(exponent));
                assert!((found / right - 1.0).abs() < 3e-7, "{x}^{exponent}: {found} for {right}");
                assert!(found >= before, "{x}^{exponent} falls");
                before = found;
            }
            for x in [0.0, 1e-40, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY] {
                let (found, right) = (power.raise(x), f64::from(x).powf(exponent));
                assert!(found == right || (found / right - 1.0).abs() < 3e-7, "{x}: {found} for {right}");
            }
        }
    }

    #[test]
    fn powers_of_colours_are_those_of_the_library() {
        for exponent in [0.0, 0.2, 0.947, 1.0, 1.5] {
            for x in numbers() {
                let (found, right) = (powers([x; 3], exponent)[1], f64::from(x).powf(f64::from(exponent)));
                assert!((f64::from(found) / right - 1.0).abs() < 1e-5, "{x}^{exponent}: {found} for {right}");
            }
        }
        assert_eq!(powers([0.0, 1.0, f32::INFINITY], 0.5), [0.0, 1.0, f32::INFINITY]);
        assert_eq!(powers([0.0; 3], 0.0), [1.0; 3]);
        assert!(powers([1e30; 3], 3.0)[0].is_infinite());
    }
}
