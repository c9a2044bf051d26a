//! Lamps smaller than a pixel, which the first samples may pass by.

use crate::support::{add_material, add_rectangle, add_sphere, diffuse, empty_scene, loop_settings, trace_settings};
use fechner::adaptive;
use fechner::adaptive::Quiet;
use fechner::adaptive::settings::Sampling;
use fechner::film::Film;
use fechner::integrator::{BlockWork, Crop, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Light, Motion, Scene};
use glam::{Affine3A, Vec3};
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

/// The share of each pixel that has much of a small lamp.
fn shares_of(tracer: &PathTracer) -> Option<Vec<f32>> {
    Some(tracer.known_things()?.urgent_shares().collect())
}

/// The share of each pixel.
fn all_shares_of(tracer: &PathTracer) -> Option<Vec<f32>> {
    let lamps = tracer.known_things()?;
    Some((0..(SIDE * SIDE) as usize).map(|pixel| lamps.share(pixel)).collect())
}

/// Mean of 8192 samples of each pixel.
fn found(tracer: &PathTracer) -> Vec<f32> {
    let mut film = Film::new(SIDE, SIDE);
    let block = |pixel, level| BlockWork::whole(pixel, Half::A, level);
    let blocks = (0..SIDE * SIDE).flat_map(|pixel| (0..11).map(move |level| block(pixel, level))).collect();
    tracer.trace(&SamplePlan { blocks }, &mut film, &|_| ());
    film.estimate(1.0).luminance_cd_m2.values().to_vec()
}

/// A ball of a fifth of a pixel, one on a corner of four pixels, and a needle of a twentieth, by each filter: what is
/// looked for in a pixel is what its samples find, of which 8192 leave four per cent to chance.
#[test]
fn shares_are_what_samples_find() {
    let ball = |scene: &mut Scene| add_sphere(scene, Vec3::new(0.05, 0.04, 0.0), 0.012, LAMP);
    let on_a_corner = |scene: &mut Scene| add_sphere(scene, Vec3::new(0.001, 0.001, 0.0), 0.012, LAMP);
    let needle = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::new(-0.3, 0.05, 0.0), 0.005 * Vec3::Y, Vec3::new(0.6, 0.02, 0.0), LAMP);
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let lamps: [(&str, Adding<'_>, usize); 3] =
        [("ball", &ball, 1), ("corner", &on_a_corner, 4), ("needle", &needle, 6)];
    for filter in [PixelFilter::Gaussian, PixelFilter::BlackmanHarris, PixelFilter::Box] {
        for (name, add, pixels) in lamps {
            let tracer = tracer_of(filter, 1.0, add);
            let shares = shares_of(&tracer).expect("a small lamp");
            let found = found(&tracer);
            let held: Vec<usize> = (0..shares.len()).filter(|&pixel| shares[pixel] > 0.0).collect();
            let total = |of: &[f32]| held.iter().map(|&pixel| of[pixel]).sum::<f32>();
            let ratio = total(&shares) / total(&found);
            println!("{name} {filter:?}: {} pixels, {ratio}", held.len());
            assert!(held.len() >= pixels && (ratio - 1.0).abs() < 0.12, "{name} by {filter:?}: {held:?}, {ratio}");
        }
    }
}

/// A sun of a twelfth of a pixel: looked for where samples find it, through a lens too, but not behind a wall, nor
/// where nothing shows what is behind things.
#[test]
fn the_sun_is_looked_for() {
    let sun = |scene: &mut Scene, aperture_radius: f32| {
        let (angular_radius, direction) = (0.0035_f32, Vec3::new(0.05, 0.04, 5.0));
        let irradiance = Vec3::splat(std::f32::consts::PI * angular_radius.sin().powi(2));
        let direction = direction.normalize();
        scene.lights.push(Light::Directional { direction, irradiance, angular_radius, is_of_sky: false });
        scene.camera.aperture_radius = aperture_radius;
    };
    let of = |aperture_radius: f32, is_hidden: bool, transparent: bool| {
        let mut scene = empty_scene();
        sun(&mut scene, aperture_radius);
        if is_hidden {
            let black = add_material(&mut scene, diffuse(0.0), Vec3::ZERO);
            add_rectangle(&mut scene, Vec3::new(-9.0, -9.0, -9.0), 18.0 * Vec3::X, 18.0 * Vec3::Y, black);
        }
        PathTracer::new(Arc::new(scene), TraceSettings { transparent, ..trace_settings(SIDE, SIDE, 1) })
    };
    for aperture_radius in [0.0, 0.3] {
        let tracer = of(aperture_radius, false, false);
        let (shares, found) = (all_shares_of(&tracer).expect("the sun"), found(&tracer));
        let ratio = shares.iter().sum::<f32>() / found.iter().sum::<f32>();
        println!("lens of {aperture_radius}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.12, "{aperture_radius}: {ratio}");
        assert!(of(aperture_radius, true, false).known_things().is_none(), "behind a wall");
        assert!(of(aperture_radius, false, true).known_things().is_none(), "of a picture that ends at its surfaces");
    }
}

/// What is clamped brings no more light than that.
#[test]
fn clamped_lamps_are_known_as_they_are_seen() {
    let brought = |radiance: f32, clamp: Option<f32>| {
        let mut scene = empty_scene();
        add_material(&mut scene, diffuse(0.0), Vec3::splat(radiance));
        add_sphere(&mut scene, Vec3::new(0.05, 0.04, 0.0), 0.012, LAMP);
        let tracer = PathTracer::new(Arc::new(scene), TraceSettings { clamp, ..trace_settings(SIDE, SIDE, 1) });
        let lamps = tracer.known_things().expect("a small lamp");
        (0..(SIDE * SIDE) as usize).map(|pixel| lamps.light(pixel)).sum::<f32>()
    };
    assert_eq!(brought(200.0, Some(10.0)), brought(10.0, None));
}

/// A ball of which a third is seen, its middle hidden: it is known, about as bright as it is seen.
#[test]
fn what_is_seen_of_a_lamp_in_part_is_known() {
    let tracer = tracer_of(PixelFilter::Gaussian, 1.0, |scene| {
        add_sphere(scene, Vec3::new(0.05, 0.04, 0.0), 0.012, LAMP);
        let black = add_material(scene, diffuse(0.0), Vec3::ZERO);
        add_rectangle(scene, Vec3::new(-5.0, -5.0, 2.5), 5.0268 * Vec3::X, 10.0 * Vec3::Y, black);
    });
    let (shares, found) = (all_shares_of(&tracer).expect("a third of a lamp"), found(&tracer));
    let ratio = shares.iter().sum::<f32>() / found.iter().sum::<f32>();
    println!("{ratio}");
    assert!((0.4..1.6).contains(&ratio), "{ratio}");
}

/// Puts a lens before the camera that blurs what is 5 away over so many pixels to each side.
fn blur(scene: &mut Scene, blur_px: f32) {
    let pixel = 2.0 * 10.0_f32.to_radians().tan() / SIDE as f32;
    scene.camera.focus_distance = 2.5;
    scene.camera.aperture_radius = blur_px * pixel / (1.0 / 2.5 - 1.0 / 5.0);
}

/// A ball and two triangles far out of focus, and a ball that half of the lens sees: they are looked for where
/// samples find them, and as much.
#[test]
fn shares_of_blurred_lamps_are_what_samples_find() {
    let ball = |scene: &mut Scene| add_sphere(scene, Vec3::new(0.05, 0.04, 0.0), 0.05, LAMP);
    let tile = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::new(0.1, -0.1, 0.0), 0.08 * Vec3::Y, 0.12 * Vec3::X, LAMP);
    };
    let half_hidden = |scene: &mut Scene| {
        ball(scene);
        let black = add_material(scene, diffuse(0.0), Vec3::ZERO);
        add_rectangle(scene, Vec3::new(0.0, -2.0, 4.5), 4.0 * Vec3::Y, 2.0 * Vec3::X, black);
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let lamps: [(&str, Adding<'_>); 3] = [("ball", &ball), ("tile", &tile), ("half", &half_hidden)];
    for blur_px in [2.5, 6.0] {
        for (name, add) in lamps {
            let tracer = tracer_of(PixelFilter::Gaussian, 1.0, |scene| {
                blur(scene, blur_px);
                add(scene);
            });
            let (shares, found) = (shares_of(&tracer).expect("a blurred lamp"), found(&tracer));
            let total: f32 = found.iter().sum();
            let ratio = shares.iter().sum::<f32>() / total;
            let elsewhere = shares.iter().zip(&found).map(|(share, found)| (share - found).abs()).sum::<f32>() / total;
            println!("{name} over {blur_px}: {ratio}, {elsewhere} elsewhere");
            // The lens is looked through at 64 points, and a pixel in three is on the rim.
            assert!((ratio - 1.0).abs() < 0.1 && elsewhere < 0.35, "{name} over {blur_px}: {ratio}, {elsewhere}");
        }
    }
}

/// A ball that passes by and one with a lens as well, a turning needle, a tile before a camera that pans and one that
/// half of its way hides: they are looked for where samples find them, and as much.
#[test]
fn shares_of_lamps_that_pass_by_are_what_samples_find() {
    let to = |way: Vec3| Motion::between(Affine3A::IDENTITY, Affine3A::from_translation(way));
    let way = Vec3::new(1.1, 0.3, 0.0);
    let ball = |scene: &mut Scene| {
        add_sphere(scene, Vec3::new(-0.5, -0.2, 0.0), 0.03, LAMP);
        scene.spheres[0].motion = Some(to(way));
    };
    let blurred = |scene: &mut Scene| {
        blur(scene, 2.0);
        ball(scene);
    };
    let needle = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::ZERO, 0.02 * Vec3::Y, 0.6 * Vec3::X, LAMP);
        scene.instances[0].motion =
            Some(Motion::between(Affine3A::IDENTITY, Affine3A::from_rotation_z(std::f32::consts::FRAC_PI_2)));
    };
    let pan = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::new(0.4, 0.0, 0.0), 0.1 * Vec3::Y, 0.12 * Vec3::X, LAMP);
        scene.camera.motion = Some(to(way));
    };
    let half_hidden = |scene: &mut Scene| {
        pan(scene);
        let black = add_material(scene, diffuse(0.0), Vec3::ZERO);
        add_rectangle(scene, Vec3::new(0.45, -3.0, 2.5), 6.0 * Vec3::Y, 3.0 * Vec3::X, black);
    };
    type Adding<'a> = &'a dyn Fn(&mut Scene);
    let lamps: [(&str, Adding<'_>); 5] =
        [("ball", &ball), ("blurred", &blurred), ("needle", &needle), ("pan", &pan), ("half", &half_hidden)];
    for (name, add) in lamps {
        let tracer = tracer_of(PixelFilter::Gaussian, 1.0, add);
        let (shares, found) = (all_shares_of(&tracer).expect("a lamp that passes by"), found(&tracer));
        let total: f32 = found.iter().sum();
        let ratio = shares.iter().sum::<f32>() / total;
        let elsewhere = shares.iter().zip(&found).map(|(share, found)| (share - found).abs()).sum::<f32>() / total;
        println!("{name}: {ratio}, {elsewhere} elsewhere");
        assert!((ratio - 1.0).abs() < 0.1 && elsewhere < 0.35, "{name}: {ratio}, {elsewhere}");
    }
}

/// What a lens blurs over the whole picture and far beyond comes to an end, and what a film is a part of has the
/// shares of the whole.
#[test]
fn blurred_lamps_are_looked_for_within_the_film() {
    let scene = |blur_px: f32, depth: f32, radius: f32| {
        let mut scene = empty_scene();
        add_material(&mut scene, diffuse(0.0), Vec3::ONE);
        blur(&mut scene, blur_px);
        add_sphere(&mut scene, Vec3::new(0.0, 0.0, 5.0 - depth), radius, LAMP);
        Arc::new(scene)
    };
    let near = PathTracer::new(scene(6.0, 5e-3, 5e-4), trace_settings(4096, 4096, 1));
    assert!(shares_of(&near).is_none_or(|shares| shares.iter().all(|share| share.is_finite())));

    let whole = trace_settings(SIDE, SIDE, 1);
    let crop = Crop { x: 5, y: 3, width: 7, height: 4 };
    let shares = |settings| shares_of(&PathTracer::new(scene(6.0, 5.0, 0.05), settings)).expect("a blurred lamp");
    let (of_whole, of_part) = (shares(whole), shares(TraceSettings { crop: Some(crop), ..whole }));
    let part_of_whole = (0..crop.height).flat_map(|y| (0..crop.width).map(move |x| [crop.x + x, crop.y + y]));
    let expected: Vec<f32> = part_of_whole.map(|[x, y]| of_whole[(y * SIDE + x) as usize]).collect();
    assert_eq!(of_part, expected);
    assert!(expected.iter().all(|&share| share > 0.0));
}

/// Forty balls far out of focus, and before a camera that pans, of which renders asked for 8 saw a few and left out
/// 46 ± 3 and 27 ± 1 % of their light.
#[test]
fn blurred_lamps_are_not_missed() {
    for name in ["out-of-focus", "streaks"] {
        let path = format!("{}/benches/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let scene = Arc::new(load(path.as_ref(), &LoadOptions::default()).expect("loads"));
        let nits = scene.nits_per_unit;
        let tracer = PathTracer::new(scene, TraceSettings::new(64, 48, 1));
        let light = |sampling, visibility, spp| {
            let settings = loop_settings(nits, sampling, visibility, spp);
            adaptive::render(&tracer, &settings, &Quiet).expect("renders").film.estimate(nits).luminance_cd_m2.mean()
        };
        let (sum, even) = (light(Sampling::Adaptive, Some(8.0), None), light(Sampling::Uniform, None, Some(1024)));
        println!("{name}: {sum} for {even}");
        assert!((sum / even - 1.0).abs() < 0.1, "{name}: {sum} for {even}");
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
        ("a large screen", &|scene| add_rectangle(scene, -3.0 * Vec3::ONE, 6.0 * Vec3::X, 6.0 * Vec3::Y, LAMP)),
        ("hidden", &hidden),
        ("turned away", &turned),
    ];
    for (name, add) in cases {
        assert!(tracer_of(PixelFilter::Gaussian, 1.0, add).known_things().is_none(), "{name}");
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

/// A tube that goes on far beyond the picture, and one in numbers so large that neighbours are a pixel apart, have
/// their samples as others do.
#[test]
fn long_and_far_lamps_come_to_an_end() {
    let long = |scene: &mut Scene| {
        add_rectangle(scene, Vec3::new(-1e4, 0.05, 0.0), 0.005 * Vec3::Y, 2e4 * Vec3::X, LAMP);
        add_sphere(scene, Vec3::new(0.05, -0.3, 0.0), 0.012, LAMP);
    };
    let shares = shares_of(&tracer_of(PixelFilter::Gaussian, 1.0, long)).expect("small lamps");
    let held = shares.iter().filter(|&&share| share > 0.0).count();
    assert!((SIDE as usize + 1..3 * SIDE as usize).contains(&held), "{held} pixels");

    let far_away = Vec3::new(4e6, 0.0, 5.4e6);
    let far = |scene: &mut Scene| {
        scene.camera.position += far_away;
        add_rectangle(scene, far_away - 0.5 * Vec3::X, 0.5 * Vec3::Y, Vec3::X, LAMP);
    };
    let tracer = tracer_of(PixelFilter::Gaussian, 1.0, far);
    assert!(shares_of(&tracer).is_none_or(|shares| shares.iter().all(|share| share.is_finite())));
}

/// What is left of a budget after the samples for stars goes everywhere: given to pixels that had met none, it made
/// them 13 % too bright.
#[test]
fn the_rest_of_a_budget_is_no_matter_of_luck() {
    let mut scene = empty_scene();
    add_material(&mut scene, diffuse(0.0), Vec3::splat(200.0));
    let star = |i: u32| Vec3::new(-0.7 + 0.3 * (i % 5) as f32 + 0.013 * i as f32, -0.3 + 0.5 * (i / 5) as f32, 0.0);
    (0..10).for_each(|i| add_sphere(&mut scene, star(i), 0.011, LAMP));
    let tracer = PathTracer::new(Arc::new(scene), TraceSettings::new(SIDE, SIDE, 1));
    let rendered =
        adaptive::render(&tracer, &loop_settings(100.0, Sampling::Adaptive, None, Some(24)), &Quiet).expect("renders");
    let counts: Vec<u32> = (0..(SIDE * SIDE) as usize).map(|pixel| rendered.film.samples(pixel)).collect();
    assert!(counts.iter().any(|&count| count > 100), "for stars that are known");
    // Others differ by one sample in each half at the most.
    let lamps = tracer.known_things().expect("stars");
    let others = counts.into_iter().enumerate().filter(|&(pixel, _)| lamps.share(pixel) == 0.0).map(|(_, count)| count);
    let lucky: Vec<u32> = others.filter(|count| !(16..=18).contains(count)).collect();
    assert!(lucky.is_empty(), "{lucky:?}");

    let mut settings = loop_settings(100.0, Sampling::Adaptive, None, Some(20));
    settings.limits.max_samples = 64;
    let film = adaptive::render(&tracer, &settings, &Quiet).expect("renders").film;
    assert_eq!((0..(SIDE * SIDE) as usize).map(|pixel| film.samples(pixel)).max(), Some(64), "and no pixel has more");
}
