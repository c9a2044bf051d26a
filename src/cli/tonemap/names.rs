//! Names of what is written and numbers of what is read.

use super::TonemapArguments;
use crate::cli::targets::{check_kept, display_file};
use anyhow::{Context, Result, bail};
use std::path::PathBuf;

/// One file name for each input. None of the files that are written is one that is read, nor another's.
pub(super) fn targets(arguments: &TonemapArguments) -> Result<Vec<PathBuf>> {
    let targets = named_targets(arguments)?;
    let pictures = arguments.input.iter().map(|path| ("a picture", Some(path.as_path())));
    let read: Vec<_> = pictures.chain([display_file(arguments.display.as_deref())]).collect();
    let state = ("--state", arguments.state.as_deref());
    let written: Vec<_> = targets.iter().map(|path| ("-o", Some(path.as_path()))).chain([state]).collect();
    check_kept(&read, &written)?;
    Ok(targets)
}

fn named_targets(arguments: &TonemapArguments) -> Result<Vec<PathBuf>> {
    let output = &arguments.output;
    let name = output.file_name().unwrap_or_default();
    let digits = name.as_encoded_bytes().iter().filter(|&&byte| byte == b'#').count();
    if arguments.input.len() == 1 && digits == 0 {
        return Ok(vec![output.clone()]);
    }
    let name = name.to_str().with_context(|| {
        format!("{}: the name of a sequence must be UTF-8, for numbers to be put into it", output.display())
    })?;
    let hashes = "#".repeat(digits);
    if digits == 0 || !name.contains(&hashes) {
        bail!(
            "{}: the name of a sequence needs one run of # for the digits of the frame's number, such as night.####.png",
            output.display()
        );
    }
    let target = |frame: u64| output.with_file_name(name.replace(&hashes, &format!("{frame:0digits$}")));
    let numbers = frame_numbers(&arguments.input).unwrap_or_else(|| (1..=arguments.input.len() as u64).collect());
    Ok(numbers.into_iter().map(target).collect())
}

/// How many frames after the one before each is: by their numbers in order of time, else one.
pub(super) fn frames_since_last(numbers: Option<Vec<u64>>, count: usize) -> Vec<u64> {
    let steps = numbers.map(|numbers| numbers.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect());
    let steps: Vec<u64> = steps.unwrap_or_else(|| vec![1; count.saturating_sub(1)]);
    std::iter::once(1).chain(steps).collect()
}

/// The numbers at the end of the files' names, before what follows the last dot; `None` unless all have different ones.
pub(super) fn frame_numbers(files: &[PathBuf]) -> Option<Vec<u64>> {
    let number = |file: &PathBuf| {
        let stem = file.file_stem()?.to_str()?;
        stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..].parse().ok()
    };
    let numbers: Vec<u64> = files.iter().map(number).collect::<Option<_>>()?;
    let different: std::collections::BTreeSet<u64> = numbers.iter().copied().collect();
    (different.len() == numbers.len()).then_some(numbers)
}
