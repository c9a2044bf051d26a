//! `fechner compare A.####.exr B.####.exr --fps F`: can one moving picture be told from another?

use super::{CompareArguments, Figures, Seen, check_alike, write_map};
use crate::cli::channels;
use crate::cli::finished::write_figures;
use crate::cli::kept_tone::{as_rendered, first_scene};
use crate::cli::maps::check_map;
use crate::cli::picture::{BEFORE_BLACK, InputPicture, Shape, Source};
use crate::cli::targets::check_kept;
use crate::cli::words::{OF_THE_MODEL, count, listed};
use anyhow::{Context, Result, bail};
use fechner::animate::name::FrameName;
use fechner::animate::spread_over;
use fechner::output;
use fechner_perception::csf;
use fechner_perception::display::Viewing;
use fechner_perception::sequence::{FrameMotion, SequenceFrame, SequenceObserver};
use fechner_perception::tone::{
    AdaptationState, DEFAULT_OPERATOR, FittedTone, Goal, SceneLight, ToneOperator, ToneSettings, operator_named,
};
use serde::Serialize;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

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
    /// Number of the first frame.
    first: u32,
    /// Shape of the first frame, and so of all.
    shape: Shape,
    viewing: Viewing,
    showing: Showing,
}

/// What brings files that hold the scene's light to the display.
enum Showing {
    /// Each frame as it was shown when it was rendered: eyes may adapt from frame to frame.
    AsRendered,
    /// One operator for the whole sequence; none for frames that are ready for the display.
    By(Option<Box<dyn FittedTone>>),
}

/// Exit status 0: the same to the eye; 1: told apart.
pub(super) fn run(arguments: &CompareArguments) -> Result<ExitCode> {
    if arguments.seeing.csf != csf::DEFAULT {
        bail!("--csf {}: only {} knows how the eye sees what changes in time", arguments.seeing.csf, csf::DEFAULT);
    }
    if let Some(target) = &arguments.json {
        output::check_writable(target)?;
    }
    let (numbers, sequences) = Sequences::open(arguments)?;
    let (first, last) = (numbers[0], numbers[numbers.len() - 1]);
    let observer = SequenceObserver::new(&sequences.viewing)?;
    // The last frame's number may be the largest of 32 bits.
    let reach = observer.reach() as u64;
    let mut window: VecDeque<SequenceFrame> = VecDeque::new();
    let mut next = u64::from(first);
    let mut frames = Vec::new();
    for frame in first..=last {
        let middle = u64::from(frame);
        while next <= u64::from(last).min(middle + reach) {
            window.push_back(observer.held(sequences.frame(next as u32)?));
            next += 1;
        }
        while next - (window.len() as u64) < middle.saturating_sub(reach).max(u64::from(first)) {
            window.pop_front();
        }
        let now = (middle + window.len() as u64 - next) as usize;
        let difference = observer.difference(&window.iter().collect::<Vec<_>>(), now)?;
        if let Some(map) = &sequences.map {
            let file = map.of(frame);
            let legend = write_map(&file, &difference)?;
            // One scale for all frames.
            if frame == first {
                say!("{} and on: {legend}", file.display());
            }
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

/// Numbers of the frames whose files are there; at least one.
fn numbers_of(name: &FrameName, path: &Path) -> Result<Vec<u32>> {
    let numbers = name.numbers().with_context(|| path.display().to_string())?;
    if numbers.is_empty() {
        bail!("{}: there are no such files", path.display());
    }
    Ok(numbers)
}

/// Refuses frames that one sequence has and another has not.
fn check_covered((path, numbers): (&Path, &[u32]), (by_path, by): (&Path, &[u32])) -> Result<()> {
    let lonely: Vec<u32> = numbers.iter().copied().filter(|number| by.binary_search(number).is_err()).collect();
    if lonely.is_empty() {
        return Ok(());
    }
    bail!(
        "{}: {} {} there, and missing of {}: sequences of equal frames can be compared",
        path.display(),
        if let [one] = lonely[..] { format!("frame {one}") } else { format!("frames {}", listed(&lonely)) },
        if lonely.len() == 1 { "is" } else { "are" },
        by_path.display()
    )
}

/// Refuses maps or figures in the place of a frame that is read.
fn check_frames_kept(
    arguments: &CompareArguments,
    read: [Option<&FrameName>; 3],
    map: Option<&FrameName>,
    numbers: &[u32],
) -> Result<()> {
    let of_frames = |name: &FrameName| -> Vec<PathBuf> { numbers.iter().map(|&frame| name.of(frame)).collect() };
    let frames: Vec<PathBuf> = read.into_iter().flatten().flat_map(of_frames).collect();
    let maps = map.map_or_else(Vec::new, of_frames);
    let read = frames.iter().map(|path| ("a frame", Some(path.as_path()))).chain([arguments.seeing.display_file()]);
    let figures = ("--json", arguments.json.as_deref());
    let written = maps.iter().map(|path| ("--map", Some(path.as_path()))).chain([figures]);
    check_kept(&read.collect::<Vec<_>>(), &written.collect::<Vec<_>>())
}

/// The operator as it shows a whole sequence, by some frames from all over it: fitted to them one below the other, with
/// eyes that are adapted to each of them alike. `None` for frames that are ready for the display.
fn fit(
    operator: &dyn ToneOperator,
    name: &FrameName,
    numbers: &[u32],
    nits_per_unit: Option<f64>,
    viewing: &Viewing,
) -> Result<Option<Box<dyn FittedTone>>> {
    let (mut lights, mut size): (Vec<SceneLight>, _) = (Vec::new(), None);
    for index in spread_over(numbers.len()) {
        let path = name.of(numbers[index]);
        let picture = InputPicture::read_frame(&path, nits_per_unit)?;
        let Some(light) = picture.scene_light(operator) else { return Ok(None) };
        if *size.get_or_insert(picture.size()) != picture.size() {
            bail!("{}: it has another size than {}", path.display(), name.of(numbers[0]).display());
        }
        lights.push(light);
    }
    let goals: Vec<Goal> =
        lights.iter().map(|light| operator.goal(&light.guide_for(operator), viewing.display.pixel_density())).collect();
    let eye = AdaptationState::adapted_to(Goal::mean(&goals), &operator.kinetics());
    let (width, height) = size.unwrap_or_default();
    let all = SceneLight::stacked(&lights.iter().collect::<Vec<_>>(), width, height);
    Ok(Some(operator.fit(&all.guide_for(operator), viewing, Some(&eye))))
}

impl<'a> Sequences<'a> {
    /// Numbers of the frames, and how to read them.
    fn open(arguments: &'a CompareArguments) -> Result<(Vec<u32>, Self)> {
        let reference = pattern(&arguments.reference, "the reference")?;
        let test = pattern(&arguments.test, "the test")?;
        let velocity = arguments.velocity.as_deref().map(|path| pattern(path, "the motion")).transpose()?;
        let numbers = numbers_of(&reference, &arguments.reference)?;
        if let Some(pair) = numbers.windows(2).find(|pair| pair[1] != pair[0] + 1) {
            bail!("{}: frame {} is missing", arguments.reference.display(), pair[0] + 1);
        }
        let of_reference = (arguments.reference.as_path(), numbers.as_slice());
        let test_numbers = numbers_of(&test, &arguments.test)?;
        let of_test = (arguments.test.as_path(), test_numbers.as_slice());
        check_covered(of_reference, of_test)?;
        check_covered(of_test, of_reference)?;
        if let (Some(name), Some(path)) = (&velocity, &arguments.velocity) {
            check_covered(of_reference, (path, &numbers_of(name, path)?))?;
        }
        let sequences = Self::new(arguments, [reference, test], velocity, &numbers)?;
        Ok((numbers, sequences))
    }

    fn new(
        arguments: &'a CompareArguments,
        [reference, test]: [FrameName; 2],
        velocity: Option<FrameName>,
        numbers: &[u32],
    ) -> Result<Self> {
        let map = arguments.map.as_deref().map(|path| pattern(path, "the map")).transpose()?;
        if let Some(map) = &map {
            check_map(&map.of(numbers[0]))?;
        }
        check_frames_kept(arguments, [Some(&reference), Some(&test), velocity.as_ref()], map.as_ref(), numbers)?;
        let nits_per_unit = arguments.seeing.nits_per_unit;
        let files = [&reference, &test].map(|name| name.of(numbers[0]));
        let [first, first_test] = files.each_ref().map(|file| InputPicture::read_frame(file, nits_per_unit));
        let (first, first_test) = (first?, first_test?);
        let firsts = [(files[0].as_path(), &first), (files[1].as_path(), &first_test)];
        arguments.seeing.note_what_is_ready(arguments.operator.as_deref(), &firsts);
        let mut viewing = arguments.seeing.viewing(&firsts)?;
        viewing.display.frames_per_second =
            arguments.fps.context("--fps: how many frames a second a sequence has decides what is seen in it")?;
        let viewing = first.viewed(&viewing)?;
        let asked = arguments.operator.as_deref();
        let showing = if asked.is_none() && as_rendered(&firsts, &viewing).is_some() {
            Showing::AsRendered
        } else {
            let operator = operator_named(asked.unwrap_or(DEFAULT_OPERATOR), &ToneSettings::default())?;
            // One exposure for the whole sequence, as a viewer would hold it.
            let fit_to = |name: &FrameName| fit(operator.as_ref(), name, numbers, nits_per_unit, &viewing);
            Showing::By(match fit_to(&reference)? {
                Some(fitted) => Some(fitted),
                None => fit_to(&test)?,
            })
        };
        Ok(Self {
            arguments,
            reference,
            test,
            velocity,
            map,
            first: numbers[0],
            shape: first.shape(),
            viewing,
            showing,
        })
    }

    /// Reads one frame of both.
    fn frame(&self, frame: u32) -> Result<SequenceFrame> {
        let nits_per_unit = self.arguments.seeing.nits_per_unit;
        let files = [self.reference.of(frame), self.test.of(frame)];
        let [reference, test] = files.each_ref().map(|file| InputPicture::read_frame(file, nits_per_unit));
        let (reference, test) = (reference?, test?);
        let first = self.reference.of(self.first);
        for (file, picture) in files.iter().zip([&reference, &test]) {
            check_alike((&first, self.shape), (file, picture.shape()))?;
            picture.note_if_transparent(Source::frame(file), BEFORE_BLACK);
        }
        let (width, height) = reference.size();
        let motion = match &self.velocity {
            Some(name) => Some(read_motion(&name.of(frame), (width, height))?),
            None => None,
        };
        let kept;
        let fitted = match &self.showing {
            Showing::By(fitted) => fitted.as_deref(),
            Showing::AsRendered => {
                kept = self.kept_tone(&[(&files[0], &reference), (&files[1], &test)])?;
                Some(kept.as_ref())
            }
        };
        let shown = |picture: &InputPicture| picture.displayed_rgb(fitted, &self.viewing);
        Ok(SequenceFrame::new(&shown(&reference), &shown(&test), width, height, motion)?)
    }

    /// The operator by which a frame was shown when it was rendered.
    fn kept_tone(&self, pictures: &[(&Path, &InputPicture); 2]) -> Result<Box<dyn FittedTone>> {
        let (path, picture) = first_scene(pictures).unwrap_or(pictures[0]);
        picture.kept_tone().and_then(|kept| kept.on(&self.viewing)).with_context(|| {
            format!(
                "{}: it does not say how it was shown on \"{}\" when it was rendered, as the first frame does: --operator shows all frames \
                 by one",
                path.display(),
                self.viewing.display.name
            )
        })
    }

    fn report(&self, frames: Vec<FrameFigures>) -> Result<ExitCode> {
        let by_worst =
            |a: &&FrameFigures, b: &&FrameFigures| a.seen.worst_visibility.total_cmp(&b.seen.worst_visibility);
        // The last of equals is taken: from behind, so that it is the first frame.
        let worst = frames.iter().rev().max_by(by_worst).context("a sequence has at least one frame")?;
        let mean = |of: fn(&Seen) -> f64| frames.iter().map(|frame| of(&frame.seen)).sum::<f64>() / frames.len() as f64;
        let seen = Seen {
            mean_visibility: mean(|seen| seen.mean_visibility),
            visible_fraction: mean(|seen| seen.visible_fraction),
            ..worst.seen
        };
        let operator = match &self.showing {
            Showing::AsRendered => Some("of each frame, as it was rendered".to_owned()),
            Showing::By(fitted) => fitted.as_ref().map(|fitted| fitted.describe()),
        };
        let figures = SequenceFigures {
            all: Figures::of(self.arguments, &self.viewing, csf::DEFAULT, operator, seen),
            frames_per_second: self.viewing.display.frames_per_second,
            eye_follows: self.velocity.is_some(),
            worst_frame: worst.frame,
            frames,
        };
        answer!(
            "{}: worst visibility {:.2} in frame {} (seen in a 1° patch with {:.1} %), {:.2} % of {} above threshold, \
             on \"{}\" at {} pixels a degree and {} frames a second, by an eye that {} ({OF_THE_MODEL})",
            if seen.is_visible { "visible in motion" } else { "the same to the eye in motion" },
            seen.worst_visibility,
            figures.worst_frame,
            100.0 * seen.detection_probability_worst,
            100.0 * seen.visible_fraction,
            count(figures.frames.len(), "frame"),
            figures.all.display,
            figures.all.pixels_per_degree,
            figures.frames_per_second,
            if figures.eye_follows { "follows what moves" } else { "rests" },
        );
        write_figures(self.arguments.json.as_deref(), &figures)?;
        Ok(ExitCode::from(u8::from(seen.is_visible)))
    }
}

/// Motion in pixels under the names that renderers give it.
fn read_motion(path: &Path, size: (usize, usize)) -> Result<FrameMotion> {
    channels::motion_planes(path, &channels::read_motion(path, size)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner::output::{Attribute, NITS_PER_UNIT, Picture, write_exr};

    /// An operator that looks at the middle of a picture is not fitted to the middle frames alone.
    #[test]
    fn all_frames_count_alike() {
        let folder = tempfile::tempdir().expect("a folder");
        let name = FrameName::parse(folder.path().join("a.#.exr").to_str().expect("a name")).expect("a pattern");
        for (frame, light) in [(1, 0.1), (2, 1.0), (3, 1000.0), (4, 1.0)] {
            let mut picture = Picture::new(16, 16);
            ["R", "G", "B"].into_iter().for_each(|channel| picture.push_f32(channel, vec![light; 256]));
            picture.push_attribute(NITS_PER_UNIT, Attribute::Float(1.0));
            write_exr(&name.of(frame), &picture).expect("written");
        }
        let shown = |operator: &str| {
            let operator = operator_named(operator, &ToneSettings::default()).expect("an operator");
            let fitted = fit(operator.as_ref(), &name, &[1, 2, 3, 4], None, &Viewing::default()).expect("read");
            fitted.expect("scene light").relative_luminance(1.0)
        };
        let (scheel, ward) = (shown("scheel00"), shown("ward94"));
        assert!((scheel / ward - 1.0).abs() < 1e-4, "{scheel} and {ward}");
    }
}
