//! Renders that were stopped, killed, continued and merged, against renders in one go.

use crate::support::command::repository_scene;
use crate::support::{load_cornell_box, loop_settings, trace_settings};
use fechner::adaptive::settings::{DENOISED_PILOT_SAMPLES_PER_PIXEL, Limits, LoopSettings, RivalRule, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, Quiet, Rendered, StopReason, render, resume, run};
use fechner::checkpoint::{
    Checkpoint, Header, Origin, Seeds, SettingsRecord, decode_checkpoint, merge_files, read_checkpoint, seal,
    write_checkpoint,
};
use fechner::denoise::{Denoiser, DenoiserKind};
use fechner::film::Film;
use fechner::integrator::{PathTracer, SamplePlan};
use fechner::sampler::Half;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::csf::FrameTiming;
use fechner_perception::eccentricity::Gaze;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

const SIZE: u32 = 40;

struct Setup {
    tracer: PathTracer,
    header: Header,
}

impl Setup {
    fn new(seed: u64) -> Self {
        let scene = load_cornell_box();
        let settings = trace_settings(SIZE, SIZE, seed);
        let like = loop_settings(scene.nits_per_unit, Sampling::Adaptive, 4.0, None);
        let header = Header {
            origin: Origin::of(&scene, &settings),
            seeds: Seeds::one(seed),
            settings: SettingsRecord::new(like.viewing, like.nits_per_unit, "constant"),
            visibility: 4.0,
            earlier_visibilities: Vec::new(),
        };
        Self { tracer: PathTracer::new(Arc::new(scene), settings), header }
    }

    fn settings(&self, sampling: Sampling, visibility: impl Into<Option<f64>>) -> LoopSettings {
        loop_settings(self.header.settings.nits_per_unit, sampling, visibility, None)
    }

    /// The state as it comes back from a file.
    fn through_a_file(&self, state: &RenderState) -> RenderState {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.film");
        let length = write_checkpoint(&path, &self.header, state).expect("written");
        assert_eq!(path.metadata().expect("a file").len(), length);
        let back = read_checkpoint(&path).expect("sound");
        assert_eq!(back.header, self.header);
        assert_eq!(back.state, *state);
        back.state
    }
}

/// Stops after some batches, and keeps the last state.
struct Interrupter {
    batches_left: AtomicU32,
    last: Mutex<Option<RenderState>>,
}

impl Interrupter {
    fn after(batches: u32) -> Self {
        Self { batches_left: AtomicU32::new(batches), last: Mutex::new(None) }
    }

    fn state(self) -> RenderState {
        self.last.into_inner().expect("no panic").expect("the render ended")
    }
}

impl Monitor for Interrupter {
    fn looked(&self, _: &Progress) {}
    fn samples_done(&self, _: u64) {}
    fn between_batches(&self, _: &RenderState) -> Directive {
        if self.batches_left.fetch_sub(1, Ordering::Relaxed) == 1 { Directive::Stop } else { Directive::GoOn }
    }
    fn ended(&self, state: &RenderState, _: StopReason) {
        *self.last.lock().expect("no panic") = Some(state.clone());
    }
}

fn assert_same(one: &Rendered, other: &Rendered) {
    assert_eq!(one.film, other.film);
    assert_eq!(one.judgement.predicted, other.judgement.predicted);
    assert_eq!(one.judgement.tone.describe(), other.judgement.tone.describe());
    assert_eq!((one.plans, one.inflation, one.audit), (other.plans, other.inflation, other.audit));
    assert_eq!(one.stop_reason, other.stop_reason);
}

/// Stopped at visibility 8 and continued to 4, by way of a file, is 4 in one go, and 1 continued to 0.5 is 0.5; so it
/// is when `--plans` stopped it, and where each look is a bound that depends on how many there were.
#[test]
fn a_render_that_is_continued_equals_one_in_one_go() {
    let setup = Setup::new(5);
    for (first, target, confidence) in [(8.0, 4.0, None), (1.0, 0.5, None), (8.0, 4.0, Some(0.95))] {
        let to = |visibility: f64| {
            let mut settings = setup.settings(Sampling::Adaptive, visibility);
            settings.limits.confidence = confidence;
            settings
        };
        let in_one_go = render(&setup.tracer, &to(target), &Quiet).expect("renders");
        let mut by_plans = to(target);
        by_plans.limits.plans = Some(in_one_go.plans - 2);
        for limited in [to(first), by_plans] {
            let monitor = Interrupter::after(u32::MAX);
            let stopped = render(&setup.tracer, &limited, &monitor).expect("renders");
            assert!(stopped.plans < in_one_go.plans);
            let continued = resume(&setup.tracer, &to(target), setup.through_a_file(&monitor.state()), &Quiet);
            assert_same(&continued.expect("goes on"), &in_one_go);
        }
    }
}

/// So it is where looks at a denoised picture are far apart: the one that ended the first part is the straight way's,
/// too.
#[test]
fn a_denoised_render_that_is_continued_equals_one_in_one_go() {
    let path = repository_scene("product.toml");
    let scene = load(&path, &LoadOptions::default()).expect("our own scene");
    let nits_per_unit = scene.nits_per_unit;
    let tracer = PathTracer::new(Arc::new(scene), trace_settings(48, 48, 0));
    let to = |visibility: f64| {
        let mut settings = loop_settings(nits_per_unit, Sampling::Adaptive, visibility, None);
        settings.denoiser = Some(Denoiser::open(DenoiserKind::Builtin).expect("built in"));
        settings.limits.pilot_samples = DENOISED_PILOT_SAMPLES_PER_PIXEL;
        settings.limits.mean_samples = Some(150);
        settings
    };
    let monitor = Interrupter::after(u32::MAX);
    let stopped = render(&tracer, &to(2.0), &monitor).expect("renders");
    assert_eq!(stopped.stop_reason, StopReason::Visibility);
    let continued = resume(&tracer, &to(1.0), monitor.state(), &Quiet).expect("goes on");
    assert_same(&continued, &render(&tracer, &to(1.0), &Quiet).expect("renders"));
}

/// A render that goes on to fewer samples than were planned takes no more than it may now; with nothing traced, its
/// pilot is cut.
#[test]
fn tighter_limits_hold_for_what_was_planned() {
    let setup = Setup::new(5);
    let mut by_plans = setup.settings(Sampling::Adaptive, 1.0);
    by_plans.limits.plans = Some(2);
    let monitor = Interrupter::after(u32::MAX);
    render(&setup.tracer, &by_plans, &monitor).expect("renders");
    let state = monitor.state();
    let samples = |film: &Film| (0..(SIZE * SIZE) as usize).map(|pixel| film.samples(pixel)).max();
    assert!(state.untraced_blocks().next().is_some() && samples(&state.film) > Some(20));
    let go_on = |state: RenderState, limit: fn(&mut Limits)| {
        let mut settings = setup.settings(Sampling::Adaptive, 1.0);
        limit(&mut settings.limits);
        resume(&setup.tracer, &settings, state, &Quiet).expect("goes on")
    };
    let pixels = u64::from(SIZE * SIZE);
    let by_budget = go_on(state.clone(), |limits| limits.mean_samples = Some(20));
    let total = by_budget.film.total_samples();
    assert!(total > 19 * pixels && total <= 20 * pixels, "{} a pixel", total as f64 / pixels as f64);
    let capped = go_on(state.clone(), |limits| limits.max_samples = 24);
    let most = samples(&capped.film).max(samples(&state.film));
    assert!(most <= samples(&state.film).max(Some(24)), "{most:?}");
    let had = |film: &Film, pixel: usize| film.samples(pixel) > 24;
    let more = (0..pixels as usize).filter(|&pixel| had(&capped.film, pixel) && !had(&state.film, pixel)).count();
    assert_eq!(more, 0, "pixels above --max-spp");
    let fresh = RenderState::new(SIZE, SIZE, &by_plans.limits);
    assert_eq!(go_on(fresh, |limits| limits.mean_samples = Some(4)).film.total_samples(), 4 * pixels);
}

/// The film keeps the fit of the tone operator that its last look used.
#[test]
fn the_tone_fit_is_saved() {
    let setup = Setup::new(8);
    let monitor = Interrupter::after(3);
    let stopped = render(&setup.tracer, &setup.settings(Sampling::Adaptive, 8.0), &monitor).expect("renders");
    let saved = setup.through_a_file(&monitor.state()).tone.expect("a fit").restore();
    for luminance in [0.1, 3.0, 40.0, 900.0] {
        assert_eq!(saved.relative_luminance(luminance), stopped.judgement.tone.relative_luminance(luminance));
    }
    assert_eq!(saved.describe(), stopped.judgement.tone.describe());
}

/// Interrupted after every single batch, for a rule that looks seldom too.
#[test]
fn interruptions_change_no_bit() {
    let setup = Setup::new(6);
    let relative = Sampling::Rival(RivalRule::Relative { threshold: 0.08 });
    for (sampling, visibility) in [(Sampling::Adaptive, 6.0), (Sampling::Uniform, 8.0), (relative, 1.0)] {
        let settings = setup.settings(sampling, visibility);
        let in_one_go = render(&setup.tracer, &settings, &Quiet).expect("renders");
        let mut state = RenderState::new(SIZE, SIZE, &settings.limits);
        let mut interruptions = 0;
        let interrupted = loop {
            let monitor = Interrupter::after(1);
            let rendered = resume(&setup.tracer, &settings, state, &monitor).expect("goes on");
            if rendered.stop_reason != StopReason::Interrupted {
                break rendered;
            }
            interruptions += 1;
            state = setup.through_a_file(&monitor.state());
        };
        assert!(interruptions >= in_one_go.plans, "{sampling:?}: {interruptions} interruptions");
        assert_same(&interrupted, &in_one_go);
    }
}

/// A batch that ends within a plan, as in renders too long for a test.
#[test]
fn a_state_within_a_plan_goes_on_to_the_same_film() {
    let setup = Setup::new(7);
    let settings = setup.settings(Sampling::Adaptive, 8.0);
    let in_one_go = render(&setup.tracer, &settings, &Quiet).expect("renders");
    let mut state = RenderState::new(SIZE, SIZE, &settings.limits);
    let some = SamplePlan { blocks: state.pending[0].blocks[..1001].to_vec() };
    setup.tracer.trace(&some, &mut state.film, &|_| {});
    state.traced_blocks = 1001;
    let continued = resume(&setup.tracer, &settings, setup.through_a_file(&state), &Quiet).expect("goes on");
    assert_same(&continued, &in_one_go);
}

fn uniform_film(setup: &Setup, spp: u32) -> RenderState {
    let mut settings = setup.settings(Sampling::Uniform, None);
    settings.limits.mean_samples = Some(spp);
    let monitor = Interrupter::after(u32::MAX);
    render(&setup.tracer, &settings, &monitor).expect("renders");
    monitor.state()
}

/// Films of different seeds add up: every pixel's count, mean and variance are those of all samples, the halves' means
/// come nearer as their variance says, and no order of the files changes a byte of the sum.
#[test]
fn films_of_different_seeds_add_up() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut films: Vec<(PathBuf, Film)> = Vec::new();
    for (seed, spp) in [(1, 32), (2, 64), (9, 32)] {
        let setup = Setup::new(seed);
        let mut state = uniform_film(&setup, spp);
        state.seconds.denoising = 0.5;
        let path = folder.path().join(format!("{seed}.film"));
        write_checkpoint(&path, &setup.header, &state).expect("written");
        films.push((path, state.film));
    }
    let merged = |order: [usize; 3]| {
        let sum = merge_files(&order.map(|i| films[i].0.clone())).expect("they fit");
        let path = folder.path().join("sum.film");
        write_checkpoint(&path, &sum.header, &sum.state).expect("written");
        (sum, std::fs::read(path).expect("readable"))
    };
    let (sum, bytes) = merged([0, 1, 2]);
    for order in [[2, 1, 0], [1, 2, 0], [1, 0, 2]] {
        assert!(merged(order).1 == bytes, "another order gives other bytes");
    }
    assert_eq!(sum.header.seeds, Seeds { all: vec![1, 2, 9], current: None });
    assert_eq!(sum.state.seconds.denoising, 1.5);
    for half in Half::BOTH {
        for (i, pixel) in sum.state.film.half(half).iter().enumerate() {
            let parts: Vec<_> = films.iter().map(|(_, film)| film.half(half)[i]).collect();
            let n: f64 = parts.iter().map(|part| f64::from(part.samples)).sum();
            assert_eq!((pixel.samples, f64::from(pixel.taken)), (64, n));
            let mean = parts.iter().map(|part| part.mean[1] * f64::from(part.samples)).sum::<f64>() / n;
            assert!((pixel.mean[1] - mean).abs() <= 1e-12 * mean.max(1.0), "{} for {mean}", pixel.mean[1]);
            let centre = |part: &fechner::film::HalfPixel| fechner::film::opponent(part.mean)[0];
            let whole = parts.iter().map(|part| centre(part) * f64::from(part.samples)).sum::<f64>() / n;
            let squares: f64 = parts
                .iter()
                .map(|part| f64::from(part.m2[0]) + f64::from(part.samples) * (centre(part) - whole).powi(2))
                .sum();
            let variance = squares / (n - 1.0);
            assert!((pixel.sample_variance(0) - variance).abs() <= 1e-5 * variance, "pixel {i}");
        }
    }
    // Σ (A − B)² falls with the count: 128 samples against 32, in stratified sampling at least fourfold less the
    // chance of a ratio of two sums over 1600 pixels, heavy tails included.
    let scatter = |film: &Film| {
        let difference = |i: usize| film.half(Half::A)[i].mean[1] - film.half(Half::B)[i].mean[1];
        (0..film.half(Half::A).len()).map(|i| difference(i).powi(2)).sum::<f64>()
    };
    let ratio = scatter(&films[0].1) / scatter(&sum.state.film);
    println!("Σ (A − B)² of seed 1 over that of the sum: {ratio:.2}, 4 for independent samples");
    assert!((2.5..8.0).contains(&ratio), "{ratio}");

    // Merged films are merged again, but never with a part of themselves.
    let path = folder.path().join("sum.film");
    assert_eq!(merge_files(&[]).expect_err("no film").to_string(), "there are no films to merge");
    let message = merge_files(&[path, films[1].0.clone()]).expect_err("seed 2 would count twice").to_string();
    assert!(message.contains("seed 2") && message.contains("sum.film") && message.contains("2.film"), "{message}");
}

/// Of films of one sample a pixel, or any odd number, the sum has both halves, whatever order and groups they come in.
#[test]
fn films_of_one_sample_make_two_halves() {
    let folder = tempfile::tempdir().expect("a folder");
    let films: Vec<PathBuf> = (1..=4)
        .map(|seed| {
            let setup = Setup::new(seed);
            let path = folder.path().join(format!("{seed}.film"));
            write_checkpoint(&path, &setup.header, &uniform_film(&setup, 1)).expect("written");
            path
        })
        .collect();
    let sum = merge_files(&films).expect("they fit");
    assert!(sum.state.film.has_both_halves());
    assert!(Half::BOTH.iter().all(|&half| sum.state.film.half(half).iter().all(|pixel| pixel.taken == 2)));
    let part = folder.path().join("part.film");
    let of_three = merge_files(&films[..3]).expect("they fit");
    write_checkpoint(&part, &of_three.header, &of_three.state).expect("written");
    assert_eq!(merge_files(&[films[3].clone(), part]).expect("they fit").state.film, sum.state.film);
    let alone = merge_files(&films[..1]).expect("a film");
    assert_eq!(alone.state.film, read_checkpoint(&films[0]).expect("readable").state.film);
}

/// The strictest aim stays, and a film that aimed at none takes none away: 0, by which it says so, was taken for the
/// strictest.
#[test]
fn merged_films_aim_at_what_the_strictest_aimed_at() {
    let folder = tempfile::tempdir().expect("a folder");
    let film = |seed: u64, visibility: f64| {
        let setup = Setup::new(seed);
        let header = Header { visibility, ..setup.header.clone() };
        let path = folder.path().join(format!("{seed}.film"));
        write_checkpoint(&path, &header, &uniform_film(&setup, 2)).expect("written");
        path
    };
    let films = [film(1, 4.0), film(2, 0.0), film(3, 2.0), film(4, 0.0)];
    for (merged, aim) in [([0, 1], 4.0), ([1, 2], 2.0), ([0, 2], 2.0), ([1, 3], 0.0)] {
        let sum = merge_files(&merged.map(|i| films[i].clone())).expect("they fit");
        assert_eq!(sum.header.visibility, aim, "films {merged:?}");
    }
}

/// A merged film goes on by a new seed, and by none that it has.
#[test]
fn a_merged_film_goes_on_by_another_seed() {
    let merged = Seeds { all: vec![1, 4], current: None };
    assert_eq!(merged.continued_by(3), Ok(Seeds { all: vec![1, 3, 4], current: Some(3) }));
    assert!(merged.continued_by(4).is_err_and(|problem| problem.contains("1, 4")));
    assert!(Seeds::one(1).continued_by(2).is_err_and(|problem| problem.contains("--seed 1")));

    let films = [1, 4].map(|seed| uniform_film(&Setup::new(seed), 16).film);
    let mut sum = films[0].clone();
    sum.add(&films[1]).expect("few samples");
    let setup = Setup::new(3);
    let settings = setup.settings(Sampling::Adaptive, 3.0);
    let state = RenderState::of_film(sum, settings.limits.max_samples);
    assert!(state.pending.is_empty(), "the pilot is there");
    let rendered = resume(&setup.tracer, &settings, state, &Quiet).expect("goes on");
    assert_eq!(rendered.stop_reason, StopReason::Visibility);
    let grown = (0..(SIZE * SIZE) as usize).filter(|&i| rendered.film.samples(i) > 32).count();
    assert!(grown > 0 && (0..(SIZE * SIZE) as usize).all(|i| rendered.film.samples(i) >= 32));
}

fn small_file() -> (Vec<u8>, Checkpoint) {
    let setup = Setup::new(1);
    let settings = setup.settings(Sampling::Adaptive, 8.0);
    let state = RenderState::new(3, 2, &settings.limits);
    let mut header = setup.header;
    (header.origin.width, header.origin.height) = (3, 2);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.film");
    write_checkpoint(&path, &header, &state).expect("written");
    (std::fs::read(path).expect("readable"), Checkpoint { header, state })
}

/// Every cut and every flipped bit is found; what is damaged under a fitting checksum is refused or harmless.
#[test]
fn damaged_files_are_refused() {
    const AROUND_THE_PAYLOAD: (usize, usize) = (16, 32);
    let (sound, checkpoint) = small_file();
    let path = Path::new("a.film");
    assert_eq!(decode_checkpoint(path, &sound).expect("sound"), checkpoint);
    for length in 0..sound.len() {
        let message = decode_checkpoint(path, &sound[..length]).expect_err("cut").to_string();
        assert!(message.contains("a.film") && !message.contains('\n'), "{message}");
    }
    for byte in 0..sound.len() {
        let mut changed = sound.clone();
        changed[byte] ^= 1 << (byte % 8);
        assert!(decode_checkpoint(path, &changed).is_err(), "byte {byte}");
    }
    let mut longer = sound.clone();
    longer.push(0);
    assert!(decode_checkpoint(path, &longer).is_err());

    let payload = &sound[AROUND_THE_PAYLOAD.0..sound.len() - AROUND_THE_PAYLOAD.1];
    assert_eq!(seal(payload), sound);
    let mut refused = 0;
    for byte in 0..payload.len() {
        for change in [0x00, 0x01, 0x7f, 0x80, 0xff] {
            let mut changed = payload.to_vec();
            changed[byte] = change;
            match decode_checkpoint(path, &seal(&changed)) {
                Ok(read) => assert_eq!(read.state.film.check(), Ok(())),
                Err(_) => refused += 1,
            }
        }
    }
    for length in 0..payload.len() {
        assert!(decode_checkpoint(path, &seal(&payload[..length])).is_err(), "cut at {length}");
    }
    println!("{refused} of {} changes under a fitting checksum are refused", 5 * payload.len());
}

/// What is to come before the next look at a denoised picture comes back from a file; that of a picture of another
/// size is refused.
#[test]
fn what_a_look_decided_belongs_to_its_picture() {
    let setup = Setup::new(1);
    let after_a_look = |size: u32| {
        let settings = setup.settings(Sampling::Adaptive, 1.0);
        let limits = Limits { plans: Some(2), ..settings.limits };
        let settings = LoopSettings { denoiser: Some(Denoiser::Builtin), limits, ..settings };
        let tracer = PathTracer::new(Arc::new(load_cornell_box()), trace_settings(size, size, 1));
        let state = RenderState::new(size, size, &settings.limits);
        run(&tracer, &settings, state, &Quiet).expect("renders").state
    };
    let (state, larger) = (after_a_look(SIZE), after_a_look(SIZE + 8));
    assert!(state.until_look.is_some());
    setup.through_a_file(&state);
    let mixed = RenderState { until_look: larger.until_look, ..state };
    let payload = postcard::to_stdvec(&(&setup.header, &mixed)).expect("numbers alone, in memory");
    let message = decode_checkpoint(Path::new("a.film"), &seal(&payload)).expect_err("of another picture").to_string();
    assert!(message.contains("plans make no sense"), "{message}");
}

/// A film that nobody could go on from would be refused as damaged by who comes next.
#[test]
fn what_could_not_be_read_is_not_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.film");
    let setup = Setup::new(1);
    let state = RenderState::new(SIZE, SIZE, &setup.settings(Sampling::Adaptive, 4.0).limits);
    write_checkpoint(&path, &setup.header, &state).expect("sound");
    let sound = std::fs::read(&path).expect("written");
    let broken = RenderState { inflation: f64::NAN, ..state };
    let error = write_checkpoint(&path, &setup.header, &broken).expect_err("unsound").to_string();
    assert!(error.contains("its figures make no sense, and it would be refused as damaged"), "{error}");
    assert!(std::fs::read(&path).expect("as before") == sound);
}

/// How frames follow and where they are looked at comes back from a file; what no shot has is refused.
#[test]
fn a_film_keeps_how_its_frame_is_seen() {
    let mut setup = Setup::new(1);
    let state = RenderState::new(SIZE, SIZE, &setup.settings(Sampling::Adaptive, 4.0).limits);
    let timing = FrameTiming { frames_per_second: 24.0, persistence: 0.5 };
    let gaze = Gaze { x_px: 3.0, y_px: f64::from(SIZE) };
    setup.header.settings.frames = Some(timing);
    setup.header.settings.gazes = vec![gaze];
    setup.through_a_file(&state);
    let record = &setup.header.settings;
    let seen = record
        .loop_settings(Limits::of_visibility(1.0), setup.header.origin.tracing.settings())
        .expect("names that are known");
    assert_eq!((seen.frames, seen.gazes), (Some(timing), vec![gaze]));

    for (frames, gaze) in [
        (FrameTiming { frames_per_second: f64::NAN, ..timing }, gaze),
        (FrameTiming { persistence: 0.0, ..timing }, gaze),
        (timing, Gaze { x_px: f64::NAN, ..gaze }),
        (timing, Gaze { y_px: f64::from(SIZE) + 1.0, ..gaze }),
    ] {
        let settings = SettingsRecord { frames: Some(frames), gazes: vec![gaze], ..setup.header.settings.clone() };
        let header = Header { settings, ..setup.header.clone() };
        let payload = postcard::to_stdvec(&(&header, &state)).expect("numbers alone, in memory");
        let message = decode_checkpoint(Path::new("a.film"), &seal(&payload)).expect_err("of no shot").to_string();
        assert!(message.contains("nobody can see a shot by its settings"), "{message}");
    }
}

/// One that came to the end of its ladder and does not look like it, as of a frame that was judged in motion, goes on.
#[test]
fn a_film_that_is_not_as_good_as_it_says_goes_on() {
    let setup = Setup::new(1);
    let settings = setup.settings(Sampling::Adaptive, 4.0);
    let mut state = uniform_film(&setup, 16);
    state.finished_rung = Some(4.0);
    let rendered = resume(&setup.tracer, &settings, state, &Quiet).expect("renders");
    let samples = rendered.film.total_samples();
    assert!(rendered.stop_reason == StopReason::Visibility, "{:?} after {samples} samples", rendered.stop_reason);
}

#[test]
fn foreign_files_and_versions_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.film");
    let message = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("written");
        read_checkpoint(&path).expect_err("refused").to_string()
    };
    let (sound, _) = small_file();
    assert!(message(b"").contains("not a film's file"));
    assert!(message(b"\x76\x2f\x31\x01 an EXR file, say").contains("not a film's file"));
    let mut later = sound.clone();
    later[12] += 1;
    assert!(message(&later).contains("this program reads version 10"), "{}", message(&later));
    assert!(message(&sound[..sound.len() / 2]).contains("damaged"));
    assert!(read_checkpoint(folder.path()).expect_err("a folder").to_string().contains("directory"));
}

/// Another scene, size, version or way of tracing is no film to go on with.
#[test]
fn films_of_another_origin_are_refused() {
    let own = Setup::new(1).header.origin;
    let mut scene = load_cornell_box();
    scene.camera.position.x += 1e-4;
    let others = [
        (Origin::of(&scene, &trace_settings(SIZE, SIZE, 1)), "another scene"),
        (Origin::of(&load_cornell_box(), &trace_settings(SIZE, 41, 1)), "40x41"),
        (Origin { program: "fechner 0.0.9".to_owned(), ..own.clone() }, "0.0.9"),
        (
            Origin::of(
                &load_cornell_box(),
                &fechner::integrator::TraceSettings { clamp: Some(3.0), ..trace_settings(SIZE, SIZE, 1) },
            ),
            "with clamp 3.0, and these are with no clamp",
        ),
    ];
    for (other, fragment) in others {
        let problem = other.difference(&own).expect("they differ");
        assert!(problem.contains(fragment), "{problem}");
    }
    assert_eq!(Origin::of(&load_cornell_box(), &trace_settings(SIZE, SIZE, 2)).difference(&own), None);
}
