//! Names what `tonemap` writes and numbers what it reads.

use super::TonemapArguments;
use crate::cli::targets::{check_kept, display_file};
use anyhow::{Context, Result};
use fechner::animate::name::FrameName;
use std::collections::BTreeSet;
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
    if arguments.input.len() == 1 && !name.as_encoded_bytes().contains(&b'#') {
        return Ok(vec![output.clone()]);
    }
    let name = name.to_str().with_context(|| {
        format!("{}: the name of a sequence must be UTF-8, for numbers to be put into it", output.display())
    })?;
    let pattern = FrameName::parse(name).with_context(|| {
        format!(
            "{}: the name of a sequence needs one run of # for the digits of the frame's number, such as night.####.png",
            output.display()
        )
    })?;
    let target = |frame: i64| output.with_file_name(pattern.of(frame));
    let numbers = frame_numbers(&arguments.input).unwrap_or_else(|| (1..=arguments.input.len() as i64).collect());
    Ok(numbers.into_iter().map(target).collect())
}

/// How many frames after the one before each is: by their numbers in order of time, else one.
pub(super) fn frames_since_last(numbers: Option<Vec<i64>>, count: usize) -> Vec<u64> {
    let steps = numbers.map(|numbers| numbers.windows(2).map(|pair| pair[1].abs_diff(pair[0])).collect());
    let steps: Vec<u64> = steps.unwrap_or_else(|| vec![1; count.saturating_sub(1)]);
    std::iter::once(1).chain(steps).collect()
}

/// The numbers by which the files' names differ, before what follows the last dot: of those of which all names have
/// different ones the last that ascend as the files are given, else the last; `None` where there are none.
pub(super) fn frame_numbers(files: &[PathBuf]) -> Option<Vec<i64>> {
    let all: Vec<Vec<Option<i64>>> =
        files.iter().map(|file| Some(numbers_from_end(file.file_stem()?.to_str()?))).collect::<Option<_>>()?;
    let fewest = all.iter().map(Vec::len).min().unwrap_or(0);
    let at_place = |place: usize| {
        let numbers: Vec<i64> = all.iter().map(|numbers| numbers[place]).collect::<Option<_>>()?;
        let different: BTreeSet<i64> = numbers.iter().copied().collect();
        (different.len() == numbers.len()).then_some(numbers)
    };
    let different: Vec<Vec<i64>> = (0..fewest).filter_map(at_place).collect();
    let last = different.first().cloned();
    different.into_iter().find(|numbers| numbers.is_sorted()).or(last)
}

/// All runs of digits in a name as numbers, the last first; `None` for those that are too long for one. Below 0 are
/// those with a minus that stands at the name's start, or after a dot or an underscore: between words it is a hyphen.
fn numbers_from_end(stem: &str) -> Vec<Option<i64>> {
    let (mut numbers, mut left) = (Vec::new(), stem);
    while let Some(last) = left.rfind(|c: char| c.is_ascii_digit()) {
        let before = left[..=last].trim_end_matches(|c: char| c.is_ascii_digit());
        let is_negative =
            before.strip_suffix('-').is_some_and(|before| before.is_empty() || before.ends_with(['.', '_']));
        let number = left[before.len()..=last].parse::<i64>().ok();
        numbers.push(number.map(|number| if is_negative { -number } else { number }));
        left = before;
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_by_which_names_differ() {
        let of = |names: &[&str]| frame_numbers(&names.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(of(&["s.0001.left.exr", "s.0011.left.exr"]), Some(vec![1, 11]));
        assert_eq!(of(&["s.10.v2.exr", "s.9.v2.exr"]), Some(vec![10, 9]));
        assert_eq!(of(&["v2/s.0001.exr", "v3/s.0002.exr"]), Some(vec![1, 2]));
        assert_eq!(of(&["s.-0001.exr", "s.0000.exr", "s.0001.exr"]), Some(vec![-1, 0, 1]));
        assert_eq!(of(&["s-0002.exr", "s-0001.exr"]), Some(vec![2, 1]));
        assert_eq!(of(&["r.0001_64spp.exr", "r.0002_16spp.exr", "r.0003_32spp.exr"]), Some(vec![1, 2, 3]));
        // Where no place has different ones, none has.
        assert_eq!(of(&["a1.exr", "b1.exr"]), None);
        assert_eq!(of(&["a.exr", "a2.exr"]), None);
        assert_eq!(of(&["é7.99999999999999999999.exr", "é8.99999999999999999998.exr"]), Some(vec![7, 8]));
        assert_eq!(frames_since_last(of(&["s.-2.exr", "s.0.exr", "s.1.exr"]), 3), [1, 2, 1]);
    }
}
