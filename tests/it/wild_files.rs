//! Files as other programs write them: what they mean is read, what is left out is named, and nothing sound is refused.

use crate::support::{has_note, write_and_load};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Alpha, Material, MetalRoughness, Scene, Surface};

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0.6 0 0.8\n";

fn read(files: &[(&str, &[u8])]) -> Result<Scene, String> {
    let place = tempfile::tempdir().unwrap();
    for (name, bytes) in &files[1..] {
        std::fs::write(place.path().join(name), bytes).unwrap();
    }
    write_and_load(&place.path().join(files[0].0), files[0].1)
}

fn scene(files: &[(&str, &[u8])]) -> Scene {
    read(files).unwrap_or_else(|error| panic!("{error}"))
}

/// The scene of a quad of one MTL material.
fn of_mtl(material: &str) -> (Scene, Material) {
    let obj = format!("mtllib m.mtl\n{QUAD}usemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n");
    let scene = scene(&[("q.obj", obj.as_bytes()), ("m.mtl", format!("newmtl m\n{material}\n").as_bytes())]);
    let used = scene.materials[scene.instances[0].material.0 as usize].clone();
    (scene, used)
}

fn metal_roughness(material: &str) -> MetalRoughness {
    match of_mtl(material).1.surface {
        Surface::MetalRoughness(model) => model,
        other => panic!("{material}: {other:?}"),
    }
}

#[test]
fn what_illum_calls_glass_is_glass_where_the_rest_agrees() {
    let (scene, plain) = of_mtl("illum 4\nKd 0.5 0.1 0.1\nTf 1 1 1\nNi 1");
    assert!(matches!(plain.surface, Surface::Diffuse { reflectance } if reflectance.factor.x == 0.5));
    assert!(has_note(&scene, "Material \"m\": illum 4"), "{:?}", scene.notes);
    let (_, phong) = of_mtl("illum 5\nKd 0.5 0.1 0.1\nTf 1 1 1\nKs 0.5 0.5 0.5\nNs 30\nd 1");
    assert!(matches!(phong.surface, Surface::MetalRoughness(_)));
    let (_, faded) = of_mtl("illum 9\nKd 1 0 0\nd 0.5\nKs 0.5 0.5 0.5\nNs 250\nNi 1.45");
    assert!(matches!(faded.surface, Surface::MetalRoughness(_)));
    assert!(matches!(faded.alpha, Alpha::Blend { value } if value.factor == 0.5));
    for glass in
        ["illum 7\nKd 0.01 0.01 0.01\nNi 1.5", "illum 4\nKd 0.5 0.5 0.5\nTf 0.2 0.8 0.4", "illum 9\nKd 0 0 0\nNi 1.5"]
    {
        assert!(matches!(of_mtl(glass).1.surface, Surface::Dielectric { .. }), "{glass}");
    }
    assert!(has_note(&of_mtl("illum 6\nKd 0.5 0.5 0.5\nNi 1.5").0, "Kd is not used"));
}

#[test]
fn highlights_are_as_strong_as_ks_says() {
    let strength = |ks: &str| {
        let model = metal_roughness(&format!("illum 2\nKd 0.1 0.1 0.1\nKs {ks}\nNs 200"));
        model.specular.factor * model.specular_color.factor
    };
    assert_eq!(strength("0.5 0.5 0.5"), glam::Vec3::ONE);
    assert!(strength("0.01 0.01 0.01").abs_diff_eq(glam::Vec3::splat(0.02), 1e-6));
    assert!(strength("1 0 0").abs_diff_eq(glam::Vec3::new(2.0, 0.0, 0.0), 1e-6));
    let mapped = metal_roughness("illum 2\nKd 0.1 0.1 0.1\nmap_Ks missing.png");
    assert!(mapped.specular.texture.is_some());
    let halved = of_mtl("illum 1\nKd 0.5 0.5 0.5\nmap_Kd -mm 0 0.5 missing.png").1.surface;
    assert!(matches!(halved, Surface::Diffuse { reflectance } if reflectance.factor.x == 0.25));
    // What ends at 1 is the picture times its gain.
    let doubled = metal_roughness("Kd 1 1 1\nPr 1\nmap_Kd -mm 0 2 missing.png\nmap_Pr -mm 0 2 missing.png");
    assert_eq!((doubled.base_color.factor.x, doubled.roughness.factor), (2.0, 2.0));
    let plain = metal_roughness("Kd 2 2 2\nPr 2");
    assert_eq!((plain.base_color.factor.x, plain.roughness.factor), (1.0, 1.0));
}

#[test]
fn coats_fibres_and_stretch_of_mtl_are_read() {
    let model = metal_roughness("Kd 0.5 0 0\nPc 0.75\nPcr 0.25\nPs 0.5\naniso 0.5\nanisor 0.25");
    assert_eq!((model.clearcoat.factor, model.clearcoat_roughness.factor), (0.75, 0.25));
    assert_eq!((model.sheen_color.factor.x, model.anisotropy.factor), (0.5, 0.5));
    let (_, material) = of_mtl("Kd 0.5 0 0\naniso 0.5\nanisor 0.25");
    assert_eq!(material.stretch.expect("turned").rotation, std::f32::consts::FRAC_PI_2);
    let (scene, _) = of_mtl("Kd 0.5 0 0\nKa 1 1 1\nmap_Ns a.png\nmap_Ni b.png\nrefl c.png");
    assert!(has_note(&scene, "Material \"m\": not used: map_ni, map_ns, refl."), "{:?}", scene.notes);
}

/// As the bytes of a picture in a format, of one colour.
fn picture(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([0, 255, 0])).write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A kind of picture that is not read costs the picture and not the scene; a damaged one names the line that asks for
/// it.
#[test]
fn pictures_of_every_kind_leave_a_scene() {
    let with = |name: &str, bytes: &[u8]| {
        let mtl = format!("newmtl m\nKd 1 1 1\nmap_Kd {name}\n");
        let obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
        read(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes()), (name, bytes)])
    };
    for (name, format) in [("a.bmp", image::ImageFormat::Bmp), ("a.webp", image::ImageFormat::WebP)] {
        let scene = with(name, &picture(format)).unwrap();
        let green = scene.textures[0].mean_color();
        assert!(green.y > 0.9 && green.x < 0.1 && !has_note(&scene, "stands in"), "{name}: {green}");
    }
    let scene = with("a.gif", b"GIF89a\x01\0\x01\0\0\0\0;").unwrap();
    assert!(has_note(&scene, "Texture not read, a plain one stands in: "), "{:?}", scene.notes);
    assert!(has_note(&scene, "a.mtl:3: "), "{:?}", scene.notes);
    let damaged = with("a.png", b"\x89PNG\r\n\x1a\n").unwrap_err();
    assert!(damaged.contains("a.mtl:3: "), "{damaged}");
}

#[test]
fn unknown_materials_are_counted_after_ten() {
    let uses: String = (0..30).flat_map(|name| [format!("usemtl q{}\nf 1 2 3\n", name % 15)]).collect();
    let obj = format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{uses}");
    let scene = scene(&[("a.obj", obj.as_bytes()), ("a.mtl", b"newmtl m\n")]);
    let unknown = || scene.notes.iter().filter(|note| note.contains("unknown material"));
    assert_eq!(unknown().count(), 11, "{:?}", scene.notes);
    assert!(unknown().any(|note| note.contains("5 more unknown materials")), "{:?}", scene.notes);
}

#[test]
fn an_opacity_with_a_halo_is_one() {
    let (scene, faded) = of_mtl("Kd 1 1 1\nd -halo 0.25");
    assert!(matches!(faded.alpha, Alpha::Blend { value } if value.factor == 0.25), "{:?}", scene.notes);
}

#[test]
fn a_late_material_file_counts() {
    let obj = format!("{QUAD}usemtl m\nmtllib m.mtl\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl n\n");
    let scene = scene(&[("q.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nKd 1 0 0\nillum 1\n")]);
    assert_eq!(scene.materials[scene.instances[0].material.0 as usize].name, "m");
    assert!(has_note(&scene, "q.obj:13: unknown material \"n\""), "{:?}", scene.notes);
}

#[test]
fn a_face_without_normals_or_coordinates_takes_none_from_others() {
    let apart = "v 5 5 0\nv 6 5 0\nv 6 6 0\n";
    for (last, has_uvs, has_normals) in
        [("5 6 7", false, false), ("5/1 6/2 7/3", true, false), ("5//1 6//1 7//1", false, true)]
    {
        let obj = format!("{QUAD}{apart}f 1/1/1 2/2/1 3/3/1 4/4/1\nf {last}\n");
        let scene = scene(&[("q.obj", obj.as_bytes())]);
        assert_eq!(scene.meshes.len(), 2, "{last}");
        assert!(scene.meshes[0].uvs.len() == 4 && scene.meshes[0].normals.len() == 4);
        let other = &scene.meshes[1];
        assert_eq!(
            (other.triangles.len(), !other.uvs.is_empty(), !other.normals.is_empty()),
            (1, has_uvs, has_normals)
        );
    }
    let obj = format!("mtllib none.mtl\nmtllib m.mtl\n{QUAD}usemtl m\nf 1/1 2/2 3/3\nusemtl n\nf 1 2 4\n");
    let parts = scene(&[("q.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nKd 1 0 0\nnewmtl n\nKd 0 1 0\n")]);
    let names: Vec<&str> =
        parts.instances.iter().map(|instance| parts.materials[instance.material.0 as usize].name.as_str()).collect();
    assert_eq!(names, ["m", "n"], "libraries are read for the first part and known to all");
    for statements in ["l 1 2\nl 2 3 4\n", "p 1 2\np 3\n"] {
        let obj = format!("{QUAD}{statements}f 1/1/1 2/2/1 3/3/1 4/4/1\n");
        let scene = scene(&[("q.obj", obj.as_bytes())]);
        assert_eq!((scene.meshes[0].uvs.len(), scene.meshes[0].normals.len()), (4, 4), "{statements}");
        assert!(has_note(&scene, "q.obj: 2 points and lines are not rendered."), "{:?}", scene.notes);
    }
    let obj = "v 0 0 0 1 0 0 1\nv 1 0 0 1 0 0 1\nv 0 1 0 1 0 0 1\nvt 0.5\nf 1/1 2/1 3/1\n";
    let colored = scene(&[("q.obj", obj.as_bytes())]);
    assert_eq!((colored.meshes[0].colors[0], colored.meshes[0].uvs.len()), (glam::Vec3::X, 3));
}

#[test]
fn vertices_that_no_face_uses_may_be_anything() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\nnan 0 0\n0 1 0\n3 0 1 LAST\n";
    let sound = scene(&[("p.ply", ply.replace("LAST", "3").as_bytes())]);
    assert!(sound.meshes[0].positions.iter().all(|position| position.is_finite()));
    assert!(read(&[("p.ply", ply.replace("LAST", "2").as_bytes())]).unwrap_err().contains("vertex 2"));
}

/// A triangle in glTF. `MORE` stands for further keys of the primitive, `TOP` for those of the file, `ATTRIBUTES` for
/// further attributes.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],TOP
"meshes":[{"name":"piece","primitives":[{"attributes":{"POSITION":0ATTRIBUTES}MORE}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"componentType":5126,"count":3,"type":"VEC3"},{"componentType":5126,"count":3,"type":"VEC4"},
{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[0]},
{"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

fn triangle(attributes: &str, more: &str, top: &str) -> String {
    TRIANGLE.replace("ATTRIBUTES", attributes).replace("MORE", more).replace("TOP", top)
}

#[test]
fn sound_gltf_is_read_whatever_wrote_it() {
    let plain = triangle("", "", "");
    let with_mark = [b"\xEF\xBB\xBF", plain.as_bytes()].concat();
    assert_eq!(scene(&[("t.gltf", &with_mark)]).meshes[0].triangles.len(), 1);
    let longer =
        plain.replace("\"byteLength\":36,\"uri\"", "\"byteLength\":37,\"uri\"").replace("AAAA\"}]", "AAAAAA\"}]");
    assert_eq!(scene(&[("t.gltf", longer.as_bytes())]).meshes[0].triangles.len(), 1, "base64 without its end");
    let mut glb = plain.replace(
        ",\"uri\":\"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"",
        "",
    );
    glb.push_str(&" ".repeat((4 - glb.len() % 4) % 4));
    let binary: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut bytes = b"glTF".to_vec();
    for word in [2, 28 + glb.len() as u32 + 36, glb.len() as u32, 0x4E4F_534A] {
        bytes.extend(u32::to_le_bytes(word));
    }
    bytes.extend(glb.as_bytes());
    bytes.extend([36, 0x004E_4942].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend(binary);
    bytes.extend(b"appended");
    assert_eq!(scene(&[("t.glb", &bytes)]).meshes[0].positions[1], glam::Vec3::X);
}

#[test]
fn what_gltf_may_leave_out_is_left_out() {
    let textured = triangle(
        "",
        ",\"material\":0",
        r#""textures":[{}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"#,
    );
    assert!(has_note(&scene(&[("t.gltf", textured.as_bytes())]), "Texture 0"));
    // The second accessor, of normals here, has no bytes: it is all zeros, and flat faces stand in.
    let zeros = scene(&[("t.gltf", triangle(",\"NORMAL\":1", "", "").as_bytes())]);
    assert!(has_note(&zeros, "some normals had no length"), "{:?}", zeros.notes);
    let channel = r#"{"sampler":0,"target":{"path":"translation"}}"#;
    let animated = format!(r#""animations":[{{"samplers":[{{"input":3,"output":0}}],"channels":[{channel}]}}],"#);
    assert_eq!(scene(&[("t.gltf", triangle("", "", &animated).as_bytes())]).instances.len(), 1);
}

#[test]
fn what_gltf_says_is_kept() {
    let cut = r#""materials":[{"alphaMode":"MASK","alphaCutoff":1.5}],"#;
    let cut = scene(&[("t.gltf", triangle("", ",\"material\":0", cut).as_bytes())]);
    assert!(matches!(cut.materials[0].alpha, Alpha::Mask { cutoff, .. } if cutoff == 1.5));
    let without_normals = scene(&[("t.gltf", triangle(",\"TANGENT\":2", "", "").as_bytes())]);
    assert!(without_normals.meshes[0].tangents.is_empty());
    let morphed = scene(&[("t.gltf", triangle("", r#","targets":[{"POSITION":1,"TEXCOORD_0":1}]"#, "").as_bytes())]);
    assert!(has_note(&morphed, "\"piece\": morph targets of texture coordinates"), "{:?}", morphed.notes);
    let moved = r#""images":[{"uri":"x.png"}],"textures":[{"source":0}],"materials":[{"normalTexture":{"index":0,
        "extensions":{"KHR_texture_transform":{"texCoord":1}}}}],"#;
    assert!(has_note(
        &scene(&[("t.gltf", triangle("", ",\"material\":0", moved).as_bytes())]),
        "no texture coordinates"
    ));
}

#[test]
fn nothing_of_our_own_format_is_dropped() {
    let of = |materials: &str| {
        let text = format!(
            "[environment]\nluminance_cd_m2 = 100\n{materials}\n[[objects]]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\nmaterial = \"m\"\n"
        );
        read(&[("s.toml", text.as_bytes())])
    };
    let alone =
        of("[materials.m]\ntype = \"metal-roughness\"\ntransmission = 1\nattenuation_distance = 0.01").unwrap_err();
    assert!(alone.contains("attenuation_color"), "{alone}");
    for (own, what) in [
        ("emission_cd_m2 = 500", "an emission"),
        ("power_lm = 5", "an emission"),
        ("alpha = 0.5", "an alpha"),
        ("stretch_rotation_deg = 30", "a stretch_rotation_deg"),
    ] {
        let part = format!(
            "[materials.a]\ntype = \"diffuse\"\nreflectance = 0\n{own}\n[materials.b]\ntype = \"diffuse\"\nreflectance = 0\n"
        );
        let refused = of(&format!("{part}[materials.m]\ntype = \"mix\"\nmaterials = [\"a\", \"b\"]")).unwrap_err();
        assert!(refused.contains(&format!("\"a\" has {what}")) && refused.contains("s.toml:12"), "{refused}");
    }
}

/// `d 0` is no slip about the meaning of `Tr`, which `Tr 1` may be.
#[test]
fn an_opacity_of_nothing_is_one() {
    let (_, unseen) = of_mtl("Kd 1 1 1\nd 0");
    assert!(matches!(unseen.alpha, Alpha::Blend { value } if value.factor == 0.0), "{:?}", unseen.alpha);
    let (scene, slip) = of_mtl("Kd 1 1 1\nTr 1");
    assert!(slip.alpha == Alpha::Opaque && has_note(&scene, "Tr 1 is taken for opaque"), "{:?}", scene.notes);
    let (scene, mapped) = of_mtl("Kd 0 0 0\nmap_Kd x.png\nPr 0\nmap_Pr x.png");
    assert!(has_note(&scene, "Material \"m\": Kd 0, Pr 0 beside a picture"), "{:?}, {mapped:?}", scene.notes);
    assert!(!has_note(&of_mtl("Kd 0.5 0 0\nmap_Kd x.png").0, "beside a picture"));
    for nothing in ["d 0", "Tr 1"] {
        let scene = of_mtl(&format!("Kd 0.5 0.5 0.5\n{nothing}\nmap_d x.png")).0;
        assert!(has_note(&scene, &format!("{nothing} beside a picture")), "{:?}", scene.notes);
    }
}

#[test]
fn lines_may_end_as_on_old_macs() {
    let obj = format!("mtllib m.mtl\n{QUAD}usemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n");
    let mtl = "newmtl m\nKd 1 0 0\nillum 1\n";
    for (obj, mtl) in [(obj.replace('\n', "\r"), mtl.to_owned()), (obj.clone(), mtl.replace('\n', "\r"))] {
        let scene = scene(&[("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())]);
        assert_eq!(scene.materials[scene.instances[0].material.0 as usize].name, "m", "{:?}", scene.notes);
    }
    let error = read(&[("q.obj", obj.replace("f 1", "f 9").replace('\n', "\r").as_bytes())]).unwrap_err();
    assert!(error.contains("q.obj:12:"), "{error}");
}

#[test]
fn a_missing_material_file_is_told_as_what_it_costs() {
    let obj = format!("mtllib none.mtl\nmtllib m.mtl\n{QUAD}usemtl m\nf 1/1/1 2/2/1 3/3/1\n");
    let scene = scene(&[("q.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nKd 1 0 0\n")]);
    assert!(has_note(&scene, "Material file \"none.mtl\" not found"), "{:?}", scene.notes);
    assert!(!has_note(&scene, "grey stands in"), "{:?}", scene.notes);
    let error = read(&[("q.obj", b"v 0 0 0\nv 1 0 0\n\nv nan 1 0\nf 1 2 3\n")]).unwrap_err();
    assert!(error.contains("q.obj:4:"), "{error}");
}

/// Nodes that share a camera are two cameras.
#[test]
fn every_camera_of_gltf_has_a_name() {
    let top = r#""cameras":[{"name":"Cam","type":"perspective","perspective":{"yfov":1,"znear":0.1}}],"#;
    let text = triangle("", "", top).replace(r#""nodes":[0]"#, r#""nodes":[0,1,2,3]"#).replace(
        r#"{"mesh":0}]"#,
        r#"{"mesh":0},{"name":"left","camera":0,"translation":[-1,0,4]},
            {"name":"right","camera":0,"translation":[1,0,4]},{"camera":0,"translation":[2,0,4]}]"#,
    );
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("t.gltf");
    std::fs::write(&path, text).unwrap();
    let chosen = |name: &str| {
        let options = LoadOptions { camera: Some(name.to_owned()), ..LoadOptions::default() };
        load(&path, &options).map(|scene| scene.camera.position.x).map_err(|error| error.to_string())
    };
    for (name, x) in [("Cam", -1.0), ("left", -1.0), ("right", 1.0), ("node 3", 2.0)] {
        assert_eq!(chosen(name), Ok(x), "{name}");
    }
    let error = chosen("nowhere to be seen").unwrap_err();
    assert!(error.contains("left, right, node 3"), "{error}");
}

fn with_material(extensions: &str) -> Result<Scene, String> {
    let top = format!(r#""materials":[{{"name":"lacquer","extensions":{{{extensions}}}}}],"#);
    read(&[("t.gltf", triangle("", ",\"material\":0", &top).as_bytes())])
}

/// As those of the core are, which the crate reads.
#[test]
fn values_of_gltf_extensions_are_of_their_type() {
    for (extensions, key) in [
        (r#""KHR_materials_clearcoat":{"clearcoatFactor":"1"}"#, "clearcoatFactor"),
        (r#""KHR_materials_clearcoat":{"clearcoatRoughnessFactor":[1]}"#, "clearcoatRoughnessFactor"),
        (r#""KHR_materials_clearcoat":{"clearcoatTexture":{"index":"0"}}"#, "clearcoatTexture"),
        (r#""KHR_materials_sheen":{"sheenColorFactor":1}"#, "sheenColorFactor"),
        (r#""KHR_materials_sheen":{"sheenColorFactor":[1,1]}"#, "sheenColorFactor"),
        (r#""KHR_materials_sheen":{"sheenColorFactor":[1,1,"1"]}"#, "sheenColorFactor"),
        (r#""KHR_materials_anisotropy":{"anisotropyStrength":true}"#, "anisotropyStrength"),
        (r#""KHR_materials_anisotropy":{"anisotropyRotation":"1"}"#, "anisotropyRotation"),
        (r#""KHR_materials_sheen":3"#, "KHR_materials_sheen"),
    ] {
        let error = with_material(extensions).expect_err(extensions);
        assert!(error.contains(key) && error.contains("lacquer"), "{error}");
    }
    let scene = with_material(r#""KHR_materials_clearcoat":{"clearcoatFacter":1,"extras":{}}"#).unwrap();
    let expected = "\"lacquer\": KHR_materials_clearcoat has no \"clearcoatFacter\"; did you mean \"clearcoatFactor\"?";
    assert!(has_note(&scene, expected) && !has_note(&scene, "extras"), "{:?}", scene.notes);
    assert!(with_material(r#""KHR_materials_sheen":{"sheenColorFactor":[1,0.5,0]}"#).is_ok());
}

/// A picture that is not there ends no render, whatever names it.
#[test]
fn gltf_may_name_local_files_by_their_scheme() {
    let of = |uri: &str| {
        let top = format!(
            r#""images":[{{"uri":"{uri}"}}],"textures":[{{"source":0}}],"materials":[{{"normalTexture":{{"index":0}}}}],"#
        );
        read(&[("t.gltf", triangle(",\"TEXCOORD_0\":4", ",\"material\":0", &top).as_bytes())])
    };
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("a b.png");
    image::RgbImage::from_pixel(1, 1, image::Rgb([10, 20, 30])).save(&path).unwrap();
    for host in ["", "localhost"] {
        let named = format!("file://{host}{}", path.to_str().unwrap().replace(' ', "%20").replace('\\', "/"));
        assert_eq!(of(&named).unwrap().textures[0].sample_rgba(glam::Vec2::ZERO).x, 10.0 / 255.0, "{named}");
    }
    let remote = of("https://example.org/a.png").unwrap();
    assert!(has_note(&remote, "https://example.org/a.png"), "{:?}", remote.notes);
}

#[test]
fn what_gltf_cannot_show_is_told() {
    let top = r#""images":[{"uri":"x.png"}],"textures":[{"source":0}],"materials":[{"pbrMetallicRoughness":
        {"baseColorTexture":{"index":0}}}],"#;
    let scene = scene(&[("t.gltf", triangle("", ",\"material\":0", top).as_bytes())]);
    assert!(has_note(&scene, "\"piece\" has no texture coordinates"), "{:?}", scene.notes);
    let plain = scene_of_light(r#"{"type":"point","intensity":10}"#);
    assert!(!has_note(&plain, "negative"), "{:?}", plain.notes);
    let negative = scene_of_light(r#"{"type":"point","intensity":-10}"#);
    assert!(has_note(&negative, "negative"), "{:?}", negative.notes);
}

fn scene_of_light(light: &str) -> Scene {
    let top = format!(r#""extensions":{{"KHR_lights_punctual":{{"lights":[{light}]}}}},"#);
    let text = triangle("", "", &top)
        .replace(r#"{"mesh":0}]"#, r#"{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}]"#);
    scene(&[("t.gltf", text.as_bytes())])
}
