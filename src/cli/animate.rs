//! `fechner animate`: the frames of a scene that moves, and a video of them. How one frame is made is left to `shot`.

mod contact;
mod frames;
mod motion;
mod record;
mod settings;
mod shot;
mod source;
mod time;
mod video;

use super::console::duration_in_words;
use super::denoise::DenoiseChoice;
use super::job::{Quality, Size, parse_size};
use super::numbers::{parse_positive, parse_seconds, parse_seed, parse_stops, parse_unit, whole};
use super::seeing::{AskedPresentation, display_help, operator_values};
use super::targets::{Named, display_file};
use super::{signals, threads};
use anyhow::Result;
use clap::{Args, ValueEnum};
use fechner::adaptive::settings::DEFAULT_MAX_SAMPLES;
use fechner::animate::USUAL_FRAMES_PER_SECOND;
use fechner::film::Film;
use frames::{Frames, parse_frames};
use shot::FrameOutcome;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use time::{FrameTimes, ShotClock};
use video::VideoFormat;

pub(super) use frames::{parse_lapse_rate, parse_rate};
pub(super) use shot::{Shot, ShotFrame};

/// Arguments of `animate`.
#[derive(Debug, Args)]
pub(super) struct AnimateArguments {
    /// Scene with keyframes: .toml, .gltf, .glb, .pbrt, or any other with a side file that moves its camera.
    scene: PathBuf,
    /// Frames to render, first..last, both included, or one; frame 0 is at 0 s. Frames of the shot that are there
    /// already are kept.
    #[arg(long, value_name = "A..B", value_parser = parse_frames, allow_hyphen_values = true)]
    frames: Frames,
    /// All frames of the shot, where --frames renders a part of it: exposure and eyes are those of the whole shot.
    #[arg(long, value_name = "A..B", value_parser = parse_frames, allow_hyphen_values = true)]
    shot: Option<Frames>,
    /// Files, with # for each digit of the frame's number: out/shot.####.exr (all layers) or .png (as the display
    /// shows it).
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Frames a second.
    #[arg(long, value_name = "N", value_parser = parse_rate, allow_negative_numbers = true, default_value_t = USUAL_FRAMES_PER_SECOND)]
    fps: f64,
    /// Picture size.
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<Size>,
    #[command(flatten)]
    staging: super::staging::Staging,

    /// A frame is done when its remaining noise is at most this visible in motion: 1 is at threshold [default: the
    /// scene's, else 1; none for uniform sampling with --spp or --time].
    #[arg(long, value_name = "V", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Until")]
    visibility: Option<f64>,
    /// The same, by name.
    #[arg(long, value_enum, conflicts_with = "visibility", help_heading = "Until")]
    quality: Option<Quality>,
    /// A budget of this mean number of samples a pixel over the whole shot, spent on the frames that need it most;
    /// for uniform sampling as many in each.
    #[arg(long, value_name = "N", value_parser = whole(1..=Film::MAX_SAMPLES_PER_PIXEL), allow_negative_numbers = true, help_heading = "Until")]
    spp: Option<u32>,
    /// A budget of this many seconds for all frames that are rendered, spent on those that need it most; for uniform
    /// sampling as many on each.
    #[arg(long, value_name = "S", value_parser = parse_seconds, allow_negative_numbers = true, conflicts_with = "spp", help_heading = "Until")]
    time: Option<Duration>,
    /// Most samples of one pixel, at least 16.
    #[arg(long, value_name = "N", value_parser = whole(16..=Film::MAX_SAMPLES_PER_PIXEL), allow_negative_numbers = true, default_value_t = DEFAULT_MAX_SAMPLES, help_heading = "Until")]
    max_spp: u32,
    /// How samples are spread.
    #[arg(long, value_enum, default_value = "adaptive", help_heading = "Sampling")]
    sampling: SamplingChoice,
    /// Seed of all random numbers; each frame has its own from it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_seed, allow_negative_numbers = true, help_heading = "Sampling")]
    seed: u64,

    /// Frames may be paused and looked at: each is held to what a still is.
    #[arg(long, help_heading = "Seeing")]
    pausable: bool,
    #[arg(long, value_name = "NAME|FILE", help = display_help("the scene's, else desktop"), help_heading = "Seeing")]
    display: Option<String>,
    /// Luminance in cd/m² of RGB (1, 1, 1), in place of the scene's.
    #[arg(long, value_name = "CD_M2", value_parser = parse_unit, allow_negative_numbers = true, help_heading = "Seeing")]
    nits_per_unit: Option<f64>,
    /// What the eye is adapted to before the first frame; without it, to the first frame.
    #[arg(long, value_name = "CD_M2", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Seeing")]
    adapted_to: Option<f64>,
    /// Where viewers look: lines of frame,x,y in pixels, all inside the picture. What is far from all gazes of a
    /// frame may stay noisier; in frames without a line everything may be looked at.
    #[arg(long, value_name = "FILE.csv", conflicts_with = "pausable", help_heading = "Seeing")]
    gaze: Option<PathBuf>,
    /// What viewers' eyes do. A frame's noise stands still on the display while it is held, so that an eye that
    /// follows what moves smears it, and there may be more. An eye at rest sees the most.
    #[arg(long, value_enum, default_value = "none", help_heading = "Seeing")]
    eye: EyeChoice,
    /// Tone operator [default: the scene's, else constant].
    #[arg(long, value_name = "NAME", value_parser = operator_values(), help_heading = "Picture")]
    operator: Option<String>,
    /// Exposure correction in stops [default: the scene's, else 0].
    #[arg(long, value_name = "STOPS", value_parser = parse_stops, allow_negative_numbers = true, help_heading = "Picture")]
    exposure: Option<f64>,
    /// Take the noise out of every frame: by the built-in filter, or by Open Image Denoise where it is installed.
    #[arg(long, value_enum, default_value = "none", help_heading = "Picture")]
    denoise: DenoiseChoice,
    /// Names of the layers of motion in .exr files.
    #[arg(long, value_enum, default_value = "fechner", help_heading = "Picture")]
    aov_names: AovNames,
    /// Whose motion the layers of motion tell in mirrors and clear glass. Rough ones always have their surface's.
    #[arg(long, value_enum, default_value = "surface", help_heading = "Picture")]
    velocity_of: VelocityChoice,
    /// Make a video of the shot when all its frames are there: .y4m (BT.709, which programs have to be told), or .mp4
    /// by an installed ffmpeg. It is not HDR: an HDR display's white becomes its white.
    #[arg(long, value_name = "FILE", help_heading = "Picture")]
    video: Option<PathBuf>,

    /// Threads, 1 to 1023; the pictures do not depend on it.
    #[arg(long, value_name = "N", value_parser = whole(1..=1023), allow_negative_numbers = true, help_heading = "Running")]
    threads: Option<u32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplingChoice {
    /// Where the remaining error can be seen.
    Adaptive,
    /// The same everywhere in a frame. Where --time ends it on the way from one count to the next, some pixels have
    /// the next already.
    Uniform,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EyeChoice {
    /// They rest: safe, whatever viewers do.
    None,
    /// They follow whatever they look at.
    Track,
    /// They follow what stands out in the picture and in its motion (Itti 1998, Yee 2001).
    Saliency,
    /// They move as --gaze does, where a frame and its neighbours have one line each.
    Gaze,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum VelocityChoice {
    /// The mirror's or the glass's own.
    Surface,
    /// That of what is seen in it.
    Image,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AovNames {
    /// velocity.X and .Y, to the next frame; `velocity_previous`.X and .Y, to the one before. x right, y down.
    Fechner,
    /// Vector.X, .Y, .Z, .W as Blender writes them. x right, y up.
    Blender,
}

/// Renders what is not there yet, and writes it.
pub(super) fn run(arguments: &AnimateArguments) -> Result<()> {
    let pool = threads::pool(arguments.threads, "render")?;
    // Frames are written whole or not at all, so that there is nothing to wait for.
    signals::listen(|| {
        say!("stopped by a signal: finished frames are there, and the same command makes the others");
        fechner::output::abandon_unfinished();
        std::process::exit(i32::from(super::CALL_AGAIN));
    })?;
    pool.install(|| render_shot(arguments))
}

fn render_shot(arguments: &AnimateArguments) -> Result<()> {
    arguments.video()?;
    let shot = Shot::new(arguments)?;
    shot.check_video()?;
    shot.note_other_frames();
    let started = Instant::now();
    let track = shot.track(arguments.frame_numbers())?;
    let looked = started.elapsed();
    let clock = match arguments.time {
        Some(budget) => ShotClock::new(&shot, &track, started, budget)?,
        None => None,
    };
    if let (Some(budget), Some(clock)) = (arguments.time, &clock) {
        note_late_start(budget, looked, clock.left());
    }
    let mut times = FrameTimes::new(arguments.frame_numbers().map(|frame| shot.has_record(frame)));
    for frame in arguments.frame_numbers() {
        let started = Instant::now();
        let made = shot.make(frame, &track, clock.as_ref().map(|clock| clock.share(frame)))?;
        times.add(made, started.elapsed());
        if made != FrameOutcome::Kept && frame < arguments.frames.last {
            let (done, count) = (frame - arguments.frames.first + 1, arguments.frame_numbers().count());
            say!("{done} of {count} frames, about {} left", duration_in_words(times.seconds_left()));
        }
    }
    if let (Some(budget), Some(_)) = (arguments.time, clock) {
        note_overrun(budget, started.elapsed());
    }
    shot.conclude(&track).map(drop)
}

/// Says where little of a budget is left for the frames, and what helps. `looked`: what the track took.
fn note_late_start(budget: Duration, looked: Duration, left: Duration) {
    let half = budget / 2;
    if left >= half {
        return;
    }
    let [asked, left, taken] = [budget, left, looked].map(|time| duration_in_words(time.as_secs_f64()));
    let advice = if looked > half {
        format!("finding the shot's light took {taken}. It is kept: stop and call again, or give more --time")
    } else {
        "what they need took the rest to find. Give more --time".to_owned()
    };
    say!("note: {left} of --time's {asked} are left for the frames: {advice}.");
}

/// Says where a budget could not be kept: the track and each frame's first plans are made whatever they take.
fn note_overrun(budget: Duration, taken: Duration) {
    /// Beyond what the last plan of each frame may take too long.
    const OVERRUN: f64 = 1.5;
    if taken > budget.mul_f64(OVERRUN) {
        let [asked, taken] = [budget, taken].map(|time| duration_in_words(time.as_secs_f64()));
        say!(
            "note: {taken} were taken of --time's {asked}: the first look and the first samples of each frame take that at the least."
        );
    }
}

impl AnimateArguments {
    /// Numbers of the frames to render.
    pub(super) fn frame_numbers(&self) -> std::ops::RangeInclusive<u32> {
        self.frames.first..=self.frames.last
    }

    /// How the command line has the frames shown.
    fn asked_presentation(&self) -> AskedPresentation<'_> {
        AskedPresentation {
            display: self.display.as_deref(),
            operator: self.operator.as_deref(),
            exposure_stops: self.exposure,
        }
    }

    /// The files that it reads; what the scene is made of is known once that is loaded.
    fn files(&self) -> [Named<'_>; 3] {
        [("the scene", Some(&self.scene)), ("the gaze", self.gaze.as_deref()), display_file(self.display.as_deref())]
    }

    /// Whether eyes are to follow what moves.
    pub(super) fn eyes_move(&self) -> bool {
        self.eye != EyeChoice::None
    }

    /// The video that is asked for; an error if it cannot be made.
    fn video(&self) -> Result<Option<(&Path, VideoFormat)>> {
        self.video.as_deref().map(|path| VideoFormat::of(path).map(|format| (path, format))).transpose()
    }
}
