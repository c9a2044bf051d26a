//! `fechner animate`: the frames of a scene that moves, and a video of them.

mod frames;
mod motion;
mod source;
mod video;

use super::console::{Console, duration_in_words};
use super::denoise::DenoiseChoice;
use super::job::{Quality, Size, check_memory, parse_size};
use super::report::Report;
use super::seeing::{self, parse_positive};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use fechner::adaptive::settings::{AllocationRule, DEFAULT_MAX_SAMPLES, Limits, LoopSettings, Sampling};
use fechner::animate::name::FrameName;
use fechner::animate::track::{Track, TrackFrame};
use fechner::animate::{FrameScenes, RenderedFrame, SceneSource as _, ShotSettings, render_frame};
use fechner::checkpoint::SettingsRecord;
use fechner::denoise::Denoiser;
use fechner::integrator::TraceSettings;
use fechner::output::rendered::{Background, layers, write_display_png};
use fechner::output::{self, Format};
use fechner::scene::Scene;
use fechner::scene::hash::content_hash;
use fechner_perception::model;
use fechner_perception::tone::{self, ToneOperator};
use frames::{Frames, parse_frames, parse_rate};
use motion::push_velocity;
use serde::{Deserialize, Serialize};
use source::FileSource;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use video::VideoFormat;

/// Arguments of `animate`.
#[derive(Debug, Args)]
pub(super) struct AnimateArguments {
    /// Scene with keyframes: .toml, .gltf, .glb, .pbrt, or any other with a side file that moves its camera.
    scene: PathBuf,
    /// Frames to render, first..last, both included; frame 0 is at 0 s. Frames of the shot that are there already are kept.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    frames: Frames,
    /// All frames of the shot, where --frames renders a part of it: exposure and eyes are those of the whole shot.
    #[arg(long, value_name = "A..B", value_parser = parse_frames)]
    shot: Option<Frames>,
    /// Files, with # for each digit of the frame's number: out/shot.####.exr (all layers) or .png (as the display shows it).
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Frames a second.
    #[arg(long, value_name = "N", value_parser = parse_rate, default_value_t = 24.0)]
    fps: f64,
    /// Picture size.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<Size>,
    /// Camera of the scene file, by name.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    #[command(flatten)]
    staging: super::staging::Staging,

    /// A frame is done when its remaining noise is at most this visible in motion: 1 is at threshold.
    #[arg(long, value_name = "V", value_parser = parse_positive, help_heading = "Until")]
    visibility: Option<f64>,
    /// The same, by name.
    #[arg(long, value_enum, conflicts_with = "visibility", help_heading = "Until")]
    quality: Option<Quality>,
    /// A frame is done at this mean number of samples a pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Until")]
    spp: Option<u32>,
    /// Most samples of one pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..), help_heading = "Until")]
    max_spp: Option<u32>,
    /// How samples are spread.
    #[arg(long, value_enum, default_value = "adaptive", help_heading = "Sampling")]
    sampling: SamplingChoice,
    /// Seed of all random numbers; each frame has its own from it.
    #[arg(long, default_value_t = 0, help_heading = "Sampling")]
    seed: u64,

    /// Frames may be paused and looked at: each is held to what a still is.
    #[arg(long, help_heading = "Seeing")]
    pausable: bool,
    /// Display: a preset (desktop, fullhd, laptop, uhd-tv, phone, cinema, hdr-1000, strict) or a TOML file.
    #[arg(long, value_name = "NAME|FILE", help_heading = "Seeing")]
    display: Option<String>,
    /// Luminance in cd/m² of RGB (1, 1, 1), in place of the scene's.
    #[arg(long, value_name = "CD_M2", value_parser = parse_positive, help_heading = "Seeing")]
    nits_per_unit: Option<f64>,
    /// What the eye is adapted to before the first frame; without it, to the first frame.
    #[arg(long, value_name = "CD_M2", value_parser = parse_positive, help_heading = "Seeing")]
    adapted_to: Option<f64>,
    /// Tone operator.
    #[arg(long, value_name = "NAME", help_heading = "Picture")]
    operator: Option<String>,
    /// Exposure correction in stops.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, help_heading = "Picture")]
    exposure: Option<f64>,
    /// Take the noise out of every frame: by the built-in filter, or by Open Image Denoise where it is installed.
    #[arg(long, value_enum, default_value = "none", help_heading = "Picture")]
    denoise: DenoiseChoice,
    /// Names of the layers of motion in .exr files.
    #[arg(long, value_enum, default_value = "fechner", help_heading = "Picture")]
    aov_names: AovNames,
    /// Make a video of the shot when all its frames are there: .y4m, or .mp4 by an installed ffmpeg.
    #[arg(long, value_name = "FILE", help_heading = "Picture")]
    video: Option<PathBuf>,

    /// Threads; the pictures do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..1024), help_heading = "Running")]
    threads: Option<u32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplingChoice {
    /// Where the remaining error can be seen.
    Adaptive,
    /// The same everywhere.
    Uniform,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AovNames {
    /// velocity.X and .Y, to the next frame; `velocity_previous`.X and .Y, to the one before. x right, y down.
    Fechner,
    /// Vector.X, .Y, .Z, .W as Blender writes them. x right, y up.
    Blender,
}

/// The figures of one frame, beside its picture; by `key` a later run knows that it need not be made again.
#[derive(Serialize, Deserialize)]
struct FrameRecord {
    key: String,
    frame: u32,
    seconds_of_shot: f64,
    report: serde_json::Value,
}

/// What a frame is made from and judged by.
pub(super) struct FrameJob {
    pub(super) scenes: FrameScenes,
    pub(super) settings: LoopSettings,
    /// All that its file depends on, as a name.
    pub(super) key: String,
}

/// A shot on its way into files.
pub(super) struct Shot<'a> {
    arguments: &'a AnimateArguments,
    source: FileSource<'a>,
    pub(super) settings: ShotSettings,
    operator_name: String,
    exposure_stops: Option<f64>,
    name: FrameName,
    format: Format,
}

/// Renders what is not there yet, and writes it.
pub(super) fn run(arguments: &AnimateArguments) -> Result<()> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads.unwrap_or(0) as usize)
        .thread_name(|i| format!("render-{i}"))
        .build()
        .context("the threads could not be started")?;
    pool.install(|| render_shot(arguments))
}

fn render_shot(arguments: &AnimateArguments) -> Result<()> {
    arguments.video()?;
    let shot = Shot::new(arguments)?;
    let track = shot.track()?;
    for frame in arguments.frames.first..=arguments.frames.last {
        shot.make(frame, &track)?;
    }
    shot.conclude(&track)
}

impl AnimateArguments {
    /// Numbers of the frames to render.
    pub(super) fn frame_numbers(&self) -> std::ops::RangeInclusive<u32> {
        self.frames.first..=self.frames.last
    }

    /// The video that is asked for; an error if it cannot be made.
    fn video(&self) -> Result<Option<(&Path, VideoFormat)>> {
        self.video.as_deref().map(|path| VideoFormat::of(path).map(|format| (path, format))).transpose()
    }
}

impl<'a> Shot<'a> {
    pub(super) fn new(arguments: &'a AnimateArguments) -> Result<Self> {
        let name = FrameName::parse(&arguments.output).with_context(|| {
            format!(
                "{}: a sequence's name has # for each digit of the frame's number, as out/shot.####.exr",
                arguments.output
            )
        })?;
        let whole = arguments.shot.unwrap_or(arguments.frames);
        if arguments.frames.first < whole.first || arguments.frames.last > whole.last {
            bail!("--frames reaches beyond --shot");
        }
        let first_file = name.of(arguments.frames.first);
        if let Some(folder) = first_file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
        }
        let format = output::check_target(&first_file)?;
        let source = FileSource::new(arguments);
        let scene = source.at(f64::from(arguments.frames.first) / arguments.fps)?;
        for note in &scene.notes {
            eprintln!("note: {note}");
        }
        let settings = shot_settings(arguments, &scene, whole)?;
        let operator_name = arguments.operator.as_deref().or(scene.viewing.operator.as_deref()).unwrap_or("constant");
        let exposure_stops = arguments.exposure.or(scene.viewing.exposure_stops);
        let operator_name = operator_name.to_owned();
        let shot = Self { arguments, source, settings, operator_name, exposure_stops, name, format };
        shot.operator()?;
        Ok(shot)
    }

    /// For whose eyes its frames are, as their films say it.
    pub(super) fn settings_record(&self) -> SettingsRecord {
        SettingsRecord {
            sampling: self.settings.sampling,
            allocation: AllocationRule::default(),
            model: model::names()[0].to_owned(),
            viewing: self.settings.viewing.clone(),
            nits_per_unit: self.settings.nits_per_unit,
            operator: self.operator_name.clone(),
            exposure_stops: self.exposure_stops,
            importance: None,
            denoiser: self.settings.denoiser.as_ref().map(Denoiser::kind),
        }
    }

    fn operator(&self) -> Result<Box<dyn ToneOperator>> {
        tone::operator(&self.operator_name, self.exposure_stops).with_context(|| {
            format!(
                "there is no tone operator \"{}\"; known: {}",
                self.operator_name,
                tone::operator_names().join(", ")
            )
        })
    }

    /// The track that lies beside the frames, or a new one where there is none for this shot.
    pub(super) fn track(&self) -> Result<Track> {
        let file = self.name.of_shot("track.json");
        let operator = self.operator()?;
        let wanted = self.arguments.frames;
        if let Some(track) = read_json::<Track>(&file) {
            let is_of = |frame: u32| -> Result<bool> {
                let scene = self.source.at(self.settings.seconds(f64::from(frame)))?;
                Ok(track.of_frame(&self.settings, operator.as_ref(), frame, &scene).is_some())
            };
            // Each frame is looked at again before it is rendered; the ends tell here whether the track is of use at all.
            if is_of(wanted.first)? && is_of(wanted.last)? {
                return Ok(track);
            }
        }
        let count = self.settings.last - self.settings.first + 1;
        let started = Instant::now();
        let track = Track::make(&self.source, &self.settings, operator.as_ref(), &|_| {})?;
        eprintln!("looked at {count} frames in {}", duration_in_words(started.elapsed().as_secs_f64()));
        let text = serde_json::to_string(&track).context("the track could not be put into words")?;
        output::write_beside(&file, |file| file.write_all(text.as_bytes()))?;
        Ok(track)
    }

    /// Renders a frame, unless it is there.
    fn make(&self, frame: u32, track: &Track) -> Result<()> {
        let job = self.frame(frame, track)?;
        let file = self.name.of(frame);
        if self.record(frame).is_some_and(|record| record.key == job.key) && file.is_file() {
            eprintln!("{}: is there", file.display());
            return Ok(());
        }
        let console = Console::new(None);
        let made = render_frame(&job.scenes, &self.settings, &job.settings, frame, &console)?;
        console.finish();
        self.keep(frame, &job, &made).map(drop)
    }

    /// What a frame shows.
    pub(super) fn scene(&self, frame: u32) -> Result<Arc<Scene>> {
        Ok(self.source.at(self.settings.seconds(f64::from(frame)))?)
    }

    /// What a frame is made from and judged by.
    pub(super) fn frame(&self, frame: u32, track: &Track) -> Result<FrameJob> {
        let scenes = FrameScenes::load(&self.source, &self.settings, frame)?;
        let operator = self.operator()?;
        let Some(of_track) = track.of_frame(&self.settings, operator.as_ref(), frame, &scenes.now) else {
            bail!("{}: not of this scene any more: delete it", self.name.of_shot("track.json").display());
        };
        let settings = self.settings.frame_settings(operator, of_track);
        let key = self.key(&settings, of_track, &scenes);
        Ok(FrameJob { scenes, settings, key })
    }

    /// Writes a frame and its record.
    pub(super) fn keep(&self, frame: u32, job: &FrameJob, made: &RenderedFrame) -> Result<Report> {
        let file = self.name.of(frame);
        let scene_name = self.arguments.scene.display().to_string();
        let report = Report::new(&scene_name, &[self.settings.trace.seed], &job.settings, &made.rendered);
        self.write(&file, made, &job.settings, &report)?;
        let record = FrameRecord {
            key: job.key.clone(),
            frame,
            seconds_of_shot: self.settings.seconds(f64::from(frame)),
            report: serde_json::to_value(&report).context("the report could not be put into words")?,
        };
        let text = serde_json::to_string_pretty(&record).context("the record could not be put into words")?;
        output::write_beside(&file.with_extension("json"), |file| file.write_all(text.as_bytes()))?;
        eprintln!("{}: {}", file.display(), report.in_a_line());
        Ok(report)
    }

    /// Writes what only the whole shot has, if all its frames are there.
    pub(super) fn conclude(&self, track: &Track) -> Result<()> {
        let records = self.records();
        let missing = self.settings.last - self.settings.first + 1 - records.len() as u32;
        if missing > 0 {
            eprintln!("{missing} frames of the shot are not there yet.");
            return Ok(());
        }
        let text = serde_json::to_string_pretty(&records).context("the shot could not be put into words")?;
        output::write_beside(&self.name.of_shot("json"), |file| file.write_all(text.as_bytes()))?;
        if let Some((path, format)) = self.arguments.video()? {
            let files = (self.settings.first..=self.settings.last).map(|frame| self.name.of(frame));
            let fits = |frame: usize| track.frames[frame].fitted.clone().restore();
            video::write(path, format, files, &fits, &self.settings)?;
        }
        Ok(())
    }

    fn write(&self, file: &Path, made: &RenderedFrame, settings: &LoopSettings, report: &Report) -> Result<()> {
        match self.format {
            Format::Png => write_display_png(file, &made.rendered, &settings.viewing.display, Background::Shown)?,
            Format::Exr => {
                let attributes = report.attributes();
                let mut picture = layers(&made.rendered, settings, Background::Shown, &attributes);
                push_velocity(&mut picture, &made.velocity, self.arguments.aov_names);
                output::write_exr(file, &picture)?;
            }
        }
        Ok(())
    }

    /// All that a frame's file depends on, as a name.
    fn key(&self, settings: &LoopSettings, track: &TrackFrame, scenes: &FrameScenes) -> String {
        let text = format!(
            "{}|{track:?}|{}|{}|{:?}|{:?}|{:?}|{:?}|{:?}|{:?}|{:?}",
            env!("CARGO_PKG_VERSION"),
            content_hash(&scenes.previous),
            content_hash(&scenes.next),
            self.settings.trace,
            settings.sampling,
            settings.denoiser.as_ref().map(Denoiser::name),
            settings.limits,
            settings.viewing,
            settings.frames,
            self.arguments.aov_names
        );
        blake3::hash(text.as_bytes()).to_hex()[..32].to_owned()
    }

    fn record(&self, frame: u32) -> Option<FrameRecord> {
        read_json(&self.name.of(frame).with_extension("json"))
    }

    /// Records of the frames that are there.
    fn records(&self) -> Vec<FrameRecord> {
        (self.settings.first..=self.settings.last).filter_map(|frame| self.record(frame)).collect()
    }
}

/// What is in a file, or nothing if it is not there or not whole.
fn read_json<T: serde::de::DeserializeOwned>(file: &Path) -> Option<T> {
    serde_json::from_slice(&std::fs::read(file).ok()?).ok()
}

fn shot_settings(arguments: &AnimateArguments, scene: &Scene, shot: Frames) -> Result<ShotSettings> {
    let size = arguments.size.unwrap_or(Size { width: scene.film.width, height: scene.film.height });
    check_memory(size)?;
    let display = arguments.display.as_deref().or(scene.viewing.display.as_deref()).unwrap_or("desktop");
    let asked = arguments.visibility.or(arguments.quality.map(Quality::visibility));
    let (sampling, otherwise) = match arguments.sampling {
        SamplingChoice::Adaptive => (Sampling::Adaptive, scene.viewing.visibility.unwrap_or(1.0)),
        SamplingChoice::Uniform if arguments.spp.is_some() => (Sampling::Uniform, 0.0),
        SamplingChoice::Uniform => (Sampling::Uniform, scene.viewing.visibility.unwrap_or(1.0)),
    };
    Ok(ShotSettings {
        first: shot.first,
        last: shot.last,
        frames_per_second: arguments.fps,
        pausable: arguments.pausable,
        trace: TraceSettings::new(size.width, size.height, arguments.seed),
        sampling,
        limits: Limits {
            mean_samples: arguments.spp,
            max_samples: arguments.max_spp.unwrap_or(DEFAULT_MAX_SAMPLES),
            pilot_samples: arguments.denoise.pilot_samples(),
            ..Limits::of_visibility(asked.unwrap_or(otherwise))
        },
        viewing: seeing::viewing(display, None)?,
        nits_per_unit: arguments.nits_per_unit.unwrap_or(scene.nits_per_unit),
        adapted_to_cd_m2: arguments.adapted_to,
        denoiser: arguments.denoise.kind().map(Denoiser::open).transpose()?,
    })
}
