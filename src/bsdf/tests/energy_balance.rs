//! White furnaces: what a model gives back of uniform light from everywhere. What is lost or made between two
//! directions alone is not seen here.

use super::cases::{Budget, Case, bumpy_cases, delta_cases, smooth_cases, views};
use super::sphere::{Bins, integrate};
use super::statistics::{Mean, Random, normal_p, sidak};
use glam::Vec3;

/// Share of the light that a model may be off by; none may give back more than comes in by more than that.
const fn tolerance(budget: Budget) -> f64 {
    match budget {
        Budget::Lossless | Budget::AtMost => 0.005,
        Budget::NearlyLossless => 0.01,
        Budget::Kirchhoff => 0.04,
    }
}

const SAMPLES: usize = 60_000;
/// Error of quadrature along the edges that refraction makes.
const QUADRATURE_ERROR: f64 = 1e-3;

/// Energy that comes back by sampling, in the brightest channel.
fn by_sampling(case: &Case, wo: Vec3, seed: u64) -> Mean {
    let mut random = Random::new(seed);
    let mut mean = Mean::default();
    for _ in 0..SAMPLES {
        mean.add(
            case.bsdf
                .sample(wo, random.triple())
                .map_or(0.0, |sample| f64::from(sample.weight.z) * case.energy_per_radiance(wo, sample.wi)),
        );
    }
    mean
}

/// The same by quadrature of the smooth lobes, plus the exact share of the delta lobes.
fn by_quadrature(case: &Case, wo: Vec3) -> f64 {
    // Fewer bins miss slivers of refracted light that fall between the first points of quadrature.
    let bins = Bins { heights: 64, azimuths: 64 };
    let peaks = case.peaks(wo);
    let value = |wi| {
        let energy = case.energy_per_radiance(wo, wi);
        [f64::from(case.bsdf.evaluate(wo, wi).value.z) * energy, 0.0]
    };
    let smooth: f64 = (0..bins.count()).map(|index| integrate(bins.cell(index), &peaks, &value)[0]).sum();
    smooth + delta_energy(case, wo)
}

/// Energy of the delta lobes: each is found by trying the third random number.
fn delta_energy(case: &Case, wo: Vec3) -> f64 {
    let mut energies = [0.0; 2];
    for step in 0..1000 {
        let u = [0.3, 0.4, (step as f32 + 0.5) / 1000.0];
        if let Some(sample) = case.bsdf.sample(wo, u).filter(|s| s.lobe.is_delta()) {
            energies[usize::from(sample.lobe.is_transmission())] =
                f64::from(sample.weight.z * sample.pdf) * case.energy_per_radiance(wo, sample.wi);
        }
    }
    energies.iter().sum()
}

fn all_cases() -> Vec<Case> {
    smooth_cases().into_iter().chain(delta_cases()).chain(bumpy_cases()).collect()
}

/// Significance 1e-3 over all models and views for the agreement of sampling and quadrature.
#[test]
fn energy_is_what_the_model_promises_by_quadrature_and_by_sampling() {
    let cases = all_cases();
    let views: Vec<Vec3> = views().into_iter().step_by(2).collect();
    let significance = sidak(1e-3, cases.len() * views.len());
    let mut failures = Vec::new();
    for (number, case) in cases.iter().enumerate() {
        let mut worst = (f64::MIN, 0.0);
        for (view, &wo) in views.iter().enumerate() {
            let energy = by_quadrature(case, wo);
            let error = match case.budget {
                Budget::AtMost | Budget::Kirchhoff => energy - 1.0,
                Budget::Lossless | Budget::NearlyLossless => (energy - 1.0).abs(),
            };
            if error > worst.0 {
                worst = (error, wo.z);
            }
            failures.extend(disagreement(case, wo, energy, significance, (number * 100 + view) as u64 + 7));
        }
        println!("{}: worst furnace error {:.5} at cos {}", case.name, worst.0, worst.1);
        if worst.0 > tolerance(case.budget) {
            failures.push(format!("{}: furnace error {:.5} at cos {}", case.name, worst.0, worst.1));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// What is wrong between energy by sampling and `energy` by quadrature, if anything is.
fn disagreement(case: &Case, wo: Vec3, energy: f64, significance: f64, seed: u64) -> Option<String> {
    let sampled = by_sampling(case, wo, seed);
    let error = sampled.standard_error();
    let difference = ((sampled.mean() - energy).abs() - QUADRATURE_ERROR).max(0.0);
    let p = normal_p(difference / error.max(1e-9));
    // Beyond an error of 5e-3 the test could not tell 1 from 1.02.
    (p < significance || error > 5e-3).then(|| {
        let (name, cos, mean) = (&case.name, wo.z, sampled.mean());
        format!("{name} cos {cos}: sampled {mean:.5} ± {error:.5}, quadrature {energy:.5}, p {p:.1e}")
    })
}
