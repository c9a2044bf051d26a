//! Every way of sampling a light against its own pdf, and the tree against lights in plenty.

use super::{LightProbe, LightReceiver, Lights};
use crate::geometry::{Ray, World};
use crate::sampler::{hash_words, unit_of_hash};
use crate::scene::{
    Alpha, ColorInput, Environment, Instance, Light, Material, MaterialId, Mesh, MeshId, Parametrisation,
    PhotometricWeb, Scene, Sphere, SpotFalloff, Surface,
};
use glam::{Affine3A, Mat3, Vec2, Vec3, Vec3A};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

fn random(index: u64, dimension: u64) -> f32 {
    unit_of_hash(hash_words(index, dimension))
}

fn add_emitter(scene: &mut Scene, radiance: f32, emits_both_sides: bool) -> MaterialId {
    scene.materials.push(Material {
        name: "lamp".to_owned(),
        surface: Surface::Diffuse { reflectance: ColorInput::constant(Vec3::ZERO) },
        emission: ColorInput::constant(Vec3::splat(radiance)),
        emits_both_sides,
        relief: None,
        stretch: None,
        alpha: Alpha::Opaque,
    });
    MaterialId(scene.materials.len() as u32 - 1)
}

fn add_mesh(scene: &mut Scene, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, material: MaterialId) {
    scene.meshes.push(Mesh { name: String::new(), positions, triangles, ..Mesh::default() });
    scene.instances.push(Instance {
        name: String::new(),
        mesh: MeshId(scene.meshes.len() as u32 - 1),
        material,
        to_world: Affine3A::IDENTITY,
        motion: None,
    });
}

fn add_parallelogram(scene: &mut Scene, corner: Vec3, u: Vec3, v: Vec3, material: MaterialId) {
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    add_mesh(scene, positions, vec![[0, 1, 2], [0, 2, 3]], material);
}

fn add_sphere(scene: &mut Scene, center: Vec3, radius: f32, material: MaterialId) {
    scene.spheres.push(Sphere {
        name: String::new(),
        center,
        radius,
        axes: glam::Mat3A::IDENTITY,
        material,
        motion: None,
    });
}

/// A sky with a bright patch off the poles, dark below.
fn uneven(direction: Vec3) -> Vec3 {
    let spot = (direction.dot(Vec3::new(0.6, 0.5, -0.62).normalize()) - 0.8).max(0.0) * 40.0;
    Vec3::splat(0.2 * (1.0 + direction.y) + spot)
}

/// Emitters that do not hide each other from the origin.
fn scenes() -> Vec<(&'static str, Scene)> {
    let mut all = Vec::new();
    let mut with = |name, fill: &dyn Fn(&mut Scene)| {
        let mut scene = Scene::default();
        fill(&mut scene);
        all.push((name, scene));
    };
    with("a large triangle", &|scene| {
        let lamp = add_emitter(scene, 1.0, true);
        add_mesh(
            scene,
            vec![Vec3::new(-2.0, 1.0, -1.0), Vec3::new(2.0, 0.5, -1.5), Vec3::new(0.0, 1.5, 2.0)],
            vec![[0, 1, 2]],
            lamp,
        );
    });
    with("a rectangle near and slanted, one-sided", &|scene| {
        let lamp = add_emitter(scene, 1.0, false);
        add_parallelogram(scene, Vec3::new(-1.0, 0.7, -0.4), Vec3::new(0.0, 0.0, 1.5), Vec3::X * 2.0 + Vec3::Y, lamp);
        add_parallelogram(scene, Vec3::new(-1.0, 0.7, -0.4), Vec3::X * 2.0 + Vec3::Y, Vec3::new(0.0, 0.0, 1.5), lamp);
    });
    with("a parallelogram without a right angle", &|scene| {
        let lamp = add_emitter(scene, 1.0, true);
        add_parallelogram(scene, Vec3::new(-1.0, -0.5, -1.0), Vec3::new(1.5, 0.4, 0.0), Vec3::new(0.6, 1.2, 0.1), lamp);
    });
    with("a near and a far sphere", &|scene| {
        let lamp = add_emitter(scene, 2.0, false);
        add_sphere(scene, Vec3::new(0.0, 1.2, 0.3), 0.8, lamp);
        add_sphere(scene, Vec3::new(4.0, 0.5, 0.0), 1.0, lamp);
    });
    with("a lat-long sky, turned and mirrored", &|scene| {
        scene.environment = Some(Environment {
            from_world: Mat3::from_rotation_x(0.5) * Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0)),
            ..Environment::from_directions(48, 24, uneven)
        });
    });
    with("an equal-area sky", &|scene| {
        let size = 32u32;
        let texel = |i: u32| {
            let uv = Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) / size as f32;
            uneven(Parametrisation::EqualArea.to_direction(uv))
        };
        scene.environment = Some(Environment {
            parametrisation: Parametrisation::EqualArea,
            width: size,
            height: size,
            texels: Arc::new((0..size * size).map(texel).collect()),
            ..Environment::constant(Vec3::ZERO)
        });
    });
    with("everything at once", &|scene| {
        let (lamp, weak) = (add_emitter(scene, 1.0, true), add_emitter(scene, 0.1, false));
        add_sphere(scene, Vec3::new(3.0, 1.0, 0.0), 0.9, lamp);
        add_sphere(scene, Vec3::new(-3.0, 0.2, 0.5), 1.0, weak);
        add_parallelogram(scene, Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, lamp);
        add_mesh(
            scene,
            vec![Vec3::new(-1.0, -1.0, 3.0), Vec3::new(1.0, -1.0, 3.0), Vec3::new(0.0, 1.0, 3.0)],
            vec![[0, 1, 2]],
            lamp,
        );
        scene.environment = Some(Environment::from_directions(48, 24, uneven));
        scene.lights.push(Light::Directional {
            direction: Vec3::new(0.0, 0.6, 0.8),
            irradiance: Vec3::ONE,
            angular_radius: 0.4,
            is_of_sky: false,
        });
    });
    all
}

/// Probes that face up.
fn probes(position: impl Fn(u64) -> Vec3) -> Vec<LightProbe> {
    let receiver = |i| LightReceiver { position: position(i), normal: Vec3::Y };
    (0..256).map(|i| LightProbe { receiver: receiver(i), time: 0.0 }).collect()
}

fn pdf_from_afar(lights: &Lights, receiver: &LightReceiver, direction: Vec3) -> f32 {
    lights.from_afar(receiver, direction).map(|light| light.pdf).into_iter().sum()
}

/// Density of a direction, from whatever a ray that way meets.
fn pdf(world: &World, lights: &Lights, receiver: &LightReceiver, direction: Vec3) -> f32 {
    let ray = Ray::new(Vec3A::from(receiver.position), direction.into());
    // Lights from afar are sampled whether something stands before them or not.
    pdf_from_afar(lights, receiver, direction)
        + world.closest(&ray).map_or(0.0, |hit| lights.pdf_of_hit(world, receiver, &ray, &hit, hit.distance))
}

const BINS: usize = 20 * 40;

fn bin(direction: Vec3) -> usize {
    let row = ((1.0 - direction.y) * 10.0) as usize;
    let column = ((direction.x.atan2(direction.z) / TAU + 0.5) * 40.0) as usize;
    row.min(19) * 40 + column.min(39)
}

/// Sampled directions fall as the pdf says (χ², significance 1e-3 for each scene and receiver), and the pdf and the
/// share of failed samples add up to 1.
#[test]
fn samples_follow_their_pdf() {
    const SAMPLES: u64 = 40_000;
    const FINE: usize = 16;
    for (name, scene) in scenes() {
        let world = World::new(Arc::new(scene));
        let lights = Lights::new(&world);
        for normal in [Vec3::ZERO, Vec3::Y] {
            let receiver = LightReceiver { position: Vec3::ZERO, normal };
            let mut expected = vec![0.0f64; BINS];
            for (cell, expected) in expected.iter_mut().enumerate() {
                for fine in 0..FINE * FINE {
                    let share = |i: usize| (i as f32 + 0.5) / FINE as f32;
                    let y = 1.0 - ((cell / 40) as f32 + share(fine / FINE)) / 10.0;
                    let phi = (((cell % 40) as f32 + share(fine % FINE)) / 40.0 - 0.5) * TAU;
                    let r = (1.0 - y * y).max(0.0).sqrt();
                    let direction = Vec3::new(r * phi.sin(), y, r * phi.cos()).normalize();
                    *expected += f64::from(pdf(&world, &lights, &receiver, direction));
                }
                *expected *= 4.0 * std::f64::consts::PI / (BINS * FINE * FINE) as f64;
            }
            let mut observed = vec![0.0f64; BINS];
            let mut failed = 0.0;
            for i in 0..SAMPLES {
                let u = [random(i, 1), random(i, 2), random(i, 3)];
                match lights.sample(&world, &receiver, 0.0, u) {
                    Some(sample) => {
                        observed[bin(sample.direction)] += 1.0;
                        let stated = pdf(&world, &lights, &receiver, sample.direction);
                        let differs = (stated / sample.pdf - 1.0).abs() > 1e-3;
                        // A sample on an outline may be seen past it.
                        failed += if differs { 1e-9 } else { 0.0 };
                    }
                    None => failed += 1.0,
                }
            }
            let total = expected.iter().sum::<f64>() + failed / SAMPLES as f64;
            assert!((total - 1.0).abs() < 4e-3, "{name}, normal {normal}: pdf and failures add up to {total}");
            let (mut statistic, mut degrees, mut rest) = (0.0, 0.0, (0.0, 0.0));
            for (expected, observed) in expected.iter().zip(&observed) {
                let expected = expected * SAMPLES as f64;
                if expected >= 8.0 {
                    statistic += (observed - expected).powi(2) / expected;
                    degrees += 1.0;
                } else {
                    rest = (rest.0 + observed, rest.1 + expected);
                }
            }
            if rest.1 >= 8.0 {
                statistic += (rest.0 - rest.1) * (rest.0 - rest.1) / rest.1;
            } else {
                assert!(rest.0 < 30.0, "{name}: {} samples where {} were expected", rest.0, rest.1);
            }
            let p = 1.0 - ChiSquared::new(degrees).expect("some bins").cdf(statistic);
            assert!(p > 1e-3, "{name}, normal {normal}: χ² {statistic} with {degrees} degrees of freedom, p {p}");
        }
    }
}

/// Directions of a sample and of the ray that finds the same light have the same density, but for a few at outlines:
/// where kinds of light are chosen by what arrives, too, here hardly anything of what comes from afar to one side.
#[test]
fn both_sides_of_mis_state_the_same_density() {
    for (name, scene) in scenes() {
        let world = World::new(Arc::new(scene));
        let mut lights = Lights::new(&world);
        let probes = probes(|i| Vec3::splat(0.1 * random(i, 5)));
        let kinds_by_place = lights.kinds_by_place(&world, &probes, &|number, sample| {
            if sample.place.is_none() && probes[number].receiver.position.x < 0.05 { 0.01 } else { 1.0 }
        });
        lights.set_kinds_by_place(kinds_by_place);
        let mut differ = 0;
        for i in 0..4000 {
            let normal = Vec3::new(random(i, 7) - 0.5, random(i, 8) - 0.5, random(i, 9) - 0.5).normalize_or(Vec3::Y);
            let receiver = LightReceiver { position: Vec3::splat(0.1 * random(i, 5)), normal };
            let u = [random(i, 1), random(i, 2), random(i, 3)];
            let Some(sample) = lights.sample(&world, &receiver, 0.0, u) else { continue };
            // What stands before lights from afar has a density of its own.
            let stated = match sample.place {
                None => pdf_from_afar(&lights, &receiver, sample.direction),
                Some(_) => {
                    pdf(&world, &lights, &receiver, sample.direction)
                        - pdf_from_afar(&lights, &receiver, sample.direction)
                }
            };
            differ += u32::from((stated / sample.pdf - 1.0).abs() > 2e-3);
        }
        assert!(differ < 20, "{name}: {differ} of 4000 differ");
    }
}

/// Spots, points, photometric lamps and suns that are far apart are all found, with probabilities that add up to 1.
#[test]
fn choices_without_area_add_up() {
    let mut scene = Scene::default();
    for i in 0..7 {
        let position = Vec3::new(i as f32 * 3.0 - 9.0, 2.0 + (i % 3) as f32, 1.0);
        scene.lights.push(Light::Point { position, intensity: Vec3::splat(1.0 + i as f32) });
    }
    scene.lights.push(Light::Spot {
        position: Vec3::Y * 5.0,
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(50.0),
        inner_angle: 0.3,
        outer_angle: 0.6,
        falloff: SpotFalloff::Smoothstep,
    });
    let below = PhotometricWeb::from_directions(5.0, |own| (-own.z).max(0.0));
    for (position, axis) in [(Vec3::new(2.0, 4.0, 0.0), Vec3::NEG_Y), (Vec3::new(-2.0, 4.0, 0.0), Vec3::Y)] {
        scene.lights.push(Light::Photometric {
            position,
            from_world: PhotometricWeb::from_world(axis, 0.0),
            web: Arc::new(below.clone()),
            per_candela: Vec3::splat(10.0),
        });
    }
    scene.lights.push(Light::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::ONE,
        angular_radius: 0.0,
        is_of_sky: false,
    });
    let world = World::new(Arc::new(scene));
    let lights = Lights::new(&world);
    let receiver = LightReceiver { position: Vec3::ZERO, normal: Vec3::Y };
    let n = 20_000;
    let mut seen = std::collections::BTreeMap::new();
    for i in 0..n {
        let select = (i as f32 + 0.5) / n as f32;
        let sample = lights.sample(&world, &receiver, 0.0, [0.5, 0.5, select]).expect("all of them shine here");
        let key = sample.place.map_or([0; 3], |place| place.position.to_array().map(f32::to_bits));
        let entry = seen.entry(key).or_insert((sample.pdf, 0));
        assert_eq!(entry.0, sample.pdf);
        entry.1 += 1;
    }
    // All but the lamp that shines up.
    assert_eq!(seen.len(), 10);
    for (probability, count) in seen.values() {
        assert!((f64::from(*probability) * f64::from(n) - f64::from(*count)).abs() < 3.0, "{probability} {count}");
    }
}

/// Irradiance at random places on a floor under lamps spread over a ceiling: mean and the samples' variance over its
/// square, averaged over the places.
fn noise_under(lamps: &Scene) -> (f64, f64) {
    let world = World::new(Arc::new(lamps.clone()));
    let lights = Lights::new(&world);
    let (mut mean_sum, mut noise_sum) = (0.0, 0.0);
    const PLACES: u64 = 60;
    const SAMPLES: u64 = 400;
    for place in 0..PLACES {
        let position = Vec3::new(random(place, 20) * 16.0 - 8.0, 0.0, random(place, 21) * 16.0 - 8.0);
        let receiver = LightReceiver { position, normal: Vec3::Y };
        let (mut sum, mut squares) = (0.0f64, 0.0f64);
        for i in 0..SAMPLES {
            let u = [1, 2, 3].map(|d| random(place * SAMPLES + i, d));
            let value = lights
                .sample(&world, &receiver, 0.0, u)
                .map_or(0.0, |sample| f64::from(sample.radiance.x * sample.direction.y.max(0.0) / sample.pdf));
            sum += value;
            squares += value * value;
        }
        let mean = sum / SAMPLES as f64;
        mean_sum += mean;
        noise_sum += (squares / SAMPLES as f64 - mean * mean) / (mean * mean);
    }
    (mean_sum / PLACES as f64, noise_sum / PLACES as f64)
}

/// `count`² lamps of the same flux together, 3 units above the floor.
fn ceiling(count: u32) -> Scene {
    let mut scene = Scene::default();
    let side = 0.2f32;
    let radiance = 1000.0 / (count * count) as f32;
    let lamp = add_emitter(&mut scene, radiance, false);
    for i in 0..count * count {
        let at = |k: u32| (k as f32 + 0.5) / count as f32 * 16.0 - 8.0;
        let corner = Vec3::new(at(i % count) - 0.5 * side, 3.0, at(i / count) - 0.5 * side);
        // Faces down.
        add_parallelogram(&mut scene, corner, Vec3::X * side, Vec3::Z * side, lamp);
    }
    scene
}

/// A choice by power has the relative variance n·Σe²/(Σe)² − 1 for n like lamps of irradiance e: above 1 here. The
/// tree's must be below a tenth of that, which is lost in the noise of whatever the light falls on.
#[test]
fn hundreds_of_lamps_hardly_raise_noise() {
    let count = 24;
    let (_, few) = noise_under(&ceiling(3));
    let (_, many) = noise_under(&ceiling(count));
    let by_power = (0..60u64).map(|place| {
        let (x, z) = (random(place, 20) * 16.0 - 8.0, random(place, 21) * 16.0 - 8.0);
        let at = |k: u32| (k as f32 + 0.5) / count as f32 * 16.0 - 8.0;
        let lamps = (0..count * count).map(|i| {
            let distance_squared = (at(i % count) - x).powi(2) + (at(i / count) - z).powi(2) + 9.0;
            f64::from(9.0 / (distance_squared * distance_squared))
        });
        let (sum, squares) = lamps.fold((0.0, 0.0), |(sum, squares), e| (sum + e, squares + e * e));
        f64::from(count * count) * squares / (sum * sum) - 1.0
    });
    let by_power = by_power.sum::<f64>() / 60.0;
    println!("relative variance: {few:.4} under 9 lamps, {many:.4} under 576, {by_power:.2} if chosen by power");
    assert!(few < 0.02 && many < 0.1, "relative variance: {few} under 9 lamps, {many} under 576");
    assert!(many < 0.1 * by_power, "{many} {by_power}");
}

/// A sun that shines on one side of the scene only is asked for there, and everywhere else a little; what samples say
/// of the light stays the same.
#[test]
fn kinds_of_light_are_chosen_by_what_arrives() {
    let mut scene = Scene { environment: Some(Environment::from_directions(48, 24, uneven)), ..Scene::default() };
    let sun = Light::Directional {
        is_of_sky: false,
        direction: Vec3::NEG_Y,
        irradiance: Vec3::splat(100.0),
        angular_radius: 0.0,
    };
    scene.lights.push(sun);
    let world = World::new(Arc::new(scene));
    let even = Lights::new(&world);
    let mut lights = Lights::new(&world);
    let probes = probes(|i| Vec3::new(random(i, 0) - 0.5, 0.0, random(i, 1)));
    let is_sunny = |position: Vec3| position.x > 0.0;
    let kinds_by_place = lights.kinds_by_place(&world, &probes, &|number, sample| {
        let arrives = !sample.is_delta || is_sunny(probes[number].receiver.position);
        if arrives { 1.0 } else { 0.0 }
    });
    lights.set_kinds_by_place(kinds_by_place);
    for (x, least, most) in [(-0.4, 0.12, 0.14), (0.4, 0.85, 0.88)] {
        let receiver = LightReceiver { position: Vec3::new(x, 0.0, 0.5), normal: Vec3::Y };
        let count = 20_000;
        let (mut suns, mut sums) = ([0u32; 2], [[0.0f64; 2]; 2]);
        for i in 0..count {
            let u = [random(i, 1), random(i, 2), random(i, 3)];
            for (lights, [sum, squares]) in [&lights, &even].into_iter().zip(&mut sums) {
                let Some(sample) = lights.sample(&world, &receiver, 0.0, u) else { continue };
                suns[usize::from(std::ptr::eq(lights, &even))] += u32::from(sample.is_delta);
                let value = f64::from(sample.radiance.x * sample.direction.y.max(0.0) / sample.pdf);
                *sum += value;
                *squares += value * value;
            }
        }
        let share = f64::from(suns[0]) / count as f64;
        assert!(share > least && share < most, "at {x} the sun is asked for by {share} of the samples");
        let [[chosen, chosen_squares], [evenly, evenly_squares]] = sums;
        // Both estimates' variances together, four deviations.
        let variance = |sum: f64, squares: f64| (squares - sum * sum / count as f64) / (count as f64).powi(2);
        let bound = 4.0 * (variance(chosen, chosen_squares) + variance(evenly, evenly_squares)).sqrt();
        let (chosen, evenly) = (chosen / count as f64, evenly / count as f64);
        assert!((chosen - evenly).abs() < bound, "at {x}: {chosen} for {evenly} ± {bound}");
    }
}

/// Irradiance that a receiver is told to have, from so many samples.
fn irradiance(world: &World, lights: &Lights, receiver: &LightReceiver, samples: u64) -> f64 {
    let value = |i| {
        let sample = lights.sample(world, receiver, 0.0, [random(i, 31), random(i, 32), random(i, 33)])?;
        Some(f64::from(sample.radiance.x * sample.direction.dot(receiver.normal).max(0.0) / sample.pdf))
    };
    (0..samples).map(|i| value(i).unwrap_or(0.0)).sum::<f64>() / samples as f64
}

/// A fan of triangles around the origin in the plane z = 0, as large as the unit disk.
fn disk() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    const CORNERS: u32 = 48;
    let at = |i: u32| (i as f32 / CORNERS as f32 * TAU).sin_cos();
    let rim = (0..CORNERS).map(|i| Vec3::new(at(i).1, at(i).0, 0.0));
    let triangles = (0..CORNERS).map(|i| [0, 1 + i, 1 + (i + 1) % CORNERS]).collect();
    (std::iter::once(Vec3::ZERO).chain(rim).collect(), triangles)
}

/// A flat lamp gives nothing to itself, wherever rounding puts a place on it: neither to its back nor, where it emits
/// on both sides, to either.
#[test]
fn a_flat_lamp_does_not_light_itself() {
    let square = vec![
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
    ];
    let slanted = vec![
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(0.5, -1.0, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-0.5, 1.0, 0.0),
    ];
    let shapes = [
        ("rectangle", (square.clone(), vec![[0, 1, 2], [0, 2, 3]])),
        ("parallelogram", (slanted, vec![[0, 1, 2], [0, 2, 3]])),
        ("triangle", (square, vec![[0, 1, 3]])),
        ("disk", disk()),
    ];
    for (name, (positions, triangles)) in shapes {
        for (size, translation) in [
            (1.0, Vec3::ZERO),
            (0.01, Vec3::ZERO),
            (100.0, Vec3::ZERO),
            (1.0, Vec3::new(30.3, -7.7, 71.9)),
            (0.1, Vec3::new(-913.7, 3.3, 1e-3)),
        ] {
            for angle in [1.0_f32, 37.0, 100.0, 120.0, 145.0, 170.0] {
                for both_sides in [false, true] {
                    let mut scene = Scene::default();
                    let lamp = add_emitter(&mut scene, 1.0, both_sides);
                    add_mesh(&mut scene, positions.clone(), triangles.clone(), lamp);
                    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 0.3, 0.1).normalize(), angle.to_radians());
                    let to_world = Affine3A::from_mat3_translation(turn * size, translation);
                    scene.instances[0].to_world = to_world;
                    let world = World::new(Arc::new(scene));
                    let lights = Lights::new(&world);
                    let mut most = 0.0_f64;
                    for i in 0..64 {
                        let target = Vec3::new(random(i, 21), random(i, 22), 0.0) * 0.8 - Vec3::new(0.4, 0.4, 0.0);
                        let from =
                            target + Vec3::new(random(i, 23), random(i, 24), if i % 2 == 0 { 3.0 } else { -3.0 });
                        let [target, from] = [target, from].map(|place| Vec3A::from(to_world.transform_point3(place)));
                        let ray = Ray::new(from, (target - from).normalize());
                        let Some(hit) = world.closest(&ray) else { continue };
                        let point = world.surface(&ray, &hit);
                        for normal in [point.geometric_normal, -point.geometric_normal] {
                            let receiver = LightReceiver { position: point.position, normal };
                            most = most.max(irradiance(&world, &lights, &receiver, 16));
                        }
                    }
                    assert!(
                        most < 1e-4,
                        "{name}, size {size} at {translation}, {angle} degrees, both sides {both_sides}: {most}"
                    );
                }
            }
        }
    }
}

/// What is before a lamp by more than rounding has all of its light: right before it, π, and beside its rim, half of
/// that.
#[test]
fn a_lamp_lights_what_nearly_touches_it() {
    for (center, size) in [(Vec3::ZERO, 1.0), (Vec3::new(5.0, 2.0, -3.0), 1.0), (Vec3::ZERO, 30.0)] {
        let mut scene = Scene::default();
        let lamp = add_emitter(&mut scene, 1.0, false);
        let (along_x, along_z) = (size * Vec3::X, size * Vec3::Z);
        add_parallelogram(&mut scene, center - 0.5 * (along_x + along_z), along_x, along_z, lamp);
        let world = World::new(Arc::new(scene));
        let lights = Lights::new(&world);
        for height in [1e-4 * size, 1e-5 * size, 1e-3 * size] {
            let below = LightReceiver { position: center - height * Vec3::Y, normal: Vec3::Y };
            let wall = LightReceiver { position: center + Vec3::new(0.5 * size, -height, 0.0), normal: -Vec3::X };
            for (receiver, expected) in [(below, PI), (wall, 0.5 * PI)] {
                let found = irradiance(&world, &lights, &receiver, 4096);
                assert!(
                    (found / f64::from(expected) - 1.0).abs() < 0.05,
                    "{center} {size} {height}: {found} of {expected}"
                );
            }
        }
    }
}
