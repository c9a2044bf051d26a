//! `fechner compare A.####.exr B.####.exr --fps F`: can one moving picture be told from another?

use super::{CompareArguments, Figures, Seen, check_alike, write_map};
use crate::cli::channels::both_motions;
use crate::cli::json::write_json;
use crate::cli::picture::InputPicture;
use crate::cli::seeing::tone_operator;
use anyhow::{Context, Result, bail};
use fechner::animate::name::FrameName;
use fechner::exr_read::read_exr;
use fechner::output;
use fechner_perception::Plane;
use fechner_perception::display::Viewing;
use fechner_perception::sequence::{FrameMotion, SequenceFrame, SequenceObserver};
use fechner_perception::tone::{FittedTone, SceneGuide, ToneSettings};
use serde::Serialize;
use std::collections::VecDeque;
use std::path::Path;
use std::process::ExitCode;

/// Frames, spread over the sequence, that the tone operator is fitted to.
const FITTED_FRAMES: usize = 16;

#[derive(Serialize)]
struct SequenceFigures {
    #[serde(flatten)]
    all: Figures,
    frames_per_second: f64,
    eye_follows: bool,
    worst_frame: u32,
    frames: Vec<FrameFigures>,
}

#[derive(Serialize)]
struct FrameFigures {
    frame: u32,
    #[serde(flatten)]
    seen: Seen,
}

/// The files of two sequences, and how they are shown.
struct Sequences<'a> {
    arguments: &'a CompareArguments,
    reference: FrameName,
    test: FrameName,
    velocity: Option<FrameName>,
    map: Option<FrameName>,
    viewing: Viewing,
    /// For files that hold the scene's light.
    fitted: Option<Box<dyn FittedTone>>,
}

/// Exit status 0: the same to the eye; 1: told apart.
pub(super) fn run(arguments: &CompareArguments) -> Result<ExitCode> {
    if arguments.seeing.csf != "castle" {
        bail!("--csf {}: only castle knows how the eye sees what changes in time", arguments.seeing.csf);
    }
    if let Some(target) = &arguments.json {
        output::check_writable(target)?;
    }
    let reference = pattern(&arguments.reference, "the reference")?;
    let numbers = reference.numbers().with_context(|| arguments.reference.display().to_string())?;
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else {
        bail!("{}: there are no such files", arguments.reference.display());
    };
    if let Some(pair) = numbers.windows(2).find(|pair| pair[1] != pair[0] + 1) {
        bail!("{}: frame {} is missing", arguments.reference.display(), pair[0] + 1);
    }
    let sequences = Sequences::new(arguments, reference, &numbers)?;
    let observer = SequenceObserver::new(&sequences.viewing)?;
    let reach = observer.reach() as u32;
    let mut window: VecDeque<SequenceFrame> = VecDeque::new();
    let mut next = first;
    let mut frames = Vec::new();
    for frame in first..=last {
        while next <= last && next <= frame + reach {
            window.push_back(sequences.frame(next)?);
            next += 1;
        }
        while next as usize - window.len() < frame.saturating_sub(reach).max(first) as usize {
            window.pop_front();
        }
        let now = frame as usize + window.len() - next as usize;
        let difference = observer.difference(&window.iter().collect::<Vec<_>>(), now)?;
        if let Some(map) = &sequences.map {
            write_map(&map.of(frame), &difference)?;
        }
        frames.push(FrameFigures { frame, seen: Seen::of(&difference) });
    }
    sequences.report(frames)
}

fn pattern(path: &Path, what: &str) -> Result<FrameName> {
    path.to_str().and_then(FrameName::parse).with_context(|| {
        format!(
            "{}: {what} of a sequence has # for each digit of the frame's number, as out/shot.####.exr",
            path.display()
        )
    })
}

impl<'a> Sequences<'a> {
    fn new(arguments: &'a CompareArguments, reference: FrameName, numbers: &[u32]) -> Result<Self> {
        let test = pattern(&arguments.test, "the test")?;
        let velocity = arguments.velocity.as_deref().map(|path| pattern(path, "the motion")).transpose()?;
        let map = arguments.map.as_deref().map(|path| pattern(path, "the map")).transpose()?;
        if let Some(map) = &map {
            output::check_writable(&map.of(numbers[0]))?;
        }
        let operator = tone_operator(&arguments.operator, &ToneSettings::default())?;
        let nits_per_unit = arguments.seeing.nits_per_unit;
        let mut viewing = arguments.seeing.viewing()?;
        viewing.display.frames_per_second =
            arguments.fps.context("--fps: how many frames a second a sequence has decides what is seen in it")?;
        let viewing = InputPicture::read(&reference.of(numbers[0]), nits_per_unit)?.viewed(&viewing)?;
        // One exposure for the whole sequence, as a viewer would hold it.
        let count = numbers.len().min(FITTED_FRAMES);
        let mut guide = Vec::new();
        let mut width = 0;
        for index in 0..count {
            let frame = numbers[index * numbers.len() / count];
            let picture = InputPicture::read(&reference.of(frame), nits_per_unit)?;
            width = picture.size().0;
            guide.extend(picture.scene_luminance().map_or_else(Vec::new, Plane::into_values));
        }
        let fitted = if guide.is_empty() {
            None
        } else {
            let guide = Plane::from_values(width, guide.len() / width, guide).context("frames of several sizes")?;
            Some(operator.fit(&SceneGuide::of(&guide), &viewing, None))
        };
        Ok(Self { arguments, reference, test, velocity, map, viewing, fitted })
    }

    /// Reads one frame of both.
    fn frame(&self, frame: u32) -> Result<SequenceFrame> {
        let nits_per_unit = self.arguments.seeing.nits_per_unit;
        let files = [self.reference.of(frame), self.test.of(frame)];
        let [reference, test] = files.each_ref().map(|file| InputPicture::read(file, nits_per_unit));
        let (reference, test) = (reference?, test?);
        check_alike((&files[0], &reference), (&files[1], &test))?;
        let (width, height) = reference.size();
        let motion = match &self.velocity {
            Some(name) => Some(read_motion(&name.of(frame), (width, height))?),
            None => None,
        };
        let shown = |picture: &InputPicture| picture.displayed_rgb(self.fitted.as_deref(), &self.viewing);
        Ok(SequenceFrame::new(&shown(&reference), &shown(&test), width, height, motion)?)
    }

    fn report(&self, frames: Vec<FrameFigures>) -> Result<ExitCode> {
        let by_worst =
            |a: &&FrameFigures, b: &&FrameFigures| a.seen.worst_visibility.total_cmp(&b.seen.worst_visibility);
        let worst = frames.iter().max_by(by_worst).context("a sequence has at least one frame")?;
        let mean = |of: fn(&Seen) -> f64| frames.iter().map(|frame| of(&frame.seen)).sum::<f64>() / frames.len() as f64;
        let seen = Seen {
            mean_visibility: mean(|seen| seen.mean_visibility),
            visible_fraction: mean(|seen| seen.visible_fraction),
            ..worst.seen
        };
        let figures = SequenceFigures {
            all: Figures {
                reference: self.arguments.reference.display().to_string(),
                test: self.arguments.test.display().to_string(),
                display: self.viewing.display.name.clone(),
                pixels_per_degree: self.viewing.display.pixels_per_degree,
                csf: "castle",
                seen,
            },
            frames_per_second: self.viewing.display.frames_per_second,
            eye_follows: self.velocity.is_some(),
            worst_frame: worst.frame,
            frames,
        };
        if let Some(path) = &self.arguments.json {
            write_json(path, &figures)?;
        }
        println!(
            "{}: worst visibility {:.2} in frame {} (seen in a 1° patch with {:.1} %), {:.2} % of {} frames above threshold, \
             on \"{}\" at {} pixels a degree and {} frames a second, by an eye that {} (model-predicted; calibrated on \
             gratings, not on renderings)",
            if seen.is_visible { "visible in motion" } else { "the same to the eye in motion" },
            seen.worst_visibility,
            figures.worst_frame,
            100.0 * seen.detection_probability_worst,
            100.0 * seen.visible_fraction,
            figures.frames.len(),
            figures.all.display,
            figures.all.pixels_per_degree,
            figures.frames_per_second,
            if figures.eye_follows { "follows what moves" } else { "rests" },
        );
        Ok(ExitCode::from(u8::from(seen.is_visible)))
    }
}

/// Motion in pixels under the names that renderers give it.
fn read_motion(path: &Path, (width, height): (usize, usize)) -> Result<FrameMotion> {
    let exr = read_exr(path)?;
    if (exr.width as usize, exr.height as usize) != (width, height) {
        bail!("{} has {}x{} pixels, the picture {width}x{height}", path.display(), exr.width, exr.height);
    }
    let Some(motions) = both_motions(&exr) else {
        bail!(
            "{}: no motion channels; velocity.X/Y (and velocity_previous.X/Y), Vector.X/Y/Z/W, motion.X/Y and forward.u/v are \
             known, with or without a layer before them",
            path.display()
        );
    };
    let planes = |[x, y]: [Vec<f32>; 2]| -> Result<[Plane; 2]> {
        Ok([Plane::from_values(width, height, x)?, Plane::from_values(width, height, y)?])
    };
    Ok(FrameMotion { to_next: planes(motions.to_next)?, to_previous: planes(motions.to_previous)? })
}
