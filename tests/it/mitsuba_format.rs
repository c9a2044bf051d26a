//! What Mitsuba's files mean; figures are those of Mitsuba 3.9.

use crate::support::{has_note, write_and_load};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, Material, Scene, Surface};
use glam::{Vec2, Vec3};
use std::path::Path;

pub(crate) const LIGHT: &str = r#"<emitter type="constant"/>"#;
const SQUARE_OBJ: &str =
    "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
const BARE_OBJ: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
const SQUARE_PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
property float u\nproperty float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
0 0 0 0 0.25\n1 0 0 1 0.25\n0 1 0 0 1\n3 0 1 2\n";

/// A folder with two meshes and a picture that is green.
pub(crate) fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("square.obj"), SQUARE_OBJ).unwrap();
    std::fs::write(folder.path().join("bare.obj"), BARE_OBJ).unwrap();
    std::fs::write(folder.path().join("square.ply"), SQUARE_PLY).unwrap();
    image::RgbImage::from_pixel(2, 2, image::Rgb([0, 255, 0])).save(folder.path().join("green.png")).unwrap();
    folder
}

pub(crate) fn try_load(folder: &Path, version: &str, body: &str) -> Result<Scene, String> {
    write_and_load(&folder.join("scene.xml"), format!("<scene version=\"{version}\">{body}</scene>"))
}

pub(crate) fn scene(body: &str) -> Scene {
    try_load(folder().path(), "3.0.0", &format!("{LIGHT}{body}")).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn material(bsdf: &str) -> Material {
    let scene = scene(&format!(r#"<shape type="rectangle">{bsdf}</shape>"#));
    scene.materials[scene.instances[0].material.0 as usize].clone()
}

/// A sky's luminance is ours, in cd/m², whatever RGB 1 is taken as.
#[test]
fn skies_are_as_bright_at_every_unit() {
    let folder = folder();
    let path = folder.path().join("scene.xml");
    std::fs::write(&path, r#"<scene version="3.0.0"><emitter type="sky"/><shape type="rectangle"/></scene>"#).unwrap();
    let brightest_cd_m2 = |nits_per_unit: Option<f64>| {
        let scene = load(&path, &LoadOptions { nits_per_unit, ..LoadOptions::default() }).unwrap();
        let sky = scene.environment.as_ref().unwrap();
        let largest = sky.texels.iter().map(|texel| texel.max_element()).fold(0.0, f32::max);
        f64::from(largest * sky.scale) * scene.nits_per_unit
    };
    let (assumed, asked) = (brightest_cd_m2(None), brightest_cd_m2(Some(7.0)));
    assert!((asked / assumed - 1.0).abs() < 1e-5, "{assumed} {asked}");
}

/// Mitsuba 3.9 warns of it and makes a sphere of the scale of x.
#[test]
fn a_sphere_that_is_scaled_unevenly_is_told() {
    let scaled = |scale: &str| {
        scene(&format!(r#"<shape type="sphere"><transform name="to_world"><scale {scale}/></transform></shape>"#))
    };
    assert!(has_note(&scaled(r#"x="1" y="3" z="2""#), "an ellipsoid"));
    assert!(!has_note(&scaled(r#"value="2""#), "an ellipsoid"));
}

#[test]
fn bsdfs_inside_others_keep_their_order() {
    let dark = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.1"/></bsdf>"#;
    let blend = r#"<bsdf type="diffuse" id="light"><rgb name="reflectance" value="0.9"/></bsdf>"#;
    let scene = scene(&format!(
        r#"{blend}<shape type="rectangle"><bsdf type="blendbsdf"><float name="weight" value="0.25"/><ref id="light"/>{dark}</bsdf></shape>"#
    ));
    let Surface::Mix { first, .. } = &scene.materials[0].surface else { panic!("{:?}", scene.materials[0]) };
    let Surface::Diffuse { reflectance } = **first else { panic!("{first:?}") };
    assert_eq!(reflectance.factor, Vec3::splat(0.9));
}

#[test]
fn what_never_ends_is_refused() {
    let folder = folder();
    let refused = |body: &str| try_load(folder.path(), "3.0.0", body).unwrap_err();
    let itself = r#"<texture type="checkerboard" id="a"><ref name="color0" id="a"/></texture>
<shape type="rectangle"><bsdf type="diffuse"><ref name="reflectance" id="a"/></bsdf></shape>"#;
    assert!(refused(itself).contains("scene.xml:1: <texture>: textures are nested too deeply, or one uses itself"));
    let white = r#"<shape type="rectangle"><bsdf type="diffuse"><spectrum name="reflectance" type="d65" id="a"><ref name="color" id="a"/></spectrum></bsdf></shape>"#;
    assert!(refused(white).contains("textures are nested too deeply, or one uses itself"));
    let in_turn = r#"<texture type="checkerboard" id="a"><spectrum name="color0" type="d65"><ref name="color" id="a"/></spectrum></texture>
<shape type="rectangle"><bsdf type="diffuse"><ref name="reflectance" id="a"/></bsdf></shape>"#;
    assert!(refused(in_turn).contains("textures are nested too deeply, or one uses itself"));
    let mut defaults = r#"<default name="v0" value="0123456789"/>"#.to_owned();
    for n in 1..30 {
        let last = format!("$v{}", n - 1);
        defaults += &format!(r#"<default name="v{n}" value="{last}{last}{last}"/>"#);
    }
    assert!(refused(&defaults).contains("with its values in place"));
}

#[test]
fn metals_have_the_versions_defaults() {
    assert!(matches!(material(r#"<bsdf type="conductor"/>"#).surface, Surface::Mirror { .. }));
    let eta = r#"<bsdf type="conductor"><rgb name="eta" value="0.2,0.9,1.1"/></bsdf>"#;
    let Surface::Conductor { k, .. } = material(eta).surface else { panic!("a metal") };
    assert_eq!(k, Vec3::ONE);
    let old = format!(r#"{LIGHT}<shape type="rectangle"><bsdf type="conductor"/></shape>"#);
    let old = try_load(folder().path(), "0.5.0", &old).unwrap();
    assert!(matches!(old.materials[0].surface, Surface::Conductor { .. }));
}

/// Oren and Nayar's B/A for slopes of α/√2 radians, not α.
#[test]
fn rough_diffuse_is_as_rough_as_in_mitsuba() {
    for (alpha, ratio) in [("0", 0.0), ("0.2", 0.0842), ("0.7", 0.4182)] {
        let bsdf = format!(r#"<bsdf type="roughdiffuse"><float name="alpha" value="{alpha}"/></bsdf>"#);
        let Surface::OrenNayar { roughness, .. } = material(&bsdf).surface else { panic!("clay") };
        assert!((roughness.factor - ratio).abs() < 1e-4, "alpha {alpha}: {}", roughness.factor);
    }
}

#[test]
fn principled_glass_refracts_and_thin_does_not() {
    for (kind, refracts) in [("principled", true), ("principledthin", false)] {
        let bsdf = format!(r#"<bsdf type="{kind}"><float name="spec_trans" value="1"/></bsdf>"#);
        assert_eq!(material(&bsdf).surface.interior_absorption().is_some(), refracts, "{kind}");
    }
}

/// A body of base colour 0.25 lets through 0.25, so each of its two crossings half.
#[test]
fn principled_glass_is_tinted_by_the_root_of_its_colour() {
    let glass = |parameters: &str| {
        let scene = scene(&format!(r#"<shape type="rectangle"><bsdf type="principled">{parameters}</bsdf></shape>"#));
        let (share, boundary) = match &scene.materials[0].surface {
            Surface::Mix { second, amount, .. } => (amount.factor, second.as_ref()),
            surface => (1.0, surface),
        };
        let Surface::Dielectric { transmittance, .. } = boundary else { panic!("{boundary:?}") };
        (share, transmittance.evaluate(&scene.textures, Vec2::splat(0.5)))
    };
    let all = r#"<float name="spec_trans" value="1"/>"#;
    let grey = r#"<rgb name="base_color" value="0.25"/>"#;
    assert_eq!(glass(&format!("{all}{grey}")), (1.0, Vec3::splat(0.5)));
    let part = r#"<float name="spec_trans" value="0.5"/><float name="metallic" value="0.5"/>"#;
    assert_eq!(glass(&format!("{part}{grey}")), (0.25, Vec3::splat(0.5)));
    let picture = r#"<texture name="base_color" type="checkerboard"><rgb name="color0" value="0.25"/>
<rgb name="color1" value="0.25"/></texture>"#;
    assert_eq!(glass(&format!("{all}{picture}")), (1.0, Vec3::splat(0.5)));
}

#[test]
fn masks_and_blends_cover_what_they_should() {
    let plain = r#"<bsdf type="diffuse"/>"#;
    let covers = |bsdf: &str| match material(bsdf).alpha {
        Alpha::Blend { value } => value.factor,
        other => panic!("{other:?}"),
    };
    assert_eq!(covers(&format!(r#"<bsdf type="mask">{plain}</bsdf>"#)), 0.5);
    let unseen = format!(r#"<bsdf type="mask"><float name="opacity" value="0"/>{plain}</bsdf>"#);
    assert_eq!(
        covers(&format!(r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/>{unseen}{plain}</bsdf>"#)),
        0.25
    );
    assert_eq!(
        covers(&format!(
            r#"<bsdf type="blendbsdf"><float name="weight" value="0.25"/>{plain}<bsdf type="null"/></bsdf>"#
        )),
        0.75
    );
    let mask = |opacity: f32, inner: &str| {
        format!(r#"<bsdf type="mask"><float name="opacity" value="{opacity}"/>{inner}</bsdf>"#)
    };
    assert_eq!(covers(&mask(0.25, &mask(0.5, plain))), 0.125);
    let half_there =
        format!(r#"<bsdf type="blendbsdf"><float name="weight" value="0.5"/><bsdf type="null"/>{plain}</bsdf>"#);
    assert_eq!(covers(&mask(0.25, &half_there)), 0.125);
}

/// What a masked emitter sends out on average is what Mitsuba says, whatever its opacity.
#[test]
fn a_masked_emitter_shines_in_full() {
    let emission = |bsdf: &str| {
        let body = format!(
            r#"<shape type="rectangle">{bsdf}<emitter type="area"><rgb name="radiance" value="1,2,3"/></emitter></shape>"#
        );
        let scene = try_load(folder().path(), "3.0.0", &body).unwrap_or_else(|error| panic!("{error}"));
        let material = &scene.materials[0];
        material.emission.factor * material.alpha.coverage(&scene.textures, Vec2::ZERO)
    };
    let whole = emission(r#"<bsdf type="diffuse"/>"#);
    let masked = emission(r#"<bsdf type="mask"><float name="opacity" value="0.25"/><bsdf type="diffuse"/></bsdf>"#);
    assert!(whole.x > 0.0 && masked.abs_diff_eq(whole, 1e-6 * whole.x), "{masked}, not {whole}");
}

#[test]
fn a_mesh_of_a_file_has_a_whole_number() {
    let load = |number: &str| {
        let index = format!(r#"<integer name="shape_index" value="{number}"/>"#);
        let shape = format!(r#"<shape type="obj"><string name="filename" value="square.obj"/>{index}</shape>"#);
        try_load(folder().path(), "3.0.0", &format!("{LIGHT}{shape}"))
    };
    assert!(load("0").is_ok());
    for wrong in ["-1", "1.5"] {
        let error = load(wrong).unwrap_err();
        assert!(error.contains(&format!("must be a whole number from 0 on, not {wrong}")), "{error}");
    }
}

/// As in Mitsuba 3: what shines and has no BSDF reflects nothing, all else without one is 50 % grey.
#[test]
fn a_lamp_without_a_bsdf_is_black() {
    for (inside, albedo) in [(r#"<emitter type="area"/>"#, 0.0), ("", 0.5)] {
        let Surface::Diffuse { reflectance } = material(inside).surface else { panic!("{inside}: not diffuse") };
        assert_eq!(reflectance.factor, Vec3::splat(albedo), "{inside}");
    }
}

#[test]
fn a_lamp_of_nothing_lets_light_through() {
    let lamp = material(r#"<emitter type="area"/><bsdf type="null"/>"#);
    assert_eq!(lamp.emission.factor, Vec3::ONE);
    assert!(matches!(lamp.surface, Surface::ThinDielectric { ior: 1.0, .. }), "{:?}", lamp.surface);
}

#[test]
fn includes_are_elements_and_know_their_folder() {
    let folder = folder();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    let shape = r#"<shape type="obj"><string name="filename" value="square.obj"/></shape>"#;
    std::fs::write(inner.join("alone.xml"), shape).unwrap();
    std::fs::write(inner.join("scene.xml"), format!("<scene version=\"3.0.0\">{shape}</scene>")).unwrap();
    for name in ["alone", "scene"] {
        let body = format!(r#"{LIGHT}<include filename="inner/{name}.xml"/>"#);
        let scene = try_load(folder.path(), "3.0.0", &body).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(scene.instances.len(), 1, "{name}");
    }
}

/// Relative to the file that they stand in; the last one is searched first.
#[test]
fn files_are_found_in_the_folders_of_path() {
    let folder = folder();
    for (place, name) in [("far/meshes", "a.obj"), ("far/last", "a.obj"), ("far", "part.xml")] {
        let place = folder.path().join(place);
        std::fs::create_dir_all(&place).unwrap();
        let far = r#"<path value="meshes"/><path value="last"/>"#;
        let shape = r#"<shape type="obj"><string name="filename" value="a.obj"/></shape>"#;
        let text = match name {
            "part.xml" => format!("<scene version=\"3.0.0\">{far}{shape}</scene>"),
            _ if place.ends_with("last") => BARE_OBJ.replace("f 1 3 4\n", ""),
            _ => BARE_OBJ.to_owned(),
        };
        std::fs::write(place.join(name), text).unwrap();
    }
    let include = format!(r#"{LIGHT}<path value="far"/><include filename="part.xml"/>"#);
    let scene = try_load(folder.path(), "3.0.0", &include).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    let missing = r#"<path value="far"/><shape type="obj"><string name="filename" value="none.obj"/></shape>"#;
    let error = try_load(folder.path(), "3.0.0", missing).unwrap_err();
    let (far, here) = (folder.path().join("far/none.obj"), folder.path().join("none.obj"));
    let expected = format!("none.obj: no such file at {} or {}", far.display(), here.display());
    assert!(error.ends_with(&expected), "{error}");
}

/// Mitsuba knows no groups, materials or smoothing groups of OBJ files: normals are smooth across all of them.
#[test]
fn normals_are_smooth_across_groups() {
    let folder = folder();
    let roof = "v 0 0 0\nv 0 1 0\nv 1 0 1\nv 1 1 1\nv 2 0 0\nv 2 1 0\n";
    for divider in ["", "g b\n", "o b\n", "usemtl b\n", "s off\n"] {
        std::fs::write(folder.path().join("roof.obj"), format!("{roof}s 1\nf 1 3 4 2\n{divider}f 3 5 6 4\n")).unwrap();
        let shape = r#"<shape type="obj"><string name="filename" value="roof.obj"/></shape>"#;
        let scene = try_load(folder.path(), "3.0.0", &format!("{LIGHT}{shape}")).unwrap();
        let mesh = &scene.meshes[0];
        assert_eq!((scene.meshes.len(), mesh.positions.len()), (1, 6), "{divider}");
        let ridge = mesh.positions.iter().zip(&mesh.normals).filter(|(place, _)| place.z == 1.0);
        ridge.for_each(|(_, normal)| assert!(normal.abs_diff_eq(Vec3::Z, 1e-3), "{divider}: {normal}"));
    }
}

/// Without normals in the file the front is where the corners are seen counter-clockwise in the world.
#[test]
fn mirrors_turn_meshes_without_normals_over() {
    let turned = |shape: &str| {
        let scene = scene(&format!(
            r#"<shape {shape}<transform name="to_world"><scale x="-1"/></transform><emitter type="area"/></shape>"#
        ));
        let [a, b, c] = scene.meshes[0].triangles[0].map(|index| scene.meshes[0].positions[index as usize]);
        (b - a).cross(c - a).z < 0.0
    };
    assert!(turned(r#"type="obj"><string name="filename" value="bare.obj"/>"#));
    assert!(!turned(r#"type="rectangle">"#));
    let sphere = scene(
        r#"<shape type="sphere"><transform name="to_world"><scale x="-1"/></transform><emitter type="area"/></shape>"#,
    );
    assert!(sphere.spheres.is_empty(), "an analytic sphere shines outwards");
}

#[test]
fn groups_inside_their_instance_are_placed() {
    let group = r#"<shape type="instance"><shape type="shapegroup"><shape type="rectangle"/></shape></shape>"#;
    assert_eq!(scene(group).instances.len(), 1);
}

/// As in Mitsuba, in whichever order they stand.
#[test]
fn groups_inside_groups_are_refused() {
    let inner = r#"<shape type="shapegroup" id="inner"><shape type="rectangle"/></shape>"#;
    let outer = r#"<shape type="shapegroup" id="outer"><shape type="instance"><ref id="inner"/></shape></shape>"#;
    for body in [format!("{inner}{outer}"), format!("{outer}{inner}")] {
        let error = try_load(folder().path(), "3.0.0", &format!("{LIGHT}{body}")).unwrap_err();
        assert!(error.contains("a group inside a group is not rendered"), "{error}");
    }
}

#[test]
fn instances_place_groups_and_nothing_else() {
    let of_others = r#"<shape type="sphere" id="ball"/><bsdf type="diffuse" id="red"/>"#;
    for inside in ["", r#"<ref id="ball"/>"#, r#"<ref id="red"/>"#, r#"<shape type="sphere"/>"#] {
        let body = format!(r#"{LIGHT}{of_others}<shape type="instance">{inside}</shape>"#);
        let error = try_load(folder().path(), "3.0.0", &body).unwrap_err();
        assert!(error.contains("an instance places a shapegroup and nothing else"), "{inside}: {error}");
    }
}

#[test]
fn what_groups_and_instances_do_not_use_is_named() {
    let nonsense = r#"<float name="nonsense" value="3"/>"#;
    let group = format!(r#"<shape type="shapegroup" id="g">{nonsense}<shape type="rectangle"/></shape>"#);
    let scene = scene(&format!(r#"{group}<shape type="instance"><ref id="g"/>{nonsense}</shape>"#));
    for kind in ["shapegroup", "instance"] {
        let note = format!("shape \"{kind}\": not used: nonsense.");
        assert!(has_note(&scene, &note), "{kind}: {:?}", scene.notes);
    }
}

/// 4,002,000 meshes out of 140 kB.
#[test]
fn groups_that_are_placed_many_times_are_counted() {
    let group = r#"<shape type="rectangle"/>"#.repeat(2001);
    let instances = r#"<shape type="instance"><ref id="g"/></shape>"#.repeat(2000);
    let body = format!(r#"{LIGHT}<shape type="shapegroup" id="g">{group}</shape>{instances}"#);
    let error = try_load(folder().path(), "3.0.0", &body).map(|scene| scene.instances.len()).unwrap_err();
    assert!(error.contains("more than 4000000 placed meshes"), "{error}");
}

#[test]
fn triangles_without_coordinates_have_barycentric_ones() {
    let picture = r#"<texture name="reflectance" type="bitmap"><string name="filename" value="green.png"/></texture>"#;
    let bare = r#"<shape type="obj"><string name="filename" value="bare.obj"/>"#;
    let textured = scene(&format!(r#"{bare}<bsdf type="diffuse">{picture}</bsdf></shape>"#));
    assert_eq!(textured.meshes[0].uvs[3..], [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert!(scene(&format!("{bare}</shape>")).meshes[0].uvs.is_empty());
}

#[test]
fn what_is_not_followed_is_named() {
    let hidden = r#"<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>"#;
    assert!(has_note(&scene(&format!(r#"{hidden}<shape type="rectangle"/>"#)), "hide_emitters"));
    let night = r#"<emitter type="sunsky"><vector name="sun_direction" x="1" y="0" z="-0.3"/></emitter>"#;
    let night = try_load(folder().path(), "3.0.0", &format!(r#"{night}<shape type="rectangle"/>"#)).unwrap();
    assert!(night.lights.is_empty() && has_note(&night, "below the horizon gives no light"), "{:?}", night.notes);
}
