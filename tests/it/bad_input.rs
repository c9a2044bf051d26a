//! Bad scene files end in one line that says what is wrong; every file of `tests/bad` holds its own expectation.

use crate::support::command::assert_refused;
use fechner::scene::load::{LoadOptions, load};
use std::path::Path;

fn folder(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

#[test]
fn every_bad_file_says_what_is_wrong_with_it() {
    let mut files = 0;
    for entry in std::fs::read_dir(folder("tests/bad")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let (_, expected) = text.split_once("# expect: ").expect("a bad file says what is expected");
        let expected = expected.split(['\n', '}']).next().unwrap().trim_end_matches('"');
        let expected = if path.extension().unwrap() == "gltf" { expected } else { expected.trim() };
        let message = load(&path, &LoadOptions::default()).expect_err(&path.display().to_string()).to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{}\n  {message}\n  {expected}", path.display());
        files += 1;
    }
    assert!(files >= 15, "{files}");
}

#[test]
fn what_is_no_scene_is_named() {
    let message = |name: &str| load(&folder(name), &LoadOptions::default()).unwrap_err().to_string();
    assert!(message("tests/none.toml").ends_with("no such file"));
    assert!(message("tests").contains("is a directory"));
    assert!(message("Cargo.lock").contains(".toml, .obj, .ply, .gltf, .glb, .pbrt and .xml (Mitsuba) are read"));
}

/// Initials are read, and no list shows them: "tr, fpsg, wrp, ptyg" were in it, and in no help text.
#[test]
fn operators_are_listed_by_their_names() {
    let place = tempfile::tempdir().unwrap();
    let scene = place.path().join("shown.toml");
    let message = |operator: &str| {
        std::fs::write(&scene, format!("[view]\noperator = \"{operator}\"\n")).unwrap();
        load(&scene, &LoadOptions::default()).unwrap_err().to_string()
    };
    let unknown = message("filmic");
    assert!(unknown.contains("shown.toml:2: ") && unknown.ends_with("pbr-neutral, agx"), "{unknown}");
    assert!(!message("ptyg").contains("operator"), "{}", message("ptyg"));
}

#[test]
fn our_own_scenes_load_and_survive_every_cut() {
    for entry in std::fs::read_dir(folder("scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") || path.ends_with("Cargo.toml") {
            continue;
        }
        if let Err(error) = load(&path, &LoadOptions::default()) {
            panic!("{error}");
        }
    }
    let bytes = std::fs::read(folder("scenes/cornell-box.toml")).unwrap();
    let place = tempfile::tempdir().unwrap();
    let cut = place.path().join("cut.toml");
    for length in (0..bytes.len()).step_by(7) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        if let Err(error) = load(&cut, &LoadOptions::default()) {
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    }
}

/// Writes cuts of a good file, and the file with single bytes overwritten, in its place, and loads the scene: a scene
/// or one line, never a panic. 61 cuts, every third of the first 400 bytes, and one in 61 of all.
fn survive_damage(scene: &Path, damaged: &Path, good: &[u8]) {
    let load_scene = || {
        if let Err(error) = load(scene, &LoadOptions::default()) {
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    };
    for length in (0..good.len()).step_by(good.len() / 61 + 1) {
        std::fs::write(damaged, &good[..length]).unwrap();
        load_scene();
    }
    let mut bytes = good.to_vec();
    let beginning = (0..good.len().min(400)).step_by(3);
    for i in beginning.chain((400..good.len()).step_by(good.len() / 61 + 1)) {
        for wrong in [0x00, 0x7f, 0xff] {
            bytes[i] = wrong;
            std::fs::write(damaged, &bytes).unwrap();
            load_scene();
        }
        bytes[i] = good[i];
    }
}

#[test]
fn damaged_meshes_and_textures_never_panic() {
    let place = tempfile::tempdir().unwrap();
    let obj = std::fs::read(folder("scenes/meshes/table.obj")).unwrap();
    let mesh = place.path().join("mesh.obj");
    survive_damage(&mesh, &mesh, &obj);

    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(place.path().join("quad.obj"), quad).unwrap();
    let mut picture = image::RgbImage::new(9, 7);
    picture.pixels_mut().enumerate().for_each(|(i, p)| p.0 = [(i * 7) as u8, (i * 3) as u8, 200]);
    for ending in ["png", "jpg", "tga", "hdr"] {
        let texture = place.path().join(format!("texture.{ending}"));
        match ending {
            "hdr" => image::DynamicImage::ImageRgb8(picture.clone()).into_rgb32f().save(&texture).unwrap(),
            _ => picture.save(&texture).unwrap(),
        }
        let scene = place.path().join(format!("{ending}.toml"));
        let text = format!(
            "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n[environment]\nradiance = [1, 1, 1]\n\
             [textures.t]\nfile = \"texture.{ending}\"\n[materials.m]\ntype = \"diffuse\"\n\
             reflectance = {{ texture = \"t\" }}\n[[objects]]\nmesh = \"quad.obj\"\nmaterial = \"m\"\n"
        );
        std::fs::write(&scene, text).unwrap();
        let loaded = load(&scene, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((loaded.textures[0].width, loaded.textures[0].height), (9, 7), "{ending}");
        survive_damage(&scene, &texture, &std::fs::read(&texture).unwrap());
    }
}

/// A triangle with its buffer in a data URI: the smallest whole glTF.
const TRIANGLE_GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn damaged_photometric_files_never_panic() {
    let place = tempfile::tempdir().unwrap();
    let (scene, lamp) = (place.path().join("scene.toml"), place.path().join("lamp.ies"));
    let text = "[[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"m\"\n[materials.m]\n\
                type = \"mirror\"\n[[lights]]\ntype = \"photometric\"\nfile = \"lamp.ies\"\nposition = [0, 3, 0]\n";
    std::fs::write(&scene, text).unwrap();
    let good = "IESNA:LM-63-2002\nTILT=INCLUDE\n1\n2\n0 90\n1 0.9\n1 1000 1 3 2 1 2 0 0 0\n1 1 20\n0 45 90\n0 90\n\
                100 50 0\n100 70 0\n";
    std::fs::write(&lamp, good).unwrap();
    assert_eq!(load(&scene, &LoadOptions::default()).unwrap().lights.len(), 1);
    survive_damage(&scene, &lamp, good.as_bytes());
    // Every number replaced by ones that are too large, negative and not whole.
    for (start, _) in good.match_indices(|c: char| c.is_ascii_digit()) {
        for wrong in ["4294967295", "99999999999999999999", "-1", "1e39", "0.5", "nan", "", "1", "36001"] {
            std::fs::write(&lamp, format!("{}{wrong}{}", &good[..start], &good[start + 1..])).unwrap();
            if let Err(error) = load(&scene, &LoadOptions::default()) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn damaged_scenes_of_other_renderers_never_panic() {
    let place = tempfile::tempdir().unwrap();
    for ending in ["pbrt", "xml"] {
        let good = std::fs::read(folder(&format!("scenes/other-formats/cornell-box.{ending}"))).unwrap();
        let path = place.path().join(format!("scene.{ending}"));
        survive_damage(&path, &path, &good);
    }
}

/// A file of more than 64 KiB, beyond which some widths and offsets do not count.
#[test]
fn long_damaged_scenes_never_panic() {
    let lamp = |number: u32| {
        format!(
            "[[lights]]\ntype = \"point\"\nposition = [{number}, 3, 2]\n\
             keyframes = [{{ time = 0, intensity_cd = 0 }}, {{ time = 1, intensity_cd = 50 }}]\n"
        )
    };
    let thing = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n[materials.white]\ntype = \"diffuse\"\nreflectance = 0.5\n\
                 [[objects]]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = \"white\"\n";
    let good = [thing.to_owned()].into_iter().chain((0..600).map(lamp)).collect::<String>();
    assert!(good.len() > 1 << 16, "{}", good.len());
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("long.toml");
    std::fs::write(&path, &good).unwrap();
    assert_eq!(load(&path, &LoadOptions::default()).unwrap().lights.len(), 600);
    survive_damage(&path, &path, good.as_bytes());
}

#[test]
fn a_side_file_adds_what_the_scene_lacks() {
    let place = tempfile::tempdir().unwrap();
    let scene = place.path().join("quad.obj");
    std::fs::write(&scene, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap();
    let alone = load(&scene, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert!(alone.environment.is_some() && alone.nits_per_unit == 1.0);
    let side = place.path().join("quad.fechner.toml");
    let text = "nits_per_unit = 50\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n\
                [[lights]]\ntype = \"point\"\nposition = [0, 0, 2]\nintensity_cd = 100\n";
    std::fs::write(&side, text).unwrap();
    let staged = load(&scene, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((staged.lights.len(), staged.nits_per_unit), (1, 50.0));
    assert!(staged.environment.is_none() && staged.camera.position.z == 4.0);
    std::fs::write(&side, "[camra]\n").unwrap();
    let message = load(&scene, &LoadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("quad.fechner.toml:1: unknown key \"camra\"; did you mean \"camera\"?"), "{message}");
}

/// A link that leads nowhere and a folder were passed over in silence, with the lights that they were to bring.
#[cfg(unix)]
#[test]
fn a_side_file_that_is_no_file_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let scene = place.path().join("quad.obj");
    std::fs::write(&scene, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap();
    let side = place.path().join("quad.fechner.toml");
    let refused = |expected: &str| {
        let message = load(&scene, &LoadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("quad.fechner.toml: ") && message.contains(expected), "{message}");
    };
    std::os::unix::fs::symlink("nowhere", &side).unwrap();
    refused("no such file");
    std::fs::remove_file(&side).unwrap();
    std::os::unix::fs::symlink("/dev/zero", &side).unwrap();
    refused("is not a regular file");
    std::fs::remove_file(&side).unwrap();
    std::fs::create_dir(&side).unwrap();
    refused("is a directory");
}

/// Eight files of ten includes each ask for a hundred million spheres, which ended in an abort for want of memory.
#[test]
fn files_that_include_each_other_often_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let refused = |first: &str, include: fn(usize) -> String, last: &str, head: &str, foot: &str| {
        for level in 0..8 {
            let inner = if level < 7 { include(level + 1) } else { last.to_owned() };
            let (head, foot) = if level == 0 || !foot.is_empty() { (head, foot) } else { ("", "") };
            let file = place.path().join(include(level).split('"').nth(1).unwrap());
            std::fs::write(file, format!("{head}{}{foot}", inner.repeat(10))).unwrap();
        }
        let message = load(&place.path().join(first), &LoadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("more than 4000000"), "{message}");
    };
    let include = |level: usize| format!("Include \"{level}.pbrt\"\n");
    refused("0.pbrt", include, "Shape \"sphere\"\n", "Camera \"perspective\"\nWorldBegin\n", "");
    refused("0.pbrt", include, "LightSource \"point\"\n", "Camera \"perspective\"\nWorldBegin\n", "");
    let include = |level: usize| format!("<include filename=\"{level}.xml\"/>\n");
    refused("0.xml", include, "<shape type=\"sphere\"/>\n", "<scene version=\"3.0.0\">\n", "</scene>\n");
}

#[test]
fn damaged_gltf_never_panics() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("triangle.gltf");
    std::fs::write(&path, TRIANGLE_GLTF).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    survive_damage(&path, &path, TRIANGLE_GLTF.as_bytes());
    // Every number replaced by ones that are too large, negative and not whole.
    for (start, _) in TRIANGLE_GLTF.match_indices(|c: char| c.is_ascii_digit()) {
        for wrong in ["4294967295", "-1", "1e30", "0.5", "99"] {
            let text = format!("{}{wrong}{}", &TRIANGLE_GLTF[..start], &TRIANGLE_GLTF[start + 1..]);
            std::fs::write(&path, text).unwrap();
            if let Err(error) = load(&path, &LoadOptions::default()) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

/// A pipe has no header to be asked for: opening it would wait for whoever writes to it, for ever.
#[test]
#[cfg(unix)]
fn pipes_in_the_place_of_textures_are_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    assert!(std::process::Command::new("mkfifo").arg(folder.path().join("pipe.png")).status().unwrap().success());
    let mitsuba = |bsdf: &str| {
        let shape = format!("<shape type=\"rectangle\">{bsdf}</shape>");
        format!("<scene version=\"3.0.0\"><emitter type=\"constant\"/>{shape}</scene>")
    };
    let bitmap = |name: &str| {
        let file = "<string name=\"filename\" value=\"pipe.png\"/>";
        format!("<texture type=\"bitmap\" name=\"{name}\">{file}</texture>")
    };
    let rough = mitsuba(&format!("<bsdf type=\"roughplastic\">{}</bsdf>", bitmap("alpha")));
    let masked = mitsuba(&format!("<bsdf type=\"mask\">{}<bsdf type=\"diffuse\"/></bsdf>", bitmap("opacity")));
    let metal = "WorldBegin\nLightSource \"infinite\"\nTexture \"t\" \"float\" \"imagemap\" \"string filename\" \"pipe.png\"\n\
                 Material \"conductor\" \"texture roughness\" \"t\"\nShape \"sphere\"\n";
    for (name, text) in [("rough.xml", rough.as_str()), ("masked.xml", &masked), ("metal.pbrt", metal)] {
        std::fs::write(folder.path().join(name), text).unwrap();
        let mut command = std::process::Command::new("timeout");
        command.current_dir(folder.path()).args(["60", env!("CARGO_BIN_EXE_fechner"), "render", name]);
        command.args(["--size", "8x8", "--spp", "1", "-o", "a.png"]);
        assert_refused(&mut command, &["pipe.png: is not a regular file"]);
    }
}
