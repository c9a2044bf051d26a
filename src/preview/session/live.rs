//! What viewers change while a picture is made, and the settings that come of it. To act on them is left to `obeying`.

use crate::adaptive::settings::{Limits, LoopSettings};
use crate::preview::Job;
use crate::scene::MAX_EXPOSURE_STOPS;
use fechner_perception::display::{Display, Observer, Viewing};
use fechner_perception::eccentricity::Gaze;
use fechner_perception::tone::SceneLight;

/// What viewers changed, in place of what the job says.
#[derive(Clone, Default)]
pub(super) struct Live {
    pub(super) exposure: Option<f64>,
    pub(super) operator: Option<String>,
    /// A preset's name, or the job's own display's.
    pub(super) display: Option<String>,
    /// Distance of the eyes, in distances that the display is made for.
    pub(super) distance: Option<f64>,
    pub(super) visibility: Option<f64>,
    /// Where somebody looks.
    pub(super) gaze: Option<Gaze>,
}

/// What a change of settings asks for.
#[derive(Clone, Copy)]
pub(super) enum Changed {
    /// What the eye is shown, and with it every threshold.
    Seen,
    /// When to stop.
    Target,
    /// Where somebody looks: the picture is shown as before.
    Gaze,
}

impl Changed {
    /// What two changes ask for together: another target is one also for other eyes.
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Target, _) | (_, Self::Target) => Self::Target,
            (Self::Seen, _) | (_, Self::Seen) => Self::Seen,
            (Self::Gaze, Self::Gaze) => Self::Gaze,
        }
    }
}

/// The loop's settings for a job that viewers changed, whose picture is shown as `whole` is of which it is a part.
///
/// # Errors
/// In words for the user, about the change that cannot be.
pub(super) fn settings_of(job: &Job, live: &Live, whole: Option<&SceneLight>) -> Result<LoopSettings, String> {
    let mut record = job.record.clone();
    record.exposure_stops = live.exposure.or(record.exposure_stops);
    record.operator = live.operator.clone().unwrap_or(record.operator);
    // The job's own display may have no preset's name, or more than the preset of its name.
    if let Some(name) = live.display.as_ref().filter(|name| **name != record.viewing.display.name) {
        let display = Display::named(name).map_err(|error| error.to_string())?;
        let Observer { sensitivity, glare, .. } = record.viewing.observer;
        record.viewing = Viewing::of(display);
        let own = record.viewing.observer.csf_area_deg2;
        let csf_area_deg2 = job.csf_area_deg2.unwrap_or(own);
        record.viewing.observer = Observer { sensitivity, glare, csf_area_deg2 };
    }
    // So many times as far, a pixel looks so many times as small.
    record.viewing.display.pixels_per_degree *= live.distance.unwrap_or(1.0);
    record.viewing.check().map_err(|error| error.to_string())?;
    let visibility = live.visibility.unwrap_or(job.limits.last_rung());
    if visibility.is_nan() || visibility < 0.0 {
        return Err("visibility must be 0 or above".to_owned());
    }
    let known_stops = -MAX_EXPOSURE_STOPS..=MAX_EXPOSURE_STOPS;
    if record.exposure_stops.is_some_and(|stops| !known_stops.contains(&stops)) {
        return Err(format!("exposure must be from -{MAX_EXPOSURE_STOPS} to {MAX_EXPOSURE_STOPS} stops"));
    }
    let limits = Limits { visibility: Limits::visibility_of_last_rung(visibility), ..job.limits };
    let mut settings = record.loop_settings(limits, &job.trace).map_err(|error| error.to_string())?;
    if let Some(whole) = whole {
        settings.fit_to(whole);
    }
    Ok(LoopSettings { importance: job.importance.clone(), gazes: live.gaze.into_iter().collect(), ..settings })
}
