//! `fechner merge`: films of different seeds in, one film or its picture out.

use super::claim::Claim;
use super::finished::{Finished, PictureTarget, all_written, write_figures};
use super::numbers::parse_positive;
use super::report::{Report, summary};
use super::targets::{check_distinct, check_kept};
use clap::Args;
use fechner::adaptive::judge::judge;
use fechner::adaptive::settings::{Limits, THRESHOLD};
use fechner::adaptive::{Rendered, StopReason, is_reached};
use fechner::checkpoint::{merge_files, write_checkpoint};
use fechner::output::rendered::Background;
use fechner::output::{self, PictureFormat};
use std::path::{Path, PathBuf};

/// Arguments of `merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Films that render --checkpoint kept, of one scene and size and of different seeds; their order does not matter.
    #[arg(required = true, value_name = "FILM")]
    films: Vec<PathBuf>,
    /// What to write: .film for the sum, to be merged or resumed by another seed; .png or .exr for its picture.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Visibility that may remain, in place of the smallest that the films aimed at.
    #[arg(long, value_name = "V", value_parser = parse_positive, allow_negative_numbers = true)]
    visibility: Option<f64>,
    /// Write figures of the merged render here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Merges, looks again, writes and says what can be seen.
pub(super) fn run(arguments: &MergeArguments) -> anyhow::Result<()> {
    let (format, _claim) = if is_film(&arguments.output) {
        output::check_writable(&arguments.output)?;
        (None, Some(Claim::on(&arguments.output)?))
    } else {
        (Some(output::check_target(&arguments.output)?), None)
    };
    // A sum may take the place of one of its films; its picture and figures may not.
    let picture = format.is_some().then_some(arguments.output.as_path());
    let films: Vec<_> = arguments.films.iter().map(|film| ("a film", Some(film.as_path()))).collect();
    check_kept(&films, &[("-o", picture), ("--json", arguments.json.as_deref())])?;
    // Of a sum, too, which may take the place of a film.
    check_distinct(&[("-o", Some(&arguments.output)), ("--json", arguments.json.as_deref())])?;
    if let Some(json) = &arguments.json {
        output::check_writable(json)?;
    }
    let mut merged = merge_files(&arguments.films)?;
    merged.header.visibility = arguments.visibility.unwrap_or(merged.header.visibility);
    let visibility = merged.header.visibility;
    if let Some(map) = merged.header.settings.importance {
        say!(
            "note: sampled under an importance map (content {map}), which films do not keep: what can be seen is told without it"
        );
    }
    if format == Some(PictureFormat::Exr) && merged.header.settings.frames.is_some() {
        say!("note: films keep no motion: the picture of this frame is without the velocities that it has in its shot");
    }
    let tracing = *merged.header.origin.tracing.settings();
    let background = if tracing.transparent { Background::Transparent } else { Background::Shown };
    let limits = Limits { visibility: Limits::visibility_of_last_rung(visibility), ..Limits::of_visibility(THRESHOLD) };
    let settings = merged.header.settings.loop_settings(limits, &tracing)?;
    if format.is_none() {
        write_checkpoint(&arguments.output, &merged.header, &merged.state)?;
    }
    let judgement = judge(&merged.state.film, &settings, merged.state.inflation)?;
    let reason = if is_reached(&judgement, visibility) { StopReason::Visibility } else { StopReason::Merged };
    let rendered = Rendered::new(merged.state, judgement, reason);
    let report = Report::new(&merged.header.origin.scene_name, &merged.header.seeds.all, &settings, &rendered);
    let finished = Finished { rendered: &rendered, settings: &settings, report: &report };
    let picture = format.map_or(Ok(()), |format| {
        let part_of = merged.header.origin.part_of();
        PictureTarget { path: &arguments.output, format, background, part_of }.write_here_or_elsewhere(finished)
    });
    let figures = write_figures(arguments.json.as_deref(), &report);
    say!("Films of the seeds {}:", merged.header.seeds.in_words());
    say!("{}", summary(finished, None));
    all_written([picture, figures])
}

fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("film"))
}
