//! What comes of a render: finished, ended where it may go on, or planned and to be traced elsewhere.

use super::audit::Audit;
use super::judge::Judgement;
use super::state::{RenderState, Seconds};
use super::stop::StopReason;
use crate::film::Film;

/// A finished render.
#[derive(Debug)]
pub struct Rendered {
    /// All samples.
    pub film: Film,
    /// The last look at it.
    pub judgement: Judgement,
    /// Why it ended.
    pub stop_reason: StopReason,
    /// Plans traced.
    pub plans: u32,
    /// The last audit, where the picture was large enough for one.
    pub audit: Option<Audit>,
    /// What audits multiplied the variance by.
    pub inflation: f64,
    /// What it took to its end.
    pub seconds: Seconds,
}

impl Rendered {
    /// A state's end and the last look at it.
    pub fn new(state: RenderState, judgement: Judgement, stop_reason: StopReason) -> Self {
        Self {
            film: state.film,
            judgement,
            stop_reason,
            plans: state.plans,
            audit: state.audit,
            inflation: state.inflation,
            seconds: state.seconds,
        }
    }
}

/// A render as its loop left it.
#[derive(Debug)]
pub struct Ended {
    /// What a render to another limit would go on from.
    pub state: RenderState,
    /// The last look and why the render ended; `None` if it was left without a look.
    pub last_look: Option<LastLook>,
}

/// Why a render ended, and what it was like then.
#[derive(Debug)]
pub struct LastLook {
    /// What was seen.
    pub judgement: Judgement,
    /// Why it ended.
    pub stop_reason: StopReason,
}

/// What comes after a state all of whose plans are traced.
#[derive(Debug)]
pub enum Next {
    /// More is planned, and not traced.
    Planned(Box<RenderState>),
    /// Nothing.
    Ended(Box<Ended>),
}
