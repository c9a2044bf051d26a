//! What lens and shutter do to a picture, measured as second moments of spots of light; crops; motion under lamps.

use crate::support::{
    add_material, add_rectangle, add_sphere, constant_environment, diffuse, empty_scene, radiance_along, trace_settings,
};
use fechner::film::Film;
use fechner::geometry::Ray;
use fechner::integrator::{BlockWork, Crop, PathTracer, SamplePlan, TraceSettings};
use fechner::sampler::{Half, PixelFilter, Sequence};
use fechner::scene::hash::content_hash;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Motion, Scene};
use glam::{Affine3A, Quat, Vec3, vec3a};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

const SIZE: u32 = 64;

/// All blocks up to a level of every pixel.
fn film_of(scene: &Scene, settings: TraceSettings, levels: u8) -> Film {
    let tracer = PathTracer::new(Arc::new(scene.clone()), settings);
    let area = settings.film_area();
    let blocks = (0..area.width * area.height)
        .flat_map(|pixel| Half::BOTH.map(|half| (0..levels).map(move |level| BlockWork::whole(pixel, half, level))))
        .flatten()
        .collect();
    let mut film = Film::new(area.width, area.height);
    tracer.trace(&SamplePlan { blocks }, &mut film, &|_| {});
    film
}

/// Mean and variance of the light's place along x and y, in pixels, without what the pixels' own width adds.
struct Spot {
    variance: [f64; 2],
}

fn spot_of(scene: &Scene) -> Spot {
    // Of the box filter, whose variance is 1/12.
    let settings = TraceSettings { filter: PixelFilter::Box, ..trace_settings(SIZE, SIZE, 3) };
    let estimate = film_of(scene, settings, 5).estimate(1.0);
    let (mut weight, mut sum, mut squares) = (0.0, [0.0; 2], [0.0; 2]);
    for (i, rgb) in estimate.rgb_cd_m2.iter().enumerate() {
        let value = f64::from(rgb[0]);
        weight += value;
        for (axis, place) in [i as u32 % SIZE, i as u32 / SIZE].into_iter().enumerate() {
            sum[axis] += value * f64::from(place);
            squares[axis] += value * f64::from(place) * f64::from(place);
        }
    }
    let variance = std::array::from_fn(|axis| {
        let mean = sum[axis] / weight;
        squares[axis] / weight - mean * mean - 1.0 / 12.0
    });
    Spot { variance }
}

/// Mean of the pixels of some columns of 16, of a scene of such text.
fn mean_of_columns(text: &str, columns: std::ops::Range<u32>) -> [f32; 3] {
    const SIDE: u32 = 16;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("s.toml");
    std::fs::write(&file, text).expect("written");
    let scene = load(&file, &LoadOptions::default()).expect("a scene");
    let rgb = film_of(&scene, trace_settings(SIDE, SIDE, 5), 4).estimate(1.0).rgb_cd_m2;
    let pixels: Vec<_> = (0..SIDE).flat_map(|y| columns.clone().map(move |x| (y * SIDE + x) as usize)).collect();
    std::array::from_fn(|c| pixels.iter().map(|&pixel| rgb[pixel][c]).sum::<f32>() / pixels.len() as f32)
}

/// A camera that leaves an absorbing box, one that is left by it, and parallel rays that begin in it and beside it:
/// each ray knows.
#[test]
fn each_ray_knows_what_it_begins_in() {
    const ABSORPTION: [f32; 3] = [1.0, 0.5, 0.1];
    let scene = |camera: &str, of_box: &str| {
        format!(
            "nits_per_unit = 1.0\n[camera]\n{camera}\n[environment]\nradiance = [1, 1, 1]\n[materials.m]\ntype = \"dielectric\"\nior = 1.0\n\
             absorption = [1.0, 0.5, 0.1]\n[[objects]]\nbox = {{ min = [-1, -1, -1], max = [1, 1, 1] }}\nmaterial = \"m\"\n{of_box}"
        )
    };
    let at = |time: f32, x: f32| format!("{{ time = {time:?}, position = [{x:?}, 0, 0.5], look_at = [{x:?}, 0, -5] }}");
    let shutter = "vertical_fov_deg = 2\nshutter_s = 1.0";
    let moving = scene(&format!("{shutter}\nkeyframes = [{}, {}]", at(0.0, 0.0), at(1.0, 3.0)), "");
    let resting = format!("{shutter}\nposition = [0, 0, 0.5]\nlook_at = [0, 0, -5]");
    let moves = "keyframes = [ { time = 0.0, translate = [0, 0, 0] }, { time = 1.0, translate = [3, 0, 0] } ]";
    for (what, text) in [("the camera leaves", moving), ("the box leaves", scene(&resting, moves))] {
        // A third of the time 1.5 of the box lie before the lens, then nothing.
        let found = mean_of_columns(&text, 0..16);
        for (absorption, found) in ABSORPTION.into_iter().zip(found) {
            let right = (-1.5 * absorption).exp() / 3.0 + 2.0 / 3.0;
            assert!((found - right).abs() < 0.02, "{what}: {found}, not {right}");
        }
    }
    let parallel = scene("orthographic_height = 4\nposition = [0, 0, 0.5]\nlook_at = [0, 0, -5]", "");
    for (columns, right) in [(0..3, 1.0), (6..10, (-1.5f32).exp()), (13..16, 1.0)] {
        // Above and below the box is nothing, too: of four units of height it has two.
        let right = 0.5 * (1.0 + right);
        let found = mean_of_columns(&parallel, columns.clone())[0];
        assert!((found - right).abs() < 0.02, "columns {columns:?}: {found}, not {right}");
    }
}

/// Pixels that a length at a distance from the camera of `empty_scene` (20°, at z = 5) takes.
fn pixels(length: f64, distance: f64) -> f64 {
    length / (2.0 * 10f64.to_radians().tan() * distance / f64::from(SIZE))
}

fn small_lamp(radius: f32, z: f32) -> Scene {
    let mut scene = empty_scene();
    let lamp = add_material(&mut scene, diffuse(0.0), Vec3::ONE);
    add_sphere(&mut scene, Vec3::new(0.0, 0.0, z), radius, lamp);
    scene
}

/// A lamp twice as far as the plane in focus is blurred into a disc of radius a·(1 − f/d) on that plane: variance r²/4
/// along each axis, besides that of the lamp's own disc.
#[test]
fn a_lens_blurs_by_the_thin_lens_law() {
    let (radius, distance, focus, aperture) = (0.08, 8.0, 4.0, 0.2);
    let mut scene = small_lamp(radius as f32, 5.0 - distance as f32);
    scene.camera.aperture_radius = aperture as f32;
    scene.camera.focus_distance = focus as f32;
    let Spot { variance } = spot_of(&scene);
    let blur = pixels(aperture * (1.0 - focus / distance), focus);
    let own = pixels(radius, distance);
    for measured in variance {
        let measured_blur = (4.0 * measured - own * own).sqrt();
        assert!((measured_blur / blur - 1.0).abs() < 0.01, "blur of {measured_blur} px, expected {blur}");
    }
}

/// Whatever moves evenly by a length leaves a streak of that length: variance L²/12 along it, besides its own.
#[test]
fn a_shutter_leaves_streaks_of_their_length() {
    let motion = Motion::between(Affine3A::from_translation(Vec3::X * -0.4), Affine3A::from_translation(Vec3::X * 0.4));
    let radius = 0.06;
    let mut sphere = small_lamp(radius as f32, 0.0);
    sphere.spheres[0].motion = Some(motion.clone());
    let mut camera = small_lamp(radius as f32, 0.0);
    camera.camera.motion = Some(motion.clone());
    let mut mesh = empty_scene();
    let lamp = add_material(&mut mesh, diffuse(0.0), Vec3::ONE);
    add_rectangle(&mut mesh, Vec3::new(-0.05, -0.05, 0.0), Vec3::X * 0.1, Vec3::Y * 0.1, lamp);
    mesh.instances[0].motion = Some(motion);
    for (name, scene, own) in [
        ("sphere", sphere, radius * radius / 4.0),
        ("camera", camera, radius * radius / 4.0),
        ("mesh", mesh, 0.01 / 12.0),
    ] {
        let Spot { variance: [along, across] } = spot_of(&scene);
        let own = own * pixels(1.0, 5.0).powi(2);
        let length = (12.0 * (along - own)).sqrt();
        let expected = pixels(0.8, 5.0);
        assert!((length / expected - 1.0).abs() < 0.01, "{name}: a streak of {length} px, expected {expected}");
        assert!((across / own - 1.0).abs() < 0.05, "{name}: {across} across, expected {own}");
    }
}

/// A floor under a lamp that moves and turns: at any time the light is that of the lamp where it is then.
#[test]
fn a_moving_lamp_lights_from_where_it_is() {
    let (albedo, radius, radiance) = (0.6f32, 0.3f32, 4.0f32);
    let motion = Motion::between(
        Affine3A::from_translation(Vec3::new(-1.0, 1.0, 0.0)),
        Affine3A::from_rotation_translation(Quat::from_rotation_x(2.0), Vec3::new(1.0, 2.0, 0.0)),
    );
    for as_mesh in [false, true] {
        let mut scene = empty_scene();
        let floor = add_material(&mut scene, diffuse(albedo), Vec3::ZERO);
        add_rectangle(&mut scene, Vec3::new(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0, floor);
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(radiance));
        if as_mesh {
            let ball = fechner::scene::load::shapes::sphere(Vec3::ZERO, radius);
            scene.meshes.push(ball);
            let mut instance = scene.instances[0].clone();
            instance.mesh = fechner::scene::MeshId(1);
            instance.material = lamp;
            instance.motion = Some(motion.clone());
            scene.instances.push(instance);
        } else {
            add_sphere(&mut scene, Vec3::ZERO, radius, lamp);
            scene.spheres[0].motion = Some(motion.clone());
        }
        let settings = TraceSettings { max_depth: 1, ..trace_settings(16, 16, 0) };
        let tracer = PathTracer::new(Arc::new(scene), settings);
        for time in [0.0f32, 0.3, 0.9] {
            let ray = Ray { time, ..Ray::new(vec3a(0.1, 0.2, 0.0), vec3a(-0.1, -0.2, 0.0).normalize()) };
            let (mean, error) = radiance_along(&tracer, ray, 16, if as_mesh { 1024 } else { 4096 });
            let center = Vec3::from(motion.at(time).translation);
            let distance_squared = center.length_squared();
            let irradiance = radiance * PI * radius * radius / distance_squared * (center.y / distance_squared.sqrt());
            let expected = albedo * FRAC_1_PI * irradiance;
            // The mesh is a polyhedron inside the sphere: 0.1 % less of it.
            let tolerance = 3.3 * error.x + if as_mesh { 2e-3 } else { 1e-4 } * expected;
            assert!((mean.x - expected).abs() < tolerance, "mesh {as_mesh}, time {time}: {mean} ± {error}, {expected}");
            assert!(error.x < 0.01 * expected, "too noisy to test: {error}");
        }
    }
}

/// A crop's pixels are those of the whole picture, bit for bit, in every sequence.
#[test]
fn a_crop_is_a_part_of_the_whole() {
    let mut scene = small_lamp(0.5, 0.0);
    scene.camera.aperture_radius = 0.1;
    let crop = Crop { x: 20, y: 11, width: 17, height: 23 };
    for sequence in [Sequence::PerPixel, Sequence::ZOrder, Sequence::Independent] {
        let settings = TraceSettings { sequence, ..trace_settings(SIZE, SIZE, 5) };
        let whole = film_of(&scene, settings, 2);
        let part = film_of(&scene, TraceSettings { crop: Some(crop), ..settings }, 2);
        for half in Half::BOTH {
            for (i, pixel) in part.half(half).iter().enumerate() {
                let (x, y) = (crop.x + i as u32 % crop.width, crop.y + i as u32 / crop.width);
                assert_eq!(pixel, &whole.half(half)[(y * SIZE + x) as usize], "{sequence:?} ({x}, {y})");
            }
        }
        assert!(part.half(Half::A).iter().any(|pixel| pixel.mean[0] > 0.1), "the crop shows something");
    }
}

/// With a transparent background, pixels beside the lamp see nothing of the sky and are not covered, while the sky
/// still lights what stands in it.
#[test]
fn a_transparent_background_leaves_the_light() {
    let mut scene = empty_scene();
    let grey = add_material(&mut scene, diffuse(0.5), Vec3::ZERO);
    add_sphere(&mut scene, Vec3::ZERO, 0.5, grey);
    scene.environment = constant_environment(1.0);
    let film = film_of(&scene, TraceSettings { transparent: true, ..trace_settings(SIZE, SIZE, 5) }, 3);
    let (coverage, picture) = (film.coverage(), film.estimate(1.0).rgb_cd_m2);
    let (corner, middle) = (0, (SIZE * SIZE / 2 + SIZE / 2) as usize);
    assert_eq!((coverage[corner], picture[corner]), (0.0, [0.0; 3]));
    assert!(coverage[middle] == 1.0 && (picture[middle][0] - 0.5).abs() < 0.02, "{:?}", picture[middle]);
    // The sphere's disc in pixels: its silhouette is at sin θ = 0.1.
    let radius = pixels(5.0 * 0.1f64.asin().tan(), 5.0);
    let area: f64 = coverage.iter().map(|&c| f64::from(c)).sum();
    assert!((area / (std::f64::consts::PI * radius * radius) - 1.0).abs() < 0.005, "{area}");
}

/// Keyframes of a file move things while the shutter is open, from the frame's time on: at shares of the shutter they
/// are where the keyframes say, also where a keyframe lies within it.
#[test]
fn keyframes_move_things_while_the_shutter_is_open() {
    let text = r#"
        [camera]
        shutter_s = 0.5
        keyframes = [ { time = 0, position = [0, 0, 5], look_at = [0, 0, 0] }, { time = 4, position = [4, 0, 5], look_at = [4, 0, 0] } ]
        [environment]
        sky = { sun_elevation_deg = 30 }
        [materials.white]
        type = "diffuse"
        reflectance = [0.7, 0.7, 0.7]
        [[objects]]
        box = { min = [0, 0, 0], max = [1, 1, 1] }
        material = "white"
        transform = [ { translate = [0, 1, 0] } ]
        keyframes = [ { time = 1, translate = [0, 0, 0] }, { time = 1.25, translate = [1, 0, 0] }, { time = 2, rotate_deg = 90, axis = [0, 0, 1], translate = [1, 0, 0] } ]
        [[objects]]
        sphere = { center = [0, 0, 0], radius = 1 }
        material = "white"
        keyframes = [ { time = 1, scale = 1 }, { time = 1.5, scale = 2 } ]
    "#;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("moving.toml");
    std::fs::write(&file, text).expect("written");
    let options = LoadOptions { frame_time: 1.0, ..LoadOptions::default() };
    let scene = load(&file, &options).expect("a sound scene");
    assert!(scene.moves() && scene.lights.len() == 1);
    let camera = scene.camera.motion.as_ref().expect("it moves");
    assert!(scene.camera.position.abs_diff_eq(Vec3::new(1.0, 0.0, 5.0), 1e-5));
    assert!(camera.at(1.0).transform_point3(scene.camera.position).abs_diff_eq(Vec3::new(1.5, 0.0, 5.0), 1e-5));
    let cube = scene.instances[0].motion.as_ref().expect("it moves");
    let origin = |time: f32| cube.at(time).transform_point3(Vec3::ZERO);
    assert!(origin(0.25).abs_diff_eq(Vec3::new(0.5, 1.0, 0.0), 1e-5), "{}", origin(0.25));
    assert!(origin(0.5).abs_diff_eq(Vec3::new(1.0, 1.0, 0.0), 1e-5), "{}", origin(0.5));
    // A quarter second of three quarters: 30° about z.
    let (sin, cos) = 30f32.to_radians().sin_cos();
    assert!(origin(1.0).abs_diff_eq(Vec3::new(1.0 - sin, cos, 0.0), 1e-5), "{}", origin(1.0));
    let sphere = scene.spheres[0].motion.as_ref().expect("it moves");
    assert!((sphere.at(0.5).matrix3.x_axis.length() - 1.5).abs() < 1e-5);
    let still = load(&file, &LoadOptions { frame_time: 9.0, ..LoadOptions::default() }).expect("a sound scene");
    assert!(!still.moves(), "after the last keyframe everything rests");
}

/// Keyframes of materials and lights: what they say at the frame's time, as if it had been written; what is wrong is
/// named with the keyframes' line.
#[test]
fn lights_and_materials_change_in_time() {
    let of = |light: &str, material: &str| {
        format!(
            "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n[materials.red]\ntype = \"diffuse\"\n{material}\n\
             [[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"red\"\n\
             [[lights]]\ntype = \"point\"\nposition = [0, 3, 0]\n{light}\n"
        )
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("changing.toml");
    let at = |text: &str, frame_time: f64| {
        std::fs::write(&file, text).expect("written");
        load(&file, &LoadOptions { frame_time, ..LoadOptions::default() })
    };
    let moving = of(
        "keyframes = [ { time = 1, intensity_cd = 10, color = [1, 1, 1] }, { time = 3, intensity_cd = 30, color = [1, 1, 1] } ]",
        "keyframes = [ { time = 0, reflectance = [0.5, 0, 0] }, { time = 2, reflectance = [0, 0.5, 0] } ]",
    );
    let fixed = of("intensity_cd = 15\ncolor = [1, 1, 1]", "reflectance = [0.125, 0.375, 0]");
    let (moving, fixed) = (at(&moving, 1.5).expect("sound"), at(&fixed, 1.5).expect("sound"));
    assert_eq!(content_hash(&moving), content_hash(&fixed));
    for (light, material, expected) in [
        ("keyframes = [ { time = 0, intensity_cd = -1 } ]", "reflectance = 0.5", [":13:", "negative"]),
        ("intensity_cd = 5", "keyframes = [ { time = 0, reflectence = 0.5 } ]", [":6:", "reflectence"]),
        ("intensity_cd = 5", "keyframes = []", [":6:", "each needs a time"]),
        (
            "intensity_cd = 5",
            "keyframes = [ { time = 1, reflectance = 0.1 }, { time = 1, reflectance = 0.2 } ]",
            [":6:", "increase"],
        ),
        ("intensity_cd = 5", "reflectance = 0.1\nkeyframes = [ { time = 1, reflectance = 0.1 } ]", [":6:", "as well"]),
        ("intensity_cd = 5", "keyframes = [ { time = 1, reflectance = \"red\" } ]", [":6:", "expected a number"]),
    ] {
        let said = at(&of(light, material), 0.0).expect_err("not sound").to_string();
        assert!(expected.iter().all(|part| said.contains(part)), "{said}");
    }
}
