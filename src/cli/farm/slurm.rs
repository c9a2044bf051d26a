//! `farm slurm`: submits the farm as Slurm jobs. What these do is in the scripts beside it.

use super::absolute;
use crate::cli::numbers::whole;
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::farm::Farm;
use fechner::output;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `farm slurm`.
#[derive(Debug, Args)]
pub(super) struct SlurmArguments {
    /// The farm's folder, on a file system that all nodes see under this name.
    folder: PathBuf,
    /// Processors of a unit or merge.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole(1..=1023), allow_negative_numbers = true)]
    cpus: u32,
    /// Memory of a unit or merge, as Slurm writes it.
    #[arg(long, value_name = "SIZE", default_value = "4G", value_parser = parse_memory, allow_hyphen_values = true)]
    memory: String,
    /// Time limit of a unit or merge, as Slurm writes it; a unit that does not make it goes on from its checkpoint.
    #[arg(long, value_name = "TIME", default_value = "01:00:00", value_parser = parse_time, allow_hyphen_values = true)]
    time: String,
    /// Most units at once.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = whole(1..=u32::MAX), allow_negative_numbers = true)]
    at_once: u32,
    /// Most tasks of a job array (less than the cluster's MaxArraySize); with more units than that a task has several.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = whole(1..=u32::MAX), allow_negative_numbers = true)]
    array: u32,
    /// Another option for every job, such as --option=--partition=render.
    #[arg(long = "option", value_name = "OPTION", allow_hyphen_values = true)]
    options: Vec<String>,
}

/// A size as sbatch reads it: MiB, or with the unit behind it.
fn parse_memory(text: &str) -> Result<String, String> {
    match text.strip_suffix(['K', 'M', 'G', 'T', 'k', 'm', 'g', 't']).unwrap_or(text) {
        number if is_whole(number) => Ok(text.to_owned()),
        _ => Err(format!("{text:?} is not a size of Slurm; expected MiB, or a number with K, M, G or T, such as 4G")),
    }
}

/// A time as sbatch reads it: minutes, minutes:seconds or hours:minutes:seconds; days- before hours,
/// hours:minutes or all three.
fn parse_time(text: &str) -> Result<String, String> {
    let (days, clock) = text.split_once('-').map_or((None, text), |(days, clock)| (Some(days), clock));
    let is_clock = clock.split(':').count() <= 3 && clock.split(':').all(is_whole);
    if (is_clock && days.is_none_or(is_whole)) || ["UNLIMITED", "INFINITE"].contains(&text.to_uppercase().as_str()) {
        return Ok(text.to_owned());
    }
    Err(format!(
        "{text:?} is not a time of Slurm; expected MINUTES, HOURS:MINUTES:SECONDS or DAYS-HOURS, such as 01:00:00"
    ))
}

/// Digits alone.
fn is_whole(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

const SUBMIT: &str = include_str!("slurm/submit.sh");
const UNITS: &str = include_str!("slurm/units.sh");
const MERGE: &str = include_str!("slurm/merge.sh");

/// Writes the scripts, and says how to start.
pub(super) fn run(arguments: &SlurmArguments) -> Result<ExitCode> {
    let folder = absolute(&arguments.folder)?;
    Farm::open(&folder)?;
    let program = std::env::current_exe().context("where this program is")?;
    let word = |path: &std::path::Path| match path.to_str() {
        Some(text) if !text.contains(['\'', '\n', '%']) => Ok(text.to_owned()),
        _ => bail!("{}: a name that scripts cannot hold (Unicode without ', % and line ends)", path.display()),
    };
    let (farm, program) = (word(&folder)?, word(&program)?);
    let mut head = format!(
        "#SBATCH --cpus-per-task={}\n#SBATCH --mem={}\n#SBATCH --time={}\n",
        arguments.cpus, arguments.memory, arguments.time
    );
    for option in &arguments.options {
        if !option.starts_with('-') || option.contains('\n') {
            bail!("--option {option}: an option of sbatch begins with -");
        }
        head.push_str(&format!("#SBATCH {option}\n"));
    }
    let scripts = folder.join("slurm");
    std::fs::create_dir_all(&scripts).with_context(|| format!("{}", scripts.display()))?;
    for (name, template) in [("submit.sh", SUBMIT), ("units.sh", UNITS), ("merge.sh", MERGE)] {
        let text = filled(
            template,
            &[
                ("#SBATCH @HEAD@\n", &head),
                ("@FARM@", &farm),
                ("@FECHNER@", &program),
                ("@CPUS@", &arguments.cpus.to_string()),
                ("@ARRAY@", &arguments.array.to_string()),
                ("@AT_ONCE@", &arguments.at_once.to_string()),
            ],
        );
        output::write_beside(&scripts.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    answer!("sh '{}'", scripts.join("submit.sh").display());
    Ok(ExitCode::SUCCESS)
}

/// A template with values in the places of their names, in one go: a value that holds a name stays as it is.
fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let (mut text, mut rest) = (String::new(), template);
    let first = |rest: &str| values.iter().filter_map(|(name, value)| Some((rest.find(name)?, *name, *value))).min();
    while let Some((start, name, value)) = first(rest) {
        text.push_str(&rest[..start]);
        text.push_str(value);
        rest = &rest[start + name.len()..];
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of sbatch(1).
    #[test]
    fn sizes_and_times_are_those_that_slurm_reads() {
        for time in ["90", "90:30", "01:00:00", "2-12", "2-12:30", "2-12:30:00", "UNLIMITED", "infinite"] {
            assert_eq!(parse_time(time).as_deref(), Ok(time));
        }
        for time in ["", "foo", "1h", "1:2:3:4", "-5", "1-", "1-2-3", "1:", "1 0"] {
            assert!(parse_time(time).is_err(), "{time}");
        }
        for memory in ["4096", "4G", "512M", "0", "1T"] {
            assert_eq!(parse_memory(memory).as_deref(), Ok(memory));
        }
        for memory in ["", "G", "4GB", "4.5G", "-1", "4 G"] {
            assert!(parse_memory(memory).is_err(), "{memory}");
        }
    }

    #[test]
    fn values_that_look_like_names_stay() {
        let values = [("@FARM@", "a@CPUS@b"), ("@CPUS@", "8")];
        assert_eq!(filled("cd @FARM@ -t @CPUS@ '@FARM@'.", &values), "cd a@CPUS@b -t 8 'a@CPUS@b'.");
    }
}
