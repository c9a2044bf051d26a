//! What a live preview costs and what it is worth: time to the first picture, samples a second beside a render that nobody
//! watches, and quality over the first seconds against uniform progressive rendering by the same tracer.
//!
//! `cargo bench --bench preview [-- --size N --seconds S --seeds N --reference N]` prints the tables of `benches/README.md`. Every
//! arm renders on one thread, whose own processor time is the clock, so that others' work on the machine counts only through
//! caches; a browser's part is played by a WebSocket that takes every frame, on another thread.

mod support;

use anyhow::{Context, Result};
use colorvideovdp::{Color, Cvvdp, DisplayModel, Execution, Geometry, Image, Options as VdpOptions, Photometry};
use fechner::adaptive::plan::uniform_plan;
use fechner::adaptive::settings::{AllocationRule, Limits, LoopSettings, Sampling};
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{Directive, Monitor, Progress, Rendered, render};
use fechner::checkpoint::SettingsRecord;
use fechner::film::Film;
use fechner::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use fechner::preview::{Closer, Door, Host, Job, Options, Shown, Spectator, start};
use fechner::sampler::Half;
use fechner::scene::Scene;
use fechner::scene::load::{LoadOptions, load};
use fechner_perception::tone::{FittedTone, SceneGuide, map_picture, operator};
use fechner_perception::{Display, Eotf, Plane, Viewing};
use flip_rs::{RgbImage, ldr_flip};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use support::CpuClock;
use tungstenite::client::IntoClientRequest;

const SCENES: [&str; 3] = ["cornell-box", "many-lights", "textured-room"];
/// Pictures that are compared with the reference, evenly over the logarithm of time.
const MOMENTS: usize = 12;
/// The first of them, in seconds.
const FIRST_MOMENT: f64 = 0.15;
/// Samples a pixel at which renders end that are compared by the clock.
const OVERHEAD_SPP: u32 = 96;
const REFERENCE_SEED: u64 = 0x5245_4645;

struct Arguments {
    size: u32,
    seconds: f64,
    seeds: u64,
    reference_spp: u32,
}

impl Arguments {
    fn read() -> Result<Self> {
        let words: Vec<String> = std::env::args().collect();
        let number = |name: &str, otherwise: f64| match words.iter().position(|word| word == name) {
            None => Ok(otherwise),
            Some(place) => words.get(place + 1).and_then(|word| word.parse().ok()).with_context(|| format!("{name} N")),
        };
        Ok(Self {
            size: number("--size", 192.0)? as u32,
            seconds: number("--seconds", 10.0)?,
            seeds: number("--seeds", 3.0)? as u64,
            reference_spp: number("--reference", 1024.0)? as u32,
        })
    }
}

fn main() -> Result<()> {
    let arguments = Arguments::read()?;
    let subjects = SCENES.map(|name| Subject::load(name, arguments.size)).into_iter().collect::<Result<Vec<_>>>()?;
    first_pictures(&subjects)?;
    overheads(&subjects, &arguments)?;
    races(&subjects, &arguments)
}

/// A scene of the suite, at a size.
struct Subject {
    name: &'static str,
    scene: Arc<Scene>,
    size: u32,
    viewing: Viewing,
}

impl Subject {
    fn load(name: &'static str, size: u32) -> Result<Self> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let scene = Arc::new(load(&file, &LoadOptions::default())?);
        Ok(Self { name, scene, size, viewing: Viewing::of(Display::preset("desktop").context("a preset")?) })
    }

    fn trace_settings(&self, seed: u64) -> TraceSettings {
        TraceSettings::new(self.size, self.size, seed)
    }

    fn tracer(&self, seed: u64) -> PathTracer {
        PathTracer::new(Arc::clone(&self.scene), self.trace_settings(seed))
    }

    fn job(&self, seed: u64, limits: Limits) -> Job {
        let record = SettingsRecord {
            sampling: Sampling::Adaptive,
            allocation: AllocationRule::Convex,
            model: "csf-bands".to_owned(),
            viewing: self.viewing.clone(),
            nits_per_unit: self.scene.nits_per_unit,
            operator: "constant".to_owned(),
            exposure_stops: None,
            importance: None,
            denoiser: None,
        };
        Job { scene: Arc::clone(&self.scene), trace: self.trace_settings(seed), record, limits, importance: None }
    }

    fn loop_settings(&self, limits: Limits) -> Result<LoopSettings> {
        let operator = operator("constant", None).context("an operator")?;
        Ok(LoopSettings { limits, ..LoopSettings::new(self.viewing.clone(), self.scene.nits_per_unit, operator) })
    }

    fn pixels(&self) -> usize {
        self.size as usize * self.size as usize
    }

    fn pixel_count(&self) -> f64 {
        f64::from(self.size) * f64::from(self.size)
    }
}

/// One thread, so that its processor time is what a quiet core would take.
fn one_thread() -> Result<rayon::ThreadPool> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build()?)
}

/// Every pixel once.
fn one_sample_each(film: &Film, taken: u32) -> SamplePlan {
    let half = if taken.is_multiple_of(2) { Half::A } else { Half::B };
    let one = |pixel| BlockWork { samples: 1, ..BlockWork::rest(pixel, half, taken / 2) };
    SamplePlan { blocks: (0..film.width() * film.height()).map(one).collect() }
}

/// A scene that never changes, and pictures that nobody keeps.
struct Nowhere(PathBuf);

impl Host for Nowhere {
    fn load(&self) -> Result<Job, String> {
        Err("there is no file".to_owned())
    }

    fn later(&self, _: f64) -> Result<Scene, String> {
        Err("there is no file".to_owned())
    }

    fn save(&self, _: &Path, _: &Rendered, _: &LoopSettings) -> Result<(), String> {
        Err("nothing is kept".to_owned())
    }

    fn scene_file(&self) -> &Path {
        &self.0
    }
}

/// A moment of a picture.
struct Moment {
    seconds: f64,
    samples: u64,
    /// Pixels of the picture to each of these, each way.
    step: u32,
    width: usize,
    /// Where it was asked for.
    rgb_cd_m2: Vec<[f32; 3]>,
    is_at_rest: bool,
}

/// Tells of every frame; its own time does not count.
struct Watcher {
    clock: Arc<Mutex<Option<CpuClock>>>,
    own_seconds: f64,
    keeps_pictures: bool,
    moments: Sender<Moment>,
}

impl Spectator for Watcher {
    fn shown(&mut self, shown: &Shown<'_>) {
        let clock = self.clock.lock().expect("nobody panics");
        let Some(clock) = clock.as_ref() else { return };
        let begun = clock.seconds();
        let moment = Moment {
            seconds: begun - self.own_seconds,
            samples: shown.film.total_samples(),
            step: shown.step,
            width: shown.film.width() as usize,
            rgb_cd_m2: if self.keeps_pictures { shown.rgb_cd_m2.to_vec() } else { Vec::new() },
            is_at_rest: shown.is_at_rest,
        };
        // Nobody listens any more at the end.
        let _ = self.moments.send(moment);
        self.own_seconds += clock.seconds() - begun;
    }
}

/// A preview that somebody watches over a socket, ended when dropped.
struct Watched {
    moments: Receiver<Moment>,
    closer: Closer,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Watched {
    fn start(subject: &Subject, seed: u64, limits: Limits, keeps_pictures: bool) -> Result<Self> {
        let pool = one_thread()?;
        let (sender, moments) = channel();
        // The clock is of the pool's thread, and starts before anything is made of the loaded scene.
        let clock = pool.install(|| Arc::new(Mutex::new(Some(CpuClock::of_thread()))));
        let watcher = Watcher { clock, own_seconds: 0.0, keeps_pictures, moments: sender };
        let options = Options { is_foveated: false, spectators: vec![Box::new(watcher)] };
        let host = Arc::new(Nowhere(PathBuf::from("nowhere.toml")));
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let viewer = move || {
            let stream = TcpStream::connect(address)?;
            let request = format!("ws://{address}/ws?token=bench").into_client_request()?;
            let (mut socket, _) = tungstenite::client(request, stream).map_err(|error| anyhow::anyhow!("{error}"))?;
            while socket.read().is_ok() {}
            anyhow::Ok(())
        };
        let viewer = std::thread::spawn(move || drop(viewer()));
        let preview = start(subject.job(seed, limits), host, options, pool)?;
        let closer = preview.closer();
        let door = Door { address, token: "bench".to_owned() };
        let server = std::thread::spawn(move || drop(preview.serve(listener, door)));
        Ok(Self { moments, closer, threads: vec![server, viewer] })
    }

    /// All moments up to the first that is `last`.
    fn until(&self, last: impl Fn(&Moment) -> bool) -> Result<Vec<Moment>> {
        let mut moments = Vec::new();
        loop {
            let moment = self.moments.recv_timeout(Duration::from_secs(300)).context("the preview says nothing")?;
            let is_last = last(&moment);
            moments.push(moment);
            if is_last {
                return Ok(moments);
            }
        }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.closer.close();
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}

/// The least of several measurements: noise only adds.
fn least(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

fn first_pictures(subjects: &[Subject]) -> Result<()> {
    println!(
        "| scene | trees, ms | one uniform pass, ms | first picture, ms (of a pass) | every pixel shown, ms (of a pass) |"
    );
    println!("| --- | --- | --- | --- | --- |");
    for subject in subjects {
        let (mut trees, mut pass, mut first, mut whole) = (vec![], vec![], vec![], vec![]);
        for seed in 0..5 {
            let [tree, traced] = one_thread()?.install(|| {
                let clock = CpuClock::of_thread();
                let tracer = subject.tracer(seed);
                let tree = clock.seconds();
                let mut film = Film::new(subject.size, subject.size);
                tracer.trace(&one_sample_each(&film, 0), &mut film, &|_| {});
                [tree, clock.seconds() - tree]
            });
            trees.push(tree);
            pass.push(traced);
            let watched = Watched::start(subject, seed, Limits::of_visibility(1.0), false)?;
            let pixels = subject.pixels() as u64;
            let moments = watched.until(|moment| moment.samples >= 2 * pixels)?;
            first.push(moments[0].seconds - tree);
            // The draft is in a film of its own, and its end is always shown.
            let is_drafted = |moment: &&Moment| moment.step == 1 && moment.samples == 0;
            whole.extend(moments.iter().rfind(is_drafted).map(|moment| moment.seconds - tree));
        }
        let [trees, pass, first, whole] = [trees, pass, first, whole].map(|times| 1e3 * least(times));
        let (name, first_ratio, whole_ratio) = (subject.name, first / pass, whole / pass);
        println!("| {name} | {trees:.1} | {pass:.0} | {first:.1} ({first_ratio:.2}) | {whole:.0} ({whole_ratio:.2}) |");
    }
    Ok(())
}

/// Notes when the film had how many samples.
struct Notes {
    clock: CpuClock,
    counts: Mutex<Vec<(u64, f64)>>,
}

impl Monitor for Notes {
    fn looked(&self, _: &Progress) {}

    fn samples_done(&self, _: u64) {}

    fn most_samples_a_batch(&self) -> u64 {
        1 << 15
    }

    fn between_batches(&self, state: &RenderState) -> Directive {
        let now = self.clock.seconds();
        self.counts.lock().expect("nobody panics").push((state.film.total_samples(), now));
        Directive::GoOn
    }
}

/// Seconds at which so many samples were there, by the nearest counts on both sides.
fn seconds_at(counts: &[(u64, f64)], samples: u64) -> f64 {
    let above = counts.partition_point(|count| count.0 < samples).clamp(1, counts.len() - 1);
    let [(low, from), (high, to)] = [counts[above - 1], counts[above]];
    from + (to - from) * (samples as f64 - low as f64) / ((high - low) as f64).max(1.0)
}

fn overheads(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
    println!("\n| scene | render, s | watched preview, s | whole overhead | after the first 5 s |");
    println!("| --- | --- | --- | --- | --- |");
    for subject in subjects {
        let (mut whole, mut steady, mut alone, mut watched) = (vec![], vec![], vec![], vec![]);
        for seed in 0..arguments.seeds {
            let limits = Limits { mean_samples: Some(OVERHEAD_SPP), ..Limits::of_visibility(1.0) };
            let (rendered, counts) = one_thread()?.install(|| {
                let notes = Notes { clock: CpuClock::of_thread(), counts: Mutex::default() };
                let settings = subject.loop_settings(limits)?;
                let rendered = render(&subject.tracer(seed), &settings, &notes)?;
                let seconds = notes.clock.seconds();
                let mut counts = notes.counts.into_inner().expect("nobody panics");
                counts.push((rendered.film.total_samples() + 1, seconds));
                anyhow::Ok((rendered, counts))
            })?;
            let preview = Watched::start(subject, seed, limits, false)?;
            let moments = preview.until(|moment| moment.is_at_rest)?;
            let end = moments.last().context("an end")?;
            anyhow::ensure!(end.samples == rendered.film.total_samples(), "the preview took another way");
            let (_, render_seconds) = *counts.last().context("an end")?;
            whole.push(end.seconds / render_seconds);
            alone.push(render_seconds);
            watched.push(end.seconds);
            if let Some(from) = moments.iter().find(|moment| moment.step == 1 && moment.seconds > 5.0) {
                let preview_seconds = end.seconds - from.seconds;
                steady.push(preview_seconds / (render_seconds - seconds_at(&counts, from.samples)));
            }
        }
        let percent = |ratios: Vec<f64>| match ratios.len() {
            0 => "ended before".to_owned(),
            count => {
                let mut ratios = ratios;
                ratios.sort_unstable_by(f64::total_cmp);
                format!("{:+.1} %", 100.0 * (ratios[count / 2] - 1.0))
            }
        };
        let (name, alone, watched) = (subject.name, least(alone), least(watched));
        println!("| {name} | {alone:.1} | {watched:.1} | {} | {} |", percent(whole), percent(steady));
    }
    Ok(())
}

/// The reference of a scene as the display shows it, and other people's measures against it.
struct Judge {
    tone: Box<dyn FittedTone>,
    shown: Vec<[f32; 3]>,
    size: usize,
    display: Display,
}

impl Judge {
    fn of(subject: &Subject, spp: u32) -> Result<Self> {
        let tracer = subject.tracer(REFERENCE_SEED);
        let mut film = Film::new(subject.size, subject.size);
        loop {
            let plan = uniform_plan(&film, spp);
            if plan.blocks.is_empty() {
                break;
            }
            tracer.trace(&plan, &mut film, &|_| {});
        }
        let estimate = film.estimate(subject.scene.nits_per_unit);
        let operator = operator("constant", None).context("an operator")?;
        let guide: Plane = estimate.luminance_cd_m2.map(|luminance| luminance.max(0.0));
        let tone = operator.fit(&SceneGuide::of(&guide), &subject.viewing, None);
        let size = subject.size as usize;
        let shown = map_picture(tone.as_ref(), size, &estimate.rgb_cd_m2);
        Ok(Self { tone, shown, size, display: subject.viewing.display.clone() })
    }

    /// FLIP's mean, and just-objectionable differences of ColorVideoVDP.
    fn measure(&self, rgb_cd_m2: &[[f32; 3]]) -> Result<[f64; 2]> {
        let picture = map_picture(self.tone.as_ref(), self.size, rgb_cd_m2);
        let (size, display) = (self.size, &self.display);
        let encoded = |picture: &[[f32; 3]]| {
            let code = |&light: &f32| Eotf::Srgb.encode(f64::from(light), display.white_cd_m2) as f32;
            RgbImage::new(size, size, picture.iter().flatten().map(code).collect::<Vec<f32>>())
        };
        let flip = ldr_flip(&encoded(&self.shown)?, &encoded(&picture)?, display.pixels_per_degree as f32)?;
        let light = |picture: &[[f32; 3]]| {
            let emitted = |&light: &f32| display.luminance_cd_m2(f64::from(light)) as f32;
            Image::new(size, size, 3, picture.iter().flatten().map(emitted).collect())
        };
        let contrast = display.white_cd_m2 / display.black_cd_m2;
        let model = DisplayModel::new(
            "desktop",
            Photometry::new(display.white_cd_m2, contrast, 0.0, 0.0, 1.0)?,
            Geometry::from_ppd([size, size], display.pixels_per_degree)?,
            "BT.709-linear",
        )?;
        let metric = Cvvdp::new(model, VdpOptions::default().with_execution(Execution::SingleThread))?;
        let prediction = metric.predict_image(&light(&picture)?, &light(&self.shown)?, Color::Linear)?;
        Ok([f64::from(flip.statistics().mean), f64::from(prediction.jod)])
    }
}

/// When pictures are looked at.
fn moments(seconds: f64) -> Vec<f64> {
    let ratio = (seconds / FIRST_MOMENT).powf(1.0 / (MOMENTS - 1) as f64);
    (0..MOMENTS).map(|moment| FIRST_MOMENT * ratio.powi(moment as i32)).collect()
}

/// What somebody who watches the preview has before him at each time.
fn previewed(subject: &Subject, seed: u64, times: &[f64]) -> Result<Vec<Vec<[f32; 3]>>> {
    let watched = Watched::start(subject, seed, Limits::of_visibility(1.0), true)?;
    let end = *times.last().context("a time")?;
    let mut before: Option<Moment> = None;
    let mut pictures = Vec::new();
    while pictures.len() < times.len() {
        let moment = watched.moments.recv_timeout(Duration::from_secs(300)).context("the preview says nothing")?;
        // A preview that has stopped stays as it is.
        let until = if moment.is_at_rest { end + 1.0 } else { moment.seconds };
        let shown = if moment.is_at_rest { None } else { before.take() };
        while pictures.len() < times.len() && times[pictures.len()] < until {
            let at = shown.as_ref().unwrap_or(&moment);
            pictures.push(enlarged(at, subject.size as usize));
        }
        before = Some(moment);
    }
    Ok(pictures)
}

/// The picture as the page draws it, less the browser's smoothing.
fn enlarged(moment: &Moment, size: usize) -> Vec<[f32; 3]> {
    let step = moment.step as usize;
    let pixel = |at: usize| moment.rgb_cd_m2[at / size / step * moment.width + at % size / step];
    (0..size * size).map(pixel).collect()
}

/// The same of a renderer that gives every pixel one sample after the other, and is shown at no cost.
fn progressive(subject: &Subject, seed: u64, times: &[f64]) -> Result<Vec<Vec<[f32; 3]>>> {
    let nits = subject.scene.nits_per_unit;
    one_thread()?.install(|| {
        let clock = CpuClock::of_thread();
        let tracer = subject.tracer(seed);
        let mut film = Film::new(subject.size, subject.size);
        let mut pictures = Vec::new();
        let mut before = vec![[0.0; 3]; subject.pixels()];
        let mut taken = 0;
        let mut own_seconds = 0.0;
        while pictures.len() < times.len() {
            tracer.trace(&one_sample_each(&film, taken), &mut film, &|_| {});
            taken += 1;
            let begun = clock.seconds();
            while pictures.len() < times.len() && times[pictures.len()] < begun - own_seconds {
                pictures.push(before.clone());
            }
            before = (0..subject.pixels()).map(|pixel| film.rgb_cd_m2(pixel, nits)).collect();
            own_seconds += clock.seconds() - begun;
        }
        Ok(pictures)
    })
}

/// Mean over time of what was measured at some times, straight in between.
fn time_average(times: &[f64], values: &[f64]) -> f64 {
    let area: f64 = (1..times.len()).map(|i| 0.5 * (values[i] + values[i - 1]) * (times[i] - times[i - 1])).sum();
    area / (times[times.len() - 1] - times[0])
}

fn races(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
    let times = moments(arguments.seconds);
    let seconds = arguments.seconds;
    println!(
        "\nMean over the first {seconds} s, preview less uniform (± standard error over {} seeds):\n",
        arguments.seeds
    );
    println!("| scene | FLIP, uniform | FLIP, preview | difference | JOD, uniform | JOD, preview | difference |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut tracks = Vec::new();
    for subject in subjects {
        let judge = Judge::of(subject, arguments.reference_spp)?;
        // [arm][measure][seed], and by moment.
        let mut averages = [[vec![], vec![]], [vec![], vec![]]];
        let mut track = vec![[[0.0; 2]; 2]; times.len()];
        for seed in 1..=arguments.seeds {
            let arms = [progressive(subject, seed, &times)?, previewed(subject, seed, &times)?];
            for (arm, pictures) in arms.iter().enumerate() {
                let measured = pictures.iter().map(|picture| judge.measure(picture)).collect::<Result<Vec<_>>>()?;
                for measure in 0..2 {
                    let values: Vec<f64> = measured.iter().map(|both| both[measure]).collect();
                    averages[arm][measure].push(time_average(&times, &values));
                    for (moment, value) in values.iter().enumerate() {
                        track[moment][measure][arm] += value / arguments.seeds as f64;
                    }
                }
            }
        }
        let [uniform, preview] = &averages;
        let cells = [0, 1].map(|measure| {
            let differences: Vec<f64> = preview[measure].iter().zip(&uniform[measure]).map(|(a, b)| a - b).collect();
            let (difference, error) = mean_and_error(&differences);
            let [of_uniform, of_preview] =
                [&uniform[measure], &preview[measure]].map(|values| mean_and_error(values).0);
            format!("{of_uniform:.4} | {of_preview:.4} | {difference:+.4} ± {error:.4}")
        });
        println!("| {} | {} | {} |", subject.name, cells[0], cells[1]);
        tracks.push((subject, track));
    }
    println!("\nOver time, uniform / preview:\n");
    let heads: Vec<String> = times.iter().map(|time| format!("{time:.2} s")).collect();
    println!("| scene, measure | {} |", heads.join(" | "));
    println!("| --- |{}", " --- |".repeat(times.len()));
    for (subject, track) in &tracks {
        for (measure, name) in ["FLIP", "JOD"].iter().enumerate() {
            let cells: Vec<String> =
                track.iter().map(|at| format!("{:.3} / {:.3}", at[measure][0], at[measure][1])).collect();
            println!("| {}, {name} | {} |", subject.name, cells.join(" | "));
        }
    }
    println!("\nPixels: {:.0}; reference: {} samples a pixel.", subjects[0].pixel_count(), arguments.reference_spp);
    Ok(())
}

/// Mean and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0).max(1.0) / count).sqrt())
}
