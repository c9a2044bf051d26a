//! Tests that sampling matches the pdf, and that the pdf integrates to 1 less what is discarded.

use super::cases::{Case, bumpy_cases, delta_cases, smooth_cases, views};
use super::sphere::{Bins, integrate};
use super::statistics::{Random, chi_square_p, normal_p, sidak};
use glam::Vec3;

const SAMPLES: usize = 60_000;
/// Share of the pdf that quadrature may miss along the edges that refraction makes.
const QUADRATURE_ERROR: f64 = 1e-3;
const BINS: Bins = Bins { heights: 24, azimuths: 24 };
/// Bins after those of the sphere: delta reflection, delta transmission, nothing.
const EXTRA: usize = 3;

/// Observed and expected counts of one model from one side.
struct Histogram {
    observed: Vec<f64>,
    expected: Vec<f64>,
}

fn histogram(case: &Case, wo: Vec3, seed: u64) -> Histogram {
    let mut observed = vec![0.0; BINS.count() + EXTRA];
    let mut probability = vec![0.0; BINS.count() + EXTRA];
    let mut random = Random::new(seed);
    for _ in 0..SAMPLES {
        let bin = match case.bsdf.sample(wo, random.triple()) {
            None => BINS.count() + 2,
            Some(sample) if sample.lobe.is_delta() => {
                let bin = BINS.count() + usize::from(sample.lobe.is_transmission());
                probability[bin] = f64::from(sample.pdf);
                bin
            }
            Some(sample) => BINS.index(sample.wi),
        };
        observed[bin] += 1.0;
    }
    let peaks = case.peaks(wo);
    for (index, probability) in probability.iter_mut().take(BINS.count()).enumerate() {
        let pdf = |wi| [f64::from(case.bsdf.evaluate(wo, wi).pdf), 0.0];
        *probability = integrate(BINS.cell(index), &peaks, &pdf)[0];
    }
    let used: f64 = probability.iter().sum();
    probability[BINS.count() + 2] = (1.0 - used).max(0.0);
    Histogram { observed, expected: probability.iter().map(|p| p * SAMPLES as f64).collect() }
}

impl Histogram {
    /// p-value of Pearson's test, bins that expect fewer than 5 being merged into one.
    fn p(&self) -> f64 {
        let mut statistic = 0.0;
        let mut bins = 0.0;
        let mut rest = (0.0, 0.0);
        let mut add = |observed: f64, expected: f64| {
            statistic += (observed - expected) * (observed - expected) / expected;
            bins += 1.0;
        };
        for (&observed, &expected) in self.observed.iter().zip(&self.expected) {
            if expected >= 5.0 {
                add(observed, expected);
            } else {
                rest = (rest.0 + observed, rest.1 + expected);
            }
        }
        if rest.1 >= 5.0 {
            add(rest.0, rest.1);
        } else if rest.0 > 25.0 {
            // Hardly anything was expected and much came: no chi-square is needed to reject that.
            return 0.0;
        }
        if bins < 2.0 {
            return 1.0;
        }
        chi_square_p(statistic, bins - 1.0)
    }

    /// |Z| of the discarded share, beyond the error of quadrature.
    fn discarded_z(&self) -> f64 {
        let last = self.observed.len() - 1;
        let share = self.expected[last] / SAMPLES as f64;
        let deviation = (SAMPLES as f64 * share * (1.0 - share)).sqrt().max(5.0);
        let difference = (self.observed[last] - self.expected[last]).abs();
        (difference - QUADRATURE_ERROR * SAMPLES as f64).max(0.0) / deviation
    }
}

/// Significance 1e-3 over all models and views, once for the chi-square and once for the discarded share.
#[test]
fn samples_follow_their_pdf() {
    let cases: Vec<Case> = smooth_cases().into_iter().chain(delta_cases()).chain(bumpy_cases()).collect();
    let views = views();
    let significance = sidak(1e-3, cases.len() * views.len());
    let mut failures = Vec::new();
    for (number, case) in cases.iter().enumerate() {
        for (view, &wo) in views.iter().enumerate() {
            let histogram = histogram(case, wo, (number * 100 + view) as u64);
            let p = histogram.p();
            let z = histogram.discarded_z();
            if p < significance || normal_p(z) < significance {
                let name = &case.name;
                let cos = wo.z;
                failures.push(format!("{name}, cos {cos}: chi-square p {p:.2e}, discarded z {z:.1}"));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
