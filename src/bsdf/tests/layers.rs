//! Coated metal beside its two layers, between which light is followed by chance.

use super::statistics::{Mean, Random};
use crate::bsdf::albedo_table::direction_at;
use crate::bsdf::{Bsdf, DielectricTables, LayerTables, WidthRange};
use crate::scene::Distribution;
use glam::Vec3;
use std::sync::LazyLock;

/// A metal that colours light, by its index relative to air.
const ETA: Vec3 = Vec3::new(0.2, 0.9, 1.3);
const K: Vec3 = Vec3::new(3.4, 2.5, 1.9);
const COAT: f32 = 1.5;
static BOUNDARY: LazyLock<DielectricTables> = LazyLock::new(|| DielectricTables::new(COAT, Distribution::Ggx));
const PATHS: usize = 40_000;

/// What a rough boundary over a rough metal gives back of a path from `wo`.
fn of_two_layers(boundary: &Bsdf, metal: &Bsdf, wo: Vec3, random: &mut Random) -> Vec3 {
    let Some(first) = boundary.sample(wo, random.triple()) else { return Vec3::ZERO };
    let (mut weight, mut towards) = (first.weight, first.wi);
    // Paths that are still inside then carry less than 1e-6.
    for _ in 0..200 {
        if towards.z > 0.0 {
            return weight;
        }
        let Some(off_metal) = metal.sample(-towards, random.triple()) else { return Vec3::ZERO };
        let Some(next) = boundary.sample(-off_metal.wi, random.triple()) else { return Vec3::ZERO };
        weight *= off_metal.weight * next.weight;
        towards = next.wi;
    }
    Vec3::ZERO
}

fn mean_of(mut path: impl FnMut() -> Vec3) -> Vec3 {
    let mut channels = [Mean::default(), Mean::default(), Mean::default()];
    for _ in 0..PATHS {
        for (mean, value) in channels.iter_mut().zip(path().to_array()) {
            mean.add(f64::from(value));
        }
    }
    Vec3::from_array(channels.map(|mean| mean.mean() as f32))
}

/// Within 10 %, of which chance is 1 or 2 %: the angles at which light meets the metal are known by their mean alone,
/// and rough coats spread them. By what the coat lets out as seen from outside it was up to 1.4 of the two layers.
#[test]
fn a_coated_metal_gives_back_what_its_two_layers_do() {
    let mut random = Random::new(11);
    let mut worst = 1.0f32;
    for (coat, metal) in [(0.0f32, 0.3f32), (0.03, 0.0), (0.1, 0.02), (0.2, 0.02), (0.2, 0.3), (0.35, 0.05), (0.5, 0.5)]
    {
        let widths = [coat, metal].map(WidthRange::Constant);
        let tables = LayerTables::new(COAT, [Distribution::Ggx; 2], widths);
        let layered = Bsdf::coated_conductor(ETA, K, metal.sqrt(), coat.sqrt(), &tables);
        let boundary = Bsdf::dielectric(COAT, coat.sqrt(), Vec3::ONE, Some(&BOUNDARY));
        let base = Bsdf::conductor(ETA / COAT, K / COAT, metal.sqrt());
        for mu in [0.95f32, 0.5, 0.15] {
            let wo = direction_at(mu);
            let apart = mean_of(|| of_two_layers(&boundary, &base, wo, &mut random));
            let together = mean_of(|| layered.sample(wo, random.triple()).map_or(Vec3::ZERO, |sample| sample.weight));
            let ratio = together / apart;
            println!("coat {coat}, metal {metal}, cosine {mu}: {together:.3} of {apart:.3}, {ratio:.3}");
            worst = ratio
                .to_array()
                .into_iter()
                .fold(worst, |worst, r| if (r - 1.0).abs() > (worst - 1.0).abs() { r } else { worst });
        }
    }
    assert!((worst - 1.0).abs() < 0.1, "{worst}");
}
