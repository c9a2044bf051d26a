//! Lamps smaller than a pixel, which the first samples may pass by.

use crate::support::{add_material, add_rectangle, add_sphere, diffuse, empty_scene, loop_settings, trace_settings};
use fechner::adaptive;
use fechner::adaptive::Quiet;
use fechner::adaptive::settings::Sampling;
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter};
use fechner::scene::Scene;
use glam::Vec3;
use std::sync::Arc;

const SIDE: u32 = 16;

/// Of lamps of this radiance, both sides of which shine, and whatever else.
fn tracer_of(filter: PixelFilter, radiance: f32, add: impl Fn(&mut Scene)) -> PathTracer {
    let mut scene = empty_scene();
    add_material(&mut scene, diffuse(0.0), Vec3::splat(radiance));
    add(&mut scene);
    PathTracer::new(Arc::new(scene), TraceSettings { filter, ..trace_settings(SIDE, SIDE, 1) })
}

const LAMP: fechner::scene::MaterialId = fechner::scene::MaterialId(0);

/// Mean of 8192 samples of each pixel.
fn found(tracer: &PathTracer) -> Vec<f32> {
    let mut film = Film::new(SIDE, SIDE);
    let block = |pixel, level| BlockWork::whole(pixel, Half::A, level);
    let blocks = (0..SIDE * SIDE).flat_map(|pixel| (0..11).map(move |level| block(pixel, level))).collect();
    tracer.trace(&SamplePlan { blocks }, &mut film, &|_| ());
    film.estimate(1.0).luminance_cd_m2.values().to_vec()
}

/// A ball of a fifth of a pixel and a needle of a twentieth, by each filter, within what samples find: scatter of 8192 and pieces that
/// also shine into the pixel beside theirs.
#[test]
fn shares_are_what_samples_find() {
    let ball = |scene: &mut Scene| add_sphere(scene, Vec3::new(0.03, 0.02, 0.0), 0.012, LAMP);
    let needle = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::new(-0.3, 0.05, 0.0), 0.005 * Vec3::Y, Vec3::new(0.6, 0.02, 0.0), LAMP);
    };
    for filter in [PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris] {
        for (name, add) in [("ball", &ball as &dyn Fn(&mut Scene)), ("needle", &needle)] {
            let tracer = tracer_of(filter, 1.0, add);
            let shares = tracer.share_of_small_lamps().expect("a small lamp");
            let found = found(&tracer);
            let held: Vec<usize> = (0..shares.len()).filter(|&pixel| shares[pixel] > 0.01).collect();
            assert!(!held.is_empty(), "{name}");
            let total = |of: &[f32]| held.iter().map(|&pixel| of[pixel]).sum::<f32>();
            let ratio = total(&shares) / total(&found);
            println!("{name} {filter:?}: {} pixels, {ratio}", held.len());
            assert!((0.7..1.1).contains(&ratio), "{name} by {filter:?}: {ratio}");
        }
    }
}

#[test]
fn lamps_that_are_large_or_hidden_or_turned_away_are_not_looked_for() {
    let far = Vec3::new(0.03, 0.02, 0.0);
    let hidden = |scene: &mut Scene| {
        add_sphere(scene, far, 0.006, LAMP);
        let black = add_material(scene, diffuse(0.0), Vec3::ZERO);
        add_sphere(scene, Vec3::Z, 0.2, black);
    };
    let turned = |scene: &mut Scene| {
        scene.materials[0].emits_both_sides = false;
        add_rectangle(scene, far, 0.004 * Vec3::Y, 0.004 * Vec3::X, LAMP);
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let cases: [(&str, Adding<'_>); 5] = [
        ("none", &|_| ()),
        ("a large ball", &|scene| add_sphere(scene, Vec3::ZERO, 0.3, LAMP)),
        ("a large screen", &|scene| add_rectangle(scene, -Vec3::ONE, 2.0 * Vec3::X, 2.0 * Vec3::Y, LAMP)),
        ("hidden", &hidden),
        ("turned away", &turned),
    ];
    for (name, add) in cases {
        assert!(tracer_of(PixelFilter::Gaussian, 1.0, add).share_of_small_lamps().is_none(), "{name}");
    }
}

/// Ten stars on black, of which each covers a thirtieth of a pixel: their light is that of an even render.
#[test]
fn stars_are_not_missed() {
    let star = |i: u32| Vec3::new(-0.7 + 0.3 * (i % 5) as f32 + 0.013 * i as f32, -0.3 + 0.5 * (i / 5) as f32, 0.0);
    let tracer = tracer_of(PixelFilter::Gaussian, 200.0, |scene| {
        (0..10).for_each(|i| add_sphere(scene, star(i), 0.011, LAMP));
    });
    let settings = loop_settings(100.0, Sampling::Adaptive, 8.0, None);
    let rendered = adaptive::render(&tracer, &settings, &Quiet).expect("renders");
    let (sum, even) = (rendered.film.estimate(1.0).luminance_cd_m2.mean(), found(&tracer));
    let even = even.iter().map(|&light| f64::from(light)).sum::<f64>() / even.len() as f64;
    assert!((sum / even - 1.0).abs() < 0.1, "{sum} for {even}");
}
