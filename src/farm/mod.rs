//! Renders spread over processes and machines that share nothing but a folder.
//!
//! The contract is files. A [`Manifest`] says what is rendered. A round of a frame is cut into units: contiguous
//! ranges of the blocks that the loop in [`crate::adaptive`] planned, written as one [`unit::Order`] each.
//! [`unit::render_unit`] executes an order and decides nothing: its result is the sums of its blocks, a pure
//! function of scene and order. [`frame::merge_frame`] enters the sums into the film in the plan's order, looks
//! once, and hands out the next round: so the film is, bit for bit, that of one process, whoever rendered the units,
//! how often and in which order.
//!
//! ```text
//! manifest.json
//! frame-0007/film                        all rounds merged so far, and the plan of the open one
//! frame-0007/round-003/round.json        its units, written after their orders; numbered by the plans traced before
//! frame-0007/round-003/unit-001234.*     order, partial (checkpoint), sums (result), lock
//! frame-0007/result.json                 the frame is done
//! pictures/
//! concluded                              what needs all frames is made
//! ```
//!
//! [`folder`] knows where each of them is.
//!
//! Every file is complete or not there; locks spare work and protect nothing. Schedulers are outside: they run
//! commands. Not for one machine alone: there [`crate::adaptive::render`] does the same without files.

pub mod folder;
pub mod frame;
mod manifest;
pub mod round;
pub mod unit;

pub use folder::{Farm, UnitPlace};
pub use manifest::{FrameEntry, Manifest, ManifestError, Work};
