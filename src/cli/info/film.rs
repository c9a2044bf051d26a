//! What a film's file holds, in words.

use super::super::console::duration_in_words;
use super::super::report::sampling_name;
use super::super::words::{count, rounded};
use fechner::adaptive::settings::Limits;
use fechner::checkpoint::Checkpoint;
use std::fmt::Write as _;

/// The text that `info` prints of a film.
pub(super) fn describe(checkpoint: &Checkpoint) -> String {
    let Checkpoint { header, state } = checkpoint;
    let (origin, settings, film) = (&header.origin, &header.settings, &state.film);
    let pixels = film.pixel_count();
    let counts = || (0..pixels).map(|pixel| film.samples(pixel));
    let (least, most) = (counts().min().unwrap_or(0), counts().max().unwrap_or(0));
    let mut text = format!("film of {}, {}×{} pixels\n\n", origin.program, film.width(), film.height());
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:11}  {value}");
    };
    row("scene", format!("\"{}\", content {}", origin.scene_name, origin.scene));
    row("traced by", origin.tracing.in_words());
    row(
        "seeds",
        match header.seeds.current {
            Some(seed) => format!("{}; goes on with --seed {seed}", header.seeds.in_words()),
            None => format!("{}; merged, goes on with another --seed", header.seeds.in_words()),
        },
    );
    row("samples", {
        let mean = film.total_samples() as f64 / pixels as f64;
        format!("{}: {mean:.1} a pixel, {least} to {most}; {} not finite", film.total_samples(), film.nonfinite_samples)
    });
    row(
        "planned",
        format!("{} after {}", count(state.untraced_samples() as usize, "sample"), count(state.plans as usize, "plan")),
    );
    row("time", duration_in_words(state.seconds.total));
    row("sampling", sampling_name(settings.sampling).to_owned());
    row("visibility", {
        let reached = state.finished_rung.map_or_else(|| "none".to_owned(), rounded);
        let aimed_at = Limits::visibility_of_last_rung(header.visibility).map_or_else(|| "none".to_owned(), rounded);
        format!("{aimed_at} aimed at, {reached} reached; variance × {}", rounded(state.inflation))
    });
    row("model", settings.model.clone());
    row("display", {
        let display = &settings.viewing.display;
        let [ppd, white, black] = [display.pixels_per_degree, display.white_cd_m2, display.black_cd_m2].map(rounded);
        format!("{}: {ppd} pixels a degree, white {white} and black {black} cd/m²", display.name)
    });
    if let Some(timing) = settings.frames {
        row("in motion", format!("noise is new {} times a second", rounded(timing.frames_per_second)));
    }
    if !settings.gazes.is_empty() {
        row("gaze", count(settings.gazes.len(), "place"));
    }
    row("operator", {
        let stops = settings.exposure_stops.map_or_else(String::new, |stops| format!(", {stops:+.2} stops"));
        format!("{}{stops}; RGB (1, 1, 1) is {} cd/m²", settings.operator, rounded(settings.nits_per_unit))
    });
    if let Some(tone) = &state.tone {
        row("fit", tone.clone().restore().describe());
    }
    if let Some(denoiser) = settings.denoiser {
        row("denoiser", denoiser.name().to_owned());
    }
    if let Some(importance) = settings.importance {
        row("importance", format!("map of content {importance}"));
    }
    if let Some(audit) = state.audit {
        let found = if audit.had_nothing_to_find() {
            "nothing predicted".to_owned()
        } else {
            format!("ratio {:.2} ± {:.2}", audit.ratio, audit.standard_error)
        };
        row("audit", format!("{}, {found}, the last of {}", count(audit.tiles, "tile"), state.audits));
    }
    text
}
