//! `fechner bench`: what adaptive sampling saves. What is measured is left to `fechner::benchmark`.

mod tables;

use super::animate::parse_rate;
use super::denoise::DenoiseChoice;
use super::numbers::{parse_positive, whole};
use super::seeing::DEFAULT_DISPLAY;
use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use fechner::benchmark::{
    AnimationResults, AnimationRow, AnimationSettings, Arm, BenchSettings, DenoisingSettings, animation, bounds,
    check_inputs, denoising, run as run_bench,
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
    /// Folder for results.json, results.csv and report.html, for denoise.json or for animation.json; finished renders
    /// in it of all suites but animation are not made again by the same build of the program.
    #[arg(short, long, value_name = "DIR", default_value = "bench")]
    output: PathBuf,
    /// Pixels to a side of the square pictures, in the suite animation pixels across pictures of 16:9, in place of
    /// the suite's.
    #[arg(long, value_name = "N", value_parser = whole(32..=4096), allow_negative_numbers = true)]
    size: Option<u32>,
    /// Visibility that every arm has to reach, in place of the suite's.
    #[arg(long, value_name = "V", value_parser = parse_positive, allow_negative_numbers = true)]
    visibility: Option<f64>,
    /// Renders of each arm, in place of the suite's.
    #[arg(long, value_name = "N", value_parser = whole(1..=64), allow_negative_numbers = true)]
    seeds: Option<u32>,
    /// Display preset.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_DISPLAY)]
    display: String,
    /// Samples of the reference, as a multiple of what uniform sampling needs (at least 512, at most 16384 a pixel);
    /// in the suite animation, of 64 a pixel.
    #[arg(long, value_name = "X", value_parser = parse_positive, allow_negative_numbers = true, default_value_t = 16.0)]
    reference_factor: f64,
    /// Frames a second of the suite animation, in place of 24 and 60.
    #[arg(long, value_name = "N", value_parser = parse_rate, allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Only say what uniform sampling and the optimum need by converged variances, with one sample in every pixel at
    /// least: what no rule can beat.
    #[arg(long)]
    bound: bool,
    /// Arms, separated by commas, in place of the suite's.
    #[arg(long, value_name = "ARM,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(Arm::ALL.map(Arm::name)))]
    arms: Vec<String>,
    /// Denoisers, separated by commas: of the suite denoise, without any builtin and oidn; of the suite animation,
    /// without any none.
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
    /// 128×128, denoised pictures: the law against the truth, and samples to a quality. Prints tables, writes
    /// denoise.json.
    Denoise,
    /// 96×54, visibility 2, eight frames at 24 and at 60 a second: what motion hides. Prints tables, writes
    /// animation.json.
    Animation,
}

impl Suite {
    /// Whether it compares arms.
    fn has_arms(self) -> bool {
        matches!(self, Self::Quick | Self::Full)
    }

    /// Whether it judges denoised stills.
    fn denoises(self) -> bool {
        matches!(self, Self::Denoise)
    }

    fn is_animation(self) -> bool {
        matches!(self, Self::Animation)
    }
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
    match arguments.suite {
        Suite::Quick => run_arms(arguments, &SuiteDefaults::QUICK),
        Suite::Full => run_arms(arguments, &SuiteDefaults::FULL),
        Suite::Denoise => run_denoise(arguments),
        Suite::Animation => run_animations(arguments),
    }
}

/// What a suite of arms does where nothing else is asked for.
struct SuiteDefaults {
    size: u32,
    visibility: f64,
    seeds: u32,
    arms: &'static [Arm],
}

impl SuiteDefaults {
    const QUICK: Self = Self { size: 128, visibility: 4.0, seeds: 3, arms: &Arm::QUICK };
    const FULL: Self = Self { size: 256, visibility: 1.0, seeds: 5, arms: &Arm::ALL };
}

fn run_arms(arguments: &BenchArguments, defaults: &SuiteDefaults) -> Result<()> {
    let scenes = scenes_or(&STILLS, arguments)?;
    let size = arguments.size.unwrap_or(defaults.size);
    let settings = BenchSettings {
        scenes,
        size: (size, size),
        visibility: arguments.visibility.unwrap_or(defaults.visibility),
        arms: if arguments.arms.is_empty() { defaults.arms.to_vec() } else { named_arms(&arguments.arms) },
        seeds: arguments.seeds.unwrap_or(defaults.seeds),
        reference_factor: arguments.reference_factor,
        display: arguments.display.clone(),
        output: arguments.output.clone(),
    };
    let say = |line: &str| say!("{line}");
    if arguments.bound {
        tables::print_bounds(&bounds(&settings, &say)?);
        return Ok(());
    }
    let results = run_bench(&settings, &say)?;
    tables::print_summary(&results.summary);
    say!("{}", settings.output.join("report.html").display());
    Ok(())
}

/// Refuses options that the suite would not look at.
fn check_suite(arguments: &BenchArguments) -> Result<()> {
    let suite = arguments.suite;
    for (option, is_given, is_used, suites) in [
        ("--denoise", !arguments.denoise.is_empty(), suite.denoises() || suite.is_animation(), "denoise and animation"),
        ("--law-only", arguments.law_only, suite.denoises(), "denoise"),
        ("--fps", arguments.fps.is_some(), suite.is_animation(), "animation"),
        ("--seeds", arguments.seeds.is_some(), suite.has_arms() || suite.denoises(), "quick, full and denoise"),
        ("--bound", arguments.bound, suite.has_arms(), "quick and full"),
        ("--arms", !arguments.arms.is_empty(), suite.has_arms(), "quick and full"),
    ] {
        if is_given && !is_used {
            bail!("{option} is for --suite {suites}: this suite does not look at it");
        }
    }
    for (option, is_given) in [("--arms", !arguments.arms.is_empty()), ("--seeds", arguments.seeds.is_some())] {
        if is_given && arguments.bound {
            bail!("{option} is not for --bound, which renders nothing but references: leave one of them out");
        }
    }
    if suite.denoises() && arguments.denoise.iter().any(|choice| choice.kind().is_none()) {
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
    tables::print_calibrations(&results.calibrations);
    tables::print_races(&results);
    Ok(())
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
    // All of them before the first frame: what is not installed is told of before hours of others.
    let open =
        |kind: Option<DenoiserKind>| Ok((kind, kind.map(Denoiser::open).transpose()?.map(|opened| opened.name())));
    let denoisers = denoisers_or(&[DenoiseChoice::None], arguments).map(open).collect::<Result<Vec<_>>>()?;
    check_inputs(&scenes_or(&SHOTS, arguments)?, &arguments.display)?;
    let file = AnimationResults::file(&arguments.output)?;
    let mut results = Vec::new();
    for (kind, denoiser) in denoisers {
        let rows = run_animation(arguments, kind)?;
        tables::print_animation(denoiser.as_deref(), &rows);
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

/// Arms by name, and those that others are compared with.
fn named_arms(names: &[String]) -> Vec<Arm> {
    let is_named = |arm: Arm| names.iter().any(|name| name == arm.name());
    let is_after_as_asked = [Arm::UniformEqualTime, Arm::ToThreshold].into_iter().any(is_named);
    let needed = |arm: Arm| arm == Arm::Uniform || (arm == Arm::AsAsked && is_after_as_asked);
    Arm::ALL.into_iter().filter(|&arm| needed(arm) || is_named(arm)).collect()
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
