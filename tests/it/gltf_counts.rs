//! Attributes of glTF that do not fit their meshes: "all attribute accessors for a given primitive MUST have the same
//! count" (2.0, 3.7.2.1).

use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use serde_json::{Value, json};

/// A file of a square of four vertices, its document and its bytes.
struct File {
    document: Value,
    bytes: Vec<u8>,
}

impl File {
    fn new() -> Self {
        let document = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"mesh": 0}, {}], "meshes": [{"name": "square", "primitives": [{"attributes": {}}]}],
            "accessors": [], "bufferViews": [], "buffers": [{"uri": "a.bin"}]});
        let mut file = Self { document, bytes: Vec::new() };
        file.attribute("POSITION", &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        file.document["meshes"][0]["primitives"][0]["mode"] = json!(5);
        file
    }

    /// Its material has a texture for its colour.
    fn textured() -> Self {
        let mut file = Self::new();
        file.document["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        file.document["meshes"][0]["primitives"][0]["material"] = json!(0);
        file
    }

    /// The number of a new accessor.
    fn add<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4", "MAT4"][if N == 16 { 5 } else { N }];
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": 4 * N * values.len()});
        self.bytes.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        let views = self.document["bufferViews"].as_array_mut().unwrap();
        views.push(view);
        let number = views.len() - 1;
        let mut accessor = json!({"bufferView": number, "componentType": 5126, "count": values.len(), "type": kind});
        if N == 3 {
            (accessor["min"], accessor["max"]) = (json!([0, 0, 0]), json!([1, 1, 1]));
        }
        self.document["accessors"].as_array_mut().unwrap().push(accessor);
        number
    }

    fn attribute<const N: usize>(&mut self, name: &str, values: &[[f32; N]]) {
        let accessor = self.add(values);
        self.document["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    /// Hangs every vertex on a joint of a skin of one.
    fn skin(&mut self, joint: f32, weights: usize) {
        let accessor = self.add(&[[joint; 4]; 4]);
        // Whole numbers of 16 bits.
        let start = self.document["bufferViews"][accessor]["byteOffset"].as_u64().unwrap() as usize;
        self.bytes.truncate(start);
        self.bytes.extend([joint as u16; 32].iter().flat_map(|joint| joint.to_le_bytes()));
        self.document["accessors"][accessor]["componentType"] = json!(5123);
        self.document["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(accessor);
        self.attribute("WEIGHTS_0", &vec![[1.0, 0.0, 0.0, 0.0]; weights]);
        self.document["skins"] = json!([{"joints": [1]}]);
        self.document["nodes"][0]["skin"] = json!(0);
    }

    fn load(mut self) -> Result<Scene, String> {
        let folder = tempfile::tempdir().unwrap();
        self.document["buffers"][0]["byteLength"] = json!(self.bytes.len());
        std::fs::write(folder.path().join("a.bin"), &self.bytes).unwrap();
        let path = folder.path().join("a.gltf");
        std::fs::write(&path, self.document.to_string()).unwrap();
        load(&path, &LoadOptions::default()).map_err(|error| error.to_string())
    }
}

/// They were left out without a word, or moved some of the vertices.
#[test]
fn attributes_of_another_length_are_refused() {
    type Change<'a> = &'a dyn Fn(&mut File);
    let changed = |change: Change| {
        let mut file = File::new();
        change(&mut file);
        file.load()
    };
    assert!(changed(&|_| ()).is_ok() && changed(&|file| file.skin(0.0, 4)).is_ok());
    let morph = |file: &mut File, name: &str| {
        let accessor = file.add(&[[0.5; 3]; 2]);
        file.document["meshes"][0]["primitives"][0]["targets"] = json!([{ name: accessor }]);
        file.document["meshes"][0]["weights"] = json!([1.0]);
    };
    let normals = |file: &mut File, count| file.attribute("NORMAL", &vec![[0.0, 0.0, 1.0]; count]);
    let cases: [(Change, &str); 10] = [
        (
            &|file| file.attribute("TEXCOORD_0", &[[0.0; 2]; 3]),
            "TEXCOORD_0 of \"square\" has 3 elements, but the mesh has 4",
        ),
        (&|file| file.attribute("COLOR_0", &[[1.0; 3]; 2]), "COLOR_0 of \"square\" has 2 elements, but"),
        (&|file| file.attribute("COLOR_0", &[[1.0; 4]; 2]), "COLOR_0 of \"square\" has 2 elements, but"),
        (&|file| normals(file, 2), "NORMAL of \"square\" has 2 elements, but"),
        (
            &|file| {
                normals(file, 4);
                file.attribute("TANGENT", &[[1.0; 4]; 5]);
            },
            "TANGENT of \"square\" has 5 elements, but",
        ),
        (&|file| morph(file, "POSITION"), "a morph target's POSITION of \"square\" has 2 elements, but"),
        (
            &|file| {
                normals(file, 4);
                morph(file, "NORMAL");
            },
            "a morph target's NORMAL of \"square\" has 2 elements, but",
        ),
        (&|file| file.skin(0.0, 3), "WEIGHTS_0 of \"square\" has 3 elements, but"),
        (&|file| file.skin(9.0, 4), "\"square\": vertex 0 hangs on joint 9, but its skin has 1 joints"),
        (
            &|file| {
                file.skin(0.0, 4);
                let accessor = file.add::<16>(&[]);
                file.document["skins"][0]["inverseBindMatrices"] = json!(accessor);
            },
            "1 joints, but 0 inverse bind matrices",
        ),
    ];
    for (change, expected) in cases {
        let error = changed(change).expect_err(expected);
        assert!(error.contains(expected), "{error}\n  {expected}");
    }
}

/// Joints that mirror turn corners round: faces looked inwards, so that glass took the outside for its inside.
#[test]
fn mirrored_skins_keep_their_outside() {
    // Each triangle's side that the normals are on: of a strip every second one may look away.
    let sides = |scale: [f32; 3]| -> Vec<bool> {
        let mut file = File::new();
        file.attribute("NORMAL", &[[0.0, 0.0, 1.0]; 4]);
        file.skin(0.0, 4);
        file.document["nodes"][1]["scale"] = json!(scale);
        let scene = file.load().unwrap();
        let mesh = &scene.meshes[0];
        let outwards = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            (b - a).cross(c - a).dot(mesh.normals[corners[0] as usize]) > 0.0
        };
        mesh.triangles.iter().map(outwards).collect()
    };
    let as_written = sides([1.0; 3]);
    assert!(as_written.len() == 2 && as_written[0]);
    for scale in [[-1.0, 1.0, 1.0], [-1.0, -2.0, 1.0], [1.0, -1.0, 0.5]] {
        assert_eq!(sides(scale), as_written, "{scale:?}");
    }
}

/// WebP stands beside a picture for other programs, or alone.
#[test]
fn webp_textures_are_read_in_place_of_the_other() {
    let webp = |rgb: [u8; 3]| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbImage::from_pixel(2, 2, image::Rgb(rgb)).write_to(&mut bytes, image::ImageFormat::WebP).unwrap();
        let text = base64::Engine::encode(&base64::prelude::BASE64_STANDARD, bytes.into_inner());
        json!({"uri": format!("data:image/webp;base64,{text}"), "mimeType": "image/webp"})
    };
    for texture in [json!({"source": 1}), json!({})] {
        let mut file = File::textured();
        file.document["extensionsUsed"] = json!(["EXT_texture_webp"]);
        file.document["extensionsRequired"] = json!(["EXT_texture_webp"]);
        file.document["images"] = json!([webp([255, 0, 0]), webp([0, 0, 255])]);
        file.document["textures"] = json!([texture]);
        file.document["textures"][0]["extensions"] = json!({"EXT_texture_webp": {"source": 0}});
        let scene = file.load().unwrap();
        assert!(!scene.notes.iter().any(|note| note.contains("webp")), "{:?}", scene.notes);
        let color = scene.materials[scene.instances[0].material.0 as usize].surface.base_color().unwrap();
        let shown = color.evaluate(&scene.textures, glam::Vec2::splat(0.5));
        assert!((shown - glam::Vec3::X).length() < 1e-3, "{shown}");
    }
}

/// The image is there, but only through an extension that is not read.
#[test]
fn a_texture_of_an_extension_alone_is_named_as_such() {
    let mut file = File::textured();
    file.document["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
    file.document["images"] = json!([{"uri": "a.ktx2"}]);
    let scene = file.load().unwrap();
    let expected = "Texture 0: its image is that of KHR_texture_basisu alone, which is not read; left out.";
    assert!(scene.notes.iter().any(|note| note == expected), "{:?}", scene.notes);
}

/// Files written by hand forget to say what their materials use: a specular-glossiness material was white without a
/// word.
#[test]
fn extensions_of_materials_are_named_though_the_file_declares_none() {
    for declared in [json!([]), json!(["KHR_materials_dispersion"])] {
        let mut file = File::new();
        file.document["materials"] = json!([{"extensions": {"KHR_materials_dispersion": {"dispersion": 1}}}]);
        file.document["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.document["extensionsUsed"] = declared;
        let scene = file.load().unwrap();
        let named =
            scene.notes.iter().filter(|note| note.contains("KHR_materials_dispersion is not supported")).count();
        assert_eq!(named, 1, "{:?}", scene.notes);
    }
}

/// A node places its mesh as often as the extension's accessors say, each within the node's own transform.
#[test]
fn a_mesh_of_many_instances_is_at_each_of_them() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let mut file = File::new();
    let translations = file.add(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]);
    let rotations = file.add(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half], [0.0, 0.0, 0.0, 2.0]]);
    let scales = file.add(&[[1.0; 3], [2.0; 3], [1.0, 1.0, -1.0]]);
    let numbers = file.add(&[[0.0], [1.0], [2.0]]);
    let attributes = json!({"TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": numbers});
    file.document["nodes"][0]["translation"] = json!([10, 0, 0]);
    file.document["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    file.document["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    file.document["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let scene = file.load().unwrap();
    assert!(!scene.notes.iter().any(|note| note.contains("EXT_mesh")), "{:?}", scene.notes);
    assert_eq!((scene.instances.len(), scene.meshes.len()), (3, 1));
    let corner = glam::Vec3A::new(1.0, 0.0, 1.0);
    let found = scene.instances.iter().map(|instance| instance.to_world.transform_point3a(corner));
    for (found, expected) in found.zip([[12.0, 0.0, 1.0], [10.0, 4.0, 2.0], [11.0, 0.0, 2.0]]) {
        assert!((found - glam::Vec3A::from(expected)).length() < 1e-5, "{found} for {expected:?}");
    }
}

#[test]
fn instances_that_do_not_fit_are_refused() {
    type Attributes<'a> = &'a dyn Fn(&mut File) -> Value;
    let cases: [(Attributes, &str); 5] = [
        (&|_| json!(3), "node 0: EXT_mesh_gpu_instancing: expected an object \"attributes\""),
        (&|_| json!({"SCALE": 9}), "SCALE: expected the index of an accessor, found 9"),
        (&|_| json!({"SCALE": "a"}), "SCALE: expected the index of an accessor, found \"a\""),
        (
            &|file| json!({"SCALE": file.add(&[[1.0; 3]; 2]), "TRANSLATION": file.add(&[[1.0; 3]; 3])}),
            "TRANSLATION has 3 elements, but the one before has 2",
        ),
        (&|file| json!({"TRANSLATION": file.add(&[[1.0; 2]; 2])}), "expected elements of 3 numbers"),
    ];
    for (attributes, expected) in cases {
        let mut file = File::new();
        let attributes = attributes(&mut file);
        file.document["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
        let error = file.load().expect_err(expected);
        assert!(error.contains(expected), "{error}\n  {expected}");
    }
}

/// A scale of 0 takes no light away and moves no camera: a lamp was left out without a word, and a camera as if the
/// file had none.
#[test]
fn flat_nodes_keep_their_lamps_and_cameras() {
    use fechner::scene::Light;
    let of_scale = |scale: [f32; 3], kind: &str| {
        let mut file = File::new();
        let node = json!({"camera": 0, "translation": [0, 0, 5], "rotation": [0, 1, 0, 0], "scale": scale,
            "extensions": {"KHR_lights_punctual": {"light": 0}}});
        file.document["nodes"][1] = node;
        file.document["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]);
        file.document["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        let light = match kind {
            "spot" => json!({"type": kind, "intensity": 3, "spot": {}}),
            _ => json!({"type": kind, "intensity": 3}),
        };
        file.document["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        file.load().unwrap()
    };
    for kind in ["point", "spot", "directional"] {
        for scale in [[1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]] {
            let scene = of_scale(scale, kind);
            assert!(scene.camera.forward.abs_diff_eq(glam::Vec3::Z, 1e-6), "{scale:?}: {}", scene.camera.forward);
            match (kind, scene.lights.as_slice()) {
                ("point", [Light::Point { position, .. }]) => assert_eq!(position.z, 5.0),
                ("spot", [Light::Spot { direction, .. }]) | ("directional", [Light::Directional { direction, .. }]) => {
                    assert!(direction.abs_diff_eq(glam::Vec3::Z, 1e-6), "{scale:?}: {direction}");
                }
                (_, lights) => panic!("{kind}, {scale:?}: {lights:?}"),
            }
        }
    }
    let told = of_scale([0.0; 3], "spot");
    for what in ["The light at \"node 1\" is left out", "Camera \"node 1\" is left out"] {
        assert!(told.notes.iter().any(|note| note.starts_with(what)), "{:?}", told.notes);
    }
}

/// Without attributes once, as a node without the extension; of a skin once, with a note; of a mesh that morphs one
/// bent mesh for all places.
#[test]
fn instances_of_deformed_meshes_share_their_shape() {
    let instanced = |change: &dyn Fn(&mut File), count: usize| {
        let mut file = File::new();
        change(&mut file);
        let attributes = match count {
            0 => json!({}),
            _ => json!({"TRANSLATION": file.add(&vec![[0.0, 1.0, 0.0]; count])}),
        };
        file.document["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
        file.load().unwrap()
    };
    assert_eq!(instanced(&|_| (), 0).instances.len(), 1);
    let skinned = instanced(&|file| file.skin(0.0, 4), 3);
    assert_eq!(skinned.instances.len(), 1);
    assert!(skinned.notes.iter().any(|note| note.contains("has a skin and instances")), "{:?}", skinned.notes);
    let morphs = |file: &mut File| {
        let target = file.add(&[[0.5; 3]; 4]);
        file.document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        file.document["meshes"][0]["weights"] = json!([1.0]);
    };
    let morphed = instanced(&morphs, 3);
    assert_eq!((morphed.instances.len(), morphed.meshes.len()), (3, 1));
    assert_eq!(morphed.meshes[0].positions[0], glam::Vec3::splat(0.5));
}

/// The first set may be of light maps: where all that is rendered lies on another one, that is read.
#[test]
fn pictures_are_read_by_the_set_that_they_lie_on() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let of = |colour: Value, normal: Value, sets: &[usize]| {
        let mut file = File::textured();
        for &set in sets {
            file.attribute(&format!("TEXCOORD_{set}"), &corners.map(|[u, v]| [u + set as f32, v]));
        }
        file.document["textures"] = json!([{"source": 0}]);
        file.document["images"] = json!([{"uri": "data:image/png;base64,AAAA"}]);
        let material = &mut file.document["materials"][0];
        material["pbrMetallicRoughness"]["baseColorTexture"] = colour;
        // Neither is rendered.
        material["occlusionTexture"] = json!({"index": 0});
        material["extensions"] = json!({"MOZ_lightmap": {"lightmapTexture": {"index": 0, "texCoord": 2}}});
        material["normalTexture"] = normal;
        file.load().unwrap()
    };
    let on = |set: u32| json!({"index": 0, "texCoord": set});
    let by_transform = json!({"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}});
    let tiled = json!({"index": 0, "texCoord": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    for (colour, normal, expected, is_told) in [
        (on(0), on(0), 0.0, false),
        (on(1), on(1), 1.0, false),
        (tiled, on(1), 1.0, false),
        (by_transform, on(1), 1.0, false),
        (on(1), on(0), 1.0, true),
    ] {
        let scene = of(colour, normal, &[0, 1]);
        assert_eq!(scene.meshes[0].uvs[0].x, expected);
        let told = scene.notes.iter().any(|note| note.contains("several sets of texture coordinates"));
        assert_eq!(told, is_told, "{:?}", scene.notes);
    }
    let missing = of(on(1), on(1), &[0]);
    assert!(missing.meshes[0].uvs.is_empty());
    assert!(missing.notes.iter().any(|note| note.contains("no texture coordinates")), "{:?}", missing.notes);
}

/// Only the first of them was named.
#[test]
fn every_hidden_node_is_named_where_nothing_is_left() {
    let mut file = File::new();
    file.document["nodes"] = json!([{"mesh": 0, "scale": [0, 0, 0]}, {"mesh": 0, "scale": [0, 0, 0]}]);
    let error = file.load().unwrap_err();
    assert!(error.contains("\"node 0\" is left out") && error.contains("\"node 1\" is left out"), "{error}");
}
