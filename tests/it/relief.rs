//! Height maps: normals against closed forms, the same in every format, and no light lost or found.

use crate::support::{
    add_material, add_rectangle, add_sphere, block_key, constant_environment, diffuse, empty_scene, radiance_along,
    trace_settings,
};
use fechner::geometry::Ray;
use fechner::integrator::PathTracer;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{
    HeightMap, HeightUnit, Relief, Roughness, ScalarInput, Scene, Surface, Texels, Texture, TextureId, TextureLookup,
    Wrap,
};
use glam::{Vec2, Vec3, Vec3A, vec3a};
use std::path::Path;
use std::sync::Arc;

/// Heights that rise evenly along u from 0 at the left edge to 1 at the right one.
fn ramp() -> Texture {
    let width = 64;
    let texels = (0..width).map(|x| [(x as f32 + 0.5) / width as f32; 4]).collect();
    heights_of(width, 1, texels)
}

fn heights_of(width: u32, height: u32, texels: Vec<[f32; 4]>) -> Texture {
    let texels = Texels::Floats(Arc::new(texels));
    let name = "heights".to_owned();
    Texture { name, width, height, texels, wrap_u: Wrap::Clamp, wrap_v: Wrap::Clamp, nearest: false }
}

fn relief(height: f32, lookup: TextureLookup) -> Option<Relief> {
    let height = ScalarInput { factor: height, texture: Some((lookup, 0)) };
    Some(Relief::Heights(HeightMap { height, unit: HeightUnit::Scene }))
}

/// A square of 2 × 2 units around the origin that faces +z, in a furnace, with this relief.
fn plane(surface: Surface, texture: Texture, relief: Option<Relief>) -> Scene {
    let mut scene = empty_scene();
    scene.environment = constant_environment(1.0);
    let material = add_material(&mut scene, surface, Vec3::ZERO);
    scene.textures.push(texture);
    scene.materials[0].relief = relief;
    add_rectangle(&mut scene, Vec3::new(-1.0, -1.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Y, material);
    scene
}

fn tracer(scene: Scene) -> PathTracer {
    PathTracer::new(Arc::new(scene), trace_settings(16, 16, 0))
}

fn down_at(x: f32, y: f32) -> Ray {
    Ray::new(vec3a(x, y, 5.0), Vec3A::NEG_Z)
}

fn normal_at(tracer: &PathTracer, ray: Ray) -> Vec3 {
    let sample = block_key(0).samples(1).next().expect("one sample");
    tracer.trace_path(ray, sample).first_hit.normal
}

#[test]
fn a_ramp_turns_normals_by_its_slope() {
    let plain = TextureLookup::plain(TextureId(0));
    // Heights in scene units over 2 units of width; tiled three times along u and turned by 90°, it rises along v.
    let turned = TextureLookup { rotation: std::f32::consts::FRAC_PI_2, scale: Vec2::new(1.0, 3.0), ..plain };
    for (height, lookup, slope) in [
        (1.0, plain, Vec2::new(0.5, 0.0)),
        (-4.0, plain, Vec2::new(-2.0, 0.0)),
        (1.0, TextureLookup { scale: Vec2::splat(0.25), ..plain }, Vec2::new(0.125, 0.0)),
        (0.2, turned, Vec2::new(0.0, 0.3)),
    ] {
        let tracer = tracer(plane(diffuse(0.5), ramp(), relief(height, lookup)));
        let expected = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
        let normal = normal_at(&tracer, down_at(0.1, -0.5));
        assert!(normal.abs_diff_eq(expected, 1e-4), "height {height}, {lookup:?}: {normal}, expected {expected}");
    }
}

#[test]
fn even_heights_change_no_byte() {
    let flat = || heights_of(2, 2, vec![[0.7; 4]; 4]);
    for surface in [diffuse(0.8), Surface::conductor(Vec3::ONE, Vec3::splat(3.0), Roughness::constant(0.4))] {
        let smooth = tracer(plane(surface.clone(), flat(), None));
        let bumpy = tracer(plane(surface, flat(), relief(5.0, TextureLookup::plain(TextureId(0)))));
        for sample in block_key(0).samples(64) {
            let ray = down_at(0.3, 0.2);
            let [a, b] = [&smooth, &bumpy].map(|tracer| tracer.trace_path(ray, sample));
            assert_eq!(a.radiance.to_array().map(f32::to_bits), b.radiance.to_array().map(f32::to_bits));
            assert_eq!(a.first_hit, b.first_hit);
        }
    }
}

/// A white Lambert surface whose normal is turned by α sees, of its own hemisphere, what lies above the mesh:
/// (1 + cos α)/2 by the view factor of the lune. Within 0.5 % and 3.3 standard errors.
#[test]
fn turned_normals_lose_what_lies_below_the_surface_and_no_more() {
    for slope in [0.0_f32, 0.25, 1.0, 3.0] {
        let tracer = tracer(plane(diffuse(1.0), ramp(), relief(2.0 * slope, TextureLookup::plain(TextureId(0)))));
        let (mean, error) = radiance_along(&tracer, down_at(0.1, -0.5), 16, 2048);
        let expected = 0.5 * (1.0 + slope.atan().cos());
        let tolerance = 0.005 * expected + 3.3 * error.x;
        assert!((mean.x - expected).abs() < tolerance, "slope {slope}: {} ± {}, not {expected}", mean.x, error.x);
        assert!(error.x < 0.003, "slope {slope}: too noisy to test, ± {}", error.x);
    }
}

/// Steep random heights on a plane and a ball, seen from face on to grazing: nothing is NaN, brighter than the
/// furnace, or black.
#[test]
fn steep_heights_neither_shine_nor_go_black() {
    let noise = || {
        let texel = |i: u32| [(f64::from(i) * 0.618_033_988_749_895).fract() as f32; 4];
        heights_of(16, 16, (0..256).map(texel).collect())
    };
    let shiny = Surface::conductor(Vec3::ONE, Vec3::splat(1e4), Roughness::constant(0.3));
    for surface in [diffuse(1.0), shiny] {
        let mut scene = plane(surface, noise(), relief(0.5, TextureLookup::plain(TextureId(0))));
        add_sphere(&mut scene, Vec3::new(3.0, 0.0, 0.0), 1.0, fechner::scene::MaterialId(0));
        let tracer = tracer(scene);
        for (target, from) in [
            (vec3a(0.13, 0.27, 0.0), vec3a(0.0, 0.0, 5.0)),
            (vec3a(-0.4, 0.6, 0.0), vec3a(-5.0, 0.5, 0.3)),
            (vec3a(3.0, 0.0, 0.0), vec3a(3.0, 0.0, 5.0)),
            (vec3a(3.0, 0.99, 0.0), vec3a(3.0, 0.995, 5.0)),
            // A pole, where u spans nothing.
            (vec3a(3.0, 1.0, 0.0), vec3a(3.0, 5.0, 0.0)),
        ] {
            let ray = Ray::new(from, (target - from).normalize());
            let (mean, error) = radiance_along(&tracer, ray, 4, 1024);
            assert!(mean.is_finite(), "{mean}");
            assert!(mean.x < 1.0 + 0.005 + 4.0 * error.x && mean.x > 0.05, "towards {target}: {mean} ± {error}");
        }
    }
}

/// On a ball, heights that fall from pole to pole turn normals towards the south: by the slope over half its girth.
#[test]
fn balls_have_reliefs() {
    let mut scene = empty_scene();
    let material = add_material(&mut scene, diffuse(0.5), Vec3::ZERO);
    let turn = TextureLookup { rotation: -std::f32::consts::FRAC_PI_2, ..TextureLookup::plain(TextureId(0)) };
    // Turned so that the picture's u is −v of the ball, between −1 and 0; the offset brings it back.
    scene.textures.push(ramp());
    scene.materials[0].relief = relief(1.0, TextureLookup { offset: Vec2::X, ..turn });
    add_sphere(&mut scene, Vec3::ZERO, 2.0, material);
    let normal = normal_at(&tracer(scene), down_at(0.0, 0.0));
    let slope = 1.0 / (2.0 * std::f32::consts::PI);
    // The heights are largest at the north pole: at the equator the surface looks south.
    assert!(normal.abs_diff_eq(Vec3::new(0.0, -slope, 1.0).normalize(), 1e-3), "{normal}");
}

/// The same ramp, slope and place in four formats: the same normal.
#[test]
fn every_format_reads_heights() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let picture = |name: &str, colour: &dyn Fn(u32) -> [u8; 3]| {
        let picture = image::RgbImage::from_fn(256, 2, |x, _| image::Rgb(colour(x)));
        picture.save(folder.path().join(name)).unwrap();
    };
    picture("ramp.png", &|x| [x as u8; 3]);
    // Normals of a ridge: its right half rises to the right.
    picture("normals.png", &|x| [if x < 128 { 218 } else { 38 }, 128, 218]);
    write(
        "a.toml",
        r#"
[[lights]]
type = "point"
position = [0, 0, 5]
intensity_cd = 100
[textures.ramp]
file = "ramp.png"
[materials.m]
type = "diffuse"
reflectance = [0.5, 0.5, 0.5]
bump_map = { texture = "ramp", height = 2.0 }
[[objects]]
mesh = "quad.obj"
material = "m"
"#,
    );
    let quad = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    write("quad.obj", &format!("{quad}f 1/1 2/2 3/3 4/4\n"));
    write("a.obj", &format!("mtllib a.mtl\n{quad}usemtl m\nf 1/1 2/2 3/3 4/4\n"));
    write("a.mtl", "newmtl m\nKd .5 .5 .5\nmap_bump -bm 50 ramp.png\n");
    write("b.obj", &format!("mtllib b.mtl\n{quad}usemtl m\nf 1/1 2/2 3/3 4/4\n"));
    write("b.mtl", "newmtl m\nKd .5 .5 .5\nmap_Bump -bm 1 normals.png\n");
    write(
        "a.pbrt",
        r#"WorldBegin
Texture "ramp" "float" "imagemap" "string filename" "ramp.png" "string encoding" "linear"
Texture "high" "float" "scale" "texture tex" "ramp" "float scale" 2
Material "diffuse" "texture displacement" "high"
Shape "trianglemesh" "point3 P" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] "point2 uv" [0 0 1 0 1 1 0 1] "integer indices" [0 1 2 0 2 3]
"#,
    );
    write(
        "a.xml",
        r#"<scene version="3.0.0"><shape type="rectangle"><bsdf type="bumpmap">
<texture type="bitmap" name="any"><string name="filename" value="ramp.png"/><boolean name="raw" value="true"/></texture>
<float name="scale" value="2"/><bsdf type="diffuse"/></bsdf></shape></scene>"#,
    );
    // A slope of 256/255, and for the normal map its own value.
    let expected = Vec3::new(-256.0 / 255.0, 0.0, 1.0).normalize();
    for file in ["a.toml", "a.obj", "b.obj", "a.pbrt", "a.xml"] {
        let scene = load(&folder.path().join(file), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(scene.notes.iter().all(|note| !note.contains("not rendered")), "{file}: {:?}", scene.notes);
        let normal = normal_at(&tracer(scene), down_at(0.11, 0.3));
        assert!(normal.abs_diff_eq(expected, 0.01), "{file}: {normal}, expected {expected}");
    }
}

#[test]
fn a_height_map_needs_a_height_and_no_normal_map_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    for (relief, said) in [
        ("bump_map = { texture = \"t\" }", "height"),
        (
            "bump_map = { texture = \"t\", height = 1 }\nnormal_map = { texture = \"t\" }",
            "either a normal_map or a bump_map",
        ),
    ] {
        let path = folder.path().join("a.toml");
        let text = format!("[textures.t]\nfile = \"t.png\"\n[materials.m]\ntype = \"mirror\"\n{relief}\n");
        std::fs::write(&path, text).unwrap();
        let error = load(Path::new(&path), &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("a.toml:") && error.contains(said), "{error}");
    }
}
