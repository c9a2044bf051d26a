//! `farm plan`: a scene in, a folder with a manifest and the first round's units out.

use super::job::JobOptions;
use crate::cli::numbers::whole;
use crate::cli::words::{count, samples_in_words};
use anyhow::{Context, Result, bail};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use fechner::adaptive::settings::Limits;
use fechner::adaptive::state::RenderState;
use fechner::farm::round::hand_out;
use fechner::farm::{Farm, FrameEntry, Manifest, Work};
use fechner::output::PictureFormat;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `farm plan`.
#[derive(Debug, Args)]
pub(super) struct PlanArguments {
    /// Scene, as for render and animate.
    scene: String,
    /// Frames of a scene that moves, first..last, both included; without them a still.
    #[arg(long, value_name = "A..B", allow_hyphen_values = true)]
    frames: Option<String>,
    /// Most units that a round of a frame is cut into: about as many processes as should work on one frame.
    #[arg(long, value_name = "P", default_value_t = 16, value_parser = whole(1..=100_000), allow_negative_numbers = true)]
    passes: u32,
    /// Fewest samples of a unit. A unit should last ten seconds or more; a round with fewer samples is traced by the
    /// merge that planned it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 4_000_000)]
    unit_samples: u64,
    /// Folder to make.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// What finished frames become: exr with all layers, or png as the display shows it.
    #[arg(long, default_value = "exr", value_parser = picture_formats())]
    format: PictureFormat,
    /// Keep the films of finished frames, for merge and for render --resume, which goes on with a frame of a shot as
    /// with a still.
    #[arg(long)]
    keep_films: bool,
    /// After --: options of render or, with --frames, of animate, such as --size 480x270 --visibility 2.
    #[arg(last = true, value_name = "OPTIONS", allow_hyphen_values = true)]
    options: Vec<String>,
}

/// By their files' endings, the usual one first.
fn picture_formats() -> impl TypedValueParser<Value = PictureFormat> {
    let endings = [PictureFormat::Exr, PictureFormat::Png].map(PictureFormat::ending);
    PossibleValuesParser::new(endings).try_map(|ending| PictureFormat::of_ending(&ending).ok_or("no picture format"))
}

/// What a plan makes before its manifest: removed again where it fails, less what was there before.
struct Unfinished {
    first_made: Option<PathBuf>,
}

impl Unfinished {
    fn make(folder: &Path) -> Result<Self> {
        let first_made =
            folder.ancestors().take_while(|folder| !folder.exists() && !folder.as_os_str().is_empty()).last();
        let unfinished = Self { first_made: first_made.map(Path::to_owned) };
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        Ok(unfinished)
    }

    fn keep(mut self) {
        self.first_made = None;
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if let Some(folder) = &self.first_made {
            std::fs::remove_dir_all(folder).ok();
        }
    }
}

/// Refuses a folder in which a farm is, or was.
fn check_is_free(folder: &Path) -> Result<()> {
    if Farm::manifest_file(folder).exists() {
        bail!("{} is a farm already: go on with it, name another folder, or remove it", folder.display());
    }
    if let Some(remains) = Farm::remains(folder) {
        bail!(
            "{} is left of a farm whose manifest is gone, and would pass for this one's work: remove it, or name another folder",
            remains.display()
        );
    }
    Ok(())
}

/// Where a farm is planned, as its manifest can hold it.
fn own_directory() -> Result<PathBuf> {
    let directory = std::env::current_dir().context("where the farm is planned")?;
    if directory.to_str().is_none() {
        bail!(
            "{}: a farm is planned in a folder whose name is Unicode, since its manifest holds it",
            directory.display()
        );
    }
    Ok(directory)
}

impl PlanArguments {
    /// What is rendered, and the words of `render` or `animate` that ask for it.
    fn work(&self) -> (Work, Vec<String>) {
        let scene = [self.scene.clone()].into_iter();
        let options = self.options.iter().cloned();
        match &self.frames {
            None => (Work::Render, scene.chain(options).collect()),
            Some(frames) => {
                (Work::Animate, scene.chain(["--frames".to_owned(), frames.clone()]).chain(options).collect())
            }
        }
    }
}

/// Plans; a folder that has a manifest is left alone.
pub(super) fn run(arguments: &PlanArguments) -> Result<ExitCode> {
    let folder = &arguments.output;
    check_is_free(folder)?;
    let directory = own_directory()?;
    let (work, words) = arguments.work();
    let format = arguments.format;
    JobOptions::parse(work, &words, folder, format).context("farm plan, after --")?;
    JobOptions::check_are_for_all(work, &words)?;
    let unfinished = Unfinished::make(&folder.join("pictures"))?;
    let folder = super::absolute(folder)?;
    let options = JobOptions::parse(work, &words, &folder.join("pictures"), format)?;
    let job = options.job()?;
    job.check_video()?;
    job.check_whole_video(options.frames().len())?;
    let (mut entries, mut limits) = (Vec::new(), Vec::new());
    for number in options.frames() {
        let frame = job.frame(number)?;
        entries.push(frame.entry(number));
        limits.push(frame.settings().limits);
    }
    if entries.is_empty() {
        bail!("there are no frames");
    }
    let farm = Farm::create(
        &folder,
        Manifest {
            picture_format: format,
            passes: arguments.passes,
            unit_samples: arguments.unit_samples,
            keeps_films: arguments.keep_films,
            ..Manifest::new(work, directory, words, entries)
        },
    )?;
    // From here on it is a farm: whatever works on it goes on from what is there.
    unfinished.keep();
    let round = FirstRounds::hand_out(&farm, &limits)?;
    say!("{}: {}", arguments.output.display(), round.in_words(farm.manifest()));
    Ok(ExitCode::SUCCESS)
}

/// What all frames begin with.
struct FirstRounds {
    units: usize,
    /// Samples of these.
    samples: u64,
    /// Most samples of a frame's round, whether units have them or not.
    most_samples_a_frame: u64,
}

impl FirstRounds {
    /// By each frame's own limits: of a budget frames have different shares.
    fn hand_out(farm: &Farm, limits: &[Limits]) -> Result<Self> {
        let mut rounds = Self { units: 0, samples: 0, most_samples_a_frame: 0 };
        for (frame_index, (FrameEntry { origin, .. }, limits)) in farm.manifest().frames.iter().zip(limits).enumerate()
        {
            let state = RenderState::new(origin.width, origin.height, limits);
            let record = hand_out(farm, frame_index, &state)?;
            rounds.units += record.units.len();
            rounds.samples += record.samples;
            rounds.most_samples_a_frame = rounds.most_samples_a_frame.max(state.untraced_samples());
        }
        Ok(rounds)
    }

    fn in_words(&self, manifest: &Manifest) -> String {
        let frames = count(manifest.frames.len(), "frame");
        if self.units > 0 {
            let (units, samples) = (count(self.units, "unit"), samples_in_words(self.samples));
            return format!("{frames}, {units} in the first round, {samples}");
        }
        format!(
            "{frames}, nothing to share out yet: a frame's first round has {}, fewer than --unit-samples {}, so farm merge and \
             farm work trace it whole; to share it out, plan with --unit-samples {} or less",
            samples_in_words(self.most_samples_a_frame),
            manifest.unit_samples,
            self.most_samples_a_frame / 2
        )
    }
}
