//! Tells viewers how a session goes.

use super::Session;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Progress, StopReason, visible_share};
use crate::preview::command::{Phase, Status};
use crate::preview::orbit::Held;
use crate::preview::shared::Shared;
use crate::scene::Scene;
use fechner_perception::display::Display;
use fechner_perception::tone::operator_names;

impl Session<'_> {
    pub(super) fn tell(&self) {
        self.tell_of(&self.state);
    }

    pub(super) fn tell_of(&self, state: &RenderState) {
        publish(&self.status(state), self.shared);
    }

    pub(super) fn status(&self, state: &RenderState) -> Status {
        let operator = self.live.operator.as_ref().unwrap_or(&self.job.record.operator);
        let mut status = Status {
            phase: self.phase,
            reason: self.rest_look.last.as_ref().filter(|_| self.phase == Phase::Stopped).map(|look| {
                match look.stop_reason {
                    StopReason::Visibility if !self.settings.gazes.is_empty() => "nothing more can be seen from there",
                    reason => in_words(reason),
                }
            }),
            width: self.tracer.settings().film_area().width,
            height: self.tracer.settings().film_area().height,
            displays: displays_with(&self.job.record.viewing.display.name),
            exposure: self.live.exposure.or(self.job.record.exposure_stops),
            distance: self.live.distance.unwrap_or(1.0),
            error: self.problems.told(),
            note: self.note.clone(),
            is_foveated: self.gaze.is_some(),
            ..blank_status(&self.job.scene, &self.settings, operator, &self.hand.held)
        };
        count(&mut status, state, self.screen.total_samples, self.progress.as_ref());
        // What was seen at rest is later than what the loop saw.
        if let Some(look) = self.rest_look.last.as_ref().filter(|look| look.judgement.is_known) {
            let aimed_at = self.settings.limits.visibility_or_threshold();
            status.visible_share = Some(visible_share(&look.judgement, aimed_at));
        }
        status
    }
}

/// The status of a render that has not begun.
pub(in crate::preview) fn blank_status(scene: &Scene, settings: &LoopSettings, operator: &str, held: &Held) -> Status {
    Status {
        kind: "status",
        scene: scene.name.clone(),
        phase: Phase::Rendering,
        reason: None,
        width: 0,
        height: 0,
        total_samples: 0,
        mean_samples: 0.0,
        samples_a_second: 0.0,
        seconds: 0.0,
        seconds_left: None,
        pilot_samples: settings.limits.pilot(),
        visible_share: None,
        target: settings.limits.last_rung(),
        rung: None,
        exposure: None,
        operator: operator.to_owned(),
        operators: operator_names(),
        display: settings.viewing.display.name.clone(),
        displays: displays_with(&settings.viewing.display.name),
        distance: 1.0,
        pixels_per_degree: settings.viewing.display.pixels_per_degree,
        camera: held.to_toml(if scene.moves() { scene.shutter_s } else { 0.0 }),
        error: None,
        note: None,
        is_foveated: false,
        is_driven: true,
    }
}

/// Names of displays that can be chosen: the presets, and the one that the preview was opened for.
fn displays_with(own: &str) -> Vec<String> {
    let presets = Display::preset_names();
    let own = Some(own).filter(|own| !presets.contains(own));
    presets.iter().copied().chain(own).map(str::to_owned).collect()
}

/// Fills in what the samples so far say: `total_samples` at the last frame, as counting them takes as long as one.
pub(in crate::preview) fn count(
    status: &mut Status,
    state: &RenderState,
    total_samples: u64,
    progress: Option<&Progress>,
) {
    let pixels = f64::from(status.width) * f64::from(status.height);
    status.total_samples = total_samples;
    status.mean_samples = status.total_samples as f64 / pixels.max(1.0);
    status.seconds = state.seconds.total;
    status.samples_a_second = status.total_samples as f64 / state.seconds.total.max(1e-3);
    let left_after = |samples: f64| Some(samples.max(0.0) / status.samples_a_second.max(1.0));
    if progress.is_none() && state.plans == 0 && status.total_samples > 0 {
        status.seconds_left = left_after(pixels * f64::from(status.pilot_samples) - status.total_samples as f64);
    }
    if let Some(progress) = progress.filter(|_| status.phase != Phase::Stopped) {
        status.visible_share = progress.visible_share;
        status.rung = Some(progress.rung);
        let since = status.total_samples as f64 - progress.mean_samples * progress.pixels;
        status.seconds_left = left_after(progress.remaining_samples - since).filter(|left| left.is_finite());
    }
}

pub(in crate::preview) fn publish(status: &Status, shared: &Shared) {
    if let Ok(text) = serde_json::to_string(status) {
        shared.publish_status(text);
    }
}

/// Why a picture is at rest, for the page.
pub(in crate::preview) fn in_words(reason: StopReason) -> &'static str {
    match reason {
        StopReason::Visibility => "nothing more can be seen at this target",
        StopReason::Time => "the time is up",
        StopReason::Samples => "the samples are spent",
        StopReason::MaxSamples => "what can be seen is in pixels that have the most samples allowed",
        StopReason::Plans => "the plans are done",
        StopReason::Rule => "the rule is satisfied",
        StopReason::Interrupted => "Resume goes on",
        StopReason::Merged => "merged",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::TraceSettings;
    use fechner_perception::display::Viewing;
    use fechner_perception::tone::operator;

    /// Before the first look the pilot's rest is what is left, also for a render that is only watched.
    #[test]
    fn the_first_look_says_when_it_comes() {
        let viewing = Viewing::of(Display::preset("desktop").expect("a preset"));
        let settings = LoopSettings::new(
            &TraceSettings::new(1, 1, 1),
            viewing,
            100.0,
            operator("constant", None).expect("an operator"),
        );
        let mut status =
            blank_status(&Scene::default(), &settings, "constant", &Held::at_home(&Scene::default().camera));
        (status.width, status.height) = (10, 10);
        let mut state = RenderState::new(10, 10, &settings.limits);
        state.seconds.total = 2.0;
        count(&mut status, &state, 400, None);
        assert_eq!(status.seconds_left, Some(6.0), "1200 of 1600 samples at 200 a second");
    }
}
