//! Random numbers and the few distributions that the tests need.

/// Deterministic random numbers (SplitMix64; G. Steele et al. 2014).
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// Uniform in [0, 1).
    pub(super) fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    pub(super) fn triple(&mut self) -> [f32; 3] {
        [self.uniform(), self.uniform(), self.uniform()]
    }
}

/// Mean and its standard error, in one pass.
#[derive(Default)]
pub(super) struct Mean {
    count: f64,
    mean: f64,
    m2: f64,
}

impl Mean {
    pub(super) fn add(&mut self, x: f64) {
        self.count += 1.0;
        let delta = x - self.mean;
        self.mean += delta / self.count;
        self.m2 += delta * (x - self.mean);
    }

    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    pub(super) fn standard_error(&self) -> f64 {
        (self.m2 / (self.count * (self.count - 1.0))).sqrt()
    }
}

/// ln Γ(x) for x > 0, by Stirling's series after shifting x above 10.
fn ln_gamma(x: f64) -> f64 {
    let mut shift = 0.0;
    let mut x = x;
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let x2 = x * x;
    let series = (1.0 / 12.0 - (1.0 / 360.0 - 1.0 / (1260.0 * x2)) / x2) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

/// Regularised upper incomplete gamma function Q(a, x) (Abramowitz & Stegun 1964: the series 6.5.29 below a + 1, the
/// continued fraction 6.5.31 above).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let mut term = 1.0 / a;
        let mut sum = term;
        let mut n = a;
        while term > 1e-15 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - scale * sum
    } else {
        // The even part of the fraction, evaluated from its tail.
        let terms = 500;
        let mut tail = 0.0;
        for k in (1..=terms).rev() {
            let k = f64::from(k);
            tail = k * (k - a) / (x + 2.0 * k + 1.0 - a - tail);
        }
        scale / (x + 1.0 - a - tail)
    }
}

/// Probability that chi-square with so many degrees of freedom is at least `statistic`.
pub(super) fn chi_square_p(statistic: f64, degrees: f64) -> f64 {
    upper_gamma(0.5 * degrees, 0.5 * statistic)
}

/// Probability that a standard normal deviate is at least |z| away from 0.
pub(super) fn normal_p(z: f64) -> f64 {
    upper_gamma(0.5, 0.5 * z * z)
}

/// Significance of each of `tests` comparisons so that all together have `overall`.
pub(super) fn sidak(overall: f64, tests: usize) -> f64 {
    1.0 - (1.0 - overall).powf(1.0 / tests as f64)
}

#[test]
fn distributions_match_tables() {
    // Abramowitz & Stegun (1964), tables 26.7 and 26.1.
    for (statistic, degrees, p) in
        [(3.841_46, 1.0, 0.05), (18.307_0, 10.0, 0.05), (149.449, 100.0, 0.001), (67.327_6, 100.0, 0.995)]
    {
        let got = chi_square_p(statistic, degrees);
        assert!((got / p - 1.0).abs() < 1e-4, "{statistic} {degrees}: {got}");
    }
    assert!((normal_p(1.959_964) - 0.05).abs() < 1e-7);
    assert!((normal_p(3.290_527) - 0.001).abs() < 1e-8);
    assert!((chi_square_p(1500.0, 1500.0) - 0.495_144).abs() < 1e-4);
}
