//! Denoised pictures as a user gets them.

use crate::support::command::{self, cornell_box, fechner};
use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::audit::{Audit, audit, audit_unproven};
use fechner::adaptive::settings::{DENOISED_PILOT_SAMPLES_PER_PIXEL, Limits, LoopSettings, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Quiet, Rendered, render as render_scene, resume, run};
use fechner::denoise::{Denoiser, NoisyPicture, Oidn, SurfaceGuides};
use fechner::exr_read::read_exr;
use fechner::film::{Film, opponent};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::output::ChannelValues;
use fechner::output::rendered::{Background, layers};
use fechner::sampler::Half;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::{Plane, seen};
use std::path::Path;
use std::sync::Arc;

/// Renders the Cornell box at 48×48 with these arguments.
fn render(folder: &Path, file: &str, arguments: &[&str]) -> Vec<u8> {
    let path = folder.join(file);
    let mut command = fechner();
    command.arg("render").arg(cornell_box()).args(["--size", "48x48", "-o"]).arg(&path).args(arguments);
    command::run(&mut command);
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

/// Of a picture in which nothing is called fine, nothing of that is unproven.
#[test]
fn the_summary_says_nothing_of_what_is_not_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = fechner();
    command.args([
        "render",
        "scenes/cornell-glass.toml",
        "--size",
        "32x32",
        "--spp",
        "2",
        "--denoise",
        "builtin",
        "-o",
    ]);
    let output = command.arg(folder.path().join("a.png")).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let said = String::from_utf8_lossy(&output.expect("runs").stderr).into_owned();
    assert!(said.contains("100.00 % of the picture is above") && !said.contains("Unproven"), "{said}");
}

/// A part of the error is not more than the whole: both are of the picture that is written, after it was moved
/// towards the raw mean. What the denoiser changed was up to 1.18 times the whole here.
#[test]
fn no_part_of_the_error_is_more_than_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let (picture, json) = (folder.path().join("a.exr"), folder.path().join("a.json"));
    let output = fechner()
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["render", "scenes/glass-caustic.toml", "--size", "96x72", "--spp", "128"])
        .args(["--sampling", "uniform", "--denoise", "builtin", "-o"])
        .arg(&picture)
        .arg("--json")
        .arg(&json)
        .output()
        .expect("runs");
    let exr = read_exr(&picture).expect("reads");
    let channel = |name: &str| exr.channel(name).unwrap_or_else(|| panic!("{name} is there"));
    for part in ["visibility_variance.Y", "visibility_bias.Y"] {
        let worst =
            channel(part).iter().zip(channel("visibility.Y")).map(|(part, whole)| part / whole).fold(0.0, f32::max);
        assert!(worst < 1.001, "{part} is up to {worst} times the whole");
    }

    // And what light the denoiser lost is told.
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(json).expect("a report")).expect("JSON");
    let mean = |layer: &str| -> f64 {
        let weights = [("R", 0.2126), ("G", 0.7152), ("B", 0.0722)];
        let of = |(name, weight): (&str, f64)| {
            weight * channel(&format!("{layer}{name}")).iter().map(|&value| f64::from(value)).sum::<f64>()
        };
        weights.into_iter().map(of).sum()
    };
    let (change, expected) =
        (report["denoised"]["energy_change"].as_f64().expect("a number"), mean("") / mean("raw.") - 1.0);
    assert!((change - expected).abs() < 1e-4, "{change}, not {expected}");
    let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert_eq!(said.contains("less light than the raw mean"), change < -0.005, "{change}: {said}");
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

/// A render that leaves off after some plan, between two looks too, and goes on is the one that never did.
#[test]
fn a_denoised_render_may_leave_off_between_looks() {
    let path = cornell_box();
    let scene = Arc::new(load(&path, &LoadOptions::default()).expect("loads"));
    let settings = |plans: Option<u32>| {
        let settings = loop_settings(scene.nits_per_unit, Sampling::Adaptive, 2.0, Some(40));
        let limits = Limits { plans, pilot_samples: DENOISED_PILOT_SAMPLES_PER_PIXEL, ..settings.limits };
        LoopSettings { denoiser: Some(Denoiser::Builtin), limits, ..settings }
    };
    let tracer = PathTracer::new(Arc::clone(&scene), trace_settings(48, 48, 1));
    let straight = render_scene(&tracer, &settings(None), &Quiet).expect("renders");
    for plans in (1..straight.plans).step_by(9) {
        let state = RenderState::new(48, 48, &settings(None).limits);
        let left = run(&tracer, &settings(Some(plans)), state, &Quiet).expect("renders").state;
        assert_eq!(left.plans, plans);
        let resumed = resume(&tracer, &settings(None), left, &Quiet).expect("renders");
        assert!(resumed.film == straight.film, "after {plans} of {} plans", straight.plans);
    }
}

/// Where something shines is known: the box's lamp, and nothing that it lights.
#[test]
fn lamps_are_known() {
    let path = cornell_box();
    let scene = Arc::new(load(&path, &LoadOptions::default()).expect("loads"));
    let tracer = PathTracer::new(scene, trace_settings(48, 48, 1));
    let mut film = Film::new(48, 48);
    fechner::benchmark::trace_up_to(&tracer, &mut film, 8);
    let pixels = || (0..48 * 48).map(|pixel| (film.features()[pixel].object.shines(), film.rgb_cd_m2(pixel, 1.0)[1]));
    let brightest = pixels().fold((false, 0.0), |most: (bool, f32), pixel| if pixel.1 > most.1 { pixel } else { most });
    assert!(brightest.0, "the lamp: {brightest:?}");
    let others = pixels().filter(|&(shines, value)| !shines && value > 0.0).count();
    assert!(others > 48 * 48 / 2, "{others}");
}

#[test]
fn a_library_that_is_not_there_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("a.png");
    let output = fechner()
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

/// The library; `None`, with a message, where it is not installed and nobody says that it is (`FECHNER_REQUIRE_OIDN`).
fn installed_oidn() -> Option<Oidn> {
    let is_required = std::env::var_os("FECHNER_REQUIRE_OIDN").is_some();
    match Oidn::open(1) {
        Ok(library) => Some(library),
        Err(error) if is_required => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// Skipped with a message where the library is not installed.
#[test]
fn open_image_denoise_removes_noise_and_repeats_itself() {
    let Some(one) = installed_oidn() else { return };
    let (width, height) = (96, 64);
    let mut state = 7u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / 8_388_608.0 - 1.0
    };
    // A wall of bricks four pixels wide and two high under even light, with noise of 35 %.
    let albedo: Vec<f32> =
        (0..width * height).map(|i| if (i % width / 4 + i / width / 2) % 2 == 0 { 0.4 } else { 0.6 }).collect();
    let rgb: Vec<[f32; 3]> = albedo.iter().map(|&albedo| [100.0 * albedo * (1.0 + 0.6 * random()); 3]).collect();
    let denoised = |library: &Oidn, samples: f64| {
        let denoiser = Denoiser::Oidn(library.clone());
        let guides = SurfaceGuides {
            width,
            height,
            albedo: albedo.iter().map(|&value| [value; 3]).collect(),
            normal: vec![[0.0, 0.0, 1.0]; width * height],
            depth: vec![1.0; width * height],
            shines: vec![false; width * height],
            samples,
            samples_of_picture: samples,
        };
        let guides = denoiser.prepare(guides).expect("prepares");
        let variance = Plane::filled(width, height, 300.0);
        denoiser.denoise(&NoisyPicture { rgb: &rgb, variance: &variance, guides: &guides }).expect("denoises")
    };
    let deviation = |denoised: &[[f32; 3]]| {
        let squares = denoised.iter().zip(&albedo).map(|(rgb, albedo)| (rgb[1] - 100.0 * albedo).powi(2));
        (squares.sum::<f32>() / denoised.len() as f32).sqrt()
    };
    let first = denoised(&one, 4.0);
    // 1.5 where the library takes the guides for noisy, 1.4 where a small network denoises them, 0.8 where it trusts
    // them.
    for deviation in [deviation(&first), deviation(&denoised(&one, 64.0))] {
        assert!(deviation < 1.1, "{deviation} of 17, and bricks 10 to each side of their mean");
    }
    assert_eq!(first, denoised(&one, 4.0), "the same on one thread");
    assert_eq!(first, denoised(&Oidn::open(2).expect("opens again"), 4.0), "the same on two");
}

/// An even grey of one pixel lost 74 % of its light, one of 2×2 won 37 %, of 3×3 25 %, of 5×5 3 %, of 1×32 9 %.
/// Skipped with a message where the library is not installed.
#[test]
fn open_image_denoise_keeps_the_light_of_small_pictures() {
    let Some(library) = installed_oidn() else { return };
    let denoiser = Denoiser::Oidn(library);
    for (width, height) in [(1, 1), (2, 2), (3, 3), (5, 5), (1, 32), (32, 1), (15, 16)] {
        let pixels = width * height;
        // With guides that are denoised before, and with those that are not.
        for samples in [4.0, 64.0] {
            let guides = SurfaceGuides {
                width,
                height,
                albedo: vec![[0.5; 3]; pixels],
                normal: vec![[0.0, 0.0, 1.0]; pixels],
                depth: vec![1.0; pixels],
                shines: vec![false; pixels],
                samples,
                samples_of_picture: samples,
            };
            let guides = denoiser.prepare(guides).expect("prepares");
            let (rgb, variance) = (vec![[100.0; 3]; pixels], Plane::filled(width, height, 300.0));
            let picture = NoisyPicture { rgb: &rgb, variance: &variance, guides: &guides };
            let denoised = denoiser.denoise(&picture).expect("denoises");
            assert_eq!(denoised.len(), pixels);
            let mean = denoised.iter().map(|rgb| rgb[1]).sum::<f32>() / pixels as f32;
            assert!((mean - 100.0).abs() < 2.0, "{width}×{height} at {samples} samples: {mean} of 100");
        }
    }
}

/// A scene, denoised by our own filter and judged as if no place had a witness of its own.
struct DenoisedScene {
    scene: Arc<Scene>,
    tracer: PathTracer,
    settings: LoopSettings,
    rendered: Rendered,
}

impl DenoisedScene {
    const WIDTH: u32 = 416;
    const HEIGHT: u32 = 416;

    fn of(name: &str, spp: u32, seed: u64) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let scene = Arc::new(load(&path, &LoadOptions::default()).expect("loads"));
        let settings = loop_settings(scene.nits_per_unit, Sampling::Uniform, None, Some(spp));
        let settings = LoopSettings { denoiser: Some(Denoiser::Builtin), ..settings };
        let tracer = PathTracer::new(Arc::clone(&scene), trace_settings(Self::WIDTH, Self::HEIGHT, seed));
        let mut rendered = render_scene(&tracer, &settings, &Quiet).expect("renders");
        let denoised = rendered.judgement.denoised.as_mut().expect("denoised");
        let nothing_known = Plane::filled(Self::WIDTH as usize, Self::HEIGHT as usize, f32::MAX);
        denoised.error.bias_squared_standard_error = nothing_known;
        Self { scene, tracer, settings, rendered }
    }

    /// A target that so much of the picture meets.
    fn target_met_by(&self, share: f64) -> f64 {
        let denoised = self.rendered.judgement.denoised.as_ref().expect("denoised");
        let mut values = denoised.error.visibility.values().to_vec();
        values.sort_by(f32::total_cmp);
        f64::from(values[(share * values.len() as f64) as usize])
    }

    fn audited(&self, target: f64, round: u32) -> Audit {
        audit_unproven(&self.tracer, &self.rendered.film, &self.rendered.judgement, &self.settings, target, round)
            .expect("never outdated")
            .expect("unproven in some tiles")
    }
}

/// What matters half as much may show twice as much of either part of the error, in the file as in the stop.
#[test]
fn importance_goes_for_both_parts_of_the_error() {
    let path = cornell_box();
    let scene = Arc::new(load(&path, &LoadOptions::default()).expect("loads"));
    let parts = |importance: Option<Plane>| {
        let settings = loop_settings(scene.nits_per_unit, Sampling::Uniform, None, Some(4));
        let settings = LoopSettings { denoiser: Some(Denoiser::Builtin), importance, ..settings };
        let tracer = PathTracer::new(Arc::clone(&scene), trace_settings(32, 32, 1));
        let rendered = render_scene(&tracer, &settings, &Quiet).expect("renders");
        let picture = layers(&rendered, &settings, Background::Shown, &[]);
        ["visibility_variance.Y", "visibility_bias.Y"].map(|name| {
            match picture.channels.iter().find(|channel| channel.name == name).map(|channel| &channel.values) {
                Some(ChannelValues::F32(values)) => values.to_vec(),
                _ => panic!("{name} is a channel of floats"),
            }
        })
    };
    let halved = parts(None).map(|values| values.iter().map(|value| 0.5 * value).collect::<Vec<f32>>());
    assert!(halved[0].iter().all(|&value| value > 0.0));
    assert_eq!(parts(Some(Plane::filled(32, 32, 2.0))), halved);
}

/// A denoiser that does nothing leaves the raw noise, which the variance predicts; one that draws stripes is found out.
#[test]
fn an_audit_finds_what_a_denoiser_makes_up() {
    let mut scene = DenoisedScene::of("cornell-box", 16, 3);
    let settings = loop_settings(scene.scene.nits_per_unit, Sampling::Uniform, None, Some(16));
    let raw = render_scene(&scene.tracer, &settings, &Quiet).expect("renders");
    let audited_raw = audit(&scene.tracer, &raw.film, &raw.judgement, &settings, 0).expect("never outdated");
    let raw = raw.judgement;
    let denoised = scene.rendered.judgement.denoised.as_mut().expect("denoised");
    denoised.luminance_cd_m2 = raw.estimate.luminance_cd_m2;
    denoised.error.visibility = raw.predicted.clone();
    denoised.error.visibility = raw.predicted;
    let honest = scene.audited(1e3, 0);
    println!("{honest:?}, raw {audited_raw:?}");
    // Other tiles, by the same measure but for the window. Below 1, since colour is predicted too and luminance alone
    // is found.
    let ratio_of_raw = audited_raw.expect("large enough to audit").ratio;
    assert!((honest.ratio / ratio_of_raw - 1.0).abs() < 0.3 && !honest.disagrees(), "{honest:?}, {ratio_of_raw}");

    let denoised = scene.rendered.judgement.denoised.as_mut().expect("denoised");
    // Stripes of about 5 cycles a degree.
    let stripes = |x: usize| 1.0 + 0.2 * (x as f32 / 2.0).cos();
    let picture = &denoised.luminance_cd_m2;
    denoised.luminance_cd_m2 = Plane::from_fn(picture.width(), picture.height(), |x, y| stripes(x) * picture.get(x, y));
    // Six tiles of very different contrast a round: one round of twelve has an error that just reaches to 1.
    let deceived: Vec<Audit> = (0..5).map(|round| scene.audited(1e3, round)).collect();
    println!("{deceived:?}");
    assert!(deceived.iter().filter(|audit| audit.disagrees()).count() >= 4, "{deceived:?}");
    assert!(deceived.iter().all(|audit| audit.ratio > honest.ratio + 1.0), "{deceived:?}");
}

fn half_luminance(film: &Film, half: Half, nits_per_unit: f64) -> Plane {
    Plane::from_fn(film.width() as usize, film.height() as usize, |x, y| {
        let mean = film.half(half)[y * film.width() as usize + x].mean;
        (nits_per_unit * opponent(mean)[0]) as f32
    })
}

/// The audits' mean over rounds of other tiles and other samples is what a reference says of all that is unproven.
#[test]
#[ignore = "a reference of 512 samples a pixel, a minute or more each scene"]
fn audits_of_unproven_tiles_agree_with_a_reference() {
    const ROUNDS: u32 = 12;
    /// Student's t of eleven degrees of freedom, 99 % on both sides together: rounds scatter by three times what they
    /// say in the mean.
    const WITHIN_STANDARD_ERRORS: f64 = 3.106;
    for (name, spp) in [("cornell-box", 16), ("cornell-glass", 16), ("many-lights", 16)] {
        let scene = DenoisedScene::of(name, spp, 5);
        let target = scene.target_met_by(0.9);
        let judgement = &scene.rendered.judgement;
        let denoised = judgement.denoised.as_ref().expect("denoised");
        let ratios: Vec<f64> = (0..ROUNDS).map(|round| scene.audited(target, round).ratio).collect();
        let mean = ratios.iter().sum::<f64>() / f64::from(ROUNDS);
        let squares = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>();
        let scatter = (squares / f64::from(ROUNDS - 1)).sqrt();

        let settings = TraceSettings { seed: 77, ..*scene.tracer.settings() };
        let truth = PathTracer::new(Arc::clone(&scene.scene), settings);
        let mut film = Film::new(DenoisedScene::WIDTH, DenoisedScene::HEIGHT);
        fechner::benchmark::trace_up_to(&truth, &mut film, 512);
        let nits = scene.settings.nits_per_unit;
        let [a, b] = Half::BOTH.map(|half| half_luminance(&film, half, nits));
        let reference = a.combined(&b, |a, b| 0.5 * (a + b));
        let display = &scene.settings.viewing.display;
        let slope = seen::display_slope(judgement.tone.as_ref(), display, &denoised.luminance_cd_m2);
        let [found, noise] = [
            denoised.luminance_cd_m2.combined(&reference, |denoised, truth| denoised - truth),
            a.combined(&b, |a, b| 0.5 * (a - b)),
        ]
        .map(|error| {
            judgement.thresholds.in_bands.measured_visibility(&error.combined(&slope, |error, slope| error * slope))
        });
        let unproven = denoised.error.unproven(target);
        let energy = |visibility: &Plane| {
            let values = visibility.values().iter().zip(unproven.values());
            values.map(|(&v, &share)| f64::from(share * v * v)).sum::<f64>()
        };
        let true_ratio = (energy(&found) - energy(&noise)) / energy(&denoised.error.visibility);
        let standard_error = scatter / f64::from(ROUNDS).sqrt();
        println!(
            "| {name} | {spp} | {:.1} % | {true_ratio:.2} | {mean:.2} ± {standard_error:.2} | {scatter:.2} |",
            100.0 * unproven.mean(),
        );
        // Where audits scatter so widely they agree with anything.
        if standard_error > true_ratio.abs() {
            continue;
        }
        assert!(
            (mean - true_ratio).abs() < WITHIN_STANDARD_ERRORS * standard_error,
            "{name}: audits say {mean:.2} ± {standard_error:.2} of what is {true_ratio:.2}: {ratios:.2?}"
        );
    }
}
