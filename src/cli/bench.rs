//! `fechner bench`: what adaptive sampling saves.

use super::animate::parse_rate;
use super::denoise::DenoiseChoice;
use super::seeing::{DEFAULT_DISPLAY, parse_positive};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use fechner::benchmark::{
    AnimationResults, AnimationRow, AnimationSettings, Arm, ArmSummary, BenchSettings, DenoisingSettings, Race,
    animation, bounds, denoising, run as run_bench,
};
use fechner::denoise::{Denoiser, DenoiserKind};
use std::path::{Path, PathBuf};

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArguments {
    /// Scenes; without any, those of the suite in the folder `scenes`.
    scenes: Vec<PathBuf>,
    /// How much to do.
    #[arg(long, value_enum, default_value = "quick")]
    suite: Suite,
    /// Folder for results.json, results.csv and report.html, for denoise.json or for animation.json; finished renders in it of all
    /// suites but animation are not made again by the same build of the program.
    #[arg(short, long, value_name = "DIR", default_value = "bench")]
    output: PathBuf,
    /// Pixels to a side of the square pictures, in place of the suite's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(32..=4096))]
    size: Option<u32>,
    /// Visibility that every arm has to reach, in place of the suite's.
    #[arg(long, value_name = "V", value_parser = parse_positive)]
    visibility: Option<f64>,
    /// Renders of each arm, in place of the suite's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    seeds: Option<u32>,
    /// Display preset.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_DISPLAY)]
    display: String,
    /// Samples of the reference, as a multiple of what uniform sampling needs (at least 512, at most 16384 a pixel); in the
    /// suite animation, of 64 a pixel.
    #[arg(long, value_name = "X", value_parser = parse_positive, default_value_t = 16.0)]
    reference_factor: f64,
    /// Frames a second of the suite animation, in place of 24 and 60.
    #[arg(long, value_name = "N", value_parser = parse_rate)]
    fps: Option<f64>,
    /// Only say what uniform sampling and the optimum need by converged variances: what no rule can beat.
    #[arg(long)]
    bound: bool,
    /// Arms, separated by commas, in place of the suite's.
    #[arg(long, value_name = "ARM,…", value_delimiter = ',')]
    arms: Vec<String>,
    /// Denoisers, separated by commas: of the suite denoise, without any builtin and oidn; of the suite animation, without any none.
    #[arg(long, value_enum, value_name = "NAME,…", value_delimiter = ',')]
    denoise: Vec<DenoiseChoice>,
    /// In the suite denoise, leave out what compares rules of sampling.
    #[arg(long)]
    law_only: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Suite {
    /// 128×128, visibility 4, seven arms, three seeds.
    Quick,
    /// 256×256, visibility 1, every arm, five seeds: a night.
    Full,
    /// 128×128, denoised pictures: the law against the truth, and samples to a quality. Prints tables, writes denoise.json.
    Denoise,
    /// 96×54, visibility 2, eight frames at 24 and at 60 a second: what motion hides. Prints tables, writes animation.json.
    Animation,
}

/// Stills of the suite, in `scenes/`.
const STILLS: [&str; 10] = [
    "complementary-lamps",
    "cornell-box",
    "cornell-glass",
    "dark-window",
    "glass-caustic",
    "many-lights",
    "product",
    "still-life",
    "textured-room",
    "veach-mis",
];
/// Its shots.
const SHOTS: [&str; 5] = ["light-switch", "opening-door", "rolling-ball", "textured-room", "turntable"];

/// Runs and prints the table.
pub(super) fn run(arguments: &BenchArguments) -> Result<()> {
    check_suite(arguments)?;
    let (size, visibility, seeds, arms) = match arguments.suite {
        Suite::Quick => (128, 4.0, 3, Arm::QUICK.to_vec()),
        Suite::Full => (256, 1.0, 5, Arm::ALL.to_vec()),
        Suite::Animation => return run_animations(arguments),
        Suite::Denoise => return run_denoise(arguments),
    };
    let scenes = scenes_or(&STILLS, arguments)?;
    let size = arguments.size.unwrap_or(size);
    let settings = BenchSettings {
        scenes,
        size: (size, size),
        visibility: arguments.visibility.unwrap_or(visibility),
        arms: if arguments.arms.is_empty() { arms } else { named_arms(&arguments.arms)? },
        seeds: arguments.seeds.unwrap_or(seeds),
        reference_factor: arguments.reference_factor,
        display: arguments.display.clone(),
        output: arguments.output.clone(),
    };
    let say = |line: &str| say!("{line}");
    if arguments.bound {
        answer!("| scene | coverage | uniform, spp | optimum, spp | ratio |");
        answer!("| --- | --- | --- | --- | --- |");
        for b in bounds(&settings, &say)? {
            let (share, ratio) = (100.0 * b.coverage, b.uniform / b.optimum);
            answer!("| {} | {share} % | {:.0} | {:.0} | {ratio:.2} |", b.scene, b.uniform, b.optimum);
        }
        return Ok(());
    }
    let results = run_bench(&settings, &say)?;
    print_summary(&results.summary);
    say!("{}", settings.output.join("report.html").display());
    Ok(())
}

fn print_summary(summary: &[ArmSummary]) {
    answer!("| arm | coverage | samples, uniform / arm | worst scene | oracle / arm |");
    answer!("| --- | --- | --- | --- | --- |");
    for s in summary {
        let unknown = || "–".to_owned();
        let speedup = s.speedup_samples.map_or_else(unknown, |mean| mean.in_words());
        let least = s.speedup_samples.map_or_else(unknown, |mean| format!("{:.2}", mean.least));
        let efficiency = s.efficiency.map_or_else(String::new, |e| format!("{:.2} (least {:.2})", e.value, e.least));
        answer!("| {} | {} % | {speedup} | {least} | {efficiency} |", s.arm, 100.0 * s.coverage);
    }
}

/// Refuses options that the suite would not look at.
fn check_suite(arguments: &BenchArguments) -> Result<()> {
    let (is_of_arms, is_denoise, is_animation) = match arguments.suite {
        Suite::Quick | Suite::Full => (true, false, false),
        Suite::Denoise => (false, true, false),
        Suite::Animation => (false, false, true),
    };
    for (option, is_given, is_used, suites) in [
        ("--denoise", !arguments.denoise.is_empty(), is_denoise || is_animation, "denoise and animation"),
        ("--law-only", arguments.law_only, is_denoise, "denoise"),
        ("--fps", arguments.fps.is_some(), is_animation, "animation"),
        ("--seeds", arguments.seeds.is_some(), is_of_arms || is_denoise, "quick, full and denoise"),
        ("--bound", arguments.bound, is_of_arms, "quick and full"),
        ("--arms", !arguments.arms.is_empty(), is_of_arms, "quick and full"),
    ] {
        if is_given && !is_used {
            bail!("{option} is for --suite {suites}: this suite does not look at it");
        }
    }
    if is_denoise && arguments.denoise.iter().any(|choice| choice.kind().is_none()) {
        bail!("--denoise none: the suite denoise judges denoised pictures; name builtin or oidn");
    }
    Ok(())
}

/// Scenes of the denoising suite: a plain room, glass, texture, many lamps, a caustic.
const DENOISED: [&str; 5] = ["cornell-box", "cornell-glass", "textured-room", "many-lights", "glass-caustic"];

fn run_denoise(arguments: &BenchArguments) -> Result<()> {
    let size = arguments.size.unwrap_or(128);
    let settings = DenoisingSettings {
        bench: BenchSettings {
            scenes: scenes_or(&DENOISED, arguments)?,
            size: (size, size),
            visibility: 4.0,
            arms: Vec::new(),
            seeds: arguments.seeds.unwrap_or(2),
            reference_factor: arguments.reference_factor,
            display: arguments.display.clone(),
            output: arguments.output.clone(),
        },
        denoisers: denoisers_or(&[DenoiseChoice::Builtin, DenoiseChoice::Oidn], arguments).flatten().collect(),
        target: arguments.visibility.unwrap_or(1.0),
        with_races: !arguments.law_only,
    };
    let results = denoising(&settings, &|line: &str| say!("{line}"))?;
    answer!(
        "| scene | denoiser | spp | rank corr. | predicted / true v | by variance alone | called fine | of it unproven | fine, \
         proven, wrong | fine, unproven, wrong | truly wrong | JOD raw, denoised | FLIP raw, denoised | overhead |"
    );
    answer!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for c in &results.calibrations {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let ratio = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"));
        answer!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2}, {:.2} | {:.3}, {:.3} | {:.2} |",
            c.scene,
            c.denoiser,
            c.spp,
            ratio(c.rank_correlation),
            ratio(c.predicted_over_true),
            ratio(c.variance_over_true),
            percent(c.fine_share),
            percent(c.unproven_share),
            percent(c.wrong_share),
            percent(c.wrong_unproven_share),
            percent(c.truly_wrong_share),
            c.jod_raw,
            c.jod,
            c.flip_raw,
            c.flip,
            c.overhead
        );
    }
    print_races(&results.races);
    Ok(())
}

/// Samples to three qualities by each rule, and uniform's over the others'.
fn print_races(races: &[Race]) {
    if races.is_empty() {
        return;
    }
    answer!("\n| scene | denoiser | rule | spp to JOD 9.8 | to JOD 9.9 | to FLIP of uniform at 64 |");
    answer!("| --- | --- | --- | --- | --- | --- |");
    for race in races {
        let uniform =
            races.iter().find(|r| r.rule == "uniform" && (&r.scene, &r.denoiser) == (&race.scene, &race.denoiser));
        let at_64 = uniform.and_then(|race| race.points.iter().find(|point| point[0] >= 64.0)).map_or(0.0, |p| p[2]);
        let cell = |needed: &dyn Fn(&Race) -> Option<f64>| match (needed(race), uniform.and_then(needed)) {
            (Some(own), Some(uniform)) => format!("{own:.1} ({:.2})", uniform / own),
            (Some(own), None) => format!("{own:.1}"),
            (None, _) => "more than tried".to_owned(),
        };
        answer!(
            "| {} | {} | {} | {} | {} | {} |",
            race.scene,
            race.denoiser,
            race.rule,
            cell(&|race: &Race| race.samples_to_jod(9.8)),
            cell(&|race: &Race| race.samples_to_jod(9.9)),
            cell(&|race: &Race| race.samples_to_flip(at_64))
        );
    }
}

/// The denoisers that are asked for, or those of the suite.
fn denoisers_or<'a>(
    suite: &'a [DenoiseChoice],
    arguments: &'a BenchArguments,
) -> impl Iterator<Item = Option<DenoiserKind>> + 'a {
    let asked = if arguments.denoise.is_empty() { suite } else { &arguments.denoise };
    asked.iter().map(|choice| choice.kind())
}

fn run_animations(arguments: &BenchArguments) -> Result<()> {
    let file = AnimationResults::file(&arguments.output)?;
    let mut results = Vec::new();
    for denoiser in denoisers_or(&[DenoiseChoice::None], arguments) {
        let rows = run_animation(arguments, denoiser)?;
        let denoiser = denoiser.map(Denoiser::open).transpose()?.map(|denoiser| denoiser.name());
        print_animation(denoiser.as_deref(), &rows);
        results.push(AnimationResults { denoiser, rows });
        AnimationResults::write(&results, &file)?;
    }
    say!("{}", file.display());
    Ok(())
}

fn run_animation(arguments: &BenchArguments, denoiser: Option<DenoiserKind>) -> Result<Vec<AnimationRow>> {
    let width = arguments.size.unwrap_or(96);
    let settings = AnimationSettings {
        scenes: scenes_or(&SHOTS, arguments)?,
        size: (width, (width * 9).div_ceil(16)),
        frames: 8,
        rates: arguments.fps.map_or(vec![24.0, 60.0], |rate| vec![rate]),
        visibility: arguments.visibility.unwrap_or(2.0),
        reference_spp: (64.0 * arguments.reference_factor).clamp(64.0, 16384.0) as u32,
        display: arguments.display.clone(),
        denoiser,
    };
    animation(&settings, &|line: &str| say!("{line}"))
}

fn print_animation(denoiser: Option<&str>, rows: &[AnimationRow]) {
    if let Some(denoiser) = denoiser {
        answer!("All but the references denoised by {denoiser}:\n");
    }
    answer!(
        "| shot | frames a second | motion: spp, JOD | still: spp, JOD | still / motion | even, as good: spp | even / motion | \
         flicker | of even, at equal visibility |"
    );
    answer!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for row in rows {
        let ratio = row.still_spp / row.motion_spp;
        let even = row
            .uniform_spp
            .map_or_else(|| "more than tried | ".to_owned(), |spp| format!("{spp:.0} | {:.2}", spp / row.motion_spp));
        let AnimationRow { scene, frames_per_second, motion_spp, motion_jod, still_spp, still_jod, flicker, .. } = row;
        let even_flicker = row.uniform_flicker.map_or_else(|| "not tried".to_owned(), |even| format!("{even:.2}"));
        answer!(
            "| {scene} | {frames_per_second} | {motion_spp:.0}, {motion_jod:.2} | {still_spp:.0}, {still_jod:.2} | \
             {ratio:.2} | {even} | {flicker:.2} | {even_flicker} |"
        );
    }
    let mut rates: Vec<f64> = rows.iter().map(|row| row.frames_per_second).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    for rate in rates {
        let of_rate = || rows.iter().filter(|row| row.frames_per_second == rate);
        let still = geometric_mean(of_rate().map(|row| row.still_spp / row.motion_spp));
        let even = geometric_mean(of_rate().filter_map(|row| Some(row.uniform_spp? / row.motion_spp)));
        let flicker = geometric_mean(of_rate().filter_map(|row| Some(row.flicker / row.uniform_flicker?)));
        answer!("at {rate}: still / motion {still}, even / motion {even}, flicker over that of even {flicker}");
    }
}

/// A geometric mean in words.
fn geometric_mean(values: impl Iterator<Item = f64>) -> String {
    let logarithms: Vec<f64> = values.map(f64::ln).collect();
    if logarithms.is_empty() {
        return "–".to_owned();
    }
    format!("{:.2}", (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp())
}

/// Arms by name, and those that others are compared with.
fn named_arms(names: &[String]) -> Result<Vec<Arm>> {
    for name in names {
        if !Arm::ALL.iter().any(|arm| arm.name() == name) {
            let known: Vec<&str> = Arm::ALL.iter().map(|arm| arm.name()).collect();
            bail!("there is no arm \"{name}\"; known: {}", known.join(", "));
        }
    }
    let is_named = |arm: Arm| names.iter().any(|name| name == arm.name());
    let is_after_as_asked = [Arm::UniformEqualTime, Arm::ToThreshold].into_iter().any(is_named);
    let needed = |arm: Arm| arm == Arm::Uniform || (arm == Arm::AsAsked && is_after_as_asked);
    Ok(Arm::ALL.into_iter().filter(|&arm| needed(arm) || is_named(arm)).collect())
}

/// The scenes that are asked for, or those of the suite.
fn scenes_or(suite: &[&str], arguments: &BenchArguments) -> Result<Vec<PathBuf>> {
    if !arguments.scenes.is_empty() {
        return Ok(arguments.scenes.clone());
    }
    let folder = Path::new("scenes");
    if !folder.is_dir() {
        bail!("{}: not here; name scenes, or run this where the folder is", folder.display());
    }
    Ok(suite.iter().map(|name| folder.join(name).with_extension("toml")).collect())
}
