//! `fechner tonemap`: HDR pictures as a display shows them to an eye, one by one or as a sequence in time.

mod names;
mod sheet;
mod write;

use self::names::{frame_numbers, frames_since_last, targets};
use self::write::write;
use super::animate::parse_lapse_rate;
use super::numbers::{parse_positive, parse_stops, parse_unit};
use super::picture::{InputPicture, is_of_codes};
use super::seeing::{self, DEFAULT_DISPLAY, display_help, operator_values_or_all};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use fechner::animate::USUAL_FRAMES_PER_SECOND;
use fechner::json_file;
use fechner::output::covered::Covered;
use fechner::output::{self, DisplayedPicture, PartOf, PictureFormat};
use fechner_perception::tone::{
    self, AdaptationScope, AdaptationState, Effects, FittedTone, Goal, Pixel, SceneGuide, SceneLight, ToneOperator,
    ToneSettings, map_picture,
};
use fechner_perception::{Display, Viewing};
use std::path::{Path, PathBuf};

/// Arguments of `tonemap`.
#[derive(Clone, Debug, Args)]
pub(super) struct TonemapArguments {
    /// Pictures (.exr, .hdr); several are a sequence in time, by the numbers in their names where all have different
    /// ones, and else as they are given.
    #[arg(required = true, num_args = 1..)]
    input: Vec<PathBuf>,
    /// .png (16-bit PQ for an HDR display, sRGB for all others, which colour management brings to them), .exr with
    /// what the display emits in units of its white: `absolute` shows that as it is. The name of a sequence has # for
    /// each digit of the frame's number: night.####.png. Numbers are those in the inputs' names where all have
    /// different ones, and else count from 1.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Tone operator, or "all" for a sheet with all of them [default: as the picture was shown when it was rendered,
    /// if its file says so].
    #[arg(long, value_name = "NAME|all", value_parser = operator_values_or_all())]
    operator: Option<String>,
    /// Exposure correction in stops.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = parse_stops, allow_negative_numbers = true)]
    exposure: f64,
    /// Luminance in cd/m² of RGB (1, 1, 1), for files that do not say it.
    #[arg(long, value_name = "CD_M2", value_parser = parse_unit, allow_negative_numbers = true)]
    nits_per_unit: Option<f64>,
    #[arg(long, value_name = "NAME|FILE", help = display_help(
        "desktop; without --operator the one that the picture was made for",
    ))]
    display: Option<String>,
    /// What the eye is adapted to: the view as a whole, or, for the operators that know it, each place of it.
    #[arg(long, value_enum, default_value = "world")]
    adaptation: Scope,
    /// What else the eye loses, in place of what the operator's authors chose. ward-larson97 knows all three,
    /// ferwerda96 acuity.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    effects: Option<Vec<Effect>>,

    #[arg(long, value_name = "N", value_parser = parse_lapse_rate, allow_negative_numbers = true, help_heading = "Over time", help = format!(
        "Frames a second of a sequence, 0.001 to 1000; numbers that are missing take their time [default: {USUAL_FRAMES_PER_SECOND}]",
    ))]
    fps: Option<f64>,
    /// What the eye is adapted to before the first frame; without it, to the first frame.
    #[arg(long, value_name = "CD_M2", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Over time")]
    adapted_to: Option<f64>,
    /// The eye's state, continued from this file if it is there and left in it.
    #[arg(long, value_name = "FILE.json", conflicts_with = "adapted_to", help_heading = "Over time")]
    state: Option<PathBuf>,
    /// The pixel that the eye looks at; without it, all of the view counts.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, allow_hyphen_values = true, help_heading = "Over time")]
    gaze: Option<Gaze>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Scope {
    World,
    Local,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Effect {
    /// Bright places veil their surroundings.
    Glare,
    /// Fine detail is lost in dim light.
    Acuity,
    /// Colour is lost in dim light: ferwerda96, durand-dorsey00 and pattanaik00 always lose it.
    Colour,
    /// Nothing of all this but what the operator always loses.
    None,
}

#[derive(Clone, Copy, Debug)]
struct Gaze(Pixel);

fn parse_pixel(text: &str) -> Result<Gaze, String> {
    let parsed =
        text.split_once(',').and_then(|(x, y)| Some(Pixel { x: x.trim().parse().ok()?, y: y.trim().parse().ok()? }));
    parsed.map(Gaze).ok_or_else(|| format!("\"{text}\" is not a pixel; expected X,Y such as 320,180"))
}

/// A picture in scene cd/m² with what operators look at.
pub(super) struct SceneFrame {
    width: usize,
    rgb_cd_m2: Vec<[f32; 3]>,
    light: SceneLight,
    gaze: Option<Pixel>,
    /// The display, in this picture's pixels.
    viewing: Viewing,
    /// The display in its own.
    display: Display,
    pixel_aspect_ratio: f64,
    /// How much of each pixel is covered, where that is not all: light is multiplied by it.
    alpha: Option<Vec<f32>>,
    /// Where it lies, if it is a part of a larger picture.
    part_of: Option<PartOf>,
}

impl SceneFrame {
    fn read(path: &Path, arguments: &TonemapArguments, viewing: &Viewing) -> Result<Self> {
        Self::of(InputPicture::read_frame(path, arguments.nits_per_unit)?, path, arguments, viewing)
    }

    fn of(picture: InputPicture, path: &Path, arguments: &TonemapArguments, viewing: &Viewing) -> Result<Self> {
        let display = viewing.display.clone();
        let viewing = picture.viewed(viewing).with_context(|| path.display().to_string())?;
        let pixel_aspect_ratio = picture.pixel_aspect_ratio();
        let (alpha, part_of) = (picture.premultiplied_alpha().map(<[f32]>::to_vec), picture.part_of());
        let (width, height) = picture.size();
        let Some(rgb_cd_m2) = picture.light_cd_m2() else {
            bail!(is_ready(path));
        };
        if let Some(Gaze(Pixel { x, y })) = arguments.gaze.filter(|gaze| gaze.0.x >= width || gaze.0.y >= height) {
            bail!("--gaze {x},{y} is outside {}, which has {width}x{height} pixels", path.display());
        }
        let light = SceneLight::with_rods(width, &rgb_cd_m2);
        let light = match &alpha {
            Some(alpha) => light.where_covered(alpha),
            None => light,
        };
        let gaze = arguments.gaze.map(|gaze| gaze.0);
        Ok(Self { width, rgb_cd_m2, light, gaze, viewing, display, pixel_aspect_ratio, alpha, part_of })
    }

    fn guide_for(&self, operator: &dyn ToneOperator) -> SceneGuide<'_> {
        self.light.guide_for(operator).with_gaze(self.gaze)
    }

    fn height(&self) -> usize {
        self.light.luminance_cd_m2().height()
    }

    /// As it is seen before black.
    fn shown(&self, fitted: &dyn FittedTone) -> Vec<[f32; 3]> {
        match self.covered(fitted) {
            Some(covered) => covered.premultiplied(),
            None => map_picture(fitted, self.width, &self.rgb_cd_m2),
        }
    }

    /// The same before whatever lies behind a picture with alpha.
    fn covered(&self, fitted: &dyn FittedTone) -> Option<Covered<'_>> {
        Some(Covered::of(fitted, map_picture, self.width, &self.rgb_cd_m2, self.alpha.as_deref()?))
    }
}

/// Reads, maps and writes.
pub(super) fn run(arguments: &TonemapArguments) -> Result<()> {
    let arguments = &in_time(arguments.clone());
    let targets = targets(arguments)?;
    if let Some(state) = &arguments.state {
        output::check_writable(state)?;
    }
    let format = output::check_target(&targets[0])?;
    // Before an operator is asked for, by which no such file could be shown either.
    if let Some(path) = arguments.input.iter().find(|path| is_of_codes(path) && path.exists()) {
        bail!(is_ready(path));
    }
    let Some(operator) = arguments.operator.as_deref() else {
        return run_as_rendered(arguments, format, &targets);
    };
    let viewing = seeing::viewing(arguments.display.as_deref().unwrap_or(DEFAULT_DISPLAY), None)?;
    let settings = settings(arguments)?;
    if operator == "all" {
        return run_all(arguments, format, &targets, &viewing, &settings);
    }
    let operator = tone::operator_named(operator, &settings)?;
    check_settings(operator.as_ref(), &settings)?;
    if arguments.gaze.is_some() && !operator.sees_adaptation() {
        bail!("--gaze: {} shows the same wherever the eye looks", operator.name());
    }
    let timed = is_timed(arguments);
    if timed && arguments.adaptation == Scope::Local {
        bail!("--adaptation local has no course in time: leave it out for a sequence");
    }
    if arguments.fps.is_some() && !timed {
        bail!(
            "--fps: one picture has no course in time; give several, or what the eye saw before by --adapted-to or --state"
        );
    }
    let mut eye = if timed { Some(Eye::new(arguments, operator.as_ref())?) } else { None };
    let steps = frames_since_last(frame_numbers(&arguments.input), arguments.input.len());
    for ((input, target), frames) in arguments.input.iter().zip(&targets).zip(steps) {
        let frame = SceneFrame::read(input, arguments, &viewing)?;
        let viewing = &frame.viewing;
        let goal = operator.goal(&frame.guide_for(operator.as_ref()), viewing.display.pixel_density());
        let state = eye.as_mut().map(|eye| eye.look_at(goal, frames));
        let fitted = operator.fit(&frame.guide_for(operator.as_ref()), viewing, state.as_ref());
        write(target, format, &frame, fitted.as_ref(), state.as_ref())?;
        answer!("{}: {}", target.display(), fitted.describe());
    }
    if let (Some(path), Some(state)) = (&arguments.state, eye.and_then(|eye| eye.state)) {
        json_file::write(path, &state)?;
    }
    Ok(())
}

fn is_ready(path: &Path) -> String {
    format!("{}: ready for a display already; .exr and .hdr files hold scenes", path.display())
}

/// Its inputs in the order of the numbers in their names: a shell puts 10 before 9.
fn in_time(mut arguments: TonemapArguments) -> TonemapArguments {
    let numbers = frame_numbers(&arguments.input).filter(|numbers| !numbers.is_sorted());
    if let Some(numbers) = numbers {
        let mut numbered: Vec<(i64, PathBuf)> = numbers.into_iter().zip(std::mem::take(&mut arguments.input)).collect();
        numbered.sort_unstable();
        arguments.input = numbered.into_iter().map(|(_, path)| path).collect();
        say!("note: frames are taken in the order of their numbers, from {}", arguments.input[0].display());
    }
    arguments
}

/// Whether the eye has a past.
fn is_timed(arguments: &TonemapArguments) -> bool {
    arguments.input.len() > 1 || arguments.adapted_to.is_some() || arguments.state.is_some()
}

/// Whether something is asked for that only an operator could do.
fn asks_an_operator(arguments: &TonemapArguments) -> bool {
    // Without dots, so that a new argument has to be thought of.
    let TonemapArguments {
        input: _,
        output: _,
        operator: _,
        exposure,
        nits_per_unit: _,
        display: _,
        adaptation,
        effects,
        fps,
        adapted_to,
        state,
        gaze,
    } = arguments;
    *exposure != 0.0
        || *adaptation == Scope::Local
        || effects.is_some()
        || fps.is_some()
        || adapted_to.is_some()
        || state.is_some()
        || gaze.is_some()
}

/// Each picture by the operator that it was rendered for.
fn run_as_rendered(arguments: &TonemapArguments, format: PictureFormat, targets: &[PathBuf]) -> Result<()> {
    if asks_an_operator(arguments) {
        bail!("exposure, adaptation, effects, eyes and their time are an operator's: name it by --operator");
    }
    for (input, target) in arguments.input.iter().zip(targets) {
        let picture = InputPicture::read_frame(input, arguments.nits_per_unit)?;
        let viewing =
            seeing::viewing_on(seeing::display_of(arguments.display.as_deref(), &[(input, &picture)])?, None)?;
        let Some(fitted) = picture.kept_tone().and_then(|kept| kept.on(&viewing)) else {
            bail!(
                "{}: the file does not say by which operator it was shown on \"{}\" when it was rendered: give --operator",
                input.display(),
                viewing.display.name
            );
        };
        let frame = SceneFrame::of(picture, input, arguments, &viewing)?;
        write(target, format, &frame, fitted.as_ref(), None)?;
        answer!("{}: {}", target.display(), fitted.describe());
    }
    Ok(())
}

fn run_all(
    arguments: &TonemapArguments,
    format: PictureFormat,
    targets: &[PathBuf],
    viewing: &Viewing,
    settings: &ToneSettings,
) -> Result<()> {
    if is_timed(arguments) || arguments.fps.is_some() {
        bail!(
            "a sheet of all operators shows one picture at rest: give one file and no --fps, --adapted-to or --state"
        );
    }
    if format != PictureFormat::Png {
        bail!("{}: a sheet of all operators is a picture; end the name in .png", targets[0].display());
    }
    let frame = SceneFrame::read(&arguments.input[0], arguments, viewing)?;
    let sheet = sheet::of_all_operators(&frame, &frame.viewing, settings);
    let picture = DisplayedPicture {
        size: (sheet.width as u32, sheet.height as u32),
        rgb_linear_display: &sheet.rgb,
        alpha: None,
        pixel_aspect_ratio: frame.pixel_aspect_ratio,
    };
    output::write_png_for(&targets[0], &picture, &viewing.display)?;
    Ok(())
}

fn settings(arguments: &TonemapArguments) -> Result<ToneSettings> {
    if arguments.effects.as_ref().is_some_and(|list| list.len() > 1 && list.contains(&Effect::None)) {
        bail!("--effects: none stands alone");
    }
    Ok(ToneSettings {
        exposure_stops: arguments.exposure,
        scope: match arguments.adaptation {
            Scope::World => AdaptationScope::World,
            Scope::Local => AdaptationScope::Local,
        },
        effects: arguments.effects.as_ref().map(|list| Effects {
            glare: list.contains(&Effect::Glare),
            acuity: list.contains(&Effect::Acuity),
            colour: list.contains(&Effect::Colour),
        }),
    })
}

/// Refuses what changes nothing of an operator.
fn check_settings(operator: &dyn ToneOperator, settings: &ToneSettings) -> Result<()> {
    let name = operator.name();
    if settings.scope == AdaptationScope::Local && !operator.knows_places() {
        bail!("--adaptation local: {name} knows no places");
    }
    let Some(chosen) = settings.effects else { return Ok(()) };
    let known = operator.optional_effects();
    let effects = [
        ("glare", chosen.glare, known.glare),
        ("acuity", chosen.acuity, known.acuity),
        ("colour", chosen.colour, known.colour || operator.always_loses_colour()),
    ];
    if let Some((effect, ..)) = effects.iter().find(|(_, is_chosen, is_known)| *is_chosen && !is_known) {
        bail!("--effects {effect}: {name} does not show it");
    }
    let nothing = Effects::default();
    if chosen == nothing && known == nothing {
        bail!("--effects none: there are none that {name} could leave out");
    }
    Ok(())
}

/// The eye of a sequence.
struct Eye {
    state: Option<AdaptationState>,
    is_between_frames: bool,
    seconds_per_frame: f64,
    kinetics: tone::Kinetics,
}

impl Eye {
    fn new(arguments: &TonemapArguments, operator: &dyn ToneOperator) -> Result<Self> {
        if !operator.sees_adaptation() {
            bail!(
                "{} does not know an eye that adapts over time: choose another --operator, or show each picture by a call \
                 of its own",
                operator.name()
            );
        }
        let kinetics = operator.kinetics();
        let mut state = arguments.adapted_to.map(|cd_m2| AdaptationState::adapted_to(Goal::both(cd_m2), &kinetics));
        let mut is_between_frames = false;
        if let Some(path) = arguments.state.as_ref().filter(|path| path.exists()) {
            let text = fechner::read_file::text(path).with_context(|| format!("{}", path.display()))?;
            let read = serde_json::from_str(&text).ok().filter(AdaptationState::is_possible);
            state = Some(read.with_context(|| format!("{}: not an eye's state as tonemap leaves it", path.display()))?);
            is_between_frames = true;
        }
        Ok(Self {
            state,
            is_between_frames,
            seconds_per_frame: arguments.fps.unwrap_or(USUAL_FRAMES_PER_SECOND).recip(),
            kinetics,
        })
    }

    /// The state in which the next frame is seen, so many frames after the last. The first one is seen as it appears;
    /// between frames the light changes evenly.
    fn look_at(&mut self, goal: Goal, frames: u64) -> AdaptationState {
        let state = match self.state {
            None => AdaptationState::adapted_to(goal, &self.kinetics),
            Some(state) if self.is_between_frames => {
                state.after(goal, frames as f64 * self.seconds_per_frame, &self.kinetics)
            }
            Some(state) => state.looking_at(goal),
        };
        self.is_between_frames = true;
        self.state = Some(state);
        state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_names_all_operators_that_always_lose_colour() {
        let value = Effect::Colour.to_possible_value().expect("a value");
        let help = value.get_help().expect("help").to_string();
        for name in tone::operator_names() {
            let operator = tone::operator(name, None).expect("known");
            assert_eq!(help.contains(name), operator.always_loses_colour(), "{name}: {help}");
        }
    }
}
