//! `fechner render`: a scene file in, a picture out. What is rendered and when it ends is left to `job`.

use super::CALL_AGAIN;
use super::console::Console;
use super::finished::{Finished, PictureTarget, all_written, write_figures};
use super::job::{JobArguments, Prepared};
use super::keeper::{CheckpointArguments, Keeper, SeedsSoFar, Start, Watch};
use super::maps::{MapTarget, check_map};
use super::report::{Interrupter, Report, summary};
use super::signals::listen;
use super::targets::{Named, check_kept, check_scene_kept};
use super::tev::{Showing, TevArguments};
use super::view::audience;
use super::words::{count, in_a_line};
use anyhow::anyhow;
use clap::Args;
use fechner::adaptive::judge::JudgeError;
use fechner::adaptive::settings::LoopSettings;
use fechner::adaptive::state::RenderState;
use fechner::adaptive::{self, StopReason};
use fechner::checkpoint::{Header, Origin, SettingsRecord};
use fechner::integrator::{Crop, PathTracer, TraceSettings};
use fechner::output::{self, PartOf, PictureFormat};
use fechner::scene::Scene;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// Arguments of `render`.
#[derive(Debug, Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    job: JobArguments,
    /// Picture to write: .png as the display shows it, .exr with all layers.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Write a map in colours beside the picture: samples, threshold or visibility. May be given several times.
    #[arg(long = "map", value_name = "LAYER=FILE.png", value_parser = MapTarget::parse, help_heading = "Picture")]
    maps: Vec<MapTarget>,
    /// Write figures of the render here.
    #[arg(long, value_name = "FILE", help_heading = "Running")]
    json: Option<PathBuf>,
    /// Show it in a browser while it runs; prints an address of this machine.
    #[arg(long, help_heading = "Running")]
    view: bool,
    #[command(flatten)]
    tev: TevArguments,
    #[command(flatten)]
    checkpoint: CheckpointArguments,
}

/// Renders and writes.
pub(super) fn run(arguments: &RenderArguments) -> anyhow::Result<ExitCode> {
    let format = output::check_target(&arguments.output)?;
    check_kept(&arguments.job.files(), &written(arguments))?;
    arguments.maps.iter().try_for_each(|map| check_map(map.file()))?;
    if let Some(json) = &arguments.json {
        output::check_writable(json)?;
    }
    let _claim = arguments.checkpoint.claim()?;
    let pool = arguments.job.thread_pool()?;
    pool.install(|| render_and_write(arguments, format))
}

/// The files that it writes.
fn written(arguments: &RenderArguments) -> Vec<Named<'_>> {
    let files = [
        ("-o", Some(arguments.output.as_path())),
        ("--json", arguments.json.as_deref()),
        ("--checkpoint", arguments.checkpoint.file()),
    ];
    files.into_iter().chain(arguments.maps.iter().map(|map| ("--map", Some(map.file())))).collect()
}

fn render_and_write(arguments: &RenderArguments, format: PictureFormat) -> anyhow::Result<ExitCode> {
    let mut prepared = arguments.job.prepare_samples()?;
    check_scene_kept(&written(arguments))?;
    // Of renders that were killed as they wrote.
    written(arguments).into_iter().filter_map(|(_, path)| path).for_each(output::remove_leftovers);
    // A film's picture tells the same of its scene, whether it is written now or by `merge`.
    let Prepared { scene, trace, .. } = &prepared;
    let origin = || Origin { scene_name: arguments.job.scene_name(), ..Origin::of(scene, trace) };
    let origin = arguments.checkpoint.is_wanted().then(origin);
    // From here on SIGINT, SIGTERM and SIGHUP end the render with the picture so far; one that comes seconds later ends
    // the program.
    let stop = listen(|| {})?;
    let seconds_fitting = seconds_to_fit(arguments, &mut prepared, origin.as_ref());
    let Prepared { scene, trace, record, settings, .. } = prepared;
    let audience = arguments.view.then(|| audience(&scene, &trace, &settings, &record)).transpose()?;
    let Begun { mut state, seeds, keeper } = begin(arguments, origin, &trace, record, &settings)?;
    // A glimpse of the whole is a look, and may take longer than a part.
    state.seconds.total += seconds_fitting;
    state.seconds.perception += seconds_fitting;
    let tracer = tracer_of(scene, trace);
    let tev = arguments.tev.open(&arguments.job.scene_name())?.map(|tev| Showing::new(tev, settings.nits_per_unit));
    let watch = Watch::new(stop, Console::new(settings.limits.time), keeper, audience, tev);
    let rendered = adaptive::resume(&tracer, &settings, state, &watch);
    watch.finish();
    // A signal that comes while files are written ended nothing.
    let interrupter = watch.interrupter();
    let rendered = match rendered {
        Ok(rendered) => rendered,
        Err(error) => return Err(failed(&error, watch)),
    };
    let seeds = &seeds.of(&rendered.film).all;
    let report = Report::new(&arguments.job.scene_name(), seeds, &settings, &rendered);
    let background = arguments.job.background();
    let target = PictureTarget { path: &arguments.output, format, background, part_of: PartOf::of(&trace) };
    let finished = Finished { rendered: &rendered, settings: &settings, report: &report };
    let files = FilesWritten::try_all(arguments, target, finished);
    say!("{}", summary(finished, Some(interrupter)));
    files.or_failures(&arguments.output, watch)?;
    let is_unfinished = rendered.stop_reason == StopReason::Interrupted && interrupter == Interrupter::Signal;
    Ok(if is_unfinished { ExitCode::from(CALL_AGAIN) } else { ExitCode::SUCCESS })
}

/// Fits tone to the whole of which the picture is a part, as the film of `origin` was fitted if it is kept;
/// what that took by the clock.
fn seconds_to_fit(arguments: &RenderArguments, prepared: &mut Prepared, origin: Option<&Origin>) -> f64 {
    let started = Instant::now();
    let kept_fit = origin.and_then(|origin| arguments.checkpoint.kept_fit(origin, &prepared.record));
    prepared.fit_to_whole(kept_fit);
    started.elapsed().as_secs_f64()
}

/// Makes a scene ready for rays, and says what no ray will meet.
fn tracer_of(scene: Arc<Scene>, trace: TraceSettings) -> PathTracer {
    let tracer = PathTracer::new(scene, trace);
    let degenerate = tracer.world().degenerate_triangles();
    if degenerate > 0 {
        say!("note: {} without area left out", count(degenerate, "triangle"));
    }
    tracer
}

/// What a render begins with.
struct Begun {
    state: RenderState,
    seeds: SeedsSoFar,
    /// Where there is a film to keep.
    keeper: Option<Keeper>,
}

/// Begins anew, or with the film that is kept: `origin` is its own where one is wanted.
fn begin(
    arguments: &RenderArguments,
    origin: Option<Origin>,
    trace: &TraceSettings,
    record: SettingsRecord,
    settings: &LoopSettings,
) -> anyhow::Result<Begun> {
    let Crop { width, height, .. } = trace.film_area();
    let fresh = RenderState::new(width, height, &settings.limits);
    let (Some(origin), Some(path)) = (origin, arguments.checkpoint.file()) else {
        return Ok(Begun { state: fresh, seeds: SeedsSoFar::of_one(trace.seed), keeper: None });
    };
    let header = Header::begun(origin, trace.seed, record, settings.limits.last_rung());
    let Start { header, state, seeds } = arguments.checkpoint.start(header, fresh, settings)?;
    let keeper = Keeper::new(path, arguments.checkpoint.every(), header, seeds.clone());
    Ok(Begun { state, seeds, keeper: Some(keeper) })
}

/// What became of the files of a render.
struct FilesWritten {
    picture: anyhow::Result<()>,
    maps: anyhow::Result<()>,
    figures: anyhow::Result<()>,
}

impl FilesWritten {
    /// Each is tried, whatever became of the others.
    fn try_all(arguments: &RenderArguments, target: PictureTarget, finished: Finished) -> Self {
        let Finished { rendered, settings, report } = finished;
        let picture = target.write_here_or_elsewhere(finished);
        let maps = all_written(arguments.maps.iter().map(|map| {
            say!("{}", map.write(rendered, settings.limits.visibility_or_threshold())?);
            Ok(())
        }));
        let figures = write_figures(arguments.json.as_deref(), report);
        Self { picture, maps, figures }
    }

    /// All that could not be written, the film among it, in one error; where the picture is there, that is said.
    fn or_failures(self, output: &Path, watch: Watch<'_>) -> anyhow::Result<()> {
        let Self { picture, maps, figures } = self;
        if picture.is_ok() && (maps.is_err() || figures.is_err()) {
            say!("note: the picture is in {}", output.display());
        }
        all_written([picture, maps, figures, watch.report()])
    }
}

/// What ended a render without a picture; its film is kept, or that it is not is said as well.
fn failed(error: &JudgeError, watch: Watch<'_>) -> anyhow::Error {
    match watch.report() {
        Ok(()) => anyhow!("{error}"),
        Err(lost) => anyhow!("{error}; {}", in_a_line(&lost)),
    }
}
