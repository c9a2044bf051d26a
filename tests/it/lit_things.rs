//! Small things that shine by others' light, and light beside the film, which the first samples may pass by.

use crate::support::{
    add_material, add_rectangle, add_sphere, constant_environment, diffuse, empty_scene, loop_settings, trace_settings,
};
use fechner::adaptive;
use fechner::adaptive::Quiet;
use fechner::adaptive::settings::Sampling;
use fechner::integrator::{Crop, PathTracer, TraceSettings};
use fechner::sampler::PixelFilter;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, Light, Motion, ScalarInput, Scene};
use glam::{Affine3A, Vec3};
use std::sync::Arc;

const SIDE: u32 = 16;
const WHITE: fechner::scene::MaterialId = fechner::scene::MaterialId(0);
const BLACK: fechner::scene::MaterialId = fechner::scene::MaterialId(1);

/// White and black things under a sun behind the camera.
fn tracer_of(add: impl Fn(&mut Scene)) -> PathTracer {
    let mut scene = empty_scene();
    add_material(&mut scene, diffuse(0.9), Vec3::ZERO);
    add_material(&mut scene, diffuse(0.0), Vec3::ZERO);
    let direction = Vec3::new(-0.1, -0.2, -1.0).normalize();
    scene.lights.push(Light::Directional { direction, irradiance: Vec3::ONE, angular_radius: 0.0, is_of_sky: false });
    add(&mut scene);
    PathTracer::new(Arc::new(scene), trace_settings(SIDE, SIDE, 1))
}

/// What is known of all pixels together: the shares of their samples, and the light.
fn known(tracer: &PathTracer) -> Option<[f32; 2]> {
    let things = tracer.known_things()?;
    let sum = |of: &dyn Fn(usize) -> f32| (0..(SIDE * SIDE) as usize).map(of).sum();
    Some([sum(&|pixel| things.share(pixel)), sum(&|pixel| things.light(pixel))])
}

/// Mean luminance of what a render of a visibility, or an even one of so many samples a pixel, finds; scene units.
fn mean_light(tracer: &PathTracer, nits_per_unit: f64, visibility: Option<f64>, even_spp: Option<u32>) -> f64 {
    let sampling = if visibility.is_some() { Sampling::Adaptive } else { Sampling::Uniform };
    let settings = loop_settings(nits_per_unit, sampling, visibility, even_spp);
    adaptive::render(tracer, &settings, &Quiet).expect("renders").film.estimate(1.0).luminance_cd_m2.mean()
}

/// A ball and a needle on black, and a ball that moves: what is known of them is what samples find.
#[test]
fn what_is_known_of_small_things_is_what_samples_find() {
    let place = Vec3::new(0.05, 0.04, 0.0);
    let moving = |scene: &mut Scene| {
        add_sphere(scene, place, 0.02, WHITE);
        scene.spheres[0].motion = Some(Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(0.4 * Vec3::X)));
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let cases: [(&str, Adding<'_>); 3] = [
        ("ball", &|scene| add_sphere(scene, place, 0.012, WHITE)),
        ("needle", &|scene| add_rectangle(scene, -0.3 * Vec3::X, 0.005 * Vec3::Y, Vec3::new(0.6, 0.02, 0.0), WHITE)),
        ("moving", &moving),
    ];
    for (name, add) in cases {
        let tracer = tracer_of(add);
        let found = (SIDE * SIDE) as f32 * mean_light(&tracer, 1.0, None, Some(4096)) as f32;
        let [_, light] = known(&tracer).expect("a small thing");
        println!("{name}: {light} for {found}");
        assert!((0.7..1.5).contains(&(light / found)), "{name}: {light} for {found}");
    }
}

/// Of what looks like all around it, or is a part of something larger, or hidden, nothing need be known.
#[test]
fn what_neighbours_tell_of_is_left_to_them() {
    let place = Vec3::new(0.05, 0.04, 0.0);
    let wall = |scene: &mut Scene, material| {
        add_rectangle(scene, Vec3::new(-9.0, -9.0, -1.0), 18.0 * Vec3::X, 18.0 * Vec3::Y, material);
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let covered = |scene: &mut Scene| {
        scene.materials[0].emission.factor = Vec3::splat(20.0);
        scene.materials[0].alpha = Alpha::Blend { value: ScalarInput::constant(0.9) };
        add_sphere(scene, place, 0.012, WHITE);
    };
    let cases: [(&str, bool, Adding<'_>); 7] = [
        ("a ball before black", true, &|scene| {
            wall(scene, BLACK);
            add_sphere(scene, place, 0.012, WHITE);
        }),
        ("a ball before a wall of its own material", false, &|scene| {
            wall(scene, WHITE);
            add_sphere(scene, place, 0.012, WHITE);
        }),
        ("a black ball before a black wall", false, &|scene| {
            let other_black = add_material(scene, diffuse(0.0), Vec3::ZERO);
            wall(scene, other_black);
            add_sphere(scene, place, 0.012, BLACK);
        }),
        ("a wall of many tiles", false, &|scene| {
            let tile = |step: i32| 0.02 * step as f32 - 0.64;
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let corner = Vec3::new(tile(x), tile(y), 0.0) * 2.0;
                add_rectangle(scene, corner, 0.04 * Vec3::X, 0.04 * Vec3::Y, WHITE);
            }
        }),
        ("a lamp that alpha covers", false, &covered),
        ("a black ball before the sky", true, &|scene| {
            scene.environment = constant_environment(1.0);
            add_sphere(scene, place, 0.012, BLACK);
        }),
        ("a hidden ball", false, &|scene| {
            add_sphere(scene, place, 0.012, WHITE);
            add_rectangle(scene, Vec3::new(-0.5, -0.5, 1.0), Vec3::X, Vec3::Y, BLACK);
        }),
    ];
    for (name, is_known, add) in cases {
        assert_eq!(known(&tracer_of(add)).is_some(), is_known, "{name}");
    }
}

/// White balls among as many black ones as there are paths for: each is asked for itself.
#[test]
fn unlike_things_are_told_apart() {
    let place = |number: u32| Vec3::new(-0.7 + 0.09 * (number % 16) as f32, -0.7 + 0.09 * (number / 16) as f32, 0.0);
    let light = |black_too: bool| {
        let tracer = tracer_of(|scene| {
            for number in 0..256 {
                let material = if number % 13 == 4 { WHITE } else { BLACK };
                if black_too || material == WHITE {
                    add_sphere(scene, place(number), 0.004, material);
                }
            }
        });
        let [_, light] = known(&tracer).expect("white balls");
        light
    };
    let (alone, among_black) = (light(false), light(true));
    assert!((among_black / alone - 1.0).abs() < 0.15, "{among_black} for {alone}");
}

/// Forty balls of dust in the sun, of which renders asked for 8 left out 30 ± 1 % of the light, and those asked for 1
/// 12.5 ± 1.6 %.
#[test]
fn dust_is_not_missed() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/scenes/dust.toml");
    let scene = Arc::new(load(path.as_ref(), &LoadOptions::default()).expect("loads"));
    let nits = scene.nits_per_unit;
    let tracer = PathTracer::new(scene, TraceSettings::new(48, 48, 1));
    let (sum, even) = (mean_light(&tracer, nits, Some(8.0), None), mean_light(&tracer, nits, None, Some(2048)));
    println!("{sum} for {even}");
    assert!((sum / even - 1.0).abs() < 0.08, "{sum} for {even}");
}

/// A ball of light half a pixel beyond the picture's border, or a crop's, shines into it by the pixel filter: of
/// eight renders six found nothing and called a border 77 times above threshold done.
#[test]
fn light_beside_the_film_is_not_missed() {
    let pixel = 2.0 * 5.0 * 10.0_f32.to_radians().tan() / SIDE as f32;
    let mut scene = empty_scene();
    add_material(&mut scene, diffuse(0.0), Vec3::splat(10_000.0));
    add_sphere(&mut scene, Vec3::new((0.5 * SIDE as f32 + 6.5) * pixel, 0.0, 0.0), 6.0 * pixel, WHITE);
    let scene = Arc::new(scene);
    let crop = Crop { x: 4, y: 2, width: 12, height: 12 };
    for seed in 1..=4 {
        for crop in [None, Some(crop)] {
            let settings = TraceSettings { filter: PixelFilter::Gaussian, crop, ..trace_settings(SIDE, SIDE, seed) };
            let tracer = PathTracer::new(scene.clone(), settings);
            let (sum, even) = (mean_light(&tracer, 1.0, Some(4.0), None), mean_light(&tracer, 1.0, None, Some(16_384)));
            println!("{seed} {crop:?}: {sum} for {even}");
            assert!((sum / even - 1.0).abs() < 0.2, "{seed} {crop:?}: {sum} for {even}");
        }
    }
    // A wall that ends beside the film, as bright as the sky behind it.
    let wall_ends_at = |edge_px: f32, reflectance: f32| {
        let mut scene = empty_scene();
        add_material(&mut scene, diffuse(reflectance), Vec3::ZERO);
        scene.environment = constant_environment(1.0);
        let corner = Vec3::new(-9.0, -9.0, 0.0);
        add_rectangle(&mut scene, corner, Vec3::new(9.0 + edge_px * pixel, 0.0, 0.0), 18.0 * Vec3::Y, WHITE);
        let settings = TraceSettings { filter: PixelFilter::Gaussian, ..trace_settings(SIDE, SIDE, 1) };
        PathTracer::new(Arc::new(scene), settings).known_things().is_some()
    };
    let beside = 0.5 * SIDE as f32 + 0.2;
    assert!(!wall_ends_at(beside, 0.9), "as bright as the sky");
    assert!(wall_ends_at(beside, 0.1), "darker than the sky");

    let boxed = TraceSettings { filter: PixelFilter::Box, ..trace_settings(SIDE, SIDE, 1) };
    assert!(PathTracer::new(scene, boxed).known_things().is_none(), "a box reaches nowhere");
}
