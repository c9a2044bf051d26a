//! What a farm renders, from the arguments in its manifest: as `render` or `animate` understand them.

use crate::cli::animate::{AnimateArguments, Shot, ShotFrame};
use crate::cli::finished::{Finished, PictureTarget};
use crate::cli::job::{JobArguments, Prepared};
use crate::cli::keeper::fit_in;
use crate::cli::report::Report;
use crate::cli::words::in_a_line_of_arguments;
use anyhow::{Context, Result, anyhow, bail};
use clap::{CommandFactory, Parser};
use fechner::adaptive::Rendered;
use fechner::adaptive::settings::LoopSettings;
use fechner::animate::RenderedFrame;
use fechner::animate::track::Track;
use fechner::checkpoint::{Header, Origin};
use fechner::farm::{Farm, FrameEntry, Work};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::output::{self, PictureFormat};
use fechner::scene::Scene;
use fechner::scene::hash::ContentHash;
use std::cell::OnceCell;
use std::path::Path;
use std::sync::Arc;

/// `render`'s options less its files.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct StillOptions {
    #[command(flatten)]
    job: JobArguments,
}

/// `animate`'s options.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct ShotOptions {
    #[command(flatten)]
    shot: AnimateArguments,
}

/// The arguments of the command that does the same in one process.
pub(super) enum JobOptions {
    Still(Box<JobArguments>),
    Shot(Box<AnimateArguments>),
}

/// A job with what all its frames share.
pub(super) enum Job<'a> {
    Still(&'a JobArguments),
    Shot(Box<TrackedShot<'a>>),
}

/// A shot, and how light it is once somebody has asked.
pub(super) struct TrackedShot<'a> {
    shot: Shot<'a>,
    track: OnceCell<Track>,
}

/// What one frame of a job is rendered from.
pub(super) struct Frame<'a> {
    scene: Arc<Scene>,
    trace: TraceSettings,
    header: Header,
    /// Hash of all that its film is judged by.
    judged_by: ContentHash,
    kind: FrameKind<'a>,
}

enum FrameKind<'a> {
    Still { arguments: &'a JobArguments, settings: Box<LoopSettings> },
    OfShot { shot: &'a Shot<'a>, frame: Box<ShotFrame> },
}

impl JobOptions {
    /// Reads what stands in a manifest. Pictures go to `pictures`.
    pub(super) fn parse(work: Work, arguments: &[String], pictures: &Path, format: PictureFormat) -> Result<Self> {
        let wrong = |error: clap::Error| anyhow!(in_a_line_of_arguments(&error));
        match work {
            Work::Render => {
                let options = StillOptions::try_parse_from(arguments).map_err(wrong)?;
                Ok(Self::Still(Box::new(options.job)))
            }
            Work::Animate => {
                let name = pictures.join(Farm::frame_pattern(format));
                let name = name.to_str().context("the folder's name must be Unicode")?.to_owned();
                let arguments = arguments.iter().cloned().chain(["--output".to_owned(), name]);
                let options = ShotOptions::try_parse_from(arguments).map_err(wrong)?;
                if options.shot.eyes_move() {
                    bail!("--eye: the frames of a farm are judged for eyes at rest");
                }
                Ok(Self::Shot(Box::new(options.shot)))
            }
        }
    }

    /// Refuses options that are about one process.
    pub(super) fn check_are_for_all(work: Work, arguments: &[String]) -> Result<()> {
        let command = match work {
            Work::Render => StillOptions::command(),
            // The pictures' name is the farm's.
            Work::Animate => ShotOptions::command().mut_arg("output", |output| output.required(false)),
        };
        // What cannot be understood is told by the parser.
        let Ok(found) = command.try_get_matches_from(arguments) else { return Ok(()) };
        let is_given = |id: &str| found.value_source(id) == Some(clap::parser::ValueSource::CommandLine);
        let known = |id: &&str| found.try_contains_id(id).is_ok();
        if ["time", "plans"].iter().filter(|id| known(id)).any(|id| is_given(id)) {
            bail!("--time and --plans end one process: a farm goes by --visibility, --quality, --spp and --max-spp");
        }
        if is_given("threads") {
            bail!("--threads is of one process: farm unit, farm merge and farm work have it each");
        }
        Ok(())
    }

    /// The options of a farm that is there.
    pub(super) fn of(farm: &Farm) -> Result<Self> {
        let manifest = farm.manifest();
        Self::parse(manifest.work, &manifest.arguments, &farm.pictures(), manifest.picture_format)
            .with_context(|| format!("{}", Farm::manifest_file(farm.folder()).display()))
    }

    /// Loads what all frames share.
    pub(super) fn job(&self) -> Result<Job<'_>> {
        match self {
            Self::Still(arguments) => Ok(Job::Still(arguments)),
            Self::Shot(arguments) => {
                let shot = Shot::new(arguments)?;
                Ok(Job::Shot(Box::new(TrackedShot { shot, track: OnceCell::new() })))
            }
        }
    }

    /// Numbers of the frames to render.
    pub(super) fn frames(&self) -> Vec<u32> {
        match self {
            Self::Still(_) => vec![0],
            Self::Shot(arguments) => arguments.frame_numbers().collect(),
        }
    }
}

impl Job<'_> {
    /// A frame as it is now, with everything that it is rendered from.
    pub(super) fn frame(&self, number: u32) -> Result<Frame<'_>> {
        self.frame_beside(number, None)
    }

    /// The same. A part is shown as it was in a film of it that may be there: to find out how the whole is shown takes
    /// seconds.
    fn frame_beside(&self, number: u32, film: Option<&Path>) -> Result<Frame<'_>> {
        match self {
            Self::Still(arguments) => {
                let mut prepared = arguments.prepare_samples()?;
                let Prepared { scene, trace, record, .. } = &prepared;
                let origin = Origin { scene_name: arguments.scene_name(), ..Origin::of(scene, trace) };
                let known = film.and_then(|film| fit_in(film, &origin, record));
                prepared.fit_to_whole(known);
                let Prepared { scene, trace, record, settings, .. } = prepared;
                let judged_by = ContentHash::of_bytes(format!("{record:?}|{:?}", settings.limits).as_bytes());
                let header = Header::begun(origin, trace.seed, record, settings.limits.last_rung());
                let kind = FrameKind::Still { arguments, settings: Box::new(settings) };
                Ok(Frame { scene, trace, header, judged_by, kind })
            }
            Self::Shot(tracked) => {
                let shot = &tracked.shot;
                let of_shot = shot.frame(number, tracked.track(number)?)?;
                let trace = shot.settings.trace_settings(number);
                let origin = Origin { scene_name: shot.scene_name(), ..Origin::of(&of_shot.scenes.now, &trace) };
                let aim = of_shot.settings.limits.last_rung();
                let header = Header::begun(origin, trace.seed, shot.settings_record(&of_shot.settings), aim);
                let judged_by = ContentHash::of_bytes(of_shot.key.as_bytes());
                let scene = Arc::clone(&of_shot.scenes.now);
                let kind = FrameKind::OfShot { shot, frame: Box::new(of_shot) };
                Ok(Frame { scene, trace, header, judged_by, kind })
            }
        }
    }

    /// A frame of a farm, if it still is the one that was planned.
    pub(super) fn planned_frame(&self, farm: &Farm, frame_index: usize) -> Result<Frame<'_>> {
        let entry = farm.frame(frame_index);
        let frame = self.frame_beside(entry.frame, Some(&farm.film(frame_index)))?;
        check_origin(farm, entry, &frame.header.origin)?;
        if frame.judged_by != entry.judged_by {
            bail!(
                "{}: frame {} would be judged otherwise than when it was planned (a display's file, an importance map or \
                 a neighbouring frame has changed): plan anew",
                farm.folder().display(),
                entry.frame
            );
        }
        Ok(frame)
    }

    /// What units of a frame need, if the scene still is the one that was planned.
    pub(super) fn tracer(&self, farm: &Farm, frame_index: usize) -> Result<PathTracer> {
        let entry = farm.frame(frame_index);
        let (scene, trace, origin) = match self {
            Self::Still(arguments) => {
                let Prepared { scene, trace, .. } = arguments.prepare_samples()?;
                let origin = Origin { scene_name: arguments.scene_name(), ..Origin::of(&scene, &trace) };
                (scene, trace, origin)
            }
            Self::Shot(tracked) => {
                let shot = &tracked.shot;
                let (scene, trace) = (shot.scene(entry.frame)?, shot.settings.trace_settings(entry.frame));
                let origin = Origin::of(&scene, &trace);
                (scene, trace, origin)
            }
        };
        check_origin(farm, entry, &origin)?;
        Ok(PathTracer::new(scene, trace))
    }

    /// Whether the farm's frames are all of the shot, not a part of one.
    pub(super) fn is_whole(&self, farm: &Farm) -> bool {
        match self {
            Self::Still(_) => true,
            Self::Shot(tracked) => {
                let shot = &tracked.shot;
                let all = shot.settings.last - shot.settings.first + 1;
                farm.manifest().frames.len() == all as usize
            }
        }
    }

    /// Refuses a video that cannot be made: known before the frames are rendered.
    pub(super) fn check_video(&self) -> Result<()> {
        match self {
            Self::Still(_) => Ok(()),
            Self::Shot(tracked) => tracked.shot.check_video(),
        }
    }

    /// Refuses a video of a shot of which the farm makes a part, whose other frames can never come to be beside them.
    pub(super) fn check_whole_video(&self, frames: usize) -> Result<()> {
        let Self::Shot(tracked) = self else { return Ok(()) };
        let shot = &tracked.shot;
        let all = shot.settings.last - shot.settings.first + 1;
        if shot.asks_for_video()? && frames != all as usize {
            bail!(
                "--video needs all {all} frames of the shot, and the farm makes {frames}: leave --shot or --video out"
            );
        }
        Ok(())
    }

    /// Makes what only a whole shot has, if all its frames are there; whether they are.
    pub(super) fn conclude(&self) -> Result<bool> {
        match self {
            Self::Shot(tracked) => tracked.shot.conclude(tracked.track(tracked.shot.settings.first)?),
            Self::Still(_) => Ok(true),
        }
    }
}

impl TrackedShot<'_> {
    /// How light the shot is: from the file beside the pictures, or made anew where that is not of this
    /// frame's scene. Other frames are looked at when they are asked for: a process that merges one should not
    /// have to read the scenes of all.
    fn track(&self, number: u32) -> Result<&Track> {
        match self.track.get() {
            Some(track) => Ok(track),
            None => {
                let found = self.shot.track(number..=number)?;
                Ok(self.track.get_or_init(|| found))
            }
        }
    }
}

impl Frame<'_> {
    /// Writes the pictures of the frame when it is finished, and says its figures.
    pub(super) fn write(&self, farm: &Farm, frame_index: usize, rendered: Rendered) -> Result<Report> {
        match &self.kind {
            FrameKind::Still { arguments, settings } => {
                let report = Report::new(&arguments.scene_name(), &self.header.seeds.all, settings, &rendered);
                let path = farm.picture(frame_index);
                let format = output::check_target(&path)?;
                let part_of = self.header.origin.part_of();
                let target = PictureTarget { path: &path, format, background: arguments.background(), part_of };
                target.write(Finished { rendered: &rendered, settings, report: &report })?;
                say!("{}: {}", path.display(), report.in_a_line());
                Ok(report)
            }
            FrameKind::OfShot { shot, frame } => {
                let velocity = frame.scenes.velocity(&self.tracer(), shot.settings.velocity_of);
                shot.keep(farm.frame(frame_index).frame, frame, &RenderedFrame { rendered, velocity })
            }
        }
    }

    /// The frame's entry in a manifest.
    pub(super) fn entry(&self, frame: u32) -> FrameEntry {
        let origin = self.header.origin.clone();
        FrameEntry { frame, seed: self.trace.seed, origin, judged_by: self.judged_by }
    }

    /// A tracer for the frame's scene.
    pub(super) fn tracer(&self) -> PathTracer {
        PathTracer::new(Arc::clone(&self.scene), self.trace)
    }

    /// The settings by which the frame's film is judged.
    pub(super) fn settings(&self) -> &LoopSettings {
        match &self.kind {
            FrameKind::Still { settings, .. } => settings,
            FrameKind::OfShot { frame, .. } => &frame.settings,
        }
    }

    /// What its film's file says of it.
    pub(super) fn header(&self) -> &Header {
        &self.header
    }
}

/// Refuses a scene that is not the one that was planned.
fn check_origin(farm: &Farm, entry: &FrameEntry, own: &Origin) -> Result<()> {
    match entry.origin.difference(own) {
        None => Ok(()),
        Some(problem) => {
            bail!("{}: frame {}: {problem}: plan anew", Farm::manifest_file(farm.folder()).display(), entry.frame)
        }
    }
}
