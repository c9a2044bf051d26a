//! White furnaces: what a lossless surface returns in a constant environment is the environment.

use crate::support::{
    add_material, add_mesh, add_rectangle, add_sphere, block_key, constant_environment, diffuse, empty_scene,
    radiance_along, trace_settings,
};
use fechner::geometry::Ray;
use fechner::integrator::{PathTracer, Pruning, TraceSettings};
use fechner::scene::{
    ColorInput, Mesh, MetalRoughness, Roughness, ScalarInput, Scene, Surface, Texels, Texture, TextureId,
    TextureLookup, Wrap,
};
use glam::{Vec3, Vec3A, vec3a};
use std::sync::Arc;

/// Rays that meet a unit sphere at the origin from face on to grazing.
fn rays() -> impl Iterator<Item = Ray> {
    [0.0f32, 0.5, 0.8, 0.95].into_iter().map(|x| Ray::new(vec3a(x, 0.0, 5.0), Vec3A::NEG_Z))
}

fn sphere_in_furnace(surface: Surface) -> PathTracer {
    let mut scene = empty_scene();
    scene.environment = constant_environment(1.0);
    let material = add_material(&mut scene, surface, Vec3::ZERO);
    add_sphere(&mut scene, Vec3::ZERO, 1.0, material);
    PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0))
}

/// Within 0.5 %, and 3.3 of the test's own standard errors (significance 1e-3), which must themselves be small: from 16
/// blocks of 8192 samples.
fn assert_returns(surface: &Surface, expected: Vec3) {
    assert_returns_within(surface, expected, 0.0025);
}

fn assert_returns_within(surface: &Surface, expected: Vec3, most_error: f32) {
    let tracer = sphere_in_furnace(surface.clone());
    for ray in rays() {
        let (mean, error) = radiance_along(&tracer, ray, 16, 8192);
        let tolerance = Vec3::splat(0.005) * expected + 3.3 * error;
        assert!(
            (mean - expected).abs().cmple(tolerance).all(),
            "{surface:?} at x = {}: {mean} ± {error}, expected {expected}",
            ray.origin.x
        );
        assert!(error.max_element() < most_error, "{surface:?}: too noisy to test, ± {error}");
    }
}

#[test]
fn diffuse_returns_its_albedo() {
    for albedo in [0.18, 0.5, 1.0] {
        assert_returns(&diffuse(albedo), Vec3::splat(albedo));
    }
}

/// Colours of vertices, in between as between them, multiply what a surface reflects.
#[test]
fn vertex_colours_multiply_the_albedo() {
    let mut scene = empty_scene();
    scene.environment = constant_environment(1.0);
    let material = add_material(&mut scene, diffuse(0.5), Vec3::ZERO);
    add_rectangle(&mut scene, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y, material);
    let (left, right) = (Vec3::new(1.0, 0.5, 0.0), Vec3::new(0.0, 0.5, 1.0));
    scene.meshes[0].colors = vec![left, right, right, left];
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
    for x in [-0.9_f32, 0.0, 0.5] {
        let (mean, _) = radiance_along(&tracer, Ray::new(vec3a(x, 0.2, 5.0), Vec3A::NEG_Z), 1, 16);
        let expected = 0.5 * left.lerp(right, 0.5 + 0.5 * x);
        assert!(mean.abs_diff_eq(expected, 1e-4), "{mean}, expected {expected}");
    }
}

/// A channel that would make light is scaled down, and takes no other with it.
#[test]
fn sheets_make_no_light_in_any_channel() {
    let albedo = ColorInput::constant(Vec3::new(0.8, 0.2, 0.1));
    let sheet = Surface::DiffuseTransmission { reflectance: albedo, transmittance: albedo };
    let mut scene = empty_scene();
    scene.environment = constant_environment(1.0);
    let material = add_material(&mut scene, sheet, Vec3::ZERO);
    add_rectangle(&mut scene, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y, material);
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
    let (mean, _) = radiance_along(&tracer, Ray::new(vec3a(0.1, 0.2, 5.0), Vec3A::NEG_Z), 1, 16);
    assert!(mean.abs_diff_eq(Vec3::new(1.0, 0.4, 0.2), 1e-4), "{mean}");
}

#[test]
fn mirrors_return_their_reflectance() {
    let reflectance = Vec3::new(0.9, 0.5, 0.1);
    assert_returns(&Surface::Mirror { reflectance: ColorInput::constant(reflectance) }, reflectance);
}

/// A conductor with a vast extinction reflects everything: any loss is the microfacet model's.
#[test]
fn lossless_conductors_return_everything() {
    for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
        let surface = Surface::conductor(Vec3::ONE, Vec3::splat(1e4), Roughness::constant(roughness));
        assert_returns(&surface, Vec3::ONE);
    }
}

#[test]
fn clear_dielectrics_return_everything() {
    for ior in [1.33, 1.5, 2.4] {
        for roughness in [0.0, 0.3, 0.6, 1.0] {
            let surface = Surface::Dielectric {
                ior,
                roughness: Roughness::constant(roughness),
                transmittance: ColorInput::constant(Vec3::ONE),
                absorption: Vec3::ZERO,
            };
            // Paths inside a rough ball are long and their weights differ: noisier than the others. At index 2.4 and
            // roughness 0.6 the error is 0.007 to 0.010 (of 400 blocks), and that of 16 blocks differs from it by a
            // quarter.
            assert_returns_within(&surface, Vec3::ONE, 0.015);
        }
    }
    assert_returns(&Surface::ThinDielectric { ior: 1.5, transmittance: ColorInput::constant(Vec3::ONE) }, Vec3::ONE);
}

#[test]
fn white_metal_roughness_returns_everything() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in [0.1, 0.5, 1.0] {
            let surface = Surface::MetalRoughness(MetalRoughness {
                metallic: ScalarInput::constant(metallic),
                roughness: ScalarInput::constant(roughness),
                ..MetalRoughness::default()
            });
            assert_returns(&surface, Vec3::ONE);
        }
    }
}

/// Inside a closed sphere that emits E and reflects ρ, radiance is E/(1 − ρ) everywhere and in all directions.
#[test]
fn infinite_bounces_add_up() {
    for (albedo, samples) in [(0.5f32, 4096), (0.8, 4096), (0.95, 16384)] {
        let mut scene: Scene = empty_scene();
        let material = add_material(&mut scene, diffuse(albedo), Vec3::splat(0.3));
        add_sphere(&mut scene, Vec3::ZERO, 2.0, material);
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let ray = Ray::new(vec3a(0.3, -0.2, 0.1), vec3a(0.48, 0.6, 0.64));
        let (mean, error) = radiance_along(&tracer, ray, 16, samples);
        let expected = 0.3 / (1.0 - albedo);
        assert!(
            (mean.x - expected).abs() < 0.003 * expected + 3.3 * error.x,
            "albedo {albedo}: {} ± {}, expected {expected}",
            mean.x,
            error.x
        );
        assert!(error.x < 0.005 * expected, "albedo {albedo}: too noisy to test, ± {}", error.x);
    }
}

/// Light that nobody could see is left to chance, and nothing of it is lost: in a dark closed box that emits, light
/// after two scatterings and more is 1.1 % of all, and most of it is below threshold.
#[test]
fn pruned_light_is_not_lost() {
    const ALBEDO: f32 = 0.1;
    let ray = Ray::new(vec3a(0.3, -0.2, 0.1), vec3a(0.48, 0.6, 0.64));
    let tracer_of = |prune| {
        let mut scene: Scene = empty_scene();
        let material = add_material(&mut scene, diffuse(ALBEDO), Vec3::ONE);
        for [across, up] in [[Vec3::X, Vec3::Y], [Vec3::Y, Vec3::Z], [Vec3::Z, Vec3::X]] {
            for side in [-1.0, 1.0] {
                let corner = side * across.cross(up) - across - up;
                add_rectangle(&mut scene, corner, 2.0 * across, 2.0 * up, material);
            }
        }
        PathTracer::new(Arc::new(scene), TraceSettings { prune, ..trace_settings(16, 16, 0) })
    };
    let (pruned, whole) = (tracer_of(Some(Pruning { nits_per_unit: 100.0 })), tracer_of(None));
    let [(mean, error), (expected, other)] = [&pruned, &whole].map(|tracer| radiance_along(tracer, ray, 16, 16384));
    let error = error.x.hypot(other.x);
    println!("{} and {}, ± {error}", mean.x, expected.x);
    assert!((mean.x - expected.x).abs() < 3.3 * error, "{} for {}, ± {error}", mean.x, expected.x);
    assert!(error < 0.0001 * expected.x, "too noisy to test, ± {error}");
    assert!((expected.x * (1.0 - ALBEDO) - 1.0).abs() < 0.001, "{}", expected.x);
    let rays = |tracer: &PathTracer| -> u32 {
        block_key(0).samples(4096).map(|sample| tracer.trace_path(ray, sample).rays).sum()
    };
    let (some, all) = (rays(&pruned), rays(&whole));
    assert!(f64::from(some) < 0.95 * f64::from(all), "{some} of {all} rays");
}

/// A camera under water sees a lamp in the water through all of it, and one beyond its surface through what lies
/// between.
#[test]
fn a_camera_in_a_volume_sees_through_it() {
    let through = |lamp_at: f32| {
        let mut scene = empty_scene();
        let water = Surface::Dielectric {
            ior: 1.0,
            roughness: Roughness::SMOOTH,
            transmittance: ColorInput::constant(Vec3::ONE),
            absorption: Vec3::new(1.0, 0.5, 0.0),
        };
        let water = add_material(&mut scene, water, Vec3::ZERO);
        add_sphere(&mut scene, Vec3::Z * 5.0, 6.0, water);
        let lamp = add_material(&mut scene, diffuse(0.0), Vec3::ONE);
        add_sphere(&mut scene, Vec3::Z * (4.0 - lamp_at), 1.0, lamp);
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let ray = Ray::new(vec3a(0.0, 0.0, 5.0), vec3a(0.0, 0.0, -1.0));
        radiance_along(&tracer, ray, 4, 16).0
    };
    for (lamp_at, in_water) in [(4.0, 4.0_f32), (9.0, 6.0)] {
        let (found, expected) = (through(lamp_at), Vec3::new((-in_water).exp(), (-0.5 * in_water).exp(), 1.0));
        assert!(found.abs_diff_eq(expected, 1e-4), "lamp at {lamp_at}: {found}, expected {expected}");
    }
}

/// Pictures beyond [0, 1] reflect at most what comes in, and nothing below 0.
#[test]
fn reflectance_ends_at_nothing_and_all() {
    for (texel, expected) in [(3.0, 1.0), (-2.0, 0.0)] {
        let mut scene = empty_scene();
        scene.environment = constant_environment(1.0);
        scene.textures.push(Texture {
            name: "loud".to_owned(),
            width: 1,
            height: 1,
            texels: Texels::Floats(Arc::new(vec![[texel; 4]])),
            wrap_u: Wrap::Clamp,
            wrap_v: Wrap::Clamp,
            nearest: true,
        });
        let picture = ColorInput { factor: Vec3::ONE, texture: Some(TextureLookup::plain(TextureId(0))) };
        let material = add_material(&mut scene, Surface::Diffuse { reflectance: picture }, Vec3::ZERO);
        add_sphere(&mut scene, Vec3::ZERO, 1.0, material);
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let ray = Ray::new(vec3a(0.1, 0.2, 5.0), vec3a(0.0, 0.0, -1.0));
        let found = radiance_along(&tracer, ray, 4, 64).0.x;
        assert!((found - expected).abs() < 1e-4, "texel {texel}: {found}, expected {expected}");
    }
}

/// Layers over a volume's boundary are there, and return no more than comes in; without them clear glass returns
/// everything.
#[test]
fn layers_lie_over_volumes() {
    let returned = |clearcoat: f32, sheen: f32| {
        let tracer = sphere_in_furnace(Surface::MetalRoughness(MetalRoughness {
            roughness: ScalarInput::constant(0.0),
            transmission: ScalarInput::constant(1.0),
            volume: Some(Vec3::ZERO),
            clearcoat: ScalarInput::constant(clearcoat),
            sheen_color: ColorInput::constant(Vec3::splat(sheen)),
            sheen_roughness: ScalarInput::constant(0.5),
            ..MetalRoughness::default()
        }));
        radiance_along(&tracer, Ray::new(vec3a(0.8, 0.0, 5.0), Vec3A::NEG_Z), 16, 4096).0.x
    };
    let plain = returned(0.0, 0.0);
    assert!((plain - 1.0).abs() < 1e-3, "{plain}");
    for (clearcoat, sheen) in [(1.0, 0.0), (0.0, 1.0), (1.0, 0.5)] {
        let layered = returned(clearcoat, sheen);
        assert!((0.7..0.9995).contains(&layered), "coat {clearcoat}, sheen {sheen}: {layered}");
    }
}

/// A torus of 16 by 8 corners around the z axis with the normals of the smooth one.
fn coarse_torus() -> Mesh {
    const AROUND: u32 = 16;
    const ACROSS: u32 = 8;
    let turn = |number: u32, of: u32| (number as f32 / of as f32 * std::f32::consts::TAU).sin_cos();
    let mut mesh = Mesh { name: "torus".to_owned(), ..Mesh::default() };
    for (i, j) in (0..AROUND).flat_map(|i| (0..ACROSS).map(move |j| (i, j))) {
        let ((sin_a, cos_a), (sin_b, cos_b)) = (turn(i, AROUND), turn(j, ACROSS));
        let outwards = Vec3::new(cos_a, sin_a, 0.0);
        let normal = cos_b * outwards + sin_b * Vec3::Z;
        mesh.positions.push(0.7 * outwards + 0.32 * normal);
        mesh.normals.push(normal);
        let corner = |i: u32, j: u32| (i % AROUND) * ACROSS + j % ACROSS;
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// What reflects as a mirror, in whole or in part, loses little where normals between the corners turn away from flat
/// faces.
#[test]
fn silhouettes_of_smooth_meshes_lose_little() {
    let plastic = Surface::CoatedDiffuse {
        reflectance: ColorInput::constant(Vec3::ONE),
        ior: 1.5,
        roughness: Roughness::constant(0.0),
        saturates: true,
    };
    for (name, surface, least_mean, least) in [
        ("mirror", Surface::Mirror { reflectance: ColorInput::constant(Vec3::ONE) }, 0.999, 0.97),
        ("dielectric", Surface::clear_dielectric(1.5), 0.99, 0.65),
        ("plastic", plastic, 0.99, 0.9),
    ] {
        let mut scene = empty_scene();
        scene.environment = constant_environment(1.0);
        let material = add_material(&mut scene, surface, Vec3::ZERO);
        add_mesh(&mut scene, coarse_torus(), material);
        let tracer = PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0));
        let camera = vec3a(0.0, -3.0, 2.0);
        let across = vec3a(0.0, 2.0, 3.0).normalize();
        let values: Vec<f32> = (0..24 * 24)
            .map(|i| {
                let [x, y] = [i % 24, i / 24].map(|k| (k as f32 + 0.5) / 12.0 - 1.0);
                let target = 1.1 * (x * Vec3A::X + y * across);
                radiance_along(&tracer, Ray::new(camera, (target - camera).normalize()), 2, 128).0.x
            })
            .collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        let darkest = values.iter().copied().fold(1.0, f32::min);
        println!("{name}: {mean:.4}, at darkest {darkest:.3}");
        assert!(mean > least_mean && mean < 1.005 && darkest > least, "{name}: {mean}, at darkest {darkest}");
    }
}
