//! `fechner bench`: what adaptive sampling saves.

use super::seeing::parse_positive;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use fechner::benchmark::{Arm, BenchSettings, bounds, run as run_bench};
use std::path::{Path, PathBuf};

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArguments {
    /// Scenes; without any, those of the folder `scenes`.
    scenes: Vec<PathBuf>,
    /// How much to do.
    #[arg(long, value_enum, default_value = "quick")]
    suite: Suite,
    /// Folder for results.json, results.csv and report.html; finished renders in it are not made again.
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
    #[arg(long, value_name = "NAME", default_value = "desktop")]
    display: String,
    /// Samples of the reference, as a multiple of what uniform sampling needs (at least 512, at most 16384 a pixel).
    #[arg(long, value_name = "X", value_parser = parse_positive, default_value_t = 16.0)]
    reference_factor: f64,
    /// Only say what uniform sampling and the optimum need by converged variances: what no rule can beat.
    #[arg(long)]
    bound: bool,
    /// Arms, separated by commas, in place of the suite's.
    #[arg(long, value_name = "ARM,…", value_delimiter = ',')]
    arms: Vec<String>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Suite {
    /// 128×128, visibility 4, seven arms, three seeds.
    Quick,
    /// 256×256, visibility 1, every arm, five seeds: a night.
    Full,
}

/// Runs and prints the table.
pub(super) fn run(arguments: &BenchArguments) -> Result<()> {
    let scenes = if arguments.scenes.is_empty() { scenes_of(Path::new("scenes"))? } else { arguments.scenes.clone() };
    let (size, visibility, seeds, arms) = match arguments.suite {
        Suite::Quick => (128, 4.0, 3, Arm::QUICK.to_vec()),
        Suite::Full => (256, 1.0, 5, Arm::ALL.to_vec()),
    };
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
    let say = |line: &str| eprintln!("{line}");
    if arguments.bound {
        println!("| scene | coverage | uniform, spp | optimum, spp | ratio |");
        println!("| --- | --- | --- | --- | --- |");
        for b in bounds(&settings, &say)? {
            let (share, ratio) = (100.0 * b.coverage, b.uniform / b.optimum);
            println!("| {} | {share} % | {:.0} | {:.0} | {ratio:.2} |", b.scene, b.uniform, b.optimum);
        }
        return Ok(());
    }
    let results = run_bench(&settings, &say)?;
    println!("| arm | coverage | samples, uniform / arm | worst scene | oracle / arm |");
    println!("| --- | --- | --- | --- | --- |");
    for s in &results.summary {
        let speedup = s.speedup_samples;
        let efficiency = s.efficiency.map_or_else(String::new, |e| format!("{:.2} (least {:.2})", e.value, e.least));
        println!(
            "| {} | {} % | {:.2} ({:.2} to {:.2}) | {:.2} | {efficiency} |",
            s.arm,
            100.0 * s.coverage,
            speedup.value,
            speedup.low,
            speedup.high,
            speedup.least
        );
    }
    eprintln!("{}", settings.output.join("report.html").display());
    Ok(())
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
    let needed = |arm: Arm| arm == Arm::Uniform || (arm == Arm::AsAsked && is_named(Arm::UniformEqualTime));
    Ok(Arm::ALL.into_iter().filter(|&arm| needed(arm) || is_named(arm)).collect())
}

fn scenes_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("{}: name scenes, or run this where the folder is", folder.display()))?;
    let mut scenes: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    scenes.sort();
    Ok(scenes)
}
