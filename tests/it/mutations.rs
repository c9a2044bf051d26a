//! Thousands of damaged files a format, loaded in a child process with limits of memory and time (ignored: minutes).

use fechner::scene::load::{LoadOptions, load};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Damaged files of each good one.
const MUTATIONS: u64 = 10_000;

/// The good files: one or two of each format.
fn good_files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<PathBuf> =
        ["other-formats/cornell-box.pbrt", "other-formats/cornell-box.xml", "cornell-box.toml"]
            .iter()
            .map(|name| root.join("scenes").join(name))
            .collect();
    if let Some(assets) = crate::load_assets::assets() {
        let more = [
            "scenes-pbrt/staircase2/models/Mesh010.ply",
            "gltf/CornellBox/CornellBox.glb",
            "gltf/SimpleSkin/SimpleSkin.gltf",
            "scenes-pbrt/veach-ajar/models/light.ply",
            "obj/tinyobjloader-models/cornell_box.obj",
            "obj/tinyobjloader-models/cornell_box.mtl",
        ];
        files.extend(more.iter().map(|name| assets.join(name)).filter(|file| file.is_file()));
    }
    // One part of a name, to run a format alone.
    let only = std::env::var("FECHNER_MUTATE_ONLY").unwrap_or_default();
    files.retain(|file| file.to_string_lossy().contains(&only));
    files
}

/// A generator that needs no crate: Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }
}

fn mutate(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let length = random.below(40).min(bytes.len() - at);
        match random.below(7) {
            0 => bytes.truncate(at),
            1 => _ = bytes.drain(at..at + length),
            2 => {
                let copy = bytes[at..at + length].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            3 => bytes[at..at + length].iter_mut().for_each(|byte| *byte = random.below(256) as u8),
            4 => bytes.insert(at, random.below(256) as u8),
            5 => {
                // A digit becomes a number that nobody expects.
                if let Some(digit) = bytes[at..].iter().position(u8::is_ascii_digit) {
                    let extremes = ["99999999999999999999", "-1", "1e39", "nan", "0", "1e-45", "4294967295", ""];
                    let extreme = extremes[random.below(extremes.len())].bytes();
                    bytes.splice(at + digit..=at + digit, extreme);
                }
            }
            _ => bytes[at] ^= 1 << random.below(8),
        }
        if bytes.is_empty() {
            return vec![b' '];
        }
    }
    bytes
}

/// The child: loads the mutations of the file in FECHNER_MUTATE.
#[test]
#[ignore = "started by thousands_of_mutations_end_well"]
fn child() {
    let Some(file) = std::env::var_os("FECHNER_MUTATE").map(PathBuf::from) else { return };
    let good = std::fs::read(&file).unwrap();
    let place = tempfile::tempdir().unwrap();
    // What the scene refers to is there, so that damage reaches beyond the first missing file.
    for beside in std::fs::read_dir(file.parent().unwrap()).unwrap().flatten() {
        let small = beside.metadata().is_ok_and(|data| data.is_file() && data.len() < 1 << 20);
        if small {
            _ = std::fs::copy(beside.path(), place.path().join(beside.file_name()));
        }
    }
    let path = place.path().join(file.file_name().unwrap());
    // Materials are read through the mesh that names them.
    let scene = if path.extension().is_some_and(|e| e == "mtl") { path.with_extension("obj") } else { path.clone() };
    let mut loaded = 0;
    for number in 0..MUTATIONS {
        let mut random = Random(number.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        (0..4).for_each(|_| _ = random.below(1));
        std::fs::write(&path, mutate(&good, &mut random)).unwrap();
        match load(&scene, &LoadOptions::default()) {
            Ok(_) => loaded += 1,
            Err(error) => assert!(!error.to_string().contains('\n'), "mutation {number}: {error}"),
        }
    }
    println!("{loaded} of {MUTATIONS} loaded: {}", file.display());
}

/// `cargo test --release -p fechner --test it thousands_of_mutations -- --ignored --nocapture`
#[test]
#[ignore = "minutes"]
fn thousands_of_mutations_end_well() {
    let program = std::env::current_exe().unwrap();
    for file in good_files() {
        // 4 GiB of memory, 10 minutes of processor: an endless loop or a bomb ends the child.
        let script = "ulimit -v 4194304; ulimit -t 600; exec \"$0\" --ignored --exact mutations::child --nocapture";
        let output = Command::new("sh")
            .args(["-c", script])
            .arg(&program)
            .env("FECHNER_MUTATE", &file)
            .env("RAYON_NUM_THREADS", "1")
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        println!("{}", said.lines().find(|line| line.contains("loaded")).unwrap_or("no result"));
        assert!(output.status.success(), "{}: {said}{}", file.display(), String::from_utf8_lossy(&output.stderr));
    }
}
