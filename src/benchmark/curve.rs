//! How a picture comes to be good: metrics that no arm optimises after each look of a render.

use super::arm::Arm;
use super::truth::Truth;
use super::{MAIN_COVERAGE, Subject};
use crate::adaptive::judge::Judgement;
use crate::adaptive::settings::LoopSettings;
use crate::adaptive::state::RenderState;
use crate::adaptive::{Monitor, Progress, render};
use crate::poison::Unpoisoned as _;
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A render's picture after a look.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Mean samples a pixel so far.
    pub samples: f64,
    /// Seconds so far, less those of measuring.
    pub seconds: f64,
    /// True v that 99 % of the picture is below.
    pub visibility: f64,
    /// Mean LDR-FLIP.
    pub flip_mean: f64,
    /// ColorVideoVDP.
    pub jod: f64,
    /// Relative mean squared error of the displayed picture.
    pub relmse: f64,
}

/// An arm's points on a scene, first seed.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// Scene.
    pub scene: String,
    /// Arm.
    pub arm: Arm,
    /// Points in the order of the render.
    pub points: Vec<CurvePoint>,
}

/// Measures after each look.
struct Course<'a> {
    subject: &'a Subject,
    truth: &'a Truth,
    found: Mutex<Found>,
}

#[derive(Default)]
struct Found {
    points: Vec<CurvePoint>,
    measuring: Duration,
    failure: Option<anyhow::Error>,
}

impl Course<'_> {
    fn point(&self, state: &RenderState, measuring: Duration) -> Result<CurvePoint> {
        let estimate = state.film.estimate(self.subject.scene.nits_per_unit);
        let picture = self.truth.displayed(&estimate.rgb_cd_m2);
        let metrics = self.truth.measure(&picture)?;
        Ok(CurvePoint {
            samples: state.film.total_samples() as f64 / self.subject.pixels(),
            seconds: state.seconds.total - measuring.as_secs_f64(),
            visibility: self.truth.squared_visibility(&picture).quantile(MAIN_COVERAGE).sqrt(),
            flip_mean: metrics.flip_mean,
            jod: metrics.jod,
            relmse: metrics.relmse,
        })
    }
}

impl Monitor for Course<'_> {
    fn looked(&self, _: &Progress) {}

    fn judged(&self, state: &RenderState, _: &Judgement) {
        let begun = Instant::now();
        let mut found = self.found.lock().unpoisoned();
        // Steps that nobody could see in a plot are left out.
        let samples = state.film.total_samples() as f64 / self.subject.pixels();
        let is_new = found.points.last().is_none_or(|last| 1.01 * last.samples < samples);
        if is_new {
            match self.point(state, found.measuring) {
                Ok(point) => found.points.push(point),
                Err(error) => found.failure = Some(error),
            }
        }
        found.measuring += begun.elapsed();
    }

    fn samples_done(&self, _: u64) {}
}

/// Renders once more, measuring on the way.
pub(super) fn course(subject: &Subject, truth: &Truth, settings: &LoopSettings, seed: u64) -> Result<Vec<CurvePoint>> {
    let course = Course { subject, truth, found: Mutex::default() };
    render(&subject.tracer(seed), settings, &course)?;
    let found = course.found.into_inner().unpoisoned();
    found.failure.map_or(Ok(found.points), Err)
}
