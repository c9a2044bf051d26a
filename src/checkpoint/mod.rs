//! The film's file: all sums of a render and all that decides what comes next, so that resume and merge need nothing
//! else.
//!
//! [`write_checkpoint`] and [`read_checkpoint`] know the format, [`merge_files`] adds up films of different seeds,
//! [`Header`] says what a film may be continued by. Not a picture format: `fechner merge` makes pictures of it.

mod file;
mod header;
mod merge;
mod tracing;

pub use file::{
    CheckpointError, decode_checkpoint, is_checkpoint, read_checkpoint, read_header, seal, write_checkpoint,
};
pub use header::{Header, Origin, PROGRAM, Seeds, SettingsError, SettingsRecord};
pub use merge::{MergeError, merge_files};
pub use tracing::Tracing;

use crate::adaptive::state::RenderState;

/// What a film's file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// What was rendered, and for whom.
    pub header: Header,
    /// How far it is.
    pub state: RenderState,
}
