//! Denoised pictures as a user gets them.

use assert_cmd::Command;
use fechner::denoise::{Denoiser, NoisyPicture, Oidn};
use fechner::exr_read::read_exr;
use fechner_perception::Plane;
use std::path::Path;

/// Renders the Cornell box at 48×48 with these arguments.
fn render(folder: &Path, file: &str, arguments: &[&str]) -> Vec<u8> {
    let path = folder.join(file);
    Command::cargo_bin("fechner")
        .expect("the program")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["render", "scenes/cornell-box.toml", "--size", "48x48", "-o"])
        .arg(&path)
        .args(arguments)
        .assert()
        .success();
    std::fs::read(path).expect("a picture")
}

/// The mean is in the file to the bit, beside a picture that is another.
#[test]
fn the_raw_mean_stays_beside_the_denoised_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let few = ["--spp", "4", "--sampling", "uniform"];
    render(folder.path(), "raw.exr", &few);
    render(folder.path(), "denoised.exr", &[&few[..], &["--denoise", "builtin"]].concat());
    let [raw, denoised] = ["raw.exr", "denoised.exr"].map(|name| read_exr(&folder.path().join(name)).expect("reads"));
    for channel in ["R", "G", "B"] {
        let kept = denoised.channel(&format!("raw.{channel}")).expect("a raw layer");
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(raw.channel(channel).expect("a picture")), bits(kept));
        assert_ne!(raw.channel(channel), denoised.channel(channel));
    }
    let channel = |name: &str| denoised.channel(name).unwrap_or_else(|| panic!("{name} is there"));
    assert!(channel("unproven.Y").iter().all(|&value| value == 0.0 || value == 1.0));
    let parts = channel("visibility_variance.Y").iter().zip(channel("visibility_bias.Y"));
    assert!(parts.zip(channel("visibility.Y")).all(|((a, b), v)| *v <= 1.001 * a.hypot(*b)), "both parts and no more");
}

#[test]
fn threads_change_no_byte_of_a_denoised_render() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = |threads: &str| {
        let arguments = ["--visibility", "4", "--max-spp", "64", "--denoise", "builtin", "--threads", threads];
        render(folder.path(), &format!("{threads}.exr"), &arguments)
    };
    assert!(made("1") == made("3"), "files differ");
}

#[test]
fn a_library_that_is_not_there_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("a.png");
    let output = Command::cargo_bin("fechner")
        .expect("the program")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("OIDN_DIR", folder.path())
        .args(["render", "scenes/cornell-box.toml", "--size", "16x16", "--denoise", "oidn", "-o"])
        .arg(&picture)
        .output()
        .expect("runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    for hint in ["OIDN_DIR", "pip install pyoidn", "--denoise builtin"] {
        assert!(message.contains(hint), "{message}");
    }
    assert!(!picture.exists());
}

/// Skipped with a message where the library is not installed.
#[test]
fn open_image_denoise_removes_noise_and_repeats_itself() {
    let one = match Oidn::open(1) {
        Ok(library) => library,
        Err(error) => return eprintln!("skipped: {error}"),
    };
    let (width, height) = (96, 64);
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / 8_388_608.0 - 1.0
    };
    let rgb: Vec<[f32; 3]> = (0..width * height).map(|_| [50.0 + 30.0 * random(); 3]).collect();
    let picture = NoisyPicture {
        width,
        height,
        rgb: &rgb,
        variance: &Plane::filled(width, height, 300.0),
        albedo: &vec![[0.5; 3]; width * height],
        normal: &vec![[0.0, 0.0, 1.0]; width * height],
        depth: &vec![1.0; width * height],
    };
    let denoised = |library: &Oidn| Denoiser::Oidn(library.clone()).denoise(&picture).expect("denoises");
    let first = denoised(&one);
    let deviation = (first.iter().map(|rgb| (rgb[1] - 50.0).powi(2)).sum::<f32>() / first.len() as f32).sqrt();
    assert!(deviation < 5.0, "{deviation} of 17");
    assert_eq!(first, denoised(&one), "the same on one thread");
    assert_eq!(first, denoised(&Oidn::open(2).expect("opens again")), "the same on two");
}
