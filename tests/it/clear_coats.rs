//! Clear coats of glTF: smooth over a bumpy base unless they have bumps of their own, and darkening what shines
//! beneath them.

use crate::support::{radiance_along, trace_settings};
use fechner::geometry::Ray;
use fechner::integrator::PathTracer;
use fechner::scene::load::{LoadOptions, load};
use glam::{Vec3, Vec3A};
use serde_json::{Value, json};
use std::f32::consts::FRAC_PI_6;
use std::sync::Arc;

/// The scene of `objects`, each a square of 2 × 2 units around its node's origin that faces the node's +z, by these
/// materials.
fn tracer(materials: &Value, objects: &[Value]) -> PathTracer {
    let folder = tempfile::tempdir().unwrap();
    // Normals that lean by 15° towards u.
    let leaning = [0.5 + 0.5 * (0.5 * FRAC_PI_6).sin(), 0.5, 0.5 + 0.5 * (0.5 * FRAC_PI_6).cos()];
    let leaning = leaning.map(|value| (65535.0 * value).round() as u16);
    image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(1, 1, image::Rgb(leaning))
        .save(folder.path().join("n.png"))
        .unwrap();
    let square: [[f32; 8]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| [x, y, 0.0, 0.0, 0.0, 1.0, 0.5 + 0.5 * x, 0.5 - 0.5 * y]);
    let mut bytes: Vec<u8> = square.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    std::fs::write(folder.path().join("a.bin"), &bytes).unwrap();
    let attribute = |offset: u32, kind: &str| {
        json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "count": 4, "type": kind,
               "min": [-1, -1, 0], "max": [1, 1, 0]})
    };
    let count = materials.as_array().unwrap().len();
    let mesh = |material: usize| {
        json!({"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3,
                               "material": material}]})
    };
    let mut accessors = vec![attribute(0, "VEC3"), attribute(12, "VEC3"), attribute(24, "VEC2")];
    for accessor in &mut accessors[1..] {
        accessor.as_object_mut().unwrap().retain(|key, _| key != "min" && key != "max");
    }
    accessors.push(json!({"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}));
    let document = json!({"asset": {"version": "2.0"}, "scene": 0, "nodes": objects,
        "scenes": [{"nodes": (0..objects.len()).collect::<Vec<_>>()}], "meshes": (0..count).map(mesh).collect::<Vec<_>>(),
        "materials": materials, "images": [{"uri": "n.png"}], "textures": [{"source": 0}], "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteLength": 128, "byteStride": 32},
                        {"buffer": 0, "byteOffset": 128, "byteLength": 12}],
        "buffers": [{"uri": "a.bin", "byteLength": bytes.len()}]});
    let path = folder.path().join("s.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let scene = load(&path, &LoadOptions { nits_per_unit: Some(1.0), ..LoadOptions::default() });
    PathTracer::new(Arc::new(scene.unwrap_or_else(|error| panic!("{error}"))), trace_settings(16, 16, 0))
}

/// Black but for a smooth coat.
fn coated(coat: Value, more: &Value) -> Value {
    let mut material = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0}, "KHR_materials_clearcoat": coat}});
    material.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    material
}

fn lamp(strength: f32) -> Value {
    json!({"emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "doubleSided": true,
           "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}})
}

/// A square of this mesh at 10 units from the origin, which it faces, at an angle from +z towards +x.
fn at(mesh: usize, angle: f32) -> Value {
    let half = 0.5 * angle;
    json!({"mesh": mesh, "translation": [10.0 * angle.sin(), 0.0, 10.0 * angle.cos()],
           "rotation": [0.0, half.sin(), 0.0, half.cos()]})
}

fn seen_from(tracer: &PathTracer, angle: f32) -> f32 {
    let towards = Vec3A::new(angle.sin(), 0.0, angle.cos());
    radiance_along(tracer, Ray::new(5.0 * towards, -towards), 4, 4096).0.y
}

/// "If clearcoatNormalTexture is not given, no normal mapping is applied to the clear coat layer, even if normal
/// mapping is applied to the base material" (KHR_materials_clearcoat). A coat of index 1.5 reflects 0.04 face on, and
/// 0.0401 at 15°.
#[test]
fn a_coat_is_smooth_over_bumps_unless_it_has_its_own() {
    let bumpy = json!({"normalTexture": {"index": 0}});
    let plain = json!({});
    for (coat, base, mirrors_at) in [
        (json!({"clearcoatFactor": 1}), &bumpy, 0.0),
        (json!({"clearcoatFactor": 1}), &plain, 0.0),
        (json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": 0}}), &plain, FRAC_PI_6),
        (json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": 0}}), &bumpy, FRAC_PI_6),
        (json!({"clearcoatFactor": 1, "clearcoatNormalTexture": {"index": 0, "scale": 0}}), &bumpy, 0.0),
    ] {
        for angle in [0.0, FRAC_PI_6] {
            let tracer =
                tracer(&json!([coated(coat.clone(), base), lamp(1000.0)]), &[json!({"mesh": 0}), at(1, angle)]);
            let expected = if angle == mirrors_at { 0.04 } else { 0.0 };
            let found = seen_from(&tracer, 0.0) / 1000.0;
            assert!((found - expected).abs() < 3e-4, "{coat}, {base}, lamp at {angle}: {found}, expected {expected}");
        }
    }
}

/// What lies beneath keeps its bumps: a white base whose normals lean by 15° sees a small lamp overhead at that
/// angle, through a coat that passes 0.96 both ways face on.
#[test]
fn what_lies_beneath_a_smooth_coat_keeps_its_bumps() {
    let white = json!({"normalTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 1}});
    let light = |coverage: f32| {
        let tracer = tracer(
            &json!([coated(json!({"clearcoatFactor": coverage}), &white), lamp(1000.0)]),
            &[json!({"mesh": 0}), at(1, 0.0)],
        );
        seen_from(&tracer, 0.3)
    };
    let (bare, covered) = (light(0.0), light(1.0));
    // E at 0.3 rad is 0.0400: (1 − E)² / (1 − E).
    assert!((covered / bare - 0.96).abs() < 5e-3, "{bare} bare, {covered} under the coat");
}

/// `coated_emission = emission * (1 - clearcoat * fresnel)`; seen directly and as it lights others.
#[test]
fn what_shines_beneath_a_coat_is_darkened_by_it() {
    let shining = |strength: f32| {
        let mut material = coated(json!({"clearcoatFactor": 1}), &json!({"emissiveFactor": [1, 1, 1]}));
        material["extensions"]["KHR_materials_emissive_strength"] = json!({"emissiveStrength": strength});
        material
    };
    // Fresnel's equations at index 1.5.
    for (angle_deg, passed) in [(0.0_f32, 0.96), (60.0, 0.9108), (75.0, 0.7469)] {
        let tracer = tracer(&json!([shining(1000.0)]), &[json!({"mesh": 0})]);
        let found = seen_from(&tracer, angle_deg.to_radians()) / 1000.0;
        assert!((found - passed).abs() < 2e-4, "{angle_deg}°: {found}, expected {passed}");
    }
    // A lamp that is turned by 75° away from the floor below it, with and without the coat.
    let floor = json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0}, "extensions":
        {"KHR_materials_specular": {"specularFactor": 0}}});
    let half = 0.5 * (180.0_f32 - 75.0).to_radians();
    let aside = json!({"mesh": 1, "translation": [0, 0, 50], "rotation": [0.0, half.sin(), 0.0, half.cos()]});
    let lit = |lamp: Value| {
        let tracer = tracer(&json!([floor, lamp]), &[json!({"mesh": 0}), aside.clone()]);
        seen_from(&tracer, 0.5)
    };
    let (bare, covered) = (lit(lamp(1e6)), lit(shining(1e6)));
    assert!((covered / bare - 0.7469).abs() < 5e-3, "{bare} bare, {covered} under the coat");
    assert!(Vec3::splat(bare).is_finite() && bare > 0.0);
}
