//! A shot on its way into files: its frames, in `track` what is known of all of them beforehand, in `key` what each
//! depends on, in `conclude` what only the whole of it has.

mod conclude;
mod key;
mod track;

use super::frames::Frames;
use super::motion::push_velocity;
use super::record::{self, FrameRecord};
use super::settings::shot_settings;
use super::source::FileSource;
use super::{AnimateArguments, AovNames, EyeChoice, VelocityChoice};
use crate::cli::console::Console;
use crate::cli::report::Report;
use crate::cli::seeing::Presentation;
use crate::cli::targets::{Named, check_kept, check_scene_kept};
use anyhow::{Context, Result, bail};
use fechner::adaptive::settings::LoopSettings;
use fechner::animate::name::FrameName;
use fechner::animate::track::Track;
use fechner::animate::{FrameScenes, RenderedFrame, SceneSource as _, ShotSettings, render_frame};
use fechner::checkpoint::SettingsRecord;
use fechner::denoise::Denoiser;
use fechner::json_file;
use fechner::output::rendered::{Background, layers, write_display_png};
use fechner::output::{self, Attribute, PictureFormat};
use fechner::scene::Scene;
use fechner_perception::tone::{ToneOperator, ToneSettings, operator_named};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// What a frame is made from and judged by.
pub(in crate::cli) struct ShotFrame {
    pub(in crate::cli) scenes: FrameScenes,
    pub(in crate::cli) settings: LoopSettings,
    /// Everything that the frame's file depends on, as a name.
    pub(in crate::cli) key: String,
}

/// A shot on its way into files.
pub(in crate::cli) struct Shot<'a> {
    arguments: &'a AnimateArguments,
    source: FileSource<'a>,
    pub(in crate::cli) settings: ShotSettings,
    operator_name: String,
    exposure_stops: Option<f64>,
    name: FrameName,
    format: PictureFormat,
}

impl<'a> Shot<'a> {
    pub(in crate::cli) fn new(arguments: &'a AnimateArguments) -> Result<Self> {
        let name = FrameName::parse(&arguments.output).with_context(|| {
            format!(
                "{}: a sequence's name has one run of #, one for each digit of the frame's number, as out/shot.####.exr",
                arguments.output
            )
        })?;
        let whole = arguments.shot.unwrap_or(arguments.frames);
        if arguments.frames.first < whole.first || arguments.frames.last > whole.last {
            bail!("--frames reaches beyond --shot");
        }
        let first_file = name.of(arguments.frames.first);
        let format = PictureFormat::of(&first_file)?;
        let is_followed = matches!(arguments.eye, EyeChoice::Track | EyeChoice::Saliency);
        if format == PictureFormat::Png && arguments.velocity_of == VelocityChoice::Image && !is_followed {
            bail!("--velocity-of image: PNG frames hold no motion; name the frames .exr");
        }
        if format == PictureFormat::Png && arguments.aov_names == AovNames::Blender {
            bail!("--aov-names blender: PNG frames hold no motion; name the frames .exr");
        }
        let source = FileSource::new(arguments);
        let scene = source.at(f64::from(arguments.frames.first) / arguments.fps)?;
        for note in &scene.notes {
            say!("note: {note}");
        }
        let settings = shot_settings(arguments, &scene, whole)?;
        let Presentation { operator, exposure_stops, .. } = arguments.asked_presentation().of_scene(&scene);
        let operator_name = operator.to_owned();
        let shot = Self { arguments, source, settings, operator_name, exposure_stops, name, format };
        shot.check_inputs_kept()?;
        let operator = shot.operator()?;
        if arguments.adapted_to.is_some() && !operator.sees_adaptation() {
            bail!("--adapted-to: {} does not know an eye that adapts over time", operator.name());
        }
        Ok(shot)
    }

    /// Refuses to write in the place of what is read, which is known once the scene and the display are loaded.
    fn check_inputs_kept(&self) -> Result<()> {
        let frames: Vec<PathBuf> = self.arguments.frame_numbers().map(|frame| self.file(frame)).collect();
        let records: Vec<PathBuf> = frames.iter().map(|frame| FrameRecord::file(frame)).collect();
        let (track, of_whole) = (self.track_file(), self.files_of_whole()?);
        let of_frames = frames.iter().map(|frame| ("-o", Some(frame.as_path())));
        let of_records = records.iter().map(|record| ("a frame's record", Some(record.as_path())));
        let of_shot = of_whole.iter().map(|(what, file)| (*what, Some(file.as_path())));
        let written: Vec<Named> =
            of_frames.chain(of_records).chain([("the track", Some(track.as_path()))]).chain(of_shot).collect();
        check_kept(&self.arguments.files(), &written)?;
        check_scene_kept(&written)
    }

    /// What is known of the shot's frames beforehand.
    fn track_file(&self) -> PathBuf {
        self.name.of_shot("track.json")
    }

    /// Makes the folder of the frames, once all that can be refused has been, and checks that they can be written.
    fn make_folder(&self) -> Result<()> {
        let first_file = self.name.of(self.arguments.frames.first);
        if let Some(folder) = named_folder(&first_file) {
            std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
        }
        output::check_target(&first_file)?;
        Ok(())
    }

    /// Says where frames of another call are there already that may be of the same shot: each call would fit the
    /// exposure to its own.
    pub(super) fn note_other_frames(&self) {
        let Frames { first, last } = self.arguments.frames;
        let found = self.name.numbers().unwrap_or_default();
        if let (None, Some(&least), Some(&greatest)) = (self.arguments.shot, found.first(), found.last())
            && (least < first || greatest > last)
        {
            let whole = Frames { first: first.min(least), last: last.max(greatest) };
            // Frames that lie so far apart are not of one shot.
            if whole.is_a_shot() {
                say!(
                    "note: of this sequence frames {least} to {greatest} are there; one exposure for all its parts needs --shot {}..{} \
                     in each call.",
                    whole.first,
                    whole.last
                );
            }
        }
    }

    /// The record of who a frame is for that is judged by these settings, as its film keeps it.
    pub(in crate::cli) fn settings_record(&self, of_frame: &LoopSettings) -> SettingsRecord {
        SettingsRecord {
            sampling: self.settings.sampling,
            exposure_stops: self.exposure_stops,
            fitted: of_frame.fitted.clone(),
            frames: of_frame.frames,
            gazes: of_frame.gazes.clone(),
            denoiser: self.settings.denoiser.as_ref().map(Denoiser::kind),
            ..SettingsRecord::new(
                self.settings.viewing.clone(),
                self.settings.nits_per_unit,
                self.operator_name.as_str(),
            )
        }
    }

    /// Whether the video that is asked for can be made and written: known before the frames are rendered.
    pub(in crate::cli) fn check_video(&self) -> Result<()> {
        if let Some((path, _)) = self.arguments.video()? {
            // The frames' own folder is not there yet.
            let is_beside_frames = named_folder(path) == named_folder(&self.name.of(self.settings.first));
            if !is_beside_frames || named_folder(path).is_none_or(Path::exists) {
                output::check_writable(path)?;
            }
        }
        Ok(())
    }

    /// Whether a video is asked for.
    pub(in crate::cli) fn asks_for_video(&self) -> Result<bool> {
        Ok(self.arguments.video()?.is_some())
    }

    fn operator(&self) -> Result<Box<dyn ToneOperator>> {
        let exposure_stops = self.exposure_stops.unwrap_or(0.0);
        Ok(operator_named(&self.operator_name, &ToneSettings { exposure_stops, ..ToneSettings::default() })?)
    }

    /// Frames of the shot to render that are not there as this run would make them. Reads all their scenes.
    pub(super) fn missing_frames(&self, track: &Track) -> Result<Vec<u32>> {
        let mut missing = Vec::new();
        for frame in self.arguments.frame_numbers() {
            if self.record(frame, &self.frame(frame, track)?.key).is_none() {
                missing.push(frame);
            }
        }
        Ok(missing)
    }

    /// Whether a frame has a picture and its record, of whatever settings.
    pub(super) fn has_record(&self, frame: u32) -> bool {
        FrameRecord::of_picture(&self.file(frame)).is_some()
    }

    /// Renders a frame, unless it is there. `time` is a limit of the frame's own, beside those of the shot.
    pub(super) fn make(&self, frame: u32, track: &Track, time: Option<Duration>) -> Result<FrameOutcome> {
        let mut job = self.frame(frame, track)?;
        job.settings.limits.time = time;
        let file = self.file(frame);
        if self.record(frame, &job.key).is_some() {
            say!("{}: is there", file.display());
            remove_leftovers_of_frame(&file);
            return Ok(FrameOutcome::Kept);
        }
        let outdated = self.has_record(frame);
        match FrameRecord::of_another_picture(&file) {
            Some(other) => say!("{}: its record is that of {other}, made anew", file.display()),
            None if file.exists() => {
                say!("{}: of other settings or another scene, made anew", file.display());
            }
            None => {}
        }
        let console = Console::new(None);
        let made = render_frame(&job.scenes, &self.settings, &mut job.settings, frame, &console)?;
        console.finish();
        self.keep(frame, &job, &made)?;
        Ok(if outdated { FrameOutcome::Anew } else { FrameOutcome::New })
    }

    /// What a frame shows.
    pub(in crate::cli) fn scene(&self, frame: u32) -> Result<Arc<Scene>> {
        Ok(self.source.at(self.settings.seconds(f64::from(frame)))?)
    }

    /// What a frame is made from and judged by.
    pub(in crate::cli) fn frame(&self, frame: u32, track: &Track) -> Result<ShotFrame> {
        self.frame_of_track(frame, track)?.with_context(|| {
            format!(
                "frame {frame}: its scene has changed since {} was made: call again; a farm must be planned anew",
                self.track_file().display()
            )
        })
    }

    /// The same; `None` where the track is not of the frame's scene.
    fn frame_of_track(&self, frame: u32, track: &Track) -> Result<Option<ShotFrame>> {
        let scenes = FrameScenes::load(&self.source, &self.settings, frame)?;
        let operator = self.operator()?;
        let Some(of_track) = track.of_frame(&self.settings, operator.as_ref(), frame, &scenes.now) else {
            return Ok(None);
        };
        let settings = self.settings.frame_settings(operator, of_track);
        let key = self.key(&settings, of_track, &scenes);
        Ok(Some(ShotFrame { scenes, settings, key }))
    }

    /// The scene's name in reports.
    pub(in crate::cli) fn scene_name(&self) -> String {
        self.arguments.scene.display().to_string()
    }

    /// The picture's file of a frame.
    pub(in crate::cli) fn file(&self, frame: u32) -> PathBuf {
        self.name.of(frame)
    }

    /// Writes a frame and its record.
    pub(in crate::cli) fn keep(&self, frame: u32, job: &ShotFrame, made: &RenderedFrame) -> Result<Report> {
        let file = self.file(frame);
        let seed = self.settings.trace_settings(frame).seed;
        let report = Report::new(&self.scene_name(), &[seed], &job.settings, &made.rendered);
        FrameRecord::remove(&file)?;
        remove_leftovers_of_frame(&file);
        self.write(&file, made, &job.settings, &report)?;
        let record = FrameRecord {
            key: job.key.clone(),
            picture: record::name(&file),
            picture_hash: record::hash_of_file(&file)?,
            frame,
            seconds_of_shot: self.settings.seconds(f64::from(frame)),
            report: serde_json::to_value(&report).context("the report could not be put into words")?,
        };
        json_file::write(&FrameRecord::file(&file), &record)?;
        say!("{}: {}", file.display(), report.in_a_line());
        Ok(report)
    }

    fn write(&self, file: &Path, made: &RenderedFrame, settings: &LoopSettings, report: &Report) -> Result<()> {
        match self.format {
            PictureFormat::Png => {
                write_display_png(file, &made.rendered, &settings.viewing.display, Background::Shown)?;
            }
            PictureFormat::Exr => {
                let attributes = report.attributes();
                let mut picture = layers(&made.rendered, settings, Background::Shown, &attributes);
                push_velocity(&mut picture, &made.velocity, self.arguments.aov_names);
                let rate = self.settings.frames_per_second as f32;
                picture.push_attribute(output::FRAMES_PER_SECOND, Attribute::Float(rate));
                output::write_exr(file, &picture)?;
            }
        }
        Ok(())
    }

    /// The record of a frame that is there, made from all that a key names.
    fn record(&self, frame: u32, key: &str) -> Option<FrameRecord> {
        let file = self.file(frame);
        FrameRecord::of_picture(&file).filter(|record| record.holds(key, &file))
    }
}

/// Removes what runs that were killed left of a frame's picture and record as they wrote them.
fn remove_leftovers_of_frame(picture: &Path) {
    output::remove_leftovers(picture);
    output::remove_leftovers(&FrameRecord::file(picture));
}

/// A file's folder, where its name has one.
fn named_folder(file: &Path) -> Option<&Path> {
    file.parent().filter(|folder| !folder.as_os_str().is_empty())
}

/// What came of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameOutcome {
    /// The frame was there.
    Kept,
    /// The frame was not there, and was made.
    New,
    /// There was one of other settings or another scene.
    Anew,
}
