//! Tells what a film's file holds, in words.

use super::super::console::duration_in_words;
use super::super::report::sampling_name;
use super::super::words::{count, rounded};
use fechner::adaptive::settings::Limits;
use fechner::adaptive::state::RenderState;
use fechner::checkpoint::{Checkpoint, Header, SettingsRecord};
use std::fmt::{Display, Write as _};

/// The text that `info` prints of a film.
pub(super) fn describe(checkpoint: &Checkpoint) -> String {
    let Checkpoint { header, state } = checkpoint;
    let (program, film) = (&header.origin.program, &state.film);
    let mut rows = Rows(format!("film of {program}, {}×{} pixels\n\n", film.width(), film.height()));
    rows.add_origin(header);
    rows.add_progress(state);
    rows.add_aims(header, state);
    rows.add_viewing(&header.settings, state);
    rows.0
}

/// Text of which each line has a name.
struct Rows(String);

impl Rows {
    fn add(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.0, "  {name:11}  {value}");
    }

    /// What was traced, how, and with which random numbers.
    fn add_origin(&mut self, Header { origin, seeds, .. }: &Header) {
        self.add("scene", format_args!("\"{}\", content {}", origin.scene_name, origin.scene));
        self.add("traced by", origin.tracing.in_words());
        match seeds.current {
            Some(seed) => self.add("seeds", format_args!("{}; goes on with --seed {seed}", seeds.in_words())),
            None => self.add("seeds", format_args!("{}; merged, goes on with another --seed", seeds.in_words())),
        }
    }

    /// How far it came.
    fn add_progress(&mut self, state: &RenderState) {
        let film = &state.film;
        let pixels = film.pixel_count();
        let counts = || (0..pixels).map(|pixel| film.samples(pixel));
        let (least, most) = (counts().min().unwrap_or(0), counts().max().unwrap_or(0));
        let (total, not_finite) = (film.total_samples(), film.nonfinite_samples);
        let mean = total as f64 / pixels as f64;
        self.add("samples", format_args!("{total}: {mean:.1} a pixel, {least} to {most}; {not_finite} not finite"));
        let (planned, plans) = (state.untraced_samples() as usize, state.plans as usize);
        self.add("planned", format_args!("{} after {}", count(planned, "sample"), count(plans, "plan")));
        self.add("time", duration_in_words(state.seconds.total));
    }

    /// What samples are spread by, and how near that is.
    fn add_aims(&mut self, header: &Header, state: &RenderState) {
        self.add("sampling", sampling_name(header.settings.sampling));
        let or_none = |visibility: Option<f64>| visibility.map_or_else(|| "none".to_owned(), rounded);
        let aimed_at = or_none(Limits::visibility_of_last_rung(header.visibility));
        let (reached, inflation) = (or_none(state.finished_rung), rounded(state.inflation));
        self.add("visibility", format_args!("{aimed_at} aimed at, {reached} reached; variance × {inflation}"));
        self.add("model", &header.settings.model);
    }

    /// Who looks at it, how, and what was found to be seen.
    fn add_viewing(&mut self, settings: &SettingsRecord, state: &RenderState) {
        let display = &settings.viewing.display;
        let [ppd, white, black] = [display.pixels_per_degree, display.white_cd_m2, display.black_cd_m2].map(rounded);
        self.add(
            "display",
            format_args!("{}: {ppd} pixels a degree, white {white} and black {black} cd/m²", display.name),
        );
        if let Some(timing) = settings.frames {
            self.add("in motion", format_args!("noise is new {} times a second", rounded(timing.frames_per_second)));
        }
        if !settings.gazes.is_empty() {
            self.add("gaze", count(settings.gazes.len(), "place"));
        }
        let stops = settings.exposure_stops.map_or_else(String::new, |stops| format!(", {stops:+.2} stops"));
        let nits = rounded(settings.nits_per_unit);
        self.add("operator", format_args!("{}{stops}; RGB (1, 1, 1) is {nits} cd/m²", settings.operator));
        if let Some(tone) = &state.tone {
            self.add("fit", tone.clone().restore().describe());
        }
        if let Some(denoiser) = settings.denoiser {
            self.add("denoiser", denoiser.name());
        }
        if let Some(importance) = settings.importance {
            self.add("importance", format_args!("map of content {importance}"));
        }
        if let Some(audit) = state.audit {
            let found = if audit.had_nothing_to_find() {
                "nothing predicted".to_owned()
            } else {
                format!("ratio {:.2} ± {:.2}", audit.ratio, audit.standard_error)
            };
            self.add("audit", format_args!("{}, {found}, the last of {}", count(audit.tiles, "tile"), state.audits));
        }
    }
}
