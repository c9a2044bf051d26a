//! Quality over the first seconds: what one sees of a preview beside a uniform progressive render that is shown at no
//! cost, and beside the same preview where it samples evenly, which pays for frames and looks too.

use super::watched::{Moment, Watched};
use super::{Arguments, Subject, one_sample_each, one_thread};
use crate::support::CpuClock;
use anyhow::{Context, Result};
use fechner::adaptive::settings::{Limits, Sampling};
use fechner::benchmark::{measure, trace_up_to};
use fechner::film::Film;
use fechner_perception::tone::{FittedTone, SceneGuide, map_picture, operator};
use fechner_perception::{Display, Plane};
use std::time::Duration;

/// Pictures that are compared with the reference, evenly over the logarithm of time.
const MOMENTS: usize = 12;
/// The first of them, in seconds.
const FIRST_MOMENT: f64 = 0.15;
const REFERENCE_SEED: u64 = 0x5245_4645;

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
        trace_up_to(&tracer, &mut film, spp);
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
        let metrics = measure(&self.display, self.size, &self.shown, &picture)?;
        Ok([metrics.flip_mean, metrics.jod])
    }
}

/// When pictures are looked at.
fn moments(seconds: f64) -> Vec<f64> {
    let ratio = (seconds / FIRST_MOMENT).powf(1.0 / (MOMENTS - 1) as f64);
    (0..MOMENTS).map(|moment| FIRST_MOMENT * ratio.powi(moment as i32)).collect()
}

/// What somebody who watches the preview has before him at each time.
fn previewed(subject: &Subject, seed: u64, sampling: Sampling, times: &[f64]) -> Result<Vec<Vec<[f32; 3]>>> {
    let watched = Watched::start(one_thread()?, subject.job(seed, Limits::of_visibility(1.0), sampling), true)?;
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

/// What is compared, the preview last.
const ARMS: [&str; 3] = ["uniform", "uniform preview", "preview"];
const MEASURES: [&str; 2] = ["FLIP", "JOD"];

/// A measure of each arm: its mean over the first seconds by seed, and its mean over seeds by moment.
struct Raced {
    averages: [Vec<f64>; ARMS.len()],
    track: Vec<[f64; ARMS.len()]>,
}

fn race(subject: &Subject, arguments: &Arguments, times: &[f64]) -> Result<[Raced; MEASURES.len()]> {
    let judge = Judge::of(subject, arguments.reference_spp)?;
    let mut raced =
        MEASURES.map(|_| Raced { averages: Default::default(), track: vec![[0.0; ARMS.len()]; times.len()] });
    for seed in 1..=arguments.seeds {
        // The machine's pace changes while they run: each is first, second and last in turn.
        for place in 0..ARMS.len() {
            let arm = (place + seed as usize) % ARMS.len();
            let pictures = match arm {
                0 => progressive(subject, seed, times)?,
                1 => previewed(subject, seed, Sampling::Uniform, times)?,
                _ => previewed(subject, seed, Sampling::Adaptive, times)?,
            };
            let measured = pictures.iter().map(|picture| judge.measure(picture)).collect::<Result<Vec<_>>>()?;
            for (measure, raced) in raced.iter_mut().enumerate() {
                let values: Vec<f64> = measured.iter().map(|both| both[measure]).collect();
                raced.averages[arm].push(time_average(times, &values));
                for (of_moment, value) in raced.track.iter_mut().zip(&values) {
                    of_moment[arm] += value / arguments.seeds as f64;
                }
            }
        }
    }
    Ok(raced)
}

pub(super) fn races(subjects: &[Subject], arguments: &Arguments) -> Result<()> {
    let times = moments(arguments.seconds);
    let (seconds, seeds) = (arguments.seconds, arguments.seeds);
    println!(
        "\nMean over the first {seconds} s, and the preview less the others (± standard error over {seeds} seeds):\n"
    );
    println!("| scene, measure | {} | less uniform | less uniform preview |", ARMS.join(" | "));
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut tracks = Vec::new();
    for subject in subjects {
        let raced = race(subject, arguments, &times)?;
        for (name, Raced { averages: [uniform, uniform_preview, preview], track }) in MEASURES.iter().zip(raced) {
            let [a, b, c] = [&uniform, &uniform_preview, &preview].map(|values| mean_and_error(values).0);
            let less = |other: &[f64]| {
                let differences: Vec<f64> = preview.iter().zip(other).map(|(preview, other)| preview - other).collect();
                let (difference, error) = mean_and_error(&differences);
                format!("{difference:+.4} ± {error:.4}")
            };
            let differences = [less(&uniform), less(&uniform_preview)].join(" | ");
            println!("| {}, {name} | {a:.4} | {b:.4} | {c:.4} | {differences} |", subject.name);
            tracks.push((subject.name, name, track));
        }
    }
    println!("\nOver time, {}:\n", ARMS.join(" / "));
    let heads: Vec<String> = times.iter().map(|time| format!("{time:.2} s")).collect();
    println!("| scene, measure | {} |", heads.join(" | "));
    println!("| --- |{}", " --- |".repeat(times.len()));
    for (scene, name, track) in &tracks {
        let cells: Vec<String> = track.iter().map(|[a, b, c]| format!("{a:.3} / {b:.3} / {c:.3}")).collect();
        println!("| {scene}, {name} | {} |", cells.join(" | "));
    }
    println!("\nPixels: {}; reference: {} samples a pixel.", subjects[0].pixels(), arguments.reference_spp);
    Ok(())
}

/// Mean and its standard error.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0).max(1.0) / count).sqrt())
}
