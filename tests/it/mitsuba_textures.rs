//! Colours, numbers, pictures and spectra of Mitsuba's files; figures are those of Mitsuba 3.9.

use crate::mitsuba_format::{LIGHT, folder, material, scene, try_load};
use crate::support::has_note;
use fechner::scene::{Alpha, Surface};
use glam::{Vec2, Vec3};

/// v = 0 is the picture's first row; OBJ alone is turned over, unless it says otherwise.
#[test]
fn pictures_lie_as_mitsuba_lays_them() {
    let uv = |shape: &str, x: f32, y: f32| {
        let scene = scene(shape);
        let mesh = &scene.meshes[0];
        mesh.uvs[mesh.positions.iter().position(|p| p.abs_diff_eq(Vec3::new(x, y, 0.0), 1e-6)).unwrap()]
    };
    let file = |kind: &str, flip: &str| {
        let flip = if flip.is_empty() {
            String::new()
        } else {
            format!(r#"<boolean name="flip_tex_coords" value="{flip}"/>"#)
        };
        format!(r#"<shape type="{kind}"><string name="filename" value="square.{kind}"/>{flip}</shape>"#)
    };
    assert_eq!(uv(r#"<shape type="rectangle"/>"#, -1.0, -1.0), Vec2::ZERO);
    assert_eq!(uv(&file("obj", ""), -1.0, -1.0), Vec2::Y);
    assert_eq!(uv(&file("obj", "False"), -1.0, -1.0), Vec2::ZERO);
    assert_eq!(uv(&file("ply", ""), 0.0, 0.0), Vec2::new(0.0, 0.25));
    assert_eq!(uv(&file("ply", "true"), 0.0, 0.0), Vec2::new(0.0, 0.75));
}

#[test]
fn texture_transforms_are_followed() {
    let lookup = |transform: &str| {
        let picture = r#"<string name="filename" value="green.png"/>"#;
        let texture = format!(r#"<texture name="reflectance" type="bitmap">{picture}{transform}</texture>"#);
        let Surface::Diffuse { reflectance } = material(&format!(r#"<bsdf type="diffuse">{texture}</bsdf>"#)).surface
        else {
            panic!("diffuse")
        };
        reflectance.texture.unwrap()
    };
    let at = Vec2::new(0.3, 0.2);
    let old = r#"<float name="vscale" value="2"/><float name="uoffset" value="0.5"/>"#;
    assert!(lookup(old).transform(at).abs_diff_eq(Vec2::new(0.8, 0.4), 1e-6));
    let turned = r#"<transform name="to_uv"><rotate z="1" angle="90"/><translate x="1"/></transform>"#;
    assert!(lookup(turned).transform(at).abs_diff_eq(Vec2::new(0.8, 0.3), 1e-6));
    let mirrored = r#"<transform name="to_uv"><scale x="1" y="-2"/><rotate z="1" angle="30"/></transform>"#;
    let (sin, cos) = 30_f32.to_radians().sin_cos();
    let expected = Vec2::new(cos * at.x + 2.0 * sin * at.y, sin * at.x - 2.0 * cos * at.y);
    assert!(lookup(mirrored).transform(at).abs_diff_eq(expected, 1e-6));
}

#[test]
fn a_checkerboards_first_colour_is_its_first_square() {
    let scene = scene(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<rgb name="color0" value="0.9"/><rgb name="color1" value="0.1"/></texture></bsdf></shape>"#,
    );
    for (uv, expected) in [([0.2, 0.2], 0.9), ([0.7, 0.2], 0.1), ([0.2, 0.7], 0.1), ([0.7, 0.7], 0.9)] {
        assert_eq!(scene.textures[0].sample_rgba(Vec2::from_array(uv)).x, expected, "{uv:?}");
    }
}

/// Where a number is asked for, Mitsuba exchanges them since version 2.
#[test]
fn a_checkerboard_of_numbers_begins_with_its_second() {
    let squares = r#"<texture name="opacity" type="checkerboard"><float name="color0" value="1"/><float name="color1" value="0"/></texture>"#;
    let shape = format!(r#"<shape type="rectangle"><bsdf type="mask">{squares}<bsdf type="diffuse"/></bsdf></shape>"#);
    for (version, expected) in [("3.0.0", 0.0), ("0.6.0", 1.0)] {
        let scene = try_load(folder().path(), version, &format!("{LIGHT}{shape}")).unwrap();
        assert_eq!(scene.textures[0].sample_rgba(Vec2::splat(0.2)).x, expected, "{version}");
    }
}

/// A colour where a number is asked for is the mean of its channels, as in Mitsuba.
#[test]
fn colours_for_numbers_are_their_mean() {
    let alpha_of = |opacity: &str| {
        let scene = scene(&format!(
            r#"<shape type="rectangle"><bsdf type="mask">{opacity}<bsdf type="diffuse"/></bsdf></shape>"#
        ));
        let Alpha::Blend { value } = scene.materials[0].alpha else { panic!("{:?}", scene.materials[0].alpha) };
        value.evaluate(&scene.textures, Vec2::splat(0.2))
    };
    let plain = alpha_of(r#"<rgb name="opacity" value="0.9, 0.2, 0.1"/>"#);
    let squares = alpha_of(
        r#"<texture name="opacity" type="checkerboard"><rgb name="color0" value="0"/><rgb name="color1" value="0.9, 0.2, 0.1"/></texture>"#,
    );
    assert!((plain - 0.4).abs() < 1e-6 && (squares - 0.4).abs() < 1e-6, "{plain} {squares}");
}

#[test]
fn what_lies_beyond_a_picture_is_told_where_it_is_not_rendered() {
    let of_mode = |mode: &str| {
        scene(&format!(
            r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<string name="filename" value="green.png"/><string name="wrap_mode" value="{mode}"/></texture></bsdf></shape>"#
        ))
    };
    for (mode, told) in [("clamp", false), ("zero", true), ("one", true)] {
        assert_eq!(has_note(&of_mode(mode), "wrap modes zero and one are not rendered"), told, "{mode}");
    }
}

/// What ends at 1 is a picture times its scale: the scale was cut to 1 first.
#[test]
fn pictures_may_be_scaled_by_more_than_1() {
    let doubled = |name: &str| {
        let picture = r#"<texture type="bitmap"><string name="filename" value="green.png"/></texture>"#;
        format!(r#"<texture name="{name}" type="scale"><float name="scale" value="2"/>{picture}</texture>"#)
    };
    let surface = |kind: &str, name: &str| {
        let shape = format!(r#"<shape type="rectangle"><bsdf type="{kind}">{}</bsdf></shape>"#, doubled(name));
        try_load(folder().path(), "0.6.0", &format!("{LIGHT}{shape}")).unwrap().materials.remove(0).surface
    };
    let Surface::Conductor { roughness, .. } = surface("roughconductor", "alpha") else { panic!("a metal") };
    assert!(roughness.u.texture.is_some() && (roughness.u.factor - 2.0).abs() < 1e-5, "{roughness:?}");
    for name in ["baseColor", "metallic", "roughness"] {
        let Surface::MetalRoughness(model) = surface("principled", name) else { panic!("principled") };
        let factor = match name {
            "baseColor" => model.base_color.factor.x,
            "metallic" => model.metallic.factor,
            _ => model.roughness.factor,
        };
        assert!((factor - 2.0).abs() < 1e-5, "{name}: {factor}");
    }
}

#[test]
fn a_picture_of_colour_and_opacity_is_decoded_once() {
    let folder = folder();
    image::RgbaImage::from_pixel(2, 2, image::Rgba([0, 255, 0, 128])).save(folder.path().join("leaf.png")).unwrap();
    let picture = |name: &str| {
        format!(r#"<texture name="{name}" type="bitmap"><string name="filename" value="leaf.png"/></texture>"#)
    };
    let (color, opacity) = (picture("reflectance"), picture("opacity"));
    let body = format!(
        r#"{LIGHT}<shape type="rectangle"><bsdf type="mask"><bsdf type="diffuse">{color}</bsdf>{opacity}</bsdf></shape>"#
    );
    let scene = try_load(folder.path(), "0.5.0", &body).unwrap_or_else(|error| panic!("{error}"));
    let Alpha::Blend { value } = scene.materials[0].alpha else { panic!("a mask") };
    assert_eq!((scene.textures.len(), value.texture.map(|(_, channel)| channel)), (1, Some(3)));
    // Mitsuba 3 takes the colours' luminance.
    let scene = try_load(folder.path(), "3.0.0", &body).unwrap_or_else(|error| panic!("{error}"));
    let Alpha::Blend { value } = scene.materials[0].alpha else { panic!("a mask") };
    assert!((value.evaluate(&scene.textures, Vec2::splat(0.5)) - 0.7152).abs() < 1e-4);
    assert!(has_note(&scene, "its alpha is not used"), "{:?}", scene.notes);
}

/// Green is bright: a number from a picture is its luminance.
#[test]
fn numbers_from_pictures_are_luminances() {
    let scene = scene(
        r#"<shape type="rectangle"><bsdf type="mask"><bsdf type="diffuse"/>
<texture name="opacity" type="bitmap"><string name="filename" value="green.png"/></texture></bsdf></shape>"#,
    );
    let Alpha::Blend { value } = scene.materials[0].alpha else { panic!("a mask") };
    assert!((value.evaluate(&scene.textures, Vec2::splat(0.5)) - 0.7152).abs() < 1e-4);
}

/// Space around a value is none of it.
#[test]
fn colours_in_hexadecimal_digits_are_decoded_once() {
    for value in ["#808080", " #808080", "#808080\t"] {
        let colour = format!(r#"<bsdf type="diffuse"><srgb name="reflectance" value="{value}"/></bsdf>"#);
        let Surface::Diffuse { reflectance } = material(&colour).surface else { panic!("diffuse") };
        let reflectance = reflectance.evaluate(&[], Vec2::ZERO).x;
        assert!((reflectance - 0.21586).abs() < 1e-5, "{value:?}: {reflectance}");
    }
}

#[test]
fn flat_light_is_the_equal_energy_white() {
    let radiance = |version: &str, spectrum: &str| {
        let emitter = format!(r#"<emitter type="constant">{spectrum}</emitter><shape type="rectangle"/>"#);
        let scene = try_load(folder().path(), version, &emitter).unwrap_or_else(|error| panic!("{error}"));
        scene.environment.unwrap().radiance(Vec3::Y)
    };
    let flat = r#"<spectrum name="radiance" value="2"/>"#;
    assert!(radiance("3.0.0", flat).abs_diff_eq(2.0 * Vec3::new(1.205, 0.949, 0.909), 2e-3));
    assert_eq!(radiance("0.5.0", flat), Vec3::splat(2.0));
    let day = r#"<spectrum name="radiance" type="d65"><float name="scale" value="3"/></spectrum>"#;
    assert_eq!(radiance("3.0.0", day), Vec3::splat(3.0));
}

/// Figures of Mitsuba 3.9, `scalar_spectral` at 2048 samples, which differ from ours by less than 0.1 %.
#[test]
fn spectra_of_mitsuba_3_are_read() {
    let radiance = |spectrum: &str| {
        let emitter = format!(r#"<emitter type="constant">{spectrum}</emitter><shape type="rectangle"/>"#);
        try_load(folder().path(), "3.0.0", &emitter).map(|scene| scene.environment.unwrap().radiance(Vec3::Y))
    };
    let spectrum = |kind: &str, inside: &str| format!(r#"<spectrum name="radiance" type="{kind}">{inside}</spectrum>"#);
    let regular = |last: f32| {
        let inside = format!(
            r#"<float name="wavelength_min" value="400"/><float name="wavelength_max" value="{last}"/>
<string name="values" value="0.1, 0.4, 1"/>"#
        );
        spectrum("regular", &inside)
    };
    let irregular_at = |wavelengths: &str, values: &str| {
        let wavelengths = format!(r#"<string name="wavelengths" value="{wavelengths}"/>"#);
        spectrum("irregular", &format!(r#"{wavelengths}<string name="values" value="{values}"/>"#))
    };
    let irregular = |values: &str| irregular_at("400, 500, 600, 700", values);
    let between = |ends: &[(&str, f32)]| {
        let ends: String =
            ends.iter().map(|(end, nm)| format!(r#"<float name="wavelength_{end}" value="{nm}"/>"#)).collect();
        spectrum("blackbody", &format!(r#"<float name="temperature" value="5000"/>{ends}"#))
    };
    let warm = spectrum("blackbody", r#"<float name="temperature" value="3000"/>"#);
    for (spectrum, expected) in [
        (regular(700.0), Vec3::new(0.8729, 0.3747, 0.1542)),
        (irregular("0.1, 0.4, 1, 0.5"), Vec3::new(1.1889, 0.6385, 0.1736)),
        (warm, Vec3::new(733.8, 349.9, 112.8)),
    ] {
        let found = radiance(&spectrum).unwrap();
        assert!((found / expected - 1.0).abs().max_element() < 0.003, "{spectrum}: {found} {expected}");
    }
    // Mitsuba 3.7's scalar_spectral has -1095 for blue, which no light of ours has: it is as bright, and mixed with
    // grey.
    let of_rgb = |rgb: Vec3| rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let green = radiance(&between(&[("min", 500.0), ("max", 600.0)])).unwrap();
    assert!((of_rgb(green) / of_rgb(Vec3::new(3547.0, 12459.0, -1095.0)) - 1.0).abs() < 0.003, "{green}");
    assert!(green.z == 0.0 && green.x < 0.4 * green.y, "{green}");
    let luminance = |ends: &[(&str, f32)]| of_rgb(radiance(&between(ends)).unwrap());
    let parts = [("max", 500.0), ("min", 600.0)].map(|end| luminance(&[end]));
    let all = luminance(&[]);
    println!("below 500 nm and above 600 nm: {parts:?} of {all}");
    assert!(parts.iter().all(|part| *part > 0.0 && *part < 0.3 * all), "{parts:?} of {all}");
    // As `scalar_rgb` has it.
    assert_eq!(
        radiance(&spectrum("srgb", r#"<rgb name="color" value="0.3, 0.2, 0.1"/>"#)),
        Ok(Vec3::new(0.3, 0.2, 0.1))
    );
    for (spectrum, problem) in [
        (regular(300.0), "wavelength_min below wavelength_max"),
        (irregular("1, 2"), "as many values; found 4 and 2"),
        (irregular_at("650, 500, 450", "1, 2, 3"), "wavelengths have to rise; found 500 after 650"),
        (irregular_at("400, 500, 500, 700", "1, 1, 0, 0"), "wavelengths have to rise; found 500 after 500"),
        (between(&[("min", 600.0), ("max", 500.0)]), "wavelength_min below its wavelength_max"),
        (spectrum("irregular", ""), "the string \"wavelengths\" is missing"),
        (spectrum("blackbody", ""), "a temperature in kelvin above 0"),
        (spectrum("srgb", ""), "needs a \"color\""),
        (spectrum("discrete", ""), "spectrum \"discrete\" is not read; blackbody, d65, irregular"),
    ] {
        let error = radiance(&spectrum).unwrap_err();
        assert!(error.contains(problem), "{error}");
    }
}

/// A checkerboard has no place for a picture: it was white.
#[test]
fn pictures_inside_a_checkerboard_are_their_mean() {
    let picture = r#"<texture name="color0" type="bitmap"><string name="filename" value="green.png"/></texture>"#;
    let scene = scene(&format!(
        r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">{picture}</texture></bsdf></shape>"#
    ));
    let Surface::Diffuse { reflectance } = &scene.materials[0].surface else { panic!("diffuse") };
    assert_eq!(reflectance.evaluate(&scene.textures, Vec2::splat(0.25)), Vec3::new(0.0, 1.0, 0.0));
    assert!(has_note(&scene, "\"color0\": a texture is not rendered here: its mean colour"), "{:?}", scene.notes);
}
