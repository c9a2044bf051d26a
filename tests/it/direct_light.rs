//! Direct light on a diffuse plane against closed forms, within 0.3 %.

use crate::support::{
    add_material, add_rectangle, add_sphere, constant_environment, diffuse, empty_scene, radiance_along, trace_settings,
};
use fechner::geometry::Ray;
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::scene::load::shapes;
use fechner::scene::{
    Alpha, ColorInput, Environment, Instance, Light, MaterialId, MeshId, Parametrisation, PhotometricWeb, Roughness,
    ScalarInput, Scene, SpotFalloff, Surface, Texels, Texture, TextureId, TextureLookup, Wrap,
};
use glam::{Affine3A, Mat3, Mat3A, Vec2, Vec3, vec3a};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

const ALBEDO: f32 = 0.6;

/// A floor at y = 0, facing up, of albedo 0.6.
fn floor() -> Scene {
    let mut scene = empty_scene();
    let material = add_material(&mut scene, diffuse(ALBEDO), Vec3::ZERO);
    add_rectangle(&mut scene, Vec3::new(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0, material);
    scene
}

/// Reflected radiance at (x, 0, 0) must be albedo·irradiance/π.
fn assert_irradiance(scene: Scene, x: f32, expected_irradiance: f32, what: &str) {
    assert_irradiance_behind(0, scene, x, expected_irradiance, what);
}

/// The same behind so many sheets.
fn assert_irradiance_behind(sheets: u32, scene: Scene, x: f32, expected_irradiance: f32, what: &str) {
    // One scattering event but for the sheets': direct light only.
    let settings = TraceSettings { max_depth: 1 + sheets, ..trace_settings(16, 16, 0) };
    let tracer = PathTracer::new(Arc::new(scene), settings);
    let ray = Ray::new(vec3a(x - 0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
    let (mean, error) = radiance_along(&tracer, ray, 16, 16384);
    let expected = ALBEDO * FRAC_1_PI * expected_irradiance;
    assert!(
        (mean.x - expected).abs() < 0.003 * expected && error.x < 0.001 * expected,
        "{what}: {} ± {}, expected {expected}, ratio {}",
        mean.x,
        error.x,
        mean.x / expected
    );
}

/// Irradiance at the origin, normal +y, from a polygon of radiance 1 above the horizon (Lambert 1760).
fn polygon_irradiance(corners: &[Vec3]) -> f32 {
    let mut sum = 0.0f64;
    for (i, a) in corners.iter().enumerate() {
        let (a, b) = (a.as_dvec3().normalize(), corners[(i + 1) % corners.len()].as_dvec3().normalize());
        sum += a.dot(b).acos() * a.cross(b).normalize().y;
    }
    (0.5 * sum.abs()) as f32
}

#[test]
fn a_rectangle_gives_its_form_factor() {
    for x in [0.0, 0.7, 3.0] {
        let mut scene = floor();
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(5.0));
        scene.materials[lamp.0 as usize].emits_both_sides = false;
        let (corner, u, v) = (Vec3::new(-0.5, 1.2, -0.4), Vec3::new(1.0, 0.3, 0.0), Vec3::new(0.0, 0.0, 0.8));
        add_rectangle(&mut scene, corner, u, v, lamp);
        let corners = [corner, corner + u, corner + u + v, corner + v].map(|c| c - Vec3::X * x);
        assert_irradiance(scene, x, 5.0 * polygon_irradiance(&corners), &format!("rectangle seen from x = {x}"));
    }
}

#[test]
fn a_sphere_gives_its_closed_form() {
    for (x, radius) in [(0.0f32, 0.5), (1.5, 0.5), (0.5, 0.05)] {
        let mut scene = floor();
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
        let center = Vec3::new(0.0, 1.0, 0.0);
        add_sphere(&mut scene, center, radius, lamp);
        let distance_squared = x * x + 1.0;
        let cosine = 1.0 / distance_squared.sqrt();
        let irradiance = 3.0 * PI * radius * radius / distance_squared * cosine;
        assert_irradiance(scene, x, irradiance, &format!("sphere of radius {radius} seen from x = {x}"));
    }
}

/// On the axis of a disk of radius R at a distance h, irradiance is π L R² / (R² + h²).
#[test]
fn a_disk_gives_its_closed_form() {
    for (radius, height) in [(0.5f32, 1.0f32), (2.0, 0.5)] {
        let mut scene = floor();
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
        scene.meshes.push(shapes::disk(Vec3::Y * height, Vec3::NEG_Y, radius));
        let mesh = MeshId(scene.meshes.len() as u32 - 1);
        scene.instances.push(Instance { mesh, material: lamp, ..scene.instances[0].clone() });
        let irradiance = 3.0 * PI * radius * radius / (radius * radius + height * height);
        assert_irradiance(scene, 0.0, irradiance, &format!("disk of radius {radius}"));
    }
}

/// Where a scene has its origin is no matter: lamps that stood there lost up to two thirds of their light to what is
/// far away, since shadow rays ended by the rounding of the lamp's own coordinates and not by that of their length.
#[test]
fn lamps_at_the_origin_light_what_is_far() {
    const RADIUS: f32 = 0.1;
    let tilted = [Vec3::new(0.2, 0.1, 0.0), Vec3::new(0.0, 0.05, 0.2)];
    let level = [0.2 * Vec3::X, 0.2 * Vec3::Z];
    type Adding<'a> = &'a dyn Fn(&mut Scene, Vec3, MaterialId);
    let disk = |scene: &mut Scene, center: Vec3, lamp: MaterialId| {
        scene.meshes.push(shapes::disk(Vec3::ZERO, Vec3::NEG_Y, RADIUS));
        let (mesh, to_world) = (MeshId(scene.meshes.len() as u32 - 1), Affine3A::from_translation(center));
        scene.instances.push(Instance { mesh, to_world, material: lamp, ..scene.instances[0].clone() });
    };
    let sheet = |edges: [Vec3; 2]| {
        move |scene: &mut Scene, center: Vec3, lamp: MaterialId| {
            add_rectangle(scene, center - 0.5 * (edges[0] + edges[1]), edges[0], edges[1], lamp);
        }
    };
    let of_sheet = |edges: [Vec3; 2], height: f32| {
        let [u, v] = edges.map(|edge| 0.5 * edge);
        polygon_irradiance(&[-u - v, u - v, u + v, v - u].map(|corner| corner + height * Vec3::Y))
    };
    type Irradiance<'a> = &'a dyn Fn(f32) -> f32;
    let lamps: [(&str, Adding<'_>, Irradiance<'_>); 4] = [
        ("sphere", &|scene, center, lamp| add_sphere(scene, center, RADIUS, lamp), &|height| {
            PI * (RADIUS / height).powi(2)
        }),
        ("disk", &disk, &|height| PI * RADIUS.powi(2) / (RADIUS.powi(2) + height.powi(2))),
        ("rectangle", &sheet(level), &|height| of_sheet(level, height)),
        ("tilted rectangle", &sheet(tilted), &|height| of_sheet(tilted, height)),
    ];
    for (name, add, irradiance) in lamps {
        for (height, lamp_at) in
            [1.0, 3.0, 10.0, 50.0, 1000.0].into_iter().flat_map(|h| [(h, 0.0), (h, 1.0), (h, 20.0)])
        {
            let mut scene = empty_scene();
            let material = add_material(&mut scene, diffuse(ALBEDO), Vec3::ZERO);
            let center = lamp_at * Vec3::new(0.3, 1.0, -0.6);
            let below = center - height * Vec3::Y;
            add_rectangle(&mut scene, below - Vec3::new(1.0, 0.0, 1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, material);
            let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
            add(&mut scene, center, lamp);
            let tracer = PathTracer::new(Arc::new(scene), TraceSettings { max_depth: 1, ..trace_settings(16, 16, 0) });
            let from = below + Vec3::new(-0.2, 0.4, 0.0);
            let (mean, _) = radiance_along(&tracer, Ray::new(from.into(), (below - from).normalize().into()), 16, 256);
            let ratio = mean.x / (ALBEDO * FRAC_1_PI * 3.0 * irradiance(height));
            assert!((ratio - 1.0).abs() < 2e-3, "{name} at {center}, {height} above the floor: {ratio}");
        }
    }
}

/// Between two infinite planes, one of which emits E, radiosities are E / (1 − ρρ′) and ρ′ times that. Each of 20,000
/// separations' length: 1e-4 escapes.
#[test]
fn two_planes_have_their_radiosity() {
    let (emitted, own, other) = (1.5f32, 0.7f32, 0.4f32);
    let mut scene = empty_scene();
    let lamp = add_material(&mut scene, diffuse(own), Vec3::splat(emitted));
    let plain = add_material(&mut scene, diffuse(other), Vec3::ZERO);
    let (side, half) = (20_000.0, 10_000.0);
    add_rectangle(&mut scene, Vec3::new(-half, 0.0, -half), Vec3::Z * side, Vec3::X * side, lamp);
    add_rectangle(&mut scene, Vec3::new(-half, 1.0, -half), Vec3::X * side, Vec3::Z * side, plain);
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
    let of_lamp = emitted / (1.0 - own * other);
    for (direction, expected) in [(Vec3::NEG_Y, of_lamp), (Vec3::Y, other * of_lamp)] {
        let ray = Ray::new(vec3a(0.3, 0.5, 0.2), (direction + Vec3::X * 0.4).normalize().into());
        let (mean, error) = radiance_along(&tracer, ray, 16, 16384);
        let tolerance = 3e-4 * expected + 3.3 * error.x;
        assert!((mean.x - expected).abs() < tolerance, "{direction}: {} ± {}, expected {expected}", mean.x, error.x);
        assert!(error.x < 1e-3 * expected, "too noisy to test: {error}");
    }
}

/// Under a sky of radiance 1 + 100·y⁵⁰ the floor gets π + 100·2π/52: environment sampling with MIS compensation against
/// the closed form (Z test, significance 1e-3, and 2e-4 for the picture's interpolation).
#[test]
fn uneven_skies_give_their_integral() {
    let radiance = |direction: Vec3| Vec3::splat(1.0 + 100.0 * direction.y.max(0.0).powi(50));
    let size = 512;
    let texels = (0..size * size).map(|i| {
        let uv = Vec2::new((i % size) as f32 + 0.5, (i / size) as f32 + 0.5) / size as f32;
        // The square's centre is +z.
        radiance(Mat3::from_rotation_x(-std::f32::consts::FRAC_PI_2) * Parametrisation::EqualArea.to_direction(uv))
    });
    let equal_area = Environment {
        parametrisation: Parametrisation::EqualArea,
        width: size,
        height: size,
        texels: Arc::new(texels.collect()),
        from_world: Mat3::from_rotation_x(std::f32::consts::FRAC_PI_2),
        ..Environment::constant(Vec3::ZERO)
    };
    for environment in [Environment::from_directions(1024, 512, radiance), equal_area] {
        let mut scene = floor();
        let name = environment.parametrisation;
        scene.environment = Some(environment);
        let settings = TraceSettings { max_depth: 1, ..trace_settings(16, 16, 0) };
        let tracer = PathTracer::new(Arc::new(scene), settings);
        let ray = Ray::new(vec3a(-0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
        let (mean, error) = radiance_along(&tracer, ray, 32, 4096);
        let expected = ALBEDO * FRAC_1_PI * (PI + 200.0 * PI / 52.0);
        assert!(
            (mean.x - expected).abs() < 3.3 * error.x + 2e-4 * expected && error.x < 1e-3 * expected,
            "{name:?}: {} ± {}, expected {expected}",
            mean.x,
            error.x
        );
    }
}

/// A sun of 30° across gives the irradiance it states, by light sampling and by chance together.
#[test]
fn a_sun_with_a_disc_gives_its_irradiance() {
    let mut scene = floor();
    scene.lights.push(Light::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::splat(2.0),
        angular_radius: 15f32.to_radians(),
        is_of_sky: false,
    });
    assert_irradiance(scene, 0.0, 2.0, "sun");
}

#[test]
fn lights_without_area_follow_their_laws() {
    let mut point = floor();
    point.lights.push(Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0) });
    assert_irradiance(point.clone(), 1.5, 8.0 / 6.25 * 0.8, "point");
    let mut spot = floor();
    spot.lights.push(Light::Spot {
        position: Vec3::new(0.0, 2.0, 0.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(8.0),
        inner_angle: 1.0,
        outer_angle: 1.2,
        falloff: SpotFalloff::Smoothstep,
    });
    assert_irradiance(spot, 1.5, 8.0 / 6.25 * 0.8, "inside the cone of a spot");
    // Aimed upwards, 110° away from the point, beside a lamp that the choice might take it for.
    let mut wide = floor();
    wide.lights.push(Light::Spot {
        position: Vec3::new(0.0, 2.0, 0.0),
        direction: Vec3::new(0.0, -110f32.to_radians().cos(), 110f32.to_radians().sin()),
        intensity: Vec3::splat(8.0),
        inner_angle: 10f32.to_radians(),
        outer_angle: 150f32.to_radians(),
        falloff: SpotFalloff::LinearInAngle,
    });
    wide.lights.push(Light::Point { position: Vec3::new(0.0, 2.0, 3.0), intensity: Vec3::splat(13.0) });
    assert_irradiance(wide, 0.0, 8.0 / 4.0 * 40.0 / 140.0 + 2.0 / 13f32.sqrt(), "behind a wide spot");
    let mut sun = floor();
    sun.lights.push(Light::Directional {
        direction: Vec3::new(0.6, -0.8, 0.0),
        irradiance: Vec3::splat(2.0),
        angular_radius: 0.0,
        is_of_sky: false,
    });
    assert_irradiance(sun, 0.0, 1.6, "directional");
}

/// Intensities that have closed forms: I₀ cos γ, which on a plane below gives I₀ h²/d⁴, and one that depends on C and
/// shines up too, of a lamp that is aimed and turned.
#[test]
fn photometric_lights_follow_their_webs() {
    let place = Vec3::new(0.0, 2.0, 0.0);
    let lamp = |web: &PhotometricWeb, axis: Vec3, spin: f32| Light::Photometric {
        position: place,
        from_world: PhotometricWeb::from_world(axis, spin),
        web: Arc::new(web.clone()),
        per_candela: Vec3::splat(0.5),
    };
    let under = |lights: &[Light]| {
        let mut scene = floor();
        scene.lights.extend_from_slice(lights);
        scene
    };
    let disk = PhotometricWeb::from_directions(1.0, |own| 16.0 * (-own.z).max(0.0));
    let x = 1.5f32;
    let distance_squared = x * x + 4.0;
    let irradiance = |intensity: f32| 0.5 * intensity * 2.0 / distance_squared.powf(1.5);
    let expected = irradiance(16.0 * 2.0 / distance_squared.sqrt());
    assert!((expected / (8.0 * 4.0 / distance_squared.powi(2)) - 1.0).abs() < 1e-6);
    assert_irradiance(under(&[lamp(&disk, Vec3::NEG_Y, 0.3)]), x, expected, "Lambertian lamp");

    // In the lamp's space: x is C = 0°, y is C = 90°, z is up from the lamp.
    let uneven = |own: Vec3| 8.0 + 4.0 * own.x + 3.0 * own.y + 2.0 * own.z;
    let web = PhotometricWeb::from_directions(1.0, uneven);
    let towards = (Vec3::new(x, 0.0, 0.0) - place).normalize();
    // Straight down, turned by 90°: C = 0 along −z, C = 90° along −x.
    let down = uneven(Vec3::new(-towards.z, -towards.x, towards.y));
    assert_irradiance(under(&[lamp(&web, Vec3::NEG_Y, 0.5 * PI)]), x, irradiance(down), "turned lamp");
    // Tilted by 60° towards +x: C = 0 is 30° beside the vertical, away from +x.
    let (sin, cos) = 60f32.to_radians().sin_cos();
    let axis = Vec3::new(sin, -cos, 0.0);
    let own = Vec3::new(towards.dot(Vec3::new(cos, sin, 0.0)), -towards.z, -towards.dot(axis));
    assert_irradiance(under(&[lamp(&web, axis, 0.0)]), x, irradiance(uneven(own)), "tilted lamp");
    // Beside lamps that the choice might take it for.
    let up = uneven(Vec3::new(-towards.x, -towards.z, -towards.y));
    let all = [lamp(&web, Vec3::Y, 0.0), lamp(&disk, Vec3::NEG_Y, 0.0), lamp(&disk, Vec3::Y, 0.0)];
    assert_irradiance(under(&all), x, irradiance(up) + expected, "lamps that look up and down");
}

/// A floor under sheets at heights of 0.25, 0.5, …
fn floor_under(sheets: &[Surface]) -> Scene {
    let mut scene = floor();
    for (height, surface) in (1..).zip(sheets) {
        let material = add_material(&mut scene, surface.clone(), Vec3::ZERO);
        let corner = Vec3::new(-50.0, 0.25 * height as f32, -50.0);
        add_rectangle(&mut scene, corner, Vec3::Z * 100.0, Vec3::X * 100.0, material);
    }
    scene
}

/// Glass of index 1.5.
fn pane(transmittance: f32) -> Surface {
    Surface::ThinDielectric { ior: 1.5, transmittance: ColorInput::constant(Vec3::splat(transmittance)) }
}

/// Share that passes a clear pane of index 1.5 at a cosine, by Fresnel and all reflections between its faces.
fn share_through_pane(outside: f32) -> f32 {
    let inside = (1.0 - (1.0 - outside * outside) / 2.25).sqrt();
    let parallel = ((1.5 * outside - inside) / (1.5 * outside + inside)).powi(2);
    let perpendicular = ((outside - 1.5 * inside) / (outside + 1.5 * inside)).powi(2);
    let face = 0.5 * (parallel + perpendicular);
    (1.0 - face) / (1.0 + face)
}

/// Panes between a floor and lights that no path can meet: what each lets through, at its own angle, and nothing
/// through a board nor through more panes than a path may have surfaces.
#[test]
fn lights_without_area_shine_through_panes() {
    let behind = |surfaces: &[Surface], light: &Light| {
        let mut scene = floor_under(surfaces);
        scene.lights.push(light.clone());
        scene
    };
    let through = share_through_pane(0.8);
    let point = Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0) };
    let sun = Light::Directional {
        direction: Vec3::new(0.6, -0.8, 0.0),
        irradiance: Vec3::splat(2.0),
        angular_radius: 0.0,
        is_of_sky: false,
    };
    assert_irradiance_behind(1, behind(&[pane(1.0)], &point), 1.5, through * 8.0 / 6.25 * 0.8, "point");
    assert_irradiance_behind(
        2,
        behind(&[pane(1.0), pane(0.5)], &sun),
        0.0,
        0.5 * through * through * 1.6,
        "directional",
    );
    for (surfaces, sheets) in [([pane(1.0), diffuse(0.5)], 2), ([pane(1.0), pane(1.0)], 1)] {
        let settings = TraceSettings { max_depth: 1 + sheets, ..trace_settings(16, 16, 0) };
        let tracer = PathTracer::new(Arc::new(behind(&surfaces, &point)), settings);
        let ray = Ray::new(vec3a(1.4, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
        assert_eq!(radiance_along(&tracer, ray, 16, 64).0, Vec3::ZERO);
    }
}

/// Lamps that paths meet behind panes by themselves, too, shine through them once: a sun of the sun's size, which
/// nearly only shadow rays find, a sun of 30°, a sky, and a ball near the floor, which both find.
#[test]
fn lights_of_some_extent_shine_through_panes_once() {
    let panes = [pane(1.0), pane(0.5)];
    let through = |cosine: f32| 0.5 * share_through_pane(cosine).powi(2);
    let sun = |radius: f32| Light::Directional {
        direction: Vec3::new(0.6, -0.8, 0.0),
        irradiance: Vec3::splat(2.0),
        angular_radius: radius.to_radians(),
        is_of_sky: false,
    };
    for (radius, expected) in [(0.27, 1.6 * through(0.8)), (15.0, 2.0 * mean_over_disc(15f32.to_radians(), through))] {
        let mut scene = floor_under(&panes);
        scene.lights.push(sun(radius));
        assert_irradiance_behind(2, scene, 0.0, expected, &format!("a sun of {radius}°"));
    }
    let mut scene = floor_under(&panes);
    scene.environment = constant_environment(1.0);
    let cosines = (0..10_000).map(|i| (i as f32 + 0.5) / 10_000.0);
    let sky = cosines.map(|cosine| 2.0 * PI * cosine * through(cosine) / 10_000.0).sum();
    assert_irradiance_behind(2, scene, 0.0, sky, "sky");
    let mut scene = floor_under(&panes);
    let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
    add_sphere(&mut scene, Vec3::new(0.0, 1.0, 0.0), 0.4, lamp);
    let edge = 0.84f32.sqrt();
    let cosines = (0..10_000).map(|i| edge + (1.0 - edge) * (i as f32 + 0.5) / 10_000.0);
    let ball = cosines.map(|cosine| 3.0 * 2.0 * PI * (1.0 - edge) * cosine * through(cosine) / 10_000.0).sum();
    assert_irradiance_behind(2, scene, 0.0, ball, "ball");
}

/// Mean over directions of a disc around a cosine of 0.8 of cosine times transmittance, over the mean cosine's part
/// of it: what a sun of irradiance 1, square to its middle, gives a floor.
fn mean_over_disc(radius: f32, through: impl Fn(f32) -> f32) -> f32 {
    let (mut sum, mut total) = (0.0f64, 0.0f64);
    let axis = Vec3::new(-0.6, 0.8, 0.0);
    let (side, up) = (Vec3::Z, axis.cross(Vec3::Z));
    for i in 0..400 {
        let cosine = 1.0 - (1.0 - radius.cos()) * (i as f32 + 0.5) / 400.0;
        let sine = (1.0 - cosine * cosine).sqrt();
        for j in 0..400 {
            let (s, c) = (2.0 * PI * (j as f32 + 0.5) / 400.0).sin_cos();
            let height = (axis * cosine + (side * c + up * s) * sine).y;
            sum += f64::from(height * through(height));
            total += f64::from(cosine);
        }
    }
    (sum / total) as f32
}

#[test]
fn a_constant_sky_gives_pi() {
    let mut scene = floor();
    scene.environment = constant_environment(1.0);
    assert_irradiance(scene, 0.0, PI, "sky");
}

/// Two kinds of light at once: the choice between them must not change either.
#[test]
fn lights_add_up() {
    let mut scene = floor();
    scene.environment = constant_environment(0.1);
    scene.lights.push(Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Vec3::splat(8.0) });
    assert_irradiance(scene, 0.0, 0.1 * PI + 2.0, "sky and point");
}

/// A patch of sky and a wide disc in the same directions: each alone, and what both give together.
#[test]
fn sky_and_disc_in_one_place_add_up() {
    let towards = Vec3::new(0.3, 1.0, 0.2).normalize();
    let patch = Environment::from_directions(64, 32, |d| if d.dot(towards) > 0.8 { Vec3::ONE } else { Vec3::ZERO });
    let disc = Light::Directional { direction: -towards, irradiance: Vec3::ONE, angular_radius: 1.0, is_of_sky: false };
    let along = |sky: bool, sun: bool| {
        let mut scene = floor();
        scene.environment = sky.then(|| patch.clone());
        scene.lights = if sun { vec![disc.clone()] } else { Vec::new() };
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let ray = Ray::new(vec3a(-0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
        let (mean, error) = radiance_along(&tracer, ray, 16, 4096);
        (mean.x, error.x)
    };
    let (sky, sun, both) = (along(true, false), along(false, true), along(true, true));
    let error = (sky.1 * sky.1 + sun.1 * sun.1 + both.1 * both.1).sqrt();
    assert!((both.0 - sky.0 - sun.0).abs() < 4.0 * error, "{} + {} is not {} ± {error}", sky.0, sun.0, both.0);
    assert!(error < 0.005 * both.0, "{error} of {}", both.0);
}

/// A lamp that is white above and black below gives nothing to the floor under it, and, turned over, all that it
/// gives when it is white everywhere. The floor's point sees nothing of its upper half.
#[test]
fn a_sphere_shines_where_its_picture_says() {
    let above = |turned: bool, pictured: bool| {
        let mut scene = floor();
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(3.0));
        let texels = (0..16).map(|row| [if row < 8 { 1.0 } else { 0.0 }; 4]).collect();
        scene.textures.push(Texture {
            name: "halves".to_owned(),
            width: 1,
            height: 16,
            texels: Texels::Floats(Arc::new(texels)),
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Clamp,
            nearest: true,
        });
        if pictured {
            scene.materials[lamp.0 as usize].emission.texture = Some(TextureLookup::plain(TextureId(0)));
        }
        add_sphere(&mut scene, Vec3::Y * 1.5, 0.5, lamp);
        if turned {
            scene.spheres[0].axes = Mat3A::from_rotation_x(PI);
        }
        let settings = TraceSettings { max_depth: 1, ..trace_settings(16, 16, 0) };
        let ray = Ray::new(vec3a(-0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize());
        radiance_along(&PathTracer::new(Arc::new(scene), settings), ray, 16, 1024).0.x
    };
    assert_eq!(above(false, true), 0.0);
    let (pictured, plain) = (above(true, true), above(true, false));
    assert!((pictured / plain - 1.0).abs() < 1e-3, "{pictured} and {plain}");
}

/// A lamp in an absorbing volume, whose boundary lets light through by refraction and diffusely: what light samples
/// alone find (no ray meets the lamp) is what they and scattering find together (Z test, significance 1e-3).
#[test]
fn light_samples_and_scattering_cross_a_mixed_boundary_alike() {
    let absorption = Vec3::new(0.5, 2.0, 6.0);
    let rough = Surface::Dielectric {
        ior: 1.2,
        roughness: Roughness::constant(0.6),
        transmittance: ColorInput::constant(Vec3::ONE),
        absorption,
    };
    let sheet = Surface::DiffuseTransmission {
        reflectance: ColorInput::constant(Vec3::splat(0.2)),
        transmittance: ColorInput::constant(Vec3::splat(0.7)),
    };
    let boundary = Surface::Mix { first: Box::new(rough), second: Box::new(sheet), amount: ScalarInput::constant(0.5) };
    let found = |alpha: Alpha| {
        let mut scene = empty_scene();
        let boundary = add_material(&mut scene, boundary.clone(), Vec3::ZERO);
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::splat(5.0));
        scene.materials[lamp.0 as usize].alpha = alpha;
        add_rectangle(&mut scene, Vec3::new(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0, boundary);
        add_rectangle(&mut scene, Vec3::new(-1.0, -0.5, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, lamp);
        let settings = TraceSettings { max_depth: 1, ..trace_settings(16, 16, 0) };
        let tracer = PathTracer::new(Arc::new(scene), settings);
        radiance_along(&tracer, Ray::new(vec3a(-0.1, 0.2, 0.0), vec3a(0.1, -0.2, 0.0).normalize()), 16, 16384)
    };
    let ((by_lights, lights_error), (together, error)) = (found(Alpha::Unseen), found(Alpha::Opaque));
    for channel in 0..3 {
        let (a, b) = (by_lights[channel], together[channel]);
        let deviation = lights_error[channel].hypot(error[channel]);
        assert!(
            (a - b).abs() < 3.5 * deviation + 1e-4 * a,
            "channel {channel}: {a} by lights, {b} together ± {deviation}"
        );
        assert!(deviation < 0.005 * a, "too noisy to test: {deviation} of {a}");
    }
}
